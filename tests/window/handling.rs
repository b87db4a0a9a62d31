//! Random keys, clicks and drags: the window must neither panic nor hang. Where it does, the log of what was done is printed:
//! saved as a file, `sindyscope --replay FILE` does it again.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use super::*;

/// Acts of one run.
const ACTS: usize = 150;

const KEYS: [(Modifiers, Key); 22] = [
    (Modifiers::NONE, Key::Num1),
    (Modifiers::NONE, Key::Num2),
    (Modifiers::NONE, Key::Num3),
    (Modifiers::NONE, Key::Num4),
    (Modifiers::NONE, Key::Home),
    (Modifiers::NONE, Key::F1),
    (Modifiers::NONE, Key::Escape),
    (Modifiers::NONE, Key::Tab),
    (Modifiers::NONE, Key::Enter),
    (Modifiers::NONE, Key::Space),
    (Modifiers::NONE, Key::ArrowLeft),
    (Modifiers::NONE, Key::ArrowRight),
    (CTRL, Key::Z),
    (CTRL.plus(Modifiers::SHIFT), Key::Z),
    (CTRL, Key::L),
    (CTRL, Key::K),
    (CTRL, Key::Num3),
    (CTRL, Key::Num5),
    (CTRL, Key::Num9),
    (CTRL, Key::W),
    (Modifiers::ALT, Key::Num1),
    (Modifiers::ALT, Key::Num4),
];

/// `SplitMix64`: the same acts for the same seed on every machine.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % end as u64) as usize
    }

    fn place(&mut self) -> egui::Pos2 {
        egui::pos2(self.below(1280) as f32, self.below(800) as f32)
    }
}

fn act(window: &mut Window, dice: &mut Dice) {
    let harness = &mut window.0;
    match dice.below(4) {
        0 => {
            let (modifiers, key) = KEYS[dice.below(KEYS.len())];
            harness.key_press_modifiers(modifiers, key);
        }
        1 => {
            let (from, to) = (dice.place(), dice.place());
            harness.hover_at(from);
            harness.drag_at(from);
            harness.run_steps(1);
            harness.hover_at(to);
            harness.run_steps(1);
            harness.drop_at(to);
        }
        _ => {
            let at = dice.place();
            harness.hover_at(at);
            harness.drag_at(at);
            harness.run_steps(1);
            harness.drop_at(at);
        }
    }
    harness.run_steps(2);
}

#[test]
fn random_acts_neither_panic_nor_hang() {
    let seed = std::env::var("SINDYSCOPE_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let mut dice = Dice(seed);
    let mut window = Window::sample();
    for count in 1..=ACTS {
        let done = catch_unwind(AssertUnwindSafe(|| act(&mut window, &mut dice)));
        if let Err(panic) = done {
            eprintln!("act {count} of seed {seed}; the log of the session:\n{}", window.app().log());
            resume_unwind(panic);
        }
    }
    window.settle();
    window.press(Modifiers::NONE, Key::Escape);
}
