//! CaseNumbers and units as they stand in a command, a comment or a sentence.

/// A number as a person types it.
pub(super) fn short(value: f64) -> String {
    let plain = value == 0.0 || (1e-4..1e7).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// The unit of a derivative of a quantity.
pub(super) fn per_second(unit: &str, order: u8) -> String {
    if order == 1 { format!("{unit}/s") } else { format!("{unit}/s^{order}") }
}
