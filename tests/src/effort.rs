//! Effort of the statistical tests: quick or thorough.
//!
//! By default the tests make as few comparisons as demonstrate their claims, each of which still rejects a
//! bias of [`NOTICED`](crate::power::NOTICED). With `WARPED_AREA_TESTS=thorough` they make the same
//! comparisons on more scenes and samples.

/// Whether the environment variable `WARPED_AREA_TESTS` asks for thorough tests.
pub fn thorough() -> bool {
    match std::env::var("WARPED_AREA_TESTS").as_deref() {
        Err(std::env::VarError::NotPresent) | Ok("" | "quick") => false,
        Ok("thorough") => true,
        other => panic!("WARPED_AREA_TESTS is quick or thorough, not {other:?}"),
    }
}

/// One of two values by the effort: a number of scenes, say, or of samples.
pub fn pick<T>(quick: T, thorough: T) -> T {
    if self::thorough() { thorough } else { quick }
}
