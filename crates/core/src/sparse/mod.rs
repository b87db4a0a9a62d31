//! Sparse regression on reduced columns; knows numbers, not what a column means.

mod basis;
mod bayes;
mod best_subset;
mod bounded;
mod candidate_models;
mod frols;
mod orthogonal;
mod reduce;
mod redundancy;
mod regressor;
mod sr3;
mod ssr;
mod stlsq;
mod uncertainty;
mod writing;

pub use basis::{LocalColumn, OrthonormalBasis, Stretch};
pub use bounded::{BoundedSolution, Bounds, bounded_least_squares};
pub(crate) use reduce::Unexplained;
pub use reduce::{Reduced, Sign};
pub(crate) use redundancy::Redundancy;
pub use regressor::Regressor;
pub use regressor::between;
pub(crate) use regressor::drop_path;
pub use stlsq::{Constraint, Solution, SparseOptions, stlsq};
pub(crate) use uncertainty::Scores;
