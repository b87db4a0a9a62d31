//! Sparse regression on reduced columns; knows numbers, not what a column means.

mod reduce;
mod stlsq;
mod uncertainty;

pub use reduce::{Reduced, Sign};
pub use stlsq::{Constraint, Options, Solution, drop_path, solution_path, stlsq};
pub use uncertainty::clustered_covariance;
