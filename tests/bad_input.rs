//! Bad input: one clear message that names file, line, key, value and remedy; an exit code; no panic.
//!
//! `tests/bad` holds one scene for each fault. Comment lines at its top say what the message must contain (`# expect: ...`) and
//! what else stands on the command line (`# arguments: ...`).

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;

fn impinge() -> Command {
    Command::cargo_bin("impinge").expect("the binary is built with the tests")
}

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn files(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(here(folder)).expect("the folder is there");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("it can be read").path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("messages are UTF-8")
}

/// What is wrong with an answer to bad input; nothing when it is as it should be.
fn complaint(output: &Output, code: i32, fragments: &[&str]) -> Option<String> {
    let text = stderr(output);
    let missing: Vec<_> = fragments.iter().filter(|fragment| !text.contains(**fragment)).collect();
    let good = output.status.code() == Some(code)
        && missing.is_empty()
        && !text.contains("panicked")
        && !text.contains('\u{1b}')
        && text.contains("help: ")
        && output.stdout.is_empty();
    (!good).then(|| format!("exit {:?}, without {missing:?}:\n{text}", output.status.code()))
}

#[test]
fn every_bad_scene_gives_its_message() {
    let results = tempfile::tempdir().expect("a folder for results");
    let mut complaints = Vec::new();
    for file in files("tests/bad") {
        let name = file.file_stem().and_then(|stem| stem.to_str()).expect("a plain name");
        let text = fs::read_to_string(&file).expect("it can be read");
        let fragments: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("# expect: ")).collect();
        assert!(!fragments.is_empty(), "{name} expects nothing");
        let arguments =
            text.lines().filter_map(|line| line.strip_prefix("# arguments: ")).flat_map(str::split_whitespace);
        let folder = results.path().join(name);
        let output = impinge().arg("run").arg(&file).arg("-o").arg(&folder).args(arguments).output().expect("it runs");
        complaints.extend(complaint(&output, 2, &fragments).map(|what| format!("{name}: {what}")));
        if folder.exists() {
            complaints.push(format!("{name}: left an output folder behind"));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn every_example_is_valid() {
    for file in files("examples") {
        let read = impinge::scene::SceneFile::read(&file, &impinge::scene::Overrides::default());
        assert!(read.is_ok(), "{}", read.unwrap_err());
    }
}

#[test]
fn a_scene_that_is_not_there() {
    let output = impinge().args(["run", "nowhere.toml"]).output().expect("it runs");
    assert_eq!(
        complaint(&output, 2, &["nowhere.toml: cannot read the scene file", "give the path of a TOML file"]),
        None
    );
}

#[test]
fn a_wrong_command_line_exits_with_2() {
    for arguments in [&["fly"][..], &["run"], &["run", "a.toml", "--seed", "-1"], &["run", "a.toml", "--until", "soon"]]
    {
        let output = impinge().args(arguments).output().expect("it runs");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn the_schema_describes_every_key() {
    let output = impinge().arg("schema").output().expect("it runs");
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(schema["$defs"]["Run"]["properties"]["until"]["description"], "End of the run, s.");
    assert!(output.stderr.is_empty());
}

/// A reader that goes away, as `head` does, is no failure; a full disk is.
#[cfg(target_os = "linux")]
#[test]
fn standard_output_may_be_closed_but_not_full() {
    use std::process::{Command, Stdio};
    let schema = |stdout: Stdio| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("impinge"));
        command.arg("schema").stdout(stdout).stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let mut closed = schema(Stdio::piped());
    drop(closed.stdout.take());
    let output = closed.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), stderr(&output)), (Some(0), String::new()));

    let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    let output = schema(full.into()).wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("cannot write to standard output"), "{}", stderr(&output));
}

fn run_into(folder: &Path, more: &[&str]) -> Output {
    impinge()
        .arg("run")
        .arg(here("examples/two_grains.toml"))
        .arg("-o")
        .arg(folder)
        .args(more)
        .output()
        .expect("it runs")
}

#[test]
fn an_output_folder_inside_a_file() {
    // No right to write helps here, so this holds for the administrator too.
    let file = tempfile::NamedTempFile::new().expect("a file");
    let what = format!("{} is not a folder", file.path().display());
    let output = run_into(&file.path().join("deep/results"), &[]);
    assert_eq!(complaint(&output, 2, &[&what, "name another folder with -o"]), None);
    assert_eq!(complaint(&run_into(file.path(), &["--force"]), 2, &[&what]), None);
}

#[cfg(unix)]
#[test]
fn an_output_folder_that_may_not_be_written_to() {
    use std::os::unix::fs::PermissionsExt;
    let home = tempfile::tempdir().expect("a folder");
    fs::set_permissions(home.path(), PermissionsExt::from_mode(0o555)).expect("it is ours");
    if fs::write(home.path().join("probe"), "").is_ok() {
        return; // the administrator may write anywhere
    }
    let results = home.path().join("results");
    let output = run_into(&results, &[]);
    assert_eq!(complaint(&output, 2, &[&results.to_string_lossy(), "name a folder that you may write to"]), None);
}

#[test]
fn earlier_results_are_kept_without_force() {
    let folder = tempfile::tempdir().expect("a folder");
    let summary = folder.path().join("summary.json");
    fs::write(&summary, "of another run").expect("it can be written");
    assert_eq!(complaint(&run_into(folder.path(), &[]), 2, &["--force"]), None);
    assert_eq!(fs::read_to_string(&summary).expect("it is still there"), "of another run");
    assert_eq!(run_into(folder.path(), &["--force"]).status.code(), Some(0));
}

/// A limit on the size of files stands for the full disk: it fails a write in the middle of the run, needs no disk of its own, and
/// stops the administrator too.
#[cfg(unix)]
#[test]
fn a_write_that_fails_stops_the_run_and_spares_earlier_results() {
    let home = tempfile::tempdir().expect("a folder");
    let results = home.path().join("results");
    assert_eq!(run_into(&results, &[]).status.code(), Some(0));
    let before = fs::read(results.join("summary.json")).expect("it is there");

    let output = std::process::Command::new("sh")
        .args(["-c", r#"trap "" XFSZ; ulimit -f 100; exec "$@""#, "sh"])
        .arg(assert_cmd::cargo::cargo_bin("impinge"))
        .args(["run", "--force", "--set", "output.events=true", "-o"])
        .arg(&results)
        .arg(here("examples/gas.toml"))
        .output()
        .expect("it runs");
    let kept = home.path().join("results.stopped");
    let fragments =
        ["results/events.csv: ", "what was written before is in ", &kept.to_string_lossy(), "free some space"];
    assert_eq!(complaint(&output, 1, &fragments), None);
    let rows = fs::read_to_string(kept.join("events.csv")).expect("it was kept");
    assert!(rows.lines().count() > 100);
    assert_eq!(fs::read(results.join("summary.json")).expect("it is still there"), before);
}
