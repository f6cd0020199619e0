//! `--method` and its options.

use clap::error::ErrorKind;
use clap::{Args, ValueEnum};
use flatland::warp::{Debias, Warp};
use volume3d::gradient::{
    Choice, EdgeSampling, Estimator, Field, FiniteDifference, GradientError, ImplicitField, Pilot, WarpedArea,
};

use super::missing::Kind;
use super::report::usage;

#[derive(Args, Debug)]
pub(super) struct MethodOptions {
    /// The estimator of the derivative [default: auto; edge with --allow-missing; warped-area with its
    /// options].
    #[arg(long, value_enum)]
    method: Option<Method>,
    /// Warped area: construction of the field [default: jump-mean; rays with --debias or --aux]. Implies
    /// --method warped-area.
    #[arg(long, value_enum)]
    field: Option<FieldKind>,
    /// Warped area: the field at silhouettes of implicit surfaces [default: vicini].
    #[arg(long, value_enum)]
    implicit_field: Option<ImplicitKind>,
    /// With --implicit-field bangaru: only the K points of a ray with the smallest distances count, as in the
    /// paper. The field is then discontinuous and the result biased: for comparison.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(2..))]
    nearest: Option<u32>,
    /// Warped area: how the bias of the warp due to finitely many auxiliary rays is removed.
    #[arg(long, value_enum)]
    debias: Option<Bias>,
    /// Warped area: auxiliary rays of one estimate of the warp, on the film and at every bounce; the smallest
    /// number unless --debias is none [default: 16; 4 with --debias roulette].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    aux: Option<u32>,
    /// Edge sampling: leaves out the motion of discontinuities of these kinds, which no method follows,
    /// instead of refusing scenes that have them. The rest of the derivative is unchanged. What is left out
    /// is listed, and stored in the header of a gradient in .exr format.
    #[arg(long, value_enum, value_name = "WHAT,…", value_delimiter = ',')]
    allow_missing: Vec<Kind>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// Warped area (exact or softened mean) or edge sampling, whichever a pilot with few samples expects to
    /// have the smaller error in the time of --spp samples of warped-area; the pilot also splits the samples.
    /// Unbiased. Always warped area for scenes with implicit surfaces, ideal mirrors, glass, masks or lights
    /// without extent, and if no geometry moves.
    #[value(name = "auto")]
    Automatic,
    /// Warped-area sampling: unbiased, except with --debias none. Refuses bump maps and abrupt beams where
    /// geometry moves.
    WarpedArea,
    /// Edge sampling: unbiased. Uses --spp paths per pixel and as many samples of each kind of discontinuity:
    /// up to two kinds seen by the camera, and up to five seen from surfaces. Refuses moving geometry with
    /// ideal mirrors, glass, masks and lights without extent, too.
    Edge,
    /// One rotation per kernel: biased unless what moves rotates as a whole.
    Rotation,
    /// Central differences with common random numbers: bias ~ step², noise ~ 1/√step. Supports every scene.
    /// At a bound of a parameter's range the differences are one-sided, with bias ~ step; a line says so.
    FiniteDifference,
    /// The interior term alone: biased where silhouettes or edges of shadows or lights move.
    Interior,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FieldKind {
    /// The exact weighted mean over the edges near a direction, without auxiliary rays.
    JumpMean,
    /// A softened mean over the edges. What it leaves is sampled at silhouettes, with --spp/4 samples, and at
    /// shadows, with --spp/2. For clutter and penumbrae, where the exact mean has heavy tails.
    Softened,
    /// From the hits of auxiliary rays on meshes and implicit surfaces, as in the paper.
    Rays,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ImplicitKind {
    /// One point per ray, a mean over the steps of its sphere tracing (Vicini et al. 2022).
    Vicini,
    /// All points of a ray's sphere tracing (Bangaru et al. 2022).
    Bangaru,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Bias {
    /// No debiasing: N rays; less noise, and a bias that falls as 1/N.
    None,
    /// Russian roulette, as in the paper: unbiased, but of infinite variance; for comparison.
    Roulette,
    /// Differences between levels with more and more rays: unbiased (the default).
    Multilevel,
}

/// The exponent of Russian roulette's tail: the middle of its range (1, 2).
const TAIL: f64 = 1.5;

/// Default number of rays without debiasing; the bias is then a few per cent of the boundary term.
const RAYS_WITHOUT_DEBIASING: usize = 16;

impl Method {
    /// The name in options and in the library.
    fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

impl MethodOptions {
    /// A method with its default options.
    pub(super) fn plain(method: Method) -> Self {
        let method = Some(method);
        Self {
            method,
            field: None,
            implicit_field: None,
            nearest: None,
            debias: None,
            aux: None,
            allow_missing: vec![],
        }
    }

    /// Whether a pilot chooses the method.
    pub(super) fn is_automatic(&self) -> bool {
        self.method() == Method::Automatic && !self.is_finite_difference()
    }

    fn method(&self) -> Method {
        let warped = self.asks_for_rays() || self.field.is_some() || self.asks_for_implicit_field();
        self.method.unwrap_or(match () {
            () if !self.allow_missing.is_empty() => Method::Edge,
            () if warped => Method::WarpedArea,
            () => Method::Automatic,
        })
    }

    pub(super) fn is_finite_difference(&self) -> bool {
        self.method() == Method::FiniteDifference
    }

    pub(super) fn is_interior(&self) -> bool {
        self.method() == Method::Interior
    }

    /// Refuses options that exclude one another, before any work.
    pub(super) fn check(&self, command: &'static str, step: bool) -> anyhow::Result<()> {
        let conflict = |text: &str| Err(usage(command, ErrorKind::ArgumentConflict, text.to_owned()));
        let rays = self.asks_for_rays();
        if self.method() != Method::WarpedArea && (rays || self.field.is_some()) {
            return conflict("--field, --debias and --aux belong to --method warped-area");
        }
        if self.field.is_some_and(|field| field != FieldKind::Rays) && rays {
            return conflict("--debias and --aux belong to --field rays");
        }
        let implicit = self.asks_for_implicit_field();
        if implicit && (self.method() != Method::WarpedArea || self.field == Some(FieldKind::Rays) || rays) {
            return conflict(
                "--implicit-field and --nearest belong to --method warped-area --field jump-mean",
            );
        }
        if self.nearest.is_some() && self.implicit_field != Some(ImplicitKind::Bangaru) {
            return conflict("--nearest belongs to --implicit-field bangaru");
        }
        if !self.allow_missing.is_empty() && self.method() != Method::Edge {
            return conflict(
                "--allow-missing belongs to --method edge, where leaving out a term does not change the others",
            );
        }
        if step && !self.is_finite_difference() {
            return conflict("--step belongs to --method finite-difference");
        }
        Ok(())
    }

    pub(super) fn estimator(&self, samples: usize, seed: u64, step: Option<f64>) -> Estimator {
        let estimator = Estimator::by_name(&self.method().name(), samples, seed);
        let method = match estimator.expect("a name of the library's") {
            Estimator::FiniteDifference(method) => {
                let step = step.unwrap_or(method.step);
                return Estimator::FiniteDifference(FiniteDifference { step, ..method });
            }
            Estimator::EdgeSampling(method) => {
                let allow_missing = self.allow_missing.iter().map(|&kind| kind.into()).collect();
                return Estimator::EdgeSampling(EdgeSampling { allow_missing, ..method });
            }
            Estimator::WarpedArea(method) => method,
            other => return other,
        };
        let warp = Warp { debias: self.debias(), ..method.warp };
        let rays = self.field == Some(FieldKind::Rays) || self.asks_for_rays();
        let field = match self.field {
            _ if rays => Field::AuxiliaryRays,
            Some(FieldKind::Softened) => Field::softened(samples),
            _ => Field::default(),
        };
        let implicit = self.implicit();
        Estimator::WarpedArea(WarpedArea { field, implicit, warp, ..method })
    }

    fn implicit(&self) -> ImplicitField {
        let Some(ImplicitKind::Bangaru) = self.implicit_field else { return ImplicitField::default() };
        match (ImplicitField::bangaru(), self.nearest) {
            (ImplicitField::Bangaru { gamma, lambda, .. }, Some(nearest)) => {
                ImplicitField::Bangaru { gamma, lambda, nearest: Some(nearest as usize) }
            }
            (all, _) => all,
        }
    }

    fn asks_for_implicit_field(&self) -> bool {
        self.implicit_field.is_some() || self.nearest.is_some()
    }

    fn asks_for_rays(&self) -> bool {
        self.debias.is_some() || self.aux.is_some()
    }

    fn debias(&self) -> Debias {
        let rays = |default: usize| self.aux.map_or(default, |n| n as usize);
        match self.debias {
            Some(Bias::None) => Debias::Consistent { rays: rays(RAYS_WITHOUT_DEBIASING) },
            Some(Bias::Roulette) => Debias::RussianRoulette { rays: rays(4), tail: TAIL },
            Some(Bias::Multilevel) | None => match WarpedArea::default().warp.debias {
                Debias::Multilevel { rays: default, first, ratio } => {
                    Debias::Multilevel { rays: rays(default), first, ratio }
                }
                other => other,
            },
        }
    }
}

/// The method that a pilot chooses, with a line that says what it chose and why; the estimator itself if it
/// needs no pilot.
pub(super) fn chosen(
    estimator: Estimator,
    choose: impl FnOnce(&Pilot) -> Result<Choice, GradientError>,
) -> Result<(Estimator, String), GradientError> {
    let (estimator, choice) = estimator.chosen(choose)?;
    let words = choice.map(|choice| choice.to_string()).unwrap_or_default();
    Ok((estimator, if words.is_empty() { words } else { words + "\n" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `--method` and the library have the same names.
    #[test]
    fn methods_are_those_of_the_library() {
        let names: Vec<String> = Method::value_variants().iter().map(|method| method.name()).collect();
        assert_eq!(names, Estimator::METHODS);
    }
}
