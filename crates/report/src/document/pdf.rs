//! Drawings as PDF: every SVG document a page, lines as vectors, letters of embedded fonts that can be searched and copied.
//!
//! The drawing is read by the library that draws it on the screen too, so a page looks as its preview does. Written is what
//! reports use: plain colours, dashes, clips, opacity and text (PDF 1.7, ISO 32000-1). Nothing in the file depends on when or where
//! it was made.

use std::collections::BTreeMap;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{
    CidFontType, FontFlags, LineCapStyle, LineJoinStyle, SystemInfo, TextRenderingMode, UnicodeCmap,
};
use pdf_writer::{Content, Filter, Finish as _, Name, Pdf, Rect, Ref, Str, TextStr};
use resvg::tiny_skia::{PathSegment, Transform};
use resvg::usvg::{self, fontdb};
use skrifa::instance::{LocationRef, Size};
use skrifa::raw::TableProvider as _;
use skrifa::{FontRef, GlyphId, MetadataProvider as _};
use subsetter::GlyphRemapper;

use super::font::Fonts;
use super::report::ReportError;

/// Points of a page for each pixel of an SVG document: 72 and 96 to the inch.
const POINTS_A_PIXEL: f32 = 0.75;

/// Widths and font boxes are told in thousandths of the font's size.
const PER_EM: f32 = 1000.0;

/// A document of these pages.
///
/// # Errors
/// A page is no SVG document, or a font cannot be embedded.
pub(super) fn document(pages: &[String], title: &str, fonts: &Fonts) -> Result<Vec<u8>, ReportError> {
    let mut writer = Writer { pdf: Pdf::new(), next: Ref::new(1), fonts: BTreeMap::new(), opacities: BTreeMap::new() };
    let [catalog, tree, info] = [(); 3].map(|()| writer.next.bump());
    let trees = pages.iter().map(|svg| fonts.tree(svg)).collect::<Result<Vec<_>, _>>()?;
    let drawn: Vec<(Ref, Ref, usvg::Size)> = trees.iter().map(|tree| writer.page(tree)).collect();
    let embedded = writer.embed(trees.first())?;
    let states: Vec<(u8, Ref)> = writer.opacities.iter().map(|(opacity, id)| (*opacity, *id)).collect();
    let pdf = &mut writer.pdf;
    for (opacity, id) in &states {
        let share = f32::from(*opacity) / 255.0;
        pdf.ext_graphics(*id).non_stroking_alpha(share).stroking_alpha(share);
    }
    for (page, content, size) in &drawn {
        let mut page = pdf.page(*page);
        page.parent(tree).contents(*content);
        page.media_box(Rect::new(0.0, 0.0, size.width() * POINTS_A_PIXEL, size.height() * POINTS_A_PIXEL));
        let mut resources = page.resources();
        let mut dictionary = resources.fonts();
        for (name, id) in &embedded {
            dictionary.pair(Name(name.as_bytes()), *id);
        }
        dictionary.finish();
        let mut dictionary = resources.ext_g_states();
        for (opacity, id) in &states {
            dictionary.pair(Name(opacity_name(*opacity).as_bytes()), *id);
        }
    }
    pdf.pages(tree).kids(drawn.iter().map(|d| d.0)).count(i32::try_from(drawn.len()).unwrap_or(i32::MAX));
    pdf.document_info(info).title(TextStr(title)).producer(TextStr(concat!("Sindyscope ", env!("CARGO_PKG_VERSION"))));
    let mut root = pdf.catalog(catalog);
    root.pages(tree).lang(TextStr("en"));
    root.viewer_preferences().display_doc_title(true);
    root.finish();
    Ok(writer.pdf.finish())
}

struct Writer {
    pdf: Pdf,
    next: Ref,
    /// The fonts that letters were taken of, each with its letters.
    fonts: BTreeMap<FontKey, Letters>,
    /// Graphics states by their opacity, of 255.
    opacities: BTreeMap<u8, Ref>,
}

/// A font by its place among those that were met.
type FontKey = usize;

struct Letters {
    id: fontdb::ID,
    object: Ref,
    remapper: GlyphRemapper,
    /// The text that each letter of the embedded font stands for.
    texts: BTreeMap<u16, String>,
    /// Units of the font's grid to its size.
    units_per_em: f32,
    /// Advance widths of the letters of the embedded font, of its size.
    widths: BTreeMap<u16, f32>,
}

fn font_name(key: FontKey) -> String {
    format!("F{key}")
}

fn opacity_name(opacity: u8) -> String {
    format!("O{opacity}")
}

fn deflated(data: &[u8]) -> Vec<u8> {
    use std::io::Write as _;
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(6));
    // Writing to memory cannot fail; were it to, the part that was written is what there is.
    let _ = encoder.write_all(data);
    encoder.finish().unwrap_or_default()
}

impl Writer {
    /// Draws a page; gives the page, its content, and its size in pixels.
    fn page(&mut self, tree: &usvg::Tree) -> (Ref, Ref, usvg::Size) {
        let (page, content) = (self.next.bump(), self.next.bump());
        let mut out = Content::new();
        // PDF counts upwards from the lower edge, and in points.
        let scale = POINTS_A_PIXEL;
        out.transform([scale, 0.0, 0.0, -scale, 0.0, tree.size().height() * scale]);
        self.group(&mut out, tree.root(), tree.fontdb(), 255);
        let data = deflated(&out.finish());
        self.pdf.stream(content, &data).filter(Filter::FlateDecode);
        (page, content, tree.size())
    }

    fn group(&mut self, out: &mut Content, group: &usvg::Group, fonts: &fontdb::Database, opacity: u8) {
        out.save_state();
        if group.transform() != Transform::identity() {
            out.transform(matrix(group.transform()));
        }
        if let Some(clip) = group.clip_path() {
            clip_to(out, clip);
        }
        // Parts of reports that are faded do not lie on each other, so each may be faded by itself.
        let opacity = product(opacity, group.opacity().get());
        for node in group.children() {
            match node {
                usvg::Node::Group(group) => self.group(out, group, fonts, opacity),
                usvg::Node::Path(path) => self.path(out, path, opacity),
                usvg::Node::Text(text) => self.text(out, text, fonts, opacity),
                // No report holds a picture of pixels.
                usvg::Node::Image(_) => {}
            }
        }
        out.restore_state();
    }

    fn path(&mut self, out: &mut Content, path: &usvg::Path, opacity: u8) {
        if !path.is_visible() {
            return;
        }
        if let Some(fill) = path.fill() {
            self.fade(out, product(opacity, fill.opacity().get()));
            let [r, g, b] = color(fill.paint());
            out.set_fill_rgb(r, g, b);
            trace(out, path.data());
            match fill.rule() {
                usvg::FillRule::NonZero => out.fill_nonzero(),
                usvg::FillRule::EvenOdd => out.fill_even_odd(),
            };
        }
        if let Some(stroke) = path.stroke() {
            self.fade(out, product(opacity, stroke.opacity().get()));
            pen(out, stroke);
            trace(out, path.data());
            out.stroke();
        }
    }

    fn text(&mut self, out: &mut Content, text: &usvg::Text, fonts: &fontdb::Database, opacity: u8) {
        for span in text.layouted().iter().filter(|span| span.visible) {
            let fill = span.fill.as_ref().filter(|f| f.opacity().get() > 0.0);
            let mode = match (fill, &span.stroke) {
                (Some(_), Some(_)) => TextRenderingMode::FillStroke,
                (Some(_), None) => TextRenderingMode::Fill,
                (None, Some(_)) => TextRenderingMode::Stroke,
                (None, None) => continue,
            };
            out.save_state();
            self.fade(out, product(opacity, fill.map_or(1.0, |f| f.opacity().get())));
            if let Some(fill) = fill {
                let [r, g, b] = color(fill.paint());
                out.set_fill_rgb(r, g, b);
            }
            if let Some(stroke) = &span.stroke {
                pen(out, stroke);
            }
            out.begin_text();
            out.set_text_rendering_mode(mode);
            let mut glyphs = span.positioned_glyphs.as_slice();
            while let Some(first) = glyphs.first() {
                let count = self.line(out, glyphs, first, fonts);
                glyphs = &glyphs[count.max(1)..];
            }
            out.end_text();
            out.restore_state();
        }
    }

    /// Writes the letters that stand on one line in one font and size; gives how many those are.
    fn line(
        &mut self,
        out: &mut Content,
        glyphs: &[usvg::layout::PositionedGlyph],
        first: &usvg::layout::PositionedGlyph,
        fonts: &fontdb::Database,
    ) -> usize {
        let Some(key) = self.font(first.font, fonts) else { return 0 };
        let place = first.outline_transform();
        let Some(letters) = self.fonts.get_mut(&key) else { return 0 };
        let per_em = letters.units_per_em;
        // The font's size is 1: the matrix holds it.
        let shape = [place.sx, place.ky, place.kx, place.sy].map(|v| v * per_em);
        out.set_font(Name(font_name(key).as_bytes()), 1.0);
        out.set_text_matrix([shape[0], shape[1], shape[2], shape[3], place.tx, place.ty]);
        let mut show = out.show_positioned();
        let mut items = show.items();
        let (mut at, mut count) = ((place.tx, place.ty), 0);
        // Letters that follow each other without a gap are one string.
        let mut together: Vec<u8> = Vec::new();
        for glyph in glyphs {
            let own = glyph.outline_transform();
            if glyph.font != first.font || [own.sx, own.ky, own.kx, own.sy].map(|v| v * per_em) != shape {
                break;
            }
            // How far it stands from where the letter before ended, along the line and across it.
            let off = (own.tx - at.0, own.ty - at.1);
            let length = shape[0].hypot(shape[1]);
            let along = (off.0 * shape[0] + off.1 * shape[1]) / (length * length);
            let across = (off.0 * shape[1] - off.1 * shape[0]) / (length * length);
            if across.abs() > 1e-3 || along.abs() > 5.0 {
                break;
            }
            if along.abs() > 5e-4 {
                if !together.is_empty() {
                    items.show(Str(&std::mem::take(&mut together)));
                }
                items.adjust(-along * PER_EM);
            }
            let Ok(old) = u16::try_from(glyph.id.0) else { break };
            let new = letters.remapper.remap(old);
            letters.texts.entry(new).or_insert_with(|| glyph.text.clone());
            let width = letters.widths.get(&old).copied().unwrap_or_default();
            together.extend(new.to_be_bytes());
            at = (own.tx + width * shape[0], own.ty + width * shape[1]);
            count += 1;
        }
        if !together.is_empty() {
            items.show(Str(&together));
        }
        count
    }

    /// The place of a font among those met; none of a font that cannot be read.
    fn font(&mut self, id: fontdb::ID, fonts: &fontdb::Database) -> Option<FontKey> {
        if let Some((key, _)) = self.fonts.iter().find(|(_, letters)| letters.id == id) {
            return Some(*key);
        }
        let (units_per_em, widths) = fonts.with_face_data(id, |data, index| {
            let font = FontRef::from_index(data, index).ok()?;
            let per_em = f32::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
            let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
            let width = |glyph: u16| metrics.advance_width(GlyphId::new(u32::from(glyph))).map(|w| (glyph, w / per_em));
            let count = font.maxp().ok()?.num_glyphs();
            Some((per_em, (0..count).filter_map(width).collect()))
        })??;
        let key = self.fonts.len();
        let (object, remapper) = (self.next.bump(), GlyphRemapper::new());
        self.fonts.insert(key, Letters { id, object, remapper, texts: BTreeMap::new(), units_per_em, widths });
        Some(key)
    }

    /// Sets the opacity of what follows.
    fn fade(&mut self, out: &mut Content, opacity: u8) {
        if opacity == 255 && self.opacities.is_empty() {
            return;
        }
        let next = &mut self.next;
        self.opacities.entry(opacity).or_insert_with(|| next.bump());
        out.set_parameters(Name(opacity_name(opacity).as_bytes()));
    }

    /// Writes the fonts, each with no more than the letters that were used; gives their names and objects.
    fn embed(&mut self, tree: Option<&usvg::Tree>) -> Result<Vec<(String, Ref)>, ReportError> {
        let Some(database) = tree.map(usvg::Tree::fontdb) else { return Ok(Vec::new()) };
        let mut embedded = Vec::new();
        for (key, letters) in &self.fonts {
            let failed = |problem: String| ReportError::Picture(format!("a font cannot be embedded: {problem}"));
            let whole = database.with_face_data(letters.id, |data, index| (data.to_vec(), index));
            let (data, index) = whole.ok_or_else(|| failed("its file is gone".into()))?;
            let font = FontRef::from_index(&data, index).map_err(|e| failed(e.to_string()))?;
            let subset = subsetter::subset(&data, index, &letters.remapper).map_err(|e| failed(e.to_string()))?;
            let face = database.face(letters.id);
            let family = face.map_or("Font", |f| f.post_script_name.as_str());
            // Six letters and a plus tell that the font is not whole (ISO 32000-1, 9.6.4).
            let name = format!("{}+{family}", tag(&subset));
            let [cid, descriptor, file, unicode] = [(); 4].map(|()| self.next.bump());
            let metrics = font.metrics(Size::unscaled(), LocationRef::default());
            let share = |value: f32| value / letters.units_per_em * PER_EM;
            let system = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };
            self.pdf
                .type0_font(letters.object)
                .base_font(Name(name.as_bytes()))
                .encoding_predefined(Name(b"Identity-H"))
                .descendant_font(cid)
                .to_unicode(unicode);
            let mut cid_font = self.pdf.cid_font(cid);
            cid_font.subtype(CidFontType::Type2).base_font(Name(name.as_bytes())).system_info(system);
            cid_font.font_descriptor(descriptor).default_width(0.0).cid_to_gid_map_predefined(Name(b"Identity"));
            let widths = letters.remapper.remapped_gids();
            let widths = widths.map(|old| letters.widths.get(&old).copied().unwrap_or_default() * PER_EM);
            cid_font.widths().consecutive(0, widths);
            cid_font.finish();
            let bounds = metrics.bounds.unwrap_or_default();
            let mut flags = FontFlags::SYMBOLIC;
            flags.set(FontFlags::FIXED_PITCH, metrics.is_monospace);
            self.pdf
                .font_descriptor(descriptor)
                .name(Name(name.as_bytes()))
                .flags(flags)
                .bbox(Rect::new(share(bounds.x_min), share(bounds.y_min), share(bounds.x_max), share(bounds.y_max)))
                .italic_angle(metrics.italic_angle)
                .ascent(share(metrics.ascent))
                .descent(share(metrics.descent))
                .cap_height(share(metrics.cap_height.unwrap_or(metrics.ascent)))
                .stem_v(STEM)
                .font_file2(file);
            let data = deflated(&subset);
            let length = i32::try_from(subset.len()).unwrap_or(i32::MAX);
            self.pdf.stream(file, &data).filter(Filter::FlateDecode).pair(Name(b"Length1"), length);
            let system = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"UCS"), supplement: 0 };
            let mut map = UnicodeCmap::new(Name(b"Text"), system);
            for (letter, text) in &letters.texts {
                map.pair_with_multiple(*letter, text.chars());
            }
            let data = deflated(&map.finish());
            self.pdf.cmap(unicode, &data).filter(Filter::FlateDecode);
            embedded.push((font_name(*key), letters.object));
        }
        Ok(embedded)
    }
}

/// Width of a stem, thousandths of the size; readers that draw the embedded letters do not use it.
const STEM: f32 = 80.0;

/// Six capitals that differ with what a font holds.
fn tag(data: &[u8]) -> String {
    let mut crc = flate2::Crc::new();
    crc.update(data);
    let letter = |k: u32| char::from(b'A' + (crc.sum() / 26u32.pow(k) % 26) as u8);
    (0..6).map(letter).collect()
}

fn product(opacity: u8, factor: f32) -> u8 {
    (f32::from(opacity) * factor).round() as u8
}

fn matrix(t: Transform) -> [f32; 6] {
    [t.sx, t.ky, t.kx, t.sy, t.tx, t.ty]
}

/// A plain colour; reports have no others.
fn color(paint: &usvg::Paint) -> [f32; 3] {
    match paint {
        usvg::Paint::Color(c) => [c.red, c.green, c.blue].map(|part| f32::from(part) / 255.0),
        _ => [0.0; 3],
    }
}

fn pen(out: &mut Content, stroke: &usvg::Stroke) {
    let [r, g, b] = color(stroke.paint());
    out.set_stroke_rgb(r, g, b);
    out.set_line_width(stroke.width().get());
    out.set_line_cap(match stroke.linecap() {
        usvg::LineCap::Butt => LineCapStyle::ButtCap,
        usvg::LineCap::Round => LineCapStyle::RoundCap,
        usvg::LineCap::Square => LineCapStyle::ProjectingSquareCap,
    });
    out.set_line_join(match stroke.linejoin() {
        usvg::LineJoin::Round => LineJoinStyle::RoundJoin,
        usvg::LineJoin::Bevel => LineJoinStyle::BevelJoin,
        usvg::LineJoin::Miter | usvg::LineJoin::MiterClip => LineJoinStyle::MiterJoin,
    });
    out.set_miter_limit(stroke.miterlimit().get());
    let dashes = stroke.dasharray().unwrap_or_default();
    out.set_dash_pattern(dashes.iter().copied(), stroke.dashoffset());
}

/// Keeps what follows inside a clip's shapes.
fn clip_to(out: &mut Content, clip: &usvg::ClipPath) {
    fn outlines(out: &mut Content, group: &usvg::Group, to: Transform) {
        for node in group.children() {
            match node {
                usvg::Node::Group(group) => outlines(out, group, to.pre_concat(group.transform())),
                usvg::Node::Path(path) => {
                    if let Some(moved) = path.data().clone().transform(to) {
                        trace(out, &moved);
                    }
                }
                usvg::Node::Text(_) | usvg::Node::Image(_) => {}
            }
        }
    }
    if let Some(outer) = clip.clip_path() {
        clip_to(out, outer);
    }
    outlines(out, clip.root(), clip.transform().pre_concat(clip.root().transform()));
    out.clip_nonzero().end_path();
}

fn trace(out: &mut Content, path: &resvg::tiny_skia::Path) {
    let mut last = (0.0, 0.0);
    for segment in path.segments() {
        match segment {
            PathSegment::MoveTo(p) => {
                out.move_to(p.x, p.y);
                last = (p.x, p.y);
            }
            PathSegment::LineTo(p) => {
                out.line_to(p.x, p.y);
                last = (p.x, p.y);
            }
            PathSegment::QuadTo(c, p) => {
                // A parabola as the cubic through the same points.
                let toward = |from: f32, to: f32| from + (to - from) * 2.0 / 3.0;
                out.cubic_to(toward(last.0, c.x), toward(last.1, c.y), toward(p.x, c.x), toward(p.y, c.y), p.x, p.y);
                last = (p.x, p.y);
            }
            PathSegment::CubicTo(a, b, p) => {
                out.cubic_to(a.x, a.y, b.x, b.y, p.x, p.y);
                last = (p.x, p.y);
            }
            PathSegment::Close => {
                out.close_path();
            }
        }
    }
}
