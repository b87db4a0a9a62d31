#[path = "../../../tests/support/raster.rs"]
mod raster;

use std::f64::consts::TAU;
use std::sync::Arc;

use egui::{Theme, Vec2, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};

use super::*;
use raster::Software;
use sindyscope_core::signal::Signals;
use sindyscope_core::study::{Elapsed, Outcome, RecordOutcome, Score, SensorResponse, Settings};
use sindyscope_report::document::FigureSize;
use sindyscope_report::view::ViewOptions;
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::{Channel as RecordChannel, Record, Role, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol};

/// What an outcome of these tests is like.
#[derive(Clone, Copy)]
struct OutcomeCase {
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

impl Default for OutcomeCase {
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

fn outcome_of(cases: &[OutcomeCase]) -> Arc<Outcome> {
    let OutcomeCase { freedoms, inputs, .. } = cases[0];
    let layout = Layout { kind: Kind::SecondOrder, freedoms, inputs, internals: 0 };
    let records: Vec<RecordOutcome> = cases.iter().enumerate().map(|(i, case)| record_of(i, case)).collect();
    Arc::new(Outcome {
        settings: Settings::default(),
        model: Model { layout, equations: vec![Equation { terms: Vec::new() }; layout.states()], static_ratio: 1.0 },
        refinement: None,
        fits: Vec::new(),
        covariance: sindyscope_core::study::Covariance::default(),
        train: records[0].channels[0].score,
        test: None,
        records,
        noise_floor: Some(NOISE),
        warnings: Vec::new(),
        elapsed: Elapsed::default(),
    })
}

fn record_of(index: usize, case: &OutcomeCase) -> RecordOutcome {
    let OutcomeCase { samples: n, interval, freedoms, inputs, .. } = *case;
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
        scored.push(SensorResponse {
            symbol: Symbol::State(freedom),
            role: Role::Displacement(freedom),
            response,
            error,
            score: (lasts > 0).then_some(score),
        });
        channels.push(RecordChannel {
            name: format!("x{}", freedom + 1),
            role: Role::Displacement(freedom),
            unit: "m".into(),
            values: values.into(),
            estimated: false,
        });
    }
    for input in 0..inputs {
        channels.push(RecordChannel {
            name: "force".into(),
            role: Role::Input(input),
            unit: "N".into(),
            values: (0..n).map(force).collect(),
            estimated: false,
        });
    }
    let all = |which: usize| -> Vec<Vec<f64>> { (0..freedoms).map(|f| series(f, which, 0.0, n)).collect() };
    let simulated = |which: usize| (0..freedoms).map(move |f| series(f, which, case.detuned, lasts));
    let force_rate = |k: usize| 0.4 * TAU * 1.3 * (TAU * 1.3 * time(k)).cos();
    let mut signals = Signals::known(
        (0.0, interval),
        [[all(0), all(1)].concat(), [all(1), all(2)].concat()],
        [vec![(0..n).map(force).collect(); inputs], vec![(0..n).map(force_rate).collect(); inputs]],
    );
    signals.length = 31.0;
    signals.main_period = Some(1.0 / 1.3);
    signals.noise = vec![NOISE; freedoms];
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
        driven_as_measured: true,
        scored_from: 0,
        standing: Arc::default(),
        sticks: Vec::new(),
        signals: Arc::new(signals),
        states: simulated(0).chain(simulated(1)).collect(),
        channels: scored,
        diverged_at: case.diverges.map(|_| time(lasts)),
    }
}

/// A central panel with one view, as the window has it.
struct ViewStage {
    view: View,
    outcome: Arc<Outcome>,
    previous: Option<Arc<Outcome>>,
    record: usize,
    stale: bool,
    state: ViewState,
    fitted: u64,
    figures: ViewFigures,
    wanted: Vec<FigureRequest>,
    plots: Plots,
    asked: Option<ViewAct>,
}

impl ViewStage {
    fn new(view: View, cases: &[OutcomeCase]) -> Self {
        Self {
            view,
            outcome: outcome_of(cases),
            previous: None,
            record: 0,
            stale: false,
            state: ViewState::default(),
            fitted: 0,
            figures: ViewFigures::default(),
            wanted: Vec::new(),
            plots: Plots::default(),
            asked: None,
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui) {
        let (previous, record, stale, fitted) = (self.previous.as_ref(), self.record, self.stale, self.fitted);
        let picture = Picture { previous, record, stale, fitted, ..Picture::of(&self.outcome) };
        self.wanted.extend(self.figures.attend(self.view, &picture, &self.state.options));
        let asked = show(ui, self.view, (&picture, &self.figures), &mut self.state, &mut self.plots);
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
        settle(&mut harness);
        harness
    }
}

/// Makes the figures that the window makes in the background.
fn settle(harness: &mut Harness<'_, ViewStage>) {
    for request in std::mem::take(&mut harness.state_mut().wanted) {
        request.make();
    }
    harness.run();
}

/// A free motion of 2 Hz that loses a hundredth of its amplitude in a swing.
fn decaying(n: usize) -> ViewStage {
    let mut stage = ViewStage::new(View::Decay, &[OutcomeCase { samples: n, inputs: 0, ..OutcomeCase::default() }]);
    let mut outcome = (*stage.outcome).clone();
    let record = &mut outcome.records[0];
    let at = |k: usize| 1e-3 * (-0.02 * k as f64 * 5e-3).exp() * (TAU * 2.0 * k as f64 * 5e-3).cos();
    let x: Vec<f64> = (0..n).map(at).collect();
    let mut data = (*record.record).clone();
    data.channels[0].values = x.clone().into();
    record.record = Arc::new(data);
    let mut signals = (*record.signals).clone();
    signals.noise = vec![1e-7];
    record.signals = Arc::new(signals);
    record.channels[0].response = x;
    stage.outcome = Arc::new(outcome);
    stage
}

#[test]
fn a_decay_is_drawn_and_anything_else_is_told_so() {
    let harness = decaying(6000).harness(SIZE, Theme::Light);
    harness.get_by_label_contains("backbone: ");
    harness.get_by_label_contains("damping ratio over amplitude");
    let driven = ViewStage::new(View::Decay, &[OutcomeCase::default()]).harness(SIZE, Theme::Light);
    driven.get_by_label_contains("its input never rests");
    let short = ViewStage::new(View::Decay, &[OutcomeCase { samples: 40, inputs: 0, ..OutcomeCase::default() }]);
    short.harness(SIZE, Theme::Dark).get_by_label_contains("This record is no free decay");
}

#[test]
fn a_frequency_response_needs_an_input_and_pools_the_records() {
    let case = OutcomeCase::default();
    let mut harness = ViewStage::new(View::Transfer, &[case, case, case]).harness(SIZE, Theme::Light);
    harness.get_by_label("all 3 records");
    harness.get_by_label_contains("3 tones in steady state");
    harness.get_by_label("one record").click();
    harness.run();
    settle(&mut harness);
    harness.get_by_label_contains("1 tone in steady state");
    let none = ViewStage::new(View::Transfer, &[OutcomeCase { inputs: 0, ..case }]).harness(SIZE, Theme::Light);
    none.get_by_label_contains("have no input");
}

#[test]
fn a_residual_is_held_against_what_one_chooses() {
    let mut harness = ViewStage::new(View::Residual, &[OutcomeCase::default()]).harness(SIZE, Theme::Dark);
    harness.get_by_label_contains("autocorrelation");
    harness.get_by_label_contains("correlation with u");
    harness.get_by_label("against x²").click();
    harness.run();
    harness.get_by_label_contains("correlation with x²");
    harness.get_by_label("acceleration").click();
    harness.run();
    settle(&mut harness);
    harness.get_by_label_contains("Smoothing itself colours");
    let exact = OutcomeCase { detuned: 0.0, samples: 20, ..OutcomeCase::default() };
    let nothing = ViewStage::new(View::Residual, &[exact]).harness(SIZE, Theme::Light);
    nothing.get_by_label_contains("There is no residual to judge");
}

#[test]
fn forces_need_an_equation_of_second_order() {
    for view in [View::Restoring, View::Friction] {
        let mut stage = ViewStage::new(view, &[OutcomeCase { freedoms: 3, inputs: 0, ..OutcomeCase::default() }]);
        let mut outcome = (*stage.outcome).clone();
        outcome.model = Model::first_order(0, vec![Equation { terms: Vec::new() }; 3]);
        outcome.records.iter_mut().for_each(|r| r.states.truncate(3));
        stage.outcome = Arc::new(outcome);
        stage.harness(SIZE, Theme::Light).get_by_label_contains("of second order");
    }
}

/// Clicks with the right button in a plot and takes an entry of its menu.
fn choose_from_menu(harness: &mut Harness<'_, ViewStage>, at: egui::Pos2, entry: &str) {
    harness.event(egui::Event::PointerMoved(at));
    for pressed in [true, false] {
        harness.event(egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Secondary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        });
    }
    harness.run();
    harness.get_by_label(entry).click();
    harness.step();
}

#[test]
fn every_view_of_physics_copies_its_numbers_and_asks_for_a_picture() {
    for (view, head) in [
        (View::Restoring, "x (m),v (m/s),force / mass (m/s²)\n"),
        (View::Friction, "v (m/s),force / mass (m/s²) mean,standard error,visits,"),
        (View::Transfer, "f (Hz),gain (m/N) measured,gain (m/N) identified\n"),
        (View::Decay, "amplitude of x (m) measured,frequency (Hz) measured,"),
        (View::Residual, "residual (m),density (1/m),"),
    ] {
        let stage = if view == View::Decay { decaying(6000) } else { ViewStage::new(view, &[OutcomeCase::default()]) };
        let mut harness = stage.harness(SIZE, Theme::Light);
        let at = pos2(240.0, 240.0);
        choose_from_menu(&mut harness, at, "Copy what is shown as CSV");
        let copied = harness.output().platform_output.commands.iter().find_map(|c| match c {
            egui::OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        });
        let text = copied.unwrap();
        assert!(text.starts_with(head), "{view:?}: {}", text.lines().next().unwrap());
        assert!(text.lines().count() > 1, "{view:?}");
        harness.run();
        choose_from_menu(&mut harness, at, "Save picture…");
        harness.run();
        assert_eq!(harness.state().asked, Some(ViewAct::SavePicture), "{view:?}");
        // The wheel zooms, a double click shows all again.
        let whole = bounds(&harness, view);
        harness.hover_at(at);
        harness.event(egui::Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: vec2(0.0, 120.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Unknown,
            modifiers: egui::Modifiers::NONE,
        });
        harness.run();
        assert!(bounds(&harness, view) < 0.8 * whole, "{view:?}");
        harness.state_mut().fitted += 1;
        harness.run();
        harness.run();
        assert!((bounds(&harness, view) / whole - 1.0).abs() < 1e-6, "{view:?}");
    }
}

/// Width of what the first graph of a view shows.
fn bounds(harness: &Harness<'_, ViewStage>, view: View) -> f64 {
    let graph = match view {
        View::Restoring => "surface",
        View::Friction => "friction",
        View::Transfer => "gain",
        View::Decay => "backbone",
        _ => "histogram",
    };
    let id = Id::unique(("view", view, graph));
    egui_plot::PlotMemory::load(&harness.ctx, id).unwrap().bounds().width()
}

const SIZE: Vec2 = vec2(760.0, 640.0);

fn cases() -> Vec<(&'static str, OutcomeCase)> {
    let usual = OutcomeCase::default();
    vec![
        ("usual", usual),
        ("diverged", OutcomeCase { diverges: Some(0.4), ..usual }),
        ("diverged at once", OutcomeCase { diverges: Some(0.0), ..usual }),
        ("one sample", OutcomeCase { samples: 1, ..usual }),
        ("two samples", OutcomeCase { samples: 2, ..usual }),
        ("no input", OutcomeCase { inputs: 0, ..usual }),
        ("two degrees of freedom", OutcomeCase { freedoms: 2, inputs: 2, usage: Usage::HeldOut, ..usual }),
        ("a perfect model", OutcomeCase { detuned: 0.0, ..usual }),
    ]
}

#[test]
fn every_view_shows_every_outcome() {
    for view in View::ALL {
        for (name, case) in cases() {
            for theme in [Theme::Light, Theme::Dark] {
                let mut stage = ViewStage::new(view, &[case, case]);
                stage.state.options.acceleration = true;
                stage.state.options.log_error = theme == Theme::Dark;
                stage.state.options.log_frequency = theme == Theme::Dark;
                stage.previous = Some(outcome_of(&[case, case]));
                let mut harness = stage.harness(SIZE, theme);
                harness.hover_at(pos2(400.0, 200.0));
                harness.run();
                assert!(harness.state().asked.is_none(), "{view:?}, {name}");
            }
        }
    }
}

#[test]
fn outcomes_without_records_and_records_without_samples_say_so() {
    let mut empty = ViewStage::new(View::Response, &[OutcomeCase::default()]);
    empty.outcome = Arc::new(Outcome { records: Vec::new(), ..(*empty.outcome).clone() });
    let harness = empty.harness(SIZE, Theme::Light);
    harness.get_by_label_contains("No record is marked fit");
    for view in View::ALL {
        ViewStage::new(view, &[OutcomeCase { samples: 0, ..OutcomeCase::default() }]).harness(SIZE, Theme::Light);
    }
    // A record index and choices left over from other data.
    let mut stage = ViewStage::new(View::Response, &[OutcomeCase::default()]);
    stage.record = 7;
    stage.state.options = ViewOptions { freedom: 9, input: 9, ..ViewOptions::default() };
    stage.harness(SIZE, Theme::Light).get_by_label("run 1");
}

#[test]
fn first_order_states_are_shown() {
    for view in View::ALL {
        let mut stage = ViewStage::new(view, &[OutcomeCase { freedoms: 3, inputs: 0, ..OutcomeCase::default() }]);
        let mut outcome = (*stage.outcome).clone();
        outcome.model = Model::first_order(0, vec![Equation { terms: Vec::new() }; 3]);
        outcome.records.iter_mut().for_each(|r| r.states.truncate(3));
        stage.outcome = Arc::new(outcome);
        let harness = stage.harness(SIZE, Theme::Light);
        if view == View::Response {
            harness.get_by_label("x3");
        }
    }
}

#[test]
fn the_pointer_reads_values() {
    let mut harness = ViewStage::new(View::Response, &[OutcomeCase::default()]).harness(SIZE, Theme::Light);
    harness.hover_at(pos2(400.0, 200.0));
    harness.run();
    for name in ["t", "x measured", "x identified", "E error"] {
        harness.get_by_label(name);
    }
    let id = Id::unique(("view", View::Response, "response"));
    let transform = egui_plot::PlotMemory::load(&harness.ctx, id).unwrap().transform();
    let t = transform.value_from_position(pos2(400.0, 200.0)).x;
    let measured = harness.state().outcome.records[0].record.channels[0].values[(t / 5e-3).round() as usize];
    let shown = crate::app::plot::number::significant(measured * 1e3, 4);
    harness.get_by_label_contains(&format!("{shown} mm"));

    // In the plot beneath the same instant is read.
    harness.hover_at(pos2(400.0, 500.0));
    harness.run();
    harness.get_by_label_contains(&format!("{shown} mm"));

    harness.remove_cursor();
    harness.run();
    assert!(harness.query_by_label("x measured").is_none());
}

#[test]
fn legends_switch_curves() {
    let mut harness = ViewStage::new(View::Response, &[OutcomeCase::default()]).harness(SIZE, Theme::Light);
    let all = harness.render().unwrap();
    harness.get_by_label("identified").click();
    harness.run();
    assert_eq!(harness.state().state.hidden, BTreeSet::from([Ink::Identified]));
    harness.remove_cursor();
    harness.run();
    assert_ne!(harness.render().unwrap(), all);
    harness.get_by_label("identified").click();
    harness.run();
    assert!(harness.state().state.hidden.is_empty());

    // Alt-click shows one alone, and all again.
    for hidden in [vec![Ink::Identified], vec![]] {
        harness.get_by_label("measured").click_modifiers(egui::Modifiers::ALT);
        harness.run();
        assert_eq!(harness.state().state.hidden, hidden.into_iter().collect());
    }
}

/// The words in the line above the upper plot, with their places.
fn head_words(harness: &Harness<'_, ViewStage>) -> Vec<(String, egui::Rect)> {
    let id = Id::unique(("view", View::Response, "response"));
    let frame = *egui_plot::PlotMemory::load(&harness.ctx, id).unwrap().transform().frame();
    let nodes = harness.root().children_recursive();
    let named = nodes.filter_map(|node| {
        let inner = node.accesskit_node();
        Some((inner.label().or(inner.value())?, node.rect()))
    });
    named.filter(|(_, rect)| rect.bottom() <= frame.top() + 1.0 && rect.bottom() > frame.top() - 22.0).collect()
}

#[test]
fn what_is_said_above_a_plot_never_overlaps_and_stays_while_a_slider_moves() {
    let mut stage = ViewStage::new(View::Response, &[OutcomeCase { usage: Usage::HeldOut, ..OutcomeCase::default() }]);
    let mut outcome = (*stage.outcome).clone();
    outcome.records[0].standing = (0..11).map(|k| 500 * k..500 * k + 365).collect::<Vec<_>>().into();
    outcome.records[0].sticks = vec![0.0..1.0; 11];
    stage.outcome = Arc::new(outcome);
    let mut harness = stage.harness(SIZE, Theme::Light);
    let at_right = |words: &[(String, egui::Rect)]| {
        let mut said: Vec<String> = words.iter().map(|(word, _)| word.clone()).collect();
        said.retain(|word| !["measured", "identified", "before"].contains(&word.as_str()));
        said
    };
    let mut said = BTreeSet::new();
    for width in (360..1200).step_by(20) {
        harness.set_size(vec2(width as f32, 700.0));
        harness.state_mut().previous = None;
        harness.run();
        let before = at_right(&head_words(&harness));
        let state = harness.state_mut();
        state.previous = Some(Arc::clone(&state.outcome));
        harness.run();
        let words = head_words(&harness);
        assert!(words.iter().any(|(word, _)| word == "before"), "{width}: {words:?}");
        for (k, (word, rect)) in words.iter().enumerate() {
            assert!(rect.right() <= width as f32, "{word} leaves the window at {width}");
            for (other, place) in words[..k].iter().filter(|(other, _)| other != word) {
                assert!(!rect.shrink(0.5).intersects(place.shrink(0.5)), "{word} on {other} at {width}");
            }
        }
        assert_eq!(at_right(&words), before, "at {width}");
        said.extend(before);
    }
    let stops = ["11 stops measured", "11 stops measured (67 % of the time), 11 simulated"];
    assert!(stops.iter().all(|text| said.contains(*text)), "{said:?}");
}

/// The range of time that a plot shows.
fn time_shown(harness: &Harness<'_, ViewStage>, plot: &str) -> (f64, f64) {
    let id = Id::unique(("view", harness.state().view, plot));
    let memory = egui_plot::PlotMemory::load(&harness.ctx, id).unwrap();
    (memory.bounds().min()[0], memory.bounds().max()[0])
}

#[test]
fn the_worst_stretch_is_one_click_away_and_a_double_click_shows_all() {
    let mut harness = ViewStage::new(View::Response, &[OutcomeCase::default()]).harness(SIZE, Theme::Light);
    let whole = time_shown(&harness, "response");
    assert!(whole.0 < 0.0 && whole.1 > 29.9 && whole.1 < 31.0, "{whole:?}");
    harness.get_by_label_contains("worst ").click();
    harness.run();
    let near = time_shown(&harness, "response");
    assert!(near.1 - near.0 < 8.0, "{near:?}");
    assert_eq!(near, time_shown(&harness, "error"), "plots above each other show the same time");

    // The other views over time show it too.
    harness.state_mut().view = View::Input;
    harness.run();
    harness.run();

    harness.state_mut().view = View::Response;
    harness.run();
    let at = pos2(400.0, 500.0);
    for pressed in [true, false, true, false] {
        harness.event(egui::Event::PointerMoved(at));
        harness.event(egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        });
    }
    harness.run();
    assert_eq!(time_shown(&harness, "response"), whole);
}

#[test]
fn the_wheel_zooms_time_and_a_new_outcome_of_the_same_record_keeps_the_zoom() {
    let mut harness = ViewStage::new(
        View::Response,
        &[OutcomeCase::default(), OutcomeCase { samples: 900, ..OutcomeCase::default() }],
    )
    .harness(SIZE, Theme::Light);
    let whole = time_shown(&harness, "response");
    harness.hover_at(pos2(400.0, 200.0));
    harness.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, 120.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: egui::Modifiers::NONE,
    });
    harness.run();
    let near = time_shown(&harness, "response");
    assert!(near.1 - near.0 < 0.8 * (whole.1 - whole.0), "{near:?}");
    assert_eq!(time_shown(&harness, "error"), near);

    let mut changed = (*harness.state().outcome).clone();
    changed.records[0].channels[0].response.iter_mut().for_each(|x| *x *= 1.1);
    let stage = harness.state_mut();
    stage.previous = Some(std::mem::replace(&mut stage.outcome, Arc::new(changed)));
    harness.run();
    assert_eq!(time_shown(&harness, "response"), near);
    harness.get_all_by_label("before").next().unwrap();

    harness.state_mut().record = 1;
    harness.run();
    let other = time_shown(&harness, "response");
    assert!(other.1 < 5.0, "another record is shown whole: {other:?}");
}

#[test]
fn the_menu_copies_what_is_shown_and_asks_for_a_picture() {
    let mut harness = ViewStage::new(View::Response, &[OutcomeCase { samples: 50, ..OutcomeCase::default() }])
        .harness(SIZE, Theme::Light);
    let open = |harness: &mut Harness<'_, ViewStage>| {
        let at = pos2(400.0, 200.0);
        harness.event(egui::Event::PointerMoved(at));
        for pressed in [true, false] {
            harness.event(egui::Event::PointerButton {
                pos: at,
                button: egui::PointerButton::Secondary,
                pressed,
                modifiers: egui::Modifiers::NONE,
            });
        }
        harness.run();
    };
    open(&mut harness);
    harness.get_by_label("Copy what is shown as CSV").click();
    harness.step();
    let copied = harness.output().platform_output.commands.iter().find_map(|c| match c {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    let text = copied.unwrap();
    assert!(text.starts_with("t (s),x measured (m),x identified (m),E error (m)\n0,"), "{text}");
    assert_eq!(text.lines().count(), 51);

    harness.run();
    open(&mut harness);
    harness.get_by_label("Save picture…").click();
    harness.run();
    assert_eq!(harness.state().asked, Some(ViewAct::SavePicture));
}

#[test]
fn the_header_steps_through_records_and_chooses_degrees_of_freedom() {
    let case = OutcomeCase { freedoms: 2, ..OutcomeCase::default() };
    let mut harness = ViewStage::new(View::Response, &[case, case]).harness(SIZE, Theme::Light);
    harness.get_by_label("Next record").click();
    harness.run();
    assert_eq!(harness.state().asked, Some(ViewAct::ShowRecord(1)));
    harness.get_by_label("x2").click();
    harness.run();
    assert_eq!(harness.state().state.options.freedom, 1);
}

#[test]
fn what_is_chosen_survives_a_restart() {
    let mut state = ViewState::default();
    state.hidden = BTreeSet::from([Ink::Measured]);
    state.options = ViewOptions { freedom: 1, log_frequency: true, ..ViewOptions::default() };
    let text = serde_json::to_string(&state).unwrap();
    let read: ViewState = serde_json::from_str(&text).unwrap();
    assert_eq!((read.hidden, read.options.freedom, read.options.log_frequency), (state.hidden, 1, true));
    assert!(serde_json::from_str::<ViewState>("{}").unwrap().hidden.is_empty());
}

#[test]
fn figures_for_print_are_vectors_and_show_what_the_window_shows() {
    let mut harness = ViewStage::new(View::Response, &[OutcomeCase::default()]).harness(SIZE, Theme::Dark);
    let draw = |harness: &Harness<'_, ViewStage>| {
        let stage = harness.state();
        let picture = Picture::of(&stage.outcome);
        let seen = Seen::of(&harness.ctx, View::Response, &stage.state, &stage.figures);
        let figure = figure(View::Response, &picture, &stage.state, Some(&seen)).unwrap();
        figure.svg(FigureSize::default(), seen.units())
    };
    let whole = draw(&harness);
    assert!(
        whole.contains("width=\"160mm\" height=\"90.00mm\"") && whole.contains(">t (s)</text>"),
        "{}",
        &whole[..300]
    );
    assert!(whole.contains(".ground{fill:#ffffff}"), "paper is white, whatever the window's theme");
    harness.get_by_label_contains("worst ").click();
    harness.run();
    assert_ne!(draw(&harness), whole, "a zoomed plot is printed zoomed");
}

#[test]
fn pictures() {
    let mut results = egui_kittest::SnapshotResults::new();
    let held_out = OutcomeCase { usage: Usage::HeldOut, ..OutcomeCase::default() };
    for (view, theme, case, name) in [
        (View::Response, Theme::Light, held_out, "view_response"),
        (View::Response, Theme::Light, OutcomeCase { diverges: Some(0.4), ..held_out }, "view_response_diverged"),
        (View::Velocity, Theme::Dark, held_out, "view_velocity_dark"),
        (View::Phase, Theme::Light, held_out, "view_phase"),
        (View::Spectrum, Theme::Dark, held_out, "view_spectrum_dark"),
    ] {
        let stage = ViewStage::new(view, &[case, case]);
        let mut harness = stage.harness(vec2(640.0, 480.0), theme);
        // An axis knows the room that it needs once it was drawn.
        harness.run_steps(2);
        harness.snapshot(name);
        results.extend_harness(&mut harness);
    }
}
