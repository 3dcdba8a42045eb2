//! The rigid bodies of a run, and the films that its pictures make.

use maud::{Markup, html};

use super::tables::{cell, short};
use crate::output::frames::Frame;
use crate::results::Results;
use crate::results::bodies::BodiesAtTime;

/// Rows of the table.
const MOST: usize = 40;
const HEAD: [&str; 9] = ["x₁", "x₂", "θ", "V₁", "V₂", "ω", "f₁", "f₂", "torque"];

/// Where the bodies are at the end.
pub(super) fn table(run: &Results, notes: &mut Vec<String>) -> Markup {
    let seen = match BodiesAtTime::read(&run.path, None) {
        Ok(Some(seen)) => seen,
        Ok(None) => return html! {},
        Err(error) => {
            notes.push(error.to_string());
            return html! {};
        }
    };
    let count = seen.solids.bodies.len();
    let row = |k: usize| {
        let (pose, twist, load) = (&seen.poses[k], &seen.twists[k], &seen.loads[k]);
        let (x, v, f) = (pose.position, twist.velocity, load.force);
        [x.x, x.y, pose.angle, v.x, v.y, twist.spin, f.x, f.y, load.torque]
    };
    html! {
        h3 { "Bodies" }
        div.scroll {
            table {
                caption {
                    "Position, angle, velocity, spin, and force and torque of the contacts at t = " (short(seen.time))
                    @if count > MOST { "; the first " (MOST) " of " (count) " bodies, all are in bodies.csv" }
                }
                thead { tr { th scope="col" { "body" } @for name in HEAD { th.number scope="col" { (name) } } } }
                tbody {
                    @for (k, member) in seen.solids.bodies.iter().take(MOST).enumerate() {
                        tr {
                            th scope="row" { (member.name) @if member.fixed { " (fixed)" } }
                            @for value in row(k) { (cell(&value.to_string())) }
                        }
                    }
                }
            }
        }
    }
}

/// What the pictures of the run make.
pub(super) fn films(frames: &[Frame]) -> Markup {
    let mut films: Vec<(&str, Vec<&Frame>)> = Vec::new();
    for frame in frames {
        match films.iter_mut().find(|(name, _)| *name == frame.film) {
            Some((_, all)) => all.push(frame),
            None => films.push((&frame.film, vec![frame])),
        }
    }
    html! {
        @if !films.is_empty() {
            div.scroll {
                table {
                    caption {
                        "Films: the page shows the last picture of each; the command makes it in the run's folder"
                    }
                    thead {
                        tr {
                            th scope="col" { "film" }
                            th.number scope="col" { "pictures" }
                            th.number scope="col" { "from t" }
                            th.number scope="col" { "to t" }
                            th scope="col" { "command" }
                        }
                    }
                    tbody {
                        @for (name, all) in &films {
                            tr {
                                th scope="row" { (name) } (cell(&all.len().to_string()))
                                @for end in [all.first(), all.last()] {
                                    (cell(&end.map_or_else(String::new, |f| f.time.to_string())))
                                }
                                td {
                                    code { "ffmpeg -f concat -i frames-" (name) ".txt -pix_fmt yuv420p " (name) ".mp4" }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
