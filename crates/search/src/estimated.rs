//! Displacements that no sensor showed: other estimates of them than the record's, and what the motion of a fitted model says.

use std::sync::{Arc, OnceLock};

use super::data::{Data, RecordSeries, share_limits};
use super::effects::Form;
use super::fit::Fitted;
use super::propose::{MeasuredPath, PresentModel, Proposal};
use super::ruling::Tried;
use super::search::Search;
use super::structure::Composition;
use sindyscope_core::dataset::RANGE_FACTOR;
use sindyscope_core::refine::MeasuredMotion;
use sindyscope_core::signal::dot;
use sindyscope_core::study::Cancel;
use sindyscope_values::record::estimate::integral;

/// Share of an estimated motion (RMS) by which another estimate may differ and be the same: where an estimate ends, the slowest motion
/// loses three parts in a hundred.
const ALIKE: f64 = 0.1;

const INTEGRATED: &str = "The displacement is the integral of the velocity as it was measured, with all that is slow: along it the accelerations are predicted better.";
const CENTRED: &str = "No measurement says where the displacement is zero: it is counted from where the force along each record is odd, as that of a cubic spring is.";

impl Search {
    /// The same search with displacements that are estimated otherwise, where along them more of what was measured is predicted: what goes
    /// from well to well, or turns over, is mostly slower than an estimate can hold that allows for an offset of the sensor, and
    /// is not about its own mean. None where none of them predicts more.
    pub(super) fn otherwise_estimated(&self, cancel: &Cancel) -> Option<Self> {
        let data = &self.data;
        let mut estimates: Vec<Data> = data.integrated().into_iter().collect();
        let about = |data: &Data| data.about_its_centre(&self.base, cancel);
        let counted: Vec<Data> = std::iter::once(data).chain(&estimates).filter_map(about).collect();
        estimates.extend(counted);
        estimates.retain(|other| data.estimates_otherwise(|record, mass| &other.fit()[record].smoothed.states[mass]));
        if estimates.is_empty() {
            return None;
        }
        let base = self.fitted(&[], cancel).ok()?;
        let density = |data: &Data| {
            let motion = data.motion(&base, cancel)?;
            let forms = self.forms(&base, &motion);
            Some(PresentModel::new(data, &base.composition, &base.parameters.inner, cancel).density(&forms))
        };
        let least = density(data)? + data.constants.lead;
        let predicting = estimates.into_iter().filter_map(|data| Some((density(&data)?, data)));
        let (_, data) = predicting.filter(|(density, _)| *density > least).max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(self.anew(data, self.base.clone()))
    }

    /// Along the motion that the best set simulates the regression is asked again, where that is another than the estimate: what explains
    /// as much there is fitted too.
    pub(super) fn ask_again(&self, before: &Fitted, forms: &[Form], tried: &mut Tried, cancel: &Cancel) {
        let constants = &self.data.constants;
        let sound = |k: &usize| tried.sets[*k].unborne.is_none() && !tried.sets[*k].forms.is_empty();
        let Some(best) = tried.best().into_iter().find(sound).filter(|_| self.data.estimates_displacements()) else {
            return;
        };
        let (set, fitted) = (tried.sets[best].forms.clone(), Arc::clone(&tried.sets[best].fitted));
        let simulated = self.data.simulated_paths(&fitted);
        let other =
            |paths: &Vec<MeasuredPath>| self.data.estimates_otherwise(|record, mass| &paths[record].path.x[mass]);
        let Some(paths) = simulated.filter(other) else { return };
        let (composition, inner) = (&before.composition, &before.parameters.inner);
        let proposals = PresentModel::along(&paths, &self.data, composition, inner, cancel)
            .whitened()
            .propose(forms, constants.crumb);
        let own = proposals.iter().find(|p| tried.indices(&p.composition) == set).map(|p| p.gain);
        let likeliest = proposals.iter().map(|p| p.gain).fold(f64::NEG_INFINITY, f64::max);
        let least = own.unwrap_or(likeliest) - constants.lead;
        let room = self.room(composition);
        let enough = self.explains(&fitted, tried.coloured.rms, cancel);
        let mut starts: Vec<(Vec<usize>, Proposal)> = Vec::new();
        for proposal in proposals.into_iter().filter(|p| p.forms.len() <= room && p.gain >= least) {
            let other = tried.indices(&proposal.composition);
            // What would be left for a further effect is given no name.
            let more = enough && set.iter().all(|k| other.contains(k));
            if !more && tried.place(&other).is_none() && !starts.iter().any(|(known, _)| *known == other) {
                starts.push((other, proposal));
            }
        }
        starts.truncate(constants.fitted_again);
        if !starts.is_empty() {
            let fitted = self.fit_from(starts, tried, cancel);
            tried.sets.extend(fitted);
            self.close(tried, &[], cancel);
        }
    }
}

impl Data {
    /// True if some displacement was not measured.
    pub(super) fn estimates_displacements(&self) -> bool {
        self.outputs.iter().any(|o| o.derivatives() > 0)
    }

    /// The same with displacements that are integrals of velocities as these were measured; none where no sensor shows a velocity.
    fn integrated(&self) -> Option<Self> {
        let of_velocity = |mass: usize| self.outputs[mass].derivatives() == 1;
        let integral =
            |_, s: &RecordSeries, mass: usize| of_velocity(mass).then(|| integral(&s.measured[mass], s.interval));
        (0..self.masses()).any(of_velocity).then(|| self.estimated(INTEGRATED, integral))
    }

    /// The same with the estimated displacement of one mass counted from where the force along each record is odd. None where it
    /// was measured, or there is no such point near the motion.
    fn about_its_centre(&self, base: &Composition, cancel: &Cancel) -> Option<Self> {
        if self.masses() > 1 || !self.estimates_displacements() {
            return None;
        }
        let centres: Vec<f64> = self.series.iter().map(|s| self.centre(s, base, cancel)).collect::<Option<_>>()?;
        let counted = |place: usize, s: &RecordSeries, mass: usize| {
            Some(s.smoothed.states[mass].iter().map(|x| x - centres[place]).collect())
        };
        Some(self.estimated(CENTRED, counted))
    }

    /// The point about which the force of a cubic spring beside the base model is odd, along one record by itself.
    fn centre(&self, s: &RecordSeries, base: &Composition, cancel: &Cancel) -> Option<f64> {
        let (mut alone, mut data) = (s.clone(), self.clone());
        alone.index = 0;
        (data.series, data.fitted, data.paths) = (vec![alone], 1, OnceLock::new());
        let motion = &s.smoothed.states[0];
        let across: Vec<f64> = match s.inputs.first().filter(|_| self.base_excited) {
            Some(base) => motion.iter().zip(base).map(|(x, u)| x - u).collect(),
            None => motion.clone(),
        };
        let powers = [2, 3].map(|power| across.iter().map(|z| z.powi(power)).collect());
        let inner = base.middle();
        let model = PresentModel::along(data.measured_paths(), &data, base, &inner, cancel);
        let [square, cube] = model.beside(powers)?;
        // c (z − e)³ has −3 c e before the square.
        let centre = -square / (3.0 * cube);
        let reach = across.iter().fold(0.0, |reach: f64, z| reach.max(z.abs()));
        (centre.abs() < reach).then_some(centre)
    }

    /// The same with other displacements where they are given, by record, and what is said of them.
    fn estimated(&self, notice: &str, displacement: impl Fn(usize, &RecordSeries, usize) -> Option<Vec<f64>>) -> Self {
        let mut data = self.clone();
        data.paths = OnceLock::new();
        for (place, s) in data.series.iter_mut().enumerate() {
            let mut smoothed = MeasuredMotion::clone(&s.smoothed);
            for mass in 0..self.masses() {
                let Some(values) = displacement(place, s, mass) else { continue };
                s.limits[mass] = RANGE_FACTOR * values.iter().fold(0.0, |reach: f64, x| reach.max(x.abs()));
                smoothed.states[mass] = values;
            }
            s.smoothed = Arc::new(smoothed);
        }
        share_limits(&mut data.series);
        data.notices.push(notice.to_owned());
        data
    }

    /// True if the estimated displacements, by fitted record and mass, are others than these.
    fn estimates_otherwise<'a>(&self, displacement: impl Fn(usize, usize) -> &'a [f64]) -> bool {
        let differs = |record: usize, mass: usize| {
            let (known, other) = (&self.fit()[record].smoothed.states[mass], displacement(record, mass));
            let squares = known.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            squares > ALIKE.powi(2) * dot(known, known)
        };
        let estimated = |mass: &usize| self.outputs[*mass].derivatives() > 0;
        (0..self.masses()).filter(estimated).any(|mass| (0..self.fitted).any(|record| differs(record, mass)))
    }
}
