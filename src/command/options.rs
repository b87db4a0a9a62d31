//! The options that every command which runs a study takes.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::{Args, ValueEnum};

use super::failure::Failure;
use crate::command::shell::{quoted, seen_from};
use sindyscope_core::prepare::{self, Preparation, Treatment};
use sindyscope_core::signal::TestFunction;
use sindyscope_core::study::{
    Calibration, Differentiation, Formulation, Kinematics, Known, Lock, Regressor, Scaling, Settings, force_over_mass,
};
use sindyscope_files::{ColumnMap, ReadOptions, read_set};
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{EquationEntries, Kind, Term, by_equation, is_integral, rate};

/// Data, and how they are read.
#[derive(Debug, Args)]
pub(super) struct DataOptions {
    /// Measurements to fit: CSV, MATLAB, TDMS and other files
    #[arg(required = true, value_name = "DATA")]
    pub(super) data: Vec<PathBuf>,
    /// Held-out measurements: never fitted, only simulated and scored
    #[arg(long, num_args = 1.., value_name = "FILE")]
    pub(super) test: Vec<PathBuf>,
    /// Which column is which, where the header does not say: t=NAME,x=NAME,u=NAME,…
    #[arg(long, value_name = "t=NAME,x=NAME,…")]
    columns: Option<ColumnMap>,
    /// Ignore every column that --columns does not name, whatever the header says of it
    #[arg(long, requires = "columns")]
    only_named: bool,
    /// Sampling rate, Hz, for files without a time column
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Displacements given and velocities derived, or every state given
    #[arg(long, value_enum, default_value_t)]
    pub(super) kind: KindName,

    /// Use each record from T0 to T1 only, s; either may be left out: "5:"
    #[arg(long, value_name = "T0:T1", allow_hyphen_values = true, help_heading = "Preparation")]
    crop: Option<Span>,
    /// Do this to each record, in this order, after --crop and before --hold-out: offset, trend, decimate=N, low-pass=HZ,
    /// high-pass=HZ, band-pass=HZ:HZ (without a phase), spikes, split=N, split-at=T, align=a (or align=a:SECONDS)
    #[arg(long, value_name = "STEP,…", value_delimiter = ',', help_heading = "Preparation")]
    prepare: Vec<Treatment>,
    /// Hold out this share of each record's end, as 0.3; files given with --test are held out instead
    #[arg(long, value_name = "SHARE", value_parser = share, allow_negative_numbers = true, help_heading = "Preparation")]
    hold_out: Option<f64>,
    /// Fill in up to N samples that are missing together (lost, empty or NaN); a longer gap splits the record
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, help_heading = "Preparation")]
    bridge: usize,
}

/// Data, and how it is identified.
#[derive(Debug, Args)]
pub(super) struct StudyOptions {
    #[command(flatten)]
    pub(super) data: DataOptions,

    /// Candidate terms of every acceleration (first order: of every state): "x, v, u, x^3, sgn(v)"; or of each its own:
    /// "v1: x1, x2-x1, u; v2: x2-x1" [default: by the kind of data]
    #[arg(long, value_name = "LIST", help_heading = "Library")]
    terms: Option<Terms>,
    /// Terms kept whatever the threshold: known physics; of all equations or of each, as in --terms
    #[arg(long, value_name = "LIST", help_heading = "Library")]
    lock: Vec<Terms>,
    /// Terms never used; of all equations or of each
    #[arg(long, value_name = "LIST", help_heading = "Library")]
    drop: Vec<Terms>,
    /// A term kept at a coefficient that is known; of one equation alone: "v2: x2-x1=-600"
    #[arg(long, value_name = "TERM=VALUE", help_heading = "Library")]
    fix: Vec<FixedTerms>,
    /// Known physics: x=-u (one spring across the joint), v=-du, v<=0, x>=0, passive, odd or even (stiffness), u=1/m,
    /// m2/m1 or m2/m1=0.5 (forces between two masses are equal and opposite); of
    /// all equations or of each: "v2: x2-x1<=0"
    #[arg(long, value_name = "LIST", help_heading = "Physics")]
    constrain: Vec<Constraints>,
    /// Find this with the equation and take it out of the records, fitting the response: how late a channel is, delay(u) or
    /// delay(x2); by how much a sensor shows too much, gain(x2)
    #[arg(long, value_name = "LIST", value_delimiter = ',', help_heading = "Physics")]
    pub(super) estimate: Vec<Calibration>,
    /// The moving mass, kg: coefficients are told as forces too
    #[arg(long, value_name = "KG", value_parser = positive, allow_negative_numbers = true, help_heading = "Physics")]
    mass: Option<f64>,

    /// Smoothing segment, samples: odd; of ways without segments the period of which half the amplitude passes [default: chosen from the data]
    #[arg(long, value_name = "N", value_parser = odd, help_heading = "Smoothing")]
    pub(super) window: Option<usize>,
    /// Order of the smoothing polynomial [default: chosen from the data]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=12), help_heading = "Smoothing")]
    order: Option<u8>,
    /// How velocities and accelerations are made [default: filter]
    #[arg(long, alias = "method", value_enum, value_name = "NAME", help_heading = "Smoothing")]
    differentiation: Option<MethodName>,
    /// Do not pass the library's columns through the filter that the displacement went through
    #[arg(long, help_heading = "Smoothing")]
    unfiltered_library: bool,

    /// How the equation is held against the data [default: chosen by held-out simulation error]
    #[arg(long, value_enum, value_name = "FORM", help_heading = "Regression")]
    form: Option<FormName>,
    /// Half width of the weak form's test functions, samples [default: chosen from the data]
    #[arg(long, value_name = "N", value_parser = half_width, help_heading = "Regression")]
    half_width: Option<usize>,
    /// The way to a sparse equation [default: stlsq]
    #[arg(long, value_enum, value_name = "NAME", help_heading = "Regression")]
    regressor: Option<RegressorName>,
    /// Terms below it are dropped [default: chosen by held-out simulation error]
    #[arg(long, value_name = "V", value_parser = not_negative, allow_negative_numbers = true, help_heading = "Regression")]
    pub(super) threshold: Option<f64>,
    /// Weight α of the ridge penalty [default: 0]
    #[arg(long, value_name = "V", value_parser = not_negative, allow_negative_numbers = true, help_heading = "Regression")]
    ridge: Option<f64>,
    /// What the threshold is compared with: shares of the rate, or coefficients as they stand [default: scaled]
    #[arg(long, value_enum, value_name = "WAY", help_heading = "Regression")]
    scaling: Option<ScalingName>,
    /// Fit dx/dt from the library too, instead of taking dx/dt = v as known
    #[arg(long, help_heading = "Regression")]
    fit_kinematics: bool,
    /// Fit the coefficients of the terms that are kept to the response itself (output error) [default: where that lowers
    /// the held-out error much]
    #[arg(long, value_enum, value_name = "WHETHER", num_args = 0..=1, default_missing_value = "yes", require_equals = true,
          help_heading = "Regression")]
    refine: Option<Whether>,

    /// Write the result as JSON (`-`: to standard output, and nothing else there)
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub(super) json: Option<PathBuf>,
}

impl DataOptions {
    fn reading(&self) -> ReadOptions {
        ReadOptions {
            columns: self.columns.clone().unwrap_or_default(),
            only_named: self.only_named,
            rate: self.rate,
            kind: self.kind.into(),
            bridge: self.bridge,
            ..ReadOptions::default()
        }
    }

    /// Reads the records and prepares them.
    pub(super) fn read(&self) -> Result<RecordSet, Failure> {
        let set = read_set(&self.data, &self.test, &self.reading())?;
        prepare::prepare(&set, &self.preparation()).map_err(|e| {
            Failure::new(e.to_string())
                .try_this("give other times with --crop, other steps with --prepare, or another share with --hold-out")
        })
    }

    /// What is done to the records before they are used.
    fn preparation(&self) -> Vec<Preparation> {
        let crop = self.crop.map(|Span { from, to }| Treatment::Crop { from, to });
        let hold_out = self.hold_out.filter(|_| self.test.is_empty()).map(|share| Treatment::HoldOut { share });
        let steps = self.prepare.iter().copied();
        crop.into_iter().chain(steps).chain(hold_out).map(Into::into).collect()
    }
}

impl StudyOptions {
    /// Whether smoothing uses a segment at all.
    fn smooths(&self) -> bool {
        self.differentiation != Some(MethodName::Difference)
    }

    /// Whether the segment length is left to the data.
    pub(super) fn window_is_free(&self) -> bool {
        self.window.is_none() && self.smooths()
    }

    /// Whether the order is left to the data.
    pub(super) fn order_is_free(&self) -> bool {
        let method = self.differentiation.map_or_else(Differentiation::default, Into::into);
        self.order.is_none() && method.is_local()
    }

    /// Whether the form is left to the data: who gives a smoothing means the derivatives that it makes.
    pub(super) fn form_is_free(&self) -> bool {
        self.data.kind != KindName::Integral && self.rows_are_free()
    }

    /// Whether neither a form nor a smoothing is given.
    fn rows_are_free(&self) -> bool {
        self.form.is_none() && self.half_width.is_none() && self.window_is_free() && self.order_is_free()
    }

    /// Whether refinement is left to the data: who gives a smoothing or a threshold means what they make.
    pub(super) fn refinement_is_free(&self) -> bool {
        self.refine.is_none() && self.rows_are_free() && self.threshold.is_none()
    }

    /// Puts what was asked for over what was suggested.
    pub(super) fn apply(&self, settings: &mut Settings) -> Result<(), Failure> {
        settings.kind = self.data.kind.into();
        self.apply_lists(settings).map_err(Failure::new)?;
        if let Some(method) = self.differentiation {
            settings.smoothing.method = method.into();
        }
        if self.unfiltered_library {
            settings.smoothing.filter_library = false;
        }
        let smoothing = &mut settings.smoothing;
        match (self.window, self.order.map(usize::from)) {
            (Some(window), Some(order)) => (smoothing.window, smoothing.order) = (window, order),
            // The one that is free makes room for the one that is given.
            (Some(window), None) => {
                (smoothing.window, smoothing.order) = (window, smoothing.order.min(window.saturating_sub(1)));
            }
            (None, Some(order)) => (smoothing.window, smoothing.order) = (smoothing.window.max((order + 1) | 1), order),
            (None, None) => {}
        }
        if let Some(window) = self.window {
            *smoothing = smoothing.with_window(window);
        }
        match (self.form, self.half_width) {
            (Some(FormName::Derivative), _) => settings.form = Formulation::Derivative,
            (Some(FormName::Integral), _) => settings.form = Formulation::Integral,
            (None, _) if self.data.kind == KindName::Integral => settings.form = Formulation::Integral,
            (Some(FormName::Weak), half_width) => settings.form = Formulation::Weak { half_width },
            // Only the weak form has test functions.
            (None, Some(half_width)) => settings.form = Formulation::Weak { half_width: Some(half_width) },
            (None, None) => {}
        }
        if let Some(regressor) = self.regressor {
            settings.regressor = regressor.into();
        }
        if let Some(threshold) = self.threshold {
            settings.threshold = threshold;
        }
        if let Some(ridge) = self.ridge {
            settings.ridge = ridge;
        }
        if let Some(scaling) = self.scaling {
            settings.scaling = scaling.into();
        }
        if self.fit_kinematics {
            settings.kinematics = Kinematics::Fitted;
        }
        settings.mass = self.mass;
        if let Some(refine) = self.refine {
            settings.refine = refine == Whether::Yes;
        }
        Ok(())
    }

    /// What is asked of terms, for all equations and for each.
    fn apply_lists(&self, settings: &mut Settings) -> Result<(), String> {
        let kind = settings.kind;
        for part in self.terms.iter().flat_map(|t| &t.0) {
            match part.freedom(kind)? {
                None => settings.terms.clone_from(&part.entries),
                Some(i) => settings.own.entry(i).or_default().terms = Some(part.entries.clone()),
            }
        }
        for (lists, lock) in [(&self.lock, Lock::In), (&self.drop, Lock::Out)] {
            for part in lists.iter().flat_map(|t| &t.0) {
                let freedom = part.freedom(kind)?;
                let locks = settings.own_locks(freedom);
                locks.extend(part.entries.iter().map(|t| (t.clone(), lock)));
            }
        }
        for part in self.fix.iter().flat_map(|f| &f.0) {
            let freedom = part.freedom(kind)?;
            let locks = settings.own_locks(freedom);
            locks.extend(part.entries.iter().map(|f| (f.term.clone(), Lock::Fixed(f.value))));
        }
        for part in self.constrain.iter().flat_map(|c| &c.known) {
            match part.freedom(kind)? {
                None => settings.known.extend(part.entries.iter().cloned()),
                Some(i) => settings.own.entry(i).or_default().known.extend(part.entries.iter().cloned()),
            }
        }
        Ok(())
    }

    /// Fixes the force's coefficient where `u=1/m` asks for it.
    pub(super) fn apply_mass(&self, settings: &mut Settings, records: &RecordSet) -> Result<(), Failure> {
        if !self.constrain.iter().any(|c| c.unit_mass) {
            return Ok(());
        }
        let Some(mass) = self.mass else {
            return Err(Failure::new("`u=1/m` needs the mass").try_this("say it with --mass KG"));
        };
        let coefficient = records.entries.first().and_then(|(record, _)| force_over_mass(record, mass));
        let Some(coefficient) = coefficient else {
            return Err(Failure::new("`u=1/m` needs one input that is a force in newtons")
                .try_this("give the column a unit, as `u [N]`, or fix the coefficient itself: --fix u=VALUE"));
        };
        let force = Term::parse("u").map_err(|e| Failure::new(e.to_string()))?;
        settings.locks.insert(force, Lock::Fixed(coefficient));
        Ok(())
    }

    /// The command that does the same with nothing left to choose.
    pub(super) fn command(&self, name: &str, settings: &Settings, out: Option<&Path>) -> String {
        let mut text = format!("sindyscope {name}");
        let here = std::env::current_dir().unwrap_or_default();
        let typed = |path: &Path| quoted(&seen_from(&here, path).to_string_lossy());
        let files = |text: &mut String, files: &[PathBuf]| {
            for file in files {
                let _ = write!(text, " {}", typed(file));
            }
        };
        files(&mut text, &self.data.data);
        if !self.data.test.is_empty() {
            text.push_str(" --test");
            files(&mut text, &self.data.test);
        }
        let mut option = |name: &str, value: &str| {
            let _ = write!(text, " --{name} {}", quoted(value));
        };
        if let Some(columns) = &self.data.columns {
            option("columns", &columns.to_string());
        }
        if self.data.only_named {
            text.push_str(" --only-named");
        }
        let mut option = |name: &str, value: &str| {
            let _ = write!(text, " --{name} {}", quoted(value));
        };
        if let Some(rate) = self.data.rate {
            option("rate", &rate.to_string());
        }
        if let Some(crop) = &self.data.crop {
            option("crop", &crop.to_string());
        }
        let steps: Vec<String> = self.data.prepare.iter().filter_map(|step| step.typed()).collect();
        if !steps.is_empty() {
            option("prepare", &steps.join(","));
        }
        if let Some(share) = self.data.hold_out.filter(|_| self.data.test.is_empty()) {
            option("hold-out", &share.to_string());
        }
        if self.data.bridge > 0 {
            option("bridge", &self.data.bridge.to_string());
        }
        if settings.kind == Kind::FirstOrder {
            option("kind", "first-order");
        }
        for (name, list) in lists(settings) {
            option(name, &list);
        }
        if let Some(mass) = settings.mass {
            option("mass", &mass.to_string());
        }
        let smoothing = &settings.smoothing;
        if smoothing.method != Differentiation::default() {
            option("differentiation", smoothing.method.name());
        }
        if let Some(window) = smoothing.given() {
            option("window", &window.to_string());
        }
        if smoothing.method.is_local() {
            option("order", &smoothing.order.to_string());
        }
        match settings.form {
            Formulation::Derivative => {}
            Formulation::Integral => option("form", "integral"),
            Formulation::Weak { half_width } => {
                option("form", "weak");
                if let Some(half_width) = half_width {
                    option("half-width", &half_width.to_string());
                }
            }
        }
        if settings.regressor != Regressor::default() {
            option("regressor", settings.regressor.name());
        }
        option("threshold", &settings.threshold.to_string());
        if settings.ridge > 0.0 {
            option("ridge", &settings.ridge.to_string());
        }
        if settings.scaling == Scaling::Raw {
            option("scaling", "raw");
        }
        if let Some(out) = out {
            option("out", &seen_from(&here, out).to_string_lossy());
        }
        if !smoothing.filter_library {
            text.push_str(" --unfiltered-library");
        }
        if settings.kinematics == Kinematics::Fitted {
            text.push_str(" --fit-kinematics");
        }
        if settings.refine {
            text.push_str(" --refine");
        }
        text
    }
}

/// From one time to another, s; none for the record's own beginning or end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    from: Option<f64>,
    to: Option<f64>,
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (from, to) = text.split_once(':').ok_or("it is two times with a colon between them, as 2:40")?;
        let time = |text: &str| if text.trim().is_empty() { Ok(None) } else { finite(text.trim()).map(Some) };
        let (from, to) = (time(from)?, time(to)?);
        if from.zip(to).is_some_and(|(from, to)| from >= to) {
            return Err("the first time lies before the second".into());
        }
        Ok(Self { from, to })
    }
}

impl std::fmt::Display for Span {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let time = |t: Option<f64>| t.map_or(String::new(), |t| t.to_string());
        write!(f, "{}:{}", time(self.from), time(self.to))
    }
}

/// The lists that say what settings say of terms, each with its option: those for all equations, then those of each.
fn lists(settings: &Settings) -> Vec<(&'static str, String)> {
    let mut found = Vec::new();
    let mut of = |head: &str, terms: Option<&Vec<Term>>, locks: &BTreeMap<Term, Lock>, known: &[Known]| {
        let list = |terms: &mut dyn Iterator<Item = &Term>| terms.map(Term::as_str).collect::<Vec<_>>().join(", ");
        if let Some(terms) = terms {
            found.push(("terms", format!("{head}{}", list(&mut terms.iter()))));
        }
        for (name, lock) in [("lock", Lock::In), ("drop", Lock::Out)] {
            let terms = list(&mut locks.iter().filter(|(_, l)| **l == lock).map(|(t, _)| t));
            if !terms.is_empty() {
                found.push((name, format!("{head}{terms}")));
            }
        }
        for (term, lock) in locks {
            if let Lock::Fixed(value) = lock {
                found.push(("fix", format!("{head}{term}={value}")));
            }
        }
        if !known.is_empty() {
            let known = known.iter().map(Known::to_string).collect::<Vec<_>>().join(", ");
            found.push(("constrain", format!("{head}{known}")));
        }
    };
    of("", Some(&settings.terms), &settings.locks, &settings.known);
    for (freedom, own) in &settings.own {
        let symbol = if settings.kind == Kind::SecondOrder { 'v' } else { 'x' };
        of(&format!("{symbol}{}: ", freedom + 1), own.terms.as_ref(), &own.locks, &own.known);
    }
    // The lists of terms come in one option.
    let terms: Vec<String> = found.iter().filter(|(name, _)| *name == "terms").map(|(_, list)| list.clone()).collect();
    if terms.len() > 1 {
        found.retain(|(name, _)| *name != "terms");
        let each = terms[1..].join("; ");
        found.insert(0, ("terms", each));
    }
    found
}

/// A list of terms, for all equations or for each.
#[derive(Clone, Debug)]
pub(super) struct Terms(pub(super) Vec<EquationEntries<Term>>);

impl Terms {
    /// The list, where it must be one for all equations.
    ///
    /// # Errors
    /// It has lists for single ones.
    pub(super) fn for_all(&self) -> Result<Vec<Term>, Failure> {
        if self.0.iter().any(|part| part.equation.is_some()) {
            return Err(Failure::new("a list for each equation is not possible here")
                .try_this("give one list for all equations, without `v1:`"));
        }
        Ok(self.0.iter().flat_map(|part| part.entries.iter().cloned()).collect())
    }
}

impl FromStr for Terms {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let read = if is_integral(text) { rate } else { Term::parse };
        by_equation(text, |piece| {
            read(piece).map_err(|e| (e.column - 1, format!("{:?} is no term: {}", e.text, e.problem)))
        })
        .map(Self)
    }
}

/// A list of what is known, for all equations or for each.
#[derive(Clone, Debug)]
struct Constraints {
    known: Vec<EquationEntries<Known>>,
    /// `u=1/m`: the force's coefficient follows from the mass.
    unit_mass: bool,
}

impl FromStr for Constraints {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let is_mass = |part: &str| part.replace(' ', "") == "u=1/m";
        let read = |piece: &str| if is_mass(piece) { Ok(None) } else { piece.parse().map(Some).map_err(|e| (0, e)) };
        let mut unit_mass = false;
        let known = by_equation(text, read)?
            .into_iter()
            .map(|part: EquationEntries<Option<Known>>| {
                unit_mass |= part.entries.contains(&None);
                EquationEntries { equation: part.equation, entries: part.entries.into_iter().flatten().collect() }
            })
            .collect();
        Ok(Self { known, unit_mass })
    }
}

/// A term at a coefficient.
#[derive(Clone, Debug, PartialEq)]
struct FixedTerm {
    term: Term,
    value: f64,
}

/// Terms at coefficients, for all equations or for each.
#[derive(Clone, Debug)]
struct FixedTerms(Vec<EquationEntries<FixedTerm>>);

impl FromStr for FixedTerms {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        by_equation(text, |piece| piece.parse().map_err(|e| (0, e))).map(Self)
    }
}

impl FromStr for FixedTerm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (term, value) = text.rsplit_once('=').ok_or("write a term and its coefficient as `x=-358.7`")?;
        let value = finite(value.trim())?;
        Ok(Self { term: Term::parse(term.trim()).map_err(|e| e.to_string())?, value })
    }
}

/// A number that is one.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("`{text}` is not a number"))
}

/// A number above zero.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("it must be above zero".into()) })
}

/// A number that is zero or above.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("it cannot be negative".into()) })
}

/// A share between none and all.
fn share(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 && v < 1.0 { Ok(v) } else { Err("it lies between 0 and 1, as 0.3".into()) })
}

fn half_width(text: &str) -> Result<usize, String> {
    let n = text.parse().map_err(|_| "it is a whole number of samples")?;
    if n >= TestFunction::NARROWEST {
        Ok(n)
    } else {
        Err(format!("test functions reach at least {} samples to each side", TestFunction::NARROWEST))
    }
}

pub(super) fn odd(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n >= 3 && n % 2 == 1 => Ok(n),
        Ok(n) => Err(format!(
            "a segment is odd and at least 3 samples long, so that it has a middle: {}",
            (n | 1usize).max(3)
        )),
        Err(_) => Err("it is a whole number of samples".into()),
    }
}

macro_rules! named {
    ($(#[$doc:meta])* $name:ident => $target:ty { $($(#[$variant_doc:meta])* $variant:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
        pub(super) enum $name {
            $($(#[$variant_doc])* $variant,)+
        }

        impl From<$name> for $target {
            fn from(name: $name) -> Self {
                match name {
                    $($name::$variant => Self::$variant,)+
                }
            }
        }
    };
}

/// What the equations are, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum KindName {
    /// Displacements are given, velocities are derived
    #[default]
    SecondOrder,
    /// Every state is given
    FirstOrder,
    /// As second-order, every equation integrated once over time: velocities against integrals, `int(x)`
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

named! {
    /// Ways of differentiating, by name.
    MethodName => Differentiation {
        /// The derivative of the Savitzky–Golay filter's own polynomial
        #[default]
        Filter,
        /// Savitzky–Golay smoothing, then central differences
        SmoothThenDifference,
        /// Natural cubic smoothing spline; its weight by cross-validation unless --window is given
        Spline,
        /// The whole record's Fourier transform behind a soft low-pass, whose edge is where the noise begins
        Spectral,
        /// Kalman smoother of a motion with random jerk; how random by its likelihood
        Kalman,
        /// Least total variation of the acceleration: for forces that jump; up to 100 000 samples
        TotalVariation,
        /// Central differences, no smoothing
        Difference,
    }
}

/// Yes or no.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Whether {
    /// Do
    Yes,
    /// Do not
    No,
}

named! {
    /// Ways to a sparse equation, by name.
    RegressorName => Regressor {
        /// Sequentially thresholded least squares: fit, drop what is below the threshold, again
        #[default]
        Stlsq,
        /// Sparse relaxed regularized regression, the number of terms penalised (ν = 1)
        Sr3L0,
        /// Sparse relaxed regularized regression, the terms' magnitudes penalised (ν = 1)
        Sr3L1,
        /// Stepwise elimination: the smallest term leaves, one after the other
        Ssr,
        /// Forward orthogonal selection: the term that explains most joins, one after the other
        Frols,
        /// The best of all subsets (exact up to 16 terms; of more, those that elimination keeps longest)
        BestSubset,
        /// Spike and slab: terms that belong more likely than not, each with its probability
        Bayes,
    }
}

/// How an equation is held against the data, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FormName {
    /// At samples: rates are derivatives of smoothed states
    Derivative,
    /// In averages over test functions, which take the derivatives off the measurement
    Weak,
    /// Integrated once over time
    Integral,
}

named! {
    /// What the threshold compares, by name.
    ScalingName => Scaling {
        /// Columns and rate divided by their RMS: units do not matter
        #[default]
        Scaled,
        /// Coefficients as they stand
        Raw,
    }
}
