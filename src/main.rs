//! The command `impinge`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
