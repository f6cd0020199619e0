//! See `volume3d::io::fuzz::scene`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| volume3d::io::fuzz::scene(bytes));
