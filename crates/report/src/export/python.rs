//! The model as a Python program with NumPy and SciPy.

use super::head::comment;
use super::switched::{Switched, literal, mentions};
use super::{Export, FormatEntry, input_file};
use sindyscope_values::term::{Expression, Function, Style, Symbol, written};

/// The part that is the same for every model.
const INTEGRATOR: &str = include_str!("templates/integrator.py");

struct Python<'a>(&'a Switched);

impl Style for Python<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        self.0.layout.name(symbol)
    }

    fn substitute(&self, e: &Expression) -> Option<String> {
        let (surface, function, argument) = self.0.held(e)?;
        Some(match function {
            Function::Abs => format!("(s[{surface}]*({}))", written(argument, self)),
            _ => format!("s[{surface}]"),
        })
    }

    fn number(&self, value: f64) -> String {
        literal(value)
    }

    fn times(&self) -> &'static str {
        "*"
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        // A broken power of a negative number is a complex one in plain Python.
        if exponent.contains('.') { format!("np.power({base}, {exponent})") } else { format!("{base}**{exponent}") }
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        let name = match function {
            Function::Atan => "arctan",
            f => f.name(),
        };
        format!("np.{name}({})", arguments.join(", "))
    }
}

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
    out.push_str(&format!("STATES = {}\n", quoted(switched.states.iter().map(|s| layout.name(*s)).collect())));
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
    let style = Python(switched);
    let rates: Vec<String> = (0..switched.states.len()).map(|i| switched.rate(i, &style)).collect();
    let surfaces: Vec<String> = switched.surfaces.iter().map(|s| written(&s.expression, &style)).collect();
    let slopes: Vec<String> =
        (0..surfaces.len()).map(|k| switched.surface_rate(k, &style, |i| format!("f[{i}]"))).collect();
    let mut define = |name: &str, also: &str, says: &str, results: &[String]| {
        out.push_str(&format!("def {name}(t, X, U, s{also}):\n    \"\"\"{says}\"\"\"\n"));
        let body = results.join("\n");
        let mut unpack = |symbol: Symbol, from: String| {
            let name = layout.name(symbol);
            if mentions(&body, &name) {
                out.push_str(&format!("    {name} = {from}\n"));
            }
        };
        for (i, state) in switched.states.iter().enumerate() {
            unpack(*state, format!("X[{i}]"));
        }
        for j in 0..layout.inputs {
            unpack(Symbol::Input(j), format!("U[{j}][0]"));
            unpack(Symbol::InputRate(j), format!("U[{j}][1]"));
            unpack(Symbol::InputAcceleration(j), format!("U[{j}][2]"));
        }
        out.push_str("    return [\n");
        for result in results {
            out.push_str(&format!("        {result},\n"));
        }
        out.push_str("    ]\n\n\n");
    };
    define("rates", "", "The rate of each state X; U holds each input with two derivatives, s the held signs.", &rates);
    define("surfaces", "", "The functions at whose zeros the signs change.", &surfaces);
    define("surface_rates", ", f", "Their rates, the states changing by f.", &slopes);
    out.push_str(INTEGRATOR);
    out
}
