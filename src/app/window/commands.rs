//! Commands, files that were chosen, and what is saved.

use std::path::Path;
use std::sync::Arc;

use egui::{Context, Theme, ThemePreference};

use super::{App, with_extension};
use crate::app::command_palette::Palette;
use crate::app::commands::WindowCommand;
use crate::app::component;
use crate::app::dialogs::Chosen;
use crate::app::jobs::{Job, Key};
use crate::app::message::Message;
use crate::app::missing::{self, WalkAct};
use crate::app::modal;
use crate::app::project::Project;
use crate::app::purpose::{Purpose, ReportForm};
use crate::app::report::ReportSubject;
use crate::app::rig::class;
use crate::app::saving::{SavedContent, Saving, StructureModel, StructureResult, ViewPicture};
use crate::app::series::SeriesAct;
use crate::app::state::{Room, Source};
use crate::app::views::Seen;
use sindyscope_report::export::ExportFormat;
use sindyscope_system::time::{SystemTime, UNIX_EPOCH};
use sindyscope_values::format::equations;

/// How large everything is drawn, in the steps of *Larger text*.
const ZOOMS: [f32; 3] = [1.0, 1.25, 1.5];

impl App {
    /// Does a command: the window's own here, the others by the program.
    pub(super) fn run(&mut self, command: WindowCommand, ctx: &Context, frame: &eframe::Frame) {
        let records = &self.program.derived.records;
        let (stem, room) = (records.stem("sindyscope"), self.program.state.shown.room);
        let (empty, exported) = (records.records.is_empty(), self.exports_model());
        let drawn = self.has_figure();
        match command {
            WindowCommand::Open => self.dialogs.ask(Purpose::Open, "", frame),
            WindowCommand::OpenPath => self.dialogs.type_path(Purpose::Open, "", ""),
            WindowCommand::Series => self.dialogs.ask(Purpose::Series, "", frame),
            WindowCommand::Demonstration => {
                let now = SystemTime::now().duration_since(UNIX_EPOCH);
                let seed = now.map_or(1, |d| d.as_micros() as u64);
                self.program.send(Message::OpenSource(Source::Hidden(seed)));
            }
            WindowCommand::AddRecords => {
                self.dialogs.ask(if empty { Purpose::Open } else { Purpose::Add }, "", frame);
            }
            WindowCommand::SaveProject | WindowCommand::SaveProjectAs if empty => {}
            WindowCommand::SaveProject | WindowCommand::SaveProjectAs => {
                let known = self.program.state.project.clone().filter(|_| command == WindowCommand::SaveProject);
                match known {
                    Some(path) => {
                        let content = SavedContent::Project(Box::new(self.project()));
                        self.save(Saving { path, purpose: Purpose::Project, replaces: true, content });
                    }
                    None => self.dialogs.ask(Purpose::Project, &format!("{stem}.json"), frame),
                }
            }
            WindowCommand::PlotPicture if room == Room::Rig => {
                self.dialogs.ask(Purpose::Window, "virtual-rig.png", frame);
            }
            WindowCommand::PlotPicture | WindowCommand::SaveReport if !drawn => {}
            WindowCommand::ExportModel if !exported => {}
            WindowCommand::PlotPicture if room == Room::Report => {
                self.dialogs.ask(Purpose::Window, &format!("{stem}-report.png"), frame);
            }
            WindowCommand::PlotPicture => {
                self.figure_open = !self.figure_open;
                self.figure = missing::main_figure(&self.program.state.shown.walk);
            }
            WindowCommand::SaveReport if self.shows_series() => self.ask_for_series_report(ReportForm::Pdf, frame),
            WindowCommand::SaveReport => {
                self.dialogs.ask(Purpose::Report(ReportForm::Pdf), &format!("{stem}.pdf"), frame);
            }
            WindowCommand::ExportModel => {
                self.dialogs.ask(Purpose::Model, &format!("{stem}.{}", ExportFormat::Python.ending()), frame);
            }
            WindowCommand::WindowPicture => self.dialogs.ask(Purpose::Window, &format!("{stem}-window.png"), frame),
            WindowCommand::SaveLog => self.dialogs.ask(Purpose::Log, "sindyscope-log.json", frame),
            WindowCommand::CopyText
            | WindowCommand::CopyLatex
            | WindowCommand::CopyPython
            | WindowCommand::CopyJson => self.copy(command, ctx),
            WindowCommand::Theme => {
                let dark = ctx.theme() == Theme::Dark;
                let theme = if dark { ThemePreference::Light } else { ThemePreference::Dark };
                ctx.set_theme(theme);
                self.program.send(Message::Theme(theme));
            }
            WindowCommand::LargerText => {
                let next = ZOOMS.iter().find(|z| **z > ctx.zoom_factor() + 0.01).unwrap_or(&ZOOMS[0]);
                ctx.set_zoom_factor(*next);
            }
            WindowCommand::Messages => self.notices_open = !self.notices_open,
            WindowCommand::Palette => {
                self.palette = if self.palette.is_some() { None } else { Some(Palette::default()) }
            }
            WindowCommand::Help => self.help_open = !self.help_open,
            WindowCommand::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            command => self.program.send(Message::Do(command)),
        }
    }

    /// Does what the room "What's missing" asks for.
    pub(super) fn walk_on(&mut self, act: WalkAct, ctx: &Context, frame: &eframe::Frame) {
        match act {
            WalkAct::SaveFigure(figure) => (self.figure, self.figure_open) = (figure, true),
            WalkAct::OpenEffects => self.dialogs.ask(Purpose::Effects, "", frame),
            WalkAct::SaveEffects(text) => {
                self.table = text;
                self.dialogs.ask(Purpose::SaveEffects, "own-effects.toml", frame);
            }
            WalkAct::SaveTable(what, text) => {
                self.table = text;
                self.dialogs.ask(Purpose::Table, &self.file_name(what, "csv"), frame);
            }
            WalkAct::Copy => {
                if let Some(stage) = self.stage() {
                    let units = self.program.derived.records.units(stage.model.layout.kind);
                    ctx.copy_text(equations::text(&stage.model, Some(&units)));
                    self.program.derived.notices.note("The equations are on the clipboard, as text");
                }
            }
            act => self.program.send(Message::Walk(act)),
        }
    }

    fn copy(&mut self, command: WindowCommand, ctx: &Context) {
        let Some(outcome) = self.outcome() else { return };
        let model = &outcome.model;
        let (text, form) = match command {
            WindowCommand::CopyLatex => (equations::latex(model), "LaTeX"),
            WindowCommand::CopyPython => (equations::python(model), "Python"),
            WindowCommand::CopyJson => (serde_json::to_string_pretty(model).unwrap_or_default(), "JSON"),
            _ => (equations::text(model, Some(&outcome.units())), "text"),
        };
        ctx.copy_text(text);
        self.program.derived.notices.note(format!("The equations are on the clipboard, as {form}"));
    }

    /// Does what a file was chosen for.
    pub(super) fn chosen(&mut self, ctx: &Context, chosen: Chosen) {
        let Chosen { purpose, paths, asked } = chosen;
        let Some(path) = paths.first().cloned() else { return };
        let path = match purpose.ending() {
            // A picture is never something else than its name says.
            Some(ending) if purpose == Purpose::Window => path.with_extension(ending),
            Some(ending) => with_extension(&path, ending),
            None => path,
        };
        let replaces = asked.as_ref() == Some(&path);
        match purpose {
            Purpose::Open => self.program.send(Message::Open(paths)),
            Purpose::Series => self.program.send(Message::Series(SeriesAct::Open(path))),
            Purpose::Add => self.program.send(Message::Add(paths)),
            Purpose::Locate => self.program.send(Message::Locate(path)),
            Purpose::Effects => self.program.want(Key::Effects, Job::Effects(path)),
            Purpose::Window => {
                let (send, ctx2) = (self.shots.0.clone(), ctx.clone());
                ctx.request_screenshot(move |image| {
                    // The window may be closing.
                    let _ = send.send((path, replaces, image));
                    ctx2.request_repaint();
                });
            }
            _ => match self.content(ctx, purpose) {
                Some(content) => self.save(Saving { path, purpose, replaces, content }),
                None if purpose == Purpose::Plot => {
                    let told = "The figure was not saved: there is nothing to draw yet; look for effects first";
                    self.program.derived.notices.error(told);
                }
                None => {}
            },
        }
    }

    pub(super) fn save(&mut self, saving: Saving) {
        self.program.want(Key::Save(saving.path.clone()), Job::Save(Box::new(saving)));
    }

    /// What a file for this purpose is to hold; none if there is nothing to save.
    fn content(&self, ctx: &Context, purpose: Purpose) -> Option<SavedContent> {
        let (state, derived) = (&self.program.state, &self.program.derived);
        Some(match purpose {
            Purpose::Open | Purpose::Series | Purpose::Add | Purpose::Locate | Purpose::Effects | Purpose::Window => {
                return None;
            }
            Purpose::Plot | Purpose::Report(_) if self.shows_series() => return self.series_content(ctx, purpose),
            Purpose::Project => SavedContent::Project(Box::new(self.project())),
            Purpose::Log => SavedContent::Text(self.log()),
            Purpose::Model if self.by_modes() => SavedContent::Structure(Box::new(self.structure_model()?)),
            Purpose::Model => SavedContent::Model(Arc::clone(derived.records.outcome.as_ref()?)),
            Purpose::Plot if self.of_component() => {
                let missing = state.shown.room == Room::Missing;
                let room = &derived.component;
                let of = if missing { room.diagnosed() } else { room.identified() };
                let shown = (state.shown.component, state.shown.record);
                SavedContent::Figure { svg: component::svg(ctx, of, shown, state.figure)?, title: shown.0.label() }
            }
            Purpose::Plot if state.shown.room == Room::Missing && self.by_modes() => SavedContent::Figure {
                svg: modal::missing_svg(ctx, &derived.modal, &state.shown.modal, state.figure)?,
                title: "Before and after",
            },
            Purpose::Plot if state.shown.room == Room::Missing => {
                // Drawn at once: what is saved is what is seen.
                let of = (&derived.records, &state.document.edit);
                let svg = missing::svg(ctx, &derived.missing, &self.canvas.walk, &self.figure, of, state.figure)?;
                SavedContent::Figure { svg, title: self.figure.name() }
            }
            Purpose::Plot if self.by_modes() => SavedContent::Figure {
                svg: modal::svg(ctx, &derived.modal, &state.shown.modal, state.figure)?,
                title: state.shown.modal.view.label(),
            },
            Purpose::Plot => SavedContent::View(Box::new(self.view_picture(ctx)?)),
            Purpose::Table | Purpose::SaveEffects => SavedContent::Text(self.table.clone()),
            Purpose::Report(_) => {
                let subject =
                    ReportSubject::new(state, &derived.records, &derived.missing, (&derived.modal, &derived.component));
                SavedContent::Report(Box::new(subject.content()?))
            }
            Purpose::RigRecords => SavedContent::RigRecords(Box::new(derived.rig.made()?.clone())),
            Purpose::StreamRecord => SavedContent::StreamRecord(Arc::clone(derived.stream.record.as_ref()?)),
            Purpose::RoundRecords => SavedContent::RoundRecords(state.rig.class.case.clone()),
            Purpose::Rounds => SavedContent::Text(class::csv(&state.rig.class)),
        })
    }

    /// The structure that is shown: in *What's missing* with the force that was found.
    fn structure_model(&self) -> Option<StructureModel> {
        let (state, derived) = (&self.program.state, &self.program.derived);
        let searched = derived.modal.search.found().filter(|_| state.shown.room == Room::Missing);
        let of = match searched {
            Some(found) => StructureResult::WithForce(Arc::clone(found)),
            None => StructureResult::Modes(Arc::clone(derived.modal.analysis()?)),
        };
        Some(StructureModel { of, records: derived.records.set(&state.document.edit.usage) })
    }

    /// The project as it would be saved now.
    fn project(&self) -> Project {
        let state = &self.program.state;
        let names: Vec<String> = self.program.derived.records.records.iter().map(|r| r.name.clone()).collect();
        Project::new(&state.document, &names, state.shown.clone(), state.rig.clone())
    }

    /// The picture of the view that is shown.
    fn view_picture(&self, ctx: &Context) -> Option<ViewPicture> {
        let (state, derived) = (&self.program.state, &self.program.derived);
        let outcome = derived.records.outcome.clone()?;
        Some(ViewPicture {
            seen: Seen::of(ctx, state.shown.view, &state.shown.views, &derived.figures),
            view: state.shown.view,
            record: derived.records.place_in(&outcome, state.shown.record),
            outcome,
            map: derived.map.map().map(|(map, _)| Arc::clone(map)),
            pins: derived.records.known_pins().1,
            state: state.shown.views.clone(),
            look: state.figure,
        })
    }

    /// The name that is offered for a file of a plot.
    pub(super) fn file_name(&self, what: &str, ending: &str) -> String {
        let stem = self.program.derived.records.stem("figure");
        format!("{stem}-{}.{ending}", what.to_lowercase().replace(' ', "-"))
    }

    /// The path of a report that is offered.
    pub(super) fn report_name(&self, form: ReportForm) -> String {
        let stem = self.program.derived.records.stem("report");
        Path::new(&stem).with_extension(form.ending()).display().to_string()
    }
}
