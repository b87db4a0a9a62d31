//! Files of other programs that hold no table of numbers: each is refused by name, with what to export instead.

use crate::error::{ReadError, ReadProblem};

/// A kind of file that is not read.
#[derive(Clone, Copy, Debug)]
struct Foreign {
    /// What it is: `a PDF document`.
    what: &'static str,
    /// What to do instead, in one sentence.
    advice: &'static str,
    recognises: fn(&Head<'_>) -> bool,
}

/// How many bytes tell what a file is.
const HEAD: usize = 4096;

/// The beginning of a file and the ending of its name.
struct Head<'a> {
    bytes: &'a [u8],
    /// The bytes as text in lower case, without what stands before the first sign.
    text: String,
    ending: &'a str,
}

impl Head<'_> {
    fn begins(&self, magic: &[u8]) -> bool {
        self.bytes.starts_with(magic)
    }

    fn begins_with_any(&self, magics: &[&[u8]]) -> bool {
        magics.iter().any(|magic| self.begins(magic))
    }

    /// True if the first bytes are those of no text.
    fn is_binary(&self) -> bool {
        self.bytes.contains(&0)
    }

    fn ends(&self, endings: &[&str]) -> bool {
        endings.contains(&self.ending)
    }

    /// True for a mark-up whose text holds a word near its beginning.
    fn is_markup_of(&self, word: &str) -> bool {
        self.is_markup() && self.text.contains(word)
    }

    fn is_markup(&self) -> bool {
        let mut characters = self.text.chars();
        characters.next() == Some('<') && characters.next().is_some_and(|c| c.is_alphabetic() || c == '?' || c == '!')
    }
}

const EXPORT: &str = "export the measurement there as CSV text: a header such as `t,x,u`, then one row a sample";
const UNPACK: &str = "unpack it, and open the measurement that is inside";
const PICTURE: &str = "a picture holds no samples: open the numbers that it was drawn from, as CSV text";
const SOUND: &str = "convert it to WAV (PCM), which is read";

/// What is recognised, the more special first.
const FOREIGN: &[Foreign] = &[
    Foreign {
        what: "a measurement of CASSY Lab (XML)",
        advice: "in CASSY Lab, save the table as text (“Export”, .txt) and open that",
        recognises: |h| h.is_markup_of("<cassylab"),
    },
    Foreign {
        what: "the header of a DIAdem data set (TDM)",
        advice: "save it in DIAdem or LabVIEW as TDMS or as CSV text, and open that",
        recognises: |h| h.is_markup_of("<usi:tdm"),
    },
    Foreign {
        what: "a phyphox experiment (XML)",
        advice: "in phyphox, export the data as CSV (menu, “Export data”), and open that",
        recognises: |h| h.is_markup_of("<phyphox"),
    },
    Foreign {
        what: "a Tracker project (XML)",
        advice: "in Tracker, export the track's table (“File”, “Export”, “Data file”), and open that",
        recognises: |h| h.is_markup_of("org.opensourcephysics"),
    },
    Foreign {
        what: "a Logger Pro experiment (XML)",
        advice: "in Logger Pro, choose “File”, “Export as”, “CSV”, and open that",
        recognises: |h| h.ends(&["cmbl", "gmbl"]) && h.is_markup(),
    },
    Foreign { what: "a drawing (SVG)", advice: PICTURE, recognises: |h| h.is_markup_of("<svg") },
    Foreign {
        what: "a web page (HTML)",
        advice: "a download may have failed: fetch the file itself, not the page that shows it",
        recognises: |h| h.is_markup_of("<html") || h.is_markup_of("<!doctype html"),
    },
    Foreign {
        what: "an XML file of another program",
        advice: "open it in the program that wrote it and export the measurement as CSV text",
        recognises: |h| h.text.starts_with("<?xml") || (h.ends(&["xml"]) && h.is_markup()),
    },
    Foreign {
        what: "a JSON file",
        advice: EXPORT,
        recognises: |h| {
            let inside = h.text.strip_prefix(['{', '[']).map(str::trim_start);
            h.text.starts_with('{') && inside.is_some_and(|t| t.starts_with(['"', '}']))
                || h.text.starts_with('[') && inside.is_some_and(|t| t.starts_with(['{', '[']))
        },
    },
    Foreign {
        what: "a PDF document",
        advice: "a document holds no samples: ask its author for the measurement as CSV text",
        recognises: |h| h.begins(b"%PDF-"),
    },
    Foreign {
        what: "a rich-text document (RTF)",
        advice: "save it as plain text (.txt), and open that",
        recognises: |h| h.begins(b"{\\rtf"),
    },
    Foreign {
        what: "a text document (DOCX or ODT)",
        advice: "copy its table into a spreadsheet, and save that as CSV or XLSX",
        recognises: |h| is_zip(h) && (h.ends(&["docx", "odt"]) || holds(h, b"word/") || holds(h, b"opendocument.text")),
    },
    Foreign {
        what: "a set of slides (PPTX or ODP)",
        advice: PICTURE,
        recognises: |h| is_zip(h) && (h.ends(&["pptx", "odp"]) || holds(h, b"ppt/") || holds(h, b"opendocument.pres")),
    },
    Foreign {
        what: "a Logger Pro, Tracker or GeoGebra archive (ZIP)",
        advice: "open it in the program that wrote it and export the measurement as CSV text",
        recognises: |h| is_zip(h) && h.ends(&["gambl", "trz", "ggb"]),
    },
    Foreign { what: "a ZIP archive", advice: UNPACK, recognises: is_zip },
    Foreign {
        what: "an archive",
        advice: UNPACK,
        recognises: |h| {
            const MAGICS: &[&[u8]] =
                &[b"\x1f\x8b", b"7z\xbc\xaf\x27\x1c", b"Rar!\x1a\x07", b"BZh", b"\xfd7zXZ\0", b"\x28\xb5\x2f\xfd"];
            h.is_binary() && h.begins_with_any(MAGICS) || h.bytes.get(257..262) == Some(b"ustar")
        },
    },
    Foreign {
        what: "a picture",
        advice: PICTURE,
        recognises: |h| {
            const MAGICS: &[&[u8]] = &[b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*"];
            let webp = h.begins(b"RIFF") && h.bytes.get(8..12) == Some(b"WEBP");
            h.begins_with_any(MAGICS) || webp || h.begins(b"BM") && h.ends(&["bmp"])
        },
    },
    Foreign {
        what: "a film",
        advice: "a film holds no samples: track the motion in it first, and save the track as CSV text",
        recognises: |h| {
            let avi = h.begins(b"RIFF") && h.bytes.get(8..12) == Some(b"AVI ");
            avi || h.bytes.get(4..8) == Some(b"ftyp") || h.begins(b"\x1a\x45\xdf\xa3")
        },
    },
    Foreign {
        what: "a compressed sound",
        advice: SOUND,
        recognises: |h| {
            let aiff = h.begins(b"FORM") && h.bytes.get(8..11) == Some(b"AIF");
            aiff || h.is_binary() && h.begins_with_any(&[b"ID3", b"fLaC", b"OggS"])
        },
    },
    Foreign { what: "a database (SQLite)", advice: EXPORT, recognises: |h| h.begins(b"SQLite format 3\0") },
    Foreign {
        what: "a table of columns (Parquet or Arrow)",
        advice: "save it as CSV or NumPy: `pandas.read_parquet(…).to_csv('run.csv', index=False)`",
        recognises: |h| h.is_binary() && h.begins_with_any(&[b"PAR1", b"ARROW1", b"FEA1"]),
    },
    Foreign {
        what: "a Python pickle",
        advice: "save it as NumPy instead: `numpy.savez('run.npz', t=t, x=x, u=u)`",
        recognises: |h| h.ends(&["pkl", "pickle"]),
    },
    Foreign {
        what: "a measurement of DEWESoft",
        advice: "in DEWESoft, choose “Export” and there CSV, MATLAB, UNV or MDF, and open that",
        recognises: |h| h.ends(&["dxd", "dxz", "d7d", "d7z"]),
    },
    Foreign {
        what: "a measurement of PicoScope",
        advice: "in PicoScope, choose “Save as” and there CSV, text or MATLAB, and open that",
        recognises: |h| h.ends(&["psdata", "pssettings"]),
    },
    Foreign {
        what: "a project of Origin",
        advice: "in Origin, export the worksheet as text or Excel, and open that",
        recognises: |h| h.ends(&["opj", "opju", "ogw", "ogwu"]),
    },
    Foreign {
        what: "a recording of LabChart",
        advice: "in LabChart, choose “Export” and there text or MATLAB, and open that",
        recognises: |h| h.ends(&["adicht", "adidat"]),
    },
    Foreign {
        what: "a program",
        advice: "open the measurement itself",
        recognises: |h| h.begins(b"\x7fELF") || h.begins(b"MZ") && h.ends(&["exe", "dll"]),
    },
];

fn is_zip(head: &Head<'_>) -> bool {
    head.begins(b"PK\x03\x04") || head.begins(b"PK\x05\x06")
}

fn holds(head: &Head<'_>, name: &[u8]) -> bool {
    head.bytes.windows(name.len()).any(|window| window == name)
}

/// Refuses a file of a kind that holds no table of numbers.
///
/// To be asked only where no format's reader recognises the bytes.
///
/// # Errors
/// What the file is, and what to export instead.
pub(crate) fn refuse(file: &str, ending: &str, bytes: &[u8]) -> Result<(), ReadError> {
    let bytes = &bytes[..bytes.len().min(HEAD)];
    let text = String::from_utf8_lossy(bytes).to_lowercase();
    let text = text.trim_start_matches('\u{feff}').trim_start().to_owned();
    let head = Head { bytes, text, ending };
    match FOREIGN.iter().find(|foreign| (foreign.recognises)(&head)) {
        Some(Foreign { what, advice, .. }) => Err(ReadError::new(file, ReadProblem::Foreign { what, advice })),
        None => Ok(()),
    }
}
