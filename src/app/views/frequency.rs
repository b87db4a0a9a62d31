//! The frequency response: gain, phase and coherence.

use super::{Request, View, ViewState, kept, painter};
use egui::Ui;
use egui_plot::PlotPoint;

use super::figure::{Axis, Figure, Graph, Shape, extent, lead};
use super::forces::{held, pooled};
use super::legend::{self, Entry};
use super::scene::Scene;
use crate::app::plot::palette::Ink;
use crate::app::plot::units::format_si;
use sindyscope_report::diagram::{FrequencyResponse, NoResponse};
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

/// Segments averaged, to choose from.
pub(super) const AVERAGES: [usize; 5] = [2, 4, 8, 16, 32];

/// The usual number of them.
pub(super) const USUAL: usize = 8;

/// Lines drawn of a response; of more, each group's first is drawn.
const MOST_LINES: usize = 6000;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let (alone, which) = held(scene, state);
    let (freedom, input, log) = (scene.freedom, scene.input, state.log_frequency);
    let averages = if state.averages == 0 { USUAL } else { state.averages };
    let noisy = state.noisy_input;
    let choice = [which, freedom, input, averages, usize::from(noisy), usize::from(log)];
    let name = |s| scene.layout.name(s);
    let names = (name(Symbol::State(freedom)), name(Symbol::Input(input)));
    let unit = quotient(&scene.unit(), &scene.unit_of(Role::Input(input)));
    let printing = state.printing;
    let figure =
        state.cache.figures.get(
            ui,
            View::Transfer,
            scene,
            choice,
            printing,
            move |outcome| {
                match FrequencyResponse::new(outcome, &pooled(outcome, alone), freedom, input, averages, noisy) {
            Ok(response) => figure(&response, &names, &unit, log, noisy),
            Err(why) => Figure::Note(
                match why {
                    NoResponse::NoInput => {
                        "The records have no input, and a frequency response needs one; the view Decay shows frequency \
                         and damping of a free motion"
                    }
                    NoResponse::Silent => "The input does not change, so there is nothing to respond to",
                    NoResponse::TooShort => "The records are too short for a frequency response",
                }
                .into(),
            ),
        }
            },
        );
    let graphs = kept::graphs(ui, figure.as_deref(), "Computing the frequency response…")?;
    legend::reading(
        ui,
        "Where the two gains lie on each other the model is right at that frequency; a peak that leans or changes with the \
         level is nonlinear stiffness. A coherence below one is noise, nonlinearity or another input: trust only what \
         is near one.",
    );
    let names = [Entry { ink: Ink::Measured, name: "measured" }, Entry { ink: Ink::Identified, name: "identified" }];
    painter::names(ui, scene, state, &names);
    let coherent = graphs.len() > 2;
    let rows: &[painter::Row<'_>] =
        if coherent { &[(&[0], 2.0), (&[1], 1.1), (&[2], 1.0)] } else { &[(&[0], 1.6), (&[1], 1.0)] };
    painter::rows(ui, View::Transfer, scene, state, graphs, rows)
}

/// The unit of a displacement over that of an input.
fn quotient(displacement: &str, input: &str) -> String {
    match (displacement, input) {
        (x, u) if x == u => String::new(),
        (x, "") => x.to_owned(),
        ("", u) => format!("1/{u}"),
        (x, u) if u.contains(['/', ' ', '·', '*']) => format!("{x}/({u})"),
        (x, u) => format!("{x}/{u}"),
    }
}

fn figure(response: &FrequencyResponse, names: &(String, String), unit: &str, log: bool, noisy: bool) -> Figure {
    let place = |f: f64| if log { f.log10() } else { f };
    let (x_name, u_name) = names;
    let all = response.frequency.iter().copied().chain(response.tones.iter().map(|t| t.frequency)).map(place);
    let (low, high) = extent(all);
    // One tone alone is no reason to look at its last digits; a decade gives a logarithmic axis its labels.
    let (middle, least) = (0.5 * (low + high), if log { 0.55 } else { 0.1 * (low + high) });
    let half = (0.5 * (high - low)).max(least);
    let range = (middle - half, middle + half);
    let x = if log { Axis::log("f", "Hz", range) } else { Axis::linear("f", "Hz", range) };
    let step = response.frequency.len().div_ceil(MOST_LINES).max(1);
    let line = |values: &[f64], map: &dyn Fn(f64) -> f64| {
        let both = response.frequency.iter().zip(values).step_by(step);
        runs(both.map(|(f, v)| (*f, PlotPoint::new(place(*f), map(*v)))), response.step * step as f64)
    };
    let level = |v: f64| v.max(f64::MIN_POSITIVE).log10();
    let tones = |which: &dyn Fn(&sindyscope_report::diagram::Tone) -> Option<f64>| -> Vec<PlotPoint> {
        response.tones.iter().filter_map(|t| Some(PlotPoint::new(place(t.frequency), which(t)?))).collect()
    };
    let broad = !response.frequency.is_empty();
    let mut gain = Vec::new();
    let mut phase = Vec::new();
    if broad {
        let band = |sign: f64| -> Vec<f64> {
            let both = response.measured.gain.iter().zip(&response.error);
            both.map(|(g, e)| level(g * (1.0 + sign * (2.0 * e).min(0.9)))).step_by(step).collect()
        };
        // A band needs lines beside each other; between combs of a multisine it would lie.
        if response.frequency.windows(2).all(|w| w[1] - w[0] < 1.5 * response.step) {
            let at = response.frequency.iter().map(|f| place(*f)).step_by(step).collect();
            gain.push((Ink::Measured, Shape::Band([at, band(-1.0), band(1.0)])));
        }
        gain.extend(line(&response.measured.gain, &level).into_iter().map(|s| (Ink::Measured, s)));
        gain.extend(line(&response.simulated.gain, &level).into_iter().map(|s| (Ink::Identified, s)));
        phase.extend(line(&response.measured.phase, &|p| p).into_iter().map(|s| (Ink::Measured, s)));
        phase.extend(line(&response.simulated.phase, &|p| p).into_iter().map(|s| (Ink::Identified, s)));
    }
    if !response.tones.is_empty() {
        gain.push((Ink::Measured, Shape::Marks(tones(&|t| Some(level(t.measured[0]))))));
        gain.push((Ink::Identified, Shape::Marks(tones(&|t| Some(level(t.simulated?[0]))))));
        phase.push((Ink::Measured, Shape::Marks(tones(&|t| Some(t.measured[1])))));
        phase.push((Ink::Identified, Shape::Marks(tones(&|t| Some(t.simulated?[1])))));
    }
    let measured = response.measured.gain.iter().copied().chain(response.tones.iter().map(|t| t.measured[0]));
    let simulated =
        response.simulated.gain.iter().copied().chain(response.tones.iter().filter_map(|t| Some(t.simulated?[0])));
    let gains = lead(measured.map(level), simulated.map(level));
    let estimator = if noisy { "H2" } else { "H1" };
    let mut caption = format!("|{x_name}/{u_name}|");
    if broad {
        let times =
            if response.segments == 1 { "one segment".into() } else { format!("{} segments", response.segments) };
        caption += &format!(", {estimator} from {times}, {} apart", format_si(response.step, "Hz", 2));
    }
    if !response.tones.is_empty() {
        let count = response.tones.len();
        caption += &format!(", {count} tone{} in steady state", if count == 1 { "" } else { "s" });
    }
    let frequencies: Vec<f64> =
        response.frequency.iter().copied().chain(response.tones.iter().map(|t| t.frequency)).collect();
    let with_tones = |values: &[f64], k: usize, simulated: bool| -> Vec<f64> {
        let of = |t: &sindyscope_report::diagram::Tone| {
            if simulated { t.simulated.map_or(f64::NAN, |s| s[k]) } else { t.measured[k] }
        };
        let missing = response.frequency.len().saturating_sub(values.len());
        let values = values.iter().copied().chain(std::iter::repeat_n(f64::NAN, missing));
        values.chain(response.tones.iter().map(of)).collect()
    };
    let columns = |head: &str, measured: &[f64], simulated: &[f64], k: usize| {
        vec![
            ("f (Hz)".to_owned(), frequencies.clone()),
            (format!("{head} measured"), with_tones(measured, k, false)),
            (format!("{head} identified"), with_tones(simulated, k, true)),
        ]
    };
    let (middle, half) = (0.5 * (gains.0 + gains.1), (0.5 * (gains.1 - gains.0) + 0.1).max(0.6));
    let y = Axis::log("gain", unit, (middle - half, middle + half));
    let gain_columns = columns(&y.header(), &response.measured.gain, &response.simulated.gain, 0);
    let mut graphs = vec![Graph {
        id: if log { "gain log" } else { "gain" },
        caption,
        x: x.clone(),
        y,
        layers: gain,
        map: None,
        columns: gain_columns,
        outside: None,
    }];
    let phases = response.measured.phase.iter().copied().chain(response.tones.iter().map(|t| t.measured[1]));
    let (low, high) = extent(phases);
    graphs.push(Graph {
        id: if log { "phase log" } else { "phase" },
        caption: format!("phase of {x_name} behind {u_name}"),
        x: x.clone(),
        y: Axis::linear("phase", "°", (low.clamp(-275.0, -190.0), high.clamp(10.0, 95.0))),
        layers: phase,
        map: None,
        columns: columns("phase (°)", &response.measured.phase, &response.simulated.phase, 1),
        outside: None,
    });
    if broad {
        let lines = |values: &[f64], ink| line(values, &|c| c).into_iter().map(move |s| (ink, s)).collect::<Vec<_>>();
        let mut layers = lines(&response.measured.coherence, Ink::Measured);
        layers.extend(lines(&response.simulated.coherence, Ink::Identified));
        let missing = response.frequency.len().saturating_sub(response.simulated.coherence.len());
        let simulated = response.simulated.coherence.iter().copied().chain(std::iter::repeat_n(f64::NAN, missing));
        graphs.push(Graph {
            id: if log { "coherence log" } else { "coherence" },
            caption: "coherence".into(),
            x,
            y: Axis::linear("coherence", "", (-0.05, 1.08)),
            layers,
            map: None,
            columns: vec![
                ("f (Hz)".to_owned(), response.frequency.clone()),
                ("coherence measured".to_owned(), response.measured.coherence.clone()),
                ("coherence identified".to_owned(), simulated.collect()),
            ],
            outside: None,
        });
    }
    Figure::Graphs(graphs)
}

/// Lines through points that are beside each other; a lone one is a mark.
fn runs(points: impl Iterator<Item = (f64, PlotPoint)>, step: f64) -> Vec<Shape> {
    let mut runs: Vec<Vec<PlotPoint>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for (f, point) in points.filter(|(_, p)| p.x.is_finite() && p.y.is_finite()) {
        match runs.last_mut() {
            Some(run) if f - last < 1.5 * step => run.push(point),
            _ => runs.push(vec![point]),
        }
        last = f;
    }
    let (lone, lines): (Vec<_>, Vec<_>) = runs.into_iter().partition(|r| r.len() == 1);
    let mut shapes: Vec<Shape> = lines.into_iter().map(Shape::Line).collect();
    if !lone.is_empty() {
        shapes.push(Shape::Dots(lone.into_iter().flatten().collect()));
    }
    shapes
}
