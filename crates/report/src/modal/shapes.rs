//! Shapes over the sensors, and the modal assurance of each pair.

use super::{ModalSubject, mode_name, numbered_modes};
use crate::figure::{Axis, Cells, Colours, Figure, Guide, Layer, Panel, PanelRow, PlotBar, Points, Shape, Ticks};
use crate::palette::Ink;
use sindyscope_modes::{Structure, assurance, scaled_shape};
use sindyscope_values::format::number::plain;
use sindyscope_values::model::Mode;

/// Half the width of a sensor's bar, sensors.
const HALF_BAR: f64 = 0.3;

/// Largest number of modes whose shapes are drawn into one panel.
const MOST_SHAPES: usize = 7;

/// Phase from which a shape is drawn as a complex one, rad: one degree. Shapes of free decays have less by their noise alone.
const LEAST_PHASE: f64 = std::f64::consts::PI / 180.0;

/// From this modal assurance of two different modes on, the sensors hardly tell their shapes apart.
const ALIKE: f64 = 0.9;

pub(super) fn figure(subject: &ModalSubject<'_>) -> Result<Figure, String> {
    let structure = &subject.analysis.structure;
    if structure.sensors.len() < 2 {
        return Err("One sensor shows no shape: it takes two or more".into());
    }
    // By their numbers, from one.
    let modes: Vec<(usize, &Mode)> = numbered_modes(subject.analysis).collect();
    let chosen = subject.options.mode.map(|k| structure.mode_number(k));
    let chosen = chosen.and_then(|number| modes.iter().find(|(n, _)| *n == number).copied());
    let shape = match (chosen, &subject.analysis.positions[..]) {
        (Some((k, mode)), []) => one(structure, k, mode, subject.options.swing),
        (None, []) => all(structure, &modes, subject.options.swing),
        (Some(one), positions) => placed(structure, &[one], positions, subject.options.swing),
        (None, positions) => placed(structure, &modes, positions, subject.options.swing),
    };
    let shown = chosen.map_or_else(|| modes.clone(), |one| vec![one]);
    let mut figure = Figure {
        rows: vec![PanelRow::new(vec![shape, assurances(structure, &modes)], 1.0)],
        caption: "Shapes of the modes over the sensors, the largest entry one, negative where a sensor swings against it; and the \
                  modal assurance criterion of each pair of shapes."
            .into(),
        height: 280.0,
        ..Figure::default()
    };
    if let Some(complex) = complex_plane(&shown, subject.options.swing) {
        figure.rows.push(PanelRow::new(vec![complex], 1.0));
        figure.height *= 2.0;
        figure.caption.push_str(
            " In the complex plane each sensor's entry is drawn from the origin: in phase or against it they lie on one line, as \
             where damping is proportional; sensors that come sooner or later stand off it.",
        );
    }
    if chosen.is_some() {
        figure.caption.insert_str(0, "One mode alone, with standard errors. ");
    }
    Ok(figure)
}

/// An axis with a mark at each sensor.
fn sensors(structure: &Structure) -> Axis {
    let names = structure.sensors.iter().enumerate().map(|(s, sensor)| ((s + 1) as f64, sensor.name.clone()));
    let range = (0.4, structure.sensors.len() as f64 + 0.6);
    Axis::linear("sensor", "", range).with_ticks(Ticks::Named(names.collect()))
}

fn blank(structure: &Structure, id: &'static str, title: String) -> Panel {
    let mut panel = Panel::new(id, sensors(structure), Axis::linear("shape", "", (-1.15, 1.15)));
    panel.guides.push(Guide::Level { ink: Ink::Cursor, at: 0.0, text: String::new() });
    panel.title = title;
    panel.fixed = true;
    panel
}

/// One mode, a bar for each sensor, with standard errors.
fn one(structure: &Structure, number: usize, mode: &Mode, swing: Option<f64>) -> Panel {
    let mut panel = blank(structure, "shape of one mode", format!("mode {}", mode_name(number, mode)));
    let bar = |(s, height): (usize, &f64)| {
        let at = (s + 1) as f64;
        let phase = mode.phase.get(s).copied().unwrap_or(0.0);
        let text =
            if phase.abs() < LEAST_PHASE { String::new() } else { format!("{}°", plain(phase.to_degrees(), 0)) };
        PlotBar { from: at - HALF_BAR, to: at + HALF_BAR, height: *height, text, text_at: height.max(0.0) }
    };
    let bars = swung(mode, swing).iter().enumerate().map(bar).collect();
    panel.layers.push(Layer::new(Ink::of_term(number - 1), "", Shape::Bars { bars, hollow: false }));
    let error = |(s, error): (usize, &Option<f64>)| {
        let (value, error) = (mode.shape[s], (*error)?);
        Some([(s + 1) as f64, value - error, value + error])
    };
    if swing.is_none() {
        let errors = mode.shape_error.iter().enumerate().filter_map(error).collect();
        panel.layers.push(Layer::new(Ink::Mean, "", Shape::Errors(errors)));
    }
    panel.columns = columns(structure, &[(number, mode)]);
    panel
}

/// A shape when it has swung so far: sensors that are ahead of the others come first.
fn swung(mode: &Mode, swing: Option<f64>) -> Vec<f64> {
    let Some(angle) = swing else { return mode.shape.clone() };
    mode.shape.iter().zip(&mode.phase).map(|(s, phase)| s * (angle + phase).cos()).collect()
}

/// True if some sensor comes sooner or later than others by enough to be drawn.
fn is_complex(mode: &Mode) -> bool {
    mode.phase.iter().any(|phase| phase.abs() >= LEAST_PHASE)
}

/// The entries of complex shapes as arrows from the origin, turned on by as much as the shapes have swung; none where all shapes
/// are real.
fn complex_plane(modes: &[(usize, &Mode)], swing: Option<f64>) -> Option<Panel> {
    let complex: Vec<_> = modes.iter().filter(|(_, mode)| is_complex(mode)).take(MOST_SHAPES).collect();
    if complex.is_empty() {
        return None;
    }
    // The panel is about twice as wide as high: a circle stays one.
    let axis = |name: &str, reach: f64| Axis::linear(name, "", (-reach, reach));
    let mut panel = Panel::new("complex plane", axis("real part", 2.3), axis("imaginary part", 1.15));
    panel.guides.push(Guide::Level { ink: Ink::Cursor, at: 0.0, text: String::new() });
    panel.title = match complex[..] {
        [(number, mode)] => format!("mode {} in the complex plane", mode_name(*number, mode)),
        _ => "complex plane".into(),
    };
    panel.fixed = true;
    for (number, mode) in complex {
        let end = |(size, phase): (&f64, &f64)| {
            let angle = phase + swing.unwrap_or(0.0);
            [size * angle.cos(), size * angle.sin()]
        };
        let ends: Vec<[f64; 2]> = mode.shape.iter().zip(&mode.phase).map(end).collect();
        let ink = Ink::of_term(*number - 1);
        let arrows = Points::new(ends.iter().flat_map(|end| [[0.0, 0.0], *end, [0.0, 0.0]]));
        panel.layers.push(Layer::new(ink, number.to_string(), Shape::Line(arrows)));
        panel.layers.push(Layer::new(ink, "", Shape::Marks(Points::new(ends.iter().copied()))));
        let head = |what: &str| format!("mode {number} {what}");
        panel.columns.push((head("real part"), ends.iter().map(|e| e[0]).collect()));
        panel.columns.push((head("imaginary part"), ends.iter().map(|e| e[1]).collect()));
    }
    Some(panel)
}

/// All modes as lines over the sensors.
fn all(structure: &Structure, modes: &[(usize, &Mode)], swing: Option<f64>) -> Panel {
    let drawn = modes.len().min(MOST_SHAPES);
    let title =
        if drawn < modes.len() { format!("the first {drawn} of {} modes", modes.len()) } else { "modes".into() };
    let mut panel = blank(structure, "shapes", title);
    for (k, mode) in &modes[..drawn] {
        let points = Points::new(swung(mode, swing).iter().enumerate().map(|(s, v)| [(s + 1) as f64, *v]));
        let ink = Ink::of_term(*k - 1);
        panel.layers.push(Layer::new(ink, k.to_string(), Shape::Line(points.clone())));
        panel.layers.push(Layer::new(ink, "", Shape::Marks(points)));
    }
    panel.columns = columns(structure, modes);
    panel
}

/// How far a sensor's mark moves at its largest, as a share of the structure's extent.
const REACH: f64 = 0.2;
/// Room about the structure, as a share of its extent.
const MARGIN: f64 = 0.08;

/// Shapes over the sensors' true places. With one coordinate the shape stands over it; with two the structure is seen in its plane, and
/// each sensor moves across the structure's longer extent.
fn placed(structure: &Structure, modes: &[(usize, &Mode)], positions: &[Vec<f64>], swing: Option<f64>) -> Panel {
    let coordinate = |axis: usize| positions.iter().filter_map(move |p| p.get(axis).copied());
    let range = |axis: usize| {
        let low = coordinate(axis).fold(f64::INFINITY, f64::min);
        (low, coordinate(axis).fold(f64::NEG_INFINITY, f64::max))
    };
    let plane = positions.iter().all(|p| p.len() > 1);
    let wide = |(low, high): (f64, f64), more: f64| (low - more, high + more);
    let (x, y) = (range(0), if plane { range(1) } else { (0.0, 0.0) });
    let extent = (x.1 - x.0).max(y.1 - y.0);
    let extent = if extent > 0.0 { extent } else { 1.0 };
    let upright = y.1 - y.0 > x.1 - x.0;
    let at = |s: usize, value: f64| match (positions[s].as_slice(), upright) {
        ([x, y, ..], true) => [x + REACH * extent * value, *y],
        ([x, y, ..], false) => [*x, y + REACH * extent * value],
        ([x], _) => [*x, value],
        ([], _) => [s as f64, value],
    };
    let (margin, reach) = (MARGIN * extent, (MARGIN + REACH) * extent);
    let (across, up) = match (plane, upright) {
        (false, _) => (wide(x, margin), (-1.15, 1.15)),
        (true, true) => (wide(x, reach), wide(y, margin)),
        (true, false) => (wide(x, margin), wide(y, reach)),
    };
    let (first, second) = if plane { ("x", "y") } else { ("position", "shape") };
    let mut panel = Panel::new("placed shapes", Axis::linear(first, "", across), Axis::linear(second, "", up));
    panel.fixed = true;
    // Neighbours along the structure are joined.
    let mut order: Vec<usize> = (0..positions.len()).collect();
    let along = |s: usize| positions[s].get(usize::from(upright)).copied().unwrap_or(s as f64);
    order.sort_by(|a, b| along(*a).total_cmp(&along(*b)));
    let rest = Points::new(order.iter().map(|s| at(*s, 0.0)));
    panel.layers.push(Layer::new(Ink::Ghost, "at rest", Shape::Line(rest)));
    let drawn = modes.len().min(MOST_SHAPES);
    panel.title = match modes {
        [(number, mode)] => format!("mode {}", mode_name(*number, mode)),
        _ if drawn < modes.len() => format!("the first {drawn} of {} modes", modes.len()),
        _ => "modes".into(),
    };
    for (k, mode) in &modes[..drawn] {
        let swung = swung(mode, swing);
        let points = Points::new(order.iter().map(|s| at(*s, swung[*s])));
        let ink = Ink::of_term(*k - 1);
        panel.layers.push(Layer::new(ink, k.to_string(), Shape::Line(points.clone())));
        panel.layers.push(Layer::new(ink, "", Shape::Marks(points)));
    }
    panel.columns = columns(structure, modes);
    for (axis, name) in [first, "y"].into_iter().enumerate().take(if plane { 2 } else { 1 }) {
        panel.columns.push((name.to_owned(), coordinate(axis).collect()));
    }
    panel
}

/// Shapes, errors and phases as numbers, a row for each sensor.
fn columns(structure: &Structure, modes: &[(usize, &Mode)]) -> Vec<(String, Vec<f64>)> {
    let count = structure.sensors.len();
    let mut all = vec![("sensor".to_owned(), (1..=count).map(|s| s as f64).collect())];
    for (k, mode) in modes {
        let head = |what: &str| format!("mode {k} {what}");
        all.push((head("shape"), mode.shape.clone()));
        all.push((head("std. error"), mode.shape_error.iter().map(|e| e.unwrap_or(f64::NAN)).collect()));
        all.push((head("phase (rad)"), mode.phase.clone()));
    }
    all
}

/// The modal assurance criterion of every pair of modes.
fn assurances(structure: &Structure, modes: &[(usize, &Mode)]) -> Panel {
    let names: Vec<(f64, String)> = modes.iter().enumerate().map(|(i, (k, _))| (i as f64, k.to_string())).collect();
    let axis = || Axis::linear("mode", "", (-0.5, modes.len() as f64 - 0.5)).with_ticks(Ticks::Named(names.clone()));
    let mut panel = Panel::new("assurance", axis(), axis());
    panel.title = "modal assurance criterion".into();
    panel.fixed = true;
    let shapes: Vec<_> = modes.iter().map(|(_, mode)| scaled_shape(mode, &structure.sensors)).collect();
    let pairs = || (0..shapes.len()).flat_map(|i| (0..shapes.len()).map(move |j| (i, j)));
    let values: Vec<f64> = pairs().map(|(i, j)| assurance(&shapes[i], &shapes[j])).collect();
    let edges: Vec<f64> = (0..=modes.len()).map(|i| i as f64 - 0.5).collect();
    let remark = |((i, j), value): ((usize, usize), &f64)| {
        let alike = if i != j && *value > ALIKE { ": these sensors hardly tell them apart" } else { "" };
        format!("modes {} and {}{alike}", modes[i].0, modes[j].0)
    };
    let remarks = pairs().zip(&values).map(remark).collect();
    let ends = [0.0, 0.5, 1.0].map(|v| (v, plain(v, 1))).to_vec();
    panel.columns = std::iter::once(("mode".to_owned(), modes.iter().map(|(k, _)| *k as f64).collect()))
        .chain(modes.iter().enumerate().map(|(j, (k, _))| {
            (format!("with mode {k}"), (0..modes.len()).map(|i| values[i * modes.len() + j]).collect())
        }))
        .collect();
    panel.layers.push(Layer::new(
        Ink::Mean,
        "",
        Shape::Cells(Cells {
            columns: edges.clone(),
            rows: edges,
            values,
            remarks,
            colours: Colours::Shades(ends),
            name: "assurance".into(),
            ..Cells::default()
        }),
    ));
    panel
}
