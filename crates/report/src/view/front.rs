//! The error on what was not fitted over the number of terms.

use super::map::{MapQuantity, columns, signs};
use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Layer, Panel, Points, Shape, Ticks};
use crate::palette::Ink;
use sindyscope_core::study::{GridCell, SettingsGrid, SettingsGridPoint};

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Pareto",
    tooltip: "The error on what was not fitted over the number of terms: what each further term is worth",
    reading: "Each point is a setting, the line joins the best for each number of terms: past its bend further terms buy \
              nothing. A click takes the setting over.",
    group: Group::Settings,
    records: RecordUse::None,
    slow: false,
    figure,
};

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let map = subject.landscape.ok_or("Computing the map…")?;
    let points: Vec<[f64; 2]> = map.known().filter_map(|(_, cell)| dot(cell)).collect();
    let front = Points::new(map.front().into_iter().filter_map(|place| point(map, place)));
    let errors = points.iter().map(|p| p[1].log10());
    let (least, most) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), e| (a.min(e), b.max(e)));
    let terms = points.iter().map(|p| p[0]).fold(1.0, f64::max);
    let x = Axis::linear("number of terms", "", (-0.5, terms + 0.5)).with_ticks(Ticks::Whole);
    let symbol = format!("{} (share of the motion)", MapQuantity::Error.label(map.judge));
    let y = Axis::logarithmic(symbol, "", (least - 0.15, most.max(least + 0.5) + 0.15)).with_ticks(Ticks::Percent);
    let mut panel = Panel::new("front", x, y);
    panel.layers = vec![
        Layer::new(Ink::Measured, "", Shape::Dots(Points::new(points))),
        Layer::new(Ink::Identified, "", Shape::Line(front.clone())).wide(1.6),
        Layer::new(Ink::Identified, "", Shape::Marks(front)),
    ];
    let at = |place: Option<SettingsGridPoint>| place.and_then(|place| point(map, place));
    let now = map.place_of(&scene.outcome.settings).and_then(|place| dot(map.nearest(place)?));
    panel.guides = signs(at(map.best), at(map.parsimonious), now);
    panel.columns = columns(map);
    let caption = "The error on what was not fitted over the number of terms; the line joins the best of each number.";
    Ok(Figure::stacked([(panel, 1.0)], 260.0, caption))
}

fn point(map: &SettingsGrid, place: SettingsGridPoint) -> Option<[f64; 2]> {
    dot(map.cell(place)?)
}

/// Where a cell of the map stands: its terms and its error, unless it failed.
pub fn dot(cell: &GridCell) -> Option<[f64; 2]> {
    (cell.failed == 0.0 && cell.error > 0.0).then_some([cell.terms as f64, cell.error])
}
