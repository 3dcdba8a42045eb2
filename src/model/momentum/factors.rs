//! The matrix of velocity and pressure, factorised.

use nalgebra::DMatrix;

use crate::model::closed::ClosedParts;
use crate::model::frames::Frames;
use crate::model::immersed::Immersed;
use crate::model::immersed::nitsche::Nitsche;
use crate::solve::SolveError;
use crate::solve::bordered::Bordered;
use crate::solve::sparse::{Factored, Matrix};

#[derive(Debug)]
pub(super) enum System {
    /// Some boundary part fixes the pressure.
    Open(Factored),
    /// The pressure has zero mean in each closed part: one pressure unknown and the multiplier of each border the rest.
    Closed(Bordered),
    /// Rigid bodies by penalty, with a system of their own.
    Immersed(Box<Immersed>),
    /// Rigid bodies by Nitsche's method.
    Nitsche(Box<Nitsche>),
}

/// `[TᵀAT  sTᵀBᵀ; sBT  0]` with the unit s of pressure, bordered by the zero mean of the pressure in every part where
/// no condition fixes it.
pub(super) fn factorise(
    frames: &Frames,
    stiffness: &Matrix,
    gradient: &Matrix,
    (means, unit): (&[f64], f64),
    closed: &ClosedParts,
) -> Result<System, SolveError> {
    let (free, last) = (frames.free, closed.last());
    // places of the pressures that are not in the border
    let mut place = vec![None; means.len()];
    let mut size = free;
    for dof in (0..means.len()).filter(|dof| !last.contains(dof)) {
        place[dof] = Some(size);
        size += 1;
    }
    let mut triplets = frames.reduce(stiffness);
    let mut columns = vec![vec![0.0; size]; 2 * last.len()];
    for (i, j, value) in frames.reduce_rows(gradient) {
        let value = unit * value;
        if let Some(j) = place[j] {
            triplets.push((i, j, value));
            triplets.push((j, i, value));
        } else if let Some(part) = last.iter().position(|&dof| dof == j) {
            columns[2 * part][i] += value;
        }
    }
    let inner = Factored::new("Stokes", Matrix::from_triplets(size, size, &triplets))?;
    if last.is_empty() {
        return Ok(System::Open(inner));
    }
    // the mean of the pressure over the area: a weight that has no unit
    let share = unit * unit;
    let mut corner = DMatrix::zeros(2 * last.len(), 2 * last.len());
    for (part, &dof) in last.iter().enumerate() {
        let mut own = vec![0.0; last.len()];
        own[part] = -1.0;
        let mut mean = vec![0.0; means.len()];
        closed.shift(&mut mean, &own, |dof| share * means[dof]);
        for (value, place) in mean.iter().zip(&place) {
            place.iter().for_each(|&at| columns[2 * part + 1][at] = *value);
        }
        (corner[(2 * part, 2 * part + 1)], corner[(2 * part + 1, 2 * part)]) = (share * means[dof], share * means[dof]);
    }
    let bordered = Bordered::new(inner, &columns, columns.clone(), corner)?;
    Ok(System::Closed(bordered))
}
