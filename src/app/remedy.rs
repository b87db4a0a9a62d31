//! What would help, in the window's words: there is a place for everything that the command line has options for.

use sindyscope_core::remedy::{Remedy, sentence};

/// Remedies in one sentence.
pub(super) fn worded(remedies: &[Remedy]) -> String {
    sentence(remedies, word)
}

fn word(remedy: &Remedy) -> String {
    match remedy {
        Remedy::NameColumns { .. } => "say which column is which under “Choose the columns…”".into(),
        Remedy::GiveRate { .. } => format!("{remedy} under “Choose the columns…”"),
        Remedy::OpenProject { .. } => "open it by itself".into(),
        Remedy::LeaveToData => "let it be chosen: “Choose for me”".into(),
        Remedy::LinearBase => "take the linear base model".into(),
        Remedy::OtherBase => "choose another base model above".into(),
        Remedy::FewerEffects => "undo the last effect".into(),
        Remedy::Modes => "identify it by its modes, as the command does".into(),
        Remedy::Identify { .. } | Remedy::Do(_) | Remedy::Settings { .. } | Remedy::Use { .. } => remedy.to_string(),
    }
}
