//! Every setting of a study: the one list that options, panels, documents and the repeated command are made from.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Differentiation, Formulation, Kinematics, Known, Lock, Own, Regressor, Scaling, Settings, Smoothing};
use crate::setting::{
    Given, NamedValue, Setting, SettingForm, Slider, Spread, change, finite, named, not_negative, positive,
};
use crate::signal::TestFunction;
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::term::{EquationEntries, Kind, Layout, Term, by_equation, is_integral, rate};

const LIBRARY: &str = "Library";
const PHYSICS: &str = "Physics";
const SMOOTHING: &str = "Smoothing";
const REGRESSION: &str = "Regression";
const SIMULATION: &str = "Simulation";

/// Samples that a state of one mass can be estimated from at least.
const LEAST_INITIAL: usize = 4;

/// What is said for a length that each record itself decides, where the way of differentiating can do that.
const FROM_DATA: &str = "from-data";
/// What is said for an input whose coefficient follows from the mass.
const UNIT_MASS: &str = "u=1/m";

const fn method(value: Differentiation, label: &'static str, help: &'static str) -> NamedValue<Differentiation> {
    NamedValue { value, name: value.name(), label, help }
}

/// The ways of differentiating.
pub const METHODS: [NamedValue<Differentiation>; 7] = [
    method(
        Differentiation::Filter,
        "filter's derivative",
        "Savitzky–Golay: a polynomial is laid through each segment and differentiated itself",
    ),
    method(
        Differentiation::SmoothThenDifference,
        "smooth, then difference",
        "Savitzky–Golay smoothing, then central differences of the smoothed samples",
    ),
    method(
        Differentiation::Spline,
        "smoothing spline",
        "A natural cubic spline that weighs curvature against misfit; its weight by generalised cross-validation",
    ),
    method(
        Differentiation::Spectral,
        "spectral",
        "The whole record's Fourier transform behind a soft low-pass, whose edge is where the noise begins: for long records \
         of smooth motion",
    ),
    method(
        Differentiation::Kalman,
        "Kalman smoother",
        "The likeliest motion if its jerk is white noise; how strong by the record's likelihood",
    ),
    method(
        Differentiation::TotalVariation,
        "total variation",
        "The motion whose acceleration changes least in sum, so that it may jump: for dry friction and impacts. Slow: \
         records of up to 100 000 samples; its library is not filtered alike, so coefficients lean a little",
    ),
    method(
        Differentiation::Difference,
        "difference only",
        "Central differences of the samples as measured: for data without noise",
    ),
];

/// How the equation can be held against the data; the weak form's test functions are as wide as the data ask for.
pub const FORMS: [NamedValue<Formulation>; 3] = [
    NamedValue {
        value: Formulation::Derivative,
        name: "derivative",
        label: "at samples",
        help: "The equation holds at each sample, between derivatives of the smoothed motion",
    },
    NamedValue {
        value: Formulation::Weak { half_width: None },
        name: "weak",
        label: "weak form",
        help: "The equation holds in averages over test functions, which take the derivatives off the measurement: smoothing \
               then biases nothing but forces that are not linear, and the sensor's noise is weighed out",
    },
    NamedValue {
        value: Formulation::Integral,
        name: "integral",
        label: "integral form",
        help: "The equation is integrated once over time: velocities are held against integrals of the terms, and no \
               acceleration is needed",
    },
];

const fn regressor(value: Regressor, label: &'static str, help: &'static str) -> NamedValue<Regressor> {
    NamedValue { value, name: value.name(), label, help }
}

/// The ways to a sparse equation.
pub const REGRESSORS: [NamedValue<Regressor>; 7] = [
    regressor(
        Regressor::Stlsq,
        "STLSQ",
        "Sequentially thresholded least squares: fit, drop what is below the threshold, fit again until nothing drops",
    ),
    regressor(
        Regressor::Sr3L0,
        "SR3, L0",
        "Sparse relaxed regularized regression: a sparse copy of the coefficients is kept near those that fit (ν = 1), and \
         each term costs the same. The threshold sets the cost",
    ),
    regressor(
        Regressor::Sr3L1,
        "SR3, L1",
        "The same, but a term costs its magnitude, as in the lasso; those kept are refitted without the cost",
    ),
    regressor(
        Regressor::Ssr,
        "stepwise elimination (SSR)",
        "The smallest term leaves, one after the other. Of the sets of terms on the way the one is taken that leaves least, \
         a term being worth a share of the RMS acceleration as large as the threshold",
    ),
    regressor(
        Regressor::Frols,
        "forward selection (FROLS)",
        "The term that explains most joins, one after the other, each made orthogonal to those before: for large \
         libraries. The threshold decides how many, as for elimination",
    ),
    regressor(
        Regressor::BestSubset,
        "best subset",
        "Every set of terms is tried: exact up to 16 candidates; of more, those that elimination keeps longest. The \
         threshold decides how many, as for elimination",
    ),
    regressor(
        Regressor::Bayes,
        "Bayes (spike and slab)",
        "Terms that belong more likely than not; their probabilities are in the equation's tooltips. A coefficient as \
         large as the threshold is as likely there by chance as not",
    ),
];

/// What the threshold can be compared with.
pub const SCALINGS: [NamedValue<Scaling>; 2] = [
    NamedValue {
        value: Scaling::Scaled,
        name: "scaled",
        label: "scaled",
        help: "Columns and acceleration divided by their RMS: units do not matter, metres or millimetres give the same terms",
    },
    NamedValue {
        value: Scaling::Raw,
        name: "raw",
        label: "raw",
        help: "Coefficients as they stand, as the Python package does: units decide",
    },
];

/// Whether `dx/dt = v` is looked for as well.
pub const KINEMATICS: [NamedValue<Kinematics>; 2] = [
    NamedValue { value: Kinematics::Known, name: "known", label: "known", help: "It is what velocity means" },
    NamedValue {
        value: Kinematics::Fitted,
        name: "fitted",
        label: "fitted",
        help: "It is fitted from the library too: a check of the derivative",
    },
];

/// The settings of a study, in the order in which they are made and told. Its kind is not among them: it decides how the
/// records are read.
pub static SETTINGS: &[Setting<Settings>] = &[
    Setting {
        name: "terms",
        label: "Terms",
        title: "candidate terms",
        group: LIBRARY,
        help: "Candidate terms of every acceleration (first order: of every state): \"x, v, u, x^3, sgn(v)\"; or of each its \
               own: \"v1: x1, x2-x1, u; v2: x2-x1\"",
        default: "by the kind of data",
        form: SettingForm::Many("LIST"),
        chosen: true,
        read: read_terms,
        write: write_terms,
        describe: |s, layout| Some(pretty(&s.terms, layout)),
        ..Setting::BLANK
    },
    Setting {
        name: "lock",
        label: "Locked",
        title: "decided terms",
        group: LIBRARY,
        help: "Terms kept whatever the threshold: known physics; of all equations or of each, as in the list of candidates",
        form: SettingForm::Many("LIST"),
        read: |text| decide(text, Lock::In),
        write: |s| decided(s, Lock::In),
        describe: describe_locks,
        ..Setting::BLANK
    },
    Setting {
        name: "drop",
        label: "Left out",
        title: "terms left out",
        group: LIBRARY,
        help: "Terms never used; of all equations or of each",
        form: SettingForm::Many("LIST"),
        read: |text| decide(text, Lock::Out),
        write: |s| decided(s, Lock::Out),
        ..Setting::BLANK
    },
    Setting {
        name: "fix",
        label: "Fixed",
        title: "fixed terms",
        group: LIBRARY,
        help: "A term kept at a coefficient that is known; of one equation alone: \"v2: x2-x1=-600\"",
        form: SettingForm::Many("TERM=VALUE"),
        read: read_fixed,
        write: write_fixed,
        ..Setting::BLANK
    },
    Setting {
        name: "constrain",
        label: "Known physics",
        title: "known physics",
        group: PHYSICS,
        help: "Known physics: x=-u (one spring across the joint), v=-du, v<=0, x>=0, passive, odd or even (stiffness), u=1/m, \
               m2/m1 or m2/m1=0.5 (forces between two masses are equal and opposite); of all equations or of each: \
               \"v2: x2-x1<=0\"",
        form: SettingForm::Many("LIST"),
        read: read_known,
        write: |s| by_freedom(s, |known, _, _| joined(known.iter().map(Known::to_string))),
        describe: |s, _| joined(s.known.iter().map(Known::to_string)),
        ..Setting::BLANK
    },
    Setting {
        name: "mass",
        label: "Mass",
        title: "moving mass",
        group: PHYSICS,
        help: "The moving mass: coefficients are told as stiffness, damping and friction force too",
        unit: "kg",
        form: SettingForm::One("KG"),
        read: |text| positive(text).map(|mass| change(move |s: &mut Settings| s.mass = Some(mass))),
        write: |s| s.mass.iter().map(f64::to_string).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "differentiation",
        alias: "method",
        label: "Derivative",
        title: "differentiation",
        group: SMOOTHING,
        help: "How velocities and accelerations are made from displacements",
        default: "filter",
        form: SettingForm::Names { placeholder: "NAME", names: &METHODS },
        read: |text| named(&METHODS, text).map(|m| change(move |s: &mut Settings| s.smoothing.method = m)),
        write: |s| vec![s.smoothing.method.name().into()],
        ..Setting::BLANK
    },
    Setting {
        name: "window",
        label: "Segment",
        title: "smoothing segment",
        group: SMOOTHING,
        help: "Samples that each polynomial is laid through, an odd number; of ways without segments the period of which half \
               the amplitude passes, or from-data where each record says it itself. Longer takes out more noise, too long \
               flattens the motion",
        default: "chosen from the data",
        unit: "samples",
        form: SettingForm::One("N"),
        slider: Some(Slider { least: 3.0, most: f64::INFINITY, spread: Spread::Logarithmic, step: 2.0 }),
        chosen: true,
        read: read_window,
        write: write_window,
        ..Setting::BLANK
    },
    Setting {
        name: "order",
        label: "Order",
        title: "order of the smoothing polynomial",
        group: SMOOTHING,
        help: "Degree of each segment's polynomial: higher follows faster motion and lets more noise through",
        default: "chosen from the data",
        form: SettingForm::One("N"),
        slider: Some(Slider { least: 2.0, most: 9.0, spread: Spread::Linear, step: 1.0 }),
        chosen: true,
        read: read_order,
        write: |s| s.smoothing.method.is_local().then(|| s.smoothing.order.to_string()).into_iter().collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "unfiltered-library",
        label: "filter the library columns too",
        title: "library columns",
        group: SMOOTHING,
        help: "Do not pass the library's columns through the filter that the displacement went through; without it the \
               smoothing biases the coefficients",
        form: SettingForm::Flag,
        read: |_| Ok(change(|s: &mut Settings| s.smoothing.filter_library = false)),
        write: |s| flag(!s.smoothing.filter_library),
        ..Setting::BLANK
    },
    Setting {
        name: "form",
        label: "Equation",
        title: "form of the equation",
        group: REGRESSION,
        help: "How the equation is held against the data",
        default: "chosen by held-out simulation error",
        form: SettingForm::Names { placeholder: "FORM", names: &FORMS },
        read: |text| named(&FORMS, text).map(|form| change(move |s: &mut Settings| s.form = form)),
        write: write_form,
        ..Setting::BLANK
    },
    Setting {
        name: "half-width",
        label: "Half width",
        title: "half width of the test functions",
        group: REGRESSION,
        help: "Samples that each of the weak form's test functions reaches to either side: it matters little, as long as some \
               fit into the record",
        default: "chosen from the data",
        unit: "samples",
        form: SettingForm::One("N"),
        slider: Some(Slider {
            least: TestFunction::NARROWEST as f64,
            most: f64::INFINITY,
            spread: Spread::Logarithmic,
            step: 1.0,
        }),
        read: read_half_width,
        write: |s| match s.form {
            Formulation::Weak { half_width } => half_width.iter().map(usize::to_string).collect(),
            Formulation::Derivative | Formulation::Integral => Vec::new(),
        },
        ..Setting::BLANK
    },
    Setting {
        name: "regressor",
        label: "Regression",
        title: "sparse regression",
        group: REGRESSION,
        help: "The way to a sparse equation",
        default: "stlsq",
        form: SettingForm::Names { placeholder: "NAME", names: &REGRESSORS },
        read: |text| named(&REGRESSORS, text).map(|r| change(move |s: &mut Settings| s.regressor = r)),
        write: |s| vec![s.regressor.name().into()],
        describe: |s, _| Some(s.regressor.title().into()),
        ..Setting::BLANK
    },
    Setting {
        name: "threshold",
        label: "Threshold",
        title: "threshold",
        group: REGRESSION,
        help: "A term whose share of the RMS acceleration is smaller than this is dropped",
        default: "chosen by held-out simulation error",
        form: SettingForm::One("V"),
        slider: Some(Slider { least: 1e-4, most: 1.0, spread: Spread::LogarithmicFromZero, step: 0.0 }),
        chosen: true,
        read: |text| not_negative(text).map(|v| change(move |s: &mut Settings| s.threshold = v)),
        write: |s| vec![s.threshold.to_string()],
        describe: describe_threshold,
        ..Setting::BLANK
    },
    Setting {
        name: "ridge",
        label: "Ridge α",
        title: "ridge weight α",
        group: REGRESSION,
        help: "Weight of the penalty α‖c‖² on the coefficients: steadies terms that are hard to tell apart, at the price of bias",
        default: "0",
        form: SettingForm::One("V"),
        slider: Some(Slider { least: 1e-8, most: 1e2, spread: Spread::LogarithmicFromZero, step: 0.0 }),
        read: |text| not_negative(text).map(|v| change(move |s: &mut Settings| s.ridge = v)),
        write: |s| vec![s.ridge.to_string()],
        describe: |s, _| (s.ridge > 0.0).then(|| significant_trimmed(s.ridge, 4)),
        ..Setting::BLANK
    },
    Setting {
        name: "scaling",
        label: "Compares",
        title: "scaling",
        group: REGRESSION,
        help: "What is compared with the threshold",
        default: "scaled",
        form: SettingForm::Names { placeholder: "WAY", names: &SCALINGS },
        read: |text| named(&SCALINGS, text).map(|w| change(move |s: &mut Settings| s.scaling = w)),
        write: |s| SCALINGS.iter().filter(|c| c.value == s.scaling).map(|c| c.name.into()).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "fit-kinematics",
        label: "dx/dt = v",
        title: "kinematics",
        group: REGRESSION,
        help: "Fit dx/dt from the library too, instead of taking dx/dt = v as known",
        form: SettingForm::Flag,
        read: |_| Ok(change(|s: &mut Settings| s.kinematics = Kinematics::Fitted)),
        write: |s| flag(s.kinematics == Kinematics::Fitted),
        describe: |s, layout| {
            (layout.kind == Kind::SecondOrder).then(|| match s.kinematics {
                Kinematics::Known => "dx/dt = v is known".into(),
                Kinematics::Fitted => "dx/dt is fitted too".into(),
            })
        },
        ..Setting::BLANK
    },
    Setting {
        name: "refine",
        label: "refine",
        title: "refinement",
        group: REGRESSION,
        help: "Fit the coefficients of the terms that are kept to the response itself (output error), not to the acceleration: \
               nearer to the truth, and slower",
        default: "where that lowers the held-out error much",
        form: SettingForm::Switch,
        read: |text| switch(text).map(|on| change(move |s: &mut Settings| s.refine = on)),
        write: |s| vec![if s.refine { "yes" } else { "no" }.into()],
        ..Setting::BLANK
    },
    Setting {
        name: "initial",
        label: "Initial samples",
        title: "samples for the initial state",
        group: SIMULATION,
        help: "The initial state of every held-out record is estimated from its first N samples alone, and these are left out \
               of its score, as benchmarks of the field do",
        default: "the opening of the record, which is scored too",
        unit: "samples",
        form: SettingForm::One("N"),
        read: |text| initial_samples(text).map(|n| change(move |s: &mut Settings| s.initial = Some(n))),
        write: |s| s.initial.iter().map(usize::to_string).collect(),
        describe: |s, _| s.initial.map(|n| n.to_string()),
        ..Setting::BLANK
    },
];

/// The row of a setting.
///
/// # Panics
/// No setting is called so.
pub fn setting(name: &str) -> &'static Setting<Settings> {
    SETTINGS.iter().find(|s| s.name == name).unwrap_or_else(|| panic!("no setting is called {name:?}"))
}

impl Settings {
    /// The settings with what was given put over them. Of a segment and its polynomial's order the one that was not given
    /// makes room for the one that was.
    ///
    /// # Errors
    /// A list of an equation that there is not in data of this kind.
    pub fn take(&mut self, given: &Given<Self>) -> Result<(), String> {
        given.apply(self)?;
        // Only the weak form has test functions: another one that was asked for makes nothing of their width.
        if let Some(Ok(form @ (Formulation::Derivative | Formulation::Integral))) =
            given.of("form").last().map(|name| named(&FORMS, name))
        {
            self.form = form;
        }
        let Smoothing { method, window, order, .. } = &mut self.smoothing;
        if !method.is_local() {
            return Ok(());
        }
        match (given.has("window"), given.has("order")) {
            (true, false) => *order = (*order).min(window.saturating_sub(1)),
            (false, true) => *window = (*window).max((*order + 1) | 1),
            (true, true) | (false, false) => {}
        }
        Ok(())
    }
}

/// Whether the input's coefficient is to follow from the mass and the records.
pub fn asks_for_unit_mass(given: &Given<Settings>) -> bool {
    let asked = |text: &str| {
        let read = |piece: &str| Ok(is_unit_mass(piece));
        by_equation(text, read)
            .is_ok_and(|parts| parts.iter().any(|p: &EquationEntries<bool>| p.entries.contains(&true)))
    };
    given.of("constrain").any(asked)
}

fn is_unit_mass(piece: &str) -> bool {
    piece.replace(' ', "") == UNIT_MASS
}

type Changed = Result<crate::setting::SettingChange<Settings>, String>;

/// A change made of lists, for all equations and for each; `put` is told the equation, by its degree of freedom.
fn put<E: Send + Sync + 'static>(
    parts: Vec<EquationEntries<E>>,
    put: impl Fn(&mut Settings, Option<usize>, &[E]) + Send + Sync + 'static,
) -> crate::setting::SettingChange<Settings> {
    Arc::new(move |settings: &mut Settings| {
        for part in &parts {
            let freedom = part.freedom(settings.kind)?;
            put(settings, freedom, &part.entries);
        }
        Ok(())
    })
}

/// Reads lists of terms, `int(x)` as the term whose integral it is.
///
/// # Errors
/// The first text that is no term.
pub fn term_lists(text: &str) -> Result<Vec<EquationEntries<Term>>, String> {
    let read = if is_integral(text) { rate } else { Term::parse };
    by_equation(text, |piece| {
        read(piece).map_err(|e| (e.column - 1, format!("{:?} is no term: {}", e.text, e.problem)))
    })
}

fn read_terms(text: &str) -> Changed {
    Ok(put(term_lists(text)?, |settings, freedom, terms| match freedom {
        None => settings.terms = terms.to_vec(),
        Some(i) => settings.own.entry(i).or_default().terms = Some(terms.to_vec()),
    }))
}

fn decide(text: &str, lock: Lock) -> Changed {
    Ok(put(term_lists(text)?, move |settings, freedom, terms| {
        settings.own_locks(freedom).extend(terms.iter().map(|t| (t.clone(), lock)));
    }))
}

fn read_fixed(text: &str) -> Changed {
    let entry = |piece: &str| -> Result<(Term, f64), String> {
        let (term, value) = piece.rsplit_once('=').ok_or("write a term and its coefficient as `x=-358.7`")?;
        let value = finite(value.trim())?;
        Ok((Term::parse(term.trim()).map_err(|e| e.to_string())?, value))
    };
    let parts = by_equation(text, |piece| entry(piece).map_err(|e| (0, e)))?;
    Ok(put(parts, |settings, freedom, fixed| {
        settings.own_locks(freedom).extend(fixed.iter().map(|(term, value)| (term.clone(), Lock::Fixed(*value))));
    }))
}

/// What is known; that the force's coefficient follows from the mass is for [`asks_for_unit_mass`].
fn read_known(text: &str) -> Changed {
    let read = |piece: &str| {
        if is_unit_mass(piece) { Ok(None) } else { piece.parse::<Known>().map(Some).map_err(|e| (0, e)) }
    };
    Ok(put(by_equation(text, read)?, |settings, freedom, known| {
        let known = known.iter().flatten().cloned();
        match freedom {
            None => settings.known.extend(known),
            Some(i) => settings.own.entry(i).or_default().known.extend(known),
        }
    }))
}

/// A number of samples that an initial state can be estimated from.
///
/// # Errors
/// It is none.
fn initial_samples(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n >= LEAST_INITIAL => Ok(n),
        _ => Err(format!("it is a whole number of samples, at least {LEAST_INITIAL}")),
    }
}

fn read_window(text: &str) -> Changed {
    if text == FROM_DATA {
        return Ok(change(|s: &mut Settings| s.smoothing.from_data = true));
    }
    match text.parse() {
        Ok(n) if n >= 3 && n % 2 == 1 => Ok(change(move |s: &mut Settings| s.smoothing = s.smoothing.with_window(n))),
        Ok(n) => Err(format!(
            "a segment is odd and at least 3 samples long, so that it has a middle: {}",
            (n | 1usize).max(3)
        )),
        Err(_) => Err("it is a whole number of samples".into()),
    }
}

fn write_window(settings: &Settings) -> Vec<String> {
    let smoothing = &settings.smoothing;
    match smoothing.given() {
        Some(window) => vec![window.to_string()],
        None if smoothing.method.is_global() => vec![FROM_DATA.into()],
        None => Vec::new(),
    }
}

/// The largest order of a smoothing polynomial that can be asked for.
const LARGEST_ORDER: usize = 12;

fn read_order(text: &str) -> Changed {
    match text.parse() {
        Ok(order) if (1..=LARGEST_ORDER).contains(&order) => {
            Ok(change(move |s: &mut Settings| s.smoothing.order = order))
        }
        _ => Err(format!("it is a whole number from 1 to {LARGEST_ORDER}")),
    }
}

fn write_form(settings: &Settings) -> Vec<String> {
    let same = |form: &Formulation| std::mem::discriminant(form) == std::mem::discriminant(&settings.form);
    FORMS.iter().filter(|c| same(&c.value)).map(|c| c.name.into()).collect()
}

/// Only the weak form has test functions: who gives their width means it.
fn read_half_width(text: &str) -> Changed {
    let n = text.parse().map_err(|_| "it is a whole number of samples")?;
    if n < TestFunction::NARROWEST {
        return Err(format!("test functions reach at least {} samples to each side", TestFunction::NARROWEST));
    }
    Ok(change(move |s: &mut Settings| s.form = Formulation::Weak { half_width: Some(n) }))
}

fn switch(text: &str) -> Result<bool, String> {
    match text {
        "yes" => Ok(true),
        "no" => Ok(false),
        _ => Err("it is yes or no".into()),
    }
}

/// A flag's text, where it is set.
fn flag(set: bool) -> Vec<String> {
    if set { vec![String::new()] } else { Vec::new() }
}

/// A list with commas; none of nothing.
fn joined(texts: impl Iterator<Item = String>) -> Option<String> {
    let texts: Vec<String> = texts.collect();
    (!texts.is_empty()).then(|| texts.join(", "))
}

/// What is written of all equations, then of each, whose text begins with its name.
fn by_freedom(
    settings: &Settings,
    write: impl Fn(&[Known], &BTreeMap<Term, Lock>, Option<&Vec<Term>>) -> Option<String>,
) -> Vec<String> {
    let all = write(&settings.known, &settings.locks, Some(&settings.terms));
    let symbol = if settings.kind == Kind::SecondOrder { 'v' } else { 'x' };
    let own = |(freedom, own): (&usize, &Own)| {
        let text = write(&own.known, &own.locks, own.terms.as_ref())?;
        Some(format!("{symbol}{}: {text}", freedom + 1))
    };
    all.into_iter().chain(settings.own.iter().filter_map(own)).collect()
}

/// The list of all equations, unless there is none and each has its own; then those of single ones in one text.
fn write_terms(settings: &Settings) -> Vec<String> {
    let list = |terms: &Vec<Term>| terms.iter().map(Term::as_str).collect::<Vec<_>>().join(", ");
    let mut lists = by_freedom(settings, |_, _, terms| terms.map(list));
    let own = lists.split_off(1).join("; ");
    if own.is_empty() {
        return lists;
    }
    lists.retain(|all| !all.is_empty());
    lists.push(own);
    lists
}

fn decided(settings: &Settings, wanted: Lock) -> Vec<String> {
    by_freedom(settings, |_, locks, _| joined(locks.iter().filter(|(_, l)| **l == wanted).map(|(t, _)| t.to_string())))
}

/// Each fixed term by itself: a list of equations follows its name.
fn write_fixed(settings: &Settings) -> Vec<String> {
    let fixed = |(term, lock): (&Term, &Lock)| match lock {
        Lock::Fixed(value) => Some(format!("{term}={value}")),
        Lock::In | Lock::Out => None,
    };
    by_freedom(settings, |_, locks, _| joined(locks.iter().filter_map(fixed)))
}

fn pretty(terms: &[Term], layout: &Layout) -> String {
    terms.iter().map(|t| t.pretty(layout)).collect::<Vec<_>>().join(", ")
}

fn describe_locks(settings: &Settings, layout: &Layout) -> Option<String> {
    joined(settings.locks.iter().map(|(term, lock)| match lock {
        Lock::In => format!("{} kept", term.pretty(layout)),
        Lock::Out => format!("{} left out", term.pretty(layout)),
        Lock::Fixed(value) => format!("{} fixed at {}", term.pretty(layout), significant_trimmed(*value, 6)),
    }))
}

fn describe_threshold(settings: &Settings, _: &Layout) -> Option<String> {
    let compared = match settings.scaling {
        Scaling::Scaled => "of columns and rate divided by their RMS",
        Scaling::Raw => "of the coefficients as they stand",
    };
    Some(format!("{} {compared}", significant_trimmed(settings.threshold, 4)))
}
