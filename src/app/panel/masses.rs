//! The masses with their channels, where there are several.

use egui::{RichText, Ui};

use crate::app::theme::ROW;
use crate::app::widgets::line;
use sindyscope_values::format::units::raised;
use sindyscope_values::record::{Channel, Record, Role};
use sindyscope_values::term::Kind;

/// A row for each mass, or place (`noun`): its number and what is measured of it.
pub(super) fn show(ui: &mut Ui, record: &Record, noun: &str) {
    let masses = record.layout(Kind::SecondOrder).freedoms;
    if masses < 2 {
        return;
    }
    for mass in 0..masses {
        let channels: Vec<String> = record.measured().filter(|c| of(c.role) == Some(mass)).map(said).collect();
        line(ui, ROW - 4.0, |ui| {
            ui.label(RichText::new(format!("{noun} {}", mass + 1)).weak());
            ui.add(egui::Label::new(channels.join(", ")).truncate());
        })
        .response
        .on_hover_text(format!("What is measured of {noun} {}", mass + 1));
    }
}

/// The mass that a channel is of.
fn of(role: Role) -> Option<usize> {
    match role {
        Role::Displacement(k) | Role::Velocity(k) | Role::Acceleration(k) => Some(k),
        Role::Input(_) => None,
    }
}

fn said(channel: &Channel) -> String {
    let unit = raised(channel.unit.trim());
    let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    format!("{} {}{unit}", channel.name, channel.role.noun())
}
