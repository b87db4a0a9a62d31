//! Properties: what is written reads back, and no bytes do harm.

use std::sync::Arc;

use proptest::prelude::*;

use super::*;

fn written(records: &[Record], comments: &[String]) -> String {
    let mut bytes = Vec::new();
    write_csv(records, &mut bytes, comments).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn channel(role: Role, name: &str, unit: &str, values: Vec<f64>) -> Channel {
    Channel { name: name.into(), role, unit: unit.into(), values: values.into(), estimated: false }
}

fn record(name: &str, start: f64, interval: f64, channels: Vec<Channel>) -> Record {
    Record { name: name.into(), source: None, start, interval, channels, notices: Vec::new() }
}

#[test]
fn what_is_written_is_short_and_plain() {
    let ramp = |slope: f64| (0..30).map(|i| slope * f64::from(i)).collect::<Vec<f64>>();
    let channels =
        vec![channel(Role::Displacement(0), "x", "mm", ramp(0.5)), channel(Role::Input(0), "V1_in", "V", ramp(0.1))];
    let text = written(&[record("a", 0.0, 0.01, channels)], &["made by a test".into()]);
    let head: Vec<&str> = text.lines().take(5).collect();
    assert_eq!(head, ["# made by a test", "t [s],x [mm],u V1_in [V]", "0.00,0.0,0.0", "0.01,0.5,0.1", "0.02,1.0,0.2"]);
    // A sum of binary fractions shows its rounding, the time does not.
    assert_eq!(text.lines().nth(5), Some("0.03,1.5,0.30000000000000004"));
}

#[test]
fn several_records_get_a_column_and_unlike_ones_are_refused() {
    let one = record("low, slow", 0.0, 0.1, vec![channel(Role::Displacement(0), "x", "", (0..30).map(x).collect())]);
    let mut two = one.clone();
    two.name = "# 2".into();
    let text = written(&[one.clone(), two.clone()], &[]);
    assert_eq!(text.lines().next(), Some("t [s],x,record"));
    let back = read_text("f.csv", text, &ReadOptions::default()).unwrap();
    assert_eq!(back, [one.clone(), two.clone()]);
    two.channels[0].unit = "mm".into();
    assert!(write_csv([&one, &two], &mut Vec::new(), &[]).is_err());
    assert!(write_csv([] as [&Record; 0], &mut Vec::new(), &[]).is_err());
}

#[test]
fn an_estimated_displacement_is_not_written_as_a_measured_one() {
    let values = (0..200).map(|k| f64::from(k).sin()).collect();
    let shown = record("a", 0.0, 0.1, vec![channel(Role::Acceleration(0), "a", "m/s^2", values)]);
    let completed = shown.clone().completed();
    assert!(completed.channel(Role::Displacement(0)).is_some_and(|c| c.estimated) && completed.notices.len() == 1);
    assert_eq!(written(&[completed], &[]), written(&[shown], &[]));
}

/// Finite numbers of every size that is read.
fn size() -> impl Strategy<Value = f64> {
    number().prop_map(|v| if v.abs() > 1e100 { v * 1e-250 } else { v })
}

/// Finite numbers of every size.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -10.0..10.0f64,
        1 => proptest::num::f64::NORMAL | proptest::num::f64::ZERO | proptest::num::f64::SUBNORMAL | proptest::num::f64::NEGATIVE | proptest::num::f64::POSITIVE,
    ]
}

/// Intervals as instruments have them: decimal, or one over a decimal rate.
fn interval() -> impl Strategy<Value = f64> {
    // Much shorter ones do not show in stamps of 100 s and more.
    let fits = |interval: &f64| (1e-4..1e4).contains(interval);
    let any = (1u32..1_000_000, -8i32..0, any::<bool>()).prop_map(|(mantissa, power, rate)| {
        let decimal = |power: i32| format!("{mantissa}e{power}").parse::<f64>().unwrap_or(1.0);
        if rate { 1.0 / decimal(power + 4) } else { decimal(power) }
    });
    any.prop_filter("out of proportion to the start", fits)
}

fn any_record() -> impl Strategy<Value = Record> {
    let unit = prop_oneof![Just(""), Just("mm"), Just("V"), Just("m")];
    let name =
        prop_oneof![Just("x"), Just("mass 1"), Just("V2_out"), Just("v_m"), Just(""), Just("a;b\n\"c\""), Just("é_mm")];
    let channel = (name, unit, proptest::collection::vec(size(), 60));
    let parts = (
        proptest::collection::vec(channel, 1..6),
        1usize..4,
        20usize..60,
        prop_oneof![Just(0.0), (-1000i32..1000).prop_map(|s| f64::from(s) / 8.0)],
        interval(),
    );
    parts.prop_map(|(channels, freedoms, samples, start, interval)| {
        let freedoms = freedoms.min(channels.len());
        let channels = channels.into_iter().enumerate().map(|(i, (name, unit, mut values))| {
            values.truncate(samples);
            // No channel may stand still, or reading would refuse or drop it.
            (values[0], values[1]) = (1.0, -1.0);
            let (role, unit) = if i < freedoms {
                // Lengths of different units are converted on reading, so they are not mixed here.
                (Role::Displacement(i), if unit == "m" { "mm" } else { unit })
            } else {
                (Role::Input(i - freedoms), if unit == "m" { "mm" } else { unit })
            };
            channel_of(role, name, unit, values)
        });
        record("f", start, interval, channels.collect())
    })
}

fn channel_of(role: Role, name: &str, unit: &str, values: Vec<f64>) -> Channel {
    channel(role, name, unit, values)
}

proptest! {
    #[test]
    fn written_records_read_back(record in any_record()) {
        let text = written(std::slice::from_ref(&record), &["a comment\nin two lines".into()]);
        let back = read_text("f.csv", &text, &ReadOptions::default());
        let back = back.map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        prop_assert_eq!(back.len(), 1);
        let back = &back[0];
        prop_assert_eq!(&back.notices, &Vec::<String>::new());
        prop_assert_eq!(back.start, record.start);
        prop_assert_eq!(back.interval, record.interval);
        prop_assert_eq!(back.channels.len(), record.channels.len());
        for (b, r) in back.channels.iter().zip(&record.channels) {
            prop_assert_eq!(b.role, r.role);
            prop_assert_eq!(&b.unit, &r.unit);
            prop_assert_eq!(b.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), r.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
        }
        // A second journey changes nothing any more, names included.
        let again = read_text("f.csv", written(std::slice::from_ref(back), &[]), &ReadOptions::default());
        prop_assert_eq!(&again.unwrap()[0], back);
    }

    #[test]
    fn any_interval_comes_back(interval in 1e-6..10.0f64, start in -10.0..10.0f64, n in 20usize..200) {
        let values: Vec<f64> = (0..n).map(x).collect();
        let record = record("f", start, interval, vec![channel(Role::Displacement(0), "x", "", values)]);
        let back = read_text("f.csv", written(std::slice::from_ref(&record), &[]), &ReadOptions::default()).unwrap();
        prop_assert_eq!(back[0].len(), n);
        prop_assert_eq!(back[0].start, start);
        // Stamps up to |start| + n·interval carry that much rounding, spread over n of them.
        let doubt = f64::EPSILON * (start.abs() + n as f64 * interval) / n as f64;
        prop_assert!((back[0].interval - interval).abs() <= 4.0 * doubt.max(f64::EPSILON * interval));
    }

    #[test]
    fn no_bytes_do_harm(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = read_text("f.csv", bytes, &ReadOptions::default());
    }

    #[test]
    fn nothing_that_looks_like_a_file_does_harm(
        text in "([tTxXuvayz0-9\\-+.eE,;#%\"\\[\\]() \t\r\nNain_]{0,30}\n){0,40}",
        map in proptest::option::of("(t|x|x1|x2|u|v|record)=[0-9tx]"),
        rate in proptest::option::of(number()),
        first_order in any::<bool>(),
        bridge in 0..6usize,
    ) {
        let columns: ColumnMap = map.unwrap_or_default().parse().unwrap();
        let kind = if first_order { Kind::FirstOrder } else { Kind::SecondOrder };
        let options = ReadOptions { columns, rate, kind, bridge, ..ReadOptions::default() };
        match read_text("f.csv", &text, &options) {
            Ok(records) => {
                for record in &records {
                    prop_assert!(record.len() >= 20 && record.interval > 0.0 && record.interval.is_finite());
                    prop_assert!(record.channels.iter().all(|c| c.values.len() == record.len()));
                    prop_assert!(record.channels.iter().all(|c| c.values.iter().all(|v| v.is_finite())));
                }
            }
            Err(error) => {
                prop_assert!(!error.to_string().is_empty() && !error.advice().is_empty());
            }
        }
    }

    #[test]
    fn numbers_in_any_shape_do_no_harm(
        rows in proptest::collection::vec((number(), number()), 20..60),
        header in "(t|time \\[ms\\]|t_h),(x|x1|x \\[in\\])",
    ) {
        let mut text = header + "\n";
        for (t, x) in rows {
            text += &format!("{t:?},{x:?}\n");
        }
        let _ = read_text("f.csv", text, &ReadOptions::default());
    }

    #[test]
    fn any_map_is_read_or_refused(text in "[tTxuva0-9=,\" recod]{0,30}") {
        if let Ok(map) = text.parse::<ColumnMap>() {
            prop_assert_eq!(map.to_string().parse::<ColumnMap>().map(|m| m.to_string()), Ok(map.to_string()));
        }
    }
}

#[test]
fn records_share_their_values_when_cloned() {
    let one = record("a", 0.0, 0.1, vec![channel(Role::Displacement(0), "x", "", vec![1.0; 5])]);
    assert!(Arc::ptr_eq(&one.channels[0].values, &one.clone().channels[0].values));
}
