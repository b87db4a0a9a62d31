//! Structures with several modes: a chain of masses and a cantilever beam, with a force beside the linear structure at a node or
//! between two.
//!
//! `M ẍ + C ẋ + K x = b u − g f`: the masses stand on the diagonal; C gives every mode the same damping ratio. The beam is of
//! Euler–Bernoulli elements whose masses are lumped at the nodes; its rotations carry no mass and are condensed, which is exact.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::plant::{Contact, Plant};
use super::plants::{PlantKind, PlantParameter, at_least, parameter};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Expression, Symbol, Term};

/// The most nodes of a structure.
const MOST_NODES: usize = 20;
/// Entries of a matrix below this share of its largest are rounding.
const ROUNDING: f64 = 1e-12;

/// A chain from the ground on, a force on one mass.
pub(super) static CHAIN: PlantKind = PlantKind {
    parameters: &[NODES_OF_CHAIN, MASS, SPRING, ZETA, AT, PLACE, FROM, CUBIC, FRICTION, GAP, STOP, JOINT, SLIP],
    build: |p| structure(&chain(nodes(p[0]), [p[1], p[2]]), p[3], Some(p[4]), &p[5..]),
    units: ("m", "N"),
};

/// The same, its ground moves.
pub(super) static CHAIN_ON_BASE: PlantKind = PlantKind {
    parameters: &[NODES_OF_CHAIN, MASS, SPRING, ZETA, PLACE, FROM, CUBIC, FRICTION, GAP, STOP, JOINT, SLIP],
    build: |p| structure(&chain(nodes(p[0]), [p[1], p[2]]), p[3], None, &p[4..]),
    units: ("m", "m"),
};

/// A cantilever, a force on one node.
pub(super) static BEAM: PlantKind = PlantKind {
    parameters: &[NODES_OF_BEAM, LENGTH, EI, MU, ZETA, AT, PLACE, FROM, CUBIC, FRICTION, GAP, STOP, JOINT, SLIP],
    build: |p| structure(&beam(nodes(p[0]), [p[1], p[2], p[3]]), p[4], Some(p[5]), &p[6..]),
    units: ("m", "N"),
};

/// The same, its clamp moves.
pub(super) static BEAM_ON_BASE: PlantKind = PlantKind {
    parameters: &[NODES_OF_BEAM, LENGTH, EI, MU, ZETA, PLACE, FROM, CUBIC, FRICTION, GAP, STOP, JOINT, SLIP],
    build: |p| structure(&beam(nodes(p[0]), [p[1], p[2], p[3]]), p[4], None, &p[5..]),
    units: ("m", "m"),
};

/// Masses of the adjustable rig's chain, and nodes of its beam.
pub(super) const ADJUSTABLE_MASSES: usize = 5;
pub(super) const ADJUSTABLE_NODES: usize = 6;

/// A chain of as many masses as the adjustable rig has.
pub(super) static FIVE_MASSES: PlantKind = PlantKind {
    parameters: &[MASS, SPRING, ZETA, AT, PLACE, FROM, CUBIC, FRICTION, GAP, STOP, JOINT, SLIP],
    build: |p| structure(&chain(ADJUSTABLE_MASSES, [p[0], p[1]]), p[2], Some(p[3]), &p[4..]),
    units: ("m", "N"),
};

/// A cantilever of as many nodes as the adjustable rig has.
pub(super) static SIX_NODES: PlantKind = PlantKind {
    parameters: &[LENGTH, EI, MU, ZETA, AT, PLACE, FROM, CUBIC, FRICTION, GAP, STOP, JOINT, SLIP],
    build: |p| structure(&beam(ADJUSTABLE_NODES, [p[0], p[1], p[2]]), p[3], Some(p[4]), &p[5..]),
    units: ("m", "N"),
};

const NODES_OF_CHAIN: PlantParameter = at_least(
    1.0,
    parameter("n", 5.0, "", "number of masses or of elements, at most 20; nodes are numbered from the ground"),
);
const NODES_OF_BEAM: PlantParameter = PlantParameter { value: 6.0, ..NODES_OF_CHAIN };
const MASS: PlantParameter = at_least(1e-9, parameter("m", 2.0, "kg", "each mass of the chain"));
const SPRING: PlantParameter = at_least(0.0, parameter("k", 4000.0, "N/m", "each spring of the chain"));
const LENGTH: PlantParameter = at_least(1e-6, parameter("length", 1.0, "m", "length of the beam"));
const EI: PlantParameter = at_least(1e-9, parameter("EI", 20.0, "N m^2", "bending stiffness of the beam"));
const MU: PlantParameter = at_least(1e-9, parameter("mu", 0.8, "kg/m", "mass of the beam over its length"));
const ZETA: PlantParameter = at_least(0.0, parameter("zeta", 0.01, "", "damping ratio of every mode"));
const AT: PlantParameter =
    at_least(1.0, parameter("at", 2.0, "", "the node that the force acts on; the last one where there are fewer"));
const PLACE: PlantParameter =
    at_least(1.0, parameter("place", 3.0, "", "the node of the force beside the linear structure"));
const FROM: PlantParameter = at_least(0.0, parameter("from", 0.0, "", "that force's other node; 0 is the ground"));
const CUBIC: PlantParameter = parameter("cubic", 0.0, "N/m^3", "cubic spring there");
const FRICTION: PlantParameter = at_least(0.0, parameter("friction", 0.0, "N", "dry friction there"));
const GAP: PlantParameter = at_least(0.0, parameter("gap", 1e-3, "m", "clearance to either side of the stops there"));
const STOP: PlantParameter = at_least(0.0, parameter("stop", 0.0, "N/m", "stiffness of these stops"));
const JOINT: PlantParameter =
    at_least(0.0, parameter("joint", 0.0, "N/m", "stiffness of a joint there, while it sticks"));
const SLIP: PlantParameter = at_least(0.0, parameter("slip", 0.0, "N", "force at which that joint slips (Bouc-Wen)"));

/// Masses and stiffness of the nodes' displacements, from the ground on.
struct Nodes {
    masses: DVector<f64>,
    stiffness: DMatrix<f64>,
}

/// A number of nodes, or of one of them, as it is told.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number, clamped")]
fn counted(value: f64, most: usize) -> usize {
    (value.clamp(0.0, 1e6).round() as usize).min(most)
}

fn nodes(value: f64) -> usize {
    counted(value, MOST_NODES).max(1)
}

/// Equal masses and springs, the last end free.
fn chain(n: usize, [mass, spring]: [f64; 2]) -> Nodes {
    let at = |i: usize, j: usize| match i.abs_diff(j) {
        0 if i + 1 == n => spring,
        0 => 2.0 * spring,
        1 => -spring,
        _ => 0.0,
    };
    Nodes { masses: DVector::from_element(n, mass), stiffness: DMatrix::from_fn(n, n, at) }
}

/// A cantilever of equal elements, clamped at one end.
fn beam(n: usize, [length, bending, mu]: [f64; 3]) -> Nodes {
    let l = length / n as f64;
    let element = [
        [12.0, 6.0 * l, -12.0, 6.0 * l],
        [6.0 * l, 4.0 * l * l, -6.0 * l, 2.0 * l * l],
        [-12.0, -6.0 * l, 12.0, -6.0 * l],
        [6.0 * l, 2.0 * l * l, -6.0 * l, 4.0 * l * l],
    ];
    // Displacements of all nodes first, then their rotations; those of the clamp are left out.
    let mut whole = DMatrix::<f64>::zeros(2 * n, 2 * n);
    for e in 0..n {
        let place = |k: usize| (e + k / 2).checked_sub(1).map(|node| node + n * (k % 2));
        for (i, row) in element.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                if let (Some(i), Some(j)) = (place(i), place(j)) {
                    whole[(i, j)] += value * bending / l.powi(3);
                }
            }
        }
    }
    let part = |from: usize, to: usize| whole.view((from * n, to * n), (n, n)).into_owned();
    // A clamped beam holds its rotations, so their stiffness has an inverse.
    let rotations = part(1, 1).cholesky().map_or_else(|| DMatrix::zeros(n, n), |factor| factor.solve(&part(1, 0)));
    let stiffness = part(0, 0) - part(0, 1) * rotations;
    let masses = DVector::from_fn(n, |i, _| if i + 1 == n { 0.5 * mu * l } else { mu * l });
    Nodes { masses, stiffness }
}

/// The plant of a structure; `forced` is the node that the force acts on, without it the ground moves. `force` are the
/// parameters from `place` on.
fn structure(nodes: &Nodes, zeta: f64, forced: Option<f64>, force: &[f64]) -> Plant {
    let n = nodes.masses.len();
    let root = nodes.masses.map(f64::sqrt);
    let scaled = DMatrix::from_fn(n, n, |i, j| nodes.stiffness[(i, j)] / (root[i] * root[j]));
    let eigen = SymmetricEigen::new(0.5 * (&scaled + scaled.transpose()));
    let rates = eigen.eigenvalues.map(|w| 2.0 * zeta * w.max(0.0).sqrt());
    let damping = &eigen.eigenvectors * DMatrix::from_diagonal(&rates) * eigen.eigenvectors.transpose();
    // Over the node's own mass.
    let stiffness = DMatrix::from_fn(n, n, |i, j| nodes.stiffness[(i, j)] / nodes.masses[i]);
    let damping = DMatrix::from_fn(n, n, |i, j| damping[(i, j)] * root[j] / root[i]);
    let mut terms: Vec<Vec<(Term, f64)>> = vec![Vec::new(); n];
    let term = |symbol: Symbol| Term::new(Expression::Symbol(symbol));
    let largest = |m: &DMatrix<f64>| ROUNDING * m.amax();
    for (matrix, symbol, input) in [
        (&stiffness, Symbol::State as fn(usize) -> Symbol, Symbol::Input(0)),
        (&damping, Symbol::Rate, Symbol::InputRate(0)),
    ] {
        let least = largest(matrix);
        for (i, terms) in terms.iter_mut().enumerate() {
            let of_nodes = (0..n).map(|j| (term(symbol(j)), -matrix[(i, j)]));
            let of_base = forced.is_none().then(|| (term(input), matrix.row(i).sum()));
            terms.extend(of_nodes.chain(of_base).filter(|(_, c)| c.abs() > least));
        }
    }
    if let Some(at) = forced {
        let at = counted(at, n).max(1) - 1;
        terms[at].push((term(Symbol::Input(0)), 1.0 / nodes.masses[at]));
    }
    let beside = Beside::new(force, n);
    let (contacts, joint) = beside.add(&nodes.masses, &mut terms);
    let smooth = Model::second_order(1, terms.into_iter().map(Equation::known).collect());
    Plant { smooth: if joint.is_empty() { smooth } else { smooth.with_internals(joint) }, contacts }
}

/// The force beside the linear structure.
struct Beside {
    place: usize,
    /// The other node; none is the ground.
    from: Option<usize>,
    cubic: f64,
    friction: f64,
    gap: f64,
    stop: f64,
    joint: f64,
    slip: f64,
}

impl Beside {
    fn new(parameters: &[f64], n: usize) -> Self {
        let at = |k: usize| parameters.get(k).copied().unwrap_or(0.0);
        let place = counted(at(0), n).max(1) - 1;
        let from = counted(at(1), n).checked_sub(1).filter(|from| *from != place);
        Self { place, from, cubic: at(2), friction: at(3), gap: at(4), stop: at(5), joint: at(6), slip: at(7) }
    }

    /// Adds its terms to the accelerations; contacts and the equation of the joint's inner state are handed back.
    fn add(&self, masses: &DVector<f64>, terms: &mut [Vec<(Term, f64)>]) -> (Vec<Contact>, Vec<Equation>) {
        let across = |symbol: fn(usize) -> Symbol| {
            let own = Expression::Symbol(symbol(self.place));
            match self.from {
                Some(from) => own - Expression::Symbol(symbol(from)),
                None => own,
            }
        };
        let (stretch, speed) = (across(Symbol::State), across(Symbol::Rate));
        let mut ends = vec![(self.place, 1.0 / masses[self.place])];
        ends.extend(self.from.map(|from| (from, -1.0 / masses[from])));
        let mut push = |force: Expression, size: f64| {
            for (node, share) in &ends {
                terms[*node].push((Term::new(force.clone()), -size * share));
            }
        };
        if self.cubic != 0.0 {
            push(stretch.clone().power(3.0), self.cubic);
        }
        if self.stop > 0.0 {
            push(stretch.dead_zone(self.gap), self.stop);
        }
        let mut joint = Vec::new();
        if self.joint > 0.0 && self.slip > 0.0 {
            // f = joint z, z′ = w − (|w| z + w |z|)/(2 d): stiff at first, and no more than the force at which it slips, joint d.
            let z = || Expression::Symbol(Symbol::Internal(0));
            let give = 0.5 * self.joint / self.slip;
            push(z(), self.joint);
            joint.push(Equation::known([
                (Term::new(speed.clone()), 1.0),
                (Term::new(speed.clone().abs() * z()), -give),
                (Term::new(speed.clone() * z().abs()), -give),
            ]));
        }
        let mut contacts = Vec::new();
        if self.friction > 0.0 {
            let acts_on = ends.iter().map(|(node, share)| (masses.len() + node, *share)).collect();
            let sliding = vec![(Term::new(Expression::Number(1.0)), self.friction)];
            contacts.push(Contact { velocity: Term::new(speed), acts_on, sliding, holding_ratio: 1.0 });
        }
        (contacts, joint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_values::model::modes;
    use std::f64::consts::{PI, TAU};

    fn built(kind: &PlantKind, changed: &[(&str, f64)]) -> Plant {
        let value = |p: &PlantParameter| changed.iter().find(|c| c.0 == p.name).map_or(p.value, |c| c.1);
        (kind.build)(&kind.parameters.iter().map(value).collect::<Vec<f64>>())
    }

    /// ωᵢ = 2 √(k/m) sin((2i − 1) π/(4n + 2)).
    #[test]
    fn a_chain_has_the_modes_of_the_textbook() {
        let found = modes(&built(&CHAIN, &[]).smooth, &[]);
        assert_eq!(found.len(), 5);
        for (i, mode) in found.iter().enumerate() {
            let omega = 2.0 * (4000.0_f64 / 2.0).sqrt() * ((2 * i + 1) as f64 * PI / 22.0).sin();
            assert!((mode.frequency * TAU / omega - 1.0).abs() < 1e-6, "{i}: {}", mode.frequency);
            assert!((mode.damping - 0.01).abs() < 1e-6, "{i}: {}", mode.damping);
        }
    }

    /// β l of a cantilever: 1.875, 4.694, 7.855.
    #[test]
    fn a_beam_of_many_elements_comes_near_to_the_continuous_one() {
        let found = modes(&built(&BEAM, &[("n", 20.0)]).smooth, &[]);
        for (mode, root) in found.iter().zip([1.875_104_f64, 4.694_091, 7.854_757]) {
            let frequency = root * root * (20.0_f64 / 0.8).sqrt() / TAU;
            assert!((mode.frequency / frequency - 1.0).abs() < 0.01, "{} {frequency}", mode.frequency);
        }
    }

    /// A slow motion of the base takes the whole structure along.
    #[test]
    fn a_base_that_stands_still_anywhere_leaves_the_structure_at_rest() {
        for kind in [&CHAIN_ON_BASE, &BEAM_ON_BASE] {
            let model = built(kind, &[]).smooth;
            let n = model.layout.freedoms;
            for equation in &model.equations[n..] {
                let value =
                    |symbol: Symbol| if matches!(symbol, Symbol::State(_) | Symbol::Input(_)) { 1.0 } else { 0.0 };
                let parts = equation.terms.iter().map(|t| t.coefficient * t.term.expression().value(&value));
                let parts: Vec<f64> = parts.collect();
                let size = parts.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
                assert!(parts.iter().sum::<f64>().abs() < 1e-9 * size, "{parts:?}");
            }
        }
    }

    #[test]
    fn a_force_between_two_nodes_pushes_both() {
        let plant = built(&CHAIN, &[("place", 4.0), ("from", 2.0), ("friction", 3.0), ("joint", 50.0), ("slip", 1.0)]);
        assert_eq!(plant.contacts[0].acts_on, [(5 + 3, 0.5), (5 + 1, -0.5)]);
        assert_eq!(plant.smooth.layout.internals, 1);
        let pulls = |i: usize| {
            let terms = &plant.smooth.equations[5 + i].terms;
            terms.iter().filter(|t| t.term.symbols().contains(&Symbol::Internal(0))).map(|t| t.coefficient).sum::<f64>()
        };
        assert_eq!([0, 1, 2, 3, 4].map(pulls), [0.0, 25.0, 0.0, -25.0, 0.0]);
    }
}
