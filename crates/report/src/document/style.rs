//! The style sheets of pages.

use super::font::Face;
use crate::figure::style::{Tones, rules, tones};
use crate::palette::{Ink, grid, ground};
use sindyscope_core::study::Severity;

/// Rules of the picture's page.
pub(super) fn picture() -> String {
    let Tones { text, quiet, .. } = tones(false);
    let (ground, grid, bar) = (ground(false), grid(false), Ink::Measured.rgb(false));
    let (caution, wrong) = (severity(Severity::Caution, false), severity(Severity::Wrong, false));
    let (reading, mono) = (Face::Text.family(), Face::Mono.family());
    let figures = rules(false);
    // The fonts have one weight; a fine outline of the letters makes headings stand out.
    format!(
        "text{{font-family:\"{reading}\";fill:#{text:06x}}}\n{figures}\
         .title,.heading,.subheading,.value,.head{{stroke:#{text:06x}}}\n.title{{font-size:24px;stroke-width:.5}}\n\
         .heading{{font-size:15px;stroke-width:.4}}\n.subheading{{font-size:13px;stroke-width:.35}}.value{{font-size:19px;stroke-width:.3}}\n\
         .head{{font-size:11.5px;stroke-width:.25}}\n.body{{font-size:12px}}\n.quiet{{font-size:11px;fill:#{quiet:06x}}}\n\
         .mono{{font-size:10.5px;font-family:\"{mono}\"}}\n.ground{{fill:#{ground:06x}}}\n\
         .row{{stroke:#{grid:06x};stroke-width:.7}}\n.headrow{{stroke:#{text:06x};stroke-width:.8}}\n.bar{{fill:#{bar:06x}}}\n\
         .flag{{font-size:12px;stroke-width:.3;stroke:#{text:06x}}}\n\
         .flag.caution{{fill:#{caution:06x};stroke:#{caution:06x}}}\n.flag.wrong{{fill:#{wrong:06x};stroke:#{wrong:06x}}}\n"
    )
}

/// Colour of a warning.
fn severity(severity: Severity, dark: bool) -> u32 {
    match (severity, dark) {
        (Severity::Note, _) => tones(dark).text,
        (Severity::Caution, false) => 0x8A_5A_00,
        (Severity::Caution, true) => 0xFF_C2_67,
        (Severity::Wrong, _) => Ink::Diverged.rgb(dark),
    }
}

/// Rules of the web page, light and dark.
pub(super) fn web() -> String {
    let variables = |dark: bool| {
        let Tones { text, quiet, .. } = tones(dark);
        let (ground, grid, bar) = (ground(dark), grid(dark), Ink::Measured.rgb(dark));
        let (caution, wrong) = (severity(Severity::Caution, dark), severity(Severity::Wrong, dark));
        format!(
            ":root{{--text:#{text:06x};--quiet:#{quiet:06x};--ground:#{ground:06x};--rule:#{grid:06x};--bar:#{bar:06x};\
             --caution:#{caution:06x};--wrong:#{wrong:06x}}}\n"
        )
    };
    format!(
        "{}{}{}@media screen and (prefers-color-scheme:dark){{\n{}{}}}\n",
        variables(false),
        rules(false),
        include_str!("page.css"),
        variables(true),
        rules(true)
    )
}
