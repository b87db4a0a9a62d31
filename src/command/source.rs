//! Where the records of a study come from: files, how they are read, and what is done to them before they are used.

use std::path::{Path, PathBuf};

use clap::error::Error;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};

use super::failure::Failure;
use super::shell::{quoted, seen_from};
use super::table;
use sindyscope_core::prepare::{Preparation, Treatment, crop_to_span, prepare, span};
use sindyscope_core::setting::{NamedValue, Setting, SettingForm, change, finite, named, positive};
use sindyscope_files::{ColumnMap, ReadOptions, read_set};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::Kind;

/// How files are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Reading {
    pub(super) columns: ColumnMap,
    pub(super) only_named: bool,
    pub(super) rate: Option<f64>,
    pub(super) kind: KindName,
}

/// What the equations are, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum KindName {
    #[default]
    SecondOrder,
    FirstOrder,
    /// As second order, each equation integrated once over time: short for that form of the equation.
    Integral,
}

impl From<KindName> for Kind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::SecondOrder | KindName::Integral => Self::SecondOrder,
            KindName::FirstOrder => Self::FirstOrder,
        }
    }
}

impl From<Kind> for KindName {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::SecondOrder => Self::SecondOrder,
            Kind::FirstOrder => Self::FirstOrder,
        }
    }
}

const KINDS: [NamedValue<KindName>; 3] = [
    NamedValue {
        value: KindName::SecondOrder,
        name: "second-order",
        label: "second order",
        help: "Displacements are given, velocities are derived",
    },
    NamedValue { value: KindName::FirstOrder, name: "first-order", label: "first order", help: "Every state is given" },
    NamedValue {
        value: KindName::Integral,
        name: "integral",
        label: "second order, integrated",
        help: "As second-order, every equation integrated once over time: velocities against integrals, `int(x)`",
    },
];

static READING: &[Setting<Reading>] = &[
    Setting {
        name: "columns",
        help: "Which column is which, where the header does not say: t=NAME,x=NAME,u=NAME,…",
        form: SettingForm::One("t=NAME,x=NAME,…"),
        read: |text| {
            let columns: ColumnMap = text.parse().map_err(|e: sindyscope_files::ColumnMapError| e.to_string())?;
            Ok(change(move |r: &mut Reading| r.columns = columns.clone()))
        },
        write: |r| Some(r.columns.to_string()).filter(|t| !t.is_empty()).into_iter().collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "only-named",
        help: "Ignore every column that --columns does not name, whatever the header says of it",
        form: SettingForm::Flag,
        read: |_| Ok(change(|r: &mut Reading| r.only_named = true)),
        write: |r| r.only_named.then(String::new).into_iter().collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "rate",
        help: "Sampling rate, Hz, for files without a time column",
        unit: "Hz",
        form: SettingForm::One("HZ"),
        read: |text| positive(text).map(|rate| change(move |r: &mut Reading| r.rate = Some(rate))),
        write: |r| r.rate.iter().map(f64::to_string).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "kind",
        help: "Displacements given and velocities derived, or every state given",
        default: "second-order",
        form: SettingForm::Names { placeholder: "KIND", names: &KINDS },
        read: |text| named(&KINDS, text).map(|kind| change(move |r: &mut Reading| r.kind = kind)),
        write: |r| KINDS.iter().filter(|c| c.value == r.kind).map(|c| c.name.into()).collect(),
        ..Setting::BLANK
    },
];

impl Reading {
    /// The options of the readers.
    pub(super) fn options(&self) -> ReadOptions {
        ReadOptions {
            columns: self.columns.clone(),
            only_named: self.only_named,
            rate: self.rate,
            kind: self.kind.into(),
            ..ReadOptions::default()
        }
    }
}

impl Args for Reading {
    fn augment_args(command: Command) -> Command {
        table::with_options(command, READING).mut_arg("only-named", |arg| arg.requires("columns"))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Reading {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut reading = Self::default();
        table::given(matches, READING).apply(&mut reading).map_err(table::unfit)?;
        Ok(reading)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// What is done to the records before they are used.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Preparing {
    /// The steps, in their order.
    pub(super) steps: Vec<Treatment>,
    /// Samples that are filled in where no more are missing together.
    pub(super) bridge: usize,
}

const PREPARATION_HEADING: &str = "Preparation";

/// A crop at the beginning and a part held out at the end have options of their own.
static PREPARATION: &[Setting<Preparing>] = &[
    Setting {
        name: "crop",
        group: PREPARATION_HEADING,
        help: "Use each record from T0 to T1 only, s; either may be left out: \"5:\"",
        unit: "s",
        form: SettingForm::Signed("T0:T1"),
        read: |text| crop_to_span(text).map(|step| change(move |p: &mut Preparing| p.steps.push(step))),
        write: |p| match p.steps.first() {
            Some(Treatment::Crop { from, to }) => vec![span(*from, *to)],
            _ => Vec::new(),
        },
        ..Setting::BLANK
    },
    Setting {
        name: "prepare",
        group: PREPARATION_HEADING,
        help: "Do this to each record, in this order, after --crop and before --hold-out: offset, trend, decimate=N, low-pass=HZ, \
               high-pass=HZ, band-pass=HZ:HZ (without a phase), spikes, split=N, split-at=T, align=a (or align=a:SECONDS), \
               gain=x2:1.02; where the order is another one also crop=T0:T1 and hold-out=SHARE",
        form: SettingForm::Many("STEP,…"),
        read: |text| {
            let steps: Vec<Treatment> = text
                .split(',')
                .map(|step| step.parse().map_err(|e: sindyscope_core::prepare::PrepareError| e.to_string()))
                .collect::<Result<_, String>>()?;
            Ok(change(move |p: &mut Preparing| p.steps.extend(&steps)))
        },
        write: |p| {
            let (_, between, _) = p.parts();
            let steps: Vec<String> = between.iter().map(|step| step.typed()).collect();
            if steps.is_empty() { Vec::new() } else { vec![steps.join(",")] }
        },
        ..Setting::BLANK
    },
    Setting {
        name: "hold-out",
        group: PREPARATION_HEADING,
        help: "Hold out this share of each record's end, as 0.3; files given with --test are held out instead",
        form: SettingForm::One("SHARE"),
        read: |text| {
            share(text).map(|share| change(move |p: &mut Preparing| p.steps.push(Treatment::HoldOut { share })))
        },
        write: |p| p.parts().2.iter().map(f64::to_string).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "bridge",
        group: PREPARATION_HEADING,
        help: "Fill in up to N samples that are missing together (lost, empty or NaN); a longer gap splits the record",
        unit: "samples",
        form: SettingForm::One("N"),
        read: |text| {
            let n = text.parse().map_err(|_| "it is a whole number of samples")?;
            Ok(change(move |p: &mut Preparing| p.bridge = n))
        },
        write: |p| vec![p.bridge.to_string()],
        ..Setting::BLANK
    },
];

/// A share between none and all.
fn share(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 && v < 1.0 { Ok(v) } else { Err("it lies between 0 and 1, as 0.3".into()) })
}

impl Preparing {
    /// A crop that comes first, the steps between, and a share held out at last.
    fn parts(&self) -> (Option<Treatment>, &[Treatment], Option<f64>) {
        let (crop, rest) = match self.steps.split_first() {
            Some((crop @ Treatment::Crop { .. }, rest)) => (Some(*crop), rest),
            _ => (None, self.steps.as_slice()),
        };
        match rest.split_last() {
            Some((Treatment::HoldOut { share }, between)) => (crop, between, Some(*share)),
            _ => (crop, rest, None),
        }
    }
}

/// Files, how they are read and how they are prepared: what gives the records of a study.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RecordSource {
    pub(super) data: Vec<PathBuf>,
    pub(super) test: Vec<PathBuf>,
    pub(super) reading: Reading,
    pub(super) preparing: Preparing,
}

impl RecordSource {
    /// Reads the records and prepares them.
    pub(super) fn read(&self) -> Result<RecordSet, Failure> {
        let options = ReadOptions { bridge: self.preparing.bridge, ..self.reading.options() };
        let set = read_set(&self.data, &self.test, &options)?;
        prepare(&set, &self.preparation()).map_err(|e| {
            Failure::new(e.to_string())
                .try_this("give other times with --crop, other steps with --prepare, or another share with --hold-out")
        })
    }

    /// What is done to the records: where files are held out, nothing of the others is.
    fn preparation(&self) -> Vec<Preparation> {
        let held_out = |step: &&Treatment| matches!(step, Treatment::HoldOut { .. }) && !self.test.is_empty();
        self.preparing.steps.iter().filter(|step| !held_out(step)).map(|step| (*step).into()).collect()
    }

    /// Says all of it, as words of a shell's command.
    pub(super) fn say(&self, command: &mut String) {
        let here = std::env::current_dir().unwrap_or_default();
        for (before, files) in [("", &self.data), (" --test", &self.test)] {
            if !files.is_empty() {
                command.push_str(before);
                command.extend(files.iter().map(|file| format!(" {}", typed(&here, file))));
            }
        }
        let plain = Self::default();
        table::say(command, READING, &self.reading, &plain.reading);
        table::say(command, PREPARATION, &self.preparing, &plain.preparing);
    }
}

/// A file as it is typed from a folder; a name that begins with a minus is no option.
pub(super) fn typed(here: &Path, file: &Path) -> String {
    let seen = seen_from(here, file);
    let seen = seen.to_string_lossy();
    quoted(&if seen.starts_with('-') { format!("./{seen}") } else { seen.into_owned() })
}

impl Args for RecordSource {
    fn augment_args(command: Command) -> Command {
        let files = |name: &'static str, help: &'static str| {
            Arg::new(name).value_parser(value_parser!(PathBuf)).num_args(1..).action(ArgAction::Append).help(help)
        };
        let data = files("data", "Measurements to fit: CSV, MATLAB, TDMS and other files");
        let test = files("test", "Held-out measurements: never fitted, only simulated and scored");
        let command = command.arg(data.value_name("DATA").required(true)).arg(test.long("test").value_name("FILE"));
        table::with_options(Reading::augment_args(command), PREPARATION)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for RecordSource {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let files = |name: &str| matches.get_many(name).into_iter().flatten().cloned().collect();
        let mut preparing = Preparing::default();
        table::given(matches, PREPARATION).apply(&mut preparing).map_err(table::unfit)?;
        Ok(Self { data: files("data"), test: files("test"), reading: Reading::from_arg_matches(matches)?, preparing })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}
