//! Files that other programs wrote, where the folder with them is at hand; what they hold is what those programs, or the
//! formats' Python packages, say.

use super::column::TimeBase;
use super::format::Reader;
use super::measured::folder;
use super::*;

/// A column: name, unit, samples, sampling interval if the file tells it apart from the columns, first and last value.
type Held = (String, String, usize, Option<f64>, f64, f64);

/// Columns and notices, or why there are none.
type ForeignContents = Result<(Vec<Held>, Vec<String>), String>;

/// What a file's reader finds, before any column is chosen.
fn held(path: &str) -> Option<ForeignContents> {
    let path = folder()?.join("formats").join(path);
    let Ok(bytes) = std::fs::read(&path) else {
        println!("skipped: {} is not at hand", path.display());
        return None;
    };
    let ending = path.extension().unwrap().to_string_lossy().to_lowercase();
    let Reader::Columns(read) = formats::recognise(&ending, &bytes).reader else {
        panic!("{}: read as text", path.display())
    };
    let contents = match read(&bytes) {
        Ok(contents) => contents,
        Err(flaw) => return Some(Err(flaw.what)),
    };
    let columns = contents.columns.iter().map(|column| {
        let values = (column.decode)().unwrap_or_else(|e| panic!("{}: {e:?}", path.display()));
        assert_eq!(values.len(), column.len, "{}", path.display());
        let interval = match column.base {
            TimeBase::Even { interval, .. } => Some(interval),
            _ => None,
        };
        let ends = (values.first().copied().unwrap_or(f64::NAN), values.last().copied().unwrap_or(f64::NAN));
        (column.heading.name.clone(), column.heading.unit.clone(), column.len, interval, ends.0, ends.1)
    });
    let columns = columns.collect();
    Some(Ok((columns, contents.notices)))
}

/// Checks one column of a file; values to the last digit given.
fn check(path: &str, wanted: &(&str, &str, usize, Option<f64>, f64, f64)) {
    let Some(found) = held(path) else { return };
    let (columns, notices) = found.unwrap_or_else(|e| panic!("{path}: {e}"));
    let (name, unit, len, interval, first, last) = wanted;
    let near = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-9 * b.abs().max(1e-12);
    let fits = |c: &Held| {
        c.0 == *name && c.1 == *unit && c.2 == *len && c.3 == *interval && near(c.4, *first) && near(c.5, *last)
    };
    assert!(columns.iter().any(fits), "{path}: {wanted:?}\nfound {columns:#?}\n{notices:?}");
}

#[test]
fn universal_files_hold_what_others_read_in_them() {
    let step = Some(1.52588e-5);
    for (path, wanted) in [
        ("uff/Sample_UFF58_ascii.uff", ("Mic 01.0Scalar", "Pa", 79_292, step, -1.47553e-2, -4.31469e-3)),
        (
            "uff/Sample_UFF58b_bin.uff",
            ("Mic 01.0Scalar", "Pa", 79_292, step, -0.014_755_260_199_308_395, -0.004_314_688_965_678_215),
        ),
        ("uff/binary8byte.uff", ("sine 5 Hz", "g", 250, Some(0.01), 0.0, 0.309_019_356_966_018_7)),
        (
            "uff/dataset_milestone_in_header.uff",
            (
                "M.REDON   [.../20EH0456 2017-12-06 Creteil Wet50C 14mm TorqueJLR 36V BIPO1/1 :1]",
                "Pa",
                42,
                Some(1.95312e-5),
                -6.73633e-3,
                5.39653e-3,
            ),
        ),
        ("uff/time-history-not-all-columns-filled.uff", ("1x : m/s²", "m/s²", 13, Some(5e-5), -3.81956, -5.84096)),
    ] {
        check(path, &wanted);
    }
    for (path, reason) in [
        ("uff/non_ascii_header.uff", "its function is a frequency response, not a time response"),
        ("uff/sample_dataset58_psd.uff", "its function is a power spectral density, not a time response"),
        ("uff/heat_engine_housing.uff", "no measured functions (dataset 58), only datasets 151, 164, 2411, 2412, 2414"),
        ("uff/TestLab 161 164 18 15 82.uff", "no measured functions (dataset 58), only datasets"),
        ("uff/Out_time_mdof_complex_conf1.unv", "no measured functions (dataset 58), only datasets"),
        ("uff/OOP_inb_new_attach_0_30Hz_no euler.unv", "no measured functions (dataset 58), only datasets"),
        ("uff/Artemis export - Geometry RPBC_setup_05_14102016_105117.uff", "no measured functions (dataset 58)"),
    ] {
        let Some(found) = held(path) else { continue };
        let error = found.expect_err(path);
        assert!(error.contains(reason), "{path}: {error}");
    }
}

#[test]
fn labview_files_hold_what_others_read_in_them() {
    let nan = f64::NAN;
    for (path, wanted) in [
        ("lvm/short.lvm", ("Excitation (Trigger)", "newtons", 10, Some(3.90625e-5), 0.914_018, nan)),
        ("lvm/short_new_line_end.lvm", ("Response (Trigger)", "m/s^2", 10, Some(3.90625e-5), 1.204_792, nan)),
        ("lvm/long_single_header_multi_ch.lvm", ("m_1", "m/s^2", 16_384, Some(0.000_977), 0.234_571, nan)),
        ("lvm/multi_time_column.lvm", ("Acceleration", "g", 3, None, 0.532_608, 0.467_541)),
        ("lvm/no_decimal_separator.lvm", ("ay", "g", 4, None, -0.028_189, -0.021_172)),
        ("lvm/with_comments.lvm", ("Volume (ml)", "ml", 9, None, 0.0, 89.8217)),
        ("lvm/with_empty_fields.lvm", ("Dev0/Ai2", "", 7, None, 7.254_639, 7.254_639)),
        ("lvm/data_set_1_downsampled_by_64.lvm", ("Force", "pounds", 15_761, None, -3.399_325, nan)),
        ("lvm/hrshm7_vibration_0.5.lvm", ("accelerometer_base", "", 13_216, None, 0.436_771, nan)),
    ] {
        let Some(found) = held(path) else { continue };
        let (columns, notices) = found.unwrap_or_else(|e| panic!("{path}: {e}"));
        let column = columns.iter().find(|c| c.0 == wanted.0).unwrap_or_else(|| panic!("{path}: {columns:#?}"));
        assert_eq!((column.1.as_str(), column.2, column.3), (wanted.1, wanted.2, wanted.3), "{path}: {notices:?}");
        assert_eq!(column.4, wanted.4, "{path}");
        assert!(wanted.5.is_nan() || column.5 == wanted.5, "{path}");
    }
}

#[test]
fn tdms_files_hold_what_others_read_in_them() {
    let digital = "Dev1_port3_line7 - line 0";
    for (path, wanted) in [
        ("tdms/Digital_Input.tdms", (digital, "", 20_000, Some(0.0005), 0.0, f64::NAN)),
        ("tdms/Digital_Input.tdms", (digital, "", 400, Some(0.025), 0.0, f64::NAN)),
        ("tdms/Digital_Input.tdms", (digital, "", 8, Some(1.25), 0.0, f64::NAN)),
        ("tdms/big_endian.tdms", ("Phase sweep", "", 3500, Some(0.001), 0.0, f64::NAN)),
        ("tdms/raw1.tdms", ("First  Channel", "volts", 2000, Some(2e-5), -0.184_026_612_140_263_06, f64::NAN)),
        ("tdms/raw1.tdms", ("Seventh Cha", "volts", 2000, Some(2e-5), 5.043_183_690_908_536, f64::NAN)),
        ("tdms/raw_timestamps.tdms", ("Untitled", "", 128, Some(0.001), 0.0, f64::NAN)),
    ] {
        let Some(found) = held(path) else { continue };
        let (columns, notices) = found.unwrap_or_else(|e| panic!("{path}: {e}"));
        let fits = |c: &&Held| {
            let step = c.3.zip(wanted.3).is_some_and(|(a, b)| (a / b - 1.0).abs() < 1e-12);
            c.0 == wanted.0 && c.1 == wanted.1 && c.2 == wanted.2 && step && (c.4 - wanted.4).abs() < 1e-12
        };
        assert!(columns.iter().any(|c| fits(&c)), "{path}: {wanted:?}\nfound {columns:#?}\n{notices:?}");
    }
}

#[test]
fn matlab_files_hold_what_others_read_in_them() {
    for (path, wanted) in [
        ("mat/testdouble_4.2c_SOL2.mat", ("testdouble", "", 9, 0.0, std::f64::consts::TAU)),
        ("mat/testmatrix_4.2c_SOL2.mat", ("testmatrix(1)", "", 5, 1.0, 5.0)),
        ("mat/big_endian.mat", ("floats(1)", "", 2, 2.0, 3.0)),
        (
            "mat/teststruct_7.4_GLNX86.mat",
            ("teststruct.doublefield", "", 3, std::f64::consts::SQRT_2, std::f64::consts::PI),
        ),
        ("mat/testfile1.mat", ("data.arr_float(1)", "", 3, f64::NAN, f64::NAN)),
        ("mat/testfile5.mat", ("data.cfg.callinfo.calltime", "", 6, f64::NAN, f64::NAN)),
        ("mat/testfile12.mat", ("rec_img.fwd_model.n_elec", "", 1, 16.0, 16.0)),
    ] {
        let Some(found) = held(path) else { continue };
        let (columns, notices) = found.unwrap_or_else(|e| panic!("{path}: {e}"));
        let near = |a: f64, b: f64| b.is_nan() || (a - b).abs() < 1e-14;
        let fits = |c: &Held| c.0 == wanted.0 && c.2 == wanted.2 && near(c.4, wanted.3) && near(c.5, wanted.4);
        assert!(columns.iter().any(fits), "{path}: {wanted:?}\nfound {columns:#?}\n{notices:?}");
    }
    // These hold no real numbers in arrays: each is refused with what it holds instead.
    for (path, what) in [
        ("mat/testcell_7.1_GLNX86.mat", "`testcell` is a cell array"),
        ("mat/testcomplex_7.4_GLNX86.mat", "`testcomplex` is complex"),
        ("mat/teststructarr_6.5.1_GLNX86.mat", "`teststructarr` is an array of structures"),
        (
            "mat/testhdf5_7.4_GLNX86.mat",
            "nothing in it can be used: `testdouble` was left out: HDF5 format error: invalid data layout",
        ),
        ("mat/corrupted_zlib_data.mat", "damaged"),
        ("mat/testunicode_7.4_GLNX86.mat", "it holds no columns of numbers"),
        ("mat/parabola.mat", "it holds no columns of numbers"),
    ] {
        let Some(folder) = folder() else { return };
        let path = folder.join("formats").join(path);
        if path.exists() {
            let error = read_files(&[&path], &ReadOptions::default()).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}

#[test]
fn mdf_files_hold_what_others_read_in_them() {
    let nan = f64::NAN;
    for (path, wanted) in [
        ("mdf/test_batch.mf4", ("BNXJPMAPAVZXPSX", "HBUNLOS", 1051, 0.013_000_05, nan)),
        ("mdf/test_batch.mf4", ("MCSAKJB", "s", 1051, 0.0, 10.5)),
        ("mdf/test_metadata.mf4", ("ASAM.M.SCALAR.SLONG.IDENTICAL", "hours", 2, 800.0, 899.0)),
        ("mdf/ASAP2_Demo_V171.mf4", ("ASAM.M.SCALAR.UBYTE.FORM_X_PLUS_4", "rpm", 1240, nan, nan)),
        ("mdf/ASAP2_Demo_V171.mf4", ("ASAM.M.SCALAR.UBYTE.TAB_INTP_DEFAULT_VALUE", "U/  min", 12_402, 111.0, nan)),
        ("mdf/ASAP2_Demo_V171.mf4", ("ASAM.M.SCALAR.SLONG.IDENTICAL", "hours", 12_402, 800.0, nan)),
    ] {
        let Some(found) = held(path) else { continue };
        let (columns, notices) = found.unwrap_or_else(|e| panic!("{path}: {e}"));
        let near = |a: f64, b: f64| b.is_nan() || (a - b).abs() <= 1e-6 * b.abs();
        let fits = |c: &Held| {
            c.0 == wanted.0 && c.1 == wanted.1 && c.2 == wanted.2 && near(c.4, wanted.3) && near(c.5, wanted.4)
        };
        assert!(columns.iter().any(fits), "{path}: {wanted:?}\nfound {columns:#?}\n{notices:?}");
    }
}

#[test]
fn a_header_that_lies_about_the_time_step_is_told() {
    let Some(folder) = folder() else { return };
    let path = folder.join("forced_beam_data_set_2_downsampled_by_64.lvm");
    if !path.exists() {
        return println!("skipped: {} is not at hand", path.display());
    }
    let options = ReadOptions { columns: "x=Voltage,u=Force".parse().unwrap(), ..ReadOptions::default() };
    let record = &read_files(&[&path], &options).unwrap()[0];
    assert_eq!((record.interval, record.start), (0.00125, 0.0));
    assert_eq!(values(record, Role::Input(0))[1], -5.739_583);
    let told = record.notices.iter().any(|n| n.contains("Delta_X") && n.contains("0.00125 s; the column counts"));
    assert!(told, "{:?}", record.notices);
}
