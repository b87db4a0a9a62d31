//! Every error and every notice, by its words.

use super::*;

/// A file of 30 good rows in which one row is replaced.
fn with_row(header: &str, index: usize, row: &str) -> String {
    file(header, |i| if i == index { row.to_owned() } else { format!("{:.1},{}", i as f64 / 10.0, x(i)) })
}

fn options(columns: &str) -> ReadOptions {
    ReadOptions { columns: columns.parse().unwrap(), ..ReadOptions::default() }
}

fn rate(rate: f64) -> ReadOptions {
    ReadOptions { rate: Some(rate), ..ReadOptions::default() }
}

#[test]
fn every_error_says_what_where_and_what_to_try() {
    let none = ReadOptions::default;
    let rows = |header: &str| file(header, |i| format!("{i},{},{}", x(i), x(i)));
    let cases: Vec<(String, ReadOptions, &str, &str)> = vec![
        ("\0\u{1}".into(), none(), "f.csv: this is not a text file", "export the measurement as CSV text"),
        (String::new(), none(), "f.csv: the file is empty", "a file needs a header"),
        ("# nothing\n\n  \n,,\n".into(), none(), "f.csv: the file is empty", "a file needs a header"),
        (
            "# made today\nt,x\n".into(),
            none(),
            "f.csv: there are no samples below the header in line 2",
            "below it one row a sample",
        ),
        (
            "t,x\ns,mm\n".into(),
            none(),
            "f.csv: there are no samples below the header in line 1",
            "below it one row a sample",
        ),
        (
            file("# 30 rows", |i| format!("{i},{}", x(i))),
            none(),
            "f.csv: there is no header, only numbers from line 2 on",
            "give the columns by number: t=1,x=2",
        ),
        (
            rows("a,b,x"),
            none(),
            "f.csv: no column is the time; the columns are `a`, `b` and `x`",
            "t=a, or give the sampling rate",
        ),
        (
            rows("t,pos,u"),
            none(),
            "f.csv: no column is a displacement; the columns are `t`, `pos` and `u`",
            "say which column is which: x=u",
        ),
        (
            rows("t_s,V1_in_V,V2_out_V"),
            none(),
            "f.csv: no column is a displacement; the columns are `t_s`, `V1_in_V` and `V2_out_V`; `V1_in_V` is not taken for one: its unit `V` is not that of a velocity; `V2_out_V` is not taken for one: its unit `V` is not that of a velocity",
            "x=V2_out_V",
        ),
        (
            rows("t,x_raw,x_filtered"),
            none(),
            "f.csv: `x_raw` and `x_filtered` could both be the displacement x",
            "say which column is which: x=x_raw, or x1=x_raw,x2=x_filtered",
        ),
        (
            rows("t,x,x"),
            none(),
            "f.csv: `x` and `x` could both be the displacement x",
            "give the columns by number: x=2, or x1=2,x2=3",
        ),
        (rows("t,x1,x_1"), none(), "f.csv: `x1` and `x_1` could both be the displacement x1", "x1=x1"),
        (rows("t,time,x"), none(), "f.csv: `t` and `time` could both be the time", "say which column is which: t=t"),
        (rows("t,x1,x3"), none(), "f.csv: `x3` is there, but no x2", "number the columns without a hole"),
        (
            rows("t,x,u"),
            options("x=pos"),
            "f.csv: there is no column `pos` for x; the columns are `t`, `x` and `u`",
            "or the column's number from 1",
        ),
        (
            rows("t,x,u"),
            options("x=4"),
            "f.csv: there is no column `4` for x; the columns are `t`, `x` and `u`",
            "from 1",
        ),
        (rows("t,p,p"), options("x=p"), "f.csv: 2 columns are called `p`", "give the columns by number: x=2"),
        (rows("t,x,u"), options("x=u,u=3"), "f.csv: column `u` cannot be both x and u", "leave one of them out"),
        (rows("a,x,u"), rate(0.0), "a sampling rate of 0 Hz is impossible", "give the sampling rate in hertz"),
        (rows("a,x,u"), rate(f64::NAN), "a sampling rate of NaN Hz is impossible", "give the sampling rate in hertz"),
        (
            rows("stamp [V],x,u"),
            options("t=stamp"),
            "f.csv, column `stamp [V]`: `V` is not a unit of time",
            "in s, ms, us, min or h",
        ),
        (with_row("t,x", 4, "0.4"), none(), "f.csv, line 6: 1 cells where the header has 2", "correct the row"),
        (with_row("t,x", 0, "0.4"), none(), "f.csv, line 2: 1 cells where the header has 2", "correct the row"),
        (with_row("t,x", 4, "0,4,1,5"), none(), "f.csv, line 6: 4 cells where the header has 2", "a decimal comma"),
        (
            file("s,x,record", |i| if i == 4 { "0.4,,a".into() } else { format!("{i},{},a", x(i)) }),
            rate(10.0),
            "f.csv, line 6, column `x`: the value is missing",
            "delete the row",
        ),
        (file("t,x", |i| format!("{i},")), none(), "f.csv, line 2, column `x`: the value is missing", "delete the row"),
        (with_row("t,x", 4, "0.4,o.5"), none(), "f.csv, line 6, column `x`: `o.5` is not a number", "correct the cell"),
        (
            with_row("# note\n\n\n  % more\nt,x [mm]", 0, "0.0,abc"),
            none(),
            "f.csv, line 6, column `x [mm]`: `abc` is not a number",
            "correct the cell",
        ),
        (with_row("t,x", 4, "0.4,1.000.5"), none(), "f.csv, line 6, column `x`: `1.000.5` is not a number", "correct"),
        (with_row("t,x", 4, "0.4,-inf"), none(), "f.csv, line 6, column `x`: `-inf` is not a finite number", "delete"),
        (
            with_row("t,x", 4, "0.4,1e999"),
            none(),
            "f.csv, line 6, column `x`: `1e999` is not a finite number",
            "delete",
        ),
        (with_row("t,x", 4, "0.4,-1e200"), none(), "f.csv, line 6, column `x`: `-1e200` is too large", "larger unit"),
        (
            with_row("t,x", 4, "0.4,\"1,5\""),
            none(),
            "f.csv, line 6, column `x`: `1,5`: decimal points and decimal commas are mixed",
            "with a decimal point",
        ),
        (
            with_row("t,x", 4, "0.3,1"),
            none(),
            "f.csv, line 6, column `t`: the time 0.3 is there twice",
            "give the sampling rate",
        ),
        (with_row("t,x", 4, "0.1,1"), none(), "f.csv, line 6, column `t`: the time falls from 0.3 to 0.1", "`record`"),
        (
            file("t [ms],x", |i| format!("{},{}", 10 * i * i + 10 * i, x(i))),
            none(),
            "f.csv, line 31, column `t [ms]`: the sampling is uneven: a step of 0.58 s where 0.3 s is usual (93.3 % off)",
            "give the sampling rate",
        ),
        ("t,x\n0,1\n1,2\n2,3\n".into(), none(), "f.csv: 3 samples are too few (at least 20)", "a longer measurement"),
        (
            file("t,x,id", |i| format!("{i},{},{}", x(i), i % 3)),
            none(),
            "f.csv: in the longest of 3 records, 10 samples are too few (at least 20)",
            "the column that tells the records apart",
        ),
        (
            file("t,x", |i| format!("{i},2.5")),
            none(),
            "f.csv, column `x`: the displacement is constant (2.5)",
            "x=NAME",
        ),
        (
            file("t,x1,x2", |i| format!("{i},{},0", x(i))),
            none(),
            "f.csv, column `x2`: the displacement is constant (0)",
            "check the sensor",
        ),
    ];
    for (text, options, message, advice) in cases {
        let error = read_text("folder/f.csv", &text, &options).expect_err(message);
        assert_eq!(error.to_string(), message);
        assert!(error.advice().contains(advice), "{message}\n{}", error.advice());
        assert!(!error.to_string().contains('\n') && !error.advice().contains('\n'), "{message}");
    }
}

#[test]
fn a_file_that_is_not_there_is_told_by_its_path() {
    let error = read_files(&["no/such/file.csv"], &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("no/such/file.csv: "), "{error}");
    assert!(error.advice().contains("check the path"));
}

#[test]
fn every_notice_says_what_was_done() {
    let none = ReadOptions::default;
    let even = |i: usize| format!("{:.2},{},{}", i as f64 / 100.0, x(i), x(i) + 1.0);
    let cases: Vec<(String, ReadOptions, &[&str])> = vec![
        (file("t,x,u", even), none(), &[]),
        (file("Rig 4;5\nt,x,u", even), none(), &["f.csv: line 1 above the header was skipped"]),
        (file("Rig 4\nby hand\n\nt,x,u", even), none(), &["f.csv: lines 1 to 3 above the header were skipped"]),
        (file("# t,x,u", even), none(), &["f.csv: the header was taken from the comment in line 1"]),
        (file("t_ms,x,u", even), none(), &["f.csv: time was converted from ms to s"]),
        (
            file("t,x_mm,u_base_m", even),
            none(),
            &["f.csv: input `u_base_m` was converted from m to mm, the displacement's unit"],
        ),
        (file("t,x,u,temperature", |i| even(i) + ",20"), none(), &["f.csv: column `temperature` is not used"]),
        (
            file("t,x,v_V", even),
            none(),
            &[
                "f.csv: column `v_V` is not taken for a velocity: its unit `V` is not that of a velocity; if it is one, say which column is which: v=v_V",
            ],
        ),
        (
            file("t,x,force,base", |i| even(i) + "," + &x(i + 1).to_string()),
            none(),
            &["f.csv: `force` is input u1 and `base` is input u2"],
        ),
        (
            file("t,x,u", even),
            rate(200.0),
            &["f.csv: the sampling rate given, 200 Hz, counts; the time column `t` does not"],
        ),
        (
            file("t,x,v", even),
            ReadOptions { kind: Kind::FirstOrder, ..none() },
            &["f.csv: the velocity `v` is state x2"],
        ),
        (file("t,x,u", |i| format!("{i},{},0.5", x(i))), none(), &["f.csv: input `u` is constant and was left out"]),
        (
            file("t,x,u1,u2", |i| format!("{i},{},0.5,{}", x(i), x(i))),
            none(),
            &["f.csv: input `u1` is constant and was left out", "f.csv: `u2` is now input u1"],
        ),
        (
            file("t,x,u1,u2", |i| format!("{i},{},0.5,7", x(i))),
            none(),
            &["f.csv: inputs `u1` and `u2` are constant and were left out"],
        ),
        (
            file("t,x,u,id", |i| format!("{},{i}", even(i))),
            none(),
            &["f.csv: column `id` differs in every row, so it was not taken to tell records apart"],
        ),
        (
            file("t,x", |i| format!("{},{}", if i == 0 { 0.999_999 } else { i as f64 / 1000.0 }, x(i))),
            none(),
            &["f.csv: the first time stamp, 0.999999, does not fit the others and was taken as 0"],
        ),
        (
            file("t,x", |i| format!("{:.3},{}", i as f64 * 0.0163, x(i))),
            none(),
            &[
                "f.csv: the time stamps are rounded to 0.001 s; the sampling was taken as even, one sample every 0.0163 s",
            ],
        ),
        (
            file("t,x", |i| format!("{},{}", i as f64 + if i == 5 { 0.005 } else { 0.0 }, x(i))),
            none(),
            &[
                "f.csv: the time stamps are up to 0.46 % of the interval of 1 s off an even grid; the samples were interpolated onto it",
            ],
        ),
        (
            file("t,x", |i| format!("{},{}", i + 4 * usize::from(i > 24), x(i))),
            none(),
            &[
                "f.csv: a gap of 5 s before line 27 (t = 29 s) splits the record",
                "f.csv: a stretch between gaps has fewer than 20 samples; it was left out",
            ],
        ),
        (
            {
                let mut text = file("t,x", |i| format!("{i},{}", x(i)));
                (0..120).for_each(|i| text += &format!("{},{}\n", 40 + i + 3 * (i / 30), x(i)));
                text
            },
            none(),
            &["f.csv: 4 gaps, the longest of 11 s before line 32 (t = 40 s), split the record"],
        ),
        (
            {
                let mut text = file("t,x", |i| format!("{i},{}", x(i)));
                (0..30).for_each(|i| text += &format!("{},1\n", 40 + i));
                text
            },
            none(),
            &[
                "f.csv: a gap of 11 s before line 32 (t = 40 s) splits the record",
                "f.csv: a stretch between gaps has no motion; it was left out",
            ],
        ),
        (
            {
                let mut text = file("t,x,run", |i| format!("{i},{},long", x(i)));
                (0..5).for_each(|i| text += &format!("{i},{},short\n", x(i)));
                text
            },
            none(),
            &["f.csv: record `short` has 5 samples where at least 20 are needed; it was left out"],
        ),
        (
            {
                let mut text = file("t,x,run", |i| format!("{i},{},long", x(i)));
                (0..9).for_each(|i| text += &format!("{i},{},short {}\n", x(i), i % 3));
                text
            },
            none(),
            &["f.csv: 3 records have fewer than 20 samples; they were left out"],
        ),
    ];
    for (text, options, wanted) in cases {
        let records = read_text("f.csv", &text, &options).unwrap_or_else(|e| panic!("{e}\n{wanted:?}"));
        assert_eq!(notices(&records), wanted);
    }
}

#[test]
fn a_gap_makes_two_records_of_one_interval() {
    let mut text = file("t,x", |i| format!("{:.2},{}", i as f64 * 0.01, x(i)));
    (0..40).for_each(|i| text += &format!("{:.2},{}\n", 2.0 + i as f64 * 0.01, x(i)));
    let records = read_text("f.csv", text, &ReadOptions::default()).unwrap();
    let parts: Vec<_> = records.iter().map(|r| (r.name.as_str(), r.start, r.interval, r.len())).collect();
    assert_eq!(parts, [("f part 1", 0.0, 0.01, 30), ("f part 2", 2.0, 0.01, 40)]);
}

#[test]
fn jitter_is_evened_out_close_to_the_truth() {
    let wave = |t: f64| (0.3 * t).sin();
    let stamp = |i: usize| i as f64 + 0.009 * (i as f64 * 12.9898).sin();
    let text = file("t,x", |i| format!("{},{}", stamp(i), wave(stamp(i))));
    let record = only("f", &text, &ReadOptions::default());
    for (i, value) in values(&record, Role::Displacement(0)).iter().enumerate() {
        // The cubic's own error: jitter 0.01 · ωΔt⁴/24 and the like; without interpolation it would be 3e-3.
        assert!((value - wave(record.time(i))).abs() < 3e-5, "{i}");
    }
}
