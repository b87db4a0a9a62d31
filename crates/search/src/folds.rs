//! What judges a fit to the rest of the data where no record is held out.

use super::data::Data;
use sindyscope_core::refine::Run;

/// Parts of a single record that judge a fit to the rest, as shares of its length: in a decay or a sweep its beginning, its
/// middle and its end each tell what the others cannot.
const LEFT_OUT: [(f64, f64); 2] = [(0.2, 0.35), (0.65, 0.8)];
/// The part of a record that is too short for those: its end judges.
const LEFT_OUT_AT_END: [(f64, f64); 1] = [(0.7, 1.0)];

/// Parts of each of several records, which judge one after the other. One record often goes beyond the others, and a fit to these
/// cannot foresee what begins there: each fit has two thirds of every record.
const THIRDS: [(f64, f64); 3] = [(0.0, 1.0 / 3.0), (1.0 / 3.0, 2.0 / 3.0), (2.0 / 3.0, 1.0)];

/// What judges a fit to the rest of the data where no record is held out.
pub(super) enum LeftOut {
    /// These parts of the only record, as shares of its length.
    Parts(&'static [(f64, f64)]),
    /// A third of each record in turn.
    Thirds,
    /// Records in turn, which are too short to be parted.
    Records,
}

impl Data {
    /// What judges where no record is held out.
    pub(super) fn left_out(&self) -> LeftOut {
        let least = self.constants.left_out_periods * self.period;
        let longer =
            |(from, to): &(f64, f64)| self.fit().iter().all(|s| (to - from) * s.len() as f64 * s.interval >= least);
        match self.fit() {
            [_] if LEFT_OUT.iter().all(longer) => LeftOut::Parts(&LEFT_OUT),
            [_] => LeftOut::Parts(&LEFT_OUT_AT_END),
            _ if THIRDS.iter().all(longer) => LeftOut::Thirds,
            _ => LeftOut::Records,
        }
    }

    /// The records (or parts of them) that are fitted and those that judge, one pair a fold.
    pub(super) fn folds(&self) -> Vec<(Vec<Run>, Vec<Run>)> {
        let fit = self.whole();
        if !self.held_out().is_empty() {
            return Vec::new();
        }
        match self.left_out() {
            LeftOut::Parts(parts) => vec![parted(&fit, |_| parts)],
            LeftOut::Thirds => {
                let third = |fold: usize, record: usize| &THIRDS[(record + fold) % THIRDS.len()];
                (0..THIRDS.len()).map(|g| parted(&fit, |record| std::slice::from_ref(third(g, record)))).collect()
            }
            LeftOut::Records => {
                let groups = fit.len().min(4);
                let numbered = |list: Vec<(usize, Run)>| -> Vec<Run> {
                    list.into_iter().enumerate().map(|(record, (_, run))| Run { record, ..run }).collect()
                };
                let fold = |g: usize| {
                    let (test, train): (Vec<_>, Vec<_>) =
                        fit.iter().cloned().enumerate().partition(|(k, _)| k % groups == g);
                    (numbered(train), numbered(test))
                };
                (0..groups).map(fold).collect()
            }
        }
    }
}

/// Records without the parts that judge, and these parts, as shares of each record's length.
fn parted<'a>(records: &[Run], parts: impl Fn(usize) -> &'a [(f64, f64)]) -> (Vec<Run>, Vec<Run>) {
    let part = |run: &Run, from: f64, to: f64| {
        let at = |share: f64| (share * run.range.len() as f64) as usize;
        run.part(at(from)..at(to))
    };
    let (mut train, mut test) = (Vec::new(), Vec::new());
    for (record, run) in records.iter().enumerate() {
        let own = parts(record);
        test.extend(own.iter().map(|(from, to)| part(run, *from, *to)));
        let starts = std::iter::once(0.0).chain(own.iter().map(|(_, to)| *to));
        let ends = own.iter().map(|(from, _)| *from).chain([1.0]);
        train.extend(starts.zip(ends).map(|(from, to)| part(run, from, to)).filter(|run| !run.range.is_empty()));
    }
    (train, test)
}
