//! A free decay: frequency and damping over amplitude.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::diagram::{Decay, NoDecay};
use crate::figure::{Axis, Figure, KeyMark, Layer, LegendEntry, Panel, Points, Shape, lead};
use crate::palette::Ink;
use sindyscope_values::term::Symbol;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Decay",
    tooltip: "Frequency and damping over amplitude while a free motion dies out",
    reading: "A backbone that rises with amplitude is a hardening spring, one that falls a softening one. A damping ratio that \
              is level is viscous, one that grows as the amplitude falls dry friction, one that grows with it drag.",
    group: Group::Physics,
    records: RecordUse::One,
    slow: true,
    figure,
};

/// A quantity along a decay.
type Pick = fn(&Decay) -> Vec<f64>;

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let (measured, simulated) =
        Decay::of_record(scene.outcome, scene.record, scene.freedom).map_err(|why| reason(why).to_owned())?;
    let simulated = simulated.unwrap_or_default();
    let (name, unit) = (scene.layout.name(Symbol::State(scene.freedom)), scene.unit());
    let largest = measured.amplitude.iter().copied().fold(0.0, f64::max);
    let amplitude = Axis::linear(format!("amplitude of {name}"), unit.as_str(), (-0.02 * largest, 1.04 * largest));
    let frequency = lead(measured.frequency.iter().copied(), simulated.frequency.iter().copied());
    // Frequencies that agree to the last digit should not look like a storm.
    let middle = 0.5 * (frequency.0 + frequency.1);
    let half = (0.5 * (frequency.1 - frequency.0)).max(2e-3 * middle);
    let percent: Pick = |d| d.damping.iter().map(|z| 100.0 * z).collect();
    let mut ratios = percent(&measured);
    ratios.sort_by(f64::total_cmp);
    let high = ratios.get(ratios.len() * 97 / 100).copied().unwrap_or(1.0).max(1e-6);
    let low = ratios.first().copied().unwrap_or(0.0).min(0.0).max(-0.2 * high);
    let times = measured.time.first().zip(measured.time.last()).map_or((0.0, 1.0), |(a, b)| (*a, *b));
    let margin = 0.03 * (times.1 - times.0);
    let level = |a: &f64| a.max(f64::MIN_POSITIVE).log10();
    let levels = lead(measured.amplitude.iter().map(level), simulated.amplitude.iter().map(level));
    let panel = |id, title: &str, x: Axis, y: Axis, across: Pick, up: Pick| {
        let columns = [("measured", &measured), ("identified", &simulated)].into_iter().flat_map(|(which, decay)| {
            [(format!("{} {which}", x.header()), across(decay)), (format!("{} {which}", y.header()), up(decay))]
        });
        let points = |decay| Points::of(&across(decay), &up(decay));
        let layers = vec![
            Layer::new(Ink::Measured, "", Shape::Marks(points(&measured))),
            Layer::new(Ink::Identified, "", Shape::Line(points(&simulated))),
        ];
        Panel { title: title.to_owned(), columns: columns.collect(), layers, ..Panel::new(id, x, y) }
    };
    let backbone = panel(
        "backbone",
        "backbone: frequency over amplitude",
        amplitude.clone(),
        Axis::linear("frequency", "Hz", (middle - half, middle + half)),
        |d| d.amplitude.clone(),
        |d| d.frequency.clone(),
    );
    let damping = panel(
        "damping",
        "damping ratio over amplitude",
        amplitude.clone(),
        Axis::linear("damping ratio", "%", (low - 0.05 * high, 1.15 * high)),
        |d| d.amplitude.clone(),
        percent,
    );
    let envelope = panel(
        "envelope",
        "amplitude over time: straight is viscous, bent down dry friction",
        Axis::linear("t", "s", (times.0 - margin, times.1 + margin)),
        Axis::logarithmic("amplitude", unit.as_str(), levels),
        |d| d.time.clone(),
        |d| d.amplitude.clone(),
    );
    let caption =
        format!("Free decay of record {}: backbone, damping ratio and envelope of {name}.", scene.record.record.name);
    let mut figure = Figure::stacked([(backbone, 1.2), (damping, 1.2), (envelope, 0.9)], 390.0, caption);
    let measured = LegendEntry { mark: KeyMark::Dot, ..LegendEntry::line(Ink::Measured, "measured") };
    figure.legend = vec![measured, LegendEntry::line(Ink::Identified, "identified")];
    Ok(figure)
}

fn reason(why: NoDecay) -> &'static str {
    match why {
        NoDecay::Driven => {
            "This record is no free decay: its input never rests for long. Release the structure, or let the force stop, and \
             record how the motion dies out"
        }
        NoDecay::FewSwings => "This record is no free decay: fewer than eight half swings stand out of the noise",
        NoDecay::NotDecaying => "This record is no free decay: the swings do not become smaller",
    }
}
