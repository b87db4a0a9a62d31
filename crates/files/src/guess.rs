//! What columns may be whose names do not say so by the interface's words: a proposal for a person to look at.
//!
//! Three things speak: words that laboratories use, also in German and French; the unit; and for the time the values, which
//! rise evenly. Reading never relies on it: a file is opened by what its header says or a person confirmed.

use super::heading::{ColumnKey, ColumnQuantity, Heading, Meaning};
use sindyscope_values::record::units;

/// More columns than this of one quantity are no proposal: then the first alone is.
const MOST_OF_ONE: usize = 16;

/// A step of evenly rising values may differ from the mean step by this share.
const EVEN: f64 = 0.5;

/// Words by which columns are called, each with its quantity. A word may begin a longer one from four letters on.
const WORDS: &[(&str, ColumnQuantity)] = &[
    ("zeit", ColumnQuantity::Time),
    ("temps", ColumnQuantity::Time),
    ("tiempo", ColumnQuantity::Time),
    ("tempo", ColumnQuantity::Time),
    ("timestamp", ColumnQuantity::Time),
    ("seconds", ColumnQuantity::Time),
    ("sec", ColumnQuantity::Time),
    ("pos", ColumnQuantity::Displacement),
    ("position", ColumnQuantity::Displacement),
    ("displ", ColumnQuantity::Displacement),
    ("deflection", ColumnQuantity::Displacement),
    ("weg", ColumnQuantity::Displacement),
    ("auslenkung", ColumnQuantity::Displacement),
    ("deplacement", ColumnQuantity::Displacement),
    ("déplacement", ColumnQuantity::Displacement),
    ("laser", ColumnQuantity::Displacement),
    ("lvdt", ColumnQuantity::Displacement),
    ("stroke", ColumnQuantity::Displacement),
    ("angle", ColumnQuantity::Displacement),
    ("winkel", ColumnQuantity::Displacement),
    ("theta", ColumnQuantity::Displacement),
    ("phi", ColumnQuantity::Displacement),
    ("encoder", ColumnQuantity::Displacement),
    ("strain", ColumnQuantity::Displacement),
    ("roll", ColumnQuantity::Displacement),
    ("output", ColumnQuantity::Displacement),
    ("response", ColumnQuantity::Displacement),
    ("out", ColumnQuantity::Displacement),
    ("vel", ColumnQuantity::Velocity),
    ("speed", ColumnQuantity::Velocity),
    ("geschwindigkeit", ColumnQuantity::Velocity),
    ("vitesse", ColumnQuantity::Velocity),
    ("omega", ColumnQuantity::Velocity),
    ("xdot", ColumnQuantity::Velocity),
    ("acc", ColumnQuantity::Acceleration),
    ("accel", ColumnQuantity::Acceleration),
    ("beschleunigung", ColumnQuantity::Acceleration),
    ("accélération", ColumnQuantity::Acceleration),
    ("xddot", ColumnQuantity::Acceleration),
    ("kraft", ColumnQuantity::Input),
    ("load", ColumnQuantity::Input),
    ("torque", ColumnQuantity::Input),
    ("moment", ColumnQuantity::Input),
    ("drehmoment", ColumnQuantity::Input),
    ("excitation", ColumnQuantity::Input),
    ("anregung", ColumnQuantity::Input),
    ("shaker", ColumnQuantity::Input),
    ("hammer", ColumnQuantity::Input),
    ("drive", ColumnQuantity::Input),
    ("ground", ColumnQuantity::Input),
    ("table", ColumnQuantity::Input),
    ("fuß", ColumnQuantity::Input),
    ("foot", ColumnQuantity::Input),
    ("voltage", ColumnQuantity::Input),
    ("in", ColumnQuantity::Input),
];

/// What each column may be, for those that are not `taken`; `first[column][row]` are the first values.
pub(super) fn guess(headings: &[Heading], first: &[Vec<f64>], taken: &[Option<ColumnKey>]) -> Vec<Option<ColumnKey>> {
    let free = |column: usize| taken.get(column).is_none_or(Option::is_none);
    let has = |quantity: ColumnQuantity| taken.iter().flatten().any(|key| key.quantity == quantity);
    let mut found: Vec<Option<ColumnQuantity>> =
        headings.iter().enumerate().map(|(c, heading)| said(heading).filter(|_| free(c))).collect();
    let rising = |column: usize| first.get(column).is_some_and(|values| rises_evenly(values));
    if has(ColumnQuantity::Time) {
        forget(&mut found, ColumnQuantity::Time);
    } else {
        let named = (0..found.len()).find(|c| found[*c] == Some(ColumnQuantity::Time) && rising(*c));
        // A column of whole numbers counts rows: only a lone one may be the time.
        let by_values = || {
            let candidates: Vec<usize> = (0..headings.len()).filter(|c| free(*c) && rising(*c)).collect();
            candidates.iter().copied().find(|c| !counts(&first[*c])).or(candidates.first().copied())
        };
        let time = named.or_else(by_values);
        forget(&mut found, ColumnQuantity::Time);
        if let Some(column) = time {
            found[column] = Some(ColumnQuantity::Time);
        }
    }
    for quantity in
        [ColumnQuantity::Displacement, ColumnQuantity::Velocity, ColumnQuantity::Acceleration, ColumnQuantity::Input]
    {
        if found.iter().filter(|f| **f == Some(quantity)).count() > MOST_OF_ONE {
            let one = found.iter().position(|f| *f == Some(quantity));
            forget(&mut found, quantity);
            if let Some(column) = one {
                found[column] = Some(quantity);
            }
        }
    }
    let known =
        taken.iter().flatten().any(|key| key.quantity.is_motion()) || found.iter().flatten().any(|q| q.is_motion());
    if !known {
        // Nothing speaks: the first column beside the time is the motion, and of two the other what drives it.
        let idle: Vec<usize> =
            (0..headings.len()).filter(|c| free(*c) && found[*c].is_none() && varies(first.get(*c))).collect();
        if let Some(column) = idle.first() {
            found[*column] = Some(ColumnQuantity::Displacement);
        }
        if let [_, second] = idle[..]
            && !has(ColumnQuantity::Input)
            && !found.contains(&Some(ColumnQuantity::Input))
        {
            found[second] = Some(ColumnQuantity::Input);
        }
    }
    numbered(&found, taken)
}

/// The quantity that a name or its unit speaks of.
fn said(heading: &Heading) -> Option<ColumnQuantity> {
    let words: Vec<String> = heading
        .stem
        .split(|c: char| !c.is_alphabetic())
        .filter(|word| !word.is_empty())
        .map(str::to_lowercase)
        .collect();
    let by_word = words.iter().find_map(|word| {
        let fits = |known: &str| word == known || (known.chars().count() >= 4 && word.starts_with(known));
        WORDS.iter().find(|(known, _)| fits(known)).map(|(_, quantity)| *quantity)
    });
    let unit = units::parse(&heading.unit);
    let by_unit = unit.and_then(|unit| {
        [
            (unit.is_time(), ColumnQuantity::Time),
            (unit.is_acceleration(), ColumnQuantity::Acceleration),
            (unit.is_force(), ColumnQuantity::Input),
            (unit.is_length() || unit.is_angle(), ColumnQuantity::Displacement),
            (unit.is_rate() && !unit.is_frequency(), ColumnQuantity::Velocity),
        ]
        .into_iter()
        .find_map(|(fits, quantity)| fits.then_some(quantity))
    });
    let doubtful = match &heading.meaning {
        Meaning::Doubtful(key, _) if unit.is_none() => Some(key.quantity),
        _ => None,
    };
    // The unit of a motion outweighs the word: `shaker position [mm]` aside, where the word names what drives.
    match (by_word, by_unit) {
        (Some(ColumnQuantity::Input), _) => by_word,
        (_, Some(_)) => by_unit,
        (word, None) => word.or(doubtful),
    }
}

fn forget(found: &mut [Option<ColumnQuantity>], quantity: ColumnQuantity) {
    found.iter_mut().filter(|f| **f == Some(quantity)).for_each(|f| *f = None);
}

/// The numbers that are left for each quantity, in the order of the columns.
fn numbered(found: &[Option<ColumnQuantity>], taken: &[Option<ColumnKey>]) -> Vec<Option<ColumnKey>> {
    let mut next: Vec<(ColumnQuantity, usize)> = Vec::new();
    let used = |quantity: ColumnQuantity, number: usize| {
        taken.iter().flatten().any(|key| key.quantity == quantity && key.number.unwrap_or(1) == number)
    };
    let mut number = |quantity: ColumnQuantity| {
        let index = next.iter().position(|(q, _)| *q == quantity).unwrap_or_else(|| {
            next.push((quantity, 0));
            next.len() - 1
        });
        next[index].1 += 1;
        while used(quantity, next[index].1) {
            next[index].1 += 1;
        }
        next[index].1
    };
    let key = |quantity: ColumnQuantity, number: Option<usize>| ColumnKey { quantity, number };
    found
        .iter()
        .map(|found| found.map(|q| if q.is_numbered() { key(q, Some(number(q))) } else { key(q, None) }))
        .collect()
}

/// True for values that rise from one to the next by about the same step.
fn rises_evenly(values: &[f64]) -> bool {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return false };
    let mean = (last - first) / (values.len().max(2) - 1) as f64;
    values.len() > 2 && mean > 0.0 && values.windows(2).all(|w| ((w[1] - w[0]) / mean - 1.0).abs() <= EVEN)
}

/// True for 0, 1, 2, … or 1, 2, 3, …
fn counts(values: &[f64]) -> bool {
    values.first().is_some_and(|f| *f == 0.0 || *f == 1.0) && values.windows(2).all(|w| w[1] - w[0] == 1.0)
}

fn varies(values: Option<&Vec<f64>>) -> bool {
    values.is_none_or(|values| values.is_empty() || values.iter().any(|v| v.is_finite() && Some(v) != values.first()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A column's name, and its values by row.
    type Named = (&'static str, fn(f64) -> f64);

    /// The guess for columns `name=values`, as `t x1 - u1`.
    fn told(columns: &[Named]) -> String {
        let headings: Vec<Heading> = columns.iter().map(|(name, _)| Heading::new(name, None)).collect();
        let first: Vec<Vec<f64>> =
            columns.iter().map(|(_, value)| (0..50).map(|i| value(f64::from(i))).collect()).collect();
        let found = guess(&headings, &first, &vec![None; columns.len()]);
        let text: Vec<String> = found.iter().map(|key| key.map_or("-".into(), |key| key.to_string())).collect();
        text.join(" ")
    }

    #[test]
    fn words_units_and_values_speak() {
        fn rising(i: f64) -> f64 {
            0.3 + 0.01 * i
        }
        fn wave(i: f64) -> f64 {
            (0.4 * i).sin()
        }
        fn count(i: f64) -> f64 {
            i
        }
        fn still(_: f64) -> f64 {
            2.0
        }
        let columns: [(&[Named], &str); 10] = [
            (&[("Zeit", rising), ("Laser 2 (mm)", wave), ("Kraft (N)", wave)], "t x1 u1"),
            (&[("n", count), ("clock", rising), ("Beschleunigung 1", wave), ("Beschleunigung 2", wave)], "- t a1 a2"),
            (&[("ch1 [m/s^2]", wave), ("ch2 [lbf]", wave)], "a1 u1"),
            (&[("shaker [mm]", wave), ("tip [mm]", wave)], "u1 x1"),
            (&[("A", rising), ("B", wave), ("C", wave)], "t x1 u1"),
            (&[("A", rising), ("B", still), ("C", wave)], "t - x1"),
            (&[("A", rising), ("B", wave), ("C", wave), ("D", wave)], "t x1 - -"),
            (&[("n", count), ("signal", wave)], "t x1"),
            (&[("speed", wave), ("Zeit", wave)], "v1 -"),
            (&[("t_s", rising), ("V1_in_V", wave), ("V2_out_V", wave)], "t u1 x1"),
        ];
        for (columns, expected) in columns {
            assert_eq!(told(columns), expected, "{:?}", columns.iter().map(|c| c.0).collect::<Vec<_>>());
        }
    }

    #[test]
    fn of_very_many_alike_only_the_first_is_proposed() {
        let headings: Vec<Heading> = (1..=40).map(|n| Heading::new(&format!("ch {n} [mm]"), None)).collect();
        let found = guess(&headings, &[], &vec![None; 40]);
        assert_eq!(found.iter().flatten().count(), 1);
    }
}
