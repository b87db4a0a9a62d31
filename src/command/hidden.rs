//! `generate hidden`: records of a rig that hides an effect.

use clap::Args;
use clap::error::ErrorKind;

use super::failure::Failure;
use super::{Stop, usage};
use sindyscope_rig::hidden::{self as rig, ExcitationKind, NOTHING, names, outside_names, title};
use sindyscope_rig::{Noise, NoiseKind, RigError};
use sindyscope_values::record::Record;

pub(super) use sindyscope_rig::hidden::HIDDEN_SCENARIO as NAME;

/// Options of `generate hidden`, of no use to other scenarios.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Options of the scenario `hidden`")]
pub(super) struct HiddenArguments {
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

impl HiddenArguments {
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

    /// An option that was given beside the effect and whether it is told.
    pub(super) fn beside_effect(&self) -> Option<&'static str> {
        let Self { effect: _, excitation, noise_kind, ratio, samples, reveal: _ } = self;
        let given = [
            ("excitation", excitation.is_some()),
            ("noise-kind", noise_kind.is_some()),
            ("ratio", ratio.is_some()),
            ("samples", samples.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(name, _)| name)
    }

    /// The one effect that is asked for, if any, and whether it is told.
    pub(super) fn effect_alone(&self) -> Result<(Option<String>, bool), String> {
        match self.effect.as_slice() {
            [] => Ok((None, self.reveal)),
            [one] => Ok((Some(one.clone()), self.reveal)),
            _ => Err("--effect: a component hides one effect".into()),
        }
    }

    /// The records, fitted ones first, and the comments to be written above them.
    pub(super) fn make(
        &self,
        seed: u64,
        noise: Option<Noise>,
        measure: Option<&[String]>,
    ) -> Result<(Vec<Record>, Vec<String>), Stop> {
        let Self { effect, excitation, noise_kind, ratio, samples, reveal } = self.clone();
        let measure = measure.map(<[String]>::to_vec);
        let options = rig::HiddenOptions {
            seed,
            effects: effect,
            excitation,
            noise,
            noise_kind,
            measure,
            ratio,
            samples,
            reveal,
        };
        rig::hidden_records(&options).map_err(|error| match error {
            RigError::BadOption { option, problem } => {
                usage("generate", ErrorKind::ValueValidation, format!("--{option}: {problem}"))
            }
            error => Failure::new(error.to_string()).into(),
        })
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
