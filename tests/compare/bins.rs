//! Identities of bins, means, filter, interpolation and correction.

use monolayer::measure::measured::{Averages, Binned, Bins, Sample};
use monolayer::mesh::Point;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn bins(count: [usize; 2]) -> Bins {
    Bins { low: Point::new(-4.0, -2.0), high: Point::new(6.0, 3.0), count }
}

/// Every bin filled with the value of a function at its centre.
fn filled(count: [usize; 2], value: impl Fn(Point) -> Point) -> Binned {
    let mut field = Binned::empty(bins(count));
    for bin in 0..field.bins.len() {
        field.values[bin] = value(field.bins.centre(bin));
        field.weights[bin] = 1.0;
    }
    field
}

fn averages(bins: Bins, samples: &[Sample], frames: usize) -> Averages {
    Averages::join(&Averages::of_blocks(bins, &vec![false; bins.len()], samples, frames, frames.min(3)), None)
}

/// Samples at random places, few enough that many bins are empty in many frames and some in all.
fn random_samples(bins: Bins, frames: usize, cells: usize, seed: u64) -> Vec<Sample> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut one = |frame: usize| {
        let mut draw = || generator.random_range(0.0..1.0);
        let x = bins.low + (bins.high - bins.low).component_mul(&Point::new(draw(), draw()));
        Sample { frame, x, v: Point::new(draw(), draw()) }
    };
    (0..frames).flat_map(|frame| vec![frame; cells]).map(&mut one).collect()
}

#[test]
fn every_point_of_the_box_lies_in_the_bin_that_is_found() {
    let bins = bins([7, 5]);
    for bin in 0..bins.len() {
        for shares in [[0.001, 0.001], [0.5, 0.5], [0.999, 0.3]] {
            assert_eq!(bins.find(bins.inside(bin, shares.into())), Some(bin));
        }
    }
    assert_eq!(bins.find(bins.high), Some(bins.len() - 1));
    assert_eq!(bins.find(bins.low), Some(0));
    for x in [[6.001, 0.0], [-4.001, 0.0], [0.0, 3.001], [f64::NAN, 0.0]] {
        assert_eq!(bins.find(x.into()), None, "{x:?}");
    }
}

#[test]
fn frames_count_once_and_frames_without_cells_not_at_all() {
    let bins = bins([2, 2]);
    let x = bins.centre(2);
    let sample = |frame, v1| Sample { frame, x, v: Point::new(v1, -v1) };
    // the third frame has no cells in this bin, the fourth has some elsewhere
    let mut samples = vec![sample(0, 1.0), sample(1, 5.0), sample(0, 3.0)];
    samples.push(Sample { frame: 3, x: bins.centre(0), v: Point::new(9.0, 9.0) });
    samples.push(Sample { frame: 3, x: Point::new(100.0, 0.0), v: Point::new(1e6, 1e6) });
    let all = averages(bins, &samples, 4);
    let mean = all.mean();
    assert_eq!((all.cells[2], all.frames[2]), (3, 2));
    assert_eq!((all.cells[1], all.frames[1], mean.is_filled(1)), (0, 0, false));
    assert_eq!(mean.values[2], Point::new(3.5, -3.5), "mean of the frames' means 2 and 5, not of the cells");
    // (1.5² + 1.5²)/(2·1)
    assert!((mean.variances[2] - Point::repeat(2.25)).norm() < 1e-14, "{}", mean.variances[2]);
    // one frame only: the scatter of a frame in the other bin, 4.5
    assert!((mean.variances[0] - Point::repeat(4.5)).norm() < 1e-14, "{}", mean.variances[0]);
}

#[test]
fn closed_bins_stay_empty_and_do_not_leak() {
    let bins = bins([10, 5]);
    let mut closed = vec![false; bins.len()];
    closed[22] = true;
    let samples: Vec<Sample> = (0..2 * bins.len())
        .map(|k| {
            let (frame, bin) = (k / bins.len(), k % bins.len());
            let v1 = if closed[bin] { 1e9 } else { 1.5 };
            Sample { frame, x: bins.centre(bin), v: Point::new(v1, 0.25) }
        })
        .collect();
    let mean = Averages::join(&Averages::of_blocks(bins, &closed, &samples, 2, 2), None).mean();
    let smooth = mean.filtered(1.0);
    for bin in 0..bins.len() {
        assert_eq!(smooth.is_filled(bin), bin != 22);
        if bin != 22 {
            assert!((smooth.values[bin] - Point::new(1.5, 0.25)).norm() < 1e-14, "{bin}");
        }
    }
    // bridged by its neighbours
    let around = smooth.at(bins.centre(22) + 0.3 * bins.size()).unwrap();
    assert!((around - Point::new(1.5, 0.25)).norm() < 1e-14);
    assert_eq!(smooth.at(bins.centre(22)), None, "nothing was measured there");
}

#[test]
fn filter_of_the_means_is_the_mean_of_what_is_filtered_in_bins_and_frames() {
    let (bins, frames, deviation) = (bins([6, 5]), 7, 1.0);
    let samples = random_samples(bins, frames, 5, 3);
    let found = averages(bins, &samples, frames).mean().filtered(deviation);
    let by_frame: Vec<Binned> = (0..frames)
        .map(|frame| {
            let own: Vec<Sample> = samples.iter().filter(|s| s.frame == frame).copied().collect();
            averages(bins, &own, frames).mean()
        })
        .collect();
    let gauss = |k: usize| if k <= 4 { (-0.5 * (k as f64 / deviation).powi(2)).exp() } else { 0.0 };
    // every frame hands out weight 1 to the frames about it
    let spread = |to: usize, from: usize| {
        gauss(to.abs_diff(from)) / (0..frames).map(|other| gauss(other.abs_diff(from))).sum::<f64>()
    };
    let mut filled = 0;
    for bin in 0..bins.len() {
        let (mut sum, mut weight) = (Point::zeros(), 0.0);
        for to in 0..frames {
            for (from, field) in by_frame.iter().enumerate() {
                for other in (0..bins.len()).filter(|other| field.is_filled(*other)) {
                    let (i, j) = ((bin % 6).abs_diff(other % 6), (bin / 6).abs_diff(other / 6));
                    let g = spread(to, from) * gauss(i) * gauss(j);
                    sum += g * field.values[other];
                    weight += g;
                }
            }
        }
        if found.is_filled(bin) {
            filled += 1;
            assert!((found.values[bin] - sum / weight).norm() < 1e-13, "{bin}: {} {}", found.values[bin], sum / weight);
        }
    }
    assert!(filled > 15 && filled < 30, "{filled}: the case should have empty bins");
}

#[test]
fn the_variance_after_the_filter_is_that_of_the_sum() {
    // scatter of many tables against the variance that each of them tells on average
    let bins = bins([8, 6]);
    let tables: Vec<Binned> =
        (0..400).map(|seed| averages(bins, &random_samples(bins, 20, 60, seed), 20).mean().filtered(1.0)).collect();
    let n = tables.len() as f64;
    for bin in [0, 20, 27] {
        let mean = tables.iter().map(|t| t.values[bin].x).sum::<f64>() / n;
        let scatter = tables.iter().map(|t| (t.values[bin].x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let told = tables.iter().map(|t| t.variances[bin].x).sum::<f64>() / n;
        // a variance from 400 values: relative deviation (2/399)^½ = 0.071, five of them
        assert!((scatter / told - 1.0).abs() < 5.0 * (2.0_f64 / 399.0).sqrt(), "{bin}: {scatter} {told}");
    }
}

#[test]
fn interpolation_is_exact_for_bilinear_fields_and_honours_empty_bins() {
    let bilinear = |x: Point| Point::new(1.0 + 2.0 * x.x - x.y, x.x * x.y);
    let mut field = filled([10, 5], bilinear);
    let half = 0.5 * field.bins.size();
    for (s, t) in [(0.0, 0.0), (0.3, 0.8), (0.77, 0.13), (1.0, 1.0)] {
        let (low, high) = (field.bins.low + half, field.bins.high - half);
        let x = low + (high - low).component_mul(&Point::new(s, t));
        assert!((field.at(x).unwrap() - bilinear(x)).norm() < 1e-13, "{x}");
    }
    let centre = field.bins.centre(23);
    let corner = centre + half;
    field.weights[23] = 0.0;
    let left: Point = [24, 33, 34].map(|bin| field.values[bin]).iter().sum::<Point>() / 3.0;
    assert!((field.at(corner).unwrap() - left).norm() < 1e-14, "mean of the three that are left");
    assert_eq!(field.at(Point::new(7.0, 0.0)), None);
}

#[test]
fn a_linear_trend_is_removed_and_the_flux_kept() {
    let profile = |y: f64| 1.0 + 0.3 * (2.0 * y).sin();
    let (alpha, scale) = (0.07, 40.0);
    let field = filled([50, 20], |x| scale * Point::new(profile(x.y) + alpha * x.x, 0.2 * x.y));
    let (kept, flux) = field.flux_kept(2.5).unwrap();
    let mean = (0..20).map(|j| profile(field.bins.centre(50 * j).y)).sum::<f64>() / 20.0;
    for bin in 0..kept.bins.len() {
        let x = kept.bins.centre(bin);
        let exact = Point::new(profile(x.y), 0.2 * x.y) / mean;
        assert!((kept.values[bin] - exact).norm() < 1e-13, "{x}: {} {exact}", kept.values[bin]);
    }
    assert!(
        (flux.minus / scale - (mean - 2.5 * alpha)).abs() < 1e-13
            && (flux.plus / scale - (mean + 2.5 * alpha)).abs() < 1e-13
    );
    // away from the sides of the box, where a Gaussian sees both sides alike, the filter keeps a linear trend
    let (kept, _) = field.filtered(1.0).flux_kept(2.5).unwrap();
    let column = |i: usize| (0..20).map(|j| kept.values[50 * j + i].x).collect::<Vec<f64>>();
    for i in 5..45 {
        let difference = column(i).iter().zip(column(5)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference < 1e-13, "column {i}: {difference:e}");
    }
}

#[test]
fn the_flux_is_one_at_both_ends_of_the_window_for_any_field() {
    let bins = bins([20, 8]);
    let field = averages(bins, &random_samples(bins, 4, 150, 11), 4).mean();
    assert!((0..bins.len()).any(|bin| !field.is_filled(bin)));
    for window in [0.3, 1.75, 2.5, 4.0] {
        let (kept, flux) = field.flux_kept(window).unwrap();
        assert_eq!((flux.minus, flux.plus), (field.flux(-window).unwrap(), field.flux(window).unwrap()));
        for x1 in [-window, window] {
            // centres of columns are the places that the trend is taken at: interpolation does not move them inside the
            // box
            let inside = (x1 - bins.low.x).min(bins.high.x - x1) > 0.5 * bins.size().x;
            let q = kept.flux(x1).unwrap();
            assert!(!inside || (q - 1.0).abs() < 1e-13, "{window}: {q}");
        }
    }
    assert!(Binned::empty(bins).flux_kept(2.0).is_err());
    let turning = filled([20, 8], |x| Point::new(x.y - 0.5, 0.0));
    let error = turning.flux_kept(2.0).unwrap_err().to_string();
    assert!(error.contains("needs a flux") && error.contains("hint"), "{error}");
}
