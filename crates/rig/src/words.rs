//! Numbers and units as they stand in a command, a comment or a sentence.

/// A number as a person types it.
pub(super) fn short(value: f64) -> String {
    let plain = value == 0.0 || (1e-4..1e7).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// The unit of a derivative of a quantity.
pub(super) fn per_second(unit: &str, order: u8) -> String {
    if order == 1 { format!("{unit}/s") } else { format!("{unit}/s^{order}") }
}

/// Gives an enum the list of its values and the names that they are typed with, and reads and prints it by these.
macro_rules! typed_names {
    ($kind:ident, $what:literal, { $($value:ident => $name:literal),+ $(,)? }) => {
        impl $kind {
            /// Every one.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$value),+];

            /// The name it is typed with.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$value => $name),+
                }
            }
        }

        impl std::fmt::Display for $kind {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $kind {
            type Err = String;

            /// Reads the name it is typed with.
            fn from_str(text: &str) -> Result<Self, String> {
                Self::ALL.into_iter().find(|value| value.name() == text).ok_or_else(|| {
                    let known = Self::ALL.map(Self::name).join(", ");
                    format!("{text:?} is no {}; choose one of: {known}", $what)
                })
            }
        }
    };
}
pub(super) use typed_names;
