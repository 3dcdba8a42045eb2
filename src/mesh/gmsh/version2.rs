//! Nodes and elements in the formats 2.0 to 2.2.

use super::Fault;
use super::element_kind::ElementKind;
use super::parse::Content;
use super::scan::Scanner;

pub fn nodes(scanner: &mut Scanner, content: &mut Content, parametric: bool) -> Result<(), Fault> {
    let count = scanner.header()?;
    for _ in 0..count {
        let number = scanner.number()?;
        content.nodes.push((number, [scanner.real()?, scanner.real()?, scanner.real()?]));
        if parametric {
            let (dimension, _entity) = (scanner.int()?, scanner.int()?);
            for _ in 0..if matches!(dimension, 1 | 2) { dimension } else { 0 } {
                scanner.skip_real()?;
            }
        }
    }
    scanner.leave()
}

/// An element carries tags, of which the first is its physical group (0 is none), the second the entity.
pub fn elements(scanner: &mut Scanner, content: &mut Content) -> Result<(), Fault> {
    let mut left = scanner.header()?;
    while left > 0 {
        let (kind, count, tags) =
            if scanner.binary { (scanner.int()?, scanner.number()?, scanner.number()?) } else { (0, 1, 0) };
        if count == 0 || count > left {
            return Err(scanner.fault("the counts of its blocks do not add up to the number of elements"));
        }
        left -= count;
        for _ in 0..count {
            let number = scanner.number()?;
            let (kind, tags) = if scanner.binary { (kind, tags) } else { (scanner.int()?, scanner.number()?) };
            let kind = ElementKind::of(kind)?;
            let tags = (0..tags).map(|_| scanner.int()).collect::<Result<Vec<_>, _>>()?;
            let nodes = (0..kind.nodes()).map(|_| scanner.number()).collect::<Result<_, _>>()?;
            let group = tags.first().copied().filter(|&g| g != 0).map(i32::abs);
            let entity = tags.get(1).copied().unwrap_or(0);
            content.keep(kind, number, entity, group.as_slice(), nodes);
        }
    }
    scanner.leave()
}
