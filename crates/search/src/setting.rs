//! What may be tried beside a model: the data's extents and frequencies, and the forms of the catalogue that make sense for them.

use super::columns::forces;
use super::data::{Data, RecordSeries};
use super::effects::{EffectSetting, Form, Frame, catalogue, described, own};
use super::fit::{Fitted, WHOLE};
use super::propose::usual_speed;
use super::screen::Motion;
use super::search::Search;
use super::site::accelerations;
use super::structure::choice;
use sindyscope_core::refine::Structure as _;
use sindyscope_core::signal::Spectrum;

impl Search {
    /// What the catalogue needs to know of these data and a model.
    fn setting(&self, fitted: &Fitted, motion: &Motion) -> EffectSetting {
        let data = &self.data;
        let (lines, pulsations) = data.frequencies(fitted, motion);
        EffectSetting {
            base_excited: data.base_excited,
            passive: fitted.composition.passive,
            input_open: data.input_open,
            frames: data.frames(motion),
            terms: fitted.composition.plain_terms(&fitted.parameters.inner),
            unit: data.unit.clone(),
            derivatives: data.outputs[0].derivatives(),
            inputs: (0..data.layout.inputs).map(|j| data.largest(|r, k| data.fit()[r].inputs[j][k])).collect(),
            frequency: data.frequency,
            lines,
            pulsations,
            interval: data.fit()[0].interval,
            measured: data.largest(|r, k| data.fit()[r].measured[0][k]),
        }
    }

    /// The terms that a formula which describes what a model lacks is made of.
    pub(super) fn words_of_formulas(&self, fitted: &Fitted, motion: &Motion) -> Vec<Form> {
        let present = fitted.composition.choices();
        let tied = fitted.composition.offset() || fitted.composition.datum;
        let mut forms = described(&self.setting(fitted, motion));
        // A steady force beside a zero that is free says nothing.
        forms.retain(|f| !(present.contains(&choice(f)) || tied && f.moves_the_zero(true)));
        forms
    }

    pub(super) fn forms(&self, fitted: &Fitted, motion: &Motion) -> Vec<Form> {
        let data = &self.data;
        let setting = self.setting(fitted, motion);
        let present = fitted.composition.choices();
        let offset = fitted.composition.offset();
        let turns = data.turns_over();
        let units: Vec<&str> = std::iter::once(&data.unit)
            .chain(&data.input_units)
            .map(String::as_str)
            .filter(|u| !u.is_empty())
            .collect();
        let all = catalogue(&setting);
        let swings = all.iter().any(Form::is_periodic);
        all.into_iter()
            .chain(own(&self.ask.effects, &setting, &units))
            .filter(|f| !present.contains(&choice(f)))
            // A richer kind of what is there was tried in its place.
            .filter(|f| !fitted.composition.forms.iter().any(|there| f.includes(there) || there.includes(f)))
            .filter(|f| !self.audit.blind.iter().any(|b| b.effect == f.effect))
            .filter(|f| {
                // The zero of a velocity or an acceleration is not that of the spring.
                let moved = data.outputs.iter().all(|o| o.derivatives() == 0);
                let tied = moved && (offset || fitted.composition.datum);
                // Where a sine holds an angle that turns over, a shifted zero and a steady force differ.
                let told_apart = turns && !f.is_offset() && (fitted.composition.is_periodic() || swings);
                !(tied && f.moves_the_zero(offset) && !told_apart || fitted.composition.zero && f.is_offset())
            })
            .collect()
    }
}

impl Data {
    /// The largest magnitude over all samples of all fitted records of what `pick` gives by record and sample.
    fn largest(&self, pick: impl Fn(usize, usize) -> f64) -> f64 {
        let of_record = |(r, s): (usize, &RecordSeries)| (0..s.len()).map(|k| pick(r, k).abs()).fold(0.0, f64::max);
        self.fit().iter().enumerate().map(of_record).fold(0.0, f64::max)
    }

    /// Every place with what the measured motion across it reaches.
    fn frames(&self, motion: &Motion) -> Vec<Frame> {
        let u = |r: usize, k: usize| self.fit()[r].inputs.first().map_or(0.0, |u| u[k]);
        let du = |r: usize, k: usize| self.fit()[r].input_rates.first().map_or(0.0, |u| u[k]);
        let mut frames = Frame::all(self.masses(), self.base_excited);
        for frame in &mut frames {
            let site = frame.site;
            let displacement = |r: usize, k: usize| site.across(|i| motion.measured[r].x[i][k], u(r, k));
            let velocity = |r: usize, k: usize| site.across(|i| motion.measured[r].v[i][k], du(r, k));
            (frame.reach, frame.speed) = (self.largest(displacement), self.largest(velocity));
            let records = self.fit().iter().enumerate();
            let velocities: Vec<f64> = records.flat_map(|(r, s)| (0..s.len()).map(move |k| velocity(r, k))).collect();
            frame.usual_speed = usual_speed(&velocities, self.constants.still);
            let (first, second) = site.masses();
            frame.speed_noise = second.map_or(motion.speed_noise[first], |second| {
                motion.speed_noise[first].hypot(motion.speed_noise[second])
            });
        }
        frames
    }

    /// Frequencies at which a force that nothing measured may act, and at which the spring's stiffness may pulsate, Hz.
    fn frequencies(&self, fitted: &Fitted, motion: &Motion) -> (Vec<f64>, Vec<f64>) {
        let lead = self.lead(motion);
        let missing = motion.missing_of(lead);
        // Along short stretches of the simulation the missing force is mostly what corrects their beginnings.
        let smoothed = if fitted.level == WHOLE { Vec::new() } else { self.missing_along_smoothed(fitted, lead) };
        let ways = [missing, smoothed.iter().map(Vec::as_slice).collect()];
        // In a motion that dies away a line at its own frequency, or at twice that, is damping or stiffness that depends on the
        // amplitude.
        let dies_away = self.fit().iter().all(RecordSeries::is_undriven) && !self.self_sustained && !self.settles;
        let locked = |f: &f64, times: &[f64]| {
            times.iter().any(|n| (f / (n * self.frequency) - 1.0).abs() < self.constants.locked)
        };
        let lines = |times: &[f64], of: &dyn Fn(usize, usize, f64) -> f64| -> Vec<f64> {
            let along = |way: &Vec<&[f64]>| -> Vec<f64> {
                let of_record = |(r, force): (usize, &&[f64])| -> Vec<f64> {
                    force.iter().enumerate().map(|(k, force)| of(r, k, *force)).collect()
                };
                self.lines(&way.iter().enumerate().map(of_record).collect::<Vec<_>>())
            };
            let mut lines: Vec<f64> = ways.iter().flat_map(along).collect();
            lines.retain(|f| !(dies_away && locked(f, times)));
            lines.sort_by(f64::total_cmp);
            lines
        };
        let base = |r: usize| if self.base_excited { self.fit()[r].inputs.first() } else { None };
        let across = |r: usize, k: usize| motion.measured[r].x[lead][k] - base(r).map_or(0.0, |u| u[k]);
        // A spring without a damper that is tuned to the tone swings along with it, and lacks nothing there.
        let mut forces = lines(&[1.0], &|_, _, force| force);
        forces.extend(self.tone);
        forces.sort_by(f64::total_cmp);
        (forces, lines(&[1.0, 2.0], &|r, k, force| force * across(r, k)))
    }

    /// What a fitted model lacks of one mass's acceleration along the motion that was smoothed without a model: a series a record.
    fn missing_along_smoothed(&self, fitted: &Fitted, mass: usize) -> Vec<Vec<f64>> {
        let composed = fitted.composition.compose(&fitted.parameters.inner);
        let coefficients = &fitted.parameters.coefficients;
        let of_record = |s: &RecordSeries| {
            let path = s.path();
            let columns = forces(&composed.terms, &composed.internals, &self.layout, s, &s.inputs(), &path);
            let there = accelerations(self.masses(), &composed.terms, coefficients, &columns, s.len());
            let acceleration = path.acceleration(mass, s.interval);
            acceleration.iter().zip(&there[mass]).map(|(a, there)| a - there).collect()
        };
        self.fit().iter().map(of_record).collect()
    }

    /// Frequencies that stand out in series along the fitted records, Hz, in order: each with neighbours half a line apart.
    fn lines(&self, series: &[Vec<f64>]) -> Vec<f64> {
        const PEAKS: usize = 24;
        let (low, high) = (0.1 * self.frequency, 4.0 * self.frequency);
        let mut peaks: Vec<(f64, f64, f64)> = Vec::new();
        for (s, values) in self.fit().iter().zip(series) {
            let Some(spectrum) = Spectrum::new(values, s.interval) else { continue };
            let a = &spectrum.amplitudes;
            let resolution = 1.0 / (s.interval * s.len() as f64);
            peaks.extend((1..a.len().saturating_sub(1)).filter(|k| a[*k] >= a[k - 1] && a[*k] > a[k + 1]).map(|k| {
                // The vertex of the parabola through three lines.
                let bend = a[k - 1] - 2.0 * a[k] + a[k + 1];
                let shift = if bend < 0.0 { 0.5 * (a[k - 1] - a[k + 1]) / bend } else { 0.0 };
                (a[k], spectrum.frequency(k) + shift * spectrum.step, resolution)
            }));
        }
        peaks.retain(|(_, f, _)| (low..=high).contains(f));
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        peaks.truncate(PEAKS);
        let mut lines: Vec<f64> =
            peaks.iter().flat_map(|(_, f, step)| [-0.5, 0.0, 0.5].map(|k| f + k * step)).filter(|f| *f > 0.0).collect();
        lines.sort_by(f64::total_cmp);
        lines.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * *b);
        lines
    }
}
