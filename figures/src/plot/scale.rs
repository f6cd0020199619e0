//! Linear and logarithmic scales: positions of values and choice of labelled ticks.

/// Mapping of values along an axis or a colour bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Equal differences take equal lengths.
    Linear,
    /// Equal ratios take equal lengths; only positive values have a position.
    Log,
}

/// A range of values laid along [0, 1].
///
/// # Guarantees
/// `low < high`, both finite, and positive on a log scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    kind: Kind,
    low: f64,
    high: f64,
}

/// Ticks of a scale.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Ticks {
    /// Labelled ticks, ascending.
    pub(crate) major: Vec<(f64, String)>,
    /// Ticks without labels; a linear axis has none.
    pub(crate) minor: Vec<f64>,
    /// The power of ten taken out of all labels, such as "×10⁻⁴"; empty if there is none.
    pub(crate) factor: String,
}

impl Scale {
    /// The scale from `low` to `high`; an empty or invalid range is widened to a valid one.
    pub(crate) fn new(kind: Kind, low: f64, high: f64) -> Self {
        let (low, high) = if low <= high { (low, high) } else { (high, low) };
        let usable = low.is_finite() && high.is_finite() && (high - low).is_finite();
        let (low, high) = match kind {
            Kind::Linear if !usable => (0.0, 1.0),
            Kind::Linear if high - low <= 1e-12 * low.abs().max(high.abs()) => {
                let half = if high == 0.0 { 1.0 } else { 0.1 * high.abs() };
                (low - half, high + half)
            }
            Kind::Log if !usable || high <= 0.0 => (0.1, 1.0),
            Kind::Log => {
                let low = if low > 0.0 { low } else { high * 1e-6 }.max(f64::MIN_POSITIVE);
                let high = high.max(f64::MIN_POSITIVE * 4.0);
                if high / low < 1.0 + 1e-9 { (low / 2.0, high * 2.0) } else { (low, high) }
            }
            Kind::Linear => (low, high),
        };
        Self { kind, low, high }
    }

    /// The smallest scale that shows all values with a small margin; invalid values are skipped.
    pub(crate) fn covering(kind: Kind, values: impl IntoIterator<Item = f64>) -> Self {
        let usable = |value: &f64| value.is_finite() && (kind == Kind::Linear || *value > 0.0);
        let (low, high) = values
            .into_iter()
            .filter(usable)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let tight = Self::new(kind, low, high);
        match kind {
            Kind::Linear => {
                let air = 0.05 * (tight.high - tight.low);
                Self::new(kind, tight.low - air, tight.high + air)
            }
            Kind::Log => {
                let air = (tight.high / tight.low).powf(0.05).max(1.05);
                Self::new(kind, tight.low / air, tight.high * air)
            }
        }
    }

    pub(crate) fn kind(self) -> Kind {
        self.kind
    }

    pub(crate) fn low(self) -> f64 {
        self.low
    }

    pub(crate) fn high(self) -> f64 {
        self.high
    }

    /// Position of `value`: 0 at the low end, 1 at the high end, beyond them outside. `None` for values
    /// without a position: NaN, infinities, and on a log scale values that are not positive.
    pub(crate) fn position(self, value: f64) -> Option<f64> {
        let position = match self.kind {
            Kind::Linear => (value - self.low) / (self.high - self.low),
            Kind::Log if value > 0.0 => (value / self.low).ln() / (self.high / self.low).ln(),
            Kind::Log => return None,
        };
        position.is_finite().then_some(position)
    }

    /// The value at `position`, the inverse of [`Scale::position`].
    pub(crate) fn value(self, position: f64) -> f64 {
        match self.kind {
            Kind::Linear => self.low + position * (self.high - self.low),
            Kind::Log => self.low * (self.high / self.low).powf(position),
        }
    }

    /// Ticks at round values, about `target` of them.
    pub(crate) fn ticks(self, target: usize) -> Ticks {
        match self.kind {
            Kind::Linear => linear_ticks(self, target.max(2)),
            Kind::Log => log_ticks(self, target.max(2)),
        }
    }

    /// Whether a value lies on the scale, ends included.
    pub(crate) fn holds(self, value: f64) -> bool {
        self.position(value).is_some_and(|position| (-1e-9..=1.0 + 1e-9).contains(&position))
    }
}

fn linear_ticks(scale: Scale, target: usize) -> Ticks {
    let raw = (scale.high - scale.low) / target as f64;
    let decade = raw.log10().floor();
    let mantissa = match raw / 10f64.powf(decade) {
        ratio if ratio < 1.5 => 1.0,
        ratio if ratio < 3.5 => 2.0,
        ratio if ratio < 7.5 => 5.0,
        _ => 10.0,
    };
    let step = mantissa * 10f64.powf(decade);
    let step_exponent = decade as i32 + i32::from(mantissa == 10.0);
    let largest = scale.low.abs().max(scale.high.abs());
    let exponent = if (1e-2..1e5).contains(&largest) { 0 } else { largest.log10().floor() as i32 };
    let decimals = usize::try_from(exponent - step_exponent).unwrap_or(0).min(12);
    // k·step instead of a running sum: no drift, and zero is exactly zero.
    let first = (scale.low / step - 1e-9).ceil();
    let values = (0..200).map(|k| (first + f64::from(k)) * step);
    let major = values
        .take_while(|value| *value <= scale.high + 1e-9 * step)
        .map(|value| {
            let scaled = value / 10f64.powi(exponent);
            (value, with_minus(format!("{:.decimals$}", if value == 0.0 { 0.0 } else { scaled })))
        })
        .collect();
    let factor = if exponent == 0 { String::new() } else { format!("×{}", power_of_ten(exponent)) };
    Ticks { major, minor: vec![], factor }
}

fn log_ticks(scale: Scale, target: usize) -> Ticks {
    let first = scale.low.log10().floor() as i32;
    let last = scale.high.log10().ceil() as i32;
    let decades: Vec<i32> = (first..=last).filter(|decade| scale.holds(10f64.powi(*decade))).collect();
    let ladder = |multiples: &'static [i32]| {
        (first..=last)
            .flat_map(move |decade| multiples.iter().map(move |multiple| (*multiple, decade)))
            .filter(move |(multiple, decade)| scale.holds(f64::from(*multiple) * 10f64.powi(*decade)))
    };
    let value = |(multiple, decade): (i32, i32)| f64::from(multiple) * 10f64.powi(decade);
    let minor: Vec<f64> = if last - first <= 12 {
        ladder(&[2, 3, 4, 5, 6, 7, 8, 9]).map(value).collect()
    } else {
        decades.iter().map(|decade| 10f64.powi(*decade)).collect()
    };
    if decades.len() >= 2 {
        let needed = decades.len().div_ceil(target);
        let stride = [1, 2, 3, 4, 5, 10, 20, 25, 50].into_iter().find(|stride| *stride as usize >= needed);
        let stride = stride.unwrap_or(100);
        let major = decades
            .iter()
            .filter(|decade| decade.rem_euclid(stride) == 0)
            .map(|decade| (10f64.powi(*decade), power_of_ten(*decade)))
            .collect();
        return Ticks { major, minor, factor: String::new() };
    }
    // A range below a decade or two: 1-2-5 within it, or a linear ladder within that.
    let major: Vec<_> = ladder(&[1, 2, 5]).map(|tick| (value(tick), number(value(tick)))).collect();
    if major.len() >= 2 {
        return Ticks { major, minor, factor: String::new() };
    }
    Ticks { minor, ..linear_ticks(scale, target.min(5)) }
}

/// 10 to the `exponent` in Unicode, such as "10⁻³".
pub(crate) fn power_of_ten(exponent: i32) -> String {
    let mut power = "10".to_owned();
    power.extend(exponent.to_string().chars().map(|character| match character {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit.to_digit(10).unwrap_or(0) as usize],
    }));
    power
}

/// A short label for a value: three significant digits, large and small ones as "2.5×10⁻⁵".
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return with_minus(format!("{value}")).replace("inf", "∞").replace("NaN", "–");
    }
    // Rounded first: 9.999 is 10.0, which has one more digit before the point.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    let exponent = rounded.abs().log10().floor() as i32;
    if !(-3..=4).contains(&exponent) {
        let mantissa = trimmed(format!("{:.2}", rounded / 10f64.powi(exponent)));
        let power = power_of_ten(exponent);
        return with_minus(match mantissa.as_str() {
            "1" => power,
            "-1" => format!("-{power}"),
            mantissa => format!("{mantissa}×{power}"),
        });
    }
    with_minus(trimmed(format!("{rounded:.*}", usize::try_from(2 - exponent).unwrap_or(0))))
}

fn trimmed(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn with_minus(text: String) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, target: usize) -> Vec<String> {
        scale.ticks(target).major.into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(labels(Scale::new(Kind::Linear, -1.0, 1.0), 5), ["−1.0", "−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(Scale::new(Kind::Linear, 0.0, 97.0), 5), ["0", "20", "40", "60", "80"]);
        let small = Scale::new(Kind::Linear, 0.0, 4e-4).ticks(4);
        assert_eq!(small.factor, "×10⁻⁴");
        assert_eq!(small.major[1].1, "1");
    }

    #[test]
    fn log_ticks_are_powers() {
        assert_eq!(labels(Scale::new(Kind::Log, 1e-3, 10.0), 8), ["10⁻³", "10⁻²", "10⁻¹", "10⁰", "10¹"]);
        assert_eq!(labels(Scale::new(Kind::Log, 1.5, 8.0), 8), ["2", "5"]);
        assert!(labels(Scale::new(Kind::Log, 2.1, 2.4), 5).len() >= 2);
        assert!(labels(Scale::new(Kind::Log, 1e-300, 1e300), 6).len() <= 7);
    }

    #[test]
    fn meaningless_ranges_are_widened() {
        const INFINITY: f64 = f64::INFINITY;
        for kind in [Kind::Linear, Kind::Log] {
            for (low, high) in
                [(0.0, 0.0), (f64::NAN, 1.0), (-INFINITY, INFINITY), (-1.0, -1.0), (0.0, 5e-324)]
            {
                let scale = Scale::new(kind, low, high);
                assert!(scale.low < scale.high && scale.ticks(6).major.len() < 40, "{kind:?} {scale:?}");
            }
            assert!(Scale::covering(kind, []).low.is_finite());
        }
        assert_eq!(Scale::new(Kind::Log, 0.1, 1.0).position(-1.0), None);
    }

    #[test]
    fn numbers_keep_three_digits() {
        let shown: Vec<_> = [0.0, 12.345, -0.001234, 9.999, 1e-5, -2.5e-7, 123456.0].map(number).into();
        assert_eq!(shown, ["0", "12.3", "−0.00123", "10", "10⁻⁵", "−2.5×10⁻⁷", "1.23×10⁵"]);
    }
}
