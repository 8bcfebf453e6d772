//! Progress of long work on a terminal.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU32, Ordering};

/// A callback that rewrites one line of a terminal; a pipe gets none.
pub fn percent_on_terminal(what: &'static str) -> impl Fn(f64) + Sync {
    let last = AtomicU32::new(u32::MAX);
    let terminal = std::io::stderr().is_terminal();
    move |share| {
        let percent = (share * 100.0) as u32;
        if terminal && last.swap(percent, Ordering::Relaxed) != percent {
            let end = if percent >= 100 { "\r            \r" } else { "" };
            let _ = write!(std::io::stderr(), "\r  {what} {percent:3} %{end}");
        }
    }
}
