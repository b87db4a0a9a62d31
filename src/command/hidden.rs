//! `generate hidden`: records of a rig that hides an effect.

use clap::Args;
use clap::error::ErrorKind;

use super::failure::Failure;
use super::{Stop, usage};
use sindyscope_rig::hidden::{
    ExcitationKind, Hidden, HiddenRequest, Instruments, SensedMotion, draw, names, outside_names, title,
};
use sindyscope_rig::{Noise, NoiseKind, RigError};
use sindyscope_values::record::Record;

/// The name of the scenario.
pub(super) const NAME: &str = "hidden";
/// What hides nothing.
const NOTHING: &str = "nothing";

/// Options of `generate hidden`, of no use to other scenarios.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Options of the scenario `hidden`")]
pub(super) struct HiddenOptions {
    /// What is hidden (two at once: with a comma; `nothing`); drawn blind if not given
    #[arg(long, value_name = "EFFECT,…", value_delimiter = ',')]
    effect: Vec<String>,
    /// How it is shaken: multisine, sweep-pair, tones, decay or single-tone
    #[arg(long, value_name = "KIND")]
    excitation: Option<ExcitationKind>,
    /// What the noise is like: white, coloured or quantised (then `--noise` is the step)
    #[arg(long, value_name = "KIND")]
    noise_kind: Option<NoiseKind>,
    /// RMS missing force over RMS spring force, of each effect (0.05 or 5%)
    #[arg(long, value_name = "SHARE", value_parser = share)]
    ratio: Option<f64>,
    /// Samples in all fitted records together
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
    /// Write what is hidden into the file's comments
    #[arg(long)]
    reveal: bool,
}

fn share(text: &str) -> Result<f64, String> {
    let (number, scale) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let value: Option<f64> = number.trim().parse().ok().map(|n: f64| n * scale);
    value.filter(|v| v.is_finite()).ok_or_else(|| format!("{text:?} is no share: write 0.05 or 5%"))
}

impl HiddenOptions {
    /// True if any of them was given.
    pub(super) fn given(&self) -> bool {
        let Self { effect, excitation, noise_kind, ratio, samples, reveal } = self;
        !effect.is_empty()
            || excitation.is_some()
            || noise_kind.is_some()
            || ratio.is_some()
            || samples.is_some()
            || *reveal
    }

    /// The records, fitted ones first, and the comments to be written above them.
    pub(super) fn make(
        &self,
        seed: u64,
        noise: Option<Noise>,
        measure: Option<&[String]>,
    ) -> Result<(Vec<Record>, Vec<String>), Stop> {
        let refuse = |problem: String| usage("generate", ErrorKind::ValueValidation, problem);
        let shown = match measure {
            None => SensedMotion::default(),
            Some([one]) => one.trim().parse().map_err(|e| refuse(format!("--measure: {e}")))?,
            Some(_) => return Err(refuse("--measure: the rig has one sensor of the motion: x, v or a".to_owned())),
        };
        let share = match noise {
            None => 0.01,
            Some(Noise::ShareOfPeak(share) | Noise::ShareOfRms(share)) => share,
            Some(Noise::Deviation(0.0)) => 0.0,
            Some(Noise::Deviation(_)) => {
                return Err(refuse(
                    "--noise: the size of a hidden rig is drawn; give the noise as a share of the RMS (1%)".to_owned(),
                ));
            }
        };
        let kind = self.noise_kind.unwrap_or_default();
        let instruments = Instruments { shown, kind, ..Instruments::white(share) };
        let excitation = self.excitation.unwrap_or(ExcitationKind::Multisine);
        let mut request = match self.effect.as_slice() {
            [] => HiddenRequest::blind(excitation, seed),
            [only] if only == NOTHING => HiddenRequest::new([] as [&str; 0], excitation, seed),
            effects => HiddenRequest::new(effects.iter().map(|e| e.trim()), excitation, seed),
        };
        request.instruments = instruments;
        request.ratio = self.ratio;
        request.samples = self.samples.unwrap_or(request.samples);
        let Hidden { mut fit, held_out, truth, .. } = match draw(&request) {
            Ok(hidden) => hidden,
            Err(RigError::BadOption { option, problem }) => return Err(refuse(format!("--{option}: {problem}"))),
            Err(error) => return Err(Failure::new(error.to_string()).into()),
        };
        let mut comments = vec![
            format!("Sindyscope, a virtual rig that may hide an effect: seed {seed}, excitation {excitation}"),
            "the record `held out` is for checking, not for fitting".to_owned(),
        ];
        if self.reveal {
            comments.push(truth.description);
            comments.extend(truth.parameters.iter().map(|p| {
                let of = p.effect.map_or(String::new(), |e| format!("{e}: "));
                format!("{of}{} = {:e} {}", p.name, p.value, p.unit).trim_end().to_owned()
            }));
        }
        fit.extend(held_out);
        Ok((fit, comments))
    }
}

/// What the list says about it.
pub(super) fn describe(width: usize) -> String {
    let mut text =
        format!("{NAME:<width$}  linear oscillator with something else in it, drawn by --seed; told with --reveal\n");
    let pad = " ".repeat(width + 4);
    text += &format!(
        "{pad}--excitation multisine|sweep-pair|tones|decay|single-tone --noise 1% (of the RMS) --measure x|v|a\n"
    );
    text += &format!("{pad}--effect NAME, or two with a comma, or {NOTHING}; drawn blind if not given:\n");
    for name in names().chain(outside_names()) {
        text += &format!("{pad}  {name:<32}{}\n", title(name).unwrap_or_default());
    }
    text
}
