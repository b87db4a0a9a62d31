//! Whoever waits for long work can stop it: a cancel is honoured promptly, whenever it comes.

use std::fmt::Write as _;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use sindyscope_core::study::{
    Calibration, Cancel, FreeSettings, Settings, Study, calibrate, choose, settings_grid, suggest,
};
use sindyscope_files::{MeasuredFile, ReadOptions};
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_search::{Ask, Search};
use sindyscope_values::record::{Record, RecordSet, Role, Usage};
use sindyscope_values::term::Kind;

/// Longest that work goes on after a cancel.
const PROMPT: Duration = Duration::from_millis(50);
/// When work is cancelled, ms after it began.
const AFTER: [u64; 8] = [0, 5, 30, 100, 300, 700, 1500, 3000];
/// Tries of one of these: on a busy machine a thread may wait longer for its turn than for the work.
const TRIES: usize = 20;

/// How long work goes on after a cancel that comes so long after its beginning; none if it has ended by itself before.
fn latency(after: Duration, work: &(impl Fn(&Cancel) + Sync)) -> Option<Duration> {
    let cancel = Cancel::default();
    let (ended, end) = channel();
    thread::scope(|scope| {
        let cancel = &cancel;
        scope.spawn(move || {
            work(cancel);
            ended.send(Instant::now()).expect("someone who waits");
        });
        if end.recv_timeout(after) != Err(RecvTimeoutError::Timeout) {
            return None;
        }
        let asked = Instant::now();
        cancel.cancel();
        Some(end.recv().expect("work without a panic").saturating_duration_since(asked))
    })
}

/// Held by a test for as long as it runs: beside another one's work a cancel waits for a core.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Holds that work stops at once, whenever a cancel comes.
fn stops_at_once(what: &str, work: impl Fn(&Cancel) + Sync) {
    let least = |after: &u64| {
        let mut least = Duration::MAX;
        for _ in 0..TRIES {
            least = least.min(latency(Duration::from_millis(*after), &work)?);
            if least < PROMPT {
                break;
            }
        }
        Some(least)
    };
    // What has ended after so long has ended after longer too.
    let latencies: Vec<Duration> = AFTER.iter().map_while(least).collect();
    println!("{what}: {latencies:.1?} after a cancel");
    assert!(latencies.iter().all(|latency| *latency < PROMPT), "{what}: {latencies:.1?}");
}

fn records(scenario: &str, duration: f64) -> RecordSet {
    let options = ScenarioOptions { seed: 3, duration: Some(duration), ..ScenarioOptions::default() };
    RecordSet::new(generate(scenario, &options).expect("a scenario").records, Usage::Fit)
}

fn with_settings(records: &RecordSet) -> Settings {
    suggest(records, Kind::SecondOrder).expect("settings")
}

#[test]
fn a_study_stops_at_once() {
    let _alone = alone();
    let records = records("duffing-noisy", 600.0);
    let settings = with_settings(&records);
    stops_at_once("study", |cancel| drop(Study::default().run(&records, &settings, cancel)));
    stops_at_once("resampled", |cancel| drop(Study::default().ensemble(&records, &settings, cancel)));
}

#[test]
fn choosing_stops_at_once() {
    let _alone = alone();
    let records = records("friction", 40.0);
    let start = with_settings(&records);
    let free = FreeSettings { window: true, order: true, threshold: true, form: true, refine: true, terms: false };
    stops_at_once("choose", |cancel| drop(choose(&records, &start, free, cancel, &|_, _| {})));
}

#[test]
fn refinement_stops_at_once() {
    let _alone = alone();
    let records = records("duffing-noisy", 40.0);
    let settings = Settings { refine: true, threshold: 0.0, ..with_settings(&records) };
    stops_at_once("refine", |cancel| drop(Study::default().run(&records, &settings, cancel)));
    let sought = [Calibration::Delay(Role::Input(0))];
    stops_at_once("calibrate", |cancel| drop(calibrate(&records, &settings, &sought, cancel)));
}

#[test]
fn a_map_of_settings_stops_at_once() {
    let _alone = alone();
    let records = records("friction", 40.0);
    let settings = with_settings(&records);
    stops_at_once("map", |cancel| drop(settings_grid(&records, &settings, (25, 25), cancel, &|_| {})));
}

#[test]
fn the_search_stops_at_once() {
    let _alone = alone();
    let records = records("friction", 40.0);
    let search = Search::new(&records, &Ask::default()).expect("a search");
    stops_at_once("walk", |cancel| drop(search.diagnose(&|_| {}, cancel)));
    let base = search.stage(&[], &Cancel::default()).expect("a base");
    stops_at_once("stage", |cancel| drop(search.stage(&[], cancel)));
    stops_at_once("look", |cancel| drop(search.look(&base, &|_| {}, cancel)));
}

#[test]
fn the_preparation_of_a_search_stops_at_once() {
    let _alone = alone();
    let options = |seed: u64| ScenarioOptions { seed, duration: Some(600.0), ..ScenarioOptions::default() };
    let of = |seed: u64| generate("duffing-noisy", &options(seed)).expect("a scenario").records;
    let records = RecordSet::new((0..8).flat_map(of), Usage::Fit);
    stops_at_once("prepare", |cancel| {
        // What is measured of a record is kept with it.
        let fresh = records.entries.iter().map(|(record, usage)| (Arc::new(Record::clone(record)), *usage)).collect();
        drop(Search::prepare(&RecordSet { entries: fresh }, &Ask::default(), cancel));
    });
}

#[test]
fn reading_stops_at_once() {
    let _alone = alone();
    let mut text = "t,x,v,a,u\n".to_owned();
    for k in 0..200_000 {
        let t = 1e-3 * f64::from(k);
        writeln!(text, "{t},{},{},{},{}", t.sin(), t.cos(), -t.sin(), (3.0 * t).sin()).expect("text");
    }
    stops_at_once("read", |cancel| {
        let file = MeasuredFile::from_bytes("long.csv", text.clone()).stopped_by(cancel);
        drop(file.read(&ReadOptions::default()));
    });
}
