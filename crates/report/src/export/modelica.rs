//! The model as a Modelica package: the motion, and an experiment that reads the inputs from a file.

use super::head::comment;
use super::switched::{Switched, literal, mentions};
use super::{Export, FormatEntry, identifier, input_file};
use sindyscope_values::term::{Expression, Function, Layout, Style, Symbol, written};

/// Modelica locates the zeros of `abs` and of conditions by itself; only signs that may stick are variables of their own.
struct Modelica<'a> {
    switched: &'a Switched,
    /// States are written as entries of a vector `X`.
    by_place: bool,
}

impl Style for Modelica<'_> {
    fn symbol(&self, symbol: Symbol) -> String {
        match symbol {
            Symbol::Time => "time".into(),
            symbol => {
                let place = self.switched.states.iter().position(|s| *s == symbol);
                let place = place.filter(|_| self.by_place);
                place.map_or_else(|| self.switched.layout.name(symbol), |i| format!("X[{}]", i + 1))
            }
        }
    }

    fn substitute(&self, e: &Expression) -> Option<String> {
        match self.switched.held(e)? {
            (surface, Function::Sgn, _) if self.switched.surfaces[surface].slides => {
                Some(format!("sgn_{}", surface + 1))
            }
            (_, Function::Sgn, argument) => {
                let argument = written(argument, self);
                Some(format!("(if {argument} > 0 then 1.0 elseif {argument} < 0 then -1.0 else 0.0)"))
            }
            _ => None,
        }
    }

    fn number(&self, value: f64) -> String {
        literal(value)
    }

    fn times(&self) -> &'static str {
        "*"
    }

    fn power(&self, base: &str, exponent: &str) -> String {
        format!("{base}^{exponent}")
    }

    fn call(&self, function: Function, arguments: &[String], _: bool) -> String {
        format!("{}({})", function.name(), arguments.join(", "))
    }
}

pub(super) const FORMAT: FormatEntry =
    FormatEntry { ending: "mo", name: "Modelica", runs: true, switches: false, write: program };

/// The package's text.
fn program(export: &Export<'_>, switched: &Switched, stem: &str) -> String {
    let layout = &switched.layout;
    let name = identifier(stem);
    let usage = [
        format!("Run:  simulate {name}.Experiment (Modelica Standard Library 4.1 or later, which reads CSV)."),
        format!(
            "      Its inputs are those of {}; between samples they are interpolated by the library.",
            input_file(stem)
        ),
        format!("      {name}.Motion is the model alone, for use in other models."),
    ];
    let mut out = comment("//", &export.head(switched, &usage));
    out.push_str(&format!("package {name}\n\n  model Motion \"The equations of motion\"\n"));
    let style = Modelica { switched, by_place: export.space.is_some() };
    if let Some(space) = export.space {
        let force = space.force_expression().map(|e| written(e, &style));
        let joint_rate = space.joint_rate(switched, &style);
        out.push_str(&space.modelica(switched, &export.initial(), [force.as_deref(), joint_rate.as_deref()]));
        out.push_str("  end Motion;\n\n  model Experiment \"The motion along the recorded inputs\"\n");
        out.push_str(&experiment(layout, stem));
        out.push_str(&format!("  end Experiment;\n\nend {name};\n"));
        return out;
    }
    let rates: Vec<String> = (0..switched.states.len()).map(|i| switched.rate(i, &style)).collect();
    let sliding: Vec<usize> = (0..switched.surfaces.len()).filter(|k| switched.surfaces[*k].slides).collect();
    // A surface's rate, the sign that acts on it replaced.
    let slope = |k: usize, sign: &str| {
        let rate = switched.surface_rate(k, &style, |i| format!("({})", rates[i]));
        replaced(&rate, &format!("sgn_{}", k + 1), sign)
    };
    let slopes: Vec<[String; 2]> = sliding.iter().map(|k| [slope(*k, "0.0"), slope(*k, "1.0")]).collect();
    let values: Vec<String> = sliding.iter().map(|k| written(&switched.surfaces[*k].expression, &style)).collect();
    let code = [&rates[..], slopes.as_flattened(), &values].concat().join("\n");
    for (state, start) in switched.states.iter().zip(export.initial()) {
        out.push_str(&format!("    Real {}(start = {}, fixed = true);\n", layout.name(*state), literal(start)));
    }
    for j in 0..layout.inputs {
        let [u, du, ddu] =
            [Symbol::Input(j), Symbol::InputRate(j), Symbol::InputAcceleration(j)].map(|s| layout.name(s));
        out.push_str(&format!("    input Real {u};\n"));
        if mentions(&code, &du) || mentions(&code, &ddu) {
            out.push_str(&format!("    Real {du} = der({u});\n"));
        }
        if mentions(&code, &ddu) {
            out.push_str(&format!("    Real {ddu} = der({du});\n"));
        }
    }
    if !sliding.is_empty() {
        out.push_str(&format!(
            "    parameter Real hold = {} \"A sticking sign holds up to this magnitude\";\n",
            literal(switched.hold)
        ));
    }
    let reach = export.scale().into_iter().fold(0.0, f64::max);
    out.extend(sliding.iter().zip(&values).map(|(k, value)| surface(k + 1, value, 1e-10 * reach)));
    if !sliding.is_empty() {
        out.push_str("  initial equation\n");
    }
    for n in sliding.iter().map(|k| k + 1) {
        out.push_str(&format!(
            "    pre(side_{n}) = if surface_{n} > 0 then 1 elseif surface_{n} < 0 then -1 else 0;\n"
        ));
    }
    out.push_str("  equation\n");
    for (state, rate) in switched.states.iter().zip(&rates) {
        out.push_str(&format!("    der({}) = {rate};\n", layout.name(*state)));
    }
    for (k, [without, with]) in sliding.iter().zip(&slopes) {
        let n = k + 1;
        out.push_str(&format!(
            "    sgn_{n} = if side_{n} == 0 then needed_{n} else side_{n};\n    free_{n} = {without};\n    \
             pull_{n} = {with} - free_{n};\n    needed_{n} = -free_{n}/min(pull_{n}, -1e-30);\n    \
             ahead_{n} = side_{n}*surface_{n};\n    \
             excess_{n} = if side_{n} == 0 then abs(needed_{n}) - hold else -1.0;\n    \
             when ahead_{n} < -beyond_{n} then\n      \
             side_{n} = if abs(needed_{n}) < hold then 0 else -pre(side_{n});\n    \
             elsewhen excess_{n} > 0 then\n      side_{n} = if needed_{n} > 0 then 1 else -1;\n    end when;\n"
        ));
    }
    out.push_str("  end Motion;\n\n  model Experiment \"The motion along the recorded inputs\"\n");
    out.push_str(&experiment(layout, stem));
    out.push_str(&format!("  end Experiment;\n\nend {name};\n"));
    out
}

/// The variables of a surface that the motion may stay on.
fn surface(n: usize, value: &str, beyond: f64) -> String {
    let beyond = literal(beyond);
    format!(
        "    Real surface_{n} = {value} \"The motion switches where this is zero\";\n    \
             parameter Real beyond_{n} = {beyond} \"A surface so far beyond zero is left\";\n    \
             discrete Real side_{n}(start = 0) \"The held sign of surface_{n}: 1 or -1; 0 while stuck\";\n    \
             Real sgn_{n} \"The sign that acts\";\n    \
             Real free_{n} \"Rate of surface_{n} without that sign\";\n    \
             Real pull_{n} \"What a sign of 1 adds to it\";\n    \
             Real needed_{n} \"The sign that would keep surface_{n} at zero\";\n    \
             Real ahead_{n} \"surface_{n} seen from the side that the motion is on\";\n    \
             Real excess_{n} \"What a stuck sign exceeds hold by\";\n"
    )
}

/// The parts of the experiment: the motion, and where there are inputs the table that feeds it.
fn experiment(layout: &Layout, stem: &str) -> String {
    let feed: Vec<String> =
        (0..layout.inputs).map(|j| format!("{} = table.y[{}]", layout.name(Symbol::Input(j)), j + 1)).collect();
    if feed.is_empty() {
        return "    Motion motion;\n".into();
    }
    let columns: Vec<String> = (0..layout.inputs).map(|j| (j + 2).to_string()).collect();
    format!(
        "    Motion motion({});\n    Modelica.Blocks.Sources.CombiTimeTable table(\n      tableOnFile = true, tableName = \"input\", fileName = \
             \"{}\", delimiter = \",\", nHeaderLines = 1,\n      columns = {{{}}}, smoothness = \
             Modelica.Blocks.Types.Smoothness.ContinuousDerivative);\n",
        feed.join(", "),
        input_file(stem).replace(['"', '\\'], "_"),
        columns.join(", ")
    )
}

/// A text of code with a name replaced.
fn replaced(code: &str, name: &str, by: &str) -> String {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut out, mut rest) = (String::new(), code);
    while let Some(at) = rest.find(name) {
        let (before, after) = (&rest[..at], &rest[at + name.len()..]);
        let whole = !before.chars().next_back().is_some_and(word) && !after.chars().next().is_some_and(word);
        out.push_str(before);
        out.push_str(if whole { by } else { name });
        rest = after;
    }
    out + rest
}
