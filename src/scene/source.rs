//! A scene as text with overrides: reading it, [`SceneSource::set`], and the place of every key.

use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use toml_edit::{Document, DocumentMut, Item};

use super::edit;
use super::error::{Place, SceneError};
use super::particles::ParticlesFile;
use super::renamed;
use super::stokes::StokesFile;
use super::tables::SceneFile;
use super::translate;
use super::{locate, path};
use crate::mesh::generate::MeshScene;
use crate::names;

/// What a scene is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneKind {
    /// `"incompressible"` and `"compressible"`, and whatever is no kind at all.
    Tissue,
    /// `"stokes"`
    Stokes,
    /// `"particles"`
    Particles,
}

impl SceneKind {
    /// Every kind of scene.
    pub const ALL: [SceneKind; 3] = [SceneKind::Tissue, SceneKind::Stokes, SceneKind::Particles];

    /// By the text of `model.kind`.
    pub fn of(kind: &str) -> Self {
        match kind {
            "stokes" => SceneKind::Stokes,
            "particles" => SceneKind::Particles,
            _ => SceneKind::Tissue,
        }
    }

    /// As in messages.
    pub fn shown(self) -> &'static str {
        match self {
            SceneKind::Tissue => "tissue (kind = \"incompressible\" or \"compressible\")",
            SceneKind::Stokes => "a Stokes flow (kind = \"stokes\")",
            SceneKind::Particles => "particles (kind = \"particles\")",
        }
    }
}

/// A scene that is well-formed TOML; nothing else is checked yet.
#[derive(Debug, Clone)]
pub struct SceneSource {
    /// The file, as messages name it.
    origin: String,
    /// Where relative paths in the scene start.
    folder: PathBuf,
    /// The file's own text, which line numbers refer to.
    original: String,
    /// The text with the overrides.
    document: DocumentMut,
    /// Paths that were set, in order, with bodies by their numbers, and as they were given.
    set: Vec<(String, String)>,
    /// Words that have another name today.
    notes: Vec<String>,
}

impl SceneSource {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read or is not TOML.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path).map_err(|error| SceneError::Unreadable {
            file: path.display().to_string(),
            reason: error.to_string(),
            hint: "give the path of a scene, a TOML text such as studies/strip/strip.toml",
        })?;
        Self::parse(&text, path)
    }

    /// Takes a text; `origin` is its file, for messages and relative paths.
    ///
    /// # Errors
    /// A text that is not TOML.
    pub fn parse(text: &str, origin: &Path) -> Result<Self, SceneError> {
        let name = origin.display().to_string();
        let (text, notes) = renamed::modern(text);
        let text = text.as_str();
        let document = text.parse::<DocumentMut>().map_err(|error| {
            let line = error.span().map(|span| locate::line(text, span.start));
            let what = error.message().replace('\n', ", ");
            let twice = what.contains("duplicate");
            let hint = match error.span().and_then(|span| locate::key_with_accents(text, span.start)) {
                _ if twice => "give each key once".to_owned(),
                Some(key) => format!("keys are plain letters, digits and _, and `{key}` is none{}", symbol_hint(key)),
                None => "a text value needs quotes, a table starts with [name]".to_owned(),
            };
            SceneError::Syntax { place: Box::new(Place::Line { file: name.clone(), line }), what, hint }
        })?;
        let folder = origin.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self { origin: name, folder, original: text.to_owned(), document, set: Vec::new(), notes })
    }

    /// Puts `value` at the dotted `path`, as in `model.peclet`, `boundary.inlet.velocity`, `boundary."my
    /// wall".velocity` or `output.0.every.time`.
    ///
    /// The value is a TOML value, or else a string without its quotes (`slip`, `1 - y^2`). An empty value removes the
    /// key, which restores its default. The scene is checked as a whole only by [`super::Scene::check`], so that
    /// several overrides may depend on each other.
    ///
    /// # Errors
    /// A path that no scene has, with the keys that exist there; a value of the wrong type.
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), SceneError> {
        let kind = match path.trim() {
            "model.kind" => SceneKind::of(value.trim().trim_matches('"')),
            _ => self.kind(),
        };
        match kind {
            SceneKind::Tissue => self.set_in::<SceneFile>(path, value),
            SceneKind::Stokes => self.set_in::<StokesFile>(path, value),
            SceneKind::Particles => self.set_in::<ParticlesFile>(path, value),
        }
    }

    /// The command for a text that is a study of scenes, not one of them.
    pub fn study_command(&self) -> Option<&'static str> {
        let has = |key: &str| self.value(key).is_some();
        if !has("scene") {
            return (has("data") && !has("model")).then_some("compare");
        }
        match (has("levels"), has("parameter"), has("setting")) {
            (true, _, _) => Some("order"),
            (false, true, _) => Some("branch"),
            (false, false, true) => Some("tradeoff"),
            (false, false, false) => ["vary", "case", "together", "seeds"].into_iter().any(has).then_some("study"),
        }
    }

    /// What `model.kind` makes of the scene.
    pub fn kind(&self) -> SceneKind {
        let kind = self.value("model").and_then(|model| model.as_table_like()?.get("kind")?.as_str());
        kind.map_or(SceneKind::Tissue, SceneKind::of)
    }

    /// Top-level keys.
    pub(crate) fn names(&self) -> Vec<String> {
        self.document.iter().map(|(name, _)| name.to_owned()).collect()
    }

    /// [`set`](Self::set) for a text that is to become `T`.
    pub(crate) fn set_in<T: DeserializeOwned>(&mut self, path: &str, value: &str) -> Result<(), SceneError> {
        let mut next = self.clone();
        let refused = |rule, hint| {
            let shown: String = path.chars().take(200).collect();
            let place = Box::new(Place::Set { file: self.origin.clone(), path: shown.clone() });
            SceneError::Value { place, key: shown, value: value.trim().to_owned(), rule, hint }
        };
        let (now, note) = renamed::path_now(path.trim());
        next.notes.extend(note.filter(|note| !self.notes.contains(note)));
        let keys = path::split(&now).and_then(|keys| self.by_number(keys));
        let keys = keys.map_err(|(rule, hint)| refused(rule, hint))?;
        let names: Vec<&str> = keys.iter().map(String::as_str).collect();
        let found = edit::set(next.document.as_item_mut(), &names, value.trim());
        if !found.map_err(|refusal| refused(refusal.rule, refusal.hint))? {
            return self.check_absent::<T>(&keys, path);
        }
        next.modernise();
        let joined = path::join(&keys);
        next.set.push((joined.clone(), path.to_owned()));
        match next.tables::<T>() {
            // a preset may fill in what is taken away
            Err(found) if related(&found.0, &joined) && !(value.trim().is_empty() && self.has("accuracy")) => {
                Err(found.1)
            }
            // other keys may still be set; the check reports what remains wrong
            Err(_) | Ok(_) => {
                *self = next;
                Ok(())
            }
        }
    }

    /// Puts what an override has brought into the words of today.
    fn modernise(&mut self) {
        let (text, notes) = renamed::modern(&self.document.to_string());
        if notes.is_empty() {
            return;
        }
        if let Ok(document) = text.parse::<DocumentMut>() {
            self.document = document;
            self.notes.extend(notes);
        }
    }

    /// A note for each word of the text and its overrides that has another name today.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// A key that is to be removed and is not there: one that scenes have is at its default already, another is a
    /// mistake.
    fn check_absent<T: DeserializeOwned>(&self, keys: &[String], path: &str) -> Result<(), SceneError> {
        if let [boundary, tag, ..] = keys
            && boundary == "boundary"
        {
            let table = self.value("boundary").and_then(Item::as_table_like);
            let tags: Vec<String> = table.iter().flat_map(|t| t.iter()).map(|(name, _)| path::quoted(name)).collect();
            let tag = path::quoted(tag);
            if !tags.contains(&tag) {
                let known: Vec<&str> = tags.iter().map(String::as_str).collect();
                let place = Box::new(Place::Set { file: self.origin.clone(), path: path.to_owned() });
                let (suggestion, known) = (names::did_you_mean(&tag, &known), known.join(", "));
                return Err(SceneError::UnknownKey { place, key: format!("boundary.{tag}"), suggestion, known });
            }
        }
        let mut tried = self.clone();
        let names: Vec<&str> = keys.iter().map(String::as_str).collect();
        let joined = path::join(keys);
        if let Err(edit::Refusal { rule, hint }) = edit::set(tried.document.as_item_mut(), &names, "0") {
            let place = Box::new(Place::Set { file: self.origin.clone(), path: path.to_owned() });
            return Err(SceneError::Value { place, key: joined, value: "(to be removed)".to_owned(), rule, hint });
        }
        tried.set.push((joined.clone(), path.to_owned()));
        match tried.tables::<T>() {
            Err(found) if matches!(found.1, SceneError::UnknownKey { .. }) && related(&found.0, &joined) => {
                Err(found.1)
            }
            Err(_) | Ok(_) => Ok(()),
        }
    }

    /// Keys of a path in which bodies may be named: `body.NAME.density` is `body.2.density` for the third `[[body]]` if
    /// that has
    /// this name; and so are `bodies`.
    ///
    /// # Errors
    /// Rule and hint, where the list has nothing of that name.
    fn by_number(&self, mut keys: Vec<String>) -> Result<Vec<String>, (String, String)> {
        if let [list, name, ..] = &mut keys[..]
            && matches!(list.as_str(), "body" | "bodies")
            && let Some(known) = self.names_of_bodies(list)
        {
            match known.iter().position(|other| other == name) {
                Some(at) => *name = at.to_string(),
                None if name.parse::<usize>().is_ok() => {}
                None => {
                    let known: Vec<&str> = known.iter().map(String::as_str).collect();
                    let rule = format!("no [[{list}]] has the name `{name}`{}", names::did_you_mean(name, &known));
                    return Err((rule, format!("their names are {}; or give a number from 0", known.join(", "))));
                }
            }
        }
        Ok(keys)
    }

    /// Names of the tables `[[body]]` or `[[bodies]]`, given or by default.
    fn names_of_bodies(&self, list: &str) -> Option<Vec<String>> {
        let tables = self.value(list)?.as_array_of_tables()?;
        let default = |at: usize| match (list, at) {
            ("body", at) => format!("body-{}", at + 1),
            (_, 0) => "disc".to_owned(),
            (_, at) => format!("disc{}", at + 1),
        };
        let name = |(at, table): (usize, &toml_edit::Table)| {
            table.get("name").and_then(Item::as_str).map_or_else(|| default(at), str::to_owned)
        };
        Some(tables.iter().enumerate().map(name).collect())
    }

    /// Puts a value under a key, dots and all, into a top-level table, which is made where it is missing.
    pub(crate) fn put(&mut self, table: &str, key: &str, mut value: toml_edit::Value) {
        value.decor_mut().clear();
        let item = self.document.entry(table).or_insert(toml_edit::value(toml_edit::InlineTable::new()));
        if let Some(table) = item.as_table_like_mut() {
            table.insert(key, Item::Value(value));
        }
    }

    /// The tables, with the overrides; an error comes with the key that it concerns.
    pub(crate) fn tables<T: DeserializeOwned>(&self) -> Result<T, Box<(String, SceneError)>> {
        let text = self.document.to_string();
        let tables = toml_edit::de::from_str::<T>(&text).map_err(|error| {
            let found = translate::translate(self, &text, &error);
            Box::new(self.tag_or(translate::elsewhere::<T>(found)))
        })?;
        translate::too_long::<T>(self, &text).map_or(Ok(tables), |found| Err(Box::new(found)))
    }

    /// An error about a tag that the shape of the mesh does not have says so, whatever else is wrong with its table.
    fn tag_or(&self, found: (String, SceneError)) -> (String, SceneError) {
        let keys = path::split(&found.0).unwrap_or_default();
        let tag = keys.get(1).filter(|_| keys[0] == "boundary");
        let unknown = tag.and_then(|tag| self.unknown_tag(tag));
        unknown.map_or(found.clone(), |error| (found.0, error))
    }

    /// The shape of the mesh and its numbers, as far as they can be read whatever is wrong elsewhere in the scene.
    pub(super) fn mesh(&self) -> Option<MeshScene> {
        let table = self.value("mesh")?.as_table_like()?;
        let mut mesh = MeshScene::named(table.get("shape")?.as_str()?)?;
        for (key, item) in table.iter() {
            if let Some(number) = item.as_integer().and_then(|number| u64::try_from(number).ok()) {
                mesh = mesh.with(key, number);
            } else if let Some(number) = item.as_float() {
                mesh = mesh.with(key, number);
            }
        }
        Some(mesh)
    }

    /// Refuses a tag that the shape of the mesh does not have, where the scene names a shape.
    pub(super) fn unknown_tag(&self, tag: &str) -> Option<SceneError> {
        let known = self.mesh()?.tags();
        if known.contains(&tag) {
            return None;
        }
        let (suggestion, known) = (names::did_you_mean(tag, known), known.join(", "));
        Some(SceneError::UnknownTag {
            place: self.place(&format!("boundary.{}", path::quoted(tag))),
            tag: tag.to_owned(),
            suggestion,
            known,
        })
    }

    /// Where `key` was given: the override, the line, or the line of the nearest table around it.
    pub fn place(&self, key: &str) -> Box<Place> {
        let file = self.origin.clone();
        if let Some((_, path)) = self.set.iter().rev().find(|(path, _)| related(key, path)) {
            return Box::new(Place::Set { file, path: path.clone() });
        }
        let line = Document::parse(self.original.as_str())
            .ok()
            .and_then(|document| locate::position(&document, key).map(|at| locate::line(&self.original, at)));
        Box::new(Place::Line { file, line })
    }

    /// Whether there is a top-level `key`.
    pub fn has(&self, key: &str) -> bool {
        self.value(key).is_some()
    }

    /// The top-level value `key`, if it is there.
    pub(crate) fn value(&self, key: &str) -> Option<&Item> {
        self.document.get(key)
    }

    /// What is given at a dotted path.
    pub(crate) fn at(&self, path: &str) -> Option<&Item> {
        let keys = path::split(path).ok()?;
        keys.iter().try_fold(self.document.as_item(), |item, key| item.get(key.as_str()))
    }

    /// The file, as messages name it.
    pub fn origin(&self) -> &str {
        &self.origin
    }

    /// Where relative paths in the scene start.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The scene's text with the overrides, defaults not filled in.
    pub fn text(&self) -> String {
        self.document.to_string()
    }
}

/// What a symbol in the place of a key may have meant.
fn symbol_hint(key: &str) -> String {
    const OF_MODEL: [&str; 9] =
        ["kind", "friction", "beta", "traction", "active_stress", "peclet", "coherence", "elasticity", "alignment"];
    names::did_you_mean(key, &OF_MODEL)
}

/// Whether one dotted path contains the other.
fn related(a: &str, b: &str) -> bool {
    let inside = |inner: &str, outer: &str| {
        inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    inside(a, b) || inside(b, a)
}
