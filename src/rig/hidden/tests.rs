use super::*;

#[test]
fn survey() {
    for shaking in Shaking::ALL {
        for name in names().chain(outside_names()).filter(|n| possible(n, shaking)) {
            let begun = std::time::Instant::now();
            let made = draw(&Request { watching: Watching::white(0.0), ..Request::new([name], shaking, 1) });
            let took = begun.elapsed().as_secs_f64();
            match made {
                Ok(h) => println!("{shaking} {name} {took:.3} {:.4} | {}", h.truth.ratio, h.truth.description),
                Err(e) => println!("{shaking} {name} {took:.3} ERROR {e}"),
            }
        }
    }
}
