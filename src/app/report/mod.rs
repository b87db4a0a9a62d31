//! The room "Report": what a person takes along. On the left the sections, chosen, ordered and with texts between them; in the centre
//! the pages as they will be saved.
//!
//! What is arranged is part of what undo takes back and of the project ([`sindyscope_report::document::Arrangement`]); here is only how it is shown.

mod content;
mod contents;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) mod headless;
mod pages;

use std::path::Path;
use std::sync::Arc;

pub(crate) use content::Content;
use content::title;
use contents::Contents;
use egui::{ColorImage, Ui};
pub(crate) use pages::ReportAct;
use pages::{Pages, USUAL};

use super::component::ComponentRoom;
use super::missing::Missing;
use super::modal::ModalRoom;
use super::records::OpenRecords;
use super::state::{Edit, State};
use super::widgets::section;
use sindyscope_core::study::Cancel;
use sindyscope_report::document::{Arrangement, Pixels, Section, pixels};
use sindyscope_search::Diagnosis;
use sindyscope_values::record::Usage;

/// What a preview was made of: what is held here keeps its address.
struct PagesKey {
    content: Content,
    usage: Vec<Usage>,
    generation: u64,
    width: u32,
}

/// What a report is of.
#[derive(Clone, Copy)]
pub(crate) struct ReportSubject<'a> {
    pub(crate) data: &'a OpenRecords,
    pub(crate) edit: &'a Edit,
    pub(crate) diagnosis: Option<&'a Arc<Diagnosis>>,
    /// The modes and the component, where it is about these.
    pub(crate) others: (&'a ModalRoom, &'a ComponentRoom),
    /// The project that this is, if it is one.
    pub(crate) project: Option<&'a Path>,
}

impl<'a> ReportSubject<'a> {
    /// What is open.
    pub(crate) fn new(
        state: &'a State,
        records: &'a OpenRecords,
        missing: &'a Missing,
        others: (&'a ModalRoom, &'a ComponentRoom),
    ) -> Self {
        let edit = &state.document.edit;
        let diagnosis = missing.diagnosis(&edit.walk);
        Self { data: records, edit, diagnosis, others, project: state.project.as_deref() }
    }

    /// Everything that the report is made of; none while nothing was found.
    pub(crate) fn content(&self) -> Option<Content> {
        Content::new((self.data, self.edit), self.diagnosis, self.others, self.project)
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
    let (pages, empty) = content.pages();
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

/// Draws the room's part of the left column for a report that has sections of its own.
pub(crate) fn title_controls(ui: &mut Ui, report: &mut Arrangement, data: &str) {
    section(
        ui,
        "REPORT",
        |_| {},
        |ui| {
            contents::title_row(ui, report, &title(data));
            ui.weak("Its sections are its own.")
                .on_hover_text("Reports of modes and of components have no sections to choose");
        },
    );
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
        let Some(content) = subject.content() else {
            (self.asked, self.pages) = (None, Vec::new());
            return None;
        };
        let (width, generation) = (self.width.unwrap_or(USUAL), subject.data.generation);
        let holds = |key: &PagesKey| {
            (key.generation, key.width) == (generation, width)
                && key.usage == subject.edit.usage
                && key.content.is(&content)
        };
        if self.asked.as_ref().is_some_and(holds) {
            return None;
        }
        self.asked = Some(PagesKey { content: content.clone(), usage: subject.edit.usage.clone(), generation, width });
        Some((content, width))
    }
}
