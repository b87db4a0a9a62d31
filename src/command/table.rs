//! Options that are made from a table of settings, and the words that say them again.

use std::fmt::Write;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, ArgAction, ArgMatches, Command};

use crate::shell::quoted;
use sindyscope_core::setting::{Given, Said, Setting, SettingForm, told};

/// A command with an option for each row of a table.
pub(super) fn with_options<T>(command: Command, table: &'static [Setting<T>]) -> Command {
    table.iter().fold(command, |command, setting| command.arg(option(setting)))
}

/// The option of a row.
pub(super) fn option<T>(setting: &'static Setting<T>) -> Arg {
    let help = match setting.default {
        "" => setting.help.to_owned(),
        default => format!("{} [default: {default}]", setting.help),
    };
    let mut arg = Arg::new(setting.name).long(setting.name).help(help);
    if !setting.group.is_empty() {
        arg = arg.help_heading(setting.group);
    }
    if !setting.alias.is_empty() {
        arg = arg.alias(setting.alias);
    }
    let read = move |text: &str| Said::new(setting, text);
    let names = |names: &[(&'static str, &'static str)]| {
        let values = names.iter().map(|(name, help)| match *help {
            "" => PossibleValue::new(*name),
            help => PossibleValue::new(*name).help(help),
        });
        PossibleValuesParser::new(values).try_map(move |text: String| Said::new(setting, &text))
    };
    match setting.form {
        SettingForm::One(placeholder) => arg.value_name(placeholder).value_parser(read).allow_negative_numbers(true),
        SettingForm::Signed(placeholder) => arg.value_name(placeholder).value_parser(read).allow_hyphen_values(true),
        SettingForm::Many(placeholder) => arg.value_name(placeholder).value_parser(read).action(ArgAction::Append),
        SettingForm::Names { placeholder, names: of } => arg.value_name(placeholder).value_parser(names(&of.names())),
        SettingForm::Flag => arg.action(ArgAction::SetTrue),
        SettingForm::Switch => arg
            .value_name("WHETHER")
            .value_parser(names(&[("yes", "Do"), ("no", "Do not")]))
            .num_args(0..=1)
            .default_missing_value("yes")
            .require_equals(true),
    }
}

/// What the options of these rows were given.
pub(super) fn given<T>(matches: &ArgMatches, table: impl IntoIterator<Item = &'static Setting<T>>) -> Given<T> {
    let of = |setting: &'static Setting<T>| -> Vec<Said<T>> {
        match setting.form {
            SettingForm::Flag if matches.get_flag(setting.name) => Said::new(setting, "").into_iter().collect(),
            SettingForm::Flag => Vec::new(),
            _ => matches.get_many::<Said<T>>(setting.name).into_iter().flatten().cloned().collect(),
        }
    };
    Given::new(table.into_iter().flat_map(of))
}

/// Says what a value is that would be another one if nothing were said, as options of a shell's command; each begins with a
/// blank.
pub(super) fn say<T>(command: &mut String, table: &'static [Setting<T>], value: &T, from: &T) {
    write_options(command, told(table, value, from));
}

/// The options by which a value becomes another one, each with a blank before it.
pub(super) fn change<T>(table: &'static [Setting<T>], from: &T, to: &T) -> String {
    let changed = table.iter().filter(|s| (s.write)(from) != (s.write)(to));
    let mut options = String::new();
    write_options(&mut options, changed.flat_map(|s| (s.write)(to).into_iter().map(move |text| (s, text))));
    options
}

/// An option with its value, a blank before it; what begins with a minus would be taken for another option.
pub(super) fn valued(name: &str, text: &str) -> String {
    format!(" --{name}{}{}", if text.starts_with('-') { '=' } else { ' ' }, quoted(text))
}

fn write_options<T: 'static>(command: &mut String, said: impl IntoIterator<Item = (&'static Setting<T>, String)>) {
    for (setting, text) in said {
        // Writing to a text cannot fail.
        let _ = match (setting.form, text.as_str()) {
            (SettingForm::Flag, _) | (SettingForm::Switch, "yes") => write!(command, " --{}", setting.name),
            (SettingForm::Switch, text) => write!(command, " --{}={text}", setting.name),
            (_, text) => write!(command, "{}", valued(setting.name, text)),
        };
    }
}

/// What was given does not go together.
pub(super) fn unfit(problem: String) -> clap::Error {
    clap::Error::raw(clap::error::ErrorKind::ValueValidation, format!("{problem}\n"))
}
