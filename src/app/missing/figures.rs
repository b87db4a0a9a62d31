//! The figures of the room: made of what was found, drawn in the steps, and taken along as pictures and tables.

use std::collections::BTreeSet;
use std::sync::Arc;

use egui::{Context, Sense, Ui, Vec2};

use super::act::{WalkAct, WalkFigure};
use super::canvas::WalkCanvas;
use super::choice;
use super::known::WalkContext;
use super::room::Missing;
use super::subject::WalkSubject;
use crate::app::figure_panel::FigureLook;
use crate::app::plot::figures::{FigurePlace, plot_id};
use crate::app::plot::painter::{self, Wish, zoom};
use crate::app::plot::{display, palette};
use crate::app::records::OpenRecords;
use crate::app::state::{Edit, RoundStep, WalkView};
use palette::Ink;
use sindyscope_report::figure::Figure as Drawing;
use sindyscope_report::walk::{self, Compared, Lacking, WalkResponse};
use sindyscope_search::{Choice, Curve, Map, Profile, Stage, Trace};
use sindyscope_values::format::units::raised;
use sindyscope_values::record::Usage;

/// How a figure is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Manner {
    /// Size, points.
    pub(super) size: Vec2,
    /// Small letters.
    pub(super) compact: bool,
    /// What it reacts to if it is not zoomed.
    pub(super) sense: Sense,
    /// Strength, 0 to 1.
    pub(super) strength: f32,
}

impl Manner {
    pub(super) fn new(size: Vec2) -> Self {
        Self { size, compact: false, sense: Sense::click(), strength: 1.0 }
    }

    pub(super) fn compact(self) -> Self {
        Self { compact: true, ..self }
    }
}

/// Draws a figure; false where there is nothing to draw. `preview` is the candidate under the pointer.
pub(super) fn show(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    (figure, preview): (&WalkFigure, Option<&Choice>),
    manner: Manner,
    acts: &mut Vec<WalkAct>,
) -> bool {
    let Some(drawing) = kept(canvas, context, figure, preview) else { return false };
    let data: Vec<u64> = match figure {
        WalkFigure::Time(_) => drawing.panels().flat_map(|p| [p.x.range.0.to_bits(), p.x.range.1.to_bits()]).collect(),
        _ => Vec::new(),
    };
    // Of these several stand beside each other, each with a plot of its own.
    let number = match figure {
        WalkFigure::Curve(choice) => painter::stamp(format!("{choice:?}")),
        WalkFigure::Why(index) => *index as u64,
        _ => 0,
    };
    let place = FigurePlace {
        number,
        compact: manner.compact,
        sense: manner.sense,
        strength: manner.strength,
        ..FigurePlace::new(figure.place(), figure.spoken(), data)
    };
    let figures = &mut canvas.figures;
    let wish = ui
        .allocate_ui(manner.size, |ui| {
            ui.set_min_size(manner.size);
            figures.draw(ui, &drawing, &place).wish
        })
        .inner;
    match wish {
        Some(Wish::Table(text)) => acts.push(WalkAct::SaveTable(figure.name(), text)),
        Some(Wish::Picture) => acts.push(WalkAct::SaveFigure(figure.clone())),
        None => {}
    }
    true
}

/// A figure, kept as long as it would be the same; none where there is nothing to draw.
pub(super) fn kept(
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    figure: &WalkFigure,
    preview: Option<&Choice>,
) -> Option<Arc<Drawing>> {
    let made_of = made_of(canvas, context, figure, preview)?;
    let mut figures = std::mem::take(&mut canvas.figures);
    let name = match figure {
        WalkFigure::Curve(choice) => format!("{choice:?}"),
        WalkFigure::Why(index) => format!("why {index}"),
        _ => figure.place().to_owned(),
    };
    let drawing = figures.get(name, made_of, || make(canvas, context, figure, preview));
    canvas.figures = figures;
    drawing
}

/// A stage whose response is shown: what it is called, its ink, and its line's width in points.
type ShownStage<'a> = (&'static str, Ink, f32, &'a Stage);

/// The stages whose responses a step shows over each other.
fn stages_shown<'a>(
    canvas: &WalkCanvas,
    context: &WalkContext<'a>,
    step: RoundStep,
    preview: Option<&Choice>,
) -> Option<(Vec<ShownStage<'a>>, &'a Trace)> {
    let find = |stage: &'a Stage, record: &str| stage.traces.iter().find(|t| &*t.record == record);
    match step {
        RoundStep::Add => {
            let before: &Stage = context.stage()?;
            let choice = preview.cloned().or_else(|| choice::looked_at(canvas, context).map(|c| c.choice.clone()));
            let trace = before.traces.get(canvas.view.record)?;
            let effects = before.effects.len();
            let after = choice.and_then(|choice| context.with(&choice));
            let after = after.filter(|s| find(s, &trace.record).is_some());
            let mut stages = vec![("before", Ink::of_stage(effects), 1.1, before)];
            stages.extend(after.map(|s| ("with the effect", Ink::of_stage(effects + 1), 1.6, &**s)));
            Some((stages, trace))
        }
        RoundStep::Verify => {
            let all = context.stages();
            let (first, last) = (*all.first()?, *all.last()?);
            let trace = last.traces.get(choice::record_shown(canvas, last))?;
            let mut stages = Vec::new();
            if all.len() > 1 && find(first, &trace.record).is_some() {
                stages.push(("before", Ink::of_stage(0), 1.1, &**first));
            }
            let (name, width) = if all.len() > 1 { ("after", 1.6) } else { ("base", 1.3) };
            stages.push((name, Ink::of_stage(all.len() - 1), width, &**last));
            Some((stages, trace))
        }
        _ => {
            let stage: &Stage = context.stage()?;
            let trace = stage.traces.get(canvas.view.record)?;
            Some((
                vec![("simulated", Ink::of_stage(context.walk.accepted.len()), Ink::Identified.width(), stage)],
                trace,
            ))
        }
    }
}

/// What a figure is made of, as something that tells it from others; none where there is nothing to draw.
fn made_of(
    canvas: &WalkCanvas,
    context: &WalkContext<'_>,
    figure: &WalkFigure,
    preview: Option<&Choice>,
) -> Option<Vec<u64>> {
    let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<u64>>();
    let pairs = |points: &[[f64; 2]]| points.iter().flatten().map(|v| v.to_bits()).collect::<Vec<u64>>();
    Some(match figure {
        WalkFigure::Time(step) => {
            let (stages, trace) = stages_shown(canvas, context, *step, preview)?;
            let address = |values: &Arc<[f64]>| values.as_ptr() as u64;
            let force = force(context, trace).map_or(0, |f| address(&f.force));
            let mut made_of = vec![context.mass as u64, context.noise(trace).to_bits(), force];
            made_of.push(u64::from(choice::only_noise(context)));
            made_of.push(address(trace.of_mass(context.mass).0));
            for (_, _, _, stage) in stages {
                let trace = stage.traces.iter().find(|t| t.record == trace.record)?;
                made_of.push(address(trace.of_mass(context.mass).1));
            }
            made_of
        }
        WalkFigure::Map => bits(&map(context)?.mean),
        WalkFigure::Profile | WalkFigure::Left => {
            let profile = profile(canvas, context, figure)?;
            [bits(&profile.at), bits(&profile.mean), bits(&profile.error)].concat()
        }
        WalkFigure::Curve(choice) => {
            let (curve, ..) = curve(context, choice)?;
            [pairs(&curve.measured), pairs(&curve.effect)].concat()
        }
        WalkFigure::Description => {
            let curve = &context.conclusion()?.description.as_ref()?.curve;
            [pairs(&curve.measured), pairs(&curve.effect), bits(&curve.deviation)].concat()
        }
        WalkFigure::Waterfall => {
            let errors = context.stages().into_iter().flat_map(|s| [s.gap.train_rmse, s.gap.test_rmse.unwrap_or(-1.0)]);
            errors.chain([context.known.noise_floor]).map(f64::to_bits).collect()
        }
        WalkFigure::Why(index) => [vec![*index as u64], bits(&context.lead(*index)?.1.each)].concat(),
    })
}

/// Makes a figure; none where there is nothing to draw.
fn make(
    canvas: &WalkCanvas,
    context: &WalkContext<'_>,
    figure: &WalkFigure,
    preview: Option<&Choice>,
) -> Option<Drawing> {
    let acceleration = &context.subject.acceleration;
    match figure {
        WalkFigure::Time(step) => {
            let (stages, trace) = stages_shown(canvas, context, *step, preview)?;
            let sensor = context.subject.sensor(context.mass);
            let (symbol, unit, noise) = (&*sensor.symbol, &*sensor.unit, context.noise(trace));
            let compared = Compared { mass: context.mass, symbol, unit, noise };
            let responses: Vec<WalkResponse<'_>> = stages
                .iter()
                .filter_map(|(name, ink, width, stage)| {
                    let trace = stage.traces.iter().find(|t| t.record == trace.record)?;
                    Some(WalkResponse { name, ink: *ink, width: *width, trace })
                })
                .collect();
            if matches!(step, RoundStep::Add | RoundStep::Verify) {
                return walk::responses(&compared, &responses);
            }
            // With several masses it is that of the one that lacks most, whichever is shown above.
            let name = match context.place() {
                Some(place) if context.subject.masses() > 1 => {
                    format!("missing force per mass, on mass {}", place.mass + 1)
                }
                _ => "missing force per mass".to_owned(),
            };
            let note = match trace.usage {
                Usage::HeldOut => "known for fitted records only",
                _ => "the missing force comes with the search",
            };
            // Of noise there is no worst stretch.
            let marked = !choice::only_noise(context);
            let lacking = Lacking { force: force(context, trace), name: &name, unit: acceleration, note, marked };
            Some(walk::gap(&compared, responses.first()?, &lacking))
        }
        WalkFigure::Map => walk::map(map(context)?, acceleration),
        WalkFigure::Profile => Some(walk::profile(profile(canvas, context, figure)?, acceleration, "")),
        WalkFigure::Left => Some(walk::profile(profile(canvas, context, figure)?, acceleration, "not a law")),
        WalkFigure::Curve(choice) => {
            let (curve, title, ink) = curve(context, choice)?;
            walk::curve(curve, title, ink, acceleration)
        }
        WalkFigure::Description => {
            let description = context.conclusion()?.description.as_ref()?;
            let ink = Ink::of_stage(description.stage.effects.len());
            walk::curve(&description.curve, &raised(&description.terms.join(" + ")), ink, acceleration)
        }
        WalkFigure::Waterfall => {
            let stages: Vec<&Stage> = context.stages().into_iter().map(AsRef::as_ref).collect();
            walk::waterfall(&stages, context.known.noise_floor, context.unit, "never fitted")
        }
        WalkFigure::Why(index) => walk::why(context.lead(*index)?.1, *index),
    }
}

fn force<'a>(context: &WalkContext<'a>, trace: &Trace) -> Option<&'a sindyscope_search::MissingForce> {
    context.place()?.force.iter().find(|f| f.record == trace.record)
}

fn map<'a>(context: &WalkContext<'a>) -> Option<&'a Map> {
    context.place().filter(|_| !choice::only_noise(context)).map(|p| &p.map).filter(|m| !m.mean.is_empty())
}

fn profile<'a>(canvas: &WalkCanvas, context: &WalkContext<'a>, figure: &WalkFigure) -> Option<&'a Profile> {
    if *figure == WalkFigure::Left {
        return context.round()?.place.profiles.first();
    }
    let place = context.place().filter(|p| !p.profiles.is_empty())?;
    place.profiles.get(choice::profile(canvas, context, place))
}

/// A candidate's curve, its title and the ink that it would have.
fn curve<'a>(context: &WalkContext<'a>, choice: &Choice) -> Option<(&'a Curve, &'a str, Ink)> {
    let candidate = context.candidates().iter().find(|c| c.choice == *choice)?;
    Some((&candidate.curve, &candidate.title, Ink::of_stage(context.stage()?.effects.len() + 1)))
}

/// The figure that is saved without one being pointed at.
pub(crate) fn main_figure(view: &WalkView) -> WalkFigure {
    match (view.step, &view.selected) {
        (RoundStep::Name, Some(choice)) => WalkFigure::Curve(choice.clone()),
        (RoundStep::Name, None) => WalkFigure::Profile,
        (step, _) => WalkFigure::Time(step),
    }
}

/// A figure as an SVG document for print, whole or zoomed as in the window (`like`, the window's context); none if there is
/// nothing to draw.
pub(crate) fn svg(
    like: &Context,
    room: &Missing,
    canvas: &WalkCanvas,
    figure: &WalkFigure,
    (data, edit): (&OpenRecords, &Edit),
    look: FigureLook,
) -> Option<String> {
    let subject = WalkSubject::of(data);
    let context = room.context(&edit.walk, &subject, (canvas.mass, canvas.view.site), false);
    let drawing = make(canvas, &context, figure, None)?;
    let place = |panel: &'static str| plot_id(figure.place(), 0, panel);
    let seen = drawing.as_seen(&BTreeSet::new(), |panel| {
        (look.as_shown && !panel.fixed).then(|| zoom(like, &place, panel)).flatten()
    });
    Some(seen.svg(look.size, &display::chosen(like)))
}
