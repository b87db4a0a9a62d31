//! What a frame of a plot costs: a million samples, a view of 1400 columns.

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

use sindyscope_report::figure::Samples;
use sindyscope_report::figure::thin::{self, Envelope, Raster, Spacing};

const N: usize = 1_000_000;
const INTERVAL: f64 = 1e-3;
const COLUMNS: usize = 1400;

fn signal() -> Vec<f64> {
    (0..N)
        .map(|k| (0.013 * k as f64).sin() + 0.3 * (0.171 * k as f64).sin() + 1e-3 * ((k * 7919) % 101) as f64)
        .collect()
}

fn time_series(criterion: &mut Criterion) {
    let values = signal();
    let mut group = criterion.benchmark_group("a million samples");
    group.bench_function("envelope, once an outcome", |b| b.iter(|| Envelope::new(black_box(&values))));
    let samples = Samples::new(values, Spacing { start: 0.0, interval: INTERVAL });
    let mut points = Vec::new();
    for (name, visible) in [("all of them", 0.0..=1000.0), ("a tenth", 300.0..=400.0), ("a thousandth", 500.0..=501.0)]
    {
        group.bench_function(format!("points of {name}"), |b| {
            b.iter(|| samples.thinned(black_box(visible.clone()), COLUMNS, &mut points));
        });
    }
    group.finish();
}

fn curves(criterion: &mut Criterion) {
    let (x, y) = (signal(), signal().into_iter().skip(120).chain(std::iter::repeat_n(0.0, 120)).collect::<Vec<f64>>());
    let mut points = Vec::new();
    let mut group = criterion.benchmark_group("a million points");
    group.bench_function("phase portrait", |b| {
        b.iter(|| {
            let raster = Raster { min: [-1.5; 2], max: [1.5; 2], scale: [400.0, 200.0] };
            thin::loops(x.iter().zip(&y).map(|(x, y)| [*x, *y]), raster, 20_000, &mut points);
        });
    });
    group.bench_function("spectrum over log f", |b| {
        b.iter(|| {
            let lines = x.iter().enumerate().map(|(k, y)| [((k + 1) as f64).log10(), *y]);
            thin::columns(lines, 0.0..=6.0, COLUMNS, &mut points);
        });
    });
    group.finish();
}

criterion_group!(benches, time_series, curves);
criterion_main!(benches);
