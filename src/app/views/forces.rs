//! Forces across an element of the structure: the restoring force's surface with its slices, and friction over velocity.

use super::{Request, View, ViewState, kept, painter};
use std::sync::Arc;

use egui::Ui;
use egui_plot::PlotPoint;

use super::figure::{Axis, Figure, Graph, Shape, extent, lead, points};
use super::legend::{self, Entry};
use super::scene::Scene;
use crate::app::plot::palette::Ink;
use crate::app::plot::units::{format_si, per_second};
use sindyscope_core::study::{Outcome, base_excited};
use sindyscope_report::diagram::{Across, Cells, Element, FrictionForce, RestoringForce, Samples, Slice};
use sindyscope_values::record::Role;

const FORCE: &str = "force / mass";

/// Why equations of first order have no such views.
const FIRST_ORDER: &str =
    "Forces need an equation of second order (acceleration from displacement and velocity); these are of first order";

const TOO_SHORT: &str = "The records are too short, or nothing moves in them";

/// What the deflection may be measured against, and what it is.
pub(super) fn across(scene: &Scene<'_>, state: &ViewState) -> (Vec<Across>, Across) {
    let base = base_excited(&scene.record.record, scene.layout.kind);
    let model = &scene.outcome.model;
    let choices = Element::choices(model, scene.freedom, base);
    let chosen = state.across.filter(|a| choices.contains(a));
    let chosen = chosen.unwrap_or_else(|| Element::suited(model, scene.freedom, base));
    (choices, chosen)
}

/// A number that tells choices apart.
fn code(across: Across) -> usize {
    match across {
        Across::Ground => 0,
        Across::Input(j) => 2 * j + 1,
        Across::Freedom(k) => 2 * k + 2,
    }
}

/// The records that a view of several shows.
pub(super) fn pooled(outcome: &Outcome, alone: Option<usize>) -> Vec<usize> {
    alone.map_or_else(|| (0..outcome.records.len()).collect(), |k| vec![k])
}

/// Which record a view of several is held to, as a number.
pub(super) fn held(scene: &Scene<'_>, state: &ViewState) -> (Option<usize>, usize) {
    let alone = state.alone.then_some(scene.index);
    (alone, alone.map_or(0, |k| k + 1))
}

pub(super) fn restoring(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let figure = figure(ui, View::Restoring, scene, state);
    let graphs = kept::graphs(ui, figure.as_deref(), "Computing the restoring force…")?;
    legend::reading(
        ui,
        "The force that the inputs do not explain, by where the motion is: colour that changes along the deflection is \
         stiffness, along the velocity damping, a jump at zero velocity dry friction. In the slices, points off the line \
         are force that the equation lacks.",
    );
    let names = [Entry { ink: Ink::Measured, name: "measured" }, Entry { ink: Ink::Identified, name: "identified" }];
    painter::names(ui, scene, state, &names);
    let map = usize::from(state.curved);
    painter::rows(ui, View::Restoring, scene, state, graphs, &[(&[map], 1.1), (&[2, 3], 1.0)])
}

pub(super) fn friction(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let figure = figure(ui, View::Friction, scene, state);
    let graphs = kept::graphs(ui, figure.as_deref(), "Computing the friction force…")?;
    legend::reading(
        ui,
        "What is left when every other term is taken away: a straight line is viscous damping, a step at zero dry \
         friction, a step that falls behind zero Stribeck friction, a parabola drag. Means away from the line are \
         damping that the equation lacks.",
    );
    let names = [
        Entry { ink: Ink::Measured, name: "measured" },
        Entry { ink: Ink::Mean, name: "mean ± 2 standard errors" },
        Entry { ink: Ink::Identified, name: "identified" },
    ];
    painter::names(ui, scene, state, &names);
    painter::rows(ui, View::Friction, scene, state, graphs, &[(&[0], 1.0)])
}

fn figure(ui: &Ui, view: View, scene: &Scene<'_>, state: &mut ViewState) -> Option<Arc<std::sync::OnceLock<Figure>>> {
    let (_, across) = across(scene, state);
    let (alone, which) = held(scene, state);
    let (freedom, unit) = (scene.freedom, scene.unit());
    let choice = [which, freedom, code(across), 0, 0, 0];
    let printing = state.printing;
    state.cache.figures.get(ui, view, scene, choice, printing, move |outcome| {
        let Some((element, stretches)) = element(outcome, &pooled(outcome, alone), freedom, across) else {
            return Figure::Note(FIRST_ORDER.into());
        };
        let figure = match view {
            View::Restoring => surface(&element, &stretches, &unit),
            _ => over_velocity(&element, &stretches, &unit),
        };
        figure.unwrap_or_else(|| Figure::Note(TOO_SHORT.into()))
    })
}

fn element(outcome: &Outcome, records: &[usize], freedom: usize, across: Across) -> Option<(Element, Vec<Samples>)> {
    let first = &outcome.records.first()?.record;
    first.channel(Role::Displacement(freedom))?;
    let base = base_excited(first, outcome.model.layout.kind);
    let element = Element::new(&outcome.model, freedom, across, base)?;
    let records = records.iter().filter_map(|k| outcome.records.get(*k));
    let stretches = records.filter_map(|r| element.samples(outcome, r)).collect();
    Some((element, stretches))
}

fn surface(element: &Element, stretches: &[Samples], unit: &str) -> Option<Figure> {
    let force = RestoringForce::new(element, stretches)?;
    let [x, v] = element.names();
    let (rate, acceleration) = (per_second(unit), per_second(&per_second(unit)));
    let axis = |symbol: &str, unit: &str, most: f64| Axis::linear(symbol, unit, (-1.03 * most, 1.03 * most));
    let map = |id: &'static str, cells: &Cells, caption: String, name: &str| {
        let (x, v) = (axis(&x, unit, cells.most[0]), axis(&v, &rate, cells.most[1]));
        let middle = |axis: usize, k: usize| {
            let (low, high) = cells.edges(axis, k);
            0.5 * (low + high)
        };
        let columns = vec![
            (x.header(), cells.visited().map(|c| middle(0, c.0)).collect()),
            (v.header(), cells.visited().map(|c| middle(1, c.1)).collect()),
            (Axis::linear(name, &*acceleration, (0.0, 1.0)).header(), cells.visited().map(|c| c.2).collect()),
        ];
        let map = Some((cells.clone(), name.to_owned(), acceleration.clone()));
        Graph { id, caption, x, y: v, layers: Vec::new(), map, columns, outside: None }
    };
    let slice = |id: &'static str, slice: &Slice, caption: String, symbol: &str, unit: &str| {
        let x = axis(symbol, unit, slice.curve.last().map_or(1.0, |p| p[0]));
        let curve: Vec<PlotPoint> = slice.curve.iter().map(|[a, f]| PlotPoint::new(*a, *f)).collect();
        let range = lead(slice.force.iter().copied(), curve.iter().map(|p| p.y));
        let y = Axis::linear(FORCE, &*acceleration, range);
        let columns = vec![
            (x.header(), slice.at.clone()),
            (format!("{} measured", y.header()), slice.force.clone()),
            (format!("{} of the curve", x.header()), slice.curve.iter().map(|p| p[0]).collect()),
            (format!("{} identified", y.header()), slice.curve.iter().map(|p| p[1]).collect()),
        ];
        let layers =
            vec![(Ink::Measured, Shape::Dots(points(&slice.at, &slice.force))), (Ink::Identified, Shape::Line(curve))];
        Graph { id, caption, x, y, layers, map: None, columns, outside: None }
    };
    let near = |name: &str, within: f64, unit: &str| format!("|{name}| < {}", format_si(within, unit, 2));
    Some(Figure::Graphs(vec![
        map("surface", &force.map, format!("restoring force / mass over {x} and {v}"), FORCE),
        map("curved", &force.curved, format!("the same without the straight part {}", plane(&force, &x, &v)), "rest"),
        slice(
            "stiffness",
            &force.stiffness,
            format!("stiffness: {}", near(&v, force.stiffness.within, &rate)),
            &x,
            unit,
        ),
        slice("damping", &force.damping, format!("damping: {}", near(&x, force.damping.within, unit)), &v, &rate),
    ]))
}

/// The straight part of a restoring force in words.
fn plane(force: &RestoringForce, x: &str, v: &str) -> String {
    use crate::app::plot::number::significant;
    let group = |name: &str| if name.contains(' ') { format!("({name})") } else { name.to_owned() };
    let [k, c] = force.linear;
    let sign = if c < 0.0 { '−' } else { '+' };
    format!("{} {} {sign} {} {}", significant(k, 3), group(x), significant(c.abs(), 3), group(v))
}

fn over_velocity(element: &Element, stretches: &[Samples], unit: &str) -> Option<Figure> {
    let friction = FrictionForce::new(element, stretches)?;
    let [_, v] = element.names();
    let most = friction.curve.last().map_or(1.0, |p| p[0]);
    let x = Axis::linear(v.as_str(), per_second(unit), (-1.03 * most, 1.03 * most));
    let curve: Vec<PlotPoint> = friction.curve.iter().map(|[a, f]| PlotPoint::new(*a, *f)).collect();
    let mean = &friction.mean;
    // Scatter is wide where smoothing is narrow: the means decide what is shown.
    let ends = extent(mean.mean.iter().copied());
    let room = 0.75 * (ends.1 - ends.0);
    let within = friction.force.iter().copied().filter(|f| (ends.0 - room..=ends.1 + room).contains(f));
    let y = Axis::linear(
        FORCE,
        per_second(&per_second(unit)),
        lead(within.chain([ends.0, ends.1]), curve.iter().map(|p| p.y)),
    );
    let bars = mean.at.iter().zip(&mean.mean).zip(&mean.error).filter(|(_, e)| e.is_finite());
    let errors = bars.map(|((a, m), e)| [*a, m - 2.0 * e, m + 2.0 * e]).collect();
    let columns = vec![
        (x.header(), mean.at.clone()),
        (format!("{} mean", y.header()), mean.mean.clone()),
        ("standard error".to_owned(), mean.error.clone()),
        ("visits".to_owned(), mean.visits.iter().map(|n| *n as f64).collect()),
        (format!("{} of the curve", x.header()), friction.curve.iter().map(|p| p[0]).collect()),
        (format!("{} identified", y.header()), friction.curve.iter().map(|p| p[1]).collect()),
        (format!("{} of the points", x.header()), friction.at.clone()),
        (format!("{} measured", y.header()), friction.force.clone()),
    ];
    let layers = vec![
        (Ink::Measured, Shape::Dots(points(&friction.at, &friction.force))),
        (Ink::Identified, Shape::Line(curve)),
        (Ink::Mean, Shape::Errors(errors)),
        (Ink::Mean, Shape::Marks(points(&mean.at, &mean.mean))),
    ];
    let caption = format!("damping and friction / mass over {v}");
    Some(Figure::Graphs(vec![Graph { id: "friction", caption, x, y, layers, map: None, columns, outside: None }]))
}
