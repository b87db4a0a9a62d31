//! The fixed colours and strokes of everything that is drawn, in the light and the dark theme.
//!
//! Hues are those of Okabe and Ito's set for colour-blind eyes (jfly.uni-koeln.de/color), made darker or lighter until each
//! stands off its ground; what lies on top of each other differs in lightness and width too, so that a grey print still tells it.

use serde::{Deserialize, Serialize};

/// One thing that plots draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ink {
    /// The measurement: wide and mid-toned, so that what lies on it shows.
    Measured,
    /// The identified model's response: narrow and strong.
    Identified,
    /// The response before the last change.
    Ghost,
    /// The error between the two.
    Error,
    /// The error before the last change.
    ErrorGhost,
    /// The error's root mean square over a few periods.
    ErrorRms,
    /// A mean over many samples, or the curve that chance would give.
    Mean,
    /// The measurement noise's level.
    NoiseFloor,
    /// An input.
    Input,
    /// The place where a response left the data's range.
    Diverged,
    /// What marks a place or the setting that holds now.
    Cursor,
    /// The effect of this index: the first missing effect that was found, the second, …
    Effect(u8),
    /// The term of a library of this index.
    Term(u8),
    /// The pinned outcome of this index.
    Pin(u8),
}

/// Colours that tell effects apart; then again from the first.
const EFFECTS: u8 = 8;

/// Colours that tell terms apart (of those of effects, two are blues), and strokes for those beyond.
const TERMS: [u8; 7] = [0, 1, 2, 3, 4, 6, 7];

/// Colours of pinned outcomes: the orange among the effects' is that of what is shown now.
const PINS: [u8; 6] = [0, 2, 3, 4, 7, 6];

impl Ink {
    /// Every ink that stands for one thing.
    pub const SINGLE: [Self; 11] = [
        Self::Measured,
        Self::Identified,
        Self::Ghost,
        Self::Error,
        Self::ErrorGhost,
        Self::ErrorRms,
        Self::Mean,
        Self::NoiseFloor,
        Self::Input,
        Self::Diverged,
        Self::Cursor,
    ];

    /// Every ink that looks different from the others.
    pub fn all() -> impl Iterator<Item = Self> {
        let effects = (0..EFFECTS).map(Self::Effect);
        let terms = (0..3 * TERMS.len() as u8).map(Self::Term);
        let pins = (0..PINS.len() as u8).map(Self::Pin);
        Self::SINGLE.into_iter().chain(effects).chain(terms).chain(pins)
    }

    /// The ink of a model with so many effects in it: the base's is that of every model, then it is the last effect's.
    pub fn of_stage(effects: usize) -> Self {
        match effects.checked_sub(1) {
            None => Self::Identified,
            Some(last) => Self::Effect((last % usize::from(EFFECTS)) as u8),
        }
    }

    /// The ink of a term by its place in the library.
    pub fn of_term(index: usize) -> Self {
        Self::Term((index % (3 * TERMS.len())) as u8)
    }

    /// The colour on the dark or the light theme's plot ground, `0xRRGGBB`.
    pub fn rgb(self, dark: bool) -> u32 {
        let (light_theme, dark_theme) = match self {
            Self::Measured => (0x47_9B_D4, 0x2C_76_AE),
            Self::Identified => (0xA8_32_00, 0xFF_B8_66),
            Self::Ghost => (0xD3_A4_8E, 0x7A_5F_45),
            Self::Error => (0x00_6B_4F, 0x3C_CF_A3),
            Self::ErrorGhost => (0xC6_DD_D6, 0x22_42_39),
            Self::ErrorRms => (0x00_3B_2A, 0xB4_FF_E4),
            Self::Mean | Self::NoiseFloor => (0x20_20_20, 0xF0_F0_F0),
            Self::Input => (0x7B_3F_73, 0xDF_9B_C8),
            Self::Diverged => (0xB0_00_20, 0xFF_6B_6B),
            Self::Cursor => (0x7C_82_8A, 0x8A_90_98),
            Self::Effect(index) => effect(index),
            Self::Term(index) => effect(TERMS[usize::from(index) % TERMS.len()]),
            Self::Pin(index) => effect(PINS[usize::from(index) % PINS.len()]),
        };
        if dark { dark_theme } else { light_theme }
    }

    /// Width of the line, points.
    pub fn width(self) -> f32 {
        match self {
            Self::Measured => 3.4,
            Self::Identified => 1.3,
            Self::Ghost | Self::ErrorGhost | Self::Error => 1.0,
            Self::Input | Self::Mean => 1.4,
            Self::ErrorRms => 1.8,
            Self::NoiseFloor | Self::Diverged | Self::Pin(_) => 1.2,
            Self::Cursor => 1.5,
            Self::Effect(_) => 1.6,
            Self::Term(_) => 2.0,
        }
    }

    /// Length of a dash, points; none for a solid line.
    pub fn dash(self) -> Option<f32> {
        match self {
            Self::NoiseFloor => Some(7.0),
            Self::Diverged => Some(4.0),
            Self::Cursor => Some(6.0),
            Self::Term(index) => [None, Some(8.0), Some(2.0)][usize::from(index) / TERMS.len() % 3],
            _ => None,
        }
    }
}

/// The ground of a plot, `0xRRGGBB`.
pub fn ground(dark: bool) -> u32 {
    if dark { 0x14_16_19 } else { 0xFF_FF_FF }
}

/// Grid lines and the plot's frame, `0xRRGGBB`.
pub fn grid(dark: bool) -> u32 {
    if dark { 0x2E_32_37 } else { 0xE2_E4_E7 }
}

/// A tint over a stretch of an abscissa.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tint {
    /// Held out of the fit.
    HeldOut,
    /// Where the error is worst.
    Worst,
    /// Where it is nearly as bad.
    Bad,
    /// Where a motion stands still.
    Standing,
    /// What is drawn out beside.
    Detail,
}

impl Tint {
    /// Every tint.
    pub const ALL: [Self; 5] = [Self::HeldOut, Self::Worst, Self::Bad, Self::Standing, Self::Detail];

    /// Colour, `0xRRGGBB`, and opacity of 255.
    pub fn rgba(self, dark: bool) -> (u32, u8) {
        match (self, dark) {
            (Self::HeldOut, true) => (0xC8_BE_FF, 16),
            (Self::HeldOut, false) => (0x60_48_A0, 16),
            (Self::Worst, true) => (0xFF_BE_5A, 34),
            (Self::Worst, false) => (0xE6_9F_00, 44),
            (Self::Bad, true) => (0xFF_BE_5A, 19),
            (Self::Bad, false) => (0xE6_9F_00, 24),
            (Self::Standing, true) => (0x78_AA_E6, 26),
            (Self::Standing, false) => (0x28_5A_A0, 26),
            (Self::Detail, true) => (0xC8_BE_FF, 24),
            (Self::Detail, false) => (0x60_48_A0, 20),
        }
    }
}

/// The colours of an effect on the light and on the dark ground.
fn effect(index: u8) -> (u32, u32) {
    const LIGHT: [u32; EFFECTS as usize] =
        [0x94_3F_94, 0x00_5A_8C, 0x8A_6A_00, 0x00_7A_5A, 0xB0_48_00, 0x6A_3D_9A, 0x2A_7F_B4, 0x5C_5C_5C];
    const DARK: [u32; EFFECTS as usize] =
        [0xB9_8C_FF, 0x56_B4_E9, 0xF0_E4_42, 0x2F_C0_97, 0xE6_8A_3C, 0xE6_9B_E0, 0x8F_C8_F0, 0xB8_B8_B8];
    let index = usize::from(index % EFFECTS);
    (LIGHT[index], DARK[index])
}

/// Each part of two colours mixed: the first at 0, the second at 1.
fn mixed(from: u32, to: u32, share: f64) -> u32 {
    let ([_, r, g, b], [_, red, green, blue]) = (from.to_be_bytes(), to.to_be_bytes());
    let mix = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))) as u8;
    u32::from_be_bytes([0, mix(r, red), mix(g, green), mix(b, blue)])
}

/// The colour of a value on a map, from dark (0) to bright (1): viridis by N. Smith and S. van der Walt (CC0), even in
/// lightness, for colour-blind eyes and for grey print.
pub fn shade(share: f64) -> u32 {
    const STOPS: [u32; 9] =
        [0x44_01_54, 0x47_2D_7B, 0x3B_52_8B, 0x2C_72_8E, 0x21_91_8C, 0x28_AE_80, 0x5E_C9_62, 0xAD_DC_30, 0xFD_E7_25];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let first = (place as usize).min(STOPS.len() - 2);
    mixed(STOPS[first], STOPS[first + 1], place - first as f64)
}

/// Blue for negative, orange for positive, the ground's colour between: apart also to colour-blind eyes, and by lightness
/// from zero in grey print.
pub fn diverging(share: f64, dark: bool) -> u32 {
    let share = share.clamp(-1.0, 1.0);
    let (negative, middle, positive) =
        if dark { (0x7C_C4_F4, 0x1E_22_27, 0xFF_A9_4D) } else { (0x0A_5C_96, 0xFA_FA_F7, 0xB0_4A_00) };
    // The square root shows small means too.
    mixed(middle, if share < 0.0 { negative } else { positive }, share.abs().sqrt())
}

/// The colour of what chance might have made.
pub fn unsure(dark: bool) -> u32 {
    if dark { 0x50_50_50 } else { 0xC6_C6_C6 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance as WCAG 2 defines it.
    fn luminance(c: u32) -> f64 {
        let linear = |v: u8| {
            let v = f64::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        let [_, r, g, b] = c.to_be_bytes();
        0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
    }

    fn contrast(a: u32, b: u32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn lines_stand_off_their_ground() {
        for dark in [false, true] {
            for ink in Ink::SINGLE {
                // WCAG asks 3 of graphics that carry meaning, 4.5 of text; ghosts are meant to be faint.
                let least = match ink {
                    Ink::Ghost => 1.6,
                    Ink::ErrorGhost => 1.3,
                    Ink::Measured => 2.9,
                    Ink::Cursor => 3.0,
                    _ => 4.5,
                };
                let c = contrast(ink.rgb(dark), ground(dark));
                assert!(c >= least, "{ink:?}, dark {dark}: {c:.2}");
            }
            for i in 0..8 {
                let c = contrast(Ink::Effect(i).rgb(dark), ground(dark));
                assert!(c >= 3.0, "effect {i}, dark {dark}: {c:.2}");
            }
            assert!(contrast(grid(dark), ground(dark)) < 1.5, "the grid stays behind the data");
        }
    }

    #[test]
    fn identified_shows_on_measured_in_grey_print() {
        for dark in [false, true] {
            let c = contrast(Ink::Identified.rgb(dark), Ink::Measured.rgb(dark));
            assert!(c >= 2.0, "dark {dark}: {c:.2}");
        }
        assert!(Ink::Measured.width() > 2.0 * Ink::Identified.width());
    }

    /// Colours as a person without red (protan), green (deutan) or blue (tritan) cones sees them:
    /// Machado, Oliveira and Fernandes, IEEE TVCG 15 (2009) 1291, severity 1, on linear RGB.
    fn seen(c: u32, kind: usize) -> [f64; 3] {
        const M: [[[f64; 3]; 3]; 3] = [
            [
                [0.152_286, 1.052_583, -0.204_868],
                [0.114_503, 0.786_281, 0.099_216],
                [-0.003_882, -0.048_116, 1.051_998],
            ],
            [[0.367_322, 0.860_646, -0.227_968], [0.280_085, 0.672_501, 0.047_413], [-0.011_820, 0.042_940, 0.968_881]],
            [
                [1.255_528, -0.076_749, -0.178_779],
                [-0.078_411, 0.930_809, 0.147_602],
                [0.004_733, 0.691_367, 0.303_900],
            ],
        ];
        let linear = |v: u8| (f64::from(v) / 255.0).powf(2.2);
        let [_, r, g, b] = c.to_be_bytes();
        let v = [linear(r), linear(g), linear(b)];
        M[kind].map(|row| row.iter().zip(v).map(|(m, v)| m * v).sum::<f64>().clamp(0.0, 1.0).powf(1.0 / 2.2))
    }

    #[test]
    fn colour_blind_eyes_tell_the_lines_of_one_plot_apart() {
        for dark in [false, true] {
            for (a, b) in [
                (Ink::Measured, Ink::Identified),
                (Ink::Measured, Ink::Error),
                (Ink::Identified, Ink::Error),
                (Ink::Error, Ink::NoiseFloor),
            ] {
                apart(a.rgb(dark), b.rgb(dark), &format!("{a:?} {b:?} dark {dark}"));
            }
            // The response with the first effect lies on the measurement, beside the response without.
            for ink in [Ink::Measured, Ink::Identified] {
                apart(Ink::Effect(0).rgb(dark), ink.rgb(dark), &format!("effect {ink:?} dark {dark}"));
            }
        }
    }

    fn apart(a: u32, b: u32, what: &str) {
        for kind in 0..3 {
            let (p, q) = (seen(a, kind), seen(b, kind));
            let distance = p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt();
            // A tenth of the way from black to white (√3 long): plainly different side by side.
            assert!(distance > 0.17, "{what} kind {kind}: {distance:.3}");
        }
    }
}
