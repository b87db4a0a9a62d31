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
}

impl Ink {
    /// Every ink.
    pub const ALL: [Self; 10] = [
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
    ];

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
            Self::NoiseFloor | Self::Diverged => 1.2,
        }
    }

    /// Length of a dash, points; none for a solid line.
    pub fn dash(self) -> Option<f32> {
        match self {
            Self::NoiseFloor => Some(7.0),
            Self::Diverged => Some(4.0),
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
