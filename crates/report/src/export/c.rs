//! The model as a C program that needs nothing but the standard library.

use super::head::comment;
use super::switched::{Switched, literal, mentions};
use super::{Export, FormatEntry, input_file};
use sindyscope_values::term::{Expression, Function, Layout, Style, Symbol, written};

/// The part that is the same for every model.
const INTEGRATOR: &str = include_str!("templates/integrator.c");

struct C<'a>(&'a Switched);

impl Style for C<'_> {
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
        format!("pow({base}, {exponent})")
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        let name = match function {
            Function::Abs => "fabs",
            f => f.name(),
        };
        format!("{name}({})", arguments.join(", "))
    }
}

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
        "#define STATES {count}\n#define INPUTS {}\n#define SURFACES {}\n\n",
        layout.inputs,
        switched.surfaces.len()
    ));
    let names: Vec<String> = switched.states.iter().map(|s| format!("\"{}\"", layout.name(*s))).collect();
    out.push_str(&format!("static const char *state_name[STATES] = {{{}}};\n", names.join(", ")));
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
    let style = C(switched);
    let body: Vec<String> = (0..count).map(|i| format!("    f[{i}] = {};", switched.rate(i, &style))).collect();
    out.push_str(&function("rates", false, "f", &body, layout));
    let surfaces = &switched.surfaces;
    let body: Vec<String> =
        surfaces.iter().enumerate().map(|(k, s)| format!("    g[{k}] = {};", written(&s.expression, &style))).collect();
    out.push_str("/* The functions at whose zeros the signs change. */\n");
    out.push_str(&function("surfaces", false, "g", &body, layout));
    let rate = |i: usize| format!("f[{i}]");
    let body: Vec<String> =
        (0..surfaces.len()).map(|k| format!("    g[{k}] = {};", switched.surface_rate(k, &style, rate))).collect();
    out.push_str("/* Their rates, the states changing by f. */\n");
    out.push_str(&function("surface_rates", true, "g", &body, layout));
    out.push_str(INTEGRATOR);
    out
}

/// A function of the model's quantities that names what its body uses; `out` is the array that it fills.
fn function(name: &str, reads_rates: bool, out: &str, body: &[String], layout: &Layout) -> String {
    let body = body.join("\n");
    let mut code = String::new();
    let mut define = |symbol: Symbol, from: String| {
        let name = layout.name(symbol);
        if mentions(&body, &name) {
            code.push_str(&format!("    const double {name} = {from};\n"));
        }
    };
    for (i, symbol) in layout.state_symbols().enumerate() {
        define(symbol, format!("X[{i}]"));
    }
    for j in 0..layout.inputs {
        define(Symbol::Input(j), format!("U[{j}][0]"));
        define(Symbol::InputRate(j), format!("U[{j}][1]"));
        define(Symbol::InputAcceleration(j), format!("U[{j}][2]"));
    }
    code.push_str(&body);
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
