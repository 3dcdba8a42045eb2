//! The rules of `maps`.

use std::collections::BTreeSet;

use super::outputs::Scope;
use super::strain::NO_STRAIN;
use super::{Checker, broken_by};
use crate::measure::fields::Tool;
use crate::model::{ModelKind, Parameters};
use crate::names::absent;
use crate::output::plot;
use crate::output::plot::map::{LONGEST, Window};
use crate::scene::StrainSettings;
use crate::scene::error::SceneError;
use crate::scene::kinds::SceneKind;
use crate::scene::maps::{ArrowsOf, MapOptions, MapRequest, MapTable, Quantity};
use crate::scene::output::Output;

impl Checker<'_> {
    pub(super) fn maps(&self, key: &str, maps: &[MapTable], p: &Parameters) -> Result<Vec<MapRequest>, SceneError> {
        let numbered = maps.iter().enumerate();
        numbered.map(|(at, map)| self.map(&format!("{key}.maps.{at}"), map, p)).collect()
    }

    fn map(&self, key: &str, table: &MapTable, p: &Parameters) -> Result<MapRequest, SceneError> {
        let of_key = match table {
            MapTable::Quantity(_) => key.to_owned(),
            MapTable::Options(_) => format!("{key}.of"),
        };
        let options = table.options();
        if let Err(broken) = options.check(p) {
            let key = if broken.key == "of" { of_key } else { format!("{key}.{}", broken.key) };
            return Err(self.error(&key, broken.value, &broken.rule, &broken.hint));
        }
        self.map_request(key, options)
    }

    fn map_request(&self, key: &str, options: MapOptions) -> Result<MapRequest, SceneError> {
        let rule = absent(plot::FEATURE, plot::DOES);
        let hint = "remove the maps; fields and cuts tell the same, or build with `--features pictures`";
        self.require(cfg!(feature = "pictures"), key, "(given)", &rule, hint)?;
        let MapOptions { of, name, arrows, streamlines, mesh, window, range } = options;
        let name = name.unwrap_or_else(|| of.file_name());
        self.file_name(&format!("{key}.name"), &name, "such as \"wake\"")?;
        Ok(MapRequest { name, of, arrows, streamlines, mesh, window, range })
    }

    /// A picture of a flow, or of the bodies alone, in a scene that is no tissue.
    pub(super) fn map_without_tissue(
        &self,
        key: &str,
        table: &MapTable,
        scope: Scope,
    ) -> Result<MapRequest, SceneError> {
        let options = table.options();
        let of_key = match table {
            MapTable::Quantity(_) => key.to_owned(),
            MapTable::Options(_) => format!("{key}.of"),
        };
        let checked = if !scope.kind.fields.is_empty() && options.of != Quantity::Bodies {
            options.check_of(scope.kind)
        } else {
            let rule = format!("{} has no map of it", scope.kind.shown);
            let shown = format!("\"{}\"", options.of.name());
            self.require(options.of == Quantity::Bodies, &of_key, shown, &rule, "take maps = [\"bodies\"]")?;
            let field = options.arrows.is_some() || options.streamlines || options.mesh || options.range.is_some();
            let rule = "a picture of the bodies has no field for `arrows`, `streamlines`, `mesh` and `range`";
            self.require(!field, key, "(a table)", rule, "only `name` and `window` have a meaning")?;
            let (rule, hint) = ("the scene has no rigid body", "add a [[body]], or remove it");
            self.require(!scope.bodies.is_empty(), &of_key, "\"bodies\"", rule, hint)?;
            options.check_frame()
        };
        if let Err(broken) = checked {
            let key = if broken.key == "of" { of_key } else { format!("{key}.{}", broken.key) };
            return Err(self.error(&key, broken.value, &broken.rule, &broken.hint));
        }
        self.map_request(key, options)
    }

    /// Maps of one name would overwrite each other's pictures.
    pub(super) fn one_picture_each(&self, outputs: &[Output]) -> Result<(), SceneError> {
        let mut names = BTreeSet::new();
        for (at, output) in outputs.iter().enumerate() {
            for map in output.what.maps() {
                let rule = "two maps have this name, and would write the same file";
                let hint = "give every map a `name` of its own; without one it has that of its quantity";
                let shown = format!("\"{}\"", map.name);
                self.require(names.insert(&map.name), &format!("output.{at}.maps"), shown, rule, hint)?;
            }
        }
        Ok(())
    }
}

/// A rule of maps that an option breaks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{key}` = {value}: {rule}; hint: {hint}")]
pub struct MapRule {
    /// Of the option.
    pub key: &'static str,
    /// As it was given.
    pub value: String,
    /// What is broken.
    pub rule: String,
    /// What to do.
    pub hint: String,
}

impl MapOptions {
    /// Whether a model has what the map shows, and whether window and range can be drawn.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn check(&self, p: &Parameters) -> Result<(), MapRule> {
        let broken = |key: &'static str, value: String, rule: &str, hint: &str| {
            Err(MapRule { key, value, rule: rule.to_owned(), hint: hint.to_owned() })
        };
        self.check_frame()?;
        if self.of == Quantity::Bodies {
            let rule = "the rigid bodies of a tissue are drawn on the maps of its fields";
            return broken("of", "\"bodies\"".into(), rule, "take a map of a field, such as \"speed\"");
        }
        let arrows = self.arrows.map(|arrows| arrows.0);
        for (key, name, field) in
            [("of", self.of.name(), self.of.field())].into_iter().chain(arrows.map(|a| ("arrows", a.name, Some(a))))
        {
            if let Some((rule, hint)) = field.and_then(|field| broken_by(field, p)) {
                return broken(key, format!("\"{name}\""), rule, hint);
            }
        }
        if self.streamlines && p.kind() == ModelKind::Compressible {
            let rule = "the flow of a compressible sheet has no stream function whose contours are streamlines";
            return broken("streamlines", "true".into(), rule, "remove it; arrows = \"velocity\" shows the flow");
        }
        Ok(())
    }

    /// Whether a tissue with these settings of the elastic strain has the fields that the map shows; those that are in
    /// a scene are refused with its outputs.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn check_strain(&self, settings: Option<StrainSettings>) -> Result<(), MapRule> {
        match self.of.field().filter(|field| settings.is_none() && field.tool == Some(Tool::Strain)) {
            Some(_) => Err(MapRule {
                key: "of",
                value: format!("\"{}\"", self.of.name()),
                rule: NO_STRAIN.to_owned(),
                hint: "take another quantity".to_owned(),
            }),
            None => Ok(()),
        }
    }

    /// Whether runs of a kind without a tissue have what is to be drawn.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn check_of(&self, kind: &SceneKind) -> Result<(), MapRule> {
        let broken =
            |key: &'static str, value: String, rule: String, hint: String| Err(MapRule { key, value, rule, hint });
        let drawn = |of: &Quantity| of.field().is_some_and(|field| kind.has(field));
        if !drawn(&self.of) {
            let all: Vec<&str> = Quantity::all().filter(drawn).map(Quantity::name).collect();
            let (name, hint) = (kind.names.join("\" or \""), format!("the fields that it has are {}", all.join(", ")));
            return broken(
                "of",
                format!("\"{}\"", self.of.name()),
                format!("kind = \"{name}\" has no map of it"),
                hint,
            );
        }
        if let Some(ArrowsOf(field)) = self.arrows.filter(|arrows| !kind.has(arrows.0)) {
            let rule = format!("kind = \"{}\" has no such field", kind.names.join("\" or \""));
            return broken(
                "arrows",
                format!("\"{}\"", field.name),
                rule,
                "take arrows = \"velocity\", or remove it".into(),
            );
        }
        self.check_frame()
    }

    /// Whether window and range can be drawn.
    ///
    /// # Errors
    /// The first rule that is broken.
    pub fn check_frame(&self) -> Result<(), MapRule> {
        let broken = |key: &'static str, value: String, rule: &str, hint: &str| {
            Err(MapRule { key, value, rule: rule.to_owned(), hint: hint.to_owned() })
        };
        if let Some([low, high]) = self.window
            && Window::new(low, high).is_err()
        {
            let shown = format!("[[{}, {}], [{}, {}]]", low[0], low[1], high[0], high[1]);
            let rule = format!(
                "must be the lower left and the upper right corner, finite, and at most {LONGEST} times as long as wide or high"
            );
            return broken("window", shown, &rule, "such as [[-5, -5], [10, 5]]");
        }
        if let Some([low, high]) = self.range
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            let rule = "must be two finite numbers, the smaller one first";
            return broken("range", format!("[{low}, {high}]"), rule, "such as [0, 1.5]");
        }
        Ok(())
    }
}
