//! What the state asks for beside messages: a study of the settings as they stand, and what the room in view shows.

use std::sync::Arc;

use super::change::{Update, Want, run};
use crate::app::component::{Asked, request};
use crate::app::derived::Derived;
use crate::app::jobs::{Job, Key};
use crate::app::questions::replies;
use crate::app::report::ReportSubject;
use crate::app::settings_map::SettingsMap;
use crate::app::state::{Edit, Room, State};
use sindyscope_modes::{Base, BaseModel, StructureDiagnosis};
use sindyscope_values::record::Usage;

/// Jobs on a chain of masses: where modes are the base they are in vain.
const OF_A_CHAIN: [Key; 4] = [Key::Fit, Key::Resample, Key::Answers, Key::Map];

/// Asks for everything that is in view and not there; `held` tells whether something is being dragged.
pub(crate) fn demand(state: &mut State, derived: &mut Derived, held: bool) -> Vec<Want> {
    run(state, derived, |update| {
        update.room();
        update.series();
        update.columns();
        if update.of_component() {
            update.component();
        } else if update.by_modes() {
            update.modes(held);
        } else {
            update.fit();
            update.settings_map();
            update.figures();
            if !held {
                update.resample();
            }
            update.answers(held);
        }
        update.teach();
    })
}

impl Update<'_> {
    fn room(&mut self) {
        match self.state.shown.room {
            Room::Identify => {}
            Room::Missing if self.by_modes() || self.of_component() => {}
            Room::Missing => self.attend_to_search(),
            Room::Rig => {
                if self.derived.rig.wants(&self.state.rig) {
                    let settings = Box::new(self.state.rig.settings.clone());
                    self.want(Key::Rig, Job::Rig { settings, usual_library: self.state.rig.usual_library });
                }
            }
            Room::Report => {
                // A walk that came back with its project is told in the report too.
                let walked =
                    !self.state.document.edit.walk.accepted.is_empty() || self.derived.missing.found().is_some();
                if walked && !self.by_modes() && !self.of_component() {
                    self.attend_to_search();
                }
                let derived = &mut *self.derived;
                let subject = ReportSubject::new(
                    self.state,
                    &derived.records,
                    &derived.missing,
                    (&derived.modal, &derived.component),
                );
                if let Some((content, width)) = derived.report.wanted(&subject) {
                    self.want(Key::Pages, Job::Pages { content: Box::new(content), width });
                }
            }
        }
    }

    fn attend_to_search(&mut self) {
        let (edit, view) = (&self.state.document.edit, &mut self.state.shown.walk);
        let wanted = self.derived.missing.attend(&self.derived.records, edit, view);
        self.search(wanted);
    }

    /// Asks for a study if what was asked last is no longer what is wanted. A walk decides nothing of it.
    fn fit(&mut self) {
        let (records, edit) = (&self.derived.records, &self.state.document.edit);
        let same = |(generation, asked): &(u64, Edit)| {
            *generation == records.generation && (&asked.settings, &asked.usage) == (&edit.settings, &edit.usage)
        };
        if records.records.is_empty() || self.derived.asked.as_ref().is_some_and(same) {
            return;
        }
        self.derived.asked = Some((records.generation, edit.clone()));
        // What is known of the terms is of other settings.
        self.cancel(Key::Resample);
        let (records, settings) = self.study();
        let is_first = self.derived.records.outcome.is_none();
        self.want(Key::Fit, Job::Fit { records, settings, is_first });
    }

    fn by_modes(&self) -> bool {
        self.state.document.edit.base.model == BaseModel::Modes
    }

    fn of_component(&self) -> bool {
        self.state.document.edit.component
    }

    /// Stops the jobs on a chain of masses; they are asked for again where the chain is the base again.
    fn leave_the_chain(&mut self) {
        for key in OF_A_CHAIN {
            if self.derived.running.contains_key(&key) {
                self.cancel(key);
                self.derived.asked = None;
            }
        }
    }

    /// What the force of a component belongs to now.
    fn component_wanted(&self) -> Asked {
        let edit = &self.state.document.edit;
        (self.derived.records.generation, edit.usage.clone(), edit.force.clone())
    }

    /// Asks for the force of a component.
    fn component(&mut self) {
        self.leave_the_chain();
        let wanted = self.component_wanted();
        if self.derived.component.search.is_of_others(&wanted) {
            self.component_search(false);
        }
        if self.derived.records.records.is_empty() {
            return;
        }
        if self.derived.component.coming() {
            self.component_search(true);
        }
        if self.derived.component.fit.is_of(&wanted) {
            return;
        }
        self.derived.component.fit.begin(wanted);
        let (records, _) = self.study();
        let document = &self.state.document;
        let source = request(&document.reading, document.edit.force.as_deref());
        self.want_instead(Key::Component, Job::Component { records, source });
    }

    /// Begins or stops the search for what the force of a component lacks.
    pub(super) fn component_search(&mut self, begins: bool) {
        if !begins {
            self.derived.component.search.stop();
            return self.cancel(Key::ComponentSearch);
        }
        let wanted = self.component_wanted();
        self.derived.component.search.begin(wanted);
        let (records, _) = self.study();
        let document = &self.state.document;
        let source = request(&document.reading, document.edit.force.as_deref());
        self.want_instead(Key::ComponentSearch, Job::ComponentSearch { records, source });
    }

    /// What modes and a search belong to now.
    fn modes_wanted(&self) -> (u64, Base, Vec<Usage>) {
        let edit = &self.state.document.edit;
        (self.derived.records.generation, edit.base.clone(), edit.usage.clone())
    }

    /// Begins or stops the search for the force that the modes lack.
    pub(super) fn modal_search(&mut self, begins: bool) {
        if begins {
            return self.search_structure(None);
        }
        self.derived.modal.search.stop();
        self.cancel(Key::ModalSearch);
    }

    /// Searches for the force that the modes lack, or shows again what was kept of such a search.
    fn search_structure(&mut self, kept: Option<Arc<StructureDiagnosis>>) {
        let wanted = self.modes_wanted();
        let base = wanted.1.clone();
        self.derived.modal.search.begin(wanted);
        let (records, _) = self.study();
        self.want_instead(Key::ModalSearch, Job::ModalSearch { records, base, kept });
    }

    /// Asks for the modes of a structure if what was asked last is no longer what is wanted, and for the figure in view.
    fn modes(&mut self, held: bool) {
        self.leave_the_chain();
        let wanted = self.modes_wanted();
        if self.derived.modal.search.is_of_others(&wanted) {
            self.modal_search(false);
        }
        if !self.derived.records.records.is_empty()
            && let Some(kept) = self.derived.modal.coming()
        {
            self.search_structure(Some(kept));
        }
        if !held && !self.derived.records.records.is_empty() && self.derived.modal.wants(wanted) {
            let base = self.state.document.edit.base.clone();
            let (records, _) = self.study();
            self.want_instead(Key::Modes, Job::Modes { records, base });
        }
        let shown = &self.state.shown;
        if shown.room == Room::Identify
            && let Some(request) = self.derived.modal.attend(&shown.modal, &self.derived.records, shown.record)
        {
            self.want(Key::ModalFigure(request.view), Job::ModalFigure(Box::new(request)));
        }
    }

    /// Asks for the map of settings while a view shows it.
    fn settings_map(&mut self) {
        let derived = &mut *self.derived;
        if derived.records.records.is_empty() {
            if derived.running.contains_key(&Key::Map) {
                self.cancel(Key::Map);
            }
            self.derived.map = SettingsMap::default();
        } else if self.state.shown.view.needs_map()
            && derived.records.outcome.is_some()
            && derived.map.wants(derived.records.generation, &self.state.document.edit)
        {
            let (records, settings) = self.study();
            self.want_instead(Key::Map, Job::Map { records, settings });
        }
    }

    /// Makes the figure of the view that is shown; asks for it where that takes longer than a frame.
    fn figures(&mut self) {
        let shown = &self.state.shown;
        let mut figures = std::mem::take(&mut self.derived.figures);
        let pins = self.derived.records.known_pins().1;
        let picture = self.derived.picture(shown, &pins).filter(|_| shown.room == Room::Identify);
        let wanted = picture.and_then(|picture| figures.attend(shown.view, &picture, &shown.views.options));
        self.derived.figures = figures;
        if let Some(request) = wanted {
            self.want(Key::Figure(request.view), Job::Figure(Box::new(request)));
        }
    }

    fn columns(&mut self) {
        let wanted = self.derived.columns.wanted();
        self.read_columns(wanted);
    }

    /// Repeats the regression on resampled data once the outcome is there.
    fn resample(&mut self) {
        let records = &self.derived.records;
        let Some(outcome) = records.outcome.as_ref().filter(|_| !self.derived.is_stale()) else { return };
        if self.derived.resampled.as_ptr() == Arc::as_ptr(outcome) {
            return;
        }
        self.derived.resampled = Arc::downgrade(outcome);
        let (records, settings) = self.study();
        self.want_instead(Key::Resample, Job::Resample { records, settings });
    }

    /// Asks what the answers to the open questions would buy, once the outcome is there and nothing is being dragged.
    fn answers(&mut self, held: bool) {
        let (derived, edit) = (&mut *self.derived, &self.state.document.edit);
        let kind = edit.settings.kind;
        let open = self.state.shown.room == Room::Identify && edit.settings.known.is_empty();
        let records = &derived.records;
        let replies = if open { replies(&records.layout(kind), &records.units(kind)) } else { Vec::new() };
        if replies.is_empty() {
            if derived.questions.forget() {
                self.cancel(Key::Answers);
            }
        } else if derived.running.contains_key(&Key::Fit) {
            // The fit comes first, and makes the answers out of date.
            if derived.running.contains_key(&Key::Answers) {
                derived.questions.give_way();
                self.cancel(Key::Answers);
            }
        } else if !held && records.outcome.is_some() && derived.questions.wants(records.generation, edit) {
            let (records, settings) = self.study();
            self.want_instead(Key::Answers, Job::Answers { records, settings, replies });
        }
    }
}
