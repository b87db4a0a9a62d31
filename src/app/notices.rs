//! What the window tells: toasts that pass, and a log in which they can be read again.

use std::time::Duration;

use egui::{Color32, RichText};
use egui_notify::{Anchor, Toast, ToastLevel, Toasts};

use super::theme;

/// Messages kept in the log.
const KEPT: usize = 100;

/// Characters in a line of a toast.
const LINE: usize = 64;

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// It went well.
    Done,
    /// Good to know.
    Note,
    /// It did not work.
    Error,
}

/// One message.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Notice {
    pub(crate) level: Level,
    pub(crate) text: String,
}

/// All messages, the newest last.
pub(crate) struct Notices {
    toasts: Toasts,
    log: Vec<Notice>,
    /// Messages that the person has not looked at in the log.
    unread: usize,
}

impl Default for Notices {
    fn default() -> Self {
        let toasts = Toasts::default().with_anchor(Anchor::BottomRight).with_margin(egui::vec2(12.0, 36.0));
        Self { toasts, log: Vec::new(), unread: 0 }
    }
}

impl Notices {
    /// Tells that something worked.
    pub(crate) fn done(&mut self, text: impl Into<String>) {
        self.tell(Level::Done, text.into());
    }

    /// Tells something good to know.
    pub(crate) fn note(&mut self, text: impl Into<String>) {
        self.tell(Level::Note, text.into());
    }

    /// Tells that something did not work, and what to try.
    pub(crate) fn error(&mut self, text: impl Into<String>) {
        self.tell(Level::Error, text.into());
    }

    /// Notes what is said elsewhere already, to be read again.
    pub(crate) fn log(&mut self, level: Level, text: impl Into<String>) {
        self.log.push(Notice { level, text: text.into() });
        if self.log.len() > KEPT {
            self.log.remove(0);
        }
    }

    /// Other records are open: what was said of those before stands in the log alone.
    pub(crate) fn settle(&mut self) {
        self.unread = 0;
    }

    fn tell(&mut self, level: Level, text: String) {
        let (icon, color, seconds) = match level {
            Level::Done => ("✔", Color32::from_rgb(0x2E, 0x9E, 0x6B), 4),
            Level::Note => ("ℹ", Color32::from_rgb(0x3B, 0x82, 0xC4), 6),
            Level::Error => ("⚠", Color32::from_rgb(0xD0, 0x5A, 0x2A), 15),
        };
        let mut toast = Toast::custom(wrapped(&text), ToastLevel::Custom(icon.into(), color));
        toast.duration(Some(Duration::from_secs(seconds))).show_progress_bar(false);
        self.toasts.add(toast);
        self.log(level, text);
        self.unread += 1;
    }

    /// The newest message.
    pub(crate) fn latest(&self) -> Option<&Notice> {
        self.log.last()
    }

    /// Number of messages that were not looked at.
    pub(crate) fn unread(&self) -> usize {
        self.unread
    }

    /// Draws the toasts.
    pub(crate) fn show_toasts(&mut self, ctx: &egui::Context) {
        self.toasts.show(ctx);
    }

    /// Draws the log.
    pub(crate) fn show_log(&mut self, ui: &mut egui::Ui) {
        self.unread = 0;
        ui.set_width(420.0);
        if self.log.is_empty() {
            ui.weak("No messages yet");
            return;
        }
        egui::ScrollArea::vertical().max_height(320.0).auto_shrink([false, true]).show(ui, |ui| {
            for message in self.log.iter().rev() {
                ui.horizontal_wrapped(|ui| {
                    let colors = theme::accents(ui.visuals().dark_mode);
                    let (icon, color) = match message.level {
                        Level::Done => ("✔", colors.good),
                        Level::Note => ("ℹ", colors.accent),
                        Level::Error => ("⚠", colors.caution),
                    };
                    ui.label(RichText::new(icon).color(color));
                    ui.add(egui::Label::new(&message.text).selectable(true).wrap());
                });
                ui.add_space(2.0);
            }
        });
    }
}

/// Breaks a text into lines of bearable length: toasts do not wrap by themselves.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let full = lines.last().is_some_and(|l| !l.is_empty() && l.chars().count() + word.chars().count() >= LINE);
        if full {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_messages_are_broken_between_words() {
        let text = wrapped(&"segment length ".repeat(20));
        assert!(text.lines().count() > 3 && text.lines().all(|l| l.chars().count() <= LINE), "{text}");
        assert_eq!(wrapped("short"), "short");
    }
}
