//! What reflection depends on at a point, and where it leads.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use crate::optics::Coating;
use crate::scene::{Bsdf, Principled, PrincipledThin};

/// A shaded point: everything that reflection depends on.
#[derive(Clone, Debug)]
pub(crate) struct Shading<'s, T> {
    pub(crate) bsdf: &'s Bsdf,
    /// What the coating lets through, if it has one.
    pub(crate) coating: Option<&'s Coating>,
    /// On the viewer's side.
    pub(crate) normal: Vec3<T>,
    pub(crate) viewer: Vec3<T>,
    pub(crate) reflectance: Rgb<T>,
    /// Of facets, α along u.
    pub(crate) roughness: T,
    /// α across u, of facets that are not the same in all directions.
    pub(crate) across: T,
    /// The numbers of a principled model at the point.
    pub(crate) numbers: Option<Box<Numbers<T>>>,
    /// A unit vector across the normal, along which facets are what they are along u, if that is not what they are
    /// across.
    pub(crate) along: Option<Vec3<T>>,
    /// Whether the viewer is behind a surface that light passes.
    pub(crate) behind: bool,
    /// How much of the surface is there, if not all of it.
    pub(crate) opacity: Option<T>,
    /// Whether what is there is black.
    pub(crate) black: bool,
    /// The surface's own normal on the viewer's side, where `normal` is tilted: light does not arrive from between the two
    /// horizons.
    pub(crate) beneath: Option<Vec3<T>>,
    /// What it is mixed with, if it is.
    pub(crate) blend: Option<Box<Mixed<'s, T>>>,
}

/// The second part of a mixture at a point.
#[derive(Clone, Debug)]
pub(crate) struct Mixed<'s, T> {
    pub(crate) other: Shading<'s, T>,
    /// Its part, in [0, 1].
    pub(crate) weight: T,
}

/// The numbers of a principled model at a point.
#[derive(Clone, Debug)]
pub(crate) enum Numbers<T> {
    Solid(Principled<T>),
    Thin(PrincipledThin<T>),
}

/// A direction and its density in solid angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampled {
    pub(crate) direction: DVec3,
    pub(crate) density: f64,
}

/// The only direction that an ideal boundary makes of another, and what arrives from there, over the probability of its
/// choice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ideal<T> {
    pub(crate) direction: Vec3<T>,
    pub(crate) factor: Rgb<T>,
}

/// Where a path may go on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bounce<T> {
    Smooth(Sampled),
    Ideal(Ideal<T>),
}

impl<T: Number> Mixed<'_, T> {
    /// The probability with which a sample is of the second part: about its weight, but for some that is left to both, as a weight
    /// of 0 may have a derivative.
    pub(super) fn part(&self) -> f64 {
        const LEAST: f64 = 0.05;
        LEAST + (1.0 - 2.0 * LEAST) * self.weight.value().clamp(0.0, 1.0)
    }
}
