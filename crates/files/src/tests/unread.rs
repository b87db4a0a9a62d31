//! Files that hold no table of numbers, and columns whose names say little.

use super::*;

fn refused(name: &str, bytes: &[u8]) -> ReadError {
    let file = MeasuredFile::from_bytes(name, bytes);
    let options = ReadOptions::default();
    let error = file.read(&options).expect_err(name);
    assert_eq!(file.look(&options), Err(error.clone()), "{name}");
    assert!(!file.fits(&options));
    error
}

#[test]
fn a_file_of_another_program_is_refused_with_what_it_is_and_what_to_export() {
    let files: [(&str, &[u8], &str, &str); 14] = [
        ("a.labx", b"\xef\xbb\xbf<?xml version=\"1.0\"?><cassylab xml:lang=\"de\">", "CASSY Lab", "as text"),
        ("a.tdm", b"<?xml version=\"1.0\"?>\n<usi:tdm xmlns:usi=\"x\">", "DIAdem", "TDMS"),
        ("run.xml", b"<?xml version=\"1.0\"?><data>", "an XML file", "export the measurement as CSV"),
        ("run.csv", b"<!DOCTYPE html><html><body>", "a web page", "fetch the file itself"),
        ("run.csv", b"{\"t\": [0, 1], \"x\": [1, 2]}", "a JSON file", "`t,x,u`"),
        ("run.mat", b"%PDF-1.7\n%\xe2\xe3", "a PDF document", "CSV"),
        ("run.csv", b"PK\x03\x04\x14\0\0\0\x08\0run.csv", "a ZIP archive", "unpack it"),
        ("run.docx", b"PK\x03\x04\x14\0\0\0\x08\0[Content_Types].xml word/document.xml", "a text document", "CSV"),
        ("run.csv.gz", b"\x1f\x8b\x08\0\0\0", "an archive", "unpack it"),
        ("run.png", b"\x89PNG\r\n\x1a\n\0", "a picture", "no samples"),
        ("run.mp4", b"\0\0\0\x18ftypisom", "a film", "track the motion"),
        ("run.mp3", b"ID3\x03\0\0", "a compressed sound", "WAV"),
        ("run.dxd", b"\0\x01\x02", "DEWESoft", "UNV"),
        ("run.psdata", b"\0\x01\x02", "PicoScope", "text"),
    ];
    for (name, bytes, what, export) in files {
        let error = refused(name, bytes);
        assert!(matches!(*error.problem, ReadProblem::Foreign { .. }), "{name}: {error:?}");
        let told = error.to_string();
        assert!(told.starts_with(&format!("{name}: this is ")) && told.contains(what), "{told}");
        assert!(error.advice().contains(export), "{name}: {}", error.advice());
    }
}

#[test]
fn text_that_begins_oddly_is_still_text() {
    for header in ["PAR1,t,x", "ID3,t,x", "[t],[s],[x]", "{note},t,x", "<a>,t,x"] {
        let text = file(header, |i| format!("{i},{},{}", i as f64 / 100.0, x(i)));
        let refused = read_text("f.csv", &text, &ReadOptions::default()).err();
        assert!(
            !matches!(refused.as_ref().map(|e| &*e.problem), Some(ReadProblem::Foreign { .. })),
            "{header}: {refused:?}"
        );
    }
}

#[test]
fn a_measurement_of_cassy_is_known_where_the_folder_is_at_hand() {
    let Some(folder) = measured::folder() else { return };
    let path = folder.join("formats/other/CassyExample.labx");
    if path.exists() {
        let error = read_files(&[&path], &ReadOptions::default()).unwrap_err();
        assert!(error.to_string().contains("a measurement of CASSY Lab"), "{error}");
    }
}

#[test]
fn a_unit_of_acceleration_makes_an_acceleration_where_no_name_speaks_of_a_motion() {
    let text = file("t [s],1x : m/s²,2x : m/s²,U [V]", |i| format!("{},{},{},1", i as f64 / 100.0, x(i), x(i + 3)));
    let record = only("f.csv", &text, &ReadOptions::default());
    let named = |role| record.channel(role).map(|c| (c.name.as_str(), c.unit.as_str()));
    assert_eq!(named(Role::Acceleration(0)), Some(("1x", "m/s^2")));
    assert_eq!(named(Role::Acceleration(1)), Some(("2x", "m/s^2")));
    let told = "f.csv: `1x : m/s²` is taken for acceleration a1, as its unit m/s^2 says";
    assert!(record.notices.iter().any(|n| n == told), "{:?}", record.notices);

    // Where a name speaks, it counts.
    let text = file("t [s],x [mm],top [m/s^2]", |i| format!("{},{},{}", i as f64 / 100.0, x(i), x(i + 3)));
    let record = only("f.csv", &text, &ReadOptions::default());
    assert_eq!(record.measured().count(), 1);
}

#[test]
fn many_channels_of_one_kind_are_all_proposed() {
    let places = ["base", "board", "deck", "left", "right", "top", "arm", "tip", "motor", "frame"];
    let named = |word: &str| places.map(|place| format!("{word}_{place}")).join(",");
    let header = format!("time,{},{}", named("accelerometer"), named("force"));
    let text = file(&header, |i| {
        let values: Vec<String> = (0..20).map(|k| x(i + k).to_string()).collect();
        format!("{},{}", i as f64 / 100.0, values.join(","))
    });
    let overview = MeasuredFile::from_bytes("f.csv", text.as_str()).look(&ReadOptions::default()).unwrap();
    let table = &overview.tables[0];
    let wanted: Vec<Option<ColumnUse>> = std::iter::once(ColumnUse::Time)
        .chain((0..10).map(|i| ColumnUse::Channel(Role::Acceleration(i))))
        .chain((0..10).map(|i| ColumnUse::Channel(Role::Input(i))))
        .map(Some)
        .collect();
    assert_eq!(table.proposed(), wanted);
    let options = ReadOptions { columns: table.map(&table.proposed()), ..ReadOptions::default() };
    assert_eq!(only("f.csv", &text, &options).measured().count(), 20);
}

#[test]
fn one_opened_file_answers_everything() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    std::fs::write(&path, file("clock,top", |i| format!("{},{}", i as f64 / 100.0, x(i)))).unwrap();
    let opened = MeasuredFile::open(&path).unwrap();
    // It is read from the disk once.
    std::fs::remove_file(&path).unwrap();
    let plain = ReadOptions::default();
    let told = ReadOptions { columns: "t=clock,x=top".parse().unwrap(), ..ReadOptions::default() };
    assert!(!opened.fits(&plain) && opened.fits(&told));
    assert_eq!(opened.look(&plain).unwrap().tables[0].rows, 30);
    assert!(opened.read(&plain).is_err());
    assert_eq!(opened.read(&told).unwrap()[0].source.as_deref(), Some(path.as_path()));
    assert_eq!(read_opened(&[opened], &[], &told).unwrap().entries.len(), 1);
    assert_eq!(MeasuredFile::open(&path).unwrap_err().advice(), "check the path, and that the file may be read");
}
