//! What is left of the measurement: its distribution, and what it goes with.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::diagram::{Correlation, Histogram, Partner, Residual, ResidualSource};
use crate::figure::{Axis, Figure, Guide, KeyMark, Layer, LegendEntry, Panel, PanelRow, PlotBar, Points, Shape};
use crate::palette::Ink;
use sindyscope_values::format::number::{plain, significant};
use sindyscope_values::format::units::{format_si, per_second};
use sindyscope_values::term::Layout;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Residual",
    tooltip: "What the model leaves: its distribution, and what it still goes with",
    reading: "If the model is right, what is left is noise: the histogram follows the normal curve, and 95 of 100 lags lie within \
              the bands. A lag far outside says what the residual still goes with. Smoothing itself colours the residual of the \
              acceleration over about one segment.",
    group: Group::Physics,
    records: RecordUse::One,
    slow: true,
    figure,
};

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let source = subject.options.residual_of;
    let unit = match source {
        ResidualSource::Response => scene.shown().1,
        ResidualSource::Equation if scene.second_order() => per_second(&per_second(&scene.unit())),
        ResidualSource::Equation => per_second(&scene.unit()),
    };
    let residual = Residual::new(scene.outcome, scene.record, scene.freedom, source)
        .ok_or("There is no residual to judge: the record is too short, or nothing is left over")?;
    let layout = &scene.layout;
    let own = correlation(&residual.itself, residual.interval, layout);
    let mut rows = vec![PanelRow::new(vec![distribution(&residual.histogram, residual.samples, &unit), own], 1.0)];
    let with: Vec<Panel> = residual.with.iter().map(|c| correlation(c, residual.interval, layout)).collect();
    // The one that tells most.
    let most = residual.with.iter().enumerate().max_by(|a, b| a.1.outside.total_cmp(&b.1.outside));
    if let Some((index, _)) = most {
        rows.push(PanelRow { one_of: Some(index), ..PanelRow::new(with, 0.9) });
    }
    let patch = LegendEntry { mark: KeyMark::Patch, ..LegendEntry::line(Ink::Error, "residual") };
    let legend = vec![patch, LegendEntry::line(Ink::Mean, "normal"), LegendEntry::line(Ink::NoiseFloor, "95 % band")];
    let mut caption = format!(
        "What the model leaves of {} on record {} (measured − identified). If it is noise, 95 of 100 lags lie within the bands; {} % \
         of the autocorrelation's do not",
        scene.shown().0,
        scene.record.record.name,
        plain(100.0 * residual.itself.outside, 0)
    );
    if let Some((_, most)) = most {
        let (outside, name) = (plain(100.0 * most.outside, 0), most.partner.name(layout));
        caption += &format!(", and {outside} % of those with {name}, which it goes with most");
    }
    caption.push('.');
    let height = 165.0 * rows.len() as f64;
    Ok(Figure { rows, legend, caption, height })
}

fn distribution(histogram: &Histogram, samples: usize, unit: &str) -> Panel {
    let (first, last) = (histogram.edges[0], histogram.edges[histogram.edges.len() - 1]);
    let values = (0..=120).map(|k| first + (last - first) * f64::from(k) / 120.0);
    let normal: Vec<[f64; 2]> = values.map(|v| [v, histogram.normal(v)]).collect();
    let most = histogram.density.iter().copied().chain(normal.iter().map(|p| p[1])).fold(0.0, f64::max);
    let per_unit = match unit {
        "" => String::new(),
        unit if unit.contains(['/', ' ']) => format!("1/({unit})"),
        unit => format!("1/{unit}"),
    };
    let x = Axis::linear("residual", unit, (first, last));
    let y = Axis::linear("density", per_unit, (0.0, 1.08 * most));
    let mut panel = Panel::new("histogram", x, y);
    let middle = histogram.edges.windows(2).map(|e| 0.5 * (e[0] + e[1])).collect::<Vec<f64>>();
    panel.columns = vec![
        (panel.x.header(), middle.clone()),
        (panel.y.header(), histogram.density.clone()),
        (
            format!("{} of a normal distribution", panel.y.header()),
            middle.iter().map(|v| histogram.normal(*v)).collect(),
        ),
    ];
    let bars = histogram.edges.windows(2).zip(&histogram.density).map(|(edges, height)| {
        let gap = 0.03 * (edges[1] - edges[0]);
        PlotBar { from: edges[0] + gap, to: edges[1] - gap, height: *height, text: String::new(), text_at: *height }
    });
    panel.layers = vec![
        Layer::new(Ink::Error, "", Shape::Bars { bars: bars.collect(), hollow: false }),
        Layer::new(Ink::Mean, "", Shape::Line(Points::new(normal))),
    ];
    panel.title = format!(
        "{samples} samples: s.d. {}, kurtosis {}",
        format_si(histogram.deviation, unit, 3),
        significant(histogram.kurtosis + 3.0, 2)
    );
    panel
}

fn correlation(correlation: &Correlation, interval: f64, layout: &Layout) -> Panel {
    let own = correlation.partner == Partner::Itself;
    let name = correlation.partner.name(layout);
    let lags: Vec<f64> = correlation.lags.clone().map(|k| k as f64 * interval).collect();
    // The one at lag zero of itself is known.
    let most = correlation.value.iter().skip(usize::from(own)).fold(0.0_f64, |m, v| m.max(v.abs()));
    let most = (1.15 * most).max(2.5 * correlation.band).min(1.05);
    let reach = lags.last().copied().unwrap_or(1.0);
    let behind = if own { "lag".to_owned() } else { format!("lag of the residual behind {name}") };
    let x = Axis::linear(behind, "s", (if own { -0.01 * reach } else { -1.01 * reach }, 1.01 * reach));
    let mut panel = Panel::new(if own { "itself" } else { "with" }, x, Axis::linear("correlation", "", (-most, most)));
    let outside = plain(100.0 * correlation.outside, 0);
    panel.title = if own {
        format!("autocorrelation, {outside} % outside")
    } else {
        format!("correlation with {name}: {outside} % of the lags outside the band (5 % by chance)")
    };
    let band = correlation.band;
    let line = Points::of(&lags, &correlation.value);
    panel.columns = vec![
        (panel.x.header(), lags),
        (if own { "correlation".to_owned() } else { name.clone() }, correlation.value.clone()),
        ("95 % band ±".to_owned(), vec![band; correlation.value.len()]),
    ];
    let level = |at| Guide::Level { ink: Ink::NoiseFloor, at, text: String::new() };
    panel.guides = vec![level(-band), level(band)];
    panel.layers = vec![Layer::new(Ink::Error, "", Shape::Line(line))];
    panel.choice = (!own).then_some((name, correlation.outside));
    panel
}
