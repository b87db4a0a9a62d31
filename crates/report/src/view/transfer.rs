//! The frequency response: gain, phase and coherence.

use super::forces::pooled;
use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::diagram::{FrequencyResponse, NoResponse, Tone};
use crate::figure::{Axis, Figure, Layer, LegendEntry, Panel, Points, Shape, Ticks, extent, lead};
use crate::palette::Ink;
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "FRF",
    tooltip: "Frequency response from the input to the displacement, with phase and coherence",
    reading: "Where the two gains lie on each other the model is right at that frequency; a peak that leans or changes with the \
              level is nonlinear stiffness. A coherence below one is noise, nonlinearity or another input: trust only what \
              is near one.",
    group: Group::Physics,
    records: RecordUse::Pooled,
    slow: true,
    figure,
};

/// Segments averaged, to choose from.
pub const AVERAGES: [usize; 5] = [2, 4, 8, 16, 32];

/// The usual number of them.
pub const USUAL_AVERAGES: usize = 8;

/// Lines drawn of a response; of more, each group's first is drawn.
const MOST_LINES: usize = 6000;

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let options = subject.options;
    let averages = if options.averages == 0 { USUAL_AVERAGES } else { options.averages };
    let (records, noisy) = (pooled(subject, &scene), options.noisy_input);
    let response =
        FrequencyResponse::new(scene.outcome, &records, scene.freedom, scene.input, averages, noisy).map_err(reason)?;
    let picture = TransferPicture {
        response: &response,
        step: response.frequency.len().div_ceil(MOST_LINES).max(1),
        x: abscissa(&response, options.log_frequency),
        names: [scene.layout.name(Symbol::State(scene.freedom)), scene.layout.name(Symbol::Input(scene.input))],
        unit: quotient(&scene.unit(), &scene.unit_of(Role::Input(scene.input))),
        noisy,
    };
    let broad = !response.frequency.is_empty();
    let log = options.log_frequency;
    let gain = picture.gain(if log { "gain log" } else { "gain" });
    let phase = picture.phase(if log { "phase log" } else { "phase" });
    let mut panels = vec![(gain, if broad { 2.0 } else { 1.6 }), (phase, if broad { 1.1 } else { 1.0 })];
    if broad {
        panels.push((picture.coherence(if log { "coherence log" } else { "coherence" }), 1.0));
    }
    let [x, u] = &picture.names;
    let caption = format!("Frequency response from {u} to {x}: gain, phase and coherence, measured and identified.");
    let height = 90.0 * panels.iter().map(|p| p.1).sum::<f64>();
    let mut figure = Figure::stacked(panels, height, caption);
    figure.legend =
        vec![LegendEntry::line(Ink::Measured, "measured"), LegendEntry::line(Ink::Identified, "identified")];
    Ok(figure)
}

fn reason(why: NoResponse) -> String {
    match why {
        NoResponse::NoInput => {
            "The records have no input, and a frequency response needs one; the view Decay shows frequency and damping of a \
             free motion"
        }
        NoResponse::Silent => "The input does not change, so there is nothing to respond to",
        NoResponse::TooShort => "The records are too short for a frequency response",
    }
    .to_owned()
}

/// The unit of a response over that of an input.
pub(crate) fn quotient(displacement: &str, input: &str) -> String {
    match (displacement, input) {
        (x, u) if x == u => String::new(),
        (x, "") => x.to_owned(),
        ("", u) => format!("1/{u}"),
        (x, u) if u.contains(['/', ' ', '·', '*']) => format!("{x}/({u})"),
        (x, u) => format!("{x}/{u}"),
    }
}

fn abscissa(response: &FrequencyResponse, log: bool) -> Axis {
    let place = |f: f64| if log { f.log10() } else { f };
    let all = response.frequency.iter().copied().chain(response.tones.iter().map(|t| t.frequency)).map(place);
    let (low, high) = extent(all);
    // One tone alone is no reason to look at its last digits; a decade gives a logarithmic axis its labels.
    let (middle, least) = (0.5 * (low + high), if log { 0.55 } else { 0.1 * (low + high) });
    let half = (0.5 * (high - low)).max(least);
    let range = (middle - half, middle + half);
    if log { Axis::logarithmic("f", "Hz", range) } else { Axis::linear("f", "Hz", range) }
}

/// A response and how it is drawn.
struct TransferPicture<'a> {
    response: &'a FrequencyResponse,
    /// Of so many lines one is drawn.
    step: usize,
    x: Axis,
    /// Displacement and input.
    names: [String; 2],
    unit: String,
    noisy: bool,
}

impl TransferPicture<'_> {
    /// Lines of a quantity where frequencies are beside each other; lone ones are dots.
    fn lines(&self, ink: Ink, values: &[f64]) -> Vec<Layer> {
        let both = self.response.frequency.iter().zip(values).step_by(self.step).map(|(f, v)| [*f, *v]);
        runs(both, self.response.step * self.step as f64).into_iter().map(|s| Layer::new(ink, "", s)).collect()
    }

    fn tones(&self, ink: Ink, which: impl Fn(&Tone) -> Option<f64>) -> Option<Layer> {
        let tones = &self.response.tones;
        let points = Points::new(tones.iter().filter_map(|t| Some([t.frequency, which(t)?])));
        (!tones.is_empty()).then(|| Layer::new(ink, "", Shape::Marks(points)))
    }

    /// Values at the lines and at the tones, measured and identified.
    fn columns(&self, head: &str, [measured, simulated]: [&[f64]; 2], part: usize) -> Vec<(String, Vec<f64>)> {
        let tones = &self.response.tones;
        let frequencies = self.response.frequency.iter().copied().chain(tones.iter().map(|t| t.frequency));
        let at = |values: &[f64], of: &dyn Fn(&Tone) -> f64| -> Vec<f64> {
            let missing = self.response.frequency.len().saturating_sub(values.len());
            let values = values.iter().copied().chain(std::iter::repeat_n(f64::NAN, missing));
            values.chain(tones.iter().map(of)).collect()
        };
        vec![
            ("f (Hz)".to_owned(), frequencies.collect()),
            (format!("{head} measured"), at(measured, &|t| t.measured[part])),
            (format!("{head} identified"), at(simulated, &|t| t.simulated.map_or(f64::NAN, |s| s[part]))),
        ]
    }

    fn gain(&self, id: &'static str) -> Panel {
        let response = self.response;
        let level = |v: f64| v.max(f64::MIN_POSITIVE).log10();
        let measured = response.measured.gain.iter().copied().chain(response.tones.iter().map(|t| t.measured[0]));
        let simulated = response.tones.iter().filter_map(|t| Some(t.simulated?[0]));
        let simulated = response.simulated.gain.iter().copied().chain(simulated);
        let gains = lead(measured.map(level), simulated.map(level));
        let (middle, half) = (0.5 * (gains.0 + gains.1), (0.5 * (gains.1 - gains.0) + 0.1).max(0.6));
        let y = Axis::logarithmic("gain", self.unit.as_str(), (middle - half, middle + half));
        let mut panel = Panel::new(id, self.x.clone(), y);
        // A band needs lines beside each other; between combs of a multisine it would lie.
        if response.frequency.windows(2).all(|w| w[1] - w[0] < 1.5 * response.step) {
            let both = response.frequency.iter().zip(&response.measured.gain).zip(&response.error).step_by(self.step);
            let span = |((f, g), e): ((&f64, &f64), &f64)| {
                let share = (2.0 * e).min(0.9);
                [*f, g * (1.0 - share), g * (1.0 + share)]
            };
            panel.layers.push(Layer::new(Ink::Measured, "", Shape::Band(both.map(span).collect())));
        }
        panel.layers.extend(self.lines(Ink::Measured, &response.measured.gain));
        panel.layers.extend(self.lines(Ink::Identified, &response.simulated.gain));
        panel.layers.extend(self.tones(Ink::Measured, |t| Some(t.measured[0])));
        panel.layers.extend(self.tones(Ink::Identified, |t| Some(t.simulated?[0])));
        panel.title = self.title();
        panel.columns = self.columns(&panel.y.header(), [&response.measured.gain, &response.simulated.gain], 0);
        panel
    }

    fn title(&self) -> String {
        let (response, [x, u]) = (self.response, &self.names);
        let mut title = format!("|{x}/{u}|");
        if !response.frequency.is_empty() {
            let estimator = if self.noisy { "H2" } else { "H1" };
            let times =
                if response.segments == 1 { "one segment".into() } else { format!("{} segments", response.segments) };
            title += &format!(", {estimator} from {times}, {} apart", format_si(response.step, "Hz", 2));
        }
        if !response.tones.is_empty() {
            let count = response.tones.len();
            title += &format!(", {count} tone{} in steady state", if count == 1 { "" } else { "s" });
        }
        title
    }

    fn phase(&self, id: &'static str) -> Panel {
        let response = self.response;
        let phases = response.measured.phase.iter().copied().chain(response.tones.iter().map(|t| t.measured[1]));
        let (low, high) = extent(phases);
        let range = (low.clamp(-275.0, -190.0), high.clamp(10.0, 95.0));
        let y = Axis::linear("phase", "°", range).with_ticks(Ticks::Degrees);
        let mut panel = Panel::new(id, self.x.clone(), y);
        panel.layers.extend(self.lines(Ink::Measured, &response.measured.phase));
        panel.layers.extend(self.lines(Ink::Identified, &response.simulated.phase));
        panel.layers.extend(self.tones(Ink::Measured, |t| Some(t.measured[1])));
        panel.layers.extend(self.tones(Ink::Identified, |t| Some(t.simulated?[1])));
        let [x, u] = &self.names;
        panel.title = format!("phase of {x} behind {u}");
        panel.columns = self.columns("phase (°)", [&response.measured.phase, &response.simulated.phase], 1);
        panel
    }

    fn coherence(&self, id: &'static str) -> Panel {
        let response = self.response;
        let mut panel = Panel::new(id, self.x.clone(), Axis::linear("coherence", "", (-0.05, 1.08)));
        panel.layers.extend(self.lines(Ink::Measured, &response.measured.coherence));
        panel.layers.extend(self.lines(Ink::Identified, &response.simulated.coherence));
        panel.title = "coherence".into();
        panel.columns = vec![
            ("f (Hz)".to_owned(), response.frequency.clone()),
            ("coherence measured".to_owned(), response.measured.coherence.clone()),
            ("coherence identified".to_owned(), response.simulated.coherence.clone()),
        ];
        panel
    }
}

/// Lines through points that are beside each other; lone ones are dots.
pub(crate) fn runs(points: impl Iterator<Item = [f64; 2]>, step: f64) -> Vec<Shape> {
    let mut runs: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for point in points.filter(|p| p[0].is_finite() && p[1].is_finite()) {
        match runs.last_mut() {
            Some(run) if point[0] - last < 1.5 * step => run.push(point),
            _ => runs.push(vec![point]),
        }
        last = point[0];
    }
    let (lone, lines): (Vec<_>, Vec<_>) = runs.into_iter().partition(|r| r.len() == 1);
    let mut shapes: Vec<Shape> = lines.into_iter().map(|run| Shape::Line(Points::new(run))).collect();
    if !lone.is_empty() {
        shapes.push(Shape::Dots(Points::new(lone.into_iter().flatten())));
    }
    shapes
}
