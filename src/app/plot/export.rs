//! Pictures of plots as PNG, and their data as CSV.

use std::fmt::Write as _;
use std::path::Path;

use egui::epaint::ClippedShape;
use egui::{Context, FontDefinitions, RawInput, Rect, Theme, Vec2, pos2};
use image::RgbaImage;

use super::raster::Rasterizer;

/// Passes until a plot's axes have the width that their labels need and its view fits the data.
const PASSES: usize = 4;

/// How a picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Size in points, as on the screen.
    pub size: Vec2,
    /// Pixels a point; 2 for print.
    pub scale: f32,
    /// Colours.
    pub theme: Theme,
}

impl Default for Sheet {
    fn default() -> Self {
        Self { size: Vec2::new(760.0, 560.0), scale: 2.0, theme: Theme::Light }
    }
}

/// Draws widgets into a picture, apart from the window: no pointer, no tooltip, and pixels as fine as asked for.
///
/// `fonts` and `memory` (zoomed views, above all) are those of the window's context, if it is to look alike.
pub fn picture(sheet: &Sheet, like: Option<&Context>, draw: impl FnMut(&mut egui::Ui)) -> RgbaImage {
    let mut raster = Rasterizer::default();
    let (ctx, shapes) = passes(sheet, like, draw, |textures| raster.update(textures));
    let primitives = ctx.tessellate(shapes, sheet.scale);
    let pixels = (sheet.size * sheet.scale).round();
    let ground = ctx.style_of(sheet.theme).visuals.panel_fill;
    raster.draw(&primitives, [pixels.x as u32, pixels.y as u32], sheet.scale, ground)
}

/// Draws widgets as [`picture`] does; gives the ground's colour and the shapes, in points.
pub fn shapes(
    sheet: &Sheet,
    like: Option<&Context>,
    draw: impl FnMut(&mut egui::Ui),
) -> (egui::Color32, Vec<ClippedShape>) {
    // Letters are written as letters: the pictures of them are not needed.
    let (ctx, shapes) = passes(sheet, like, draw, egui::TexturesDelta::clear);
    (ctx.style_of(sheet.theme).visuals.panel_fill, shapes)
}

/// Lets widgets be drawn until they have settled; `textures` hears what changes in the textures.
fn passes(
    sheet: &Sheet,
    like: Option<&Context>,
    mut draw: impl FnMut(&mut egui::Ui),
    mut textures: impl FnMut(&mut egui::TexturesDelta),
) -> (Context, Vec<ClippedShape>) {
    let ctx = Context::default();
    if let Some(like) = like {
        let data = like.data(Clone::clone);
        ctx.data_mut(|d| *d = data);
        let fonts: FontDefinitions = like.fonts(|f| f.definitions().clone());
        ctx.set_fonts(fonts);
        for theme in [Theme::Light, Theme::Dark] {
            ctx.set_style_of(theme, like.style_of(theme));
        }
    }
    ctx.set_theme(sheet.theme);
    // Paper is white.
    ctx.style_mut_of(Theme::Light, |style| style.visuals.panel_fill = egui::Color32::WHITE);
    let mut shapes = Vec::new();
    for pass in 0..PASSES {
        let mut input = RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), sheet.size)),
            time: Some(pass as f64),
            ..Default::default()
        };
        if let Some(viewport) = input.viewports.get_mut(&input.viewport_id) {
            viewport.native_pixels_per_point = Some(sheet.scale);
        }
        let mut output = ctx.run_ui(input, |ui| {
            egui::CentralPanel::default().show(ui, &mut draw);
        });
        textures(&mut output.textures_delta);
        shapes = output.shapes;
    }
    (ctx, shapes)
}

/// Writes a picture as PNG.
///
/// # Errors
/// The sentence to show: what could not be written, and why.
pub fn save_png(path: &Path, image: &RgbaImage) -> Result<(), String> {
    image
        .save_with_format(path, image::ImageFormat::Png)
        .map_err(|e| format!("the picture was not saved: {e}; choose another folder ({})", path.display()))
}

/// A table as CSV: a line of headers, then one line a row; cells that do not exist are empty.
pub fn csv(headers: &[String], rows: usize, cell: impl Fn(usize, usize) -> Option<f64>) -> String {
    let quoted =
        |h: &String| if h.contains([',', '"']) { format!("\"{}\"", h.replace('"', "\"\"")) } else { h.clone() };
    let mut text = headers.iter().map(quoted).collect::<Vec<_>>().join(",");
    text.push('\n');
    for row in 0..rows {
        for column in 0..headers.len() {
            if column > 0 {
                text.push(',');
            }
            if let Some(value) = cell(row, column).filter(|v| v.is_finite()) {
                // Writing to a string cannot fail.
                let _ = write!(text, "{value}");
            }
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_has_one_line_a_row_and_leaves_out_what_is_not_there() {
        let cells = [[Some(0.0), Some(1.5)], [Some(0.1), None], [Some(0.2), Some(f64::NAN)]];
        let text = csv(&["t (s)".into(), "x, \"raw\"".into()], 3, |r, c| cells[r][c]);
        assert_eq!(text, "t (s),\"x, \"\"raw\"\"\"\n0,1.5\n0.1,\n0.2,\n");
    }

    #[test]
    fn a_picture_has_the_pixels_asked_for_and_something_on_it() {
        let sheet = Sheet { size: Vec2::new(120.0, 60.0), scale: 2.0, theme: Theme::Light };
        let image = picture(&sheet, None, |ui| {
            ui.label("sindyscope");
        });
        assert_eq!(image.dimensions(), (240, 120));
        let ground = *image.get_pixel(230, 110);
        assert!(ground.0[0] > 230, "{ground:?}");
        let dark = image.pixels().filter(|p| p.0[0] < 120).count();
        assert!((100..4000).contains(&dark), "{dark} dark pixels of text");
    }

    #[test]
    fn a_picture_that_cannot_be_written_says_so() {
        let error = save_png(Path::new("/no/such/folder/a.png"), &RgbaImage::new(2, 2)).unwrap_err();
        assert!(error.contains("/no/such/folder/a.png"), "{error}");
    }
}
