//! The program: a thin way into the library.

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    sindyscope::command::main()
}

/// A web page begins with the library.
#[cfg(target_arch = "wasm32")]
fn main() {}
