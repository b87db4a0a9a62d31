//! The program: a thin way into the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    sindyscope::command::main()
}
