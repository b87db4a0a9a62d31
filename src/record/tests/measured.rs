//! Real measurements, where the folder with them is at hand.

use super::*;

fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("SINDYSCOPE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: the measurements are not at hand; SINDYSCOPE_DATA names their folder");
    None
}

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
    assert!(matches!(error, ReadError::NoDisplacement { .. }), "{error}");
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
