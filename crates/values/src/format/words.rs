//! Words as sentences begin with them.

/// Words as the beginning of a sentence: the first letter is a capital, unless a file's name begins it (`run.csv: …`).
pub fn capitalised(text: &str) -> String {
    let first = text.split(char::is_whitespace).next().unwrap_or_default();
    if first.trim_end_matches(['.', ':', ',', '…']).contains('.') {
        return text.to_owned();
    }
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_begins_with_a_capital_and_a_file_keeps_its_name() {
        for (text, said) in [
            ("looking for modes…", "Looking for modes…"),
            ("column y is not used", "Column y is not used"),
            ("y.csv: column y is not used", "y.csv: column y is not used"),
            ("élan", "Élan"),
            ("", ""),
        ] {
            assert_eq!(capitalised(text), said);
        }
    }
}
