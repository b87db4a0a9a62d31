//! What the records are of: the masses, what the sensor of each shows, and whether the base moves.

use crate::app::records::OpenRecords;
use sindyscope_core::study::base_excited;
use sindyscope_search::{Candidate, Site};
use sindyscope_values::format::units::per_second;
use sindyscope_values::record::Role;
use sindyscope_values::term::{Kind, Layout};

/// The masses and their sensors, as the first record has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct WalkSubject {
    pub(super) layout: Layout,
    /// The sensor of each mass.
    pub(super) sensors: Vec<MassSensor>,
    /// Whether the base moves; else it is the ground.
    pub(super) base_moves: bool,
    /// Unit of a force per mass.
    pub(super) acceleration: String,
}

/// What a mass's sensor shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MassSensor {
    /// `x`, `x2`, `a1`.
    pub(super) symbol: String,
    /// Its unit; empty if the record does not say.
    pub(super) unit: String,
}

impl WalkSubject {
    pub(super) fn of(data: &OpenRecords) -> Self {
        let Some(record) = data.records.first() else { return Self::default() };
        let layout = record.layout(Kind::SecondOrder);
        let masses = layout.freedoms;
        let sensors = (0..masses).filter_map(|k| record.sensor(k)).map(|channel| {
            let letter = channel.role.symbol();
            let symbol = match channel.role {
                Role::Displacement(k) | Role::Velocity(k) | Role::Acceleration(k) if masses > 1 => {
                    format!("{letter}{}", k + 1)
                }
                _ => letter.to_owned(),
            };
            MassSensor { symbol, unit: channel.unit.trim().to_owned() }
        });
        let acceleration = record.sensor(0).map_or_else(String::new, |channel| {
            let unit = channel.unit.trim();
            match channel.role {
                Role::Acceleration(_) => unit.to_owned(),
                Role::Velocity(_) => per_second(unit),
                _ => per_second(&per_second(unit)),
            }
        });
        let base_moves = base_excited(record, Kind::SecondOrder);
        Self { layout, sensors: sensors.collect(), base_moves, acceleration }
    }

    pub(super) fn masses(&self) -> usize {
        self.sensors.len()
    }

    /// The sensor of a mass; an unnamed one of a mass that there is not.
    pub(super) fn sensor(&self, mass: usize) -> MassSensor {
        self.sensors
            .get(mass)
            .cloned()
            .unwrap_or_else(|| MassSensor { symbol: "x".to_owned(), ..MassSensor::default() })
    }

    /// Where an effect may act.
    pub(super) fn sites(&self) -> Vec<Site> {
        Site::all(self.masses(), self.base_moves)
    }
}

/// A candidate's name with its place as the picture writes it: a card is too narrow for both in words.
pub(super) fn short_title(candidate: &Candidate, masses: usize) -> String {
    let place = candidate.place.filter(|_| masses > 1);
    let title = candidate.title.strip_suffix(&format!(", {}", candidate.choice.form));
    let (Some(site), Some(title)) = (place, title) else { return candidate.title.clone() };
    let at = match site {
        Site::Ground(k) => format!("m{} to ground", k + 1),
        Site::Joint(i, j) => format!("m{}–m{}", i + 1, j + 1),
        Site::Base(k) => format!("base–m{}", k + 1),
    };
    format!("{title}, {at}")
}

/// A site in words: `between masses 1 and 2`.
pub(super) fn site_name(site: Site, masses: usize) -> String {
    match site {
        Site::Ground(_) if masses == 1 => "to ground".to_owned(),
        Site::Base(_) if masses == 1 => "between base and mass".to_owned(),
        Site::Ground(k) => format!("mass {} to ground", k + 1),
        Site::Joint(i, j) => format!("between masses {} and {}", i + 1, j + 1),
        Site::Base(k) => format!("between base and mass {}", k + 1),
    }
}
