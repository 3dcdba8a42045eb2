//! The measures, each said once: its name and columns in words, what it is taken of, and how.
//!
//! A new measure is a constant in a file of its own and its name in [`ALL`]. From the list follow the keys of scenes
//! and what they are refused with, the columns of tables, labels of pictures, what studies can compare, and a table in
//! `docs/scene.md` that a test compares.

mod asked;
mod asymmetry;
mod bodies;
mod boundary;
mod circulation;
mod column;
mod defects;
mod density;
mod elastic_strain;
mod energy_budget;
mod free_energy;
mod mean_speed;
mod overshoot;
mod subject;

use std::fmt;
use std::sync::LazyLock;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub use asked::{Asked, On};
pub use bodies::{BODY, CONTACTS, GAP, HOLDING, KINETIC_ENERGY, OVERLAP, POWER_TO, WALL_FORCE, WRENCH};
pub use column::{Column, DIMENSIONLESS};
pub use subject::{
    Acting, ActsOn, Bodies, Boundary, Domain, Flow, Gauge, OfBodies, OfBody, OfBoundary, OfFlow, OfMarch, OfState,
    OneBody, Powers, Prepared, Spot, Subject, Taken, Tissue,
};

pub use self::asymmetry::ASYMMETRY;
pub use self::boundary::{FORCE_ON, TORQUE_ON};
pub use self::circulation::CIRCULATION;
pub use self::defects::DEFECTS;
pub use self::density::{DENSITY_MIN, LIMITED_CELLS, MASS};
pub use self::elastic_strain::ELASTIC_STRAIN;
pub use self::energy_budget::{BUDGET, ENERGY_BUDGET};
pub use self::free_energy::FREE_ENERGY;
pub use self::mean_speed::MEAN_SPEED;
pub use self::overshoot::OVERSHOOT;
use super::MeasureError;
use crate::schema::listed::{self, Listed};
use crate::schema::{FLOWS, IN_A_FLOW, TISSUE, WITH_BODIES, WITH_PRESSURE};

/// Every measure, in the order of its columns.
pub const ALL: &[&Measure] = &[
    &FREE_ENERGY,
    &OVERSHOOT,
    &ASYMMETRY,
    &MASS,
    &DENSITY_MIN,
    &LIMITED_CELLS,
    &ELASTIC_STRAIN,
    &CIRCULATION,
    &DEFECTS,
    &ENERGY_BUDGET,
    &MEAN_SPEED,
    &FORCE_ON,
    &TORQUE_ON,
    &KINETIC_ENERGY,
    &GAP,
    &OVERLAP,
    &CONTACTS,
    &WALL_FORCE,
    &BODY,
    &HOLDING,
    &WRENCH,
    &POWER_TO,
];

/// What can be measured: one or more numbers. Two measures of one name are the same.
pub struct Measure {
    /// As in the scene file.
    pub name: &'static str,
    /// What it is, in a line for `docs/scene.md`.
    pub help: &'static str,
    /// Its numbers, in the order in which they are written.
    pub columns: &'static [Column],
    /// What it is taken of, and how.
    pub of: Of,
    /// What a scene must have for it besides.
    pub needs: &'static [Premise],
    /// Whether the residuals of the stationary equations stand beside it in the history.
    pub with_residuals: bool,
}

/// What a measure is taken of, and the function that takes it. This decides which scenes can have it.
#[derive(Clone, Copy)]
pub enum Of {
    /// A flow: that of a tissue with bodies or without, or of a Stokes fluid.
    Flow(OfFlow),
    /// A boundary tag of a flow that forces drive: of a tissue, or of a Stokes fluid.
    Boundary {
        /// Whether it is about a point.
        around: bool,
        /// From the forces on the nodes.
        take: OfBoundary,
    },
    /// A tissue of any density.
    Tissue(Region, Taking),
    /// A tissue whose density is a field; it has no rigid bodies.
    Compressible(Taking),
    /// Rigid bodies.
    Bodies(Which, OfBodies),
    /// One rigid body: the first, or one that a scene names.
    Body(Which, OfBody),
}

/// How a measure of a tissue is taken.
#[derive(Clone, Copy)]
pub enum Taking {
    /// At a state.
    At(OfState),
    /// With what is prepared once for the domain.
    Prepared(fn(&Domain<'_>) -> Result<Box<dyn Gauge>, MeasureError>),
}

/// The part of the mesh that a measure of a tissue reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// The tissue alone, where bodies lie in it.
    OutsideOfBodies,
    /// The whole mesh: with bodies in it, their inside would count as tissue.
    WholeMesh,
}

/// The bodies that have a measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Any, at rest too.
    Any,
    /// Those in a flow, at rest too.
    InAFlow,
    /// Those in a tissue, at rest too.
    InATissue,
    /// In a tissue, those of which at least one moves; else any.
    Moving,
}

/// What a scene must have for some measures, besides what they are taken of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Premise {
    /// A disc with tissue behind it, and an inflow on its axis.
    Wake,
    /// A domain with a way around.
    Track,
    /// The table `[strain]`.
    Strain,
}

impl Measure {
    /// The measure of this name.
    pub fn named(name: &str) -> Option<&'static Measure> {
        ALL.iter().copied().find(|measure| measure.name == name)
    }

    /// The names of its columns.
    pub fn column_names(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.columns.iter().map(|column| column.name)
    }

    /// Whether the scene must have this.
    pub fn needs(&self, need: Premise) -> bool {
        self.needs.contains(&need)
    }

    /// What it is taken of, in words.
    pub fn subject(&self) -> &'static str {
        match self.of {
            Of::Flow(_) => "any flow",
            Of::Boundary { .. } => "a boundary tag",
            Of::Tissue(Region::OutsideOfBodies, _) => "tissue",
            Of::Tissue(Region::WholeMesh, _) => "tissue without bodies",
            Of::Compressible(_) => "compressible tissue",
            Of::Bodies(which, _) => match which {
                Which::Any => "bodies",
                Which::InAFlow => "bodies in a flow",
                Which::InATissue => "bodies in tissue",
                Which::Moving => "bodies that move",
            },
            Of::Body(which, _) => match which {
                Which::Any => "a body",
                Which::InAFlow => "a body in a flow",
                Which::InATissue => "a body in tissue",
                Which::Moving => "a body that moves",
            },
        }
    }

    /// Kinds of scenes that may have it.
    pub(super) fn kinds(&self) -> &'static str {
        match self.of {
            Of::Flow(_) => FLOWS,
            Of::Boundary { .. } => WITH_PRESSURE,
            Of::Tissue(..) => TISSUE,
            Of::Compressible(_) => "compressible",
            Of::Bodies(which, _) | Of::Body(which, _) => match which {
                Which::InAFlow => IN_A_FLOW,
                Which::InATissue => TISSUE,
                Which::Any | Which::Moving => WITH_BODIES,
            },
        }
    }

    /// Whether it is about rigid bodies.
    pub fn is_of_bodies(&self) -> bool {
        match self.of {
            Of::Bodies(..) | Of::Body(..) => true,
            Of::Flow(_) | Of::Boundary { .. } | Of::Tissue(..) | Of::Compressible(_) => false,
        }
    }

    /// Whether it is taken on a boundary tag, which a scene names beside it.
    pub fn is_on_a_tag(&self) -> bool {
        matches!(self.of, Of::Boundary { .. })
    }

    /// Whether it is taken of one body, which a scene may name.
    pub fn is_of_a_body(&self) -> bool {
        matches!(self.of, Of::Body(..))
    }

    /// Whether it is taken about a point, which a scene names beside it.
    pub fn is_around_a_point(&self) -> bool {
        matches!(self.of, Of::Boundary { around: true, .. })
    }

    /// Whether it is about a tissue, and not about any flow.
    pub fn is_of_tissue(&self) -> bool {
        match self.of {
            Of::Tissue(..) | Of::Compressible(_) => true,
            Of::Flow(_) | Of::Boundary { .. } | Of::Bodies(..) | Of::Body(..) => false,
        }
    }

    /// Whether it says nothing of bodies at rest.
    pub fn needs_motion(&self) -> bool {
        match self.of {
            Of::Bodies(which, _) | Of::Body(which, _) => which == Which::Moving,
            Of::Flow(_) | Of::Boundary { .. } | Of::Tissue(..) | Of::Compressible(_) => false,
        }
    }

    /// Whether it would take the inside of bodies for tissue.
    pub fn reads_bodies(&self) -> bool {
        match self.of {
            Of::Tissue(region, _) => region == Region::WholeMesh,
            Of::Flow(_) | Of::Boundary { .. } | Of::Compressible(_) | Of::Bodies(..) | Of::Body(..) => false,
        }
    }
}

/// The column of this name, if a measure has it; of one on a boundary tag or a body that without their names.
pub fn column(name: &str) -> Option<&'static Column> {
    let name = on(name).map_or(name, |(name, _)| name);
    ALL.iter().flat_map(|measure| measure.columns).find(|column| column.name == name)
}

/// `force_x1` and `disc` of the column `force_x1:disc` of a measure on a boundary tag or a body.
pub fn on(column: &str) -> Option<(&str, &str)> {
    let (name, on) = column.split_once(':')?;
    let takes = |measure: &Measure| measure.is_on_a_tag() || measure.is_of_a_body();
    let has = |measure: &&&Measure| takes(measure) && measure.column_names().any(|own| own == name);
    ALL.iter().find(has).map(|_| (name, on))
}

/// Whether a column belongs to a march in time, or to bodies that move: a steady state by itself has none of them.
pub fn is_of_a_march(column: &str) -> bool {
    let measure = ALL.iter().find(|measure| measure.column_names().any(|name| name == column));
    measure.is_some_and(|measure| {
        measure.needs_motion() || measure.columns.iter().any(|one| one.name == column && one.of_a_march)
    })
}

impl PartialEq for Measure {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Measure {}

impl fmt::Debug for Measure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name)
    }
}

impl Serialize for Measure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl Listed for &'static Measure {
    const WHAT: &'static str = "Measure";

    fn names() -> &'static [&'static str] {
        static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| ALL.iter().map(|measure| measure.name).collect());
        &NAMES
    }

    fn named(name: &str) -> Option<Self> {
        Measure::named(name)
    }
}

impl<'de> Deserialize<'de> for &'static Measure {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        listed::read(deserializer)
    }
}
