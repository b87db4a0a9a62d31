//! What was found of a component.

use crate::app::answer::Answer;
use crate::app::plot::figures::Figures;
use sindyscope_analysis::component::{ComponentAnalysis, DiagnosedComponent};
use sindyscope_analysis::{KindName, Reading, RecordSource};
use sindyscope_component::{ComponentModel, Specimen};
use sindyscope_files::ReadOptions;
use sindyscope_values::record::Usage;

/// What an answer belongs to: the records' generation, what each record is used for, and the channel that was said to be the force.
pub(crate) type Asked = (u64, Vec<Usage>, Option<String>);

/// What was found of a component.
#[derive(Debug, Default)]
pub(crate) struct ComponentRoom {
    /// The force.
    pub(crate) fit: Answer<Asked, ComponentAnalysis>,
    /// What it lacks.
    pub(crate) search: Answer<Asked, DiagnosedComponent>,
    /// Whether that was looked for before the window was closed, until it is looked for again.
    coming: bool,
}

/// What the drawing keeps.
pub(crate) type ComponentCanvas = Figures;

/// The source by which the analysis knows which channel is the force: the one that a person said it is, or that was named when
/// the file was read.
pub(crate) fn request(reading: &ReadOptions, force: Option<&str>) -> RecordSource {
    let named = reading.columns.clone();
    let columns = match force {
        Some(name) => named.with_force(name),
        None => named,
    };
    let reading = Reading { columns, kind: KindName::Component, ..Reading::default() };
    RecordSource { reading, ..RecordSource::default() }
}

impl ComponentRoom {
    /// Awaits what the session or a project knows of the search.
    pub(crate) fn bring_back(&mut self, searched: bool) {
        self.search.stop();
        self.coming = searched;
    }

    /// Whether to look again for what was found before, once.
    pub(crate) fn coming(&mut self) -> bool {
        std::mem::take(&mut self.coming)
    }

    /// Whether it was looked for what the force lacks.
    pub(crate) fn searched(&self) -> bool {
        self.coming || self.search.found().is_some()
    }

    /// The component with the model that Identify shows.
    pub(crate) fn identified(&self) -> Option<(&Specimen, &ComponentModel)> {
        self.fit.found().map(|analysis| (&analysis.specimen, &analysis.found.model))
    }

    /// The component with the model that "What's missing" came to.
    pub(crate) fn diagnosed(&self) -> Option<(&Specimen, &ComponentModel)> {
        self.search.found().map(|found| (&found.specimen, found.found.last()))
    }
}
