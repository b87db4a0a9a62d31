//! The shared palette as egui draws it, and the tints and grounds of the window's plots.

use egui::{Color32, Stroke};
use egui_plot::{LineStyle, Span};

use sindyscope_report::palette;
pub use sindyscope_report::palette::Ink;

/// An ink as egui draws it.
pub trait Painted {
    /// The colour on the dark or the light theme's plot ground.
    fn color(self, dark: bool) -> Color32;
    /// Solid or dashed.
    fn style(self) -> LineStyle;
    /// Colour and width.
    fn stroke(self, dark: bool) -> Stroke;
}

impl Painted for Ink {
    fn color(self, dark: bool) -> Color32 {
        rgb(self.rgb(dark))
    }

    fn style(self) -> LineStyle {
        self.dash().map_or(LineStyle::Solid, |length| LineStyle::Dashed { length })
    }

    fn stroke(self, dark: bool) -> Stroke {
        Stroke::new(self.width(), self.color(dark))
    }
}

/// A span without a border.
pub(crate) fn quiet(span: Span, fill: Color32) -> Span {
    span.fill(fill).border(Stroke::new(0.0, fill))
}

/// The colour of the effect of this index (the first missing effect found, the second, …); eight, then again from the first.
pub fn effect(index: usize, dark: bool) -> Color32 {
    const LIGHT: [u32; 8] =
        [0x94_3F_94, 0x00_5A_8C, 0x8A_6A_00, 0x00_7A_5A, 0xB0_48_00, 0x6A_3D_9A, 0x2A_7F_B4, 0x5C_5C_5C];
    const DARK: [u32; 8] =
        [0xB9_8C_FF, 0x56_B4_E9, 0xF0_E4_42, 0x2F_C0_97, 0xE6_8A_3C, 0xE6_9B_E0, 0x8F_C8_F0, 0xB8_B8_B8];
    rgb(if dark { DARK } else { LIGHT }[index % LIGHT.len()])
}

/// The colour of a value on a map, from dark (0) to bright (1): viridis by N. Smith and S. van der Walt (CC0), even in
/// lightness, for colour-blind eyes and for grey print.
pub fn shade(share: f64) -> Color32 {
    const STOPS: [u32; 9] =
        [0x44_01_54, 0x47_2D_7B, 0x3B_52_8B, 0x2C_72_8E, 0x21_91_8C, 0x28_AE_80, 0x5E_C9_62, 0xAD_DC_30, 0xFD_E7_25];
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let first = (place as usize).min(STOPS.len() - 2);
    rgb(STOPS[first]).lerp_to_gamma(rgb(STOPS[first + 1]), (place - first as f64) as f32)
}

/// Blue for negative, orange for positive, the ground's colour between: apart also to colour-blind eyes, and by lightness
/// from zero in grey print.
pub fn diverging(share: f64, dark: bool) -> Color32 {
    let share = share.clamp(-1.0, 1.0);
    let (negative, middle, positive) = if dark {
        ([0x7C_u8, 0xC4, 0xF4], [0x1E, 0x22, 0x27], [0xFF, 0xA9, 0x4D])
    } else {
        ([0x0A_u8, 0x5C, 0x96], [0xFA, 0xFA, 0xF7], [0xB0, 0x4A, 0x00])
    };
    let end = if share < 0.0 { negative } else { positive };
    // The square root shows small means too.
    let t = share.abs().sqrt();
    let mix = |a: u8, b: u8| (f64::from(a) + t * (f64::from(b) - f64::from(a))) as u8;
    Color32::from_rgb(mix(middle[0], end[0]), mix(middle[1], end[1]), mix(middle[2], end[2]))
}

/// The ground of a plot.
pub fn ground(dark: bool) -> Color32 {
    rgb(palette::ground(dark))
}

/// The tint over stretches that were held out of the fit.
pub fn held_out(dark: bool) -> Color32 {
    if dark {
        Color32::from_rgba_unmultiplied(200, 190, 255, 16)
    } else {
        Color32::from_rgba_unmultiplied(96, 72, 160, 16)
    }
}

/// The tint over the stretch where the error is worst.
pub fn worst(dark: bool) -> Color32 {
    if dark {
        Color32::from_rgba_unmultiplied(255, 190, 90, 34)
    } else {
        Color32::from_rgba_unmultiplied(230, 159, 0, 44)
    }
}

/// Shade of stretches in which a motion stands still.
pub fn stands(dark: bool) -> Color32 {
    if dark {
        Color32::from_rgba_unmultiplied(120, 170, 230, 26)
    } else {
        Color32::from_rgba_unmultiplied(40, 90, 160, 26)
    }
}

/// Grid lines and the plot's frame.
pub fn grid(dark: bool) -> Color32 {
    rgb(palette::grid(dark))
}

/// The line at the pointer.
pub fn cursor(dark: bool) -> Color32 {
    rgb(if dark { 0x8A_90_98 } else { 0x7C_82_8A })
}

fn rgb(hex: u32) -> Color32 {
    let [_, r, g, b] = hex.to_be_bytes();
    Color32::from_rgb(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance as WCAG 2 defines it.
    fn luminance(c: Color32) -> f64 {
        let linear = |v: u8| {
            let v = f64::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(c.r()) + 0.7152 * linear(c.g()) + 0.0722 * linear(c.b())
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn lines_stand_off_their_ground() {
        for dark in [false, true] {
            for ink in Ink::ALL {
                // WCAG asks 3 of graphics that carry meaning, 4.5 of text; ghosts are meant to be faint.
                let least = match ink {
                    Ink::Ghost => 1.6,
                    Ink::ErrorGhost => 1.3,
                    Ink::Measured => 2.9,
                    _ => 4.5,
                };
                let c = contrast(ink.color(dark), ground(dark));
                assert!(c >= least, "{ink:?}, dark {dark}: {c:.2}");
            }
            for i in 0..8 {
                let c = contrast(effect(i, dark), ground(dark));
                assert!(c >= 3.0, "effect {i}, dark {dark}: {c:.2}");
            }
            assert!(contrast(grid(dark), ground(dark)) < 1.5, "the grid stays behind the data");
        }
    }

    #[test]
    fn identified_shows_on_measured_in_grey_print() {
        for dark in [false, true] {
            let c = contrast(Ink::Identified.color(dark), Ink::Measured.color(dark));
            assert!(c >= 2.0, "dark {dark}: {c:.2}");
        }
        assert!(Ink::Measured.width() > 2.0 * Ink::Identified.width());
    }

    /// Colours as a person without red (protan), green (deutan) or blue (tritan) cones sees them:
    /// Machado, Oliveira and Fernandes, IEEE TVCG 15 (2009) 1291, severity 1, on linear RGB.
    fn seen(c: Color32, kind: usize) -> [f64; 3] {
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
        let v = [linear(c.r()), linear(c.g()), linear(c.b())];
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
                apart(a.color(dark), b.color(dark), &format!("{a:?} {b:?} dark {dark}"));
            }
            // The response with the first effect lies on the measurement, beside the response without.
            for ink in [Ink::Measured, Ink::Identified] {
                apart(effect(0, dark), ink.color(dark), &format!("effect {ink:?} dark {dark}"));
            }
        }
    }

    fn apart(a: Color32, b: Color32, what: &str) {
        for kind in 0..3 {
            let (p, q) = (seen(a, kind), seen(b, kind));
            let distance = p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum::<f64>().sqrt();
            // A tenth of the way from black to white (√3 long): plainly different side by side.
            assert!(distance > 0.17, "{what} kind {kind}: {distance:.3}");
        }
    }
}
