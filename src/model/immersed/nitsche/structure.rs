//! The order of elimination: nested dissection of the mesh, changed where ghost penalties couple cells.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::elements::Elements;
use crate::model::immersed::Ground;
use crate::solve::SolveError;
use crate::solve::dissection::{Dissection, Group, LEAF, LateGroup};
use crate::solve::symbolic::Symbolic;

/// What does not depend on where the bodies are.
#[derive(Debug, Clone)]
pub(super) struct Skeleton {
    /// The unknowns of every velocity node.
    groups: Vec<Group>,
    dissection: Dissection,
    /// Velocity nodes around every pressure node.
    around: Vec<Vec<u32>>,
}

impl Skeleton {
    pub fn new(ground: Ground) -> Self {
        let (velocity, pressure) = (ground.velocity, ground.pressure);
        let mut adjacency = vec![BTreeSet::new(); velocity.node_count];
        let mut around = vec![BTreeSet::new(); pressure.node_count];
        for cell in 0..velocity.mesh.cells.len() {
            let nodes = velocity.cell_nodes(cell);
            for &a in nodes {
                adjacency[a as usize].extend(nodes.iter().copied().filter(|&b| b != a));
            }
            pressure.cell_nodes(cell).iter().for_each(|&node| around[node as usize].extend(nodes));
        }
        let unknowns = |node: usize| ground.frames.owned(node).map(|u| u as u32).collect();
        let positions = velocity.node_positions().into_iter().enumerate();
        let groups: Vec<Group> =
            positions.map(|(node, x)| Group { unknowns: unknowns(node), position: x.into() }).collect();
        let list = |sets: Vec<BTreeSet<u32>>| -> Vec<Vec<u32>> {
            sets.into_iter().map(|set| set.into_iter().collect()).collect()
        };
        let dissection = Dissection::new(&groups, &list(adjacency), LEAF);
        Self { groups, dissection, around: list(around) }
    }

    /// The structure of the matrix for one placement of the bodies.
    pub fn symbolic(&self, elements: &Elements) -> Result<Arc<Symbolic>, SolveError> {
        let Elements { ground, domain, twists, blocks, .. } = elements;
        let (velocity, free) = (ground.velocity, ground.frames.free);
        let mut dissection = self.dissection.clone();
        for &face in &domain.ghosts {
            let face = &velocity.mesh.faces[face];
            let plus = face.plus.expect("an interior face").cell;
            for &a in velocity.cell_nodes(face.minus.cell) {
                velocity.cell_nodes(plus).iter().for_each(|&b| dissection.couple(a as usize, b as usize));
            }
        }
        let mut late: Vec<LateGroup> = (self.around.iter().enumerate())
            .map(|(node, around)| LateGroup { unknowns: vec![(free + node) as u32], neighbours: around.clone() })
            .collect();
        let [first, means, count] = elements.firsts();
        let mut near = vec![BTreeSet::new(); twists.count()];
        for (&cell, cut) in &blocks.cut {
            for &body in &cut.bodies {
                let unknowns: BTreeSet<usize> = (0..3).flat_map(|k| twists.of(body, k)).map(|(u, _)| u).collect();
                unknowns.iter().for_each(|&unknown| near[unknown].extend(velocity.cell_nodes(cell)));
            }
        }
        late.extend(near.into_iter().enumerate().map(|(unknown, near)| LateGroup {
            unknowns: vec![(first + unknown) as u32],
            neighbours: near.into_iter().collect(),
        }));
        // the constant pressures are settled at the very end, together with the multipliers of their means
        let constants = domain.parts.last.iter().map(|&dof| (free + dof) as u32);
        let last: Vec<u32> = constants.chain(means as u32..count as u32).collect();
        let tree = dissection.tree(&self.groups, &late, &last);
        let pattern = |e: usize, out: &mut _| elements.pattern(e, out);
        Ok(Arc::new(Symbolic::new("Stokes", count, &tree, elements.count(), pattern)?))
    }
}
