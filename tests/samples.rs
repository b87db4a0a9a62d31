//! Every file of `sample_data/` is what the command in its head makes.

use std::fs;
use std::path::Path;
use std::process::Command;

/// The largest size that a person clones gladly.
const LARGEST: usize = 400_000;

#[test]
fn each_sample_is_what_its_command_makes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data");
    let guide = fs::read_to_string(folder.join("README.md")).expect("sample_data/README.md");
    let mut count = 0;
    for entry in fs::read_dir(&folder).expect("sample_data") {
        let path = entry.expect("an entry of sample_data").path();
        if path.extension().is_none_or(|e| e != "csv") {
            continue;
        }
        count += 1;
        let name = path.file_name().and_then(|n| n.to_str()).expect("a plain file name");
        let stored = fs::read_to_string(&path).expect("a readable sample");
        assert!(stored.len() <= LARGEST, "{name} has {} bytes", stored.len());
        let command = stored.lines().find_map(|l| l.strip_prefix("# made by: ")).expect("a command in the head");
        assert!(guide.contains(name) && guide.contains(command), "{name} is in the README with its command: {command}");
        let made = Command::new(env!("CARGO_BIN_EXE_sindyscope"))
            .args(command.split_whitespace().skip(1))
            .args(["--out", "-"])
            .output()
            .expect("the program runs");
        assert!(made.status.success(), "{command}: {}", String::from_utf8_lossy(&made.stderr));
        let made = String::from_utf8(made.stdout).expect("text");
        assert_eq!(made.lines().count(), stored.lines().count(), "{name}");
        for (number, (a, b)) in made.lines().zip(stored.lines()).enumerate() {
            assert!(same(a, b), "{name}, line {}: made {a:?}, stored {b:?}", number + 1);
        }
    }
    assert!(count >= 8, "{count} samples");
}

/// Equal, but for the last of ten digits: sines differ in their last bit from one C library to another.
fn same(a: &str, b: &str) -> bool {
    a == b
        || a.split(',').zip(b.split(',')).all(|(a, b)| {
            let numbers = a.parse::<f64>().ok().zip(b.parse::<f64>().ok());
            a == b || numbers.is_some_and(|(a, b)| (a - b).abs() <= 2e-9 * a.abs().max(b.abs()).max(1e-3))
        })
}
