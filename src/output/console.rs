//! Everything that is printed. What is computed does not depend on whether somebody reads it: after the first line that
//! cannot be written to a stream (a reader that has gone, a full disk, a terminal that was closed), nothing more is
//! written there.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Standard output, standard error: whether they are lost.
static LOST: [AtomicBool; 2] = [AtomicBool::new(false), AtomicBool::new(false)];

/// Prints a line to standard error.
pub fn note(text: &str) {
    // nobody is left who could be told
    let _ = line(&LOST[1], &mut io::stderr(), text);
}

/// Prints a line to standard output, beside results that are in files.
pub fn tell(text: &str) {
    let _ = line(&LOST[0], &mut io::stdout(), text);
}

/// Prints what a command was asked for, and what is nowhere else.
///
/// # Errors
/// A stream that cannot be written. A reader who has gone away had enough.
pub fn answer(text: &str) -> io::Result<()> {
    match line(&LOST[0], &mut io::stdout(), text) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(io::Error::new(error.kind(), format!("standard output cannot be written: {error}")))
        }
        Ok(()) | Err(_) => Ok(()),
    }
}

fn line(lost: &AtomicBool, stream: &mut dyn Write, text: &str) -> io::Result<()> {
    if lost.load(Ordering::Relaxed) {
        return Ok(());
    }
    let written = writeln!(stream, "{text}").and_then(|()| stream.flush());
    if written.is_err() {
        lost.store(true, Ordering::Relaxed);
    }
    written
}

#[cfg(test)]
mod tests {
    use std::io::{self, Write};
    use std::sync::atomic::AtomicBool;

    use super::line;

    struct Closed(usize);

    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            self.0 += 1;
            Err(io::ErrorKind::BrokenPipe.into())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn after_the_first_failure_nothing_is_tried_again() {
        let (lost, mut stream) = (AtomicBool::new(false), Closed(0));
        assert!(line(&lost, &mut stream, "a").is_err());
        assert!(line(&lost, &mut stream, "b").is_ok());
        assert_eq!(stream.0, 1);
    }
}
