//! The model as a Python program with NumPy and SciPy.

use super::head::comment;
use super::switched::{InLanguage, Language, Switched, literal};
use super::{Export, FormatEntry, input_file};
use sindyscope_values::term::{Function, Symbol, written};

const RATES: &str = "The rate of each state X; U holds each input with two derivatives, s the held signs.";

/// The part that is the same for every model.
const INTEGRATOR: &str = include_str!("templates/integrator.py");

const PYTHON: Language = Language {
    sign: |surface| format!("s[{surface}]"),
    state: |i| format!("X[{i}]"),
    input: |j, order| format!("U[{j}][{order}]"),
    define: |name, value| format!("    {name} = {value}\n"),
    // A broken power of a negative number is a complex one in plain Python.
    power: |base, exponent| match exponent.contains('.') {
        true => format!("np.power({base}, {exponent})"),
        false => format!("{base}**{exponent}"),
    },
    function: |function| format!("np.{}", if function == Function::Atan { "arctan" } else { function.name() }),
};

pub(super) const FORMAT: FormatEntry =
    FormatEntry { ending: "py", name: "Python", runs: true, switches: true, write: program };

/// The program's text.
fn program(export: &Export<'_>, switched: &Switched, stem: &str) -> String {
    let layout = &switched.layout;
    let usage = [
        format!("Run:  python3 {stem}.py {} response.csv", input_file(stem)),
        "      (further arguments: another initial state); needs NumPy and SciPy.".into(),
        "Reads CSV: evenly spaced times and the inputs, by header name or in this order; writes time and states."
            .into(),
    ];
    let mut out = comment("#", &export.head(switched, &usage));
    out.push_str("\nimport csv\nimport sys\n\nimport numpy as np\nfrom scipy.integrate import DOP853\nfrom scipy.optimize import brentq\n\n");
    let list = |items: Vec<String>| format!("[{}]", items.join(", "));
    let numbers = |values: &[f64]| list(values.iter().map(|v| literal(*v)).collect());
    let quoted = |names: Vec<String>| list(names.iter().map(|n| format!("\"{n}\"")).collect());
    out.push_str(&format!("STATES = {}\n", quoted(export.state_names())));
    out.push_str(&format!(
        "OUTPUTS = {}  # what sensors show, written after the states\n",
        quoted(export.output_names())
    ));
    out.push_str(&format!("INITIAL = {}\n", numbers(&export.initial())));
    out.push_str(&format!(
        "SCALE = {}  # largest magnitude of each state: what an error is held against\n",
        numbers(&export.scale())
    ));
    out.push_str(&format!("HOLD = {}  # a sticking sign holds up to this magnitude\n", literal(switched.hold)));
    let slides = switched.surfaces.iter().map(|s| if s.slides { "True" } else { "False" }.to_owned());
    out.push_str(&format!("SLIDES = {}  # surfaces that the motion can stay on\n", list(slides.collect())));
    let names = |symbol: fn(usize) -> Symbol| {
        list((0..layout.inputs).map(|j| quoted(export.header_names(symbol(j)))).collect())
    };
    out.push_str(&format!("INPUT_NAMES = {}\n", names(Symbol::Input)));
    out.push_str(&format!("RATE_NAMES = {}\n\n\n", names(Symbol::InputRate)));
    let style = InLanguage { language: &PYTHON, switched, by_place: export.space.is_some() };
    let rates: Vec<String> = (0..switched.states.len()).map(|i| switched.rate(i, &style)).collect();
    let surfaces: Vec<String> = switched.surfaces.iter().map(|s| written(&s.expression, &style)).collect();
    let slopes: Vec<String> =
        (0..surfaces.len()).map(|k| switched.surface_rate(k, &style, |i| format!("f[{i}]"))).collect();
    let mut define = |name: &str, also: &str, says: &str, results: &[String]| {
        out.push_str(&format!("def {name}(t, X, U, s{also}):\n    \"\"\"{says}\"\"\"\n"));
        out.push_str(&style.definitions(&results.join("\n")));
        out.push_str("    return [\n");
        for result in results {
            out.push_str(&format!("        {result},\n"));
        }
        out.push_str("    ]\n\n\n");
    };
    if export.space.is_none() {
        define("rates", "", RATES, &rates);
        define("outputs", "", "What sensors show beside the states.", &[]);
    }
    define("surfaces", "", "The functions at whose zeros the signs change.", &surfaces);
    define("surface_rates", ", f", "Their rates, the states changing by f.", &slopes);
    if let Some(space) = export.space {
        out.push_str(&space.python(&style));
    }
    out.push_str(INTEGRATOR);
    out
}
