#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::*;
use sindyscope_files::{TableColumn, write_parquet};

fn read(text: &str, over: Option<&str>) -> Result<Series, SeriesError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    std::fs::write(&path, text).unwrap();
    series(&path, over)
}

/// A table of records whose parameter falls with the temperature, or does not.
fn table(count: usize, slope: f64, scatter: f64, seed: u64) -> String {
    let random = &mut Pcg64::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let mut text = "record,temperature,status,error,v: x,v: x std_error\n".to_owned();
    for k in 0..count {
        let temperature = 10.0 + 2.0 * k as f64;
        let value =
            -358.0 + slope * (temperature - 20.0) + 0.5 * normal.sample(random) + scatter * normal.sample(random);
        text += &format!("r{k},{temperature},ok,,{value},0.5\n");
    }
    text
}

#[test]
fn a_trend_is_found_with_its_slope_and_a_record_that_does_not_fit_is_named() {
    let mut text = table(12, 0.8, 0.0, 1);
    text += "odd,21,ok,,-330,0.5\n";
    let found = read(&text, Some("temperature")).unwrap();
    let trend = found.parameters[0].trend.unwrap();
    assert!(trend.told() && (trend.slope - 0.8).abs() < 3.0 * trend.slope_error, "{trend:?}");
    assert_eq!(found.odd.iter().map(|o| o.record.as_str()).collect::<Vec<_>>(), ["odd"], "{:?}", found.odd);
}

#[test]
fn chance_makes_few_trends_and_few_odd_records() {
    let (mut trends, mut odd) = (0, 0);
    for seed in 0..300 {
        let scatter = if seed % 2 == 0 { 0.0 } else { 1.0 };
        let found = read(&table(10, 0.0, scatter, seed), Some("temperature")).unwrap();
        trends += usize::from(found.parameters[0].trend.unwrap().told());
        odd += usize::from(!found.odd.is_empty());
    }
    // One in a hundred each; the scatter is estimated from ten records, which widens that somewhat.
    assert!(trends <= 12 && odd <= 12, "{trends} trends and {odd} odd records in 300 series");
}

#[test]
fn records_that_failed_or_have_other_terms_are_named() {
    let mut text = "record,status,error,v: x,v: x std_error,v: x^3,v: x^3 std_error\n".to_owned();
    for k in 0..9 {
        text += &format!("r{k},ok,,{},0.1,5,0.1\n", -1.0 - 0.01 * f64::from(k % 3));
    }
    text += "linear,ok,,-1.01,0.1,,\nlost,failed,line 3: no number,,,,\n";
    let found = read(&text, None).unwrap();
    let names: Vec<&str> = found.odd.iter().map(|o| o.record.as_str()).collect();
    assert_eq!(names, ["linear", "lost"], "{:?}", found.odd);
    assert!(found.odd[0].reasons[0].contains("lacks v: x^3"), "{:?}", found.odd);
}

#[test]
fn what_is_wrong_with_a_table_is_said_with_its_place() {
    let wrong = "record,amplitude,v: x,v: x std_error\na,1,2,0.1\nb,two,2,0.1\n";
    let error = read(wrong, Some("amplitude")).unwrap_err().to_string();
    assert!(error.contains("line 3") && error.contains("`two`"), "{error}");
    let error = read(wrong, Some("height")).unwrap_err().to_string();
    assert!(error.contains("amplitude"), "{error}");
    assert!(matches!(read("a,b\n1,2\n", None), Err(SeriesError::NoParameter(_))));
    let error = read("record,v: x,v: x std_error\na,2,0.1\nb,3\n", None).unwrap_err().to_string();
    assert!(error.contains("line 3 has 2 cells, the first line 3"), "{error}");
}

#[test]
fn a_table_is_the_same_series_as_parquet() {
    let text = table(8, 0.8, 0.3, 2);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.parquet");
    let mut lines = csv::Reader::from_reader(text.as_bytes());
    let heads: Vec<String> = lines.headers().unwrap().iter().map(str::to_owned).collect();
    let rows: Vec<csv::StringRecord> = lines.records().map(Result::unwrap).collect();
    let column = |(k, head): (usize, &String)| {
        let cells = || rows.iter().map(|row| row[k].to_owned()).map(|cell| Some(cell).filter(|c| !c.is_empty()));
        match head.as_str() {
            "record" | "status" | "error" => TableColumn::Texts(head.clone(), cells().collect()),
            _ => TableColumn::Numbers(head.clone(), cells().map(|c| c.map(|c| c.parse().unwrap())).collect()),
        }
    };
    let columns: Vec<TableColumn> = heads.iter().enumerate().map(column).collect();
    write_parquet(&columns, &mut std::fs::File::create(&path).unwrap()).unwrap();
    assert!(is_series_table(&path, b"PAR1"));
    assert_eq!(series(&path, Some("temperature")).unwrap(), read(&text, Some("temperature")).unwrap());
    std::fs::write(&path, b"PAR1 and nothing else").unwrap();
    assert!(!is_series_table(&path, b"PAR1"));
    assert!(series(&path, None).unwrap_err().to_string().contains("save it as CSV"));
}

#[test]
fn the_table_of_a_batch_is_known_by_its_head_and_says_what_was_varied() {
    let nowhere = Path::new("table.csv");
    assert!(is_series_table(nowhere, b"record,temperature,status,error,train_rmse,v: x,v: x std_error\n"));
    for other in ["t,x,u\n0,1,2\n", "record,t,x\na,0,1\n", "record,status,error,v: x\n", ""] {
        assert!(!is_series_table(nowhere, other.as_bytes()), "{other}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    std::fs::write(
        &path,
        table(6, 0.5, 0.0, 3).replacen("temperature", "specimen,temperature", 1).replace("\nr", "\nr0,A"),
    )
    .unwrap();
    let table = SeriesTable::read(&path).unwrap();
    assert_eq!((table.columns(), table.varied()), (vec!["temperature", "v: x"], Some("temperature")));
}

#[test]
fn the_report_has_the_trends_and_why_a_record_does_not_fit() {
    let folder = tempfile::tempdir().unwrap();
    let found = read(&(table(12, 0.8, 0.0, 1) + "odd,21,ok,,-330,0.5\n"), Some("temperature")).unwrap();
    let path = folder.path().join("series.html");
    found.report("A series").write(&path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let slope = found.parameters[0].words().unwrap().slope.unwrap();
    for part in
        ["A series", "over temperature", "v: x", &slope, "odd", "standard deviations from the trend of the others"]
    {
        assert!(text.contains(part), "{part}");
    }
}
