//! Noise that is more than its estimate. Without a model noise is heard where there is no motion, above its frequencies; a sensor
//! whose noise is coloured has more of it below. What a model leaves tells: where the tests that ask for a gap find nothing in it, it is
//! noise.

use std::sync::Arc;

use super::effects::Form;
use super::evidence::Examined;
use super::fit::{Fitted, WHOLE};
use super::ruling::Tried;
use super::search::Search;
use sindyscope_core::study::Cancel;

/// What the sets that were tried tell of the noise.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ColouredNoise {
    /// Its RMS, more than the estimate without a model; zero where no set tells.
    pub(super) rms: f64,
    /// The least RMS left of which it was asked whether it is noise.
    least: Option<f64>,
}

impl ColouredNoise {
    /// Asks what a model leaves for its noise, if none of which that was asked left less.
    pub(super) fn ask(&mut self, error: f64, noise: impl FnOnce() -> Option<f64>) {
        if self.least.is_none_or(|least| error < least) {
            self.least = Some(error);
            self.rms = noise().unwrap_or(self.rms);
        }
    }
}

impl Search {
    /// True if a set explains the data: it leaves no more than noise as it is estimated, or as what another set leaves has
    /// shown it to be.
    pub(super) fn explains(&self, fitted: &Fitted, noise: f64, cancel: &Cancel) -> bool {
        let times = self.data.constants.explaining();
        self.data.is_within(fitted, times, cancel)
            || fitted.error() <= times.0 * noise && fitted.held_out_error() <= times.1 * noise
    }

    /// True if a model leaves more on the data fitted than it could where it [explains](Self::explains) them, whatever the noise is
    /// found to be.
    pub(super) fn leaves_more_than_noise(&self, fitted: &Fitted, cancel: &Cancel) -> bool {
        let constants = &self.data.constants;
        let more = |noise: f64| fitted.error() >= constants.explaining().0 * constants.loud * noise;
        more(self.data.noise) && more(self.data.noise_of(fitted, cancel))
    }

    /// What a model leaves, RMS, if that is noise by all tests, and along whole records: along short stretches they hear little. None
    /// where it is louder than the estimate can be wrong by.
    pub(super) fn noise_left(&self, fitted: &Fitted, forms: &[Form], cancel: &Cancel) -> Option<f64> {
        let data = &self.data;
        let (error, unseen) = (fitted.error(), fitted.held_out_error());
        let may_be = data.constants.loud * data.noise_of(fitted, cancel);
        // Noise is as large in data that were not fitted.
        let alike = unseen <= data.constants.explaining().1 * error;
        if fitted.level != WHOLE || error >= may_be || !alike {
            return None;
        }
        let motion = data.motion(fitted, cancel)?;
        let screened = data.screen(fitted, &motion, forms, cancel);
        let seen = Examined { fitted, motion: &motion, forms, screened: &screened };
        data.evidence(&seen, cancel).filter(|evidence| !evidence.significant).map(|_| error)
    }

    /// Asks the best set whether it is noise that it leaves, where none explains the data.
    pub(super) fn ask_for_noise(&self, tried: &mut Tried, cancel: &Cancel) {
        let Some(best) = tried.nearest(|set| !set.forms.is_empty()) else { return };
        let fitted = Arc::clone(&tried.sets[best].fitted);
        if !self.explains(&fitted, tried.coloured.rms, cancel) {
            tried.coloured.ask(fitted.error(), || self.noise_left(&fitted, &tried.forms, cancel));
        }
    }
}
