//! The search for missing effects of each record of a batch.

use crate::error::AnalysisError;
use crate::missing::MissingRequest;
use crate::request::AnalysisRequest;
use sindyscope_core::study::SETTINGS;

/// Settings of a study that a search takes: the base model's terms, terms that are known besides, and where held-out records begin.
const TAKEN: [&str; 3] = ["terms", "lock", "initial"];

/// The search that settings ask for, as the options of `diagnose` do: `terms` is the base model, `lock` has known terms besides.
/// `identified` tells that an equation is identified besides, as a report has one: that takes the other settings.
///
/// # Errors
/// A setting that says how an equation is identified would go unheard.
pub fn missing_of_settings(
    study: &AnalysisRequest,
    max_effects: u8,
    identified: bool,
) -> Result<MissingRequest, AnalysisError> {
    let unheard = |name: &str| !identified && study.given.has(name) && !TAKEN.contains(&name);
    if let Some(row) = SETTINGS.iter().find(|row| unheard(row.name)) {
        let taken = TAKEN.join(", ");
        return Err(AnalysisError::Settings(format!(
            "`{}` says how an equation is identified, and changes nothing where missing effects are searched: that takes {taken}",
            row.name
        )));
    }
    let list = |name: &'static str| {
        move |text: &str| text.parse().map_err(|problem| AnalysisError::Value { name: name.to_owned(), problem })
    };
    let base = study.given.of("terms").last().map(list("terms")).transpose()?;
    let known = study.given.of("lock").map(list("lock")).collect::<Result<_, _>>()?;
    Ok(MissingRequest { base, known, max_effects, initial: study.initial()?, effects: Vec::new() })
}
