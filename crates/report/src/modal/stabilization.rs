//! The stabilization diagram.

use super::{ModalSubject, modes_in_band, numbered_modes};
use crate::figure::{Axis, Figure, Guide, Layer, LayerRole, Panel, Points, Shape, Ticks};
use crate::palette::Ink;
use sindyscope_modes::{PoleCluster, ProposedPole, Stability, Stabilization};

/// Share of the diagram's height that the spectrum takes up, and decades of it that are shown.
const SPECTRUM_HEIGHT: f64 = 0.9;
const DECADES: f64 = 5.0;
/// Singular values that are drawn: a second one that rises with the first tells of two modes at one frequency.
const SINGULAR_VALUES: usize = 3;

pub(super) fn figure(subject: &ModalSubject<'_>) -> Figure {
    let (analysis, options) = (subject.analysis, subject.options);
    let stabilization = &analysis.stabilization;
    let orders = stabilization.poles.iter().map(|p| p.order);
    let (low, high) = (orders.clone().min().unwrap_or(2), orders.max().unwrap_or(4));
    let y = (low as f64 - 2.0, high as f64 + 2.0);
    let top = highest(subject);
    let id = if options.log_frequency { "stabilization log" } else { "stabilization" };
    let x = if options.log_frequency {
        let bottom = stabilization.frequencies.first().map_or(0.01 * top, |f| f.max(1e-3 * top));
        Axis::logarithmic("f", "Hz", (bottom.log10(), top.log10()))
    } else {
        Axis::linear("f", "Hz", (0.0, top))
    };
    let mut panel = Panel::new(id, x, Axis::linear("order", "", y).with_ticks(Ticks::Whole));
    panel.layers.extend(spectrum(subject, y));
    let kinds = [
        (Stability::New, Ink::Ghost, "new"),
        (Stability::Frequency, Ink::Effect(1), "stable frequency"),
        (Stability::Damping, Ink::Effect(3), "and damping"),
        (Stability::Whole, Ink::Identified, "and shape"),
    ];
    let at = |p: &ProposedPole| [p.pole.frequency(), p.order as f64];
    let of = |kind: Stability| stabilization.poles.iter().filter(move |p| p.stability == kind).map(at);
    if options.spurious {
        panel.layers.push(Layer::new(Ink::Cursor, "spurious", Shape::Dots(Points::new(of(Stability::Spurious)))));
    }
    for (kind, ink, name) in kinds {
        let points = Points::new(of(kind));
        let shape = if kind == Stability::New { Shape::Dots(points) } else { Shape::Marks(points) };
        panel.layers.push(Layer::new(ink, name, shape));
    }
    if !stabilization.clusters.is_empty() {
        let extent = |c: &PoleCluster| [c.frequency.0, c.orders.0 as f64, c.orders.1 as f64];
        let extents = stabilization.clusters.iter().map(extent).collect();
        panel.layers.push(Layer::new(Ink::Mean, "", Shape::Errors(extents)));
    }
    panel.guides.extend(numbered_modes(analysis).map(|(number, mode)| Guide::At {
        ink: Ink::Cursor,
        at: mode.frequency,
        text: number.to_string(),
    }));
    panel.columns = columns(stabilization);
    let caption = "Stabilization diagram: poles of state spaces of growing order that stay as the order grows, over the largest \
                   singular values of the responses' spectral matrix (on a logarithmic scale of their own, five decades); upright \
                   bars, clusters of stable poles over the orders that have them; dashed and numbered, the modes that were chosen.";
    Figure::stacked([(panel, 1.0)], 300.0, caption)
}

/// Up to where the diagram is shown at first, Hz: beyond the last mode in the band, else the last pole that stays.
fn highest(subject: &ModalSubject<'_>) -> f64 {
    let analysis = subject.analysis;
    let nyquist = analysis.records.iter().map(|r| 0.5 / r.interval).fold(0.0, f64::max);
    let last = modes_in_band(analysis).map(|(_, m)| m.frequency).fold(0.0, f64::max);
    let wanted = if last > 0.0 { 1.5 * last } else { nyquist };
    if nyquist > 0.0 { wanted.min(nyquist) } else { wanted.max(1.0) }
}

/// The largest singular values, drawn across the orders; the first has the name.
fn spectrum(subject: &ModalSubject<'_>, (bottom, top): (f64, f64)) -> Vec<Layer> {
    let stabilization = &subject.analysis.stabilization;
    let Some(first) = stabilization.singular_values.first() else { return Vec::new() };
    let largest = first.iter().copied().fold(0.0, f64::max);
    if largest.is_nan() || largest <= 0.0 {
        return Vec::new();
    }
    let height = SPECTRUM_HEIGHT * (top - bottom);
    let level = |v: f64| 1.0 + (v.max(f64::MIN_POSITIVE) / largest).log10() / DECADES;
    let of = |(k, values): (usize, &Vec<f64>)| {
        let points =
            stabilization.frequencies.iter().zip(values).map(|(f, v)| [*f, bottom + height * level(*v).max(0.0)]);
        let name = if k == 0 { "spectrum" } else { "" };
        let layer = Layer::new(Ink::Measured, name, Shape::Line(Points::new(points)));
        layer.playing(LayerRole::Ghost).wide(if k == 0 { 1.2 } else { 0.6 })
    };
    stabilization.singular_values.iter().take(SINGULAR_VALUES).enumerate().map(of).collect()
}

/// The poles as numbers, and the cluster that each belongs to with its means and spreads.
fn columns(stabilization: &Stabilization) -> Vec<(String, Vec<f64>)> {
    let poles = &stabilization.poles;
    let column = |head: &str, of: &dyn Fn(&ProposedPole) -> f64| (head.to_owned(), poles.iter().map(of).collect());
    let mut of_pole = vec![None; poles.len()];
    for (number, cluster) in stabilization.clusters.iter().enumerate() {
        cluster.members.iter().for_each(|k| of_pole[*k] = Some((number, cluster)));
    }
    let clustered = |head: &str, of: &dyn Fn(usize, &PoleCluster) -> f64| {
        let value = |c: &Option<(usize, &PoleCluster)>| c.map_or(f64::NAN, |(number, cluster)| of(number, cluster));
        (head.to_owned(), of_pole.iter().map(value).collect())
    };
    vec![
        column("order", &|p| p.order as f64),
        column("thinning", &|p| p.thinning as f64),
        column("f (Hz)", &|p| p.pole.frequency()),
        column("damping ratio", &|p| p.pole.damping),
        column("modal phase collinearity", &|p| p.collinearity.unwrap_or(f64::NAN)),
        column("mean phase deviation (rad)", &|p| p.deviation.unwrap_or(f64::NAN)),
        column("stable (0 spurious, 1 new, 2 frequency, 3 damping, 4 shape)", &|p| f64::from(p.stability as u8)),
        clustered("cluster", &|number, _| number as f64 + 1.0),
        clustered("cluster's mean f (Hz)", &|_, c| c.frequency.0),
        clustered("spread of f (Hz)", &|_, c| c.frequency.1),
        clustered("cluster's mean damping ratio", &|_, c| c.damping.0),
        clustered("spread of damping ratio", &|_, c| c.damping.1),
    ]
}
