//! What the program says while it works and when it ends: results on standard output, whose reader may leave early
//! (`spectral matrices | head -1`), and everything else on standard error.

use std::io::{self, ErrorKind, Write};

use crate::error::CliError;

/// Print a result as it is.
///
/// # Errors
/// [`CliError::OutputClosed`] if nobody reads any more; what the system says otherwise.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => CliError::OutputClosed,
        _ => CliError::failed(format!("cannot write to standard output: {error}")),
    })
}

/// A line on standard error. If that is closed too, the exit status is all that is left to say.
pub(crate) fn complain(line: &str) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// A warning on standard error.
pub(crate) fn warn(warning: &str) {
    complain(&format!("warning: {warning}"));
}

/// A warning on standard error that the statistics have, too.
pub(crate) fn warn_and_keep(warnings: &mut Vec<String>, warning: String) {
    warn(&warning);
    warnings.push(warning);
}
