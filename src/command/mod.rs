//! The command line: what the library finds, for terminals and scripts. None of it but the window needs a display.

mod batch;
mod component;
mod diagnose;
mod effects;
mod failure;
mod generate;
mod hidden;
mod identify;
mod inspect;
mod json;
mod modes;
mod progress;
mod report;
mod request;
mod series;
mod serve;
mod shell;
mod source;
mod table;
mod watch;
mod window;

use std::ffi::OsString;
use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use failure::{Failure, Stop};
use progress::ProgressLine;

/// Finds the equation of motion of a vibrating thing from its measurements.
///
/// Without a command the window opens, with the given files in it.
#[derive(Debug, Parser)]
#[command(name = "sindyscope", version, max_term_width = 110)]
struct Cli {
    /// Show no progress on the terminal, as where nobody watches
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Measurements to open in the window (a file named like a command: by its path, `./identify`)
    files: Vec<PathBuf>,
    /// Do again, without a window, what the log of a session holds (in the window: Help, Save the log of this session)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["files", "log"])]
    replay: Option<PathBuf>,
    /// Keep the log of the window's session in this file as it goes
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

impl Cli {
    /// True where something is given that only the window takes.
    fn opens_the_window(&self) -> bool {
        !self.files.is_empty() || self.replay.is_some() || self.log.is_some()
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Identify the equation of motion: smooth, differentiate, regress sparsely, simulate
    Identify(identify::IdentifyOptions),
    /// Find what a model lacks: where simulation and measurement disagree, which effect that is, how the gap shrinks with it
    Diagnose(diagnose::DiagnoseOptions),
    /// The study as a document: figures, equations, tables
    Report(report::ReportOptions),
    /// Identify many records with the same settings, one row of a table each; ended at any time, it goes on where it was
    Batch(batch::BatchOptions),
    /// The table of a batch as a series: parameters over amplitude, temperature or time with their trend, and the records that do not fit
    Series(series::SeriesOptions),
    /// Follow a stream: a growing file, a serial line or UDP; its last seconds are identified as they come, with an alarm when the
    /// model no longer explains what arrives
    Watch(watch::WatchOptions),
    /// What files hold: records, channels with name, unit and role, rate and length; what was mended, what is wrong
    Inspect(inspect::InspectOptions),
    /// The catalogue of effects that `diagnose` looks for: what each is, its terms and parameters, what it is mistaken for
    Effects(effects::EffectsOptions),
    /// Make a record of the virtual test rig, whose equation of motion is known
    Generate(generate::GenerateOptions),
    /// Hand the window out as a web page, to this computer's browser or a class's
    Serve(serve::ServeOptions),
}

/// What a command leaves for standard output.
type CommandResult = Result<Vec<u8>, Stop>;

/// Runs the program with the arguments that it was started with.
///
/// Exit status: 0 done, 1 the work could not be done, 2 wrong usage.
pub fn main() -> ExitCode {
    run(std::env::args_os(), &mut io::stdout().lock(), &mut io::stderr().lock())
}

fn run(arguments: impl IntoIterator<Item = OsString>, out: &mut impl Write, err: &mut impl Write) -> ExitCode {
    let result = match Cli::try_parse_from(arguments) {
        Err(error) => Err(Stop::Usage(error)),
        Ok(cli) if cli.command.is_some() && cli.opens_the_window() => Err(usage(
            "",
            clap::error::ErrorKind::ArgumentConflict,
            "a command stands first: files and options of the window go with none",
        )),
        Ok(cli) => match (cli.command, ProgressLine::new(cli.quiet)) {
            (None, _) => match cli.replay {
                Some(log) => window::replay(&log).map_err(Stop::from),
                None => window::open(cli.files, cli.log).map(|()| Vec::new()).map_err(Stop::from),
            },
            (Some(Command::Identify(options)), progress) => identify::run(&options, &progress),
            (Some(Command::Diagnose(options)), progress) => diagnose::run(&options, &progress),
            (Some(Command::Report(options)), progress) => report::run(&options, &progress),
            (Some(Command::Batch(options)), progress) => batch::run(&options, &progress),
            (Some(Command::Series(options)), _) => series::run(&options),
            (Some(Command::Watch(options)), progress) => watch::run(&options, &progress, out),
            (Some(Command::Inspect(options)), progress) => inspect::run(&options, &progress),
            (Some(Command::Effects(options)), _) => effects::run(&options),
            (Some(Command::Generate(options)), progress) => generate::run(&options, &progress),
            (Some(Command::Serve(options)), _) => serve::run(&options),
        },
    };
    match result {
        Ok(text) => match out.write_all(&text).and_then(|()| out.flush()) {
            Ok(()) => ExitCode::SUCCESS,
            // The reader has seen enough, as `head` does.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => ExitCode::SUCCESS,
            Err(error) => fail(&Failure::new(format!("cannot write to standard output: {error}")), err),
        },
        Err(Stop::Usage(error)) => error.exit(),
        Err(Stop::Failure(failure)) => fail(&failure, err),
    }
}

fn fail(failure: &Failure, err: &mut impl Write) -> ExitCode {
    // Nobody is left to tell if standard error is gone too.
    let _ = write!(err, "{failure}");
    ExitCode::from(1)
}

/// Wrong usage that the argument parser cannot see by itself.
fn usage(command: &str, kind: clap::error::ErrorKind, problem: impl std::fmt::Display) -> Stop {
    let mut cli = Cli::command();
    cli.build();
    let error = match cli.find_subcommand_mut(command) {
        Some(command) => command.error(kind, problem),
        None => cli.error(kind, problem),
    };
    Stop::Usage(error)
}

#[cfg(test)]
mod tests;
