//! The columns of a file: what it holds, what each column is used for, and what would be read, live.
//!
//! The window is not modal; files are looked into and read in the background.

mod draft;
mod list;
mod preview;

use std::path::{Path, PathBuf};

use egui::{Align2, Context, Key, Label, Margin, Panel, RichText, TextEdit, Ui, Window, vec2};

use serde::{Deserialize, Serialize};

use super::plot::painter::Plots;
use super::problem::{OpeningProblem, file_name};
use super::theme::{self, ROW};
use super::widgets::chip;
use draft::Draft;
pub(crate) use preview::Preview;
use sindyscope_core::study::Cancel;
use sindyscope_files::{ColumnUse, MeasuredFile, Overview, ReadOptions, TableOverview, read_opened};
use sindyscope_values::format::number::significant_trimmed;

/// What is to be read for the window of columns.
#[derive(Debug, PartialEq)]
pub(crate) enum WantedColumns {
    /// What the file holds.
    Overview { path: PathBuf, reading: ReadOptions },
    /// What would be read of it.
    Preview { path: PathBuf, reading: ReadOptions },
}

/// What a person does in the window of columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum ColumnsAct {
    /// Use the columns so; nothing is read anew yet.
    Choose(Draft),
    /// Read the files like this.
    Read(ReadOptions),
    /// Close the window.
    Close,
}

/// The window of columns.
#[derive(Default)]
pub(crate) struct Columns {
    open: Option<Open>,
}

/// The files whose columns are shown.
struct Open {
    /// They are read alike; the first one is looked into.
    paths: Vec<PathBuf>,
    /// How they were to be read before.
    reading: ReadOptions,
    overview: Option<Result<Overview, OpeningProblem>>,
    draft: Draft,
    preview: Option<Result<Preview, OpeningProblem>>,
    /// What the preview was asked with.
    asked: Option<ReadOptions>,
}

impl Columns {
    /// Shows the columns of files that are read alike, once the first of them was looked into.
    pub(crate) fn open(&mut self, paths: Vec<PathBuf>, reading: &ReadOptions) -> Option<WantedColumns> {
        let wanted = paths.first().map(|path| WantedColumns::Overview { path: path.clone(), reading: reading.clone() });
        self.open = Some(Open {
            paths,
            reading: reading.clone(),
            overview: None,
            draft: Draft { rate: reading.rate.map_or(String::new(), |r| r.to_string()), ..Draft::default() },
            preview: None,
            asked: None,
        });
        wanted
    }

    /// Takes over what a person has chosen so far.
    pub(crate) fn choose(&mut self, draft: Draft) {
        if let Some(open) = &mut self.open {
            open.draft = draft;
        }
    }

    /// Closes the window.
    pub(crate) fn close(&mut self) {
        self.open = None;
    }

    /// Takes in what the file holds.
    pub(crate) fn looked(&mut self, overview: Result<Overview, OpeningProblem>) {
        let Some(open) = &mut self.open else { return };
        if let Ok(overview) = &overview {
            open.draft.table = overview.main();
            open.draft.uses = overview.tables[open.draft.table].proposed();
        }
        open.overview = Some(overview);
    }

    /// Takes in what would be read.
    pub(crate) fn previewed(&mut self, preview: Result<Preview, OpeningProblem>) {
        if let Some(open) = &mut self.open {
            open.preview = Some(preview);
        }
    }

    /// What would be read with the columns chosen, if it is not known.
    pub(crate) fn wanted(&mut self) -> Option<WantedColumns> {
        let open = self.open.as_mut()?;
        let options = open.draft.options(open.table()?, &open.reading);
        let reading = options.ok().filter(|options| open.asked.as_ref() != Some(options))?;
        open.asked = Some(reading.clone());
        Some(WantedColumns::Preview { path: open.paths.first()?.clone(), reading })
    }

    /// Draws the window; `plots` is what its drawing remembers.
    pub(crate) fn show(&self, ctx: &Context, plots: &mut Plots) -> Option<ColumnsAct> {
        let open = self.open.as_ref()?;
        let mut draft = open.draft.clone();
        let mut stays = true;
        let mut asked = None;
        let screen = ctx.content_rect().size();
        let title = match open.paths.as_slice() {
            [] => "Columns".to_owned(),
            [one] => format!("Columns of {}", file_name(one)),
            [one, rest @ ..] => format!("Columns of {} and {} more", file_name(one), rest.len()),
        };
        Window::new(title)
            .id(egui::Id::unique("columns"))
            .open(&mut stays)
            .collapsible(false)
            .default_size(vec2((screen.x - 80.0).min(820.0), (screen.y - 120.0).min(640.0)))
            .min_size(vec2(480.0, 320.0))
            .max_size(screen - vec2(24.0, 24.0))
            .pivot(Align2::CENTER_CENTER)
            .default_pos(ctx.content_rect().center())
            .show(ctx, |ui| asked = body(ui, open, &mut draft, plots));
        let typing = ctx.text_edit_focused() || egui::Popup::is_any_open(ctx);
        if !typing && ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, Key::Escape)) {
            stays = false;
        }
        match asked {
            Some(reading) => Some(ColumnsAct::Read(reading)),
            None if !stays => Some(ColumnsAct::Close),
            None => (draft != open.draft).then_some(ColumnsAct::Choose(draft)),
        }
    }
}

impl Open {
    fn table(&self) -> Option<&TableOverview> {
        self.overview.as_ref()?.as_ref().ok()?.tables.get(self.draft.table)
    }
}

/// Looks into a file.
pub(crate) fn overview(path: &Path, reading: &ReadOptions) -> Result<Overview, OpeningProblem> {
    MeasuredFile::open(path).and_then(|file| file.look(reading)).map_err(|e| OpeningProblem::reading(&e))
}

/// Reads a file as it would be read.
pub(crate) fn preview(path: &Path, reading: &ReadOptions, cancel: &Cancel) -> Result<Preview, OpeningProblem> {
    let file = MeasuredFile::open(path).map(|file| file.stopped_by(cancel));
    let set = file.and_then(|file| read_opened(&[file], &[], reading));
    set.map(|set| Preview::of(&set)).map_err(|e| OpeningProblem::reading(&e))
}

fn body(ui: &mut Ui, open: &Open, draft: &mut Draft, plots: &mut Plots) -> Option<ReadOptions> {
    let colors = theme::accents(ui.visuals().dark_mode);
    let overview = match &open.overview {
        None => {
            ui.centered_and_justified(|ui| ui.weak("looking into the file…"));
            return None;
        }
        Some(Err(problem)) => {
            ui.add(Label::new(RichText::new(&problem.what).color(colors.wrong)).wrap());
            ui.add(Label::new(RichText::new(&problem.advice).weak()).wrap());
            return None;
        }
        Some(Ok(overview)) => overview,
    };
    head(ui, overview, draft);
    let table = overview.tables.get(draft.table)?;
    let mut asked = None;
    let frame = egui::Frame::new().inner_margin(Margin { top: 6, ..Margin::ZERO });
    // A short list leaves its room to the preview.
    let rows = draft.uses.len() as f32 + 1.5;
    let height =
        (ui.available_height() - rows * (ROW + 1.0)).clamp(0.45 * ui.available_height(), 0.8 * ui.available_height());
    Panel::bottom("columns preview").resizable(false).exact_size(height).frame(frame).show(ui, |ui| {
        asked = foot(ui, open, table, draft, plots);
    });
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| list::show(ui, table, draft));
    asked
}

/// What the file is, and what of it is listed.
fn head(ui: &mut Ui, overview: &Overview, draft: &mut Draft) {
    let Some(table) = overview.tables.get(draft.table) else { return };
    let rate = table.rate.map_or(String::new(), |r| format!(", {} samples a second", significant_trimmed(r, 6)));
    let text = format!("{}: {} columns, {} rows{rate}", overview.format, table.columns.len(), table.rows);
    ui.add(Label::new(RichText::new(text).weak()).truncate());
    let mut other = draft.table;
    let mut proposed = None;
    ui.horizontal(|ui| {
        if overview.tables.len() > 1 {
            let name = |index: usize| match overview.tables[index].name.as_str() {
                "" => format!("table {}", index + 1),
                name => name.to_owned(),
            };
            let combo = egui::ComboBox::from_id_salt("table").width(150.0).selected_text(name(draft.table));
            let combo = combo.show_ui(ui, |ui| {
                for index in 0..overview.tables.len() {
                    ui.selectable_value(&mut other, index, name(index));
                }
            });
            combo.response.accessible_name("Table");
        }
        let field = TextEdit::singleline(&mut draft.search).hint_text("find a column").desired_width(160.0);
        ui.add(field).accessible_name("Find a column");
        if chip(ui, "in use", draft.chosen_only, false, "List only the columns that are used").clicked() {
            draft.chosen_only = !draft.chosen_only;
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui
                .button("Propose")
                .on_hover_text("Use each column as its name, its unit and its values suggest")
                .clicked()
            {
                proposed = Some(table.proposed());
            }
            if ui.button("None").on_hover_text("Use no column, to choose anew").clicked() {
                proposed = Some(vec![None; table.columns.len()]);
            }
        });
    });
    if other != draft.table {
        proposed = Some(overview.tables[other].proposed());
        draft.table = other;
    }
    if let Some(uses) = proposed {
        draft.uses = uses;
    }
}

/// What would be read, and the buttons.
fn foot(ui: &mut Ui, open: &Open, table: &TableOverview, draft: &mut Draft, plots: &mut Plots) -> Option<ReadOptions> {
    let mut asked = None;
    let options = draft.options(table, &open.reading);
    Panel::bottom("columns buttons").resizable(false).frame(egui::Frame::NONE).show(ui, |ui| {
        ui.horizontal(|ui| {
            if !draft.uses.contains(&Some(ColumnUse::Time)) {
                ui.label("Sampling rate");
                let field = TextEdit::singleline(&mut draft.rate).hint_text("1000").desired_width(70.0);
                ui.add(field)
                    .accessible_name("Sampling rate")
                    .on_hover_text("Samples a second, as no column is the time");
                ui.label("Hz");
            }
            if let Err(problem) = options {
                ui.add(Label::new(RichText::new(problem).weak()).truncate());
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let ready = options.is_ok() && matches!(open.preview, Some(Ok(_)));
                let label = if open.paths.len() > 1 { "Use in every file" } else { "Use these columns" };
                let hint = "Read with these columns; other files of the folder are read alike from now on";
                if ui.add_enabled(ready, egui::Button::new(label)).on_hover_text(hint).clicked() {
                    asked = options.ok();
                }
            });
        });
    });
    match &open.preview {
        None => {
            ui.centered_and_justified(|ui| ui.weak("reading…"));
        }
        Some(Err(problem)) => {
            let colors = theme::accents(ui.visuals().dark_mode);
            ui.add(Label::new(RichText::new(&problem.what).color(colors.caution)).wrap());
            let advice = if problem.about_columns {
                "choose in the list what each column is used for; without a time column, give the sampling rate"
            } else {
                &problem.advice
            };
            ui.add(Label::new(RichText::new(advice).weak()).wrap());
        }
        Some(Ok(preview)) => preview.show(ui, plots),
    }
    asked
}
