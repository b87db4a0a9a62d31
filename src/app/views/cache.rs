//! What views compute from an outcome and keep until it changes.

use std::collections::{HashMap, HashSet};
use std::sync::{Arc, OnceLock, Weak};

use egui_plot::PlotPoint;

use super::kept::Kept;
use super::{Picture, View};
use crate::app::plot::decimate::{Decimated, Samples};
use crate::app::plot::palette::Ink;
use sindyscope_core::signal::{Peak, Spectrum};
use sindyscope_core::study::Outcome;

/// A curve of a plot: the plot's name and what is drawn.
pub(super) type CurveKey = (&'static str, Ink);

/// Amplitude spectra of one displacement of one record.
#[derive(Debug, Default)]
pub(super) struct Spectra {
    pub(super) measured: Option<Spectrum>,
    pub(super) identified: Option<Spectrum>,
    pub(super) error: Option<Spectrum>,
    /// Main line of the measurement.
    pub(super) peak: Option<Peak>,
    /// Range of log₁₀ amplitudes worth showing.
    pub(super) range: (f64, f64),
}

/// Where the error is worst: a stretch of time, and the root mean square of the error on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) rms: f64,
}

/// Points thinned for a view, and for what lies around it: a view that is moved finds them ready.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    covers: Option<([f64; 2], [f64; 2])>,
    scale: [f64; 2],
    log: bool,
    pub(super) points: Vec<PlotPoint>,
}

/// What is to be drawn: bounds, and pixels per unit.
pub(super) struct Wanted {
    pub(super) min: [f64; 2],
    pub(super) max: [f64; 2],
    pub(super) scale: [f64; 2],
}

impl Drawn {
    /// What has to be drawn anew to show these bounds on as many pixels; none if the points do.
    pub(super) fn wanted(&mut self, min: [f64; 2], max: [f64; 2], pixels: [f64; 2], log: bool) -> Option<Wanted> {
        let scale: [f64; 2] = std::array::from_fn(|k| pixels[k] / (max[k] - min[k]));
        let ready = self.log == log
            && self.covers.is_some_and(|(from, to)| (0..2).all(|k| from[k] <= min[k] && max[k] <= to[k]))
            && (0..2).all(|k| (0.8..1.25).contains(&(scale[k] / self.scale[k])));
        if ready || !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
            return None;
        }
        let margin: [f64; 2] = std::array::from_fn(|k| 0.5 * (max[k] - min[k]));
        let wanted = Wanted {
            min: std::array::from_fn(|k| min[k] - margin[k]),
            max: std::array::from_fn(|k| max[k] + margin[k]),
            scale,
        };
        self.covers = Some((wanted.min, wanted.max));
        self.scale = scale;
        self.log = log;
        Some(wanted)
    }
}

/// Everything here belongs to one outcome, one record, one degree of freedom and one input, and is dropped with them.
#[derive(Clone, Debug, Default)]
pub(super) struct Cache {
    // Weak references, so that the addresses compared are not given to newer outcomes meanwhile.
    outcome: Weak<Outcome>,
    previous: Weak<Outcome>,
    /// Record, degree of freedom, input.
    chosen: [usize; 3],
    curves: HashMap<CurveKey, Decimated>,
    pub(super) drawn: HashMap<CurveKey, Drawn>,
    pub(super) series: HashMap<CurveKey, Arc<[f64]>>,
    pub(super) worst: Option<Option<Stretch>>,
    /// The error's running root mean square, where it is too dense to be read.
    pub(super) running: Option<Arc<[f64]>>,
    /// Range of the phase portrait along both axes.
    pub(super) portrait: Option<[(f64, f64); 2]>,
    pub(super) spectra: Option<Arc<OnceLock<Spectra>>>,
    /// Figures, which know themselves what they were made of.
    pub(super) figures: Kept,
    /// What the view was last fitted to; other data are fitted anew, the same data keep their zoom.
    shown: Option<(Arc<str>, usize, u64, u64)>,
    fitted: HashSet<(View, &'static str)>,
    /// Time range to be shown from the next frame on.
    pub(super) go_to: Option<(f64, f64)>,
}

impl Cache {
    /// Forgets what belongs to another outcome.
    pub(super) fn attend_to(&mut self, picture: &Picture<'_>, chosen: [usize; 3]) {
        let same = self.outcome.as_ptr() == Arc::as_ptr(picture.outcome)
            && self.previous.as_ptr() == picture.previous.map_or(Weak::new().as_ptr(), Arc::as_ptr)
            && self.chosen == chosen;
        if same {
            return;
        }
        let data = &picture.outcome.records[chosen[0]].record;
        let shown = (Arc::from(data.name.as_str()), data.len(), data.start.to_bits(), data.interval.to_bits());
        let (fitted, figures) = if self.shown.as_ref() == Some(&shown) && self.chosen == chosen {
            (std::mem::take(&mut self.fitted), std::mem::take(&mut self.figures))
        } else {
            Default::default()
        };
        *self = Self {
            outcome: Arc::downgrade(picture.outcome),
            previous: picture.previous.map_or_else(Weak::new, Arc::downgrade),
            chosen,
            shown: Some(shown),
            fitted,
            figures,
            ..Self::default()
        };
    }

    /// Whether a plot has to be fitted to its data, once.
    pub(super) fn must_fit(&mut self, view: View, plot: &'static str) -> bool {
        self.fitted.insert((view, plot))
    }

    pub(super) fn fit_all(&mut self) {
        self.fitted.clear();
    }

    /// The curve of a series, ready to be asked for its points.
    pub(super) fn curve(&mut self, key: CurveKey, samples: &Samples<'_>) -> &mut Decimated {
        self.curves.entry(key).or_insert_with(|| Decimated::new(samples.values))
    }

    /// A curve that [`Self::curve`] was asked for.
    pub(super) fn ready(&self, key: CurveKey) -> Option<&Decimated> {
        self.curves.get(&key)
    }
}
