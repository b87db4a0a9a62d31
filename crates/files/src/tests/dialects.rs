//! One measurement in every way of writing it down.

use super::*;

/// The bytes of `text` in UTF-16.
fn utf16(text: &str) -> Vec<u8> {
    let mut bytes = vec![0xff, 0xfe];
    bytes.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
    bytes
}

#[test]
fn every_dialect_gives_the_same_record() {
    let point = |i: usize, s: &str| format!("{:.2}{s}{}{s}{}", i as f64 / 100.0, x(i), 2.0 * x(i));
    let comma = |i: usize, s: &str| point(i, s).replace('.', ",");
    let plain = file("t,x,u", |i| point(i, ","));
    let texts: Vec<(&str, Vec<u8>)> = vec![
        ("commas", plain.clone().into()),
        ("blanks after commas", file("t, x, u", |i| point(i, ", ")).into()),
        ("semicolons", file("t;x;u", |i| point(i, ";")).into()),
        ("decimal commas, semicolons", file("t;x;u", |i| comma(i, ";")).into()),
        ("decimal commas, tabs", file("t\tx\tu", |i| comma(i, "\t")).into()),
        ("decimal commas, blanks", file("t x u", |i| comma(i, " ")).into()),
        ("quoted decimal commas", file("\"t\",\"x\",\"u\"", |i| format!("\"{}\"", comma(i, "\",\""))).into()),
        ("aligned blanks", file("   t    x      u", |i| format!("  {}  ", point(i, "    "))).into()),
        ("tabs with blanks", file("t \t x \t u", |i| point(i, " \t ")).into()),
        ("line ends of Windows", plain.replace('\n', "\r\n").into()),
        ("line ends of old", plain.replace('\n', "\r").into()),
        ("byte-order mark", format!("\u{feff}{plain}").into()),
        ("UTF-16", utf16(&plain)),
        ("no line end at the end", plain.trim_end().into()),
        ("comments", format!("# a, b\n% c; \"d\n  % e\n{}# end\n", plain.replace("\n0.05", "\n# note\n\n0.05")).into()),
        ("trailing commas in the rows", file("t,x,u", |i| point(i, ",") + ",").into()),
        ("trailing commas everywhere", file("t,x,u,", |i| point(i, ",") + ",").into()),
        ("trailing commas in the header", file("t,x,u,,", |i| point(i, ",")).into()),
        ("empty rows at the end", (plain.clone() + ",,\n  \n,,\n").into()),
        ("row of units", file("t,x,u\ns,-,-", |i| point(i, ",")).into()),
        ("row of bracketed units", file("t,x,u\n[s],[],[]", |i| point(i, ",")).into()),
        ("preamble", format!("Device;Laser\nRate;2000\n\n{}", file("t;x;u", |i| point(i, ";"))).into()),
        ("sep= line of Excel", format!("sep=;\n{}", file("t;x;u", |i| point(i, ";"))).into()),
        ("header in a comment", format!("# made by hand\n# {plain}").into()),
        ("commented header with blanks", format!("# {}", file("t x u", |i| point(i, " "))).into()),
        (
            "other order of columns",
            file("u,t,x", |i| format!("{},{:.2},{}", 2.0 * x(i), i as f64 / 100.0, x(i))).into(),
        ),
        ("milliseconds", file("time [ms],x,u", |i| format!("{},{},{}", 10 * i, x(i), 2.0 * x(i))).into()),
        ("microseconds", file("t_us,x,u", |i| format!("{}e4,{},{}", i, x(i), 2.0 * x(i))).into()),
        ("a text column", file("t,x,u,note", |i| point(i, ",") + ",ok").into()),
        ("a text column first", file("note,t,x,u", |i| format!("run a,{}", point(i, ","))).into()),
        ("an unnamed index", file(",t,x,u", |i| format!("{i},{}", point(i, ","))).into()),
        ("Fortran's exponents", file("t,x,u", |i| format!("{}D-2,{},{}", i, x(i), 2.0 * x(i))).into()),
    ];
    let want = only("a.csv", &plain, &ReadOptions::default());
    assert_eq!((want.start, want.interval, want.len()), (0.0, 0.01, 30));
    for (what, bytes) in texts {
        let records = read_text("a.csv", bytes, &ReadOptions::default()).unwrap_or_else(|e| panic!("{what}: {e}"));
        let [record] = &records[..] else { panic!("{what}: {} records", records.len()) };
        assert_eq!((record.start, record.interval), (want.start, want.interval), "{what}");
        for role in [Role::Displacement(0), Role::Input(0)] {
            assert_eq!(values(record, role), values(&want, role), "{what}");
        }
        assert_eq!(record.channels.len(), 2, "{what}");
    }
}

#[test]
fn names_and_units_come_through() {
    let text = file("t_s;u_base_m;Displacement [mm]", |i| format!("{};{};{}", i, x(i), 3.0 * x(i)));
    let record = only("rig.csv", &text, &ReadOptions::default());
    let channels: Vec<_> = record.channels.iter().map(|c| (c.role, c.name.as_str(), c.unit.as_str())).collect();
    assert_eq!(channels, [(Role::Displacement(0), "Displacement", "mm"), (Role::Input(0), "u_base", "mm")]);
    assert_eq!(record.name, "rig");
    // The base moved by x metres, which are 1000 x millimetres.
    assert_eq!(values(&record, Role::Input(0))[1], 1000.0 * x(1));
}

#[test]
fn time_comes_in_many_units() {
    for (header, interval) in [
        ("t,x", 5.0),
        ("t [ns],x", 5e-9),
        ("TIME_US,x", 5e-6),
        ("Time (ms),x", 0.005),
        ("time [min],x", 300.0),
        ("t / h,x", 18_000.0),
        ("time_seconds,x", 5.0),
    ] {
        let record = only("a", &file(header, |i| format!("{},{}", 5 * i + 5, x(i))), &ReadOptions::default());
        assert_eq!((record.start, record.interval), (interval, interval), "{header}");
    }
}

#[test]
fn latin_1_names_are_read() {
    let mut bytes = file("t,x [@m],na@ve", |i| format!("{i},{},0", x(i))).into_bytes();
    for (byte, latin) in bytes.iter_mut().filter(|b| **b == b'@').zip([0xb5, 0xef]) {
        *byte = latin;
    }
    let records = read_text("a", bytes, &ReadOptions::default()).unwrap();
    assert_eq!(records[0].channels[0].unit, "µm");
    assert_eq!(records[0].notices, ["a: column `naïve` is not used"]);
}

#[test]
fn names_with_line_ends_in_quotes_are_read() {
    let text = file("t,\"x\n[mm]\"", |i| format!("{i},{}", x(i)));
    let record = only("a", &text, &ReadOptions::default());
    assert_eq!((record.channels[0].name.as_str(), record.channels[0].unit.as_str()), ("x", "mm"));
}

#[test]
fn velocities_and_accelerations_follow_the_length_unit() {
    let text = file("t,x [mm],v [m/s],a_m_s2,force (N)", |i| format!("{i},{0},{0},{0},{0}", x(i)));
    let record = only("a", &text, &ReadOptions::default());
    let units: Vec<&str> = record.channels.iter().map(|c| c.unit.as_str()).collect();
    assert_eq!(units, ["mm", "mm/s", "mm/s^2", "N"]);
    assert_eq!(values(&record, Role::Velocity(0))[1], 1000.0 * x(1));
    assert_eq!(values(&record, Role::Input(0))[1], x(1));
}

#[test]
fn one_column_and_a_rate_are_enough() {
    let options = ReadOptions { rate: Some(2000.0), ..ReadOptions::default() };
    for text in [file("x", |i| x(i).to_string()), file("x [mm]", |i| x(i).to_string().replace('.', ","))] {
        let record = only("a", &text, &options);
        assert_eq!((record.start, record.interval, record.len()), (0.0, 0.0005, 30));
        assert_eq!(values(&record, Role::Displacement(0))[3], x(3));
    }
}

#[test]
fn columns_by_number_need_no_header() {
    let options = ReadOptions { columns: "t=1,x=3".parse().unwrap(), ..ReadOptions::default() };
    for separator in [",", ";", "\t", "  "] {
        let text = file("", |i| format!("{i}.5{separator}7.0{separator}{}", x(i)));
        let record = only("a", &text, &options);
        assert_eq!((record.start, record.interval, record.len()), (0.5, 1.0, 30), "{separator:?}");
        assert_eq!(values(&record, Role::Displacement(0))[3], x(3));
    }
}

#[test]
fn first_order_states_are_read() {
    let options = ReadOptions { kind: Kind::FirstOrder, ..ReadOptions::default() };
    for header in ["t,x,y,z", "t,x1,x2,x3", "t,x_1,x_2,x_3", "t,x0,x1,x2"] {
        let text = file(header, |i| format!("{i},{0},{0},{0}", x(i)));
        let record = only("a", &text, &options);
        let roles: Vec<Role> = record.channels.iter().map(|c| c.role).collect();
        assert_eq!(roles, [0, 1, 2].map(Role::Displacement), "{header}");
    }
}

#[test]
fn a_record_column_separates_trajectories() {
    let contiguous = file("run,t,x", |i| format!("{},{},{}", if i < 5 { "a" } else { "b" }, i, x(i)));
    // Five samples are too few.
    assert_eq!(read_text("f.csv", contiguous, &ReadOptions::default()).unwrap().len(), 1);
    let mut contiguous = String::from("run,t,x\n");
    let mut interleaved = contiguous.clone();
    for run in ["a", "b"] {
        for i in 0..30 {
            contiguous += &format!("{run},{i},{}\n", x(i) + run.len() as f64);
        }
    }
    for i in 0..30 {
        interleaved += &format!("a,{i},{0}\nb,{i},{0}\n", x(i) + 1.0);
    }
    let one = read_text("f.csv", contiguous, &ReadOptions::default()).unwrap();
    let two = read_text("f.csv", interleaved, &ReadOptions::default()).unwrap();
    assert_eq!(one, two);
    assert_eq!(one.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
}

#[test]
fn rows_without_a_value_are_left_out_with_a_notice() {
    let text = |lacking: &[usize], cell: &str| {
        file("t,x,w", |i| format!("{i},{},", if lacking.contains(&i) { cell.to_owned() } else { x(i).to_string() }))
    };
    for cell in ["", "n/a", "NaN", "-"] {
        let record = only("f.csv", &text(&[0, 28, 29], cell), &ReadOptions::default());
        assert_eq!((record.start, record.len()), (1.0, 27), "{cell}");
        let told = "f.csv: 3 rows without a value, the first of `x` in line 2, were left out";
        assert!(record.notices.iter().any(|n| n == told), "{:?}", record.notices);
    }
    // A column that is not used may be as empty as it likes, and rows may end before it.
    let short = file("t,x,w", |i| format!("{i},{}", x(i)));
    assert_eq!(only("f.csv", &short, &ReadOptions::default()).len(), 30);
}

#[test]
fn jittering_stamps_are_evened_out_with_a_notice() {
    let wobble = |i: usize| ((i * 7919) % 101) as f64 / 101.0 - 0.5;
    let text = file("t,x", |i| format!("{:.6},{:.9}", 0.1 * (i as f64 + 0.1 * wobble(i)), (0.3 * i as f64).sin()));
    let record = only("f.csv", &text, &ReadOptions::default());
    assert_eq!(record.interval, 0.1);
    let told = record.notices.iter().find(|n| n.contains("interpolated")).unwrap();
    assert!(
        told.starts_with("f.csv: the time stamps are up to 4") && told.contains("% of the interval of 0.1 s"),
        "{told}"
    );
}

#[test]
fn records_are_named_after_file_and_label() {
    let two = |a: &str, b: &str| {
        let mut text = String::from("record,t,x\n");
        for label in [a, b] {
            (0..30).for_each(|i| text += &format!("{label},{i},{}\n", x(i)));
        }
        text
    };
    for (text, names) in
        [(two("1", "2"), ["tones 1", "tones 2"]), (two("2.013 Hz", "5.843 Hz"), ["2.013 Hz", "5.843 Hz"])]
    {
        let records = read_text("tones.csv", text, &ReadOptions::default()).unwrap();
        assert_eq!(records.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), names);
    }
}
