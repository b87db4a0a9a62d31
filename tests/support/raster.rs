//! Draws what egui drew into a picture, without a window or a graphics card, so that tests see the same pixels on every machine.
//!
//! egui's shapes come as triangles whose edges fade out (feathering), in premultiplied colours that are blended without
//! linearising; filling triangles is all there is to do.

use std::collections::HashMap;

use egui::epaint::{ClippedPrimitive, ImageData, Primitive, Vertex};
use egui::{Color32, Context, FullOutput, Mesh, Rect, TextureId, TexturesDelta};
use egui_kittest::TestRenderer;
use image::RgbaImage;

/// Pictures without a graphics card, alike on every machine.
#[derive(Default)]
pub(crate) struct Software(Rasterizer);

impl TestRenderer for Software {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        self.0.update(delta);
    }

    fn render(&mut self, ctx: &Context, output: &FullOutput) -> Result<RgbaImage, String> {
        let primitives = ctx.tessellate(output.shapes.clone(), output.pixels_per_point);
        let size = ctx.content_rect().size() * output.pixels_per_point;
        let ground = ctx.global_style().visuals.panel_fill;
        Ok(self.0.draw(&primitives, [size.x as u32, size.y as u32], output.pixels_per_point, ground))
    }
}

/// Textures as egui handed them over: its font atlas, in the main.
#[derive(Default)]
struct Rasterizer {
    textures: HashMap<TextureId, Texture>,
}

struct Texture {
    size: [usize; 2],
    pixels: Vec<[f32; 4]>,
}

impl Rasterizer {
    /// Takes over what changed of the textures; textures that egui gave up are kept until they are set anew.
    fn update(&mut self, delta: &mut TexturesDelta) {
        let changes = delta.set.drain().flat_map(|(id, changes)| changes.into_iter().map(move |c| (id, c)));
        for (id, change) in changes {
            let ImageData::Color(image) = &change.image;
            let pixels = image.pixels.iter().map(|c| floats(*c));
            match change.pos {
                None => {
                    self.textures.insert(id, Texture { size: image.size, pixels: pixels.collect() });
                }
                Some([x, y]) => {
                    let Some(texture) = self.textures.get_mut(&id) else { continue };
                    let rows = texture.pixels.chunks_mut(texture.size[0]).skip(y);
                    let width = image.size[0];
                    let pixels: Vec<_> = pixels.collect();
                    for (row, patch) in rows.zip(pixels.chunks(width)) {
                        if let Some(place) = row.get_mut(x..x + width) {
                            place.copy_from_slice(patch);
                        }
                    }
                }
            }
        }
        delta.free.clear();
    }

    /// Draws tessellated shapes on a ground of one colour.
    fn draw(
        &self,
        primitives: &[ClippedPrimitive],
        size_in_pixels: [u32; 2],
        pixels_per_point: f32,
        ground: Color32,
    ) -> RgbaImage {
        let [width, height] = size_in_pixels;
        let mut canvas =
            Canvas { width: width as usize, pixels: vec![floats(ground); width as usize * height as usize] };
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            let Primitive::Mesh(mesh) = primitive else { continue };
            let clip = pixel_clip(*clip_rect, pixels_per_point, width, height);
            canvas.mesh(mesh, self.textures.get(&mesh.texture_id), pixels_per_point, clip);
        }
        let bytes = canvas.pixels.iter().flat_map(|p| p.map(|v| (v * 255.0).round().clamp(0.0, 255.0) as u8)).collect();
        RgbaImage::from_raw(width, height, bytes).unwrap_or_default()
    }
}

/// Columns and rows that may be drawn: from, to (exclusive).
#[derive(Clone, Copy)]
struct Clip {
    x: (usize, usize),
    y: (usize, usize),
}

fn pixel_clip(rect: Rect, pixels_per_point: f32, width: u32, height: u32) -> Clip {
    let pixel = |v: f32, most: u32| (v * pixels_per_point).round().clamp(0.0, most as f32) as usize;
    Clip {
        x: (pixel(rect.min.x, width), pixel(rect.max.x, width)),
        y: (pixel(rect.min.y, height), pixel(rect.max.y, height)),
    }
}

struct Canvas {
    width: usize,
    pixels: Vec<[f32; 4]>,
}

impl Canvas {
    fn mesh(&mut self, mesh: &Mesh, texture: Option<&Texture>, pixels_per_point: f32, clip: Clip) {
        for corners in mesh.indices.chunks_exact(3) {
            let vertex = |i: usize| mesh.vertices.get(corners[i] as usize);
            if let (Some(a), Some(b), Some(c)) = (vertex(0), vertex(1), vertex(2)) {
                self.triangle([*a, *b, *c], texture, f64::from(pixels_per_point), clip);
            }
        }
    }

    fn triangle(&mut self, mut v: [Vertex; 3], texture: Option<&Texture>, scale: f64, clip: Clip) {
        let place = |v: &Vertex| [f64::from(v.pos.x) * scale, f64::from(v.pos.y) * scale];
        let mut p = [place(&v[0]), place(&v[1]), place(&v[2])];
        let double_area =
            |p: &[[f64; 2]; 3]| (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        let mut area = double_area(&p);
        if area < 0.0 {
            v.swap(1, 2);
            p.swap(1, 2);
            area = -area;
        }
        if !(area > 0.0 && area.is_finite()) {
            return;
        }
        // Edge i runs opposite to corner i; its function is positive inside, and is that corner's weight times the area.
        let edges = [Edge::new(p[1], p[2]), Edge::new(p[2], p[0]), Edge::new(p[0], p[1])];
        let span = |k: usize, (from, to): (usize, usize)| {
            let low = p.iter().map(|q| q[k]).fold(f64::INFINITY, f64::min);
            let high = p.iter().map(|q| q[k]).fold(f64::NEG_INFINITY, f64::max);
            ((low.floor().max(from as f64)) as usize, (high.ceil().min(to as f64)).max(0.0) as usize)
        };
        let (rows, columns) = (span(1, clip.y), span(0, clip.x));
        let solid = v.iter().all(|q| q.uv == v[0].uv).then(|| sample(texture, v[0].uv.x, v[0].uv.y));
        let colors = v.map(|q| floats(q.color));
        for row in rows.0..rows.1 {
            let y = row as f64 + 0.5;
            // The stretch of the row that may lie inside, a pixel wider than computed to be safe against rounding.
            let (mut from, mut to) = (columns.0 as f64, columns.1 as f64);
            for e in &edges {
                let crossing = -(e.b * y + e.c) / e.a;
                if e.a > 0.0 {
                    from = from.max(crossing - 1.5);
                } else if e.a < 0.0 {
                    to = to.min(crossing + 1.5);
                }
            }
            let (from, to) = (from.max(0.0) as usize, to.max(0.0) as usize);
            for column in from..to.min(columns.1) {
                let x = column as f64 + 0.5;
                let at = [edges[0].at(x, y), edges[1].at(x, y), edges[2].at(x, y)];
                if !edges.iter().zip(at).all(|(e, value)| value > 0.0 || (value == 0.0 && e.owns_border)) {
                    continue;
                }
                let w = at.map(|value| (value / area) as f32);
                let mix = |pick: [f32; 3]| w[0] * pick[0] + w[1] * pick[1] + w[2] * pick[2];
                let texel = solid.unwrap_or_else(|| sample(texture, mix(v.map(|q| q.uv.x)), mix(v.map(|q| q.uv.y))));
                let over: [f32; 4] = std::array::from_fn(|k| mix(colors.map(|c| c[k])) * texel[k]);
                let under = &mut self.pixels[row * self.width + column];
                for k in 0..4 {
                    under[k] = over[k] + under[k] * (1.0 - over[3]);
                }
            }
        }
    }
}

/// The line through two corners as a·x + b·y + c, zero on it.
struct Edge {
    a: f64,
    b: f64,
    c: f64,
    /// Of two triangles that share an edge, exactly one draws a pixel that lies right on it.
    owns_border: bool,
}

impl Edge {
    fn new(p: [f64; 2], q: [f64; 2]) -> Self {
        let (a, b) = (p[1] - q[1], q[0] - p[0]);
        Self { a, b, c: p[0] * q[1] - q[0] * p[1], owns_border: a > 0.0 || (a == 0.0 && b > 0.0) }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        self.a * x + self.b * y + self.c
    }
}

fn floats(c: Color32) -> [f32; 4] {
    c.to_array().map(|v| f32::from(v) / 255.0)
}

/// The texture's colour between its four nearest pixels; white without a texture.
fn sample(texture: Option<&Texture>, u: f32, v: f32) -> [f32; 4] {
    let Some(Texture { size: [width, height], pixels }) = texture else { return [1.0; 4] };
    let place = |t: f32, n: usize| {
        let x = (t * n as f32 - 0.5).clamp(0.0, n as f32 - 1.0);
        let low = x.floor();
        (low as usize, (low as usize + 1).min(n - 1), x - low)
    };
    if *width == 0 || *height == 0 {
        return [1.0; 4];
    }
    let ((x0, x1, fx), (y0, y1, fy)) = (place(u, *width), place(v, *height));
    let at = |x: usize, y: usize| pixels[y * width + x];
    let (a, b, c, d) = (at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1));
    std::array::from_fn(|k| {
        let (top, bottom) = (a[k] + (b[k] - a[k]) * fx, c[k] + (d[k] - c[k]) * fx);
        top + (bottom - top) * fy
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Shape, pos2, vec2};

    fn vertex(x: f32, y: f32, color: Color32) -> Vertex {
        Vertex { pos: pos2(x, y), uv: pos2(0.0, 0.0), color }
    }

    fn draw(mesh: Mesh, clip: Rect) -> RgbaImage {
        let primitive = ClippedPrimitive { clip_rect: clip, primitive: Primitive::Mesh(mesh) };
        Rasterizer::default().draw(&[primitive], [40, 40], 1.0, Color32::BLACK)
    }

    #[test]
    fn triangles_that_share_an_edge_neither_overlap_nor_leave_a_gap() {
        let half = Color32::from_rgba_premultiplied(100, 100, 100, 128);
        for corner in [0.0, 0.3, 0.5, 1.7] {
            let vertices = vec![
                vertex(3.0 + corner, 3.0, half),
                vertex(35.0, 3.0, half),
                vertex(35.0, 35.0, half),
                vertex(3.0, 35.0 - corner, half),
            ];
            let mesh = Mesh { vertices, indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() };
            let image = draw(mesh, Rect::EVERYTHING);
            for y in 6..32 {
                for x in 6..32 {
                    assert_eq!(image.get_pixel(x, y).0[0], 100, "{x} {y}, corner {corner}");
                }
            }
        }
    }

    #[test]
    fn nothing_is_drawn_outside_the_clip() {
        let mut mesh = Mesh::default();
        mesh.add_colored_rect(Rect::from_min_size(pos2(-1e6, -50.0), vec2(2e6, 500.0)), Color32::WHITE);
        let image = draw(mesh, Rect::from_min_max(pos2(10.0, 5.0), pos2(20.0, 15.0)));
        let white = image.enumerate_pixels().filter(|(_, _, p)| p.0[0] == 255).count();
        assert_eq!(white, 100);
    }

    #[test]
    fn a_circle_covers_its_area() {
        let ctx = Context::default();
        let input = egui::RawInput {
            screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), vec2(40.0, 40.0))),
            ..Default::default()
        };
        let mut output = ctx.run_ui(input, |ui| {
            ui.painter().add(Shape::circle_filled(pos2(20.0, 20.0), 12.0, Color32::WHITE));
        });
        let mut raster = Rasterizer::default();
        raster.update(&mut output.textures_delta);
        let primitives = ctx.tessellate(output.shapes, 1.0);
        let image = raster.draw(&primitives, [40, 40], 1.0, Color32::BLACK);
        let area: f64 = image.pixels().map(|p| f64::from(p.0[0]) / 255.0).sum();
        // Feathering moves the edge by a fraction of a pixel: 2 % of the area of this circle.
        assert!((area / (std::f64::consts::PI * 144.0) - 1.0).abs() < 0.03, "{area}");
    }
}
