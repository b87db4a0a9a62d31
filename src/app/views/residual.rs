//! What is left of the measurement: its distribution, and what it goes with.

use super::{Request, View, ViewState, kept, painter};
use egui::Ui;
use egui_plot::PlotPoint;

use super::figure::{Axis, Figure, Graph, Shape};
use super::legend::{self, Entry};
use super::scene::Scene;
use crate::app::plot::number::{plain, significant};
use crate::app::plot::palette::Ink;
use crate::app::plot::units::{format_si, per_second};
use sindyscope_report::diagram::{Correlation, Histogram, Partner, Residual, Source};
use sindyscope_values::term::Layout;

/// Share of lags outside a band from which a correlation is marked: chance leaves 0.05, seldom twice that.
const SUSPECT: f64 = 0.15;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let (index, freedom, source, layout) = (scene.index, scene.freedom, state.residual_of, scene.layout);
    let unit = match source {
        Source::Response => scene.shown().1,
        Source::Equation if scene.second_order() => per_second(&per_second(&scene.unit())),
        Source::Equation => per_second(&scene.unit()),
    };
    let choice = [index, freedom, usize::from(source == Source::Equation), 0, 0, 0];
    let printing = state.printing;
    let figure =
        state.cache.figures.get(ui, View::Residual, scene, choice, printing, move |outcome| {
            match Residual::new(outcome, &outcome.records[index], freedom, source) {
                Some(residual) => figure(&residual, &unit, &layout),
                None => Figure::Note(
                    "There is no residual to judge: the record is too short, or nothing is left over".into(),
                ),
            }
        });
    let graphs = kept::graphs(ui, figure.as_deref(), "Computing the residual's correlations…")?;
    legend::reading(
        ui,
        match source {
            Source::Response => {
                "If the model is right, what is left is noise: the histogram follows the normal curve, and 95 of 100 lags lie \
                 within the bands. A lag far outside says what the residual still goes with."
            }
            Source::Equation => {
                "If the equation is right, what is left goes with nothing: 95 of 100 lags lie within the bands. Smoothing \
                 itself colours this residual over about one segment; beyond it, structure is a missing term."
            }
        },
    );
    let names = [
        Entry { ink: Ink::Error, name: "residual" },
        Entry { ink: Ink::Mean, name: "normal" },
        Entry { ink: Ink::NoiseFloor, name: "95 % band" },
    ];
    painter::names(ui, scene, state, &names);
    let shown = 2 + state.partner.min(graphs.len().saturating_sub(3));
    if graphs.len() > 3 && !state.printing {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.weak("Against");
            for (k, graph) in graphs.iter().enumerate().skip(2) {
                let outside = graph.outside.unwrap_or(0.0);
                let name = graph.columns.get(1).map_or("", |c| c.0.as_str());
                let text = if outside > SUSPECT { format!("{name} •") } else { name.to_owned() };
                let hint =
                    format!("{} % of the lags lie outside the band; 5 % do by chance", plain(100.0 * outside, 0));
                let response = ui.selectable_label(k == shown, text).on_hover_text(hint);
                let spoken = format!("against {name}");
                response.widget_info(|| egui::WidgetInfo::selected(egui::Role::RadioButton, true, k == shown, &spoken));
                if response.clicked() {
                    state.partner = k - 2;
                }
            }
        });
    }
    let rows: &[painter::Row<'_>] =
        if graphs.len() > 2 { &[(&[0, 1], 1.0), (&[shown], 0.9)] } else { &[(&[0, 1], 1.0)] };
    painter::rows(ui, View::Residual, scene, state, graphs, rows)
}

fn figure(residual: &Residual, unit: &str, layout: &Layout) -> Figure {
    let mut graphs = vec![distribution(&residual.histogram, residual.samples, unit)];
    graphs.push(correlation(&residual.itself, residual.interval, layout, "autocorrelation"));
    let ids = ["with 0", "with 1", "with 2", "with 3", "with 4", "with 5", "with 6", "with 7", "with 8", "with 9"];
    let with = residual.with.iter().zip(ids);
    graphs.extend(with.map(|(c, id)| correlation(c, residual.interval, layout, id)));
    Figure::Graphs(graphs)
}

fn distribution(histogram: &Histogram, samples: usize, unit: &str) -> Graph {
    let (first, last) = (histogram.edges[0], histogram.edges[histogram.edges.len() - 1]);
    let normal: Vec<PlotPoint> = (0..=120)
        .map(|k| first + (last - first) * f64::from(k) / 120.0)
        .map(|v| PlotPoint::new(v, histogram.normal(v)))
        .collect();
    let most = histogram.density.iter().copied().chain(normal.iter().map(|p| p.y)).fold(0.0, f64::max);
    let per_unit = match unit {
        "" => String::new(),
        unit if unit.contains(['/', ' ']) => format!("1/({unit})"),
        unit => format!("1/{unit}"),
    };
    let x = Axis::linear("residual", unit, (first, last));
    let y = Axis::linear("density", per_unit, (0.0, 1.08 * most));
    let middle = histogram.edges.windows(2).map(|e| 0.5 * (e[0] + e[1])).collect::<Vec<f64>>();
    let columns = vec![
        (x.header(), middle.clone()),
        (y.header(), histogram.density.clone()),
        (format!("{} of a normal distribution", y.header()), middle.iter().map(|v| histogram.normal(*v)).collect()),
    ];
    let layers = vec![
        (Ink::Error, Shape::Bars(histogram.edges.clone(), histogram.density.clone())),
        (Ink::Mean, Shape::Line(normal)),
    ];
    let caption = format!(
        "{samples} samples: s.d. {}, kurtosis {}",
        format_si(histogram.deviation, unit, 3),
        significant(histogram.kurtosis + 3.0, 2)
    );
    Graph { id: "histogram", caption, x, y, layers, map: None, columns, outside: None }
}

fn correlation(correlation: &Correlation, interval: f64, layout: &Layout, id: &'static str) -> Graph {
    let own = correlation.partner == Partner::Itself;
    let name = correlation.partner.name(layout);
    let lags: Vec<f64> = correlation.lags.clone().map(|k| k as f64 * interval).collect();
    let line: Vec<PlotPoint> = lags.iter().zip(&correlation.value).map(|(l, v)| PlotPoint::new(*l, *v)).collect();
    // The one at lag zero of itself is known.
    let most = correlation.value.iter().skip(usize::from(own)).fold(0.0_f64, |m, v| m.max(v.abs()));
    let most = (1.15 * most).max(2.5 * correlation.band).min(1.05);
    let reach = lags.last().copied().unwrap_or(1.0);
    let behind = if own { "lag".to_owned() } else { format!("lag of the residual behind {name}") };
    let x = Axis::linear(behind, "s", (if own { -0.01 * reach } else { -1.01 * reach }, 1.01 * reach));
    let y = Axis::linear("correlation", "", (-most, most));
    let outside = plain(100.0 * correlation.outside, 0);
    let caption = if own {
        format!("autocorrelation, {outside} % outside")
    } else {
        format!("correlation with {name}: {outside} % of the lags outside the band (5 % by chance)")
    };
    let band = correlation.band;
    let columns = vec![
        (x.header(), lags),
        (if own { "correlation".to_owned() } else { name }, correlation.value.clone()),
        ("95 % band ±".to_owned(), vec![band; correlation.value.len()]),
    ];
    let layers = vec![(Ink::NoiseFloor, Shape::Levels(vec![-band, band])), (Ink::Error, Shape::Line(line))];
    Graph { id, caption, x, y, layers, map: None, columns, outside: Some(correlation.outside) }
}
