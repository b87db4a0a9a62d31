//! Samples that are missing: lost, empty or NaN.

use super::*;

/// A motion of some forty samples a period, 100 samples a second.
fn motion(i: usize) -> f64 {
    (i as f64 * 0.157).sin()
}

/// 200 samples of the motion, of which `lost` are not there; `line(i, value)` writes a row.
fn with_lost(
    header: &str,
    lost: std::ops::Range<usize>,
    line: impl Fn(usize, Option<f64>) -> Option<String>,
) -> String {
    let rows = (0..200).filter_map(|i| line(i, (!lost.contains(&i)).then(|| motion(i))));
    std::iter::once(header.to_owned()).chain(rows).map(|l| l + "\n").collect()
}

fn bridging(bridge: usize) -> ReadOptions {
    ReadOptions { bridge, ..ReadOptions::default() }
}

fn assert_is_motion(record: &Record) {
    let far = values(record, Role::Displacement(0)).into_iter().enumerate().map(|(i, v)| (v - motion(i)).abs());
    let far = far.fold(0.0, f64::max);
    assert!(record.len() == 200 && far < 3e-3, "{} samples, {far}", record.len());
}

#[test]
fn a_short_gap_is_bridged_and_a_longer_one_splits_the_record() {
    let seconds = |i: usize| i as f64 / 100.0;
    let lost = with_lost("t,x", 90..96, |i, x| Some(format!("{},{}", seconds(i), x?)));
    let empty =
        with_lost("t,x", 90..96, |i, x| Some(format!("{},{}", seconds(i), x.map_or("NaN".into(), |x| x.to_string()))));
    for text in [lost, empty] {
        let record = only("f.csv", &text, &bridging(6));
        assert_is_motion(&record);
        assert!(
            record.notices.contains(&"f.csv: 1 gap of up to 6 samples was bridged".to_owned()),
            "{:?}",
            record.notices
        );
        for bridge in [0, 5] {
            let parts = read_text("f.csv", &text, &bridging(bridge)).unwrap();
            assert_eq!(parts.iter().map(Record::len).collect::<Vec<_>>(), [90, 104], "{bridge}");
        }
    }
}

#[test]
fn a_gap_in_stamps_that_jitter_is_bridged_on_one_grid() {
    let noise = |i: usize| ((i as f64 * 12.9898).sin() * 43_758.545_3).fract();
    let stamp = |i: usize| (i as f64 + 0.1 * noise(i)) / 100.0;
    let text = with_lost("t,x", 90..98, |i, x| x.map(|_| format!("{},{}", stamp(i), (stamp(i) * 15.7).sin())));
    let record = only("f.csv", &text, &bridging(10));
    let at = |i: usize| (record.time(i) * 15.7).sin();
    let far =
        values(&record, Role::Displacement(0)).iter().enumerate().map(|(i, v)| (v - at(i)).abs()).fold(0.0, f64::max);
    assert!(record.len() >= 198 && far < 5e-3, "{} samples, {far}", record.len());
    assert_eq!(read_text("f.csv", &text, &bridging(5)).unwrap().len(), 2);
}

#[test]
fn without_time_the_rows_count_and_those_without_a_value_are_missing() {
    let text = with_lost("x,u", 60..63, |i, x| Some(x.map_or("NaN,NaN".into(), |x| format!("{x},{}", i % 3))));
    let options = |bridge| ReadOptions { rate: Some(50.0), ..bridging(bridge) };
    let whole = only("f.csv", &text, &options(3));
    assert_is_motion(&whole);
    assert_eq!(whole.interval, 0.02);
    let parts = read_text("f.csv", &text, &options(0)).unwrap();
    let told: Vec<_> = parts.iter().map(|r| (r.len(), r.start)).collect();
    assert_eq!(told.len(), 2);
    assert_eq!((told[0].0, told[1].0), (60, 137));
    // Rows count from one, so that the second part begins where it began.
    assert!((told[1].1 - told[0].1 - 63.0 * 0.02).abs() < 1e-12, "{told:?}");
}
