//! A series in the window: the table of a batch, recognised, drawn, saved, and left for one of its records.

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use egui_kittest::kittest::by;
use sindyscope::app::{Sample, SeriesOver, Source};
use sindyscope_analysis::AnalysisRequest;
use sindyscope_analysis::batch::{BatchRequest, batch, batch_items};
use sindyscope_core::study::Cancel;
use sindyscope_rig::{Noise, ScenarioOptions};

use super::{CTRL, Window, look_at, recorded, start};

/// Decays whose stiffness falls with the temperature, one of a stiffness that does not belong, and a file that is none; the table of them.
fn table(home: &Path) -> PathBuf {
    let mut list = "file,temperature,specimen\n".to_owned();
    for k in 0..9_u32 {
        let stiffness = if k == 6 { 340.0 } else { 330.0 - 4.0 * f64::from(k) };
        let options = ScenarioOptions {
            duration: Some(1.0),
            noise: Some(Noise::Deviation(2e-5)),
            seed: u64::from(k),
            parameters: vec![("k".to_owned(), stiffness)],
            ..ScenarioOptions::default()
        };
        recorded(home.join(format!("run{k}.csv")), "friction-decay", &options);
        list += &format!("run{k}.csv,{},A{k}\n", 10 + 2 * k);
    }
    std::fs::write(home.join("bad.csv"), "t,x\n0,1\n0.1,oops\n").unwrap();
    list += "bad.csv,30,B\n";
    std::fs::write(home.join("list.csv"), list).unwrap();
    let settings = [("terms", "x, v, sgn(v)"), ("window", "15"), ("order", "5"), ("threshold", "0"), ("refine", "yes")];
    let request = BatchRequest {
        items: batch_items(&home.join("list.csv")).unwrap(),
        study: AnalysisRequest::named(settings).unwrap(),
        missing: None,
        out: home.join("table.csv"),
        reports: None,
        part: None,
    };
    assert_eq!(batch(&request, &Cancel::default(), &|_| ()).unwrap().failed, 1);
    request.out
}

#[test]
fn the_table_of_a_batch_is_shown_as_a_series_and_a_record_opens_with_a_click() {
    let home = tempfile::tempdir().unwrap();
    let table = table(home.path());
    let mut window = Window::open(start(Source::Sample(Sample::Duffing)));
    // As a file that is dropped: it is known for what it is.
    window.0.state_mut().open(vec![table]);
    window.settle();
    let series = window.app().shown_series().expect("a series");
    assert_eq!((series.over.as_deref(), series.records), (Some("temperature"), 10), "what was varied is chosen");
    let names: Vec<&str> = series.odd.iter().map(|odd| odd.record.as_str()).collect();
    assert_eq!(names, ["run6.csv", "bad.csv"], "{:?}", series.odd);
    let stiffness = &series.parameters[0];
    assert!(stiffness.points.iter().all(|p| p.std_error.is_some()) && stiffness.trend.unwrap().told());
    for text in
        ["table.csv", "10 records", "v: x", "for 1 of temperature", "run6.csv", "standard deviations from the trend"]
    {
        assert!(window.shows(text), "{text}");
    }
    assert!(window.shows("it failed: ") && window.shows("line 3"), "a failure says why");
    look_at(&mut window, "series_light");

    // Over another column, and one parameter alone.
    window.0.get(by().label("Series over")).click();
    window.settle();
    window.click("order of the table");
    assert_eq!(window.app().state().series.over, Some(SeriesOver::Order));
    assert_eq!(window.app().shown_series().unwrap().over, None);
    window.0.get(by().label("Series over")).click();
    window.settle();
    window.click("temperature");
    window.0.get(by().label("Parameter of the series")).click();
    window.settle();
    window.0.get_by_role_and_label(Role::Button, "v: sgn(v)").click();
    window.settle();
    assert_eq!(window.app().state().series.parameter.as_deref(), Some("v: sgn(v)"));

    // The picture and the report.
    window.press(CTRL, Key::E);
    window.click("SVG");
    window.click("Save to…");
    let picture = home.path().join("series.svg");
    window.press(CTRL, Key::A);
    window.type_into("Path", picture.to_str().unwrap());
    window.click("Save");
    let drawn = std::fs::read_to_string(&picture).unwrap();
    assert!(drawn.contains("v: sgn(v)") && drawn.contains("temperature") && !drawn.contains("v: x"));
    window.press(Modifiers::NONE, Key::Escape);
    window.click("Save report…");
    let report = home.path().join("series.html");
    window.press(CTRL, Key::A);
    window.type_into("Path", report.to_str().unwrap());
    window.click("Save");
    let written = std::fs::read_to_string(&report).unwrap();
    assert!(written.contains("Records that do not fit") && written.contains("run6.csv") && written.contains("v: x"));

    assert!(window.shows("10 records over temperature") && !window.shows("fitted in "), "the line at the bottom");

    // A record of the right column: its file opens in place of the series, which the recent files bring back.
    window.click("run6.csv");
    assert!(window.app().shown_series().is_none() && window.shows("fitted in "));
    assert_eq!(window.app().records().entries.len(), 1);
    window.click("run6.csv ⏷");
    window.click("table.csv");
    let series = window.app().shown_series().expect("a series");
    assert_eq!(series.over.as_deref(), Some("temperature"));
    assert_eq!(window.app().state().series.parameter.as_deref(), Some("v: sgn(v)"), "as it was left");
    // A point of the figure.
    let at = point(&window, "v: sgn(v)", "run2.csv");
    window.0.hover_at(at);
    window.0.run_steps(3);
    assert!(window.shows("A click opens the record"), "the pointer is at a record");
    look_at(&mut window, "series_point");
    window.0.drag_at(at);
    window.0.run_steps(1);
    window.0.drop_at(at);
    window.settle();
    assert!(window.app().shown_series().is_none() && window.shows("run2.csv"));
}

/// Where a record lies in the window, from how the plot of its parameter is zoomed.
fn point(window: &Window, parameter: &str, record: &str) -> egui::Pos2 {
    let series = window.app().shown_series().unwrap();
    let of = series.parameters.iter().find(|p| p.name == parameter).unwrap();
    let point = of.points.iter().find(|p| p.record == record).unwrap();
    let plot = egui::Id::unique(("room", "series", 0_u64, "first"));
    let transform = egui_plot::PlotMemory::load(&window.0.ctx, plot).expect("it is drawn").transform();
    egui::pos2(transform.position_from_point_x(point.at), transform.position_from_point_y(point.value))
}

#[test]
fn a_series_is_opened_by_name_survives_a_restart_and_says_what_is_wrong_with_a_table() {
    let home = tempfile::tempdir().unwrap();
    let table = table(home.path());
    let session = home.path().join("session.json");
    let mut window = Window::revived(&session, vec![table.clone()]);
    assert!(window.app().shown_series().is_some(), "a table that is given as it starts");
    window.0.run_steps(5);
    window.settle();
    drop(window);
    let mut again = Window::revived(&session, Vec::new());
    assert_eq!(again.app().shown_series().expect("it came back").records, 10);
    again.click("Close");
    assert!(again.app().shown_series().is_none());

    std::fs::write(home.path().join("other.csv"), "record,status,error,v: x,v: x std_error\na,ok\n").unwrap();
    again.press(CTRL, Key::K);
    again.0.run_steps(2);
    again.type_into("Find a command", "open a series");
    again.press(Modifiers::NONE, Key::Enter);
    again.give_path(&home.path().join("other.csv"), "Open");
    assert!(again.app().shown_series().is_none() && again.shows("cannot read"), "the reason stands in the centre");
    // A Parquet file that is none, or another's, is no measurement either.
    std::fs::write(home.path().join("broken.parquet"), [b"PAR1", [0; 40].as_slice(), b"PAR1"].concat()).unwrap();
    again.press(CTRL, Key::K);
    again.0.run_steps(2);
    again.type_into("Find a command", "open a series");
    again.press(Modifiers::NONE, Key::Enter);
    again.give_path(&home.path().join("broken.parquet"), "Open");
    assert!(again.shows("broken.parquet: ") && again.shows("Other table…") && !again.shows("Choose the columns…"));
    // One that is added to others is refused in words.
    std::fs::copy(&table, home.path().join("copy.csv")).unwrap();
    again.0.state_mut().open(vec![table, home.path().join("copy.csv")]);
    again.settle();
    assert!(again.shows("is a table of many records"));
}
