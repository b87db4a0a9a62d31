//! The command that repeats a study asks for that study.

use std::collections::BTreeMap;
use std::path::PathBuf;

use proptest::collection::{btree_map, vec};
use proptest::prelude::*;
use proptest::sample::select;

use super::super::report::{DocumentOptions, PaperName, PoleOptions, ReportBase};
use super::super::request::StudyRequest;
use super::super::{Cli, Command};
use clap::Parser;
use sindyscope_analysis::missing::MAX_EFFECTS;
use sindyscope_analysis::{Preparing, Reading, RecordSource};
use sindyscope_core::prepare::Treatment;
use sindyscope_core::study::{
    Calibration, Differentiation, Formulation, Kinematics, Known, Lock, Own, REGRESSORS, Scaling, Settings, Smoothing,
};
use sindyscope_values::record::Role;
use sindyscope_values::term::{Kind, Term};

/// The words of a command as a shell takes them apart.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted, mut any) = (Vec::new(), String::new(), false, false);
    let mut letters = command.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\'' => (quoted, any) = (!quoted, true),
            '\\' if !quoted => word.extend(letters.next()),
            ' ' if !quoted => {
                if any || !word.is_empty() {
                    words.push(std::mem::take(&mut word));
                }
                any = false;
            }
            other => word.push(other),
        }
    }
    if any || !word.is_empty() {
        words.push(word);
    }
    words
}

fn terms() -> impl Strategy<Value = Vec<Term>> {
    let some =
        vec!["x", "v", "u", "1", "x^3", "x*v", "v*|v|", "sgn(v)", "sgn(v-du)", "x2-x1", "-v", "sin(2*x)", "0.5*x+u"];
    vec(select(some), 1..5).prop_map(|texts| {
        let mut terms: Vec<Term> = Vec::new();
        for term in texts.into_iter().map(|t| Term::parse(t).expect("a term")) {
            if !terms.contains(&term) {
                terms.push(term);
            }
        }
        terms
    })
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), -1e3..1e3, (-300.0..300.0_f64).prop_map(|e| 10_f64.powf(e)), Just(-1.5e-7)]
}

fn locks() -> impl Strategy<Value = BTreeMap<Term, Lock>> {
    let lock = prop_oneof![Just(Lock::In), Just(Lock::Out), number().prop_map(Lock::Fixed)];
    let term = terms().prop_map(|terms| terms[0].clone());
    btree_map(term, lock, 0..4)
}

fn known() -> impl Strategy<Value = Vec<Known>> {
    let some = vec!["x=-u", "v=-du", "x=2.5*u", "v<=0", "x^3>=0", "passive", "odd", "m2/m1", "m3/m2=0.25"];
    proptest::sample::subsequence(some, 0..4)
        .prop_map(|texts| texts.into_iter().map(|t| t.parse().expect("known physics")).collect())
}

fn own() -> impl Strategy<Value = Own> {
    (terms(), any::<bool>(), locks(), known()).prop_map(|(terms, has, locks, known)| {
        let terms = (has || (locks.is_empty() && known.is_empty())).then_some(terms);
        Own { terms, locks, known }
    })
}

/// A smoothing of which nothing is said that counts for nothing.
fn smoothing() -> impl Strategy<Value = Smoothing> {
    let methods = select(&Differentiation::ALL[..]);
    (methods, 1_usize..500, 1_usize..=12, any::<bool>(), any::<bool>()).prop_map(
        |(method, half, order, filter_library, from_data)| {
            let plain = Smoothing { method, filter_library, ..Smoothing::default() };
            match method {
                _ if method.is_local() => Smoothing { window: 2 * half + 1, order, ..plain },
                _ if method.is_global() && !from_data => plain.with_window(2 * half + 1),
                _ => plain,
            }
        },
    )
}

fn settings() -> impl Strategy<Value = Settings> {
    let form = prop_oneof![
        Just(Formulation::Derivative),
        Just(Formulation::Integral),
        Just(Formulation::Weak { half_width: None }),
        (sindyscope_core::signal::TestFunction::NARROWEST..900).prop_map(|n| Formulation::Weak { half_width: Some(n) }),
    ];
    let level = || number().prop_map(f64::abs);
    let lists = (terms(), locks(), known(), btree_map(0_usize..4, own(), 0..3));
    let ways = (smoothing(), form, select(REGRESSORS.map(|c| c.value).to_vec()), level(), level());
    let numbers = (proptest::option::of(1e-6..1e6), proptest::option::of(4_usize..5000));
    let rest = (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>(), numbers);
    (lists, ways, rest).prop_map(|((terms, locks, known, own), ways, (first_order, raw, fitted, refine, numbers))| {
        let (mass, initial) = numbers;
        let (smoothing, form, regressor, threshold, ridge) = ways;
        Settings {
            kind: if first_order { Kind::FirstOrder } else { Kind::SecondOrder },
            smoothing,
            form,
            terms,
            locks,
            own,
            regressor,
            threshold,
            ridge,
            scaling: if raw { Scaling::Raw } else { Scaling::Scaled },
            kinematics: if fitted { Kinematics::Fitted } else { Kinematics::Known },
            known,
            mass,
            refine,
            initial,
        }
    })
}

fn treatment() -> impl Strategy<Value = Treatment> {
    let time = || -100.0..100.0;
    let role = select(vec![Role::Input(0), Role::Displacement(1), Role::Acceleration(0)]);
    let positive = || 1e-3..1e3;
    prop_oneof![
        (time(), positive()).prop_map(|(from, long)| Treatment::Crop { from: Some(from), to: Some(from + long) }),
        time().prop_map(|to| Treatment::Crop { from: None, to: Some(to) }),
        (0.01..0.99).prop_map(|share| Treatment::HoldOut { share }),
        Just(Treatment::RemoveOffset),
        Just(Treatment::RemoveTrend),
        (2_usize..50).prop_map(|factor| Treatment::Decimate { factor }),
        positive().prop_map(|to| Treatment::Filter { from: None, to: Some(to) }),
        positive().prop_map(|from| Treatment::Filter { from: Some(from), to: None }),
        positive().prop_map(|from| Treatment::Filter { from: Some(from), to: Some(2.0 * from) }),
        positive().prop_map(|from| Treatment::IsolateMode { from, to: 1.5 * from }),
        positive().prop_map(|threshold| Treatment::MendSpikes { threshold }),
        (2_usize..20).prop_map(|parts| Treatment::Split { parts }),
        time().prop_map(|time| Treatment::SplitAt { time }),
        (role.clone(), proptest::option::of(time())).prop_map(|(role, delay)| Treatment::Align { role, delay }),
        (role, positive()).prop_map(|(role, gain)| Treatment::Gain { role, gain }),
        (1_usize..50).prop_map(|longest| Treatment::Bridge { longest }),
    ]
}

fn source() -> impl Strategy<Value = RecordSource> {
    let file = || select(&["run.csv", "a b.csv", "it's.mat", "-odd.csv"][..]).prop_map(PathBuf::from);
    let columns = select(&["", "t=Time,x=Laser 2", "t=1,x=a, b,u=Kraft [N]"][..]);
    let reading = (columns, any::<bool>(), proptest::option::of(1e-3..1e6));
    let reading = reading.prop_map(|(columns, only_named, rate)| Reading {
        only_named: only_named && !columns.is_empty(),
        columns: columns.parse().expect("columns"),
        rate,
        ..Reading::default()
    });
    let preparing = (vec(treatment(), 0..5), 0_usize..30).prop_map(|(steps, bridge)| Preparing { steps, bridge });
    (vec(file(), 1..3), vec(file(), 0..3), reading, preparing).prop_map(|(data, test, reading, preparing)| {
        // A file that begins with a minus is typed with its folder.
        let typed = |files: Vec<PathBuf>| {
            files.into_iter().map(|f| if f.starts_with("-odd.csv") { "./-odd.csv".into() } else { f }).collect()
        };
        RecordSource { data: typed(data), test: typed(test), reading, preparing }
    })
}

fn document() -> impl Strategy<Value = DocumentOptions> {
    let text = || select(&["run 3", "it's", "-x"][..]).prop_map(str::to_owned);
    let list = || select(&["x, v", "v1: x1; v2: x2-x1"][..]).prop_map(|t| t.parse().expect("terms"));
    let sections = || select(&["equation", "response, equation"][..]).prop_map(|t| t.parse().expect("sections"));
    let effects = || select(&["own.toml", "a b.toml", "./-odd.toml"][..]).prop_map(PathBuf::from);
    let search = (any::<bool>(), proptest::option::of(list()), 0_u8..=20, proptest::option::of(effects()));
    let look =
        (proptest::option::of(text()), proptest::option::of(text()), proptest::option::of(sections()), any::<bool>());
    (search, look).prop_map(|((diagnose, base, max_effects, effects), (over, title, sections, letter))| {
        DocumentOptions {
            out: "it's a report.html".into(),
            diagnose,
            base: base.filter(|_| diagnose).map(ReportBase::Terms),
            poles: PoleOptions::default(),
            max_effects: if diagnose { max_effects } else { MAX_EFFECTS },
            effects: effects.filter(|_| diagnose),
            over,
            title,
            sections,
            paper: if letter { PaperName::Letter } else { PaperName::A4 },
        }
    })
}

fn request() -> impl Strategy<Value = StudyRequest> {
    let sought = vec![Calibration::Delay(Role::Input(0)), Calibration::Gain(Role::Displacement(1))];
    let calibrations = proptest::sample::subsequence(sought, 0..=2);
    let document = proptest::option::of(document());
    (source(), calibrations, settings(), document).prop_map(|(source, calibrations, settings, document)| {
        let reading = Reading { kind: settings.kind.into(), ..source.reading };
        StudyRequest { source: RecordSource { reading, ..source }, calibrations, settings, document }
    })
}

proptest! {
    #[test]
    fn the_command_of_a_study_asks_for_that_study(
        asked in request(),
        terms in terms(),
        (window, threshold, refine) in (1_usize..100, 0.0..1.0, any::<bool>()),
    ) {
        // What the data would suggest if nothing were said.
        let smoothing = Smoothing { window: 2 * window + 1, ..Smoothing::default() };
        let suggested = Settings { kind: asked.settings.kind, smoothing, terms, threshold, refine, ..Settings::default() };
        let command = asked.command(if asked.document.is_some() { "report" } else { "identify" }, &suggested);
        let parsed = Cli::try_parse_from(words(&command)).map_err(|e| TestCaseError::fail(format!("{command}\n{e}")))?;
        let (options, document) = match parsed.command {
            Some(Command::Identify(options)) => (options.study.request, None),
            Some(Command::Report(options)) => (options.study.request, Some(options.document)),
            _ => return Err(TestCaseError::fail(command)),
        };
        let mut settings = options.settings(&suggested).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let free = options.free(&settings);
        prop_assert!(!(free.window || free.order || free.threshold || free.form || free.refine), "{command}");
        // What counts for nothing is not said: the length where none is given, the order where there are no segments.
        if asked.settings.smoothing.given().is_none() {
            settings.smoothing.window = asked.settings.smoothing.window;
        }
        if !asked.settings.smoothing.method.is_local() {
            settings.smoothing.order = asked.settings.smoothing.order;
        }
        let parsed = StudyRequest { source: options.source, calibrations: options.calibrations, settings, document };
        prop_assert_eq!(parsed, asked, "{}", command);
    }
}
