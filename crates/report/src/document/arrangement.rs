//! What a report holds and in which order: sections made from a study, and paragraphs of one's own between them.

use std::fmt::{self, Display};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A part of a report that is made from the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Section {
    /// The errors in large type, and what is to be known of the result.
    Summary,
    /// The equation of motion, typeset.
    Equation,
    /// Every coefficient with its standard error, unit and share.
    Coefficients,
    /// Stiffness, damping and friction in the words of mechanics, and the natural modes of several masses.
    Parameters,
    /// The errors of every record.
    Errors,
    /// Measured and identified response over time, with the error.
    Response,
    /// The phase portrait.
    Phase,
    /// The amplitude spectra of response and error.
    Spectrum,
    /// Restoring force and friction.
    Forces,
    /// What the residual still goes with.
    Residual,
    /// What the search for missing effects came to, and the base model it began with.
    Missing,
    /// How the gap falls from effect to effect.
    Waterfall,
    /// Each round of the search: where the gap sat, what was added, the candidates.
    Rounds,
    /// The response before and after what was added, with the model.
    Overlay,
    /// What is left, and what the data could not show.
    Remaining,
    /// The records.
    Records,
    /// The settings.
    Settings,
    /// The command that makes the report again.
    Command,
}

impl Section {
    /// Every section, in the order of a report that nobody has arranged.
    pub const ALL: [Self; 18] = [
        Self::Summary,
        Self::Equation,
        Self::Coefficients,
        Self::Parameters,
        Self::Errors,
        Self::Response,
        Self::Phase,
        Self::Spectrum,
        Self::Forces,
        Self::Residual,
        Self::Missing,
        Self::Waterfall,
        Self::Rounds,
        Self::Overlay,
        Self::Remaining,
        Self::Records,
        Self::Settings,
        Self::Command,
    ];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Summary => "summary",
            Self::Equation => "equation",
            Self::Coefficients => "coefficients",
            Self::Parameters => "parameters",
            Self::Errors => "errors",
            Self::Response => "response",
            Self::Phase => "phase",
            Self::Spectrum => "spectrum",
            Self::Forces => "forces",
            Self::Residual => "residual",
            Self::Missing => "missing",
            Self::Waterfall => "waterfall",
            Self::Rounds => "rounds",
            Self::Overlay => "overlay",
            Self::Remaining => "remaining",
            Self::Records => "records",
            Self::Settings => "settings",
            Self::Command => "command",
        }
    }

    /// What it is called where one chooses.
    pub fn label(self) -> &'static str {
        match self {
            Self::Summary => "Summary and warnings",
            Self::Equation => "Equation of motion",
            Self::Coefficients => "Coefficients",
            Self::Parameters => "Physical parameters",
            Self::Errors => "Errors of each record",
            Self::Response => "Response and error",
            Self::Phase => "Phase portrait",
            Self::Spectrum => "Spectrum",
            Self::Forces => "Restoring force, friction",
            Self::Residual => "Residual",
            Self::Missing => "What is missing",
            Self::Waterfall => "Fall of the gap",
            Self::Rounds => "Effects and candidates",
            Self::Overlay => "Response before and after",
            Self::Remaining => "What remains",
            Self::Records => "Records",
            Self::Settings => "Settings",
            Self::Command => "Command that repeats it",
        }
    }

    /// What it shows, in one sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Summary => "The errors in large type, and the warnings about this result",
            Self::Equation => "The identified equations as mathematics",
            Self::Coefficients => "A table of the coefficients with standard error, unit and share of the rate",
            Self::Parameters => "Natural frequency, damping, stiffness and friction, and the modes of several masses",
            Self::Errors => "A table of RMSE, NRMSE, largest error and best fit",
            Self::Response => "Measured and identified response over each other, the error beneath",
            Self::Phase => "Velocity over displacement, measured and identified",
            Self::Spectrum => "Amplitude spectra of measurement, model and error",
            Self::Forces => "Restoring force over deflection, and friction over velocity",
            Self::Residual => "Correlations of what the model leaves, with their 95 % bands",
            Self::Missing => "The verdict of the search for missing effects, and its base model",
            Self::Waterfall => "The gap between model and measurement after each effect that was added",
            Self::Rounds => "Where the gap sat, what was added with its parameters, and the table of the candidates",
            Self::Overlay => "The model with what was added, and its response beside the base model's",
            Self::Remaining => "Whether a gap is left, and what these data could not show",
            Self::Records => "A table of the records: file, use, samples, rate, channels, and what was mended",
            Self::Settings => "A table of all settings",
            Self::Command => "The command line that makes this report again",
        }
    }

    /// The heading that it stands under; none for the summary, which opens the report.
    pub fn heading(self) -> Option<&'static str> {
        match self {
            Self::Summary => None,
            Self::Equation | Self::Coefficients | Self::Parameters => Some("Equation of motion"),
            Self::Errors | Self::Response | Self::Phase | Self::Spectrum => Some("Response and error"),
            Self::Forces | Self::Residual => Some("Forces and residual"),
            Self::Missing | Self::Waterfall | Self::Rounds | Self::Overlay | Self::Remaining => Some("What is missing"),
            Self::Records => Some("Data"),
            Self::Settings | Self::Command => Some("Settings"),
        }
    }
}

impl Display for Section {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A sheet of paper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Paper {
    /// 210 mm × 297 mm.
    #[default]
    A4,
    /// 8.5 in × 11 in.
    Letter,
}

impl Paper {
    /// Width and height, mm.
    pub fn size(self) -> (f64, f64) {
        match self {
            Self::A4 => (210.0, 297.0),
            Self::Letter => (215.9, 279.4),
        }
    }
}

/// One entry of a report's contents.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Item {
    /// A section of the study.
    Section {
        /// Which one.
        section: Section,
        /// False if it is left out; it keeps its place in the list.
        shown: bool,
    },
    /// A text of one's own: paragraphs parted by blank lines; a line that begins with `# ` is a heading.
    Text {
        /// The text.
        text: String,
    },
}

/// The contents of a report in their order, and the paper it is printed on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Written")]
pub struct Arrangement {
    /// The report's title; empty: the name of the data.
    pub title: String,
    /// The paper.
    pub paper: Paper,
    /// Every section once, those that are left out too, and texts between them.
    pub items: Vec<Item>,
}

/// An arrangement as a file has it: of an older program it lacks sections, edited by hand it may have one twice.
#[derive(Deserialize)]
#[serde(default)]
struct Written {
    title: String,
    paper: Paper,
    items: Vec<Item>,
}

impl Default for Written {
    fn default() -> Self {
        let Arrangement { title, paper, items } = Arrangement::default();
        Self { title, paper, items }
    }
}

impl From<Written> for Arrangement {
    fn from(written: Written) -> Self {
        let Written { title, paper, items } = written;
        let mut seen = Vec::new();
        let mut items: Vec<Item> = items
            .into_iter()
            .filter(|item| match item {
                Item::Section { section, .. } if seen.contains(section) => false,
                Item::Section { section, .. } => {
                    seen.push(*section);
                    true
                }
                Item::Text { .. } => true,
            })
            .collect();
        let lacking = Section::ALL.into_iter().filter(|s| !seen.contains(s));
        items.extend(lacking.map(|section| Item::Section { section, shown: false }));
        Self { title, paper, items }
    }
}

impl Default for Arrangement {
    fn default() -> Self {
        let items = Section::ALL.map(|section| Item::Section { section, shown: true }).into();
        Self { title: String::new(), paper: Paper::default(), items }
    }
}

impl Arrangement {
    /// These sections in this order, and no others.
    pub fn of(sections: &[Section]) -> Self {
        let items = sections.iter().map(|&section| Item::Section { section, shown: true }).collect();
        Written { items, ..Written::default() }.into()
    }

    /// The sections that are shown, in their order.
    pub fn shown(&self) -> impl Iterator<Item = Section> {
        self.items.iter().filter_map(|item| match item {
            Item::Section { section, shown: true } => Some(*section),
            Item::Section { .. } | Item::Text { .. } => None,
        })
    }

    /// True if every section is shown, in the usual order and with no text between.
    pub fn is_usual(&self) -> bool {
        self.items == Self::default().items
    }

    /// Moves an entry to another place; entries between the two move by one. Places beyond the end mean the last.
    pub fn move_item(&mut self, from: usize, to: usize) {
        if from < self.items.len() {
            let item = self.items.remove(from);
            self.items.insert(to.min(self.items.len()), item);
        }
    }
}

/// A list of sections by their names, as it is typed: `equation, response, spectrum`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sections(pub Vec<Section>);

impl FromStr for Sections {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = |name: &str| {
            let found = Section::ALL.into_iter().find(|s| s.name() == name);
            found.ok_or_else(|| {
                let names: Vec<&str> = Section::ALL.iter().map(|s| s.name()).collect();
                format!("`{name}` is no section of a report; there are {}", names.join(", "))
            })
        };
        let names: Vec<&str> = text.split(',').map(str::trim).filter(|n| !n.is_empty()).collect();
        if names.is_empty() {
            return Err("name at least one section, as `equation, response`".into());
        }
        let sections = names.into_iter().map(named).collect::<Result<Vec<_>, _>>()?;
        match sections.iter().enumerate().find(|(k, s)| sections[..*k].contains(s)) {
            Some((_, twice)) => Err(format!("`{twice}` stands twice in the list")),
            None => Ok(Self(sections)),
        }
    }
}

impl Display for Sections {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.0.iter().map(|s| s.name()).collect();
        f.write_str(&names.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_section_is_there_once_whatever_a_file_says() {
        let text = r##"{"title": "Rig", "paper": "letter", "items": [
            {"section": "spectrum", "shown": true}, {"text": "# Words\nof mine"}, {"section": "spectrum", "shown": false}]}"##;
        let read: Arrangement = serde_json::from_str(text).expect("an arrangement");
        assert_eq!((read.title.as_str(), read.paper), ("Rig", Paper::Letter));
        assert_eq!(read.shown().collect::<Vec<_>>(), [Section::Spectrum], "what an older program did not know is off");
        assert_eq!(read.items.len(), Section::ALL.len() + 1);
        assert_eq!(read.items[1], Item::Text { text: "# Words\nof mine".into() });
        let again: Arrangement = serde_json::from_str(&serde_json::to_string(&read).expect("JSON")).expect("read");
        assert_eq!(again, read);
        let empty: Arrangement = serde_json::from_str("{}").expect("read");
        assert!(empty.is_usual());
    }

    #[test]
    fn an_entry_moves_past_others() {
        let mut arrangement = Arrangement::of(&[Section::Equation, Section::Spectrum, Section::Phase]);
        arrangement.move_item(2, 0);
        assert_eq!(arrangement.shown().collect::<Vec<_>>(), [Section::Phase, Section::Equation, Section::Spectrum]);
        arrangement.move_item(0, 99);
        assert_eq!(arrangement.shown().last(), Some(Section::Phase));
        arrangement.move_item(99, 0);
        assert_eq!(arrangement.items.len(), Section::ALL.len());
    }

    #[test]
    fn sections_are_named_on_the_command_line() {
        let sections: Sections = "response, equation ,".parse().expect("sections");
        assert_eq!(sections.0, [Section::Response, Section::Equation]);
        assert_eq!(sections.to_string(), "response, equation");
        for (text, said) in [("respnse", "there are summary, equation"), ("", "at least one"), ("phase,phase", "twice")]
        {
            let error = text.parse::<Sections>().expect_err("refused");
            assert!(error.contains(said), "{error}");
        }
        for section in Section::ALL {
            let quoted = serde_json::to_string(&section).expect("JSON");
            assert_eq!(quoted, format!("\"{}\"", section.name()), "one name everywhere");
        }
    }
}
