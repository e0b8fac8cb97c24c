//! Speed against error: the command end to end, and what it takes for the right answer.

use std::collections::HashMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use impinge::scene::Scene;
use impinge::study::compare::{Comparison, Curve, Distance, Failed, Fault, Options, PROBE, Plan, Regime, SPREAD};

/// Two grains and a wall: four collisions.
const SMALL: &str = "examples/compare/two_grains_and_wall.toml";

/// A short, dense jet: thousands of collisions.
const JET: &str = r#"
    run.until = 0.03
    domain = { min = [-3, -3, -1], max = [3, 3, 3] }
    grain = { radius = 0.01, density = 8500.0 }
    contact.grain.restitution = 0.9
    contact.surface.restitution = 0.9
    source = [{ kind = "block", min = [-0.05, -0.05, 0.1], max = [0.05, 0.05, 0.6], count = 300, velocity = [0, 0, -80] }]
    surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }]
"#;

fn impinge(arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::cargo_bin("impinge").expect("the binary is built with the tests");
    command.arg("compare").args(arguments).arg("-o").arg(folder).output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

fn rows(folder: &Path, name: &str) -> Vec<HashMap<String, String>> {
    let mut table = csv::Reader::from_path(folder.join(name)).expect("it is there");
    table.deserialize().map(|row| row.expect("a row")).collect()
}

fn event_driven() -> Options {
    Options { schemes: vec!["event-driven".into()], quick: true, ..Options::default() }
}

fn plan(text: &str, options: Options) -> Plan {
    let scene: Scene = toml::from_str(text).expect("it is a scene");
    Plan::new(&scene, ".".as_ref(), options).expect("it is valid")
}

fn compare(text: &str, options: Options) -> Comparison {
    plan(text, options).run(&mut |_, _| ControlFlow::Continue(())).expect("the reference is sound")
}

#[test]
fn a_comparison_leaves_tables_a_picture_and_a_summary() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path().join("two");
    let output = impinge(&[SMALL, "--quick"], &folder);
    assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    let told = text(&output.stdout);
    for part in ["Two grains and a wall", "no chaos before the end", "CPU time", "written to "] {
        assert!(told.contains(part), "without {part:?}:\n{told}");
    }

    let runs = rows(&folder, "compare.csv");
    for scheme in ["event-driven", "fixed-point", "trapezoidal", "soft-sphere"] {
        assert!(runs.iter().any(|run| run["scheme"] == scheme), "without {scheme}");
    }
    let exact = &runs[0];
    assert_eq!([&exact["scheme"], &exact["setting"], &exact["status"]], ["event-driven", "", "done"]);
    assert_eq!([&exact["position_error"], &exact["velocity_error"], &exact["lost"]], ["0.0", "0.0", "0"]);
    assert!(exact["cpu_seconds"].parse::<f64>().expect("a number") > 0.0);

    // The closed form: E0 = 2 m v² / 2 brings 0.6953 to the surface, in two hits of it and two of the grains.
    let ensemble = rows(&folder, "ensemble.csv");
    let mean = |name: &str| {
        let row = ensemble.iter().find(|row| row["quantity"] == name).expect("it is there");
        row["mean"].parse::<f64>().expect("a number")
    };
    assert_eq!((mean("grain_grain"), mean("grain_surface"), mean("first_hits")), (2.0, 2.0, 1.0));
    let parts = mean("energy_all_hits") / (2.0 * mean("energy_first_hits"));
    assert!((parts - 0.6953).abs() < 1e-4, "{parts}");

    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("summary.json")).expect("it is there")).expect("JSON");
    assert_eq!((&summary["reference"]["regime"], &summary["threads"]), (&"pointwise".into(), &1.into()));
    let svg = fs::read_to_string(folder.join("speed_against_error.svg")).expect("it is there");
    assert!(svg.starts_with("<svg") && svg.contains("event-driven"));
    assert_eq!(fs::read_dir(home.path()).expect("it is there").count(), 1, "nothing else is left");
}

#[test]
fn two_grains_and_a_wall_are_no_chaos_and_the_engine_is_exact() {
    let two = compare(&fs::read_to_string(SMALL).expect("it is there").replace("../", "examples/"), event_driven());
    assert_eq!(two.reference.regime, Regime::Pointwise);
    let spread = two.reference.spread.position;
    assert!(0.1 * PROBE < spread && spread < SPREAD, "{spread}");
    let scores = two.curves[0].entries[0].result.as_ref().expect("it ends");
    assert_eq!((scores.error, scores.distance), (0.0, Some(Distance::default())));
    assert_eq!((scores.deviations, scores.lost), ([0.0; 7], 0));
}

#[test]
fn a_dense_jet_is_chaos_and_the_engine_lies_within_its_own_scatter() {
    let options = Options { ensemble: Some(8), members: Some(4), ..event_driven() };
    let jet = compare(JET, options);
    assert_eq!((jet.reference.regime, jet.reference.members.len()), (Regime::Statistical, 8));
    assert!(jet.reference.spread.position > 1.0, "{}", jet.reference.spread.position);
    let [entry] = jet.curves[0].entries.as_slice() else { panic!("one exact run") };
    let scores = entry.result.as_ref().expect("it ends");
    assert_eq!((entry.members, scores.distance, scores.lost), (4, None, 0));
    // The floor is two standard deviations; five are chance once in a million.
    assert!(scores.error > 0.0 && scores.error < 2.5 * scores.floor, "{} above {}", scores.error, scores.floor);
    assert!((1e-4..0.1).contains(&scores.floor), "{}", scores.floor);
}

#[test]
fn sub_steps_are_compared_with_finer_ones_and_show_their_order() {
    let falling = r#"
        run = { until = 0.6, gravity = [0, 0, -9.81] }
        domain = { min = [-9, -9, -1], max = [9, 9, 9] }
        grain = { radius = 0.05, density = 1000.0 }
        contact.grain.restitution = 0.9
        contact.surface.restitution = 0.9
        near_field = { alpha1 = 0.05, beta1 = 2.0, alpha2 = 0.0, beta2 = 3.0, substep = 0.002 }
        source = [{ kind = "lattice", min = [0, 0, 0.1], max = [0.3, 0.01, 1.1], cells = [2, 1, 2], velocity = [0.3, 0, -1] }]
        surface = [{ kind = "plane", point = [0, 0, 0], normal = [0.1, 0, 1] }]
    "#;
    let comparison = compare(falling, Options { quick: false, ..event_driven() });
    let reference = &comparison.reference;
    assert_eq!((reference.regime, reference.sub_step), (Regime::Pointwise, Some(0.001 / 8.0)));
    let [curve] = comparison.curves.as_slice() else { panic!("one curve") };
    let errors: Vec<_> = curve.done().map(|(_, scores)| scores.error).collect();
    assert!(errors.len() == 4 && errors.is_sorted_by(|coarse, fine| coarse > fine), "{errors:?}");
    let order = curve.order().expect("there are errors");
    assert!((1.8..2.2).contains(&order), "{order} from {errors:?}");
}

#[test]
fn a_run_that_takes_too_long_is_reported_and_not_fatal() {
    let comparison = compare(JET, Options { budget: Some(1e-6), ..event_driven() });
    let fault = comparison.curves[0].entries[0].result.as_ref().expect_err("it has no time");
    assert!(matches!(fault, Fault::OverBudget { time, .. } if (0.0..=0.03).contains(time)), "{fault}");
}

#[test]
fn an_interrupted_comparison_gives_what_there_is() {
    let plan = plan(JET, event_driven());
    assert_eq!(plan.run(&mut |_, _| ControlFlow::Break(())).err(), Some(Failed::Interrupted));
    let stop = |what: &str| if what == "event-driven" { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let comparison = plan.run(&mut |what, _| stop(what)).expect("there is a reference");
    assert!(comparison.interrupted);
    assert_eq!(comparison.curves.iter().flat_map(Curve::done).count(), 0);
    assert_eq!(comparison.curves[0].entries[0].result, Err(Fault::Interrupted));
}

#[test]
fn a_source_that_keeps_sending_is_displaced_too() {
    let nozzle = r#"
        run.until = 0.2
        domain = { min = [-1, -1, -1], max = [1, 1, 1] }
        grain = { radius = 0.01, density = 2500.0 }
        contact.grain.restitution = 0.9
        contact.surface.restitution = 0.9
        surface = [{ kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }]
        [[source]]
        kind = "nozzle"
        shape = { circle = { diameter = 0.06 } }
        centre = [0, 0, 0.5]
        axis = [0, 0, -1]
        speed = 10.0
        flow = { volume_fraction = 0.1 }
    "#;
    let jet = compare(nozzle, event_driven());
    assert_eq!(jet.reference.regime, Regime::Statistical, "starts are the same: {:?}", jet.reference.spread);
    assert!(jet.reference.members.windows(2).any(|pair| pair[0] != pair[1]));
}

#[test]
fn earlier_results_are_kept_without_force() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path().join("two");
    let quick = [SMALL, "--quick", "--schemes", "event-driven"];
    assert_eq!(impinge(&quick, &folder).status.code(), Some(0));
    let before = fs::read(folder.join("compare.csv")).expect("it is there");
    let refused = impinge(&quick, &folder);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--force") && refused.stdout.is_empty(), "{}", text(&refused.stderr));
    assert_eq!(fs::read(folder.join("compare.csv")).expect("it is still there"), before);
    assert_eq!(impinge(&[&quick[..], &["--force"]].concat(), &folder).status.code(), Some(0));
}

#[test]
fn a_wrong_option_says_what_is_right() {
    let home = tempfile::tempdir().expect("a folder");
    for (arguments, says) in [
        (["--schemes", "event-drven"], "event-driven, fixed-point, trapezoidal, soft-sphere"),
        (["--ensemble", "1"], "1 is not in 2..=10000"),
        (["--members", "0"], "0 is not in 1..=10000"),
        (["--repeats", "0"], "0 is not in 1..=10000"),
        (["--budget", "0"], "give a number of seconds above 0"),
        (["--set", "contact.grain.restitution=2"], "2 is outside [0, 1]"),
    ] {
        let output = impinge(&[&[SMALL], &arguments[..]].concat(), &home.path().join("none"));
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {told}");
        assert!(told.contains(says) && output.stdout.is_empty(), "{arguments:?} without {says:?}: {told}");
        assert!(!home.path().join("none").exists());
    }
}

#[test]
fn every_scene_for_comparisons_is_valid() {
    let files = fs::read_dir("examples/compare").expect("it is there").map(|entry| entry.expect("readable").path());
    let scenes = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let mut count = 0;
    for path in scenes {
        let file =
            impinge::scene::SceneFile::read(&path, &Default::default()).unwrap_or_else(|error| panic!("{error}"));
        Plan::new(&file.scene, file.folder(), Options::default())
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        count += 1;
    }
    assert_eq!(count, 9);
}
