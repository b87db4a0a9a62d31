//! The real program, as a person at a terminal or a script runs it.

mod measurements;

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
    for command in ["identify", "diagnose", "report", "inspect", "effects", "generate"] {
        assert!(help.contains(command), "{help}");
    }
    let help = done(here.path(), &["identify", "--help"]);
    for option in
        ["test", "columns", "terms", "lock", "window", "order", "threshold", "ridge", "kind", "json", "rate", "export"]
    {
        assert!(help.contains(&format!("--{option}")), "--{option}");
    }
    let help = done(here.path(), &["diagnose", "--help"]);
    for option in [
        "test",
        "columns",
        "terms",
        "lock",
        "window",
        "order",
        "threshold",
        "ridge",
        "kind",
        "json",
        "max-effects",
        "effects",
    ] {
        assert!(help.contains(&format!("--{option}")), "--{option}");
    }
}

#[test]
fn the_catalogue_is_told_to_people_and_to_scripts() {
    let here = folder();
    let list = done(here.path(), &["effects"]);
    let all: Value = serde_json::from_str(&done(here.path(), &["effects", "--json"])).expect("JSON");
    let effects = all["effects"].as_array().expect("a list");
    assert_eq!((all["version"].as_u64(), effects.len()), (Some(1), 39));
    assert!(effects.iter().all(|e| list.contains(e["effect"].as_str().expect("a name"))));
    let one: Value =
        serde_json::from_str(&done(here.path(), &["effects", "coulomb_friction", "--json"])).expect("JSON");
    assert_eq!(one["effects"][0]["forms"][0]["terms"][0], "sgn(v)");
    assert_eq!(one["effects"][0]["parameters"][0]["unit"], "m/s^2");
    assert!(done(here.path(), &["effects", "clearance"]).contains("dz(x,0.5)"));
    refused(here.path(), &["effects", "no_such_effect"], 2);
}

/// The magnet of the virtual rig, which the catalogue does not have.
const MAGNET: &str = r#"[[effect]]
name = "magnetic_pull"
words = "A magnet pulls the harder the nearer the mass comes."
terms = ["1/(d-r)^2-1/d^2"]
coefficients = ["k_m"]
inner.d = { bounds = [0.5, 20.0], unit = "mm" }
"#;

#[test]
fn an_effect_of_ones_own_is_listed_searched_and_reported() {
    let here = folder();
    let write = |name: &str, text: &str| std::fs::write(here.path().join(name), text).expect("a file");
    write("own.toml", MAGNET);
    write("wrong.toml", &MAGNET.replace("d-r", "q-r"));
    let card = done(here.path(), &["effects", "magnetic_pull", "--effects", "own.toml"]);
    for part in ["Magnetic pull (magnetic_pull)", "the nearer the mass comes", "k_m", "d in mm, not negative"] {
        assert!(card.contains(part), "{part}: {card}");
    }
    assert!(done(here.path(), &["effects", "--effects", "own.toml"]).contains("Your own\n  magnetic_pull"));
    for command in [&["effects"][..], &["diagnose", "run.csv"], &["report", "run.csv", "--out", "r.html", "--diagnose"]]
    {
        let said = refused(here.path(), &[command, &["--effects", "wrong.toml"]].concat(), 1);
        assert!(said.contains("wrong.toml, line 4, column 14: ") && said.contains("no quantity \"q\""), "{said}");
        assert!(refused(here.path(), &[command, &["--effects", "none.toml"]].concat(), 1).contains("no such file"));
    }
    let magnet = ["generate", "hidden", "--effect", "magnet", "--excitation", "multisine", "--noise", "1%"];
    done(here.path(), &[&magnet[..], &["--seed", "1", "--out", "run.csv"]].concat());
    let result = diagnosed(here.path(), &["run.csv", "--effects", "own.toml"]);
    assert_walk(&result, false);
    assert_eq!((&result["verdict"], effects(&result)), (&"named".into(), vec!["magnetic_pull"]));
    let step = &result["steps"][0];
    assert_eq!((&step["title"], &step["parameters"][1]["name"]), (&"Magnetic pull, to ground".into(), &"d".into()));
    assert!(result["description"].is_null());
}

#[test]
fn progress_is_silenced_before_a_command_as_behind_it() {
    let here = folder();
    let list = |arguments: &[&str]| run(here.path(), arguments).stdout;
    assert_eq!(list(&["-q", "generate", "list"]), list(&["generate", "list", "-q"]));
    assert!(!list(&["--quiet", "generate", "list"]).is_empty());
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
        &["--log", "session.log", "generate", "list"],
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
    for word in ["display", "sindyscope identify", "sindyscope diagnose", "sindyscope report", "sindyscope generate"] {
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

    report("report.pdf");
    let pdf = std::fs::read(here.path().join("report.pdf")).expect("a PDF");
    assert!(pdf.starts_with(b"%PDF") && pdf.windows(10).any(|w| w == b"/FontFile2"), "fonts are embedded");
    report("report.pdf");
    assert_eq!(std::fs::read(here.path().join("report.pdf")).expect("a PDF"), pdf, "the same bytes again");
    let absolute = here.path().join("short.html");
    let arguments = ["report", "fit.csv", "--sections", "spectrum, equation, command", "--paper", "letter", "--out"];
    done(here.path(), &[&arguments[..], &[absolute.to_str().expect("a path")], &CHOSEN[..]].concat());
    let page = std::fs::read_to_string(&absolute).expect("a page");
    assert!(page.find("Amplitude spectrum") < page.find("<math display") && !page.contains("Held-out"));
    assert!(page.contains("--out short.html --") || page.contains("--out short.html "), "paths as typed from here");
    assert!(
        page.contains("--sections &#39;spectrum, equation, command&#39;")
            || page.contains("--sections 'spectrum, equation, command'")
    );

    report("report.png");
    let picture = image::open(here.path().join("report.png")).expect("a picture").into_luma8();
    assert!(picture.width() > 1200 && picture.height() > 1200);
    let dark = picture.pixels().filter(|p| p.0[0] < 128).count();
    assert!(dark * 200 > picture.pixels().len(), "text and lines are drawn");
}

#[test]
#[cfg(feature = "desktop")]
fn a_saved_project_is_written_as_its_report() {
    use sindyscope_core::study::Settings;
    use sindyscope_values::term::Term;

    let here = folder();
    duffing(here.path());
    let terms = ["x", "v", "u", "x^3"].map(|t| Term::parse(t).expect("a term")).into();
    let settings = Settings { terms, threshold: 0.02, ..Settings::default() };
    let report = serde_json::json!({ "title": "Mine", "items": [
        { "text": "# Aim\nWords of mine." }, { "section": "equation", "shown": true }, { "section": "command", "shown": true },
    ] });
    let project = serde_json::json!({
        "sindyscope_project": 3, "source": { "files": ["fit.csv"] }, "settings": settings, "report": report,
    });
    std::fs::write(here.path().join("study.json"), project.to_string()).expect("written");
    assert_eq!(done(here.path(), &["report", "study.json", "--out", "mine.html"]), "wrote mine.html\n");
    let page = std::fs::read_to_string(here.path().join("mine.html")).expect("a page");
    for part in
        ["<h1>Mine</h1>", "<h2>Aim</h2>", "Words of mine.", "<math", "sindyscope report study.json --out mine.html"]
    {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("<figure"), "no figure was asked for");
    let said = refused(here.path(), &["report", "study.json", "--threshold", "0.1", "--out", "mine.html"], 1);
    assert!(said.contains("its own settings"), "{said}");
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

/// What `diagnose --json -` prints, checked to be JSON alone.
fn diagnosed<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Value {
    let mut all: Vec<&OsStr> = vec!["diagnose".as_ref()];
    all.extend(arguments.iter().map(AsRef::as_ref));
    all.extend(["--json", "-"].map(OsStr::new));
    let said = done(folder, &all);
    assert!(!said.contains("NaN"));
    serde_json::from_str(&said).expect("JSON alone")
}

fn effects(result: &Value) -> Vec<&str> {
    let steps = result["steps"].as_array().expect("steps");
    steps.iter().map(|s| s["effect"].as_str().expect("a name")).collect()
}

/// Every promised field of the JSON of `diagnose` is there and of its kind; numbers that do not exist are null.
fn assert_walk(result: &Value, held_out: bool) {
    let gap = |gap: &Value| {
        let fields = gap.as_object().expect("a gap");
        for field in ["train_rmse", "train_nrmse", "test_rmse", "test_nrmse"] {
            let value = fields.get(field).unwrap_or_else(|| panic!("{field}"));
            assert!(value.as_f64().is_some_and(|v| v >= 0.0) || (value.is_null() && !held_out), "{field} {value}");
        }
    };
    let equations = |stage: &Value| {
        let equations = stage["equations"].as_array().expect("equations");
        assert_eq!((&equations[0]["state"], &equations[1]["state"]), (&"x".into(), &"v".into()));
        for term in equations.iter().flat_map(|e| e["terms"].as_array().expect("terms")) {
            assert!(term["term"].is_string() && term["coefficient"].is_number(), "{term}");
            assert!(term["std_error"].is_number() || term["std_error"].is_null(), "{term}");
        }
    };
    assert_eq!(result["version"], 1);
    assert!(number(&result["noise_floor"]) >= 0.0 && number(&result["elapsed_ms"]) > 0.0);
    for stage in [&result["base"], &result["final"]] {
        equations(stage);
        gap(&stage["gap"]);
    }
    let steps = result["steps"].as_array().expect("steps");
    for (k, step) in steps.iter().enumerate() {
        gap(&step["gap"]);
        for text in ["effect", "title", "where"] {
            assert!(step[text].as_str().is_some_and(|t| !t.is_empty()), "{text}: {step}");
        }
        assert!(step["terms"].as_array().is_some_and(|t| t.iter().all(Value::is_string)));
        assert!(step["next_experiment"].is_null() || step["next_experiment"].is_string());
        for parameter in step["parameters"].as_array().expect("parameters") {
            assert!(parameter["name"].is_string() && parameter["unit"].is_string() && parameter["value"].is_number());
            assert!(parameter["std_error"].is_number() || parameter["std_error"].is_null(), "{parameter}");
        }
        for other in step["alternatives"].as_array().expect("alternatives") {
            assert!(other["effect"].is_string());
            for field in ["delta_bic", "test_rmse"] {
                assert!(other[field].is_number() || other[field].is_null(), "{other}");
            }
        }
        let alike = step["indistinguishable"].as_array().expect("a list");
        let ambiguous = result["verdict"] == "ambiguous" && k + 1 == steps.len();
        assert_eq!(!alike.is_empty(), ambiguous, "only an ambiguous verdict's last step has rivals");
    }
    let verdict = result["verdict"].as_str().expect("a verdict");
    assert!(["named", "ambiguous", "unexplained", "nothing_missing"].contains(&verdict));
    assert!(verdict != "nothing_missing" || steps.is_empty());
    assert!(result["remaining"]["significant"].is_boolean() && result["remaining"]["note"].is_string());
    assert!((0.0..=1.0).contains(&number(&result["remaining"]["p_value"])));
}

fn coefficient(stage: &Value, term: &str) -> f64 {
    let terms = stage["equations"][1]["terms"].as_array().expect("terms");
    number(&terms.iter().find(|t| t["term"] == term).unwrap_or_else(|| panic!("{term} in {stage}"))["coefficient"])
}

/// Gap on data never fitted of the base over that of a stage.
fn times_smaller(result: &Value, stage: &Value) -> f64 {
    number(&result["base"]["gap"]["test_rmse"]) / number(&stage["gap"]["test_rmse"])
}

/// Friction with noise of 0.4 % of the motion, and a tone to hold out.
fn friction(folder: &Path) {
    let make = |seed: &str, more: &[&str], out: &str| {
        let first = ["generate", "friction-noisy", "--seed", seed, "--rate", "400", "--duration", "4", "--out", out];
        done(folder, &[&first, more].concat());
    };
    make("1", &[], "fit.csv");
    make("2", &["--frequencies", "5.843"], "test.csv");
}

#[test]
fn diagnose_names_dry_friction() {
    let here = folder();
    friction(here.path());
    let result = diagnosed(here.path(), &["fit.csv", "--test", "test.csv"]);
    assert_walk(&result, true);
    assert_eq!((&result["verdict"], effects(&result)), (&"named".into(), vec!["coulomb_friction"]));
    let step = &result["steps"][0];
    assert_eq!(step["terms"], serde_json::json!(["sgn(v)"]));
    let level = &step["parameters"][0];
    // The friction force of the rig is 0.0856 m/s²; the held-out gap shows that it is as sure as its error says.
    assert_eq!((&level["name"], &level["unit"]), (&"F_c".into(), &"m/s^2".into()));
    assert!((number(&level["value"]) - 0.0856).abs() < 5e-4, "{level}");
    assert!(times_smaller(&result, step) > 5.0 && result["remaining"]["significant"] == false);
    assert!(number(&step["gap"]["test_rmse"]) < 1.1 * 1e-5, "the noise of the sensor is 1e-5 m");
}

#[test]
fn diagnose_names_the_cubic_spring_of_a_linear_base() {
    let here = folder();
    let make = |seed: &str, tones: &str, out: &str| {
        let arguments = ["generate", "duffing-noisy", "--seed", seed, "--duration", "60", "--rate", "25"];
        done(here.path(), &[&arguments[..], &["--frequencies", tones, "--together", "--out", out]].concat());
    };
    make("7", "0.08,0.13,0.19,0.27,0.31", "fit.csv");
    make("8", "0.11,0.23", "test.csv");
    let result = diagnosed(here.path(), &["fit.csv", "--test", "test.csv", "--terms", "x, v, u"]);
    assert_walk(&result, true);
    assert_eq!((&result["verdict"], effects(&result)), (&"named".into(), vec!["cubic_stiffness"]));
    // Noise of 1 % of the motion over 1500 samples.
    for (term, truth) in [("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)] {
        assert!((coefficient(&result["final"], term) - truth).abs() < 0.02, "{term}");
    }
    assert!(times_smaller(&result, &result["final"]) > 5.0);
}

#[test]
fn diagnose_finds_nothing_where_the_base_is_whole() {
    let here = folder();
    friction(here.path());
    let arguments = ["fit.csv", "--test", "test.csv", "--terms", "x-u, v-du", "--lock", "sgn(v)"];
    let result = diagnosed(here.path(), &arguments);
    assert_walk(&result, true);
    assert_eq!((&result["verdict"], effects(&result).len()), (&"nothing_missing".into(), 0));
    assert!((coefficient(&result["base"], "sgn(v)") + 0.0856).abs() < 5e-4);
}

#[test]
fn diagnose_tells_a_person_the_walk_and_keeps_to_the_most_effects() {
    let here = folder();
    friction(here.path());
    let said =
        done(here.path(), &["diagnose", "fit.csv", "--test", "test.csv", "--json", "walk.json", "--window", "31"]);
    for words in [
        "Base model\ndx/dt = v\n",
        "gap: fitted",
        "held out",
        "noise floor",
        "1. Coulomb (dry) friction",
        "where",
        "F_c = 0.08",
        "rather than",
        "times smaller",
        "Verdict: ",
        "--window changed nothing",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!said.contains('\u{1b}'), "no progress where nobody watches");
    let walk = std::fs::read_to_string(here.path().join("walk.json")).expect("a file");
    assert_walk(&serde_json::from_str(&walk).expect("JSON"), true);

    let none = diagnosed(here.path(), &["fit.csv", "--test", "test.csv", "--max-effects", "0"]);
    assert_eq!((&none["verdict"], effects(&none).len()), (&"unexplained".into(), 0));
    assert_eq!(none["remaining"]["significant"], true);
}

#[test]
fn diagnose_tells_what_it_did_not_read() {
    let here = folder();
    friction(here.path());
    let plain = std::fs::read_to_string(here.path().join("fit.csv")).expect("a file");
    let rows = plain.lines().filter(|line| !line.starts_with('#')).enumerate();
    let warmer = rows.map(|(k, row)| format!("{row},{}\n", if k == 0 { "T [°C]" } else { "21.5" }));
    std::fs::write(here.path().join("warm.csv"), warmer.collect::<String>()).expect("written");
    let said = done(here.path(), &["diagnose", "warm.csv", "--max-effects", "0"]);
    assert!(said.contains("Note. warm.csv: column `T [°C]` is not taken for a time"), "{said}");
    let result = diagnosed(here.path(), &["warm.csv", "--max-effects", "0"]);
    let first = result["notices"][0].as_str().expect("a notice");
    assert!(first.contains("`T [°C]`"), "{first}");
}

#[test]
fn diagnose_refuses_in_a_sentence() {
    let here = folder();
    let write = |name: &str, head: &str, row: &dyn Fn(f64) -> String, samples: usize| {
        let rows: String = (0..samples).map(|k| 0.01 * k as f64).map(|t| format!("{t},{}\n", row(t))).collect();
        std::fs::write(here.path().join(name), format!("{head}\n{rows}")).expect("written");
    };
    let wave = |t: f64| (5.0 * t).sin() + 0.3 * (8.0 * t).sin();
    write("short.csv", "t,x,u", &|t| format!("{},{}", wave(t), t.cos()), 40);
    write("free.csv", "t,x", &|t| wave(t).to_string(), 400);
    for (arguments, words) in [
        (&["short.csv"][..], &["short", "40 samples"][..]),
        (&["free.csv", "--kind", "first-order"], &["second order"]),
        (&["free.csv", "--terms", "x, v, u"], &["u", "records do not have"]),
        (&["missing.csv"], &["missing.csv"]),
    ] {
        let said = refused(here.path(), &[&["diagnose"], arguments].concat(), 1);
        assert!(words.iter().all(|w| said.lines().next().is_some_and(|l| l.contains(w))), "{arguments:?}: {said}");
        assert!(said.lines().nth(1).is_some_and(|l| l.starts_with("  try: ")), "{said}");
    }
    for arguments in [&["free.csv", "--max-effects", "-1"][..], &["free.csv", "--window", "30"], &[]] {
        refused(here.path(), &[&["diagnose"], arguments].concat(), 2);
    }
}

#[test]
fn reports_tell_the_walk_where_asked() {
    let here = folder();
    friction(here.path());
    let terms = ["--terms", "x, v, u, du", "--window", "31", "--order", "4", "--threshold", "0.01"];
    let arguments = ["report", "fit.csv", "--test", "test.csv", "--diagnose", "--json", "walk.json", "--out"];
    done(here.path(), &[&arguments[..], &["walk.html"], &terms].concat());
    let page = std::fs::read_to_string(here.path().join("walk.html")).expect("a page");
    for part in [
        "What is missing",
        "Round 1: Coulomb (dry) friction",
        "Gap of the base model",
        "ΔBIC",
        "What remains",
        "--diagnose",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("NaN"));
    let json = std::fs::read_to_string(here.path().join("walk.json")).expect("a file");
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_walk(&json["diagnosis"], true);
    refused(here.path(), &[&["report", "fit.csv", "--base", "x, v", "--out", "a.html"], &terms[..]].concat(), 2);
}

#[test]
fn a_report_of_modes_says_the_command_that_makes_it_again() {
    let here = folder();
    // A mast after a blow, at 1.5 and 4 Hz, seen by two accelerometers.
    let mut table = String::from("t [s],a1 [m/s^2],a2 [m/s^2]\n");
    for k in 0..1200 {
        let t = 0.02 * f64::from(k);
        let wave = |damping: f64, frequency: f64| (-damping * t).exp() * (std::f64::consts::TAU * frequency * t).cos();
        let (slow, fast) = (wave(0.1, 1.5), wave(0.3, 4.0));
        table += &format!("{t},{},{}\n", slow + 0.5 * fast, slow - 0.8 * fast);
    }
    std::fs::write(here.path().join("mast.csv"), table).expect("a file");
    done(here.path(), &["report", "mast.csv", "--base", "modes", "--modes", "2", "--out", "mast.html"]);
    let page = std::fs::read_to_string(here.path().join("mast.html")).expect("a page");
    for part in ["Stabilization diagram", "damping ratio (%)", "report mast.csv --out mast.html --base modes --modes 2"]
    {
        assert!(page.contains(part), "{part}");
    }
    let poles = ["report", "mast.csv", "--base", "modes", "--poles", "1.5:0.01,4:0.01", "--out", "mast.pdf"];
    done(here.path(), &poles);
    let walk = done(here.path(), &["diagnose", "mast.csv", "--base", "modes", "--poles", "1.5:0.01,4:0.01"]);
    assert!(walk.contains("1.5") && walk.contains("Nothing is missing"), "{walk}");
    refused(here.path(), &["report", "mast.csv", "--modes", "2", "--out", "a.html"], 2);
    refused(here.path(), &["report", "mast.csv", "--base", "modes", "--poles", "1.5", "--out", "a.html"], 2);
}

#[test]
#[ignore = "takes a minute where tests are not optimised; run with --profile study"]
fn the_friction_rig_rubs_on_the_ground() {
    let Some(data) = measurements::folder() else { return };
    let files = ["friction_rig_3.6Hz.csv", "friction_rig_2.0Hz.csv"];
    for (fitted, held_out) in [(files[0], files[1]), (files[1], files[0])] {
        let started = std::time::Instant::now();
        let result = diagnosed(&data, &[fitted, "--test", held_out]);
        assert_walk(&result, true);
        let named = effects(&result);
        assert!(named.contains(&"coulomb_friction"), "{fitted}: {named:?}");
        assert!(!named.contains(&"clearance"), "a softening clearance makes held-out data worse: {named:?}");
        let steps = result["steps"].as_array().expect("steps");
        let friction = steps.iter().find(|s| s["effect"] == "coulomb_friction").expect("friction");
        assert_eq!(friction["terms"], serde_json::json!(["sgn(v)"]), "to ground: on the absolute velocity");
        let smaller = times_smaller(&result, &result["final"]);
        assert!(smaller >= 4.0, "{fitted}: the held-out gap is {smaller:.2} times smaller");
        assert!(started.elapsed().as_secs() < 60, "{:?}", started.elapsed());
    }
}

#[test]
#[ignore = "takes minutes where tests are not optimised; run with --profile study"]
fn the_silverbox_has_a_cubic_spring() {
    let Some(data) = measurements::folder() else { return };
    let files = ["silverbox_multisine_1.csv", "--test", "silverbox_multisine_10.csv"];
    let result = diagnosed(&data, &[&files[..], &["--columns", "x=V2_out_V,u=V1_in_V"]].concat());
    assert_walk(&result, true);
    assert!(effects(&result).contains(&"cubic_stiffness"), "{:?}", effects(&result));
    let error = number(&result["final"]["gap"]["test_nrmse"]);
    assert!(error <= 0.02, "held-out NRMSE {error}");
}

#[test]
#[ignore = "takes minutes where tests are not optimised; run with --profile study"]
fn the_magnet_beam_hardens_and_a_viscous_damper_is_not_taken_for_all_the_rest() {
    let Some(data) = measurements::folder() else { return };
    let result = diagnosed(&data, &["magnet_beam_decay.csv"]);
    assert_walk(&result, false);
    const HARDENING: [&str; 4] = ["cubic_stiffness", "quintic_stiffness", "clearance", "bouc_wen_hysteresis"];
    let named = effects(&result);
    assert!(named.iter().any(|e| HARDENING.contains(e)), "{named:?}");
    let damping =
        |effect: &&str| effect.contains("damping") || effect.contains("friction") || effect.contains("hysteresis");
    let open = ["ambiguous", "unexplained"].iter().any(|v| result["verdict"] == *v);
    assert!(named.iter().any(damping) || open, "{named:?}, {}", result["verdict"]);
}

#[test]
fn known_physics_and_the_mass_give_the_parameters_of_the_machine() {
    let here = folder();
    let scenario =
        ["friction-noisy", "--seed", "3", "--rate", "250", "--duration", "6", "--frequencies", "2.013,4.611"];
    done(here.path(), &[&["generate"], &scenario[..], &["--out", "fit.csv"]].concat());
    let options =
        ["--terms", "x, v, u, du, sgn(v)", "--constrain", "x=-u, v=-du, passive, odd", "--mass", "2", "--refine"];
    let command = [&["identify", "fit.csv"], &options[..]].concat();
    let said = done(here.path(), &command);
    for word in
        ["x-u", "v-du", "Physical parameters", "natural frequency", "damping ratio", "dry friction force", "x=-u"]
    {
        assert!(said.contains(word), "{word}: {said}");
    }
    let result: Value =
        serde_json::from_str(&done(here.path(), &[&command[..], &["--json", "-"]].concat())).expect("JSON");
    let truth = [
        ("f_n", f64::sqrt(358.706) / std::f64::consts::TAU),
        ("zeta", 0.0658 / (2.0 * f64::sqrt(358.706))),
        ("k", 717.412),
        ("c", 0.1316),
        ("F_f", 0.1712),
    ];
    for (name, truth) in truth {
        let found = result["physical"].as_array().and_then(|p| p.iter().find(|p| p["name"] == name));
        let found = found.unwrap_or_else(|| panic!("{name}: {}", result["physical"]));
        let (value, error) = (number(&found["value"]), number(&found["std_error"]));
        assert!((value - truth).abs() < 4.0 * error && error < 0.05 * truth, "{name}: {value} ± {error}, {truth}");
    }
    assert_eq!(result["settings"]["constrain"], serde_json::json!(["x=-u", "v=-du", "passive", "odd"]));
    assert!(result["refinement"]["converged"].as_bool().is_some_and(|c| c));
    let said = refused(here.path(), &["identify", "fit.csv", "--constrain", "u=1/m", "--mass", "2"], 1);
    assert!(said.contains("newton") && said.contains("--fix"), "{said}");
    // The same mass under a force in newtons: its coefficient is fixed and stays.
    let text = std::fs::read_to_string(here.path().join("fit.csv")).expect("the record");
    let forced: String = text
        .lines()
        .map(|l| format!("{}\n", if l.contains("u [m]") { l.replace("u [m]", "u [N]") } else { l.into() }))
        .collect();
    std::fs::write(here.path().join("forced.csv"), forced).expect("written");
    let json = done(
        here.path(),
        &[
            "identify",
            "forced.csv",
            "--terms",
            "x, v, u",
            "--constrain",
            "u=1/m",
            "--mass",
            "2",
            "--threshold",
            "0",
            "--json",
            "-",
        ],
    );
    let result: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(number(&result["settings"]["fix"]["u"]), 0.5);
}

/// A decaying motion in a unit, written as its header says it.
fn decay(folder: &Path, name: &str, unit: &str, factor: f64) {
    let motion = |t: f64| factor * 0.01 * (-0.1 * t).exp() * (6.0 * t).cos();
    let rows: String = (0..2000).map(|k| f64::from(k) * 0.01).map(|t| format!("{t:.2},{:.9}\n", motion(t))).collect();
    std::fs::write(folder.join(name), format!("t [s],x [{unit}]\n{rows}")).expect("a file");
}

#[test]
fn metres_and_millimetres_are_scored_in_one_unit_and_radians_are_refused() {
    let home = folder();
    decay(home.path(), "m.csv", "m", 1.0);
    decay(home.path(), "mm.csv", "mm", 1e3);
    decay(home.path(), "rad.csv", "rad", 1.0);
    let run = ["identify", "m.csv", "--test", "mm.csv", "--terms", "x, v", "--json", "-"];
    let result: Value = serde_json::from_str(&done(home.path(), &run)).expect("JSON");
    let rmse = |part: &str| result[part]["rmse"].as_f64().expect("a figure");
    assert!(rmse("test") < 1e-4, "millimetres were scored as metres: {}", rmse("test"));
    let terms = result["equations"][1]["terms"].as_array().expect("terms");
    let units: Vec<&str> = terms.iter().filter_map(|t| t["unit"].as_str()).collect();
    assert_eq!(units, ["1/s^2", "1/s"]);
    let said = refused(home.path(), &["identify", "m.csv", "--test", "rad.csv"], 1);
    assert!(said.contains("is in rad, in m.csv it is in m"), "{said}");
}

#[test]
fn terms_that_add_different_quantities_are_refused() {
    let home = folder();
    duffing(home.path());
    let said = refused(home.path(), &["identify", "fit.csv", "--terms", "x-u, v"], 1);
    assert!(said.contains("cannot be added or subtracted"), "{said}");
    let said = refused(home.path(), &["diagnose", "fit.csv", "--terms", "x-u, v"], 1);
    assert!(said.contains("cannot be added or subtracted"), "{said}");
}

#[test]
fn a_saved_project_is_known_by_what_it_holds() {
    let home = folder();
    std::fs::write(home.path().join("rig70.sindy"), r#"{ "sindyscope_project": 1, "source": "nothing" }"#)
        .expect("a file");
    let said = refused(home.path(), &["identify", "rig70.sindy"], 1);
    assert!(said.contains("a saved project") && said.contains("sindyscope rig70.sindy"), "{said}");
}

#[test]
fn the_end_of_each_record_is_held_out_and_records_are_cropped() {
    let here = folder();
    duffing(here.path());
    let samples = |more: &[&str]| {
        let arguments = [&["identify", "fit.csv", "--json", "-"], more, &CHOSEN[..]].concat();
        let result: Value = serde_json::from_str(&done(here.path(), &arguments)).expect("JSON");
        (number(&result["train"]["samples"]), result["test"]["samples"].as_f64())
    };
    let (whole, none) = samples(&[]);
    assert_eq!(none, None);
    let (fitted, held_out) = samples(&["--hold-out", "0.3"]);
    assert_eq!((fitted, held_out), ((0.7 * whole).round(), Some(whole - (0.7 * whole).round())));
    let (cropped, held_out) = samples(&["--crop", ":8", "--hold-out", "0.25"]);
    assert!(cropped + held_out.unwrap() < whole && cropped / held_out.unwrap() > 2.9);
    // Files that are held out are the held-out data.
    let (fitted, held_out) = samples(&["--hold-out", "0.3", "--test", "test.csv"]);
    assert!(fitted == whole && held_out.is_some());
    let said = refused(here.path(), &["identify", "fit.csv", "--crop", "1e6:"], 1);
    assert!(said.contains("leaves 0 samples") && said.contains("--crop"), "{said}");
    refused(here.path(), &["identify", "fit.csv", "--hold-out", "30"], 2);
}

#[test]
fn a_record_that_is_fitted_and_held_out_is_told_of() {
    let here = folder();
    duffing(here.path());
    let arguments = [&["identify", "fit.csv", "--test", "fit.csv", "--json", "-"], &CHOSEN[..]].concat();
    let result: Value = serde_json::from_str(&done(here.path(), &arguments)).expect("JSON");
    let notices = result["notices"].as_array().expect("notices");
    assert!(notices.iter().any(|n| n.as_str().is_some_and(|n| n.contains("fitted too"))), "{notices:?}");
}

/// The words of a command as a shell takes them apart, its quotes closed.
fn words(command: &str) -> Vec<String> {
    let pieces = command.split('\'').enumerate();
    let marked = pieces.map(|(k, piece)| if k % 2 == 1 { piece.replace(' ', "\u{1}") } else { piece.to_owned() });
    let words = marked.collect::<String>();
    words.split_whitespace().map(|w| w.replace('\u{1}', " ")).collect()
}

#[test]
fn the_command_in_a_report_repeats_it_with_what_was_found_on_the_way() {
    let here = folder();
    duffing(here.path());
    let asked = ["--hold-out", "0.25", "--prepare", "offset", "--terms", "x, v, u, x^3", "--window", "65"];
    let first = ["report", "fit.csv", "--estimate", "delay(u)", "--out", "first.html", "--json", "first.json"];
    done(here.path(), &[&first[..], &asked, &["--order", "5", "--threshold", "0.02"]].concat());
    let page = std::fs::read_to_string(here.path().join("first.html")).expect("a page");
    let command = page.split("sindyscope report").nth(1).and_then(|rest| rest.split('<').next()).expect("a command");
    let command = command.replace("&#39;", "'").replace("&amp;", "&").replace("&gt;", ">").replace("&lt;", "<");
    assert!(command.contains("align=u1:") && !command.contains("--estimate"), "{command}");
    let again = command.replace("first.html", "again.html");
    let words: Vec<String> = ["report".to_owned()].into_iter().chain(words(&again)).collect();
    done(here.path(), &[&words[..], &["--json".to_owned(), "again.json".to_owned()]].concat());
    let result = |name: &str| -> Value {
        let text = std::fs::read_to_string(here.path().join(name)).expect("JSON");
        serde_json::from_str(&text).expect("JSON")
    };
    let (first, again) = (result("first.json"), result("again.json"));
    for part in ["equations", "train", "test", "settings"] {
        assert_eq!(first[part], again[part], "{part}: {command}");
    }
}

#[test]
fn missing_samples_are_bridged_or_split_the_record() {
    let here = folder();
    duffing(here.path());
    let whole = std::fs::read_to_string(here.path().join("fit.csv")).expect("data");
    let header = whole.lines().position(|l| l.starts_with('t')).expect("a header");
    let lines = whole.lines().enumerate().map(|(i, line)| match i.checked_sub(header + 300) {
        Some(0..4) => line.split(',').next().map_or(String::new(), |t| format!("{t},NaN,NaN")),
        _ => line.to_owned(),
    });
    std::fs::write(here.path().join("holes.csv"), lines.collect::<Vec<_>>().join("\n")).expect("a file");
    let records = |bridge: &str| {
        let arguments = [&["identify", "holes.csv", "--bridge", bridge, "--json", "-"], &CHOSEN[..]].concat();
        let result: Value = serde_json::from_str(&done(here.path(), &arguments)).expect("JSON");
        result["records"].as_array().expect("records").len()
    };
    assert_eq!((records("3"), records("4")), (2, 1));
}

#[test]
fn inspect_tells_what_a_file_holds_and_what_is_wrong() {
    let home = folder();
    std::fs::write(home.path().join("bad.csv"), "time,volume\n0,1\n1,2\n").expect("a file");
    let rows: String = (0..60).map(|i| format!("{},{},{}\n", 2 * i, (i * i) % 7, (i * 3) % 5)).collect();
    std::fs::write(home.path().join("good.csv"), format!("t [ms],x_mm,force (N)\n{rows},,\n")).expect("a file");
    let said = done(home.path(), &["inspect", "good.csv", "bad.csv"]);
    for part in
        ["record good: 60 samples at 500 Hz", "x   x", "displacement in mm, 0 to 4", "input in N", "time was converted"]
    {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(said.contains("bad.csv") && said.contains("no column is a displacement"), "{said}");
    let result: Value =
        serde_json::from_str(&done(home.path(), &["inspect", "--json", "good.csv", "bad.csv"])).expect("JSON");
    let good = &result["files"][0];
    assert_eq!((good["status"].as_str(), good["records"][0]["rate"].as_f64()), (Some("ok"), Some(500.0)));
    assert_eq!(good["records"][0]["channels"][1]["unit"], "N");
    assert_eq!(result["files"][1]["status"], "refused");
    let columns = &good["holds"]["tables"][0]["columns"];
    assert_eq!((columns[0]["role"].as_str(), columns[1]["name"].as_str()), (Some("t"), Some("x_mm")));
    let said = refused(home.path(), &["inspect", "bad.csv"], 1);
    assert!(said.contains("perhaps: --columns \"t=time,x=volume\""), "{said}");
}

#[test]
fn a_wide_file_is_listed_at_once_and_read_by_the_columns_that_are_named() {
    let home = folder();
    let names: Vec<String> = (1..=800).map(|c| format!("x{c} [mm]")).collect();
    let row = |r: usize| {
        let cells: Vec<String> = (0..800).map(|c| format!("{:.3}", ((r + c) as f64 * 0.31).sin())).collect();
        format!("{},{}\n", r as f64 * 0.01, cells.join(","))
    };
    let text = format!("t,{}\n{}", names.join(","), (0..500).map(row).collect::<String>());
    std::fs::write(home.path().join("wide.csv"), text).expect("a file");
    let begun = std::time::Instant::now();
    let said = refused(home.path(), &["inspect", "wide.csv"], 1);
    for part in
        ["800 columns are taken for motions", "801 columns of 500 rows at 100 Hz", "and 761 more", "--only-named"]
    {
        assert!(said.contains(part), "{part}: {said}");
    }
    let said = done(home.path(), &["inspect", "wide.csv", "--columns", "t=t,x=x217", "--only-named"]);
    assert!(said.contains("record wide: 500 samples at 100 Hz") && said.contains("x217"), "{said}");
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
    refused(home.path(), &["inspect", "wide.csv", "--only-named"], 2);
}

#[test]
fn records_are_prepared_by_steps_in_the_order_given() {
    let here = folder();
    let row = |k: u32| {
        let t = f64::from(k) * 0.01;
        let x = if k == 700 { 9.0 } else { (3.0 * t).sin() + 0.3 * (70.0 * t).sin() };
        format!("{t:.2},{x:.6},{:.6}\n", (2.0 * t).cos())
    };
    let text = format!("t [s],x [m],u [N]\n{}", (0..2000).map(row).collect::<String>());
    std::fs::write(here.path().join("spiked.csv"), text).expect("a file");
    let study = |more: &[&str]| -> Value {
        let chosen = ["--terms", "x, v, u", "--window", "65", "--order", "5", "--threshold", "0.001", "--json", "-"];
        let arguments = [&["identify", "spiked.csv"], &chosen[..], more].concat();
        serde_json::from_str(&done(here.path(), &arguments)).expect("JSON")
    };
    let plain = study(&[]);
    let prepared = study(&["--prepare", "spikes,low-pass=3,split=2", "--hold-out", "0.2"]);
    assert_eq!(
        prepared["records"].as_array().expect("records").len(),
        4,
        "two parts, each with its last fifth held out"
    );
    assert!(number(&prepared["train"]["rmse"]) < 0.2 * number(&plain["train"]["rmse"]), "{prepared}");
    let said = refused(here.path(), &["identify", "spiked.csv", "--prepare", "lowpass=3"], 2);
    assert!(said.contains("low-pass=40"), "{said}");
    let said = refused(here.path(), &["identify", "spiked.csv", "--prepare", "low-pass=90"], 1);
    assert!(said.contains("half the sampling rate") && said.contains("--prepare"), "{said}");
}

#[test]
fn the_report_of_a_table_is_that_of_a_series() {
    let home = folder();
    let folder = home.path();
    let rows: String =
        (0..8).map(|k| format!("run{k}.csv,{},ok,,{},0.1\n", 10 + 2 * k, 5.0 + 0.5 * f64::from(k))).collect();
    std::fs::write(folder.join("table.csv"), format!("record,temperature,status,error,v: x,v: x std_error\n{rows}"))
        .expect("written");
    let report = ["report", "table.csv", "--over", "temperature", "--out"];
    for (out, begin) in [("series.html", "<!DOCTYPE html>"), ("series.pdf", "%PDF"), ("series.png", "\u{fffd}PNG")] {
        done(folder, &[&report[..], &[out]].concat());
        let bytes = std::fs::read(folder.join(out)).expect("a document");
        assert!(String::from_utf8_lossy(&bytes).to_lowercase().starts_with(&begin.to_lowercase()), "{out}");
    }
    let html = std::fs::read_to_string(folder.join("series.html")).expect("a document");
    for part in ["over temperature", "0.25", "Every record fits its siblings", "sindyscope report table.csv"] {
        assert!(html.contains(part), "{part}");
    }
    // Known by its head without --over too, then in the order of the table; the same JSON as that of `series`.
    let json = done(folder, &["report", "table.csv", "--out", "order.html", "--json", "-"]);
    assert_eq!(json, done(folder, &["series", "table.csv", "--json", "-"]));
    let said = refused(folder, &[&report[..], &["a.html", "--terms", "x, v"]].concat(), 1);
    assert!(said.contains("takes --out, --over, --title, --paper and --json alone"), "{said}");
    let said = refused(folder, &["report", "table.csv", "--over", "height", "--out", "a.html"], 1);
    assert!(said.contains("no column `height`") && said.contains("temperature"), "{said}");
}
