use super::*;
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_values::record::Role;
use sindyscope_values::term::Term;

/// Rows of the rig's Duffing oscillator as text, a header above them.
fn text(seconds: f64) -> Vec<String> {
    let options = ScenarioOptions { duration: Some(seconds), seed: 2, ..ScenarioOptions::default() };
    let record = generate("duffing-multisine", &options).unwrap().records.remove(0);
    let values = |role| record.channel(role).unwrap().values.clone();
    let (x, u) = (values(Role::Displacement(0)), values(Role::Input(0)));
    let row = |k: usize| format!("{:.2},{},{}\n", record.time(k), x[k], u[k]);
    std::iter::once("t [s],x [m],u [m/s^2]\n".to_owned()).chain((0..record.len()).map(row)).collect()
}

fn request(more: &[(&'static str, &'static str)]) -> AnalysisRequest {
    let given = [("terms", "x, v, u, x^3"), ("window", "31"), ("order", "5"), ("threshold", "0.02")];
    AnalysisRequest::named(given.into_iter().chain(more.iter().copied())).unwrap()
}

fn watch(more: &[(&'static str, &'static str)]) -> Watch {
    let watching = Watching { last: Some(60.0), ..Watching::default() };
    Watch::new("test", request(more), watching).unwrap()
}

fn take(watch: &mut Watch, bytes: &str) -> Vec<WatchEvent> {
    let mut told = Vec::new();
    watch.take(bytes.as_bytes(), &Cancel::default(), &|_| (), &mut told).unwrap();
    told
}

fn end(watch: &mut Watch) -> Vec<WatchEvent> {
    let mut told = Vec::new();
    watch.end(&Cancel::default(), &|_| (), &mut told).unwrap();
    told
}

fn updates(events: impl IntoIterator<Item = WatchEvent>) -> Vec<StreamUpdate> {
    let update = |event| if let WatchEvent::Update(update) = event { Some(*update) } else { None };
    events.into_iter().filter_map(update).collect()
}

/// What a stream of these pieces of text tells, to its end.
fn watched(pieces: &[String], more: &[(&'static str, &'static str)]) -> (Watch, Vec<StreamUpdate>) {
    let mut watch = watch(more);
    let mut told: Vec<WatchEvent> = pieces.iter().flat_map(|piece| take(&mut watch, piece)).collect();
    told.extend(end(&mut watch));
    (watch, updates(told))
}

fn spring(update: &StreamUpdate) -> f64 {
    update.model.leading().unwrap().coefficient(&Term::parse("x^3").unwrap()).unwrap()
}

#[test]
fn in_whatever_pieces_text_arrives_the_same_is_identified() {
    let rows = text(150.0);
    let (watch, one) = watched(&[rows.concat()], &[]);
    assert_eq!((watch.counts().taken, watch.counts().gaps), (rows.len() - 1, 0));
    assert!((spring(one.last().unwrap()) + 0.6).abs() < 0.01, "{}", spring(one.last().unwrap()));
    let whole = rows.concat();
    let chunks = |size: usize| -> Vec<String> {
        whole.as_bytes().chunks(size).map(|c| String::from_utf8_lossy(c).into_owned()).collect()
    };
    for pieces in [rows.clone(), chunks(17), chunks(5000)] {
        assert_eq!(watched(&pieces, &[]).1, one);
    }
}

#[test]
fn rows_that_come_twice_or_again_after_a_new_header_change_nothing() {
    let rows = text(150.0);
    let (_, plain) = watched(&rows, &[]);
    let mut stuttering = rows[..9000].to_vec();
    // The sender sends its last second again, begins with its header again, and goes on.
    stuttering.extend_from_slice(&rows[8900..9000]);
    stuttering.push(rows[0].clone());
    stuttering.extend_from_slice(&rows[8990..]);
    let (watch, told) = watched(&stuttering, &[]);
    assert_eq!(told.last(), plain.last());
    assert_eq!((watch.counts().repeated, watch.counts().restarts, watch.counts().gaps), (110, 0, 0));
}

#[test]
fn a_source_that_stops_and_comes_back_loses_nothing_that_arrived() {
    let rows = text(200.0);
    // Five seconds are missing, then its clock begins anew.
    let options = ScenarioOptions { duration: Some(100.0), seed: 5, ..ScenarioOptions::default() };
    let again = generate("duffing-multisine", &options).unwrap().records.remove(0);
    let values = |role| again.channel(role).unwrap().values.clone();
    let (x, u) = (values(Role::Displacement(0)), values(Role::Input(0)));
    let mut all: Vec<String> = rows[..12_000].iter().chain(&rows[12_500..]).cloned().collect();
    all.extend((0..again.len()).map(|k| format!("{:.2},{},{}\n", again.time(k), x[k], u[k])));
    let (watch, told) = watched(&all, &[]);
    let counts = watch.counts();
    assert_eq!(counts.taken, all.len() - 1, "{counts:?}");
    assert_eq!((counts.gaps, counts.restarts, counts.late), (1, 1, 0));
    for update in &told {
        assert!((spring(update) + 0.6).abs() < 0.03, "{} s: {}", update.time, spring(update));
    }
    assert!(told.iter().all(|u| u.alarm.is_none()), "{:?}", told.iter().find(|u| u.alarm.is_some()));
    assert!(told.last().unwrap().samples == counts.taken);
    // What is shown and kept is what came last, however short.
    let mut watch = self::watch(&[]);
    take(&mut watch, &[&rows[..9000], &rows[9500..10_500]].concat().concat());
    let record = watch.record().unwrap();
    assert!((record.duration() - 10.0).abs() < 0.05, "{}", record.duration());
}

#[test]
fn rows_without_a_time_count_by_the_rate_and_a_bad_line_is_a_gap() {
    let rows = text(150.0);
    let mut bare: Vec<String> =
        rows[1..].iter().map(|row| row.split_once(',').map(|(_, rest)| rest.to_owned()).unwrap()).collect();
    bare.insert(0, "x,u\n".into());
    bare[10_000] = "oops\n".into();
    let (watch, told) = watched(&bare, &[("rate", "100")]);
    assert_eq!(watch.counts().unreadable, 1);
    assert_eq!(watch.counts().taken, bare.len() - 1);
    assert!((spring(told.last().unwrap()) + 0.6).abs() < 0.01);
    assert!((told.last().unwrap().time - 150.0).abs() < 1.0, "{}", told.last().unwrap().time);
}

#[test]
fn a_slow_motion_is_given_more_time_unless_a_length_is_asked_for() {
    let rows = text(200.0);
    let open = || Watch::new("test", request(&[]), Watching::default()).unwrap();
    let mut watch = open();
    let told: Vec<WatchEvent> = rows.iter().flat_map(|row| take(&mut watch, row)).collect();
    let noticed = told.iter().any(|e| matches!(e, WatchEvent::Notice(what) if what.contains("slow")));
    let settled = told.iter().find_map(|e| if let WatchEvent::Settled(s) = e { Some(s) } else { None }).unwrap();
    assert!(noticed && settled.last > USUAL_LAST && settled.blocking.kept >= 8, "{settled:?}");
    assert!(settled.opening.duration() >= OPENING_SHARE * settled.last);
    let asked = Watching { last: Some(20.0), ..Watching::default() };
    let mut watch = Watch::new("test", request(&[]), asked).unwrap();
    let refused =
        rows.iter().find_map(|row| watch.take(row.as_bytes(), &Cancel::default(), &|_| (), &mut Vec::new()).err());
    assert!(refused.unwrap().to_string().contains("where 8 are needed"));
}

#[test]
fn what_is_left_open_is_chosen_from_the_first_seconds_and_the_last_ones_are_a_record() {
    let rows = text(150.0);
    let watching = Watching { last: Some(60.0), ..Watching::default() };
    let mut watch = Watch::new("test", AnalysisRequest::default(), watching).unwrap();
    let told: Vec<WatchEvent> = rows.chunks(500).flat_map(|rows| take(&mut watch, &rows.concat())).collect();
    let settled = told.iter().find_map(|e| if let WatchEvent::Settled(s) = e { Some(s) } else { None }).unwrap();
    assert!(settled.choice.is_some() && !settled.settings.refine);
    let last = updates(told.clone()).pop().unwrap();
    assert!((spring(&last) + 0.6).abs() < 0.02, "{last:?}");
    let record = watch.record().unwrap();
    assert!((record.duration() - 60.0).abs() < 0.05 && (record.time(record.len() - 1) - 149.99).abs() < 0.02);
    let json = update_json(&last, settled);
    assert_eq!(json["equations"][1]["state"], "v");
    assert!(json["alarm"].is_null() && json["residual_ratio"].is_number());
}

#[test]
fn a_stream_that_cannot_be_used_is_refused_in_a_sentence() {
    let refused = |text: &str| {
        let mut watch = watch(&[]);
        let mut told = Vec::new();
        watch.take(text.as_bytes(), &Cancel::default(), &|_| (), &mut told).expect_err("refused").to_string()
    };
    assert!(refused("t,y\n0,1\n1,2\n").contains("displacement"));
    let uneven: String =
        (0..4000).map(|k| format!("{},{}\n", 0.05 * f64::from(k) + 0.02 * f64::from(k * k % 3), k)).collect();
    let words = refused(&format!("t,x\n{uneven}"));
    assert!(words.contains("stream"), "{words}");
    let calibrated = AnalysisRequest::named([("estimate", "delay(u)")]).unwrap();
    assert!(Watch::new("test", calibrated, Watching::default()).is_err());
}
