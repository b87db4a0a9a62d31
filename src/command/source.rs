//! The options that say where the records of a study come from: files, how they are read, and what is done to them before they
//! are used.

use std::path::{Path, PathBuf};

use clap::error::Error;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};

use super::shell::seen_from;
use super::table;
use crate::shell::quoted;
use sindyscope_analysis::source::{PREPARATION, Preparing, READING, Reading, RecordSource};

/// The options of [`Reading`].
#[derive(Clone, Debug, Default)]
pub(super) struct ReadingOptions(pub(super) Reading);

/// The options of [`RecordSource`].
#[derive(Clone, Debug, Default)]
pub(super) struct SourceOptions(pub(super) RecordSource);

impl Args for ReadingOptions {
    fn augment_args(command: Command) -> Command {
        table::with_options(command, READING).mut_arg("only-named", |arg| {
            let help = "Ignore every column that --columns does not name, whatever the header says of it";
            arg.requires("columns").help(help)
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ReadingOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut reading = Reading::default();
        table::given(matches, READING).apply(&mut reading).map_err(table::unfit)?;
        Ok(Self(reading))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// Says all of a source, as words of a shell's command.
pub(super) fn say(source: &RecordSource, command: &mut String) {
    let here = std::env::current_dir().unwrap_or_default();
    for (before, files) in [("", &source.data), (" --test", &source.test)] {
        if !files.is_empty() {
            command.push_str(before);
            command.extend(files.iter().map(|file| format!(" {}", typed(&here, file))));
        }
    }
    let plain = RecordSource::default();
    table::say(command, READING, &source.reading, &plain.reading);
    table::say(command, PREPARATION, &source.preparing, &plain.preparing);
}

/// A file as it is typed from a folder; a name that begins with a minus is no option.
pub(super) fn typed(here: &Path, file: &Path) -> String {
    let seen = seen_from(here, file);
    let seen = seen.to_string_lossy();
    quoted(&if seen.starts_with('-') { format!("./{seen}") } else { seen.into_owned() })
}

/// What the preparation does, with the options that stand beside it.
const PREPARE: &str = "Do this to each record, in this order, after --crop and before --hold-out: offset, trend, decimate=N, low-pass=HZ, \
                       high-pass=HZ, band-pass=HZ:HZ (without a phase), mode=HZ:HZ (one mode as one mass), spikes, split=N, split-at=T, align=a (or align=a:SECONDS), \
                       gain=x2:1.02; where the order is another one also crop=T0:T1 and hold-out=SHARE";

/// What holding out a share does, beside the option that holds out files.
const HOLD_OUT: &str = "Hold out this share of each record's end, as 0.3; files given with --test are held out instead";

impl Args for SourceOptions {
    fn augment_args(command: Command) -> Command {
        let files = |name: &'static str, help: &'static str| {
            Arg::new(name).value_parser(value_parser!(PathBuf)).num_args(1..).action(ArgAction::Append).help(help)
        };
        let data = files("data", "Measurements to fit: CSV, MATLAB, TDMS and other files");
        let test = files("test", "Held-out measurements: never fitted, only simulated and scored");
        let command = command.arg(data.value_name("DATA").required(true)).arg(test.long("test").value_name("FILE"));
        table::with_options(ReadingOptions::augment_args(command), PREPARATION)
            .mut_arg("prepare", |arg| arg.help(PREPARE))
            .mut_arg("hold-out", |arg| arg.help(HOLD_OUT))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for SourceOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let files = |name: &str| matches.get_many(name).into_iter().flatten().cloned().collect();
        let mut preparing = Preparing::default();
        table::given(matches, PREPARATION).apply(&mut preparing).map_err(table::unfit)?;
        let ReadingOptions(reading) = ReadingOptions::from_arg_matches(matches)?;
        Ok(Self(RecordSource { data: files("data"), test: files("test"), reading, preparing }))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}
