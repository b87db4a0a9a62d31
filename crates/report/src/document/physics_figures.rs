//! The figures of an equation's physics: stiffness, friction, and what the residual still tells.

use super::chart::{Axis, BELOW, Extent, Guide, LEFT, Legend, Line, Panel, RIGHT, padded};
use super::figures::Figure;
use super::svg::Svg;
use crate::diagram::{Element, FrictionForce, Partner, Residual, RestoringForce, Samples, Source};
use crate::palette::Ink;
use sindyscope_core::study::{Outcome, RecordOutcome, base_excited};
use sindyscope_values::format::number::plain;
use sindyscope_values::format::units::{format_si, per_second};
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

/// Height of a panel.
const HEIGHT: f64 = 200.0;

/// Points of a scatter: more would only hide each other, and swell the document.
const DOTS: usize = 700;

/// A force over what it follows from: measured samples, the model's curve, the mean over samples where there is one.
struct Force<'a> {
    /// Name and unit of the abscissa.
    over: (&'a str, &'a str),
    samples: (&'a [f64], &'a [f64]),
    curve: &'a [[f64; 2]],
    mean: Option<(&'a [f64], &'a [f64])>,
}

/// What forces are drawn of: the first degree of freedom, all records together, and the displacement's unit.
fn element(outcome: &Outcome) -> Option<(Element, Vec<Samples>, &str)> {
    let first = &outcome.records.first()?.record;
    let unit = first.channel(Role::Displacement(0))?.unit.as_str();
    let base = base_excited(first, outcome.model.layout.kind);
    let element = Element::new(&outcome.model, 0, Element::suited(&outcome.model, 0, base), base)?;
    let stretches = outcome.records.iter().filter_map(|r| element.samples(outcome, r)).collect();
    Some((element, stretches, unit))
}

/// The restoring force over the deflection near zero velocity.
pub(super) fn restoring(outcome: &Outcome, extent: &Extent) -> Option<Figure> {
    let (element, stretches, unit) = element(outcome)?;
    let found = RestoringForce::new(&element, &stretches)?;
    let [x, v] = element.names();
    let stiffness = &found.stiffness;
    let caption = format!(
        "Restoring force per mass over {x} near zero velocity (|{v}| < {}): points off the line are stiffness that the equation lacks.",
        format_si(stiffness.within, &per_second(unit), 2)
    );
    let samples = (&*stiffness.at, &*stiffness.force);
    let force = Force { over: (&x, unit), samples, curve: &stiffness.curve, mean: None };
    Some(force.figure(unit, extent, caption))
}

/// What follows the velocity alone.
pub(super) fn friction(outcome: &Outcome, extent: &Extent) -> Option<Figure> {
    let (element, stretches, unit) = element(outcome)?;
    let found = FrictionForce::new(&element, &stretches)?;
    let [_, v] = element.names();
    let caption = format!(
        "Force per mass that follows {v} alone: a straight line is viscous damping, a step at zero dry friction."
    );
    let mean = Some((&*found.mean.at, &*found.mean.mean));
    let rate = per_second(unit);
    let force = Force { over: (&v, &rate), samples: (&found.at, &found.force), curve: &found.curve, mean };
    Some(force.figure(unit, extent, caption))
}

impl Force<'_> {
    fn figure(&self, unit: &str, extent: &Extent, caption: String) -> Figure {
        let step = self.samples.0.len().div_ceil(DOTS).max(1);
        let pairs = |(at, force): (&[f64], &[f64])| at.iter().copied().zip(force.iter().copied()).collect::<Vec<_>>();
        let dots: Vec<(f64, f64)> = pairs(self.samples).into_iter().step_by(step).collect();
        let curve = self.curve.iter().map(|[a, f]| (*a, *f)).collect();
        let mut lines = vec![Line { ink: Ink::Identified, points: curve }];
        let mut keys = vec![(Ink::Measured, "measured"), (Ink::Identified, "identified")];
        if let Some(mean) = self.mean {
            lines.push(Line { ink: Ink::Mean, points: pairs(mean) });
            keys.push((Ink::Mean, "mean"));
        }
        let points = || lines.iter().flat_map(|l| &l.points);
        let forces = dots.iter().map(|p| p.1).chain(points().map(|p| p.1));
        let y = Axis::linear("force / mass", padded(forces), &per_second(&per_second(unit)));
        let x = Axis::linear(self.over.0, padded(points().map(|p| p.0)), self.over.1);
        let mut drawing = Svg::default();
        let legend = Legend::new(&keys, LEFT, extent.width);
        legend.draw(&mut drawing);
        let height = HEIGHT * extent.stretch(legend.top() + BELOW, HEIGHT);
        let size = (extent.width - LEFT - RIGHT, height);
        let (at, guides) = ((LEFT, legend.top()), Vec::new());
        Panel { at, size, x, y, x_labels: true, y_labels: true, guides, lines, dots }.draw(&mut drawing);
        Figure { drawing, size: (extent.width, legend.top() + height + BELOW), caption }
    }
}

/// The residual's correlation with itself, and with what it goes with most, on the record that tells most.
pub(super) fn residual(outcome: &Outcome, record: &RecordOutcome, extent: &Extent) -> Option<Figure> {
    let residual = Residual::new(outcome, record, 0, Source::Response)?;
    let layout = &outcome.model.layout;
    let mut drawing = Svg::default();
    let keys = [(Ink::Error, "residual"), (Ink::NoiseFloor, "95 % band")];
    let legend = Legend::new(&keys, LEFT, extent.width);
    legend.draw(&mut drawing);
    let top = legend.top();
    let height = HEIGHT * extent.stretch(top + BELOW, HEIGHT);
    let size = (0.5 * extent.width - LEFT - RIGHT, height);
    let mut draw = |left: f64, c: &crate::diagram::Correlation, name: &str| {
        let own = c.partner == Partner::Itself;
        let points: Vec<(f64, f64)> =
            c.lags.clone().map(|k| k as f64 * residual.interval).zip(c.value.iter().copied()).collect();
        let most = c.value.iter().skip(usize::from(own)).fold(2.0 * c.band, |m, v| m.max(v.abs()));
        let panel = Panel {
            at: (left, top),
            size,
            x: Axis::linear("lag", points[0].0..=points[points.len() - 1].0, "s"),
            y: Axis::linear(name, -1.15 * most..=1.15 * most, ""),
            x_labels: true,
            y_labels: true,
            guides: vec![Guide::Level(Ink::NoiseFloor, c.band), Guide::Level(Ink::NoiseFloor, -c.band)],
            lines: vec![Line { ink: Ink::Error, points }],
            dots: Vec::new(),
        };
        panel.draw(&mut drawing);
    };
    draw(LEFT, &residual.itself, "autocorrelation");
    let most = residual.with.iter().max_by(|a, b| a.outside.total_cmp(&b.outside));
    let partner = most.map(|c| c.partner.name(layout));
    if let (Some(c), Some(name)) = (most, &partner) {
        draw(LEFT + 0.5 * extent.width, c, &format!("correlation with {name}"));
    }
    let symbol = layout.name(Symbol::State(0));
    let mut caption = format!(
        "What the model leaves of {symbol} on record {} (measured − identified). If it is noise, 95 of 100 lags lie within the bands; {} % of the \
         autocorrelation's do not",
        record.record.name,
        plain(100.0 * residual.itself.outside, 0)
    );
    if let (Some(c), Some(name)) = (most, &partner) {
        caption += &format!(", and {} % of those with {name}, which it goes with most", plain(100.0 * c.outside, 0));
    }
    caption.push('.');
    Some(Figure { drawing, size: (extent.width, top + height + BELOW), caption })
}
