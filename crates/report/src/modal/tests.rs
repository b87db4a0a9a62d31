use super::*;
use sindyscope_core::study::Cancel;
use sindyscope_modes::{Base, analyse};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};

/// Two sensors of a mast after a blow, modes at 1.5 and 4 Hz; two records of different strength.
fn decays() -> ModalAnalysis {
    let value = |t: f64, strength: f64, second: f64| {
        let slow = (-0.1 * t).exp() * (std::f64::consts::TAU * 1.5 * t).cos();
        let fast = (-0.3 * t).exp() * (std::f64::consts::TAU * 4.0 * t).cos();
        strength * (slow + second * fast)
    };
    let mut records = RecordSet::default();
    for (name, strength) in [("soft", 1.0), ("hard", 3.0)] {
        let channel = |i: usize, second: f64| Channel {
            name: format!("a{}", i + 1),
            unit: "m/s^2".into(),
            role: Role::Acceleration(i),
            values: (0..1500).map(|k| value(0.02 * f64::from(k), strength, second)).collect(),
            estimated: false,
        };
        let channels = vec![channel(0, 0.5), channel(1, -0.8)];
        let (name, notices) = (name.into(), Vec::new());
        records.add([Record { name, source: None, start: 0.0, interval: 0.02, channels, notices }], Usage::Fit);
    }
    analyse(&records, &Base::default(), &|_, _| {}, &Cancel::default()).unwrap()
}

#[test]
fn every_view_draws_what_it_says() {
    let analysis = decays();
    let options = ModalOptions::default();
    let subject = ModalSubject { analysis: &analysis, record: 0, options: &options };
    let names = |view: ModalView| -> Vec<String> {
        let figure = view.figure(&subject).unwrap();
        figure.panels().flat_map(|p| p.layers.iter().map(|l| l.name.clone()).filter(|n| !n.is_empty())).collect()
    };
    assert_eq!(names(ModalView::Stabilization), ["spectrum", "new", "stable frequency", "and damping", "and shape"]);
    assert_eq!(
        names(ModalView::Responses),
        ["hard", "measured", "of the modes", "missed"],
        "the other record lies behind"
    );
    let shapes = names(ModalView::Shapes);
    assert_eq!(shapes, ["1", "2"]);
    let figure = ModalView::Shapes.figure(&subject).unwrap();
    let table = figure.table(figure.panels().nth(1).unwrap(), &(0.0..=1.0));
    assert!(table.starts_with("mode,with mode 1,with mode 2\n1,1,"), "{table}");
}

#[test]
fn one_mode_alone_has_a_bar_for_each_sensor() {
    let analysis = decays();
    let options = ModalOptions { mode: Some(1), ..ModalOptions::default() };
    let figure = ModalView::Shapes.figure(&ModalSubject { analysis: &analysis, record: 0, options: &options }).unwrap();
    let panel = figure.panels().next().unwrap();
    assert!(panel.title.starts_with("mode 2: 4.00"), "{}", panel.title);
    let heights: Vec<f64> = panel.columns[1].1.clone();
    assert!((heights[0] / heights[1] + 0.5 / 0.8).abs() < 0.01, "{heights:?}");
}

#[test]
fn a_shape_that_has_swung_half_a_cycle_is_turned_over() {
    let analysis = decays();
    let first = |swing: Option<f64>| -> Vec<[f64; 2]> {
        let options = ModalOptions { swing, ..ModalOptions::default() };
        let figure =
            ModalView::Shapes.figure(&ModalSubject { analysis: &analysis, record: 0, options: &options }).unwrap();
        let layer = figure.panels().next().unwrap().layers[0].clone();
        let crate::figure::Shape::Line(points) = layer.shape else { panic!("a line") };
        points.points.to_vec()
    };
    for (still, turned) in first(Some(0.0)).iter().zip(first(Some(std::f64::consts::PI))) {
        assert!((still[1] + turned[1]).abs() < 1e-12, "{still:?} {turned:?}");
    }
    // Nearly real shapes: as they are at their largest.
    assert!((first(None)[1][1] - first(Some(0.0))[1][1]).abs() < 1e-3);
}
