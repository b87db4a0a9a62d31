//! What records tell before any smoothing: noise and main period.

use std::sync::{Arc, Mutex, Weak};

use super::noise::standard_deviation;
use super::spectrum::main_period;
use crate::parallel::lock;
use sindyscope_values::record::{Record, Role};
use sindyscope_values::term::Layout;

/// What a record tells before any smoothing.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalFacts {
    /// Main period of the first displacement, s, if it oscillates.
    pub main_period: Option<f64>,
    /// Standard deviation of each displacement's noise.
    pub noise: Vec<f64>,
    /// Standard deviation of each input's noise.
    pub input_noise: Vec<f64>,
    /// Standard deviation of each channel's noise, in the record's order.
    pub channel_noise: Vec<f64>,
}

/// A record, the layout it was seen with, and its facts.
type KnownFacts = (Weak<Record>, Layout, Arc<SignalFacts>);

/// Facts of the records in use.
static KNOWN: Mutex<Vec<KnownFacts>> = Mutex::new(Vec::new());

impl SignalFacts {
    /// The facts of a record, measured once as long as it is in use.
    pub fn cached(record: &Arc<Record>, layout: &Layout) -> Arc<Self> {
        let same = |(of, with, _): &&KnownFacts| std::ptr::eq(of.as_ptr(), Arc::as_ptr(record)) && with == layout;
        // What a thread that panicked left is whole: entries come and go at once.
        let known = || lock(&KNOWN);
        if let Some((.., facts)) = known().iter().find(same) {
            return Arc::clone(facts);
        }
        let facts = Arc::new(Self::new(record, layout));
        let mut known = known();
        known.retain(|(record, ..)| record.strong_count() > 0);
        known.push((Arc::downgrade(record), *layout, Arc::clone(&facts)));
        facts
    }

    /// Measures a record.
    pub fn new(record: &Record, layout: &Layout) -> Self {
        let values = |role: Role| record.channel(role).map(|c| &*c.values);
        let channel_noise: Vec<f64> =
            record.channels.iter().map(|c| standard_deviation(&c.values).unwrap_or(0.0)).collect();
        let noise =
            |role: Role| record.channels.iter().position(|c| c.role == role).map_or(0.0, |index| channel_noise[index]);
        let first = Role::Displacement(0);
        Self {
            main_period: values(first).and_then(|x| main_period(x, record.interval, noise(first))),
            noise: (0..layout.freedoms).map(|i| noise(Role::Displacement(i))).collect(),
            input_noise: (0..layout.inputs).map(|j| noise(Role::Input(j))).collect(),
            channel_noise,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_rig::{ScenarioOptions, generate};
    use sindyscope_values::term::Kind;

    #[test]
    fn a_record_is_measured_once_and_not_kept_for_that() {
        let options = ScenarioOptions { duration: Some(5.0), ..ScenarioOptions::default() };
        let record = Arc::new(generate("duffing-noisy", &options).unwrap().records.remove(0));
        let layout = record.layout(Kind::SecondOrder);
        let facts = SignalFacts::cached(&record, &layout);
        assert_eq!(*facts, SignalFacts::new(&record, &layout));
        assert!(Arc::ptr_eq(&facts, &SignalFacts::cached(&record, &layout)));
        let first_order = record.layout(Kind::FirstOrder);
        assert!(!Arc::ptr_eq(&facts, &SignalFacts::cached(&record, &first_order)));
        let known = Arc::downgrade(&record);
        drop(record);
        assert!(known.upgrade().is_none(), "what is known of a record does not keep it");
    }
}
