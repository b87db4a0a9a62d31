//! The map of settings, computed beside everything else while a view shows it.

use std::sync::Arc;

use super::state::Edit;
use sindyscope_core::study::{Settings, SettingsGrid};
use sindyscope_values::record::Usage;

/// What a map depends on: everything but the two settings that it is spread over.
#[derive(Clone, Debug, PartialEq)]
struct MapKey {
    generation: u64,
    usage: Vec<Usage>,
    settings: Settings,
}

impl MapKey {
    fn new(generation: u64, edit: &Edit) -> Self {
        let mut settings = edit.settings.clone();
        settings.smoothing = settings.smoothing.with_window(0);
        settings.threshold = 0.0;
        Self { generation, usage: edit.usage.clone(), settings }
    }
}

/// The map that is being made, or was.
#[derive(Debug, Default)]
pub(crate) struct SettingsMap {
    asked: Option<MapKey>,
    map: Option<(MapKey, Arc<SettingsGrid>)>,
    failure: Option<String>,
}

impl SettingsMap {
    /// True if the map of these records and settings is to be asked for: it is neither there nor on its way.
    pub(crate) fn wants(&mut self, generation: u64, edit: &Edit) -> bool {
        let key = MapKey::new(generation, edit);
        if self.asked.as_ref() == Some(&key) {
            return false;
        }
        if self.map.as_ref().is_some_and(|(known, _)| known.generation != generation) {
            self.map = None;
        }
        self.failure = None;
        self.asked = Some(key);
        true
    }

    /// Takes in the map that was asked for, as far as it is known.
    pub(crate) fn take(&mut self, map: SettingsGrid) {
        if let Some(key) = &self.asked {
            self.map = Some((key.clone(), Arc::new(map)));
        }
    }

    /// Notes why there is none.
    pub(crate) fn fail(&mut self, reason: String) {
        self.failure = Some(reason);
    }

    /// The map as far as it is known, and whether it is that of older settings.
    pub(crate) fn map(&self) -> Option<(&Arc<SettingsGrid>, bool)> {
        self.map.as_ref().map(|(key, map)| (map, self.asked.as_ref() != Some(key)))
    }

    /// Why there is no map.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }
}
