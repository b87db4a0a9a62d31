use std::fs;
use std::path::Path;

use super::*;
use crate::source::KindName;
use sindyscope_core::study::Settings;
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_values::term::Term;

/// Records of decays that differ in their stiffness, and one that is none.
fn folder(home: &Path, count: usize) {
    for k in 0..count {
        let parameters = vec![("k".to_owned(), 300.0 + 10.0 * k as f64)];
        let options = ScenarioOptions { parameters, duration: Some(1.0), ..ScenarioOptions::default() };
        let made = generate("friction-decay", &options).expect("a scenario");
        let record = &made.records[0];
        let x = &record.channels[0].values;
        let rows: String = (0..record.len()).map(|i| format!("{},{}\n", record.time(i), x[i])).collect();
        fs::write(home.join(format!("run{k:02}.csv")), format!("t,x\n{rows}")).expect("written");
    }
    fs::write(home.join("bad.csv"), "t,x\n0,1\n0.1,oops\n").expect("written");
}

fn study() -> AnalysisRequest {
    let pairs =
        [("terms", "x, v, sgn(v)"), ("window", "15"), ("order", "5"), ("threshold", "0"), ("form", "derivative")];
    AnalysisRequest::named(pairs).expect("settings")
}

fn request(home: &Path, out: &str, part: Option<BatchPart>) -> BatchRequest {
    let items = batch_items(&home.join("runs")).expect("records");
    BatchRequest { items, study: study(), missing: None, out: home.join(out), reports: None, part }
}

fn run(request: &BatchRequest) -> Result<BatchSummary, BatchError> {
    batch(request, &Cancel::default(), &|_| ())
}

fn home() -> tempfile::TempDir {
    let home = tempfile::tempdir().expect("a folder");
    fs::create_dir(home.path().join("runs")).expect("a folder");
    folder(&home.path().join("runs"), 6);
    home
}

#[test]
fn every_record_is_a_row_once_and_a_failure_its_sentence() {
    let home = home();
    let whole = request(home.path(), "table.csv", None);
    let summary = run(&whole).expect("done");
    assert_eq!(summary, BatchSummary { records: 7, now: 7, before: 0, failed: 1, left: 0, written: true });
    let table = fs::read_to_string(&whole.out).expect("a table");
    assert_eq!(table.lines().count(), 8);
    assert!(table.lines().nth(1).expect("a row").starts_with("bad.csv,failed,") && table.contains("line 3"), "{table}");
    assert!(table.starts_with("record,status,error,train_rmse,") && table.contains("v: sgn(v),v: sgn(v) std_error"));
    // Again: nothing is done, nothing changes.
    assert_eq!(run(&whole).expect("done").now, 0);
    assert_eq!(fs::read_to_string(&whole.out).expect("a table"), table);
    // What was mended since is done anew.
    fs::copy(home.path().join("runs/run00.csv"), home.path().join("runs/bad.csv")).expect("copied");
    assert_eq!(run(&whole).map(|s| (s.now, s.failed)), Ok((1, 0)));
}

#[test]
fn parts_joined_are_the_whole() {
    let home = home();
    run(&request(home.path(), "whole.csv", None)).expect("done");
    for index in 1..=2 {
        let part = run(&request(home.path(), "joined.csv", Some(BatchPart { index, count: 2 }))).expect("done");
        assert!(!part.written && part.now > 0 && !home.path().join("joined.csv").exists());
    }
    let joined = run(&request(home.path(), "joined.csv", None)).expect("done");
    assert_eq!((joined.now, joined.before), (0, 7));
    let read = |name: &str| fs::read(home.path().join(name)).expect("a table");
    assert_eq!(read("joined.csv"), read("whole.csv"));
}

#[test]
fn a_line_that_was_cut_off_is_done_again() {
    let home = home();
    let whole = request(home.path(), "table.csv", None);
    run(&whole).expect("done");
    let (table, journal) = (fs::read(&whole.out).expect("a table"), home.path().join("table.csv.journal"));
    let text = fs::read(&journal).expect("a journal");
    for cut in [text.len() - 1, text.len() - 40, text.len() / 2, 3, 0] {
        fs::write(&journal, &text[..cut]).expect("written");
        let again = run(&whole).expect("done");
        assert!(again.now > 0 && again.now + again.before == 7, "{again:?}");
        assert_eq!(fs::read(&whole.out).expect("a table"), table);
    }
    fs::write(&journal, [&text[..text.len() / 2], b"\n", &text[text.len() / 2..]].concat()).expect("written");
    assert!(matches!(run(&whole), Err(BatchError::Journal { .. })));
}

#[test]
fn other_settings_are_another_batch() {
    let home = home();
    let mut whole = request(home.path(), "table.csv", None);
    run(&whole).expect("done");
    whole.study = AnalysisRequest::named([("threshold", "0.5")]).expect("settings");
    assert!(matches!(run(&whole), Err(BatchError::OtherSettings(_))));
    let held = File::open(home.path().join("table.csv.journal")).expect("a journal");
    held.lock().expect("locked");
    assert!(matches!(run(&request(home.path(), "table.csv", None)), Err(BatchError::AtWork(_))));
}

#[test]
fn a_list_says_what_is_held_out_and_more() {
    let home = home();
    let list = home.path().join("list.csv");
    fs::write(&list, "file, test, amplitude\nruns/run00.csv, runs/run01.csv, 0.5\n# none\nruns/run02.csv,,1\n")
        .expect("written");
    let items = batch_items(&list).expect("records");
    assert_eq!(items.len(), 2);
    assert_eq!(
        (items[0].test.as_deref(), items[1].test.as_deref()),
        (Some(&*home.path().join("runs/run01.csv")), None)
    );
    let reports = Some(home.path().join("reports"));
    run(&BatchRequest { items, reports, ..request(home.path(), "table.csv", None) }).expect("done");
    let table = fs::read_to_string(home.path().join("table.csv")).expect("a table");
    assert!(table.starts_with("record,amplitude,status,") && table.contains("\nruns/run00.csv,0.5,ok,"), "{table}");
    let report = fs::read_to_string(home.path().join("reports/runs_run02.csv.html")).expect("a report");
    assert!(report.trim_end().ends_with("</html>"));
    fs::write(&list, "runs/run00.csv\n\nruns/gone.csv\n").expect("written");
    assert_eq!(batch_items(&list).expect("records")[1].data, home.path().join("runs/gone.csv"));
    assert!(matches!(batch_items(&home.path().join("gone")), Err(BatchError::Read { .. })));
}

#[test]
fn settings_are_read_from_toml_and_projects() {
    let home = tempfile::tempdir().expect("a folder");
    let file = home.path().join("settings.toml");
    let text = "terms = [\"x\", \"v\", \"u\"]\nwindow = 31\nthreshold = 0.02\nrefine = false\nfit_kinematics = true\n\
                kind = \"integral\"\nhold_out = 0.3\n[fix]\nv = -0.1\n[columns]\nx = \"Laser 2\"\nt = 1\n";
    fs::write(&file, text).expect("written");
    let asked = settings_of_file(&file).expect("settings");
    let settings = asked.settings(&Settings::default()).expect("settings");
    assert_eq!(settings.terms, ["x", "v", "u"].map(|t| Term::parse(t).expect("a term")));
    assert_eq!((settings.smoothing.window, settings.threshold, settings.refine), (31, 0.02, false));
    assert_eq!(settings.locks.len(), 1);
    assert_eq!(asked.source.reading.kind, KindName::Integral);
    assert!(asked.source.reading.columns.to_string().contains("x=Laser 2") && asked.source.preparing.steps.len() == 1);
    for (text, said) in
        [("windo = 3", "windo"), ("window = 30", "31"), ("terms = ", "TOML"), ("[fix]\nv = \"a\"", "fix")]
    {
        fs::write(&file, text).expect("written");
        assert!(settings_of_file(&file).expect_err("refused").to_string().contains(said), "{text}");
    }
    let project = serde_json::json!({
        "sindyscope_project": 5,
        "document": {
            "reading": { "rate": 500.0 },
            "edit": { "settings": settings, "steps": [{ "step": "remove-offset" }] },
        },
    });
    let file = home.path().join("study.sindy");
    fs::write(&file, project.to_string()).expect("written");
    let of_project = settings_of_file(&file).expect("settings");
    assert_eq!(of_project.settings(&Settings::default()).expect("settings").terms, settings.terms);
    assert_eq!((of_project.source.reading.rate, of_project.source.preparing.steps.len()), (Some(500.0), 1));
}

#[test]
fn a_parquet_table_is_the_same_after_a_break() {
    let home = home();
    let whole = request(home.path(), "table.parquet", None);
    run(&whole).expect("done");
    let table = fs::read(&whole.out).expect("a table");
    assert!(table.starts_with(b"PAR1") && table.ends_with(b"PAR1"));
    let journal = home.path().join("table.parquet.journal");
    let text = fs::read(&journal).expect("a journal");
    fs::write(&journal, &text[..text.len() / 2]).expect("written");
    fs::remove_file(&whole.out).expect("removed");
    let again = run(&whole).expect("done");
    assert!(again.now > 0 && again.before > 0, "{again:?}");
    assert_eq!(fs::read(&whole.out).expect("a table"), table);
}

#[test]
fn a_batch_searches_for_what_is_missing() {
    let home = home();
    let asked = AnalysisRequest::named([("terms", "x, v")]).expect("settings");
    let missing = Some(missing_of_settings(&asked, 2, false).expect("a search"));
    let whole = BatchRequest { study: asked, missing, ..request(home.path(), "missing.csv", None) };
    let whole = BatchRequest { items: whole.items[..3].to_vec(), ..whole };
    let summary = run(&whole).expect("done");
    assert_eq!((summary.now, summary.failed), (3, 1));
    let table = fs::read_to_string(&whole.out).expect("a table");
    assert!(
        table.starts_with("record,status,error,verdict,effects,places,indistinguishable,base_train_rmse,"),
        "{table}"
    );
    assert!(table.contains("coulomb_friction: F_c,coulomb_friction: F_c std_error"), "{table}");
    assert!(table.lines().nth(2).is_some_and(|row| row.contains(",named,coulomb_friction,ground-1,")), "{table}");
    // Its journal is not that of records that are identified.
    let identified = BatchRequest { missing: None, ..whole };
    assert!(matches!(run(&identified), Err(BatchError::OtherSettings(_))));
    let refused = missing_of_settings(&study(), 2, false).expect_err("window is given").to_string();
    assert!(refused.contains("`window` says how an equation is identified"), "{refused}");
}

#[test]
fn reports_of_a_search_tell_the_equation_and_what_was_found() {
    let home = home();
    let asked = AnalysisRequest::named([("terms", "x, v"), ("window", "15"), ("order", "5")]).expect("settings");
    let missing = Some(missing_of_settings(&asked, 2, true).expect("reports take how an equation is identified"));
    let reports = Some(home.path().join("reports"));
    let whole = BatchRequest { study: asked, missing, reports, ..request(home.path(), "missing.csv", None) };
    let whole = BatchRequest { items: whole.items[..2].to_vec(), ..whole };
    assert_eq!(run(&whole).map(|s| (s.now, s.failed)), Ok((2, 1)));
    let row = |table: &str| {
        let table = fs::read_to_string(home.path().join(table)).expect("a table");
        table.lines().nth(2).expect("a row").to_owned()
    };
    let report = fs::read_to_string(home.path().join("reports/run00.csv.html")).expect("a report");
    for told in ["Coulomb (dry) friction", "Response", "</html>"] {
        assert!(report.contains(told), "{told}");
    }
    // What failed has none.
    assert_eq!(fs::read_dir(home.path().join("reports")).expect("a folder").count(), 1);
    // The table is that of the search without reports.
    let asked = AnalysisRequest::named([("terms", "x, v")]).expect("settings");
    let missing = Some(missing_of_settings(&asked, 2, false).expect("a search"));
    let bare = BatchRequest { study: asked, missing, reports: None, out: home.path().join("bare.csv"), ..whole };
    run(&bare).expect("done");
    assert_eq!(row("missing.csv"), row("bare.csv"));
}
