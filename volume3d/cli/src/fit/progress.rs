//! The progress bars of a fit.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use volume3d::optimize::{Fit, Record};

/// A progress bar on standard error, if that is a terminal.
pub(super) fn bar(what: &'static str, steps: u64) -> ProgressBar {
    let template = format!("{what} {{bar:24}} {{pos}}/{{len}}  {{msg}}  {{elapsed}} elapsed, {{eta}} left");
    let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(steps).with_style(style);
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Loss and learning rates of the last step.
pub(super) fn message(fit: &Fit, record: &Record) -> String {
    let mut rates: Vec<f64> = vec![];
    for rate in fit.optimizers().iter().map(|optimizer| record.factor * optimizer.adam.rate) {
        if !rates.contains(&rate) {
            rates.push(rate);
        }
    }
    let rates: Vec<String> = rates.iter().map(|rate| format!("{rate:.2e}")).collect();
    format!("loss {:.3e}, learning rate {}", record.loss, rates.join(", "))
}
