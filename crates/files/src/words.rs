//! How a name out of a file, and a list of them, stand in a sentence.

/// A text out of a file as a message can hold it: in one line, without signs that move or hide what stands around it.
pub(super) fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || c == '\u{feff}' { '\u{fffd}' } else { c }).collect()
}

/// `` `a`, `b` and `c` ``, the tail of a long list left out.
pub(super) fn list<S: AsRef<str>>(names: &[S]) -> String {
    const SHOWN: usize = 12;
    let mut text = String::new();
    for (i, name) in names.iter().take(SHOWN).enumerate() {
        let joint = match i {
            0 => "",
            _ if i + 1 == names.len() => " and ",
            _ => ", ",
        };
        text += joint;
        text += &format!("`{}`", name.as_ref());
    }
    if names.len() > SHOWN {
        text += &format!(" and {} more", names.len() - SHOWN);
    }
    text
}

/// `a velocity`, `an input`.
pub(super) fn article(noun: &str) -> String {
    let an = noun.starts_with(['a', 'e', 'i', 'o', 'u']);
    format!("{} {noun}", if an { "an" } else { "a" })
}
