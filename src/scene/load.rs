//! From a scene file and the overrides of the command line to a [`Scene`].

use std::path::{Path, PathBuf};

use toml::de::DeTable;
use toml::{Table, Value};

use super::key::{Caret, KeyPath};
use super::{Invalid, Scene, SceneError, check, later, shape};

/// What the command line changes in a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// `key=value` texts, as in `contact.grain.restitution=0.5` or `source[0].count=10`. Values are TOML, but a string needs
    /// no quotes. Later ones win.
    pub set: Vec<String>,
    /// Another seed, at most `i64::MAX` (the largest whole number of TOML).
    pub seed: Option<u64>,
    /// Another end of the run, s.
    pub until: Option<f64>,
}

/// One value that the command line changed.
#[derive(Clone, Debug)]
struct Override {
    typed: String,
    path: KeyPath,
}

/// A scene that has been read and validated, with what is needed to point at the place of a value.
///
/// ```
/// use impinge::scene::{Overrides, SceneFile};
///
/// let text = r#"
///     [run]
///     until = 1.0
///     [domain]
///     min = [0, 0, 0]
///     max = [1, 1, 1]
///     [grain]
///     radius = 0.01
///     density = 2500
///     [contact.grain]
///     restitution = 0.9
///     [[source]]
///     kind = "block"
///     min = [0.1, 0.1, 0.1]
///     max = [0.9, 0.9, 0.9]
///     count = 100
///     velocity = [0, 0, -1]
/// "#;
/// let overrides = Overrides { set: vec!["grain.radius=0.02".into()], ..Overrides::default() };
/// let file = SceneFile::parse("jet.toml".as_ref(), text, &overrides)?;
/// assert_eq!(file.scene.source.len(), 1);
///
/// let wrong = SceneFile::parse("jet.toml".as_ref(), &text.replace("0.9\n", "1.9\n"), &overrides).unwrap_err();
/// assert!(wrong.to_string().starts_with("jet.toml:11:19: contact.grain.restitution: 1.9"));
/// # Ok::<(), impinge::scene::SceneError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// The scene, overrides included.
    pub scene: Scene,
    path: PathBuf,
    text: String,
    overrides: Vec<Override>,
}

impl SceneFile {
    /// Reads and validates a scene file.
    ///
    /// # Errors
    /// What is wrong with the file or an override, where, and what to do about it.
    pub fn read(path: &Path, overrides: &Overrides) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path).map_err(|error| SceneError::unreadable(path, &error))?;
        Self::parse(path, &text, overrides)
    }

    /// The same from a text; `path` names it in errors, and other files are looked for beside it.
    ///
    /// # Errors
    /// As [`SceneFile::read`].
    pub fn parse(path: &Path, text: &str, overrides: &Overrides) -> Result<Self, SceneError> {
        let mut table: Table = text.parse().map_err(|error| syntax(path, text, &error))?;
        let overrides = apply(&mut table, path, overrides)?;
        let place = Place { path, text, overrides: &overrides };

        later::refuse(&mut table).map_err(|invalid| place.of(invalid, Caret::Value))?;
        shape::check(&table).map_err(|(invalid, caret)| place.of(invalid, caret))?;
        let scene: Scene = table.try_into().map_err(|error| syntax(path, text, &error))?;
        check::check(&scene).map_err(|invalid| place.of(invalid, Caret::Value))?;
        Ok(Self { scene, path: path.to_owned(), text: text.to_owned(), overrides })
    }

    /// The folder of the scene file; paths in the scene are relative to it.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// The path of the scene file, as it was given.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Says where a value that turned out to be unusable stands: in this file, or in an override.
    #[must_use]
    pub fn locate(&self, invalid: Invalid) -> SceneError {
        Place { path: &self.path, text: &self.text, overrides: &self.overrides }.of(invalid, Caret::Value)
    }
}

/// Where values come from.
struct Place<'a> {
    path: &'a Path,
    text: &'a str,
    overrides: &'a [Override],
}

impl Place<'_> {
    fn of(&self, invalid: Invalid, caret: Caret) -> SceneError {
        let what = invalid.to_string();
        let Some(key) = KeyPath::parse(&invalid.key) else {
            return SceneError::at(self.path, self.text, 0..0, what, invalid.remedy);
        };
        let (bytes, depth) = match DeTable::parse(self.text) {
            Ok(root) => key.find(&root, caret),
            Err(_) => (0..0, 0),
        };
        // An override is to blame when it gave the value, or the table around it, or made a way that the file does not have.
        let to_blame = |o: &&Override| key.common(&o.path) == o.path.len() || key.common(&o.path) > depth;
        match self.overrides.iter().rev().find(to_blame) {
            Some(culprit) => SceneError::typed(self.path, &culprit.typed, what, invalid.remedy),
            None => SceneError::at(self.path, self.text, bytes, what, invalid.remedy),
        }
    }
}

/// A text that is not TOML.
fn syntax(path: &Path, text: &str, error: &toml::de::Error) -> SceneError {
    let end = text.trim_end().len();
    let bytes = error.span().unwrap_or(end..end);
    let remedy = "correct the line; https://toml.io/en shows how TOML is written".to_owned();
    SceneError::at(path, text, bytes, format!("not valid TOML: {}", error.message()), remedy)
}

fn apply(table: &mut Table, path: &Path, overrides: &Overrides) -> Result<Vec<Override>, SceneError> {
    let mut applied = Vec::new();
    for text in &overrides.set {
        let typed = format!("--set {text}");
        let parts = text.split_once('=').and_then(|(key, value)| Some((KeyPath::parse(key)?, value.trim())));
        let Some((key, value)) = parts else {
            let remedy = "write `--set key=value`, as in `--set contact.grain.restitution=0.5`".to_owned();
            return Err(SceneError::typed(path, &typed, "this is not key=value".to_owned(), remedy));
        };
        // What is not TOML is taken as a string without quotes; where no string belongs, the walk says what does.
        let value = value.parse().unwrap_or_else(|_| Value::String(value.to_owned()));
        applied.push((typed, key, value));
    }
    if let Some(seed) = overrides.seed {
        let value = i64::try_from(seed).map_or_else(|_| Value::String(seed.to_string()), Value::Integer);
        applied.push((format!("--seed {seed}"), KeyPath::parse("seed").expect("a path"), value));
    }
    if let Some(until) = overrides.until {
        applied.push((format!("--until {until}"), KeyPath::parse("run.until").expect("a path"), Value::Float(until)));
    }
    let put = |(typed, key, value): (String, KeyPath, Value)| match key.set(table, value) {
        Ok(()) => Ok(Override { typed, path: key }),
        Err((what, remedy)) => Err(SceneError::typed(path, &typed, what, remedy)),
    };
    applied.into_iter().map(put).collect()
}
