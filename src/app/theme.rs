//! Fonts, spacing and colours of the window: one grid, two themes.

use egui::style::{Selection, WidgetVisuals, Widgets};
use egui::{
    Color32, Context, CornerRadius, FontDefinitions, FontFamily, FontId, Margin, Stroke, Style, TextStyle, Theme,
};

use super::plot::palette;

/// Height of a row of the side panels, points.
pub(crate) const ROW: f32 = 22.0;

/// Colours with a meaning, beside those of the plots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Accents {
    /// What is chosen, active or linked.
    pub(crate) accent: Color32,
    /// The accent as a ground for text.
    pub(crate) accent_ground: Color32,
    /// It is well.
    pub(crate) good: Color32,
    /// It may mislead.
    pub(crate) caution: Color32,
    /// It cannot be used.
    pub(crate) wrong: Color32,
    /// The ground of cards.
    pub(crate) card: Color32,
    /// Hairlines.
    pub(crate) line: Color32,
}

/// The accents of the dark or the light theme.
pub(crate) fn accents(dark: bool) -> Accents {
    if dark {
        Accents {
            accent: rgb(0x6B_B5_EE),
            accent_ground: rgb(0x1F_3F_58),
            good: rgb(0x3C_CF_A3),
            caution: rgb(0xF0_B3_57),
            wrong: rgb(0xFF_7A_6B),
            card: rgb(0x25_29_2E),
            line: rgb(0x33_38_3E),
        }
    } else {
        Accents {
            accent: rgb(0x0B_62_A4),
            accent_ground: rgb(0xD6_E8_F7),
            good: rgb(0x00_6B_4F),
            caution: rgb(0x9A_5B_00),
            wrong: rgb(0xB0_00_20),
            card: rgb(0xFF_FF_FF),
            line: rgb(0xDB_DE_E2),
        }
    }
}

/// Sets fonts, spacing and both themes up.
pub(crate) fn install(ctx: &Context) {
    let mut fonts = FontDefinitions::default();
    // Arrows, primes and superscripts that the proportional font lacks.
    fonts.families.entry(FontFamily::Proportional).or_default().push("Hack".into());
    ctx.set_fonts(fonts);
    for theme in [Theme::Light, Theme::Dark] {
        ctx.style_mut_of(theme, |style| shape(style, theme == Theme::Dark));
    }
}

fn shape(style: &mut Style, dark: bool) {
    style.text_styles = [
        (TextStyle::Small, FontId::proportional(11.0)),
        (TextStyle::Body, FontId::proportional(13.0)),
        (TextStyle::Button, FontId::proportional(13.0)),
        (TextStyle::Heading, FontId::proportional(16.0)),
        (TextStyle::Monospace, FontId::monospace(12.0)),
    ]
    .into();
    let spacing = &mut style.spacing;
    spacing.item_spacing = egui::vec2(6.0, 4.0);
    spacing.button_padding = egui::vec2(7.0, 2.0);
    spacing.interact_size = egui::vec2(32.0, ROW);
    spacing.slider_rail_height = 4.0;
    spacing.icon_width = 15.0;
    spacing.icon_width_inner = 9.0;
    spacing.icon_spacing = 5.0;
    spacing.menu_margin = Margin::same(6);
    spacing.window_margin = Margin::same(12);
    spacing.combo_width = 60.0;
    spacing.tooltip_width = 340.0;
    // Floating, in room that the columns keep for it: nothing moves when it comes.
    spacing.scroll =
        egui::style::ScrollStyle { floating: true, floating_allocated_width: 0.0, ..egui::style::ScrollStyle::thin() };
    style.interaction.tooltip_delay = 0.4;
    // A drag that misses a slider shall not mark words; what is worth copying has a button.
    style.interaction.selectable_labels = false;
    style.visuals = visuals(dark);
}

fn visuals(dark: bool) -> egui::Visuals {
    let accents = accents(dark);
    let mut v = if dark { egui::Visuals::dark() } else { egui::Visuals::light() };
    let (panel, text, weak, strong) = if dark {
        (rgb(0x1C_1F_23), rgb(0xCF_D4_DA), rgb(0x93_9B_A5), rgb(0xF2_F4_F7))
    } else {
        (rgb(0xF5_F6_F8), rgb(0x2A_2F_36), rgb(0x5C_65_70), rgb(0x0C_10_14))
    };
    let (rest, hover, press) = if dark {
        (rgb(0x2A_2E_34), rgb(0x35_3A_41), rgb(0x40_46_4E))
    } else {
        (rgb(0xE7_EA_EE), rgb(0xDB_E0_E6), rgb(0xCD_D4_DC))
    };
    v.panel_fill = panel;
    v.window_fill = if dark { rgb(0x23_27_2C) } else { rgb(0xFF_FF_FF) };
    v.window_stroke = Stroke::new(1.0, accents.line);
    v.extreme_bg_color = palette::ground(dark);
    v.faint_bg_color = if dark { rgb(0x21_25_29) } else { rgb(0xEE_F0_F3) };
    v.code_bg_color = v.faint_bg_color;
    v.weak_text_color = Some(weak);
    v.hyperlink_color = accents.accent;
    v.warn_fg_color = accents.caution;
    v.error_fg_color = accents.wrong;
    v.selection = Selection { bg_fill: accents.accent_ground, stroke: Stroke::new(1.0, strong) };
    v.slider_trailing_fill = true;
    v.window_corner_radius = CornerRadius::same(6);
    v.menu_corner_radius = CornerRadius::same(6);
    v.window_shadow = egui::Shadow {
        offset: [0, 4],
        blur: 16,
        spread: 0,
        color: Color32::from_black_alpha(if dark { 96 } else { 40 }),
    };
    v.popup_shadow = v.window_shadow;
    let edge = if dark { rgb(0x3A_40_47) } else { rgb(0xD3_D8_DE) };
    let corner_radius = CornerRadius::same(4);
    let widget = |fill: Color32, line: Stroke, text: Color32| WidgetVisuals {
        bg_fill: fill,
        weak_bg_fill: fill,
        bg_stroke: line,
        corner_radius,
        fg_stroke: Stroke::new(1.0, text),
        expansion: 0.0,
    };
    v.widgets = Widgets {
        noninteractive: widget(panel, Stroke::new(1.0, accents.line), text),
        inactive: widget(rest, Stroke::new(1.0, edge), text),
        hovered: widget(hover, Stroke::new(1.0, accents.line), strong),
        active: widget(press, Stroke::new(1.0, accents.accent), strong),
        open: widget(hover, Stroke::new(1.0, accents.line), strong),
    };
    v
}

fn rgb(hex: u32) -> Color32 {
    let [_, r, g, b] = hex.to_be_bytes();
    Color32::from_rgb(r, g, b)
}
