//! Kinds of element by their numbers in the format.

use super::Fault;

/// The kinds that are read, with their order.
#[derive(Clone, Copy)]
pub enum ElementKind {
    Point,
    Line(usize),
    Triangle(usize),
}

impl ElementKind {
    /// # Errors
    /// Elements that no mesh of triangles up to order 3 has, by name.
    pub fn of(number: i32) -> Result<Self, Fault> {
        let refuse = |what: &str, hint: &str| Err(Fault::new(format!("{what} (element type {number})"), hint));
        match number {
            15 => Ok(Self::Point),
            1 => Ok(Self::Line(1)),
            8 => Ok(Self::Line(2)),
            26 => Ok(Self::Line(3)),
            2 => Ok(Self::Triangle(1)),
            9 => Ok(Self::Triangle(2)),
            21 => Ok(Self::Triangle(3)),
            3 | 10 | 16 | 36..=41 | 47..=51 => refuse(
                "the mesh has quadrangles",
                "this program computes on triangles: leave out `Recombine Surface` and transfinite recombination \
                 (`Mesh.RecombineAll = 0;`), and mesh again with `gmsh -2`",
            ),
            4..=7 | 11..=14 | 17..=19 | 29..=33 | 71..=93 => refuse(
                "the mesh is three-dimensional: it has volume elements",
                "mesh a surface in the plane z = const in two dimensions: `gmsh -2`",
            ),
            20 | 22..=25 | 42..=46 | 52..=61 => refuse(
                "the mesh has triangles of order above 3, or incomplete ones",
                "set `Mesh.ElementOrder` to 1, 2 or 3 and `Mesh.SecondOrderIncomplete = 0`, and mesh again",
            ),
            other => {
                let hint = "use complete triangles and lines of order 1, 2 or 3 (`Mesh.ElementOrder`)";
                Err(Fault::new(format!("the mesh has elements of type {other}"), hint))
            }
        }
    }

    pub fn nodes(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line(degree) => degree + 1,
            Self::Triangle(degree) => (degree + 1) * (degree + 2) / 2,
        }
    }
}
