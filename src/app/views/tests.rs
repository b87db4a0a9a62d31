use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;

use egui::{Theme, Vec2, pos2, vec2};
use egui_kittest::kittest::Queryable as _;
use egui_kittest::{Harness, TestRenderer};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};

use super::*;
use crate::app::plot::raster::Rasterizer;
use crate::model::{Equation, Model};
use crate::record::{Channel as RecordChannel, Record, Role, Usage};
use crate::signal::Signals;
use crate::study::{Channel, Elapsed, RecordOutcome, Score, Settings};
use crate::term::{Kind, Layout, Symbol};

/// What an outcome of these tests is like.
#[derive(Clone, Copy)]
struct Case {
    samples: usize,
    interval: f64,
    freedoms: usize,
    inputs: usize,
    usage: Usage,
    /// Share of the record after which the response left the data's range.
    diverges: Option<f64>,
    /// Relative error of the identified frequency.
    detuned: f64,
}

impl Default for Case {
    fn default() -> Self {
        Self { samples: 6000, interval: 5e-3, freedoms: 1, inputs: 1, usage: Usage::Fit, diverges: None, detuned: 4e-4 }
    }
}

const NOISE: f64 = 2e-5;

/// Steady vibration at 1.3 Hz and a decaying one at 3 Hz, as a linear oscillator with a force has: displacement in metres,
/// velocity, acceleration.
fn motion(t: f64, freedom: usize, detuned: f64) -> [f64; 3] {
    let scale = 1.0 / (1.0 + freedom as f64);
    let (forced, own, decay) = (TAU * 1.3, TAU * 3.0 * (1.0 + detuned), 0.12);
    let (a, b) = (1.1e-3 * scale, 1.4e-3 * scale);
    let e = (-decay * t).exp();
    let (s, c) = (own * t).sin_cos();
    let (fs, fc) = (forced * t).sin_cos();
    [
        a * fs + b * e * c,
        a * forced * fc - b * e * (decay * c + own * s),
        -a * forced * forced * fs + b * e * ((decay * decay - own * own) * c + 2.0 * decay * own * s),
    ]
}

fn outcome_of(cases: &[Case]) -> Arc<Outcome> {
    let Case { freedoms, inputs, .. } = cases[0];
    let layout = Layout { kind: Kind::SecondOrder, freedoms, inputs };
    let records: Vec<RecordOutcome> = cases.iter().enumerate().map(|(i, case)| record_of(i, case)).collect();
    Arc::new(Outcome {
        settings: Settings::default(),
        model: Model { layout, equations: vec![Equation { terms: Vec::new() }; layout.states()] },
        fits: Vec::new(),
        train: records[0].channels[0].score,
        test: None,
        records,
        noise_floor: Some(NOISE),
        warnings: Vec::new(),
        elapsed: Elapsed::default(),
    })
}

fn record_of(index: usize, case: &Case) -> RecordOutcome {
    let Case { samples: n, interval, freedoms, inputs, .. } = *case;
    let mut random = rand_pcg::Pcg64::seed_from_u64(7 + index as u64);
    let normal = Normal::new(0.0, NOISE).unwrap();
    let time = |k: usize| interval * k as f64;
    let series = |freedom: usize, which: usize, detuned: f64, count: usize| -> Vec<f64> {
        (0..count).map(|k| motion(time(k), freedom, detuned)[which]).collect()
    };
    let force = |k: usize| 0.4 * (TAU * 1.3 * time(k)).sin();
    let lasts = case.diverges.map_or(n, |share| (share * n as f64) as usize);
    let grows = |k: usize, x: f64| match case.diverges {
        Some(_) => x + 1e-4 * (6.0 * (k as f64 / lasts as f64)).exp(),
        None => x,
    };
    let mut channels = Vec::new();
    let mut scored = Vec::new();
    for freedom in 0..freedoms {
        let values: Vec<f64> = series(freedom, 0, 0.0, n).iter().map(|x| x + normal.sample(&mut random)).collect();
        let response: Vec<f64> =
            series(freedom, 0, case.detuned, lasts).iter().enumerate().map(|(k, x)| grows(k, *x)).collect();
        let error: Vec<f64> = values.iter().zip(&response).map(|(a, b)| (a - b).abs()).collect();
        let rmse = (error.iter().map(|e| e * e).sum::<f64>() / lasts.max(1) as f64).sqrt();
        let max_error = error.iter().copied().fold(0.0, f64::max);
        let score = Score { rmse, nrmse: rmse / 1e-3, max_error, best_fit: 98.76, samples: lasts };
        scored.push(Channel { symbol: Symbol::State(freedom), response, error, score: (lasts > 0).then_some(score) });
        channels.push(RecordChannel {
            name: format!("x{}", freedom + 1),
            role: Role::Displacement(freedom),
            unit: "m".into(),
            values: values.into(),
        });
    }
    for input in 0..inputs {
        channels.push(RecordChannel {
            name: "force".into(),
            role: Role::Input(input),
            unit: "N".into(),
            values: (0..n).map(force).collect(),
        });
    }
    let all = |which: usize| -> Vec<Vec<f64>> { (0..freedoms).map(|f| series(f, which, 0.0, n)).collect() };
    let simulated = |which: usize| (0..freedoms).map(move |f| series(f, which, case.detuned, lasts));
    RecordOutcome {
        record: Arc::new(Record {
            name: format!("run {}", index + 1),
            source: None,
            start: 0.0,
            interval,
            channels,
            notices: Vec::new(),
        }),
        usage: case.usage,
        signals: Arc::new(Signals {
            start: 0.0,
            interval,
            states: [all(0), all(1)].concat(),
            rates: [all(1), all(2)].concat(),
            inputs: vec![(0..n).map(force).collect(); inputs],
            input_rates: vec![(0..n).map(|k| 0.4 * TAU * 1.3 * (TAU * 1.3 * time(k)).cos()).collect(); inputs],
            main_period: Some(1.0 / 1.3),
            noise: vec![NOISE; freedoms],
        }),
        states: simulated(0).chain(simulated(1)).collect(),
        channels: scored,
        diverged_at: case.diverges.map(|_| time(lasts)),
    }
}

/// A central panel with one view, as the window has it.
struct Stage {
    view: View,
    outcome: Arc<Outcome>,
    previous: Option<Arc<Outcome>>,
    record: usize,
    stale: bool,
    state: ViewState,
    asked: Option<Request>,
}

impl Stage {
    fn new(view: View, cases: &[Case]) -> Self {
        Self {
            view,
            outcome: outcome_of(cases),
            previous: None,
            record: 0,
            stale: false,
            state: ViewState::default(),
            asked: None,
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui) {
        let picture = Picture {
            outcome: &self.outcome,
            previous: self.previous.as_ref(),
            record: self.record,
            stale: self.stale,
        };
        let asked = show(ui, self.view, &picture, &mut self.state);
        self.asked = asked.or(self.asked.take());
    }

    fn harness(self, size: Vec2, theme: Theme) -> Harness<'static, Self> {
        let mut harness = Harness::builder()
            .with_size(size)
            .with_theme(theme)
            .with_max_steps(12)
            .renderer(Software::default())
            .build_ui_state(|ui, stage: &mut Self| stage.ui(ui), self);
        harness.run();
        harness
    }
}

/// Pictures without a graphics card, alike on every machine.
#[derive(Default)]
struct Software(Rasterizer);

impl TestRenderer for Software {
    fn handle_delta(&mut self, delta: &mut egui::TexturesDelta) {
        self.0.update(delta);
    }

    fn render(&mut self, ctx: &egui::Context, output: &egui::FullOutput) -> Result<image::RgbaImage, String> {
        let primitives = ctx.tessellate(output.shapes.clone(), output.pixels_per_point);
        let size = ctx.content_rect().size() * output.pixels_per_point;
        let ground = ctx.global_style().visuals.panel_fill;
        Ok(self.0.draw(&primitives, [size.x as u32, size.y as u32], output.pixels_per_point, ground))
    }
}

const SIZE: Vec2 = vec2(760.0, 640.0);

fn cases() -> Vec<(&'static str, Case)> {
    let usual = Case::default();
    vec![
        ("usual", usual),
        ("diverged", Case { diverges: Some(0.4), ..usual }),
        ("diverged at once", Case { diverges: Some(0.0), ..usual }),
        ("one sample", Case { samples: 1, ..usual }),
        ("two samples", Case { samples: 2, ..usual }),
        ("no input", Case { inputs: 0, ..usual }),
        ("two degrees of freedom", Case { freedoms: 2, inputs: 2, usage: Usage::HeldOut, ..usual }),
        ("a perfect model", Case { detuned: 0.0, ..usual }),
    ]
}

#[test]
fn look() {
    let Ok(folder) = std::env::var("LOOK") else { return };
    let folder = PathBuf::from(folder);
    for (size, suffix) in [(SIZE, ""), (vec2(1400.0, 900.0), "-wide")] {
        for theme in [Theme::Light, Theme::Dark] {
            for view in View::ALL {
                let mut stage = Stage::new(view, &[Case { usage: Usage::HeldOut, ..Case::default() }, Case::default()]);
                stage.state.acceleration = true;
                if view == View::Response {
                    stage.previous = Some(Arc::new(Outcome {
                        records: vec![RecordOutcome {
                            record: stage.outcome.records[0].record.clone(),
                            ..record_of(0, &Case { detuned: 4e-3, ..Case::default() })
                        }],
                        ..(*stage.outcome).clone()
                    }));
                }
                let mut harness = stage.harness(size, theme);
                let image = harness.render().unwrap();
                image.save(folder.join(format!("{}-{theme:?}{suffix}.png", view.label()))).unwrap();
            }
        }
    }
    for (name, case) in cases() {
        let mut stage = Stage::new(View::Response, &[case]);
        stage.state.log_error = name == "usual";
        let mut harness = stage.harness(SIZE, Theme::Light);
        harness.hover_at(pos2(400.0, 200.0));
        harness.run();
        harness.render().unwrap().save(folder.join(format!("case {name}.png"))).unwrap();
    }
    let stage = Stage::new(View::Response, &[Case::default()]);
    let picture = Picture { outcome: &stage.outcome, previous: None, record: 0, stale: false };
    for view in [View::Response, View::Phase] {
        render(None, view, &picture, &stage.state, &Sheet::default())
            .save(folder.join(format!("print {view:?}.png")))
            .unwrap();
    }
}
