//! `watch`, as it is used: sources that grow, stutter, stop and come back.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, Write};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_values::record::Role;

/// What a stream of the Duffing oscillator is identified with: no choice is waited for.
const SETTINGS: [&str; 12] = [
    "--terms",
    "x, v, u, x^3",
    "--window",
    "31",
    "--order",
    "5",
    "--threshold",
    "0.02",
    "--last",
    "60",
    "--every",
    "5",
];

fn rows(seconds: f64, seed: u64) -> Vec<String> {
    let options = ScenarioOptions { duration: Some(seconds), seed, ..ScenarioOptions::default() };
    let record = generate("duffing-multisine", &options).unwrap().records.remove(0);
    let values = |role| record.channel(role).unwrap().values.clone();
    let (x, u) = (values(Role::Displacement(0)), values(Role::Input(0)));
    let row = |k: usize| format!("{:.2},{},{}\n", record.time(k), x[k], u[k]);
    std::iter::once("t [s],x [m],u [m/s^2]\n".to_owned()).chain((0..record.len()).map(row)).collect()
}

/// A run of `watch`, whose lines come as they are printed.
struct Watching {
    child: Child,
    lines: Receiver<String>,
}

impl Watching {
    fn start(source: &str, more: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sindyscope"));
        command.args(["watch", source]).args(SETTINGS).args(more);
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || out.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        Self { child, lines }
    }

    /// The next line in which something is so.
    fn line(&self, what: &str, so: impl Fn(&str) -> bool) -> String {
        let patience = Instant::now() + Duration::from_secs(60);
        while let Ok(line) = self.lines.recv_timeout(patience.saturating_duration_since(Instant::now())) {
            if so(&line) {
                return line;
            }
        }
        panic!("{what}");
    }

    /// Ends it as Ctrl+C does; the summary.
    fn interrupt(mut self) -> Value {
        let done = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        assert!(done.success());
        let summary = self.line("a summary", |line| line.contains("\"summary\""));
        assert!(self.child.wait().unwrap().success());
        serde_json::from_str::<Value>(&summary).unwrap()["summary"].clone()
    }
}

fn append(path: &Path, text: &str) {
    OpenOptions::new().create(true).append(true).open(path).unwrap().write_all(text.as_bytes()).unwrap();
}

fn spring(line: &str) -> f64 {
    let update: Value = serde_json::from_str(line).unwrap();
    let terms = update["equations"][1]["terms"].as_array().unwrap().clone();
    terms.iter().find(|t| t["term"] == "x^3").unwrap()["coefficient"].as_f64().unwrap()
}

/// The time of a line.
fn time(line: &str) -> f64 {
    serde_json::from_str::<Value>(line).unwrap()["time"].as_f64().unwrap_or(0.0)
}

#[test]
#[cfg(unix)]
fn a_file_that_is_not_there_yet_grows_and_is_replaced_loses_no_row() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("log.csv");
    let watching = Watching::start(path.to_str().unwrap(), &["--json"]);
    std::thread::sleep(Duration::from_millis(200));
    let rows = rows(200.0, 2);
    append(&path, &rows[..7000].concat());
    let first = watching.line("it is identified", |line| line.contains("equations"));
    assert!((spring(&first) + 0.6).abs() < 0.05, "{first}");
    // Half a line, then the other half and more.
    append(&path, &rows[7000][..5]);
    std::thread::sleep(Duration::from_millis(200));
    append(&path, &rows[7000][5..]);
    append(&path, &rows[7001..9000].concat());
    watching.line("it goes on", |line| time(line) > 80.0);
    // The logger puts the file aside and goes on in a new one, with a header; its clock runs on.
    append(&path, &rows[9000..9100].concat());
    std::fs::rename(&path, home.path().join("log.1")).unwrap();
    append(&path, &rows[0]);
    append(&path, &rows[9100..15_000].concat());
    let last = watching.line("it goes on in the new file", |line| time(line) > 140.0);
    assert!((spring(&last) + 0.6).abs() < 0.02, "{last}");
    let summary = watching.interrupt();
    assert_eq!(summary["rows"], 14_999);
    assert_eq!(
        [&summary["gaps"], &summary["restarts"], &summary["late"], &summary["alarms"]].map(|v| v.as_u64()),
        [Some(0); 4]
    );
}

#[test]
#[cfg(unix)]
fn datagrams_whose_sender_repeats_itself_and_comes_back_count_once() {
    let address = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let watching = Watching::start(&format!("udp://{address}"), &["--json"]);
    std::thread::sleep(Duration::from_millis(500));
    let rows = rows(200.0, 4);
    let send = |rows: &[String]| {
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        for (k, datagram) in rows.chunks(20).enumerate() {
            sender.send_to(datagram.concat().as_bytes(), address).unwrap();
            // Every tenth is sent twice, as by a network that doubts itself.
            if k % 10 == 0 {
                sender.send_to(datagram.concat().as_bytes(), address).unwrap();
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    };
    send(&rows[..10_000]);
    watching.line("it is identified", |line| line.contains("equations"));
    // The sender is started anew: a header, and its time runs on after three seconds.
    send(&[&rows[..1], &rows[10_300..18_000]].concat());
    let last = watching.line("it goes on", |line| time(line) > 170.0);
    assert!((spring(&last) + 0.6).abs() < 0.02, "{last}");
    let summary = watching.interrupt();
    assert_eq!(summary["rows"], 9_999 + 7_700, "{summary}");
    assert_eq!((summary["gaps"].as_u64(), summary["restarts"].as_u64()), (Some(1), Some(0)), "{summary}");
    assert!(summary["repeated"].as_u64().unwrap() > 1500, "{summary}");
}

#[test]
fn standard_input_ends_with_a_summary_and_a_closed_pipe_ends_it() {
    let rows = rows(150.0, 3);
    let home = tempfile::tempdir().unwrap();
    let table = home.path().join("table.csv");
    let mut watching = Watching::start("-", &["--out", table.to_str().unwrap()]);
    let mut input = watching.child.stdin.take().unwrap();
    input.write_all(rows.concat().as_bytes()).unwrap();
    drop(input);
    watching.line("an equation", |line| line.contains("dv/dt:") && line.contains("x^3") && line.contains("±"));
    watching.line("a summary", |line| line.contains("15000 rows, 0 alarms"));
    assert!(watching.child.wait().unwrap().success());
    let table = std::fs::read_to_string(table).unwrap();
    assert!(table.starts_with("time,") && table.lines().count() > 10, "{table}");

    let mut command = Command::new(env!("CARGO_BIN_EXE_sindyscope"));
    let mut child = command
        .args(["watch", "-"])
        .args(SETTINGS)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Nobody reads: the first line that is printed ends it.
    drop(child.stdout.take());
    let mut input = child.stdin.take().unwrap();
    let _ = input.write_all(rows.concat().as_bytes());
    drop(input);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && !said.contains("panicked"), "{said}");
}

#[test]
fn what_cannot_be_watched_is_refused_in_a_sentence() {
    let refused = |source: &str, input: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sindyscope"));
        command.args(["watch", source]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
        let output = child.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert_eq!(refused("tcp://127.0.0.1:1", "").0, Some(2));
    let (status, said) = refused("-", "t,y\n0,1\n1,2\n");
    assert!(status == Some(1) && said.contains("displacement") && said.contains("--columns"), "{said}");
    let (status, said) = refused("-", "t,x\n0,1\n1,2\n");
    assert!(status == Some(1) && said.contains("ended before"), "{said}");
    let (status, said) = refused("serial:///no/such/line", "");
    assert!(status == Some(1) && said.contains("/no/such/line"), "{said}");
}
