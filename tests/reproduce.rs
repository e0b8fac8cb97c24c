//! `impinge reproduce` as a shell sees it: every study, quickly, from its name to its files.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use impinge::study::reproduce::STUDIES;

/// The command, with a folder for its results.
fn reproduce(arguments: &[&str], target: Option<&Path>) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("impinge"));
    command.arg("reproduce").args(arguments);
    if let Some(target) = target {
        command.arg("-o").arg(target);
    }
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

fn output(arguments: &[&str], target: Option<&Path>) -> Output {
    reproduce(arguments, target).output().expect("it runs")
}

/// Names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let name =
        |entry: std::io::Result<fs::DirEntry>| entry.expect("readable").file_name().into_string().expect("UTF-8");
    let mut names: Vec<String> = fs::read_dir(folder).expect("it is there").map(name).collect();
    names.sort();
    names
}

#[test]
fn every_study_is_listed_with_what_it_is_about() {
    let listed = output(&["--list"], None);
    let lines = text(&listed.stdout);
    assert!(listed.status.success());
    assert_eq!(lines.lines().count(), STUDIES.len());
    for (line, study) in lines.lines().zip(STUDIES) {
        assert!(line.starts_with(study.name) && line.ends_with(study.title), "{line}");
    }
}

#[test]
fn every_quick_study_leaves_numbers_pictures_and_a_verdict() {
    let home = tempfile::tempdir().expect("a folder");
    let target = home.path().join("studies");
    let ran = output(&["all", "--quick"], Some(&target));
    assert!(ran.status.success(), "{}", text(&ran.stderr));
    assert!(ran.stderr.is_empty(), "nothing but results when nobody watches");
    let printed = text(&ran.stdout);
    let mut expected: Vec<&str> = STUDIES.iter().map(|study| study.name).collect();
    expected.sort_unstable();
    assert_eq!(names(&target), expected, "and nothing else is left");
    assert_eq!(names(home.path()), ["studies", "studies.md"]);
    let page = fs::read_to_string(home.path().join("studies.md")).expect("it is there");
    for study in STUDIES {
        let folder = target.join(study.name);
        assert_eq!(names(&folder), ["pictures", "summary.json", "tables", "verdict.md"]);
        let verdict = fs::read_to_string(folder.join("verdict.md")).expect("it is there");
        assert!(printed.contains(&verdict) && verdict.contains(study.statement), "{verdict}");

        let json = fs::read(folder.join("summary.json")).expect("it is there");
        let summary: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        assert_eq!((summary["study"].as_str(), summary["quick"].as_bool()), (Some(study.name), Some(true)));
        let findings = summary["findings"].as_array().expect("a list");
        assert!(!findings.is_empty() && findings.iter().all(|finding| finding["measured"].is_string()));

        for name in names(&folder.join("tables")) {
            let mut table = csv::Reader::from_path(folder.join("tables").join(&name)).expect("a table");
            // Rows as long as the header, or reading would fail.
            let rows = table.records().map(|row| row.expect("a row")).collect::<Vec<_>>();
            assert!(rows.len() > 3, "{name}");
            assert!(rows.iter().flatten().all(|cell| cell != "NaN"), "{name}");
        }
        assert!(page.contains(study.statement), "{}", study.name);
        for name in names(&folder.join("pictures")) {
            assert!(page.contains(&format!("](studies/{}/pictures/{name})", study.name)), "{name}");
            let svg = fs::read_to_string(folder.join("pictures").join(&name)).expect("it is there");
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"), "{name}");
        }
    }
    // One is missing: it alone is computed again, and the page is what it was.
    fs::remove_dir_all(target.join("002-fig4")).expect("it was there");
    let resumed = output(&["all", "--quick", "--resume"], Some(&target));
    assert!(resumed.status.success(), "{}", text(&resumed.stderr));
    assert_eq!(text(&resumed.stdout).matches("Verdict: ").count(), 1);
    assert_eq!(names(&target), expected);
    assert_eq!(fs::read_to_string(home.path().join("studies.md")).expect("it is there"), page);
    let of_another_seed = output(&["all", "--quick", "--resume", "--seed", "2"], Some(&target));
    assert_eq!(of_another_seed.status.code(), Some(2), "what is there is not what is asked for");
}

#[test]
fn results_are_replaced_by_force_only_and_that_is_known_before_anything_runs() {
    let home = tempfile::tempdir().expect("a folder");
    let target = home.path().join("fig4");
    assert!(output(&["002-fig4"], Some(&target)).status.success());
    let before = fs::read(target.join("verdict.md")).expect("it is there");
    let again = output(&["002-fig4", "--seed", "7"], Some(&target));
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("holds the results of an earlier run") && again.stdout.is_empty());
    assert_eq!(fs::read(target.join("verdict.md")).expect("it is there"), before);
    assert!(output(&["002-fig4", "--force", "--seed", "7"], Some(&target)).status.success());
    assert_ne!(fs::read(target.join("verdict.md")).expect("it is there"), before);

    // The full studies would take minutes; the last of them would find its place taken.
    let last = home.path().join("all").join(STUDIES[STUDIES.len() - 1].name);
    fs::create_dir_all(&last).expect("it is made");
    fs::write(last.join("thesis.tex"), "mine").expect("it is written");
    let all = output(&["all"], Some(&home.path().join("all")));
    assert_eq!(all.status.code(), Some(2));
    assert!(text(&all.stderr).contains("thesis.tex"), "{}", text(&all.stderr));
    assert_eq!(names(&home.path().join("all")).len(), 1, "nothing was begun");
}

#[test]
fn an_unknown_study_is_told_the_nearest_name() {
    let unknown = output(&["two-grain"], None);
    let told = text(&unknown.stderr);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(told.contains("there is no study `two-grain`") && told.contains("did you mean `two-grains`?"), "{told}");
    let nothing = output(&[], None);
    assert_eq!(nothing.status.code(), Some(2));
}

#[test]
fn the_number_of_threads_does_not_change_a_digit() {
    let home = tempfile::tempdir().expect("a folder");
    let table = |threads: &str| {
        let target = home.path().join(threads);
        let mut command = reproduce(&["002-fig18", "--quick"], Some(&target));
        assert!(command.env("RAYON_NUM_THREADS", threads).stdout(Stdio::null()).status().expect("it runs").success());
        fs::read_to_string(target.join("tables/carried.csv")).expect("it is there")
    };
    assert_eq!(table("1"), table("3"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_study_leaves_nothing() {
    let home = tempfile::tempdir().expect("a folder");
    let mut study = reproduce(&["first-order-or-repeated"], Some(&home.path().join("jets")))
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts");
    // Once its folder is there it listens.
    while names(home.path()).is_empty() {
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(300));
    assert!(Command::new("kill").args(["-s", "INT", &study.id().to_string()]).status().expect("a `kill`").success());
    assert_eq!(study.wait().expect("it ends").code(), Some(130));
    assert_eq!(names(home.path()), Vec::<String>::new());
}
