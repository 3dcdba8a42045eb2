//! Axes: the range that shows all values, ticks and their labels.
//!
//! Values are handled as coordinates: the value itself on a linear axis, its log₁₀ on a logarithmic one.

use super::Scale;

/// Share of the range left free at each end.
const MARGIN: f64 = 0.06;

/// Ranges narrower than this, relative to the values, are treated as one value: f64 cannot label them.
const NARROW: f64 = 1e-12;

/// Mantissas that are labelled on a logarithmic axis, from the coarsest choice on.
const MANTISSAS: [&[f64]; 4] = [&[1.0], &[1.0, 3.0], &[1.0, 2.0, 5.0], &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0]];

/// Tick at a coordinate; minor ticks have no label.
pub(super) struct Tick {
    pub at: f64,
    pub label: Option<String>,
}

/// Shown part of an axis, in coordinates, `lo` < `hi`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    scale: Scale,
    pub lo: f64,
    pub hi: f64,
}

impl Scale {
    /// Coordinate of a value, if the axis can show it.
    pub(super) fn coordinate(self, value: f64) -> Option<f64> {
        match self {
            Self::Linear => value.is_finite().then_some(value),
            Self::Log => (value.is_finite() && value > 0.0).then(|| value.log10()),
        }
    }
}

impl Range {
    /// Range around all coordinates, with a margin; any range if there are none.
    pub fn around(scale: Scale, coordinates: impl Iterator<Item = f64>) -> Self {
        let (lo, hi) = coordinates.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), c| (lo.min(c), hi.max(c)));
        if lo > hi {
            return Self { scale, lo: 0.0, hi: 1.0 };
        }
        let size = lo.abs().max(hi.abs());
        // Differences of logarithms are already relative to the values.
        let narrow = match scale {
            Scale::Linear => NARROW * size,
            Scale::Log => NARROW,
        };
        let pad = if hi / 2.0 - lo / 2.0 > narrow {
            2.0 * MARGIN * (hi / 2.0 - lo / 2.0)
        } else {
            match scale {
                Scale::Log => 0.5,
                Scale::Linear if size > f64::MIN_POSITIVE => 0.1 * size,
                Scale::Linear => 0.5,
            }
        };
        Self { scale, lo: (lo - pad).max(-f64::MAX), hi: (hi + pad).min(f64::MAX) }
    }

    /// Exactly from `lo` to `hi`, linear.
    pub fn exact(lo: f64, hi: f64) -> Self {
        Self { scale: Scale::Linear, lo, hi }
    }

    /// Lowers the lower end by a share of the range.
    pub fn extend_below(&mut self, share: f64) {
        self.lo -= share * (self.hi - self.lo);
    }

    /// Share of the range below a coordinate; halves keep differences of the largest numbers finite.
    pub fn share(&self, coordinate: f64) -> f64 {
        (coordinate / 2.0 - self.lo / 2.0) / (self.hi / 2.0 - self.lo / 2.0)
    }

    /// Ticks from low to high, about `most` labelled ones.
    pub fn ticks(&self, most: usize) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => linear_ticks(self.lo, self.hi, most),
            Scale::Log => self.log_ticks(most),
        }
    }

    fn log_ticks(&self, most: usize) -> Vec<Tick> {
        let decades = self.hi.floor() - self.lo.ceil() + 1.0;
        if decades >= 3.0 {
            let stride = (decades / most.max(1) as f64).ceil().max(1.0);
            return self.decade_ticks(stride as i64);
        }
        for mantissas in MANTISSAS {
            let labelled = self.multiples(mantissas);
            if labelled.len() >= 3 {
                return self.mantissa_ticks(&labelled);
            }
        }
        let mut ticks = linear_ticks(10f64.powf(self.lo), 10f64.powf(self.hi), most);
        ticks.iter_mut().for_each(|t| t.at = t.at.log10());
        ticks.retain(|t| t.at.is_finite());
        ticks
    }

    // Multiples (m, e) with lo <= log10(m 10^e) <= hi, in rising order.
    fn multiples(&self, mantissas: &[f64]) -> Vec<(f64, i64)> {
        let exponents = self.lo.floor() as i64..=self.hi.ceil() as i64;
        let all = exponents.flat_map(|e| mantissas.iter().map(move |&m| (m, e)));
        all.filter(|&(m, e)| (self.lo..=self.hi).contains(&(m.log10() + e as f64))).collect()
    }

    fn decade_ticks(&self, stride: i64) -> Vec<Tick> {
        let minor: &[f64] = if stride == 1 { &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0] } else { &[1.0] };
        let tick = |(m, e): (f64, i64)| {
            let label = (m == 1.0 && e.rem_euclid(stride) == 0).then(|| power_of_ten(e));
            Tick { at: m.log10() + e as f64, label }
        };
        let crowded = stride > 10;
        self.multiples(minor).into_iter().map(tick).filter(|t| t.label.is_some() || !crowded).collect()
    }

    fn mantissa_ticks(&self, labelled: &[(f64, i64)]) -> Vec<Tick> {
        let plain = labelled.iter().all(|&(_, e)| (-3..=3).contains(&e));
        let name = |m: f64, e: i64| match (plain, m == 1.0) {
            (true, _) => {
                let digits = usize::try_from(-e).unwrap_or(0) + usize::from(m.fract() != 0.0 && e <= 0);
                format!("{:.digits$}", m * 10f64.powi(e as i32))
            }
            (false, true) => power_of_ten(e),
            (false, false) => format!("{m}·{}", power_of_ten(e)),
        };
        let at = |m: f64, e: i64| m.log10() + e as f64;
        let mut ticks: Vec<Tick> =
            labelled.iter().map(|&(m, e)| Tick { at: at(m, e), label: Some(name(m, e)) }).collect();
        let minor = self.multiples(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        ticks.extend(minor.iter().filter(|t| !labelled.contains(t)).map(|&(m, e)| Tick { at: at(m, e), label: None }));
        ticks.sort_by(|a, b| a.at.total_cmp(&b.at));
        ticks
    }
}

fn power_of_ten(exponent: i64) -> String {
    format!("10^{{{exponent}}}").replace('-', "−")
}

// Ticks at multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks(lo: f64, hi: f64, most: usize) -> Vec<Tick> {
    let raw = (hi / 2.0 - lo / 2.0) / most.max(2) as f64 * 2.0;
    let step = nice_above(raw);
    if !(step.is_finite() && step > 0.0) {
        return Vec::new();
    }
    let (first, last) = ((lo / step).ceil(), (hi / step).floor());
    let values: Vec<f64> = (0..=2 * most.max(2)).map(|k| first + k as f64).take_while(|&k| k <= last).collect();
    values
        .into_iter()
        .map(|k| Tick { at: k * step, label: Some(decimal(k * step, step, lo.abs().max(hi.abs()))) })
        .collect()
}

/// A value with four significant digits of the largest of its kind.
pub(super) fn significant(value: f64, largest: f64) -> String {
    let largest = largest.abs().max(f64::MIN_POSITIVE);
    decimal(value, 10f64.powf(largest.log10().floor() - 3.0), largest)
}

/// A positive value with its first digit alone.
pub(super) fn round(value: f64) -> String {
    decimal(value, 10f64.powf(value.log10().floor()), value)
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below a positive value.
pub(super) fn nice_above(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0, 10.0].iter().map(|m| m * decade).find(|&s| s >= value).unwrap_or(value)
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a positive value.
pub(super) fn nice_below(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0].iter().map(|m| m * decade).find(|&s| s <= value).unwrap_or(value)
}

// A value with the digits that a step between neighbours needs.
fn decimal(value: f64, step: f64, largest: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let finest = step.log10().floor();
    let digits = |from: f64| (from - finest).clamp(0.0, 15.0) as usize;
    if (1e-3..1e5).contains(&largest) && finest >= -7.0 {
        return format!("{value:.0$}", digits(0.0)).replace('-', "−");
    }
    let scientific = format!("{value:.0$e}", digits(value.abs().log10().floor()));
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    format!("{mantissa}·10^{{{exponent}}}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: Scale, lo: f64, hi: f64) -> Vec<String> {
        Range { scale, lo, hi }.ticks(6).into_iter().filter_map(|t| t.label).collect()
    }

    #[test]
    fn ticks_have_short_exact_labels() {
        assert_eq!(labels(Scale::Log, -3.2, 0.1), ["10^{−3}", "10^{−2}", "10^{−1}", "10^{0}"]);
        assert_eq!(labels(Scale::Log, 0.0441f64.log10(), 0.19f64.log10()), ["0.05", "0.07", "0.1", "0.15"]);
        assert_eq!(labels(Scale::Linear, -1.0, 1.1), ["−1.0", "−0.5", "0", "0.5", "1.0"]);
        assert_eq!(
            labels(Scale::Linear, 0.0, 1.2e6),
            ["0", "2·10^{5}", "4·10^{5}", "6·10^{5}", "8·10^{5}", "1.0·10^{6}", "1.2·10^{6}"]
        );
    }

    #[test]
    fn ticks_lie_in_any_range_and_rise() {
        let ends = [-f64::MAX, -1.0, 0.0, f64::MIN_POSITIVE, 1e-9, 1.0, 1.0 + 1e-15, 1e300, f64::MAX];
        for scale in [Scale::Linear, Scale::Log] {
            for (a, b) in ends.iter().flat_map(|&a| ends.iter().map(move |&b| (a, b))) {
                let coordinates = [a, b].into_iter().filter_map(|v| scale.coordinate(v));
                let range = Range::around(scale, coordinates);
                assert!(range.lo < range.hi && range.lo.is_finite() && range.hi.is_finite(), "{a} {b}");
                let ticks = range.ticks(6);
                assert!(ticks.len() < 100 && ticks.windows(2).all(|t| t[0].at < t[1].at), "{a} {b}");
                let slack = 1e-9;
                assert!(ticks.iter().all(|t| (-slack..=1.0 + slack).contains(&range.share(t.at))), "{a} {b}");
            }
        }
    }

    #[test]
    fn many_decades_are_thinned() {
        let names = labels(Scale::Log, -16.0, 2.0);
        assert!((4..=7).contains(&names.len()), "{names:?}");
    }
}
