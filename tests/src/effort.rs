//! How much the statistical tests spend.
//!
//! By default they make as few comparisons as show what they are for, each of which could still notice a bias of
//! [`NOTICED`](crate::power::NOTICED). With `WARPED_AREA_TESTS=thorough` they make the same comparisons on more scenes
//! and samples.

/// Whether the environment variable `WARPED_AREA_TESTS` asks for everything.
pub fn thorough() -> bool {
    match std::env::var("WARPED_AREA_TESTS").as_deref() {
        Err(std::env::VarError::NotPresent) | Ok("" | "quick") => false,
        Ok("thorough") => true,
        other => panic!("WARPED_AREA_TESTS is quick or thorough, not {other:?}"),
    }
}

/// One of two numbers: of scenes, say, or of samples.
pub fn pick<T>(quick: T, thorough: T) -> T {
    if self::thorough() { thorough } else { quick }
}
