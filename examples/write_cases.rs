//! Writes cases of the virtual rig, each with what it hides beside it:
//! `cargo run --release --example write_cases -- FOLDER [CASES A REGIME] [REGIME …]`.
//!
//! Every case is `FOLDER/REGIME-SEED/{train.csv,test.csv,truth.json}`. A table has the columns record, t, x and, where there is an
//! input, u.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use sindyscope_rig::hidden::{Hidden, Regime, draw_in};
use sindyscope_values::record::{Record, Role};
use sindyscope_values::term::Term;

fn main() -> Result<(), Box<dyn Error>> {
    let mut given = std::env::args().skip(1);
    let folder = given.next().ok_or("give a folder")?;
    let count: u64 = given.next().map_or(Ok(20), |n| n.parse())?;
    let regimes: Vec<Regime> = given.map(|name| name.parse()).collect::<Result<_, _>>()?;
    for regime in if regimes.is_empty() { Regime::ALL.to_vec() } else { regimes } {
        for seed in 0..count {
            match draw_in(regime, seed) {
                Ok(hidden) => write(&Path::new(&folder).join(format!("{regime}-{seed:03}")), regime, &hidden)?,
                Err(error) => eprintln!("{error}"),
            }
        }
    }
    Ok(())
}

fn write(folder: &Path, regime: Regime, hidden: &Hidden) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("train.csv"), table(&hidden.fit))?;
    std::fs::write(folder.join("test.csv"), table(&hidden.held_out))?;
    let driven = hidden.fit.iter().any(|r| r.channel(Role::Input(0)).is_some());
    let usual = match (hidden.base_excited, driven) {
        (true, _) => "x-u,v-du",
        (false, true) => "x,v,u",
        (false, false) => "x,v",
    };
    let join = |terms: &Vec<Term>| terms.iter().map(Term::as_str).collect::<Vec<_>>().join(",");
    let truth = &hidden.truth;
    let names: Vec<&str> = match truth.effects.as_slice() {
        [] => vec!["nothing_missing"],
        effects => effects.iter().map(String::as_str).collect(),
    };
    let told = json!({
        "regime": regime.name(),
        "hidden": names,
        "base_terms": hidden.base.as_ref().map_or_else(|| usual.to_owned(), join),
        "noise_sd": truth.noise,
        "ratio": truth.ratio,
        "beyond_base": truth.beyond_base,
        "description": truth.description,
    });
    std::fs::write(folder.join("truth.json"), serde_json::to_string_pretty(&told)?)?;
    Ok(())
}

/// One table of all records.
fn table(records: &[Record]) -> String {
    let driven = records.iter().any(|r| r.channel(Role::Input(0)).is_some());
    let mut text = String::from(if driven { "record,t,x,u\n" } else { "record,t,x\n" });
    for (index, record) in records.iter().enumerate() {
        let column = |role| record.channel(role).map_or(&[][..], |c| &c.values);
        let (x, u) = (column(Role::Displacement(0)), column(Role::Input(0)));
        for (k, x) in x.iter().enumerate() {
            let _ = write!(text, "{index},{},{x}", record.time(k));
            if let Some(u) = u.get(k) {
                let _ = write!(text, ",{u}");
            }
            text.push('\n');
        }
    }
    text
}
