//! Terms: what is printed reads back as itself, whatever the term; no text makes the reader fail badly.

use proptest::prelude::*;
use sindyscope_values::term::{Expression, Function, Kind, Layout, Program, SampleBlock, Symbol, Term};

fn symbol() -> impl Strategy<Value = Symbol> {
    prop_oneof![
        Just(Symbol::Time),
        (0..3usize).prop_map(Symbol::State),
        (0..3usize).prop_map(Symbol::Rate),
        (0..3usize).prop_map(Symbol::Acceleration),
        (0..2usize).prop_map(Symbol::Input),
        (0..2usize).prop_map(Symbol::InputRate),
    ]
}

fn expression() -> impl Strategy<Value = Expression> {
    let leaf = prop_oneof![
        3 => symbol().prop_map(Expression::Symbol),
        1 => prop_oneof![-9.0..9.0f64, Just(1e-7), Just(2.5e9)].prop_map(Expression::Number),
    ];
    leaf.prop_recursive(4, 24, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 1..4).prop_map(Expression::Sum),
            prop::collection::vec(inner.clone(), 1..4).prop_map(Expression::Product),
            (inner.clone(), prop_oneof![Just(-2.0), Just(-1.0), Just(0.5), Just(2.0), Just(3.0)])
                .prop_map(|(base, n)| Expression::Power(Box::new(base), n)),
            (0..Function::ALL.len(), inner.clone(), inner).prop_map(|(k, a, b)| {
                let function = Function::ALL[k];
                Expression::Call(function, [a, b].into_iter().take(function.arity()).collect())
            }),
        ]
    })
}

fn layout() -> Layout {
    Layout { kind: Kind::SecondOrder, freedoms: 3, inputs: 2, internals: 0 }
}

/// True of terms that have a value: no infinite number, nothing divided by zero.
fn sound(e: &Expression) -> bool {
    let mut sound = true;
    e.visit(&mut |e| match e {
        Expression::Number(n) => sound &= n.is_finite(),
        Expression::Power(base, _) => sound &= **base != Expression::Number(0.0),
        _ => {}
    });
    sound
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn printing_and_parsing_are_inverse(e in expression()) {
        let term = Term::new(e);
        prop_assume!(sound(term.expression()));
        for text in [term.to_string(), term.text(&layout())] {
            let again = Term::parse(&text);
            prop_assert!(again.as_ref() == Ok(&term), "{text} became {again:?}");
        }
    }

    #[test]
    fn the_normal_form_keeps_the_value(e in expression(), values in prop::array::uniform15(0.1..2.0f64)) {
        let value = |s: Symbol| match s {
            Symbol::Time => values[0],
            Symbol::State(i) => values[1 + i],
            Symbol::Rate(i) => values[4 + i],
            Symbol::Input(j) => values[7 + j],
            Symbol::InputRate(j) => values[9 + j],
            Symbol::InputAcceleration(_) => values[11],
            Symbol::Acceleration(i) => values[12 + i],
            Symbol::Internal(_) => 0.0,
        };
        let (plain, normal) = (e.value(&value), e.normal().value(&value));
        // Sums that cancel lose digits; only well-scaled values are compared.
        prop_assume!(plain.is_finite() && normal.is_finite() && (1e-3..1e6).contains(&plain.abs()));
        let smooth = {
            let mut smooth = true;
            e.visit(&mut |e| match e {
                Expression::Call(Function::Sgn | Function::Step | Function::Tan, _) => smooth = false,
                // Of an angle of many turns no digit of the sine is left.
                Expression::Call(Function::Sin | Function::Cos, angle) => smooth &= angle[0].value(&value).abs() < 1e5,
                _ => {}
            });
            smooth
        };
        prop_assume!(smooth);
        prop_assert!((plain - normal).abs() <= 1e-5 * plain.abs(), "{e:?}: {plain} became {normal}");
    }

    #[test]
    fn any_text_is_a_term_or_an_error_that_names_a_column(text in "[-+*/^|().,a-z0-9 xvu²]{0,30}") {
        match Term::parse(&text) {
            Ok(term) => prop_assert!(!term.as_str().is_empty()),
            Err(error) => prop_assert!(error.column >= 1 && error.column <= text.chars().count() + 1, "{error}"),
        }
    }

    #[test]
    fn compiled_columns_are_the_trees_values(e in expression(), x in prop::collection::vec(0.1..2.0f64, 300)) {
        let layout = layout();
        let series: Vec<&[f64]> = vec![&x; 6];
        let block = SampleBlock {
            start: 0.5,
            interval: 0.01,
            states: &series,
            inputs: &series[..2],
            input_rates: &series[..2],
            accelerations: &series[..3],
        };
        let mut columns = vec![Vec::new()];
        let e = e.normal();
        Program::new(std::slice::from_ref(&e), &layout).columns(&block, &mut columns);
        for (k, found) in columns[0].iter().enumerate() {
            let want = e.value(&|s| if s == Symbol::Time { 0.5 + 0.01 * k as f64 } else { x[k] });
            let close = (want - found).abs() <= 1e-9 * want.abs().max(1.0);
            prop_assert!(close || !want.is_finite() || !found.is_finite() || want.abs() > 1e6, "{e:?} {k}: {want} {found}");
        }
    }
}
