//! `supple`: design compliant robots that need little information to be controlled.

fn main() -> std::process::ExitCode {
    supple_cli::run()
}
