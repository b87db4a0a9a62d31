//! A canvas of SVG. What its pieces look like is said by the style sheet of the page they stand on.

use std::fmt::{Display, Write};

/// Text made safe for XML and HTML, in elements and in attributes.
pub(crate) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' => out.push(c),
            // XML has no way to write these.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// Text made safe, its superscript digits set as smaller raised ones: few fonts have them all.
fn raised(text: &str) -> String {
    let Some(start) = text.find(|c| digit_of_superscript(c).is_some()) else { return escape(text) };
    let (before, from) = text.split_at(start);
    let end = from.find(|c| digit_of_superscript(c).is_none()).unwrap_or(from.len());
    let (digits, after) = from.split_at(end);
    let digits: String = digits.chars().filter_map(digit_of_superscript).collect();
    let mut out = format!("{}<tspan font-size=\"0.75em\" dy=\"-0.42em\">{digits}</tspan>", escape(before));
    if !after.is_empty() {
        // Back to the line: 0.42 em of the smaller size.
        let _ = write!(out, "<tspan dy=\"0.315em\">{}</tspan>", raised(after));
    }
    out
}

/// The digit or minus that a superscript stands for.
pub(crate) fn digit_of_superscript(c: char) -> Option<char> {
    match c {
        '⁻' => Some('−'),
        '¹' => Some('1'),
        '²' => Some('2'),
        '³' => Some('3'),
        '⁰' | '⁴'..='⁹' => char::from_digit(c as u32 - '⁰' as u32, 10),
        _ => None,
    }
}

/// Coordinates with as many decimals as a print at 300 dpi can show.
pub(crate) struct Coordinate(pub(crate) f64);

impl Display for Coordinate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let tenths = (self.0 * 10.0).round() / 10.0;
        // No minus before a zero.
        write!(f, "{}", if tenths == 0.0 { 0.0 } else { tenths })
    }
}

/// A canvas that grows as it is drawn on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Svg(pub(crate) String);

/// Stands for the figure's number in the names within a drawing; [`escape`] lets it into no text.
const OWN: &str = "\u{1}";

/// Where a text stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    pub(crate) fn line(&mut self, class: &str, from: (f64, f64), to: (f64, f64)) {
        let _ = writeln!(
            self.0,
            "<line class=\"{class}\" x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\"/>",
            Coordinate(from.0),
            Coordinate(from.1),
            Coordinate(to.0),
            Coordinate(to.1)
        );
    }

    pub(crate) fn rect(&mut self, class: &str, at: (f64, f64), size: (f64, f64)) {
        self.styled_rect(class, "", at, size);
    }

    /// A rectangle with attributes of its own.
    pub(crate) fn styled_rect(&mut self, class: &str, attributes: &str, at: (f64, f64), size: (f64, f64)) {
        let _ = writeln!(
            self.0,
            "<rect class=\"{class}\"{attributes} x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            Coordinate(at.0),
            Coordinate(at.1),
            Coordinate(size.0.max(0.0)),
            Coordinate(size.1.max(0.0))
        );
    }

    pub(crate) fn text(&mut self, class: &str, at: (f64, f64), anchor: Anchor, text: &str) {
        if text.is_empty() {
            return;
        }
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let _ = writeln!(
            self.0,
            "<text class=\"{class}\" xml:space=\"preserve\" x=\"{}\" y=\"{}\"{anchor}>{}</text>",
            Coordinate(at.0),
            Coordinate(at.1),
            raised(text)
        );
    }

    /// An area within an outline that is given as the data of a path.
    pub(crate) fn area(&mut self, class: &str, attributes: &str, outline: &str) {
        let _ = writeln!(self.0, "<path class=\"{class}\"{attributes} d=\"{outline}\"/>");
    }

    /// A round dot.
    pub(crate) fn circle(&mut self, class: &str, at: (f64, f64), radius: f64) {
        let (x, y) = (Coordinate(at.0), Coordinate(at.1));
        let _ = writeln!(self.0, "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>");
    }

    /// A text that reads upwards, centred at `at`.
    pub(crate) fn upward_text(&mut self, class: &str, at: (f64, f64), text: &str) {
        let _ = writeln!(
            self.0,
            "<text class=\"{class}\" text-anchor=\"middle\" transform=\"translate({} {}) rotate(-90)\">{}</text>",
            Coordinate(at.0),
            Coordinate(at.1),
            raised(text)
        );
    }

    /// A line through points; it pauses where a point is not finite.
    pub(crate) fn path(&mut self, class: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        self.styled_path(class, "", points);
    }

    /// A line with attributes of its own.
    pub(crate) fn styled_path(&mut self, class: &str, attributes: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        let mut path = String::new();
        let (mut lifted, mut last) = (true, None);
        for (x, y) in points {
            if !(x.is_finite() && y.is_finite()) {
                lifted = true;
                continue;
            }
            let place = (Coordinate(x).to_string(), Coordinate(y).to_string());
            if !lifted && last.as_ref() == Some(&place) {
                continue;
            }
            let _ = write!(path, "{}{} {}", if lifted { 'M' } else { 'L' }, place.0, place.1);
            lifted = false;
            last = Some(place);
        }
        if !path.is_empty() {
            let _ = writeln!(self.0, "<path class=\"{class}\"{attributes} d=\"{path}\"/>");
        }
    }

    /// What is drawn until [`Self::end_clip`] shows within a rectangle only.
    pub(crate) fn begin_clip(&mut self, at: (f64, f64), size: (f64, f64)) {
        let name = format!("clip{OWN}-{}", self.0.matches("<clipPath").count());
        let _ = write!(self.0, "<clipPath id=\"{name}\">");
        self.rect("clip", at, size);
        let _ = writeln!(self.0, "</clipPath><g clip-path=\"url(#{name})\">");
    }

    /// Ends what [`Self::begin_clip`] began.
    pub(crate) fn end_clip(&mut self) {
        self.0.push_str("</g>\n");
    }

    /// The drawing with the names within it made the figure's own: several stand in one document.
    pub(crate) fn numbered(&self, figure: usize) -> String {
        self.0.replace(OWN, &figure.to_string())
    }

    /// A figure, moved to `at`.
    pub(crate) fn place(&mut self, at: (f64, f64), figure: &Self, number: usize) {
        let (x, y) = (Coordinate(at.0), Coordinate(at.1));
        let _ = writeln!(self.0, "<g transform=\"translate({x} {y})\">\n{}</g>", figure.numbered(number));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out_of_the_document() {
        assert_eq!(
            escape("<script>\"a\" & b\u{1b}</script>"),
            "&lt;script&gt;&quot;a&quot; &amp; b\u{fffd}&lt;/script&gt;"
        );
    }

    #[test]
    fn a_line_pauses_where_nothing_was_measured() {
        let mut svg = Svg::default();
        svg.path("a", [(0.0, 0.0), (0.01, 0.02), (1.0, -0.01), (2.0, f64::NAN), (3.0, 1.25), (4.0, 2.0)]);
        assert_eq!(svg.0, "<path class=\"a\" d=\"M0 0L1 0M3 1.3L4 2\"/>\n");
    }
}
