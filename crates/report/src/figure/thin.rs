//! Few points for many samples, without losing an extreme.
//!
//! A line of a million samples covers a thousand columns of pixels; in each column only the smallest and the largest sample
//! show. [`Envelope`] knows these for every aligned block of 2ᵏ samples, so that a view costs what its width costs.

use std::ops::RangeInclusive;

/// Samples in a block of the lowest level; smaller blocks are searched as they are asked for.
const LOWEST: usize = 16;

/// A stretch of evenly spaced samples: abscissa of the first one and their distance, > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// Abscissa of the first sample.
    pub start: f64,
    /// Distance of the samples, > 0.
    pub interval: f64,
}

impl Spacing {
    /// Abscissa of a sample.
    pub fn at(&self, index: usize) -> f64 {
        self.start + self.interval * index as f64
    }
}

/// Where the smallest and the largest finite sample of a block are; the same index if it has but one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Extremes {
    least: u32,
    most: u32,
}

/// The smallest and largest sample of every aligned block of 2ᵏ samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Envelope {
    /// `levels[k]`: blocks of `LOWEST << k` samples; none where a block has no finite sample.
    levels: Vec<Vec<Option<Extremes>>>,
    range: Option<(f64, f64)>,
}

impl Envelope {
    /// The envelope of a series of at most 2³² samples.
    pub fn new(values: &[f64]) -> Self {
        let mut levels = Vec::new();
        let mut level: Vec<_> =
            values.chunks(LOWEST).enumerate().map(|(b, block)| extremes(block, b * LOWEST)).collect();
        while level.len() > 1 {
            let next = level
                .chunks(2)
                .map(|pair| match *pair {
                    [Some(a), Some(b)] => Some(join(values, a, b)),
                    [a, b] => a.or(b),
                    [a] => a,
                    _ => None,
                })
                .collect();
            levels.push(std::mem::replace(&mut level, next));
        }
        let range = level.first().copied().flatten().map(|e| (values[e.least as usize], values[e.most as usize]));
        levels.push(level);
        Self { levels, range }
    }

    /// Smallest and largest finite value of the series.
    pub fn range(&self) -> Option<(f64, f64)> {
        self.range
    }

    /// Fills `points` with what shows of the samples in `visible` on `columns` columns of pixels, in order of the abscissa:
    /// all of them if they are few, else the smallest and largest of each of at least `columns` blocks, each where it lies.
    /// One sample on either side is added, so that lines run on to the edges. Blocks are aligned to the series and not to the
    /// view, so a drawn line keeps its shape while it is moved.
    ///
    /// `values` are those that the envelope was made of.
    pub fn points(
        &self,
        values: &[f64],
        spacing: Spacing,
        visible: RangeInclusive<f64>,
        columns: usize,
        points: &mut Vec<[f64; 2]>,
    ) {
        points.clear();
        let n = values.len();
        let position = |x: f64| (x - spacing.start) / spacing.interval;
        let point = |k: usize| [spacing.at(k), values[k]];
        let first = (position(*visible.start()).floor().max(0.0) as usize).min(n);
        let last = (position(*visible.end()).ceil() + 1.0).clamp(0.0, n as f64) as usize;
        if first >= last {
            return;
        }
        let columns = columns.max(1);
        let per_column = (last - first) / columns;
        if per_column < 4 {
            points.extend((first..last).map(point).filter(|p| p[1].is_finite()));
            return;
        }
        let size = 1 << per_column.ilog2();
        let (from, to) = (first / size, last.div_ceil(size));
        let mut push = |block: Option<Extremes>| {
            if let Some(Extremes { least, most }) = block {
                let (one, other) = (least.min(most) as usize, least.max(most) as usize);
                points.push(point(one));
                if other != one {
                    points.push(point(other));
                }
            }
        };
        if size < LOWEST {
            for b in from..to {
                push(extremes(&values[b * size..((b + 1) * size).min(n)], b * size));
            }
        } else {
            let level = &self.levels[((size / LOWEST).ilog2() as usize).min(self.levels.len() - 1)];
            level[from.min(level.len())..to.min(level.len())].iter().copied().for_each(push);
        }
    }
}

fn extremes(block: &[f64], offset: usize) -> Option<Extremes> {
    let mut found: Option<(usize, usize)> = None;
    for (i, value) in block.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        found = Some(found.map_or((i, i), |(least, most)| {
            (if *value < block[least] { i } else { least }, if *value > block[most] { i } else { most })
        }));
    }
    let index = |i: usize| u32::try_from(offset + i).ok();
    let (least, most) = found?;
    Some(Extremes { least: index(least)?, most: index(most)? })
}

fn join(values: &[f64], a: Extremes, b: Extremes) -> Extremes {
    let value = |i: u32| values[i as usize];
    Extremes {
        least: if value(b.least) < value(a.least) { b.least } else { a.least },
        most: if value(b.most) > value(a.most) { b.most } else { a.most },
    }
}

/// Thins points whose abscissae rise but are not evenly spaced (a spectrum over the logarithm of frequency): of those that
/// fall into one of `columns` columns over `visible`, the smallest and the largest.
pub fn columns(
    points: impl Iterator<Item = [f64; 2]>,
    visible: RangeInclusive<f64>,
    columns: usize,
    out: &mut Vec<[f64; 2]>,
) {
    out.clear();
    let (low, high) = visible.into_inner();
    let scale = columns as f64 / (high - low);
    let mut current: Option<(f64, [f64; 2], [f64; 2])> = None;
    let mut flush = |least: [f64; 2], most: [f64; 2]| {
        let (one, other) = if least[0] <= most[0] { (least, most) } else { (most, least) };
        out.push(one);
        if other[0] > one[0] {
            out.push(other);
        }
    };
    for point in points.filter(|p| p[0].is_finite() && p[1].is_finite()) {
        let column = ((point[0] - low) * scale).floor().clamp(-1.0, columns as f64);
        current = Some(match current {
            Some((c, least, most)) if c == column => {
                (c, if point[1] < least[1] { point } else { least }, if point[1] > most[1] { point } else { most })
            }
            Some((_, least, most)) => {
                flush(least, most);
                (column, point, point)
            }
            None => (column, point, point),
        });
    }
    if let Some((_, least, most)) = current {
        flush(least, most);
    }
}

/// What a thinned curve is drawn on: its bounds, and pixels per unit along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    /// Lower ends.
    pub min: [f64; 2],
    /// Upper ends.
    pub max: [f64; 2],
    /// Pixels per unit.
    pub scale: [f64; 2],
}

/// Thins a curve that may run in loops (a phase portrait) to what shows on a raster: points nearer than a pixel to the last
/// one kept are left out, and so are short steps between pixels that the curve has been to before, which leaves a pause in
/// the line (a point that is not finite). If more than `most` points remain (a portrait that fills an area), pixels of twice
/// the size are taken, and so on.
pub fn loops<P: Iterator<Item = [f64; 2]> + Clone>(points: P, raster: Raster, most: usize, out: &mut Vec<[f64; 2]>) {
    let mut size = 1.0;
    let coarser = |size: f64| Raster { scale: raster.scale.map(|s| s / size), ..raster };
    while !loops_of(points.clone(), coarser(size), most, out) && size < COARSEST {
        size *= 2.0;
    }
}

/// Beyond this size of pixels a portrait is drawn with as many points as it takes.
const COARSEST: f64 = 16.0;

/// False if `most` points did not do.
fn loops_of(points: impl Iterator<Item = [f64; 2]>, raster: Raster, most: usize, out: &mut Vec<[f64; 2]>) -> bool {
    const STEP: f64 = 0.7;
    const PAUSE: [f64; 2] = [f64::NAN; 2];
    let Raster { min, max, scale } = raster;
    out.clear();
    let cells = |k: usize| ((max[k] - min[k]) * scale[k]).ceil().clamp(0.0, 8192.0) as usize + 1;
    let (width, height) = (cells(0), cells(1));
    let mut visited = vec![false; width * height];
    let mut last: Option<([f64; 2], [f64; 2], bool)> = None;
    let mut paused = true;
    for point in points.filter(|p| p[0].is_finite() && p[1].is_finite()) {
        let place = [(point[0] - min[0]) * scale[0], (point[1] - min[1]) * scale[1]];
        let distance_squared =
            last.map_or(f64::INFINITY, |(_, at, _)| (place[0] - at[0]).powi(2) + (place[1] - at[1]).powi(2));
        if distance_squared < STEP * STEP {
            continue;
        }
        let inside = place[0] >= 0.0 && place[1] >= 0.0 && place[0] < width as f64 && place[1] < height as f64;
        let cell = inside.then(|| place[1] as usize * width + place[0] as usize);
        // Outside the view nothing shows but the line that leads in, which the next point inside draws from here.
        let known = cell.is_none_or(|c| std::mem::replace(&mut visited[c], true));
        if let Some((before, _, before_known)) = last {
            if known && before_known && (distance_squared < 4.0 || cell.is_none()) {
                if !paused {
                    out.push(PAUSE);
                    paused = true;
                }
            } else {
                if paused {
                    out.push(before);
                    paused = false;
                }
                out.push(point);
                if out.len() > most {
                    return false;
                }
            }
        }
        last = Some((point, place, known));
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SPACING: Spacing = Spacing { start: -3.0, interval: 0.5 };

    proptest! {
        #[test]
        fn no_extreme_of_a_block_is_lost(
            values in prop::collection::vec(-1e3..1e3f64, 1..5000),
            from in -0.2..1.1f64,
            width in 0.001..1.3f64,
            columns in 1usize..300,
        ) {
            let length = SPACING.at(values.len()) - SPACING.start;
            let visible = SPACING.start + from * length..=SPACING.start + (from + width) * length;
            let mut points = Vec::new();
            Envelope::new(&values).points(&values, SPACING, visible.clone(), columns, &mut points);
            let shown: Vec<usize> = (0..values.len()).filter(|&i| visible.contains(&SPACING.at(i))).collect();
            let inside = |p: &&[f64; 2]| shown.iter().any(|&i| SPACING.at(i) == p[0]);
            let index = |x: f64| ((x - SPACING.start) / SPACING.interval).round() as usize;

            // Every point is a sample, in order of time, and there are not many more than the columns need.
            prop_assert!(points.iter().all(|p| values[index(p[0])] == p[1]));
            prop_assert!(points.windows(2).all(|w| w[0][0] < w[1][0]));
            prop_assert!(points.len() <= 5 * columns + 6, "{} points on {columns} columns", points.len());

            // The largest and smallest visible sample are there, or something beyond them at the view's edge.
            if let Some(most) = shown.iter().map(|&i| values[i]).reduce(f64::max) {
                let least = shown.iter().map(|&i| values[i]).fold(f64::INFINITY, f64::min);
                prop_assert!(points.iter().any(|p| p[1] >= most));
                prop_assert!(points.iter().any(|p| p[1] <= least));
            }
            // And so in each column: within two columns of any sample there is a point as high, and one as low.
            let reach = 2.0 * (shown.len() as f64 / columns as f64).max(1.0) * SPACING.interval;
            for &i in shown.iter().step_by(1 + shown.len() / 40) {
                let near = |p: &&[f64; 2]| (p[0] - SPACING.at(i)).abs() <= reach;
                prop_assert!(points.iter().filter(near).any(|p| p[1] >= values[i]));
                prop_assert!(points.iter().filter(near).any(|p| p[1] <= values[i]));
            }
            prop_assert!(shown.is_empty() || points.iter().filter(inside).count() > 0);
        }

        #[test]
        fn columns_keep_their_extremes(values in prop::collection::vec(-1.0..1.0f64, 1..2000), count in 1usize..200) {
            let point = |i: usize| [((i + 1) as f64).log10(), values[i]];
            let high = ((values.len() + 1) as f64).log10();
            let mut out = Vec::new();
            columns((0..values.len()).map(point), 0.0..=high, count, &mut out);
            prop_assert!(out.len() <= 2 * count + 4);
            prop_assert!(out.windows(2).all(|w| w[0][0] < w[1][0]));
            let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(out.iter().any(|p| p[1] == most));
        }
    }

    #[test]
    fn samples_that_are_no_numbers_are_left_out() {
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        values[400..600].fill(f64::NAN);
        values[700] = f64::INFINITY;
        let envelope = Envelope::new(&values);
        assert_eq!(envelope.range(), Some((0.0, 999.0)));
        let mut points = Vec::new();
        for columns in [3, 20, 1000] {
            envelope.points(&values, SPACING, -10.0..=1e4, columns, &mut points);
            assert!(points.iter().all(|p| p[1].is_finite()));
            assert_eq!(points.last().map(|p| p[1]), Some(999.0));
        }
        assert_eq!(Envelope::new(&[f64::NAN; 40]).range(), None);
        assert_eq!(Envelope::new(&[]).range(), None);
        Envelope::new(&[]).points(&[], SPACING, 0.0..=1.0, 10, &mut points);
        assert!(points.is_empty());
    }

    #[test]
    fn a_loop_run_through_again_adds_nothing() {
        let turn = |turns: u32| {
            let mut out = Vec::new();
            let points = (0..turns * 2000).map(|k| {
                let phase = std::f64::consts::TAU * f64::from(k) / 2000.0;
                [phase.cos(), phase.sin()]
            });
            loops(points, Raster { min: [-1.1; 2], max: [1.1; 2], scale: [200.0; 2] }, 100_000, &mut out);
            out.len()
        };
        assert!(turn(1) > 500);
        assert!(turn(50) < turn(1) + 20, "{} {}", turn(1), turn(50));
    }

    #[test]
    fn a_coarse_loop_keeps_every_sample() {
        let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut out = Vec::new();
        let raster = Raster { min: [0.0; 2], max: [1.0; 2], scale: [100.0; 2] };
        loops((0..12).map(|k| corner[k % 4]), raster, 100, &mut out);
        assert_eq!(out.len(), 12);
    }

    #[test]
    fn a_portrait_that_fills_an_area_is_drawn_with_few_points_from_edge_to_edge() {
        let points = (0..400_000).map(|k| {
            let t = 0.01 * f64::from(k);
            [(t * 1.618_034).sin(), t.sin()]
        });
        let mut out = Vec::new();
        loops(points, Raster { min: [-1.1; 2], max: [1.1; 2], scale: [300.0; 2] }, 12_000, &mut out);
        assert!((2000..=12_000).contains(&out.len()), "{}", out.len());
        let widest = out.iter().filter(|p| p[0].is_finite()).map(|p| p[0]).fold(0.0, f64::max);
        assert!(widest > 0.95, "{widest}");
    }
}
