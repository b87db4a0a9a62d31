//! What the search finds on real measurements, as the table of docs/reference/figures.md:
//! `SINDYSCOPE_DATA=FOLDER cargo run --release --no-default-features --example measurements [NAME …]`.
//!
//! The folder (default `../shared/data`) is not part of the project; a set that is not there is said to be skipped.

use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use sindyscope_core::study::Cancel;
use sindyscope_files::{ReadOptions, read_files};
use sindyscope_search::{Ask, Diagnosis, Search};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{RecordSet, Usage};

/// Measurements of one thing: what is fitted, what is held out.
struct Set {
    name: &'static str,
    fit: &'static [&'static str],
    /// Nothing where the last record of the fitted file is held out.
    held_out: &'static [&'static str],
    columns: &'static str,
}

const SETS: &[Set] = &[
    Set {
        name: "friction rig, 3.6 Hz, tested on 2.0 Hz",
        fit: &["friction_rig_3.6Hz.csv"],
        held_out: &["friction_rig_2.0Hz.csv"],
        columns: "",
    },
    Set {
        name: "friction rig, 2.0 Hz, tested on 3.6 Hz",
        fit: &["friction_rig_2.0Hz.csv"],
        held_out: &["friction_rig_3.6Hz.csv"],
        columns: "",
    },
    Set {
        name: "Silverbox",
        fit: &["silverbox_multisine_1.csv"],
        held_out: &["silverbox_multisine_10.csv"],
        columns: "t=t_s,u=V1_in_V,x=V2_out_V",
    },
    Set {
        name: "magnet beam, decay",
        fit: &["magnet_beam_decay.csv"],
        held_out: &["magnet_beam_decay.csv"],
        columns: "",
    },
    Set {
        name: "ship roll at rest",
        fit: &["ship_roll_0kn_fit.csv"],
        held_out: &["ship_roll_0kn_heldout.csv"],
        columns: "",
    },
    Set {
        name: "ship roll at 15.5 kn, second record held out",
        fit: &["ship_roll_15kn.csv"],
        held_out: &[],
        columns: "",
    },
    Set {
        name: "Pohl's wheel, free",
        fit: &["pohl_1.3_200mA.csv"],
        held_out: &[],
        columns: "t=Zeit t / s,x=Weg &b_A1 / rad",
    },
    Set {
        name: "Pohl's wheel, driven",
        fit: &["pohl_2.1_200mA_4.csv"],
        held_out: &[],
        columns: "t=Zeit t / s,x=Weg &b_A1 / rad,u=Spannung U_B1 / V",
    },
    Set {
        name: "pendulum with spikes in the torque",
        fit: &["simple_pendulum_spikes.csv"],
        held_out: &[],
        columns: "u=torque",
    },
    Set { name: "rack and pinion", fit: &["rack_pinion_stroke.csv"], held_out: &[], columns: "u=force" },
    Set {
        name: "friction damper, second record held out",
        fit: &["friction_damper_1Hz_80lb.csv"],
        held_out: &[],
        columns: "u=force",
    },
    Set {
        name: "F-16, one accelerometer",
        fit: &["f16_acc1_force.csv"],
        held_out: &["f16_acc1_force_heldout.csv"],
        columns: "",
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::var_os("SINDYSCOPE_DATA").unwrap_or_else(|| "../shared/data".into()));
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!("| data | what is found | error on what was not fitted | noise | verdict | s |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for set in SETS.iter().filter(|s| wanted.is_empty() || wanted.iter().any(|w| s.name.contains(w.as_str()))) {
        if !set.fit.iter().chain(set.held_out).all(|file| folder.join(file).exists()) {
            println!("| {} | skipped: it is not in {} | | | | |", set.name, folder.display());
            continue;
        }
        let started = Instant::now();
        match search(set, &folder) {
            Ok((diagnosis, unit)) => println!("{}", line(set.name, &diagnosis, &unit, started.elapsed().as_secs_f64())),
            Err(error) => println!("| {} | {error} | | | | |", set.name),
        }
    }
    Ok(())
}

fn search(set: &Set, folder: &std::path::Path) -> Result<(Diagnosis, String), Box<dyn Error>> {
    let mut options = ReadOptions::default();
    if !set.columns.is_empty() {
        options.columns = set.columns.parse()?;
    }
    let read = |files: &[&str]| -> Result<_, Box<dyn Error>> {
        let paths: Vec<PathBuf> = files.iter().map(|f| folder.join(f)).collect();
        Ok(read_files(&paths, &options)?)
    };
    let mut fitted = read(set.fit)?;
    let last = if set.held_out.is_empty() && fitted.len() > 1 { fitted.pop() } else { None };
    let unit = fitted.first().and_then(|r| Some(r.sensor(0)?.unit.clone())).unwrap_or_default();
    let mut records = RecordSet::new(fitted, Usage::Fit);
    // One file that is both: the search holds out a part of it.
    let other = if set.held_out == set.fit { &[][..] } else { set.held_out };
    let held_out = if other.is_empty() { last.into_iter().collect() } else { read(other)? };
    records.add(held_out, Usage::HeldOut);
    let diagnosis = Search::new(&records, &Ask::default())?.diagnose(&|_| {}, &Cancel::default())?;
    Ok((diagnosis, unit))
}

fn line(name: &str, diagnosis: &Diagnosis, unit: &str, seconds: f64) -> String {
    let error = |stage: Option<&std::sync::Arc<sindyscope_search::Stage>>| {
        stage.and_then(|s| s.gap.test_rmse).map_or_else(|| "–".to_owned(), |e| format_si(e, unit, 3))
    };
    let last = diagnosis.stages.last();
    let effects: Vec<String> = last
        .iter()
        .flat_map(|s| &s.effects)
        .map(|e| {
            let size = e.parameters.first().map(|p| format!(" ({} {} {})", p.name, format_si(p.value, "", 3), p.unit));
            format!("{}{}", e.title, size.unwrap_or_default())
        })
        .collect();
    format!(
        "| {name} | {} | {} → {} | {} | {} | {seconds:.0} |",
        if effects.is_empty() { "nothing".to_owned() } else { effects.join(", ") },
        error(diagnosis.stages.first()),
        error(last),
        format_si(diagnosis.noise_floor, unit, 2),
        diagnosis.verdict.word(),
    )
}
