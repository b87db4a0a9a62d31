//! `sindyscope batch` ended by force and begun again.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Records of the batch, and how often it is killed.
const RECORDS: usize = 160;
const KILLS: usize = 10;

fn program() -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_sindyscope"));
    program.stdout(Stdio::piped()).stderr(Stdio::piped());
    program
}

/// Runs the batch to its end and gives what it printed.
fn finish(home: &Path, out: &str, more: &[&str]) -> String {
    let mut batch = program();
    batch.current_dir(home).args(["batch", "runs", "--settings", "settings.toml", "--out", out]).args(more);
    let done = batch.output().expect("the program runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8_lossy(&done.stdout).into_owned()
}

fn lines(journal: &Path) -> usize {
    fs::read(journal).map_or(0, |text| text.iter().filter(|b| **b == b'\n').count())
}

/// Decays of 4 s, each of another stiffness; long enough to be killed amid, settings given to be fast.
fn records(home: &Path) {
    fs::create_dir(home.join("runs")).expect("a folder");
    for k in 0..RECORDS {
        let file = format!("runs/run{k:03}.csv");
        let stiffness = format!("k={}", 250 + 5 * k);
        let made = program()
            .current_dir(home)
            .args(["generate", "friction-decay", "--duration", "4", "--set", &stiffness, "--out", &file])
            .status();
        assert!(made.expect("the program runs").success());
    }
    let settings = "terms = \"x, v, sgn(v)\"\nwindow = 15\norder = 5\nthreshold = 0\nrefine = true\n";
    fs::write(home.join("settings.toml"), settings).expect("written");
}

#[test]
fn killed_ten_times_every_record_is_done_once() {
    let home = tempfile::tempdir().expect("a folder");
    let home = home.path();
    records(home);
    assert!(finish(home, "whole.csv", &[]).starts_with(&format!("{RECORDS} records: {RECORDS} done now, 0 before")));

    let journal = home.join("killed.csv.journal");
    for kill in 0..KILLS {
        let before = lines(&journal);
        let mut batch = program();
        batch.current_dir(home).args(["batch", "runs", "--settings", "settings.toml", "--out", "killed.csv"]);
        batch.args(["--reports", "reports"]);
        let mut running = batch.spawn().expect("the program runs");
        let begun = Instant::now();
        // The head of the journal counts as a line; the kill falls anywhere in what follows.
        while lines(&journal) < before.max(1) + 1 && begun.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(2 * (kill as u64 % 4)));
        assert!(running.try_wait().expect("a process").is_none(), "kill {kill} came too late to be one");
        running.kill().expect("killed");
        running.wait().expect("a process");
        assert!(!home.join("killed.csv").exists());
        for report in fs::read_dir(home.join("reports")).expect("a folder").flatten() {
            let text = fs::read_to_string(report.path()).expect("text");
            let whole = report.path().extension().is_some_and(|e| e == "html");
            assert!(!whole || text.trim_end().ends_with("</html>"), "{} is half written", report.path().display());
        }
    }
    let said = finish(home, "killed.csv", &["--reports", "reports"]);
    let now: usize = said.split(' ').nth(2).and_then(|n| n.parse().ok()).expect("a number");
    assert!(now < RECORDS && said.contains(&format!("{now} done now, {} before, 0 failed", RECORDS - now)), "{said}");
    let read = |name: &str| fs::read_to_string(home.join(name)).expect("a table");
    assert_eq!(read("killed.csv"), read("whole.csv"));
    // Every record stands in the journal once: none was done a second time.
    let text = read("killed.csv.journal");
    let mut keys: Vec<&str> = text.lines().skip(1).filter_map(|line| line.split('"').nth(3)).collect();
    assert_eq!(keys.len(), RECORDS);
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), RECORDS);
    assert_eq!(fs::read_dir(home.join("reports")).expect("a folder").count(), RECORDS);
}

#[test]
fn two_halves_joined_are_the_whole() {
    let home = tempfile::tempdir().expect("a folder");
    let home = home.path();
    records(home);
    finish(home, "whole.csv", &[]);
    assert!(
        finish(home, "joined.csv", &["--part", "1/2"]).ends_with(&format!("{} left to other parts\n", RECORDS / 2))
    );
    assert!(finish(home, "joined.csv", &["--part", "2/2"]).contains("all parts are done"));
    assert!(finish(home, "joined.csv", &[]).contains(" 0 done now"));
    assert_eq!(fs::read(home.join("joined.csv")).expect("a table"), fs::read(home.join("whole.csv")).expect("a table"));
}
