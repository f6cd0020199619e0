//! Finite differences at a bound of a parameter's range.

use volume3d::gradient::OneSided;

/// A line if differences are one-sided, with their steps; empty otherwise.
pub(super) fn one_sided<'a>(found: impl IntoIterator<Item = (f64, &'a OneSided)>) -> String {
    let found: Vec<_> = found.into_iter().collect();
    let Some((_, OneSided { ahead, outside })) = found.first() else { return String::new() };
    let (side, other) = if *ahead { ("θ to θ + h", "θ − h") } else { ("θ − h to θ", "θ + h") };
    let steps: Vec<_> = found.iter().map(|(step, _)| format!("{step:.1e}")).collect();
    let steps = steps.join(", ");
    format!(
        "ONE-SIDED differences at step {steps}, from {side}, whose error is proportional to the step: at {other} \
         {outside}\n"
    )
}
