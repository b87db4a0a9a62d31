//! The content as one web page that needs nothing beside itself.

use std::fmt::Write;

use super::content::{Block, Cell, DocumentTable};
use super::math::EquationRows;
use super::style;
use crate::canvas::{Coordinate, escape};
use crate::figure::svg::WIDTH;
use sindyscope_core::study::Severity;

/// The whole page.
pub(super) fn document(title: &str, blocks: &[Block]) -> String {
    let mut out = String::new();
    let _ = write!(
        out,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" content=\"Sindyscope {}\">\n\
         <title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n",
        env!("CARGO_PKG_VERSION"),
        escape(title),
        style::web()
    );
    let mut figures = 0;
    for block in blocks {
        match block {
            Block::Title { title, subtitle } => {
                let _ = writeln!(out, "<h1>{}</h1>\n<p class=\"subtitle\">{}</p>", escape(title), escape(subtitle));
            }
            Block::Tiles(tiles) => {
                out.push_str("<dl class=\"tiles\">\n");
                for tile in tiles {
                    let _ = writeln!(
                        out,
                        "<div><dt>{}</dt><dd>{}</dd><dd class=\"unit\">{}</dd></div>",
                        tile.label,
                        escape(&tile.value),
                        escape(&tile.note)
                    );
                }
                out.push_str("</dl>\n");
            }
            Block::Warnings(warnings) => {
                out.push_str("<ul class=\"warnings\">\n");
                for (severity, text) in warnings {
                    let (class, word) = flag(*severity);
                    let _ = writeln!(out, "<li class=\"{class}\"><b>{word}</b> {}</li>", escape(text));
                }
                out.push_str("</ul>\n");
            }
            Block::Heading(text) => {
                let _ = writeln!(out, "<h2>{}</h2>", escape(text));
            }
            Block::Subheading(text) => {
                let _ = writeln!(out, "<h3>{}</h3>", escape(text));
            }
            Block::Paragraph(text) => {
                let _ = writeln!(out, "<p>{}</p>", escape(text));
            }
            Block::Equations(equations) => write_equations(&mut out, equations),
            Block::Table(table) => write_table(&mut out, table),
            Block::Figure(figure) => {
                figures += 1;
                // Two narrow ones have room beside each other.
                let class = if figure.size.0 < 0.5 * WIDTH { " class=\"half\"" } else { "" };
                let _ = writeln!(
                    out,
                    "<figure{class}>\n<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"Figure {figures}\">\n{}</svg>\n\
                     <figcaption><b>Figure {figures}.</b> {}</figcaption>\n</figure>",
                    Coordinate(figure.size.0),
                    Coordinate(figure.size.1),
                    figure.svg.numbered(figures),
                    escape(&figure.caption)
                );
            }
            Block::Command(command) => {
                let _ = writeln!(out, "<p>The same again:</p>\n<pre>{}</pre>", escape(command));
            }
        }
    }
    let _ = write!(out, "<footer>Made with Sindyscope {}.</footer>\n</body>\n</html>\n", env!("CARGO_PKG_VERSION"));
    out
}

/// Class and word of a warning.
pub(super) fn flag(severity: Severity) -> (&'static str, &'static str) {
    match severity {
        Severity::Note => ("note", "Note."),
        Severity::Caution => ("caution", "Caution."),
        Severity::Wrong => ("wrong", "Wrong."),
    }
}

fn write_equations(out: &mut String, equations: &[EquationRows]) {
    out.push_str("<div class=\"equation\"><math display=\"block\"><mtable>\n");
    for equation in equations {
        for (k, right) in equation.right.iter().enumerate() {
            let left = if k == 0 { equation.left.mathml() } else { String::new() };
            let _ = writeln!(out, "<mtr><mtd>{left}</mtd><mtd>{}</mtd></mtr>", right.mathml());
        }
    }
    out.push_str("</mtable></math></div>\n");
}

fn write_table(out: &mut String, table: &DocumentTable) {
    out.push_str("<div class=\"scroll\"><table>\n");
    if !table.head.is_empty() {
        let cells: String = table.head.iter().map(|h| format!("<th scope=\"col\">{h}</th>")).collect();
        let _ = writeln!(out, "<thead><tr>{cells}</tr></thead>");
    }
    out.push_str("<tbody>\n");
    for row in &table.rows {
        out.push_str("<tr>");
        for cell in row {
            let _ = match cell {
                Cell::Text(text) => write!(out, "<td>{}</td>", escape(text)),
                Cell::Number(text) => write!(out, "<td class=\"number\">{}</td>", escape(text)),
                Cell::Formula(math) => write!(out, "<td><math>{}</math></td>", math.mathml()),
                Cell::Share(share) => write!(
                    out,
                    "<td class=\"share\"><span class=\"bar\" style=\"width:{:.2}em\"></span>{:.1} %</td>",
                    6.0 * share.clamp(0.0, 1.0),
                    100.0 * share
                ),
            };
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
}
