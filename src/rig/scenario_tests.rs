use super::*;

#[test]
fn probe() {
    for s in scenarios() {
        let t = std::time::Instant::now();
        let g = generate(s.name, &ScenarioOptions::default()).unwrap();
        println!("{:20} {:?} {}", s.name, t.elapsed(), g.records.len());
        for c in &g.comments {
            println!("   # {c}");
        }
        for r in &g.records {
            for c in &r.channels {
                println!(
                    "    {} {} n {} peak {:.6}",
                    r.name,
                    c.name,
                    r.len(),
                    c.values.iter().fold(0.0f64, |a, b| a.max(b.abs()))
                );
            }
        }
    }
}
