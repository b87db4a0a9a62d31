//! The search for missing effects as it is asked for.

use crate::analyse::{AnalysisListener, AnalysisProgress};
use crate::error::AnalysisError;
use crate::request::Terms;
use sindyscope_core::study::Cancel;
use sindyscope_search::{Ask, Diagnosis, OwnEffect, Search};
use sindyscope_values::model::Units;
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{Kind, Term};

/// Most effects that are added unless told otherwise.
pub const MAX_EFFECTS: u8 = 3;

/// What a search starts from, and where it ends at the latest.
#[derive(Clone, Debug, PartialEq)]
pub struct MissingRequest {
    /// Terms of the base model; none: linear springs and dampers.
    pub base: Option<Terms>,
    /// Known physics: terms that are in the base model besides.
    pub known: Vec<Terms>,
    /// Most effects that are added, one at a time.
    pub max_effects: u8,
    /// Samples of every held-out record that its initial state is estimated from, and that its score leaves out.
    pub initial: Option<usize>,
    /// Effects of one's own, looked for beside those of the catalogue.
    pub effects: Vec<OwnEffect>,
}

impl Default for MissingRequest {
    fn default() -> Self {
        Self { base: None, known: Vec::new(), max_effects: MAX_EFFECTS, initial: None, effects: Vec::new() }
    }
}

/// Walks through prepared records on its own.
///
/// # Errors
/// A base model that cannot be used or fitted, records that do not go together; cancelled.
pub fn search(
    request: &MissingRequest,
    records: &RecordSet,
    cancel: &Cancel,
    tell: AnalysisListener<'_>,
) -> Result<Diagnosis, AnalysisError> {
    let lists: Vec<Vec<Term>> = request.known.iter().map(Terms::for_all).collect::<Result<_, _>>()?;
    let mut ask = Ask {
        known: lists.concat(),
        max_effects: usize::from(request.max_effects),
        initial: request.initial,
        effects: request.effects.clone(),
        ..Ask::default()
    };
    for part in request.base.iter().flat_map(|terms| &terms.0) {
        let list = match part.freedom(Kind::SecondOrder).map_err(AnalysisError::Settings)? {
            None => ask.base.get_or_insert_default(),
            Some(mass) => ask.own.entry(mass).or_default(),
        };
        list.extend(part.entries.iter().cloned());
    }
    tell(AnalysisProgress::Stage("looking at the records"));
    let search = Search::prepare(records, &ask, cancel)?;
    if let Some((record, _)) = records.entries.first() {
        let layout = record.layout(Kind::SecondOrder);
        let units = Units::from_record(record, &layout);
        search.base_terms().try_for_each(|t| units.check(t, &layout)).map_err(AnalysisError::Settings)?;
    }
    let told = |progressed: sindyscope_search::Progress| {
        if let sindyscope_search::Progress::Step(what, share) = progressed {
            tell(AnalysisProgress::Share(what, share));
        }
    };
    Ok(search.diagnose(&told, cancel)?)
}
