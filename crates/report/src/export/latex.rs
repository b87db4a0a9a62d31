//! The model as a small LaTeX document.

use super::switched::{Switched, literal};
use super::{Export, FormatEntry};
use sindyscope_values::format::equations;
use sindyscope_values::term::{Expression, Layout, Symbol, Term, latex_number};

pub(super) const FORMAT: FormatEntry = FormatEntry {
    ending: "tex",
    name: "LaTeX",
    runs: false,
    switches: true,
    write: |export, switched, _| document(export, switched),
};

/// The equations in a display, every coefficient in a table, the initial states.
fn document(export: &Export<'_>, switched: &Switched) -> String {
    if let Some(space) = export.space {
        return space.latex_document(switched);
    }
    let model = export.model;
    let layout = &model.layout;
    let mut out = String::from(
        "\\documentclass{article}\n\\usepackage[T1]{fontenc}\n\\usepackage[utf8]{inputenc}\n\\usepackage{amsmath}\n\
         \\begin{document}\n\n% Equations of motion identified by Sindyscope; pdflatex makes a page of this file.\n",
    );
    out.push_str("\\begin{equation*}\n");
    out.push_str(&equations::latex(model));
    out.push_str("\\end{equation*}\n\n");
    let quantities = layout.state_symbols().chain((0..layout.inputs).map(Symbol::Input));
    let units: Vec<String> = quantities
        .map(|s| {
            let unit = export.units.of_symbol(s).map_or_else(|| "unit not known".into(), |u| unit(&u));
            format!("${}$: {unit}", symbol(s, layout))
        })
        .collect();
    out.push_str(&format!("\\noindent Units: $t$: {}; {}.\n\n", unit("s"), units.join("; ")));
    let sliding: Vec<String> = switched
        .surfaces
        .iter()
        .filter(|s| s.slides)
        .map(|s| format!("$\\operatorname{{sgn}}\\left({}\\right)$", math(&s.expression, layout)))
        .collect();
    if !sliding.is_empty() {
        out.push_str(&format!(
            "\\noindent Where its argument stays at zero, {} takes the value that keeps it there, up to a magnitude of \
             ${}$.\n\n",
            sliding.join(", "),
            latex_number(&literal(switched.hold))
        ));
    }
    out.push_str(
        "\\begin{center}\n\\begin{tabular}{llrrl}\nrate & term & coefficient & standard error & unit \\\\ \\hline\n",
    );
    for (state, equation) in model.iter() {
        for t in &equation.terms {
            let number = |x: f64| format!("${}$", latex_number(&literal(x)));
            out.push_str(&format!(
                "$\\mathrm{{d}} {}/\\mathrm{{d}} t$ & ${}$ & {} & {} & {} \\\\\n",
                symbol(state, layout),
                t.term.latex(layout),
                number(t.coefficient),
                t.std_error.filter(|e| e.is_finite()).map_or_else(|| "--".into(), number),
                export.units.coefficient(state, &t.term).map_or_else(|| "--".into(), |u| unit(&u)),
            ));
        }
    }
    out.push_str("\\end{tabular}\n\\end{center}\n\n");
    for start in &export.starts {
        let state: Vec<String> = layout
            .state_symbols()
            .zip(&start.state)
            .map(|(s, x)| format!("${} = {}$", symbol(s, layout), latex_number(&literal(*x))))
            .collect();
        out.push_str(&format!("\\noindent Initial state of {}: {}.\n\n", escaped(&start.record), state.join(", ")));
    }
    out.push_str("\\end{document}\n");
    out
}

fn symbol(symbol: Symbol, layout: &Layout) -> String {
    math(&Expression::Symbol(symbol), layout)
}

fn math(e: &Expression, layout: &Layout) -> String {
    Term::new(e.clone()).latex(layout)
}

/// A text as LaTeX prints it.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '{' | '}' | '$' | '&' | '#' | '_' | '%' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// A unit as upright mathematics: `m/s^2` with its power raised.
pub(super) fn unit(text: &str) -> String {
    let mut out = String::from("$\\mathrm{");
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        match c {
            '^' => {
                let mut power = String::new();
                while let Some(digit) = rest.next_if(|d| d.is_ascii_digit() || matches!(d, '-' | '.')) {
                    power.push(digit);
                }
                out.push_str(&format!("^{{{power}}}"));
            }
            ' ' => out.push_str("\\,"),
            '*' | '·' => out.push_str("\\cdot "),
            'µ' | 'μ' => out.push_str("\\mu "),
            'Ω' => out.push_str("\\Omega "),
            '°' => out.push_str("^{\\circ}"),
            '²' => out.push_str("^{2}"),
            '³' => out.push_str("^{3}"),
            c if c.is_ascii_alphanumeric() || matches!(c, '/' | '(' | ')' | '.' | '-') => out.push(c),
            c => out.push_str(&format!("\\text{{{}}}", escaped(&c.to_string()))),
        }
    }
    out.push_str("}$");
    out
}

#[cfg(test)]
mod tests {
    use super::{escaped, unit};

    #[test]
    fn what_latex_reads_otherwise_is_escaped() {
        assert_eq!(escaped("run_1 50% #2 a&b {c} $d$"), "run\\_1 50\\% \\#2 a\\&b \\{c\\} \\$d\\$");
        assert_eq!(escaped("a\\b~c^d"), "a\\textbackslash{}b\\textasciitilde{}c\\textasciicircum{}d");
    }

    #[test]
    fn units_stand_upright_with_raised_powers() {
        assert_eq!(unit("m/s^2"), "$\\mathrm{m/s^{2}}$");
        assert_eq!(unit("1/(m^2 s^2)"), "$\\mathrm{1/(m^{2}\\,s^{2})}$");
        assert_eq!(unit("µm^-0.5"), "$\\mathrm{\\mu m^{-0.5}}$");
        assert_eq!(unit("%"), "$\\mathrm{\\text{\\%}}$");
    }
}
