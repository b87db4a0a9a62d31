//! Where the records of a study come from: files, how they are read, and what is done to them before they are used.

use std::path::PathBuf;

use crate::error::AnalysisError;
use sindyscope_core::prepare::{Preparation, Treatment, crop_to_span, prepare, span};
use sindyscope_core::setting::{NamedValue, Setting, SettingForm, change, finite, named, positive};
use sindyscope_files::{ColumnMap, ReadOptions, read_set};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Kind;

/// How files are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// Which column is which, where the header does not say.
    pub columns: ColumnMap,
    /// Whether other columns are left out, whatever the header says of them.
    pub only_named: bool,
    /// Sampling rate of files without a time column, Hz.
    pub rate: Option<f64>,
    /// What the equations are.
    pub kind: KindName,
}

/// What the equations are, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KindName {
    /// Displacements are given, velocities are derived.
    #[default]
    SecondOrder,
    /// Every state is given.
    FirstOrder,
    /// As second order, each equation integrated once over time: short for that form of the equation.
    Integral,
    /// The force of a component along a given motion, without a mass.
    Component,
}

impl From<KindName> for Kind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::SecondOrder | KindName::Integral | KindName::Component => Self::SecondOrder,
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

const KINDS: [NamedValue<KindName>; 4] = [
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
    NamedValue {
        value: KindName::Component,
        name: "component",
        label: "component without a mass",
        help: "The force of a damper, mount or joint along a given motion is measured and predicted: columns F, x, v, u",
    },
];

/// The settings of [`Reading`].
pub static READING: &[Setting<Reading>] = &[
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
        help: "Ignore every column that is not named, whatever the header says of it",
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
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            columns: self.columns.clone(),
            only_named: self.only_named,
            rate: self.rate,
            kind: self.kind.into(),
            ..ReadOptions::default()
        }
    }
}

/// What is done to the records before they are used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Preparing {
    /// The steps, in their order.
    pub steps: Vec<Treatment>,
    /// Samples that are filled in where no more are missing together.
    pub bridge: usize,
}

const PREPARATION_HEADING: &str = "Preparation";

/// The settings of [`Preparing`]: a crop at the beginning and a part held out at the end have a row of their own.
pub static PREPARATION: &[Setting<Preparing>] = &[
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
        help: "Do this to each record, in this order, after the crop and before a share is held out: offset, trend, decimate=N, low-pass=HZ, \
               high-pass=HZ, band-pass=HZ:HZ (without a phase), mode=HZ:HZ (one mode as one mass), spikes, split=N, split-at=T, align=a (or align=a:SECONDS), \
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
        help: "Hold out this share of each record's end, as 0.3; records that are held out already stay alone with that",
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
pub struct RecordSource {
    /// Files that are fitted.
    pub data: Vec<PathBuf>,
    /// Files that are held out.
    pub test: Vec<PathBuf>,
    /// How files are read.
    pub reading: Reading,
    /// What is done to the records before they are used.
    pub preparing: Preparing,
}

impl RecordSource {
    /// Reads the files and prepares their records.
    ///
    /// # Errors
    /// A file that cannot be read; a step that cannot be done.
    pub fn read(&self) -> Result<RecordSet, AnalysisError> {
        let set = read_set(&self.data, &self.test, &self.read_options())?;
        self.prepared(&set)
    }

    /// How files are read: as their columns are named, with gaps as they are bridged.
    pub fn read_options(&self) -> ReadOptions {
        ReadOptions { bridge: self.preparing.bridge, ..self.reading.options() }
    }

    /// Records, of files or of elsewhere, prepared.
    ///
    /// # Errors
    /// A step that cannot be done.
    pub fn prepared(&self, set: &RecordSet) -> Result<RecordSet, AnalysisError> {
        let held_out_already = !self.test.is_empty() || set.with(Usage::HeldOut).next().is_some();
        let steps = self.preparing.steps.iter();
        let steps = steps.filter(|step| !(matches!(step, Treatment::HoldOut { .. }) && held_out_already));
        let steps: Vec<Preparation> = steps.map(|step| (*step).into()).collect();
        Ok(prepare(set, &steps)?)
    }
}
