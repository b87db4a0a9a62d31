//! Everything that a report is made of, held so that another thread can make it.

use std::path::Path;
use std::sync::Arc;

use crate::app::component::ComponentRoom;
use crate::app::modal::ModalRoom;
use crate::app::records::OpenRecords;
use crate::app::state::Edit;
use crate::shell::quoted;
use sindyscope_analysis::component::{ComponentAnalysis, DiagnosedComponent};
use sindyscope_core::study::Outcome;
use sindyscope_modes::{BaseModel, ModalAnalysis, StructureDiagnosis};
use sindyscope_report::component::{effect_lines, verdict};
use sindyscope_report::document::{Arrangement, ComponentReport, ModesReport, Report, ReportError, Section};
use sindyscope_search::Diagnosis;
use sindyscope_values::record::RecordSet;

/// What a report is made of.
#[derive(Clone, Debug)]
pub(crate) struct Content {
    pub(super) title: String,
    pub(super) of: Reported,
    pub(super) arrangement: Arrangement,
    /// The command that makes the report again.
    pub(super) command: Option<String>,
}

/// What a report tells.
#[derive(Clone, Debug)]
pub(super) enum Reported {
    /// A study of equations of motion.
    Study { records: RecordSet, outcome: Arc<Outcome>, diagnosis: Option<Arc<Diagnosis>> },
    /// The modes of a structure.
    Modes { analysis: Arc<ModalAnalysis>, diagnosis: Option<Arc<StructureDiagnosis>> },
    /// The force of a component.
    Component { analysis: Arc<ComponentAnalysis>, diagnosis: Option<Arc<DiagnosedComponent>> },
}

impl Reported {
    /// True if the same is told, of the same records.
    fn is(&self, other: &Self) -> bool {
        fn same<T>(one: Option<&Arc<T>>, other: Option<&Arc<T>>) -> bool {
            one.map(Arc::as_ptr) == other.map(Arc::as_ptr)
        }
        match (self, other) {
            (Self::Study { outcome, diagnosis, .. }, Self::Study { outcome: o, diagnosis: d, .. }) => {
                Arc::ptr_eq(outcome, o) && same(diagnosis.as_ref(), d.as_ref())
            }
            (Self::Modes { analysis, diagnosis }, Self::Modes { analysis: a, diagnosis: d }) => {
                Arc::ptr_eq(analysis, a) && same(diagnosis.as_ref(), d.as_ref())
            }
            (Self::Component { analysis, diagnosis }, Self::Component { analysis: a, diagnosis: d }) => {
                Arc::ptr_eq(analysis, a) && same(diagnosis.as_ref(), d.as_ref())
            }
            _ => false,
        }
    }
}

impl Content {
    /// The report of what is open; none while nothing was found.
    pub(super) fn new(
        (data, edit): (&OpenRecords, &Edit),
        diagnosis: Option<&Arc<Diagnosis>>,
        (modal, component): (&ModalRoom, &ComponentRoom),
        project: Option<&Path>,
    ) -> Option<Self> {
        let of = if edit.component {
            let analysis = Arc::clone(component.fit.found()?);
            Reported::Component { analysis, diagnosis: component.search.found().cloned() }
        } else if edit.base.model == BaseModel::Modes {
            Reported::Modes { analysis: Arc::clone(modal.analysis()?), diagnosis: modal.search.found().cloned() }
        } else {
            let (records, outcome) = (data.set(&edit.usage), Arc::clone(data.outcome.as_ref()?));
            Reported::Study { records, outcome, diagnosis: diagnosis.cloned() }
        };
        Some(Self { title: title(&data.title), of, arrangement: edit.report.clone(), command: project.map(command) })
    }

    /// True if the same report would be made.
    pub(super) fn is(&self, other: &Self) -> bool {
        let Self { title, of, arrangement, command } = self;
        of.is(&other.of) && (title, arrangement, command) == (&other.title, &other.arrangement, &other.command)
    }

    /// Writes the document that the file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none; a file that cannot be written.
    pub(crate) fn write(&self, path: &Path) -> Result<(), ReportError> {
        match &self.of {
            Reported::Study { records, outcome, diagnosis } => {
                self.study(records, outcome, diagnosis.as_deref()).write(path)
            }
            Reported::Modes { analysis, diagnosis } => self.modes(analysis, diagnosis.as_deref()).write(path),
            Reported::Component { analysis, diagnosis } => {
                self.component(analysis, diagnosis.as_deref(), |report| report.write(path))
            }
        }
    }

    /// The pages of paper, and the sections that the study has nothing for.
    pub(super) fn pages(&self) -> (Vec<String>, Vec<Section>) {
        match &self.of {
            Reported::Study { records, outcome, diagnosis } => {
                self.study(records, outcome, diagnosis.as_deref()).pages()
            }
            Reported::Modes { analysis, diagnosis } => (self.modes(analysis, diagnosis.as_deref()).pages(), Vec::new()),
            Reported::Component { analysis, diagnosis } => {
                (self.component(analysis, diagnosis.as_deref(), |report| report.pages()), Vec::new())
            }
        }
    }

    fn study<'a>(
        &'a self,
        records: &'a RecordSet,
        outcome: &'a Outcome,
        diagnosis: Option<&'a Diagnosis>,
    ) -> Report<'a> {
        let Self { title, arrangement, command, .. } = self;
        Report { title, records, outcome, choice: None, command: command.as_deref(), diagnosis, arrangement }
    }

    /// The title: one's own, or the name of the data.
    fn heading(&self) -> &str {
        let own = self.arrangement.title.trim();
        if own.is_empty() { &self.title } else { own }
    }

    /// Does something with the report of a component.
    fn component<R>(
        &self,
        analysis: &ComponentAnalysis,
        diagnosis: Option<&DiagnosedComponent>,
        then: impl FnOnce(&ComponentReport<'_>) -> R,
    ) -> R {
        let model = diagnosis.map_or(&analysis.found.model, |d| d.found.last());
        let mut lacking = Vec::new();
        if let Some(diagnosis) = diagnosis {
            lacking.push(verdict(&diagnosis.found).to_owned());
            lacking.extend(diagnosis.found.steps.iter().flat_map(effect_lines));
            lacking.push(format!("Remaining: {}.", diagnosis.remaining()));
        }
        let (title, specimen, paper) = (self.heading(), &analysis.specimen, self.arrangement.paper);
        then(&ComponentReport { title, specimen, model, lacking: &lacking, paper })
    }

    fn modes<'a>(&'a self, analysis: &'a ModalAnalysis, diagnosis: Option<&'a StructureDiagnosis>) -> ModesReport<'a> {
        let title = self.heading();
        ModesReport { title, analysis, diagnosis, command: self.command.as_deref(), paper: self.arrangement.paper }
    }
}

/// The title of a report that has none of its own: the data's name without its ending.
pub(super) fn title(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(|| name.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// The command that makes the report of a project again, from the project's own folder.
fn command(project: &Path) -> String {
    let name = project.file_name().unwrap_or_default().to_string_lossy();
    let out = Path::new(&*name).with_extension("pdf");
    format!("sindyscope report {} --out {}", quoted(&name), quoted(&out.to_string_lossy()))
}
