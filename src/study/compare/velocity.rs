//! The velocity that a run left, as a function of the place.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use crate::measure::measured::{Binned, Bins, Sample};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::model::fields::VELOCITY;
use crate::run::domain::build_mesh;
use crate::run::finished::FinishedRun;
use crate::scene::Scene;
use crate::space::{Continuity, Field, Space};
use crate::study::StudyError;

/// The last velocity of a run; nothing is solved or factorised to have it.
#[derive(Debug)]
pub struct RunVelocity {
    /// What was computed.
    pub scene: Scene,
    /// On which cells.
    pub mesh: Arc<Mesh>,
    locator: Locator,
    /// At the time of the run's checkpoint.
    pub velocity: Field,
    /// Of the state.
    pub time: f64,
    /// Centre and radius of the disc that lengths refer to.
    pub centre: Point,
    /// Of its disc.
    pub radius: f64,
}

/// Points along each side of a bin, at the midpoints of equal parts, whose mean is that of the bin.
const POINTS: usize = 5;

impl RunVelocity {
    /// Reads the folder of a run.
    ///
    /// # Errors
    /// A folder without scene or checkpoint, files that cannot be read or do not belong together, a mesh file that has
    /// changed since.
    pub fn read(folder: &Path) -> Result<Self, StudyError> {
        let left = FinishedRun::read(folder)?;
        let mesh = Arc::new(build_mesh(&left.scene)?);
        let space = Arc::new(Space::new(&mesh, Continuity::Continuous, left.scene.space.velocity, 2));
        let (scene, saved) =
            left.on(&mesh, |saved| saved.flow_of(VELOCITY).is_some_and(|v| v.len() == space.dof_count()))?;
        let velocity = Field::new(&space, saved.flow_of(VELOCITY).expect("it fits").to_vec());
        let centre = Point::from(scene.mesh.centre());
        let radius = scene.mesh.radius();
        Ok(Self { locator: Locator::new(&mesh), scene, mesh, velocity, time: saved.t, centre, radius })
    }

    /// `v` at a point in disc radii about the disc's centre; `None` outside of the mesh.
    pub fn at(&self, x: Point) -> Option<Point> {
        let (cell, xi) = self.locator.locate(&self.mesh, self.centre + x * self.radius)?;
        Some(self.velocity.vector_at(cell, xi))
    }

    /// How many of these points in disc radii lie outside of the mesh.
    pub fn count_outside(&self, points: &[Sample]) -> usize {
        let Self { mesh, locator, centre, radius, .. } = self;
        points.par_iter().filter(|point| locator.locate(mesh, centre + point.x * *radius).is_none()).count()
    }

    /// Lowest and highest corner of the mesh, in disc radii about the disc's centre.
    pub fn bounds(&self) -> [Point; 2] {
        let vertices = self.mesh.vertices.iter().map(|x| (x - self.centre) / self.radius);
        let none = [Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY)];
        vertices.fold(none, |[low, high], x| [low.inf(&x), high.sup(&x)])
    }

    /// Means over bins, by 5 × 5 points in each, and the share of a bin's points that lie in the mesh and not in the
    /// obstacle of this radius. A bin takes the weight of the same bin of `like`, and is empty if none of its points
    /// lies in the mesh.
    pub fn average(&self, bins: Bins, like: &[f64], obstacle: f64) -> (Binned, Vec<f64>) {
        let mut binned = Binned::empty(bins);
        let mut shares = vec![0.0; bins.len()];
        for bin in (0..bins.len()).filter(|bin| like[*bin] > 0.0) {
            let place = |k: usize| (k as f64 + 0.5) / POINTS as f64;
            let points = (0..POINTS * POINTS)
                .map(|k| bins.inside(bin, Point::new(place(k % POINTS), place(k / POINTS))))
                .filter(|x| x.norm() >= obstacle);
            let values: Vec<Point> = points.filter_map(|x| self.at(x)).collect();
            if !values.is_empty() {
                binned.values[bin] = values.iter().sum::<Point>() / values.len() as f64;
                binned.weights[bin] = like[bin];
                shares[bin] = values.len() as f64 / (POINTS * POINTS) as f64;
            }
        }
        (binned, shares)
    }
}
