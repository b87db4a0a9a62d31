//! The figures of an equation's physics: stiffness, friction, and what the residual still tells.

use super::chart::{Axis, BELOW, Guide, LEFT, Line, Panel, legend, padded};
use super::figures::{Figure, WIDTH};
use super::svg::Svg;
use crate::diagram::{Element, FrictionForce, Partner, Residual, RestoringForce, Source};
use crate::format::number::plain;
use crate::format::palette::Ink;
use crate::format::units::{format_si, per_second};
use crate::record::{Role, Usage};
use crate::study::{Outcome, RecordOutcome, base_excited};
use crate::term::Symbol;

const TOP: f64 = 20.0;
const RIGHT: f64 = 8.0;
const SIZE: (f64, f64) = (0.5 * WIDTH - LEFT - RIGHT, 200.0);

/// Points of a scatter: more would only hide each other, and swell the document.
const DOTS: usize = 700;

/// The stiffness slice and the friction of the first degree of freedom, all records together.
pub(super) fn forces(outcome: &Outcome) -> Option<Figure> {
    let first = &outcome.records.first()?.record;
    let unit = first.channel(Role::Displacement(0))?.unit.as_str();
    let base = base_excited(first, outcome.model.layout.kind);
    let element = Element::new(&outcome.model, 0, Element::suited(&outcome.model, 0, base), base)?;
    let stretches: Vec<_> = outcome.records.iter().filter_map(|r| element.samples(outcome, r)).collect();
    let restoring = RestoringForce::new(&element, &stretches)?;
    let friction = FrictionForce::new(&element, &stretches)?;
    let [x, v] = element.names();
    let (rate, acceleration) = (per_second(unit), per_second(&per_second(unit)));
    let mut drawing = Svg::default();
    let dots = |at: &[f64], force: &[f64]| -> Vec<(f64, f64)> {
        let step = at.len().div_ceil(DOTS).max(1);
        at.iter().copied().zip(force.iter().copied()).step_by(step).collect()
    };
    let curve = |points: &[[f64; 2]]| points.iter().map(|[a, f]| (*a, *f)).collect::<Vec<_>>();
    let panel = |left: f64, symbol: &str, unit: &str, dots: Vec<(f64, f64)>, lines: Vec<Line>| {
        let ordinates = dots.iter().map(|p| p.1).chain(lines.iter().flat_map(|l| &l.points).map(|p| p.1));
        let y = Axis::linear("force / mass", padded(ordinates), &acceleration);
        let abscissae = lines.iter().flat_map(|l| &l.points).map(|p| p.0);
        let x = Axis::linear(symbol, padded(abscissae), unit);
        let (at, guides) = ((left, TOP), Vec::new());
        Panel { at, size: SIZE, x, y, x_labels: true, y_labels: true, guides, lines, dots }
    };
    let stiffness = &restoring.stiffness;
    let lines = vec![Line { ink: Ink::Identified, points: curve(&stiffness.curve) }];
    panel(LEFT, &x, unit, dots(&stiffness.at, &stiffness.force), lines).draw(&mut drawing, "stiffness");
    let means = friction.mean.at.iter().copied().zip(friction.mean.mean.iter().copied()).collect();
    let lines =
        vec![Line { ink: Ink::Identified, points: curve(&friction.curve) }, Line { ink: Ink::Mean, points: means }];
    let left = LEFT + 0.5 * WIDTH;
    panel(left, &v, &rate, dots(&friction.at, &friction.force), lines).draw(&mut drawing, "friction");
    legend(
        &mut drawing,
        &[(Ink::Measured, "measured"), (Ink::Identified, "identified"), (Ink::Mean, "mean")],
        LEFT,
        TOP - 8.0,
    );
    let caption = format!(
        "Forces per mass. Left, the restoring force over {x} near zero velocity (|{v}| < {}): points off the line are stiffness that the \
         equation lacks. Right, what follows {v} alone: a straight line is viscous damping, a step at zero dry friction.",
        format_si(stiffness.within, &rate, 2)
    );
    Some(Figure { drawing, size: (WIDTH, TOP + SIZE.1 + BELOW), caption })
}

/// The residual's correlation with itself, and with what it goes with most, on the record that tells most.
pub(super) fn residual(outcome: &Outcome) -> Option<Figure> {
    let held_out = outcome.records.iter().find(|r| r.usage == Usage::HeldOut);
    let record: &RecordOutcome = held_out.or(outcome.records.first())?;
    let residual = Residual::new(outcome, record, 0, Source::Response)?;
    let layout = &outcome.model.layout;
    let mut drawing = Svg::default();
    let mut draw = |left: f64, c: &crate::diagram::Correlation, name: &str| {
        let own = c.partner == Partner::Itself;
        let points: Vec<(f64, f64)> =
            c.lags.clone().map(|k| k as f64 * residual.interval).zip(c.value.iter().copied()).collect();
        let most = c.value.iter().skip(usize::from(own)).fold(2.0 * c.band, |m, v| m.max(v.abs()));
        let panel = Panel {
            at: (left, TOP),
            size: SIZE,
            x: Axis::linear("lag", points[0].0..=points[points.len() - 1].0, "s"),
            y: Axis::linear(name, -1.15 * most..=1.15 * most, ""),
            x_labels: true,
            y_labels: true,
            guides: vec![Guide::Level(Ink::NoiseFloor, c.band), Guide::Level(Ink::NoiseFloor, -c.band)],
            lines: vec![Line { ink: Ink::Error, points }],
            dots: Vec::new(),
        };
        panel.draw(&mut drawing, if own { "autocorrelation" } else { "correlation" });
    };
    draw(LEFT, &residual.itself, "autocorrelation");
    let most = residual.with.iter().max_by(|a, b| a.outside.total_cmp(&b.outside));
    let partner = most.map(|c| c.partner.name(layout));
    if let (Some(c), Some(name)) = (most, &partner) {
        draw(LEFT + 0.5 * WIDTH, c, &format!("correlation with {name}"));
    }
    legend(&mut drawing, &[(Ink::Error, "residual"), (Ink::NoiseFloor, "95 % band")], LEFT, TOP - 8.0);
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
    Some(Figure { drawing, size: (WIDTH, TOP + SIZE.1 + BELOW), caption })
}
