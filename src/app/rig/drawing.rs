//! The rig as one would sketch it: base, springs, dampers, masses and what rubs, moving with the simulated motion.

use crate::app::plot::palette::Painted as _;
use std::f32::consts::PI;

use egui::{Align2, Rangef, Rect, Stroke, StrokeKind, Ui, pos2, vec2};

use super::room::Made;
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::sketch::Pen;
use crate::app::theme;
use sindyscope_rig::hidden::title;
use sindyscope_rig::{PlantChoice, RigDrive};
use sindyscope_values::format::units::format_si;

/// Height of the drawing, points.
pub(super) const HEIGHT: f32 = 158.0;
/// Largest share of the distance between two masses that a displacement takes on the screen.
const REACH: f32 = 0.34;
/// Height of a mass, points.
const MASS: f32 = 54.0;

/// What is drawn at an instant.
struct Pose {
    /// Displacement of each mass, of the base, and the force, each over its largest magnitude; of masses and base over a
    /// common one.
    masses: Vec<f32>,
    base: f32,
    force: f32,
    stuck: bool,
    /// The largest displacement, in its unit.
    largest: f64,
    /// The instant, s.
    at: f64,
}

impl Pose {
    fn of(made: &Made, at: f64) -> Self {
        let run = &made.run;
        let index = |length: usize| {
            let interval = run.records[0].interval;
            ((at / interval).round().max(0.0) as usize).min(length.saturating_sub(1))
        };
        let value = |series: &[f64]| series.get(index(series.len())).copied().unwrap_or(0.0);
        let peak = |series: &[f64]| series.iter().fold(0.0_f64, |peak, v| peak.max(v.abs()));
        let base_moves = made.settings.plant == PlantChoice::OneMass && made.settings.drive == RigDrive::Base;
        let mut largest = run.displacements.iter().map(|x| peak(x)).fold(0.0, f64::max);
        if base_moves {
            largest = largest.max(peak(&run.input));
        }
        let scale = 1.0 / largest.max(f64::MIN_POSITIVE);
        let input = value(&run.input);
        let share = |value: f64| (value * scale) as f32;
        Self {
            masses: run.displacements.iter().map(|x| share(value(x))).collect(),
            base: if base_moves { share(input) } else { 0.0 },
            force: if base_moves { 0.0 } else { (input / peak(&run.input).max(f64::MIN_POSITIVE)) as f32 },
            stuck: run.stops.iter().any(|stop| stop.from <= at && at < stop.to),
            largest,
            at,
        }
    }
}

/// Draws the rig at an instant of its record.
pub(super) fn show(ui: &mut Ui, made: &Made, at: f64) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Drawing of the rig"));
    let dark = ui.visuals().dark_mode;
    let pose = Pose::of(made, at);
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect(rect, 4.0, palette::ground(dark), Stroke::new(1.0, theme::accents(dark).line), StrokeKind::Inside);
    let pen =
        Pen { painter, line: Stroke::new(1.6, ui.visuals().text_color()), weak: ui.visuals().weak_text_color(), dark };
    rig(&pen, rect.shrink(10.0), made, &pose);
}

/// Effects that rub on something.
fn rubs(effect: &str) -> bool {
    effect.contains("friction")
}

fn rig(pen: &Pen, area: Rect, made: &Made, pose: &Pose) {
    let settings = &made.settings;
    let one = settings.plant == PlantChoice::OneMass;
    let base_moves = one && settings.drive == RigDrive::Base;
    let count = pose.masses.len();
    let last_spring = !one
        && settings.plant.parameters().iter().any(|p| {
            let last = ["k2", "k3"].get(count.wrapping_sub(2));
            last.is_some_and(|last| p.name == *last) && settings.chain_value(p) != 0.0
        });
    let floor = area.bottom() - 22.0;
    let (top, middle) = (floor - MASS - 3.0, floor - 0.5 * MASS - 3.0);
    let places = count as f32 + if last_spring { 1.0 } else { 0.35 };
    let pitch = ((area.width() - 30.0) / places).min(300.0);
    let wall = (area.center().x - 0.5 * pitch * places).max(area.left() + 12.0);
    let reach = REACH * pitch * 0.62;
    let width = (0.30 * pitch).clamp(34.0, 78.0);
    pen.ground(area.x_range(), floor);
    let effect = settings.effect.as_deref().filter(|_| one);
    let rubbing = effect.is_some_and(rubs);
    let colors = theme::accents(pen.dark);
    let rub = if pose.stuck { colors.caution } else { pen.weak };
    let mut before = wall + pose.base * reach;
    if base_moves {
        let block = Rect::from_min_max(pos2(before - 16.0, top - 6.0), pos2(before, floor - 2.0));
        pen.painter.rect(block, 2.0, Ink::Effect(0).color(pen.dark).gamma_multiply(0.35), pen.line, StrokeKind::Inside);
    } else {
        pen.wall(wall, Rangef::new(top - 6.0, floor), true);
    }
    for (k, share) in pose.masses.iter().enumerate() {
        let left = wall + pitch * (k as f32 + 1.0) - 0.5 * width - 0.2 * pitch + share * reach;
        let link = |y: f32| (pos2(before, y), pos2(left, y));
        let (from, to) = link(middle - 13.0);
        pen.spring(from, to, 8.0, pen.line);
        let (from, to) = link(middle + 13.0);
        pen.damper(from, to, 7.0, pen.line);
        let block = Rect::from_min_size(pos2(left, top), vec2(width, MASS));
        pen.mass(block, &if count > 1 { format!("m{}", k + 1) } else { "m".to_owned() });
        // Rollers where nothing rubs, a rough strip where something does.
        let chain_rubs = !one && ground_friction(made, k, count);
        if rubbing && (settings.to_ground || !base_moves) || chain_rubs {
            let strip = Rect::from_min_max(pos2(block.left(), block.bottom()), pos2(block.right(), floor));
            pen.painter.rect_filled(strip, 0.0, rub);
        } else {
            for share in [0.25, 0.75] {
                let at = pos2(block.left() + share * width, floor - 2.0);
                pen.painter.circle_stroke(at, 2.0, Stroke::new(1.0, pen.weak));
            }
        }
        if k == 0 && pose.force != 0.0 {
            let from = pos2(block.center().x, top - 9.0);
            pen.arrow(from, from + vec2(pose.force * 0.25 * pitch, 0.0), Ink::Input.color(pen.dark));
        }
        before = block.right();
    }
    if rubbing && base_moves && !settings.to_ground {
        // A pad on an arm of the base presses on the mass.
        let (arm, y) = (wall + pose.base * reach, top - 7.0);
        let right = before - 0.3 * width;
        pen.painter.line_segment([pos2(arm, y), pos2(right, y)], pen.line);
        let pad = Rect::from_min_max(pos2(right - 0.4 * width, y), pos2(right, top));
        pen.painter.rect_filled(pad, 0.0, rub);
    }
    if last_spring {
        let end = wall + pitch * places;
        pen.spring(pos2(before, middle - 13.0), pos2(end, middle - 13.0), 8.0, pen.line);
        pen.wall(end, Rangef::new(top - 6.0, floor), false);
    }
    if let Some(effect) = effect {
        stops(pen, made, effect, (before, top, pose), reach);
    }
    let words = caption(made, pose);
    let color = if pose.stuck { colors.caution } else { pen.weak };
    pen.text(pos2(area.left(), area.top() - 2.0), Align2::LEFT_TOP, &words, 12.5, color);
    let size = format!("largest displacement {}", format_si(pose.largest, settings.unit(), 3));
    pen.text(area.right_bottom(), Align2::RIGHT_BOTTOM, &size, 11.5, pen.weak);
    clock(pen, area, made, pose.at);
}

/// Friction between a mass of a chain and the ground.
fn ground_friction(made: &Made, mass: usize, count: usize) -> bool {
    let settings = &made.settings;
    let named =
        |name: &str| settings.plant.parameters().iter().any(|p| p.name == name && settings.chain_value(p) > 0.0);
    let value = |name: &str| {
        let parameter = settings.plant.parameters().iter().find(|p| p.name == name);
        parameter.map(|p| settings.chain_value(p).round())
    };
    let at_place = value("place") == Some(mass as f64 + 1.0) && value("from") == Some(0.0);
    if named("friction") && at_place {
        return true;
    }
    mass == 0 && named("F1") || mass + 1 == count && named(if count == 2 { "F2" } else { "F3" })
}

/// Side stops of a gap, where they stand.
fn stops(pen: &Pen, made: &Made, effect: &str, (right, top, pose): (f32, f32, &Pose), reach: f32) {
    let gap = made.run.effect_values.iter().find(|v| v.name == "d").map(|v| v.value);
    let Some(gap) = gap.filter(|_| matches!(effect, "clearance" | "one_sided_stop")) else { return };
    let share = pose.masses.first().copied().unwrap_or(0.0);
    let distance = (gap / pose.largest.max(f64::MIN_POSITIVE)) as f32 * reach;
    let moved = if made.settings.to_ground { 0.0 } else { pose.base * reach };
    let rest = right - share * reach + moved;
    let stop = Rect::from_min_size(pos2(rest + distance, top + 8.0), vec2(6.0, MASS - 12.0));
    let accent = Ink::Effect(0).color(pen.dark);
    pen.painter.rect_filled(stop, 1.0, accent);
    let (from, to) = (pos2(stop.right(), top + 0.5 * MASS), pos2(stop.right() + 34.0, top + 0.5 * MASS));
    pen.spring(from, to, 8.0, pen.line);
    pen.wall(to.x, Rangef::new(top, top + MASS), false);
}

fn caption(made: &Made, pose: &Pose) -> String {
    let settings = &made.settings;
    match (settings.plant, settings.effect.as_deref()) {
        (PlantChoice::OneMass, Some(effect)) => {
            let name = title(effect).unwrap_or(effect);
            format!("{name}{}", if pose.stuck { ": it sticks" } else { "" })
        }
        (PlantChoice::OneMass, None) => "spring and damper alone".to_owned(),
        (plant, _) => {
            let what = if plant == PlantChoice::Beam { "nodes of a cantilever" } else { "masses in a chain" };
            format!("{} {what}{}", pose.masses.len(), if pose.stuck { ": something sticks" } else { "" })
        }
    }
}

/// A small clock that turns once a natural period, so that slow motion is felt as such.
fn clock(pen: &Pen, area: Rect, made: &Made, at: f64) {
    let Some(frequency) = made.settings.natural_frequencies().first().copied() else { return };
    let center = pos2(area.right() - 12.0, area.top() + 10.0);
    pen.painter.circle_stroke(center, 9.0, Stroke::new(1.0, pen.weak));
    let angle = (at * frequency).fract() as f32 * 2.0 * PI;
    pen.painter.line_segment([center, center + vec2(angle.sin(), -angle.cos()) * 8.0], Stroke::new(1.5, pen.weak));
}
