//! The content of a file, not yet a mesh: sections, format and names, whatever the version.

use std::collections::{BTreeMap, HashMap};

use super::element_kind::ElementKind;
use super::scan::Scanner;
use super::{Fault, version2, version4};

/// A line or a triangle.
#[derive(Debug)]
pub struct Element {
    pub number: usize,
    /// The curve or surface of the geometry it lies on.
    pub entity: i32,
    /// Its physical group. An element in several groups is listed once for each, in the order of the file.
    pub group: Option<i32>,
    pub degree: usize,
    /// Node numbers, in the order of the file: corners, inner nodes of the edges, inner nodes.
    pub nodes: Vec<usize>,
}

/// What a mesh is made of.
#[derive(Debug, Default)]
pub struct Content {
    /// Names of the physical curves.
    pub names: HashMap<i32, String>,
    /// Physical groups by dimension and entity.
    pub groups: HashMap<(i32, i32), Vec<i32>>,
    /// Node numbers and positions.
    pub nodes: Vec<(usize, [f64; 3])>,
    pub lines: Vec<Element>,
    pub triangles: Vec<Element>,
    /// Point elements, which no mesh needs.
    pub points: usize,
    /// Sections that are not used.
    pub unused: Vec<String>,
}

/// Versions of the format that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// 2.0 to 2.2: elements carry their groups.
    Two,
    /// 4.0: entities carry the groups, numbers have four bytes.
    Four,
    /// 4.1
    FourOne,
}

impl Content {
    /// Keeps an element of a kind, once for each of its groups.
    pub fn keep(&mut self, kind: ElementKind, number: usize, entity: i32, groups: &[i32], nodes: Vec<usize>) {
        let (list, degree) = match kind {
            ElementKind::Point => {
                self.points += 1;
                return;
            }
            ElementKind::Line(degree) => (&mut self.lines, degree),
            ElementKind::Triangle(degree) => {
                let group = groups.first().copied();
                self.triangles.push(Element { number, entity, group, degree, nodes });
                return;
            }
        };
        let given = groups.iter().copied().map(Some).chain(groups.is_empty().then_some(None));
        list.extend(given.map(|group| Element { number, entity, group, degree, nodes: nodes.clone() }));
    }

    /// The name of a physical curve, or its number.
    pub fn name(&self, group: i32) -> String {
        self.names.get(&group).cloned().unwrap_or_else(|| group.to_string())
    }
}

/// Reads all sections that matter.
pub fn parse(bytes: &[u8]) -> Result<Content, Fault> {
    let mut scanner = Scanner::new(bytes);
    let mut content = Content::default();
    let (mut seen, mut version) = (Vec::new(), None);
    let mut unused = BTreeMap::<String, usize>::new();
    while let Some(section) = scanner.enter()? {
        match (section.as_str(), version) {
            ("MeshFormat", _) => version = Some(format(&mut scanner)?),
            ("NOD" | "ELM", _) => {
                let hint = "convert it: `gmsh old.msh -save -format msh41 -o new.msh`";
                return Err(Fault::new("the file has format version 1; read are 2, 4.0 and 4.1", hint));
            }
            ("Comments", _) => scanner.skip()?,
            (_, None) => return Err(scanner.fault("comes before $MeshFormat")),
            ("PhysicalNames", Some(_)) => names(&mut scanner, &mut content)?,
            ("Nodes" | "ParametricNodes", Some(Version::Two)) => {
                version2::nodes(&mut scanner, &mut content, section == "ParametricNodes")?;
            }
            ("Elements", Some(Version::Two)) => version2::elements(&mut scanner, &mut content)?,
            ("Entities", Some(version)) => version4::entities(&mut scanner, &mut content, version)?,
            ("PartitionedEntities", Some(version)) => {
                *unused.entry("$PartitionedEntities".to_owned()).or_default() += 1;
                version4::partitions(&mut scanner, &mut content, version)?;
            }
            ("Nodes", Some(version)) => version4::nodes(&mut scanner, &mut content, version)?,
            ("Elements", Some(version)) => version4::elements(&mut scanner, &mut content, version)?,
            (other, Some(_)) => {
                *unused.entry(format!("${other}")).or_default() += 1;
                scanner.skip()?;
            }
        }
        seen.push(if section == "ParametricNodes" { "Nodes".to_owned() } else { section });
    }
    content.unused = unused.into_keys().collect();
    match ["MeshFormat", "Nodes", "Elements"].into_iter().find(|s| !seen.iter().any(|have| have == s)) {
        None => Ok(content),
        Some(section) => {
            let hint = "give a mesh file of Gmsh (.msh) that has been meshed (`gmsh file.geo -2 -o file.msh`) and \
             saved completely";
            Err(Fault::new(format!("there is no section ${section}"), hint))
        }
    }
}

fn format(scanner: &mut Scanner) -> Result<Version, Fault> {
    let number: f64 = scanner.text()?;
    let version = match number {
        2.0..=2.2 => Version::Two,
        4.0 => Version::Four,
        4.1 => Version::FourOne,
        _ => {
            let hint = "convert it: `gmsh old.msh -save -format msh41 -o new.msh`";
            let what = format!("the file has format version {number}; this program reads 2.2, 4.0 and 4.1");
            return Err(Fault::new(what, hint));
        }
    };
    let kind: u8 = scanner.text()?;
    let width: u8 = scanner.text()?;
    if kind > 1 || width != 8 {
        return Err(scanner.fault(&format!("file type {kind} and data size {width}; expected 0 or 1, and 8")));
    }
    if kind == 1 {
        scanner.line()?;
        scanner.begin_binary()?;
    }
    scanner.leave()?;
    Ok(version)
}

fn names(scanner: &mut Scanner, content: &mut Content) -> Result<(), Fault> {
    for _ in 0..scanner.text::<usize>()? {
        let line = scanner.whole_line()?.trim();
        let (numbers, name) = line.split_once('"').unwrap_or((line, ""));
        let numbers: Vec<i32> = numbers.split_whitespace().map_while(|n| n.parse().ok()).collect();
        // version 2.0 has no dimensions
        let (dimension, group) = match numbers[..] {
            [group] => (1, group),
            [dimension, group] => (dimension, group),
            _ => return Err(scanner.fault(&format!("`{line}` is no dimension, number and name in quotes"))),
        };
        let name = name.trim_end().strip_suffix('"');
        let name = name.ok_or_else(|| scanner.fault(&format!("the name of group {group} is not in quotes")))?;
        if dimension == 1 && !name.is_empty() {
            content.names.insert(group, name.to_owned());
        }
    }
    scanner.leave()
}
