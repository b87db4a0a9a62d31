//! Rectangles over two quantities, each coloured by a value.

use crate::palette::{diverging, shade};

/// Rectangles that are coloured by their values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Edges along the abscissa, ascending coordinates.
    pub columns: Vec<f64>,
    /// Edges along the ordinate, ascending coordinates.
    pub rows: Vec<f64>,
    /// Value of each, row by row, the lowest first; one that is not finite is not drawn.
    pub values: Vec<f64>,
    /// Which of them are drawn grey, since chance might have made them; empty: none.
    pub unsure: Vec<bool>,
    /// What is said of each at the pointer beside its value; empty: nothing.
    pub remarks: Vec<String>,
    /// How values are coloured.
    pub colours: Colours,
    /// What the values are.
    pub name: String,
    /// Their unit.
    pub unit: String,
}

/// How values are coloured.
#[derive(Clone, Debug, PartialEq)]
pub enum Colours {
    /// Blue for negative, orange for positive values, up to this magnitude.
    Diverging(f64),
    /// From dark to bright: what the ends of the scale and places between them say, as shares of its length.
    Shades(Vec<(f64, String)>),
}

impl Default for Colours {
    fn default() -> Self {
        Self::Diverging(1.0)
    }
}

impl Cells {
    /// Each cell that is drawn: its place among the values, its lower left and its upper right corner.
    pub fn drawn(&self) -> impl Iterator<Item = (usize, [f64; 2], [f64; 2])> {
        let columns = self.columns.len().saturating_sub(1).max(1);
        let finite = self.values.iter().enumerate().filter(|(_, v)| v.is_finite());
        finite.filter_map(move |(k, _)| {
            let (column, row) = (k % columns, k / columns);
            let low = [*self.columns.get(column)?, *self.rows.get(row)?];
            Some((k, low, [*self.columns.get(column + 1)?, *self.rows.get(row + 1)?]))
        })
    }

    /// The cell at a place, whether or not it is drawn.
    pub fn at(&self, x: f64, y: f64) -> Option<usize> {
        let within = |edges: &[f64], v: f64| edges.windows(2).position(|e| e[0] <= v && v <= e[1]);
        let columns = self.columns.len().saturating_sub(1).max(1);
        Some(within(&self.rows, y)? * columns + within(&self.columns, x)?)
    }

    /// True if chance might have made a cell's value.
    pub fn is_unsure(&self, cell: usize) -> bool {
        self.unsure.get(cell).copied().unwrap_or(false)
    }

    /// Where a cell's value lies on the scale of colours, 0 to 1.
    pub fn share(&self, cell: usize) -> f64 {
        let value = self.values.get(cell).copied().unwrap_or(f64::NAN);
        match self.colours {
            Colours::Diverging(most) => (0.5 + 0.5 * value / most).clamp(0.0, 1.0),
            Colours::Shades(_) => value.clamp(0.0, 1.0),
        }
    }

    /// The colour at a place of the scale, 0 to 1, `0xRRGGBB`.
    pub fn rgb(&self, share: f64, dark: bool) -> u32 {
        match self.colours {
            Colours::Diverging(_) => diverging(2.0 * share - 1.0, dark),
            Colours::Shades(_) => shade(share),
        }
    }
}
