//! Draws stated odds against found ones from what the study of hidden effects prints:
//!
//! `cargo test --profile study -p sindyscope-search --test hidden_effects -- --ignored --nocapture the_wide_study > study.txt`,
//! then `cargo run --release --no-default-features --example odds -- study.txt docs/reference/odds.svg`.

use std::error::Error;
use std::path::Path;

use sindyscope_report::document::{FigureFormat, FigureSize};
use sindyscope_report::figure::{Axis, Figure, Layer, Panel, Points, Shape};
use sindyscope_report::palette::Ink;
use sindyscope_values::format::shown::ShownUnits;
use statrs::distribution::{Beta, ContinuousCDF as _};

/// What stands above the table in the study's print.
const HEADING: &str = "stated odds against found ones";
/// Where the last class, which has no end, is drawn to: leads of some thousands are rare.
const LAST: f64 = 8000.0;

/// The names of a class of leads.
struct Class {
    /// Least and largest lead, log density.
    leads: (f64, f64),
    named: f64,
    wrong: f64,
}

impl Class {
    /// A row of the table: `10 to 30 (wrong: 4.5e-5)  5  0 …`, or `above 1000 …`.
    fn of(line: &str) -> Option<Self> {
        let (class, rest) = line.split_once(" (wrong: ")?;
        let leads = match (class.split_once(" to "), class.strip_prefix("above ")) {
            (Some((low, high)), _) => (low.trim().parse().ok()?, high.trim().parse().ok()?),
            (None, Some(low)) => (low.trim().parse().ok()?, LAST),
            (None, None) => return None,
        };
        let mut counts = rest.split_whitespace().skip(1).map_while(|count| count.parse::<f64>().ok());
        Some(Self { leads, named: counts.next()?, wrong: counts.next()? })
    }

    /// Where it is drawn.
    fn middle(&self) -> f64 {
        (self.leads.0 * self.leads.1).sqrt()
    }

    /// Ends of the interval that holds the share of wrong names 19 times in 20 (Clopper, Pearson, Biometrika 26 (1934) 404).
    fn interval(&self) -> Result<(f64, f64), Box<dyn Error>> {
        let right = self.named - self.wrong;
        let low = if self.wrong > 0.0 { Beta::new(self.wrong, right + 1.0)?.inverse_cdf(0.025) } else { 0.0 };
        let high = if right > 0.0 { Beta::new(self.wrong + 1.0, right)?.inverse_cdf(0.975) } else { 1.0 };
        Ok((low, high))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [study, picture] = arguments.as_slice() else {
        return Err("give the file that the study printed, and the picture's".into());
    };
    let printed = std::fs::read_to_string(study)?;
    let (_, table) = printed.split_once(HEADING).ok_or_else(|| format!("{study} has no line `{HEADING}`"))?;
    let classes: Vec<Class> = table.lines().filter_map(Class::of).filter(|class| class.named > 0.0).collect();
    if classes.is_empty() {
        return Err(format!("{study} has no row below `{HEADING}`").into());
    }
    let percent = |class: &Class| [class.middle(), 100.0 * class.wrong / class.named];
    let bars = classes.iter().map(|class| {
        let (low, high) = class.interval()?;
        Ok([class.middle(), 100.0 * low, 100.0 * high])
    });
    let bars: Vec<[f64; 3]> = bars.collect::<Result<_, Box<dyn Error>>>()?;
    let stated = (0..=400).map(|k| {
        let lead = 3.0 * (LAST / 3.0_f64).powf(f64::from(k) / 400.0);
        [lead, 100.0 / (1.0 + lead.exp())]
    });
    let x = Axis::logarithmic("least lead, log density", "", (3f64.log10(), LAST.log10()));
    let y = Axis::linear("wrong names, %", "", (-2.0, 100.0));
    let mut panel = Panel::new("odds", x, y);
    panel.layers = vec![
        Layer::new(Ink::Mean, "as stated", Shape::Line(Points::new(stated))),
        Layer::new(Ink::Identified, "", Shape::Errors(bars)),
        Layer::new(
            Ink::Identified,
            "found, with 95 % intervals",
            Shape::Marks(Points::new(classes.iter().map(percent))),
        ),
    ];
    let names: f64 = classes.iter().map(|class| class.named).sum();
    let figure =
        Figure::stacked([(panel, 1.0)], 300.0, format!("Wrong names among {names} that were named and explained"));
    let size = FigureSize { width: 150.0, height: 85.0, ..FigureSize::default() };
    let picture = Path::new(picture);
    let drawing = figure.svg(size, &ShownUnits::default());
    std::fs::write(picture, FigureFormat::of(picture)?.bytes(&drawing, &figure.caption)?)?;
    Ok(())
}
