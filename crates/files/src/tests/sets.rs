//! Records together: names, cuts, what they must have in common.

use std::path::PathBuf;

use super::*;

fn record(name: &str, header: &str) -> Record {
    let columns = header.split(',').count();
    let text = file(header, |i| {
        (0..columns).map(|c| if c == 0 { i.to_string() } else { x(i + c).to_string() }).collect::<Vec<_>>().join(",")
    });
    only(&format!("{name}.csv"), &text, &ReadOptions::default())
}

#[test]
fn a_slice_keeps_its_time() {
    let whole = record("a", "t,x,u");
    let cut = whole.slice(10..20);
    assert_eq!((cut.start, cut.len(), cut.time(3)), (10.0, 10, whole.time(13)));
    assert_eq!(values(&cut, Role::Input(0)), values(&whole, Role::Input(0))[10..20]);
    assert_eq!(whole.between(10.0, 20.0), cut);
    let (early, late) = whole.split_at(9.5);
    assert_eq!((early.len(), late.len(), late.start), (10, 20, 10.0));
    for (range, left) in [(5..500, 25), (40..50, 0), (30..30, 0)] {
        assert_eq!(whole.slice(range).len(), left);
    }
    #[expect(clippy::reversed_empty_ranges, reason = "a range the wrong way round must do no harm")]
    let none = whole.slice(20..10);
    assert!(none.is_empty());
}

#[test]
fn times_lead_back_to_their_index() {
    let mut whole = record("a", "t,x");
    (whole.start, whole.interval) = (0.1, 0.0016384);
    for index in 0..whole.len() {
        assert_eq!(whole.index_at(whole.time(index)), index);
    }
    for (time, index) in [(f64::NEG_INFINITY, 0), (f64::INFINITY, 30), (f64::NAN, 0)] {
        assert_eq!(whole.index_at(time), index);
    }
}

#[test]
fn a_set_has_one_layout() {
    let layout = |records: Vec<Record>| RecordSet::new(records, Usage::Fit).layout(Kind::SecondOrder);
    let want = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };
    assert_eq!(layout(vec![record("a", "t,x,u"), record("b", "t,x,v,u [V]")]), Ok(want));
    for (a, b, message) in [
        ("t,x,u", "t,x", "record `b` has no input u, record `a` has"),
        ("t,x", "t,x,u", "record `a` has no input u, record `b` has"),
        ("t,x,u1,u2", "t,x,u1", "record `b` has no input u2, record `a` has"),
        ("t,x", "t,x1,x2", "record `a` has no displacement x2, record `b` has"),
        ("t,x [mm]", "t,x [m]", "displacement x is in mm in record `a` and in m in record `b`"),
    ] {
        assert_eq!(layout(vec![record("a", a), record("b", b)]), Err(message.into()));
    }
    assert_eq!(layout(Vec::new()), Err("there is no record to use".into()));
    let mut set = RecordSet::new([record("a", "t,x")], Usage::Fit);
    set.add([record("b", "t,x1,x2")], Usage::Off);
    assert!(set.layout(Kind::SecondOrder).is_ok());
}

use sindyscope_values::term::Layout;

#[test]
fn names_in_a_set_are_unique() {
    let folder = tempfile::tempdir().unwrap();
    let text = file("t,x,run", |i| format!("{i},{},A", x(i)));
    let paths: Vec<PathBuf> = ["one/tone.csv", "two/tone.csv", "three/other.csv", "other.csv"]
        .iter()
        .map(|name| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, &text).unwrap();
            path
        })
        .collect();
    let records = read_files(&paths, &ReadOptions::default()).unwrap();
    let names: Vec<&str> = records.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["A", "tone A", "other A", "A (2)"]);
    assert_eq!(records[1].source.as_ref(), Some(&paths[1]));
}

#[test]
fn an_input_at_rest_in_some_records_only_stays() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, base: fn(usize) -> f64| {
        let path = folder.path().join(name);
        std::fs::write(&path, file("t,x,u", |i| format!("{i},{},{}", x(i), base(i)))).unwrap();
        path
    };
    let (forced, decay) = (write("forced.csv", |i| x(i + 1)), write("decay.csv", |_| 0.0));
    let set = read_set(&[&forced], &[&decay], &ReadOptions::default()).unwrap();
    assert_eq!(set.layout(Kind::SecondOrder).unwrap().inputs, 1);
    let usages: Vec<Usage> = set.entries.iter().map(|(_, usage)| *usage).collect();
    assert_eq!(usages, [Usage::Fit, Usage::HeldOut]);
    assert_eq!(read_set(&[&decay], &[], &ReadOptions::default()).unwrap().layout(Kind::SecondOrder).unwrap().inputs, 0);
    let keep = ReadOptions { keep_constant_inputs: true, ..ReadOptions::default() };
    assert_eq!(read_files(&[&decay], &keep).unwrap()[0].channels.len(), 2);
}

/// Two files with these headers, whose every channel holds the same numbers times a factor.
fn pair(first: &str, second: &str, factor: f64) -> Result<RecordSet, ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, header: &str, factor: f64| {
        let path = folder.path().join(name);
        let columns = header.split(',').count();
        let cell = |i: usize, c: usize| if c == 0 { i.to_string() } else { (factor * x(i + c)).to_string() };
        std::fs::write(&path, file(header, |i| (0..columns).map(|c| cell(i, c)).collect::<Vec<_>>().join(",")))
            .unwrap();
        path
    };
    read_set(&[&write("a.csv", first, 1.0)], &[&write("b.csv", second, factor)], &ReadOptions::default())
}

#[test]
fn a_set_has_one_unit_a_quantity() {
    for (first, second, factor, units) in [
        ("t,x [m],u [kN]", "t,x [mm],u [N]", 1e3, "m kN"),
        ("t,x [mm],v [mm/s]", "t,x [m],v [m/s]", 1e-3, "mm mm/s"),
        ("t,x [rad]", "t,x [deg]", 180.0 / std::f64::consts::PI, "rad"),
        ("t,x [V],u [V]", "t,x [mV],u [mV]", 1e3, "V V"),
        ("t,x [m]", "t,x [metre]", 1.0, "m"),
    ] {
        let set = pair(first, second, factor).unwrap();
        let (a, b) = (&set.entries[0].0, &set.entries[1].0);
        for (one, two) in a.channels.iter().zip(&b.channels) {
            assert_eq!(one.unit, two.unit, "{second}");
            for (p, q) in one.values.iter().zip(&two.values[..]) {
                assert!((p - q).abs() <= 1e-12 * p.abs(), "{second}: {p} {q}");
            }
        }
        let found: Vec<&str> = b.channels.iter().map(|c| c.unit.as_str()).collect();
        assert_eq!(found.join(" "), units);
        let told = b.notices.iter().any(|n| n.contains("was converted from"));
        assert_eq!(told, factor != 1.0, "{:?}", b.notices);
    }
}

#[test]
fn rates_that_the_first_file_lacks_follow_its_displacement() {
    let set = pair("t,x [m]", "t,x [mm],v [mm/s]", 1e3).unwrap();
    let velocity = set.entries[1].0.channel(Role::Velocity(0)).unwrap();
    assert_eq!((velocity.unit.as_str(), velocity.values[0]), ("m/s", x(2)));
}

#[test]
fn a_file_without_a_unit_takes_the_others_and_says_so() {
    let set = pair("t,x [mm]", "t,x", 2.0).unwrap();
    let other = &set.entries[1].0;
    assert_eq!(other.channels[0].unit, "mm");
    assert_eq!(other.notices, ["b.csv: displacement `x` has no unit; it is taken to be in mm, as in a.csv"]);
    assert_eq!(pair("t,x", "t,x", 2.0).unwrap().entries[1].0.notices, [""; 0]);
}

#[test]
fn quantities_that_cannot_be_one_are_refused() {
    for (first, second, message) in [
        (
            "t,x [m]",
            "t,x [rad]",
            "b.csv: the displacement `x` is in rad, in a.csv it is in m: these cannot be one quantity",
        ),
        (
            "t,x [m],u [N]",
            "t,x [m],u [V]",
            "b.csv: the input `u` is in V, in a.csv it is in N: these cannot be one quantity",
        ),
    ] {
        let error = pair(first, second, 1.0).unwrap_err();
        assert_eq!(error.to_string(), message);
    }
}

#[test]
fn the_file_dialog_knows_the_endings() {
    assert!(FORMATS.iter().any(|f| f.extensions.contains(&"csv") && f.extensions.contains(&"txt")));
}
