//! The class mode: a round hides an effect, the students guess, then truth, guesses and what the program finds stand in one
//! table.

use egui::{Align, Grid, Layout, RichText, ScrollArea, Ui, vec2};

use super::number_row::{combo, percent, seed};
use super::room::{ClassWork, RigAct};
use super::sets;
use crate::app::purpose::Purpose;
use crate::app::state::{Answered, ClassCase, ClassRound, ClassState, Guess};
use crate::app::theme;
use crate::app::widgets::{Spread, card, section};
use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::{ExcitationKind, draw, names, possible, title};
use sindyscope_search::{Ask, Progress, Search, Verdict};
use sindyscope_values::format::units::raised;

/// Ways to shake, with what a teacher calls them.
const EXCITATIONS: [(ExcitationKind, &str, &str); 5] = [
    (ExcitationKind::Multisine, "multisines at two levels", ""),
    (ExcitationKind::SweepPair, "a sweep up and one down", ""),
    (ExcitationKind::Tones, "four tones", ""),
    (ExcitationKind::Decay, "free decays", ""),
    (ExcitationKind::SingleTone, "one steady tone", ""),
];

/// What a round hides: the name of the effect and its description.
pub(crate) fn drawn(case: &ClassCase) -> Result<(String, String), String> {
    let hidden = draw(&case.request()).map_err(|e| e.to_string())?;
    Ok((hidden.truth.effects.join(", "), hidden.truth.description))
}

/// What the program names in the records of a case.
pub(crate) fn search(case: &ClassCase, cancel: &Cancel, tell: &(dyn Fn(f64) + Sync)) -> Result<Answered, String> {
    let hidden = draw(&case.request()).map_err(|e| e.to_string())?;
    let search = Search::prepare(&sets::of_round(hidden), &Ask::default(), cancel).map_err(|e| e.to_string())?;
    let hear = |progress: Progress| {
        if let Progress::Step(_, share) = progress {
            tell(share);
        }
    };
    let found = search.diagnose(&hear, cancel).map_err(|e| e.to_string())?;
    let added = found.stages.last().map_or(&[][..], |stage| &stage.effects);
    let verdict = match found.verdict {
        Verdict::Named => "named",
        Verdict::Ambiguous => "ambiguous",
        Verdict::Unexplained => "unexplained",
        Verdict::NothingMissing => "nothing missing",
    };
    Ok(Answered {
        effects: added.iter().map(|e| e.choice.effect.clone()).collect(),
        verdict: verdict.to_owned(),
        sentence: found.sentence,
    })
}

fn named(effect: &str) -> &str {
    title(effect).unwrap_or(effect)
}

/// A row of the table.
struct ClassRow<'a> {
    round: usize,
    of: &'a ClassRound,
    guess: Option<&'a Guess>,
}

impl ClassRow<'_> {
    fn right(&self) -> Option<bool> {
        self.guess.filter(|_| self.of.revealed).map(|guess| guess.effect == self.of.hidden)
    }

    fn found(&self) -> Option<String> {
        let found = self.of.answered.as_ref()?;
        let names: Vec<&str> = found.effects.iter().map(|e| named(e)).collect();
        Some(if names.is_empty() { found.verdict.clone() } else { names.join(" and ") })
    }
}

fn rows(state: &ClassState) -> Vec<ClassRow<'_>> {
    let mut rows = Vec::new();
    for (index, of) in state.rounds.iter().enumerate() {
        let round = index + 1;
        if of.guesses.is_empty() {
            rows.push(ClassRow { round, of, guess: None });
        }
        rows.extend(of.guesses.iter().map(|guess| ClassRow { round, of, guess: Some(guess) }));
    }
    rows
}

/// The rounds whose truth was told as CSV, one line a guess.
pub(crate) fn csv(state: &ClassState) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = ["round", "who", "guess", "right", "hidden", "found", "verdict", "noise", "ratio", "excitation", "seed"];
    // Writing to memory does not fail.
    let _ = writer.write_record(head);
    for row in rows(state).iter().filter(|row| row.of.revealed) {
        let found = row.of.answered.as_ref();
        let _ = writer.write_record([
            row.round.to_string(),
            row.guess.map_or(String::new(), |g| g.who.clone()),
            row.guess.map_or(String::new(), |g| g.effect.clone()),
            row.right().map_or(String::new(), |right| if right { "yes" } else { "no" }.to_owned()),
            row.of.hidden.clone(),
            found.map_or(String::new(), |f| f.effects.join(" ")),
            found.map_or(String::new(), |f| f.verdict.clone()),
            row.of.case.noise.to_string(),
            row.of.case.ratio.to_string(),
            row.of.case.excitation.to_string(),
            row.of.case.seed.to_string(),
        ]);
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

/// The left column: what the next round hides; nothing of it while one is open, for the students look on.
pub(super) fn form(ui: &mut Ui, work: &ClassWork, state: &mut ClassState, acts: &mut Vec<RigAct>) {
    let number = state.rounds.len() + usize::from(state.open().is_none());
    section(ui, &format!("ROUND {number}"), |_| {}, |_| {});
    if state.open().is_some() {
        ui.add(egui::Label::new("The round is open: what it hides is not shown here until it is revealed.").wrap());
        return;
    }
    let case = &mut state.case;
    let mut effects: Vec<(Option<&str>, &str, &str)> = vec![(None, "drawn by the seed", "")];
    effects.extend(names().filter(|name| possible(name, case.excitation)).map(|name| (Some(name), named(name), "")));
    let hidden = names().find(|name| Some(*name) == case.effect.as_deref());
    if let Some(effect) = combo(ui, "Hide", "The effect that the rig hides", hidden, &effects) {
        case.effect = effect.map(str::to_owned);
    }
    let hint = "How the plant is shaken; the band is 0.3 to 2.2 times its natural frequency";
    if let Some(excitation) = combo(ui, "Excitation", hint, case.excitation, &EXCITATIONS) {
        case.excitation = excitation;
    }
    let noise = ("Noise", "Standard deviation of the displacement's noise, as a share of its RMS");
    percent(ui, &mut case.noise, noise, 0.01..=20.0, Spread::Logarithmic);
    let strength = ("Strength", "The hidden force's RMS as a share of the spring's");
    percent(ui, &mut case.ratio, strength, 1.0..=40.0, Spread::Logarithmic);
    let hint = "Draws the plant, the effect's shape and the noise, and the effect itself if none is chosen";
    seed(ui, &mut case.seed, hint, 1000);
    ui.add_space(6.0);
    let ready = !work.drawing;
    if ui.add_enabled(ready, egui::Button::new("Begin the round")).clicked() {
        acts.push(RigAct::DrawRound);
    }
}

/// The right column: how a round goes.
pub(super) fn rules(ui: &mut Ui) {
    section(ui, "HOW A ROUND GOES", |_| {}, |_| {});
    for (number, text) in [
        "Choose on the left what is hidden, or let the seed draw it, and begin the round.",
        "Give the data out: study them here, or save them for the students' own machines. The file does not tell.",
        "Take down each guess from the list of effects.",
        "Reveal: the truth is told, and the program searches the same records.",
        "Every round stays in the table, which is saved with the session and exported as CSV.",
    ]
    .iter()
    .enumerate()
    {
        ui.horizontal_top(|ui| {
            ui.label(RichText::new(format!("{}.", number + 1)).weak());
            ui.add(egui::Label::new(*text).wrap());
        });
    }
}

/// The centre: the open round, and the table of all.
pub(super) fn show(ui: &mut Ui, work: &ClassWork, state: &mut ClassState, acts: &mut Vec<RigAct>) {
    let colors = theme::accents(ui.visuals().dark_mode);
    if let Some(failure) = work.failure.clone() {
        card(ui, colors.wrong, |ui| {
            ui.add(egui::Label::new(RichText::new(raised(&failure)).color(colors.wrong)).wrap());
        });
    }
    ui.add_space(4.0);
    if state.open().is_some() {
        open_round(ui, state, acts);
    } else if work.drawing {
        ui.weak("making the records…");
    } else if state.rounds.is_empty() {
        ui.label(RichText::new("No round yet").size(18.0).strong());
        ui.weak("Choose on the left what the first one hides, and begin it");
    }
    if state.rounds.iter().any(|round| round.revealed) {
        ui.add_space(8.0);
        table(ui, work, state, acts);
    }
}

fn open_round(ui: &mut Ui, state: &mut ClassState, acts: &mut Vec<RigAct>) {
    let accent = theme::accents(ui.visuals().dark_mode).accent;
    let number = state.rounds.len();
    let mut reveal = false;
    card(ui, accent, |ui| {
        ui.label(RichText::new(format!("Round {number}: which effect is hidden?")).size(18.0).strong());
        ui.horizontal_wrapped(|ui| {
            if ui
                .button("Study the data in Identify")
                .on_hover_text("Open the round's records; they do not tell what they hide")
                .clicked()
            {
                acts.push(RigAct::StudyRound);
            }
            if ui.button("Save the data…").on_hover_text("The records as CSV, for the students' own machines").clicked()
            {
                acts.push(RigAct::Save(Purpose::RoundRecords));
            }
        });
        ui.add_space(4.0);
        ui.horizontal_wrapped(|ui| {
            ui.label("Who");
            ui.add(egui::TextEdit::singleline(&mut state.who).hint_text("name or group").desired_width(120.0))
                .accessible_name("Who");
            ui.label("takes it for");
            let shown = state.guess.as_deref().map_or("an effect…", named);
            let combo =
                egui::ComboBox::from_id_salt("guess").width(230.0).truncate().selected_text(shown).show_ui(ui, |ui| {
                    for name in names() {
                        ui.selectable_value(&mut state.guess, Some(name.to_owned()), named(name));
                    }
                });
            combo.response.accessible_name("Guess");
            if ui.add_enabled(state.guess.is_some(), egui::Button::new("Take down")).clicked()
                && let Some(effect) = state.guess.take()
            {
                let who = std::mem::take(&mut state.who).trim().to_owned();
                if let Some(round) = state.open_mut() {
                    round.guesses.push(Guess { who, effect });
                }
            }
        });
        let mut removed = None;
        for (index, guess) in state.open().map_or(&[][..], |round| &round.guesses).iter().enumerate() {
            ui.horizontal(|ui| {
                let who = if guess.who.is_empty() { "somebody" } else { &guess.who };
                ui.label(format!("{who}: {}", named(&guess.effect)));
                if ui.small_button("remove").clicked() {
                    removed = Some(index);
                }
            });
        }
        if let (Some(index), Some(round)) = (removed, state.open_mut()) {
            round.guesses.remove(index);
        }
        ui.add_space(4.0);
        let hint = "Tells what was hidden, and lets the program search the same records";
        reveal = ui.button(RichText::new("Reveal").strong()).on_hover_text(hint).clicked();
    });
    if reveal {
        if let Some(round) = state.open_mut() {
            round.revealed = true;
        }
        state.case.seed = state.case.seed % 1000 + 1;
        acts.push(RigAct::SearchRound(number - 1));
    }
}

fn table(ui: &mut Ui, work: &ClassWork, state: &ClassState, acts: &mut Vec<RigAct>) {
    let colors = theme::accents(ui.visuals().dark_mode);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Truth, guesses and what the program found").size(15.0).strong());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("Export as CSV…").clicked() {
                acts.push(RigAct::Save(Purpose::Rounds));
            }
        });
    });
    let mut again = None;
    let busy = work.progress;
    let searching = work.searching;
    ScrollArea::both().id_salt("rounds").auto_shrink([false, true]).max_height(0.55 * ui.available_height()).show(
        ui,
        |ui| {
            Grid::new("class rounds").num_columns(6).striped(true).spacing(vec2(16.0, 4.0)).show(ui, |ui| {
                for head in ["round", "hidden", "who", "guess", "", "the program"] {
                    ui.label(RichText::new(head).weak().size(12.0));
                }
                ui.end_row();
                let mut told = 0;
                for row in rows(state).into_iter().filter(|row| row.of.revealed) {
                    let first = row.round != told;
                    told = row.round;
                    ui.label(if first { row.round.to_string() } else { String::new() });
                    ui.label(if first { named(&row.of.hidden) } else { "" });
                    ui.label(row.guess.map_or("", |g| g.who.as_str()));
                    ui.label(row.guess.map_or("–", |g| named(&g.effect)));
                    match row.right() {
                        Some(true) => ui.colored_label(colors.good, "right"),
                        Some(false) => ui.colored_label(colors.caution, "wrong"),
                        None => ui.label(""),
                    };
                    match (row.found(), searching == Some(row.round - 1)) {
                        _ if !first => {
                            ui.label("");
                        }
                        (Some(found), _) => {
                            let right = row.of.answered.as_ref().is_some_and(|a| a.effects == [row.of.hidden.clone()]);
                            ui.colored_label(if right { colors.good } else { colors.caution }, found);
                        }
                        (None, true) => {
                            let share = busy.unwrap_or(0.0) as f32;
                            ui.add(egui::ProgressBar::new(share).desired_width(120.0).text("searching…"));
                        }
                        (None, false) => {
                            if ui.button("Let it search").clicked() {
                                again = Some(row.round - 1);
                            }
                        }
                    }
                    ui.end_row();
                }
            });
        },
    );
    if searching.is_some() && ui.button("Stop the search").clicked() {
        acts.push(RigAct::StopSearch);
    }
    if let Some(index) = again {
        acts.push(RigAct::SearchRound(index));
    }
    if let Some(round) = state.rounds.iter().rev().find(|round| round.revealed) {
        ui.add_space(6.0);
        card(ui, colors.accent, |ui| {
            ui.add(egui::Label::new(RichText::new("The last truth").strong()).wrap());
            ui.add(egui::Label::new(raised(&round.description)).wrap());
            if let Some(found) = &round.answered {
                ui.add_space(2.0);
                ui.add(egui::Label::new(format!("The program: {}", raised(&found.sentence))).wrap());
            }
        });
    }
}
