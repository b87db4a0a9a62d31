//! What is looked at: what a person chose, or else what suits best.

use super::canvas::WalkCanvas;
use super::known::{WalkContext, stands};
use sindyscope_search::{Candidate, Place, Site, Stage};
use sindyscope_values::record::Usage;

/// The candidate that is looked at: the one that was chosen, else the first that stands.
pub(super) fn looked_at<'a>(canvas: &WalkCanvas, context: &WalkContext<'a>) -> Option<&'a Candidate> {
    let chosen = canvas.view.selected.as_ref().and_then(|choice| context.offered().find(|c| c.choice == *choice));
    chosen.or_else(|| next(canvas, context)).or_else(|| context.offered().next())
}

/// The first candidate that stands and was not skipped.
pub(super) fn next<'a>(canvas: &WalkCanvas, context: &WalkContext<'a>) -> Option<&'a Candidate> {
    context.offered().filter(|c| stands(c)).find(|c| !canvas.view.skipped.contains(&c.choice))
}

/// Which profile is shown: the one that was chosen, else that over the quantity of the place that was picked, of the
/// likeliest effect, or, before there is one, of the motion.
pub(super) fn profile(canvas: &WalkCanvas, context: &WalkContext<'_>, place: &Place) -> usize {
    let over = |name: &str| place.profiles.iter().position(|p| p.axis.0 == name);
    let chosen = canvas.view.profile.as_deref().and_then(over);
    // Profiles are in order of what they explain.
    let among = |names: Vec<String>| place.profiles.iter().position(|p| names.contains(&p.axis.0));
    let layout = context.subject.layout;
    let motion = |site: Site| [site.displacement(&layout), site.velocity(&layout)];
    let picked = || context.site.and_then(|site| among(motion(site).to_vec()));
    let likeliest = || {
        let first = context.round()?.candidates.first().filter(|c| stands(c))?;
        over(&first.curve.axis)
    };
    let of_motion = || among(context.subject.sites().into_iter().flat_map(motion).collect());
    chosen.or_else(picked).or_else(likeliest).or_else(of_motion).unwrap_or(0)
}

/// Whether it was asked, and there is no gap beyond noise.
pub(super) fn only_noise(context: &WalkContext<'_>) -> bool {
    context.round().is_some_and(|r| !r.evidence.significant)
}

/// Which record is shown: the one that was chosen, else the first that was never fitted.
pub(super) fn record_shown(canvas: &WalkCanvas, stage: &Stage) -> usize {
    let held_out = || stage.traces.iter().position(|t| t.usage == Usage::HeldOut);
    canvas.view.verified.or_else(held_out).unwrap_or(0)
}
