//! Parallel computation of parts that are consumed in order.

use rayon::prelude::*;

use crate::gradient::{Progress, Stopped};

/// Parts per block: enough to keep all threads busy, few enough to bound memory.
const BLOCK: usize = 64;

/// Computes parts 0, 1, … on all threads and consumes them in this order, so that sums do not depend on
/// threads.
pub(in crate::gradient) fn in_order<T: Send>(
    parts: usize,
    progress: &Progress,
    part: impl Fn(usize) -> T + Sync,
    mut take: impl FnMut(usize, T),
) -> Result<(), Stopped> {
    progress.start(parts);
    for start in (0..parts).step_by(BLOCK) {
        let block: Vec<T> = (start..parts.min(start + BLOCK))
            .into_par_iter()
            .map(|number| {
                let part = part(number);
                progress.advance();
                part
            })
            .collect();
        if progress.stopped() {
            return Err(Stopped);
        }
        block.into_iter().enumerate().for_each(|(k, part)| take(start + k, part));
    }
    Ok(())
}
