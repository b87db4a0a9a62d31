//! The series in place of the records.

use egui::{Context, Ui};

use super::App;
use super::drawing::centre;
use crate::app::commands::WindowCommand;
use crate::app::message::Message;
use crate::app::panel;
use crate::app::problem::file_name;
use crate::app::program::WindowProgram;
use crate::app::purpose::{Purpose, ReportForm};
use crate::app::saving::SavedContent;
use crate::app::series::{self, OpenSeries, SeriesAct, SeriesAsk};
use crate::app::state::Room;
use std::path::Path;
use std::sync::Arc;

impl App {
    /// True if a series is shown in place of the records.
    pub(super) fn shows_series(&self) -> bool {
        let state = &self.program.state;
        state.series.shown && state.shown.room == Room::Identify
    }

    /// The series that is shown, once it was read.
    pub(super) fn open_series(&self) -> Option<&Arc<OpenSeries>> {
        self.program.derived.series.found().filter(|_| self.shows_series())
    }

    /// Draws the series and what was found of it.
    pub(super) fn series(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let ctx = ui.ctx().clone();
        let WindowProgram { state, derived, .. } = &self.program;
        let (room, figures) = (&derived.series, &mut self.canvas.series);
        let mut form = state.series.clone();
        let mut asked = Vec::new();
        panel::controls(ui, |ui| asked.extend(series::controls(ui, room, &mut form)));
        panel::findings(ui, |ui| asked.extend(series::findings(ui, room)));
        centre(ui, |ui| asked.extend(series::show(ui, room, form.parameter.as_deref(), figures)));
        if form != state.series {
            self.program.send(Message::Series(SeriesAct::Form(Box::new(form))));
        }
        for ask in asked {
            self.series_ask(ask, &ctx, frame);
        }
    }

    fn series_ask(&mut self, ask: SeriesAsk, ctx: &Context, frame: &eframe::Frame) {
        match ask {
            SeriesAsk::Do(act) => self.program.send(Message::Series(act)),
            SeriesAsk::Open => self.run(WindowCommand::Series, ctx, frame),
            SeriesAsk::SavePicture => self.run(WindowCommand::PlotPicture, ctx, frame),
            SeriesAsk::SaveTable(text) => {
                self.table = text;
                self.dialogs.ask(Purpose::Table, &format!("{}-series.csv", self.series_stem()), frame);
            }
            SeriesAsk::SaveReport(form) => self.ask_for_series_report(form, frame),
        }
    }

    /// Asks where the report of the series is to be saved.
    pub(super) fn ask_for_series_report(&mut self, form: ReportForm, frame: &eframe::Frame) {
        let name = format!("{}-series.{}", self.series_stem(), form.ending());
        self.dialogs.ask(Purpose::Report(form), &name, frame);
    }

    /// The table's name without its ending.
    pub(super) fn series_stem(&self) -> String {
        let table = self.program.state.series.table.as_deref().unwrap_or(Path::new("table"));
        Path::new(&file_name(table)).with_extension("").display().to_string()
    }

    /// What a file for this purpose is to hold of the series that is shown; none if it is for something else.
    pub(super) fn series_content(&self, ctx: &Context, purpose: Purpose) -> Option<SavedContent> {
        let (open, state) = (self.open_series()?, &self.program.state);
        match purpose {
            Purpose::Plot => {
                let svg = series::svg(ctx, open, state.series.parameter.as_deref(), state.figure);
                Some(SavedContent::Figure { svg, title: "Series" })
            }
            Purpose::Report(_) => {
                let report = open.series.report(&self.series_stem());
                Some(SavedContent::Series(Box::new(report)))
            }
            _ => None,
        }
    }
}
