//! The content of a file, not yet a mesh.

use std::collections::HashMap;

use super::Fault;
use super::scan::Scanner;

/// An element of the two kinds that are kept.
#[derive(Debug)]
pub struct Element {
    pub number: usize,
    /// The curve or surface of the geometry it lies on.
    pub entity: i32,
    pub degree: usize,
    /// Node numbers, in the order of the file: corners, inner nodes of the edges, inner nodes.
    pub nodes: Vec<usize>,
}

/// What a mesh is made of.
#[derive(Debug, Default)]
pub struct Content {
    /// Names of the physical curves.
    pub names: HashMap<i32, String>,
    /// Physical groups of the curves of the geometry.
    pub groups: HashMap<i32, Vec<i32>>,
    /// Node numbers and positions.
    pub nodes: Vec<(usize, [f64; 3])>,
    pub lines: Vec<Element>,
    pub triangles: Vec<Element>,
}

/// Reads all sections that matter.
pub fn parse(bytes: &[u8]) -> Result<Content, Fault> {
    let mut scanner = Scanner::new(bytes);
    let mut content = Content::default();
    let mut seen = Vec::new();
    while let Some(section) = scanner.enter()? {
        match section.as_str() {
            "MeshFormat" => format(&mut scanner)?,
            "Comments" => scanner.skip()?,
            _ if !seen.iter().any(|s| s == "MeshFormat") => {
                return Err(scanner.fault("comes before $MeshFormat"));
            }
            "PhysicalNames" => names(&mut scanner, &mut content)?,
            "Entities" => entities(&mut scanner, &mut content)?,
            "Nodes" => nodes(&mut scanner, &mut content)?,
            "Elements" => elements(&mut scanner, &mut content)?,
            "PartitionedEntities" => {
                return Err(Fault::new("the mesh is partitioned", "export it from Gmsh without partitions"));
            }
            _ => scanner.skip()?,
        }
        seen.push(section);
    }
    match ["MeshFormat", "Nodes", "Elements"].into_iter().find(|s| !seen.iter().any(|have| have == s)) {
        None => Ok(content),
        Some(section) => {
            let hint = "give a mesh file of Gmsh (.msh, version 4.1) that has been meshed and saved completely";
            Err(Fault::new(format!("there is no section ${section}"), hint))
        }
    }
}

fn format(scanner: &mut Scanner) -> Result<(), Fault> {
    let version: f64 = scanner.text()?;
    if version != 4.1 {
        let hint = "export version 4.1: `gmsh old.msh -save -format msh41 -o new.msh`, or in a .geo file `Mesh.MshFileVersion = 4.1;`";
        return Err(Fault::new(format!("the file has format version {version}, this program reads 4.1"), hint));
    }
    let kind: u8 = scanner.text()?;
    let width: u8 = scanner.text()?;
    if kind > 1 || width != 8 {
        return Err(scanner.fault(&format!("file type {kind} and data size {width}; expected 0 or 1, and 8")));
    }
    scanner.binary = kind == 1;
    if scanner.binary {
        scanner.line()?;
        if scanner.int()? != 1 {
            let hint = "export it on a little-endian machine, or as ASCII (`Mesh.Binary = 0;`)";
            return Err(Fault::new("the binary file is not little-endian", hint));
        }
    }
    scanner.leave()
}

fn names(scanner: &mut Scanner, content: &mut Content) -> Result<(), Fault> {
    for _ in 0..scanner.text::<usize>()? {
        let (dimension, group) = (scanner.text::<u8>()?, scanner.text::<i32>()?);
        let line = scanner.line()?.trim();
        let name = line.strip_prefix('"').and_then(|l| l.strip_suffix('"'));
        let name = name.ok_or_else(|| scanner.fault(&format!("the name of group {group} is not in quotes")))?;
        if dimension == 1 {
            content.names.insert(group, name.to_owned());
        }
    }
    scanner.leave()
}

/// Only the physical groups of the curves are kept.
fn entities(scanner: &mut Scanner, content: &mut Content) -> Result<(), Fault> {
    let counts = [scanner.size()?, scanner.size()?, scanner.size()?, scanner.size()?];
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let entity = scanner.int()?;
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                scanner.real()?;
            }
            let mut groups = integers(scanner)?;
            if dimension > 0 {
                integers(scanner)?;
            }
            if dimension == 1 {
                // A negative number is the same group with the curve reversed.
                groups.iter_mut().for_each(|g| *g = g.abs());
                content.groups.insert(entity, groups);
            }
        }
    }
    scanner.leave()
}

fn integers(scanner: &mut Scanner) -> Result<Vec<i32>, Fault> {
    let count = scanner.size()?;
    (0..count).map(|_| scanner.int()).collect()
}

fn nodes(scanner: &mut Scanner, content: &mut Content) -> Result<(), Fault> {
    let blocks = scanner.size()?;
    for _ in 0..3 {
        scanner.size()?;
    }
    for _ in 0..blocks {
        let (dimension, _entity, parametric) = (scanner.int()?, scanner.int()?, scanner.int()?);
        let count = scanner.size()?;
        let numbers: Vec<usize> = (0..count).map(|_| scanner.size()).collect::<Result<_, _>>()?;
        for number in numbers {
            content.nodes.push((number, [scanner.real()?, scanner.real()?, scanner.real()?]));
            for _ in 0..if parametric == 1 { dimension } else { 0 } {
                scanner.real()?;
            }
        }
    }
    scanner.leave()
}

fn elements(scanner: &mut Scanner, content: &mut Content) -> Result<(), Fault> {
    let blocks = scanner.size()?;
    for _ in 0..3 {
        scanner.size()?;
    }
    for _ in 0..blocks {
        let (_dimension, entity, kind) = (scanner.int()?, scanner.int()?, scanner.int()?);
        let kind = Kind::of(kind)?;
        for _ in 0..scanner.size()? {
            let number = scanner.size()?;
            let nodes = (0..kind.nodes()).map(|_| scanner.size()).collect::<Result<_, _>>()?;
            match kind {
                Kind::Point => {}
                Kind::Line(degree) => content.lines.push(Element { number, entity, degree, nodes }),
                Kind::Triangle(degree) => content.triangles.push(Element { number, entity, degree, nodes }),
            }
        }
    }
    scanner.leave()
}

/// Kinds of element, with their order.
#[derive(Clone, Copy)]
enum Kind {
    Point,
    Line(usize),
    Triangle(usize),
}

impl Kind {
    fn of(number: i32) -> Result<Self, Fault> {
        let refuse = |what: &str, hint: &str| Err(Fault::new(format!("{what} (element type {number})"), hint));
        match number {
            15 => Ok(Self::Point),
            1 => Ok(Self::Line(1)),
            8 => Ok(Self::Line(2)),
            26 => Ok(Self::Line(3)),
            2 => Ok(Self::Triangle(1)),
            9 => Ok(Self::Triangle(2)),
            21 => Ok(Self::Triangle(3)),
            3 | 10 | 16 | 36..=41 | 47..=51 => {
                refuse("the mesh has quadrangles", "leave out `Recombine`: this program computes on triangles")
            }
            4..=7 | 11..=14 | 17..=19 | 29..=35 => {
                refuse("the mesh has volume elements", "mesh in two dimensions: `gmsh -2`")
            }
            other => {
                let hint = "use complete triangles and lines of order 1, 2 or 3 (`Mesh.ElementOrder`)";
                Err(Fault::new(format!("the mesh has elements of type {other}"), hint))
            }
        }
    }

    fn nodes(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line(degree) => degree + 1,
            Self::Triangle(degree) => (degree + 1) * (degree + 2) / 2,
        }
    }
}
