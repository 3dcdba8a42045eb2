//! What a person sees while a computation runs.

use std::cell::RefCell;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

use super::console;

#[cfg(feature = "cli")]
mod bar;
#[cfg(not(feature = "cli"))]
#[path = "progress/no_bar.rs"]
mod bar;

use bar::Bar;

/// How much is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors alone.
    Quiet,
    /// A bar, or a line now and then.
    Normal,
    /// A line for every step.
    Verbose,
}

/// One line about the state of a run.
#[derive(Debug, Clone, Copy)]
pub struct Status {
    /// Steps that were accepted.
    pub step: usize,
    /// Time that was reached.
    pub t: f64,
    /// Time at which the run ends at the latest.
    pub end: f64,
    /// Length of the last step.
    pub dt: f64,
    /// Iterations that it took.
    pub iterations: usize,
    /// Residual of the stationary equations, where it is known.
    pub residual: Option<f64>,
}

impl Status {
    /// Beside a bar: what matters most comes first, and all of it fits into 80 columns as long as the numbers are usual
    /// ones.
    fn short(&self, left: &str) -> String {
        let residual = self.residual.map_or_else(String::new, |r| format!("  residual {r:.1e}"));
        format!("step {}  t {:.4} of {}  {left} left{residual}", self.step, self.t, self.end)
    }

    fn long(&self, left: &str) -> String {
        let residual = self.residual.map_or_else(String::new, |r| format!("  residual {r:.2e}"));
        let Self { step, t, end, dt, iterations, .. } = self;
        format!("step {step}  t {t:.4} of {end}  dt {dt:.3e}  {iterations} iterations{residual}  {left} left at most")
    }
}

/// A bar on a terminal, a line now and then elsewhere, nothing when quiet.
#[derive(Debug)]
pub struct Progress {
    bar: Option<Bar>,
    verbosity: Verbosity,
    start: (Instant, f64),
    last_line: Instant,
    said: RefCell<Vec<String>>,
}

/// Plain lines are this far apart.
const PAUSE: Duration = Duration::from_secs(10);

impl Progress {
    /// Begins at time `t`.
    pub fn new(verbosity: Verbosity, t: f64) -> Self {
        let on_terminal = std::io::stderr().is_terminal() && verbosity == Verbosity::Normal;
        let bar = if on_terminal { Bar::new() } else { None };
        let now = Instant::now();
        Self { bar, verbosity, start: (now, t), last_line: now, said: RefCell::default() }
    }

    /// A remark on a line of its own.
    pub fn say(&self, text: &str) {
        self.said.borrow_mut().push(text.to_owned());
        match (&self.bar, self.verbosity) {
            (_, Verbosity::Quiet) => {}
            (Some(bar), Verbosity::Normal | Verbosity::Verbose) => bar.say(text),
            (None, Verbosity::Normal | Verbosity::Verbose) => console::note(text),
        }
    }

    /// Takes over what an earlier process said, without showing it again.
    pub fn recall(&self, said: &[String]) {
        self.said.borrow_mut().extend_from_slice(said);
    }

    /// All remarks so far, whether they were shown or not.
    pub fn said(&self) -> Vec<String> {
        self.said.borrow().clone()
    }

    /// Shows where the run is.
    pub fn show(&mut self, status: &Status) {
        let left = self.time_left(status);
        if let Some(bar) = &self.bar {
            bar.show(status.t / status.end, status.short(&left));
        } else {
            self.line(&status.long(&left));
        }
    }

    /// Shows where a search for a steady state is, whose residual has to fall to `bound`.
    pub fn show_search(&mut self, step: usize, dt: f64, residual: f64, bound: f64) {
        let text = format!("pseudo-step {step}  dt {dt:.2e}  residual {residual:.2e} (to reach {bound:.0e})");
        if let Some(bar) = &self.bar {
            let digits = -residual.log10() / -bound.log10();
            bar.show(digits.clamp(0.0, 1.0), text);
        } else {
            self.line(&text);
        }
    }

    fn line(&mut self, text: &str) {
        let due = self.verbosity == Verbosity::Normal && self.last_line.elapsed() >= PAUSE;
        if self.verbosity == Verbosity::Verbose || due {
            self.last_line = Instant::now();
            console::note(text);
        }
    }

    /// Time to `end` at the pace so far.
    fn time_left(&self, status: &Status) -> String {
        let done = status.t - self.start.1;
        if done <= 0.0 {
            return "?".into();
        }
        let seconds = self.start.0.elapsed().as_secs_f64() * (status.end - status.t).max(0.0) / done;
        let whole = seconds.min(1e9) as u64;
        format!("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.take_away();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_beside_the_bar_fits_into_a_terminal() {
        let status =
            Status { step: 123_456, t: 1234.5678, end: 2000.0, dt: 0.01, iterations: 12, residual: Some(1.2e-10) };
        let text = status.short("123:59:59");
        assert_eq!(text, "step 123456  t 1234.5678 of 2000  123:59:59 left  residual 1.2e-10");
        // the bar, its percents, and the gaps; what is longer is cut at the end of the line
        let usual = Status { step: 9999, t: 49.95, end: 50.0, ..status };
        assert!(12 + 1 + 4 + 2 + usual.short("0:59:59").len() <= 80);
    }
}
