//! `--method` and what belongs to it.

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
    /// How the derivative is estimated [default: auto; edge with --allow-missing; warped-area with options that belong to it].
    #[arg(long, value_enum)]
    method: Option<Method>,
    /// Warped area: what its field is made of [default: jump-mean; rays if --debias or --aux is
    /// given]. Given, --method is warped-area.
    #[arg(long, value_enum)]
    field: Option<FieldKind>,
    /// Warped area: what follows the silhouettes of implicit surfaces [default: vicini].
    #[arg(long, value_enum)]
    implicit_field: Option<ImplicitKind>,
    /// With --implicit-field bangaru: only the K points of a ray with the least distances count, as in the paper. Not
    /// continuous, and so biased: for comparison.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(2..))]
    nearest: Option<u32>,
    /// Warped area: what is done about the bias of the warp with finitely many auxiliary rays.
    #[arg(long, value_enum)]
    debias: Option<Bias>,
    /// Warped area: auxiliary rays of an estimate of the warp, on the film and at every bounce; the least number unless
    /// --debias is none [default: 16; 4 with --debias roulette].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    aux: Option<u32>,
    /// Edge sampling: leaves out the motion of such jumps, which nothing follows, instead of refusing a scene that has
    /// them where geometry moves. The rest of the derivative is what it is without; what is left out is listed, and kept
    /// in the header of a gradient that is written as .exr.
    #[arg(long, value_enum, value_name = "WHAT,…", value_delimiter = ',')]
    allow_missing: Vec<Kind>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// Whichever of warped area (softened or exact) and edge sampling a pilot of few samples expects to err
    /// least in the time of --spp samples of warped-area; the pilot also splits the samples. Unbiased;
    /// refuses what both refuse. It is warped area beside implicit surfaces, and where no geometry moves.
    #[value(name = "auto")]
    Automatic,
    /// Warped-area sampling: unbiased, with --debias none biased; refuses mirrors and lights without extent where
    /// geometry moves.
    WarpedArea,
    /// Edge sampling: unbiased; besides --spp paths a pixel, as many samples of every kind of jump there is: up to two
    /// kinds seen by the camera, up to five seen from surfaces. Refuses what warped-area refuses.
    Edge,
    /// One rotation for each kernel: biased wherever what moves does not turn as a whole.
    Rotation,
    /// Central differences with common random numbers: biased by ~ step², noise ~ 1/√step; differentiates
    /// everything. At a bound of a parameter's range they are one-sided, biased by ~ step, which is said.
    FiniteDifference,
    /// The interior term alone: biased wherever a silhouette, a shadow's or a light's edge moves.
    Interior,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FieldKind {
    /// The edges near a direction, averaged exactly: no auxiliary rays.
    JumpMean,
    /// The same mean, softened, with a quarter of --spp samples of silhouettes and half of it of shadows for what it leaves: for
    /// clutter and penumbrae, where the exact mean has heavy tails.
    Softened,
    /// What auxiliary rays hit, as in the paper: meshes, and implicit surfaces.
    Rays,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ImplicitKind {
    /// One point of a ray, the mean of its sphere tracer's (Vicini et al. 2022).
    Vicini,
    /// All points of a ray's sphere tracer (Bangaru et al. 2022).
    Bangaru,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Bias {
    /// Nothing: N rays, less noise; the bias falls as 1/N.
    None,
    /// Russian roulette, as in the paper: unbiased, but of infinite variance; for comparison.
    Roulette,
    /// Differences between levels of rays: unbiased (the default).
    Multilevel,
}

/// The exponent of Russian roulette's tail, in (1, 2): the middle.
const TAIL: f64 = 1.5;

/// Rays without debiasing, where the bias is a few per cent of the boundary term.
const RAYS_WITHOUT_DEBIASING: usize = 16;

impl Method {
    /// Its name in options and in the library.
    fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

impl MethodOptions {
    /// A method as it is by default.
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

    /// Whether all options belong together, asked before any work.
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
                "--allow-missing belongs to --method edge, where what is left out changes nothing else",
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

/// The choice of a pilot, with a line that says what it chose and why; the estimator itself if it has no pilot.
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
