use super::columns::{Clock, Inputs, MotionPath};
use super::constants::Constants;
use super::effects::{Addition, Form};
use super::internal::integrate;
use super::outcome::Choice;
use super::parameters::{InnerValues, Parameters};
use super::site::{Placed, Site};
use sindyscope_core::refine::{Instance, Run, Structure};
use sindyscope_core::simulate::Delays;
use sindyscope_values::model::{Equation, Model, WeightedTerm};
use sindyscope_values::term::{Expression, Function, Kind, Layout, Symbol, Term, derivative};

/// The base model's terms with effects on top: what is fitted. Its shared parameters are [`Parameters`].
#[derive(Clone, Debug)]
pub(super) struct Composition {
    pub(super) layout: Layout,
    pub(super) base: Vec<Placed>,
    pub(super) forms: Vec<Form>,
    /// A change of each shared parameter that matters.
    pub(super) scales: Parameters,
    /// The base model's dampers take energy; else they may also give it.
    pub(super) passive: bool,
    /// Displacements count from an equilibrium that is fitted.
    pub(super) datum: bool,
    /// The file's own zero, as an equilibrium.
    pub(super) origin: f64,
    /// The sensor's zero is free in each record, as that of an accelerometer is.
    pub(super) zero: bool,
    /// RMS of the noise, weighted.
    pub(super) noise: f64,
    /// Standard deviation of the ratio of a joint's two forces about that of its springs.
    pub(super) reciprocity: f64,
}

/// What a composition comes to at given inner values.
#[derive(Clone)]
pub(super) struct Composed {
    /// Terms of the accelerations.
    pub(super) terms: Vec<Placed>,
    /// Equations of the internal states.
    pub(super) internals: Vec<Equation>,
    pub(super) delays: Delays,
    pub(super) static_ratio: f64,
    pub(super) ceiling: Option<f64>,
}

impl Composition {
    pub(super) fn new(layout: Layout, base: Vec<Placed>) -> Self {
        Self {
            layout,
            base,
            forms: Vec::new(),
            scales: Parameters::default(),
            passive: true,
            datum: false,
            origin: 0.0,
            zero: false,
            noise: 0.0,
            reciprocity: Constants::DEFAULT.reciprocity,
        }
    }

    /// This composition with a further effect, without scales.
    pub(super) fn with(&self, form: &Form) -> Self {
        let mut next = self.clone();
        next.forms.push(form.clone());
        next
    }

    /// Inner values to begin with: of the effects that another composition has too those that it has, of the others values in
    /// the middle of their grids; of the last effect `last`, unless that is empty.
    pub(super) fn inner_after(&self, other: &Self, inner: &InnerValues, last: &[f64]) -> InnerValues {
        let had = |form: &Form| other.index_of(form).map_or_else(|| form.middle(), |k| inner.forms[k].clone());
        let mut forms: Vec<Vec<f64>> = self.forms.iter().map(had).collect();
        if let Some(own) = forms.last_mut().filter(|_| !last.is_empty()) {
            *own = last.to_vec();
        }
        InnerValues { equilibrium: self.datum.then(|| inner.equilibrium.unwrap_or(0.0)), forms }
    }

    /// The same without one of its effects.
    pub(super) fn without(&self, index: usize) -> Self {
        let mut next = self.clone();
        next.forms.remove(index);
        next
    }

    /// The base model's term of a linear spring between the one mass and the ground.
    pub(super) fn spring(&self) -> Option<usize> {
        self.base.iter().position(|t| t.term.as_str() == "x")
    }

    pub(super) fn choices(&self) -> Vec<Choice> {
        self.forms.iter().map(choice).collect()
    }

    /// Which of its effects a form is.
    pub(super) fn index_of(&self, form: &Form) -> Option<usize> {
        self.forms.iter().position(|f| choice(f) == choice(form))
    }

    /// The optimiser's row, part by part.
    pub(super) fn named<T: Clone>(&self, row: &[T]) -> Parameters<T> {
        let forms = self.forms.iter().map(|f| vec![(); f.inner.len()]).collect();
        Parameters::of_row(row, &InnerValues { equilibrium: self.datum.then_some(()), forms })
    }

    /// The position of each shared parameter in the optimiser's row.
    pub(super) fn positions(&self) -> Parameters<usize> {
        let quantities = self.forms.iter().map(|f| f.inner.len()).sum::<usize>() + usize::from(self.datum);
        self.named(&(0..self.terms() + quantities).collect::<Vec<usize>>())
    }

    /// The terms of the accelerations as they are written, displacements not counted from the equilibrium.
    pub(super) fn plain_terms(&self, inner: &InnerValues) -> Vec<Placed> {
        self.compose(&InnerValues { equilibrium: None, ..inner.clone() }).terms
    }

    /// Number of terms of the accelerations, the same at all inner values.
    pub(super) fn terms(&self) -> usize {
        self.compose(&self.middle()).terms.len()
    }

    /// Number of parameters, those of the base model that no effect replaces included; what acts through no quantity of its
    /// own, as a sensor's offset of each record, counts for one.
    pub(super) fn parameters(&self) -> usize {
        let own = |form: &Form| match (form.coefficients.len(), form.inner.len()) {
            (0, 0) => 1,
            (_, inner) => inner,
        };
        self.terms() + self.forms.iter().map(own).sum::<usize>()
    }

    /// Some inner values within bounds.
    pub(super) fn middle(&self) -> InnerValues {
        let forms = self.forms.iter().map(Form::middle).collect();
        InnerValues { equilibrium: self.datum.then_some(0.0), forms }
    }

    fn additions(&self, inner: &InnerValues) -> Vec<Addition> {
        self.forms.iter().zip(&inner.forms).map(|(form, own)| form.addition(own)).collect()
    }

    /// The indices of each form's coefficients among the terms at these inner values.
    pub(super) fn places(&self, inner: &InnerValues) -> Vec<std::ops::Range<usize>> {
        let additions = self.additions(inner);
        let kept = self.base.iter().filter(|t| !additions.iter().any(|a| a.replaces.contains(t))).count();
        let mut next = kept;
        additions
            .iter()
            .map(|a| {
                let range = next..next + a.terms.len();
                next = range.end;
                range
            })
            .collect()
    }

    /// The base model's terms that grow with the velocity of the mass whose equation they stand in, each with the index of
    /// its coefficient: whatever else moves, a damper there takes energy.
    pub(super) fn dampers(&self, inner: &InnerValues) -> Vec<(usize, &Placed)> {
        let replaced: Vec<Placed> = self.additions(inner).into_iter().flat_map(|a| a.replaces).collect();
        let kept = self.base.iter().filter(|t| !replaced.contains(t)).enumerate();
        let slope = |t: &Placed| derivative(t.term.expression(), Symbol::Rate(t.mass));
        kept.filter(|(_, t)| matches!(slope(t), Expression::Number(slope) if slope > 0.0)).collect()
    }

    /// The stiffness of the base model in one mass's equation against another's displacement, positive where it pulls the mass
    /// there; of its own, back.
    fn stiffness(&self, parameters: &Parameters, of: usize, by: usize) -> f64 {
        let additions = self.additions(&parameters.inner);
        let kept = self.base.iter().filter(|t| !additions.iter().any(|a| a.replaces.contains(t)));
        let weighted = kept.zip(&parameters.coefficients).filter(|(t, _)| t.mass == of);
        let slope = |(t, c): (&Placed, &f64)| match derivative(t.term.expression(), Symbol::State(by)) {
            Expression::Number(slope) => slope * c,
            _ => 0.0,
        };
        let sum: f64 = weighted.map(slope).sum();
        if of == by { (-sum).max(0.0) } else { sum.max(0.0) }
    }

    /// Action and reaction: a joint's forces on its two masses are equal and opposite, so that they accelerate these in the
    /// ratio in which the springs between them do (J. C. Maxwell, Phil. Mag. 27 (1864) 294–299). It is expected, not exacted:
    /// masses that are coupled by inertia too do not keep to it.
    ///
    /// For each pair of coefficients of a joint, the index of the form and by how many standard deviations the pair's ratio is
    /// another one.
    pub(super) fn reciprocity(&self, parameters: &Parameters) -> Vec<(usize, f64)> {
        let mut found = Vec::new();
        for ((index, form), place) in self.forms.iter().enumerate().zip(self.places(&parameters.inner)) {
            let Some(Site::Joint(i, j)) = form.site else { continue };
            let stiffness = |of: usize, by: usize| self.stiffness(parameters, of, by);
            for pair in parameters.coefficients[place].chunks_exact(2) {
                let (action, reaction) = (pair[0] * stiffness(j, i), -pair[1] * stiffness(i, j));
                // Springs between two masses that are a small share of those that hold each tell little.
                let slack =
                    2.0 * self.reciprocity * (pair[0].abs() * stiffness(j, j) + pair[1].abs() * stiffness(i, i));
                let size = action.abs() + reaction.abs() + slack;
                // Half the logarithm of the ratio, and bounded where the two have nothing in common.
                let apart = if size > 0.0 { (action - reaction) / size } else { 0.0 };
                found.push((index, 2.0 * apart / self.reciprocity));
            }
        }
        found
    }

    /// Its parameters, those that another composition has too as they are there: coefficients of the same terms, and the inner
    /// quantities of the same effects, or of the same name in another kind of one.
    pub(super) fn transferred(&self, own: &Parameters, other: &Self, others: &Parameters) -> Parameters {
        let mut next = own.clone();
        next.inner.equilibrium = others.inner.equilibrium.or(own.inner.equilibrium);
        for (form, inner) in self.forms.iter().zip(&mut next.inner.forms) {
            if let Some(k) = other.index_of(form) {
                inner.clone_from(&others.inner.forms[k]);
            } else if let Some(k) = other.forms.iter().position(|kind| kind.is_kin(form)) {
                for (value, own) in inner.iter_mut().zip(&form.inner) {
                    let same = other.forms[k].inner.iter().position(|quantity| quantity.name == own.name);
                    *value = same.map_or(*value, |q| others.inner.forms[k][q].clamp(own.bounds.0, own.bounds.1));
                }
            }
        }
        let there = other.compose(&others.inner).terms;
        for (value, term) in next.coefficients.iter_mut().zip(self.compose(&next.inner).terms) {
            if let Some(k) = there.iter().position(|t| *t == term) {
                *value = others.coefficients[k];
            }
        }
        next
    }

    pub(super) fn compose(&self, inner: &InnerValues) -> Composed {
        let additions = self.additions(inner);
        let mut composed = Composed {
            terms: self.base.iter().filter(|t| !additions.iter().any(|a| a.replaces.contains(t))).cloned().collect(),
            internals: Vec::new(),
            delays: additions.iter().flat_map(|a| a.delays.each()).collect(),
            static_ratio: additions.iter().filter_map(|a| a.static_ratio).fold(1.0, f64::max),
            ceiling: additions.iter().find_map(|a| a.ceiling),
        };
        for addition in &additions {
            let first = composed.internals.len();
            let moved = |term: &Term| {
                if first == 0 { term.clone() } else { substituted(term, &|s| renumbered(s, first)) }
            };
            composed.terms.extend(addition.terms.iter().map(|t| t.map(moved)));
            composed.internals.extend(
                addition
                    .internals
                    .iter()
                    .map(|equation| Equation::known(equation.terms.iter().map(|t| (moved(&t.term), t.coefficient)))),
            );
        }
        for limit in additions.iter().filter_map(|a| a.input_limit) {
            for placed in &mut composed.terms {
                placed.term = limited(&placed.term, limit);
            }
            for term in composed.internals.iter_mut().flat_map(|e| &mut e.terms) {
                term.term = limited(&term.term, limit);
            }
        }
        if let Some(equilibrium) = inner.equilibrium.filter(|e| *e != 0.0) {
            let from_there = |term: &Term| counted_from(term, equilibrium);
            composed.terms.iter_mut().for_each(|t| t.term = from_there(&t.term));
            for term in composed.internals.iter_mut().flat_map(|e| &mut e.terms) {
                term.term = from_there(&term.term);
            }
        }
        composed
    }

    /// Least and largest value of each parameter.
    pub(super) fn ranges(&self) -> Parameters<(f64, f64)> {
        const OPEN: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
        let middle = self.middle();
        let mut coefficients = vec![OPEN; self.terms()];
        if self.passive {
            for (k, _) in self.dampers(&middle) {
                coefficients[k] = (f64::NEG_INFINITY, 0.0);
            }
        }
        for (form, place) in self.forms.iter().zip(self.places(&middle)) {
            for (coefficient, k) in form.coefficients.iter().zip(place) {
                coefficients[k] = coefficient.sign.range();
            }
        }
        let forms = self.forms.iter().map(|f| f.inner.iter().map(|i| i.bounds).collect()).collect();
        let zero = if self.holds_the_zero() { (self.origin, self.origin) } else { OPEN };
        Parameters { coefficients, inner: InnerValues { equilibrium: self.datum.then_some(zero), forms } }
    }

    /// True if some effect says why the motion is not about the file's zero: then that zero is taken at its word.
    pub(super) fn holds_the_zero(&self) -> bool {
        self.forms.iter().any(Form::has_a_mean)
    }

    /// True if the force of some effect repeats with every turn of the displacement.
    pub(super) fn is_periodic(&self) -> bool {
        self.forms.iter().any(Form::is_periodic)
    }

    /// The equations at these shared parameters.
    pub(super) fn model(&self, parameters: &Parameters) -> (Model, Composed) {
        let composed = self.compose(&parameters.inner);
        let weighted = || composed.terms.iter().zip(parameters.coefficients.iter().copied());
        let of = |mass: usize| weighted().filter(move |(t, _)| t.mass == mass).map(|(t, c)| (t.term.clone(), c));
        let accelerations = (0..self.layout.freedoms).map(|mass| Equation::known(of(mass))).collect();
        let mut model =
            Model::second_order(self.layout.inputs, accelerations).with_internals(composed.internals.clone());
        model.static_ratio = composed.static_ratio;
        (model, composed)
    }
}

pub(super) fn choice(form: &Form) -> Choice {
    Choice { effect: form.effect.to_owned(), form: form.form.clone() }
}

impl Structure for Composition {
    fn instance(&self, row: &[f64]) -> Option<Instance> {
        let parameters = self.named(row);
        let inner = self.forms.iter().zip(&parameters.inner.forms).flat_map(|(form, own)| form.inner.iter().zip(own));
        for (quantity, value) in inner {
            let (low, high) = quantity.bounds;
            if !(low..=high).contains(value) {
                return None;
            }
        }
        let (model, composed) = self.model(&parameters);
        Some(Instance { model, delays: composed.delays, ceiling: composed.ceiling, readings: Vec::new() })
    }

    fn scales(&self) -> Vec<f64> {
        self.scales.clone().row()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.ranges().row()
    }

    fn expectations(&self, row: &[f64]) -> Vec<f64> {
        if self.forms.iter().all(|f| !matches!(f.site, Some(Site::Joint(..)))) {
            return Vec::new();
        }
        self.reciprocity(&self.named(row)).into_iter().map(|(_, deviations)| deviations * self.noise).collect()
    }

    fn offset(&self) -> bool {
        self.zero || self.additions(&self.middle()).iter().any(|a| a.offset)
    }

    fn internals(&self) -> usize {
        self.compose(&self.middle()).internals.len()
    }

    fn driven(&self, row: &[f64], run: &Run) -> Vec<Vec<f64>> {
        let composed = self.compose(&self.named(row).inner);
        let layout = Layout { internals: composed.internals.len(), kind: Kind::SecondOrder, ..self.layout };
        let motion = &run.motion;
        let inputs = Inputs {
            values: motion.inputs.iter().map(Vec::as_slice).collect(),
            rates: motion.input_rates.iter().map(Vec::as_slice).collect(),
        };
        let clock = Clock { start: run.grid.time(0), interval: run.grid.interval() };
        let path = MotionPath::of(&motion.states);
        integrate(&composed.internals, &layout, clock, &inputs, &path)
    }
}

/// Standard errors and shares, one a term, into a model's accelerations.
pub(super) fn with_errors(mut model: Model, terms: &[Placed], errors: &[Option<f64>], shares: &[f64]) -> Model {
    let freedoms = model.layout.freedoms;
    let mut places = vec![0; freedoms];
    for (k, placed) in terms.iter().enumerate() {
        let place = places[placed.mass];
        places[placed.mass] += 1;
        let equation = model.equations.get_mut(freedoms + placed.mass);
        if let Some(WeightedTerm { std_error, share, .. }) = equation.and_then(|e| e.terms.get_mut(place)) {
            *std_error = errors.get(k).copied().flatten();
            *share = shares.get(k).copied().unwrap_or(0.0);
        }
    }
    model
}

fn renumbered(symbol: Symbol, first: usize) -> Option<Expression> {
    match symbol {
        Symbol::Internal(i) => Some(Expression::Symbol(Symbol::Internal(first + i))),
        _ => None,
    }
}

/// A term whose displacement counts from another point.
pub(super) fn counted_from(term: &Term, point: f64) -> Term {
    substituted(term, &|symbol| match symbol {
        Symbol::State(_) => Some(Expression::from(symbol) - point),
        _ => None,
    })
}

/// A term with some symbols replaced.
fn substituted(term: &Term, by: &dyn Fn(Symbol) -> Option<Expression>) -> Term {
    Term::new(term.expression().replaced(by))
}

/// A term in which an input is held within ± a limit; its rate is zero beyond.
fn limited(term: &Term, (input, limit): (usize, f64)) -> Term {
    let held = Expression::from(Symbol::Input(input));
    substituted(term, &|symbol| match symbol {
        Symbol::Input(j) if j == input => {
            Some(Expression::Call(Function::Clip, vec![held.clone(), Expression::Number(limit)]))
        }
        Symbol::InputRate(j) if j == input => {
            let room = Expression::from(limit) - held.clone().abs();
            Some(Expression::call(Function::Step, room) * symbol)
        }
        _ => None,
    })
}
