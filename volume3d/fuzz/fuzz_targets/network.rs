//! See `volume3d::io::fuzz::network`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| volume3d::io::fuzz::network(bytes));
