//! Fitted models and candidates as values to be drawn and read.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::columns::forces;
use super::data::RecordSeries;
use super::effects::{Coefficient, DESCRIPTION, ForceAxis, Form, unit};
use super::fit::{Fitted, Followed};
use super::outcome::{Added, Candidate, Choice, Curve, HeldFit, Parameter, SensorTrace, Stage, Standing, Trace};
use super::screen::{Motion, Screened};
use super::search::Search;
use super::site::{Placed, Site};
use super::structure::{choice, counted_from, with_errors};
use sindyscope_core::refine::Structure as _;
use sindyscope_core::signal::dot;
use sindyscope_values::format::words::capitalised;
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Symbol, Term};

/// The quantity that a force is drawn over, and where it acts.
pub(super) type Over = (ForceAxis, Option<Site>);

/// Points of a curve on a card.
const POINTS: usize = 400;

impl Search {
    fn axis(&self, (axis, site): Over, motion: &Motion) -> (String, String, Vec<Vec<f64>>) {
        let fit = self.data.fit();
        let length = &self.data.unit;
        let u = |r: usize, k: usize| fit[r].inputs.first().map_or(0.0, |u| u[k]);
        let du = |r: usize, k: usize| fit[r].input_rates.first().map_or(0.0, |u| u[k]);
        let each = |f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            fit.iter().enumerate().map(|(r, s)| (0..s.len()).map(|k| f(r, k)).collect()).collect()
        };
        let site = site.unwrap_or(Site::Ground(0));
        match axis {
            ForceAxis::Displacement => {
                let across = |r: usize, k: usize| site.across(|i| motion.measured[r].x[i][k], u(r, k));
                (site.displacement(&self.data.layout), length.clone(), each(&across))
            }
            ForceAxis::Velocity => {
                let across = |r: usize, k: usize| site.across(|i| motion.measured[r].v[i][k], du(r, k));
                (site.velocity(&self.data.layout), unit(length, (1, -1)), each(&across))
            }
            ForceAxis::Input(j) => (
                self.data.layout.name(Symbol::Input(j)),
                self.data.input_units[j].clone(),
                each(&|r, k| fit[r].inputs[j][k]),
            ),
            ForceAxis::Time => ("t".into(), "s".into(), each(&|r, k| fit[r].start + fit[r].interval * k as f64)),
        }
    }

    /// The mass that a force at a place acts on, of a joint the first; where it acts on none, that which lacks most.
    fn acts_on(&self, site: Option<Site>, motion: &Motion) -> usize {
        site.map_or_else(|| self.data.lead(motion), |site| site.masses().0)
    }

    /// The measured missing force over a quantity.
    pub(super) fn measured_curve(&self, over: Over, motion: &Motion) -> Curve {
        let (axis, unit, values) = self.axis(over, motion);
        let total: usize = values.iter().map(Vec::len).sum();
        let stride = (total / POINTS).max(1);
        let missing = motion.missing_of(self.acts_on(over.1, motion));
        let pairs = values.iter().flatten().zip(missing.into_iter().flatten());
        let measured = pairs.step_by(stride).map(|(a, f)| [*a, *f]).collect();
        Curve { over: Some(over.0), axis, unit, measured, ..Curve::default() }
    }

    /// The measured missing force and the force of the effect that was added last through it.
    pub(super) fn curve(&self, form: &Form, (before, fitted): (&Fitted, &Fitted), motion: &Motion) -> Curve {
        let own: Vec<usize> = fitted.composition.places(&fitted.parameters.inner).pop().into_iter().flatten().collect();
        self.partial_residuals((form.axis, form.site), (before, fitted), (&own, None), motion)
    }

    /// The measured missing force and that of a formula through it, over the quantity that orders the formula's best.
    pub(super) fn described_curve(&self, (before, fitted): (&Fitted, &Fitted), motion: &Motion) -> Curve {
        let composition = &fitted.composition;
        let formula = composition.forms.iter().zip(composition.places(&fitted.parameters.inner));
        let formula: Vec<_> = formula.filter(|(form, _)| form.effect == DESCRIPTION).collect();
        let Some(site) = formula.first().map(|(form, _)| form.site) else { return Curve::default() };
        let own: Vec<usize> = formula.into_iter().flat_map(|(_, place)| place).collect();
        let coefficients = composition.positions().coefficients;
        let covariance = &fitted.refined.covariance;
        let inflation = self.inflation(fitted);
        let error = |i: usize, j: usize| inflation * covariance[(coefficients[own[i]], coefficients[own[j]])];
        let known = own.iter().all(|k| coefficients[*k] < covariance.nrows());
        let errors = known.then(|| DMatrix::from_fn(own.len(), own.len(), error));
        let axes = [ForceAxis::Displacement, ForceAxis::Velocity].into_iter();
        let axes = axes.chain((0..self.data.layout.inputs).map(ForceAxis::Input));
        let curves =
            axes.map(|axis| self.partial_residuals((axis, site), (before, fitted), (&own, errors.as_ref()), motion));
        curves.min_by(|a, b| a.winding().total_cmp(&b.winding())).unwrap_or_default()
    }

    /// The measured missing force and the force of an effect through it: its partial residuals, as of a regression. `own` are
    /// the indices of the effect's terms in the model with it, beside the covariance of their coefficients where the force's error
    /// is asked for.
    pub(super) fn partial_residuals(
        &self,
        over: Over,
        (before, fitted): (&Fitted, &Fitted),
        (own, errors): (&[usize], Option<&DMatrix<f64>>),
        motion: &Motion,
    ) -> Curve {
        let mut curve = self.measured_curve(over, motion);
        if own.is_empty() {
            return curve;
        }
        let data = &self.data;
        let (_, _, values) = self.axis(over, motion);
        let (old, new) = (&before.parameters, &fitted.parameters);
        let old_composed = before.composition.compose(&old.inner);
        let composed = fitted.composition.compose(&new.inner);
        let mass = self.acts_on(over.1, motion);
        // Of each term its place among those that the errors are of.
        let own: Vec<(usize, usize)> =
            own.iter().copied().enumerate().filter(|(_, k)| composed.terms[*k].mass == mass).collect();
        let sum = |terms: &[Placed], columns: &[Vec<f64>], coefficients: &[f64], k: usize| -> f64 {
            let forces = terms.iter().zip(columns).zip(coefficients).filter(|((t, _), _)| t.mass == mass);
            forces.map(|((_, f), c)| c * f[k]).sum()
        };
        let mut force = Vec::new();
        let mut deviation = Vec::new();
        // What the effect has to make up for: the missing force, and what the other terms gave back or took over since.
        let mut wanted = Vec::new();
        for ((s, path), missing) in data.fit().iter().zip(&motion.measured).zip(motion.missing_of(mass)) {
            let columns =
                |terms: &[Placed], internals: &[Equation]| forces(terms, internals, &data.layout, s, &s.inputs(), path);
            let then = columns(&old_composed.terms, &old_composed.internals);
            let now = columns(&composed.terms, &composed.internals);
            for (k, missing) in missing.iter().enumerate() {
                if let Some(errors) = errors {
                    let of = |(i, a): &(usize, usize)| -> f64 {
                        now[*a][k] * own.iter().map(|(j, b)| errors[(*i, *j)] * now[*b][k]).sum::<f64>()
                    };
                    deviation.push(own.iter().map(of).sum::<f64>().max(0.0).sqrt());
                }
                let own: f64 = own.iter().map(|(_, i)| new.coefficients[*i] * now[*i][k]).sum();
                force.push(own);
                let then = sum(&old_composed.terms, &then, &old.coefficients, k);
                let now = sum(&composed.terms, &now, &new.coefficients, k);
                wanted.push(missing + then - (now - own));
            }
        }
        let total = force.len();
        let stride = (total / POINTS).max(1);
        let over = |force: &[f64]| -> Vec<[f64; 2]> {
            values.iter().flatten().zip(force).step_by(stride).map(|(a, f)| [*a, *f]).collect()
        };
        curve.measured = over(&wanted);
        curve.effect = over(&force);
        curve.deviation = deviation.into_iter().step_by(stride).collect();
        let remembers = |(_, k): &(usize, usize)| {
            composed.terms[*k].term.symbols().iter().any(|s| matches!(s, Symbol::Internal(_)))
        };
        if !own.iter().any(remembers) {
            let mut order: Vec<usize> = (0..curve.effect.len()).collect();
            order.sort_by(|a, b| curve.effect[*a][0].total_cmp(&curve.effect[*b][0]));
            curve.effect = order.iter().map(|k| curve.effect[*k]).collect();
            curve.deviation = order.iter().filter_map(|k| curve.deviation.get(*k).copied()).collect();
        }
        curve
    }

    /// A fitted model for showing.
    pub(super) fn show(&self, fitted: &Arc<Fitted>) -> Stage {
        let data = &self.data;
        let refined = &fitted.refined;
        let values = &fitted.parameters;
        let (mut model, mut composed) = fitted.composition.model(values);
        if data.datum != 0.0 {
            let moved = |t: &Term| counted_from(t, data.datum);
            composed.terms.iter_mut().for_each(|t| t.term = moved(&t.term));
            model.equations[1..].iter_mut().flat_map(|e| &mut e.terms).for_each(|t| t.term = moved(&t.term));
        }
        let inflated = self.inflation(fitted).sqrt();
        let error = |k: usize| refined.std_error(k).map(|e| e * inflated);
        let at_bound = |k: usize| refined.at_bound.get(k).copied().unwrap_or(false);
        let positions = fitted.composition.positions();
        let errors: Vec<Option<f64>> = positions.coefficients.iter().map(|k| error(*k)).collect();
        let model = with_errors(model, &composed.terms, &errors, &self.shares(fitted));
        let effects = fitted
            .composition
            .forms
            .iter()
            .zip(fitted.composition.places(&values.inner))
            .enumerate()
            .map(|(index, (form, place))| {
                let parameter = |name: &str, value: f64, position: usize, unit: String| Parameter {
                    name: name.to_owned(),
                    value,
                    std_error: error(position),
                    at_bound: at_bound(position),
                    unit,
                };
                let coefficient = |(c, k): (&Coefficient, usize)| {
                    let (value, position) = (c.shown(values.coefficients[k]), positions.coefficients[k]);
                    parameter(&c.name, value, position, c.unit(&data.unit))
                };
                let mut parameters: Vec<Parameter> =
                    form.coefficients.iter().zip(place.clone()).map(coefficient).collect();
                let inner = values.inner.forms[index].iter().zip(&positions.inner.forms[index]);
                parameters.extend(form.inner.iter().zip(inner).map(|(q, (value, position))| {
                    let unit = match q.of_input {
                        Some(j) => data.input_units[j].clone(),
                        None => q.unit(&data.unit),
                    };
                    parameter(q.name, *value, *position, unit)
                }));
                if fitted.composition.offset() && form.effect == "sensor_offset" {
                    let several = data.masses() > 1;
                    let sensors = data.fit().iter().flat_map(|s| (0..data.masses()).map(move |i| (s, i)));
                    parameters.extend(sensors.zip(&refined.point.offsets).map(|((s, i), offset)| Parameter {
                        name: format!(
                            "offset of {}{}",
                            s.name,
                            if several { format!(", mass {}", i + 1) } else { String::new() }
                        ),
                        value: *offset,
                        std_error: None,
                        at_bound: false,
                        unit: data.shown_unit.clone(),
                    }));
                }
                Added {
                    choice: choice(form),
                    title: form.full_title(),
                    place: form.site,
                    terms: distinct(composed.terms[place.clone()].iter().map(|t| t.term.text(&model.layout))),
                    equations: {
                        let of = |mass: usize| composed.terms[place.clone()].iter().filter(move |t| t.mass == mass);
                        let texts = |mass| of(mass).map(|t| t.term.text(&model.layout)).collect::<Vec<_>>();
                        let each = (0..data.masses()).map(|mass| (model.layout.name(Symbol::Rate(mass)), texts(mass)));
                        each.filter(|(_, texts)| !texts.is_empty()).collect()
                    },
                    parameters,
                }
            })
            .collect();
        Stage {
            model,
            delays: composed.delays,
            ceiling: composed.ceiling,
            effects,
            gap: fitted.gap,
            traces: self.traces(fitted),
            fit: HeldFit(Some(Arc::clone(fitted))),
        }
    }

    /// RMS of each term's force over the fitted records, as a share of their sum in its equation.
    fn shares(&self, fitted: &Fitted) -> Vec<f64> {
        let data = &self.data;
        let composed = fitted.composition.compose(&fitted.parameters.inner);
        let terms = &composed.terms;
        let mut squares = vec![0.0; terms.len()];
        for s in data.fit() {
            let path = s.path();
            let columns = forces(terms, &composed.internals, &data.layout, s, &s.inputs(), &path);
            for ((square, column), c) in squares.iter_mut().zip(&columns).zip(&fitted.parameters.coefficients) {
                *square += c * c * dot(column, column);
            }
        }
        let mut sums = vec![0.0; data.masses()];
        terms.iter().zip(&squares).for_each(|(t, s)| sums[t.mass] += f64::sqrt(*s));
        let share = |(t, s): (&Placed, &f64)| if sums[t.mass] > 0.0 { f64::sqrt(*s) / sums[t.mass] } else { 0.0 };
        terms.iter().zip(&squares).map(share).collect()
    }

    /// RMS of a form's force over the fitted records, as a share of all forces of the acceleration.
    pub(super) fn share(&self, form: &Form, fitted: &Fitted) -> f64 {
        let Some(index) = fitted.composition.index_of(form) else { return 0.0 };
        let own = fitted.composition.places(&fitted.parameters.inner).swap_remove(index);
        self.shares(fitted)[own].iter().sum()
    }

    /// What one mass's sensor showed, and what it would show of the response, given sensor after sensor.
    fn of_sensor(&self, s: &RecordSeries, mass: usize, simulated: &[f64]) -> SensorTrace {
        // The responses are weighted so that all sensors are told in the first's unit.
        let weight = self.data.weights[mass];
        let own = simulated.get(mass * s.len()..(mass + 1) * s.len()).unwrap_or_default();
        SensorTrace {
            measured: Arc::clone(&s.measured[mass]),
            simulated: own.iter().map(|x| x / weight).collect(),
            noise: self.data.noise / weight,
        }
    }

    /// The response along every record, fitted ones first.
    pub(super) fn traces(&self, fitted: &Fitted) -> Vec<Trace> {
        let trace = |s: &RecordSeries, Followed { simulated, beginnings }: &Followed| Trace {
            record: s.name.clone(),
            usage: s.usage,
            start: s.start,
            interval: s.interval,
            measured: s.measured[0].iter().map(|x| x + self.data.datum).collect(),
            simulated: simulated.iter().take(s.len()).map(|x| x + self.data.datum).collect(),
            others: (1..s.measured.len()).map(|mass| self.of_sensor(s, mass, simulated)).collect(),
            beginnings: beginnings.clone(),
        };
        let followed = fitted.followed();
        let fit = self.data.fit().iter().zip(&followed);
        let held = self.data.held_out().iter().zip(&fitted.held_out);
        fit.chain(held).map(|(s, y)| trace(s, y)).collect()
    }

    /// What the screen alone says of every form, and which effects the data cannot show.
    pub(super) fn screened(
        &self,
        before: &Fitted,
        motion: &Motion,
        forms: &[Form],
        screened: &Screened,
    ) -> Vec<Candidate> {
        let whole = screened.rss.max(f64::MIN_POSITIVE);
        // Chance alone "explains" this much; what is left beyond noise is the gap.
        let noise = (self.data.noise.powi(2) * before.refined.samples as f64).min(0.999 * whole);
        let mut list: Vec<Candidate> = screened
            .hits
            .iter()
            .map(|hit| {
                let form = &forms[hit.form];
                Candidate {
                    choice: choice(form),
                    title: form.full_title(),
                    place: form.site,
                    explanation: form.explanation,
                    standing: Standing::Screened,
                    explained: (hit.gain / (whole - noise)).clamp(0.0, 1.0),
                    delta_bic: -hit.gain / (whole / before.refined.samples as f64),
                    why: format!(
                        "Along the measured motion it would explain {:.0} % of the gap.",
                        100.0 * (hit.gain / (whole - noise)).clamp(0.0, 1.0)
                    ),
                    stage: None,
                    confused_with: Vec::new(),
                    curve: self.measured_curve((form.axis, form.site), motion),
                }
            })
            .collect();
        for form in forms {
            if !list.iter().any(|c| c.choice == choice(form)) {
                list.push(Candidate {
                    choice: choice(form),
                    title: form.full_title(),
                    place: form.site,
                    explanation: form.explanation,
                    standing: Standing::Refused("it would have to act the wrong way round".to_owned()),
                    explained: 0.0,
                    delta_bic: 0.0,
                    why: "Along the measured motion it explains nothing with a physical sign.".to_owned(),
                    stage: None,
                    confused_with: Vec::new(),
                    curve: Curve::default(),
                });
            }
        }
        for blind in &self.audit.blind {
            if !list.iter().any(|c| c.choice.effect == blind.effect) {
                list.push(Candidate {
                    choice: Choice { effect: blind.effect.to_owned(), form: String::new() },
                    place: None,
                    title: capitalised(&blind.effect.replace('_', " ")),
                    explanation: "",
                    standing: Standing::NotShown(blind.reason.clone()),
                    explained: 0.0,
                    delta_bic: 0.0,
                    why: format!("These data cannot show it: {}.", blind.reason),
                    stage: None,
                    confused_with: Vec::new(),
                    curve: Curve::default(),
                });
            }
        }
        list
    }
}

/// Texts without repetition.
fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    texts.fold(Vec::new(), |mut list, text| {
        if !list.contains(&text) {
            list.push(text);
        }
        list
    })
}
