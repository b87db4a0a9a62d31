//! What a moved slider costs: smoothing, regression and simulation, on one core.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use sindyscope_core::study::{
    Cancel, Differentiation, Formulation, Settings, Smoothing, Stream, StreamSettings, Study, settings_grid, suggest,
};
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Kind, list};

/// Twelve candidate terms.
const LIBRARY: &str = "x, v, u, du, x^2, x^3, v*|v|, sgn(x), sgn(v), sgn(u), sgn(du), 1";

/// Twelve candidate terms of two masses.
const LIBRARY_OF_TWO: &str = "x1, x2, v1, v2, u, x1^3, (x2-x1)^3, v1*|v1|, sgn(v1), sgn(v2-v1), sgn(v2), 1";

fn friction(samples: usize) -> (RecordSet, Settings) {
    let options = ScenarioOptions {
        frequencies: Some(vec![2.583]),
        duration: Some(samples as f64 / 1000.0),
        ..ScenarioOptions::default()
    };
    let records = generate("friction-noisy", &options).expect("a scenario of the rig").records;
    let records = RecordSet::new(records, Usage::Fit);
    let mut settings = suggest(&records, Kind::SecondOrder).expect("a record to fit");
    settings.terms = list(LIBRARY).expect("terms");
    settings.smoothing.window = 31;
    (records, settings)
}

/// Two masses, twelve candidate terms in each equation.
fn two_masses(samples: usize) -> (RecordSet, Settings) {
    let rate = 500.0;
    let options = ScenarioOptions {
        rate: Some(rate),
        duration: Some(samples as f64 / rate),
        noise: Some(Noise::ShareOfPeak(0.01)),
        ..ScenarioOptions::default()
    };
    let records = RecordSet::new(generate("two-masses", &options).expect("a scenario of the rig").records, Usage::Fit);
    let mut settings = suggest(&records, Kind::SecondOrder).expect("a record to fit");
    settings.terms = list(LIBRARY_OF_TWO).expect("terms");
    (records, settings)
}

/// Alternates between two settings, so that nothing is found in the study's memory.
fn alternate(c: &mut Criterion, name: &str, samples: usize, change: impl Fn(&mut Settings, bool)) {
    alternate_on(c, &format!("{name}, {samples} samples"), friction(samples), change);
}

/// The same on the records and from the settings given.
fn alternate_on(
    c: &mut Criterion,
    name: &str,
    (records, settings): (RecordSet, Settings),
    change: impl Fn(&mut Settings, bool),
) {
    let mut study = Study::default();
    let cancel = Cancel::default();
    study.run(&records, &settings, &cancel).expect("an outcome");
    let mut other = false;
    c.bench_function(name, |b| {
        b.iter(|| {
            other = !other;
            let mut settings = settings.clone();
            change(&mut settings, other);
            black_box(study.run(&records, &settings, &cancel).expect("an outcome"))
        });
    });
}

fn studies(c: &mut Criterion) {
    alternate(c, "threshold change", 20_000, |s, other| s.threshold = if other { 0.01 } else { 0.3 });
    alternate_on(c, "threshold change, two masses, 20000 samples", two_masses(20_000), |s, other| {
        s.threshold = if other { 0.01 } else { 0.3 };
    });
    alternate(c, "segment change", 20_000, |s, other| s.smoothing.window = if other { 31 } else { 33 });
    alternate(c, "segment change", 1_000_000, |s, other| s.smoothing.window = if other { 31 } else { 33 });
    for samples in [20_000, 1_000_000] {
        alternate(c, "half width change", samples, |s, other| {
            s.form = Formulation::Weak { half_width: Some(if other { 150 } else { 151 }) };
        });
    }
}

/// What comes before the response: smoothing, library and sparse regression, nothing in the study's memory.
fn fits(c: &mut Criterion) {
    let options = ScenarioOptions { seed: 1, ..ScenarioOptions::default() };
    let records = RecordSet::new(generate("duffing-noisy", &options).expect("a scenario").records, Usage::Fit);
    let mut settings = suggest(&records, Kind::SecondOrder).expect("a record to fit");
    settings.terms = list("x, x^2, x^3, v, v^2, v^3, u, u^2, u^3").expect("terms");
    settings.smoothing = Smoothing { from_data: false, ..settings.smoothing }.with_window(81);
    settings.form = Formulation::Derivative;
    settings.threshold = 0.1;
    settings.refine = false;
    c.bench_function("fit alone, 7000 samples", |b| {
        b.iter_custom(|times| {
            let fit =
                |_| Study::default().run(&records, &settings, &Cancel::default()).expect("an outcome").elapsed.fit;
            Duration::from_secs_f64((0..times).map(fit).sum::<f64>() / 1e3)
        });
    });
}

/// Every way of differentiation, its length moved, on the longest records that it is for.
fn differentiations(c: &mut Criterion) {
    for method in Differentiation::ALL {
        let samples = if method == Differentiation::TotalVariation { Smoothing::MOST_VARIATION } else { 1_000_000 };
        alternate(c, method.title(), samples, |s, other| {
            s.smoothing =
                Smoothing { method, from_data: false, ..s.smoothing }.with_window(if other { 31 } else { 33 });
            // Differences have no length: the threshold moves.
            s.threshold = if other { 0.01 } else { 0.011 };
        });
    }
}

/// The map behind the sliders: the whole, and the coarse one that is shown first.
fn maps(c: &mut Criterion) {
    let (records, settings) = friction(20_000);
    c.bench_function("map of 25 × 25, 20000 samples", |b| {
        b.iter(|| black_box(settings_grid(&records, &settings, (25, 25), &Cancel::default(), &|_| {}).expect("a map")));
    });
    c.bench_function("first coarse map, 20000 samples", |b| {
        b.iter(|| {
            let cancel = Cancel::default();
            let stop = cancel.clone();
            black_box(settings_grid(&records, &settings, (25, 25), &cancel, &move |_| stop.cancel()))
        });
    });
}

/// Samples of a stream, each pushed by itself: rows, blocks, coefficients with their errors, and the judgement of each block.
fn streams(c: &mut Criterion) {
    let options = ScenarioOptions { seed: 1, duration: Some(60.0), ..ScenarioOptions::default() };
    let record = generate("friction-multisine", &options).expect("a scenario").records.remove(0);
    let study = Settings {
        terms: list("x, v, u, du, x^2, x^3, v*|v|, sgn(v), 1").expect("terms"),
        smoothing: Smoothing::default().with_window(31),
        threshold: 0.001,
        ..Settings::default()
    };
    let settings = StreamSettings { study, last: 20.0, false_alarms: 0.1 };
    let samples: Vec<Vec<f64>> =
        (0..record.len()).map(|k| record.channels.iter().map(|c| c.values[k]).collect()).collect();
    let mut stream = Stream::new(record.slice(0..20_000), settings).expect("a stream");
    let mut next = samples.iter().cycle();
    c.bench_function("1000 samples of a stream, 9 terms", |b| {
        b.iter(|| {
            for sample in next.by_ref().take(1000) {
                black_box(stream.push(sample));
            }
        });
    });
}

criterion_group! {
    name = map;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(8));
    targets = maps
}
criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(Duration::from_secs(4));
    targets = studies, fits, streams
}
criterion_group! {
    name = ways;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(3));
    targets = differentiations
}
criterion_main!(map, benches, ways);
