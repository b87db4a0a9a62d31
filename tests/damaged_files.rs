//! Files of every format, whole and damaged: what other programs wrote is read, and no damage makes the reader panic, hang
//! or stay silent about the place.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use sindyscope_files::{MeasuredFile, ReadError, ReadOptions, read_files, read_opened};
use sindyscope_values::record::Role;

/// Damaged copies of each file, and in the long run.
const COPIES: usize = 200;
const MANY: usize = 5000;

/// No file may take longer.
const LONGEST: Duration = Duration::from_secs(5);

/// The files that `tests/fixtures/formats/make.py` wrote.
fn fixtures() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e != "py"));
    files.sort();
    assert!(files.len() >= 16, "{files:?}");
    files
}

/// What the header of a fixture does not say.
fn options(path: &Path) -> ReadOptions {
    let columns = match path.file_name().unwrap().to_str().unwrap() {
        "text.tsv" => "t=Zeit,x=Weg,u=Kraft",
        "sound.wav" => "x=channel1,u=channel2",
        _ => "",
    };
    ReadOptions { columns: columns.parse().unwrap(), ..ReadOptions::default() }
}

#[test]
fn what_other_programs_wrote_is_read() {
    for path in fixtures() {
        let name = path.display();
        let records = read_files(&[&path], &options(&path)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(records.len(), 1, "{name}");
        let record = &records[0];
        assert_eq!((record.len(), (record.interval * 1e9).round()), (64, 1e7), "{name}");
        let values = |role| &record.channel(role).unwrap_or_else(|| panic!("{name}: no {role:?}")).values;
        for k in 0..64 {
            let t = 0.01 * k as f64;
            let (x, u) = ((7.0 * t).cos() * (-0.3 * t).exp(), (5.0 * t).sin());
            assert!((values(Role::Displacement(0))[k] - x).abs() < 2e-5, "{name}: sample {k}");
            assert!((values(Role::Input(0))[k] - u).abs() < 2e-5, "{name}: sample {k}");
        }
        let file = MeasuredFile::open(&path).unwrap();
        let overview = file.look(&options(&path)).unwrap_or_else(|e| panic!("{e}"));
        let table = &overview.tables[overview.main()];
        assert_eq!((table.rows, table.rate.map(f64::round)), (64, Some(100.0)), "{name}");
        let proposed = file.look(&ReadOptions::default()).unwrap();
        let table = &proposed.tables[proposed.main()];
        let mapped = ReadOptions { columns: table.map(&table.proposed()), only_named: true, ..ReadOptions::default() };
        let again = read_files(&[&path], &mapped).unwrap_or_else(|e| panic!("proposed {}: {e}", mapped.columns));
        assert!(again[0].sensors().next().is_some(), "{name}: what is proposed can be read");
    }
}

/// A damaged copy of a file.
fn damage(whole: &[u8], rng: &mut Pcg64) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..rng.random_range(1..=3) {
        let len = bytes.len().max(1);
        // Most formats keep what matters at their beginning.
        let reach = if rng.random_bool(0.5) { len } else { len.min(300) };
        let at = rng.random_range(0..reach);
        let end = (at + rng.random_range(1..=64)).min(bytes.len());
        match rng.random_range(0..11) {
            0 => bytes.truncate(at),
            1 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << rng.random_range(0..8)),
            2 => bytes.iter_mut().skip(at).take(8).for_each(|b| *b = 0xff),
            3 => bytes.iter_mut().skip(at).take(end - at.min(end)).for_each(|b| *b = 0),
            4 => bytes.iter_mut().skip(at).take(4).zip([0x7f, 0xff, 0xff, 0xff]).for_each(|(b, new)| *b = new),
            5 => drop(bytes.drain(at.min(end)..end)),
            6 => {
                let copy = bytes[at.min(end)..end].to_vec();
                bytes.splice(at..at, copy);
            }
            7 => {
                let huge: &[&[u8]] =
                    &[b"1e999", b"-99999999999999999999999999999999", b"NaN", b"1e300", b"0x1p9", b"\xef\xbb\xbf"];
                let text = huge[rng.random_range(0..huge.len())];
                bytes.splice(at..at, text.iter().copied());
            }
            8 => drop(bytes.splice(at..at, std::iter::repeat_n(b',', 3000))),
            9 => bytes = bytes.iter().flat_map(|b| [*b, 0]).collect(),
            _ => bytes.iter_mut().skip(at).take(16).for_each(|b| *b = rng.random()),
        }
    }
    bytes
}

/// What is wrong with the way in which a file was refused.
fn unhelpful(error: &ReadError, file: &str) -> Option<String> {
    let (message, advice) = (error.to_string(), error.advice());
    let plain = |text: &str| !text.chars().any(char::is_control);
    let helps =
        message.contains(file) && !advice.is_empty() && plain(&message) && plain(&advice) && message.len() < 3000;
    (!helps).then(|| format!("{message:?}\n  {advice:?}"))
}

/// Reads damaged copies of a file, and tells what went wrong.
fn endure(path: PathBuf, copies: usize) -> Vec<String> {
    let file = path.file_name().unwrap().to_str().unwrap().to_owned();
    let whole = std::fs::read(&path).unwrap();
    let (send, progress) = channel();
    let (name, options) = (file.clone(), options(&path));
    std::thread::spawn(move || {
        let home = tempfile::tempdir().unwrap();
        let copy = home.path().join(&name);
        let mut wrong = Vec::new();
        for seed in 0..copies as u64 {
            let _ = send.send(Err(seed));
            std::fs::write(&copy, damage(&whole, &mut Pcg64::seed_from_u64(seed))).unwrap();
            let begun = Instant::now();
            let told = catch_unwind(AssertUnwindSafe(|| {
                let file = MeasuredFile::open(&copy).unwrap();
                let looked = file.look(&options).err().and_then(|e| unhelpful(&e, &name));
                looked.or_else(|| read_opened(&[file], &[], &options).err().and_then(|e| unhelpful(&e, &name)))
            }));
            match told {
                Err(_) => wrong.push(format!("{name}, seed {seed}: panicked")),
                Ok(Some(told)) => wrong.push(format!("{name}, seed {seed}: {told}")),
                Ok(None) if begun.elapsed() > LONGEST => wrong.push(format!("{name}, seed {seed}: slow")),
                Ok(None) => {}
            }
        }
        let _ = send.send(Ok(wrong));
    });
    let mut last = 0;
    loop {
        match progress.recv_timeout(4 * LONGEST) {
            Ok(Ok(wrong)) => return wrong,
            Ok(Err(seed)) => last = seed,
            Err(RecvTimeoutError::Timeout) => return vec![format!("{file}, seed {last}: hangs")],
            Err(RecvTimeoutError::Disconnected) => return vec![format!("{file}, seed {last}: the thread ended")],
        }
    }
}

fn endure_all(copies: usize) {
    let wrong: Vec<String> = fixtures().into_iter().flat_map(|path| endure(path, copies)).collect();
    assert!(wrong.is_empty(), "{} of {copies} a file:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n"));
}

#[test]
fn damaged_files_are_refused_with_place_and_remedy_or_read() {
    endure_all(COPIES);
}

#[test]
#[ignore = "minutes: as many damaged files as an evening of fuzzing"]
fn very_many_damaged_files_are_refused_or_read() {
    endure_all(MANY);
}

#[test]
fn what_is_no_measurement_at_all_is_refused_in_words() {
    let home = tempfile::tempdir().unwrap();
    let mut rng = Pcg64::seed_from_u64(5);
    for path in fixtures() {
        let file = path.file_name().unwrap().to_str().unwrap().to_owned();
        let copy = home.path().join(&file);
        let noise: Vec<u8> = (0..4000).map(|_| rng.random()).collect();
        for bytes in [Vec::new(), vec![0; 4096], vec![b'\n'; 500], noise, "größer als ☃ ".repeat(40).into_bytes()] {
            std::fs::write(&copy, bytes).unwrap();
            let error = read_files(&[&copy], &options(&path)).expect_err(&file);
            assert_eq!(unhelpful(&error, &file), None);
        }
    }
}
