//! Real measurements, where the folder with them is at hand.

#[path = "../../../../tests/measurements/mod.rs"]
mod measurements;

use super::*;
pub(super) use measurements::folder;

#[test]
fn the_friction_rig_reads_as_it_is() {
    let Some(folder) = folder() else { return };
    let paths = ["friction_rig_2.0Hz.csv", "friction_rig_3.6Hz.csv"].map(|name| folder.join(name));
    let records = read_files(&paths, &ReadOptions::default()).unwrap();
    for (record, samples) in records.iter().zip([122_647, 138_212]) {
        assert_eq!((record.start, record.interval, record.len()), (0.0, 0.0005, samples));
        let channels: Vec<_> = record.channels.iter().map(|c| (c.role, c.name.as_str(), c.unit.as_str())).collect();
        assert_eq!(channels, [(Role::Displacement(0), "x_mass", "m"), (Role::Input(0), "u_base", "m")]);
        assert_eq!(record.notices, [] as [&str; 0]);
    }
    assert_eq!(values(&records[0], Role::Displacement(0)).last(), Some(&-0.002_279_86));
}

#[test]
fn the_silverbox_needs_to_be_told_its_columns() {
    let Some(folder) = folder() else { return };
    let path = folder.join("silverbox_multisine_1.csv");
    let error = read_files(&[&path], &ReadOptions::default()).unwrap_err();
    assert!(matches!(*error.problem, ReadProblem::NoDisplacement { .. }), "{error}");
    let options = ReadOptions { columns: "x=V2_out_V,u=V1_in_V".parse().unwrap(), ..ReadOptions::default() };
    let record = &read_files(&[&path], &options).unwrap()[0];
    assert_eq!((record.interval, record.len()), (0.0016384, 8690));
    assert_eq!(record.channel(Role::Displacement(0)).unwrap().unit, "V");
    assert_eq!(record.notices, [] as [&str; 0]);
}

#[test]
fn the_magnet_beam_has_no_input() {
    let Some(folder) = folder() else { return };
    let record = &read_files(&[folder.join("magnet_beam_decay.csv")], &ReadOptions::default()).unwrap()[0];
    assert_eq!((record.interval, record.len(), record.channels.len()), (0.001, 4000, 1));
    assert_eq!(record.channels[0].unit, "microstrain");
}

#[test]
fn uneven_and_gappy_measurements_are_read() {
    let Some(folder) = folder() else { return };
    let pohl = "t=Zeit t / s,x=Weg &b_A1 / rad,u=Spannung U_B1 / V";
    for (name, columns, interval, samples) in [
        ("pohl_1.3_200mA.csv", pohl, 0.1, 709),
        ("pohl_2.1_200mA_4.csv", pohl, 0.1, 1326),
        ("ship_roll_0kn_fit.csv", "", 0.01, 4000),
        ("ship_roll_0kn_heldout.csv", "", 0.01, 6000),
        ("ship_roll_15kn.csv", "", 0.01, 2540),
        ("double_pendulum_fit.csv", "u1=torque1,u2=torque2", 0.005, 1998),
        ("double_pendulum_heldout.csv", "u1=torque1,u2=torque2", 0.005, 1998),
        ("rack_pinion_stroke.csv", "", 1.0 / 1500.0, 807),
        ("simple_pendulum_spikes.csv", "u=torque", 1.0 / 300.0, 1170),
        ("friction_damper_1Hz_80lb.csv", "", 1.0 / 1024.0, 5120),
    ] {
        let options = ReadOptions { columns: columns.parse().unwrap(), ..ReadOptions::default() };
        let records = read_files(&[folder.join(name)], &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        let record = &records[0];
        assert!((record.interval / interval - 1.0).abs() < 1e-3, "{name}: {}", record.interval);
        assert!(record.len().abs_diff(samples) <= 1, "{name}: {}", record.len());
        assert!(record.channels.iter().flat_map(|c| &c.values[..]).all(|v| v.is_finite()));
    }
}
