//! Ctrl+K: every command by its name.

use egui::{Align2, Context, Key, Modifiers, RichText, ScrollArea, Window, vec2};

use super::commands::WindowCommand;

/// The palette while it is open.
#[derive(Debug, Default)]
pub(crate) struct Palette {
    text: String,
    chosen: usize,
    shown: bool,
}

/// What became of the palette in this frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PaletteOutcome {
    Open,
    Closed,
    Chosen(WindowCommand),
}

impl Palette {
    /// Draws the palette; it closes when a command is chosen, at Escape and at a click elsewhere.
    pub(crate) fn show(&mut self, ctx: &Context) -> PaletteOutcome {
        let found = matches(&self.text);
        let key = |key| ctx.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        if key(Key::Escape) {
            return PaletteOutcome::Closed;
        }
        if key(Key::ArrowDown) {
            self.chosen += 1;
        }
        if key(Key::ArrowUp) {
            self.chosen = self.chosen.saturating_sub(1);
        }
        self.chosen = self.chosen.min(found.len().saturating_sub(1));
        if key(Key::Enter) {
            return found.get(self.chosen).map_or(PaletteOutcome::Closed, |c| PaletteOutcome::Chosen(*c));
        }
        let mut outcome = PaletteOutcome::Open;
        let window = Window::new("All commands")
            .title_bar(false)
            .resizable(false)
            .anchor(Align2::CENTER_TOP, vec2(0.0, 64.0))
            .fixed_size(vec2(460.0, 320.0))
            .show(ctx, |ui| {
                let field =
                    egui::TextEdit::singleline(&mut self.text).hint_text("Find a command").desired_width(f32::INFINITY);
                let response = ui.add(field).accessible_name("Find a command");
                if !self.shown {
                    response.request_focus();
                    self.shown = true;
                }
                if response.changed() {
                    self.chosen = 0;
                }
                ui.add_space(4.0);
                ScrollArea::vertical().max_height(280.0).auto_shrink([false, false]).show(ui, |ui| {
                    for (index, command) in found.iter().enumerate() {
                        let spec = command.spec();
                        let mut button = egui::Button::selectable(index == self.chosen, spec.label)
                            .min_size(vec2(ui.available_width(), 0.0));
                        if let Some(key) = &spec.key {
                            button = button.shortcut_text(ctx.format_shortcut(key));
                        }
                        if ui.add(button).on_hover_text(spec.tooltip).clicked() {
                            outcome = PaletteOutcome::Chosen(*command);
                        }
                    }
                    if found.is_empty() {
                        ui.label(RichText::new("No command of that name").weak());
                    }
                });
            });
        if outcome == PaletteOutcome::Open && window.is_some_and(|w| w.response.clicked_elsewhere()) && self.shown {
            outcome = PaletteOutcome::Closed;
        }
        outcome
    }
}

/// The commands whose name holds every word typed, those that begin with it first.
fn matches(text: &str) -> Vec<WindowCommand> {
    let text = text.trim().to_lowercase();
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut found: Vec<(bool, WindowCommand)> = WindowCommand::all()
        .into_iter()
        .filter(|c| *c != WindowCommand::Palette)
        .filter_map(|c| {
            let spec = c.spec();
            let name = format!("{} {}", spec.label, spec.tooltip).to_lowercase();
            let label = spec.label.to_lowercase();
            words.iter().all(|w| name.contains(w)).then(|| (!label.starts_with(&text), c))
        })
        .collect();
    found.sort_by_key(|(later, _)| *later);
    found.into_iter().map(|(_, c)| c).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_found_by_its_beginning_first() {
        assert_eq!(matches("save proj")[0], WindowCommand::SaveProject);
        assert_eq!(matches("copy latex")[0], WindowCommand::CopyLatex);
        assert_eq!(matches("latex").len(), 2);
        assert!(matches("no such thing").is_empty());
        assert!(matches("").len() > 15);
    }
}
