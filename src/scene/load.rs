//! From a scene file and the overrides of the command line to a [`Scene`].

use std::path::{Path, PathBuf};

use toml::de::DeTable;
use toml::{Table, Value};

use super::key::{Caret, KeyPath};
use super::{Invalid, Scene, SceneError, check, shape};

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

#[cfg(test)]
mod tests {
    use super::super::{Friction, Interference, Radius, Source};
    use super::*;

    /// Every kind of source and surface, every form of radius, friction, shape and flow, every key.
    const EVERYTHING: &str = include_str!("../../tests/everything.toml");

    fn with(overrides: &Overrides) -> Result<SceneFile, SceneError> {
        SceneFile::parse("all.toml".as_ref(), EVERYTHING, overrides)
    }

    fn set(texts: &[&str]) -> Overrides {
        Overrides { set: texts.iter().map(|text| (*text).to_owned()).collect(), ..Overrides::default() }
    }

    #[test]
    fn what_passes_the_walk_is_read_and_survives_writing() -> Result<(), SceneError> {
        let scene = with(&Overrides::default())?.scene;
        let written = toml::to_string(&scene).expect("a scene can be written");
        let again = SceneFile::parse("again.toml".as_ref(), &written, &Overrides::default())?;
        assert_eq!(again.scene, scene);
        Ok(())
    }

    #[test]
    fn overrides_reach_tables_arrays_and_strings() -> Result<(), SceneError> {
        let scene = with(&set(&[
            "source[1].count=11",
            "source.2.cells.0=5",
            "run.interference=none",
            "grain.radius=0.5",
            "contact.grain.friction.static=0.4",
            "title=jet = two",
            "seed=3",
            "seed=4",
        ]))?
        .scene;
        assert!(matches!(&scene.source[1], Source::Block(block) if block.count == 11));
        assert!(matches!(&scene.source[2], Source::Lattice(lattice) if lattice.cells == [5, 2, 3]));
        assert_eq!(scene.run.interference, Interference::None);
        assert_eq!(scene.grain.radius, Radius::Constant(0.5));
        let friction = scene.contact.grain.map(|contact| contact.friction);
        assert!(matches!(friction, Some(Friction::StaticDynamic(mu)) if (mu.static_, mu.dynamic) == (0.4, 0.2)));
        assert_eq!((scene.title.as_str(), scene.seed), ("jet = two", 4));
        Ok(())
    }

    #[test]
    fn seed_and_until_have_flags_of_their_own() -> Result<(), SceneError> {
        let scene = with(&Overrides { seed: Some(9), until: Some(3.5), ..Overrides::default() })?.scene;
        assert_eq!((scene.seed, scene.run.until), (9, 3.5));
        Ok(())
    }

    #[test]
    fn a_later_fault_is_blamed_on_the_override_that_gave_the_value() -> Result<(), SceneError> {
        let file = with(&set(&["source[1].count=5"]))?;
        let fault = |key: &str| file.locate(Invalid::new(key, "odd", "change it")).to_string();
        let line = |text: &str| 1 + EVERYTHING[..EVERYTHING.find(text).expect("it is there")].matches('\n').count();
        assert_eq!(fault("source[1].count"), "all.toml with `--set source[1].count=5`: source[1].count: odd");
        let cv = format!("all.toml:{}:30: source[1].radius.cv: odd", line("cv = 0.11"));
        assert_eq!(fault("source[1].radius.cv"), cv);
        // A key that is not in the file is shown at its table.
        let table = line("kind = \"lattice\"") - 1;
        assert_eq!(fault("source[2].spin"), format!("all.toml:{table}:1: source[2].spin: odd"));
        Ok(())
    }

    #[test]
    fn two_flows_at_once_are_refused() {
        let both = set(&["source[3].flow={ volume_fraction = 0.1, number_flux = 3 }"]);
        let error = with(&both).expect_err("only one may be given");
        assert!(error.to_string().contains("does not go with the other keys"), "{error}");
        assert!(error.remedy().contains("give { volume_fraction } or { number_flux }"), "{}", error.remedy());
    }
}
