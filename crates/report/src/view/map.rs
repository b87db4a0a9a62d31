//! Segment length over threshold, each setting coloured by how well it does.

use serde::{Deserialize, Serialize};

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Cells, Colours, Figure, Guide, Layer, MarkerShape, Panel, Shape, Ticks, percent};
use crate::palette::Ink;
use sindyscope_core::study::{GridCell, Judge, SettingsGrid, SettingsGridPoint};
use sindyscope_values::format::number::significant_trimmed;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Map",
    tooltip: "Every segment length and threshold at once, coloured by the error on what was not fitted",
    reading: "Brighter is better: look for a wide bright plateau, not a single bright spot; a click takes the setting over.",
    group: Group::Settings,
    records: RecordUse::None,
    slow: false,
    figure,
};

/// What marks the setting of the fewest terms within one standard error of the best.
pub const PARSIMONIOUS_SIGN: MarkerShape = MarkerShape::Diamond;

/// What the map is coloured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MapQuantity {
    /// Error of the simulated response on what was not fitted.
    #[default]
    Error,
    /// Number of terms.
    Terms,
    /// What the regression leaves of the rate.
    FitError,
    /// Whiteness of the response's error.
    Whiteness,
}

impl MapQuantity {
    /// Every quantity.
    pub const ALL: [Self; 4] = [Self::Error, Self::Terms, Self::FitError, Self::Whiteness];

    /// Its name.
    pub fn label(self, judge: Judge) -> &'static str {
        match (self, judge) {
            (Self::Error, Judge::HeldOut) => "held-out error",
            (Self::Error, Judge::CrossValidation) => "cross-validated error",
            (Self::Terms, _) => "number of terms",
            (Self::FitError, _) => "fit error",
            (Self::Whiteness, _) => "whiteness",
        }
    }

    /// What it is, in one sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Error => "Error of the simulated response on what was not fitted, as a share of the motion",
            Self::Terms => "Terms that stay in the fitted equations",
            Self::FitError => {
                "What the regression leaves of the acceleration: small wherever there are many terms, right or wrong, \
                 so it is no guide"
            }
            Self::Whiteness => {
                "1 − the largest autocorrelation of the response's error: near 1 where the error is noise alone, near 0 \
                 where it is a motion that the model misses"
            }
        }
    }

    fn value(self, cell: &GridCell) -> f64 {
        match self {
            Self::Error => cell.error,
            Self::Terms => cell.terms as f64,
            Self::FitError => cell.fit_error,
            Self::Whiteness => cell.whiteness,
        }
    }

    fn logarithmic(self) -> bool {
        matches!(self, Self::Error | Self::FitError)
    }

    fn text(self, value: f64) -> String {
        match self {
            Self::Error | Self::FitError => percent(value),
            Self::Terms => format!("{value:.0}"),
            Self::Whiteness => significant_trimmed(value, 2),
        }
    }
}

/// The range of colours: values that are shown dark and bright.
struct Shades {
    quantity: MapQuantity,
    low: f64,
    high: f64,
}

impl Shades {
    fn new(map: &SettingsGrid, quantity: MapQuantity) -> Self {
        let values = map.known().map(|(_, cell)| quantity.value(cell)).filter(|v| v.is_finite());
        let (mut low, mut high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        match quantity {
            // An error as large as the motion is as bad as any.
            MapQuantity::Error | MapQuantity::FitError => {
                high = high.min(1.0).max(1.5 * low);
                low = low.max(1e-6 * high);
            }
            MapQuantity::Terms => high = high.max(low + 1.0),
            MapQuantity::Whiteness => (low, high) = (0.0, 1.0),
        }
        Self { quantity, low, high }
    }

    /// 0 at the worst, 1 at the best.
    fn share(&self, value: f64) -> f64 {
        let place = |v: f64| if self.quantity.logarithmic() { v.max(f64::MIN_POSITIVE).ln() } else { v };
        let share = (place(value) - place(self.low)) / (place(self.high) - place(self.low));
        let share = share.clamp(0.0, 1.0);
        if self.quantity == MapQuantity::Whiteness { share } else { 1.0 - share }
    }

    fn at(&self, share: f64) -> f64 {
        let share = if self.quantity == MapQuantity::Whiteness { share } else { 1.0 - share };
        if self.quantity.logarithmic() {
            self.low * (self.high / self.low).powf(share)
        } else {
            self.low + share * (self.high - self.low)
        }
    }

    /// What stands beside the scale of colours.
    fn marks(&self) -> Vec<(f64, String)> {
        let steps = if self.quantity == MapQuantity::Terms { ((self.high - self.low) as usize).clamp(1, 6) } else { 4 };
        let mark = |k: usize| {
            let share = k as f64 / steps as f64;
            let text = self.quantity.text(self.at(share));
            let more = k == 0 && self.quantity.logarithmic();
            (share, if more { format!("≥ {text}") } else { text })
        };
        (0..=steps).map(mark).collect()
    }
}

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let map = subject.landscape.ok_or("Computing the map…")?;
    let quantity = subject.options.quantity;
    let shades = Shades::new(map, quantity);
    let places = (0..map.windows.len()).flat_map(|w| (0..map.thresholds.len()).map(move |t| (w, t)));
    let simulated = matches!(quantity, MapQuantity::Error | MapQuantity::Whiteness);
    let share = |place: SettingsGridPoint| {
        let cell = map.nearest(place).filter(|cell| !(simulated && cell.failed > 0.0));
        cell.map(|cell| quantity.value(cell)).filter(|v| v.is_finite()).map_or(f64::NAN, |v| shades.share(v))
    };
    let windows: Vec<f64> = map.windows.iter().map(|w| *w as f64).collect();
    let edges = |count: usize| (0..=count).map(|k| k as f64).collect::<Vec<f64>>();
    let cells = Cells {
        columns: edges(map.thresholds.len()),
        rows: edges(map.windows.len()),
        values: places.clone().map(share).collect(),
        remarks: places.map(|place| remark(map, place)).collect(),
        colours: Colours::Shades(shades.marks()),
        name: quantity.label(map.judge).to_owned(),
        ..Cells::default()
    };
    let names = map.windows.iter().enumerate().map(|(k, w)| (k as f64 + 0.5, w.to_string())).collect();
    let x = Axis::linear("threshold", "", (0.0, map.thresholds.len() as f64))
        .with_ticks(Ticks::Named(threshold_ticks(&map.thresholds)));
    let y = Axis::linear("segment (samples)", "", (0.0, map.windows.len() as f64)).with_ticks(Ticks::Named(names));
    let mut panel = Panel::new("map", x, y);
    panel.title = quantity.label(map.judge).to_owned();
    panel.layers.push(Layer::new(Ink::Measured, "", Shape::Cells(cells)));
    let middle = |(window, threshold): SettingsGridPoint| [threshold as f64 + 0.5, window as f64 + 0.5];
    let settings = &scene.outcome.settings;
    let now =
        [index(&map.thresholds, settings.threshold) + 0.5, index(&windows, settings.smoothing.window as f64) + 0.5];
    panel.guides.extend(signs(map.best.map(middle), map.parsimonious.map(middle), Some(now)));
    panel.columns = columns(map);
    panel.fixed = true;
    let caption = format!("The {} over threshold and segment length; brighter is better.", quantity.label(map.judge));
    Ok(Figure::stacked([(panel, 1.0)], 300.0, caption))
}

/// Marks of the best setting, the most parsimonious one and the one that holds now.
pub(super) fn signs(best: Option<[f64; 2]>, parsimonious: Option<[f64; 2]>, now: Option<[f64; 2]>) -> Vec<Guide> {
    [(MarkerShape::Cross, best), (PARSIMONIOUS_SIGN, parsimonious), (MarkerShape::Circle, now)]
        .into_iter()
        .filter_map(|(sign, at)| Some(Guide::Sign { sign, at: at? }))
        .collect()
}

/// Where a value lies among ascending ones, by logarithms; at the edge if it is outside.
fn index(values: &[f64], wanted: f64) -> f64 {
    let after = values.partition_point(|v| *v < wanted);
    match (after.checked_sub(1).map(|k| values[k]), values.get(after)) {
        (Some(a), Some(b)) => (after - 1) as f64 + (wanted / a).ln() / (b / a).ln(),
        (None, Some(_)) if wanted >= values[0] => 0.0,
        (None, _) => -0.3,
        (Some(_), None) => values.len() as f64 - 0.7,
    }
}

/// Round thresholds with their places among those of the map.
fn threshold_ticks(thresholds: &[f64]) -> Vec<(f64, String)> {
    let (Some(low), Some(high)) = (thresholds.first(), thresholds.last()) else { return Vec::new() };
    let (from, to) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let digits: &[f64] = if to - from > 3 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let values = (from..=to).flat_map(|power| digits.iter().map(move |d| d * 10f64.powi(power)));
    let within = values.filter(|v| (*low..=*high).contains(v));
    within.map(|v| (index(thresholds, v) + 0.5, significant_trimmed(v, 1))).collect()
}

/// What is known of a setting.
pub fn remark(map: &SettingsGrid, place: SettingsGridPoint) -> String {
    let Some(cell) = map.cell(place) else { return String::new() };
    let error = if cell.failed > 0.0 { "diverges".to_owned() } else { percent(cell.error) };
    let whiteness = if cell.whiteness.is_finite() { significant_trimmed(cell.whiteness, 2) } else { "–".into() };
    format!(
        "segment {}\nthreshold {}\n{} {error}\nterms {}\nfit error {}\nwhiteness {whiteness}",
        map.windows[place.0],
        significant_trimmed(map.thresholds[place.1], 3),
        MapQuantity::Error.label(map.judge),
        cell.terms,
        percent(cell.fit_error)
    )
}

/// Every cell that is known.
pub(super) fn columns(map: &SettingsGrid) -> Vec<(String, Vec<f64>)> {
    let column = |head: &str, value: &dyn Fn(SettingsGridPoint, &GridCell) -> f64| {
        (head.to_owned(), map.known().map(|(place, cell)| value(place, cell)).collect())
    };
    vec![
        column("segment (samples)", &|place, _| map.windows[place.0] as f64),
        column("threshold", &|place, _| map.thresholds[place.1]),
        column("error (share of the motion)", &|_, cell| cell.error),
        column("share of stretches that diverged", &|_, cell| cell.failed),
        column("terms", &|_, cell| cell.terms as f64),
        column("fit error (share of the rate)", &|_, cell| cell.fit_error),
        column("whiteness", &|_, cell| cell.whiteness),
    ]
}
