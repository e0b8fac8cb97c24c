//! What is wrong with a scene, and where.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};

/// A value that cannot be used: which key, what is wrong with it, and what to do about it.
///
/// `key` is the path of the value in the scene file, as in `source[1].count` or `contact.grain.restitution`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {what}")]
pub struct Invalid {
    /// Path of the key in the scene file.
    pub key: String,
    /// What is wrong, with the value.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
}

impl Invalid {
    /// A value at `key` that cannot be used.
    pub fn new(key: impl Into<String>, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { key: key.into(), what: what.into(), remedy: remedy.into() }
    }
}

/// A scene that cannot be used: what is wrong, where it stands, and what to do about it.
///
/// `{}` gives one line, `file:line:column: what`; as a [`Diagnostic`] it also shows the line with a caret under the value.
#[derive(Debug)]
pub struct SceneError {
    file: PathBuf,
    /// The override that is to blame, as it was typed; none when it is the file.
    typed: Option<String>,
    what: String,
    remedy: String,
    /// Text of the file and the bytes to point at.
    place: Option<Box<(NamedSource<String>, Range<usize>)>>,
}

impl SceneError {
    /// A file that could not be read at all.
    pub(super) fn unreadable(file: &Path, error: &std::io::Error) -> Self {
        Self {
            file: file.to_owned(),
            typed: None,
            what: format!("cannot read the scene file: {error}"),
            remedy: "give the path of a TOML file, as in `impinge run examples/two_grains.toml`".to_owned(),
            place: None,
        }
    }

    /// A fault at some bytes of the file.
    pub(super) fn at(file: &Path, text: &str, bytes: Range<usize>, what: String, remedy: String) -> Self {
        let start = text.floor_char_boundary(bytes.start);
        let place =
            (NamedSource::new(file.to_string_lossy(), text.to_owned()), start..bytes.end.clamp(start, text.len()));
        Self { file: file.to_owned(), typed: None, what, remedy, place: Some(Box::new(place)) }
    }

    /// A fault of an override, `typed` on the command line.
    pub(super) fn typed(file: &Path, typed: &str, what: String, remedy: String) -> Self {
        Self { file: file.to_owned(), typed: Some(typed.to_owned()), what, remedy, place: None }
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &str {
        &self.remedy
    }

    /// Line and column in the file, both from 1; none when the fault is not in the file.
    #[must_use]
    pub fn line_column(&self) -> Option<(usize, usize)> {
        let (source, bytes) = self.place.as_deref()?;
        let before = &source.inner()[..bytes.start];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        Some((line, column))
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some((line, column)) = self.line_column() {
            write!(f, ":{line}:{column}")?;
        }
        if let Some(typed) = &self.typed {
            write!(f, " with `{typed}`")?;
        }
        write!(f, ": {}", self.what)
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(&self.remedy))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_deref().map(|(source, _)| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let (_, bytes) = self.place.as_deref()?;
        Some(Box::new(std::iter::once(LabeledSpan::new(None, bytes.start, bytes.len()))))
    }
}
