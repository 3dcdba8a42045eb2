//! Entities, nodes and elements in the formats 4.0 and 4.1.

use super::Fault;
use super::element_kind::ElementKind;
use super::parse::{Content, Version};
use super::scan::Scanner;

/// Only the physical groups of curves and surfaces are kept.
pub fn entities(scanner: &mut Scanner, content: &mut Content, version: Version) -> Result<(), Fault> {
    let counts = [scanner.size()?, scanner.size()?, scanner.size()?, scanner.size()?];
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let entity = scanner.int()?;
            rest_of_entity(scanner, content, (dimension, entity), version)?;
        }
    }
    scanner.leave()
}

/// Box, groups and bounding entities.
fn rest_of_entity(
    scanner: &mut Scanner,
    content: &mut Content,
    (dimension, entity): (i32, i32),
    version: Version,
) -> Result<(), Fault> {
    let bounds = if dimension == 0 && version == Version::FourOne { 3 } else { 6 };
    // the box of an entity without nodes may be anything
    for _ in 0..bounds {
        scanner.skip_real()?;
    }
    let mut groups = integers(scanner)?;
    if dimension > 0 {
        integers(scanner)?;
    }
    if dimension == 1 || dimension == 2 {
        // A negative number is the same group with the curve reversed.
        groups.iter_mut().for_each(|g| *g = g.abs());
        content.groups.insert((dimension, entity), groups);
    }
    Ok(())
}

/// The pieces into which a partition cuts the entities: nodes and elements lie on them, and they have the groups.
pub fn partitions(scanner: &mut Scanner, content: &mut Content, version: Version) -> Result<(), Fault> {
    scanner.size()?;
    for _ in 0..scanner.size()? {
        scanner.int()?;
        scanner.int()?;
    }
    let counts = [scanner.size()?, scanner.size()?, scanner.size()?, scanner.size()?];
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let (entity, _parent) = (scanner.int()?, (scanner.int()?, scanner.int()?));
            integers(scanner)?;
            rest_of_entity(scanner, content, (dimension, entity), version)?;
        }
    }
    scanner.leave()
}

fn integers(scanner: &mut Scanner) -> Result<Vec<i32>, Fault> {
    let count = scanner.size()?;
    (0..count).map(|_| scanner.int()).collect()
}

pub fn nodes(scanner: &mut Scanner, content: &mut Content, version: Version) -> Result<(), Fault> {
    let blocks = scanner.size()?;
    for _ in 0..totals(version) {
        scanner.size()?;
    }
    for _ in 0..blocks {
        let [dimension, _entity] = place(scanner, version)?;
        let parametric = scanner.int()?;
        let count = scanner.size()?;
        let parameters = if parametric == 1 { dimension } else { 0 };
        // 4.1 lists the numbers of a block before its positions
        let numbers = match version {
            Version::FourOne => (0..count).map(|_| scanner.size()).collect::<Result<Vec<_>, _>>()?,
            Version::Two | Version::Four => Vec::new(),
        };
        for k in 0..count {
            let number = numbers.get(k).copied().map_or_else(|| scanner.number(), Ok)?;
            content.nodes.push((number, [scanner.real()?, scanner.real()?, scanner.real()?]));
            for _ in 0..parameters {
                scanner.skip_real()?;
            }
        }
    }
    scanner.leave()
}

pub fn elements(scanner: &mut Scanner, content: &mut Content, version: Version) -> Result<(), Fault> {
    let blocks = scanner.size()?;
    for _ in 0..totals(version) {
        scanner.size()?;
    }
    for _ in 0..blocks {
        let [dimension, entity] = place(scanner, version)?;
        let kind = ElementKind::of(scanner.int()?)?;
        let groups = content.groups.get(&(dimension, entity)).cloned().unwrap_or_default();
        for _ in 0..scanner.size()? {
            let mut next = || if version == Version::FourOne { scanner.size() } else { scanner.number() };
            let number = next()?;
            let nodes = (0..kind.nodes()).map(|_| next()).collect::<Result<_, _>>()?;
            content.keep(kind, number, entity, &groups, nodes);
        }
    }
    scanner.leave()
}

/// Numbers after the count of blocks: the total, and in 4.1 the smallest and largest number.
fn totals(version: Version) -> usize {
    if version == Version::FourOne { 3 } else { 1 }
}

/// Dimension and entity of a block, which 4.0 has in the other order.
fn place(scanner: &mut Scanner, version: Version) -> Result<[i32; 2], Fault> {
    let (first, second) = (scanner.int()?, scanner.int()?);
    Ok(if version == Version::FourOne { [first, second] } else { [second, first] })
}
