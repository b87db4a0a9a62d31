//! The room "Report": what a person takes along. On the left the sections, chosen, ordered and with texts between them; in the centre
//! the pages as they will be saved.
//!
//! What is arranged is part of what undo takes back and of the project ([`sindyscope_report::document::Arrangement`]); here is only how it is shown.

mod contents;
pub(crate) mod headless;
mod pages;

use std::path::Path;
use std::sync::Arc;

use contents::Contents;
use egui::{ColorImage, Ui};
pub(crate) use pages::ReportAct;
use pages::{Pages, USUAL};

use super::missing::Missing;
use super::records::OpenRecords;
use super::state::{Edit, State};
use crate::command::shell::quoted;
use sindyscope_core::study::{Cancel, Outcome};
use sindyscope_report::document::{Arrangement, Pixels, Report, Section, pixels};
use sindyscope_search::Diagnosis;
use sindyscope_values::record::{RecordSet, Usage};

/// Everything that a report is made of, held so that another thread can make it.
#[derive(Clone, Debug)]
pub(crate) struct Content {
    title: String,
    records: RecordSet,
    outcome: Arc<Outcome>,
    diagnosis: Option<Arc<Diagnosis>>,
    arrangement: Arrangement,
    /// The command that makes the report again.
    command: Option<String>,
}

impl Content {
    /// The report of what is open; none while there is no outcome.
    pub(crate) fn new(
        data: &OpenRecords,
        edit: &Edit,
        diagnosis: Option<&Arc<Diagnosis>>,
        project: Option<&Path>,
    ) -> Option<Self> {
        let outcome = Arc::clone(data.outcome.as_ref()?);
        let (records, arrangement) = (data.set(&edit.usage), edit.report.clone());
        let (title, diagnosis) = (title(&data.title), diagnosis.cloned());
        Some(Self { title, records, outcome, diagnosis, arrangement, command: project.map(command) })
    }

    pub(crate) fn report(&self) -> Report<'_> {
        Report {
            title: &self.title,
            records: &self.records,
            outcome: &self.outcome,
            choice: None,
            command: self.command.as_deref(),
            diagnosis: self.diagnosis.as_deref(),
            arrangement: &self.arrangement,
        }
    }
}

/// The title of a report that has none of its own: the data's name without its ending.
fn title(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| name.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// The command that makes the report of a project again, from the project's own folder.
fn command(project: &Path) -> String {
    let name = project.file_name().unwrap_or_default().to_string_lossy();
    let out = Path::new(&*name).with_extension("pdf");
    format!("sindyscope report {} --out {}", quoted(&name), quoted(&out.to_string_lossy()))
}

/// What a preview was made of: what is held here keeps its address.
struct PagesKey {
    outcome: Arc<Outcome>,
    diagnosis: Option<Arc<Diagnosis>>,
    usage: Vec<Usage>,
    arrangement: Arrangement,
    command: Option<String>,
    generation: u64,
    width: u32,
}

/// What a report is of.
#[derive(Clone, Copy)]
pub(crate) struct ReportSubject<'a> {
    pub(crate) data: &'a OpenRecords,
    pub(crate) edit: &'a Edit,
    pub(crate) diagnosis: Option<&'a Arc<Diagnosis>>,
    /// The project that this is, if it is one.
    pub(crate) project: Option<&'a Path>,
}

impl<'a> ReportSubject<'a> {
    /// What is open.
    pub(crate) fn new(state: &'a State, records: &'a OpenRecords, missing: &'a Missing) -> Self {
        let edit = &state.document.edit;
        let diagnosis = missing.diagnosis(&edit.walk);
        Self { data: records, edit, diagnosis, project: state.project.as_deref() }
    }

    /// Everything that the report is made of; none while there is no outcome.
    pub(crate) fn content(&self) -> Option<Content> {
        Content::new(self.data, self.edit, self.diagnosis, self.project)
    }
}

impl PagesKey {
    fn holds(&self, subject: &ReportSubject<'_>, width: u32) -> bool {
        let ReportSubject { data, edit, diagnosis, project } = *subject;
        let same_diagnosis = match (&self.diagnosis, diagnosis) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            (own, other) => own.is_none() && other.is_none(),
        };
        same_diagnosis
            && data.outcome.as_ref().is_some_and(|outcome| Arc::ptr_eq(outcome, &self.outcome))
            && (self.generation, self.width) == (data.generation, width)
            && self.usage == edit.usage
            && self.arrangement == edit.report
            && self.command == project.map(command)
    }
}

/// Draws the pages, so many pixels wide, and names the sections that the study has nothing for.
///
/// # Errors
/// A page cannot be drawn, or the work was cancelled.
pub(crate) fn pages(
    content: &Content,
    width: u32,
    cancel: &Cancel,
    tell: &dyn Fn(f64),
) -> Result<(Vec<Pixels>, Vec<Section>), String> {
    let (pages, empty) = content.report().pages();
    let mut drawn = Vec::with_capacity(pages.len());
    for (k, page) in pages.iter().enumerate() {
        if cancel.is_cancelled() {
            return Err("cancelled".to_owned());
        }
        tell(k as f64 / pages.len() as f64);
        drawn.push(pixels(page, width).map_err(|e| e.to_string())?);
    }
    Ok((drawn, empty))
}

/// The room: the pages that were drawn last.
#[derive(Default)]
pub(crate) struct ReportRoom {
    asked: Option<PagesKey>,
    pages: Vec<Arc<ColorImage>>,
    empty: Vec<Section>,
    failure: Option<String>,
    /// Pixels that a page is to be wide, once it was shown.
    width: Option<u32>,
}

/// What the room remembers of its drawing from frame to frame.
#[derive(Default)]
pub(crate) struct ReportCanvas {
    contents: Contents,
    pages: Pages,
}

/// Draws the room's part of the left column; what is changed of the report is the person's.
pub(crate) fn controls(
    ui: &mut Ui,
    room: &ReportRoom,
    canvas: &mut ReportCanvas,
    report: &mut Arrangement,
    data: &str,
) {
    canvas.contents.show(ui, report, &room.empty, &title(data));
}

/// Draws the centre.
pub(crate) fn show(
    ui: &mut Ui,
    room: &ReportRoom,
    canvas: &mut ReportCanvas,
    report: &mut Arrangement,
) -> Option<ReportAct> {
    let (act, width) = canvas.pages.show(ui, (&room.pages, room.failure.as_deref()), report);
    act.or(width.filter(|width| room.width != Some(*width)).map(ReportAct::Width))
}

/// A page's pixels as the window shows them.
fn image(page: Pixels) -> Arc<ColorImage> {
    let size = [page.width, page.height].map(|n| n as usize);
    Arc::new(ColorImage::from_rgba_premultiplied(size, &page.bytes))
}

impl ReportRoom {
    /// Takes in the pages that were drawn.
    pub(crate) fn take(&mut self, pages: Vec<Pixels>, empty: Vec<Section>) {
        self.failure = None;
        self.empty = empty;
        self.pages = pages.into_iter().map(image).collect();
    }

    /// Has the pages drawn so many pixels wide.
    pub(crate) fn widen(&mut self, width: u32) {
        self.width = Some(width);
    }

    /// Notes why there are none.
    pub(crate) fn fail(&mut self, reason: String) {
        self.failure = Some(reason);
    }

    /// What the pages are to be drawn of, and how wide, if what is shown is no longer what was drawn.
    pub(crate) fn wanted(&mut self, subject: &ReportSubject<'_>) -> Option<(Content, u32)> {
        if subject.data.outcome.is_none() {
            (self.asked, self.pages) = (None, Vec::new());
            return None;
        }
        let width = self.width.unwrap_or(USUAL);
        if self.asked.as_ref().is_some_and(|key| key.holds(subject, width)) {
            return None;
        }
        let content = subject.content()?;
        self.asked = Some(PagesKey {
            outcome: Arc::clone(&content.outcome),
            diagnosis: content.diagnosis.clone(),
            usage: subject.edit.usage.clone(),
            arrangement: content.arrangement.clone(),
            command: content.command.clone(),
            generation: subject.data.generation,
            width,
        });
        Some((content, width))
    }
}
