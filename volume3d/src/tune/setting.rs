//! The settings that a study measures.

use std::fmt;

use flatland::warp::{Debias, Warp};

use crate::gradient::{Estimator, Field, FiniteDifference, Tangent, WarpedArea};
use crate::scene::Scene;

/// A method with its settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// [`Estimator::warped_area`].
    WarpedArea,
    /// [`Estimator::edge_sampling`].
    EdgeSampling,
    /// [`Estimator::softened`].
    Softened,
    /// [`Estimator::auto`].
    Auto,
    /// [`Estimator::auxiliary_rays`].
    AuxiliaryRays,
    /// A fixed number of auxiliary rays, without debiasing.
    FewRays(usize),
    /// [`Estimator::rotation`].
    Rotation,
    /// [`Estimator::interior`].
    Interior,
    /// [`Estimator::finite_difference`] with this step.
    FiniteDifference(f64),
}

/// Unbiased settings. The first two are candidates for the reference.
const UNBIASED: [Setting; 5] =
    [Setting::WarpedArea, Setting::EdgeSampling, Setting::Softened, Setting::Auto, Setting::AuxiliaryRays];

/// Settings that are biased where geometry moves.
const BIASED: [Setting; 5] =
    [Setting::FewRays(4), Setting::FewRays(16), Setting::FewRays(64), Setting::Rotation, Setting::Interior];

/// The default steps to leave out: the bias of the largest is too large to be a choice.
const SKIPPED: usize = 1;

impl Setting {
    /// All settings worth measuring for a change. If no geometry moves, all methods except finite differences
    /// are the interior term, and one setting stands for them.
    #[must_use]
    pub fn all(scene: &Scene, change: &Tangent) -> Vec<Self> {
        let mut all = if change.is_geometric() {
            [UNBIASED, BIASED].concat()
        } else {
            vec![Self::WarpedArea, Self::Interior]
        };
        all.extend(Self::differences(scene, change));
        all
    }

    /// The candidates for the reference: unbiased methods, of which the better is taken.
    pub(super) fn references(change: &Tangent) -> &'static [Self] {
        if change.is_geometric() { &UNBIASED[..2] } else { &UNBIASED[..1] }
    }

    /// The reference for a scene that no unbiased method supports: the second largest step of finite
    /// differences, whose difference from the smaller ones is then visible. The smallest may be dominated by
    /// noise.
    pub(super) fn makeshift(scene: &Scene, change: &Tangent) -> Self {
        let default = FiniteDifference::default().step;
        Self::differences(scene, change).get(1).copied().unwrap_or(Self::FiniteDifference(default))
    }

    /// Finite differences, from large to small steps, rounded to two digits.
    fn differences(scene: &Scene, change: &Tangent) -> Vec<Self> {
        let rounded = |step: f64| format!("{step:.1e}").parse().unwrap_or(step);
        let steps = FiniteDifference::steps(scene, change).into_iter().skip(SKIPPED);
        steps.map(|step| Self::FiniteDifference(rounded(step))).collect()
    }

    /// Whether it is proved to be unbiased for a change.
    #[must_use]
    pub fn is_unbiased(self, change: &Tangent) -> bool {
        UNBIASED.contains(&self) || (self == Self::Interior && !change.is_geometric())
    }

    /// The method with a number of samples and a seed.
    #[must_use]
    pub fn estimator(self, samples: usize, seed: u64) -> Estimator {
        match self {
            Self::WarpedArea => Estimator::warped_area(samples, seed),
            Self::EdgeSampling => Estimator::edge_sampling(samples, seed),
            Self::Softened => Estimator::softened(samples, seed),
            Self::Auto => Estimator::auto(samples, seed),
            Self::AuxiliaryRays => Estimator::auxiliary_rays(samples, seed),
            Self::FewRays(rays) => {
                let method = WarpedArea::default();
                let warp = Warp { debias: Debias::Consistent { rays }, ..method.warp };
                let field = Field::AuxiliaryRays;
                Estimator::WarpedArea(WarpedArea { samples, seed, field, warp, ..method })
            }
            Self::Rotation => Estimator::rotation(samples, seed),
            Self::Interior => Estimator::interior(samples, seed),
            Self::FiniteDifference(step) => Estimator::finite_difference(samples, step, seed),
        }
    }

    /// The name of the method in [`Estimator::METHODS`], if name and step determine the setting.
    #[must_use]
    pub fn method(self) -> Option<&'static str> {
        match self {
            Self::WarpedArea => Some("warped-area"),
            Self::EdgeSampling => Some("edge"),
            Self::Auto => Some("auto"),
            Self::Rotation => Some("rotation"),
            Self::Interior => Some("interior"),
            Self::FiniteDifference(_) => Some("finite-difference"),
            Self::Softened | Self::AuxiliaryRays | Self::FewRays(_) => None,
        }
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FiniteDifference(step) => write!(f, "finite-difference, step {step:.1e}"),
            Self::Softened => f.write_str("warped-area, softened field"),
            Self::AuxiliaryRays => f.write_str("warped-area, auxiliary rays"),
            Self::FewRays(rays) => write!(f, "warped-area, {rays} auxiliary rays without debiasing"),
            other => f.write_str(other.method().unwrap_or_default()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_methods() {
        for setting in [UNBIASED, BIASED].concat() {
            if let Some(name) = setting.method() {
                let named = Estimator::by_name(name, 8, 3).unwrap();
                assert_eq!(format!("{named:?}"), format!("{:?}", setting.estimator(8, 3)));
            }
        }
    }
}
