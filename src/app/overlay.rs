//! What lies over the window for a moment: the drop zone, and the field for a path.

use egui::{Align2, Color32, Context, FontId, Id, Key, LayerId, Order, Stroke, StrokeKind, Window, vec2};

use super::dialogs::{Chosen, Dialogs, PathField};
use super::theme;

/// What the field for a path is called, and what it says while it is empty: in a browser a file has no more than a name.
const FIELD: (&str, &str) =
    if cfg!(target_arch = "wasm32") { ("Name", "name of the file") } else { ("Path", "path of the file") };

/// Covers the window while a file is held over it.
pub(crate) fn drop_zone(ctx: &Context) {
    let held = ctx.input(|i| i.raw.hovered_files.len());
    if held == 0 {
        return;
    }
    let dark = ctx.theme() == egui::Theme::Dark;
    let colors = theme::accents(dark);
    let painter = ctx.layer_painter(LayerId::new(Order::Foreground, Id::unique("drop zone")));
    let rect = ctx.content_rect();
    let veil = if dark { Color32::from_black_alpha(190) } else { Color32::from_white_alpha(215) };
    painter.rect_filled(rect, 0.0, veil);
    painter.rect_stroke(rect.shrink(18.0), 12.0, Stroke::new(2.0, colors.accent), StrokeKind::Inside);
    let text = if held == 1 { "Drop to open".to_owned() } else { format!("Drop to open {held} files as records") };
    painter.text(rect.center(), Align2::CENTER_CENTER, text, FontId::proportional(26.0), colors.accent);
}

/// The field in which a path is typed; gives what was typed once it is sent off.
pub(crate) fn path_field(ctx: &Context, dialogs: &mut Dialogs) -> Option<Chosen> {
    let field = dialogs.field.as_mut()?;
    let (mut sent, mut closed) = (false, ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, Key::Escape)));
    Window::new(field.purpose.title())
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_TOP, vec2(0.0, 64.0))
        .show(ctx, |ui| {
            ui.set_width(560.0);
            if !field.reason.is_empty() {
                ui.weak(format!("{}: type or paste a path", field.reason));
            }
            ui.horizontal(|ui| {
                let edit = egui::TextEdit::singleline(&mut field.text).hint_text(FIELD.1).desired_width(420.0);
                let response = ui.add(edit).accessible_name(FIELD.0);
                if field.fresh {
                    response.request_focus();
                    field.fresh = false;
                }
                sent = response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
                let ready = !field.text.trim().is_empty();
                let verb = if asked(field) { "Replace" } else { field.purpose.verb() };
                sent |= ui.add_enabled(ready, egui::Button::new(verb)).clicked();
                sent &= ready;
                closed |= ui.button("Cancel").clicked();
            });
            if asked(field) {
                let color = theme::accents(ui.visuals().dark_mode).caution;
                ui.colored_label(color, "This file is there already: replace it, or type another name");
            }
        });
    if !sent && !closed {
        return None;
    }
    let field = dialogs.field.take()?;
    // A path dragged from a file manager or a terminal may come in quotes.
    let path = field.text.trim().trim_matches(['"', '\'']).to_owned();
    sent.then(|| Chosen { purpose: field.purpose, paths: vec![path.into()], asked: field.replaces })
}

/// True if the path that stands there is the one that was asked about.
fn asked(field: &PathField) -> bool {
    field.replaces.as_ref().is_some_and(|path| path.as_os_str() == field.text.trim())
}
