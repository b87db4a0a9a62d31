//! Responses over frequency: of a sensor to an input, or its spectrum where no input was measured.

use super::{ModalSubject, modes_in_band, numbered_modes};
use crate::diagram::{DrivenSeries, FrequencyResponse};
use crate::figure::{Axis, Figure, Guide, Layer, LegendEntry, Panel, Points, Shape, Ticks, extent, lead};
use crate::palette::Ink;
use crate::view::{quotient, runs, value_range};
use sindyscope_core::signal::Spectrum;
use sindyscope_modes::{Input, ModalRecord, Sensor};
use sindyscope_values::format::units::{Scale, format_si, raised};

/// Other records that are laid over the one that is shown, at most.
const MOST_OTHERS: usize = 4;

/// Cycles of the slowest mode that a segment lasts at least, where the record bears it: its half-power band, at a damping
/// ratio of one per cent, is then as wide as two lines.
const CYCLES: f64 = 100.0;

/// Lines of a spectrum, at most, that its curves are drawn of.
const MOST_LINES: usize = 6000;

pub(super) fn figure(subject: &ModalSubject<'_>) -> Result<Figure, String> {
    let structure = &subject.analysis.structure;
    let records = &subject.analysis.records;
    let record = records.get(subject.record.min(records.len().saturating_sub(1))).ok_or("There is no record")?;
    let at = subject.options.sensor.min(structure.sensors.len().saturating_sub(1));
    let sensor = structure.sensors.get(at).ok_or("There is no sensor")?;
    match structure.inputs.len() {
        0 => spectra(subject, record, (at, sensor)),
        inputs => {
            let input = subject.options.input.min(inputs - 1);
            driven(subject, record, (at, sensor), (input, &structure.inputs[input]))
        }
    }
}

/// The usual number of averaged segments: as many as leave each the length that tells the slowest mode's width.
pub fn modal_averages(subject: &ModalSubject<'_>) -> usize {
    let records = &subject.analysis.records;
    let seconds =
        records.iter().map(|r| r.interval * r.measured.first().map_or(0, Vec::len) as f64).fold(0.0, f64::max);
    let slowest = modes_in_band(subject.analysis).map(|(_, m)| m.frequency).fold(f64::INFINITY, f64::min);
    let length = if slowest.is_finite() { CYCLES / slowest } else { seconds / 4.0 };
    // k segments that overlap by half are (k + 1) / 2 segments long.
    (2.0 * seconds / length - 1.0).clamp(4.0, 32.0) as usize
}

/// What one record shows of a response.
struct RecordResponse {
    measured: FrequencyResponse,
    /// Of what the model leaves.
    missed: Option<FrequencyResponse>,
}

fn response(record: &ModalRecord, sensor: usize, input: usize, averages: usize) -> Result<RecordResponse, String> {
    let modelled = record.modelled(sensor);
    let of = |measured: &[f64], simulated: &[f64]| {
        let input = &record.inputs[input];
        let series = DrivenSeries { name: &record.name, interval: record.interval, input, measured, simulated };
        FrequencyResponse::of_series(&[series], averages, false)
    };
    let measured = of(&record.measured[sensor], &modelled).map_err(|_| {
        format!("Record {} is too short for a frequency response, or its input stands still", record.name)
    })?;
    let missed = of(&record.left[sensor], &[]).ok();
    Ok(RecordResponse { measured, missed })
}

fn driven(
    subject: &ModalSubject<'_>,
    record: &ModalRecord,
    (at, sensor): (usize, &Sensor),
    (input_at, input): (usize, &Input),
) -> Result<Figure, String> {
    let averages = if subject.options.averages == 0 { modal_averages(subject) } else { subject.options.averages };
    let shown = response(record, at, input_at, averages)?;
    let others: Vec<(&ModalRecord, RecordResponse)> = others(subject, record)
        .filter_map(|other| Some((other, response(other, at, input_at, averages).ok()?)))
        .collect();
    let x = abscissa(subject, shown.measured.frequency.iter().copied());
    let log = subject.options.log_frequency;
    let unit = quotient(&sensor.unit, &input.unit);
    let mut gain = Panel::new(if log { "response gain log" } else { "response gain" }, x.clone(), Axis::default());
    let mut phase = Panel::new(if log { "response phase log" } else { "response phase" }, x.clone(), Axis::default());
    let mut coherence = Panel::new(
        if log { "response coherence log" } else { "response coherence" },
        x,
        Axis::linear("coherence", "", (-0.05, 1.08)),
    );
    for (k, (other, theirs)) in others.iter().enumerate() {
        let ink = Ink::Pin(k as u8);
        gain.layers.extend(lines(ink, &other.name, &theirs.measured, &theirs.measured.measured.gain));
        phase.layers.extend(lines(ink, "", &theirs.measured, &theirs.measured.measured.phase));
        coherence.layers.extend(lines(ink, "", &theirs.measured, &theirs.measured.measured.coherence));
    }
    let found = &shown.measured;
    gain.layers.extend(lines(Ink::Measured, "", found, &found.measured.gain));
    gain.layers.extend(lines(Ink::Identified, "", found, &found.simulated.gain));
    if let Some(missed) = &shown.missed {
        gain.layers.extend(lines(Ink::Error, "missed", missed, &missed.measured.gain));
    }
    phase.layers.extend(lines(Ink::Measured, "", found, &found.measured.phase));
    phase.layers.extend(lines(Ink::Identified, "", found, &found.simulated.phase));
    coherence.layers.extend(lines(Ink::Measured, "", found, &found.measured.coherence));
    let level = |v: &f64| v.max(f64::MIN_POSITIVE).log10();
    let gains = lead(found.measured.gain.iter().map(level), found.simulated.gain.iter().map(level));
    // The unit stands in the title: at every mark it would push the plot out of line with those beneath.
    gain.y = Axis::logarithmic("gain", "", gains);
    gain.title = format!(
        "{}, H1 from {} segments, {} apart",
        Scale::plain(raised(&unit)).axis(&format!("|{}/{}|", sensor.name, input.name)),
        found.segments,
        format_si(found.step, "Hz", 2)
    );
    gain.guides.extend(signs(subject));
    gain.columns = columns(&shown, &Scale::plain(unit.as_str()).axis("gain"));
    let (low, high) = extent(found.measured.phase.iter().copied());
    phase.y =
        Axis::linear("phase", "°", (low.clamp(-275.0, -190.0), high.clamp(10.0, 95.0))).with_ticks(Ticks::Degrees);
    coherence.title = "coherence: below one there is noise, nonlinearity or another input".into();
    let caption = format!(
        "Frequency response from {} to {}, measured and of the modes, and what the modes miss; the modes' response is estimated \
         as the measured one is. Record {}{}.",
        input.name,
        sensor.name,
        record.name,
        if others.is_empty() { "" } else { ", and the measured responses of other records laid over it" },
    );
    let mut figure = Figure::stacked([(gain, 2.2), (phase, 1.0), (coherence, 0.9)], 380.0, caption);
    figure.legend =
        vec![LegendEntry::line(Ink::Measured, "measured"), LegendEntry::line(Ink::Identified, "of the modes")];
    Ok(figure)
}

/// Records beside the one that is shown.
fn others<'a>(subject: &ModalSubject<'a>, shown: &'a ModalRecord) -> impl Iterator<Item = &'a ModalRecord> {
    subject.analysis.records.iter().filter(move |r| !std::ptr::eq(*r, shown)).take(MOST_OTHERS)
}

/// Lines at the frequencies of a response; the first bears the name.
fn lines(ink: Ink, name: &str, response: &FrequencyResponse, values: &[f64]) -> Vec<Layer> {
    let every = response.frequency.len().div_ceil(MOST_LINES).max(1);
    let points = response.frequency.iter().zip(values).step_by(every).map(|(f, v)| [*f, *v]);
    let shapes = runs(points, response.step * every as f64).into_iter().enumerate();
    shapes.map(|(k, shape)| Layer::new(ink, if k == 0 { name } else { "" }, shape)).collect()
}

fn columns(shown: &RecordResponse, head: &str) -> Vec<(String, Vec<f64>)> {
    let found = &shown.measured;
    let mut all = vec![
        ("f (Hz)".to_owned(), found.frequency.clone()),
        (format!("{head} measured"), found.measured.gain.clone()),
        ("phase (°) measured".to_owned(), found.measured.phase.clone()),
        ("coherence".to_owned(), found.measured.coherence.clone()),
        (format!("{head} of the modes"), found.simulated.gain.clone()),
        ("phase (°) of the modes".to_owned(), found.simulated.phase.clone()),
    ];
    all.extend(shown.missed.as_ref().map(|m| (format!("{head} missed"), m.measured.gain.clone())));
    all
}

/// The modes' frequencies.
fn signs(subject: &ModalSubject<'_>) -> Vec<Guide> {
    let sign = |(number, mode): (usize, &sindyscope_values::model::Mode)| Guide::At {
        ink: Ink::Cursor,
        at: mode.frequency,
        text: number.to_string(),
    };
    numbered_modes(subject.analysis).map(sign).collect()
}

/// From the first line to beyond the last mode.
fn abscissa(subject: &ModalSubject<'_>, frequencies: impl Iterator<Item = f64>) -> Axis {
    let (low, high) = frequencies.fold((f64::INFINITY, 0.0_f64), |(low, high), f| (low.min(f), high.max(f)));
    let last = modes_in_band(subject.analysis).map(|(_, m)| m.frequency).fold(0.0, f64::max);
    let high = if last > 0.0 { high.min(2.0 * last) } else { high };
    if subject.options.log_frequency {
        Axis::logarithmic("f", "Hz", (low.log10(), high.log10())).linked("modal frequency log")
    } else {
        Axis::linear("f", "Hz", (0.0, high)).linked("modal frequency")
    }
}

/// Amplitude spectra where no input was measured.
fn spectra(subject: &ModalSubject<'_>, record: &ModalRecord, (at, sensor): (usize, &Sensor)) -> Result<Figure, String> {
    let of = |values: &[f64]| Spectrum::new(values, record.interval);
    let measured = of(&record.measured[at]).ok_or("The record is too short for a spectrum: it takes eight samples")?;
    let (modelled, left) = (of(&record.modelled(at)), of(&record.left[at]));
    let lines = measured.amplitudes.len();
    let x = abscissa(subject, (1..lines).map(|k| measured.frequency(k)));
    let range = value_range(std::iter::once(&measured).chain(&left), None);
    let id = if subject.options.log_frequency { "response spectrum log" } else { "response spectrum" };
    let mut panel = Panel::new(id, x, Axis::logarithmic("amplitude", sensor.unit.as_str(), range));
    panel.columns.push(("f (Hz)".to_owned(), (0..lines).map(|k| measured.frequency(k)).collect()));
    for (k, other) in others(subject, record).enumerate() {
        if let Some(spectrum) = Spectrum::new(&other.measured[at], other.interval) {
            panel.layers.push(curve(Ink::Pin(k as u8), &other.name, &spectrum));
        }
    }
    let curves = [
        (Ink::Measured, "measured", Some(&measured)),
        (Ink::Identified, "of the modes", modelled.as_ref()),
        (Ink::Error, "missed", left.as_ref()),
    ];
    for (ink, name, spectrum) in curves {
        let Some(spectrum) = spectrum else { continue };
        panel.layers.push(curve(ink, name, spectrum));
        let head = Scale::plain(sensor.unit.as_str()).axis(&format!("amplitude {name}"));
        panel.columns.push((head, spectrum.amplitudes.clone()));
    }
    panel.guides.extend(signs(subject));
    panel.title = format!("{}, record {}", sensor.name, record.name);
    let caption = format!(
        "Amplitude spectrum of {}, measured and of the modes, and what the modes miss. Record {}.",
        sensor.name, record.name
    );
    Ok(Figure::stacked([(panel, 1.0)], 300.0, caption))
}

fn curve(ink: Ink, name: &str, spectrum: &Spectrum) -> Layer {
    // The line at zero is the mean, and has no place on a logarithmic axis.
    let lines = spectrum.amplitudes.iter().enumerate().skip(1);
    let points = Points::new(lines.map(|(k, a)| [spectrum.frequency(k), a.max(f64::MIN_POSITIVE)]));
    Layer::new(ink, name, Shape::Line(points))
}
