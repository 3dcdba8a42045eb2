//! Velocities from the positions of tracked cells.

use crate::mesh::Point;

/// A cell that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    /// Spots of one cell have one number.
    pub track: usize,
    pub t: f64,
    pub x: Point,
}

/// How many spots have no velocity, and why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Without {
    /// A neighbour in time is missing: the track begins, ends or has a gap.
    pub at_ends: usize,
    /// The track has several spots in this frame or the next or last one: which belong together is not known.
    pub at_forks: usize,
}

/// Frames this many usual steps apart still follow each other.
const NEXT: f64 = 1.5;

/// Central differences `(x(t₊) − x(t₋))/(t₊ − t₋)` for each spot, from the spots of its track in the frames before and
/// after; NaN where there are none.
pub(super) fn velocities(spots: &[Spot]) -> (Vec<Point>, Without) {
    let mut order: Vec<usize> = (0..spots.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (&spots[*a], &spots[*b]);
        a.track.cmp(&b.track).then(a.t.total_cmp(&b.t))
    });
    let step = usual_step(spots);
    let mut found = vec![Point::repeat(f64::NAN); spots.len()];
    let mut without = Without::default();
    for track in order.chunk_by(|a, b| spots[*a].track == spots[*b].track) {
        let frames: Vec<&[usize]> = track.chunk_by(|a, b| spots[*a].t == spots[*b].t).collect();
        for (k, here) in frames.iter().enumerate() {
            let follows = |a: &&[usize], b: &&[usize]| spots[b[0]].t - spots[a[0]].t <= NEXT * step;
            let before = k.checked_sub(1).map(|k| frames[k]).filter(|before| follows(before, here));
            let after = frames.get(k + 1).copied().filter(|after| follows(here, after));
            match (before, here, after) {
                (Some(&[a]), &&[at], Some(&[b])) => {
                    found[at] = (spots[b].x - spots[a].x) / (spots[b].t - spots[a].t);
                }
                (None, _, _) | (_, _, None) => without.at_ends += here.len(),
                (Some(_), _, Some(_)) => without.at_forks += here.len(),
            }
        }
    }
    (found, without)
}

/// The median of the differences of successive times.
fn usual_step(spots: &[Spot]) -> f64 {
    let mut times: Vec<f64> = spots.iter().map(|spot| spot.t).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocities_are_central_differences_within_a_track() {
        let spot = |track, t: f64, x: f64| Spot { track, t, x: Point::new(x, -2.0 * x) };
        // track 0 moves as t², out of order; track 1 has a gap; track 2 divides
        let spots = [
            spot(0, 2.0, 4.0),
            spot(0, 0.0, 0.0),
            spot(0, 1.0, 1.0),
            spot(0, 3.0, 9.0),
            spot(1, 0.0, 0.0),
            spot(1, 1.0, 1.0),
            spot(1, 3.0, 3.0),
            spot(1, 4.0, 4.0),
            spot(1, 5.0, 7.0),
            spot(2, 1.0, 0.0),
            spot(2, 2.0, 0.5),
            spot(2, 3.0, 1.0),
            spot(2, 3.0, 2.0),
        ];
        let (found, without) = velocities(&spots);
        let known: Vec<(usize, f64)> =
            (0..spots.len()).filter(|k| !found[*k].x.is_nan()).map(|k| (k, found[k].x)).collect();
        assert_eq!(known, [(0, 4.0), (2, 2.0), (7, 2.0)]);
        assert!(known.iter().all(|(k, v)| found[*k].y == -2.0 * v));
        assert_eq!(without, Without { at_ends: 9, at_forks: 1 });
    }
}
