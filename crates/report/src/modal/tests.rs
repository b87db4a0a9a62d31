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
fn stable_poles_are_clustered_and_their_spread_is_told() {
    let analysis = decays();
    let clusters = &analysis.stabilization.clusters;
    let near = |f: f64| clusters.iter().find(|c| (c.frequency.0 / f - 1.0).abs() < 1e-3).expect("a cluster");
    for (mode, f) in analysis.structure.modes.iter().zip([1.5, 4.0]) {
        let cluster = near(f);
        assert!(cluster.members.len() >= 10 && cluster.frequency.1 < 0.01 * f, "{cluster:?}");
        assert!((cluster.damping.0 - mode.damping).abs() < 0.2 * mode.damping, "{cluster:?}");
    }
    assert!(analysis.quality.iter().all(|q| q.cluster.is_some()));
    let options = ModalOptions::default();
    let subject = ModalSubject { analysis: &analysis, record: 0, options: &options };
    let figure = ModalView::Stabilization.figure(&subject).unwrap();
    let panel = figure.panels().next().unwrap();
    let column = |head: &str| &panel.columns.iter().find(|(h, _)| h == head).expect("a column").1;
    let told = column("cluster").iter().filter(|c| c.is_finite()).count();
    assert_eq!(told, clusters.iter().map(|c| c.members.len()).sum::<usize>());
    assert!(column("spread of f (Hz)").iter().filter(|v| v.is_finite()).all(|v| *v >= 0.0));
}

#[test]
fn shapes_stand_where_their_sensors_do() {
    let mut analysis = decays();
    let options = ModalOptions::default();
    let drawn = |analysis: &ModalAnalysis| {
        let figure = ModalView::Shapes.figure(&ModalSubject { analysis, record: 0, options: &options }).unwrap();
        let panel = figure.panels().next().unwrap().clone();
        let crate::figure::Shape::Line(points) = panel.layers[1].shape.clone() else { panic!("a line") };
        (panel, points.points.to_vec())
    };
    let shape = analysis.structure.modes[0].shape.clone();
    // The second sensor stands below the first one.
    analysis.positions = vec![vec![3.0], vec![1.5]];
    let (panel, points) = drawn(&analysis);
    assert_eq!(points, [[1.5, shape[1]], [3.0, shape[0]]]);
    assert_eq!(panel.columns.last().unwrap(), &("position".to_owned(), vec![3.0, 1.5]));
    // A tower: what swings moves sideways.
    analysis.positions = vec![vec![0.0, 3.0], vec![0.0, 1.0]];
    let (_, points) = drawn(&analysis);
    assert_eq!([points[0][1], points[1][1]], [1.0, 3.0]);
    assert!((points[1][0] - REACH_OF_TWO_METRES * shape[0]).abs() < 1e-12, "{points:?}");
}

/// A fifth of the tower's extent.
const REACH_OF_TWO_METRES: f64 = 0.4;

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
fn complex_shapes_are_drawn_in_the_complex_plane_and_real_ones_are_not() {
    let mut analysis = decays();
    let panels = |analysis: &ModalAnalysis, swing: Option<f64>| -> Vec<crate::figure::Panel> {
        let options = ModalOptions { swing, ..ModalOptions::default() };
        let figure = ModalView::Shapes.figure(&ModalSubject { analysis, record: 0, options: &options }).unwrap();
        figure.panels().cloned().collect()
    };
    analysis.structure.modes.iter_mut().for_each(|mode| mode.phase = vec![0.0, 1e-3]);
    assert!(panels(&analysis, None).iter().all(|p| p.id != "complex plane"));
    // The second sensor of the faster mode comes half a radian late.
    let mode = &mut analysis.structure.modes[1];
    mode.phase = vec![0.0, -0.5];
    let shape = mode.shape.clone();
    let drawn = panels(&analysis, None).into_iter().find(|p| p.id == "complex plane").expect("a panel");
    assert_eq!(drawn.layers.iter().filter(|l| !l.name.is_empty()).map(|l| l.name.as_str()).collect::<Vec<_>>(), ["2"]);
    let imaginary = &drawn.columns[1];
    assert_eq!(imaginary.0, "mode 2 imaginary part");
    assert!(imaginary.1[0].abs() < 1e-12 && (imaginary.1[1] + shape[1] * 0.5_f64.sin()).abs() < 1e-12, "{imaginary:?}");
    // A quarter of a cycle on all have turned by as much.
    let quarter = std::f64::consts::FRAC_PI_2;
    let turned = panels(&analysis, Some(quarter)).into_iter().find(|p| p.id == "complex plane").expect("a panel");
    for (still, on) in imaginary.1.iter().zip(&turned.columns[0].1) {
        assert!((still + on).abs() < 1e-12, "{still} {on}");
    }
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
