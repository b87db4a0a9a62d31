use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::PossibleValuesParser;
use clap::error::ErrorKind;

use super::failure::Failure;
use super::hidden;
use super::progress::ProgressLine;
use super::{CommandResult, Stop, usage};
use sindyscope_core::setting::{finite, not_negative, positive};
use sindyscope_files::write_csv;
use sindyscope_rig::{
    COMPONENT_SCENARIO, ComponentOptions, Noise, PlantParameter, RigError, Scenario, ScenarioExcitation,
    ScenarioOptions, component_effects, component_records, generate, scenarios,
};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::record::Record;

/// The name under which the scenarios are listed.
const LIST: &str = "list";

/// Options of `generate`.
#[derive(Debug, Args)]
pub(super) struct GenerateOptions {
    /// What is recorded; `list` describes each, with its parameters
    #[arg(value_parser = names(), hide_possible_values = true)]
    scenario: String,
    /// The file to write (`-`: standard output)
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Seed of the noise and of a multisine's phases
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// What is measured of the motion: x, v or a of every mass (or node), or of one (x1,a2)
    #[arg(long, value_name = "CHANNEL,…", value_delimiter = ',')]
    measure: Option<Vec<String>>,
    /// Noise on every channel of the motion: a standard deviation (1e-5) or a share of the peak (1%)
    #[arg(long, value_name = "LEVEL")]
    noise: Option<Noise>,
    /// What the motion's sensors show of nothing, in the channel's unit
    #[arg(long, value_name = "VALUE", value_parser = finite, allow_hyphen_values = true)]
    offset: Option<f64>,
    /// How fast that grows, in the channel's unit per second
    #[arg(long, value_name = "VALUE", value_parser = finite, allow_hyphen_values = true)]
    drift: Option<f64>,
    /// Corner of the first-order high-pass that the motion's sensors are read through; 0 is none
    #[arg(long, value_name = "HZ", value_parser = not_negative, allow_negative_numbers = true)]
    high_pass: Option<f64>,
    /// Noise on the input, likewise
    #[arg(long, value_name = "LEVEL")]
    input_noise: Option<Noise>,
    /// Quantisation step of every channel, in its unit
    #[arg(long, value_name = "STEP", value_parser = not_negative, allow_negative_numbers = true)]
    resolution: Option<f64>,
    /// Sampling rate, Hz
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Duration of each record, s
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Time before each record in which the motion settles, s
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    settle: Option<f64>,
    /// Amplitude of the input (of each tone), or the displacement that the plant is released from
    #[arg(long, value_name = "A", value_parser = finite, allow_hyphen_values = true)]
    amplitude: Option<f64>,
    /// Amplitudes of a multisine, one record for each, with other phases in every one
    #[arg(long, value_name = "A,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true)]
    levels: Option<Vec<f64>>,
    /// Frequencies of the tones, or the two ends of a sweep or band, Hz
    #[arg(long, value_name = "HZ,…", value_delimiter = ',', value_parser = positive, allow_negative_numbers = true)]
    frequencies: Option<Vec<f64>>,
    /// All tones in one record, instead of one record each
    #[arg(long)]
    together: bool,
    /// Number of harmonics of a multisine
    #[arg(long, value_name = "N")]
    lines: Option<usize>,
    /// Time in which tones or a multisine fade in, s
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true)]
    ramp: Option<f64>,
    /// State at the start: displacements, then velocities
    #[arg(long, value_name = "X,V,…", value_delimiter = ',', value_parser = finite, allow_hyphen_values = true)]
    initial: Option<Vec<f64>>,
    /// A parameter of the plant
    #[arg(long, value_name = "NAME=VALUE", value_parser = parameter)]
    set: Vec<(String, f64)>,
    #[command(flatten)]
    hidden: hidden::HiddenArguments,
}

impl GenerateOptions {
    /// What of the scenario is to be otherwise.
    fn wanted(&self) -> ScenarioOptions {
        ScenarioOptions {
            seed: self.seed,
            measure: self.measure.clone(),
            noise: self.noise,
            offset: self.offset,
            drift: self.drift,
            high_pass: self.high_pass,
            input_noise: self.input_noise,
            resolution: self.resolution,
            rate: self.rate,
            duration: self.duration,
            settle: self.settle,
            amplitude: self.amplitude,
            levels: self.levels.clone(),
            frequencies: self.frequencies.clone(),
            together: self.together,
            lines: self.lines,
            ramp: self.ramp,
            initial: self.initial.clone(),
            parameters: self.set.clone(),
        }
    }
}

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(scenarios().iter().map(|s| s.name).chain([hidden::NAME, COMPONENT_SCENARIO, LIST]))
}

fn parameter(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write a parameter and its value as `k=358.7`")?;
    Ok((name.trim().to_owned(), finite(value.trim())?))
}

/// Makes the records of a scenario and writes them, or lists the scenarios.
pub(super) fn run(options: &GenerateOptions, progress: &ProgressLine) -> CommandResult {
    if options.scenario == LIST {
        return Ok(list().into_bytes());
    }
    let Some(out) = &options.out else {
        return Err(usage(
            "generate",
            ErrorKind::MissingRequiredArgument,
            "where to? give --out FILE.csv (or --out -)",
        ));
    };
    progress.stage("recording");
    let (records, comments) = match options.scenario.as_str() {
        hidden::NAME => hide(options)?,
        COMPONENT_SCENARIO => component(options)?,
        _ => make(options)?,
    };
    let mut csv = Vec::new();
    write_csv(&records, &mut csv, &comments)
        .map_err(|e| Failure::new(format!("cannot write the records as CSV: {e}")))?;
    if out == Path::new("-") {
        return Ok(csv);
    }
    std::fs::write(out, csv).map_err(|e| Failure::writing(out, &e))?;
    let samples: usize = records.iter().map(Record::len).sum();
    let count = match records.len() {
        1 => "1 record".to_owned(),
        n => format!("{n} records"),
    };
    Ok(format!("wrote {}: {count}, {samples} samples\n", out.display()).into_bytes())
}

/// The records of a scenario and the comments above them.
fn make(options: &GenerateOptions) -> Result<(Vec<Record>, Vec<String>), Stop> {
    if options.hidden.given() {
        return Err(usage(
            "generate",
            ErrorKind::ArgumentConflict,
            "--effect, --excitation, --noise-kind, --ratio, --samples and --reveal belong to the scenario hidden",
        ));
    }
    match generate(&options.scenario, &options.wanted()) {
        Ok(generated) => Ok((generated.records, generated.comments)),
        Err(RigError::BadOption { option, problem }) => {
            Err(usage("generate", ErrorKind::ValueValidation, format!("--{option}: {problem}")))
        }
        Err(error @ RigError::UnknownScenario { .. }) => Err(usage("generate", ErrorKind::ValueValidation, error)),
        Err(error) => Err(Failure::new(error.to_string()).into()),
    }
}

/// The records of a rig that hides something, which draws everything else by itself.
fn hide(options: &GenerateOptions) -> Result<(Vec<Record>, Vec<String>), Stop> {
    let drawn = |(name, _): &(&str, String)| !["seed", "measure", "noise"].contains(name);
    if let Some((option, _)) = options.wanted().given().into_iter().find(drawn) {
        let problem = format!("--{option}: the scenario hidden draws this by its seed; leave the option out");
        return Err(usage("generate", ErrorKind::ArgumentConflict, problem));
    }
    options.hidden.make(options.seed, options.noise, options.measure.as_deref())
}

/// The records of a component that hides something, which draws everything else by itself.
fn component(options: &GenerateOptions) -> Result<(Vec<Record>, Vec<String>), Stop> {
    let drawn = |(name, _): &(&str, String)| !["seed", "noise"].contains(name);
    let of_hidden = options.hidden.beside_effect();
    let other = options.wanted().given().into_iter().find(drawn).map(|(name, _)| name).or(of_hidden);
    if let Some(option) = other {
        let problem = format!("--{option}: the scenario component draws this by its seed; leave the option out");
        return Err(usage("generate", ErrorKind::ArgumentConflict, problem));
    }
    let (effect, reveal) =
        options.hidden.effect_alone().map_err(|problem| usage("generate", ErrorKind::ValueValidation, problem))?;
    component_records(&ComponentOptions { seed: options.seed, effect, noise: options.noise, reveal }).map_err(|error| {
        match error {
            RigError::BadOption { option, problem } => {
                usage("generate", ErrorKind::ValueValidation, format!("--{option}: {problem}"))
            }
            error => Failure::new(error.to_string()).into(),
        }
    })
}

/// Every scenario with what it does unless told otherwise.
fn list() -> String {
    let mut text = String::new();
    let mut meanings: Vec<PlantParameter> = Vec::new();
    let width = scenarios().iter().map(|s| s.name.len()).max().unwrap_or(0);
    for scenario in scenarios() {
        let _ = writeln!(text, "{:<width$}  {}", scenario.name, scenario.summary);
        let _ = writeln!(text, "{:<width$}    {}", "", defaults(scenario));
        let parameters = scenario.parameters();
        let values: Vec<String> = parameters.iter().map(|p| format!("--set {}={}", p.name, ascii(p.value))).collect();
        let _ = writeln!(text, "{:<width$}    {}", "", values.join(" "));
        for parameter in parameters {
            if !meanings.iter().any(|m| m.name == parameter.name && m.meaning == parameter.meaning) {
                meanings.push(parameter);
            }
        }
    }
    text += &hidden::describe(width);
    let effects: Vec<&str> = component_effects().collect();
    let _ = writeln!(
        text,
        "{COMPONENT_SCENARIO:<width$}  force of a component along a given motion, drawn by --seed; told with --reveal"
    );
    let _ = writeln!(text, "{:<width$}    --noise 1% --effect {}", "", effects.join("|"));
    text.push_str("\nParameters:\n");
    for PlantParameter { name, meaning, unit, .. } in meanings {
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        let _ = writeln!(text, "  {name:<8}{meaning}{unit}");
    }
    text.push_str("\nEvery value can be changed: see `sindyscope generate --help`.\n");
    text
}

fn defaults(scenario: &Scenario) -> String {
    let frequencies: Vec<String> = scenario.frequencies.iter().map(|f| ascii(*f)).collect();
    let frequencies = frequencies.join(",");
    let amplitude = ascii(scenario.amplitude);
    let mut text = match scenario.excitation_kind {
        ScenarioExcitation::Tones => format!("--amplitude {amplitude} --frequencies {frequencies}"),
        ScenarioExcitation::Sweep => format!("--amplitude {amplitude} --frequencies {frequencies} (from, to)"),
        ScenarioExcitation::Multisine => {
            format!("--amplitude {amplitude} --frequencies {frequencies} (from, to) --lines {}", scenario.lines)
        }
        ScenarioExcitation::Release => format!("--amplitude {amplitude} (released from)"),
        ScenarioExcitation::None => String::new(),
    };
    let _ = write!(text, " --rate {} --duration {}", ascii(scenario.rate), ascii(scenario.duration));
    if scenario.settle > 0.0 {
        let _ = write!(text, " --settle {}", ascii(scenario.settle));
    }
    if !scenario.measures.is_empty() {
        let _ = write!(text, " --measure {}", scenario.measures.join(","));
    }
    for (option, value) in [("offset", scenario.sensor.offset), ("high-pass", scenario.sensor.high_pass)] {
        if value != 0.0 {
            let _ = write!(text, " --{option} {}", ascii(value));
        }
    }
    if scenario.sensor.noise != Noise::NONE {
        let _ = write!(text, " --noise {}", scenario.sensor.noise);
    }
    text.trim_start().to_owned()
}

/// A number as it is typed.
fn ascii(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    let text = significant_trimmed(rounded, 6);
    if text.is_ascii() { text } else { format!("{rounded:?}") }
}
