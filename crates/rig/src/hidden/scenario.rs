//! The scenario `hidden`: what of it may be asked for, as a command or a script does.

use super::{ExcitationKind, Hidden, HiddenRequest, Instruments, SensedMotion, draw};
use crate::error::RigError;
use crate::scenario_options::{list, number, typed, unknown};
use crate::sensor::{Noise, NoiseKind};
use sindyscope_values::record::Record;

/// The name of the scenario.
pub const HIDDEN_SCENARIO: &str = "hidden";
/// What hides nothing.
pub const NOTHING: &str = "nothing";

/// What of the scenario `hidden` is to be as told; the rest is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HiddenOptions {
    /// Draws everything that is not told.
    pub seed: u64,
    /// What is hidden, by name; [`NOTHING`] alone: nothing; none: drawn blind.
    pub effects: Vec<String>,
    /// How it is shaken; none: a multisine.
    pub excitation: Option<ExcitationKind>,
    /// Noise as a share of the RMS; none: 1 %.
    pub noise: Option<Noise>,
    /// What the noise is like.
    pub noise_kind: Option<NoiseKind>,
    /// The one sensor of the motion: x, v or a.
    pub measure: Option<Vec<String>>,
    /// RMS missing force over RMS spring force, of each effect.
    pub ratio: Option<f64>,
    /// Samples in all fitted records together.
    pub samples: Option<usize>,
    /// Whether the comments tell what is hidden.
    pub reveal: bool,
}

impl HiddenOptions {
    /// What is said by names and typed values, as [`ScenarioOptions::typed`](crate::ScenarioOptions::typed) takes them, with
    /// `effect`, `excitation`, `noise-kind`, `ratio`, `samples` and `reveal` besides.
    ///
    /// # Errors
    /// A name that the scenario draws by its seed or does not have; a value that is none.
    pub fn typed<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self, RigError> {
        let mut options = Self::default();
        for (name, text) in pairs {
            match name {
                "effect" => options.effects = text.split(',').map(|e| e.trim().to_owned()).collect(),
                "excitation" => options.excitation = Some(typed("excitation", text)?),
                "noise-kind" => options.noise_kind = Some(typed("noise-kind", text)?),
                "ratio" => options.ratio = Some(number("ratio", text)?),
                "samples" => options.samples = Some(number("samples", text)?),
                "reveal" => options.reveal = true,
                "seed" => options.seed = number("seed", text)?,
                "noise" => options.noise = Some(typed("noise", text)?),
                "measure" => options.measure = Some(list(text).map(str::to_owned).collect()),
                _ => return Err(unknown(name, "the scenario hidden draws all else by its seed; leave it out")),
            }
        }
        Ok(options)
    }
}

/// The records, fitted ones first, and the comments to be written above them.
///
/// # Errors
/// An option whose value cannot be used; no case that is as asked for.
pub fn hidden_records(options: &HiddenOptions) -> Result<(Vec<Record>, Vec<String>), RigError> {
    let refuse = |option: &'static str, problem: String| RigError::BadOption { option, problem };
    let shown = match options.measure.as_deref() {
        None => SensedMotion::default(),
        Some([one]) => one.trim().parse().map_err(|problem: String| refuse("measure", problem))?,
        Some(_) => return Err(refuse("measure", "the rig has one sensor of the motion: x, v or a".to_owned())),
    };
    let share = match options.noise {
        None => 0.01,
        Some(Noise::ShareOfPeak(share) | Noise::ShareOfRms(share)) => share,
        Some(Noise::Deviation(0.0)) => 0.0,
        Some(Noise::Deviation(_)) => {
            let problem = "the size of a hidden rig is drawn; give the noise as a share of the RMS (1%)";
            return Err(refuse("noise", problem.to_owned()));
        }
    };
    let kind = options.noise_kind.unwrap_or_default();
    let excitation = options.excitation.unwrap_or(ExcitationKind::Multisine);
    let mut request = match options.effects.as_slice() {
        [] => HiddenRequest::blind(excitation, options.seed),
        [only] if only == NOTHING => HiddenRequest::new([] as [&str; 0], excitation, options.seed),
        effects => HiddenRequest::new(effects.iter().map(|e| e.trim()), excitation, options.seed),
    };
    request.instruments = Instruments { shown, kind, ..Instruments::white(share) };
    request.ratio = options.ratio;
    request.samples = options.samples.unwrap_or(request.samples);
    let Hidden { mut fit, held_out, truth, .. } = draw(&request)?;
    let seed = options.seed;
    let mut comments = vec![
        format!("Sindyscope, a virtual rig that may hide an effect: seed {seed}, excitation {excitation}"),
        "the record `held out` is for checking, not for fitting".to_owned(),
    ];
    if options.reveal {
        comments.push(truth.description);
        comments.extend(truth.parameters.iter().map(|p| {
            let of = p.effect.map_or(String::new(), |e| format!("{e}: "));
            format!("{of}{} = {:e} {}", p.name, p.value, p.unit).trim_end().to_owned()
        }));
    }
    fit.extend(held_out);
    Ok((fit, comments))
}
