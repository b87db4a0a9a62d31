//! A seed makes the same records for ever: checksums of the records of every scenario, of the adjustable rig and of rigs
//! with hidden effects, stored in `fixtures/checksums.txt`.
//!
//! A record's samples are rounded to ten digits, so the last bit of a platform's sine does not show. Where records are
//! meant to change (a new scenario, say), `UPDATE_CHECKSUMS=1 cargo test -p sindyscope-rig --test checksums -- --ignored`
//! writes the file anew; its difference then shows which did.

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use sindyscope_rig::hidden::{self, ExcitationKind, Hidden, HiddenRequest, Instruments, Regime, SensedMotion};
use sindyscope_rig::{
    ExcitationChoice, Noise, NoiseKind, PlantChoice, RigDrive, RigError, RigSettings, ScenarioOptions, generate,
    record_rig, scenarios,
};
use sindyscope_values::record::Record;

/// The 64-bit hash of Fowler, Noll and Vo (FNV-1a).
struct Checksum(u64);

impl Checksum {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Everything that a record holds, each sample by its bits.
    fn add_record(&mut self, record: &Record) {
        self.add(record.name.as_bytes());
        self.add(&record.start.to_bits().to_le_bytes());
        self.add(&record.interval.to_bits().to_le_bytes());
        for channel in &record.channels {
            let role = format!("{}{}", channel.role.symbol(), channel.role.index());
            self.add(format!("{} {role} {} {}", channel.name, channel.unit, channel.estimated).as_bytes());
            for value in channel.values.iter() {
                self.add(&value.to_bits().to_le_bytes());
            }
        }
        for notice in &record.notices {
            self.add(notice.as_bytes());
        }
    }
}

/// Checksums of records and of the words that say what made them, or of the error.
fn line<'a>(made: Result<(impl IntoIterator<Item = &'a Record>, Vec<String>), &RigError>) -> String {
    let mut checksum = Checksum::new();
    match made {
        Ok((records, truth)) => {
            records.into_iter().for_each(|record| checksum.add_record(record));
            let mut words = Checksum::new();
            words.add(truth.join("\n").as_bytes());
            format!("{:016x} {:016x}", checksum.0, words.0)
        }
        Err(error) => {
            checksum.add(error.to_string().as_bytes());
            format!("{:016x} refused", checksum.0)
        }
    }
}

fn scenario_options() -> Vec<(&'static str, ScenarioOptions)> {
    let none = ScenarioOptions::default;
    let text = |names: &[&str]| Some(names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
    vec![
        ("as it is", none()),
        ("seed", ScenarioOptions { seed: 7, ..none() }),
        (
            "sensors",
            ScenarioOptions {
                seed: 3,
                noise: Some(Noise::ShareOfPeak(0.02)),
                input_noise: Some(Noise::Deviation(1e-4)),
                resolution: Some(1e-5),
                offset: Some(0.1),
                drift: Some(-0.01),
                high_pass: Some(0.2),
                duration: Some(3.0),
                ..none()
            },
        ),
        (
            "noise alone",
            ScenarioOptions { seed: 4, noise: Some(Noise::Deviation(1e-3)), duration: Some(4.0), ..none() },
        ),
        ("velocities", ScenarioOptions { measure: text(&["v"]), duration: Some(2.0), ..none() }),
        ("mixed", ScenarioOptions { measure: text(&["x1", "a"]), duration: Some(2.0), ..none() }),
        ("together", ScenarioOptions { together: true, ramp: Some(1.5), duration: Some(5.0), ..none() }),
        ("multisine", ScenarioOptions { seed: 11, lines: Some(17), ramp: Some(0.5), duration: Some(5.0), ..none() }),
        (
            "band",
            ScenarioOptions { amplitude: Some(2e-3), frequencies: Some(vec![0.7, 3.3]), duration: Some(6.0), ..none() },
        ),
        ("settled", ScenarioOptions { settle: Some(2.5), rate: Some(250.0), duration: Some(3.0), ..none() }),
        ("begun", ScenarioOptions { initial: Some(vec![0.004, -0.01]), duration: Some(3.0), ..none() }),
        ("stiffer", ScenarioOptions { parameters: vec![("k".into(), 300.0)], duration: Some(3.0), ..none() }),
        ("rubbing", ScenarioOptions { parameters: vec![("F12".into(), 0.5)], duration: Some(3.0), ..none() }),
        (
            "joint between nodes",
            ScenarioOptions {
                seed: 5,
                measure: text(&["x2", "a3"]),
                levels: Some(vec![0.5, 2.0, 2.0]),
                parameters: [
                    ("n", 4.0),
                    ("place", 4.0),
                    ("from", 2.0),
                    ("joint", 300.0),
                    ("slip", 0.5),
                    ("cubic", 1e4),
                ]
                .map(|(name, value)| (name.to_owned(), value))
                .to_vec(),
                duration: Some(2.0),
                ..none()
            },
        ),
        (
            "stops and friction",
            ScenarioOptions {
                parameters: [("place", 2.0), ("stop", 2e3), ("gap", 1e-4), ("friction", 0.2)]
                    .map(|(name, value)| (name.to_owned(), value))
                    .to_vec(),
                duration: Some(2.0),
                ..none()
            },
        ),
        ("too long", ScenarioOptions { duration: Some(1e9), ..none() }),
    ]
}

fn rig_settings() -> Vec<(String, RigSettings)> {
    let short = RigSettings { duration: 6.0, ..RigSettings::default() };
    let mut all = vec![
        ("default".to_owned(), RigSettings::default()),
        ("offset, jitter".to_owned(), RigSettings { offset: 0.3, jitter: 0.1, settle: 2.0, seed: 9, ..short.clone() }),
        ("too dense".to_owned(), RigSettings { rate: 1e6, ..short.clone() }),
    ];
    for effect in hidden::names().chain(hidden::outside_names()) {
        for drive in [RigDrive::Force, RigDrive::Base] {
            let level = if drive == RigDrive::Base { 0.005 } else { 1.0 };
            let settings = RigSettings { effect: Some(effect.to_owned()), drive, level, ..short.clone() };
            all.push((format!("{effect} {drive:?}"), settings));
        }
        let across = RigSettings { to_ground: false, drive: RigDrive::Base, level: 0.005, ..short.clone() };
        all.push((format!("{effect} joint"), across.with_effect(Some(effect.to_owned()))));
    }
    for plant in PlantChoice::ALL {
        for excitation in ExcitationChoice::ALL {
            let suited = short.clone().with_plant(plant).with_excitation(excitation);
            all.push((format!("{plant:?} {excitation:?}"), RigSettings { duration: 5.0, ..suited.clone() }));
            if plant.parameters().iter().any(|p| p.name == "F12") {
                let chain = [("F12".to_owned(), 0.3), ("h1".to_owned(), 4e5)].into();
                all.push((format!("{plant:?} {excitation:?} rubbing"), RigSettings { chain, duration: 5.0, ..suited }));
            }
        }
    }
    all
}

fn requests() -> Vec<(String, HiddenRequest)> {
    let mut all = Vec::new();
    for seed in 0..64 {
        for (k, excitation_kind) in ExcitationKind::ALL.into_iter().enumerate() {
            let turn = seed as usize + k;
            let instruments = Instruments {
                shown: SensedMotion::ALL[turn % 3],
                kind: NoiseKind::ALL[(turn / 3) % 3],
                jitter: if turn.is_multiple_of(5) { 0.02 } else { 0.0 },
                ..Instruments::white([0.0, 0.01, 0.03][turn % 3])
            };
            let samples = if seed < 8 { 3000 } else { 400 };
            let request = HiddenRequest { instruments, samples, ..HiddenRequest::blind(excitation_kind, seed) };
            all.push((format!("{seed} {excitation_kind} {:?}", request.effects), request));
        }
    }
    for (k, pair) in hidden::pairs().iter().enumerate() {
        let request = HiddenRequest {
            ratio: Some(0.06),
            ..HiddenRequest::new(*pair, ExcitationKind::ALL[k % 3], 100 + k as u64)
        };
        all.push((format!("{} {pair:?}", request.seed), request));
    }
    all.push(("nothing".to_owned(), HiddenRequest::new([] as [&str; 0], ExcitationKind::Multisine, 200)));
    all
}

fn of_hidden(made: &Result<Hidden, RigError>) -> String {
    line(made.as_ref().map(|h| {
        let mut words = vec![h.truth.description.clone(), format!("base excited: {}", h.base_excited)];
        words.extend(h.base.iter().flatten().map(ToString::to_string));
        // Eight digits: these are not rounded as samples are.
        words.extend(h.truth.parameters.iter().map(|p| format!("{} {:.8e} {}", p.name, p.value, p.unit)));
        (h.fit.iter().chain(&h.held_out), words)
    }))
}

/// A case's name, and what makes its line.
type Case = (String, Box<dyn Fn() -> String + Send + Sync>);

fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    for scenario in scenarios() {
        for (words, options) in scenario_options() {
            let run = move || {
                let made = generate(scenario.name, &options);
                line(made.as_ref().map(|g| (&g.records, g.comments.clone())))
            };
            cases.push((format!("scenario {}, {words}", scenario.name), Box::new(run)));
        }
    }
    for (words, settings) in rig_settings() {
        let run = move || {
            let made = record_rig(&settings);
            line(made.as_ref().map(|r| {
                let values = r.effect_values.iter().map(|v| format!("{} {:.8e} {}", v.name, v.value, v.unit));
                let terms = r.truth.terms.iter().map(|t| format!("{:.8e} {}", t.coefficient, t.text));
                let told = r.truth.description.clone();
                (&r.records, std::iter::once(told).chain(values).chain(terms).collect())
            }))
        };
        cases.push((format!("rig {words}"), Box::new(run)));
    }
    for (words, request) in requests() {
        cases.push((format!("hidden {words}"), Box::new(move || of_hidden(&hidden::draw(&request)))));
    }
    for regime in Regime::ALL {
        for seed in 0..6 {
            cases
                .push((format!("regime {regime} {seed}"), Box::new(move || of_hidden(&hidden::draw_in(regime, seed)))));
        }
    }
    cases
}

/// Of the cases that a plain run makes there are this many times as many.
const STRIDE: usize = 7;

#[test]
fn a_seed_makes_the_records_that_it_made() {
    compare(cases().into_iter().step_by(STRIDE).collect());
}

#[test]
#[ignore = "two minutes: every case"]
fn every_seed_makes_the_records_that_it_made() {
    compare(cases());
}

/// Makes the cases and compares their checksums with the stored ones.
fn compare(cases: Vec<Case>) {
    let made: Vec<(String, String)> = cases.into_par_iter().map(|(name, make)| (name, make())).collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/checksums.txt");
    if std::env::var_os("UPDATE_CHECKSUMS").is_some() {
        let text: String = made.iter().map(|(name, sums)| format!("{sums} {name}\n")).collect();
        std::fs::write(&file, text).expect("the fixture can be written");
    }
    let text = std::fs::read_to_string(&file).expect("the fixture is there");
    let known: BTreeMap<&str, &str> =
        text.lines().filter_map(|l| l.match_indices(' ').nth(1).map(|(at, _)| (&l[at + 1..], &l[..at]))).collect();
    let changed = |(name, sums): &&(String, String)| known.get(name.as_str()) != Some(&sums.as_str());
    let changed: Vec<&String> = made.iter().filter(changed).map(|(name, _)| name).collect();
    assert!(changed.is_empty(), "{} of {} are made otherwise than before: {changed:#?}", changed.len(), made.len());
}
