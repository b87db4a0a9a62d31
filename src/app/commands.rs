//! Everything that can be done: buttons, menus, keys, help and the palette all come from this one list.

use egui::{Key, KeyboardShortcut, Modifiers, Ui};
use serde::{Deserialize, Serialize};

use super::state::{Room, Sample};
use super::views::View;

/// Something that a person can ask for by button, menu, key or name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum WindowCommand {
    Open,
    OpenPath,
    AddRecords,
    Columns,
    Stream,
    Series,
    Sample(Sample),
    Demonstration,
    Lessons,
    Close,
    SaveProject,
    SaveProjectAs,
    ExportModel,
    SaveReport,
    Undo,
    Redo,
    Choose,
    Reset,
    PlotPicture,
    WindowPicture,
    CopyText,
    CopyLatex,
    CopyPython,
    CopyJson,
    View(View),
    Room(Room),
    FitView,
    Theme,
    LargerText,
    Messages,
    SaveLog,
    Palette,
    Help,
    Quit,
}

/// How a command is shown.
#[derive(Clone, Debug)]
pub(crate) struct Spec {
    /// What its button or menu entry says.
    pub(crate) label: &'static str,
    /// What it does, in one sentence.
    pub(crate) tooltip: &'static str,
    /// Its key.
    pub(crate) key: Option<KeyboardShortcut>,
    /// The heading that it stands under in the help.
    pub(crate) group: &'static str,
}

const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

/// The commands that are one each, in the order of the help: group, label, tooltip and key.
const TABLE: [CommandRow; 31] = [
    (
        WindowCommand::Open,
        "Files",
        "Open…",
        "Open measurements (CSV, MATLAB, TDMS, …) or a saved project; several files become several records",
        Some((CTRL, Key::O)),
    ),
    (WindowCommand::OpenPath, "Files", "Open a path…", "Type or paste the path of a file", Some((CTRL_SHIFT, Key::O))),
    (
        WindowCommand::AddRecords,
        "Files",
        "Add records…",
        "Open further measurements beside those that are open, as more records of the same study",
        None,
    ),
    (
        WindowCommand::Columns,
        "Files",
        "Columns…",
        "Show what the files hold, and say which column is the time, a displacement, a force, …",
        None,
    ),
    (
        WindowCommand::Stream,
        "Files",
        "Open a stream…",
        "Follow a growing file, a serial line or UDP: its last seconds are identified as they come, with an alarm when they change",
        None,
    ),
    (
        WindowCommand::Series,
        "Files",
        "Open a series…",
        "Open the table that `sindyscope batch` wrote: parameters over amplitude, temperature or time, and the records that do not fit",
        None,
    ),
    (
        WindowCommand::Demonstration,
        "Files",
        "Demonstration: a hidden effect",
        "The virtual rig hides an effect that it draws blind; find it in “What's missing”, then reveal the truth",
        None,
    ),
    (
        WindowCommand::Lessons,
        "Help",
        "Lessons…",
        "Short lessons on real controls, from smoothing to chaos; each notices what you do",
        None,
    ),
    (WindowCommand::Close, "Files", "Close", "Close what is open; it comes back as it was left", Some((CTRL, Key::W))),
    (
        WindowCommand::SaveProject,
        "Files",
        "Save project",
        "Save which files are open, how they are used, all settings, the walk and the views, as one text file",
        Some((CTRL, Key::S)),
    ),
    (
        WindowCommand::SaveProjectAs,
        "Files",
        "Save project as…",
        "Save the project under another name",
        Some((CTRL_SHIFT, Key::S)),
    ),
    (
        WindowCommand::ExportModel,
        "Files",
        "Export model…",
        "Save the equations to take along: LaTeX, text, JSON, or a program in Python, MATLAB, Modelica or C",
        None,
    ),
    (
        WindowCommand::SaveReport,
        "Files",
        "Save report…",
        "Save the report as PDF or as a web page, with the sections that were chosen in the room Report",
        Some((CTRL, Key::P)),
    ),
    (
        WindowCommand::PlotPicture,
        "Pictures",
        "Save figure…",
        "Save the view in the centre for a paper or a slide: SVG, PDF or PNG, at the size and with the letters you choose",
        Some((CTRL, Key::E)),
    ),
    (
        WindowCommand::WindowPicture,
        "Pictures",
        "Save picture of the window…",
        "Save the whole window as a PNG, as it is on the screen",
        Some((CTRL_SHIFT, Key::E)),
    ),
    (WindowCommand::Undo, "Settings", "Undo", "Take back the last change of settings", Some((CTRL, Key::Z))),
    (WindowCommand::Redo, "Settings", "Redo", "Take the change again", Some((CTRL_SHIFT, Key::Z))),
    (
        WindowCommand::Choose,
        "Settings",
        "Choose for me",
        "Find segment length, order and threshold by the simulation error on stretches that were not fitted",
        Some((CTRL, Key::R)),
    ),
    (
        WindowCommand::Reset,
        "Settings",
        "Reset settings",
        "Go back to the settings that the program chose for these records",
        None,
    ),
    (
        WindowCommand::CopyText,
        "Equation",
        "Copy as text",
        "Copy the equations as plain text",
        Some((CTRL_SHIFT, Key::C)),
    ),
    (WindowCommand::CopyLatex, "Equation", "Copy as LaTeX", "Copy the equations as LaTeX, for a paper", None),
    (
        WindowCommand::CopyPython,
        "Equation",
        "Copy as Python",
        "Copy the equations as a Python function that SciPy can integrate",
        None,
    ),
    (WindowCommand::CopyJson, "Equation", "Copy as JSON", "Copy terms, coefficients and standard errors as JSON", None),
    (
        WindowCommand::FitView,
        "View",
        "Show all data",
        "Undo zoom and pan in every plot",
        Some((Modifiers::NONE, Key::Home)),
    ),
    (
        WindowCommand::Theme,
        "View",
        "Light or dark",
        "Switch between the light and the dark theme",
        Some((CTRL, Key::L)),
    ),
    (
        WindowCommand::LargerText,
        "View",
        "Larger text",
        "Everything a quarter larger, half as large again, or as it was; Ctrl with + and − goes in small steps",
        None,
    ),
    (WindowCommand::Messages, "Help", "Messages", "Read again what the program said", None),
    (
        WindowCommand::SaveLog,
        "Help",
        "Save the log of this session…",
        "Save what was done since the window was opened: `sindyscope --replay FILE` does it again, for a bug report",
        None,
    ),
    (WindowCommand::Palette, "Help", "All commands…", "Find a command by its name", Some((CTRL, Key::K))),
    (WindowCommand::Help, "Help", "Help", "Keys, mouse and how to read the window", Some((Modifiers::NONE, Key::F1))),
    (WindowCommand::Quit, "Files", "Quit", "Close the window; everything is remembered", Some((CTRL, Key::Q))),
];

/// A command with its group, label, tooltip and key.
type CommandRow = (WindowCommand, &'static str, &'static str, &'static str, Option<(Modifiers, Key)>);

impl WindowCommand {
    /// Every command, in the order of the help.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for (command, ..) in TABLE {
            match command {
                Self::Demonstration => all.extend(Sample::all().map(Self::Sample)),
                Self::FitView => {
                    all.extend(Room::ALL.map(Self::Room));
                    all.extend(View::ALL.map(Self::View));
                }
                _ => {}
            }
            all.push(command);
        }
        all.retain(|command| command.is_offered());
        all
    }

    /// False for what a web page has no use for: paths, and an end.
    fn is_offered(self) -> bool {
        !(cfg!(target_arch = "wasm32") && matches!(self, Self::OpenPath | Self::Quit))
    }

    /// How the command is shown.
    pub(crate) fn spec(self) -> Spec {
        let (group, label, tooltip, key) = match self {
            Self::Sample(sample) => ("Files", sample.label(), sample.tooltip(), None),
            Self::View(view) => ("View", view.label(), view.tooltip(), Some(view_key(view))),
            Self::Room(room) => {
                let index = Room::ALL.iter().position(|r| *r == room).unwrap_or(0);
                ("View", room.label(), room.tooltip(), Some((Modifiers::NONE, number_key(index))))
            }
            // A test holds that every other command stands in the table.
            command => TABLE.into_iter().find(|row| row.0 == command).map_or(("", "", "", None), |row| {
                let (_, group, label, tooltip, key) = row;
                (group, label, tooltip, key)
            }),
        };
        let key = key.map(|(modifiers, key)| KeyboardShortcut::new(modifiers, key));
        Spec { label, tooltip, key, group }
    }

    /// The tooltip with the key behind it.
    pub(crate) fn hint(self, ctx: &egui::Context) -> String {
        let spec = self.spec();
        match spec.key {
            Some(key) => format!("{} ({})", spec.tooltip, ctx.format_shortcut(&key)),
            None => spec.tooltip.to_owned(),
        }
    }

    /// True if the command's key belongs to a text field while one is being typed in.
    fn yields_to_typing(self) -> bool {
        match self {
            Self::Undo | Self::Redo => true,
            _ => self.spec().key.is_some_and(|k| k.modifiers.is_none() && k.logical_key != Key::F1),
        }
    }

    /// The commands whose keys were pressed.
    pub(crate) fn pressed(ctx: &egui::Context) -> Vec<Self> {
        // An open list or menu keeps single keys to itself, as a field does.
        let typing = ctx.text_edit_focused() || egui::Popup::is_any_open(ctx);
        let mut keyed: Vec<(Self, KeyboardShortcut)> =
            Self::all().into_iter().filter_map(|c| c.spec().key.map(|key| (c, key))).collect();
        // A shortcut matches with extra modifiers too: the ones with more go first.
        keyed.sort_by_key(|(_, key)| !(key.modifiers.shift || key.modifiers.alt));
        let mut pressed = Vec::new();
        for (command, key) in keyed {
            if !(typing && command.yields_to_typing()) && ctx.input_mut(|i| i.consume_shortcut(&key)) {
                pressed.push(command);
            }
        }
        let redo = KeyboardShortcut::new(CTRL, Key::Y);
        if !typing && ctx.input_mut(|i| i.consume_shortcut(&redo)) {
            pressed.push(Self::Redo);
        }
        pressed
    }

    /// An entry of a menu; true if it was clicked.
    pub(crate) fn menu(self, ui: &mut Ui, enabled: bool) -> bool {
        if !self.is_offered() {
            return false;
        }
        let spec = self.spec();
        let mut button = egui::Button::new(spec.label);
        if let Some(key) = &spec.key {
            button = button.shortcut_text(ui.ctx().format_shortcut(key));
        }
        ui.add_enabled(enabled, button).on_hover_text(spec.tooltip).clicked()
    }

    /// Entries of a menu that open the classics.
    pub(crate) fn classics(ui: &mut Ui) -> Option<Self> {
        ui.set_min_width(200.0);
        Sample::CLASSICS.map(Self::Sample).into_iter().find(|command| command.menu(ui, true))
    }
}

/// What the menu of the classics holds.
pub(crate) const CLASSICS_HINT: &str =
    "Oscillators that courses begin with, with the figures of their sources, recorded by the virtual rig";

/// Ctrl with a number for the first nine views, Alt with a number for those behind them.
fn view_key(view: View) -> (Modifiers, Key) {
    let index = View::ALL.iter().position(|v| *v == view).unwrap_or(0);
    if index < 9 { (CTRL, number_key(index)) } else { (Modifiers::ALT, number_key(index - 9)) }
}

fn number_key(index: usize) -> Key {
    const KEYS: [Key; 9] =
        [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9];
    KEYS[index.min(KEYS.len() - 1)]
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn no_two_commands_share_a_key_or_a_name() {
        let (mut keys, mut labels) = (HashSet::new(), HashSet::new());
        for command in WindowCommand::all() {
            let spec = command.spec();
            assert!(labels.insert(spec.label), "{command:?}: {}", spec.label);
            if let Some(key) = spec.key {
                assert!(keys.insert(format!("{key:?}")), "{command:?}: {key:?}");
            }
            assert!(!spec.tooltip.ends_with('.'), "{command:?}: one sentence without a full stop");
        }
    }
}
