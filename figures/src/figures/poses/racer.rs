//! The methods that descend: one gradient of six numbers each.

use flatland::warp::{Debias, Warp};
use volume3d::Image;
use volume3d::Kernels;
use volume3d::gradient::{EdgeSampling, Field, Progress, Rotation, WarpedArea, render};
use volume3d::optimize::Parameters;
use volume3d::scene::Scene;

use crate::plot::{Color, Palette};

/// Samples a pixel of the control variate of area methods.
const CONTROL_VARIATE: usize = 2;
/// The step of finite differences, in units of length and in radians.
const DIFFERENCE: f64 = 0.01;

/// A method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Racer {
    WarpedArea,
    EdgeSampling,
    Rotation,
    FourRays,
    SixteenRays,
    Interior,
    Differences,
}

/// Place and effort of a requested gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub(super) scene: &'a Scene,
    pub(super) parameters: &'a Parameters,
    /// The scene's pose.
    pub(super) x: &'a [f64],
    /// ∂L/∂I.
    pub(super) adjoint: &'a Image,
    /// Samples a pixel.
    pub(super) samples: usize,
    pub(super) seed: u64,
}

impl Racer {
    pub(super) const ALL: [Self; 7] = [
        Self::WarpedArea,
        Self::EdgeSampling,
        Self::Rotation,
        Self::FourRays,
        Self::SixteenRays,
        Self::Interior,
        Self::Differences,
    ];

    /// Methods whose drift from the truth is measured.
    pub(super) const DRIFTING: [Self; 3] = [Self::WarpedArea, Self::EdgeSampling, Self::Rotation];

    /// Key in files of results.
    pub(super) fn key(self) -> &'static str {
        ["warped-area", "edge-sampling", "rotation", "4-rays", "16-rays", "interior", "finite-differences"]
            [self as usize]
    }

    /// Name on pages.
    pub(super) fn name(self) -> &'static str {
        [
            "warped area",
            "edge sampling",
            "rotation",
            "4 auxiliary rays",
            "16 auxiliary rays",
            "interior only",
            "finite differences",
        ][self as usize]
    }

    pub(super) fn color(self) -> Color {
        [
            Palette::BLUE,
            Palette::VERMILION,
            Palette::PURPLE,
            Palette::GREEN,
            Palette::SKY,
            Palette::OCHRE,
            Palette::GREY,
        ][self as usize]
    }

    /// The derivative of a loss with respect to the pose.
    pub(super) fn gradient(self, place: &Place<'_>) -> anyhow::Result<Vec<f64>> {
        let Place { scene, parameters, x, adjoint, samples, seed } = *place;
        let (active, still) = (parameters.active(scene), Progress::none());
        let area = WarpedArea { samples, seed, control_variate: CONTROL_VARIATE, ..WarpedArea::default() };
        let rays = |rays: usize| WarpedArea {
            field: Field::AuxiliaryRays,
            warp: Warp { debias: Debias::Consistent { rays }, ..area.warp },
            ..area.clone()
        };
        let gradient = match self {
            Self::WarpedArea => area.reverse(scene, adjoint, &active, &still),
            Self::EdgeSampling => {
                let method = EdgeSampling {
                    samples,
                    primary: samples,
                    secondary: samples,
                    bounces: samples,
                    seed,
                    allow_missing: vec![],
                };
                method.reverse(scene, adjoint, &active, &still)
            }
            Self::Rotation => {
                // Kernels as wide as a pixel: narrower ones see fewer edges at once, and have less bias and
                // more variance.
                let kernels = Kernels { film: 1.0, ..Kernels::default() };
                let control_variate = CONTROL_VARIATE;
                let method = Rotation { samples, control_variate, kernels, seed, ..Rotation::default() };
                method.reverse(scene, adjoint, &active, &still)
            }
            Self::FourRays => rays(4).reverse(scene, adjoint, &active, &still),
            Self::SixteenRays => rays(16).reverse(scene, adjoint, &active, &still),
            Self::Interior => WarpedArea { warps: false, ..area }.reverse(scene, adjoint, &active, &still),
            Self::Differences => return differences(place),
        }?;
        Ok(parameters.gradient(scene, x, &gradient.by_parameter))
    }
}

/// Central differences of all pixels with common random numbers, one parameter at a time, contracted with the
/// loss's adjoint.
fn differences(place: &Place<'_>) -> anyhow::Result<Vec<f64>> {
    let Place { scene, parameters, x, adjoint, samples, seed } = *place;
    let mut moved = Scene::new(scene.description().clone())?;
    let mut side = |number: usize, step: f64| -> anyhow::Result<f64> {
        let (mut there, mut direction) = (x.to_vec(), vec![0.0; x.len()]);
        direction[number] = step;
        parameters.retract(&mut there, &direction);
        parameters.apply(&there, &mut moved)?;
        let image = render(&moved, samples, seed, &Progress::none())?.image;
        Ok(adjoint.pixels.iter().zip(&image.pixels).map(|(a, b)| a.dot(*b)).sum())
    };
    let slope = |number| Ok((side(number, DIFFERENCE)? - side(number, -DIFFERENCE)?) / (2.0 * DIFFERENCE));
    (0..x.len()).map(slope).collect()
}
