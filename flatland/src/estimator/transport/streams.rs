//! Random numbers of samples.

use crate::random::{Stream, stream};
use crate::transport::path_stream;

/// Streams of one sample: of the path, which is the image's own; of auxiliary rays; and of the view at the
/// end of a pixel. Paths of one seed may differ in length, depending on whether materials are differentiated,
/// and must not affect the others.
#[derive(Debug)]
pub(super) struct Streams {
    pub(super) path: Stream,
    pub(super) auxiliary: Stream,
    pub(super) pixel_end: Stream,
}

/// Words of stream addresses that no sample has.
const AUXILIARY: u64 = u64::MAX;
const PIXEL_END: u64 = u64::MAX - 1;
pub(super) const CONTROL: u64 = u64::MAX - 2;

impl Streams {
    pub(super) fn new(seed: u64, pixel: usize, sample: usize) -> Self {
        Self {
            path: path_stream(seed, pixel, sample),
            auxiliary: stream(seed, &[pixel as u64, sample as u64, AUXILIARY]),
            pixel_end: stream(seed, &[pixel as u64, sample as u64, PIXEL_END]),
        }
    }
}
