//! The whole record in a strip above the plots: its ends are dragged to crop it, a divider to hold its last part out.

use crate::app::plot::palette::Painted as _;
use std::sync::{Arc, Weak};

use egui::{Align2, Color32, CursorIcon, FontId, Id, Rect, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

use super::plot::palette::{self, Ink, Tint};
use super::plot::units::Scale;
use super::records::OpenRecords;
use super::theme;
use sindyscope_core::prepare::{Preparation, Treatment};
use sindyscope_report::figure::Samples;
use sindyscope_report::figure::thin::Spacing;
use sindyscope_values::record::Record;

/// Height of the strip, points.
const HEIGHT: f32 = 64.0;

/// Half the width of what can be grasped of a handle, points.
const GRASP: f32 = 7.0;

/// A cut nearer to the record's end than this share of it is none.
const NOTHING: f64 = 0.005;

/// What is dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Handle {
    From,
    To,
    Divider,
}

impl Handle {
    const ALL: [Self; 3] = [Self::From, Self::To, Self::Divider];

    fn name(self) -> &'static str {
        match self {
            Self::From => "Crop: the record begins here",
            Self::To => "Crop: the record ends here",
            Self::Divider => "Held out from here on",
        }
    }

    fn tooltip(self) -> &'static str {
        match self {
            Self::From | Self::To => "Drag to crop the record",
            Self::Divider => "Drag to hold the last part out: it is never fitted, only simulated and scored",
        }
    }
}

/// Where a record is cut, s.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cuts {
    from: f64,
    to: f64,
    /// The record's end if nothing is held out.
    divider: f64,
}

/// What the strip remembers.
#[derive(Default)]
pub(crate) struct Cutter {
    /// The record that was drawn last, and its samples.
    drawn: Option<(Weak<Record>, Samples)>,
    /// What is being dragged, and to where, s.
    dragged: Option<(Handle, f64)>,
}

impl Cutter {
    /// Draws the strip of the record shown; gives the steps once a handle was moved.
    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        data: &OpenRecords,
        steps: &[Preparation],
        shown: usize,
    ) -> Option<Vec<Preparation>> {
        let record = data.origin(shown)?;
        let channel = record.sensor(0).or_else(|| record.channels.first())?;
        let target = (data.raw.entries.len() > 1).then_some(record.name.as_str());
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
        let (start, end) = (record.start, record.start + record.duration());
        let field = rect.shrink2(vec2(GRASP + 2.0, 0.0));
        let x = |t: f64| field.left() + ((t - start) / (end - start).max(f64::MIN_POSITIVE)) as f32 * field.width();
        let t = |x: f32| start + f64::from((x - field.left()) / field.width()).clamp(0.0, 1.0) * (end - start);
        let mut cuts = Cuts::of(steps, target, (start, end));
        let mut asked = None;
        let mut hovered = None;
        for handle in Handle::ALL {
            let at = x(cuts.at(handle));
            // The divider is grasped in the upper half, the ends in the lower one: they may stand over each other.
            let rows =
                if handle == Handle::Divider { rect.top()..=rect.center().y } else { rect.center().y..=rect.bottom() };
            let place = Rect::from_x_y_ranges(at - GRASP..=at + GRASP, rows);
            let response = ui.interact(place, Id::unique(("cut", handle.name())), Sense::drag());
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Splitter, true, handle.name()));
            let response = response.on_hover_cursor(CursorIcon::ResizeHorizontal).on_hover_text(handle.tooltip());
            if response.hovered() || response.dragged() {
                hovered = Some(handle);
            }
            if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
                self.dragged = Some((handle, t(pointer.x)));
            }
            if response.drag_stopped()
                && let Some((handle, time)) = self.dragged.take()
            {
                asked = Some(cuts.moved(handle, time).steps(steps, target, (start, end), handle));
            }
        }
        if let Some((handle, time)) = self.dragged {
            cuts = cuts.moved(handle, time);
        }
        self.draw(ui, rect, record, &channel.values, &x, &cuts, hovered);
        asked.filter(|new| new != steps)
    }

    #[expect(clippy::too_many_arguments, reason = "the one place where all that the strip shows comes together")]
    fn draw(
        &mut self,
        ui: &Ui,
        rect: Rect,
        record: &Arc<Record>,
        values: &Arc<[f64]>,
        x: &dyn Fn(f64) -> f32,
        cuts: &Cuts,
        hovered: Option<Handle>,
    ) {
        let dark = ui.visuals().dark_mode;
        let colors = theme::accents(dark);
        let painter = ui.painter().with_clip_rect(rect);
        painter.rect(rect, 4.0, ui.visuals().faint_bg_color, Stroke::new(1.0, colors.line), StrokeKind::Inside);
        if self.drawn.as_ref().is_none_or(|(old, _)| !std::ptr::eq(old.as_ptr(), Arc::as_ptr(record))) {
            let spacing = Spacing { start: record.start, interval: record.interval.max(f64::MIN_POSITIVE) };
            self.drawn = Some((Arc::downgrade(record), Samples::new(Arc::clone(values), spacing)));
        }
        let (left, right) = (record.start, record.start + record.duration());
        if let Some((_, samples)) = &self.drawn {
            let (low, high) = samples.range().unwrap_or((0.0, 1.0));
            let span = (high - low).max(f64::MIN_POSITIVE);
            let y = |v: f64| rect.bottom() - 6.0 - ((v - low) / span) as f32 * (rect.height() - 12.0);
            let mut points = Vec::new();
            samples.thinned(left..=right, rect.width() as usize, &mut points);
            let line = points.iter().map(|p| pos2(x(p[0]), y(p[1]))).collect();
            painter.line(line, Stroke::new(1.0, Ink::Measured.color(dark)));
        }
        // What is held out is shaded, what is cut off is veiled.
        let stretch = |from: f32, to: f32| Rect::from_x_y_ranges(from..=to, rect.shrink(1.0).y_range());
        painter.rect_filled(stretch(x(cuts.divider), x(cuts.to)), 0.0, palette::tint(Tint::HeldOut, dark));
        let ground = palette::ground(dark);
        let veil = Color32::from_rgba_unmultiplied(ground.r(), ground.g(), ground.b(), 200);
        painter.rect_filled(stretch(rect.left() + 1.0, x(cuts.from)), 0.0, veil);
        painter.rect_filled(stretch(x(cuts.to), rect.right() - 1.0), 0.0, veil);
        for handle in Handle::ALL {
            let at = x(cuts.at(handle));
            let color = if hovered == Some(handle) { colors.accent } else { ui.visuals().weak_text_color() };
            painter.vline(at, rect.y_range().shrink(2.0), Stroke::new(1.5, color));
            let grip = match handle {
                Handle::Divider => Rect::from_center_size(pos2(at, rect.top() + 12.0), vec2(8.0, 16.0)),
                _ => Rect::from_center_size(pos2(at, rect.bottom() - 12.0), vec2(6.0, 16.0)),
            };
            painter.rect_filled(grip, 2.0, color);
        }
        let moved = self.dragged.map(|(handle, _)| handle).or(hovered);
        let scale = Scale::suited(right - left, "s");
        let text = match moved {
            Some(Handle::Divider) => format!(
                "from {}: {:.0} % held out",
                scale.format(cuts.divider, 4),
                100.0 * (cuts.to - cuts.divider) / (cuts.to - cuts.from).max(f64::MIN_POSITIVE)
            ),
            Some(_) => format!("{} … {}", scale.format(cuts.from, 4), scale.format(cuts.to, 4)),
            None => format!("{}, whole", record.name),
        };
        let galley = painter.layout_no_wrap(text, FontId::proportional(12.0), ui.visuals().text_color());
        let place = Align2::CENTER_TOP.anchor_size(pos2(rect.center().x, rect.top() + 3.0), galley.size());
        painter.rect_filled(place.expand(2.0), 2.0, veil);
        painter.galley(place.min, galley, ui.visuals().text_color());
    }
}

impl Cuts {
    fn of(steps: &[Preparation], target: Option<&str>, (start, end): (f64, f64)) -> Self {
        let (mut from, mut to, mut share) = (start, end, 0.0);
        for step in steps.iter().filter(|s| s.record.is_none() || s.record.as_deref() == target) {
            match step.treatment {
                Treatment::Crop { from: one, to: other } => {
                    from = one.unwrap_or(from).clamp(from, to);
                    to = other.unwrap_or(to).clamp(from, to);
                }
                Treatment::HoldOut { share: last } => share = last,
                _ => {}
            }
        }
        Self { from, to, divider: to - share * (to - from) }
    }

    fn at(&self, handle: Handle) -> f64 {
        match handle {
            Handle::From => self.from,
            Handle::To => self.to,
            Handle::Divider => self.divider,
        }
    }

    /// The cuts with a handle at another time; none passes another, and what is held out keeps its share of a crop.
    fn moved(self, handle: Handle, time: f64) -> Self {
        let share = self.share();
        let kept = |from: f64, to: f64| Self { from, to, divider: to - share * (to - from) };
        match handle {
            Handle::From => kept(time.min(self.to), self.to),
            Handle::To => kept(self.from, time.max(self.from)),
            Handle::Divider => Self { divider: time.clamp(self.from, self.to), ..self },
        }
    }

    /// Share that is held out.
    fn share(&self) -> f64 {
        (self.to - self.divider) / (self.to - self.from).max(f64::MIN_POSITIVE)
    }

    /// The steps with these cuts, of which one handle was moved: the crop goes before all others, what is held out behind
    /// them where there was none.
    fn steps(&self, old: &[Preparation], target: Option<&str>, whole: (f64, f64), moved: Handle) -> Vec<Preparation> {
        let mut steps = old.to_vec();
        let mine = |s: &Preparation| s.record.is_none() || s.record.as_deref() == target;
        let step = |treatment: Treatment| Preparation { treatment, record: target.map(str::to_owned) };
        if moved == Handle::Divider {
            let share = (1e4 * self.share()).round() / 1e4;
            let held = |s: &Preparation| mine(s) && matches!(s.treatment, Treatment::HoldOut { .. });
            let treatment = Treatment::HoldOut { share };
            match (steps.iter().rposition(held), share < NOTHING) {
                (Some(index), true) => drop(steps.remove(index)),
                (Some(index), false) => steps[index].treatment = treatment,
                (None, true) => {}
                (None, false) => steps.push(step(treatment)),
            }
            return steps;
        }
        // A crop of this very record alone: one for every record is not changed by cutting one.
        let own = |s: &Preparation| s.record.as_deref() == target && matches!(s.treatment, Treatment::Crop { .. });
        let margin = NOTHING * (whole.1 - whole.0);
        let from = (self.from - whole.0 > margin).then_some(rounded(self.from, whole));
        let to = (whole.1 - self.to > margin).then_some(rounded(self.to, whole));
        let treatment = Treatment::Crop { from, to };
        match (steps.iter().position(own), from.is_none() && to.is_none()) {
            (Some(index), true) => drop(steps.remove(index)),
            (Some(index), false) => steps[index].treatment = treatment,
            (None, true) => {}
            (None, false) => steps.insert(0, step(treatment)),
        }
        steps
    }
}

/// A time to four digits of the record's length: no hand is steadier.
fn rounded(time: f64, (start, end): (f64, f64)) -> f64 {
    let step = 10f64.powf(((end - start) * 1e-4).log10().floor());
    if step > 0.0 && step.is_finite() { (time / step).round() * step } else { time }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: (f64, f64) = (2.0, 12.0);

    fn held(share: f64) -> Preparation {
        Treatment::HoldOut { share }.into()
    }

    #[test]
    fn moving_the_divider_holds_out_and_moving_it_back_does_not() {
        let none = Cuts::of(&[], None, WHOLE);
        assert_eq!(none, Cuts { from: 2.0, to: 12.0, divider: 12.0 });
        let steps = none.moved(Handle::Divider, 9.0).steps(&[], None, WHOLE, Handle::Divider);
        assert_eq!(steps, [held(0.3)]);
        let cuts = Cuts::of(&steps, None, WHOLE);
        assert!((cuts.divider - 9.0).abs() < 1e-12);
        assert_eq!(cuts.moved(Handle::Divider, 7.0).steps(&steps, None, WHOLE, Handle::Divider), [held(0.5)]);
        assert!(cuts.moved(Handle::Divider, 12.0).steps(&steps, None, WHOLE, Handle::Divider).is_empty());
    }

    #[test]
    fn moving_an_end_crops_before_all_else_and_keeps_the_share() {
        let steps = [held(0.5)];
        let cuts = Cuts::of(&steps, None, WHOLE).moved(Handle::To, 10.0);
        assert_eq!(cuts.divider, 6.0);
        let cropped = cuts.steps(&steps, None, WHOLE, Handle::To);
        assert_eq!(cropped, [Treatment::Crop { from: None, to: Some(10.0) }.into(), held(0.5)]);
        let whole = Cuts::of(&cropped, None, WHOLE).moved(Handle::To, 12.0);
        assert_eq!(whole.steps(&cropped, None, WHOLE, Handle::To), steps);
    }

    #[test]
    fn of_several_records_only_the_one_shown_is_cut() {
        let every: Preparation = Treatment::Crop { from: Some(3.0), to: None }.into();
        let cuts = Cuts::of(std::slice::from_ref(&every), Some("a"), WHOLE);
        assert_eq!(cuts.from, 3.0);
        let steps = cuts.moved(Handle::From, 4.0).steps(std::slice::from_ref(&every), Some("a"), WHOLE, Handle::From);
        let own = Preparation { record: Some("a".into()), ..Treatment::Crop { from: Some(4.0), to: None }.into() };
        assert_eq!(steps, [own, every]);
    }
}
