//! Forces across an element of the structure: the restoring force's surface with its slices, and friction over velocity.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::diagram::{CellMeans, Element, ElementEnds, ElementSamples, FrictionForce, RestoringForce, Slice};
use crate::figure::{
    Axis, Cells, Colours, Figure, KeyMark, Layer, LayerRole, LegendEntry, Panel, PanelRow, Points, Shape, extent, lead,
};
use crate::palette::Ink;
use sindyscope_core::study::base_excited;
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::{format_si, per_second};
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

pub(super) const RESTORING: ViewEntry = ViewEntry {
    label: "Restoring force",
    tooltip: "Restoring force over deflection and velocity, with slices for stiffness and damping",
    reading: "The force that the inputs do not explain, by where the motion is: colour that changes along the deflection is \
              stiffness, along the velocity damping, a jump at zero velocity dry friction. In the slices, points off the \
              line are force that the equation lacks.",
    group: Group::Physics,
    records: RecordUse::Pooled,
    slow: true,
    figure: restoring,
};

pub(super) const FRICTION: ViewEntry = ViewEntry {
    label: "Friction",
    tooltip: "What the velocity alone does: damping and friction, measured and identified",
    reading: "What is left when every other term is taken away: a straight line is viscous damping, a step at zero dry \
              friction, a step that falls behind zero Stribeck friction, a parabola drag. CellMeans away from the line are \
              damping that the equation lacks.",
    group: Group::Physics,
    records: RecordUse::Pooled,
    slow: true,
    figure: friction,
};

const FORCE: &str = "force / mass";

/// Why equations of first order have no such views.
const FIRST_ORDER: &str =
    "Forces need an equation of second order (acceleration from displacement and velocity); these are of first order";

const TOO_SHORT: &str = "The records are too short, or nothing moves in them";

/// What the deflection may be measured against, and what it is.
pub fn across(scene: &Scene<'_>, chosen: Option<ElementEnds>) -> (Vec<ElementEnds>, ElementEnds) {
    let base = base_excited(&scene.record.record, scene.layout.kind);
    let model = &scene.outcome.model;
    let choices = Element::choices(model, scene.freedom, base);
    let chosen = chosen.filter(|a| choices.contains(a));
    (choices, chosen.unwrap_or_else(|| Element::suited(model, scene.freedom, base)))
}

/// A deflection's name.
pub fn deflection_name(scene: &Scene<'_>, across: ElementEnds) -> String {
    let own = scene.layout.name(Symbol::State(scene.freedom));
    let other = match across {
        ElementEnds::Ground => return own,
        ElementEnds::Input(j) => Symbol::Input(j),
        ElementEnds::Freedom(k) => Symbol::State(k),
    };
    format!("{own} − {}", scene.layout.name(other))
}

/// The records that a view of several shows.
pub(super) fn pooled(subject: &Subject<'_>, scene: &Scene<'_>) -> Vec<usize> {
    if subject.options.alone { vec![scene.index] } else { (0..subject.outcome.records.len()).collect() }
}

/// The element that forces act across, and the motion along it.
fn element(subject: &Subject<'_>, scene: &Scene<'_>) -> Result<(Element, Vec<ElementSamples>), String> {
    let outcome = scene.outcome;
    let first = &outcome.records.first().ok_or(super::scene::NO_RECORD)?.record;
    let (_, across) = across(scene, subject.options.across);
    let base = base_excited(first, outcome.model.layout.kind);
    let measured = first.channel(Role::Displacement(scene.freedom)).is_some();
    let element = Element::new(&outcome.model, scene.freedom, across, base).filter(|_| measured).ok_or(FIRST_ORDER)?;
    let records = pooled(subject, scene).into_iter().filter_map(|k| outcome.records.get(k));
    let stretches = records.filter_map(|r| element.samples(outcome, r)).collect();
    Ok((element, stretches))
}

/// An axis over ± the largest magnitude.
fn both_ways(symbol: &str, unit: &str, most: f64) -> Axis {
    Axis::linear(symbol, unit, (-1.03 * most, 1.03 * most))
}

fn legend() -> Vec<LegendEntry> {
    let measured = LegendEntry { mark: KeyMark::Dot, ..LegendEntry::line(Ink::Measured, "measured") };
    vec![measured, LegendEntry::line(Ink::Identified, "identified")]
}

fn restoring(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let (element, stretches) = element(subject, &scene)?;
    let force = RestoringForce::new(&element, &stretches).ok_or(TOO_SHORT)?;
    let [x, v] = element.names();
    let unit = scene.unit();
    let (rate, acceleration) = (per_second(&unit), per_second(&per_second(&unit)));
    let axes = |means: &CellMeans| (both_ways(&x, &unit, means.most[0]), both_ways(&v, &rate, means.most[1]));
    let (id, means, title, name) = if subject.options.curved {
        let title =
            format!("restoring force / mass over {x} and {v}, without the straight part {}", plane(&force, &x, &v));
        ("curved", &force.curved, title, "rest")
    } else {
        ("surface", &force.map, format!("restoring force / mass over {x} and {v}"), FORCE)
    };
    let near = |name: &str, within: f64, unit: &str| format!("|{name}| < {}", format_si(within, unit, 2));
    let near_v = near(&v, force.stiffness.within, &rate);
    let stiffness = slice("stiffness", &force.stiffness, format!("stiffness: {near_v}"), (&x, &unit), &acceleration);
    let title_x = format!("damping: {}", near(&x, force.damping.within, &unit));
    let damping = slice("damping", &force.damping, title_x, (&v, &rate), &acceleration);
    let caption = format!(
        "Above, the restoring force per mass over {x} and {v}; beneath, its slices near zero velocity ({near_v}) and near zero \
         deflection: points off the line are stiffness or damping that the equation lacks."
    );
    let surface = surface(id, means, title, axes(means), (name, &acceleration));
    Ok(Figure {
        rows: vec![PanelRow::new(vec![surface], 1.1), PanelRow::new(vec![stiffness, damping], 1.0)],
        legend: legend(),
        caption,
        height: 340.0,
    })
}

fn surface(
    id: &'static str,
    means: &CellMeans,
    title: String,
    (x, y): (Axis, Axis),
    (name, unit): (&str, &str),
) -> Panel {
    let edges = |axis: usize| {
        let ends = (0..means.count[axis]).map(|k| means.edges(axis, k));
        ends.clone().next().map(|e| e.0).into_iter().chain(ends.map(|e| e.1)).collect::<Vec<f64>>()
    };
    let middle = |axis: usize, k: usize| {
        let (low, high) = means.edges(axis, k);
        0.5 * (low + high)
    };
    let columns = vec![
        (x.header(), means.visited().map(|c| middle(0, c.0)).collect()),
        (y.header(), means.visited().map(|c| middle(1, c.1)).collect()),
        (Axis::linear(name, unit, (0.0, 1.0)).header(), means.visited().map(|c| c.2).collect()),
    ];
    let most = means.visited().fold(0.0_f64, |m, (.., v)| m.max(v.abs()));
    let cells = Cells {
        columns: edges(0),
        rows: edges(1),
        values: means.mean.clone(),
        colours: Colours::Diverging(most),
        name: name.to_owned(),
        unit: unit.to_owned(),
        ..Cells::default()
    };
    let layers = vec![Layer::new(Ink::Measured, "", Shape::Cells(cells))];
    Panel { title, layers, columns, ..Panel::new(id, x, y) }
}

fn slice(id: &'static str, slice: &Slice, title: String, (symbol, unit): (&str, &str), acceleration: &str) -> Panel {
    let x = both_ways(symbol, unit, slice.curve.last().map_or(1.0, |p| p[0]));
    let range = lead(slice.force.iter().copied(), slice.curve.iter().map(|p| p[1]));
    let y = Axis::linear(FORCE, acceleration, range);
    let columns = vec![
        (x.header(), slice.at.clone()),
        (format!("{} measured", y.header()), slice.force.clone()),
        (format!("{} of the curve", x.header()), slice.curve.iter().map(|p| p[0]).collect()),
        (format!("{} identified", y.header()), slice.curve.iter().map(|p| p[1]).collect()),
    ];
    let layers = vec![
        Layer::new(Ink::Measured, "", Shape::Dots(Points::of(&slice.at, &slice.force))),
        Layer::new(Ink::Identified, "", Shape::Line(Points::new(slice.curve.iter().copied()))),
    ];
    Panel { title, layers, columns, ..Panel::new(id, x, y) }
}

/// The straight part of a restoring force in words.
fn plane(force: &RestoringForce, x: &str, v: &str) -> String {
    let group = |name: &str| if name.contains(' ') { format!("({name})") } else { name.to_owned() };
    let [k, c] = force.linear;
    let sign = if c < 0.0 { '−' } else { '+' };
    format!("{} {} {sign} {} {}", significant(k, 3), group(x), significant(c.abs(), 3), group(v))
}

fn friction(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let (element, stretches) = element(subject, &scene)?;
    let friction = FrictionForce::new(&element, &stretches).ok_or(TOO_SHORT)?;
    let [_, v] = element.names();
    let unit = scene.unit();
    let x = both_ways(&v, &per_second(&unit), friction.curve.last().map_or(1.0, |p| p[0]));
    let mean = &friction.mean;
    let y = Axis::linear(FORCE, per_second(&per_second(&unit)), friction_range(&friction));
    let mut panel = Panel::new("friction", x, y);
    panel.columns = friction_columns(&friction, &panel);
    let bars = mean.at.iter().zip(&mean.mean).zip(&mean.error).filter(|(_, e)| e.is_finite());
    let errors = bars.map(|((a, m), e)| [*a, m - 2.0 * e, m + 2.0 * e]).collect();
    panel.layers = vec![
        Layer::new(Ink::Measured, "measured", Shape::Dots(Points::of(&friction.at, &friction.force))),
        Layer::new(Ink::Identified, "identified", Shape::Line(Points::new(friction.curve.iter().copied()))),
        Layer::new(Ink::Mean, "", Shape::Errors(errors)).playing(LayerRole::Ghost),
        Layer::new(Ink::Mean, "mean ± 2 standard errors", Shape::Marks(Points::of(&mean.at, &mean.mean))),
    ];
    let caption = format!(
        "Force per mass that follows {v} alone: a straight line is viscous damping, a step at zero dry friction. Black, means \
         with two standard errors."
    );
    Ok(Figure::stacked([(panel, 1.0)], 240.0, caption))
}

/// Scatter is wide where smoothing is narrow: the means decide what is shown.
fn friction_range(friction: &FrictionForce) -> (f64, f64) {
    let ends = extent(friction.mean.mean.iter().copied());
    let room = 0.75 * (ends.1 - ends.0);
    let within = friction.force.iter().copied().filter(|f| (ends.0 - room..=ends.1 + room).contains(f));
    lead(within.chain([ends.0, ends.1]), friction.curve.iter().map(|p| p[1]))
}

fn friction_columns(friction: &FrictionForce, panel: &Panel) -> Vec<(String, Vec<f64>)> {
    let (x, y, mean) = (panel.x.header(), panel.y.header(), &friction.mean);
    vec![
        (x.clone(), mean.at.clone()),
        (format!("{y} mean"), mean.mean.clone()),
        ("standard error".to_owned(), mean.error.clone()),
        ("visits".to_owned(), mean.visits.iter().map(|n| *n as f64).collect()),
        (format!("{x} of the curve"), friction.curve.iter().map(|p| p[0]).collect()),
        (format!("{y} identified"), friction.curve.iter().map(|p| p[1]).collect()),
        (format!("{x} of the points"), friction.at.clone()),
        (format!("{y} measured"), friction.force.clone()),
    ]
}
