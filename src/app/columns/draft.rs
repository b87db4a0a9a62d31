//! How the columns of a file are to be used, as far as a person has chosen.

use serde::{Deserialize, Serialize};

use sindyscope_files::{ColumnUse, ReadOptions, TableOverview};

/// What is chosen, and what is listed to choose from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Draft {
    /// The table of the file.
    pub(super) table: usize,
    /// What each column of the table is used for.
    pub(super) uses: Vec<Option<ColumnUse>>,
    /// The sampling rate as it is typed.
    pub(super) rate: String,
    pub(super) search: String,
    /// Whether only columns in use are listed.
    pub(super) chosen_only: bool,
}

impl Draft {
    /// The way of reading that is chosen; `before` says what the columns do not.
    pub(super) fn options(&self, table: &TableOverview, before: &ReadOptions) -> Result<ReadOptions, &'static str> {
        let rate = match self.rate.trim() {
            "" => None,
            text => {
                let rate: f64 = text.replace(',', ".").parse().map_err(|_| "the rate is not a number")?;
                Some(rate).filter(|r| r.is_normal() && *r > 0.0)
            }
        };
        // Where the time is a column it counts; a rate typed before is no reason to leave it out.
        let rate = rate.filter(|_| !self.uses.contains(&Some(ColumnUse::Time)));
        Ok(ReadOptions { columns: table.map(&self.uses), only_named: true, rate, ..before.clone() })
    }
}
