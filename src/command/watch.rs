//! `watch`: a stream, the last seconds of which are identified as they come.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::error::Error;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, value_parser};

use super::failure::{Failure, Stop};
use super::progress::ProgressLine;
use super::source::ReadingOptions;
use super::table;
use sindyscope_analysis::watch::source::{Arrival, Arriving, StreamSource};
use sindyscope_analysis::watch::{
    Settled, WATCHING, Watch, WatchEvent, Watching, alarm_words, cleared_words, settled_words, stream_figure,
    summary_json, summary_words, update_json,
};
use sindyscope_analysis::{AnalysisRequest, RecordSource};
use sindyscope_core::study::{AlarmChange, Cancel, SETTINGS, StreamUpdate};
use sindyscope_report::document::{FigureFormat, FigureSize};
use sindyscope_values::format::equations::is_kinematic;
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::term::Symbol;

/// Options of `watch`.
#[derive(Clone, Debug)]
pub(super) struct WatchOptions {
    source: StreamSource,
    request: AnalysisRequest,
    watching: Watching,
    json: bool,
    out: Option<PathBuf>,
    picture: Option<PathBuf>,
    until_alarm: bool,
}

impl Args for WatchOptions {
    fn augment_args(command: Command) -> Command {
        let source = Arg::new("source").value_name("SOURCE").required(true).value_parser(value_parser!(StreamSource));
        let source = source.help(
            "Where rows come from, text as in a file: a file that grows, `-` for standard input, udp://ADDRESS:PORT, or \
             serial://DEVICE?baud=115200",
        );
        let flag = |name: &'static str, help: &'static str| {
            Arg::new(name).long(name).action(ArgAction::SetTrue).help(help).help_heading("Output")
        };
        let out = Arg::new("out").long("out").value_name("TABLE").value_parser(value_parser!(PathBuf));
        let out = out.help("Write the coefficients over time as CSV, a row a block").help_heading("Output");
        let picture = Arg::new("picture").long("picture").value_name("FILE").value_parser(value_parser!(PathBuf));
        let picture = picture
            .help("Draw at the end what arrived last and the coefficients over time: .svg, .pdf or .png")
            .help_heading("Output");
        let command = table::with_options(ReadingOptions::augment_args(command.arg(source)), WATCHING).mut_arg("rate", |arg| {
            arg.help("Sampling rate, Hz, of rows without a time, or of even ones whose stamps only tell when they arrived")
        });
        table::with_options(command, SETTINGS)
            .arg(flag("json", "Print one JSON object a line, and nothing else"))
            .arg(out)
            .arg(picture)
            .arg(flag("until-alarm", "End with the first alarm"))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for WatchOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let ReadingOptions(reading) = ReadingOptions::from_arg_matches(matches)?;
        let mut watching = Watching::default();
        table::given(matches, WATCHING).apply(&mut watching).map_err(table::unfit)?;
        let source = RecordSource { reading, ..RecordSource::default() };
        let request = AnalysisRequest { source, given: table::given(matches, SETTINGS), ..AnalysisRequest::default() };
        let stream = matches.get_one("source").cloned().unwrap_or(StreamSource::Input);
        Ok(Self {
            source: stream,
            request,
            watching,
            json: matches.get_flag("json"),
            out: matches.get_one("out").cloned(),
            picture: matches.get_one("picture").cloned(),
            until_alarm: matches.get_flag("until-alarm"),
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// Width of the picture, and the height of each of its panels, mm.
const WIDTH: f64 = 160.0;
const PANEL: f64 = 32.0;

/// How long nothing may come before it is looked at whether the stream is still wanted.
const PATIENCE: Duration = Duration::from_millis(100);

/// Follows the stream until it ends, an interrupt comes, or nobody reads what is printed.
pub(super) fn run(options: &WatchOptions, progress: &ProgressLine, out: &mut impl Write) -> Result<Vec<u8>, Stop> {
    let WatchOptions { source, request, watching, .. } = options;
    // Said before the stream is followed, not after.
    if let Some(path) = &options.picture {
        FigureFormat::of(path).map_err(Failure::from)?;
    }
    let cancel = Cancel::default();
    interrupted(&cancel);
    let mut watch = Watch::new(&source.to_string(), request.clone(), *watching).map_err(Failure::from)?;
    let arriving = Arriving::open(source, &cancel)
        .map_err(|e| Failure::new(e).try_this("see `sindyscope watch --help` for how a source is written"))?;
    let mut printer = WatchPrinter::new(options, out)?;
    let mut told = Vec::new();
    progress.share("collecting the first seconds", 0.0);
    loop {
        if cancel.is_cancelled() {
            break;
        }
        let Some(arrival) = arriving.next(PATIENCE) else { continue };
        // A choice of settings that is interrupted has no result, which is no failure.
        let taken = match arrival {
            Arrival::Bytes(bytes) => watch.take(&bytes, &cancel, &|p| progress.show(p), &mut told),
            Arrival::Anew => {
                watch.begin_anew();
                Ok(())
            }
            Arrival::Waiting(what) => {
                printer.notice(&what)?;
                Ok(())
            }
            Arrival::Ended => break,
            Arrival::Failed(why) => return Err(Failure::new(why).into()),
        };
        match taken {
            Err(error) if error.is_cancelled() => break,
            taken => taken.map_err(Failure::from)?,
        }
        match watch.filled() {
            Some(share) => progress.share("collecting the first seconds", share),
            None => progress.hide(),
        }
        if !printer.tell(told.drain(..))? {
            cancel.cancel();
            return Ok(Vec::new());
        }
        if options.until_alarm && printer.alarms > 0 {
            break;
        }
    }
    // What has come is still identified where the stream has ended, but not by choosing settings after an interrupt.
    if !cancel.is_cancelled() || watch.filled().is_none() {
        watch.end(&Cancel::default(), &|p| progress.show(p), &mut told).map_err(Failure::from)?;
    }
    cancel.cancel();
    progress.hide();
    if !options.until_alarm || printer.alarms == 0 {
        printer.tell(told.drain(..))?;
    }
    printer.end(&watch)
}

/// Sets the flag at the first interrupt; a second one ends the program as it would otherwise.
fn interrupted(cancel: &Cancel) {
    let cancel = cancel.clone();
    // Where there is a handler already, as in tests that run commands in one process, an interrupt ends the program.
    let _ = ctrlc::set_handler(move || {
        if cancel.is_cancelled() {
            std::process::exit(130);
        }
        cancel.cancel();
    });
}

/// What is printed, and written to a table.
struct WatchPrinter<'a, W: Write> {
    options: &'a WatchOptions,
    out: &'a mut W,
    table: Option<WatchTable>,
    settled: Option<Box<Settled>>,
    /// Time from which on the next line is due.
    due: f64,
    alarms: usize,
    /// What was identified, where it is to be drawn.
    updates: Vec<StreamUpdate>,
}

impl<'a, W: Write> WatchPrinter<'a, W> {
    fn new(options: &'a WatchOptions, out: &'a mut W) -> Result<Self, Failure> {
        let table = options.out.as_deref().map(WatchTable::new).transpose()?;
        Ok(Self { options, out, table, settled: None, due: f64::NEG_INFINITY, alarms: 0, updates: Vec::new() })
    }

    /// Prints a line; false if nobody reads it.
    fn line(&mut self, text: &str) -> Result<bool, Failure> {
        match writeln!(self.out, "{text}").and_then(|()| self.out.flush()) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
            Err(error) => Err(Failure::new(format!("cannot write to standard output: {error}"))),
        }
    }

    fn notice(&mut self, text: &str) -> Result<bool, Failure> {
        if self.options.json { Ok(true) } else { self.line(&format!("# {text}")) }
    }

    /// False if nobody reads any more.
    fn tell(&mut self, events: impl Iterator<Item = WatchEvent>) -> Result<bool, Failure> {
        for event in events {
            let read = match event {
                WatchEvent::Notice(text) => self.notice(&text)?,
                WatchEvent::Settled(settled) => {
                    let words = settled_words(&settled);
                    self.settled = Some(settled);
                    self.notice(&words)?
                }
                WatchEvent::Update(update) => self.update(&update)?,
            };
            if !read {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn update(&mut self, update: &StreamUpdate) -> Result<bool, Failure> {
        let raised = update.change == Some(AlarmChange::Raised);
        self.alarms += usize::from(raised);
        if let (Some(table), Some(settled)) = (&mut self.table, &self.settled) {
            table.row(update, settled)?;
        }
        if self.options.picture.is_some() {
            self.updates.push(update.clone());
        }
        if update.change.is_none() && update.time < self.due {
            return Ok(true);
        }
        self.due = update.time + self.options.watching.every * (1.0 - 1e-9);
        if self.options.json {
            let json = self.settled.as_ref().map(|settled| update_json(update, settled).to_string());
            return json.map_or(Ok(true), |json| self.line(&json));
        }
        let layout = &update.model.layout;
        let time = format!("{:>9} s", significant(update.time, 6));
        let told = match (update.change, &update.alarm) {
            (Some(AlarmChange::Raised), Some(alarm)) => {
                let what = alarm_words(alarm, layout);
                self.line(&format!("{time}  ALARM: the model no longer explains what arrives, {what}"))?
            }
            (Some(AlarmChange::Cleared(why)), _) => {
                let why = cleared_words(why, self.settled.as_ref().map_or(0.0, |s| s.last));
                self.line(&format!("{time}  the alarm ends: {why}"))?
            }
            _ => true,
        };
        Ok(told && self.line(&format!("{time}  {}", equations(update)))?)
    }

    /// Draws the stream as far as it was followed.
    fn draw(&self, path: &Path, watch: &Watch) -> Result<(), Failure> {
        let format = FigureFormat::of(path).map_err(Failure::from)?;
        let record = watch.record();
        let Some(figure) = stream_figure(record.as_ref(), self.settled.as_deref(), &self.updates) else {
            return Ok(());
        };
        let height = PANEL * figure.rows.len() as f64 + 10.0;
        let drawing = figure.svg(FigureSize { width: WIDTH, height, ..FigureSize::default() }, &ShownUnits::default());
        let bytes = format.bytes(&drawing, &figure.caption).map_err(Failure::from)?;
        std::fs::write(path, bytes).map_err(|e| Failure::writing(path, &e))
    }

    /// The last line.
    fn end(mut self, watch: &Watch) -> Result<Vec<u8>, Stop> {
        if self.settled.is_none() {
            let failure = Failure::new(format!(
                "the stream ended before it could be identified: {}",
                summary_words(watch.counts(), self.alarms)
            ));
            return Err(failure.try_this("watch for longer, or identify a shorter part of it with --last").into());
        }
        let text = if self.options.json {
            summary_json(watch.counts(), self.alarms).to_string()
        } else {
            format!("# {}", summary_words(watch.counts(), self.alarms))
        };
        if let Some(path) = &self.options.picture {
            self.draw(path, watch)?;
        }
        self.line(&text)?;
        Ok(Vec::new())
    }
}

/// What is identified, in a line.
fn equations(update: &StreamUpdate) -> String {
    let model = &update.model;
    let fitted = model.iter().filter(|(state, equation)| !is_kinematic(model, *state, equation));
    let mut text: Vec<String> = fitted
        .map(|(state, equation)| {
            let term = |t: &sindyscope_values::model::WeightedTerm| {
                format!("{} {}", format_measured(t.coefficient, t.std_error), t.term.text(&model.layout))
            };
            let terms: Vec<String> = equation.terms.iter().map(term).collect();
            format!("d{}/dt: {}", model.layout.name(state), terms.join(", "))
        })
        .collect();
    if let Some(judged) = &update.judged {
        text.push(format!("residual {} of the usual", significant(judged.ratio, 3)));
    }
    if update.alarm.is_some() {
        text.push("alarm".into());
    }
    text.join("; ")
}

/// The coefficients over time as CSV.
struct WatchTable {
    path: PathBuf,
    csv: csv::Writer<std::fs::File>,
    /// The states whose rates are identified, once the first row has told; a column of each term for each.
    states: Option<Vec<Symbol>>,
}

impl WatchTable {
    fn new(path: &Path) -> Result<Self, Failure> {
        let file = std::fs::File::create(path).map_err(|e| Failure::writing(path, &e))?;
        Ok(Self { path: path.to_owned(), csv: csv::Writer::from_writer(file), states: None })
    }

    fn write(&mut self, cells: &[String]) -> Result<(), Failure> {
        // Whoever follows the table sees each row as it comes.
        let written = self.csv.write_record(cells).map_err(std::io::Error::from).and_then(|()| self.csv.flush());
        written.map_err(|e| Failure::writing(&self.path, &e))
    }

    fn row(&mut self, update: &StreamUpdate, settled: &Settled) -> Result<(), Failure> {
        let model = &update.model;
        let states = match &self.states {
            Some(states) => states.clone(),
            None => {
                let fitted = model.iter().filter(|(state, equation)| !is_kinematic(model, *state, equation));
                let states: Vec<Symbol> = fitted.map(|(state, _)| state).collect();
                let columns = states.iter().flat_map(|state| {
                    settled.library.iter().flat_map(|term| {
                        let name = format!("d{}/dt {}", model.layout.name(*state), term.text(&model.layout));
                        let error = format!("{name} std_error");
                        [name, error]
                    })
                });
                let ends = ["residual_ratio".to_owned(), "alarm".to_owned()];
                let head: Vec<String> = std::iter::once("time".to_owned()).chain(columns).chain(ends).collect();
                self.write(&head)?;
                self.states.insert(states).clone()
            }
        };
        let mut cells = vec![update.time.to_string()];
        for (_, equation) in model.iter().filter(|(state, _)| states.contains(state)) {
            for term in &settled.library {
                let found = equation.terms.iter().find(|t| t.term == *term);
                cells.push(found.map_or("0".into(), |t| t.coefficient.to_string()));
                cells.push(found.and_then(|t| t.std_error).map_or_else(String::new, |e| e.to_string()));
            }
        }
        cells.push(update.judged.as_ref().map_or_else(String::new, |j| j.ratio.to_string()));
        cells.push(u8::from(update.alarm.is_some()).to_string());
        self.write(&cells)
    }
}
