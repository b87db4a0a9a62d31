//! Every number that the search decides or budgets by: its value, its unit, and what sets it.

// --- what is told from what

/// Standard errors (inflated by the residual's correlation) that each amplitude of a set lies from zero at least.
pub(super) const BORNE: f64 = 3.0;
/// Log density by which a set beats another at least. In the simulation study that chose it, values from 0 to 8 differ by two
/// verdicts of 174.
pub const LEAD: f64 = 5.0;
/// Quantile of the resampled lead that must be positive: two standard deviations of a normal law.
pub(super) const QUANTILE: f64 = 0.023;
/// Resampled sums of the blocks that the quantile is taken from.
pub(super) const RESAMPLED: usize = 400;
/// Degrees of freedom of Student's density: no single block may own the sum.
pub(super) const STUDENT: f64 = 5.0;
/// Times the scale of its fitted blocks from which a set's error on an unseen one is its own scale there: a ratio that right
/// names reach in 3 of 164 draws.
pub(super) const SURPRISED: f64 = 1.5;
/// Where nothing explains the data, times that a set must err less on unseen samples than another to beat it.
pub(super) const FAR: f64 = 1.5;
/// Length of a block that a set predicts, main periods.
pub const BLOCK: usize = 4;
/// Blocks that unseen data are cut into at least: of one, nothing is resampled.
pub const LEAST_BLOCKS: f64 = 4.0;
/// Noises (RMS of the fitted records' residual over the sensor's) from which what is left matters.
pub(super) const MATTERS_NOISES: f64 = 1.2;
/// Share of what was found (RMS, noise taken off) from which what is left matters.
pub(super) const MATTERS_SHARE: f64 = 0.1;

// --- proposing

/// Half width of a test function, main periods.
pub(super) const HALF_WIDTH: f64 = 0.35;
/// Half widths beside sticks, which are shorter than a wide test function.
pub(super) const NARROW_WIDTHS: [f64; 2] = [0.11, 0.2];
/// Rows of all records together at most.
pub(super) const MOST_ROWS: usize = 4000;
/// Blocks of rows that are left out in turn, about.
pub(super) const LEFT_OUT_BLOCKS: usize = 10;
/// Least length of such a block, main periods.
pub(super) const LEFT_OUT_PERIODS: f64 = 3.0;
/// Least length of a spell of rest, main periods: a smooth motion is as slow for a quarter of it.
pub(super) const STICK_SPELL: f64 = 0.08;
/// Least length of a spell on a surface that moves, main periods: near its greatest speed a smooth motion stays longer.
pub(super) const BELT_SPELL: f64 = 0.2;
/// A gap within a spell of rest, main periods: shorter ones are noise of the velocity.
pub(super) const STICK_GAP: f64 = 0.04;
/// What is left out on either side of a spell, main periods: there the mass is just caught or let go.
pub(super) const STICK_MARGIN: f64 = 0.03;
/// Grid points of a form that enter pairs.
pub(super) const KEPT_POINTS: usize = 6;
/// The same beside a constant force, which moves the place of a contact.
pub(super) const KEPT_PRELOADED: usize = 2;
/// Pairs that are tried with a third effect.
pub(super) const BEAM: usize = 20;
/// Sets of each size about which the grid is made finer.
pub(super) const ZOOMED: usize = 8;
/// Rounds of a finer grid about what the best sets hold.
pub(super) const ZOOMS: usize = 2;
/// Share of the gain of the best set that it contains which a set must bring besides, to be proposed before it.
pub(super) const CRUMB: f64 = 0.2;
/// A damper may push by this much, in natural frequencies, beside a force that remembers.
pub(super) const PUSHING: f64 = 0.02;
/// Sets of one, two and three effects that are proposed at most.
pub(super) const QUOTAS: [usize; 3] = [6, 4, 2];
/// Sets of effects that are met most often which are proposed of each size, at most: the best, and what the regression cannot
/// tell from it.
pub(super) const LIKE: usize = 2;

/// Share of a frequency within which another is the same in a motion whose frequency changes with its amplitude.
pub(super) const LOCKED: f64 = 0.2;

// --- fitting

/// Times the noise that a set which explains the data leaves at most, on the data fitted and on those never fitted.
pub(super) const EXPLAINS: (f64, f64) = (1.06, 1.12);
/// Where a set explains the data, others are fitted if their gain in the regression falls short by this share of its own at
/// most.
pub(super) const CLOSE_GAIN: f64 = 0.05;
/// Single effects that are fitted in any case, to be shown beside the one that explains the data.
pub(super) const SHOWN: usize = 2;
/// A fit that leaves so many times the least sum of squares has lost: its damper's sign is not asked for.
pub(super) const HOPELESS: f64 = 4.0;
/// The parts of so many of the best sets are fitted.
pub(super) const CLOSED: usize = 2;
/// So many rivals are fitted once more from where the best set landed.
pub(super) const SETTLED: usize = 3;
/// Times the best set's sum of squares from which a rival is too far behind for that.
pub(super) const FAR_BEHIND: f64 = 9.0;
