//! Masses, springs and dampers as one sketches them.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rangef, Rect, Shape, Stroke, StrokeKind, pos2, vec2};

use super::palette::{Ink, Painted as _};

/// Share of a spring's length that is straight at either end.
const STRAIGHT: f32 = 0.15;
/// Length of a spring for each of its coils, points; their number is odd.
const COIL: f32 = 14.0;
/// Longest cup of a damper, points.
const CUP: f32 = 26.0;
/// Length of the hatching of a wall or the ground, and its distance, points.
const HATCH: f32 = 6.0;
const APART: f32 = 9.0;

/// Draws the parts of a sketch.
pub(crate) struct Pen {
    /// Where it draws.
    pub(crate) painter: Painter,
    /// The line of all that is solid.
    pub(crate) line: Stroke,
    /// The colour of what stays behind.
    pub(crate) weak: Color32,
    /// The theme.
    pub(crate) dark: bool,
}

impl Pen {
    /// A text.
    pub(crate) fn text(&self, at: Pos2, anchor: Align2, text: &str, size: f32, color: Color32) {
        self.painter.text(at, anchor, text, FontId::proportional(size), color);
    }

    /// A mass with its name.
    pub(crate) fn mass(&self, block: Rect, name: &str) {
        let fill = Ink::Measured.color(self.dark).gamma_multiply(0.45);
        self.painter.rect(block, 3.0, fill, self.line, StrokeKind::Inside);
        self.text(block.center(), Align2::CENTER_CENTER, name, 0.2 * block.height() + 5.5, self.line.color);
    }

    /// A spring between two points, its coils reaching so far to either side.
    pub(crate) fn spring(&self, from: Pos2, to: Pos2, reach: f32, line: Stroke) {
        let along = to - from;
        let side = along.normalized().rot90() * reach;
        let coils = 2 * (along.length() / (2.0 * COIL)).round().clamp(2.0, 4.0) as usize + 1;
        let mut points = vec![from, from + STRAIGHT * along];
        for k in 0..coils {
            let share = STRAIGHT + (1.0 - 2.0 * STRAIGHT) * (k as f32 + 0.5) / coils as f32;
            points.push(from + share * along + if k % 2 == 0 { -side } else { side });
        }
        points.extend([from + (1.0 - STRAIGHT) * along, to]);
        self.painter.add(Shape::line(points, line));
    }

    /// A damper between two points: a cup that is open towards the second, and the piston that moves in it.
    pub(crate) fn damper(&self, from: Pos2, to: Pos2, reach: f32, line: Stroke) {
        let along = to - from;
        let (length, direction) = (along.length(), along.normalized());
        let side = direction.rot90() * reach;
        let bottom = from + 0.35 * along;
        let cup = CUP.min(0.38 * length);
        let (rim, piston) = (bottom + cup * direction, bottom + 0.57 * cup * direction);
        self.painter.line_segment([from, bottom], line);
        self.painter.add(Shape::line(vec![rim + side, bottom + side, bottom - side, rim - side], line));
        self.painter.line_segment([piston + 0.7 * side, piston - 0.7 * side], line);
        self.painter.line_segment([piston, to], line);
    }

    /// The ground, from one end to the other.
    pub(crate) fn ground(&self, ends: Rangef, y: f32) {
        self.painter.hline(ends, y, self.line);
        let mut x = ends.min + 7.0;
        while x <= ends.max {
            self.painter.line_segment([pos2(x, y), pos2(x - HATCH, y + HATCH)], Stroke::new(1.0, self.weak));
            x += APART;
        }
    }

    /// A wall that is hatched on its left or on its right.
    pub(crate) fn wall(&self, x: f32, ends: Rangef, left: bool) {
        self.painter.vline(x, ends, self.line);
        let turn = if left { 1.0 } else { -1.0 };
        let mut y = ends.min + 4.0;
        while y <= ends.max {
            let end = pos2(x - turn * HATCH, y + turn * HATCH);
            self.painter.line_segment([pos2(x, y), end], Stroke::new(1.0, self.weak));
            y += APART;
        }
    }

    /// A level arrow; none where it would be but a head.
    pub(crate) fn arrow(&self, from: Pos2, tip: Pos2, color: Color32) {
        let length = tip.x - from.x;
        if length.abs() < 2.0 {
            return;
        }
        self.painter.line_segment([from, tip], Stroke::new(2.2, color));
        let back = 6.0 * length.signum();
        let head = vec![tip, tip - vec2(back, 4.0), tip - vec2(back, -4.0)];
        self.painter.add(Shape::convex_polygon(head, color, Stroke::NONE));
    }
}
