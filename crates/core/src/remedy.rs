//! What would help where something is wrong, as values: the command line words them as options, the window as buttons.

use std::borrow::Cow;

use crate::study::settings::Settings;
use sindyscope_values::record::Usage;

/// Something that a person can do about what is wrong.
#[derive(Clone, Debug, PartialEq)]
pub enum Remedy {
    /// Something that no setting does, as with the file or at the sensor: an imperative without a full stop.
    Do(Cow<'static, str>),
    /// Say which column is which.
    NameColumns {
        /// For example: what it is (`t`, `x2`), and the column's name or number.
        columns: Vec<(String, String)>,
        /// Whether no other column is to be used.
        only: bool,
        /// Whether the sampling rate has to be given with them.
        rate: bool,
    },
    /// Give the sampling rate.
    GiveRate {
        /// Where it is of use only if something is so, that; else empty.
        when: &'static str,
    },
    /// Open a saved project in the window.
    OpenProject {
        /// The project's file.
        file: String,
    },
    /// Leave a setting to be chosen from the data.
    LeaveToData,
    /// Start the search for missing effects from a linear spring and damper.
    LinearBase,
    /// Start it from another base model.
    OtherBase,
    /// End it before an effect that cannot be fitted.
    FewerEffects,
    /// Identify the equation, which takes more terms than a search's base model or shows which suit the records.
    Identify {
        /// What that gives: `shows which terms suit the records`.
        what: &'static str,
    },
    /// Identify a structure by its modes, not by the masses under its sensors.
    Modes,
    /// Take these settings over.
    Settings {
        /// What is changed, as a button says it.
        label: String,
        /// All of them.
        settings: Box<Settings>,
    },
    /// Use a record differently.
    Use {
        /// What is changed, as a button says it.
        label: String,
        /// The record, by its index in the set.
        record: usize,
        /// What for.
        usage: Usage,
    },
}

impl Remedy {
    /// Something to do.
    pub fn to_do(what: impl Into<Cow<'static, str>>) -> Self {
        Self::Do(what.into())
    }

    /// Say which column is which, as for these.
    pub fn columns<K: Into<String>, C: Into<String>>(columns: impl IntoIterator<Item = (K, C)>) -> Self {
        let columns = columns.into_iter().map(|(key, column)| (key.into(), column.into())).collect();
        Self::NameColumns { columns, only: false, rate: false }
    }

    /// How it is asked for to say which column is which.
    pub fn naming(columns: &[(String, String)]) -> &'static str {
        let by_number = !columns.is_empty() && columns.iter().all(|(_, column)| column.parse::<usize>().is_ok());
        if by_number { "give the columns by number" } else { "say which column is which" }
    }

    /// Give the sampling rate.
    pub fn rate() -> Self {
        Self::GiveRate { when: "" }
    }
}

impl std::fmt::Display for Remedy {
    /// In plain words, for whoever has neither options nor buttons.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Do(what) => f.write_str(what),
            Self::NameColumns { columns, only, rate } => {
                f.write_str(Self::naming(columns))?;
                for (k, (key, column)) in columns.iter().enumerate() {
                    write!(f, "{}{key}={column}", if k == 0 { ": " } else { "," })?;
                }
                f.write_str(if *only { ", and use no other" } else { "" })?;
                f.write_str(if *rate { ", with the sampling rate" } else { "" })
            }
            Self::GiveRate { when: "" } => f.write_str("give the sampling rate in hertz"),
            Self::GiveRate { when } => write!(f, "if {when}, give the sampling rate in hertz"),
            Self::OpenProject { file } => {
                write!(f, "open {file} in the window, or take the measurements that it names")
            }
            Self::LeaveToData => f.write_str("leave the setting to be chosen from the data"),
            Self::LinearBase => f.write_str("start from a linear spring and damper"),
            Self::OtherBase => f.write_str("start from another base model"),
            Self::FewerEffects => f.write_str("stop before that effect"),
            Self::Modes => f.write_str("identify it by its modes"),
            Self::Identify { what } => write!(f, "identify the equation, which {what}"),
            Self::Settings { label, .. } | Self::Use { label, .. } => f.write_str(label),
        }
    }
}

/// Remedies in one sentence, as `word` words each; of two that begin alike up to a colon the beginning is said once.
pub fn sentence(remedies: &[Remedy], word: impl Fn(&Remedy) -> String) -> String {
    let mut text = String::new();
    let mut before = None;
    for worded in remedies.iter().map(word) {
        text.push_str(if text.is_empty() { "" } else { ", or " });
        match worded.split_once(": ") {
            Some((beginning, rest)) if before.as_deref() == Some(beginning) => text.push_str(rest),
            _ => text.push_str(&worded),
        }
        before = worded.split_once(": ").map(|(beginning, _)| beginning.to_owned());
    }
    text
}
