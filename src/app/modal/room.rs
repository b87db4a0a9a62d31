//! What was found of a structure's modes, and the figures of it.

use std::sync::{Arc, OnceLock, Weak};

use crate::app::answer::Answer;
use crate::app::plot::beside::FiguresBeside;
use crate::app::records::OpenRecords;
use crate::app::state::ModalShown;
use sindyscope_modes::{Base, ModalAnalysis, StructureDiagnosis};
use sindyscope_report::modal::{ModalOptions, ModalSubject, ModalView};
use sindyscope_report::view::FigureResult;
use sindyscope_values::record::Usage;

/// Samples of all records up to which a figure is made at once: that costs less than a frame.
const AT_ONCE: usize = 1 << 13;

/// What the modes belong to: the records' generation, the settings, and what each record is used for.
pub(crate) type ModesAsked = (u64, Base, Vec<Usage>);

/// What was found of a structure's modes.
#[derive(Debug, Default)]
pub(crate) struct ModalRoom {
    asked: Option<ModesAsked>,
    analysis: Option<Arc<ModalAnalysis>>,
    /// Whether the analysis is of what was asked last.
    current: bool,
    /// Why what was asked last has none.
    failure: Option<String>,
    pub(crate) figures: FiguresBeside<ModalView, ModesMadeOf>,
    /// The search for the force that the modes lack.
    pub(crate) search: Answer<ModesAsked, StructureDiagnosis>,
    /// What came of it before the window was closed, until it is in view again.
    coming: Option<Arc<StructureDiagnosis>>,
    /// The same while its figures are made anew.
    returning: Option<Arc<StructureDiagnosis>>,
}

/// What a figure was made of; weak, so that an address that is compared is not given to a newer one meanwhile.
#[derive(Clone, Debug)]
pub(crate) struct ModesMadeOf {
    analysis: Weak<ModalAnalysis>,
    record: usize,
    options: ModalOptions,
}

impl PartialEq for ModesMadeOf {
    fn eq(&self, other: &Self) -> bool {
        let Self { analysis, record, options } = self;
        analysis.ptr_eq(&other.analysis) && *record == other.record && *options == other.options
    }
}

/// A figure that takes longer than a frame, to be made in the background.
#[derive(Clone, Debug)]
pub(crate) struct ModalFigureRequest {
    pub(crate) view: ModalView,
    analysis: Arc<ModalAnalysis>,
    record: usize,
    options: ModalOptions,
    cell: Arc<OnceLock<FigureResult>>,
}

impl ModalFigureRequest {
    /// Makes the figure; the window shows it from the next frame on.
    pub(crate) fn make(self) {
        let subject = ModalSubject { analysis: &self.analysis, record: self.record, options: &self.options };
        // It was empty when it was asked for.
        let _ = self.cell.set(self.view.figure(&subject));
    }
}

impl ModalRoom {
    /// True if this is to be asked for: it is neither known nor on its way.
    pub(crate) fn wants(&mut self, wanted: ModesAsked) -> bool {
        if self.asked.as_ref() == Some(&wanted) {
            return false;
        }
        if self.asked.as_ref().is_some_and(|(generation, ..)| *generation != wanted.0) {
            self.analysis = None;
        }
        (self.asked, self.current, self.failure) = (Some(wanted), false, None);
        true
    }

    /// Takes in what was found.
    pub(crate) fn take(&mut self, analysis: Arc<ModalAnalysis>) {
        (self.analysis, self.current, self.failure) = (Some(analysis), true, None);
    }

    /// Notes why nothing was found.
    pub(crate) fn fail(&mut self, reason: String) {
        self.failure = Some(reason);
    }

    /// Awaits what the session or a project kept of the search.
    pub(crate) fn bring_back(&mut self, kept: Option<Arc<StructureDiagnosis>>) {
        self.search.stop();
        self.coming = kept;
    }

    /// What was kept, to be shown again, once.
    pub(crate) fn coming(&mut self) -> Option<Arc<StructureDiagnosis>> {
        let kept = self.coming.take()?;
        self.returning = Some(Arc::clone(&kept));
        Some(kept)
    }

    /// What of the search is to be kept.
    pub(crate) fn kept(&self) -> Option<Arc<StructureDiagnosis>> {
        let returning = self.returning.as_ref().filter(|_| self.search.is_running());
        self.search.found().or(self.coming.as_ref()).or(returning).cloned()
    }

    /// What was found, if anything was of these records.
    pub(crate) fn analysis(&self) -> Option<&Arc<ModalAnalysis>> {
        self.analysis.as_ref()
    }

    /// Why there is none of the settings as they stand.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// What the line at the bottom says.
    pub(crate) fn said(&self) -> String {
        match (&self.failure, &self.analysis) {
            (Some(failure), _) => failure.clone(),
            (None, Some(analysis)) => {
                let structure = &analysis.structure;
                match structure.sensors.len() {
                    1 => format!("{} states from one sensor", structure.order()),
                    count => format!("{} states from {count} sensors", structure.order()),
                }
            }
            (None, None) => "looking for modes…".to_owned(),
        }
    }

    /// True if what is shown is not of the settings as they stand.
    pub(crate) fn is_stale(&self) -> bool {
        !self.current
    }

    /// The analysis's place of the record that is shown; its first if that one is left out.
    pub(super) fn place(analysis: &ModalAnalysis, data: &OpenRecords, shown: usize) -> usize {
        let name = data.records.get(shown).map(|r| r.name.as_str());
        analysis.records.iter().position(|r| Some(r.name.as_str()) == name).unwrap_or(0)
    }

    /// Makes the figure in view if it would be another now; one that takes longer than a frame is to be made in the
    /// background.
    pub(crate) fn attend(
        &mut self,
        shown: &ModalShown,
        data: &OpenRecords,
        record: usize,
    ) -> Option<ModalFigureRequest> {
        let analysis = Arc::clone(self.analysis.as_ref()?);
        let (view, options, record) = (shown.view, shown.options.clone(), Self::place(&analysis, data, record));
        let made_of = ModesMadeOf { analysis: Arc::downgrade(&analysis), record, options: options.clone() };
        let cell = self.figures.renew(view, made_of)?;
        let samples: usize = analysis.records.iter().map(|r| r.measured.first().map_or(0, Vec::len)).sum();
        let request = ModalFigureRequest { view, analysis, record, options, cell };
        if view == ModalView::Responses && samples > AT_ONCE {
            return Some(request);
        }
        request.make();
        None
    }
}
