//! The command `impinge`.

mod cli;

/// As much as the first thread of a program has.
const STACK: usize = 8 << 20;

fn main() -> std::process::ExitCode {
    // What threads share begins and ends in one of them, so that none has to be woken from outside.
    match rayon::ThreadPoolBuilder::new().stack_size(STACK).build() {
        Ok(pool) => pool.install(cli::main),
        Err(_) => cli::main(),
    }
}
