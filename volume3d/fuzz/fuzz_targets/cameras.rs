//! See `volume3d::io::fuzz::cameras`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| volume3d::io::fuzz::cameras(bytes));
