//! What the search for missing effects costs: its pieces, the whole, and how soon it obeys.

use std::hint::black_box;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, Instruments, draw};
use sindyscope_search::{Ask, Progress, Search};
use sindyscope_values::record::{RecordSet, Usage};

/// 3000 fitted samples in which an effect is hidden, and a held-out record.
fn records(effect: &str) -> RecordSet {
    let request = HiddenRequest {
        instruments: Instruments::white(0.05),
        ..HiddenRequest::new([effect.to_owned()], ExcitationKind::Multisine, 1)
    };
    let hidden = draw(&request).expect("an effect that can be hidden");
    let mut records = RecordSet::new(hidden.fit, Usage::Fit);
    records.add(hidden.held_out, Usage::HeldOut);
    records
}

fn search(records: &RecordSet) -> Search {
    Search::new(records, &Ask::default()).expect("records that go together")
}

/// Three thousand samples × the whole catalogue.
fn whole(c: &mut Criterion) {
    for effect in ["coulomb_friction", "cubic_stiffness", "second_mode"] {
        let records = records(effect);
        c.bench_function(&format!("diagnose, {effect} hidden, 3000 samples"), |b| {
            b.iter(|| black_box(search(&records).diagnose(&|_| {}, &Cancel::default()).expect("a diagnosis")));
        });
    }
}

fn pieces(c: &mut Criterion) {
    let records = records("coulomb_friction");
    c.bench_function("prepare records", |b| b.iter(|| black_box(search(&records))));
    c.bench_function("refine the base model, 3000 samples", |b| {
        b.iter_with_setup(|| search(&records), |s| black_box(s.base(&Cancel::default()).expect("a base model")));
    });
    // From the press of the button to the first ranked cards.
    c.bench_function("first ranking, 3000 samples", |b| {
        b.iter_custom(|times| {
            let mut sum = Duration::ZERO;
            for _ in 0..times {
                let started = Instant::now();
                let (search, cancel) = (search(&records), Cancel::default());
                let first = std::sync::Mutex::new(None);
                let tell = |progress: Progress| {
                    if matches!(progress, Progress::Ranking(_)) {
                        first.lock().expect("no panic").get_or_insert(started.elapsed());
                        cancel.cancel();
                    }
                };
                let base = search.base(&Cancel::default()).expect("a base model");
                let _ = search.look(&base, &tell, &cancel);
                sum += first.into_inner().expect("no panic").expect("a ranking");
            }
            sum
        });
    });
}

/// From cancelling in the midst of the refits to the search's return.
fn cancelling(c: &mut Criterion) {
    let records = records("second_mode");
    c.bench_function("cancel", |b| {
        b.iter_custom(|times| {
            let mut sum = Duration::ZERO;
            for k in 0..times {
                let cancel = Cancel::default();
                let (send, ended) = mpsc::channel();
                let (records, handle) = (records.clone(), cancel.clone());
                let worker = std::thread::spawn(move || {
                    let _ = search(&records).diagnose(&|_| {}, &handle);
                    send.send(Instant::now()).expect("the bench waits");
                });
                std::thread::sleep(Duration::from_millis(300 + 37 * (k % 10)));
                let pressed = Instant::now();
                cancel.cancel();
                sum += ended.recv().expect("an end").saturating_duration_since(pressed);
                worker.join().expect("no panic");
            }
            sum
        });
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    targets = pieces, whole, cancelling
}
criterion_main!(benches);
