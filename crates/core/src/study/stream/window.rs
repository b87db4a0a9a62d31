//! The blocks of the last seconds, and what they say together.

use std::collections::VecDeque;

use nalgebra::DMatrix;

use crate::sparse::Unexplained;
use crate::study::Settings;
use crate::study::regression::Regression;
use sindyscope_values::model::Model;

/// Rows of a stream, reduced.
#[derive(Debug)]
pub(super) struct StreamBlock {
    /// Time of its last row, s.
    pub(super) time: f64,
    /// How much of the stream it covers, s.
    pub(super) seconds: f64,
    /// Whether it is as long as others, so that their spread is its own.
    pub(super) judged: bool,
    /// Whether it came while an alarm stood, or alarmed with the next one: it is no example of what is usual.
    pub(super) alarmed: bool,
    pub(super) regression: Regression,
    /// The same rows with soft edges.
    pub(super) tapered: Regression,
    /// What the measurement's noise, of unit deviation, makes of a residual's part along each term: `[equation][term]`.
    pub(super) spreads: Vec<Vec<f64>>,
}

/// What coefficients leave of a block's rate.
#[derive(Clone, Debug)]
pub(super) struct BlockLeft {
    /// Its size, and with soft edges, its direction.
    pub(super) unexplained: Unexplained,
    /// What noise makes of its part along each term: a block of short stretches has more.
    spreads: Vec<f64>,
}

impl BlockLeft {
    /// Its part along a term, by which blocks compare whatever their stretches are.
    pub(super) fn along(&self, term: usize) -> f64 {
        self.unexplained.along[term] / self.spreads[term]
    }
}

impl StreamBlock {
    /// What coefficients leave of its rates: the size of it, and with soft edges, in which direction.
    pub(super) fn left_by(&self, coefficients: &[Vec<f64>]) -> Vec<BlockLeft> {
        let sizes = self.regression.left_by(coefficients);
        let soft = self.tapered.left_by(coefficients);
        let both = sizes.into_iter().zip(soft).map(|(size, soft)| Unexplained { rms: size.rms, ..soft });
        both.zip(&self.spreads).map(|(unexplained, s)| BlockLeft { unexplained, spreads: s.clone() }).collect()
    }
}

/// The blocks of the last seconds, the oldest first.
#[derive(Debug)]
pub(super) struct Window {
    blocks: VecDeque<StreamBlock>,
    /// What is kept, s.
    length: f64,
    /// Blocks that are kept, at most.
    most: usize,
}

/// Blocks to each whole one that is kept, at most: gaps may cut them short.
const MAX_PIECES: usize = 4;
/// Fewest blocks whose spread tells how uncertain a coefficient is.
const MIN_SCATTER: usize = 4;

impl Window {
    /// A window of so many blocks of a length, s.
    pub(super) fn new(kept: usize, seconds: f64) -> Self {
        Self { blocks: VecDeque::new(), length: kept as f64 * seconds, most: MAX_PIECES * kept }
    }

    /// Takes a block in, and lets those go that are older than what is kept.
    pub(super) fn push(&mut self, block: StreamBlock) {
        self.blocks.push_back(block);
        let rounding = 1e-9 * self.length;
        while self.blocks.len() > 1 && (self.seconds() > self.length + rounding || self.blocks.len() > self.most) {
            self.blocks.pop_front();
        }
    }

    /// The blocks, the oldest first.
    pub(super) fn blocks(&self) -> impl Iterator<Item = &StreamBlock> {
        self.blocks.iter()
    }

    /// Every block is an example of what is usual again.
    pub(super) fn mark_usual(&mut self) {
        self.blocks.iter_mut().for_each(|b| b.alarmed = false);
    }

    /// How much of the stream the blocks cover, s.
    pub(super) fn seconds(&self) -> f64 {
        self.blocks.iter().map(|b| b.seconds).sum()
    }

    /// The equations of all blocks together. Standard errors come from how the scores of blocks, with soft edges, scatter
    /// (Welch's estimate of their spectrum at zero, between the bread of the sandwich estimator): serial correlation within
    /// blocks does not deceive them. None of few blocks.
    pub(super) fn identify(&self, settings: &Settings) -> StreamFit {
        let blocks: Vec<&StreamBlock> = self.blocks.iter().collect();
        StreamFit::new(&blocks, settings)
    }
}

/// What blocks say together.
#[derive(Debug)]
pub(super) struct StreamFit {
    pub(super) model: Model,
    /// What each block leaves under the model of all the others; none of few blocks.
    pub(super) left: Vec<Vec<BlockLeft>>,
}

/// Σ w² over the rows, as a share of their number, of Hann's weights: a sum of uncorrelated scores has so much less variance.
const HANN_POWER: f64 = 3.0 / 8.0;

impl StreamFit {
    pub(super) fn new(blocks: &[&StreamBlock], settings: &Settings) -> Self {
        let parts: Vec<&Regression> = blocks.iter().map(|b| &b.regression).collect();
        let joined = Regression::joined(&parts);
        let mut model = joined.model(settings);
        if blocks.len() < MIN_SCATTER {
            return Self { model, left: Vec::new() };
        }
        let states: Vec<usize> = joined.fitted().collect();
        let of_others = |rest: &Regression| {
            let mut others = model.clone();
            for (state, fitted) in states.iter().zip(rest.refitted(&model, settings)) {
                let terms = &mut others.equations[*state].terms;
                terms.iter_mut().zip(fitted).for_each(|(term, c)| term.coefficient = c);
            }
            rest.coefficients_of(&others)
        };
        let rests = leave_one_out(&parts);
        let left: Vec<Vec<BlockLeft>> =
            rests.iter().zip(blocks).map(|(rest, block)| block.left_by(&of_others(rest))).collect();
        let coefficients = joined.coefficients_of(&model);
        let own: Vec<Vec<Unexplained>> = blocks.iter().map(|b| b.tapered.left_by(&coefficients)).collect();
        for (e, state) in states.iter().enumerate() {
            // What was given has no error, and the bread of the others does not know it.
            let fitted: Vec<usize> = joined.fitted_columns(e, &model, settings);
            let Some(bread) = joined.inverse_gram(e, &fitted) else { continue };
            // A fit draws its own residuals to nothing, one without the block leaves too much: the mean of both.
            let score = |block: usize, k: usize| 0.5 * (own[block][e].score(k) + left[block][e].unexplained.score(k));
            let scores = DMatrix::from_fn(fitted.len(), blocks.len(), |i, b| score(b, fitted[i]));
            let covariance = &bread * (&scores * scores.transpose() / HANN_POWER) * &bread;
            for term in &mut model.equations[*state].terms {
                let place = fitted.iter().position(|k| *joined.term(*k) == term.term);
                let error = place.map(|i| covariance[(i, i)].sqrt());
                term.std_error = error.filter(|e| e.is_finite() && *e > 0.0);
            }
        }
        Self { model, left }
    }
}

/// For each part, all others together; none of a single part.
pub(super) fn leave_one_out(parts: &[&Regression]) -> Vec<Regression> {
    let n = parts.len();
    if n < 2 {
        return Vec::new();
    }
    let add = |sum: Option<&Regression>, part: &Regression| {
        let both: Vec<&Regression> = sum.into_iter().chain([part]).collect();
        Regression::joined(&both)
    };
    // All parts before the first k, and all behind the last k.
    let (mut before, mut behind): (Vec<Regression>, Vec<Regression>) = (Vec::new(), Vec::new());
    for k in 0..n - 1 {
        before.push(add(before.last(), parts[k]));
        behind.push(add(behind.last(), parts[n - 1 - k]));
    }
    let rest = |k: usize| {
        let before = k.checked_sub(1).map(|k| &before[k]);
        let behind = (n - 1 - k).checked_sub(1).map(|k| &behind[k]);
        let both: Vec<&Regression> = before.into_iter().chain(behind).collect();
        Regression::joined(&both)
    };
    (0..n).map(rest).collect()
}
