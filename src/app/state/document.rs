//! What a person has open and has decided about it: the one value that projects, the session and the list of what was open
//! lately keep.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::class::ClassCase;
use super::walk::Walk;
use sindyscope_core::prepare::Preparation;
use sindyscope_core::study::Settings;
use sindyscope_files::ReadOptions;
use sindyscope_modes::StructureDiagnosis;
use sindyscope_report::document::Arrangement;
use sindyscope_rig::RigSettings;
use sindyscope_search::Found;
use sindyscope_values::record::Usage;
use sindyscope_values::term::Kind;

/// Records that come with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sample {
    /// A Duffing oscillator under harmonic force, with noise; the last part held out.
    Duffing,
    /// A base-excited mass with dry friction at four frequencies; a fifth held out.
    Friction,
    /// The Lorenz system.
    Lorenz,
    /// An oscillator that keeps itself going, let go near rest.
    VanDerPol,
    /// A beam between two magnets, chaotic.
    DoubleWell,
    /// A driven pendulum that turns over.
    Pendulum,
    /// A mass that a belt drags along.
    Belt,
    /// A cubic spring alone, strongly driven: chaotic.
    Ueda,
    /// A self-excited oscillator under a harmonic force.
    VanDerPolForced,
    /// Damping that is negative at low speed, under a harmonic force.
    Rayleigh,
    /// A spring that pulsates at twice the natural frequency.
    Mathieu,
    /// A pendulum whose pivot moves up and down at twice its frequency.
    ParametricPendulum,
    /// A pendulum on its head that a spring holds.
    UprightPendulum,
    /// Two pendula with a spring between them.
    CoupledPendula,
    /// A mass that hits a stiff stop on one side.
    HardStop,
    /// A mass with a gap before the springs on either side.
    Freeplay,
    /// Two oblique springs that snap through.
    Truss,
    /// A damper that resists extension more than compression.
    UnevenDamper,
    /// A plate that a voltage attracts across a gap.
    Electrostatic,
    /// A small mass on a cubic spring that takes the energy of a large one.
    EnergySink,
    /// The hysteresis of the benchmark of 2016; its sweep held out.
    BoucWen,
    /// A mass with a tuned absorber that no sensor sees.
    Absorber,
    /// A tower with five floors and three sensors.
    Floors,
    /// A cantilever whose tip is held by a joint that slips, driven softly and hard.
    Joint,
    /// A Duffing oscillator that moves too little for its library; four times the force held out.
    Overfit,
}

impl Sample {
    /// True if it is a structure with several modes.
    pub(crate) fn is_structure(self) -> bool {
        matches!(self, Self::Floors | Self::Joint)
    }

    /// Order of its equations.
    pub(crate) fn kind(self) -> Kind {
        match self {
            Self::Lorenz => Kind::FirstOrder,
            _ => Kind::SecondOrder,
        }
    }
}

/// Where the records come from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// None is open.
    #[default]
    Nothing,
    /// One that comes with the program.
    Sample(Sample),
    /// Files, read together.
    Files(Vec<PathBuf>),
    /// The virtual rig's, with an effect hidden in them that this seed draws.
    Hidden(u64),
    /// The room "Virtual rig", with these settings.
    Rig(Box<RigSettings>),
    /// A round of the class mode; what it hides is not told with its records.
    Round(ClassCase),
}

/// What undo takes back: everything that decides an outcome and the report on it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Edit {
    /// The settings.
    pub settings: Settings,
    /// What each record is used for, in the order of reading.
    pub usage: Vec<Usage>,
    /// What is done to the records before they are studied.
    pub steps: Vec<Preparation>,
    /// What the equations are made of: a mass for each sensor, or modes.
    pub base: sindyscope_modes::Base,
    /// Whether what is measured is a component without a mass: its force along a given motion.
    pub component: bool,
    /// The channel that a person said is its force; none where its name or unit says so.
    pub force: Option<String>,
    /// Whether a person has said which, where the program would propose another.
    pub base_settled: bool,
    /// What was added to the base model in "What's missing".
    pub walk: Walk,
    /// What the report holds, in which order.
    pub report: Arrangement,
}

/// What a pinned outcome was made with: enough to make it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pin {
    /// The settings.
    pub settings: Settings,
    /// What each record was used for, in the order of reading.
    #[serde(default)]
    pub usage: Vec<Usage>,
    /// What was done to the records before.
    #[serde(default)]
    pub steps: Vec<Preparation>,
}

/// What is open: where the records come from, how they are read, and everything that was decided and found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Document {
    /// Where the records come from.
    pub source: Source,
    /// What the files' headers do not say.
    pub reading: ReadOptions,
    /// What each file held when it was read last, in the order of the source: `120 bytes, crc32 …`.
    pub checksums: Vec<String>,
    /// What was decided. Settings that say nothing at all are the program's own choice, once the records are read.
    pub edit: Edit,
    /// The settings that the program chose itself: what reset goes back to; none until the records were read.
    pub suggestion: Option<Settings>,
    /// What was pinned to be compared, in order.
    pub pins: Vec<Pin>,
    /// What was found missing.
    #[serde(deserialize_with = "leniently")]
    pub found: Option<Arc<Found>>,
    /// What was found missing of a structure or a component.
    #[serde(skip_serializing_if = "is_usual")]
    pub beside: FoundBeside,
}

/// What was found missing where the base is no chain of masses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FoundBeside {
    /// The force that the modes of a structure lack. What another version wrote in another form is dropped.
    #[serde(deserialize_with = "if_it_fits")]
    pub structure: Option<Arc<StructureDiagnosis>>,
    /// Whether it was looked for what the force of a component lacks: that takes a second and is looked for again.
    pub component: bool,
}

impl Document {
    /// A document of which nothing but the source is known.
    pub fn of(source: Source) -> Self {
        let kind = if let Source::Sample(sample) = source { sample.kind() } else { Kind::default() };
        let reading = ReadOptions { kind, ..ReadOptions::default() };
        Self { source, reading, ..Self::default() }
    }

    /// True if there is something in it that opening the source again would not give by itself.
    pub(crate) fn is_worth_keeping(&self) -> bool {
        let decided = self.edit.settings != Settings::default() || !self.edit.usage.is_empty();
        let found = self.found.is_some() || !is_usual(&self.beside);
        self.source != Source::Nothing && (decided || !self.pins.is_empty() || found)
    }
}

/// Reads what was found missing. What another version wrote in another form belongs to no records: it is dropped and told,
/// and all else is read.
fn leniently<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Arc<Found>>, D::Error> {
    let value = Option::<serde_json::Value>::deserialize(deserializer)?;
    Ok(value.map(|value| serde_json::from_value(value).unwrap_or_default()))
}

fn if_it_fits<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Arc<StructureDiagnosis>>, D::Error> {
    let value = Option::<serde_json::Value>::deserialize(deserializer)?;
    Ok(value.and_then(|value| serde_json::from_value(value).ok()))
}

fn is_usual<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// A path that holds wherever the program is started next.
pub(crate) fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}
