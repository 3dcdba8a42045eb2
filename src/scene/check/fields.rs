//! The rules of `[initial]`, `[source]` and `[exact]`.

use std::sync::Arc;

use super::{CONSTANT_DENSITY, Checker, WRONG_KIND, exact_hint};
use crate::expression::{Expression, Formula, VectorFormula};
use crate::model::{Exact, ModelError, ModelKind, Parameters};
use crate::names;
use crate::scene::error::SceneError;
use crate::scene::kinds::stokes::{StokesExact, StokesFile};
use crate::scene::start::{DensityStart, DensityTable, NAMED, PolarityStart, StartTable};
use crate::scene::tables::{ExactBoundary, ExactTable, SceneFile};
use crate::scene::{Initial, InitialDensity, Sources};

/// Exact fields with whose data natural conditions have, as sources.
fn exact_sources(given: Option<(Exact, ExactBoundary)>) -> Sources {
    let exact_boundary = match given {
        Some((_, ExactBoundary::Exact)) => true,
        Some((_, ExactBoundary::Scene)) | None => false,
    };
    Sources { exact: given.map(|(exact, _)| Arc::new(exact)), exact_boundary, ..Sources::default() }
}

impl Checker<'_> {
    pub(super) fn initial(
        &self,
        start: &mut PolarityStart,
        p: &Parameters,
        exact: Option<&Exact>,
    ) -> Result<Initial, SceneError> {
        const KEY: &str = "initial.polarity";
        match start {
            PolarityStart::Name(name) if name == "aligned-around-disc" => Ok(Initial::AlignedAroundDisc),
            PolarityStart::Name(name) if name == "circulating" => Ok(Initial::Circulating),
            PolarityStart::Name(name) if name == "exact" => {
                let given = exact_hint(p.kind());
                self.require(exact.is_some(), KEY, "\"exact\"", "the scene has no exact fields", given)?;
                Ok(Initial::Exact)
            }
            PolarityStart::Name(name) => {
                let near = match name.as_str() {
                    "random" | "file" => String::new(),
                    other => {
                        let known: Vec<&str> = NAMED.iter().map(|(name, _)| *name).chain(["random", "file"]).collect();
                        names::did_you_mean(other, &known)
                    }
                };
                let hint = "the choices are \"aligned-around-disc\", \"circulating\", \"exact\", [\"p_1\", \"p_2\"], { random = { seed = 1 } }, \
                            { file = \"…\" }";
                Err(self.error(KEY, format!("\"{name}\""), &format!("no such initial polarity{near}"), hint))
            }
            PolarityStart::Formulas(formulas) => Ok(Initial::Expressions(self.vector(KEY, formulas, p)?)),
            PolarityStart::Table(StartTable::Random(random)) => {
                let coarse = "the edge length of the mesh of random vectors; the structures are about as large";
                let amplitude = "the standard deviation of |p| at the start; 0.1 is usual";
                Ok(Initial::Random {
                    seed: random.seed,
                    amplitude: self.positive("initial.polarity.random.amplitude", random.amplitude, amplitude)?,
                    h_coarse: self.positive("initial.polarity.random.h_coarse", random.h_coarse, coarse)?,
                })
            }
            PolarityStart::Table(StartTable::File(name)) => {
                let path = self.existing_file("initial.polarity.file", name)?;
                *name = path.to_string_lossy().into_owned();
                Ok(Initial::File(path))
            }
        }
    }

    /// Filled in as `"exact"` where there are exact fields and nothing is said.
    pub(super) fn initial_density(
        &self,
        start: &mut Option<DensityStart>,
        p: &Parameters,
        exact: Option<&Exact>,
    ) -> Result<Option<InitialDensity>, SceneError> {
        const KEY: &str = "initial.density";
        match p.kind() {
            ModelKind::Incompressible if start.is_none() => return Ok(None),
            ModelKind::Incompressible => return Err(self.error(KEY, "(given)", CONSTANT_DENSITY, WRONG_KIND)),
            ModelKind::Compressible => {}
        }
        if start.is_none() && exact.is_some() {
            *start = Some(DensityStart::Formula(Formula::Text("exact".to_owned())));
        }
        match start {
            None => Err(self.missing("initial", "density", "add `density = 1.0` or a formula to [initial]")),
            Some(DensityStart::Formula(Formula::Text(name))) if name == "exact" => {
                let hint = exact_hint(p.kind());
                self.require(exact.is_some(), KEY, "\"exact\"", "the scene has no exact fields", hint)?;
                Ok(Some(InitialDensity::Exact))
            }
            Some(DensityStart::Formula(formula)) => Ok(Some(InitialDensity::Formula(self.density(KEY, formula, p)?))),
            Some(DensityStart::Table(DensityTable::File(name))) => {
                let path = self.existing_file("initial.density.file", name)?;
                *name = path.to_string_lossy().into_owned();
                Ok(Some(InitialDensity::File(path)))
            }
        }
    }

    /// A density's formula; a number must not be negative.
    fn density(&self, key: &str, formula: &Formula, p: &Parameters) -> Result<Expression, SceneError> {
        let parsed = ModelError::parse_density(key, formula, &p.symbols());
        let parsed = parsed.map(|density| density.given_at(&self.given(key)));
        parsed.map_err(|error| self.error(key, error.value, &error.rule, &error.hint))
    }

    pub(super) fn sources(&self, file: &SceneFile, p: &Parameters) -> Result<Sources, SceneError> {
        let parse = |key: &str, formulas: &Option<VectorFormula>| {
            formulas.as_ref().map(|formulas| self.vector(key, formulas, p)).transpose()
        };
        let force = parse("source.force", &file.source.force)?;
        let polarity = parse("source.polarity", &file.source.polarity)?;
        let density = match (p.kind(), &file.source.density) {
            (_, None) => None,
            (ModelKind::Compressible, Some(given)) => Some(self.formula("source.density", given, &p.symbols())?),
            (ModelKind::Incompressible, Some(given)) => {
                let shown = format!("\"{given}\"");
                return Err(self.error("source.density", shown, CONSTANT_DENSITY, WRONG_KIND));
            }
        };
        let exact = file.exact.as_ref().map(|table| Ok((self.exact(table, p)?, table.boundary))).transpose()?;
        Ok(Sources { force, polarity, density, ..exact_sources(exact) })
    }

    /// Those of a Stokes flow.
    pub(super) fn sources_of_flow(&self, file: &StokesFile, symbols: &[(&str, f64)]) -> Result<Sources, SceneError> {
        let force = file.source.as_ref().map(|table| self.pair("source.force", &table.force, symbols)).transpose()?;
        let of = |table: &StokesExact| {
            let velocity = self.pair("exact.velocity", &table.velocity, symbols)?;
            let pressure = self.formula("exact.pressure", &table.pressure, symbols)?;
            Ok((Exact::stokes(velocity, pressure), table.boundary))
        };
        let exact = file.exact.as_ref().map(of).transpose()?;
        let bodies = !(file.body.is_empty() && file.bodies.is_empty());
        let rule = "exact fields are those of a flow without bodies: at the edge of a rigid one they would have a \
                    kink, and no force that makes them a solution";
        let hint = "remove the bodies, or take a mesh with holes in their places";
        self.require(exact.is_none() || !bodies, "exact", "(given)", rule, hint)?;
        Ok(Sources { force, ..exact_sources(exact) })
    }

    fn exact(&self, table: &ExactTable, p: &Parameters) -> Result<Exact, SceneError> {
        let velocity = self.vector("exact.velocity", &table.velocity, p)?;
        let exact = match (p.kind(), &table.pressure, &table.density) {
            (ModelKind::Incompressible, _, Some(given)) => {
                return Err(self.error("exact.density", format!("\"{given}\""), CONSTANT_DENSITY, WRONG_KIND));
            }
            (ModelKind::Incompressible, None, None) => {
                return Err(self.missing("exact", "pressure", "add `pressure = …` to [exact]"));
            }
            (ModelKind::Incompressible, Some(pressure), None) => {
                let pressure = self.formula("exact.pressure", pressure, &p.symbols())?;
                Exact::new(velocity, pressure, self.vector("exact.polarity", &table.polarity, p)?)
            }
            (ModelKind::Compressible, Some(given), _) => {
                let rule = "the pressure of a compressible sheet follows from its density";
                let hint = "remove it and give `density`";
                return Err(self.error("exact.pressure", format!("\"{given}\""), rule, hint));
            }
            (ModelKind::Compressible, None, None) => {
                return Err(self.missing("exact", "density", "add `density = …` to [exact]"));
            }
            (ModelKind::Compressible, None, Some(density)) => {
                let density = self.density("exact.density", density, p)?;
                Exact::compressible(velocity, density, self.vector("exact.polarity", &table.polarity, p)?)
            }
        };
        exact.map_err(|error| self.model("exact", ModelError::of_expression("polarity", &error)))
    }
}
