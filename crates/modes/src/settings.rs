//! Which base model is meant, as options and panels have it.

use serde::{Deserialize, Serialize};

use super::pole::Pole;
use super::position::{SensorPosition, position_text, positions};
use sindyscope_core::setting::{NamedValue, Setting, SettingForm, change, named};

/// What equations are made of before anything is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BaseModel {
    /// A mass for each sensor, neighbours in a chain: every acceleration has an equation of its own.
    #[default]
    Chain,
    /// As many modes as the data bear, whatever the number of sensors.
    Modes,
}

/// The base model that is asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Base {
    /// Which.
    pub model: BaseModel,
    /// The number of modes; none where the data choose it.
    pub modes: Option<usize>,
    /// Poles chosen by hand, from which the modes are fitted; empty where the data choose them.
    pub poles: Vec<Pole>,
    /// Where the sensors stand; empty where that is not known, or the records' files say it.
    pub positions: Vec<SensorPosition>,
}

impl Base {
    /// These settings with the positions that a file's comments tell, where none are given; what is no position there tells
    /// nothing.
    #[must_use]
    pub fn placed(mut self, comments: Option<&str>) -> Self {
        if let (true, Some(Ok(told))) = (self.positions.is_empty(), comments.map(positions)) {
            self.positions = told;
        }
        self
    }
}

/// The base models.
pub const BASES: [NamedValue<BaseModel>; 2] = [
    NamedValue {
        value: BaseModel::Chain,
        name: "chain",
        label: "chain of masses",
        help: "A mass for each sensor, neighbours in a chain: every acceleration has an equation of its own",
    },
    NamedValue {
        value: BaseModel::Modes,
        name: "modes",
        label: "modes",
        help: "As many modes as the data bear, whatever the number of sensors: for structures with several modes and few \
               sensors of any kind, driven by measured inputs or free",
    },
];

/// Most modes that can be asked for.
const MOST: usize = 40;

/// The settings of the base model.
pub static BASE: &[Setting<Base>] = &[
    Setting {
        name: "base",
        label: "Base",
        title: "base model",
        group: "Base model",
        help: "What the equations are made of before anything is missing",
        default: "chain",
        form: SettingForm::Names { placeholder: "NAME", names: &BASES },
        read: |text| named(&BASES, text).map(|model| change(move |b: &mut Base| b.model = model)),
        write: |b| BASES.iter().filter(|n| n.value == b.model).map(|n| n.name.into()).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "modes",
        label: "Modes",
        title: "number of modes",
        group: "Base model",
        help: "The number of modes of the base model",
        default: "chosen by data never fitted",
        form: SettingForm::One("N"),
        read: |text| match text.parse() {
            Ok(n) if (1..=MOST).contains(&n) => Ok(change(move |b: &mut Base| b.modes = Some(n))),
            _ => Err(format!("it is a whole number from 1 to {MOST}")),
        },
        write: |b| b.modes.iter().map(usize::to_string).collect(),
        ..Setting::BLANK
    },
    Setting {
        name: "poles",
        label: "Poles",
        title: "poles chosen by hand",
        group: "Base model",
        help: "Fit the modes from these poles: natural frequency (Hz) and damping ratio of each, HZ:RATIO,HZ:RATIO,…",
        default: "chosen by data never fitted",
        form: SettingForm::One("HZ:RATIO,…"),
        read: |text| {
            let poles = text.split(',').map(pole).collect::<Result<Vec<Pole>, _>>()?;
            if poles.len() > MOST {
                return Err(format!("they are at most {MOST}"));
            }
            Ok(change(move |b: &mut Base| b.poles.clone_from(&poles)))
        },
        write: |b| {
            let said = |p: &Pole| format!("{}:{}", rounded(p.frequency()), rounded(p.damping));
            Some(b.poles.iter().map(said).collect::<Vec<_>>().join(",")).filter(|t| !t.is_empty()).into_iter().collect()
        },
        ..Setting::BLANK
    },
    Setting {
        name: "positions",
        label: "Positions",
        title: "positions of the sensors",
        group: "Base model",
        help: "Where the sensors stand, for the drawing of shapes: one or two coordinates of each, NAME=X,Y;NAME=X,Y;…",
        default: "as the file's comments say, `# position: a1=0,0.5`",
        form: SettingForm::One("NAME=X,Y;…"),
        read: |text| positions(text).map(|positions| change(move |b: &mut Base| b.positions.clone_from(&positions))),
        write: |b| Some(position_text(&b.positions)).filter(|t| !t.is_empty()).into_iter().collect(),
        ..Setting::BLANK
    },
];

/// A pole as it is written: `9.2:0.01`.
fn pole(text: &str) -> Result<Pole, String> {
    let wrong =
        || format!("`{}` is no pole: write its natural frequency in Hz and its damping ratio, 9.2:0.01", text.trim());
    let (frequency, damping) = text.trim().split_once(':').ok_or_else(wrong)?;
    let [frequency, damping] = [frequency, damping].map(|n| n.trim().parse::<f64>());
    match (frequency, damping) {
        (Ok(f), Ok(d)) if f.is_finite() && f > 0.0 && d > 0.0 && d < 1.0 => Ok(Pole::at(f, d)),
        _ => Err(wrong()),
    }
}

/// A number to six digits: a start of a fit needs no more.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_core::setting::{Given, Said, told};

    #[test]
    fn poles_are_read_as_they_are_said() {
        let base = Base {
            model: BaseModel::Modes,
            modes: None,
            poles: vec![Pole::at(9.2, 0.0125), Pole::at(31.0, 0.004)],
            ..Base::default()
        };
        let words = told(BASE, &base, &Base::default());
        let said = words.iter().map(|(setting, text)| Said::new(setting, text).expect("it is read"));
        let mut again = Base::default();
        Given::new(said).apply(&mut again).expect("it is taken");
        assert_eq!((again.model, again.poles.len()), (base.model, 2));
        for (a, b) in again.poles.iter().zip(&base.poles) {
            assert!(
                (a.omega / b.omega - 1.0).abs() < 1e-5 && (a.damping / b.damping - 1.0).abs() < 1e-5,
                "{a:?} {b:?}"
            );
        }
        let poles = BASE.iter().find(|s| s.name == "poles").expect("it is there");
        assert!(Said::new(poles, "9.2").is_err_and(|e| e.contains("damping ratio")));
    }
}
