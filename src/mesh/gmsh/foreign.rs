//! Mesh files of other programs: what they are, and how they become files of Gmsh.

use std::path::Path;

use super::Fault;

const MESHIO: &str = "convert it: `meshio convert --output-format gmsh22 FILE file.msh` (pip install meshio), or \
 save it as MSH in the program that made it";
const GMSH_READS: &str = "convert it: `gmsh FILE -save -format msh41 -o file.msh`, or with `meshio convert`";
const MESH_IT: &str = "mesh it: `gmsh FILE -2 -o file.msh`";

/// Extension, what such a file is, and what to do.
const KINDS: [(&str, &str, &str); 26] = [
    ("geo", "a geometry of Gmsh, not yet a mesh", MESH_IT),
    ("geo_unrolled", "a geometry of Gmsh, not yet a mesh", MESH_IT),
    ("step", "a geometry (STEP), not yet a mesh", MESH_IT),
    ("stp", "a geometry (STEP), not yet a mesh", MESH_IT),
    ("iges", "a geometry (IGES), not yet a mesh", MESH_IT),
    ("igs", "a geometry (IGES), not yet a mesh", MESH_IT),
    ("brep", "a geometry (OpenCASCADE), not yet a mesh", MESH_IT),
    ("xao", "a geometry (SALOME), not yet a mesh", MESH_IT),
    ("su2", "a mesh of SU2", GMSH_READS),
    ("vtk", "a mesh of VTK (legacy)", GMSH_READS),
    ("vtu", "an unstructured grid of VTK", MESHIO),
    ("vtp", "polydata of VTK", MESHIO),
    ("pvd", "a time series of ParaView", MESHIO),
    ("xdmf", "a mesh in XDMF", MESHIO),
    ("h5", "a mesh in HDF5", MESHIO),
    ("inp", "a mesh of Abaqus", GMSH_READS),
    ("unv", "a mesh of I-deas (universal file)", GMSH_READS),
    ("med", "a mesh of SALOME (MED)", GMSH_READS),
    ("mesh", "a mesh of Medit", GMSH_READS),
    ("meshb", "a mesh of Medit, binary", GMSH_READS),
    ("bdf", "a mesh of Nastran", GMSH_READS),
    ("nas", "a mesh of Nastran", GMSH_READS),
    ("cgns", "a mesh in CGNS", GMSH_READS),
    (
        "stl",
        "a surface of facets without boundary curves (STL)",
        "draw its outline in Gmsh and mesh that: `gmsh file.geo -2 -o file.msh`",
    ),
    ("off", "a surface of facets (OFF)", MESHIO),
    ("ply", "a surface of facets (PLY)", GMSH_READS),
];

/// The extension in lower case.
fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

/// Whether a file is a mesh or a geometry by its name, and no scene.
pub fn is_mesh_file(path: &Path) -> bool {
    extension(path).is_some_and(|e| e == "msh" || KINDS.iter().any(|(name, ..)| *name == e))
}

/// What a file is by its name, if it is not one of Gmsh's meshes.
pub fn by_name(path: &Path) -> Result<(), Fault> {
    let extension = extension(path).unwrap_or_default();
    if matches!(extension.as_str(), "gz" | "zip" | "bz2" | "xz" | "zst") {
        let what = format!("the file is compressed (.{extension})");
        return Err(Fault::new(what, "unpack it first: meshes are read from plain .msh files"));
    }
    let Some((_, what, hint)) = KINDS.iter().find(|(name, ..)| *name == extension) else { return Ok(()) };
    let hint = hint.replace("FILE", &path.display().to_string());
    Err(Fault::new(format!("this is {what}; meshes are read from files of Gmsh (.msh)"), hint))
}

/// What a file is by its first bytes: other programs call their meshes .msh, too.
pub fn by_content(bytes: &[u8]) -> Result<(), Fault> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).into_owned();
    let head = head.trim_start_matches('\u{feff}').trim_start();
    let first: Vec<&str> = head.lines().next().unwrap_or("").split_whitespace().collect();
    let counts = first.len() == 3 && first.iter().all(|word| word.parse::<u64>().is_ok());
    let what = match head {
        "" => return Err(Fault::new("the file is empty", "save the mesh from Gmsh again")),
        _ if head.starts_with('(') => "a mesh of Fluent",
        _ if head.starts_with("# vtk DataFile") => "a mesh of VTK (legacy)",
        _ if head.starts_with("<?xml") || head.starts_with("<VTKFile") => "an XML file, such as those of VTK",
        _ if head.starts_with("MeshVersionFormatted") => "a mesh of Medit",
        _ if head.starts_with("NDIME") => "a mesh of SU2",
        _ if head.starts_with("*HEADING") || head.starts_with("*Heading") || head.starts_with("*NODE") => {
            "a mesh of Abaqus"
        }
        _ if head.starts_with("solid ") => "a surface of facets (STL)",
        _ if head.starts_with("\u{fffd}HDF") => "a file in HDF5, such as those of MED, CGNS and XDMF",
        _ if bytes.starts_with(&[0x1f, 0x8b]) => "a compressed file (gzip)",
        _ if counts => "a mesh of FreeFEM (its first line has three counts)",
        _ => return Ok(()),
    };
    let hint =
        "convert it: open it in Gmsh and save it as .msh, or `meshio convert --output-format gmsh22 FILE file.msh`";
    Err(Fault::new(format!("this is {what}, not a mesh of Gmsh"), hint))
}
