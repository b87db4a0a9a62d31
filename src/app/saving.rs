//! Everything that is saved to a file that a person chose.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::ColorImage;

use super::figure_panel::FigureLook;
use super::plot::export::save_png;
use super::project::Project;
use super::purpose::Purpose;
use super::report::Content;
use super::rig::{Made, save};
use super::state::ClassCase;
use super::state::ViewState;
use super::views::{self, MapProgress, Picture, Seen, View};
use sindyscope_core::study::{Outcome, SettingsGrid};
use sindyscope_modes::{ModalAnalysis, StructureDiagnosis};
use sindyscope_report::document::{FigureFormat, SeriesReport};
use sindyscope_report::export::{self, ExportError, StateSpace};
use sindyscope_system::fs;
use sindyscope_values::record::{Record, RecordSet};

/// What is saved, and where.
#[derive(Debug)]
pub(crate) struct Saving {
    pub(crate) path: PathBuf,
    /// What the file is for: asked for again if there is one already.
    pub(crate) purpose: Purpose,
    /// True if a file that is there may be replaced: a person was asked.
    pub(crate) replaces: bool,
    pub(crate) content: SavedContent,
}

/// What a file holds once it is saved.
#[derive(Debug)]
pub(crate) enum SavedContent {
    /// The project.
    Project(Box<Project>),
    /// The model, in the form that the file's ending says.
    Model(Arc<Outcome>),
    /// A structure by its modes, in the form that the file's ending says.
    Structure(Box<StructureModel>),
    /// A picture of a view.
    View(Box<ViewPicture>),
    /// A figure that is drawn already, as SVG, with its title.
    Figure { svg: String, title: &'static str },
    /// The numbers of a plot, the rounds of a class, the log of the session.
    Text(String),
    /// A picture of the window.
    Window(Arc<ColorImage>),
    /// The report, as what the file's ending says.
    Report(Box<Content>),
    /// The virtual rig's records and the truth beside them.
    RigRecords(Box<Made>),
    /// The records of a class's round.
    RoundRecords(ClassCase),
    /// The last seconds of a stream.
    StreamRecord(Arc<Record>),
    /// The report of a series, as what the file's ending says.
    Series(Box<SeriesReport>),
}

/// A structure to be exported, with the records that its programs run along.
#[derive(Debug)]
pub(crate) struct StructureModel {
    pub(crate) of: StructureResult,
    pub(crate) records: RecordSet,
}

/// Where a structure comes from.
#[derive(Debug)]
pub(crate) enum StructureResult {
    /// Its modes alone.
    Modes(Arc<ModalAnalysis>),
    /// The search for the force that they lack.
    WithForce(Arc<StructureDiagnosis>),
}

impl StructureModel {
    fn write(&self, path: &Path) -> Result<Vec<PathBuf>, ExportError> {
        let space = match &self.of {
            StructureResult::Modes(analysis) => StateSpace::new(&analysis.structure, None),
            StructureResult::WithForce(found) => StateSpace::new(&found.last, found.found.as_ref()),
        };
        space.write(&self.records, path)
    }
}

/// A picture of a view.
pub(crate) struct ViewPicture {
    /// How it is zoomed in the window.
    pub(crate) seen: Seen,
    pub(crate) view: View,
    pub(crate) outcome: Arc<Outcome>,
    pub(crate) map: Option<Arc<SettingsGrid>>,
    pub(crate) pins: Vec<Arc<Outcome>>,
    pub(crate) record: usize,
    pub(crate) state: ViewState,
    pub(crate) look: FigureLook,
}

impl std::fmt::Debug for ViewPicture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ViewPicture").field("view", &self.view).field("look", &self.look).finish_non_exhaustive()
    }
}

/// What came of it.
#[derive(Debug, PartialEq)]
pub(crate) enum SaveResult {
    /// These files were written.
    Written { purpose: Purpose, paths: Vec<PathBuf> },
    /// Nothing was: there is a file already, and nobody was asked about it.
    Taken { purpose: Purpose, path: PathBuf },
}

impl Saving {
    /// Writes the file.
    ///
    /// # Errors
    /// It cannot be written, in one sentence.
    pub(crate) fn run(self) -> Result<SaveResult, String> {
        let Self { path, purpose, replaces, content } = self;
        if !replaces && fs::exists(&path) {
            return Ok(SaveResult::Taken { purpose, path });
        }
        let written = match content {
            SavedContent::Project(project) => project.save(&path).map(|()| vec![path])?,
            SavedContent::Model(outcome) => export::write(&outcome, &path).map_err(|e| e.to_string())?,
            SavedContent::Structure(model) => model.write(&path).map_err(|e| e.to_string())?,
            SavedContent::View(picture) => {
                figure(&path, picture.view.label(), || picture.svg())?;
                vec![path]
            }
            SavedContent::Figure { svg, title } => {
                figure(&path, title, || Ok(svg))?;
                vec![path]
            }
            SavedContent::Text(text) => {
                let failed = |e| format!("Nothing was saved: {e}; choose another folder ({})", path.display());
                fs::write(&path, text).map_err(failed)?;
                vec![path]
            }
            SavedContent::Window(image) => {
                save_png(&path, &pixels(&image)?)?;
                vec![path]
            }
            SavedContent::Report(content) => {
                content.write(&path).map_err(|e| format!("The report was not saved: {e}"))?;
                vec![path]
            }
            SavedContent::RigRecords(made) => save::rig(path, &made)?,
            SavedContent::RoundRecords(case) => save::round(path, &case)?,
            SavedContent::Series(report) => {
                report.write(&path).map_err(|e| format!("The report was not saved: {e}"))?;
                vec![path]
            }
            SavedContent::StreamRecord(record) => save::stream(path, &record)?,
        };
        Ok(SaveResult::Written { purpose, paths: written })
    }
}

impl ViewPicture {
    /// The view as the window shows it, or whole.
    fn svg(self) -> Result<String, String> {
        let Self { seen, view, outcome, map, pins, record, state, look } = self;
        let search = MapProgress { map: map.as_ref(), ..MapProgress::default() };
        let picture = Picture { record, search, pins: &pins, ..Picture::of(&outcome) };
        let figure = views::figure(view, &picture, &state, look.as_shown.then_some(&seen))?;
        Ok(figure.svg(look.size, seen.units()))
    }
}

/// Writes a drawing in the form that the path's ending says.
fn figure(path: &Path, title: &str, drawing: impl FnOnce() -> Result<String, String>) -> Result<(), String> {
    let write = || {
        let format = FigureFormat::of(path).map_err(|e| e.to_string())?;
        let bytes = format.bytes(&drawing()?, title).map_err(|e| e.to_string())?;
        fs::write(path, bytes).map_err(|e| format!("{e}; choose another folder ({})", path.display()))
    };
    write().map_err(|e: String| format!("The figure was not saved: {e}"))
}

fn pixels(image: &ColorImage) -> Result<image::RgbaImage, String> {
    let [width, height] = image.size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_srgba_unmultiplied()).collect();
    let image = image::RgbaImage::from_raw(width, height, bytes);
    image.ok_or_else(|| "the picture of the window came damaged; try again".to_owned())
}
