//! The velocity of a run from tables of cells that move with it.

use monolayer::measure::measured::Bins;
use monolayer::mesh::Point;
use monolayer::study::compare::{Comparison, RunVelocity};

use crate::common::{CELLS, compared, program, reading, strip, table};

const PLAIN: &str = "box = [[-6, -5], [8, 5]]\nbins = [28, 20]\nfilter = 0\n";

/// `κ = Σ_f 1/n_f / N²` of each bin: the variance of its mean when each velocity has variance 1. From the cells alone.
fn variance_factors(found: &Comparison) -> Vec<f64> {
    let bins = found.measured.bins;
    let mut counts = vec![vec![0_u32; found.tracks.frames]; bins.len()];
    for sample in &found.tracks.samples {
        if let Some(bin) = bins.find(sample.x) {
            counts[bin][sample.frame] += 1;
        }
    }
    let factor = |counts: &Vec<u32>| {
        let held = counts.iter().filter(|n| **n > 0);
        held.clone().map(|n| 1.0 / f64::from(*n)).sum::<f64>() / (held.count() as f64).powi(2)
    };
    counts.iter().map(factor).collect()
}

/// Bins that are compared, with their weights.
fn weighted(found: &Comparison) -> Vec<(usize, f64)> {
    let computed = found.computed.as_ref().unwrap();
    let fills = |bin: &usize| found.measured.is_filled(*bin) && computed.field.is_filled(*bin);
    (0..computed.shares.len()).filter(fills).map(|bin| (bin, computed.shares[bin])).collect()
}

fn error(found: &Comparison, bin: usize) -> Point {
    found.measured.values[bin] - found.computed.as_ref().unwrap().field.values[bin]
}

#[test]
fn noise_adds_what_statistics_say() {
    let temporary = tempfile::tempdir().unwrap();
    let noise = 0.2;
    let mut added = Vec::new();
    for frames in [5, 20, 80] {
        let clean = compared(&table(temporary.path(), frames, 0.0, 0.0), PLAIN);
        let noisy = compared(&table(temporary.path(), frames, noise, 0.0), PLAIN);
        let (factors, bins) = (variance_factors(&noisy), weighted(&noisy));
        let norm: f64 = {
            let field = &noisy.computed.as_ref().unwrap().field;
            bins.iter().map(|(bin, w)| w * field.values[*bin].norm_squared()).sum()
        };
        let squares =
            |found: &Comparison| bins.iter().map(|(bin, w)| w * error(found, *bin).norm_squared()).sum::<f64>();
        assert!((reading(&noisy, "relative").0 - (squares(&noisy) / norm).sqrt()).abs() < 1e-13);
        // places are the same, so E|e|² = |e_0|² + 2 S² κ in each bin, with variance 4 S⁴ κ² + 4 S² κ |e_0|²
        let mean: f64 = bins.iter().map(|(bin, w)| w * 2.0 * noise.powi(2) * factors[*bin]).sum();
        let variance: f64 = bins
            .iter()
            .map(|(bin, w)| {
                let s = noise.powi(2) * factors[*bin];
                w * w * 4.0 * (s * s + s * error(&clean, *bin).norm_squared())
            })
            .sum();
        let found = squares(&noisy) - squares(&clean);
        println!("{frames} frames: {found:.5}, expected {mean:.5} ± {:.5}", variance.sqrt());
        assert!((found - mean).abs() < 5.0 * variance.sqrt(), "{frames}: {found} {mean} ± {}", variance.sqrt());
        // what the data tell of themselves, without the run
        let told = noisy.computed.as_ref().unwrap().difference.noise;
        let relative = reading(&noisy, "relative").0;
        println!("relative {relative:.5}, noise {told:.5}");
        added.push((frames, (mean / norm).sqrt(), told));
    }
    for (frames, expected, told) in &added[1..] {
        // scatter within the bins is noise to the data as well
        assert!((0.9..1.3).contains(&(told / expected)), "{frames}: {told} {expected}");
    }
    let slope = (added[2].1 / added[1].1).ln() / 4.0_f64.ln();
    assert!((-0.55..-0.45).contains(&slope), "noise over samples to the power {slope}");
}

/// Range of the run's velocity in each bin.
fn ranges(bins: Bins) -> Vec<Point> {
    let run = RunVelocity::read(strip()).unwrap();
    let points = 30;
    let range = |bin: usize| {
        let place = |k: usize| k as f64 / f64::from(points - 1);
        let count = points as usize;
        let at = |k: usize| run.at(bins.inside(bin, Point::new(place(k % count), place(k / count))));
        let none = (Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY));
        let (low, high) = (0..count * count).filter_map(at).fold(none, |(a, b), v| (a.inf(&v), b.sup(&v)));
        high - low
    };
    (0..bins.len()).map(range).collect()
}

#[test]
fn without_noise_the_error_is_that_of_the_bins() {
    let temporary = tempfile::tempdir().unwrap();
    let path = table(temporary.path(), 20, 0.0, 0.0);
    let found = compared(&path, PLAIN);
    let ranges = ranges(found.measured.bins);
    // both means lie between the extremes of the velocity in the bin; the last tenth and 1e-5 for extremes between the
    // points and for the digits of the table
    for (bin, _) in weighted(&found) {
        let beyond = error(&found, bin).abs() - 1.1 * ranges[bin];
        assert!(beyond.max() < 1e-5, "bin {bin}: {}", error(&found, bin));
    }
    let coarse = compared(&path, &PLAIN.replace("[28, 20]", "[7, 5]"));
    let (fine, coarse) = (reading(&found, "relative").0, reading(&coarse, "relative").0);
    println!("relative error {fine:.5} on 28 × 20 bins, {coarse:.5} on 7 × 5");
    assert!(fine < 0.02 && reading(&found, "correlation_v1").0 > 0.99 && reading(&found, "correlation_v2").0 > 0.99);
    assert!(reading(&found, "bias_v1").0.abs() < 5.0 * reading(&found, "bias_v1").1);
}

#[test]
fn a_trend_in_the_table_is_removed() {
    let temporary = tempfile::tempdir().unwrap();
    let (trend, window) = (0.05, 4.0);
    let keys = format!("{PLAIN}window = {window}\n");
    let clean = compared(&table(temporary.path(), 20, 0.0, 0.0), &keys);
    let drifting = table(temporary.path(), 20, 0.0, trend);
    let moved = compared(&drifting, &keys);
    let flux = moved.flux.unwrap();
    let half = 0.5 * moved.measured.bins.size().x;
    // cells lie at most half a bin from the centre that the trend is taken at: so far their mean may be off
    assert!(
        (flux.plus - flux.minus - (clean.flux.unwrap().plus - clean.flux.unwrap().minus) - 2.0 * trend * window).abs()
            < 2.0 * trend * half
    );
    let factor = 2.0 / (flux.minus + flux.plus);
    for bin in (0..moved.measured.bins.len()).filter(|bin| moved.measured.is_filled(*bin)) {
        let x1 = moved.measured.bins.centre(bin).x;
        let (a, b) = (moved.measured.values[bin], clean.measured.values[bin]);
        let bound = factor * trend * half * (1.0 + x1.abs() / window + b.norm());
        assert!((a - b).norm() < bound + 1e-4, "bin {bin}: {a} {b}");
    }
    let left = compared(&drifting, PLAIN);
    assert!(reading(&left, "relative").0 > 5.0 * reading(&moved, "relative").0, "without the correction");
}

#[test]
fn units_of_the_table_do_not_matter() {
    let temporary = tempfile::tempdir().unwrap();
    let path = table(temporary.path(), 5, 0.1, 0.0);
    let plain = compared(&path, PLAIN);
    let text = std::fs::read_to_string(&path).unwrap();
    let (length, speed, x0) = (64.0, 16.0, [512.0, 256.0]);
    let row = |line: &str| {
        let n: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        format!(
            " {},{} , {},{},{}",
            n[3] * speed,
            n[1] * length + x0[1],
            n[2] * 0.1,
            n[0] * length + x0[0],
            n[4] * speed
        )
    };
    let rows: Vec<String> = text.lines().skip(1).map(row).collect();
    let other = temporary.path().join("other.csv");
    std::fs::write(&other, format!("u,Y,\"time, h\",X,w\n{}\n", rows.join("\n"))).unwrap();
    let keys = format!(
        "{PLAIN}columns = {{ x = \"X\", y = \"Y\", t = \"time, h\", vx = \"u\", vy = \"w\" }}\nlength = 64\n\
         speed = 16\ncentre = [512, 256]\n"
    );
    let found = compared(&other, &keys);
    assert_eq!(found.averages.cells, plain.averages.cells);
    for bin in 0..found.measured.values.len() {
        assert!((found.measured.values[bin] - plain.measured.values[bin]).norm() < 1e-12);
    }
    // frames of a length
    let joined = compared(&other, &format!("{keys}frames = 0.1\n"));
    assert_eq!((joined.tracks.frames, &joined.measured), (5, &found.measured));
    assert_eq!(compared(&other, &format!("{keys}frames = 0.2\n")).tracks.frames, 3);
}

#[test]
fn the_standard_error_of_a_mean_is_the_familiar_one() {
    let temporary = tempfile::tempdir().unwrap();
    let path = table(temporary.path(), 12, 0.3, 0.0);
    // four large bins that hold cells in all frames: the bias is a mean over frames of the mean over bins
    let found = compared(&path, "box = [[3, -4], [7, 4]]\nbins = [2, 2]\nfilter = 0\n");
    assert!(found.averages.frames.iter().all(|n| *n == 12) && found.computed.as_ref().unwrap().shares == [1.0; 4]);
    let mean_of = |frame: usize| {
        let mean = |bin: usize| {
            let own =
                found.tracks.samples.iter().filter(|s| s.frame == frame && found.measured.bins.find(s.x) == Some(bin));
            own.clone().map(|s| s.v.x).sum::<f64>() / own.count() as f64
        };
        (0..4).map(mean).sum::<f64>() / 4.0
    };
    let means: Vec<f64> = (0..12).map(mean_of).collect();
    let mean = means.iter().sum::<f64>() / 12.0;
    let error = (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (12.0 * 11.0)).sqrt();
    assert!((reading(&found, "bias_v1").1 - error).abs() < 1e-12, "{} {error}", reading(&found, "bias_v1").1);
}

#[test]
fn the_program_leaves_tables_cuts_and_plots_that_do_not_depend_on_threads() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let run = strip().to_str().unwrap();
    let cells = (CELLS / 5).to_string();
    let make = ["compare", "--synthesize", run, "--cells", &cells, "--frames", "6", "--noise", "0.1", "--seed", "2"];
    for name in ["a.csv", "b.csv"] {
        let output = program(&[&make[..], &["--out", name, "--box=-5,-5,7,5"]].concat(), folder);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert_eq!(read("a.csv"), read("b.csv"));
    let text = format!("data = \"a.csv\"\nbox = [[-5, -5], [7, 5]]\nbins = [24, 20]\nwindow = 2.5\nrun = '{run}'\n");
    std::fs::write(folder.join("c.toml"), text).unwrap();
    for threads in ["1", "2"] {
        let output = program(&["compare", "c.toml", "--out", threads, "--threads", threads], folder);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(said.contains("relative") && said.contains("bins compared"), "{said}");
    }
    for name in
        ["field.csv", "run.csv", "comparison.csv", "summary.json", "cuts/axis-3.csv", "plots/axis-1.svg", "study.toml"]
    {
        assert_eq!(read(&format!("1/{name}")), read(&format!("2/{name}")), "{name}");
    }
    let mut field = csv::Reader::from_path(folder.join("1/field.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = field.records().map(Result::unwrap).collect();
    let empty = rows.iter().filter(|row| &row[2] == "0").count();
    assert!(rows.len() == 480 && empty > 12, "{empty} empty bins: those of the disc and some without cells");
    assert!(rows.iter().all(|row| (&row[2] == "0") == row[4].is_empty()));
    for axis in ["1", "2a", "2b", "3", "4", "5"] {
        let text = std::fs::read_to_string(folder.join(format!("1/cuts/axis-{axis}.csv"))).unwrap();
        assert!(text.starts_with("s,x1,x2,v1,v2") && text.lines().count() > 500, "{axis}");
        assert!(folder.join(format!("1/plots/axis-{axis}.png")).exists());
    }
    for map in ["measured-speed", "run-speed", "difference"] {
        assert!(
            read(&format!("1/plots/{map}.png")).len() > 10_000 && folder.join(format!("1/plots/{map}.svg")).exists()
        );
    }
    let summary: serde_json::Value = serde_json::from_slice(&read("1/summary.json")).unwrap();
    assert_eq!(summary["frames"], 6);
    assert!(summary["measures"]["relative"]["standard_error"].as_f64().unwrap() > 0.0);
    // what the study says can be done again from the folder of its results
    let again = program(&["compare", "1/study.toml", "--out", "again", "-q"], folder);
    assert!(again.status.success() && again.stdout.is_empty(), "{}", String::from_utf8_lossy(&again.stderr));
    assert_eq!(read("1/comparison.csv"), read("again/comparison.csv"));
}
