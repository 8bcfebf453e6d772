//! Runs the program and looks at everything that came out.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// What a run of the program left.
pub(crate) struct Run {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Run `spectral` with arguments separated by blanks, in a folder of its own.
pub(crate) fn spectral(args: &str) -> Run {
    spectral_in(tempfile::tempdir().expect("folder").path(), args)
}

/// The same in another working folder.
pub(crate) fn spectral_in(folder: &Path, args: &str) -> Run {
    run(Command::new(env!("CARGO_BIN_EXE_spectral")).args(args.split_whitespace()).current_dir(folder))
}

/// Run a prepared command to its end.
pub(crate) fn run(command: &mut Command) -> Run {
    let Output { status, stdout, stderr } =
        command.stdin(Stdio::null()).output().expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("the program prints UTF-8");
    Run { status: status.code(), stdout: text(stdout), stderr: text(stderr) }
}

impl Run {
    /// It did what it was asked.
    #[track_caller]
    pub(crate) fn done(self) -> Self {
        assert_eq!(self.status, Some(0), "{}", self.stderr);
        self
    }

    /// It refused the command line with status 2 and at most two lines on standard error, which have every one of
    /// `words` in them.
    #[track_caller]
    pub(crate) fn bad_usage(self, words: &[&str]) -> Self {
        self.ended_with(2, words)
    }

    /// It failed with status 1, likewise.
    #[track_caller]
    pub(crate) fn failed(self, words: &[&str]) -> Self {
        self.ended_with(1, words)
    }

    #[track_caller]
    fn ended_with(self, status: i32, words: &[&str]) -> Self {
        assert_eq!(self.status, Some(status), "{}", self.stderr);
        let lines = self.stderr.lines().filter(|line| !line.starts_with("warning: ")).count();
        assert!((1..=2).contains(&lines), "{} lines: {}", lines, self.stderr);
        assert!(self.stderr.contains("error: "), "{}", self.stderr);
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        assert_eq!(self.stdout, "");
        for word in words {
            assert!(self.stderr.contains(word), "no {word:?} in {}", self.stderr);
        }
        self
    }
}

/// Names of everything in a folder, sorted, hidden files included.
pub(crate) fn files_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder can be listed");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("an entry").file_name().into_string().expect("a UTF-8 name")).collect();
    names.sort();
    names
}
