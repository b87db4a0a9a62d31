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
    /// Its number among those that are told as they come; none: it is said elsewhere.
    told: Option<u64>,
}

/// All messages, the newest last.
#[derive(Debug, Default)]
pub(crate) struct Notices {
    log: Vec<Notice>,
    /// How many were told as they came.
    told: u64,
    /// How many of those were said of records that are no longer open.
    settled: u64,
}

/// What a person has seen of the messages.
pub(crate) struct Toasted {
    toasts: Toasts,
    /// How many have had their toast.
    toasted: u64,
    /// How many had been told when the log was looked at last.
    read: u64,
}

impl Default for Toasted {
    fn default() -> Self {
        let toasts = Toasts::default().with_anchor(Anchor::BottomRight).with_margin(egui::vec2(12.0, 36.0));
        Self { toasts, toasted: 0, read: 0 }
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
        self.push(Notice { level, text: text.into(), told: None });
    }

    fn push(&mut self, notice: Notice) {
        self.log.push(notice);
        if self.log.len() > KEPT {
            self.log.remove(0);
        }
    }

    /// Other records are open: what was said of those before stands in the log alone.
    pub(crate) fn settle(&mut self) {
        self.settled = self.told;
    }

    fn tell(&mut self, level: Level, text: String) {
        self.told += 1;
        self.push(Notice { level, text, told: Some(self.told) });
    }

    /// The newest message.
    pub(crate) fn latest(&self) -> Option<&Notice> {
        self.log.last()
    }

    /// Number of messages that were not looked at.
    pub(crate) fn unread(&self, seen: &Toasted) -> u64 {
        self.told - seen.read.max(self.settled)
    }

    /// Draws the toasts.
    pub(crate) fn show_toasts(&self, ctx: &egui::Context, seen: &mut Toasted) {
        for notice in self.log.iter().filter(|notice| notice.told.is_some_and(|number| number > seen.toasted)) {
            seen.toasts.add(toast(notice));
        }
        seen.toasted = self.told;
        seen.toasts.show(ctx);
    }

    /// Draws the log.
    pub(crate) fn show_log(&self, ui: &mut egui::Ui, seen: &mut Toasted) {
        seen.read = self.told;
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

fn toast(notice: &Notice) -> Toast {
    let (icon, color, seconds) = match notice.level {
        Level::Done => ("✔", Color32::from_rgb(0x2E, 0x9E, 0x6B), 4),
        Level::Note => ("ℹ", Color32::from_rgb(0x3B, 0x82, 0xC4), 6),
        Level::Error => ("⚠", Color32::from_rgb(0xD0, 0x5A, 0x2A), 15),
    };
    let mut toast = Toast::custom(wrapped(&notice.text), ToastLevel::Custom(icon.into(), color));
    toast.duration(Some(Duration::from_secs(seconds))).show_progress_bar(false);
    toast
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
