//! Whoever waits for long work can stop it: a cancel is honoured promptly, whenever it comes.

use std::thread;
use std::time::{Duration, Instant};

use sindyscope_core::study::{Cancel, FreeSettings, Settings, Study, choose, suggest};
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_search::{Ask, Search};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Kind;

/// Longest that work goes on after a cancel here: 50 ms are meant for a person, and tests share their cores.
const PROMPT: Duration = Duration::from_millis(500);
/// When work is cancelled, ms after it began.
const AFTER: [u64; 7] = [5, 30, 100, 300, 700, 1500, 3000];

/// How long work goes on after a cancel, the longest of several.
fn slowest(what: &str, work: impl Fn(&Cancel) + Sync) -> Duration {
    let latency = |after: &u64| {
        let cancel = Cancel::default();
        thread::scope(|scope| {
            let working = scope.spawn(|| {
                work(&cancel);
                Instant::now()
            });
            thread::sleep(Duration::from_millis(*after));
            let asked = Instant::now();
            cancel.cancel();
            working.join().expect("work without a panic").saturating_duration_since(asked)
        })
    };
    let latencies: Vec<Duration> = AFTER.iter().map(latency).collect();
    println!("{what}: {latencies:.1?} after a cancel");
    latencies.into_iter().max().unwrap_or_default()
}

fn records(scenario: &str) -> RecordSet {
    let options = ScenarioOptions { seed: 3, duration: Some(40.0), ..ScenarioOptions::default() };
    RecordSet::new(generate(scenario, &options).expect("a scenario").records, Usage::Fit)
}

#[test]
fn choosing_stops_at_once() {
    let records = records("friction");
    let start = suggest(&records, Kind::SecondOrder).expect("settings");
    let free = FreeSettings { window: true, order: true, threshold: true, form: true, refine: true };
    let slowest = slowest("choose", |cancel| drop(choose(&records, &start, free, cancel, &|_, _| {})));
    assert!(slowest < PROMPT, "{slowest:?}");
}

#[test]
fn refinement_stops_at_once() {
    let records = records("duffing-noisy");
    let start = suggest(&records, Kind::SecondOrder).expect("settings");
    let settings = Settings { refine: true, threshold: 0.0, ..start };
    let slowest = slowest("refine", |cancel| drop(Study::default().run(&records, &settings, cancel)));
    assert!(slowest < PROMPT, "{slowest:?}");
}

#[test]
fn the_search_stops_at_once() {
    let records = records("friction");
    let search = |cancel: &Cancel| {
        Search::new(&records, &Ask::default()).and_then(|search| search.diagnose(&|_| {}, cancel)).map(drop)
    };
    let slowest = slowest("search", |cancel| drop(search(cancel)));
    assert!(slowest < PROMPT, "{slowest:?}");
}
