//! The real program, as a person at a terminal or a script runs it.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// The program, without a display.
fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sindyscope"));
    command.current_dir(folder).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command
}

fn run<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Output {
    program(folder).args(arguments).output().expect("the program starts")
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder for the test")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Standard output of a run that must succeed.
fn done<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// Standard error of a run that must fail so.
fn refused<S: AsRef<OsStr>>(folder: &Path, arguments: &[S], status: i32) -> String {
    let output = run(folder, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{said}");
    assert!(output.stdout.is_empty(), "nothing but the refusal");
    said
}

/// A Duffing record to fit and one of another force to hold out.
fn duffing(folder: &Path) {
    done(folder, &["generate", "duffing-noisy", "--seed", "7", "--duration", "60", "--out", "fit.csv"]);
    done(
        folder,
        &[
            "generate",
            "duffing",
            "--amplitude",
            "0.7",
            "--frequencies",
            "0.25",
            "--duration",
            "40",
            "--out",
            "test.csv",
        ],
    );
}

/// Options that leave nothing to choose, for tests of what comes after.
const CHOSEN: [&str; 8] = ["--terms", "x, v, u, x^2, x^3", "--window", "65", "--order", "5", "--threshold", "0.02"];

#[test]
fn help_names_every_command_and_option() {
    let here = folder();
    let help = done(here.path(), &["--help"]);
    for command in ["identify", "report", "generate"] {
        assert!(help.contains(command), "{help}");
    }
    let help = done(here.path(), &["identify", "--help"]);
    for option in ["test", "columns", "terms", "lock", "window", "order", "threshold", "ridge", "kind", "json", "rate"]
    {
        assert!(help.contains(&format!("--{option}")), "--{option}");
    }
}

#[test]
fn wrong_usage_is_status_2() {
    let here = folder();
    for arguments in [
        &["identify"][..],
        &["identify", "a.csv", "--window", "30"],
        &["identify", "a.csv", "--terms", "x, sin("],
        &["identify", "a.csv", "--no-such-option"],
        &["report", "a.csv"],
        &["generate", "duffing"],
        &["generate", "no-such-scenario", "--out", "a.csv"],
        &["generate", "duffing", "--set", "no-such=1", "--out", "a.csv"],
    ] {
        assert!(refused(here.path(), arguments, 2).starts_with("error: "), "{arguments:?}");
    }
}

#[test]
fn what_cannot_be_done_is_status_1_with_the_reason_first() {
    let here = folder();
    std::fs::write(here.path().join("bad.csv"), "t,x,u\n0,1,2\n0.1,oops,3\n").expect("written");
    std::fs::write(here.path().join("short.csv"), "t,x\n0,1\n0.1,2\n0.2,3\n").expect("written");
    for (arguments, words) in [
        (&["identify", "missing.csv"][..], &["missing.csv"][..]),
        (&["identify", "bad.csv"], &["bad.csv", "line 3", "`x`", "oops"]),
        (&["identify", "short.csv"], &["short.csv"]),
        (&["report", "bad.csv", "--out", "report.docx"], &[".docx", ".html", ".png"]),
        (&["generate", "duffing", "--out", "no/such/folder/a.csv"], &["no/such/folder/a.csv"]),
        (&["missing.csv"], &["missing.csv"]),
    ] {
        let said = refused(here.path(), arguments, 1);
        let mut lines = said.lines();
        let reason = lines.next().expect("a reason");
        assert!(words.iter().all(|w| reason.contains(w)), "{reason}");
        assert!(lines.next().is_some_and(|l| l.starts_with("  try: ")), "{said}");
        assert_eq!(lines.next(), None);
    }
    assert!(!here.path().join("report.docx").exists());
}

#[test]
fn without_a_display_the_window_names_the_commands() {
    let here = folder();
    let said = refused::<&str>(here.path(), &[], 1);
    for word in ["display", "sindyscope identify", "sindyscope report", "sindyscope generate"] {
        assert!(said.contains(word), "{said}");
    }
}

#[test]
fn identify_prints_the_equation_and_the_errors() {
    let here = folder();
    duffing(here.path());
    let said = done(here.path(), &["identify", "fit.csv", "--test", "test.csv"]);
    assert!(said.starts_with("dx/dt = v\ndv/dt =\n"), "{said}");
    for line in ["x^3", "±", "held out", "RMSE", "best fit", "noise floor", "Savitzky–Golay"] {
        assert!(said.contains(line), "{line}: {said}");
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is a number"))
}

#[test]
fn json_has_the_promised_fields_and_nothing_else_on_standard_output() {
    let here = folder();
    duffing(here.path());
    let said =
        done(here.path(), &[&["identify", "fit.csv", "--test", "test.csv", "--json", "-"], &CHOSEN[..]].concat());
    let result: Value = serde_json::from_str(&said).expect("JSON alone");
    assert_eq!(result["version"], 1);
    assert_eq!(result["status"], "ok");
    let settings = &result["settings"];
    assert_eq!((&settings["window"], &settings["order"]), (&Value::from(65), &Value::from(5)));
    assert_eq!((number(&settings["threshold"]), number(&settings["ridge"])), (0.02, 0.0));
    assert!(settings["terms"].as_array().is_some_and(|t| t.contains(&"x^3".into())));
    let equations = result["equations"].as_array().expect("equations");
    assert_eq!(equations[0]["state"], "x");
    let kinematic = &equations[0]["terms"][0];
    assert_eq!(
        (&kinematic["term"], number(&kinematic["coefficient"]), number(&kinematic["std_error"])),
        (&"v".into(), 1.0, 0.0)
    );
    assert_eq!(equations[1]["state"], "v");
    for (term, truth) in [("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)] {
        let terms = equations[1]["terms"].as_array().expect("terms");
        let found = terms.iter().find(|t| t["term"] == term).unwrap_or_else(|| panic!("{term} was found"));
        // Noise of 1 % of the motion moves a coefficient by about as much.
        assert!((number(&found["coefficient"]) - truth).abs() < 0.05, "{found}");
        assert!(number(&found["std_error"]) > 0.0);
    }
    for set in ["train", "test"] {
        for field in ["rmse", "nrmse", "max_error", "samples"] {
            assert!(number(&result[set][field]) > 0.0, "{set} {field}");
        }
    }
    assert_eq!(number(&result["test"]["samples"]), 4000.0);
    assert!(number(&result["noise_floor"]) >= 0.0);
    assert!(number(&result["elapsed_ms"]["fit"]) >= 0.0 && number(&result["elapsed_ms"]["simulate"]) >= 0.0);
}

#[test]
fn json_goes_to_a_file_beside_the_text_and_says_null_without_a_test() {
    let here = folder();
    duffing(here.path());
    let said = done(here.path(), &[&["identify", "fit.csv", "--json", "result.json"], &CHOSEN[..]].concat());
    assert!(said.contains("dv/dt ="));
    let json = std::fs::read_to_string(here.path().join("result.json")).expect("a file");
    let result: Value = serde_json::from_str(&json).expect("JSON");
    assert!(result["test"].is_null() && result.as_object().is_some_and(|r| r.contains_key("test")));
    assert!(!json.contains("NaN"));
}

#[test]
fn equations_come_as_latex_and_python() {
    let here = folder();
    duffing(here.path());
    let form = |form: &str| done(here.path(), &[&["identify", "fit.csv", "--format", form], &CHOSEN[..]].concat());
    assert!(form("latex").contains("\\ddot{x} &="));
    assert!(form("python").contains("def rate(t, state, inputs):"));
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let here = folder();
    let mut child = program(here.path())
        .args(["generate", "duffing", "--out", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut first = String::new();
    BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut first).expect("a line");
    let output = child.wait_with_output().expect("it ends");
    assert!(first.starts_with('#'));
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
}

#[test]
fn generated_records_say_what_made_them_and_make_themselves_again() {
    let here = folder();
    let list = done(here.path(), &["generate", "list"]);
    for scenario in ["duffing", "duffing-noisy", "friction", "friction-noisy", "friction-experiment", "lorenz"] {
        assert!(list.lines().any(|l| l.split_whitespace().next() == Some(scenario)), "{scenario}");
    }
    done(
        here.path(),
        &["generate", "friction-noisy", "--seed", "3", "--duration", "2", "--noise", "1%", "--out", "a.csv"],
    );
    let first = std::fs::read_to_string(here.path().join("a.csv")).expect("a file");
    assert!(first.contains("# truth:") && first.contains("seed"), "{}", &first[..500]);
    let made_by = first.lines().find_map(|l| l.split_once("made by: sindyscope ")).expect("the command").1;
    let mut again: Vec<&str> = made_by.split_whitespace().collect();
    again.extend(["--out", "-"]);
    assert!(done(here.path(), &again) == first, "the command in the file makes the same file");
}

#[test]
fn every_state_can_be_given() {
    let here = folder();
    done(here.path(), &["generate", "lorenz", "--duration", "5", "--out", "lorenz.csv"]);
    let said = done(here.path(), &["identify", "lorenz.csv", "--kind", "first-order", "--json", "-"]);
    let result: Value = serde_json::from_str(&said).expect("JSON");
    let states: Vec<&Value> = result["equations"].as_array().expect("equations").iter().map(|e| &e["state"]).collect();
    assert_eq!(states, ["x1", "x2", "x3"]);
}

#[test]
fn reports_are_whole_documents() {
    let here = folder();
    duffing(here.path());
    let report = |out: &str| {
        let arguments = ["report", "fit.csv", "--test", "test.csv", "--title", "Duffing <1> & co", "--out", out];
        done(here.path(), &[&arguments, &CHOSEN[..]].concat())
    };
    assert_eq!(report("report.html"), "wrote report.html\n");
    let page = std::fs::read_to_string(here.path().join("report.html")).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
    for part in [
        "<title>Duffing &lt;1&gt; &amp; co</title>",
        "<math display=\"block\">",
        "<svg ",
        "held out",
        "--window 65",
        "prefers-color-scheme",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Nothing is fetched from elsewhere; a name space is no address.
    let outside = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!outside.contains("http") && !outside.contains("src="), "the page needs nothing beside itself");

    report("report.png");
    let picture = image::open(here.path().join("report.png")).expect("a picture").into_luma8();
    assert!(picture.width() > 1200 && picture.height() > 1200);
    let dark = picture.pixels().filter(|p| p.0[0] < 128).count();
    assert!(dark * 200 > picture.pixels().len(), "text and lines are drawn");
}

#[test]
fn files_named_like_a_command_open_by_path() {
    let here = folder();
    std::fs::write(here.path().join("identify"), "t,x\n").expect("written");
    let said = refused(here.path(), &["./identify"], 1);
    assert!(said.contains("display") || said.contains("window"), "{said}");
}

#[test]
fn a_hidden_rig_tells_only_when_asked() {
    let here = tempfile::tempdir().unwrap();
    let folder = here.path();
    let options = ["generate", "hidden", "--effect", "coulomb_friction", "--excitation", "sweep-pair", "--seed", "3"];
    let with = |more: &[&str]| done(folder, &[&options[..], more].concat());
    with(&["--noise", "1%", "--out", "blind.csv"]);
    with(&["--noise", "1%", "--reveal", "--out", "told.csv"]);
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let (blind, told) = (read("blind.csv"), read("told.csv"));
    assert!(!blind.contains("friction") && told.contains("# Hidden: Coulomb friction"), "{}", &told[..400]);
    let rows = |text: &str| text.lines().filter(|l| !l.starts_with('#')).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(rows(&blind), rows(&told));
    assert!(blind.contains(",held out\n"));
}
