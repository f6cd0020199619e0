//! See `volume3d::io::fuzz::sdf`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| volume3d::io::fuzz::sdf(bytes));
