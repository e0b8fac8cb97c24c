//! What can go wrong with an output folder, and what to do about it.

use std::io;
use std::path::PathBuf;

/// Why results could not be written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// There are results already.
    #[error("{} holds the results of an earlier run", .folder.display())]
    Occupied {
        /// The folder asked for.
        folder: PathBuf,
    },
    /// The folder holds something that no run has written, so it may not be replaced.
    #[error("{} holds `{stranger}`, which no run has written", .folder.display())]
    Foreign {
        /// The folder asked for.
        folder: PathBuf,
        /// The first such name in it.
        stranger: String,
    },
    /// What is there is no folder.
    #[error("{} is not a folder", .path.display())]
    NotAFolder {
        /// The path asked for.
        path: PathBuf,
    },
    /// A file or folder could not be written.
    #[error("cannot write {}: {source}", .path.display())]
    Write {
        /// Which one, by the name it was to have.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A run was stopped because something could not be written; what had been written is kept.
    #[error("{cause}; what was written before is in {}", .kept.display())]
    Stopped {
        /// What could not be written.
        cause: Box<Error>,
        /// Where the rest is.
        kept: PathBuf,
    },
    /// The results are complete, but could not be put in their place.
    #[error("the results could not be moved to {}: {source}", .folder.display())]
    Place {
        /// Where they were to be.
        folder: PathBuf,
        /// Where they are.
        kept: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The results are in their place; the earlier ones that they replace could not be removed.
    #[error("the earlier results could not be removed from {}: {source}", .kept.display())]
    Leftover {
        /// Where they are.
        kept: PathBuf,
        /// Why.
        source: io::Error,
    },
}

impl Error {
    /// What the user can do about it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::Occupied { .. } => "name another folder with -o, or replace these results with --force".into(),
            Self::Foreign { .. } => "move it elsewhere, or name another folder with -o".into(),
            Self::NotAFolder { .. } => "name another folder with -o".into(),
            Self::Write { source, .. } => match source.kind() {
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
                    "free some space, or name a folder on another disk with -o; fewer `run.frames` need less".into()
                }
                io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                    "name a folder that you may write to with -o".into()
                }
                _ => "name another folder with -o".into(),
            },
            Self::Stopped { cause, .. } => cause.remedy(),
            Self::Place { kept, .. } => format!("they are complete in {}; move them by hand", kept.display()),
            Self::Leftover { kept, .. } => format!("the new results are in place; remove {} by hand", kept.display()),
        }
    }
}
