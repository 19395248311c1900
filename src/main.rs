//! Thin binary over [`sph_prep::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    sph_prep::cli::main()
}
