//! What a frame of the window costs the processor: widgets laid out, shapes made and cut into triangles; 16.7 ms are 60
//! frames a second. How many frames took longer, and the worst of all, is printed beside the mean.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use sindyscope::app::{App, Source, State};
use sindyscope_files::write_csv;
use sindyscope_rig::{ScenarioOptions, generate};

/// Milliseconds that a frame may take at sixty frames a second.
const FRAME: f64 = 16.7;

type Window = Harness<'static, App>;

/// One tone of the friction rig.
fn friction(folder: &Path, samples: usize) -> PathBuf {
    let options = ScenarioOptions {
        frequencies: Some(vec![2.583]),
        duration: Some(samples as f64 / 1000.0),
        ..ScenarioOptions::default()
    };
    let made = generate("friction-noisy", &options).expect("a scenario of the rig");
    let path = folder.join(format!("friction_{samples}.csv"));
    let mut file = std::fs::File::create(&path).expect("a file");
    write_csv(&made.records, &mut file, &made.comments).expect("records");
    path
}

fn open(path: PathBuf) -> Window {
    let state = State::with_source(Source::Files(vec![path]), egui::ThemePreference::Dark);
    let mut window = Harness::builder()
        .with_size([1920.0, 1080.0])
        .build_eframe(|cc| App::with_state(&cc.egui_ctx, state).without_dialogs());
    settle(&mut window);
    window
}

fn settle(window: &mut Window) {
    window.run_steps(3);
    while window.state().busy() {
        std::thread::sleep(Duration::from_millis(3));
        window.step();
    }
    window.run_steps(8);
}

/// One frame, all but the graphics card's part.
fn frame(window: &mut Window) {
    window.step();
    let output = window.output();
    black_box(window.ctx.tessellate(output.shapes.clone(), output.pixels_per_point));
}

fn click(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    window.run_steps(3);
}

/// Frames before each of which something may happen; the frames alone are timed.
fn frames(c: &mut Criterion, name: &str, window: &mut Window, mut before: impl FnMut(&mut Window, usize)) {
    let mut all: Vec<f64> = Vec::new();
    let mut count = 0;
    c.bench_function(name, |b| {
        b.iter_custom(|iterations| {
            let mut total = Duration::ZERO;
            for _ in 0..iterations {
                before(window, count);
                count += 1;
                let begun = Instant::now();
                frame(window);
                let spent = begun.elapsed();
                all.push(1e3 * spent.as_secs_f64());
                total += spent;
            }
            total
        });
    });
    all.sort_by(f64::total_cmp);
    let late = all.iter().filter(|ms| **ms > FRAME).count();
    let (n, worst) = (all.len(), all.last().copied().unwrap_or_default());
    let percentile = all.get(99 * n / 100).copied().unwrap_or_default();
    eprintln!("{name}: {n} frames, 99 % within {percentile:.1} ms, {late} over {FRAME} ms, worst {worst:.1} ms");
}

fn windows(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder");
    for samples in [20_000, 1_000_000] {
        let mut window = open(friction(folder.path(), samples));
        frames(c, &format!("at rest, {samples} samples"), &mut window, |_, _| {});
        frames(c, &format!("a slider dragged, {samples} samples"), &mut window, |window, k| {
            let value = if k % 2 == 0 { 31.0 } else { 33.0 };
            window.get_by_role_and_label(Role::Slider, "Segment").set_value_accesskit(value);
        });
        settle(&mut window);
        click(&mut window, "Tuning");
        click(&mut window, "Map");
        // Every change of the regression makes the map anew.
        frames(c, &format!("while the map fills, {samples} samples"), &mut window, |window, k| {
            if k % 30 == 0 {
                let value = if k % 60 == 0 { 1e-3 } else { 2e-3 };
                window.get_by_role_and_label(Role::Slider, "Ridge α").set_value_accesskit(value);
            }
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(Duration::from_secs(5));
    targets = windows
}
criterion_main!(benches);
