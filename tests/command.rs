//! The command as a script or a shell sees it: what stands on standard output, and what an interrupted run leaves.

#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn impinge() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin("impinge"))
}

/// A run that would take minutes, caught in the middle: its partial folder is there and has a frame.
fn started(results: &Path) -> Child {
    let mut command = impinge();
    command.args(["run", "examples/gas.toml", "--until", "600", "--set", "run.frames=100000", "-o"]).arg(results);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let home = results.parent().expect("it is in a folder");
    let began = Instant::now();
    loop {
        let folders = fs::read_dir(home).expect("it is there").map(|entry| entry.expect("readable").path());
        if folders.into_iter().any(|folder| folder.join("frames/grains_0002.vtp").exists()) {
            return run;
        }
        assert!(run.try_wait().expect("it is ours").is_none(), "the run ended by itself");
        assert!(began.elapsed() < Duration::from_secs(60), "no frame appears");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn signal(run: &Child, name: &str) {
    let sent = Command::new("kill").args(["-s", name, &run.id().to_string()]).status().expect("there is a `kill`");
    assert!(sent.success());
}

#[test]
fn an_interrupted_run_is_finished_and_says_so() {
    for name in ["INT", "TERM"] {
        let home = tempfile::tempdir().expect("a folder");
        let results = home.path().join("gas");
        let run = started(&results);
        signal(&run, name);
        let output = run.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(130), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(text.contains(" stopped at ") && text.contains("written to "), "{text}");
        assert!(output.stderr.is_empty(), "nothing but results when nobody watches");

        let json = fs::read(results.join("summary.json")).expect("it is there");
        let summary: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        let reached = summary["time"]["reached"].as_f64().expect("a number");
        assert_eq!(summary["interrupted"], true);
        assert!(0.0 < reached && reached < 600.0);
        assert!(summary["energy"]["residual_relative"].as_f64().expect("a number").abs() < 1e-12);
        let series = fs::read_to_string(results.join("series.csv")).expect("it is there");
        let last = series.lines().last().and_then(|row| row.split(',').next()).expect("a row");
        assert_eq!(last.parse(), Ok(reached));
        assert_eq!(fs::read_dir(home.path()).expect("it is there").count(), 1, "nothing else is left");
    }
}

#[test]
fn a_killed_run_leaves_earlier_results_alone() {
    let home = tempfile::tempdir().expect("a folder");
    let results = home.path().join("gas");
    fs::create_dir(&results).expect("it is made");
    fs::write(results.join("summary.json"), "of another run").expect("it is written");
    let mut run = impinge()
        .args(["run", "examples/gas.toml", "--until", "600", "--force", "-o"])
        .arg(&results)
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts");
    std::thread::sleep(Duration::from_millis(300));
    signal(&run, "KILL");
    assert!(!run.wait().expect("it ends").success());
    assert_eq!(fs::read_to_string(results.join("summary.json")).expect("it is there"), "of another run");
}

#[test]
fn a_reader_that_stops_reading_is_no_failure() {
    let home = tempfile::tempdir().expect("a folder");
    let mut command = impinge();
    command.args(["run", "examples/two_grains.toml", "-o"]).arg(home.path().join("two")).stdout(Stdio::piped());
    let mut run = command.spawn().expect("it starts");
    let mut first = String::new();
    BufReader::new(run.stdout.take().expect("a pipe")).read_line(&mut first).expect("a line");
    assert!(first.starts_with("Two grains and a wall"), "{first}");
    assert!(run.wait().expect("it ends").success());
}

/// What `impinge check` says of a scene with some changes, as `--set` takes them.
fn checked(scene: &str, changes: &[&str]) -> String {
    let mut command = impinge();
    command.args(["check", &format!("examples/{scene}.toml")]);
    changes.iter().for_each(|change| _ = command.args(["--set", change]));
    let output = command.output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn impinge_check_tells_what_forces_will_do() {
    let free = checked("erosive_jet", &[]);
    assert!(!free.contains("sub-step") && !free.contains("near field"), "{free}");

    let falling = checked("erosive_jet", &["run.gravity=[0, 0, -9.81]", "run.substep=1e-4", "contact.time=1e-6"]);
    for part in ["gravity     [0.0, 0.0, -9.81] m/s²", "1e-4 s, 600 of them", "contacts take 1e-6 s"] {
        assert!(falling.contains(part), "without {part:?}:\n{falling}");
    }
    assert!(!falling.contains("near field"), "{falling}");

    // PHYSICS 0.3: an exchanged ratio puts the barrier far above the energy of the jet, 114 J a grain.
    let exploding = checked("erosive_jet", &["near_field={ alpha1 = 1e3, beta1 = 2, alpha2 = 5e5, beta2 = 3 }"]);
    let [barrier, attraction] = [5e5 / (2.0 * 0.02_f64.powi(2)), 1e3 / 0.02];
    let potential = format!("{:.2e}", barrier - attraction);
    for part in [
        "attraction 1000 r^-2 N, repulsion 500000 r^-3 N",
        "in balance at 500 m between centres",
        "summed by a tree, to a relative error of 1e-4",
        "chosen so that its error stays within 1e-6 radii",
        &format!("potential at contact {potential} J"),
        "warning     source[0]: grains near each other fly apart",
    ] {
        assert!(exploding.contains(part), "without {part:?}:\n{exploding}");
    }

    let weak = "near_field={ alpha1 = 1e-6, beta1 = 2, alpha2 = 2e-9, beta2 = 3, sum = \"cut-off\", cutoff = 0.5, substep = 1e-5 }";
    let spreading = checked("two_grains", &[weak]);
    for part in [
        "in balance at 0.002 m",
        "over pairs closer than 0.5 m, fading from 0.4 m on",
        "1e-5 s, 10000 of them",
        "times the kinetic energy",
    ] {
        assert!(spreading.contains(part), "without {part:?}:\n{spreading}");
    }
    assert!(!spreading.contains("warning"), "{spreading}");

    let short = "near_field={ alpha1 = 1, beta1 = 0, alpha2 = 0, beta2 = 3, sum = \"cut-off\", cutoff = 0.01 }";
    let idle = checked("erosive_jet", &[short]);
    assert!(idle.contains("in balance at no distance") && idle.contains("no force acts beyond 0.01 m"), "{idle}");
    let binding =
        checked("erosive_jet", &["near_field={ alpha1 = 1e9, beta1 = 1, alpha2 = 0, beta2 = 3, sum = \"direct\" }"]);
    assert!(binding.contains("they will form clusters") && binding.contains("summed over all pairs"), "{binding}");
}

#[test]
fn what_impinge_check_prints_of_every_example() {
    for (scene, expected) in [
        ("erosive_jet", &["block: 8000 grains", "volume fraction 0.335", "mean free path 0.00703 m", "4.8 MB"][..]),
        ("two_grains", &["file grains_two.csv: 2 grains", "restitution 0.5, smooth"]),
        ("gas", &["lattice: 2048 grains", "about 85000 collisions", "volume fraction 0.2\n"]),
        ("nozzle", &["nozzle: 1315 grains", "volume fraction 0.02\n", "64 open edges"]),
        ("near_field_jet", &["attraction 5.24e-9 r^-2 N, repulsion 1.05e-11 r^-3 N", "4e-6 s"]),
        ("mesh_target", &["7552 triangles", "watertight", "block: 3000 grains"]),
    ] {
        let output = impinge().args(["check", &format!("examples/{scene}.toml")]).output().expect("it runs");
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(output.status.success() && text.contains(": valid"), "{scene}: {text}");
        expected.iter().for_each(|part| assert!(text.contains(part), "{scene} without {part:?}:\n{text}"));
    }
}
