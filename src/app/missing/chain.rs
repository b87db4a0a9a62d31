//! The masses as one would sketch them: springs and dampers to the ground, to the base and between neighbours, each of
//! them a place where an effect may act and which can be picked.

use crate::app::plot::palette::Painted as _;
use egui::{Align2, Color32, FontId, Rect, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

use super::subject::{WalkSubject, site_name};
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::sketch::Pen;
use crate::app::theme;
use sindyscope_search::Site;
use sindyscope_values::format::words::capitalised;
use sindyscope_values::term::Symbol;

/// Height of a mass, points.
const MASS: f32 = 34.0;
/// Length of a spring to the ground or to the base, points.
const LINK: f32 = 38.0;
/// Height of the hatching of the ground, points.
const EDGE: f32 = 9.0;
/// Height of the base, points.
const BASE: f32 = 16.0;
/// Room for the arrow of a force, points.
const ARROW: f32 = 16.0;
/// Widest mass, points.
const WIDEST: f32 = 60.0;

/// What is shown of each place.
pub(super) struct Chain<'a> {
    pub(super) subject: &'a WalkSubject,
    /// The mass that the force acts on, if there is one.
    pub(super) force: Option<usize>,
    /// The place whose candidates are shown alone.
    pub(super) picked: Option<Site>,
    /// Where the candidate that is looked at acts.
    pub(super) looked_at: Option<Site>,
    /// Effects that were added, with their colours.
    pub(super) added: &'a [(Site, Color32)],
    /// What is known of a place, beneath its name.
    pub(super) known: &'a dyn Fn(Site) -> String,
}

/// Draws the chain; the place that was clicked.
pub(super) fn show(ui: &mut Ui, chain: &Chain<'_>) -> Option<Site> {
    let masses = chain.subject.masses();
    let above = if chain.subject.base_moves { BASE + LINK } else { ARROW };
    let size = vec2(ui.available_width(), above + MASS + LINK + EDGE + 4.0);
    let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
    let dark = ui.visuals().dark_mode;
    let pitch = rect.width() / masses as f32;
    let width = if masses == 1 { WIDEST } else { (0.44 * pitch).min(WIDEST) };
    let top = rect.top() + above;
    let mass = |k: usize| {
        let centre = rect.left() + pitch * (k as f32 + 0.5);
        Rect::from_min_size(pos2(centre - 0.5 * width, top), vec2(width, MASS))
    };
    let link = |site: Site| match site {
        Site::Ground(k) => {
            let block = mass(k);
            Rect::from_min_max(block.left_bottom(), pos2(block.right(), block.bottom() + LINK))
        }
        Site::Base(k) => {
            let block = mass(k);
            Rect::from_min_max(pos2(block.left(), block.top() - LINK), block.right_top())
        }
        Site::Joint(i, j) => Rect::from_min_max(mass(i).right_top(), mass(j).left_bottom()),
    };
    let colors = theme::accents(dark);
    let (line, weak) = (Stroke::new(1.4, ui.visuals().text_color()), ui.visuals().weak_text_color());
    let painter = ui.painter().clone();
    let pen = Pen { painter: painter.clone(), line, weak, dark };
    pen.ground(rect.x_range(), mass(0).bottom() + LINK);
    let input = chain.subject.layout.name(Symbol::Input(0));
    if chain.subject.base_moves {
        let plate = Rect::from_min_size(rect.min, vec2(rect.width(), BASE));
        let fill = Ink::Input.color(dark).gamma_multiply(0.35);
        painter.rect(plate, 2.0, fill, line, StrokeKind::Inside);
        painter.text(
            plate.center(),
            Align2::CENTER_CENTER,
            format!("⟷ {input}"),
            FontId::proportional(12.0),
            line.color,
        );
    }
    let mut clicked = None;
    for site in chain.subject.sites() {
        let area = link(site);
        let name = site_name(site, masses);
        let id = ui.scope_id().with(("place", site));
        let response = ui.interact(area.expand2(vec2(1.0, -1.0)), id, Sense::click());
        let on = chain.picked == Some(site);
        response.widget_info(|| WidgetInfo::selected(egui::Role::Button, true, on, format!("Place {name}")));
        if on {
            painter.rect(area, 4.0, colors.accent_ground, Stroke::new(1.5, colors.accent), StrokeKind::Inside);
        } else if response.hovered() || response.has_focus() {
            let fill = ui.visuals().widgets.hovered.weak_bg_fill;
            painter.rect(area, 4.0, fill, Stroke::new(1.0, colors.accent), StrokeKind::Inside);
        }
        let looked_at = chain.looked_at == Some(site);
        elements(&pen, site, area, if looked_at { Stroke::new(2.0, colors.accent) } else { line });
        let here: Vec<Color32> = chain.added.iter().filter(|(s, _)| *s == site).map(|(_, color)| *color).collect();
        for (k, color) in here.iter().enumerate() {
            let shift = 9.0 * (k as f32 - 0.5 * (here.len() - 1) as f32);
            painter.circle(area.center() + vec2(shift, 0.0), 4.5, *color, Stroke::new(1.0, palette::ground(dark)));
        }
        let known = (chain.known)(site);
        let hint = capitalised(&name) + if known.is_empty() { "" } else { "\n" } + &known;
        if response.on_hover_text(hint).clicked() {
            clicked = Some(site);
        }
    }
    for k in 0..masses {
        let block = mass(k);
        pen.mass(block, &if masses > 1 { format!("m{}", k + 1) } else { "m".to_owned() });
        if chain.force == Some(k) && !chain.subject.base_moves {
            let tip = block.center_top() - vec2(0.0, 8.0);
            pen.arrow(tip - vec2(30.0, 0.0), tip, Ink::Input.color(dark));
            let at = tip + vec2(5.0, 0.0);
            painter.text(at, Align2::LEFT_CENTER, &input, FontId::proportional(12.0), Ink::Input.color(dark));
        }
    }
    clicked
}

/// A spring and a damper beside each other, along a place.
fn elements(pen: &Pen, site: Site, area: Rect, stroke: Stroke) {
    let along = !matches!(site, Site::Joint(..));
    let line = |share: f32| {
        if along {
            let x = area.left() + share * area.width();
            (pos2(x, area.top()), pos2(x, area.bottom()))
        } else {
            let y = area.top() + share * area.height();
            (pos2(area.left(), y), pos2(area.right(), y))
        }
    };
    let (from, to) = line(0.27);
    pen.spring(from, to, 4.5, stroke);
    let (from, to) = line(0.75);
    pen.damper(from, to, 4.5, stroke);
}
