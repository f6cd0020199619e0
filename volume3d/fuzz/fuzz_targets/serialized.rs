//! See `volume3d::io::fuzz::serialized`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| volume3d::io::fuzz::serialized(bytes));
