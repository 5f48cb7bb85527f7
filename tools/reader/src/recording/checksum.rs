//! Whether checksums count.

/// True if checksums are compared: always, but in a build for fuzzing with `--cfg percuss_unchecked` (see `tools/fuzz`), where
/// they would keep changed bytes from all code behind them. `cargo fuzz` alone sets `fuzzing`.
pub const COUNT: bool = cfg!(not(all(fuzzing, percuss_unchecked)));
