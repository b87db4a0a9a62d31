//! What the equations of hidden effects are written in; plants are of first order, so velocities are states.

use sindyscope_values::term::{Expression, Symbol};

/// Displacement of the mass.
pub(super) fn x() -> Expression {
    state(0)
}

/// Velocity of the mass.
pub(super) fn v() -> Expression {
    state(1)
}

/// A state of the first-order system.
pub(super) fn state(index: usize) -> Expression {
    Symbol::State(index).into()
}

/// An input.
pub(super) fn u(index: usize) -> Expression {
    Symbol::Input(index).into()
}

/// An input's first time derivative.
pub(super) fn du(index: usize) -> Expression {
    Symbol::InputRate(index).into()
}

/// Time.
pub(super) fn t() -> Expression {
    Symbol::Time.into()
}
