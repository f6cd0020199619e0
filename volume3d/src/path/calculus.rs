//! The calculus: the source of a sample's numbers, with or without derivatives.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::bsdf::Branch;
use crate::scene::{Hit, SHORT, Scene, Span, Surface};

/// A camera frame over numbers, with the focal length in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<T> {
    pub(crate) origin: Vec3<T>,
    pub(crate) right: Vec3<T>,
    pub(crate) up: Vec3<T>,
    pub(crate) forward: Vec3<T>,
    pub(crate) focal: T,
}

/// Camera motion: numbers of value 0 whose derivatives matter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraMotion<T> {
    pub(crate) translation: Vec3<T>,
    /// About the world's axes through the camera's origin.
    pub(crate) rotation: Vec3<T>,
    pub(crate) field_of_view: T,
}

/// A direction ω + ε V(ω), with the Jacobian 1 + ε ∇·V(ω) of the change of variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warped<T> {
    pub(crate) direction: Vec3<T>,
    pub(crate) jacobian: T,
}

impl<T: Number> Warped<T> {
    /// The direction without a warp.
    #[inline]
    pub(crate) fn still(direction: DVec3) -> Self {
        Self { direction: Vec3::constant(direction), jacobian: T::constant(1.0) }
    }

    /// Whether neither direction nor Jacobian has a derivative.
    #[inline]
    pub(crate) fn is_still(&self) -> bool {
        let Vec3 { x, y, z } = self.direction;
        [x, y, z, self.jacobian].iter().all(|number| number.is_still())
    }
}

/// A point of a discontinuity as seen from a shading point. The reflection of `light` from there, times
/// `speed`, is added to the radiance: its value is 0, and its derivative is the boundary term's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderSample<T> {
    pub(crate) direction: DVec3,
    /// The light that is discontinuous, divided by the density of the sample.
    pub(crate) light: DVec3,
    /// A number of value 0 whose derivative is the discontinuity's normal velocity relative to the warp.
    pub(crate) speed: T,
}

/// The kernel around a direction, for which a warp is made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kernel {
    /// Concentration κ of auxiliary directions.
    pub(crate) kappa: f64,
    pub(crate) domain: VisibilityDomain,
    /// The shading normal on the viewer's side. No light arrives from below its horizon, and objects there
    /// need not be followed: inside a solid, near its edges, they are arbitrarily near and move arbitrarily
    /// fast.
    pub(crate) normal: DVec3,
    /// The surface seen along the direction itself.
    pub(crate) surface: Option<Surface>,
    /// Whether it is for the light of a single emitter.
    pub(crate) of_light: bool,
}

/// The light that an integral is over, which determines the discontinuities that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum VisibilityDomain {
    /// Discontinuities of all radiance.
    Radiance,
    /// Discontinuities of light from infinity, which any surface occludes: silhouettes only.
    Distant,
    /// Discontinuities of light from a plane {y: n·y = d} with occluders in front of it: silhouettes of
    /// nearer objects. The border of the light itself is a separate integral.
    BeforePlane {
        /// n.
        normal: DVec3,
        /// d.
        offset: f64,
        /// Shape of the light.
        shape: u32,
    },
}

impl VisibilityDomain {
    /// Whether the light is discontinuous at a silhouette or a crossing. Where two occluders cross, occlusion
    /// does not change; where one crosses a flat light, it does. The light's own silhouettes do not count.
    pub(crate) fn has(self, scene: &Scene, span: Span) -> bool {
        match (self, span) {
            (Self::Radiance, _) | (Self::Distant, Span::Edge(_)) => true,
            (Self::Distant, Span::Crossing(_)) => false,
            (Self::BeforePlane { shape, .. }, Span::Edge(ends)) => {
                let own = scene.position_range(shape as usize);
                !ends.iter().all(|&i| own.contains(&(i as usize)))
            }
            (Self::BeforePlane { shape, .. }, Span::Crossing(index)) => {
                scene.crossings().get(index).shapes(&scene.triangles).contains(&shape)
            }
        }
    }

    /// Whether a hit at a distance occludes the integrand: whether it lies in front of the plane of a flat
    /// light.
    pub(crate) fn counts(self, x: DVec3, direction: DVec3, distance: f64) -> bool {
        match self {
            Self::Radiance | Self::Distant => true,
            Self::BeforePlane { normal, offset, .. } => {
                // In front of the light n·y > d. The light's own plane must not occlude it.
                let height = normal.dot(x) - offset;
                normal.dot(direction) * distance + height > SHORT * height
            }
        }
    }
}

/// The parameters of a scene as numbers, and the warp of directions.
///
/// [`warp`](Self::warp) and [`border`](Self::border) are calls because the result depends on the mode of
/// differentiation: dual numbers apply a warp's linear form to velocities at once, a tape stores it for its
/// sweep, and the path continues with the resulting numbers. Plain numbers return constants, so that an image
/// incurs no cost.
pub(crate) trait Calculus {
    /// Number type.
    type Number: Number;

    /// Whether directions may be warped; if not, no kernels are made.
    const WARPS: bool = true;

    /// Position of a vertex.
    fn position(&self, index: u32) -> Vec3<Self::Number>;

    /// A shading normal before interpolation.
    fn normal(&self, index: u32) -> Vec3<Self::Number>;

    /// The intersection of a ray with an implicit surface, and ∇φ there, for a point x of the ray that is on
    /// the surface in value: x − ω φ(x)/(∇φ·ω) with a constant denominator, and ∇φ at that point. φ and ∇φ
    /// change with their parameters and with x.
    fn level_set(
        &self,
        implicit: u32,
        x: Vec3<Self::Number>,
        direction: DVec3,
    ) -> (Vec3<Self::Number>, Vec3<Self::Number>);

    /// First hit of a ray that leaves a surface.
    fn next_hit(&mut self, scene: &Scene, x: DVec3, from: Surface, direction: DVec3) -> Option<Hit> {
        scene.closest(x, direction, Some(from))
    }

    /// A constant reflectance, given its value.
    fn reflectance(&self, material: usize, value: DVec3) -> Rgb<Self::Number>;

    /// A texel.
    fn texel(&self, texture: usize, index: usize) -> Rgb<Self::Number>;

    /// A roughness, given its value.
    fn roughness(&self, material: usize, value: f64) -> Self::Number;

    /// The radiance of a shape, given its value.
    fn radiance(&self, shape: usize, value: DVec3) -> Rgb<Self::Number>;

    /// The irradiance or intensity of a light, given its value.
    fn intensity(&self, light: usize, value: DVec3) -> Rgb<Self::Number>;

    /// Translation of a point light, or rotation of a directional one, in numbers of value 0; `None` if it is
    /// static.
    fn pose(&self, light: usize) -> Option<Vec3<Self::Number>>;

    /// Rotation of a spot or projector about its position, in numbers of value 0; `None` if it is static.
    fn light_turn(&self, light: usize) -> Option<Vec3<Self::Number>>;

    /// The radiance of a constant environment, given its value.
    fn environment(&self, value: DVec3) -> Rgb<Self::Number>;

    /// Rotation of the environment map, in numbers of value 0; `None` if it is static.
    fn environment_turn(&self) -> Option<Vec3<Self::Number>>;

    /// Camera motion; `None` if it is static.
    fn camera(&self) -> Option<CameraMotion<Self::Number>>;

    /// Whether a black surface must be followed nevertheless, because its reflectance is a parameter.
    fn wants_black(&self, material: usize) -> bool;

    /// A border point of the flat emitter chosen by next-event estimation, as seen from `origin` on surface
    /// `from`, with the kernel of the emitter's light. `None` without derivatives.
    fn border(
        &mut self,
        origin: Vec3<Self::Number>,
        from: Surface,
        shape: u32,
        kernel: impl FnOnce() -> Kernel,
    ) -> Option<BorderSample<Self::Number>>;

    /// Whether directions towards sampled lights may be warped; if not, no kernels of lights are made.
    fn warps_light(&self) -> bool {
        Self::WARPS
    }

    /// Whether ∫ ∇·(V f) dω = 0 over the directions of a bounce, so that any control variate may be
    /// subtracted from the radiance.
    fn levels_bounces(&self) -> bool {
        false
    }

    /// The warp at direction ω seen from `origin` on surface `from`.
    fn warp(
        &mut self,
        origin: Vec3<Self::Number>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
    ) -> Warped<Self::Number>;

    /// Whether chains of ideal boundaries, and lights without extent, have warps of their own.
    fn follows_chains(&self) -> bool {
        false
    }

    /// The warp at direction ω seen from `origin` on surface `from`, for light that comes along the branches
    /// of a chain and then, if given, from a light without extent.
    fn chain_warp(
        &mut self,
        origin: Vec3<Self::Number>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        chain: &[Branch],
        light: Option<usize>,
    ) -> Warped<Self::Number> {
        let _ = (origin, from, kernel, chain, light);
        Warped::still(direction)
    }
}
