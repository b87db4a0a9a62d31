//! What known physics makes of the library: which terms are candidates, and what is decided of each.

use super::error::StudyError;
use super::known::{Known, Sign};
use super::opposite::pairs;
use super::settings::{Kinematics, Lock, Settings};
use sindyscope_values::term::{Expression, Kind, Layout, Symbol, Term};

/// What a tie makes of two terms: one, whose coefficient is the first's.
fn merged(term: &Term, to: &Term, times: f64) -> Term {
    let second = Expression::Product(vec![Expression::Number(times.recip()), to.expression().clone()]);
    Term::new(Expression::Sum(vec![term.expression().clone(), second]))
}

/// The candidates of all equations together, each once.
pub(super) fn candidate_terms(settings: &Settings, layout: &Layout) -> Vec<Term> {
    if settings.own.is_empty() {
        return offered(settings);
    }
    let mut terms: Vec<Term> = Vec::new();
    for term in (0..layout.freedoms).flat_map(|freedom| offered(&settings.of_equation(freedom))) {
        if !terms.contains(&term) {
            terms.push(term);
        }
    }
    terms
}

/// The library's terms together with those locked in or fixed, each once, as what is known makes them; of settings that
/// stand for one equation.
pub(super) fn offered(settings: &Settings) -> Vec<Term> {
    let offered = |t: &&Term| match settings.known.iter().find_map(stiffness) {
        Some(keeps_odd) => stiffness_of(t).is_none_or(|shape| shape.stays(keeps_odd)),
        None => true,
    };
    let locked = settings.locks.iter().filter(|(_, lock)| **lock != Lock::Out).map(|(term, _)| term);
    let mut terms: Vec<Term> = Vec::with_capacity(settings.terms.len());
    for term in settings.terms.iter().filter(offered).chain(locked) {
        if !terms.contains(term) {
            terms.push(term.clone());
        }
    }
    for known in &settings.known {
        let Known::Tied { term, to, times } = known else { continue };
        let joint = merged(term, to, *times);
        let Some(place) = terms.iter().position(|t| t == term || t == to || *t == joint) else { continue };
        terms[place] = joint.clone();
        let mut index = 0;
        terms.retain(|t| {
            index += 1;
            index - 1 == place || (t != term && t != to && *t != joint)
        });
    }
    terms
}

/// What is decided about a term of the library, or about one of the two that a tie made it of.
pub(super) fn lock_of(settings: &Settings, term: &Term) -> Option<Lock> {
    if let Some(lock) = settings.locks.get(term) {
        return Some(*lock);
    }
    settings.known.iter().find_map(|known| match known {
        Known::Tied { term: first, to, times } if merged(first, to, *times) == *term => {
            let second = settings.locks.get(to).map(|lock| match lock {
                Lock::Fixed(value) => Lock::Fixed(times * value),
                other => *other,
            });
            settings.locks.get(first).copied().or(second)
        }
        _ => None,
    })
}

/// The sign that a term's coefficient may have in the equation of one velocity (of one state, first order).
pub(super) fn sign_of(settings: &Settings, term: &Term, freedom: usize) -> Option<Sign> {
    settings.known.iter().find_map(|known| match known {
        Known::Signed(signed, sign) if signed == term => Some(*sign),
        Known::Signed(signed, sign) => settings.known.iter().find_map(|known| match known {
            Known::Tied { term: first, to, times } if merged(first, to, *times) == *term => {
                let second = if *times < 0.0 { sign.other() } else { *sign };
                (signed == first).then_some(*sign).or((signed == to).then_some(second))
            }
            _ => None,
        }),
        Known::Passive => damping(term, freedom),
        _ => None,
    })
}

/// Displacements and velocities at which a term is evaluated to find its symmetry.
const TRIAL_VALUES: [f64; 5] = [0.013, 0.21, 0.83, 1.7, 6.1];

/// The sign of a coefficient with which a term takes energy out of one degree of freedom at every motion, everything else
/// at rest; none if that depends on the motion, or the term does no work.
fn damping(term: &Term, freedom: usize) -> Option<Sign> {
    if term.symbols().contains(&Symbol::Time) {
        return None;
    }
    let (mut gains, mut loses) = (false, false);
    for x in TRIAL_VALUES.into_iter().chain([0.0]).flat_map(|x| [x, -x]) {
        for v in TRIAL_VALUES.into_iter().flat_map(|v| [v, -v]) {
            let power = v * term.expression().value(&|s| match s {
                Symbol::State(i) if i == freedom => x,
                Symbol::Rate(i) if i == freedom => v,
                _ => 0.0,
            });
            gains |= power > 0.0;
            loses |= power < 0.0;
            if !power.is_finite() {
                return None;
            }
        }
    }
    match (gains, loses) {
        (true, false) => Some(Sign::NotPositive),
        (false, true) => Some(Sign::NotNegative),
        _ => None,
    }
}

/// True if only odd terms stay, false if only even ones do; none if it says nothing of stiffness.
fn stiffness(known: &Known) -> Option<bool> {
    match known {
        Known::OddStiffness => Some(true),
        Known::EvenStiffness => Some(false),
        _ => None,
    }
}

/// How a restoring force behaves when the displacement is turned around.
struct ForceSymmetry {
    odd: bool,
    even: bool,
    linear: bool,
}

impl ForceSymmetry {
    fn stays(&self, keeps_odd: bool) -> bool {
        if keeps_odd { self.odd } else { self.even || self.linear }
    }
}

/// The shape of a term that depends on displacements; none for others.
fn stiffness_of(term: &Term) -> Option<ForceSymmetry> {
    let symbols = term.symbols();
    let position = |s: &Symbol| matches!(s, Symbol::State(_));
    let other = |s: &Symbol| matches!(s, Symbol::Rate(_) | Symbol::InputRate(_) | Symbol::Time | Symbol::Internal(_));
    if !symbols.iter().any(position) || symbols.iter().any(other) {
        return None;
    }
    // Unequal displacements, so that a product of two is told from the square of their difference.
    let force =
        |x: f64| term.expression().value(&|s| if let Symbol::State(i) = s { x * (1.0 + 0.37 * i as f64) } else { 0.0 });
    let mut shape = ForceSymmetry { odd: true, even: true, linear: true };
    for x in TRIAL_VALUES {
        let (there, back, twice) = (force(x), force(-x), force(2.0 * x));
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (a.abs() + b.abs());
        shape.odd &= close(there, -back);
        shape.even &= close(there, back);
        shape.linear &= close(there, -back) && close(twice, 2.0 * there);
    }
    Some(shape)
}

/// Holds what is known, for all equations and for each, against the rest of the settings.
pub(super) fn check(settings: &Settings, layout: &Layout) -> Result<(), StudyError> {
    let name = |freedom: usize| match layout.kind {
        Kind::SecondOrder => layout.name(Symbol::Rate(freedom)),
        Kind::FirstOrder => layout.name(Symbol::State(freedom)),
    };
    if let Some(foreign) = settings.own.keys().find(|freedom| **freedom >= layout.freedoms) {
        let there: Vec<String> = (0..layout.freedoms).map(name).collect();
        return Err(StudyError::Setting(format!(
            "there is no equation of {}: the records have {}",
            Layout { freedoms: foreign + 1, ..*layout }.name(match layout.kind {
                Kind::SecondOrder => Symbol::Rate(*foreign),
                Kind::FirstOrder => Symbol::State(*foreign),
            }),
            there.join(", ")
        )));
    }
    check_pairs(settings, layout)?;
    if settings.own.is_empty() {
        return check_one(settings, layout);
    }
    for freedom in 0..layout.freedoms {
        let settings = settings.of_equation(freedom);
        let named = |problem: String| StudyError::Setting(format!("equation of {}: {problem}", name(freedom)));
        check_one(&settings, layout).map_err(|e| named(e.to_string()))?;
        let terms = offered(&settings);
        if terms.is_empty() {
            return Err(named("its library is empty: add at least one term".into()));
        }
        if let Some((term, symbol)) = terms.iter().find_map(|t| t.foreign_symbol(layout).map(|s| (t, s))) {
            return Err(named(format!("the term {term} needs {}, which the records do not have", layout.name(symbol))));
        }
    }
    Ok(())
}

/// Holds pairs of masses against the records and the library.
fn check_pairs(settings: &Settings, layout: &Layout) -> Result<(), StudyError> {
    let refused = |text: String| Err(StudyError::Setting(text));
    let own = settings.own.values().flat_map(|own| &own.known).find(|known| matches!(known, Known::Opposite(_)));
    if let Some(known) = own {
        return refused(format!("`{known}` is said of two equations: give it for all, not for one"));
    }
    let pairs = pairs(settings);
    for (k, pair) in pairs.iter().enumerate() {
        let known = Known::Opposite(*pair);
        let (low, high) = (pair.first.min(pair.second), pair.first.max(pair.second));
        if layout.kind != Kind::SecondOrder || settings.kinematics == Kinematics::Fitted {
            return refused(format!("`{known}` says something of forces: take dx/dt = v as known"));
        }
        if high >= layout.freedoms {
            let masses = layout.freedoms;
            return refused(format!("`{known}`: there is no m{}: the masses measured are {masses}", high + 1));
        }
        if pairs[..k].iter().any(|other| other.is_of_same_masses(pair)) {
            return refused(format!("`{known}`: the ratio of these two masses is given twice"));
        }
        let [first, second] = [pair.first, pair.second].map(|mass| offered(&settings.of_equation(mass)));
        if !first.iter().any(|term| pair.joins(term) && second.contains(term)) {
            let (low, high) = (low + 1, high + 1);
            return refused(format!(
                "`{known}`: no candidate of both equations is a force between masses {low} and {high}: add x{high}-x{low}"
            ));
        }
    }
    Ok(())
}

fn check_one(settings: &Settings, layout: &Layout) -> Result<(), StudyError> {
    let mut tied: Vec<&Term> = Vec::new();
    for known in &settings.known {
        if let Known::Tied { term, to, .. } = known {
            if settings.kind == Kind::SecondOrder && settings.kinematics == Kinematics::Fitted {
                return Err(StudyError::Setting(format!(
                    "`{known}` says something of the force, not of dx/dt: take dx/dt = v as known"
                )));
            }
            if let Some(twice) = [term, to].into_iter().find(|t| tied.contains(t)) {
                return Err(StudyError::Setting(format!("{twice} is tied twice: keep one of its ties")));
            }
            tied.extend([term, to]);
        }
        let terms: &[&Term] = match known {
            Known::Tied { term, to, .. } => &[term, to],
            Known::Signed(term, _) => &[term],
            _ => &[],
        };
        if let Some((term, symbol)) = terms.iter().find_map(|t| t.foreign_symbol(layout).map(|s| (t, s))) {
            return Err(StudyError::Setting(format!(
                "`{known}`: the term {term} needs {}, which the records do not have",
                layout.name(symbol)
            )));
        }
    }
    if settings.known.contains(&Known::OddStiffness) && settings.known.contains(&Known::EvenStiffness) {
        return Err(StudyError::Setting("stiffness cannot be both `odd` and `even`".into()));
    }
    if settings.mass.is_some_and(|m| !(m > 0.0 && m.is_finite())) {
        return Err(StudyError::Setting("a mass is above zero".into()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{Cancel, Outcome, Study, known_list, suggest};
    use sindyscope_rig::{ScenarioOptions, generate};
    use sindyscope_values::record::{RecordSet, Usage};
    use sindyscope_values::term::list;

    fn settings(terms: &str, known: &str) -> Settings {
        Settings { terms: list(terms).unwrap(), known: known_list(known).unwrap(), ..Settings::default() }
    }

    fn offered(terms: &str, known: &str) -> String {
        super::offered(&settings(terms, known)).iter().map(Term::as_str).collect::<Vec<_>>().join(", ")
    }

    /// Two tones of the friction rig, base driven.
    fn friction() -> RecordSet {
        let options = ScenarioOptions {
            seed: 5,
            duration: Some(6.0),
            rate: Some(250.0),
            frequencies: Some(vec![2.013, 4.611]),
            ..ScenarioOptions::default()
        };
        RecordSet::new(generate("friction-noisy", &options).unwrap().records, Usage::Fit)
    }

    fn run(records: &RecordSet, settings: &Settings) -> Outcome {
        Study::default().run(records, settings, &Cancel::default()).unwrap()
    }

    #[test]
    fn ties_and_symmetry_make_another_library() {
        assert_eq!(offered("x, v, u, du, sgn(v)", "x=-u, v=-du"), "x-u, v-du, sgn(v)");
        assert_eq!(offered("x, v", "x=-u"), "x-u, v", "a tie brings the other term with it");
        assert_eq!(offered("v, x^3", "x=-u"), "v, x^3", "and says nothing of terms that are not there");
        assert_eq!(offered("1, x, x^2, x^3, |x|, x*|x|, v, x*v, (x-u)^2, u^2", "odd"), "1, x, x^3, x*|x|, v, x*v, u^2");
        assert_eq!(offered("1, x, x^2, x^3, |x|, sgn(x), sin(x), x-u, v", "even"), "1, x, x^2, |x|, x-u, v");
        assert_eq!(offered("x1, x2, x1*x2, x1^2*x2, x1-x2", "odd"), "x, x2, x^2*x2, x-x2");
    }

    #[test]
    fn locks_and_signs_of_tied_terms_are_their_own() {
        let mut settings = settings("x, u, v, du", "x=-2*u, v=-du, v<=0");
        let tied = super::offered(&settings)[0].clone();
        assert_eq!(tied.as_str(), "x-0.5*u");
        settings.locks.insert(Term::parse("u").unwrap(), Lock::Fixed(150.0));
        assert_eq!(lock_of(&settings, &tied), Some(Lock::Fixed(-300.0)));
        settings.locks.insert(Term::parse("x").unwrap(), Lock::In);
        assert_eq!(lock_of(&settings, &tied), Some(Lock::In));
        assert_eq!(sign_of(&settings, &Term::parse("v-du").unwrap(), 0), Some(Sign::NotPositive));
        settings.known = known_list("v=-du, du>=0").unwrap();
        assert_eq!(sign_of(&settings, &Term::parse("v-du").unwrap(), 0), Some(Sign::NotPositive));
    }

    #[test]
    fn passive_terms_are_those_that_only_take_energy_out() {
        let sign = |text: &str, freedom| sign_of(&settings("x", "passive"), &Term::parse(text).unwrap(), freedom);
        for text in ["v", "v^3", "v*|v|", "sgn(v)", "x^2*v", "|x|*sgn(v)", "v-du", "tanh(v)"] {
            assert_eq!(sign(text, 0), Some(Sign::NotPositive), "{text}");
        }
        for text in ["x", "u", "1", "x*v", "v^2", "du", "x^3", "cos(t)*v"] {
            assert_eq!(sign(text, 0), None, "{text}");
        }
        assert_eq!(sign("v1-v2", 0), Some(Sign::NotPositive));
        assert_eq!(sign("v1-v2", 1), Some(Sign::NotNegative), "the other side of the same damper");
        assert_eq!(sign("v2", 0), None);
    }

    #[test]
    fn a_shared_spring_is_found_more_sharply_than_two() {
        let records = friction();
        let mut free = suggest(&records, Kind::SecondOrder).unwrap();
        free.terms = list("x, v, u, du, sgn(v)").unwrap();
        free.threshold = 0.0;
        let mut tied = free.clone();
        tied.known = known_list("x=-u, v=-du, passive").unwrap();
        let error = |settings: &Settings, term: &str| {
            let outcome = run(&records, settings);
            let equation = outcome.model.leading().unwrap().clone();
            let found = equation.terms.iter().find(|t| t.term.as_str() == term).unwrap().clone();
            (found.coefficient, found.std_error.unwrap(), outcome.train.unwrap().nrmse)
        };
        let ((c, sd, free_error), (_, alone, tied_error)) = (error(&tied, "v-du"), error(&free, "v"));
        assert!((c + 0.0658).abs() < 4.0 * sd && sd < alone, "{c} ± {sd}, alone ± {alone}");
        assert!(tied_error < 1.2 * free_error, "{tied_error} {free_error}");
    }

    #[test]
    fn signs_hold_in_every_fit() {
        let records = friction();
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.terms = list("x, v, u, v*|v|, v^3, x^2*v, sgn(v), |x|*sgn(v)").unwrap();
        settings.threshold = 0.0;
        let feeds = |settings: &Settings| {
            let outcome = run(&records, settings);
            let terms = &outcome.model.leading().unwrap().terms;
            terms.iter().filter(|t| damping(&t.term, 0).is_some() && t.coefficient > 0.0).count()
        };
        assert!(feeds(&settings) > 0, "without a word of it some term feeds energy in: the test is one");
        settings.known = vec![Known::Passive];
        assert_eq!(feeds(&settings), 0);
        settings.refine = true;
        assert_eq!(feeds(&settings), 0);
        let ensemble = Study::default().ensemble(&records, &settings, &Cancel::default()).unwrap();
        for said in ensemble.terms.iter().filter(|t| damping(&t.term, 0).is_some()) {
            assert!(said.interval.is_none_or(|(_, high)| high <= 0.0), "{said:?}");
        }
        // Every threshold on the way keeps to them, and the path comes to its end.
        let outcome = run(&records, &settings);
        for term in outcome.fits[0].path.iter().filter(|t| damping(&t.term, 0).is_some()) {
            assert!(term.coefficients.iter().all(|(_, c)| *c <= 0.0), "{}", term.term);
        }
    }

    #[test]
    fn what_contradicts_itself_is_said() {
        let records = friction();
        let refused = |known: &str| {
            let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
            settings.known = known_list(known).unwrap();
            Study::default().run(&records, &settings, &Cancel::default()).unwrap_err().to_string()
        };
        assert!(refused("odd, even").contains("both"));
        assert!(refused("x=-u, x=-du").contains("tied twice"));
        assert!(refused("x=-u2").contains("u2"));
    }
}
