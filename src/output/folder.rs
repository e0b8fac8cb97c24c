//! The output folder, and the safety of what is already there.
//!
//! Everything is written into a hidden folder beside the one asked for, and takes its name in one step when it is
//! complete. So a folder of results is always whole, and until then nothing of an earlier run is touched.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::Error;

/// Every name that a run or a study may write; a folder with anything else in it is never replaced.
const NAMES: [&str; 19] = [
    "summary.json",
    "grains.csv",
    "events.csv",
    "series.csv",
    "surface_hits.csv",
    "grains.pvd",
    "frames",
    "surface.vtp",
    "energy_history.svg",
    "jet_side.svg",
    "energy_by_hit_order.svg",
    "impacts.svg",
    "compare.csv",
    "ensemble.csv",
    "speed_against_error.svg",
    "verdict.md",
    "tables",
    "pictures",
    "measures",
];

/// A folder of results in the making.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    staging: TempDir,
    force: bool,
}

impl Folder {
    /// Begins a folder of results that will be called `target`; with `force` it may replace those of an earlier run.
    ///
    /// # Errors
    /// [`Error::Occupied`] if there are results and no `force`; [`Error::Foreign`] or [`Error::NotAFolder`] if what is there
    /// was not written by a run; [`Error::Write`] if nothing can be written there.
    pub fn begin(target: &Path, force: bool) -> Result<Self, Error> {
        let fail = |source| Error::Write { path: target.to_owned(), source };
        // A link is followed, so that its aim is replaced and not the link.
        let target = if target.exists() { target.canonicalize() } else { std::path::absolute(target) }.map_err(fail)?;
        may_replace(&target, force)?;
        let parent = target.parent().ok_or_else(|| Error::NotAFolder { path: target.clone() })?;
        // The error of the system does not say which of the folders on the way is none.
        if let Some(file) = parent.ancestors().find(|path| path.exists()).filter(|path| !path.is_dir()) {
            return Err(Error::NotAFolder { path: file.to_owned() });
        }
        fs::create_dir_all(parent).map_err(|source| Error::Write { path: parent.to_owned(), source })?;
        let staging = beside(&target, "partial").map_err(|source| Error::Write { path: target.clone(), source })?;
        Ok(Self { target, staging, force })
    }

    /// Where the results will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Creates a file, and the folders that lead to it.
    ///
    /// # Errors
    /// [`Error::Write`], under the name that the file was to have.
    pub fn create(&self, name: &str) -> Result<BufWriter<File>, Error> {
        let path = self.staging.path().join(name);
        let folder = path.parent().unwrap_or(&path);
        fs::create_dir_all(folder).and_then(|()| File::create(&path)).map(BufWriter::new).map_err(self.failed(name))
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// [`Error::Write`], under the name that the file was to have.
    pub fn write(&self, name: &str, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
        let mut file = self.create(name)?;
        content(&mut file).and_then(|()| file.flush()).map_err(self.failed(name))
    }

    /// Makes an error out of a failure to write `name`.
    pub fn failed(&self, name: &str) -> impl Fn(io::Error) -> Error {
        let path = self.target.join(name);
        move |source| Error::Write { path: path.clone(), source }
    }

    /// Gives the complete results their name, and removes those that they replace.
    ///
    /// # Errors
    /// [`Error::Place`] if that cannot be done: the earlier results stand, and the new ones stay where they are. Without
    /// `force` that is also so if another run has put its results there in the meantime. [`Error::Leftover`] if only the
    /// earlier results could not be removed.
    pub fn finish(self) -> Result<PathBuf, Error> {
        let Self { target, staging, force } = self;
        let kept = staging.keep();
        let misplaced = |source| Error::Place { folder: target.clone(), kept: kept.clone(), source };
        let replaced = if force && target.exists() { Some(set_aside(&target).map_err(misplaced)?) } else { None };
        // Renaming over a folder fails unless it is empty, so results that appeared meanwhile are safe.
        if let Err(source) = fs::rename(&kept, &target) {
            if let Some(earlier) = &replaced {
                fs::rename(earlier, &target).map_err(misplaced)?;
            }
            return Err(misplaced(source));
        }
        match replaced {
            Some(kept) => fs::remove_dir_all(&kept).map(|()| target).map_err(|source| Error::Leftover { kept, source }),
            None => Ok(target),
        }
    }

    /// Keeps what was written of a run that had to stop, beside the folder that it was meant for, and says where.
    #[must_use]
    pub fn keep_partial(self) -> PathBuf {
        let staging = self.staging.keep();
        let stopped = (1..).map(|count| {
            sibling(&self.target, &if count == 1 { ".stopped".into() } else { format!(".stopped-{count}") })
        });
        match stopped.into_iter().find(|path| !path.exists()) {
            Some(path) if fs::rename(&staging, &path).is_ok() => path,
            _ => staging,
        }
    }
}

/// Checks that what is at `target` may be replaced by results.
fn may_replace(target: &Path, force: bool) -> Result<(), Error> {
    if !target.exists() {
        return Ok(());
    }
    if !target.is_dir() {
        return Err(Error::NotAFolder { path: target.to_owned() });
    }
    let unreadable = |source| Error::Write { path: target.to_owned(), source };
    let names: io::Result<Vec<String>> = fs::read_dir(target)
        .map_err(unreadable)?
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect();
    let names = names.map_err(unreadable)?;
    if let Some(stranger) = names.iter().find(|name| !NAMES.contains(&name.as_str())) {
        return Err(Error::Foreign { folder: target.to_owned(), stranger: stranger.clone() });
    }
    if names.is_empty() || force { Ok(()) } else { Err(Error::Occupied { folder: target.to_owned() }) }
}

/// Moves the folder at `target` to a name beside it that nobody else uses.
fn set_aside(target: &Path) -> io::Result<PathBuf> {
    let aside = beside(target, "replaced")?;
    fs::rename(target, aside.path())?; // onto an empty folder
    Ok(aside.keep())
}

/// A new hidden folder beside `target`, as open to others as any folder that the user makes.
fn beside(target: &Path, kind: &str) -> io::Result<TempDir> {
    let parent = target.parent().unwrap_or(target);
    let prefix = format!(".{}.", target.file_name().unwrap_or_default().to_string_lossy());
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777)); // less the umask; alone it would be 0o700
    builder.prefix(&prefix).suffix(&format!(".{kind}")).tempdir_in(parent)
}

fn sibling(target: &Path, ending: &str) -> PathBuf {
    let mut name = target.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    target.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results(target: &Path, force: bool, content: &str) -> Result<PathBuf, Error> {
        let folder = Folder::begin(target, force)?;
        folder.write("summary.json", |file| file.write_all(content.as_bytes()))?;
        folder.finish()
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn results_appear_whole_and_nothing_is_left_beside_them() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("new/deep/jet");
        let folder = Folder::begin(&target, false).unwrap();
        folder.write("frames/grains_0000.vtp", |file| file.write_all(b"frame")).unwrap();
        assert!(!target.exists());
        assert_eq!(folder.finish().unwrap(), target);
        assert_eq!(fs::read(target.join("frames/grains_0000.vtp")).unwrap(), b"frame");
        assert_eq!(names(target.parent().unwrap()), ["jet"]);
    }

    #[test]
    fn earlier_results_are_not_replaced_unasked() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        results(&target, false, "one").unwrap();
        let error = results(&target, false, "two").unwrap_err();
        assert!(matches!(error, Error::Occupied { .. }));
        assert!(error.remedy().contains("--force"));
        assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "one");
        results(&target, true, "three").unwrap();
        assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "three");
        assert_eq!(names(home.path()), ["jet"]);
    }

    #[test]
    fn what_no_run_has_written_is_never_replaced() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        results(&target, false, "one").unwrap();
        fs::write(target.join("thesis.tex"), "years of work").unwrap();
        let error = results(&target, true, "two").unwrap_err();
        assert!(error.to_string().contains("thesis.tex"), "{error}");
        fs::write(home.path().join("file"), "").unwrap();
        assert!(matches!(results(&home.path().join("file"), true, ""), Err(Error::NotAFolder { .. })));
        assert_eq!(names(&target), ["summary.json", "thesis.tex"]);
    }

    #[test]
    fn a_forced_run_that_fails_leaves_the_earlier_results() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        results(&target, false, "one").unwrap();
        let folder = Folder::begin(&target, true).unwrap();
        folder.write("grains.csv", |file| file.write_all(b"half")).unwrap();
        let full = |_: &mut dyn Write| Err(io::Error::from(io::ErrorKind::StorageFull));
        let error = folder.write("summary.json", full).unwrap_err();
        assert!(error.to_string().contains("jet/summary.json"), "{error}");
        assert!(error.remedy().contains("free some space"));
        drop(folder);
        assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "one");
        assert_eq!(names(home.path()), ["jet"]);
    }

    #[test]
    fn results_that_appeared_meanwhile_are_safe_and_so_are_the_new_ones() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        let late = Folder::begin(&target, false).unwrap();
        late.write("summary.json", |file| file.write_all(b"late")).unwrap();
        results(&target, false, "early").unwrap();
        let Err(Error::Place { kept, .. }) = late.finish() else { panic!("replaced") };
        assert_eq!(fs::read_to_string(target.join("summary.json")).unwrap(), "early");
        assert_eq!(fs::read_to_string(kept.join("summary.json")).unwrap(), "late");
    }

    #[test]
    fn a_stopped_run_keeps_what_it_wrote_beside_the_folder() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("jet");
        for name in ["jet.stopped", "jet.stopped-2"] {
            let folder = Folder::begin(&target, false).unwrap();
            folder.write("series.csv", |file| file.write_all(b"rows")).unwrap();
            assert_eq!(folder.keep_partial(), home.path().join(name));
        }
        assert_eq!(names(home.path()), ["jet.stopped", "jet.stopped-2"]);
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_the_results_as_the_umask_says() {
        use std::os::unix::fs::PermissionsExt;
        let home = tempfile::tempdir().unwrap();
        let plain = home.path().join("plain");
        fs::create_dir(&plain).unwrap();
        let target = results(&home.path().join("jet"), false, "one").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&target), mode(&plain));
    }

    #[test]
    fn a_place_that_cannot_be_written_to_is_an_error_that_names_it() {
        let home = tempfile::tempdir().unwrap();
        fs::write(home.path().join("file"), "").unwrap();
        let error = Folder::begin(&home.path().join("file/jet"), false).unwrap_err();
        assert!(error.to_string().contains("file"), "{error}");
    }
}
