//! Constraints on the twists of bodies that are held or pinned.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::Immersed;
use super::balance::sparse_dot;
use crate::body::guide::Rule;
use crate::mesh::Point;
use crate::model::frames::Frames;
use crate::model::immersed::penalty::{BodyError, Immersion, Means};
use crate::shape::Wrench;
use crate::solve::axpy;

/// Singular values of the constraints below this, relative to the largest one, are those of constraints that the
/// boundary or other bodies impose.
const RANK: f64 = 1e-7;
/// Largest contradiction of constraints, relative to the velocities, that counts as rounding.
const MISFIT: f64 = 1e-7;

/// Independent constraints on the twists of bodies.
pub(super) struct Constraints {
    /// `ℓ` by free unknown.
    pub(super) rows: Vec<Vec<f64>>,
    /// `LQ`.
    pub(super) on_kernel: DMatrix<f64>,
    pub(super) targets: Vec<f64>,
    /// What a multiplier does to which body.
    pub(super) works: Vec<Vec<(usize, Vector3<f64>)>>,
    pub(super) bodies: usize,
}

impl Constraints {
    pub(super) fn new(immersed: &Immersed, frames: &Frames, rules: &[Rule], start: &[f64]) -> Result<Self, BodyError> {
        let immersion = &immersed.immersion;
        let single = single_constraints(immersion, rules);
        let fields = &immersed.kernel.fields;
        let by_unknown: Vec<Vec<f64>> =
            single.iter().map(|c| functional(&immersion.means[c.body], c.weights, frames)).collect();
        let on_kernel = DMatrix::from_fn(single.len(), fields.len(), |i, j| sparse_dot(&fields[j], &by_unknown[i]));
        let mut rest = DVector::zeros(single.len());
        let mut fastest = 0.0_f64;
        for (i, c) in single.iter().enumerate() {
            let now = immersion.means[c.body].twist(start);
            let now = c.weights.dot(&Vector3::new(now.velocity.x, now.velocity.y, now.spin));
            rest[i] = c.target - now;
            fastest = fastest.max(c.target.abs()).max(now.abs());
        }
        let bodies = rules.len();
        if single.is_empty() {
            return Ok(Self { rows: Vec::new(), on_kernel, targets: Vec::new(), works: Vec::new(), bodies });
        }
        // constraints that the boundary or other bodies impose already need no multiplier, but must agree
        let padded = DMatrix::from_fn(single.len(), single.len().max(fields.len()), |i, j| {
            if j < fields.len() { on_kernel[(i, j)] } else { 0.0 }
        });
        let svd = padded.svd(true, false);
        let u = svd.u.expect("it was asked for");
        let largest = svd.singular_values.max();
        let soft = (0..single.len()).filter(|&i| !immersed.kernel.has_patch(single[i].body));
        let kept: Vec<usize> = (0..single.len()).filter(|&k| svd.singular_values[k] > RANK * largest).collect();
        if kept.len() + soft.count() == single.len() {
            let works = single.iter().map(|c| vec![(c.body, c.weights)]).collect();
            return Ok(Self { rows: by_unknown, on_kernel, targets: rest.as_slice().to_vec(), works, bodies });
        }
        let u = u.select_columns(&kept);
        // what nothing makes rigid takes any motion
        let unit = |i: usize| DVector::from_fn(single.len(), |k, _| f64::from(u8::from(k == i)));
        let soft = (0..single.len()).filter(|&i| !immersed.kernel.has_patch(single[i].body));
        let columns: Vec<DVector<f64>> = u.column_iter().map(|c| c.into_owned()).chain(soft.map(unit)).collect();
        let u = DMatrix::from_fn(single.len(), columns.len(), |i, k| columns[k][i]);
        let misfit = &rest - &u * (u.transpose() * &rest);
        if misfit.amax() > MISFIT * fastest {
            let body = single[misfit.iamax()].body;
            return Err(BodyError::Contradiction { body: immersion.names[body].clone(), misfit: misfit.amax() });
        }
        let combine = |k: usize| {
            let mut row = vec![0.0; frames.free];
            by_unknown.iter().enumerate().for_each(|(i, single)| axpy(u[(i, k)], single, &mut row));
            row
        };
        let works = (0..u.ncols())
            .map(|k| single.iter().enumerate().map(|(i, c)| (c.body, c.weights * u[(i, k)])).collect())
            .collect();
        let rows = (0..u.ncols()).map(combine).collect();
        let targets = (u.transpose() * rest).as_slice().to_vec();
        Ok(Self { rows, on_kernel: u.transpose() * on_kernel, targets, works, bodies })
    }

    /// The force and torque on every body.
    pub(super) fn holding(&self, multipliers: &[f64]) -> Vec<Wrench> {
        let mut sums = vec![Vector3::zeros(); self.bodies];
        for (works, lambda) in self.works.iter().zip(multipliers) {
            works.iter().for_each(|(body, work)| sums[*body] += work * *lambda);
        }
        sums.into_iter().map(|s: Vector3<f64>| Wrench { force: Point::new(s.x, s.y), torque: s.z }).collect()
    }
}

/// `weights · twist = target`
pub(super) struct Single {
    pub(super) body: usize,
    pub(super) weights: Vector3<f64>,
    pub(super) target: f64,
}

pub(super) fn single_constraints(immersion: &Immersion, rules: &[Rule]) -> Vec<Single> {
    let mut all = Vec::new();
    for (body, rule) in rules.iter().enumerate() {
        match rule {
            Rule::Free => {}
            Rule::Held(twist) => {
                // the spin as a velocity at the body's rim, whatever the unit of length
                let size = immersion.means[body].area.sqrt();
                let targets = [twist.velocity.x, twist.velocity.y, twist.spin * size];
                let unit = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, size));
                all.extend((0..3).map(|k| Single { body, weights: unit.column(k).into(), target: targets[k] }));
            }
            Rule::Pinned(point) => {
                let y = point - immersion.poses[body].position;
                all.push(Single { body, weights: Vector3::new(1.0, 0.0, -y.y), target: 0.0 });
                all.push(Single { body, weights: Vector3::new(0.0, 1.0, y.x), target: 0.0 });
            }
        }
    }
    all
}

/// `weights · twist` by free unknown.
pub(super) fn functional(means: &Means, weights: Vector3<f64>, frames: &Frames) -> Vec<f64> {
    let mut out = vec![0.0; frames.free];
    for (dof, row) in &means.rows {
        let value = row.dot(&weights);
        frames.of(*dof).for_each(|(unknown, a)| out[unknown] += a * value);
    }
    out
}
