use std::sync::Arc;

use super::{Arrangement, DocumentFormat, Item, Paper, Report, ReportError, Section};
use sindyscope_core::signal::Signals;
use sindyscope_core::simulate::Delays;
use sindyscope_core::study::{
    self, DroppedTerm, Elapsed, EquationFit, Outcome, RecordOutcome, Score, Settings, Severity, Warning,
};
use sindyscope_values::model::{Equation, Model, WeightedTerm};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::{Symbol, Term};

fn term(text: &str) -> Term {
    Term::parse(text).expect("a term")
}

/// A decaying oscillation in a record of `samples`, with a response that is slightly off.
fn record_outcome(name: &str, usage: Usage, samples: usize) -> RecordOutcome {
    let interval = 0.01;
    let wave = |k: usize, phase: f64| {
        (2.5e-3 * (-0.002 * k as f64 * interval).exp()) * (6.0 * k as f64 * interval + phase).sin()
    };
    let measured: Vec<f64> = (0..samples).map(|k| wave(k, 0.0) + 1e-5 * (k as f64 * 12.9).sin()).collect();
    let response: Vec<f64> = (0..samples).map(|k| wave(k, 0.01)).collect();
    let error: Vec<f64> = measured.iter().zip(&response).map(|(m, r)| (m - r).abs()).collect();
    let velocity = |phase: f64| (0..samples).map(|k| 6.0 * wave(k, phase + 1.57)).collect::<Vec<f64>>();
    let channel = |name: &str, role, unit: &str, values: &[f64]| Channel {
        name: name.into(),
        role,
        unit: unit.into(),
        values: values.into(),
        estimated: false,
    };
    let record = Record {
        name: name.into(),
        source: Some("measured/<rig> & co.csv".into()),
        start: 0.0,
        interval,
        channels: vec![
            channel("x", Role::Displacement(0), "m", &measured),
            channel("base", Role::Input(0), "m", &vec![0.0; samples]),
        ],
        notices: vec!["The sampling intervals differed by up to 0.3 %: resampled.".into()],
    };
    let still = vec![vec![0.0; samples]];
    let motion = [vec![measured.clone(), velocity(0.0)], vec![velocity(0.0), measured.clone()]];
    let mut signals = Signals::known((0.0, interval), motion, [still.clone(), still]);
    signals.length = 31.0;
    signals.main_period = Some(std::f64::consts::TAU / 6.0);
    signals.noise = vec![1e-5];
    RecordOutcome {
        record: Arc::new(record),
        usage,
        driven_as_measured: true,
        scored_from: 0,
        standing: Arc::default(),
        sticks: Vec::new(),
        signals: Arc::new(signals),
        states: vec![response.clone(), velocity(0.01)],
        channels: vec![study::SensorResponse {
            symbol: Symbol::State(0),
            role: Role::Displacement(0),
            response,
            error,
            score: Some(score(samples)),
        }],
        diverged_at: None,
    }
}

fn score(samples: usize) -> Score {
    Score { rmse: 1.72e-5, nrmse: 0.0102, max_error: 3.4e-5, best_fit: 98.98, samples }
}

fn outcome() -> Outcome {
    let weighted =
        |text: &str, coefficient, std_error, share| WeightedTerm { term: term(text), coefficient, std_error, share };
    let acceleration = Equation {
        terms: vec![
            weighted("x", -358.612, Some(0.21), 0.47),
            weighted("u", 358.5, Some(0.3), 0.45),
            weighted("sgn(v-du)", -0.0851, Some(0.0009), 0.05),
            weighted("x^3", 1.23e-7, Some(4e-9), 0.02),
            weighted("v*|v|", -0.0704, None, 0.004),
            weighted("sqrt(|x|)/(1+x^2)", 2.0, Some(0.5), 0.002),
            weighted("1", 0.5, Some(0.1), 0.001),
        ],
    };
    Outcome {
        settings: Settings {
            terms: ["x", "v", "u", "du", "sgn(v-du)", "x^3"].map(term).into(),
            locks: [(term("x"), study::Lock::In)].into(),
            threshold: 0.01,
            ..Settings::default()
        },
        model: Model::second_order(1, vec![acceleration]),
        fits: vec![EquationFit {
            probability: Vec::new(),
            state: Symbol::Rate(0),
            dropped: vec![DroppedTerm { term: term("du"), fell_at: Some(0.0043) }],
            drop_marks: Vec::new(),
            path: Vec::new(),
            confused: Vec::new(),
            shift: Vec::new(),
            condition: 12.0,
            residual_rms: 0.02,
            rate_rms: 1.0,
        }],
        covariance: study::Covariance::default(),
        refinement: None,
        records: vec![
            record_outcome("long", Usage::Fit, 6000),
            record_outcome("short", Usage::HeldOut, 700),
        ],
        train: Some(score(6000)),
        test: Some(score(700)),
        noise_floor: Some(1e-5),
        warnings: vec![
            Warning { severity: Severity::Wrong, text: "The base is not moved at all in any of these records, so nothing is known of u.".into(), remedy: None },
            Warning { severity: Severity::Caution, text: "One tone only: terms that differ only at other frequencies or amplitudes cannot be told apart by these data, so a model identified from them should not be trusted beyond.".into(), remedy: None },
            Warning { severity: Severity::Note, text: "A tenth of the samples would do.".into(), remedy: None },
        ],
        elapsed: Elapsed { fit: 1.0, simulate: 2.0 },
    }
}

/// Calls `look` with a report on an outcome.
fn with_report<T>(outcome: &Outcome, look: impl FnOnce(&Report<'_>) -> T) -> T {
    arranged(outcome, &Arrangement::default(), look)
}

fn arranged<T>(outcome: &Outcome, arrangement: &Arrangement, look: impl FnOnce(&Report<'_>) -> T) -> T {
    let records = RecordSet { entries: outcome.records.iter().map(|r| (r.record.clone(), r.usage)).collect() };
    look(&Report {
        title: "Friction rig <1> & its base",
        records: &records,
        outcome,
        choice: Some("segment 31 was chosen: it gave the smallest error"),
        command: Some("sindyscope report long.csv --test short.csv --terms 'x, sgn(v)' --out report.html"),
        diagnosis: None,
        arrangement,
    })
}

/// Every element that is opened is closed, in order; enough of XML for what the report writes.
fn assert_balanced(markup: &str) {
    const VOID: [&str; 3] = ["meta", "!doctype", "br"];
    let mut open: Vec<&str> = Vec::new();
    for tag in markup.split('<').skip(1) {
        let inside = tag.split('>').next().expect("a tag ends");
        if let Some(name) = inside.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed in order, in …{tag}");
        } else {
            let name = inside.split([' ', '\n', '/']).next().expect("a name");
            if !inside.ends_with('/') && !VOID.contains(&name) {
                open.push(name);
            }
        }
    }
    assert!(open.is_empty(), "{open:?} left open");
}

#[test]
fn the_page_says_everything_and_is_well_formed() {
    let page = with_report(&outcome(), |r| r.html());
    assert_balanced(&page);
    for part in [
        "<title>Friction rig &lt;1&gt; &amp; its base</title>",
        "17.2 µm",
        "best fit 99.0 %",
        "<mn>358.61</mn>",
        "<msup><mi>x</mi><mn>3</mn></msup>",
        "<msqrt>",
        "sgn(v-du)",
        "(1.23   ± 0.04)×10⁻⁷",
        "47.0 %",
        "du (at 0.0043)",
        "<b>Caution.</b> One tone only",
        "segment 31 samples = 0.300 s = 0.29 main periods",
        "Every library column".to_lowercase().as_str(),
        "x kept",
        "The sampling intervals differed by up to 0.3 %: resampled.",
        "&lt;rig&gt; &amp; co.csv",
        "Segment 31 was chosen: it gave the smallest error.",
        "--terms 'x, sgn(v)'",
        "Figure 3.",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!(
        page.matches("<figure").count(),
        7,
        "a response each, portrait, spectrum, restoring force, friction, residual"
    );
    assert!(page.matches("class=\"detail\"").count() == 2, "only the long record has a detail");
    assert!(!page.contains("NaN") && !page.contains('∞'), "numbers that do not exist are not written");
}

#[test]
fn long_records_make_small_figures() {
    let mut outcome = outcome();
    outcome.records = vec![record_outcome("long", Usage::Fit, 200_000)];
    let page = with_report(&outcome, |r| r.html());
    assert!(page.len() < 400_000, "{} bytes", page.len());
}

#[test]
fn the_picture_is_drawn_with_its_letters() {
    let outcome = outcome();
    let png = with_report(&outcome, |r| r.png()).expect("a picture");
    let picture = image::load_from_memory(&png).expect("PNG").into_luma8();
    let (width, height) = picture.dimensions();
    assert!(width == 1576 && (3000..8000).contains(&height), "{width} × {height}");
    // The title is the first thing on the page; without its font there would be nothing there.
    let dark =
        (0..140).flat_map(|y| (0..width).map(move |x| (x, y))).filter(|(x, y)| picture.get_pixel(*x, *y).0[0] < 128);
    assert!(dark.count() > 1000, "the title is drawn");
    let edge = (0..height).all(|y| picture.get_pixel(width - 1, y).0[0] > 250 && picture.get_pixel(0, y).0[0] > 250);
    assert!(edge, "nothing runs over the edge");
}

#[test]
fn a_response_that_diverged_is_told_and_drawn_as_far_as_it_went() {
    let mut outcome = outcome();
    outcome.train = None;
    outcome.noise_floor = None;
    let record = &mut outcome.records[0];
    record.diverged_at = Some(0.4);
    for series in
        record.states.iter_mut().chain(record.channels.iter_mut().flat_map(|c| [&mut c.response, &mut c.error]))
    {
        series.truncate(40);
    }
    record.channels[0].response[39] = 1e30;
    record.channels[0].error[39] = 1e30;
    record.channels[0].score = None;
    let page = with_report(&outcome, |r| r.html());
    assert_balanced(&page);
    assert!(page.contains("diverged") && page.contains("at t = 0.4000 s"));
    // The error's axis is not stretched beyond the measurement's range.
    assert!(page.contains(">E (mm)<"));
    let summary = with_report(&outcome, |r| r.summary());
    assert!(summary.contains("record long: the response left the data's range at t = 0.4000 s"), "{summary}");
}

#[test]
fn a_report_on_nearly_nothing_is_written_too() {
    let mut outcome = outcome();
    outcome.model = Model::second_order(1, vec![Equation { terms: Vec::new() }]);
    outcome.fits.clear();
    for samples in [0, 1, 2] {
        outcome.records = vec![record_outcome("tiny", Usage::Fit, samples)];
        Arc::make_mut(&mut outcome.records[0].signals).main_period = None;
        assert_balanced(&with_report(&outcome, |r| r.html()));
    }
    outcome.records.clear();
    assert_balanced(&with_report(&outcome, |r| r.html()));
    with_report(&outcome, |r| r.png()).expect("a picture");
}

#[test]
fn the_summary_lines_up() {
    let said = with_report(&outcome(), |r| r.summary());
    let expected = "\
record            RMSE     NRMSE   largest error  best fit  samples
long    fitted    17.2 µm  1.02 %  34.0 µm        99.0 %    6000
short   held out  17.2 µm  1.02 %  34.0 µm        99.0 %     700
noise floor 10 µm (standard deviation, estimated)
";
    assert!(said.starts_with(expected), "{said}");
    assert!(said.contains("\nCaution. One tone only"), "{said}");
}

#[test]
fn the_ending_decides() {
    use std::path::Path;
    assert_eq!(DocumentFormat::of(Path::new("a.HTML")).expect("known"), DocumentFormat::Html);
    assert_eq!(DocumentFormat::of(Path::new("b.png")).expect("known"), DocumentFormat::Png);
    assert_eq!(DocumentFormat::of(Path::new("c.Pdf")).expect("known"), DocumentFormat::Pdf);
    for (path, said) in [("a.docx", ".docx"), ("report", "without an ending")] {
        let error = DocumentFormat::of(Path::new(path)).expect_err("unknown");
        assert!(matches!(error, ReportError::Ending(_)) && error.to_string().contains(said), "{error}");
    }
}

#[test]
fn the_walk_is_told_in_every_document() {
    use sindyscope_search::{
        Added, Beginnings, Candidate, Choice, Curve, Description, Diagnosis, Evidence, Finding, Gap, HeldFit, Lead,
        NextExperiment, Parameter, Place, Remaining, Round, Stage, Standing, Trace, Verdict,
    };
    let outcome = outcome();
    let stage = |effects: Vec<Added>, rmse: f64| {
        let measured: Arc<[f64]> = (0..500).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let trace = |usage| Trace {
            record: "a <b>".into(),
            usage,
            start: 0.0,
            interval: 0.01,
            measured: Arc::clone(&measured),
            simulated: measured.iter().map(|m| m * (1.0 + rmse)).collect(),
            others: Vec::new(),
            beginnings: Beginnings::default(),
        };
        let gap =
            Gap { train_rmse: rmse, test_rmse: Some(f64::NAN), train_nrmse: rmse, test_nrmse: None, horizon: 10.0 };
        let traces = vec![trace(Usage::Fit), trace(Usage::HeldOut)];
        Arc::new(Stage {
            model: outcome.model.clone(),
            delays: Delays::default(),
            ceiling: None,
            effects,
            gap,
            traces,
            fit: HeldFit::default(),
        })
    };
    let choice = Choice { effect: "coulomb_friction".into(), form: "to ground".into() };
    let added = Added {
        choice: choice.clone(),
        title: "Coulomb friction <to> ground".into(),
        place: Some(sindyscope_search::Site::Ground(0)),
        terms: vec!["sgn(v)".into()],
        equations: vec![("v".into(), vec!["sgn(v)".into()])],
        parameters: vec![Parameter {
            name: "F_c".into(),
            value: 0.125,
            std_error: Some(0.001),
            at_bound: false,
            unit: "m/s^2".into(),
        }],
    };
    let (base, after) = (stage(Vec::new(), 0.2), stage(vec![added.clone()], 0.01));
    let candidate = Candidate {
        choice,
        title: added.title.clone(),
        place: added.place,
        explanation: "A force of constant size.",
        standing: Standing::Refitted,
        explained: 0.9,
        delta_bic: f64::NAN,
        why: "It shrinks the gap.".into(),
        stage: Some(Arc::clone(&after)),
        confused_with: Vec::new(),
        curve: Curve {
            over: None,
            axis: "v".into(),
            unit: "m s^-1".into(),
            measured: vec![[-1.0, 0.1], [f64::NAN, 0.0], [1.0, -0.1]],
            effect: vec![[-1.0, 0.1], [1.0, -0.1]],
            deviation: Vec::new(),
        },
    };
    let mut rival = candidate.clone();
    rival.choice.effect = "stribeck_friction".into();
    rival.title = "Stribeck & friction".into();
    let round = Round {
        before: Arc::clone(&base),
        compared: Arc::clone(&base),
        evidence: Evidence { significant: true, p_value: 1e-9, tests: Vec::new() },
        place: Place { sentence: "Near zero velocity.".into(), ..Place::default() },
        candidates: vec![candidate, rival],
        finding: Finding::Ambiguous(vec![1]),
        next_experiment: Some(NextExperiment { text: "Run it slowly.".into(), test: None }),
        lead: None,
        hidden_up_to: Vec::new(),
    };
    let mut diagnosis = Diagnosis {
        verdict: Verdict::Ambiguous,
        explained: true,
        scores: Vec::new(),
        sentence: "One or the other.".into(),
        noise_floor: 1e-3,
        notices: vec!["thinned".into()],
        blind: Vec::new(),
        rounds: vec![round],
        stages: vec![base, after],
        remaining: Remaining { significant: false, p_value: 0.4, note: String::new() },
        description: None,
        elapsed_ms: 1.0,
    };
    diagnosis.description = diagnosis.stages.last().map(|stage| Description {
        terms: vec!["x*u".into()],
        beside: Vec::new(),
        stage: Arc::clone(stage),
        scores: Vec::new(),
        lead: Lead { blocks: 8, won: 7, against: "none".into(), ..Lead::default() },
        closes: true,
        alternatives: vec![vec!["v*u".into()]],
        curve: Curve {
            axis: "v".into(),
            unit: "m s^-1".into(),
            measured: vec![[-1.0, 0.1], [1.0, -0.1]],
            effect: vec![[-1.0, 0.1], [1.0, -0.1]],
            deviation: vec![0.01, 0.02],
            ..Curve::default()
        },
        sentence: String::new(),
    });
    let records = RecordSet { entries: outcome.records.iter().map(|r| (r.record.clone(), r.usage)).collect() };
    let page = |diagnosis: &Diagnosis| {
        let report = Report {
            title: "walk",
            records: &records,
            outcome: &outcome,
            choice: None,
            command: None,
            diagnosis: Some(diagnosis),
            arrangement: &Arrangement::default(),
        };
        report.png().expect("a picture");
        report.html()
    };
    let html = page(&diagnosis);
    assert_balanced(&html);
    for part in [
        "What is missing",
        "Coulomb friction &lt;to&gt; ground",
        "m/s²",
        "cannot tell it from: Stribeck",
        "Run it slowly",
        "A description, not a law",
        "tell it from v*u",
        "with two standard errors as the fit gives them",
    ] {
        assert!(html.contains(part), "{part}");
    }
    let said = super::walk(&diagnosis, &records);
    for part in [
        "1. Coulomb friction",
        "F_c = 0.125 ± 0.001 m/s²",
        "or else     Stribeck",
        "next        Run it slowly.",
        "A description, not a law",
        "Verdict: ambiguous",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // Wherever its lines are broken.
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("beside the base model: x*u."), "{said}");
    // Of a force without errors nothing is said of them, nor of one that was not fitted.
    diagnosis.description.as_mut().expect("a description").curve.deviation.clear();
    diagnosis.rounds[0].candidates[0].curve.effect.clear();
    assert!(!page(&diagnosis).contains("with two standard errors as the fit gives them"));
    diagnosis.stages.truncate(1);
    diagnosis.rounds.clear();
    assert_balanced(&page(&diagnosis));
    diagnosis.stages.clear();
    assert_balanced(&page(&diagnosis));
}

#[test]
fn a_report_holds_what_was_arranged_in_that_order() {
    let outcome = outcome();
    let mut arrangement =
        Arrangement::of(&[Section::Records, Section::Spectrum, Section::Equation, Section::Waterfall]);
    arrangement.title = "Rig <3>".into();
    arrangement.items.insert(1, Item::Text { text: "# What was & is\n\nOnly <these> words.".into() });
    let page = arranged(&outcome, &arrangement, |r| r.html());
    assert_balanced(&page);
    let parts = [
        "<h1>Rig &lt;3&gt;</h1>",
        "<h2>Data</h2>",
        "<h2>What was &amp; is</h2>",
        "Only &lt;these&gt; words.",
        "Amplitude spectrum of x",
        "<h2>Equation of motion</h2>",
    ];
    let places: Vec<usize> = parts.iter().map(|p| page.find(p).unwrap_or_else(|| panic!("{p}"))).collect();
    assert!(places.is_sorted(), "{places:?}");
    for left_out in ["segment 31 samples", "Phase portrait", "Tried and dropped"] {
        assert!(!page.contains(left_out), "{left_out}");
    }
    let (pages, empty) = arranged(&outcome, &arrangement, |r| r.pages());
    assert_eq!((pages.len(), empty), (1, vec![Section::Waterfall]), "no walk was made");
}

/// The contents of a PDF's streams, unpacked, in the order of the file.
fn streams(pdf: &[u8]) -> Vec<Vec<u8>> {
    use std::io::Read;
    let find = |from: usize, what: &[u8]| pdf[from..].windows(what.len()).position(|w| w == what).map(|k| from + k);
    let (mut found, mut at) = (Vec::new(), 0);
    while let Some(start) = find(at, b"stream\n") {
        let end = find(start, b"\nendstream").expect("a stream ends");
        let mut unpacked = Vec::new();
        flate2::read::ZlibDecoder::new(&pdf[start + 7..end]).read_to_end(&mut unpacked).expect("packed by deflate");
        found.push(unpacked);
        at = end + 10;
    }
    found
}

/// The bytes of the strings that a page shows, with the font each is shown in.
fn shown(content: &[u8]) -> Vec<(usize, Vec<u8>)> {
    let mut shown = Vec::new();
    let (mut font, mut k) = (0, 0);
    while k < content.len() {
        match content[k] {
            b'/' if content[k + 1] == b'F' => font = usize::from(content[k + 2] - b'0'),
            b'<' => {
                let end = k + content[k..].iter().position(|c| *c == b'>').expect("hexadecimal digits end");
                let digits: Vec<u8> =
                    content[k + 1..end].iter().map(|c| char::from(*c).to_digit(16).expect("a digit") as u8).collect();
                shown.push((font, digits.chunks(2).map(|d| 16 * d[0] + d[1]).collect()));
                k = end;
            }
            b'(' => {
                let mut text = Vec::new();
                let mut depth = 0;
                k += 1;
                // Brackets that match within a string stand as they are.
                while content[k] != b')' || depth > 0 {
                    depth += i32::from(content[k] == b'(') - i32::from(content[k] == b')');
                    if content[k] == b'\\' {
                        k += 1;
                        text.push(match content[k] {
                            b'n' => b'\n',
                            b'r' => b'\r',
                            b't' => b'\t',
                            b'b' => 8,
                            b'f' => 12,
                            b'0'..=b'7' => {
                                let code = content[k..k + 3].iter().fold(0u32, |sum, c| 8 * sum + u32::from(c - b'0'));
                                k += 2;
                                code as u8
                            }
                            c => c,
                        });
                    } else {
                        text.push(content[k]);
                    }
                    k += 1;
                }
                shown.push((font, text));
            }
            _ => {}
        }
        k += 1;
    }
    shown
}

/// What a reader of the PDF finds when it searches: the letters of each page, by the fonts' own tables.
fn text_of(pdf: &[u8], pages: usize) -> Vec<String> {
    let streams = streams(pdf);
    let table = |map: &[u8]| -> std::collections::HashMap<u16, String> {
        let map = String::from_utf8_lossy(map).into_owned();
        let code = |text: &str| u16::from_str_radix(text.trim_matches(['<', '>']), 16).expect("hexadecimal");
        map.lines()
            .filter_map(|line| line.split_once("> <"))
            .filter(|(glyph, text)| glyph.len() == 5 && text.ends_with('>') && text.len() % 4 == 1)
            .map(|(glyph, text)| {
                let units: Vec<u16> = (0..text.len() / 4).map(|k| code(&text[4 * k..4 * k + 4])).collect();
                (code(glyph), String::from_utf16_lossy(&units))
            })
            .collect()
    };
    let fonts: Vec<_> = streams.iter().filter(|s| s.windows(9).any(|w| w == b"begincmap")).map(|s| table(s)).collect();
    let letters = |content: &Vec<u8>| {
        let codes = shown(content);
        let text = |(font, bytes): &(usize, Vec<u8>)| -> String {
            bytes.chunks(2).map(|b| fonts[*font][&u16::from_be_bytes([b[0], b[1]])].clone()).collect()
        };
        codes.iter().map(text).collect::<String>()
    };
    streams.iter().take(pages).map(letters).collect()
}

#[test]
fn a_pdf_has_its_fonts_its_text_and_the_same_bytes_each_time() {
    let outcome = outcome();
    for paper in [Paper::A4, Paper::Letter] {
        let arrangement = Arrangement { paper, ..Arrangement::default() };
        let make = || arranged(&outcome, &arrangement, |r| (r.pdf().expect("a PDF"), r.pages().0.len()));
        let (pdf, pages) = make();
        assert!(pdf.starts_with(b"%PDF-1.7") && pdf.ends_with(b"%%EOF"));
        assert!(pages > 2);
        assert_eq!((pdf.clone(), pages), make(), "nothing in it depends on when it was made");
        let count = |what: &str| pdf.windows(what.len()).filter(|w| *w == what.as_bytes()).count();
        assert_eq!((count("/FontFile2"), count("/ToUnicode")), (2, 2), "both fonts are in the file");
        assert_eq!(count("/MediaBox"), pages);
        let size = if paper == Paper::A4 { "[0 0 595.27563 841.8898]" } else { "[0 0 611.99994 792]" };
        assert_eq!(count(size), pages, "{size}");
        let text = text_of(&pdf, pages);
        let whole = text.join("\n");
        for part in [
            "Friction rig <1> & its base",
            "Equation of motion",
            "17.2 µm",
            "Held-out error",
            "(1.23   ± 0.04)",
            "base (m)",
        ] {
            assert!(whole.contains(part), "{part}: {whole}");
        }
        assert!(text[0].contains(&format!("1 / {pages}")) && text[pages - 1].contains(&format!("{pages} / {pages}")));
    }
}

#[test]
fn every_view_stands_alone_at_the_size_asked_for() {
    use super::{FigureFormat, FigureSize};
    use crate::view::{Subject, View, ViewOptions};
    use sindyscope_values::format::shown::ShownUnits;
    let (outcome, options, units) = (outcome(), ViewOptions::default(), ShownUnits::default());
    let size = FigureSize { width: 85.0, height: 60.0, font: 8.0 };
    let mut drawn = 0;
    for view in View::ALL {
        let Ok(figure) = view.figure(&Subject::new(&outcome, 0, &options)) else { continue };
        drawn += 1;
        let svg = figure.svg(size, &units);
        assert_balanced(&svg);
        assert!(svg.contains("width=\"85mm\" height=") && !svg.contains("NaN"), "{view:?}: {}", &svg[..200]);
        let pdf = FigureFormat::Pdf.bytes(&svg, "figure").expect("a PDF");
        let axis = figure.panels().next().map_or("", |p| p.x.symbol.as_str());
        assert!(text_of(&pdf, 1)[0].contains(axis), "{view:?}");
        let png = FigureFormat::Png.bytes(&svg, "figure").expect("a picture");
        let (width, _) = image::load_from_memory(&png).expect("PNG").into_luma8().dimensions();
        assert!(width.abs_diff(1004) < 4, "{width}: 300 pixels to the inch");
    }
    assert!(drawn > 6, "{drawn}");
    let figure = View::Response.figure(&Subject::new(&outcome, 99, &options)).expect("the last record");
    let odd = FigureSize { width: f64::NAN, height: -3.0, font: 1e9 };
    assert!(!figure.svg(odd, &units).is_empty(), "any size is brought within limits");
}
