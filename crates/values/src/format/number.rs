//! Numbers as a person reads them.

/// A value with its standard error, significant digits following the error: `−358.6 ± 0.2`.
///
/// The error is shown with one significant digit and the value to the same place; values beyond 10⁶ or below 10⁻⁴ share one
/// power of ten, `(1.23 ± 0.04)×10⁻⁷`. Without an error (given, not fitted; or none known) the value has five digits.
pub fn format_measured(value: f64, std_error: Option<f64>) -> String {
    let Some(error) = std_error.filter(|e| e.is_finite() && *e > 0.0) else { return significant_trimmed(value, 5) };
    if !value.is_finite() {
        return plain(value, 0);
    }
    // An error of 0.096 rounds to 0.1 and not to 0.10.
    let place = |error: f64| {
        let place = error.log10().floor() as i32;
        if (error / 10f64.powi(place)).round() >= 10.0 { place + 1 } else { place }
    };
    let size = value.abs().max(error);
    if (1e-4..1e6).contains(&size) && place(error) >= -12 {
        let place = place(error);
        let unit = 10f64.powi(place.max(0));
        let decimals = (-place).max(0) as usize;
        let rounded = |v: f64| if place > 0 { (v / unit).round() * unit } else { v };
        return format!("{} ± {}", plain(rounded(value), decimals), plain(rounded(error), decimals));
    }
    let power = size.log10().floor() as i32;
    let unit = 10f64.powi(power);
    let decimals = (power - place(error)).clamp(0, 15) as usize;
    let (value, error) = (plain(value / unit, decimals), plain(error / unit, decimals));
    format!("({value} ± {error})×10{}", superscript(power))
}

/// A value with `digits` significant digits, trailing zeros kept; powers of ten beyond 10⁶ and below 10⁻⁴.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return plain(value, 0);
    }
    let digits = digits.max(1);
    // By way of the scientific form, so that 9.996 becomes 10.00 and not 9.9960 or 10.000.
    let scientific = format!("{:.*e}", digits - 1, value.abs());
    let (mantissa, power) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    let sign = if value < 0.0 { "−" } else { "" };
    if (-4..6).contains(&power) {
        let decimals = (digits as i32 - 1 - power).max(0) as usize;
        let unit = 10f64.powi((power + 1 - digits as i32).max(0));
        format!("{sign}{:.*}", decimals, (value.abs() / unit).round_if(unit > 1.0) * unit)
    } else {
        format!("{sign}{mantissa}×10{}", superscript(power))
    }
}

/// A value with at most `digits` significant digits, without trailing zeros.
pub fn significant_trimmed(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    let (number, power) = text.split_at(text.find('×').unwrap_or(text.len()));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    format!("{number}{power}")
}

/// A value with fixed decimals and a true minus sign; no minus before a zero.
pub fn plain(value: f64, decimals: usize) -> String {
    if value.is_nan() {
        return "–".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞".into() } else { "−∞".into() };
    }
    let text = format!("{:.*}", decimals, value.abs());
    let zero = text.bytes().all(|b| matches!(b, b'0' | b'.'));
    if value < 0.0 && !zero { format!("−{text}") } else { text }
}

/// Digits as superscripts.
pub fn superscript(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' => '⁰',
            d => char::from_u32('⁰' as u32 + d.to_digit(10).unwrap_or(0)).unwrap_or(d),
        })
        .collect()
}

/// Pads texts of numbers with blanks on both sides, so that their decimal points stand below each other in a font of fixed
/// width; whatever follows the first number (` ± 0.2`, a unit) starts at one column too.
pub fn align_at_point<S: AsRef<str>>(texts: &[S]) -> Vec<String> {
    let parts: Vec<(&str, &str, &str)> = texts
        .iter()
        .map(|text| {
            let text = text.as_ref();
            let (number, rest) = text.split_at(text.find(' ').unwrap_or(text.len()));
            let (whole, fraction) = number.split_at(number.find('.').unwrap_or(number.len()));
            (whole, fraction, rest)
        })
        .collect();
    let widest = |pick: fn(&(&str, &str, &str)) -> usize| parts.iter().map(pick).max().unwrap_or(0);
    let whole = widest(|p| p.0.chars().count());
    let fraction = widest(|p| p.1.chars().count());
    let rest = widest(|p| p.2.chars().count());
    parts.iter().map(|(w, f, r)| format!("{w:>whole$}{f:<fraction$}{r:<rest$}")).collect()
}

trait RoundIf {
    fn round_if(self, yes: bool) -> Self;
}

impl RoundIf for f64 {
    fn round_if(self, yes: bool) -> Self {
        if yes { self.round() } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_standard_error() {
        for (value, error, text) in [
            (-358.612, 0.21, "−358.6 ± 0.2"),
            (-0.0704, 0.0113, "−0.07 ± 0.01"),
            (-0.08512, 0.00094, "−0.0851 ± 0.0009"),
            (358.5, 0.096, "358.5 ± 0.1"),
            (358.7, 0.96, "359 ± 1"),
            (1.0, 1e-6, "1.000000 ± 0.000001"),
            (0.3, 0.8, "0.3 ± 0.8"),
            (-0.04, 0.8, "0.0 ± 0.8"),
            (123_456.0, 2300.0, "123000 ± 2000"),
            (123_456.0, 12.0, "123460 ± 10"),
            (1.234e-7, 4.2e-9, "(1.23 ± 0.04)×10⁻⁷"),
            (-2.5e8, 3e6, "(−2.50 ± 0.03)×10⁸"),
            (0.0, 0.5, "0.0 ± 0.5"),
            (0.0, 5e-9, "(0 ± 5)×10⁻⁹"),
            (-2.666_666_663, 6e-10, "−2.6666666630 ± 0.0000000006"),
            (5.0, 1e-14, "(5.00000000000000 ± 0.00000000000001)×10⁰"),
        ] {
            assert_eq!(format_measured(value, Some(error)), text, "{value} {error}");
        }
        for (value, text) in
            [(1.0, "1"), (-0.6, "−0.6"), (0.0, "0"), (358.70624, "358.71"), (1.5e-9, "1.5×10⁻⁹"), (f64::NAN, "–")]
        {
            assert_eq!(format_measured(value, None), text);
            assert_eq!(format_measured(value, Some(f64::NAN)), text);
            assert_eq!(format_measured(value, Some(0.0)), text);
        }
    }

    #[test]
    fn significant_digits() {
        for (value, digits, text) in [
            (1234.5678, 3, "1230"),
            (1234.5678, 6, "1234.57"),
            (9.996, 3, "10.0"),
            (0.000_123_46, 3, "0.000123"),
            (0.000_012_346, 3, "1.23×10⁻⁵"),
            (-999_999.6, 6, "−1.00000×10⁶"),
            (-2.0, 3, "−2.00"),
            (0.0, 3, "0"),
            (f64::NEG_INFINITY, 3, "−∞"),
        ] {
            assert_eq!(significant(value, digits), text, "{value} {digits}");
        }
    }

    #[test]
    fn numbers_stand_below_each_other() {
        let texts = ["−358.6 ± 0.2", "−0.07 ± 0.01", "12 ± 3", "(1.2 ± 0.3)×10⁻⁷"];
        let aligned = align_at_point(&texts[..3]);
        assert_eq!(aligned, ["−358.6  ± 0.2 ", "  −0.07 ± 0.01", "  12    ± 3   "]);
        assert_eq!(align_at_point::<&str>(&[]), Vec::<String>::new());
    }
}
