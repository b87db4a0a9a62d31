//! One measurement in every format, as bytes that the test writes: read alike, and refused in words where damaged.

use std::io::Write;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

const SAMPLES: usize = 40;
const INTERVAL: f64 = 0.015_625;

fn time(i: usize) -> f64 {
    i as f64 * INTERVAL
}

fn force(i: usize) -> f64 {
    (i % 4) as f64 / 4.0
}

/// The values of a column, sample by sample.
type Values = fn(usize) -> f64;

/// The measurement's columns, without and with the time.
const CHANNELS: [(&str, &str, Values); 2] = [("x", "mm", x), ("force", "N", force)];
const COLUMNS: [(&str, &str, Values); 3] = [("t", "s", time), CHANNELS[0], CHANNELS[1]];

fn doubles(values: Values) -> Vec<u8> {
    (0..SAMPLES).flat_map(|i| values(i).to_le_bytes()).collect()
}

fn words(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn mat_4() -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, _, values) in COLUMNS {
        bytes.extend(words(&[0, SAMPLES as u32, 1, 0, name.len() as u32 + 1]));
        bytes.extend(name.bytes().chain([0]));
        bytes.extend(doubles(values));
    }
    bytes
}

/// An element of a MAT-file of version 5, padded to eight bytes.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = words(&[kind, data.len() as u32]);
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn mat_matrix(name: &str, rows: usize, columns: usize, data: &[u8]) -> Vec<u8> {
    let mut inside = element(6, &words(&[6, 0]));
    inside.extend(element(5, &words(&[rows as u32, columns as u32])));
    inside.extend(element(1, name.as_bytes()));
    inside.extend(element(9, data));
    element(14, &inside)
}

fn mat_header() -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file, written by a test".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0, 1]);
    bytes.extend(b"IM");
    bytes
}

fn mat_5() -> Vec<u8> {
    let mut bytes = mat_header();
    for (name, _, values) in COLUMNS {
        bytes.extend(mat_matrix(name, 1, SAMPLES, &doubles(values)));
    }
    bytes
}

/// As MATLAB 7 writes it: each variable deflated; the time is told by a sampling rate.
fn mat_7() -> Vec<u8> {
    let mut bytes = mat_header();
    let mut matrices: Vec<Vec<u8>> =
        CHANNELS.iter().map(|(name, _, values)| mat_matrix(name, SAMPLES, 1, &doubles(*values))).collect();
    matrices.push(mat_matrix("fs", 1, 1, &(1.0 / INTERVAL).to_le_bytes()));
    for matrix in matrices {
        let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        packed.write_all(&matrix).unwrap();
        let packed = packed.finish().unwrap();
        bytes.extend(words(&[15, packed.len() as u32]));
        bytes.extend(packed);
    }
    bytes
}

/// As MATLAB 7.3 writes it: HDF5, a structure's fields in a group.
fn mat_73() -> Vec<u8> {
    let mut builder = hdf5_pure::FileBuilder::new();
    let column = |values: Values| (0..SAMPLES).map(values).collect::<Vec<f64>>();
    builder.create_dataset("t").with_f64_data(&column(time)).with_shape(&[SAMPLES as u64, 1]);
    builder.create_dataset("x").with_f64_data(&column(x)).with_shape(&[1, SAMPLES as u64]);
    builder.create_dataset("force").with_f64_data(&column(force)).with_shape(&[SAMPLES as u64]);
    builder.finish().unwrap()
}

fn npy_with(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(data);
    bytes
}

fn npy() -> Vec<u8> {
    let rows: Vec<u8> = (0..SAMPLES).flat_map(|i| COLUMNS.map(|(_, _, v)| v(i).to_le_bytes())).flatten().collect();
    npy_with("[('t', '<f8'), ('x [mm]', '<f8'), ('force [N]', '<f8')]", &format!("({SAMPLES},)"), &rows)
}

fn zipped(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        // OpenDocument's kind must stand there as it is.
        let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
        let options = if *name == "mimetype" { stored } else { Default::default() };
        archive.start_file(*name, options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn npz() -> Vec<u8> {
    let array = |values| npy_with("'<f8'", &format!("({SAMPLES},)"), &doubles(values));
    zipped(&[("t.npy", array(time)), ("x.npy", array(x)), ("force.npy", array(force))])
}

fn xlsx() -> Vec<u8> {
    let mut rows = String::new();
    let mut row = |number: usize, cells: &[String]| {
        rows += &format!("<row r=\"{number}\">");
        for (cell, letter) in cells.iter().zip(["A", "B", "C"]) {
            rows += &if cell.parse::<f64>().is_ok() {
                format!("<c r=\"{letter}{number}\"><v>{cell}</v></c>")
            } else {
                format!("<c r=\"{letter}{number}\" t=\"inlineStr\"><is><t>{cell}</t></is></c>")
            };
        }
        rows += "</row>";
    };
    row(1, &["Measured on the rig".into()]);
    row(3, &COLUMNS.map(|(name, _, _)| name.to_owned()));
    row(4, &COLUMNS.map(|(_, unit, _)| unit.to_owned()));
    for i in 0..SAMPLES {
        row(5 + i, &COLUMNS.map(|(_, _, values)| values(i).to_string()));
    }
    let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let package = "http://schemas.openxmlformats.org/package/2006";
    zipped(&[
        (
            "[Content_Types].xml",
            format!("<Types xmlns=\"{package}/content-types\"><Default Extension=\"xml\" ContentType=\"application/xml\"/></Types>").into_bytes(),
        ),
        (
            "_rels/.rels",
            format!("<Relationships xmlns=\"{package}/relationships\"><Relationship Id=\"rId1\" Type=\"{office}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>").into_bytes(),
        ),
        (
            "xl/workbook.xml",
            format!("<workbook xmlns=\"{main}\" xmlns:r=\"{office}\"><sheets><sheet name=\"Run\" sheetId=\"1\" r:id=\"rId1\"/></sheets></workbook>").into_bytes(),
        ),
        (
            "xl/_rels/workbook.xml.rels",
            format!("<Relationships xmlns=\"{package}/relationships\"><Relationship Id=\"rId1\" Type=\"{office}/worksheet\" Target=\"worksheets/sheet1.xml\"/></Relationships>").into_bytes(),
        ),
        (
            "xl/worksheets/sheet1.xml",
            format!("<worksheet xmlns=\"{main}\"><sheetData>{rows}</sheetData></worksheet>").into_bytes(),
        ),
    ])
}

fn ods() -> Vec<u8> {
    let mut rows = String::new();
    let text = |text: &str| {
        format!("<table:table-cell office:value-type=\"string\"><text:p>{text}</text:p></table:table-cell>")
    };
    let number = |value: f64| format!("<table:table-cell office:value-type=\"float\" office:value=\"{value}\"/>");
    let names: String = COLUMNS.iter().map(|(name, unit, _)| text(&format!("{name} [{unit}]"))).collect();
    rows += &format!("<table:table-row>{names}</table:table-row>");
    for i in 0..SAMPLES {
        let cells: String = COLUMNS.iter().map(|(_, _, values)| number(values(i))).collect();
        rows += &format!("<table:table-row>{cells}</table:table-row>");
    }
    let names =
        ["office", "table", "text"].map(|n| format!("xmlns:{n}=\"urn:oasis:names:tc:opendocument:xmlns:{n}:1.0\""));
    let content = format!(
        "<office:document-content {}><office:body><office:spreadsheet><table:table table:name=\"Run\">{rows}</table:table></office:spreadsheet></office:body></office:document-content>",
        names.join(" ")
    );
    let manifest = "<manifest:manifest xmlns:manifest=\"urn:oasis:names:tc:opendocument:xmlns:manifest:1.0\"/>";
    zipped(&[
        ("mimetype", b"application/vnd.oasis.opendocument.spreadsheet".to_vec()),
        ("META-INF/manifest.xml", manifest.into()),
        ("content.xml", content.into_bytes()),
    ])
}

/// `LabVIEW`'s text; `step` is what the header says.
fn lvm_with(step: f64) -> Vec<u8> {
    let mut text = String::from(
        "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nSeparator\tTab\r\nDecimal_Separator\t,\r\nMulti_Headings\tNo\r\nX_Columns\tOne\r\n***End_of_Header***\t\r\n\t\r\n",
    );
    text += &format!(
        "Channels\t2\t\t\r\nSamples\t{SAMPLES}\t{SAMPLES}\t\r\nY_Unit_Label\tmm\tNewtons\t\r\nX0\t0,0\t0,0\t\r\n"
    );
    text += &format!("Delta_X\t{step}\t{step}\t\r\n***End_of_Header***\t\t\t\r\nX_Value\tx\tforce\tComment\r\n")
        .replace('.', ",");
    for i in 0..SAMPLES {
        text += &format!("{}\t{}\t{}\t\r\n", time(i), x(i), force(i)).replace('.', ",");
    }
    text.into_bytes()
}

fn text_of(text: &str) -> Vec<u8> {
    let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
    bytes.extend(text.bytes());
    bytes
}

/// Two segments: the second says only that more of the same follows.
fn tdms() -> Vec<u8> {
    let half = SAMPLES / 2;
    let mut meta = words(&[3]);
    meta.extend(text_of("/'Run'"));
    meta.extend(words(&[0xffff_ffff, 0]));
    for (name, unit, _) in CHANNELS {
        meta.extend(text_of(&format!("/'Run'/'{name}'")));
        meta.extend(words(&[20, 10, 1]));
        meta.extend((half as u64).to_le_bytes());
        meta.extend(words(&[2]));
        meta.extend(text_of("wf_increment"));
        meta.extend(words(&[10]));
        meta.extend(INTERVAL.to_le_bytes());
        meta.extend(text_of("unit_string"));
        meta.extend(words(&[0x20]));
        meta.extend(text_of(unit));
    }
    let mut bytes = Vec::new();
    for part in 0..2 {
        let head: &[u8] = if part == 0 { &meta } else { &[] };
        let raw: Vec<u8> = CHANNELS
            .iter()
            .flat_map(|(_, _, v)| (0..half).flat_map(move |i| v(part * half + i).to_le_bytes()))
            .collect();
        bytes.extend(b"TDSm");
        bytes.extend(words(&[if part == 0 { 0b1110 } else { 0b1000 }, 4713]));
        bytes.extend((head.len() as u64 + raw.len() as u64).to_le_bytes());
        bytes.extend((head.len() as u64).to_le_bytes());
        bytes.extend(head);
        bytes.extend(raw);
    }
    bytes
}

fn uff(binary: bool) -> Vec<u8> {
    let mut bytes = b"    -1\n   151\nanother dataset\n    -1\n".to_vec();
    for ((name, unit, values), kind) in CHANNELS.into_iter().zip([8, 9]) {
        bytes.extend(b"    -1\n");
        let size = 8 * SAMPLES;
        let number = if binary {
            format!("    58b     1     2          11{size:12}     0     0           0           0")
        } else {
            "    58".into()
        };
        let axis = |kind: usize, label: &str, unit: &str| format!("{kind:10}    0    0    0 {label:20} {unit:20}\n");
        let head = format!(
            "{number}\n{name}\nNONE\n01-Jan-26 12:00:00\nNONE\nNONE\n    1         0    0         0 NONE               1   3 NONE               0   0\n         4{SAMPLES:10}         1  0.00000E+00{INTERVAL:13.5E}  0.00000E+00\n{}{}{}{}",
            axis(17, "Time", "s"),
            axis(kind, name, unit),
            axis(0, "NONE", "NONE"),
            axis(0, "NONE", "NONE"),
        );
        bytes.extend(head.bytes());
        if binary {
            bytes.extend(doubles(values));
            bytes.extend(b"\n");
        } else {
            for i in 0..SAMPLES {
                bytes.extend(format!("{:20.11E}{}", values(i), if i % 4 == 3 { "\n" } else { "" }).bytes());
            }
        }
        bytes.extend(b"    -1\n");
    }
    bytes
}

fn wav() -> Vec<u8> {
    let sample_format = hound::SampleFormat::Int;
    let spec = hound::WavSpec { channels: 2, sample_rate: 64, bits_per_sample: 16, sample_format };
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = hound::WavWriter::new(&mut bytes, spec).unwrap();
    for i in 0..SAMPLES {
        for (_, _, values) in CHANNELS {
            writer.write_sample((values(i) * 32768.0) as i16).unwrap();
        }
    }
    writer.finalize().unwrap();
    bytes.into_inner()
}

/// A block of an MDF file at the end of the bytes; gives its address.
fn mdf_block(bytes: &mut Vec<u8>, id: &str, links: &[u64], data: &[u8]) -> u64 {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    let at = bytes.len() as u64;
    bytes.extend(format!("##{id}\0\0\0\0").bytes());
    bytes.extend((24 + 8 * links.len() as u64 + data.len() as u64).to_le_bytes());
    bytes.extend((links.len() as u64).to_le_bytes());
    bytes.extend(links.iter().flat_map(|l| l.to_le_bytes()));
    bytes.extend(data);
    at
}

/// Rows in one deflated block behind a list; the displacement is a whole number with a linear conversion.
fn mdf() -> Vec<u8> {
    let mut bytes = b"MDF     4.10    a test  ".to_vec();
    bytes.resize(28, 0);
    bytes.extend(410u16.to_le_bytes());
    bytes.resize(64, 0);
    mdf_block(&mut bytes, "HD", &[0; 6], &[0; 32]);
    let rows: Vec<u8> = (0..SAMPLES)
        .flat_map(|i| {
            let mut row = time(i).to_le_bytes().to_vec();
            row.extend(((x(i) * 8.0) as i16).to_le_bytes());
            row.extend((force(i) as f32).to_le_bytes());
            row
        })
        .collect();
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(&rows).unwrap();
    let packed = packed.finish().unwrap();
    let mut deflated = b"DT\0\0\0\0\0\0".to_vec();
    deflated.extend((rows.len() as u64).to_le_bytes());
    deflated.extend((packed.len() as u64).to_le_bytes());
    deflated.extend(packed);
    let data = mdf_block(&mut bytes, "DZ", &[], &deflated);
    let list = mdf_block(&mut bytes, "DL", &[0, data], &[0; 16]);
    let mut linear = vec![1, 0, 0, 0, 0, 0, 2, 0];
    linear.extend([0.0f64, 0.0, 0.0, 0.125].iter().flat_map(|v| v.to_le_bytes()));
    let conversion = mdf_block(&mut bytes, "CC", &[0; 4], &linear);
    let mut next = 0;
    for (name, unit, kind, format, byte, bits, conversion) in [
        ("force", "N", [0, 0], 4u8, 10u32, 32u32, 0),
        ("x", "mm", [0, 0], 2, 8, 16, conversion),
        ("clock", "s", [2, 1], 4, 0, 64, 0),
    ] {
        let name = mdf_block(&mut bytes, "TX", &[], format!("{name}\0").as_bytes());
        let unit = mdf_block(&mut bytes, "MD", &[], format!("<CNunit><TX>{unit}</TX></CNunit>\0").as_bytes());
        let mut channel = vec![kind[0], kind[1], format, 0];
        channel.extend(words(&[byte, bits, 0, 0]));
        channel.resize(72, 0);
        next = mdf_block(&mut bytes, "CN", &[next, 0, name, 0, conversion, 0, unit, 0], &channel);
    }
    let mut group = 0u64.to_le_bytes().to_vec();
    group.extend((SAMPLES as u64).to_le_bytes());
    group.extend([0; 8]);
    group.extend(words(&[14, 0]));
    let group = mdf_block(&mut bytes, "CG", &[0, next, 0, 0, 0, 0], &group);
    let group = mdf_block(&mut bytes, "DG", &[0, group, list, 0], &[0; 8]);
    bytes[64 + 24..64 + 32].copy_from_slice(&group.to_le_bytes());
    bytes
}

/// Each format's file of the measurement, and whether it has units.
fn files() -> Vec<(&'static str, Vec<u8>, bool)> {
    vec![
        ("run4.mat", mat_4(), false),
        ("run5.mat", mat_5(), false),
        ("run7.mat", mat_7(), false),
        ("run73.mat", mat_73(), false),
        ("run.npy", npy(), true),
        ("run.npz", npz(), false),
        ("run.xlsx", xlsx(), true),
        ("run.ods", ods(), true),
        ("run.lvm", lvm_with(INTERVAL), true),
        ("run.tdms", tdms(), true),
        ("run.uff", uff(false), true),
        ("run_b.uff", uff(true), true),
        ("run.wav", wav(), false),
        ("run.mf4", mdf(), true),
    ]
}

fn options_for(name: &str) -> ReadOptions {
    let columns = if name.ends_with("wav") { "x=channel1,u=channel2" } else { "" };
    ReadOptions { columns: columns.parse().unwrap(), ..ReadOptions::default() }
}

#[test]
fn one_measurement_reads_alike_from_every_format() {
    for (name, bytes, has_units) in files() {
        let records = read_text(name, &bytes, &options_for(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(records.len(), 1, "{name}");
        let record = &records[0];
        assert_eq!((record.start, record.interval, record.len()), (0.0, INTERVAL, SAMPLES), "{name}");
        assert_eq!(record.channels.len(), 2, "{name}");
        for (role, unit, wanted) in [(Role::Displacement(0), "mm", x as Values), (Role::Input(0), "N", force)] {
            assert_eq!(values(record, role), (0..SAMPLES).map(wanted).collect::<Vec<f64>>(), "{name}");
            let unit = if has_units { unit } else { "" };
            let newtons = if name.ends_with("lvm") && unit == "N" { "newtons" } else { unit };
            assert_eq!(record.channel(role).unwrap().unit, newtons, "{name}");
        }
        let told: Vec<&str> = match name {
            "run7.mat" => vec!["run7.mat: the sampling interval, 0.015625 s, was taken from `fs`"],
            "run.xlsx" => vec!["run.xlsx: lines 1 to 2 above the header were skipped"],
            _ => vec![],
        };
        assert_eq!(record.notices, told, "{name}");
    }
}

#[test]
fn a_field_of_a_structure_is_what_its_own_name_says() {
    let fields = ["run.t", "run.x", "run.force"].into_iter().zip(COLUMNS);
    let matrices: Vec<u8> =
        fields.flat_map(|(name, (_, _, values))| mat_matrix(name, SAMPLES, 1, &doubles(values))).collect();
    let bytes = [mat_header(), matrices].concat();
    let record = &read_text("run.mat", bytes, &ReadOptions::default()).unwrap()[0];
    let roles: Vec<_> = record.channels.iter().map(|c| (c.name.as_str(), c.role)).collect();
    assert_eq!(roles, [("run.x", Role::Displacement(0)), ("run.force", Role::Input(0))]);
}

#[test]
fn a_format_is_known_by_its_content_whatever_its_name() {
    for (name, bytes, _) in files().into_iter().filter(|(name, ..)| *name != "run4.mat") {
        let other = format!("{name}.csv");
        assert!(read_text(&other, &bytes, &options_for(name)).is_ok(), "{name}");
    }
}

#[test]
fn a_wrong_time_step_in_the_header_is_told() {
    let record = &read_text("run.lvm", lvm_with(INTERVAL / 64.0), &ReadOptions::default()).unwrap()[0];
    assert_eq!(record.interval, INTERVAL);
    assert_eq!(
        record.notices,
        [
            "run.lvm: the header gives a time step (Delta_X) of 0.000244141 s, but column `X_Value` advances by 0.015625 s; the column counts"
        ]
    );
}

#[test]
fn what_cannot_be_read_is_refused_with_what_to_do() {
    let hdf5 = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".to_vec();
    let complex =
        b"    -1\n    58\na\nb\nc\nd\ne\n    4   0   0   0 a 0 0 b 0 0\n   5  2  1 0 1 0\n\n\n\n\n1 2 3 4\n    -1\n"
            .to_vec();
    for (name, bytes, message, advice) in [
        ("a.mat", hdf5, "a.mat: this HDF5 and MATLAB 7.3 file cannot be read: it is damaged or cut short", "'-v7'"),
        ("a.mat", b"nothing of the kind".to_vec(), "neither its first bytes nor its length", "copy or export"),
        ("a.uff", complex, "its function is a frequency response, not a time response", "time histories"),
        (
            "a.uff",
            b"    -1\n    15\n1\n    -1\n".to_vec(),
            "no measured functions (dataset 58), only datasets 15",
            "time histories",
        ),
        (
            "a.npy",
            npy_with("'<c16'", "(2,)", &[0; 32]),
            "it holds no columns of numbers; `` holds no real numbers",
            "numeric vector",
        ),
        (
            "a.npy",
            npy_with("'<f8'", "(99999999999,)", &[0; 32]),
            "its shape [99999999999] needs more than the 32 bytes",
            "whole",
        ),
        (
            "a.mf4",
            b"MDF     3.30    test    \0\0\0\0\x4a\x01".to_vec(),
            "it is of version 3.30; version 4 is read",
            "convert",
        ),
        (
            "a.tdms",
            b"TDSm".to_vec(),
            "it ends where 4 more bytes should be: it is cut short or damaged (at byte 4)",
            "whole",
        ),
        ("a.wav", b"RIFF\0\0\0\0WAVE".to_vec(), "it is damaged or cut short", "whole"),
        ("a.xlsx", b"PK\x03\x04 [Content_Types].xml".to_vec(), "it is damaged or cut short", "whole"),
    ] {
        let error = read_text(name, bytes, &ReadOptions::default()).expect_err(message);
        assert!(error.to_string().contains(message), "{error}");
        assert!(error.advice().contains(advice), "{}", error.advice());
    }
}

#[test]
fn damaged_files_are_refused_in_words_and_soon() {
    for (name, whole, _) in files() {
        let mut chance = Pcg64Mcg::seed_from_u64(13);
        for case in 0..200 {
            let damaged = damage(&whole, case, &mut chance);
            let begin = Instant::now();
            if let Err(error) = read_text(name, &damaged, &options_for(name)) {
                assert!(!error.to_string().is_empty() && !error.advice().is_empty(), "{name}, case {case}");
            }
            assert!(begin.elapsed() < Duration::from_secs(5), "{name}, case {case}: {:?}", begin.elapsed());
        }
    }
}

/// A file cut short, overwritten in places, or with parts taken out or doubled.
fn damage(whole: &[u8], case: usize, chance: &mut Pcg64Mcg) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    let place = chance.random_range(0..bytes.len());
    match case % 5 {
        0 => bytes.truncate(place),
        1 => {
            for _ in 0..1 + case / 50 {
                let place = chance.random_range(0..bytes.len());
                bytes[place] = chance.random_range(0..=255);
            }
        }
        // A count or an address that is as large as it can be, or not there.
        2 => {
            let end = (place + if chance.random_bool(0.5) { 4 } else { 8 }).min(bytes.len());
            let fill = if chance.random_bool(0.7) { 0xff } else { 0 };
            bytes[place..end].fill(fill);
            if chance.random_bool(0.3) && end > place {
                bytes[end - 1] = 0x7f;
            }
        }
        3 => {
            let end = (place + chance.random_range(1..64)).min(bytes.len());
            bytes.drain(place..end);
        }
        _ => {
            let end = (place + chance.random_range(1..64)).min(bytes.len());
            let part = bytes[place..end].to_vec();
            bytes.splice(place..place, part);
        }
    }
    // The first bytes stay in half of the cases, so that the format is still recognised.
    if case.is_multiple_of(2) {
        let head = bytes.len().min(16);
        bytes[..head].copy_from_slice(&whole[..head]);
    }
    bytes
}
