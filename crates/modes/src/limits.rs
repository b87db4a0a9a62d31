//! Every constant that decides something about structures, with its unit and the reason for its value.
//!
//! *Levels* decide what is named, *budgets* bound the time, *tolerances* are numerical. Comparisons of models on data never
//! fitted use the one rule of the search for missing effects (`sindyscope_search`), which has its own levels.

use std::ops::RangeInclusive;

// Levels.

/// Least gain of a further mode: share of the error on data never fitted, beside the lead that every name needs. Below
/// it a mode is lost in the scatter of the estimate of that error.
pub(crate) const MODE_GAIN: f64 = 0.01;
/// Error, as a share of the sensors' RMS, that is no noise's but the model's own: its shapes are real, which they are not quite where
/// damping is not in proportion to mass and stiffness. What is left below it asks for no further mode and for no force.
pub(crate) const LEAST_ERROR: f64 = 5e-3;
/// Error of a force, in noises, up to which it explains the data: no further start, and no rival far behind, is tried.
pub(crate) const EXPLAINS: f64 = 1.12;
/// Error of a named force at most, as a share of the linear model's.
pub(crate) const FORCE_GAIN: f64 = 0.97;
/// RMS of the free oscillations, as a share of the sensor's, up to which a record starts at rest.
pub(crate) const AT_REST: f64 = 0.05;
/// Distance beyond the driven band, as a share of the frequency, within which a mode counts as inside: half a bandwidth
/// of a mode damped by five per cent.
pub(crate) const BAND_MARGIN: f64 = 0.05;
/// Shares of an input's power below the lower and the upper end of the band that it drives.
pub(crate) const DRIVEN: (f64, f64) = (0.003, 0.99);
/// Share of a single record that is held out where nothing else is.
pub(crate) const HELD_OUT: f64 = 0.3;

// Poles.

/// Thinning (samples) and block rows (samples) at which poles are looked for: slow and fast modes need different rates.
pub(crate) const POLE_RATES: [(usize, usize); 3] = [(1, 60), (3, 40), (12, 30)];
/// The same along a candidate force, where the linear model's poles are known.
pub(crate) const FORCE_POLE_RATES: [(usize, usize); 1] = [(3, 40)];
/// Orders of the state space, states.
pub(crate) const ORDERS: RangeInclusive<usize> = 4..=24;
/// Damping ratios between which a pole is a structure's: noise lets a weakly damped one look unstable.
pub(crate) const POOL_DAMPING: (f64, f64) = (-0.05, 0.3);
/// Damping ratio of a pole that looks less damped than this.
pub(crate) const LEAST_DAMPING: f64 = 1e-3;
/// Highest frequency of a pole, as a share of the Nyquist frequency: beyond, the low-pass of thinned series acts.
pub(crate) const HIGHEST: f64 = 0.85;
/// Logarithms of frequency and damping within which two poles of the pool are one.
pub(crate) const POOL_DISTANCE: (f64, f64) = (0.006, 0.5);
/// Logarithm of the frequency within which a further pole is one that is chosen already, at first.
pub(crate) const SAME_POLE: f64 = 0.015;
/// The same along a force that does not explain the data yet.
pub(crate) const APART: f64 = 0.1;
/// Largest number of modes that the data may choose.
pub(crate) const MOST_MODES: usize = 14;
/// Numbers of modes that are tried without a better one before the choice ends.
pub(crate) const PATIENCE: usize = 2;
/// Refinement steps after each further pole, and for the last set.
pub(crate) const POLE_STEPS: usize = 5;
pub(crate) const LAST_POLE_STEPS: usize = 15;

// The stabilization diagram.

/// Orders of its state spaces, states.
pub(crate) const DIAGRAM_ORDERS: RangeInclusive<usize> = 4..=40;
/// Differences from a pole of the order below up to which a pole is stable: share of the frequency, share of the damping
/// ratio, and one minus the modal assurance criterion (B. Peeters, G. De Roeck, Mech. Syst. Signal Process. 13 (1999) 855).
pub(crate) const STABLE_FREQUENCY: f64 = 0.01;
pub(crate) const STABLE_DAMPING: f64 = 0.05;
pub(crate) const STABLE_SHAPE: f64 = 0.02;
/// Modal phase collinearity below which, and mean phase deviation (rad) from which on, a pole counts as spurious: shapes of
/// lightly damped structures are nearly real (E. Reynders, J. Houbrechts, G. De Roeck, Mech. Syst. Signal Process. 29 (2012) 228).
pub(crate) const SPURIOUS_COLLINEARITY: f64 = 0.5;
pub(crate) const SPURIOUS_DEVIATION: f64 = 0.35;
/// Damping ratio of a pole above which it is no oscillation of a structure.
pub(crate) const SPURIOUS_DAMPING: f64 = 0.2;
/// Mean distance up to which stable poles are one cluster: logarithm of the frequencies' ratio, plus one minus the assurance.
pub(crate) const CLUSTER_DISTANCE: f64 = 0.05;
/// Fewest poles of a cluster: what stays for fewer orders is chance.
pub(crate) const CLUSTER_ORDERS: usize = 5;
/// Most poles that are clustered together; a distance is kept for each pair.
pub(crate) const MOST_CLUSTERED: usize = 400;
/// Logarithm of the frequency within which poles of the diagram stand for a mode, and their least modal assurance with it.
pub(crate) const OF_MODE: f64 = 0.02;
pub(crate) const OF_MODE_ASSURANCE: f64 = 0.7;
/// Segments, overlapping by half, that a spectrum averages over at least, and most samples of one.
pub(crate) const SPECTRUM_SEGMENTS: usize = 4;
pub(crate) const SPECTRUM_SAMPLES: usize = 4096;

// Screening of forces.

/// Gaps, as shares of the largest displacement, and how often the best one of a place is sought between its neighbours.
pub(crate) const GAPS: [f64; 6] = [0.15, 0.25, 0.35, 0.45, 0.55, 0.65];
pub(crate) const GAP_STEPS: usize = 2;
/// Displacements at which a joint yields, as shares of the displacement's deviation, and the ratio γ/β of its loops' shape: the
/// closed loop reaches what lies between.
pub(crate) const YIELDS: [f64; 4] = [0.1, 0.25, 0.6, 1.5];
pub(crate) const YIELD_RATIO: f64 = 0.7;
/// Least and largest ratio: below minus one a joint never yields.
pub(crate) const RATIOS: (f64, f64) = (-0.95, 6.0);
/// Displacement, as a share of the displacement's deviation, below which a joint that yields is dry friction: what the
/// catalogue of effects has as the least.
pub(crate) const LEAST_YIELD: f64 = 0.04;
/// The same above which it does not yield.
pub(crate) const MOST_YIELD: f64 = 10.0;
/// Velocity within which friction changes its sign, as a share of the velocity's deviation, and what is left of it in the
/// closed loop: a measured velocity crosses zero at the wrong instant.
pub(crate) const SMOOTHING: f64 = 0.05;
pub(crate) const SHARPER: f64 = 0.4;
/// The same that a closed loop may find at most: above, it is a damper.
pub(crate) const MOST_SMOOTHING: f64 = 0.2;
/// Corners of the high-pass behind an integration, as shares of the lowest frequency: the lower one keeps the motion, the
/// higher one keeps the drift out. Both are tried.
pub(crate) const CORNERS: [f64; 2] = [0.25, 0.8];
/// End of the band of a motion, as a multiple of the highest frequency.
pub(crate) const BAND_END: f64 = 1.3;
/// Fewest modes of a screened force, and most modes of those that follow.
pub(crate) const SCREENED_MODES: (usize, usize) = (6, 8);
/// Refinement steps of a screened force.
pub(crate) const SCREEN_STEPS: usize = 2;
/// Most pairs of sensors between which a force is looked for.
pub(crate) const MOST_PAIRS: usize = 10;
/// Candidates within this factor of the best error go to the closed loop; of each effect the best place within the second.
pub(crate) const NEAR: f64 = 1.25;
pub(crate) const NEAR_OTHER_EFFECT: f64 = 2.0;
/// Most candidates that go to the closed loop, of each kind of place.
pub(crate) const MOST_CANDIDATES: usize = 5;
/// Most of those that go there where none of these explains the data.
pub(crate) const MOST_OTHERS: usize = 5;
/// Most of those of each kind of place that are fitted although short stretches leave more than noise.
pub(crate) const MOST_PUT_OFF: usize = 5;
/// Most candidates that are fitted again with more modes where none came near the data.
pub(crate) const MOST_AGAIN: usize = 3;
/// Candidates that are fitted at the same time once the first one did not explain the data: none knows what the other comes to, however
/// many cores there are.
pub(crate) const SIDE_BY_SIDE: usize = 2;
/// Refinement steps of a rival's poles beside one that explains the data.
pub(crate) const RIVAL_STEPS: usize = 5;
/// Most joints that slip that go to the closed loop, of each kind of place.
pub(crate) const MOST_JOINTS: usize = 2;
/// Factor from the best error within which the smallest number of modes counts along a measured force: further modes stand
/// for that force's error.
pub(crate) const ROUGH: f64 = 1.2;
/// Factor from a linear mode's frequency within which another one takes over what a mode that is left out moved.
pub(crate) const TAKES_OVER: f64 = 1.1;
/// Modes that are left out of a closed loop in turn before it is said to need all: those without which least is left.
pub(crate) const LEFT_OUT: usize = 2;
/// Steps of the fit that says how much is left without a mode.
pub(crate) const LEFT_OUT_STEPS: usize = 2;

// The closed loop.

/// Measured values for each unknown of a stretch's initial state, and its fewest samples. Short stretches cannot run away:
/// their sum of squares has one minimum where that of a whole record has many.
pub(crate) const STRETCH: f64 = 4.0;
pub(crate) const LEAST_STRETCH: f64 = 16.0;
/// What a jump between stretches counts for, in turn: RMS of a sensor for a jump as large as the state. At the last one a
/// jump of a thousandth counts as a quarter of the sensor's RMS.
pub(crate) const HOLDS: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];
/// Holds after which a start that has come to the error of the one before, within this share, is given up.
pub(crate) const SAME_HOLDS: usize = 3;
pub(crate) const SAME_WAY: f64 = 2e-3;
/// Times the error over stretches that are hardly held together from which a start is given up once they are held closer: where the force
/// is right, these errors differ by less than a half, where it is wrong and they grow, by six to a hundred.
pub(crate) const OF_SHORT: f64 = 4.0;
/// Times the error over the first stretches from which a start is given up that leaves so much of all, held as closely.
pub(crate) const OF_FIRST: f64 = 2.0;
/// Error over stretches that are hardly held together, in noises, up to which no mode is missing, and how many more are tried.
pub(crate) const MODES_MISSING: f64 = 1.3;
pub(crate) const MORE_MODES: usize = 3;
/// Steps with each hold, and the share of the sum of squares that a step must gain for another to follow.
pub(crate) const HELD_STEPS: usize = 15;
pub(crate) const HELD_GAIN: f64 = 3e-3;
/// Samples of all records together that are fitted in stretches: enough for the parameters to be known to a thousandth.
pub(crate) const HELD_SAMPLES: f64 = 12_000.0;
/// The same of samples times sensors.
pub(crate) const HELD_VALUES: f64 = 24_000.0;
/// Share of these with which a fit begins: enough to tell within the first [`SAME_HOLDS`] whether it comes near.
pub(crate) const FIRST_SHARE: f64 = 1.0 / 3.0;
/// Steps of the fit of single initial states, and of whole records.
pub(crate) const STATE_STEPS: usize = 6;
pub(crate) const WHOLE_STEPS: usize = 10;
/// How often the steps of the integration may be halved, and the change of the response, in noises, from which half a step matters.
pub(crate) const MOST_HALVINGS: u32 = 2;
pub(crate) const STEP_MATTERS: f64 = 0.3;
/// Share of a record from which its initial state is fitted first.
pub(crate) const BEGINNING: f64 = 0.15;
/// Error over whole records, as a multiple of that over stretches: below the first they are tried, below the second kept.
pub(crate) const FOLLOWED: f64 = 2.0;
pub(crate) const KEPT: f64 = 1.2;
/// A start is given up where its error exceeds so many noises and so many times that of the best so far.
pub(crate) const BEHIND_NOISES: f64 = 1.5;
pub(crate) const BEHIND: f64 = 1.2;
/// Error, in noises, up to which a force is so close to the data that further modes are judged by data never fitted; above, they stand for
/// what it lacks.
pub(crate) const CLOSE_NOISES: f64 = 2.0;
/// Error, in noises, up to which a force is near the data: what follows starts from its modes.
pub(crate) const NEAR_NOISES: f64 = 3.0;
/// Mean square, as a multiple of the middle one, from which a stretch's state is sought from the end of the one before.
pub(crate) const STRAY_STRETCH: f64 = 4.0;
/// Difference of the logarithm of the force's size from which a second start is another one.
pub(crate) const OTHER_START: f64 = 0.02;
/// What is left of a coupling by which a force would push a mode the wrong way, at the first and the second start.
pub(crate) const WRONG_COUPLING: [f64; 2] = [0.5, 0.1];
/// Rounds of closed loop and further modes; error in noises at which only a further mode asks for another, and the share
/// of the error before that a round must reach for another, far from the noise and near to it.
pub(crate) const ROUNDS: usize = 3;
pub(crate) const ENOUGH: f64 = 1.03;
pub(crate) const ROUND_GAIN: f64 = 0.8;
pub(crate) const LAST_GAIN: f64 = 0.97;
/// Size of an error, as a multiple of its sensor's RMS, from which a response has run away.
pub(crate) const RUNAWAY: f64 = 1e3;

// Numerics.

/// Rows that the choice of a further pole looks at, and the fit of a screened force, about.
pub(crate) const CHOICE_ROWS: usize = 6000;
pub(crate) const SCREEN_ROWS: usize = 5000;
/// The same of rows times sensors.
pub(crate) const SCREEN_VALUES: usize = 10_000;
/// Relative steps of frequency and damping for derivatives by differences.
pub(crate) const DIFFERENCES: [f64; 2] = [1e-5, 1e-3];
/// Largest change of a pole's logarithms in one step of the linear fit.
pub(crate) const MAX_POLE_CHANGE: f64 = 0.3;
/// The same of frequency, damping and gap in the closed loop.
pub(crate) const MAX_CHANGE: [f64; 3] = [0.1, 0.4, 0.2];
/// Share of the sum of squares that a step of the linear fit must gain for another to follow.
pub(crate) const POLE_GAIN: f64 = 1e-5;
/// Added to the diagonal of a scaled Gram matrix: of a fit's columns, and of those that a further pole adds to them.
pub(crate) const RIDGE: f64 = 1e-10;
pub(crate) const POOL_RIDGE: f64 = 1e-7;
/// The same of the scaled normal equations of the closed loop.
pub(crate) const LOOP_RIDGE: f64 = 1e-12;
/// The same of the Hankel matrices' Gram matrix, as a share of its mean diagonal.
pub(crate) const HANKEL_RIDGE: f64 = 1e-11;
/// Most rows of that matrix.
pub(crate) const MOST_HANKEL_ROWS: usize = 600;
/// Steps of inverse iteration towards an eigenvector: with the eigenvalue known, two are enough.
pub(crate) const INVERSE_ITERATIONS: usize = 3;
/// Most iterations of the search for eigenvalues, and for the force at a step's end.
pub(crate) const EIGENVALUE_ITERATIONS: usize = 10_000;
pub(crate) const FORCE_ITERATIONS: usize = 40;
/// Error of the force at a step's end, as a share of the force and its unit.
pub(crate) const FORCE_TOLERANCE: f64 = 1e-10;
/// Rows of the Jacobian that are added to the normal equations at once.
pub(crate) const CHUNK: usize = 256;
