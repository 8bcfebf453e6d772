//! The `spectral` program; see the library for what it does.

use std::env;
use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_mesa();
    spectral_cli::run(env::args_os())
}

/// Without a desktop session, Mesa's device-select layer prints `error: XDG_RUNTIME_DIR ...` over our own messages;
/// without a desktop there is nothing for it to select by.
fn quiet_mesa() {
    if env::var_os("XDG_RUNTIME_DIR").is_none() && env::var_os("NODEVICE_SELECT").is_none() {
        #[allow(unsafe_code, reason = "the first statement of a program that has one thread yet")]
        // SAFETY: no other thread exists that could read the environment meanwhile.
        unsafe {
            env::set_var("NODEVICE_SELECT", "1");
        }
    }
}
