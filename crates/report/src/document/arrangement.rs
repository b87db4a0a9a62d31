//! What a report holds and in which order: sections made from a study, and paragraphs of one's own between them.

use std::fmt::{self, Display};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Declares [`Section`] from the list of sections: the name in files and commands, the heading that it stands under (none of
/// the summary, which opens the report), what it is called where one chooses, and what it shows.
macro_rules! sections {
    ($($section:ident: $name:literal, under $heading:literal: $label:literal, $shows:literal;)*) => {
        /// A part of a report that is made from the study.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Section {
            $(#[doc = $shows] $section,)*
        }

        impl Section {
            /// Every section, in the order of a report that nobody has arranged.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$section,)*];

            /// Name, heading, label and what it shows.
            fn told(self) -> [&'static str; 4] {
                match self {
                    $(Self::$section => [$name, $heading, $label, $shows],)*
                }
            }
        }
    };
}

sections! {
    Summary: "summary", under "": "Summary and warnings",
        "The errors in large type, and the warnings about this result";
    Equation: "equation", under "Equation of motion": "Equation of motion", "The identified equations as mathematics";
    Coefficients: "coefficients", under "Equation of motion": "Coefficients",
        "A table of the coefficients with standard error, unit and share of the rate";
    Parameters: "parameters", under "Equation of motion": "Physical parameters",
        "Natural frequency, damping, stiffness and friction, and the modes of several masses";
    Errors: "errors", under "Response and error": "Errors of each record",
        "A table of RMSE, NRMSE, largest error and best fit";
    Response: "response", under "Response and error": "Response and error",
        "Measured and identified response over each other, the error beneath";
    Phase: "phase", under "Response and error": "Phase portrait", "Velocity over displacement, measured and identified";
    Spectrum: "spectrum", under "Response and error": "Spectrum", "Amplitude spectra of measurement, model and error";
    Forces: "forces", under "Forces and residual": "Restoring force, friction",
        "Restoring force over deflection, and friction over velocity";
    Residual: "residual", under "Forces and residual": "Residual",
        "Correlations of what the model leaves, with their 95 % bands";
    Missing: "missing", under "What is missing": "What is missing",
        "The verdict of the search for missing effects, and its base model";
    Waterfall: "waterfall", under "What is missing": "Fall of the gap",
        "The gap between model and measurement after each effect that was added";
    Rounds: "rounds", under "What is missing": "Effects and candidates",
        "Where the gap sat, what was added with its parameters, and the table of the candidates";
    Overlay: "overlay", under "What is missing": "Response before and after",
        "The model with what was added, and its response beside the base model's";
    Remaining: "remaining", under "What is missing": "What remains",
        "Whether a gap is left, and what these data could not show";
    Records: "records", under "Data": "Records",
        "A table of the records: file, use, samples, rate, channels, and what was mended";
    Settings: "settings", under "Settings": "Settings", "A table of all settings";
    Command: "command", under "Settings": "Command that repeats it", "The command line that makes this report again";
}

impl Section {
    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        self.told()[0]
    }

    /// The heading that it stands under; none for the summary, which opens the report.
    pub fn heading(self) -> Option<&'static str> {
        Some(self.told()[1]).filter(|heading| !heading.is_empty())
    }

    /// What it is called where one chooses.
    pub fn label(self) -> &'static str {
        self.told()[2]
    }

    /// What it shows, in one sentence.
    pub fn tooltip(self) -> &'static str {
        self.told()[3]
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
