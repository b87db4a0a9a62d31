//! Settings as a table: what each is called, what it means, what it may be, and how it is read from a text and written as one.
//!
//! From one table come the options of the commands, the command that repeats a study, the rows of the window's panels and the
//! settings that a report lists. Whoever adds a setting adds a row to it.

use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

use sindyscope_values::term::Layout;

/// What a text asks to be changed; it may turn out as it is done that it does not fit what stands there already.
pub type SettingChange<T> = Arc<dyn Fn(&mut T) -> Result<(), String> + Send + Sync>;

/// One row of the table: a setting of a `T`.
pub struct Setting<T: 'static> {
    /// What it is called in commands and files: `half-width`.
    pub name: &'static str,
    /// A second name that commands take; empty for none.
    pub alias: &'static str,
    /// What it is called in the window: `Half width`.
    pub label: &'static str,
    /// What it is called in a document: `half width of the test functions`.
    pub title: &'static str,
    /// The heading that it stands under.
    pub group: &'static str,
    /// What it does, without a full stop.
    pub help: &'static str,
    /// What happens where it is left out; empty where `help` says it.
    pub default: &'static str,
    /// Its unit, for a number; empty for none.
    pub unit: &'static str,
    /// What it may be.
    pub form: SettingForm,
    /// The numbers that a slider spans, for a number that has one; the ends may depend on the records.
    pub slider: Option<Slider>,
    /// Whether it is chosen from the data where it is left out: what repeats a study always says it.
    pub chosen: bool,
    /// Reads a text. An error says what is wrong with it, or how it is written.
    pub read: fn(&str) -> Result<SettingChange<T>, String>,
    /// Writes the setting as texts that `read` takes, one for each time that the option is given; none where it counts for
    /// nothing.
    pub write: fn(&T) -> Vec<String>,
    /// What a document says of it; nothing where another row says it or it counts for nothing.
    pub describe: fn(&T, &Layout) -> Option<String>,
}

/// What a setting may be.
#[derive(Clone, Copy)]
pub enum SettingForm {
    /// One text of this kind, as `N` or `KG`.
    One(&'static str),
    /// The same, which may begin with a minus.
    Signed(&'static str),
    /// Any number of texts of this kind.
    Many(&'static str),
    /// One of several names.
    Names {
        /// The kind of name, as `WAY`.
        placeholder: &'static str,
        /// The names.
        names: &'static (dyn Names + Sync),
    },
    /// Said or not said.
    Flag,
    /// `yes` or `no`; named without either it is `yes`.
    Switch,
}

/// The numbers that a slider spans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slider {
    /// The least.
    pub least: f64,
    /// The largest.
    pub most: f64,
    /// How values lie along it.
    pub spread: Spread,
    /// Values are this far apart, counted from the least; zero for any value.
    pub step: f64,
}

/// How values lie along a slider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spread {
    /// Evenly.
    Linear,
    /// By their logarithm.
    Logarithmic,
    /// By their logarithm, with zero at the left end.
    LogarithmicFromZero,
}

impl Slider {
    /// Its ends.
    pub fn range(&self) -> RangeInclusive<f64> {
        self.least..=self.most
    }
}

/// One value of several, with its names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedValue<V: 'static> {
    /// The value.
    pub value: V,
    /// What it is called in commands and files.
    pub name: &'static str,
    /// What it is called in the window.
    pub label: &'static str,
    /// What it is, without a full stop.
    pub help: &'static str,
}

/// The names that a setting may have.
pub trait Names {
    /// Each with what it is.
    fn names(&self) -> Vec<(&'static str, &'static str)>;
}

impl<V, const N: usize> Names for [NamedValue<V>; N] {
    fn names(&self) -> Vec<(&'static str, &'static str)> {
        self.iter().map(|c| (c.name, c.help)).collect()
    }
}

/// The value of a name.
///
/// # Errors
/// There is none of that name; the sentence lists those that there are.
pub fn named<V: Copy>(choices: &[NamedValue<V>], name: &str) -> Result<V, String> {
    choices.iter().find(|c| c.name == name).map(|c| c.value).ok_or_else(|| {
        let names: Vec<&str> = choices.iter().map(|c| c.name).collect();
        format!("`{name}` is none of {}", names.join(", "))
    })
}

impl<T> Setting<T> {
    /// A row that says nothing yet, to be filled in.
    pub const BLANK: Self = Self {
        name: "",
        alias: "",
        label: "",
        title: "",
        group: "",
        help: "",
        default: "",
        unit: "",
        form: SettingForm::Flag,
        slider: None,
        chosen: false,
        read: |_| Ok(change(|_| ())),
        write: |_| Vec::new(),
        describe: |_, _| None,
    };
}

impl<T> fmt::Debug for Setting<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Setting({})", self.name)
    }
}

/// A change that always fits.
pub fn change<T>(make: impl Fn(&mut T) + Send + Sync + 'static) -> SettingChange<T> {
    Arc::new(move |value| {
        make(value);
        Ok(())
    })
}

/// What was said of some settings of a `T`; of the others nothing.
pub struct Given<T: 'static>(Vec<Said<T>>);

/// One text that was given for one setting, and the change that it asks for.
pub struct Said<T: 'static> {
    setting: &'static Setting<T>,
    text: String,
    change: SettingChange<T>,
}

impl<T> Said<T> {
    /// Reads a text for a setting.
    ///
    /// # Errors
    /// As [`Setting::read`].
    pub fn new(setting: &'static Setting<T>, text: &str) -> Result<Self, String> {
        (setting.read)(text).map(|change| Self { setting, text: text.to_owned(), change })
    }

    /// The setting's name.
    pub fn name(&self) -> &'static str {
        self.setting.name
    }
}

impl<T> Given<T> {
    /// What was said, in the order of a table: later rows may build on earlier ones.
    pub fn new(said: impl IntoIterator<Item = Said<T>>) -> Self {
        Self(said.into_iter().collect())
    }

    /// The texts that were given for a setting.
    pub fn of(&self, name: &str) -> impl Iterator<Item = &str> {
        self.0.iter().filter(move |s| s.setting.name == name).map(|s| s.text.as_str())
    }

    /// Whether a setting was given.
    pub fn has(&self, name: &str) -> bool {
        self.of(name).next().is_some()
    }

    /// Makes the changes that were asked for.
    ///
    /// # Errors
    /// The first that does not fit.
    pub fn apply(&self, value: &mut T) -> Result<(), String> {
        self.0.iter().try_for_each(|said| (said.change)(value))
    }
}

impl<T> Default for Given<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Clone for Said<T> {
    fn clone(&self) -> Self {
        Self { setting: self.setting, text: self.text.clone(), change: Arc::clone(&self.change) }
    }
}

impl<T> Clone for Given<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T> fmt::Debug for Given<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.0.iter().map(|s| (s.setting.name, &s.text))).finish()
    }
}

/// What has to be said of a value so that it comes of another one: each setting that differs, and each that would be chosen
/// from the data if nothing were said, with its text.
pub fn told<T>(table: &'static [Setting<T>], value: &T, from: &T) -> Vec<(&'static Setting<T>, String)> {
    let differs = |setting: &&Setting<T>| setting.chosen || (setting.write)(value) != (setting.write)(from);
    table.iter().filter(differs).flat_map(|s| (s.write)(value).into_iter().map(move |text| (s, text))).collect()
}

/// A number that is one.
///
/// # Errors
/// It is not.
pub fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("`{text}` is not a number"))
}

/// A number above zero.
///
/// # Errors
/// It is not.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("it must be above zero".into()) })
}

/// A number that is zero or above.
///
/// # Errors
/// It is not.
pub fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("it cannot be negative".into()) })
}
