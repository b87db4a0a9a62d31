//! Which base model is meant, as options and panels have it.

use sindyscope_core::setting::{NamedValue, Setting, SettingForm, change, named};

/// What equations are made of before anything is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BaseModel {
    /// A mass for each sensor, neighbours in a chain: every acceleration has an equation of its own.
    #[default]
    Chain,
    /// As many modes as the data bear, whatever the number of sensors.
    Modes,
}

/// The base model that is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Base {
    /// Which.
    pub model: BaseModel,
    /// The number of modes; none where the data choose it.
    pub modes: Option<usize>,
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
        label: "Base model",
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
];
