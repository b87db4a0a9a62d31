//! What egui drew as an SVG document: the plot as it is on the screen, as lines and texts.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use egui::epaint::{ClippedShape, ColorMode, PathShape, TextShape};
use egui::{Color32, FontFamily, Mesh, Pos2, Rect, Shape, Stroke, Vec2};

use sindyscope_report::document::escape;

/// Width of the line that covers the seam between neighbouring areas of one colour, points.
const SEAM: f32 = 0.3;

/// Shapes on a ground of this size, points, as a document `width` mm wide.
pub fn svg(shapes: &[ClippedShape], size: Vec2, ground: Color32, width: f64) -> String {
    let mut out = String::new();
    let height = width * f64::from(size.y) / f64::from(size.x.max(1.0));
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height:.2}mm\" viewBox=\"0 0 {} {}\">\n\
         <rect width=\"{}\" height=\"{}\"{}/>\n",
        Short(size.x),
        Short(size.y),
        Short(size.x),
        Short(size.y),
        fill(ground)
    );
    let whole = Rect::from_min_size(Pos2::ZERO, size);
    let mut known: Vec<Rect> = Vec::new();
    for ClippedShape { clip_rect, shape, .. } in shapes {
        let clip = clip_rect.intersect(whole);
        if !clip.is_positive() {
            continue;
        }
        let mut drawn = String::new();
        draw(&mut drawn, shape);
        if drawn.is_empty() {
            continue;
        }
        if clip == whole {
            out.push_str(&drawn);
            continue;
        }
        let number = known.iter().position(|k| *k == clip).unwrap_or_else(|| {
            let _ = writeln!(out, "<clipPath id=\"clip{}\">{}</clipPath>", known.len(), rectangle(clip, ""));
            known.push(clip);
            known.len() - 1
        });
        let _ = write!(out, "<g clip-path=\"url(#clip{number})\">\n{drawn}</g>\n");
    }
    out.push_str("</svg>\n");
    out
}

/// A coordinate with as many decimals as print can show.
struct Short(f32);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let value = (self.0 * 100.0).round() / 100.0;
        // No minus before a zero.
        write!(f, "{}", if value == 0.0 { 0.0 } else { value })
    }
}

fn hex(color: Color32) -> (String, f32) {
    let [r, g, b, a] = color.to_srgba_unmultiplied();
    (format!("#{r:02x}{g:02x}{b:02x}"), f32::from(a) / 255.0)
}

fn paint(what: &str, color: Color32) -> String {
    let (color, opacity) = hex(color);
    let faded = if opacity < 1.0 { format!(" {what}-opacity=\"{opacity:.3}\"") } else { String::new() };
    format!(" {what}=\"{color}\"{faded}")
}

fn fill(color: Color32) -> String {
    if color == Color32::TRANSPARENT { " fill=\"none\"".to_owned() } else { paint("fill", color) }
}

fn line(width: f32, color: Color32) -> String {
    if width <= 0.0 || color == Color32::TRANSPARENT {
        return String::new();
    }
    format!("{} stroke-width=\"{}\" stroke-linejoin=\"round\"", paint("stroke", color), Short(width))
}

fn stroke(stroke: &Stroke) -> String {
    line(stroke.width, stroke.color)
}

fn rectangle(rect: Rect, look: &str) -> String {
    let [x, y, w, h] = [rect.left(), rect.top(), rect.width(), rect.height()].map(Short);
    format!("<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"{look}/>")
}

fn draw(out: &mut String, shape: &Shape) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| draw(out, shape)),
        Shape::Circle(c) => {
            let [x, y, r] = [c.center.x, c.center.y, c.radius].map(Short);
            let _ = writeln!(out, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{}{}/>", fill(c.fill), stroke(&c.stroke));
        }
        Shape::LineSegment { points, stroke } => {
            path(out, points, false, Color32::TRANSPARENT, &line(stroke.width, stroke.color));
        }
        Shape::Path(PathShape { points, closed, fill, stroke }) => {
            let color = match &stroke.color {
                ColorMode::Solid(color) => *color,
                // Colours along a path are egui's alone; no plot of this window has them.
                ColorMode::UV(_) => Color32::GRAY,
            };
            path(out, points, *closed, *fill, &line(stroke.width, color));
        }
        Shape::Rect(r) => {
            let look = format!("{}{}", fill(r.fill), stroke(&r.stroke));
            if r.fill != Color32::TRANSPARENT || !r.stroke.is_empty() {
                let _ = writeln!(out, "{}", rectangle(r.rect, &look));
            }
        }
        Shape::Text(text) => words(out, text),
        Shape::Mesh(mesh) => areas(out, mesh),
        // No plot of this window draws others.
        _ => {}
    }
}

fn path(out: &mut String, points: &[Pos2], closed: bool, inside: Color32, look: &str) {
    if look.is_empty() && inside == Color32::TRANSPARENT {
        return;
    }
    let mut data = String::new();
    let mut lifted = true;
    for p in points {
        if p.x.is_finite() && p.y.is_finite() {
            let _ = write!(data, "{}{} {}", if lifted { 'M' } else { 'L' }, Short(p.x), Short(p.y));
            lifted = false;
        } else {
            lifted = true;
        }
    }
    if data.is_empty() {
        return;
    }
    if closed {
        data.push('Z');
    }
    let _ = writeln!(out, "<path d=\"{data}\"{}{look}/>", fill(inside));
}

fn words(out: &mut String, text: &TextShape) {
    let Some(format) = text.galley.job.sections.first().map(|s| &s.format) else { return };
    let own = if format.color == Color32::PLACEHOLDER { text.fallback_color } else { format.color };
    let color = text.override_text_color.unwrap_or(own).gamma_multiply(text.opacity_factor);
    let family = if format.font_id.family == FontFamily::Monospace { "Hack" } else { "Ubuntu" };
    let turned = if text.angle == 0.0 { String::new() } else { format!(" rotate({})", Short(text.angle.to_degrees())) };
    for row in &text.galley.rows {
        let Some(first) = row.row.glyphs.first() else { continue };
        let words: String = row.row.glyphs.iter().map(|g| g.chr).collect();
        if words.trim().is_empty() {
            continue;
        }
        let at = row.pos + first.pos.to_vec2();
        let _ = writeln!(
            out,
            "<text xml:space=\"preserve\" transform=\"translate({} {}){turned}\" x=\"{}\" y=\"{}\" font-family=\"{family}, sans-serif\" \
             font-size=\"{}\"{}>{}</text>",
            Short(text.pos.x),
            Short(text.pos.y),
            Short(at.x),
            Short(at.y),
            Short(format.font_id.size),
            fill(color),
            escape(&words)
        );
    }
}

/// Triangles of one colour after the other as one area.
fn areas(out: &mut String, mesh: &Mesh) {
    let corners = |k: usize| [0, 1, 2].map(|j| mesh.vertices[mesh.indices[3 * k + j] as usize]);
    let color = |k: usize| {
        let mean =
            |part: fn(&Color32) -> u8| (corners(k).iter().map(|v| u16::from(part(&v.color))).sum::<u16>() / 3) as u8;
        Color32::from_rgba_premultiplied(mean(Color32::r), mean(Color32::g), mean(Color32::b), mean(Color32::a))
    };
    let count = mesh.indices.len() / 3;
    // Sharp areas alone: feathered edges are made of vertices without colour.
    let drawn: BTreeSet<usize> = (0..count).filter(|k| color(*k) != Color32::TRANSPARENT).collect();
    let mut data = String::new();
    let mut last = None;
    let mut end = |data: &mut String, color: Option<Color32>| {
        if let Some(color) = color.filter(|_| !data.is_empty()) {
            let seam = if color.is_opaque() { line(SEAM, color) } else { String::new() };
            let _ = writeln!(out, "<path d=\"{data}\"{}{seam}/>", fill(color));
        }
        data.clear();
    };
    for k in drawn {
        let color = color(k);
        if last != Some(color) {
            end(&mut data, last);
            last = Some(color);
        }
        for (j, corner) in corners(k).iter().enumerate() {
            let _ = write!(data, "{}{} {}", if j == 0 { 'M' } else { 'L' }, Short(corner.pos.x), Short(corner.pos.y));
        }
        data.push('Z');
    }
    end(&mut data, last);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::plot::export::{Sheet, shapes};
    use sindyscope_report::document::FigureFormat;

    #[test]
    fn a_plot_becomes_lines_and_words() {
        let sheet = Sheet { size: Vec2::new(300.0, 200.0), ..Sheet::default() };
        let curve: Vec<[f64; 2]> = (0..50).map(|k| [f64::from(k), f64::from(k % 7)]).collect();
        let drawn = shapes(&sheet, None, |ui| {
            let plot = egui_plot::Plot::new("p").x_axis_label("time <s> & more");
            plot.show(ui, |plot| plot.line(egui_plot::Line::new("", curve.clone()).color(Color32::RED)));
        });
        let text = svg(&drawn.1, sheet.size, Color32::WHITE, 90.0);
        assert!(text.starts_with("<svg ") && text.contains("width=\"90mm\" height=\"60.00mm\""), "{}", &text[..200]);
        assert!(text.contains("time &lt;s&gt; &amp; more</text>") && text.contains("stroke=\"#ff0000\""), "{text}");
        assert!(text.contains("clip-path=") && !text.contains("NaN"));
        for format in FigureFormat::ALL {
            let bytes = format.bytes(&text, "p").unwrap();
            let head: &[u8] = match format {
                FigureFormat::Svg => b"<svg",
                FigureFormat::Pdf => b"%PDF",
                FigureFormat::Png => b"\x89PNG",
            };
            assert!(bytes.starts_with(head), "{format:?}");
        }
    }

    #[test]
    fn neighbouring_triangles_of_a_colour_are_one_area() {
        let mut mesh = Mesh::default();
        mesh.add_colored_rect(Rect::from_min_size(Pos2::ZERO, Vec2::splat(2.0)), Color32::RED);
        mesh.add_colored_rect(Rect::from_min_size(Pos2::ZERO, Vec2::splat(1.0)), Color32::BLUE);
        let mut out = String::new();
        areas(&mut out, &mesh);
        assert_eq!(out.lines().count(), 2, "{out}");
        assert_eq!(out.matches('Z').count(), 4);
    }
}
