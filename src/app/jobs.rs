//! All background work of the window: a closed set of jobs on one queue.
//!
//! Nothing else in the window starts a thread or touches a file.

use std::path::PathBuf;
use std::sync::Arc;

use sindyscope_analysis::component::{ComponentAnalysis, DiagnosedComponent, diagnose_component, identify_component};
use sindyscope_analysis::missing::MAX_EFFECTS;
use sindyscope_analysis::{AnalysisRequest, MissingRequest, RecordSource, effects};
use sindyscope_core::prepare::{Preparation, prepare_leniently};
use sindyscope_core::study::{
    Calibrated, Calibration, Cancel, ChosenSettings, Ensemble, FreeSettings, Outcome, Settings, SettingsGrid, Study,
    StudyError, calibrate, choose, settings_grid,
};
use sindyscope_files::{Overview, ReadOptions};
use sindyscope_modes::{Base, ModalAnalysis, ModesError, StructureDiagnosis, analyse};
use sindyscope_report::document::{Pixels, Section};
use sindyscope_report::modal::ModalView;
use sindyscope_rig::RigSettings;
use sindyscope_values::record::{RecordSet, Usage};

use super::columns::{self, Preview};
use super::disk;
use super::missing::DROPPED;
use super::missing::work::{self as search, CachedSearch};
use super::modal::ModalFigureRequest;
use super::open::{self, Opened, Opening, Refused};
use super::problem::OpeningProblem;
use super::purpose::Purpose;
use super::questions::{self, Bought, Reply};
pub(crate) use super::queue::JobUpdate;
use super::queue::{JobReport, Queue, Work};
use super::remedy;
use super::report::{self, Content};
use super::rig::class;
use super::rig::work::{self as rig, Recorded, RecordedRig};
use super::saving::{SaveResult, Saving};
use super::series::{self, OpenSeries};
use super::session;
use super::state::{Answered, ClassCase, SeriesOver, State, StreamForm};
use super::stream::work::{self as stream, StreamPart};
use super::views::{FigureRequest, View};

/// The queue of the window.
pub(crate) type Jobs = Queue<Job>;

/// Segment lengths and thresholds of a full map of settings.
const MAP_SIZE: (usize, usize) = (25, 25);

/// What jobs replace each other by.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Key {
    /// Reading records.
    Open,
    /// Choosing settings.
    Choose,
    /// Finding what a step of the preparation takes out.
    Calibrate,
    /// The study of the settings as they stand.
    Fit,
    /// The modes of a structure.
    Modes,
    /// The force of a component.
    Component,
    /// The search for what a component's force lacks.
    ComponentSearch,
    /// The search for the force that a structure's modes lack.
    ModalSearch,
    /// The study on resampled data.
    Resample,
    /// The studies that were pinned.
    Pins,
    /// What the answers to open questions would buy.
    Answers,
    /// The map of settings.
    Map,
    /// The search for what is missing.
    Search,
    /// The pages of the report.
    Pages,
    /// The stream that is followed.
    Stream,
    /// The table that is shown as a series.
    Series,
    /// The virtual rig.
    Rig,
    /// Drawing a round of the class mode.
    DrawRound,
    /// The search in the records of a round.
    SearchRound,
    /// The columns of a file.
    Columns,
    /// What would be read with the columns chosen.
    Preview,
    /// A file of effects of a person's own.
    Effects,
    /// The figure of a view.
    Figure(View),
    /// A figure of a structure's modes.
    ModalFigure(ModalView),
    /// Bringing back what the session's file holds.
    Restore,
    /// The session's file.
    Session,
    /// The file in which the session's log is kept as it goes.
    Log,
    /// A file that is saved: no two writes of one file overtake each other.
    Save(PathBuf),
}

/// What is to be done.
#[derive(Debug)]
pub(crate) enum Job {
    /// Read records and find settings to start from.
    Open(Box<Opening>),
    /// Choose settings by simulation error.
    Choose { records: RecordSet, settings: Settings },
    /// Find what a step of the preparation takes out of a channel, with the equation.
    Calibrate { records: RecordSet, settings: Settings, step: usize, sought: Calibration },
    /// Study records. Where nothing is shown yet and refinement takes its time, the regression's own equation comes first.
    Fit { records: RecordSet, settings: Settings, is_first: bool },
    /// Identify the force of a component.
    Component { records: RecordSet, source: RecordSource },
    /// Look for what the force of a component lacks.
    ComponentSearch { records: RecordSet, source: RecordSource },
    /// Identify the modes of a structure.
    Modes { records: RecordSet, base: Base },
    /// Look for the force that the modes of a structure lack, or show again what was kept of such a search.
    ModalSearch { records: RecordSet, base: Base, kept: Option<Arc<StructureDiagnosis>> },
    /// Repeat the regression on resampled data.
    Resample { records: RecordSet, settings: Settings },
    /// Make pinned outcomes again, by their places among the pins.
    Pins(Vec<PinnedStudy>),
    /// Fit once for each answer.
    Answers { records: RecordSet, settings: Settings, replies: Vec<Reply> },
    /// Map the settings, coarsely first.
    Map { records: RecordSet, settings: Settings },
    /// Search for what is missing.
    Search(Box<search::SearchRequest>),
    /// Draw the pages of the report, so many pixels wide.
    Pages { content: Box<Content>, width: u32 },
    /// Follow a stream until it ends.
    Stream(Box<StreamForm>),
    /// Read a table as a series.
    Series { table: PathBuf, over: Option<SeriesOver> },
    /// Record the virtual rig and study its record.
    Rig { settings: Box<RigSettings>, usual_library: bool },
    /// Draw what a round hides.
    DrawRound(ClassCase),
    /// Search for what a round hides.
    SearchRound { index: usize, case: ClassCase },
    /// Look into a file.
    Columns { path: PathBuf, reading: ReadOptions },
    /// Read a file with the columns chosen.
    Preview { path: PathBuf, reading: ReadOptions },
    /// Read a file of effects of a person's own.
    Effects(PathBuf),
    /// Make the figure of a view that takes longer than a frame.
    Figure(Box<FigureRequest>),
    /// Make a figure of a structure's modes.
    ModalFigure(Box<ModalFigureRequest>),
    /// Read the session's file, and open files in it if there are any.
    Restore { session: PathBuf, files: Vec<PathBuf> },
    /// Write the session's file.
    Session { path: PathBuf, text: String },
    /// Save something to a file.
    Save(Box<Saving>),
}

/// A study that was pinned.
#[derive(Debug)]
pub(crate) struct PinnedStudy {
    /// Its place among the pins.
    pub(crate) index: usize,
    pub(crate) records: RecordSet,
    /// The steps by which the records are to be prepared, if they are not yet.
    pub(crate) steps: Option<Vec<Preparation>>,
    /// What each record was used for.
    pub(crate) usage: Vec<Usage>,
    pub(crate) settings: Settings,
}

impl PinnedStudy {
    fn run(self, study: &mut Study, cancel: &Cancel) -> Result<Outcome, StudyError> {
        let Self { mut records, steps, usage, settings, .. } = self;
        if let Some(steps) = steps {
            (records, _) = prepare_leniently(&records, &steps);
            for ((_, own), usage) in records.entries.iter_mut().zip(usage) {
                *own = usage;
            }
        }
        study.run(&records, &settings, cancel)
    }
}

/// What is told on the way.
#[derive(Debug)]
pub(crate) enum Part {
    /// An equation that refinement goes on from.
    Fitted(Arc<Outcome>),
    /// The map as far as it is known.
    Map(SettingsGrid),
    /// What the search has found so far.
    Search(search::Event),
    /// What has come of the stream.
    Stream(Box<StreamPart>),
}

/// What came of a job.
#[derive(Debug)]
pub(crate) enum Done {
    /// Records were read, or not.
    Opened(Result<Box<Opened>, Box<Refused>>),
    /// Settings were chosen.
    Chosen {
        /// What they were chosen from.
        asked: Box<Settings>,
        /// What was chosen.
        choice: Box<ChosenSettings>,
    },
    /// What is still to be taken out of a channel by a step of the preparation.
    Calibrated { step: usize, found: Calibrated },
    /// The outcome of a study.
    Fitted(Arc<Outcome>),
    /// The force of a component.
    Component(Arc<ComponentAnalysis>),
    /// What the force of a component lacks.
    ComponentSearched(Arc<DiagnosedComponent>),
    /// The modes of a structure.
    Modes(Arc<ModalAnalysis>),
    /// What a structure's modes lack.
    ModalSearched(Arc<StructureDiagnosis>),
    /// How sure the terms are.
    Resampled(Ensemble),
    /// Each pin's outcome, if it could be made.
    Pinned(Vec<(usize, Option<Arc<Outcome>>)>),
    /// What each answer would buy.
    Bought(Vec<Bought>),
    /// The whole map of settings.
    Map(SettingsGrid),
    /// The search has come to its end.
    Searched,
    /// The stream has ended.
    Streamed,
    /// A table was read as a series.
    Series(Arc<OpenSeries>),
    /// The pages, and the sections that the study has nothing for.
    Pages(Vec<Pixels>, Vec<Section>),
    /// The rig's record and what was found in it.
    Recorded(Box<RecordedRig>),
    /// What a round hides: the effect's name and its description.
    RoundDrawn { case: ClassCase, hidden: String, description: String },
    /// What the program found in a round.
    RoundSearched { index: usize, answered: Answered },
    /// What a file holds.
    Columns(Result<Overview, OpeningProblem>),
    /// What would be read.
    Preview(Result<Preview, OpeningProblem>),
    /// The text of a file of effects.
    Effects(String),
    /// The state that the session left, and what is to be told of it.
    Restored(Box<State>, Option<String>),
    /// A figure was made, or a file written that nobody waits for.
    Nothing,
    /// Something was saved, or there is a file already.
    Saved(SaveResult),
}

impl Done {
    /// Where the project was saved, if that is what was done.
    pub(crate) fn saved_project(&self) -> Option<PathBuf> {
        match self {
            Self::Saved(SaveResult::Written { purpose: Purpose::Project, paths }) => paths.first().cloned(),
            _ => None,
        }
    }
}

/// What the jobs of one key use again.
#[derive(Default)]
pub(crate) struct Memory {
    /// Smoothed records and Gram matrices of the last study.
    study: Study,
    search: Option<CachedSearch>,
    rig: Option<Recorded>,
}

impl Work for Job {
    type Key = Key;
    type Part = Part;
    type Done = Done;
    type Memory = Memory;

    fn run(self, memory: &mut Memory, report: &JobReport<'_, Self>) -> Result<Done, String> {
        let cancel = report.cancel;
        let share = |share: f64| report.share(share);
        let stage = |stage: &'static str, share: f64| report.stage(stage, share);
        Ok(match self {
            Self::Open(opening) => Done::Opened(open::open(*opening, cancel).map(Box::new)),
            Self::Choose { records, settings } => {
                let free =
                    FreeSettings { window: true, order: true, threshold: true, form: true, refine: true, terms: true };
                let choice = choose(&records, &settings, free, cancel, &stage).map_err(sentence)?;
                Done::Chosen { asked: Box::new(settings), choice: Box::new(choice) }
            }
            Self::Calibrate { records, settings, step, sought } => {
                let found = calibrate(&records, &settings, &[sought], cancel).map_err(sentence)?;
                Done::Calibrated { step, found: found[0] }
            }
            Self::Fit { records, settings, is_first } => {
                if is_first && settings.refine {
                    let regressed = Settings { refine: false, ..settings.clone() };
                    let outcome = memory.study.run(&records, &regressed, cancel).map_err(sentence)?;
                    report.part(Part::Fitted(Arc::new(outcome)));
                }
                Done::Fitted(Arc::new(memory.study.run(&records, &settings, cancel).map_err(sentence)?))
            }
            Self::Component { records, source } => {
                let request = AnalysisRequest { source, ..AnalysisRequest::default() };
                Done::Component(Arc::new(identify_component(&request, &records, cancel).map_err(sentence)?))
            }
            Self::ComponentSearch { records, source } => {
                let request = MissingRequest { max_effects: MAX_EFFECTS, ..MissingRequest::default() };
                let found = diagnose_component(&source, &request, &records, &stage, cancel).map_err(sentence)?;
                Done::ComponentSearched(Arc::new(found))
            }
            Self::Modes { records, base } => {
                // Positions that are not typed may stand in the file.
                let file = records.entries.first().and_then(|(record, _)| record.source.as_deref());
                let base = base.placed(file.and_then(sindyscope_files::positions_in).as_deref());
                Done::Modes(Arc::new(analyse(&records, &base, &stage, cancel).map_err(modal_sentence)?))
            }
            Self::ModalSearch { records, base, kept: None } => Done::ModalSearched(Arc::new(
                sindyscope_modes::diagnose(&records, &base, &stage, cancel).map_err(modal_sentence)?,
            )),
            Self::ModalSearch { records, base, kept: Some(kept) } => {
                if !kept.is_of(&records, &base) {
                    return Err(DROPPED.to_owned());
                }
                Done::ModalSearched(Arc::new(kept.redrawn(&records, cancel).map_err(modal_sentence)?))
            }
            Self::Resample { records, settings } => {
                Done::Resampled(memory.study.ensemble(&records, &settings, cancel).map_err(sentence)?)
            }
            Self::Pins(pins) => {
                let mut study = |pin: PinnedStudy| (pin.index, pin.run(&mut memory.study, cancel).ok().map(Arc::new));
                Done::Pinned(pins.into_iter().map(&mut study).collect())
            }
            Self::Answers { records, settings, replies } => {
                Done::Bought(questions::bought(&mut memory.study, &records, &settings, replies, cancel))
            }
            Self::Map { records, settings } => {
                let tell = |map: SettingsGrid| report.part(Part::Map(map));
                Done::Map(settings_grid(&records, &settings, MAP_SIZE, cancel, &tell).map_err(sentence)?)
            }
            Self::Search(request) => {
                let teller = search::Teller {
                    tell: &|event| report.part(Part::Search(event)),
                    stage: &|stage, share| report.stage(stage, share),
                };
                search::run(&mut memory.search, *request, &teller, cancel)?;
                Done::Searched
            }
            Self::Pages { content, width } => {
                let (pages, empty) = report::pages(&content, width, cancel, &share)?;
                Done::Pages(pages, empty)
            }
            Self::Stream(form) => {
                stream::follow(&form, cancel, &|part| report.part(Part::Stream(Box::new(part))))?;
                Done::Streamed
            }
            Self::Series { table, over } => {
                Done::Series(Arc::new(series::read(&table, over.as_ref()).map_err(sentence)?))
            }
            Self::Rig { settings, usual_library } => {
                Done::Recorded(Box::new(rig::record(&mut memory.rig, *settings, usual_library, cancel)?))
            }
            Self::DrawRound(case) => {
                let (hidden, description) = class::drawn(&case)?;
                Done::RoundDrawn { case, hidden, description }
            }
            Self::SearchRound { index, case } => {
                Done::RoundSearched { index, answered: class::search(&case, cancel, &share)? }
            }
            Self::Columns { path, reading } => Done::Columns(columns::overview(&path, &reading)),
            Self::Preview { path, reading } => Done::Preview(columns::preview(&path, &reading, cancel)),
            Self::ModalFigure(request) => {
                request.make();
                Done::Nothing
            }
            Self::Effects(path) => Done::Effects(effects::text_of_file(&path).map_err(sentence)?),
            Self::Figure(request) => {
                request.make();
                Done::Nothing
            }
            Self::Restore { session, files } => {
                let (state, problem) = session::load(&session);
                Done::Restored(Box::new(state.unwrap_or_default().with_files(&files)), problem)
            }
            Self::Session { path, text } => {
                disk::replace(&path, &text).map_err(|e| format!("{}: {e}", path.display()))?;
                Done::Nothing
            }
            Self::Save(saving) => Done::Saved(saving.run()?),
        })
    }
}

/// Why there are no modes, with what to try.
fn modal_sentence(error: ModesError) -> String {
    let remedies = error.remedies();
    if remedies.is_empty() { error.to_string() } else { format!("{error}: {}", remedy::worded(&remedies)) }
}

fn sentence(error: impl std::fmt::Display) -> String {
    error.to_string()
}
