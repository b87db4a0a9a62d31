//! What a search costs and what it says, held against a stored snapshot: a silent slowdown or a changed answer is seen.
//!
//! Where they were meant to change, `UPDATE_EFFORT=1 cargo test -p sindyscope-search --test constants` stores them anew.

use std::path::Path;

use super::drawn::{Drawn, Searched, hidden, in_regime, searched, two_masses};
use rayon::prelude::*;
use sindyscope_rig::hidden::{ExcitationKind, Instruments, Regime};
use sindyscope_search::CONSTANTS;

/// Share by which the integration steps may differ: where a fit ends may hang on the last digit, in which processors differ.
const SAME_STEPS: f64 = 0.05;

fn quiet(effects: &str, excitation: ExcitationKind, seed: u64) -> Drawn {
    hidden(effects, excitation, Instruments::white(0.01), 900, seed)
}

fn searches() -> Vec<Drawn> {
    vec![
        quiet("one_sided_stop", ExcitationKind::Multisine, 60),
        quiet("quadratic_damping", ExcitationKind::Decay, 51),
        in_regime(Regime::Sticking, 9),
        quiet("unmeasured_harmonic_force+coulomb_friction", ExcitationKind::Multisine, 82),
        quiet("", ExcitationKind::SweepPair, 5),
        two_masses(0.3, 1),
    ]
}

/// One search of the snapshot: its name, its integration steps, and all else that it came to.
#[derive(Clone, Debug, PartialEq)]
struct Entry {
    name: String,
    steps: usize,
    rest: String,
}

impl Entry {
    fn new(drawn: &Drawn, searched: &Searched) -> Self {
        let Searched { verdict, names, effort, .. } = searched;
        let names = if names.is_empty() { String::new() } else { format!(" {}", names.join(" + ")) };
        let rest = format!("{} sets proposed, {} fitted; {}{names}", effort.proposed, effort.fitted, verdict.word());
        Self { name: drawn.name.clone(), steps: effort.steps, rest }
    }

    fn text(&self) -> String {
        format!("{}\n    {} steps; {}\n", self.name, self.steps, self.rest)
    }

    /// Every search of a snapshot.
    fn read(text: &str) -> Vec<Self> {
        let mut lines = text.lines();
        let mut entries = Vec::new();
        while let (Some(name), Some(counted)) = (lines.next(), lines.next()) {
            let (steps, rest) = counted.trim().split_once(" steps; ").unwrap();
            entries.push(Self { name: name.to_owned(), steps: steps.parse().unwrap(), rest: rest.to_owned() });
        }
        entries
    }

    fn is_as(&self, stored: &Self) -> bool {
        let apart = self.steps.abs_diff(stored.steps) as f64 / stored.steps as f64;
        (&self.name, &self.rest) == (&stored.name, &stored.rest) && apart <= SAME_STEPS
    }
}

#[test]
fn searches_cost_what_they_cost_before_and_say_the_same() {
    let found: Vec<Entry> =
        searches().par_iter().map(|drawn| Entry::new(drawn, &searched(drawn, &CONSTANTS))).collect();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/effort.txt");
    if std::env::var_os("UPDATE_EFFORT").is_some() {
        std::fs::write(&file, found.iter().map(Entry::text).collect::<String>()).unwrap();
    }
    let stored = Entry::read(&std::fs::read_to_string(&file).unwrap());
    assert_eq!(found.len(), stored.len(), "as many searches as are stored");
    let changed: Vec<String> = found
        .iter()
        .zip(&stored)
        .filter(|(found, stored)| !found.is_as(stored))
        .map(|(found, stored)| format!("{}was stored as\n{}", found.text(), stored.text()))
        .collect();
    assert!(changed.is_empty(), "{}", changed.join("\n"));
}
