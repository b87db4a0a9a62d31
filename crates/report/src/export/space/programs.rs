//! The state space in the languages of the exported programs: matrices, rates, and what the sensors show.

use nalgebra::DMatrix;

use super::super::switched::{InLanguage, Switched, literal};
use super::StateSpace;
use sindyscope_values::term::{Style, written};

/// How a language writes numbers in brackets.
struct Brackets {
    open: &'static str,
    close: &'static str,
    /// Between the rows of a matrix.
    rows: &'static str,
    /// Around each row.
    row: (&'static str, &'static str),
}

impl Brackets {
    fn matrix(&self, matrix: &DMatrix<f64>) -> String {
        let row = |r: usize| {
            let numbers: Vec<String> = matrix.row(r).iter().map(|v| literal(*v)).collect();
            format!("{}{}{}", self.row.0, numbers.join(", "), self.row.1)
        };
        let rows: Vec<String> = (0..matrix.nrows()).map(row).collect();
        format!("{}{}{}", self.open, rows.join(self.rows), self.close)
    }
}

const PYTHON: Brackets = Brackets { open: "np.array([\n    ", close: ",\n])", rows: ",\n    ", row: ("[", "]") };
const MATLAB: Brackets = Brackets { open: "[ ...\n        ", close: "]", rows: "; ...\n        ", row: ("", "") };
const C: Brackets = Brackets { open: "{\n    ", close: "}", rows: ",\n    ", row: ("{", "}") };
const MODELICA: Brackets = Brackets { open: "[\n      ", close: "]", rows: ";\n      ", row: ("", "") };

fn column(values: &[f64]) -> DMatrix<f64> {
    DMatrix::from_column_slice(values.len(), 1, values)
}

fn numbers(values: &[f64], separator: &str) -> String {
    values.iter().map(|v| literal(*v)).collect::<Vec<_>>().join(separator)
}

impl StateSpace<'_> {
    /// Matrices and functions of a Python program.
    pub(in super::super) fn python(&self, style: &InLanguage<'_>) -> String {
        let inputs = !self.structure.inputs.is_empty();
        let mut out = String::new();
        for (name, matrix) in [("A", &self.a), ("B", &self.b), ("C", &self.c), ("D", &self.d)] {
            if matrix.ncols() > 0 {
                out.push_str(&format!("{name} = {}\n", PYTHON.matrix(matrix)));
            }
        }
        out.push_str(&format!("OFFSET = np.array([{}])\n", numbers(&self.offsets, ", ")));
        if let Some(force) = &self.force {
            out.push_str(&format!("G = np.array([{}])\n", numbers(&force.on_rates, ", ")));
            out.push_str(&format!("H = np.array([{}])\n", numbers(&force.on_outputs, ", ")));
            if let Some(inner) = self.on_inner() {
                out.push_str(&format!("E = np.array([{}])\n", numbers(&inner, ", ")));
            }
            out.push_str("\n\ndef force(X, s):\n    \"\"\"The force beside the linear structure.\"\"\"\n");
            out.push_str(&format!("    return {}\n", written(&force.expression, style)));
        }
        if let Some(inner) = self.inner_state() {
            out.push_str("\n\ndef joint_rate(X, s):\n    \"\"\"The rate of the force's inner state.\"\"\"\n");
            out.push_str(&format!("    return {}\n", style.switched.rate(inner, style)));
        }
        let u = if inputs { "    u = np.array([row[0] for row in U])\n" } else { "" };
        let mut define = |name: &str, says: &str, (state, input, of_force): (&str, &str, &str), rest: &str| {
            let mut sum = format!("{state} @ X");
            if inputs {
                sum.push_str(&format!(" + {input} @ u"));
            }
            if self.force.is_some() {
                sum.push_str(&format!(" + {of_force} * force(X, s)"));
            }
            if name == "rates" && self.inner_state().is_some() {
                sum.push_str(" + E * joint_rate(X, s)");
            }
            out.push_str(&format!(
                "\n\ndef {name}(t, X, U, s):\n    \"\"\"{says}\"\"\"\n{u}    return ({sum}{rest}).tolist()\n"
            ));
        };
        define(
            "rates",
            "The rate of each state X; U holds each input with two derivatives, s the held signs.",
            ("A", "B", "G"),
            "",
        );
        define("outputs", "What each sensor shows.", ("C", "D", "H"), " + OFFSET");
        out.push_str("\n\n");
        out
    }

    /// Functions of a MATLAB file.
    pub(in super::super) fn matlab(&self, style: &InLanguage<'_>) -> String {
        let inputs = !self.structure.inputs.is_empty();
        let mut out = String::from(
            "function m = matrices()\n    % The state space; ss(m.A, m.B, m.C, m.D) makes a system of it.\n",
        );
        for (name, matrix) in [("A", &self.a), ("B", &self.b), ("C", &self.c), ("D", &self.d)] {
            let text = if matrix.ncols() > 0 { MATLAB.matrix(matrix) } else { format!("zeros({}, 0)", matrix.nrows()) };
            out.push_str(&format!("    m.{name} = {text};\n"));
        }
        let (none_rates, none_outputs) = (vec![0.0; self.a.nrows()], vec![0.0; self.c.nrows()]);
        let (g, h) = self.force.as_ref().map_or((&none_rates, &none_outputs), |f| (&f.on_rates, &f.on_outputs));
        for (name, values) in [("G", g), ("H", h), ("offset", &self.offsets)] {
            out.push_str(&format!("    m.{name} = {};\n", MATLAB.matrix(&column(values))));
        }
        if let Some(inner) = self.on_inner() {
            out.push_str(&format!("    m.E = {};\n", MATLAB.matrix(&column(&inner))));
        }
        out.push_str("end\n\nfunction f = force(X, s) %#ok<INUSD>\n    % The force beside the linear structure.\n");
        let expression = self.force.as_ref().map_or_else(|| "0".to_owned(), |f| written(&f.expression, style));
        out.push_str(&format!("    f = {expression};\nend\n\n"));
        let mut of_rates = "m.G*force(X, s)".to_owned();
        if let Some(inner) = self.inner_state() {
            let rate = style.switched.rate(inner, style);
            out.push_str("function g = joint_rate(X, s) %#ok<INUSD>\n    % The rate of the force's inner state.\n");
            out.push_str(&format!("    g = {rate};\nend\n\n"));
            of_rates.push_str(" + m.E*joint_rate(X, s)");
        }
        let input = |matrix: &str| if inputs { format!(" + m.{matrix}*U(:, 1)") } else { String::new() };
        for (name, says, state, by_input, rest) in [
            (
                "rates",
                "The rate of each state X; U holds each input with two derivatives, s the held signs.",
                "A",
                input("B"),
                of_rates,
            ),
            ("outputs", "What each sensor shows.", "C", input("D"), "m.H*force(X, s) + m.offset".to_owned()),
        ] {
            out.push_str(&format!(
                "function out = {name}(t, X, U, s) %#ok<INUSL>\n    % {says}\n    persistent m\n    \
                 if isempty(m), m = matrices(); end\n    out = m.{state}*X{by_input} + {rest};\nend\n\n"
            ));
        }
        out
    }

    /// Arrays and functions of a C program.
    pub(in super::super) fn c(&self, style: &InLanguage<'_>) -> String {
        let inputs = !self.structure.inputs.is_empty();
        let mut out = String::new();
        for (name, matrix, shape) in [
            ("A", &self.a, "[STATES][STATES]"),
            ("B", &self.b, "[STATES][INPUTS]"),
            ("C", &self.c, "[OUTPUTS][STATES]"),
            ("D", &self.d, "[OUTPUTS][INPUTS]"),
        ] {
            if matrix.ncols() > 0 {
                out.push_str(&format!("static const double {name}{shape} = {};\n", C.matrix(matrix)));
            }
        }
        out.push_str(&format!("static const double offset[OUTPUTS] = {{{}}};\n", numbers(&self.offsets, ", ")));
        if let Some(force) = &self.force {
            out.push_str(&format!("static const double G[STATES] = {{{}}};\n", numbers(&force.on_rates, ", ")));
            out.push_str(&format!("static const double H[OUTPUTS] = {{{}}};\n", numbers(&force.on_outputs, ", ")));
            out.push_str("\n/* The force beside the linear structure. */\nstatic double force(const double *X, const double *s)\n{\n");
            out.push_str(&format!("    (void)X, (void)s;\n    return {};\n}}\n", written(&force.expression, style)));
        }
        let mut at_end = String::new();
        if let Some(inner) = self.inner_state() {
            let rate = style.switched.rate(inner, style);
            out.push_str("\n/* The rate of the force's inner state. */\nstatic double joint_rate(const double *X, const double *s)\n{\n");
            out.push_str(&format!("    (void)X, (void)s;\n    return {rate};\n}}\n"));
            at_end = "    f[STATES - 1] += joint_rate(X, s);\n".into();
        }
        let unused = if inputs { "" } else { " (void)U;" };
        let unheld = if self.force.is_some() { "" } else { " (void)s;" };
        for (says, name, result, count, matrix, feed, of_force, rest) in [
            ("The rates of the states.", "rates", "f", "STATES", "A", "B", "G", "0"),
            ("What each sensor shows.", "outputs", "y", "OUTPUTS", "C", "D", "H", "offset[i]"),
        ] {
            let by_input = if inputs {
                format!("        for (int j = 0; j < INPUTS; j++) {result}[i] += {feed}[i][j] * U[j][0];\n")
            } else {
                String::new()
            };
            let by_force = if self.force.is_some() {
                format!("        {result}[i] += {of_force}[i] * acting;\n")
            } else {
                String::new()
            };
            let at_end = if name == "rates" { at_end.as_str() } else { "" };
            let acting = if self.force.is_some() { "    const double acting = force(X, s);\n" } else { "" };
            out.push_str(&format!(
                "\n/* {says} */\nstatic void {name}(double t, const double *X, double (*U)[3], const double *s, double *{result})\n{{\n{acting}    \
                 (void)t;{unused}{unheld}\n    for (int i = 0; i < {count}; i++) {{\n        {result}[i] = {rest};\n        \
                 for (int j = 0; j < STATES; j++) {result}[i] += {matrix}[i][j] * X[j];\n{by_input}{by_force}    }}\n{at_end}}}\n"
            ));
        }
        out.push('\n');
        out
    }

    /// The body of a Modelica model: matrices, inputs, states and outputs.
    pub(in super::super) fn modelica(
        &self,
        switched: &Switched,
        initial: &[f64],
        [force, joint_rate]: [Option<&str>; 2],
    ) -> String {
        let (n, outputs, inputs) = (self.a.nrows(), self.c.nrows(), self.structure.inputs.len());
        let mut out = String::new();
        for (name, matrix) in [("A", &self.a), ("B", &self.b), ("C", &self.c), ("D", &self.d)] {
            if matrix.ncols() > 0 {
                let (rows, columns) = matrix.shape();
                out.push_str(&format!("    parameter Real {name}[{rows}, {columns}] = {};\n", MODELICA.matrix(matrix)));
            }
        }
        out.push_str(&format!("    parameter Real offset[{outputs}] = {{{}}};\n", numbers(&self.offsets, ", ")));
        let found = self.force.as_ref().zip(force);
        if let Some((found, _)) = found {
            out.push_str(&format!("    parameter Real G[{n}] = {{{}}};\n", numbers(&found.on_rates, ", ")));
            out.push_str(&format!("    parameter Real H[{outputs}] = {{{}}};\n", numbers(&found.on_outputs, ", ")));
            out.push_str("    Real force \"The force beside the linear structure\";\n");
        }
        if let (Some(inner), Some(_)) = (self.on_inner(), joint_rate) {
            out.push_str(&format!("    parameter Real E[{n}] = {{{}}};\n", numbers(&inner, ", ")));
            out.push_str("    Real joint_rate \"The rate of the force's inner state\";\n");
        }
        let names: Vec<String> =
            (0..inputs).map(|j| switched.layout.name(sindyscope_values::term::Symbol::Input(j))).collect();
        out.extend(names.iter().map(|name| format!("    input Real {name};\n")));
        out.push_str(&format!(
            "    Real X[{n}](start = {{{}}}, each fixed = true) \"Modal displacements and their rates\";\n",
            numbers(initial, ", ")
        ));
        out.push_str(&format!("    output Real Y[{outputs}] \"What the sensors show\";\n  equation\n"));
        let feed =
            |matrix: &str| if inputs > 0 { format!(" + {matrix}*{{{}}}", names.join(", ")) } else { String::new() };
        let by_force = |vector: &str| if found.is_some() { format!(" + {vector}*force") } else { String::new() };
        if let Some((_, force)) = found {
            out.push_str(&format!("    force = {force};\n"));
        }
        let mut inner = "";
        if let Some(rate) = joint_rate {
            out.push_str(&format!("    joint_rate = {rate};\n"));
            inner = " + E*joint_rate";
        }
        out.push_str(&format!("    der(X) = A*X{}{}{inner};\n", feed("B"), by_force("G")));
        out.push_str(&format!("    Y = C*X{}{} + offset;\n", feed("D"), by_force("H")));
        out
    }

    /// The rate of the force's inner state in Modelica's words, where it has one.
    pub(in super::super) fn joint_rate(&self, switched: &Switched, style: &impl Style) -> Option<String> {
        self.inner_state().map(|inner| switched.rate(inner, style))
    }

    /// The force in Modelica's words.
    pub(in super::super) fn force_expression(&self) -> Option<&sindyscope_values::term::Expression> {
        self.force.as_ref().map(|f| &f.expression)
    }
}
