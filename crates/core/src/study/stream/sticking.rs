//! Streams of dry friction that sticks: how often they alarm though nothing changes, and whether a change is told.
//!
//! `cargo test --profile study -p sindyscope-core --lib sticking -- --ignored --nocapture` prints the table of the book.

use super::tests::{pushed, sample};
use super::*;
use crate::study::Smoothing;
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_values::term::list;

/// A rig that sticks now and then, or in every period.
struct StickingRig {
    name: &'static str,
    scenario: &'static str,
    parameters: &'static [(&'static str, f64)],
    /// Standard deviation of the displacement's noise, m.
    noise: f64,
    /// Whether it slides for long enough that both changes must be told.
    tells: bool,
}

const RIGS: [StickingRig; 4] = [
    StickingRig { name: "now and then", scenario: "friction-multisine", parameters: &[], noise: 1e-5, tells: true },
    StickingRig { name: "hardly any noise", scenario: "friction-multisine", parameters: &[], noise: 1e-6, tells: true },
    StickingRig { name: "often", scenario: "friction-multisine", parameters: &[("F", 0.2)], noise: 1e-5, tells: false },
    StickingRig {
        name: "static above sliding",
        scenario: "friction-multisine",
        parameters: &[("F", 0.12), ("static", 1.3)],
        noise: 1e-5,
        tells: true,
    },
];

/// Length of a stream, and when the rig changes in those in which it does, s.
const SECONDS: f64 = 120.0;
const CHANGE: f64 = 60.0;

impl StickingRig {
    fn record(&self, seconds: f64, seed: u64, change: Option<(&str, f64)>) -> Record {
        let mut parameters: Vec<(String, f64)> = self.parameters.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
        if let Some((name, value)) = change {
            parameters.retain(|(n, _)| n != name);
            parameters.push((name.to_owned(), value));
        }
        let noise = Some(Noise::Deviation(self.noise));
        let options =
            ScenarioOptions { seed, noise, duration: Some(seconds), parameters, ..ScenarioOptions::default() };
        generate(self.scenario, &options).unwrap().records.remove(0)
    }

    fn settings() -> StreamSettings {
        let smoothing = Smoothing::default().with_window(31);
        let terms = list("x, v, u, du, sgn(v)").unwrap();
        let study = Settings { smoothing, terms, threshold: 0.001, ..Settings::default() };
        StreamSettings { study, last: 20.0, false_alarms: 0.1 }
    }
}

/// When alarms are raised, s, and how long blocks were judged, s.
fn alarms(updates: &[StreamUpdate], block: f64) -> (Vec<f64>, f64) {
    let raised = updates.iter().filter(|u| u.change == Some(AlarmChange::Raised)).map(|u| u.time).collect();
    (raised, block * updates.iter().filter(|u| u.judged.is_some()).count() as f64)
}

#[test]
#[ignore = "takes minutes where tests are not optimised"]
fn the_study_of_streams_that_stick() {
    const DRAWS: u64 = 30;
    // Draws on which the rule was made are not those on which it is measured.
    let first: u64 = std::env::var("SINDYSCOPE_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(2000);
    let (mut false_alarms, mut judged, mut told) = (0, 0.0, 0);
    let (mut changes, mut late): (u64, Vec<f64>) = (0, Vec::new());
    for rig in &RIGS {
        let (mut own, mut own_judged) = (0, 0.0);
        for seed in first..first + DRAWS {
            let record = rig.record(SECONDS, seed, None);
            let mut stream = Stream::new(record.slice(0..20_000), StickingRig::settings()).unwrap();
            let updates = pushed(&mut stream, &record, 0..record.len());
            let (raised, seconds) = alarms(&updates, stream.blocking().seconds());
            own += raised.len();
            own_judged += seconds;
        }
        println!("{}: {own} false alarms in {:.0} s judged of {:.0} s", rig.name, own_judged, DRAWS as f64 * SECONDS);
        (false_alarms, judged) = (false_alarms + own, judged + own_judged);
        for (what, value) in [("k", 0.9 * 358.706), ("F", 1.5 * rig.friction())] {
            let mut found = Vec::new();
            for seed in first..first + DRAWS / 3 {
                let before = rig.record(CHANGE, seed, None);
                let after = rig.record(SECONDS - CHANGE, seed + 1000, Some((what, value)));
                let mut stream = Stream::new(before.slice(0..20_000), StickingRig::settings()).unwrap();
                let mut updates = pushed(&mut stream, &before, 0..before.len());
                updates.extend(stream.begin(CHANGE));
                updates.extend((0..after.len()).filter_map(|k| stream.push(&sample(&after, k))));
                let (raised, _) = alarms(&updates, stream.blocking().seconds());
                found.extend(raised.iter().find(|at| **at > CHANGE).map(|at| at - CHANGE));
            }
            found.sort_by(f64::total_cmp);
            println!("  {what} to {value:.3}: told in {} of {}, after {found:.1?} s", found.len(), DRAWS / 3);
            if rig.tells {
                changes += DRAWS / 3;
                told += found.len();
                late.extend(found);
            }
        }
    }
    late.sort_by(f64::total_cmp);
    let allowed = 0.1 * judged / 3600.0;
    println!("{false_alarms} false alarms in {:.2} h judged, {allowed:.2} allowed", judged / 3600.0);
    println!(
        "{told} of {changes} changes told of those that must be, half of them within {:.1} s",
        late[late.len() / 2]
    );
    // Where 0.36 are allowed, three come by chance once in 170 studies.
    assert!(false_alarms <= 2, "{false_alarms} false alarms");
    assert!(told as f64 >= 0.95 * changes as f64, "{told} of {changes}");
}

impl StickingRig {
    fn friction(&self) -> f64 {
        self.parameters.iter().find(|(name, _)| *name == "F").map_or(0.0856, |(_, value)| *value)
    }
}
