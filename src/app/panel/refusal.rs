//! A file that was not opened: why, what to try, and a way to say what its header does not.

use egui::{ComboBox, Label, RichText, TextEdit, Ui};

use super::{Ask, Typing};
use crate::app::errand::Refused;
use crate::app::state::Source;
use crate::app::theme;
use crate::app::widgets::{card, row};
use crate::record::{ColumnMap, ReadOptions};

/// The columns that a box to choose from is shown for.
const KEYS: [(&str, &str); 3] = [
    ("t", "The time, or none if the sampling rate is given"),
    ("x", "The displacement (or the first state)"),
    ("u", "What drives it: a force or the base's motion; none for free motion"),
];

/// What a box says while nothing was chosen in it.
const HEADER: &str = "as the header says";

pub(super) fn show(ui: &mut Ui, refused: &Refused, typing: &mut Typing, asks: &mut Vec<Ask>) {
    let wrong = theme::accents(ui.visuals().dark_mode).wrong;
    card(ui, wrong, |ui| {
        ui.add(Label::new(&refused.problem.what).wrap());
        if !refused.problem.advice.is_empty() {
            ui.add(Label::new(RichText::new(&refused.problem.advice).weak()).wrap());
        }
        if refused.problem.missing.is_some() {
            if ui.button("Choose the file…").clicked() {
                asks.push(Ask::Locate);
            }
        } else if matches!(refused.opening.source, Source::Files(_)) {
            ui.separator();
            form(ui, refused, typing, asks);
        }
    });
}

fn form(ui: &mut Ui, refused: &Refused, typing: &mut Typing, asks: &mut Vec<Ask>) {
    let columns = &refused.problem.columns;
    for (key, tooltip) in KEYS.iter().filter(|_| !columns.is_empty()) {
        row(ui, key, tooltip, |ui| {
            let said = said(&typing.columns, key);
            let shown = said.clone().unwrap_or_else(|| HEADER.to_owned());
            let combo = ComboBox::from_id_salt(("column", key)).width(ui.available_width() - 8.0).selected_text(shown);
            let combo = combo.show_ui(ui, |ui| {
                if ui.selectable_label(said.is_none(), HEADER).clicked() {
                    typing.columns = with(&typing.columns, key, None);
                }
                for column in columns {
                    if ui.selectable_label(said.as_ref() == Some(column), column).clicked() {
                        typing.columns = with(&typing.columns, key, Some(column));
                    }
                }
            });
            combo.response.accessible_name(format!("Column of {key}"));
        });
    }
    row(ui, "Columns", "Which column is which, by name or number from 1", |ui| {
        let field = TextEdit::singleline(&mut typing.columns).hint_text("t=1,x=2,u=3").desired_width(f32::INFINITY);
        ui.add(field).accessible_name("Columns");
    });
    row(ui, "Rate (Hz)", "Sampling rate, where there is no time column", |ui| {
        let field = TextEdit::singleline(&mut typing.rate).hint_text("1000").desired_width(70.0);
        ui.add(field).accessible_name("Sampling rate");
        match options(refused, typing) {
            Ok(options) => {
                if ui.button("Read again").clicked() {
                    asks.push(Ask::ReadAgain(options));
                }
            }
            Err(problem) => {
                ui.add(Label::new(RichText::new(problem).small()).truncate());
            }
        }
    });
}

/// What is said, as options of reading.
fn options(refused: &Refused, typing: &Typing) -> Result<ReadOptions, String> {
    let columns = match typing.columns.trim() {
        "" => ColumnMap::default(),
        text => text.parse().map_err(|e: crate::record::ColumnMapError| e.to_string())?,
    };
    let rate = match typing.rate.trim() {
        "" => None,
        text => Some(text.replace(',', ".").parse().map_err(|_| "the rate is no number".to_owned())?),
    };
    Ok(ReadOptions { columns, rate, ..refused.opening.reading.clone() })
}

/// The column that a text gives a key.
fn said(text: &str, key: &str) -> Option<String> {
    pairs(text).into_iter().find(|(k, _)| k == key).map(|(_, column)| column)
}

/// The text with another column for a key.
fn with(text: &str, key: &str, column: Option<&str>) -> String {
    let mut pairs = pairs(text);
    pairs.retain(|(k, _)| k != key);
    pairs.extend(column.map(|c| (key.to_owned(), c.to_owned())));
    pairs.iter().map(|(k, c)| format!("{k}={c}")).collect::<Vec<_>>().join(",")
}

fn pairs(text: &str) -> Vec<(String, String)> {
    let pair = |part: &str| part.split_once('=').map(|(k, c)| (k.trim().to_owned(), c.trim().to_owned()));
    text.split(',').filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choosing_a_column_rewrites_what_is_said() {
        let text = with("", "x", Some("Laser 2"));
        let text = with(&text, "t", Some("Zeit"));
        assert_eq!(text, "x=Laser 2,t=Zeit");
        assert_eq!(said(&text, "x").as_deref(), Some("Laser 2"));
        assert_eq!(with(&text, "x", None), "t=Zeit");
    }
}
