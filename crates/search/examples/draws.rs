//! Draws hidden effects of a kind of laboratory and says what the search makes of each:
//! `cargo run --profile study -p sindyscope-search --example draws -- REGIME [FROM TO]`.

#[allow(dead_code, clippy::unwrap_used, reason = "the studies use the rest, and are tests")]
#[path = "../tests/study/mod.rs"]
mod study;

use sindyscope_rig::hidden::Regime;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let regime: Regime = given.first().ok_or("name a regime")?.parse()?;
    let bound = |k: usize, usual: u64| given.get(k).map_or(Ok(usual), |text| text.parse());
    let (from, to) = (bound(1, 0)?, bound(2, 10)?);
    let cases = study::in_regime(regime, to);
    let results = study::run_all(&cases[from as usize..]);
    for r in &results {
        println!(
            "{} seed {}: {:?} {:?} or {:?}; held out {:.1} → {:.2} noises, {:.2} s",
            r.case.effects.join("+"),
            r.case.seed,
            r.verdict,
            r.steps,
            r.others,
            r.base,
            r.last,
            1e-3 * r.milliseconds
        );
    }
    results.iter().filter_map(study::miss).for_each(|line| println!("{line}"));
    println!("{}\n{}", study::REGIME_HEADING, study::regime_line(regime, to - from, &results));
    Ok(())
}
