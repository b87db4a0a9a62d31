//! The style sheet of figures, made of the palette.

use std::fmt::Write;

use crate::palette::{Ink, Tint, diverging, grid, ground, shade, unsure};

/// Text and rules that are no data, `0xRRGGBB`.
pub(crate) struct Tones {
    pub(crate) text: u32,
    pub(crate) quiet: u32,
    pub(crate) rule: u32,
}

pub(crate) fn tones(dark: bool) -> Tones {
    if dark {
        Tones { text: 0xE8_EA_ED, quiet: 0xA9_B0_B8, rule: 0x5A_61_69 }
    } else {
        Tones { text: 0x1B_1F_24, quiet: 0x57_60_6A, rule: 0x8C_93_9B }
    }
}

/// Steps of a scale of colours.
pub(crate) const STEPS: usize = 32;

/// The style sheet's name of an ink; that of what is filled with it ends in `-fill`.
pub(crate) fn class(ink: Ink) -> String {
    match ink {
        Ink::Measured => "measured".into(),
        Ink::Identified => "identified".into(),
        Ink::Ghost => "ghost".into(),
        Ink::Error => "error".into(),
        Ink::ErrorGhost => "error-ghost".into(),
        Ink::ErrorRms => "error-rms".into(),
        Ink::Mean => "mean".into(),
        Ink::NoiseFloor => "noise".into(),
        Ink::Input => "input".into(),
        Ink::Diverged => "diverged".into(),
        Ink::Cursor => "cursor".into(),
        Ink::Effect(index) => format!("effect-{index}"),
        Ink::Term(index) => format!("term-{index}"),
        Ink::Pin(index) => format!("pin-{index}"),
    }
}

/// The style sheet's name of a tint.
pub(crate) fn tint(tint: Tint) -> &'static str {
    match tint {
        Tint::HeldOut => "held-out",
        Tint::Worst => "worst",
        Tint::Bad => "bad",
        Tint::Standing => "standing",
        Tint::Detail => "detail",
    }
}

/// Rules for every class that figures and formulas use.
pub(crate) fn rules(dark: bool) -> String {
    let mut css = String::new();
    for ink in Ink::all() {
        let dash = ink.dash().map(|d| format!(";stroke-dasharray:{d} {}", 0.6 * d)).unwrap_or_default();
        let (name, rgb, width) = (class(ink), ink.rgb(dark), 0.9 * ink.width());
        let _ = writeln!(
            css,
            ".{name}{{fill:none;stroke:#{rgb:06x};stroke-width:{width};stroke-linejoin:round{dash}}}\n.{name}-fill{{fill:#{rgb:06x}}}"
        );
    }
    for one in Tint::ALL {
        let (rgb, opacity) = one.rgba(dark);
        let _ = writeln!(css, ".{}{{fill:#{rgb:06x};fill-opacity:{:.3}}}", tint(one), f64::from(opacity) / 255.0);
    }
    for k in 0..=STEPS {
        let share = k as f64 / STEPS as f64;
        let _ = writeln!(
            css,
            ".d{k}{{fill:#{:06x}}}\n.s{k}{{fill:#{:06x}}}",
            diverging(2.0 * share - 1.0, dark),
            shade(share)
        );
    }
    let Tones { text, quiet, rule } = tones(dark);
    let (grid, ground) = (grid(dark), ground(dark));
    let _ = write!(
        css,
        ".grid{{stroke:#{grid:06x};stroke-width:.6}}\n.frame{{fill:none;stroke:#{rule:06x};stroke-width:.8}}\n\
         .unsure{{fill:#{:06x}}}\n.tick,.key,.note{{font-size:10.5px;fill:#{quiet:06x}}}\n.note{{stroke:none}}\n\
         .halo{{font-size:10.5px;fill:none;stroke:#{ground:06x};stroke-width:3;stroke-linejoin:round}}\n\
         .label{{font-size:11.5px;fill:#{text:06x}}}\n.math,.ink{{fill:#{text:06x}}}\n\
         .rule{{fill:none;stroke:#{text:06x};stroke-width:.9}}\n.edge{{fill:none;stroke:#000;stroke-width:3.6}}\n\
         .sign{{fill:none;stroke:#fff;stroke-width:1.8}}\n",
        unsure(dark)
    );
    css
}
