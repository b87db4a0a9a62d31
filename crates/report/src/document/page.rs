//! The content drawn as SVG with the window's fonts: on one tall sheet, or on pages of paper.

use std::fmt::Write;

use super::arrangement::Paper;
use super::content::{Block, Cell, DocumentTable};
use super::font::{Face, Fonts};
use super::html::flag;
use super::math::EquationRows;
use super::style;
use crate::canvas::{Anchor, Coordinate, Svg};
use crate::figure::svg::{Drawing, GUTTER, WIDTH as TEXT};

/// Pixels of the picture for each point of the sheet: fit for print.
pub(super) const SCALE: f32 = 2.0;

const MARGIN: f64 = 44.0;
/// Width of a sheet.
const WIDTH: f64 = TEXT + 2.0 * MARGIN;
const BODY: f64 = 12.0;
const MONO: f64 = 10.5;
const QUIET: f64 = 11.0;
const LINE: f64 = 17.0;
const EQUATION: f64 = 17.0;
/// Size of formulas in tables.
const FORMULA: f64 = 13.0;
/// Length of the bar of a term that is the whole rate.
const BAR: f64 = 80.0;
/// Room between the columns of a table.
const PAD: f64 = 16.0;
/// Height of a table's head.
const HEAD: f64 = LINE + 2.0;
/// Height of the line at the foot of a page.
const FOOT: f64 = 24.0;

/// One tall sheet.
pub(super) fn sheet(blocks: &[Block], fonts: &Fonts) -> String {
    let mut flow = Flow::new(fonts, f64::INFINITY);
    flow.blocks(blocks);
    flow.y += 22.0;
    flow.svg.text("quiet", (MARGIN, flow.y), Anchor::Start, &made());
    let height = (flow.y + MARGIN).ceil();
    document(&flow.svg, (WIDTH, height), &format!("width=\"{}\" height=\"{}\"", Coordinate(WIDTH), Coordinate(height)))
}

/// Pages of paper, the title and their number at the foot of each.
pub(super) fn pages(blocks: &[Block], fonts: &Fonts, paper: Paper, title: &str) -> Vec<String> {
    let (width, height) = paper.size();
    let length = WIDTH * height / width;
    let mut flow = Flow::new(fonts, length - MARGIN - FOOT);
    flow.blocks(blocks);
    let mut pages = flow.done;
    pages.push(flow.svg);
    let count = pages.len();
    let title = fonts.lines(title, QUIET, Face::Text, 0.6 * TEXT).into_iter().next().unwrap_or_default();
    let finish = |(k, mut page): (usize, Svg)| {
        let base = length - MARGIN;
        let left = if k == 0 { made() } else { title.clone() };
        page.text("quiet", (MARGIN, base), Anchor::Start, &left);
        page.text("quiet", (WIDTH - MARGIN, base), Anchor::End, &format!("{} / {count}", k + 1));
        document(&page, (WIDTH, length), &format!("width=\"{width}mm\" height=\"{height}mm\""))
    };
    pages.into_iter().enumerate().map(finish).collect()
}

fn made() -> String {
    format!("Made with Sindyscope {}", env!("CARGO_PKG_VERSION"))
}

/// A drawing of these points as an SVG document of this size.
fn document(drawing: &Svg, (width, height): (f64, f64), size: &str) -> String {
    let mut out = String::new();
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" {size} viewBox=\"0 0 {0} {1}\">\n<style>\n{2}</style>\n\
         <rect class=\"ground\" width=\"{0}\" height=\"{1}\"/>\n{3}</svg>\n",
        Coordinate(width),
        Coordinate(height),
        style::picture(),
        drawing.0
    );
    out
}

/// Blocks laid below each other, page after page.
struct Flow<'a> {
    fonts: &'a Fonts,
    /// The pages that are full.
    done: Vec<Svg>,
    svg: Svg,
    /// Lower edge of what is drawn.
    y: f64,
    /// Lower edge of a page's text.
    bottom: f64,
    figures: usize,
}

impl<'a> Flow<'a> {
    fn new(fonts: &'a Fonts, bottom: f64) -> Self {
        Self { fonts, done: Vec::new(), svg: Svg::default(), y: MARGIN, bottom, figures: 0 }
    }

    /// Begins a new page where what follows has no room on this one.
    fn need(&mut self, height: f64) {
        if self.y + height > self.bottom && self.y > MARGIN {
            self.done.push(std::mem::take(&mut self.svg));
            self.y = MARGIN;
        }
    }

    fn blocks(&mut self, blocks: &[Block]) {
        let mut rest = blocks;
        while let Some((first, others)) = rest.split_first() {
            self.need(self.together(rest));
            rest = others;
            // Narrow figures stand beside each other.
            if let (Block::Figure(left), Some((Block::Figure(right), others))) = (first, others.split_first())
                && left.size.0 + GUTTER + right.size.0 <= TEXT + 1e-6
            {
                self.row(&[left, right]);
                rest = others;
                continue;
            }
            self.block(first);
        }
    }

    /// Height of what begins here and is not to be parted: a heading stays with what it stands above.
    fn together(&self, blocks: &[Block]) -> f64 {
        let Some((first, rest)) = blocks.split_first() else { return 0.0 };
        match first {
            Block::Heading(_) => 48.0 + self.together(rest),
            Block::Subheading(_) => 34.0 + self.together(rest),
            Block::Figure(figure) => {
                let beside = match rest.first() {
                    Some(Block::Figure(right)) if figure.size.0 + GUTTER + right.size.0 <= TEXT + 1e-6 => {
                        self.height(right)
                    }
                    _ => 0.0,
                };
                self.height(figure).max(beside)
            }
            Block::Tiles(_) => 76.0,
            Block::Equations(_) => 2.0 * LINE + 20.0,
            Block::Table(table) => HEAD + LINE * table.rows.len().min(2) as f64 + 12.0,
            Block::Title { .. } => 60.0,
            Block::Paragraph(text) if text.ends_with(':') => LINE + 3.0 + self.together(rest),
            Block::Warnings(_) | Block::Paragraph(_) | Block::Command(_) => 2.0 * LINE,
        }
    }

    /// Height of a figure with its caption.
    fn height(&self, figure: &Drawing) -> f64 {
        let lines = self.fonts.lines(&figure.caption, QUIET, Face::Text, figure.size.0 - 20.0).len() + 1;
        10.0 + figure.size.1 + LINE * lines as f64
    }

    /// Figures beside each other, each with its caption.
    fn row(&mut self, figures: &[&Drawing]) {
        self.y += 10.0;
        let (top, mut left, mut lower) = (self.y, MARGIN, self.y);
        for figure in figures {
            self.figures += 1;
            self.svg.place((left, top), &figure.svg, self.figures);
            let caption = format!("Figure {}. {}", self.figures, figure.caption);
            let mut base = top + figure.size.1;
            for line in self.fonts.lines(&caption, QUIET, Face::Text, figure.size.0) {
                base += LINE;
                self.svg.text("quiet", (left, base), Anchor::Start, &line);
            }
            lower = lower.max(base);
            left += figure.size.0 + GUTTER;
        }
        self.y = lower + 8.0;
    }

    fn block(&mut self, block: &Block) {
        match block {
            Block::Title { title, subtitle } => {
                for line in self.fonts.lines(title, 24.0, Face::Text, TEXT) {
                    self.y += 26.0;
                    self.svg.text("title", (MARGIN, self.y), Anchor::Start, &line);
                }
                self.y += 4.0;
                self.text("quiet", subtitle, QUIET, 0.0);
            }
            Block::Tiles(tiles) => {
                let step = TEXT / tiles.len().max(1) as f64;
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
                    self.need(LINE);
                    self.svg.text(&format!("flag {class}"), (MARGIN, self.y + LINE), Anchor::Start, word);
                    self.text("body", text, BODY, 62.0);
                }
            }
            Block::Heading(text) => {
                self.y += if self.y > MARGIN { 36.0 } else { LINE };
                for line in self.fonts.lines(text, 15.0, Face::Text, TEXT) {
                    self.svg.text("heading", (MARGIN, self.y), Anchor::Start, &line);
                    self.y += 19.0;
                }
                self.y -= 12.0;
                self.svg.line("row", (MARGIN, self.y), (MARGIN + TEXT, self.y));
                self.y += 5.0;
            }
            Block::Subheading(text) => {
                self.y += 12.0;
                for line in self.fonts.lines(text, 13.0, Face::Text, TEXT) {
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
            Block::Figure(figure) => self.row(&[figure]),
            Block::Command(command) => {
                self.text("body", "The same again:", BODY, 0.0);
                for line in self.fonts.lines(command, MONO, Face::Mono, TEXT) {
                    self.need(LINE);
                    self.y += LINE - 2.0;
                    self.svg.text("mono", (MARGIN, self.y), Anchor::Start, &line);
                }
            }
        }
    }

    /// A paragraph, moved in by `indent`.
    fn text(&mut self, class: &str, text: &str, size: f64, indent: f64) {
        for line in self.fonts.lines(text, size, Face::Text, TEXT - indent) {
            self.need(LINE);
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
                let free = TEXT - 12.0 - room;
                let right = if natural.width > free {
                    right.layout(self.fonts, EQUATION * free / natural.width)
                } else {
                    natural
                };
                let ascent = if k == 0 { right.ascent.max(left.ascent) } else { right.ascent };
                let descent = if k == 0 { right.descent.max(left.descent) } else { right.descent };
                self.need(ascent + descent + 10.0);
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

    fn table(&mut self, table: &DocumentTable) {
        let columns = self.columns(table);
        self.y += 6.0;
        self.head(table, &columns);
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
            let lines = columns.iter().zip(row).map(|(column, cell)| self.cell_lines(cell, column).len()).max();
            let more = LINE * lines.unwrap_or(1).saturating_sub(1) as f64;
            let before = self.done.len();
            self.need(3.0 + ascent + more + descent);
            if self.done.len() > before {
                self.head(table, &columns);
            }
            let base = self.y + 3.0 + ascent;
            for (column, cell) in columns.iter().zip(row) {
                self.cell(cell, column, base);
            }
            self.y = base + more + descent;
            let right = columns.last().map_or(MARGIN, |c| c.start + c.width);
            self.svg.line("row", (MARGIN, self.y), (right, self.y));
        }
        self.y += 6.0;
    }

    /// Where the columns of a table stand. Those of text give way where all together are too wide: their text is broken.
    fn columns(&self, table: &DocumentTable) -> Vec<PageColumn> {
        let count = table.rows.iter().map(Vec::len).chain([table.head.len()]).max().unwrap_or(0);
        let cells = |column: usize| table.rows.iter().filter_map(move |r| r.get(column));
        let head = |column: usize| table.head.get(column).map_or(0.0, |h| self.fonts.width(h, 11.5, Face::Text));
        let mut widths: Vec<f64> =
            (0..count).map(|k| cells(k).map(|c| self.width(c)).fold(head(k), f64::max)).collect();
        let bends = |k: usize| cells(k).all(|c| matches!(c, Cell::Text(_)));
        let free = TEXT - PAD * count.saturating_sub(1) as f64;
        let stiff: f64 = (0..count).filter(|k| !bends(*k)).map(|k| widths[k]).sum();
        // What is narrower than its share keeps its width; the others divide the rest.
        let mut open: Vec<usize> = (0..count).filter(|k| bends(*k)).collect();
        let mut room = (free - stiff).max(0.0);
        while !open.is_empty() {
            let share = room / open.len() as f64;
            let (narrow, wide): (Vec<usize>, Vec<usize>) = open.iter().partition(|k| widths[**k] <= share);
            if narrow.is_empty() {
                for k in wide {
                    widths[k] = share.max(LEAST_COLUMN).max(head(k));
                }
                break;
            }
            room -= narrow.iter().map(|k| widths[*k]).sum::<f64>();
            open = wide;
        }
        let mut start = MARGIN;
        let place = |width: f64| {
            let column = PageColumn { start, width };
            start += width + PAD;
            column
        };
        widths.into_iter().map(place).collect()
    }

    fn head(&mut self, table: &DocumentTable, columns: &[PageColumn]) {
        if table.head.is_empty() {
            return;
        }
        self.y += LINE - 3.0;
        for (head, column) in table.head.iter().zip(columns) {
            self.svg.text("head", (column.start, self.y), Anchor::Start, head);
        }
        self.y += 5.0;
        let right = columns.last().map_or(MARGIN, |c| c.start + c.width);
        self.svg.line("headrow", (MARGIN, self.y), (right, self.y));
    }

    /// The lines of a cell of text; of any other, one.
    fn cell_lines(&self, cell: &Cell, column: &PageColumn) -> Vec<String> {
        match cell {
            Cell::Text(text) => self.fonts.lines(text, BODY, Face::Text, column.width + 0.01),
            _ => vec![String::new()],
        }
    }

    fn cell(&mut self, cell: &Cell, column: &PageColumn, base: f64) {
        let x = column.start;
        match cell {
            Cell::Text(_) => {
                for (k, line) in self.cell_lines(cell, column).iter().enumerate() {
                    self.svg.text("body", (x, base + k as f64 * LINE), Anchor::Start, line);
                }
            }
            Cell::Number(text) => self.svg.text("mono", (x, base), Anchor::Start, text),
            Cell::Formula(math) => math.layout(self.fonts, FORMULA).draw(&mut self.svg, (x, base)),
            Cell::Share(share) => {
                let length = BAR * share.clamp(0.0, 1.0);
                self.svg.rect("bar", (x, base - 8.0), (length, 8.0));
                let text = format!("{:.1} %", 100.0 * share);
                self.svg.text("body", (x + length + 6.0, base), Anchor::Start, &text);
            }
        }
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

/// Least width of a column of text.
const LEAST_COLUMN: f64 = 60.0;

/// Where a column of a table stands.
struct PageColumn {
    start: f64,
    width: f64,
}
