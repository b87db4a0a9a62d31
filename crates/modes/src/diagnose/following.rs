//! A closed loop fitted along the records, and followed along those never fitted.

use super::super::closed::{ClosedModel, Course, Free, InitialState, Segment};
use super::super::judge::rms;
use super::super::limits::{
    BEGINNING, EXPLAINS, FOLLOWED, HELD_GAIN, HELD_STEPS, HOLDS, KEPT, LEAST_STRETCH, NEAR_NOISES, OF_FIRST, OF_SHORT,
    SAME_HOLDS, SAME_WAY, STATE_STEPS, STRETCH, WHOLE_STEPS,
};
use super::super::measurement::SensorSeries;
use super::super::motion::PARTS;
use super::ForceSearch;
use super::beginning::{BegunFit, States, held, stretches};
use sindyscope_core::study::Cancel;

/// A model fitted in closed loop.
pub(super) struct FollowedForce {
    pub(super) model: ClosedModel,
    pub(super) course: Course,
    pub(super) residuals: Vec<Vec<Vec<f64>>>,
    /// RMS that is left, jumps counted.
    pub(super) error: f64,
}

/// What is left of the records never fitted, and the force on the fine grid.
pub(super) struct Unseen {
    pub(super) residuals: Vec<Vec<Vec<f64>>>,
    pub(super) forces: Vec<Vec<f64>>,
    pub(super) error: f64,
}

impl ForceSearch<'_> {
    /// Goes on from short stretches to ones that are held together ever more, then over whole records; where these cannot be followed,
    /// because small differences grow, the stretches stay. None where the error over stretches exceeds the bound, or what
    /// is inside the force exceeds `most_inner`. `known` has the errors with each hold of the start before, and then of this one.
    pub(super) fn follow(
        &self,
        begun: BegunFit,
        states: &States,
        limits: (usize, f64, f64),
        known: &mut Vec<f64>,
        cancel: &Cancel,
    ) -> Option<FollowedForce> {
        let mut errors = Vec::new();
        let found = self.followed(begun, states, limits, (known, &mut errors), cancel);
        *known = errors;
        found
    }

    fn followed(
        &self,
        begun: BegunFit,
        states: &States,
        (parts, bound, most_inner): (usize, f64, f64),
        (known, errors): (&[f64], &mut Vec<f64>),
        cancel: &Cancel,
    ) -> Option<FollowedForce> {
        let (sensors, series) = (&self.measurement.sensors, &self.split.fitted);
        let BegunFit { mut model, mut course, whole_initial, mut error, .. } = begun;
        let (rest, offsets) = (whole_initial.is_empty(), course.offsets.clone());
        let whole =
            Course { segments: Segment::whole(series, 1.0), weights: Vec::new(), rest, offsets: offsets.clone() };
        for hold in HOLDS {
            // What has come so far is worth all stretches.
            if errors.len() == SAME_HOLDS {
                let starts = (0..series.len()).map(|r| begins(&model, &course, states, r)).collect();
                (model, course) =
                    self.over_stretches(&model, starts, (series, &offsets, rest), self.held_share(), parts, cancel);
            }
            // The states of further stretches follow the jumps before they are held closer: together with all parameters they would lead these away.
            if errors.len() == SAME_HOLDS {
                course.weights = held(&model, HOLDS[SAME_HOLDS - 1]);
                let of = course.along(sensors, series, parts);
                let left;
                (model, left) = model.fitted(of, Free::All, HELD_STEPS, HELD_GAIN, cancel)?;
                // A force that is right leaves as little of all as of the first ones.
                let all = (left.squares / left.samples as f64).sqrt();
                if all > (OF_FIRST * error).max(NEAR_NOISES * self.noise) {
                    return None;
                }
            }
            if hold > HOLDS[0] {
                course.weights = held(&model, hold);
                let of = course.along(sensors, series, parts);
                let (found, left) = model.fitted(of, Free::All, HELD_STEPS, HELD_GAIN, cancel)?;
                model = found;
                error = (left.squares / left.samples as f64).sqrt();
            }
            // At first a start may still be far from where it goes.
            let bound = if errors.len() + 1 < SAME_HOLDS { 2.0 * bound } else { bound };
            if error > bound || model.inner[0] > most_inner {
                return None;
            }
            errors.push(error);
            // A force that is wrong stands for the right one over short stretches alone.
            if error > (OF_SHORT * errors[0]).max(NEAR_NOISES * self.noise) {
                return None;
            }
            // From here on another start goes the same way.
            let as_before = known.get(errors.len() - 1).is_some_and(|k| error > (1.0 - SAME_WAY) * k);
            if as_before && errors.len() >= SAME_HOLDS {
                return None;
            }
            // Where whole records can be followed from here, nothing needs to be held.
            if rest && hold > HOLDS[0] {
                let run =
                    ClosedModel { initial: Vec::new(), ..model.clone() }.simulate(whole.along(sensors, series, parts));
                if run.is_some_and(|r| rms(r.residuals.iter().flatten()) < FOLLOWED * error) {
                    break;
                }
            }
        }
        let mut free_run = model.clone();
        free_run.initial = whole_initial;
        for (r, initial) in free_run.initial.iter_mut().enumerate() {
            if let Some(k) = course.segments.iter().position(|s| (s.record, s.start) == (r, 0)) {
                initial.clone_from(&model.initial[k]);
            }
        }
        let free = if rest { Free::Shared } else { Free::All };
        let of = whole.along(sensors, series, parts);
        if let Some((found, left)) = free_run.fitted(of, free, WHOLE_STEPS, 1e-3, cancel) {
            let own = (left.squares / left.samples as f64).sqrt();
            if own < KEPT * error {
                return Some(FollowedForce {
                    residuals: whole.residuals(of, &left),
                    error: own,
                    model: found,
                    course: whole,
                });
            }
        }
        let starts = (0..series.len()).map(|r| begins(&model, &course, states, r)).collect();
        let (model, course) = self.shadowed(&model, starts, (series, &offsets, rest), parts, cancel)?;
        let of = course.along(sensors, series, parts);
        let left = model.simulate(of)?;
        let error = (left.squares / left.samples as f64).sqrt();
        Some(FollowedForce { residuals: course.residuals(of, &left), error, model, course })
    }

    /// The motion that a model allows, but for the smallest jumps between stretches, and that follows the data best; `starts`
    /// are the states at the records' beginnings.
    fn shadowed(
        &self,
        model: &ClosedModel,
        starts: Vec<InitialState>,
        (series, offsets, rest): (&[SensorSeries], &[Vec<f64>], bool),
        parts: usize,
        cancel: &Cancel,
    ) -> Option<(ClosedModel, Course)> {
        let sensors = &self.measurement.sensors;
        let along = (series, offsets, rest);
        let (mut model, mut course) = self.over_stretches(model, starts, along, 1.0, parts, cancel);
        for hold in HOLDS {
            course.weights = held(&model, hold);
            let of = course.along(sensors, series, parts);
            model = model.fitted(of, Free::Initial, HELD_STEPS, HELD_GAIN, cancel)?.0;
        }
        Some((model, course))
    }

    /// A model over stretches of a share of each record, their states sought one after the other from the records' beginnings.
    fn over_stretches(
        &self,
        model: &ClosedModel,
        starts: Vec<InitialState>,
        (series, offsets, rest): (&[SensorSeries], &[Vec<f64>], bool),
        share: f64,
        parts: usize,
        cancel: &Cancel,
    ) -> (ClosedModel, Course) {
        let segments = stretches(series, self.stretch(model), share);
        let mut model = model.clone();
        model.initial = segments.iter().map(|s| starts[s.record].clone()).collect();
        let course = Course { segments, weights: Vec::new(), rest, offsets: offsets.to_vec() };
        model = model.swept(course.along(&self.measurement.sensors, series, parts), STATE_STEPS, cancel);
        (model, course)
    }

    /// Samples of a stretch.
    pub(super) fn stretch(&self, model: &ClosedModel) -> f64 {
        (STRETCH * 2.0 * model.modes() as f64 / self.measurement.sensors.len() as f64).max(LEAST_STRETCH)
    }

    /// What a model leaves on the records never fitted, from initial states fitted to them.
    pub(super) fn unseen(&self, model: &ClosedModel, parts: usize, cancel: &Cancel) -> Option<Unseen> {
        let (sensors, series) = (&self.measurement.sensors, &self.split.unseen);
        let offsets: Vec<Vec<f64>> = series.iter().map(|s| vec![0.0; s.outputs.len()]).collect();
        let [begin, whole] = [BEGINNING, 1.0].map(|share| Course {
            segments: Segment::whole(series, share),
            weights: Vec::new(),
            rest: false,
            offsets: offsets.clone(),
        });
        let told = |model: &ClosedModel, course: &Course| -> Option<Unseen> {
            let of = course.along(sensors, series, parts);
            let left = model.simulate(of)?;
            let fine = course.along(sensors, series, PARTS);
            let forces = course.records(fine, model.simulate(fine)?.forces, 1);
            let error = (left.squares / left.samples as f64).sqrt();
            Some(Unseen { residuals: course.residuals(of, &left), forces, error })
        };
        let mut model = model.clone();
        model.initial = vec![InitialState::rest(model.modes()); series.len()];
        let at_start = model.fitted(begin.along(sensors, series, parts), Free::Initial, 6, 1e-4, cancel)?.0;
        let run = at_start.fitted(whole.along(sensors, series, parts), Free::Initial, 3, 1e-4, cancel);
        let free = run.and_then(|(m, _)| told(&m, &whole));
        if free.as_ref().is_some_and(|f| f.error < EXPLAINS * self.noise_in(&f.residuals)) {
            return free;
        }
        // Where small differences grow, a motion that the model allows, but for the smallest jumps, may still follow the data.
        let starts = at_start.initial.clone();
        let found = self.shadowed(&at_start, starts, (series, &offsets, false), parts, cancel);
        let Some((model, shadow)) = found else { return free };
        let shadowed = told(&model, &shadow);
        match (free, shadowed) {
            (Some(free), Some(shadowed)) if free.error <= shadowed.error => Some(free),
            (free, shadowed) => shadowed.or(free),
        }
    }
}

/// The state with which a record begins: that of its first stretch, else as an open-loop fit has it.
fn begins(model: &ClosedModel, course: &Course, states: &States, record: usize) -> InitialState {
    let first = course.segments.iter().position(|s| (s.record, s.start) == (record, 0));
    first.map_or_else(|| states.at(record, 0), |k| model.initial[k].clone())
}
