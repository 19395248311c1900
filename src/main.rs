//! Thin binary over [`sph_prep::cli`].

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    sph_prep::cli::main()
}
