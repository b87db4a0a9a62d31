//! The model as a MATLAB function around `ode45` and its events.

use super::head::comment;
use super::switched::{InLanguage, Language, Switched, literal};
use super::{Export, FormatEntry, identifier, input_file};
use sindyscope_values::term::{Symbol, written};

const RATES: &str = "The rate of each state X; U holds each input with two derivatives, s the held signs.";

/// The part that is the same for every model.
const INTEGRATOR: &str = include_str!("templates/integrator.m");

const MATLAB: Language = Language {
    sign: |surface| format!("s({})", surface + 1),
    state: |i| format!("X({})", i + 1),
    input: |j, order| format!("U({}, {})", j + 1, order + 1),
    define: |name, value| format!("    {name} = {value};\n"),
    power: |base, exponent| format!("{base}^{exponent}"),
    function: |function| function.name().into(),
};

pub(super) const FORMAT: FormatEntry =
    FormatEntry { ending: "m", name: "MATLAB", runs: true, switches: false, write: program };

/// The function file's text.
fn program(export: &Export<'_>, switched: &Switched, stem: &str) -> String {
    let layout = &switched.layout;
    let name = identifier(stem);
    let usage = [
        format!("Run:  response = {name}('{}', 'response.csv');", input_file(stem)),
        "      (a third argument: another initial state); columns of the response: time, states, outputs.".into(),
        "Reads CSV: evenly spaced times and the inputs, by header name or in this order; writes time and states."
            .into(),
    ];
    let mut out = comment("%", &export.head(switched, &usage));
    out.push_str(&format!("function response = {name}(input_file, output_file, initial)\n"));
    let list = |items: Vec<String>, separator: &str| items.join(separator);
    let numbers = |values: &[f64]| format!("[{}]", list(values.iter().map(|v| literal(*v)).collect(), "; "));
    let quoted = |names: Vec<String>| {
        let each = names.iter().map(|n| format!("'{n}'")).collect();
        format!("{{{}}}", list(each, ", "))
    };
    out.push_str(&format!("    model.states = {};\n", quoted(export.state_names())));
    out.push_str("    % What sensors show, written after the states.\n");
    out.push_str(&format!("    model.outputs = {};\n", quoted(export.output_names())));
    out.push_str(&format!("    model.initial = {};\n", numbers(&export.initial())));
    out.push_str("    % Largest magnitude of each state: what an error is held against.\n");
    out.push_str(&format!("    model.scale = {};\n", numbers(&export.scale())));
    out.push_str("    % A sticking sign holds up to this magnitude.\n");
    out.push_str(&format!("    model.hold = {};\n", literal(switched.hold)));
    out.push_str("    % Surfaces that the motion can stay on.\n");
    let slides = switched.surfaces.iter().map(|s| if s.slides { "1" } else { "0" }.to_owned()).collect();
    out.push_str(&format!("    model.slides = [{}];\n", list(slides, "; ")));
    for (field, symbol) in [("input_names", Symbol::Input as fn(usize) -> Symbol), ("rate_names", Symbol::InputRate)] {
        let each = (0..layout.inputs).map(|j| quoted(export.header_names(symbol(j)))).collect();
        out.push_str(&format!("    model.{field} = {{{}}};\n", list(each, ", ")));
    }
    out.push_str("    if nargin < 3, initial = model.initial; end\n");
    out.push_str("    inputs = read_inputs(input_file, model);\n");
    out.push_str("    response = simulate(inputs, initial(:), model);\n");
    out.push_str("    if nargin > 1, write_response(output_file, response, model); end\nend\n\n");
    let style = InLanguage { language: &MATLAB, switched, by_place: export.space.is_some() };
    let rates: Vec<String> = (0..switched.states.len()).map(|i| switched.rate(i, &style)).collect();
    let surfaces: Vec<String> = switched.surfaces.iter().map(|s| written(&s.expression, &style)).collect();
    let slopes: Vec<String> =
        (0..surfaces.len()).map(|k| switched.surface_rate(k, &style, |i| format!("f({})", i + 1))).collect();
    let mut define = |name: &str, also: &str, says: &str, results: &[String]| {
        out.push_str(&format!("function out = {name}(t, X, U, s{also})\n    % {says}\n"));
        out.push_str(&style.definitions(&results.join("\n")));
        out.push_str(&format!("    out = zeros({}, 1);\n", results.len()));
        for (i, result) in results.iter().enumerate() {
            out.push_str(&format!("    out({}) = {result};\n", i + 1));
        }
        out.push_str("end\n\n");
    };
    if export.space.is_none() {
        define("rates", "", RATES, &rates);
        define("outputs", "", "What sensors show beside the states.", &[]);
    }
    define("surfaces", "", "The functions at whose zeros the signs change.", &surfaces);
    define("surface_rates", ", f", "Their rates, the states changing by f.", &slopes);
    if let Some(space) = export.space {
        out.push_str(&space.matlab(&style));
    }
    out.push_str(INTEGRATOR);
    out
}
