//! What the pointer does in every plot.

use egui::{PopupAnchor, Response, Tooltip, Vec2, Vec2b, vec2};
use egui_plot::PlotUi;

/// The wheel zooms the horizontal axis about the pointer, sideways it moves; values stay fitted if they were.
pub(crate) fn wheel(plot: &mut PlotUi<'_>) {
    let scroll = plot.ctx().input(|i| i.smooth_scroll_delta);
    if scroll == Vec2::ZERO || !plot.response().contains_pointer() {
        return;
    }
    let auto_y = plot.auto_bounds().y;
    if scroll.y != 0.0 {
        plot.zoom_bounds_around_hovered(vec2((scroll.y / 240.0).exp(), 1.0));
    }
    if scroll.x != 0.0 {
        let per_point = 1.0 / plot.transform().dpos_dvalue_x();
        plot.translate_bounds(vec2(-scroll.x * per_point as f32, 0.0));
    }
    plot.set_auto_bounds(Vec2b::new(false, auto_y));
}

/// What is known of the place under the pointer, beside it.
pub(crate) fn tooltip(plot: &Response) -> Tooltip<'_> {
    Tooltip::always_open(plot.ctx.clone(), plot.layer_id, plot.id, PopupAnchor::Pointer).gap(14.0)
}
