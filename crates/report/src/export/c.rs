//! The model as a C program that needs nothing but the standard library.

use super::head::comment;
use super::switched::{InLanguage, Language, Switched, literal, mentions};
use super::{Export, FormatEntry, input_file};
use sindyscope_values::term::{Function, Symbol, written};

/// The part that is the same for every model.
const INTEGRATOR: &str = include_str!("templates/integrator.c");

const C: Language = Language {
    sign: |surface| format!("s[{surface}]"),
    state: |i| format!("X[{i}]"),
    input: |j, order| format!("U[{j}][{order}]"),
    define: |name, value| format!("    const double {name} = {value};\n"),
    power: |base, exponent| format!("pow({base}, {exponent})"),
    function: |function| if function == Function::Abs { "fabs".into() } else { function.name().into() },
};

pub(super) const FORMAT: FormatEntry =
    FormatEntry { ending: "c", name: "C", runs: true, switches: true, write: program };

/// The program's text.
fn program(export: &Export<'_>, switched: &Switched, stem: &str) -> String {
    let layout = &switched.layout;
    let usage = [
        format!("Build:  cc -O2 {stem}.c -o {stem} -lm"),
        format!("Run:    ./{stem} {} response.csv", input_file(stem)),
        "        (further arguments: another initial state)".into(),
        "Reads CSV: evenly spaced times and the inputs, by header name or in this order; writes time and states."
            .into(),
    ];
    let mut out = comment("//", &export.head(switched, &usage));
    out.push_str(
        "#include <ctype.h>\n#include <math.h>\n#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n\n",
    );
    let numbers = |values: &[f64]| values.iter().map(|v| literal(*v)).collect::<Vec<_>>().join(", ");
    let count = switched.states.len();
    out.push_str(&format!(
        "#define STATES {count}\n#define INPUTS {}\n#define OUTPUTS {}\n#define SURFACES {}\n\n",
        layout.inputs,
        export.output_names().len(),
        switched.surfaces.len()
    ));
    let quoted = |names: Vec<String>| names.iter().map(|n| format!("\"{n}\", ")).collect::<String>();
    out.push_str(&format!(
        "static const char *state_name[STATES] = {{{}}};\n",
        quoted(export.state_names()).trim_end_matches(", ")
    ));
    out.push_str("/* What sensors show, written after the states. */\n");
    out.push_str(&format!("static const char *output_name[OUTPUTS + 1] = {{{}0}};\n", quoted(export.output_names())));
    out.push_str(&format!("static const double initial[STATES] = {{{}}};\n", numbers(&export.initial())));
    out.push_str("/* Largest magnitude of each state: what an error is held against. */\n");
    out.push_str(&format!("static const double scale[STATES] = {{{}}};\n", numbers(&export.scale())));
    out.push_str("/* A sticking sign holds up to this magnitude. */\n");
    out.push_str(&format!("static const double hold = {};\n", literal(switched.hold)));
    out.push_str("/* Surfaces that the motion can stay on. */\n");
    let slides: Vec<&str> = switched.surfaces.iter().map(|s| if s.slides { "1" } else { "0" }).chain(["0"]).collect();
    out.push_str(&format!("static const int slides[SURFACES + 1] = {{{}}};\n", slides.join(", ")));
    for (what, symbol) in [("input", Symbol::Input as fn(usize) -> Symbol), ("rate", Symbol::InputRate)] {
        let each = (0..layout.inputs).map(|j| {
            let names: Vec<String> = export.header_names(symbol(j)).iter().map(|n| format!("\"{n}\"")).collect();
            format!("{{{}}}", names.join(", "))
        });
        let rows: Vec<String> = each.chain(["{0}".to_owned()]).collect();
        out.push_str(&format!("static const char *{what}_names[INPUTS + 1][8] = {{{}}};\n", rows.join(", ")));
    }
    out.push_str(
        "\n/* The model: X holds the states, U each input with its first two derivatives, s the held signs. */\n\n",
    );
    let style = InLanguage { language: &C, switched, by_place: export.space.is_some() };
    let body: Vec<String> = (0..count).map(|i| format!("    f[{i}] = {};", switched.rate(i, &style))).collect();
    match export.space {
        Some(space) => out.push_str(&space.c(&style)),
        None => {
            out.push_str(&function("rates", false, "f", &body, &style));
            out.push_str("/* What sensors show beside the states: nothing. */\n");
            out.push_str(&function("outputs", false, "y", &[], &style));
        }
    }
    let surfaces = &switched.surfaces;
    let body: Vec<String> =
        surfaces.iter().enumerate().map(|(k, s)| format!("    g[{k}] = {};", written(&s.expression, &style))).collect();
    out.push_str("/* The functions at whose zeros the signs change. */\n");
    out.push_str(&function("surfaces", false, "g", &body, &style));
    let rate = |i: usize| format!("f[{i}]");
    let body: Vec<String> =
        (0..surfaces.len()).map(|k| format!("    g[{k}] = {};", switched.surface_rate(k, &style, rate))).collect();
    out.push_str("/* Their rates, the states changing by f. */\n");
    out.push_str(&function("surface_rates", true, "g", &body, &style));
    out.push_str(INTEGRATOR);
    out
}

/// A function of the model's quantities that names what its body uses; `out` is the array that it fills.
fn function(name: &str, reads_rates: bool, out: &str, body: &[String], style: &InLanguage<'_>) -> String {
    let body = body.join("\n");
    let code = style.definitions(&body) + &body;
    let mut parameters =
        vec![("double t", "t"), ("const double *X", "X"), ("double (*U)[3]", "U"), ("const double *s", "s")];
    if reads_rates {
        parameters.push(("const double *f", "f"));
    }
    let result = format!("double *{out}");
    parameters.push((&result, out));
    let list: Vec<&str> = parameters.iter().map(|(declaration, _)| *declaration).collect();
    let unused: Vec<String> = parameters
        .iter()
        .filter(|(_, name)| !mentions(&code, name))
        .map(|(_, name)| format!("(void){name};"))
        .collect();
    let mut text = format!("static void {name}({})\n{{\n", list.join(", "));
    if !unused.is_empty() {
        text.push_str(&format!("    {}\n", unused.join(" ")));
    }
    text.push_str(&code);
    text.push_str("\n}\n\n");
    text
}
