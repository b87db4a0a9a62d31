use clap::{CommandFactory, Parser};

use super::request::StudyRequest;
use super::{Cli, Command};
use sindyscope_analysis::AnalysisRequest;
use sindyscope_core::study::{Kinematics, Lock, Regressor, Scaling, Settings};
use sindyscope_values::term::Term;

mod repeating;

fn term(text: &str) -> Term {
    Term::parse(text).expect("a term")
}

#[test]
fn the_options_are_sound() {
    Cli::command().debug_assert();
}

#[test]
fn files_open_whatever_they_are_called() {
    for arguments in [&["./identify"][..], &["a.csv", "identify"], &["--", "identify"]] {
        let cli = Cli::try_parse_from([&["sindyscope"], arguments].concat()).expect("files");
        assert!(cli.command.is_none(), "{arguments:?}");
        assert_eq!(cli.files.len(), arguments.iter().filter(|a| **a != "--").count());
    }
    let cli = Cli::try_parse_from(["sindyscope", "identify", "a.csv", "--test", "b.csv", "c.csv"]).expect("a command");
    assert!(matches!(cli.command, Some(Command::Identify(_))));
}

#[test]
fn wrong_values_are_said_with_the_option() {
    for (arguments, said) in [
        (&["--window", "30"][..], "31"),
        (&["--threshold", "-1"], "--threshold"),
        (&["--threshold", "nan"], "not a number"),
        (&["--rate", "0"], "above zero"),
        (&["--terms", "x, sin(v"], "--terms"),
        (&["--columns", "q=3"], "q"),
        (&["--fix", "x"], "x=-358.7"),
        (&["--kind", "third-order"], "second-order"),
        (&["--order", "0"], "--order"),
        (&["--mass", "-1"], "above zero"),
        (&["--constrain", "v<=3"], "bounded by zero"),
        (&["--constrain", "x=u2*"], "--constrain"),
    ] {
        let error =
            Cli::try_parse_from([&["sindyscope", "identify", "a.csv"], arguments].concat()).expect_err("refused");
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains(said), "{arguments:?}: {error}");
    }
}

/// The options of a study of `a b.csv`.
fn parse(arguments: &[&str]) -> AnalysisRequest {
    let words = [&["sindyscope", "identify", "a b.csv"], arguments].concat();
    match Cli::try_parse_from(words).expect("options").command {
        Some(Command::Identify(options)) => options.study.request,
        _ => panic!("a study was asked for"),
    }
}

/// The command that repeats a study.
fn repeated(options: &AnalysisRequest, settings: &Settings) -> String {
    StudyRequest::done(options, settings, &[]).command("identify", &Settings::default())
}

#[test]
fn what_was_given_goes_over_what_was_suggested() {
    let options = parse(&[
        "--terms",
        "x, v, u",
        "--lock",
        "x,v",
        "--drop",
        "u",
        "--fix",
        "x^3=-0.6",
        "--order",
        "8",
        "--regressor",
        "best-subset",
        "--threshold",
        "0.2",
        "--scaling",
        "raw",
        "--fit-kinematics",
        "--constrain",
        "x=-u, v <= 0",
        "--constrain",
        "odd; u=1/m",
        "--mass",
        "2.5",
        "--refine",
    ]);
    let mut suggested = Settings::default();
    suggested.smoothing.window = 5;
    let settings = options.settings(&suggested).expect("sound");
    assert_eq!(settings.terms, ["x", "v", "u"].map(term));
    assert_eq!(settings.known.iter().map(ToString::to_string).collect::<Vec<_>>(), ["x=-u", "v<=0", "odd"]);
    assert_eq!((settings.mass, settings.refine), (Some(2.5), true));
    assert_eq!(settings.locks[&term("v")], Lock::In);
    assert_eq!(settings.locks[&term("u")], Lock::Out);
    assert_eq!(settings.locks[&term("x^3")], Lock::Fixed(-0.6));
    assert_eq!(
        (settings.smoothing.window, settings.smoothing.order),
        (9, 8),
        "the free segment makes room for the order"
    );
    assert_eq!((settings.threshold, settings.scaling, settings.kinematics), (0.2, Scaling::Raw, Kinematics::Fitted));
    assert_eq!(settings.regressor, Regressor::BestSubset);
    let free = options.free(&settings);
    assert!(free.window && !free.order);

    assert_eq!(
        repeated(&options, &settings),
        "sindyscope identify 'a b.csv' --terms 'x, v, u' --lock 'v, x' --drop u --fix x^3=-0.6 --constrain 'x=-u, v<=0, odd' --mass 2.5 --window 9 --order 8 --regressor best-subset --threshold 0.2 \
         --scaling raw --fit-kinematics --refine"
    );

    let short = parse(&["--window", "3"]).settings(&Settings::default()).expect("sound");
    assert_eq!((short.smoothing.window, short.smoothing.order), (3, 2));
    let differences = parse(&["--method", "difference"]);
    let settings = differences.settings(&Settings::default()).expect("sound");
    assert!(!differences.free(&settings).window, "nothing to choose without a segment");
    let spline = parse(&["--differentiation", "spline", "--window", "21", "--threshold", "0.1"]);
    let settings = spline.settings(&Settings { terms: vec![term("x")], ..Settings::default() }).expect("sound");
    assert!(!spline.free(&settings).order && !spline.free(&settings).window);
    assert_eq!(
        repeated(&spline, &settings),
        "sindyscope identify 'a b.csv' --terms x --differentiation spline --window 21 --threshold 0.1"
    );
}

#[test]
fn lists_for_each_equation_are_taken_and_come_back_in_the_command() {
    let options = parse(&[
        "--terms",
        "v1: x1, x2-x1, u; v2: x2-x1",
        "--lock",
        "v2: x2-x1",
        "--drop",
        "v1: u",
        "--fix",
        "v1: x1=-400",
        "--constrain",
        "v2: x2-x1<=0",
    ]);
    let settings = options.settings(&Settings::default()).expect("sound");
    let first = &settings.own[&0];
    assert_eq!(first.terms.as_deref().expect("a list"), ["x1", "x2-x1", "u"].map(term));
    assert_eq!((first.locks[&term("u")], first.locks[&term("x1")]), (Lock::Out, Lock::Fixed(-400.0)));
    assert_eq!(settings.own[&1].locks[&term("x2-x1")], Lock::In);
    assert_eq!(settings.own[&1].known.len(), 1);
    assert!(settings.locks.is_empty() && settings.known.is_empty());
    let command = repeated(&options, &settings);
    for part in [
        "--terms 'v1: x, x2-x, u; v2: x2-x'",
        "--drop 'v1: u'",
        "--fix 'v1: x=-400'",
        "--lock 'v2: x2-x'",
        "--constrain 'v2: x2-x<=0'",
    ] {
        assert!(command.contains(part), "{command}");
    }
    let refused = parse(&["--terms", "x1: x2"]).settings(&Settings::default());
    assert!(format!("{refused:?}").contains("v1: "), "{refused:?}");
}

/// Options are this command line's own: a library that named them would speak to nobody in the window or in a script.
#[test]
fn no_sentence_of_a_library_names_an_option() {
    let option = |line: &str| {
        let code = line.trim_start();
        let words = code.match_indices("--").filter(|(at, _)| code[..*at].ends_with([' ', '`', '"', '(', '\'']));
        let named = |(at, _): (usize, &str)| code[at + 2..].starts_with(|c: char| c.is_ascii_lowercase());
        !code.starts_with("//") && code.contains('"') && words.into_iter().any(named)
    };
    let mut found = Vec::new();
    let mut folders = vec![std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("crates")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            let name = entry.file_name().to_string_lossy().into_owned();
            // Variables of style sheets begin with two minuses too.
            if name.contains("tests") || name == "style.rs" {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".rs") {
                let text = std::fs::read_to_string(&path).expect("text");
                let code = text.split("#[cfg(test)]").next().unwrap_or_default();
                found.extend(code.lines().filter(|l| option(l)).map(|l| format!("{}: {l}", path.display())));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}
