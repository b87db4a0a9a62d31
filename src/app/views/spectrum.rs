//! Amplitude spectra of measurement, model and error.

use crate::app::plot::palette::Painted as _;
use std::sync::{Arc, OnceLock};

use egui::{Align, Align2, Id, Layout, Stroke, Ui, pos2, vec2};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotMemory, PlotPoint, PlotPoints, VLine};

use super::cache::Spectra;
use super::legend::{self, Entry};
use super::panel::{self, AXIS_WIDTH};
use super::scene::Scene;
use super::{Request, View, ViewState};
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::units::Scale;
use crate::app::plot::{axis, decimate, export, pointer, units};
use sindyscope_core::signal::Spectrum;

const ID: &str = "spectrum";

/// Records longer than this are transformed beside the window, which goes on meanwhile.
const AT_ONCE: usize = 1 << 17;

/// On a linear axis as many times the main frequency is shown at first: its harmonics, which nonlinearity makes.
const HARMONICS: f64 = 10.0;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let cell = spectra(ui, scene, state);
    let Some(spectra) = cell.get() else {
        legend::note(ui, "Computing the spectra…");
        return None;
    };
    let Some(measured) = &spectra.measured else {
        legend::note(ui, "The record is too short for a spectrum: it takes eight samples");
        return None;
    };
    let curves = [
        (Ink::Measured, "measured", Some(measured)),
        (Ink::Identified, "identified", spectra.identified.as_ref()),
        (Ink::Error, "error", spectra.error.as_ref()),
    ];
    let (_, unit) = scene.shown();
    let level = noise_level(scene);
    let mut entries: Vec<Entry<'_>> =
        curves.iter().filter(|c| c.2.is_some()).map(|c| Entry { ink: c.0, name: c.1 }).collect();
    if level.is_some() {
        entries.push(Entry { ink: Ink::NoiseFloor, name: "noise floor" });
    }
    let size = vec2(ui.available_width(), legend::HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.add_space(AXIS_WIDTH);
        legend::entries(ui, scene, &entries, &mut state.hidden, state.printing);
    });

    let log = state.log_frequency;
    let place = |f: f64| if log { f.log10() } else { f };
    let peak = spectra.peak;
    let highest = measured.frequency(measured.amplitudes.len() - 1);
    let x_range = if log {
        (measured.step.log10(), highest.log10())
    } else {
        (0.0, peak.map_or(highest, |p| (HARMONICS * p.frequency).min(highest)))
    };
    let y_range = spectra.range;
    let id = Id::unique(("view", View::Spectrum, ID, log));
    let must_fit = state.cache.must_fit(View::Spectrum, if log { "log" } else { "linear" });
    let memory = PlotMemory::load(ui.ctx(), id);
    let visible =
        memory.filter(|m| !must_fit && !m.auto_bounds.x).map_or(x_range.0..=x_range.1, |m| m.bounds().range_x());
    let room = ui.available_size();
    for (ink, _, spectrum) in curves {
        let (Some(spectrum), drawn) = (spectrum, state.cache.drawn.entry((ID, ink)).or_default()) else { continue };
        let columns = f64::from(room.x * ui.ctx().pixels_per_point()).max(100.0);
        let (min, max) = ([*visible.start(), 0.0], [*visible.end(), 1.0]);
        if let Some(wanted) = drawn.wanted(min, max, [columns, 1.0], log) {
            let range = wanted.min[0]..=wanted.max[0];
            // The line at zero is the mean, and has no place on a logarithmic axis.
            let points = spectrum
                .amplitudes
                .iter()
                .enumerate()
                .skip(1)
                .map(|(k, a)| PlotPoint::new(place(spectrum.frequency(k)), a.max(f64::MIN_POSITIVE).log10()));
            let columns = (wanted.scale[0] * (range.end() - range.start())) as usize;
            decimate::columns(points, range, columns, &mut drawn.points);
        }
    }
    let hertz = Scale::plain("Hz");
    let (cache, hidden) = (&state.cache, &state.hidden);
    let mut plot = Plot::new(ID)
        .id(id)
        .height(room.y)
        .y_axis_min_width(AXIS_WIDTH)
        .x_axis_label(if log { "f".to_owned() } else { hertz.axis("f") })
        .y_axis_label("amplitude")
        .y_axis_formatter(|mark, _| axis::decade_label(mark, &unit))
        .y_grid_spacer(axis::decade_marks)
        .grid_color(palette::grid(scene.dark))
        .grid_fade(0.3)
        .default_x_bounds(x_range.0, x_range.1)
        .default_y_bounds(y_range.0, y_range.1)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false);
    plot = if log {
        plot.x_grid_spacer(axis::decade_marks).x_axis_formatter(|mark, _| axis::decade_label(mark, "Hz"))
    } else {
        plot.x_grid_spacer(axis::round_marks(10.0)).x_axis_formatter(|mark, _| axis::linear_label(mark, &hertz))
    };
    let response = plot.show(ui, |plot| {
        if must_fit {
            plot.set_auto_bounds(true);
        }
        let scroll = plot.ctx().input(|i| i.smooth_scroll_delta.y);
        if scroll != 0.0 && plot.response().contains_pointer() {
            plot.zoom_bounds_around_hovered(vec2((scroll / 240.0).exp(), 1.0));
        }
        for (ink, _, _) in curves.iter().filter(|c| c.2.is_some() && !hidden.contains(&c.0)) {
            if let Some(drawn) = cache.drawn.get(&(ID, *ink)) {
                let stroke = Stroke::new(ink.width(), scene.color(*ink));
                plot.line(
                    Line::new("", PlotPoints::Borrowed(&drawn.points)).id(*ink).stroke(stroke).allow_hover(false),
                );
            }
        }
        if let Some(level) = level.filter(|_| !hidden.contains(&Ink::NoiseFloor)) {
            let stroke = Stroke::new(Ink::NoiseFloor.width(), scene.color(Ink::NoiseFloor));
            plot.hline(HLine::new("", level.log10()).stroke(stroke).style(Ink::NoiseFloor.style()).allow_hover(false));
        }
        if let Some(peak) = peak {
            let stroke = Stroke::new(1.0, palette::cursor(scene.dark));
            let line = VLine::new("", place(peak.frequency)).stroke(stroke);
            plot.vline(line.style(LineStyle::Dotted { spacing: 4.0 }).allow_hover(false));
        }
    });

    let frame = *response.transform.frame();
    let painter = ui.painter().with_clip_rect(frame);
    if let Some(peak) = peak {
        let x = response.transform.position_from_point_x(place(peak.frequency));
        let (anchor, shift) = if x > frame.center().x { (Align2::RIGHT_TOP, -4.0) } else { (Align2::LEFT_TOP, 4.0) };
        let label = format!("{}, {}", hertz.format(peak.frequency, 5), units::format_si(peak.amplitude, &unit, 3));
        let at = pos2(x + shift, frame.top() + 4.0);
        legend::tag(&painter, ui, anchor, at, &label, ui.visuals().text_color(), palette::ground(scene.dark));
    }
    if response.response.double_clicked() {
        state.cache.fit_all();
        ui.ctx().request_repaint();
    }
    if let Some(pointer) = response.response.hover_pos().filter(|_| !response.response.dragged()) {
        let x = response.transform.value_from_position(pointer).x;
        let frequency = if log { 10f64.powf(x) } else { x };
        read_out(scene, state, &curves, &unit, &response.response, frequency);
    }
    panel::menu(&response.response, state, || {
        let present: Vec<(&str, &Spectrum)> = curves.iter().filter_map(|(_, n, s)| Some((*n, (*s)?))).collect();
        let headers: Vec<String> = std::iter::once("f (Hz)".to_owned())
            .chain(present.iter().map(|(n, _)| Scale::plain(unit.as_str()).axis(&format!("amplitude {n}"))))
            .collect();
        export::csv(&headers, measured.amplitudes.len(), |row, column| match column {
            0 => Some(measured.frequency(row)),
            _ => present[column - 1].1.amplitudes.get(row).copied(),
        })
    })
}

/// The spectra of the displacement shown, computed when first asked for.
fn spectra(ui: &Ui, scene: &Scene<'_>, state: &mut ViewState) -> Arc<OnceLock<Spectra>> {
    if let Some(cell) = &state.cache.spectra {
        return Arc::clone(cell);
    }
    let cell = Arc::new(OnceLock::new());
    state.cache.spectra = Some(Arc::clone(&cell));
    let (outcome, index, freedom, interval) = (Arc::clone(scene.outcome), scene.index, scene.freedom, scene.interval());
    let level = noise_level(scene);
    let compute = move || {
        let record = &outcome.records[index];
        let measured = record.record.sensor(freedom).map_or(&[][..], |c| &c.values);
        let response = record.channels.get(freedom).map_or(&[][..], |c| &c.response);
        let error: Vec<f64> = measured.iter().zip(response).map(|(m, r)| m - r).collect();
        let (measured, identified, error) =
            (Spectrum::new(measured, interval), Spectrum::new(response, interval), Spectrum::new(&error, interval));
        // A model's response has no noise, and would draw the view out far beneath what was measured.
        let range = value_range([&measured, &error].into_iter().flatten(), level);
        let peak = measured.as_ref().and_then(Spectrum::peak);
        Spectra { measured, identified, error, peak, range }
    };
    if scene.measured().len() <= AT_ONCE || state.printing {
        let _ = cell.set(compute());
        return cell;
    }
    let (filled, ctx) = (Arc::clone(&cell), ui.ctx().clone());
    let work = move || {
        let _ = filled.set(compute());
        ctx.request_repaint();
    };
    if std::thread::Builder::new().name("spectrum".into()).spawn(work).is_err() {
        state.cache.spectra = None;
    }
    cell
}

/// What the noise leaves in each line of a spectrum with a Hann window: σ √(4 Σw² / (Σw)²) = σ √(6/n).
fn noise_level(scene: &Scene<'_>) -> Option<f64> {
    scene.noise().map(|n| n * (6.0 / scene.measured().len() as f64).sqrt())
}

/// From a little below the quiet half of the lines to the highest.
fn value_range<'a>(spectra: impl Iterator<Item = &'a Spectrum>, level: Option<f64>) -> (f64, f64) {
    let (mut low, mut high) = (level.unwrap_or(f64::INFINITY), 0.0f64);
    for spectrum in spectra {
        let mut sorted: Vec<f64> = spectrum.amplitudes[1..].to_vec();
        let middle = sorted.len() / 2;
        let (_, median, above) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
        low = low.min(*median);
        high = above.iter().copied().fold(high.max(*median), f64::max);
    }
    if !(high > 0.0 && high.is_finite()) {
        return (-1.0, 0.0);
    }
    (low.max(1e-9 * high).min(1e-2 * high).log10() - 0.7, high.log10() + 0.4)
}

fn read_out(
    scene: &Scene<'_>,
    state: &ViewState,
    curves: &[(Ink, &str, Option<&Spectrum>); 3],
    unit: &str,
    response: &egui::Response,
    frequency: f64,
) {
    pointer::tooltip(response).show(|ui| {
        let text = ui.visuals().text_color();
        let mut rows = vec![("f".to_owned(), Scale::plain("Hz").format(frequency, 4), text)];
        for (ink, name, spectrum) in curves.iter().filter(|c| !state.hidden.contains(&c.0)) {
            let line = |s: &&Spectrum| s.amplitudes.get((frequency / s.step).round().max(0.0) as usize).copied();
            if let Some(amplitude) = spectrum.as_ref().and_then(line) {
                rows.push(((*name).to_owned(), units::format_si(amplitude, unit, 3), scene.color(*ink)));
            }
        }
        panel::table_of(ui, &rows);
    });
}
