//! The content as one tall page, drawn as SVG with the window's fonts.

use std::fmt::Write;

use super::content::{Block, Cell, Table};
use super::figures;
use super::font::{Face, Fonts};
use super::html::flag;
use super::math::EquationRows;
use super::style;
use super::svg::{Anchor, Place, Svg};

/// Pixels of the picture for each point of the page: fit for print.
pub(super) const SCALE: f32 = 2.0;

const MARGIN: f64 = 44.0;
const WIDTH: f64 = figures::WIDTH + 2.0 * MARGIN;
const BODY: f64 = 12.0;
const MONO: f64 = 10.5;
const QUIET: f64 = 11.0;
const LINE: f64 = 17.0;
const EQUATION: f64 = 17.0;
/// Size of formulas in tables.
const FORMULA: f64 = 13.0;
/// Length of the bar of a term that is the whole rate.
const BAR: f64 = 80.0;

/// The whole page.
pub(super) fn document(blocks: &[Block], fonts: &Fonts) -> String {
    let mut page = Page { fonts, svg: Svg::default(), y: MARGIN, figures: 0 };
    for block in blocks {
        page.block(block);
    }
    page.y += 22.0;
    let made = format!("Made with Sindyscope {}.", env!("CARGO_PKG_VERSION"));
    page.svg.text("quiet", (MARGIN, page.y), Anchor::Start, &made);
    let height = page.y + MARGIN;
    let mut out = String::new();
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">\n<style>\n{2}</style>\n\
         <rect class=\"ground\" width=\"{0}\" height=\"{1}\"/>\n{3}</svg>\n",
        Place(WIDTH),
        Place(height.ceil()),
        style::picture(),
        page.svg.0
    );
    out
}

struct Page<'a> {
    fonts: &'a Fonts,
    svg: Svg,
    /// Lower edge of what is drawn.
    y: f64,
    figures: usize,
}

impl Page<'_> {
    fn block(&mut self, block: &Block) {
        match block {
            Block::Title { title, subtitle } => {
                for line in self.fonts.lines(title, 24.0, Face::Text, figures::WIDTH) {
                    self.y += 26.0;
                    self.svg.text("title", (MARGIN, self.y), Anchor::Start, &line);
                }
                self.y += 4.0;
                self.text("quiet", subtitle, QUIET, 0.0);
            }
            Block::Tiles(tiles) => {
                let step = figures::WIDTH / tiles.len().max(1) as f64;
                for (k, tile) in tiles.iter().enumerate() {
                    let x = MARGIN + k as f64 * step.min(220.0);
                    self.svg.text("quiet", (x, self.y + 28.0), Anchor::Start, tile.label);
                    self.svg.text("value", (x, self.y + 50.0), Anchor::Start, &tile.value);
                    self.svg.text("quiet", (x, self.y + 67.0), Anchor::Start, &tile.note);
                }
                self.y += 76.0;
            }
            Block::Warnings(warnings) => {
                self.y += 4.0;
                for (severity, text) in warnings {
                    let (class, word) = flag(*severity);
                    self.svg.text(&format!("flag {class}"), (MARGIN, self.y + LINE), Anchor::Start, word);
                    self.text("body", text, BODY, 62.0);
                }
            }
            Block::Heading(text) => {
                self.y += 36.0;
                self.svg.text("heading", (MARGIN, self.y), Anchor::Start, text);
                self.y += 7.0;
                self.svg.line("row", (MARGIN, self.y), (MARGIN + figures::WIDTH, self.y));
                self.y += 5.0;
            }
            Block::Subheading(text) => {
                self.y += 12.0;
                for line in self.fonts.lines(text, 13.0, Face::Text, figures::WIDTH) {
                    self.y += LINE;
                    self.svg.text("subheading", (MARGIN, self.y), Anchor::Start, &line);
                }
                self.y += 2.0;
            }
            Block::Paragraph(text) => {
                self.text("body", text, BODY, 0.0);
                self.y += 3.0;
            }
            Block::Equations(equations) => self.equations(equations),
            Block::Table(table) => self.table(table),
            Block::Figure(figure) => {
                self.y += 10.0;
                self.svg.place((MARGIN, self.y), &figure.drawing);
                self.y += figure.size.1;
                self.figures += 1;
                self.text("quiet", &format!("Figure {}. {}", self.figures, figure.caption), QUIET, 0.0);
                self.y += 8.0;
            }
            Block::Command(command) => {
                self.text("body", "The same again:", BODY, 0.0);
                for line in self.fonts.lines(command, MONO, Face::Mono, figures::WIDTH) {
                    self.y += LINE - 2.0;
                    self.svg.text("mono", (MARGIN, self.y), Anchor::Start, &line);
                }
            }
        }
    }

    /// A paragraph, moved in by `indent`.
    fn text(&mut self, class: &str, text: &str, size: f64, indent: f64) {
        for line in self.fonts.lines(text, size, Face::Text, figures::WIDTH - indent) {
            self.y += LINE;
            self.svg.text(class, (MARGIN + indent, self.y), Anchor::Start, &line);
        }
    }

    fn equations(&mut self, equations: &[EquationRows]) {
        let left: Vec<_> = equations.iter().map(|e| e.left.layout(self.fonts, EQUATION)).collect();
        let room = left.iter().map(|l| l.width).fold(0.0, f64::max);
        self.y += 8.0;
        for (equation, left) in equations.iter().zip(&left) {
            for (k, right) in equation.right.iter().enumerate() {
                let natural = right.layout(self.fonts, EQUATION);
                let free = figures::WIDTH - 12.0 - room;
                let right = if natural.width > free {
                    right.layout(self.fonts, EQUATION * free / natural.width)
                } else {
                    natural
                };
                let ascent = if k == 0 { right.ascent.max(left.ascent) } else { right.ascent };
                let descent = if k == 0 { right.descent.max(left.descent) } else { right.descent };
                self.y += ascent + 5.0;
                if k == 0 {
                    left.draw(&mut self.svg, (MARGIN + 12.0 + room - left.width, self.y));
                }
                right.draw(&mut self.svg, (MARGIN + 12.0 + room, self.y));
                self.y += descent + 5.0;
            }
        }
        self.y += 6.0;
    }

    fn table(&mut self, table: &Table) {
        const PAD: f64 = 16.0;
        let columns = table.rows.iter().map(Vec::len).chain([table.head.len()]).max().unwrap_or(0);
        let natural = |column: usize| {
            let head = table.head.get(column).map_or(0.0, |h| self.fonts.width(h, 11.5, Face::Text));
            table.rows.iter().filter_map(|r| r.get(column)).map(|c| self.width(c)).fold(head, f64::max)
        };
        let mut widths: Vec<f64> = (0..columns).map(natural).collect();
        // The last column gives way: its text is broken.
        let others: f64 = widths.iter().take(columns.saturating_sub(1)).map(|w| w + PAD).sum();
        let last_room = (figures::WIDTH - others).max(80.0);
        if let Some(last) = widths.last_mut() {
            *last = last.min(last_room);
        }
        let starts: Vec<f64> = widths
            .iter()
            .scan(MARGIN, |x, w| {
                let start = *x;
                *x += w + PAD;
                Some(start)
            })
            .collect();
        let right = starts.last().zip(widths.last()).map_or(MARGIN, |(s, w)| s + w);
        self.y += 6.0;
        if !table.head.is_empty() {
            self.y += LINE - 3.0;
            for (head, x) in table.head.iter().zip(&starts) {
                self.svg.text("head", (*x, self.y), Anchor::Start, head);
            }
            self.y += 5.0;
            self.svg.line("headrow", (MARGIN, self.y), (right, self.y));
        }
        for row in &table.rows {
            let (ascent, descent) = row
                .iter()
                .filter_map(|c| match c {
                    Cell::Formula(math) => Some(math.layout(self.fonts, FORMULA)),
                    _ => None,
                })
                .fold((LINE - 5.0, 5.0), |(a, d), laid| {
                    (f64::max(a, laid.ascent + 1.0), f64::max(d, laid.descent + 3.0))
                });
            let mut lower = self.y;
            for (column, (cell, x)) in row.iter().zip(&starts).enumerate() {
                let base = self.y + 3.0 + ascent;
                lower = lower.max(match cell {
                    Cell::Text(text) if column + 1 == columns => {
                        let lines = self.fonts.lines(text, BODY, Face::Text, last_room);
                        for (k, line) in lines.iter().enumerate() {
                            self.svg.text("body", (*x, base + k as f64 * LINE), Anchor::Start, line);
                        }
                        base + lines.len().saturating_sub(1) as f64 * LINE
                    }
                    Cell::Text(text) => {
                        self.svg.text("body", (*x, base), Anchor::Start, text);
                        base
                    }
                    Cell::Number(text) => {
                        self.svg.text("mono", (*x, base), Anchor::Start, text);
                        base
                    }
                    Cell::Formula(math) => {
                        math.layout(self.fonts, FORMULA).draw(&mut self.svg, (*x, base));
                        base
                    }
                    Cell::Share(share) => {
                        self.svg.rect("bar", (*x, base - 8.0), (BAR * share.clamp(0.0, 1.0), 8.0));
                        let text = format!("{:.1} %", 100.0 * share);
                        self.svg.text("body", (x + BAR * share.clamp(0.0, 1.0) + 6.0, base), Anchor::Start, &text);
                        base
                    }
                });
            }
            self.y = lower + descent;
            self.svg.line("row", (MARGIN, self.y), (right, self.y));
        }
        self.y += 6.0;
    }

    fn width(&self, cell: &Cell) -> f64 {
        match cell {
            Cell::Text(text) => self.fonts.width(text, BODY, Face::Text),
            Cell::Number(text) => self.fonts.width(text, MONO, Face::Mono),
            Cell::Formula(math) => math.layout(self.fonts, FORMULA).width,
            Cell::Share(_) => BAR + 50.0,
        }
    }
}
