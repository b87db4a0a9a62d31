//! The values that every part of Sindyscope speaks.
//!
//! - [`term`]: candidate terms of an equation of motion, from text and to text, LaTeX and Python, and compiled for speed.
//! - [`model`]: equations of motion, terms with coefficients; explicit accelerations, units, masses, modes.
//! - [`record`]: measured samples with their roles and units, and quantities estimated from others.
//! - [`mod@format`]: numbers, units and equations as a person reads them.
//!
//! Nothing here reads files, knows the time or starts threads. A term is written as it is printed; an equation is a sum of
//! weighted terms:
//!
//! ```
//! use sindyscope_values::format::equations;
//! use sindyscope_values::model::{Equation, Model};
//! use sindyscope_values::term::Term;
//!
//! // A mass on a spring with dry friction, driven by a force.
//! let acceleration = Equation::known([
//!     (Term::parse("x")?, -4.0),
//!     (Term::parse("sgn(v)")?, -0.3),
//!     (Term::parse("u")?, 1.0),
//! ]);
//! let model = Model::second_order(1, vec![acceleration]);
//! let text = "dx/dt = v\ndv/dt =\n  -4    x\n  -0.3  sgn(v)\n   1    u\n";
//! assert_eq!(equations::text(&model, None), text);
//! assert_eq!(model.equations[1].terms[1].term.python(&model.layout), "np.sign(v)");
//! # Ok::<(), sindyscope_values::term::TermError>(())
//! ```

#![deny(missing_docs)]

pub mod format;
pub mod model;
pub mod record;
pub mod term;
