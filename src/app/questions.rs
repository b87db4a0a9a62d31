//! What answers to the first questions about a base and a mass would buy: each is fitted beside everything else.

use super::state::Edit;
use sindyscope_core::study::{Cancel, Known, Score, Settings, Study};
use sindyscope_values::model::Units;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Expression, Kind, Layout, Symbol, Term};

/// An answer: what it says, and what every fit would then keep to.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Reply {
    pub(crate) label: &'static str,
    pub(crate) hint: &'static str,
    pub(crate) known: Vec<Known>,
}

/// What an answer would come to: the error on held-out records, else on the fitted ones; none where the response diverges.
pub(crate) type Bought = Option<Score>;

/// The answers that a base and a mass leave open; none for other data, or where a sum of both would mix units.
pub(crate) fn replies(layout: &Layout, units: &Units) -> Vec<Reply> {
    if layout.kind != Kind::SecondOrder || layout.freedoms != 1 || layout.inputs != 1 {
        return Vec::new();
    }
    let spring = tie(Symbol::State(0), Symbol::Input(0));
    let damper = tie(Symbol::Rate(0), Symbol::InputRate(0));
    if !(adds(&spring, units, layout) && adds(&damper, units, layout)) {
        return Vec::new();
    }
    let reply = |label, hint, known| Reply { label, hint, known };
    vec![
        reply("One spring between base and mass", "x − u: one coefficient less", vec![spring.clone()]),
        reply(
            "One spring and one damper",
            "x − u and v − du: two coefficients less",
            vec![spring.clone(), damper.clone()],
        ),
        reply(
            "Damping cannot add energy",
            "No damping or friction term feeds energy in, whatever the motion",
            vec![Known::Passive],
        ),
        reply(
            "One of each, and no energy added",
            "x − u and v − du, and no damping or friction term feeds energy in",
            vec![spring, damper, Known::Passive],
        ),
    ]
}

/// One spring or one damper between base and mass.
pub(crate) fn tie(first: Symbol, second: Symbol) -> Known {
    let term = |s| Term::new(Expression::Symbol(s));
    Known::Tied { term: term(first), to: term(second), times: -1.0 }
}

/// True unless a tie adds quantities in different units.
pub(crate) fn adds(known: &Known, units: &Units, layout: &Layout) -> bool {
    let Known::Tied { term, to, .. } = known else { return true };
    let sum = Term::new(Expression::Sum(vec![term.expression().clone(), to.expression().clone()]));
    units.check(&sum, layout).is_ok()
}

/// Fits once for each answer; shorter than the answers if it was cancelled.
pub(crate) fn bought(
    study: &mut Study,
    records: &RecordSet,
    settings: &Settings,
    replies: Vec<Reply>,
    cancel: &Cancel,
) -> Vec<Bought> {
    let mut ask = |reply: Reply| {
        let settings = Settings { known: reply.known, ..settings.clone() };
        let outcome = study.run(records, &settings, cancel).ok()?;
        outcome.test.or(outcome.train).filter(|s| s.rmse.is_finite())
    };
    replies.into_iter().take_while(|_| !cancel.is_cancelled()).map(&mut ask).collect()
}

/// What the answers depend on.
#[derive(Clone, Debug, PartialEq)]
struct QuestionKey {
    generation: u64,
    usage: Vec<Usage>,
    settings: Settings,
}

/// The questions that are open, and what is known of their answers.
#[derive(Debug, Default)]
pub(crate) struct Questions {
    asked: Option<QuestionKey>,
    bought: Vec<Bought>,
}

impl Questions {
    /// True if it is to be asked what the answers would buy: that is neither known nor on its way.
    pub(crate) fn wants(&mut self, generation: u64, edit: &Edit) -> bool {
        let key = QuestionKey { generation, usage: edit.usage.clone(), settings: edit.settings.clone() };
        if self.asked.as_ref() == Some(&key) {
            return false;
        }
        self.asked = Some(key);
        self.bought.clear();
        true
    }

    /// The answers are out of date or were not computed: they are asked for again.
    pub(crate) fn give_way(&mut self) {
        self.asked = None;
    }

    /// Nothing is open any more; true if something was.
    pub(crate) fn forget(&mut self) -> bool {
        self.bought.clear();
        self.asked.take().is_some()
    }

    /// Takes in what each answer would buy.
    pub(crate) fn take(&mut self, bought: Vec<Bought>) {
        self.bought = bought;
    }

    /// What each answer would buy, in the order of the answers; nothing while that is being computed.
    pub(crate) fn bought(&self) -> &[Bought] {
        &self.bought
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_and_a_mass_are_asked_for_and_a_force_is_not() {
        let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };
        let known: Vec<String> = replies(&layout, &Units::default())
            .iter()
            .map(|r| r.known.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
            .collect();
        assert_eq!(known, ["x=-u", "x=-u, v=-du", "passive", "x=-u, v=-du, passive"]);
        assert!(replies(&Layout { freedoms: 2, ..layout }, &Units::default()).is_empty());
        assert!(replies(&Layout { kind: Kind::FirstOrder, ..layout }, &Units::default()).is_empty());
    }
}
