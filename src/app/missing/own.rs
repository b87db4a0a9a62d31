//! Effects of a person's own: a window in which they are written down, or opened from a file, and taken into the search.

use egui::text::{CCursor, CCursorRange};
use egui::text_edit::TextEditState;
use egui::{Align2, Id, Key, Label, Modifiers, RichText, Sense, TextEdit, TextStyle, Ui, Window, vec2};

use super::act::WalkAct;
use crate::app::state::{Edit, OwnEffects};
use crate::app::theme;
use sindyscope_analysis::AnalysisError;

/// What the field holds where nothing was written yet.
pub(super) const TEMPLATE: &str = r#"# A force that the catalogue does not have. In terms, r and w are the
# displacement and velocity across its place; x, v, u, du and t are the records'.
[[effect]]
name = "magnetic_pull"
words = "A magnet pulls the harder the nearer the mass comes."
terms = ["1/(d-r)^2-1/d^2"]     # each with a coefficient that is fitted
coefficients = ["k_m"]
signs = ["positive"]            # or "negative", "either"

[effect.inner.d]                # a quantity inside the terms
bounds = [0.5, 20.0]
unit = "mm"

# A force that remembers has a state, with its rate:
# [effect.states]
# z = "w-z/tau"
"#;

/// Lines of the field that are seen at once.
const LINES: usize = 17;

/// What is being written.
#[derive(Debug)]
pub(super) struct OwnDraft {
    text: String,
    /// What the text says, or what is wrong with it.
    read: Result<OwnEffects, AnalysisError>,
}

impl OwnDraft {
    fn of(text: &str) -> Self {
        Self { text: text.to_owned(), read: OwnEffects::of_text(text) }
    }

    /// What a file holds.
    pub(super) fn of_file(text: &str) -> Self {
        Self::of(text)
    }

    fn of_walk(own: &OwnEffects) -> Self {
        Self::of(if own.text().trim().is_empty() { TEMPLATE } else { own.text() })
    }
}

/// The section of the left column: which effects are searched beside the catalogue's, and the way to them.
pub(super) fn show(ui: &mut Ui, draft: &mut Option<OwnDraft>, edit: &mut Edit, acts: &mut Vec<WalkAct>) {
    let own = &edit.walk.own;
    for effect in own.effects() {
        ui.add(Label::new(&effect.title).truncate()).on_hover_text(&effect.words);
    }
    let hint = "Write down forces that the catalogue does not have, or open a file of them: they are searched, compared and \
                reported like the others";
    if ui.button("Own effects…").on_hover_text(hint).clicked() {
        *draft = if draft.is_some() { None } else { Some(OwnDraft::of_walk(own)) };
    }
    if let Some(open) = draft
        && !window(ui, open, edit, acts)
    {
        *draft = None;
    }
}

/// Draws the window; false once it was closed.
fn window(ui: &Ui, draft: &mut OwnDraft, edit: &mut Edit, acts: &mut Vec<WalkAct>) -> bool {
    let ctx = ui.ctx();
    if !ctx.text_edit_focused() && ctx.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape)) {
        return false;
    }
    let mut open = true;
    Window::new("Own effects")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .default_pos(ctx.content_rect().left_top() + vec2(330.0, 90.0))
        .pivot(Align2::LEFT_TOP)
        .show(ctx, |ui| {
            ui.set_width(620.0);
            field(ui, draft);
            told(ui, draft, &edit.walk.own);
            ui.horizontal(|ui| buttons(ui, draft, edit, acts));
        });
    open
}

fn field(ui: &mut Ui, draft: &mut OwnDraft) {
    egui::ScrollArea::vertical().max_height(330.0).show(ui, |ui| {
        let field = TextEdit::multiline(&mut draft.text)
            .id(field_id())
            .font(TextStyle::Monospace)
            .code_editor()
            .desired_rows(LINES)
            .desired_width(f32::INFINITY);
        if ui.add(field).accessible_name("Own effects as TOML").changed() {
            draft.read = OwnEffects::of_text(&draft.text);
        }
    });
}

fn field_id() -> Id {
    Id::unique("own effects as TOML")
}

/// Puts the cursor of the field to a line and column, both from 1.
fn go_to(ui: &Ui, text: &str, line: usize, column: usize) {
    let before: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(|l| l.chars().count()).sum();
    let cursor = CCursor::new(before + column.saturating_sub(1));
    let mut state = TextEditState::load(ui.ctx(), field_id()).unwrap_or_default();
    state.cursor.set_char_range(Some(CCursorRange::one(cursor)));
    state.store(ui.ctx(), field_id());
    ui.memory_mut(|memory| memory.request_focus(field_id()));
}

/// What the text says, or where it is wrong; a click on that leads there.
fn told(ui: &mut Ui, draft: &OwnDraft, taken: &OwnEffects) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let text = match &draft.read {
        Ok(own) if own.effects().is_empty() => RichText::new("No entry: only the catalogue is searched").weak(),
        Ok(own) => {
            let titles: Vec<&str> = own.effects().iter().map(|e| e.title.as_str()).collect();
            let state = if own == taken { "searched beside the catalogue" } else { "not taken over yet" };
            RichText::new(format!("{}: {state}", titles.join(", "))).weak()
        }
        Err(AnalysisError::Effects { line, column, problem, .. }) => {
            let text = RichText::new(format!("line {line}, column {column}: {problem}")).color(colors.wrong);
            let told = ui.add(Label::new(text).wrap().sense(Sense::click()));
            if told.on_hover_text("Put the cursor there").clicked() {
                go_to(ui, &draft.text, *line, *column);
            }
            return;
        }
        Err(other) => RichText::new(other.to_string()).color(colors.wrong),
    };
    ui.add(Label::new(text).wrap());
}

fn buttons(ui: &mut Ui, draft: &mut OwnDraft, edit: &mut Edit, acts: &mut Vec<WalkAct>) {
    let ready = draft.read.as_ref().ok().filter(|own| **own != edit.walk.own).cloned();
    let take = ui.add_enabled(ready.is_some(), egui::Button::new("Take over"));
    let hint = "Search these beside the catalogue, from the base model on";
    if take.on_hover_text(hint).on_disabled_hover_text(hint).clicked()
        && let Some(own) = ready
    {
        edit.walk.take_own(own);
    }
    if ui.button("Open TOML…").on_hover_text("Put the text of a file into the field").clicked() {
        acts.push(WalkAct::OpenEffects);
    }
    let save = ui.add_enabled(draft.read.is_ok(), egui::Button::new("Save TOML…"));
    if save.on_hover_text("Save the text for `sindyscope diagnose FILE --effects OWN.toml` and for Python").clicked() {
        acts.push(WalkAct::SaveEffects(draft.text.clone()));
    }
    if ui.button("Clear").on_hover_text("Empty the field").clicked() {
        *draft = OwnDraft::of("");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_is_an_effect_and_so_is_what_it_says_of_states() {
        let own = OwnEffects::of_text(TEMPLATE).expect("an effect");
        assert_eq!(own.effects()[0].title, "Magnetic pull");
        let remembers = TEMPLATE
            .replace("# [effect.states]\n# z", "[effect.states]\nz")
            .replace("1/(d-r)^2-1/d^2", "z")
            .replace("inner.d]", "inner.tau]")
            .replace("\"mm\"", "\"s\"");
        let own = OwnEffects::of_text(&remembers).expect("an effect");
        assert_eq!(own.effects()[0].states[0].rate, "w-z/tau");
    }
}
