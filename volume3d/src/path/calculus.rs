//! Where the numbers of a sample come from.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use crate::scene::{Hit, SHORT, Scene, Surface};

/// A camera's frame in numbers, and its focal length in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<T> {
    pub(crate) origin: Vec3<T>,
    pub(crate) right: Vec3<T>,
    pub(crate) up: Vec3<T>,
    pub(crate) forward: Vec3<T>,
    pub(crate) focal: T,
}

/// How a camera moves: numbers of value 0, of which the derivatives count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraMotion<T> {
    pub(crate) translation: Vec3<T>,
    /// About the world's axes through its origin.
    pub(crate) rotation: Vec3<T>,
    pub(crate) field_of_view: T,
}

/// A direction ω + ε V(ω) and the Jacobian 1 + ε ∇·V(ω) of the change of variables it belongs to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warped<T> {
    pub(crate) direction: Vec3<T>,
    pub(crate) jacobian: T,
}

impl<T: Number> Warped<T> {
    /// Without a warp.
    #[inline]
    pub(crate) fn still(direction: DVec3) -> Self {
        Self { direction: Vec3::constant(direction), jacobian: T::constant(1.0) }
    }

    /// Whether nothing changes with it.
    #[inline]
    pub(crate) fn is_still(&self) -> bool {
        let Vec3 { x, y, z } = self.direction;
        [x, y, z, self.jacobian].iter().all(|number| number.is_still())
    }
}

/// A point of a jump as seen from a shading point. What is reflected of `light` from there, times `speed`, is added to
/// what arrives: it has no value, and the derivative of a boundary term.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderSample<T> {
    pub(crate) direction: DVec3,
    /// The light that jumps, over the density of the sample.
    pub(crate) light: DVec3,
    /// A number of value 0 whose derivative is the jump's normal velocity beyond the warp's.
    pub(crate) speed: T,
}

/// What a warp of directions serves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kernel {
    /// The concentration of auxiliary directions.
    pub(crate) kappa: f64,
    pub(crate) domain: VisibilityDomain,
    /// The shading normal on the viewer's side. Below its horizon nothing arrives, and what is there need not be
    /// followed: inside a solid, near its edges, it is arbitrarily near and moves arbitrarily fast.
    pub(crate) normal: DVec3,
    /// What is seen along the direction itself.
    pub(crate) surface: Option<Surface>,
    /// Whether it is for the light of one emitter alone.
    pub(crate) of_light: bool,
}

/// Which jumps the integrand has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum VisibilityDomain {
    /// Those of the radiance of everything.
    Radiance,
    /// Those of light from far beyond, which everything hides alike: its silhouettes only.
    Distant,
    /// Those of light from a plane {y: n·y = d} with what hides it in front: silhouettes of what is nearer. The
    /// border of the light itself is not among them: that is an integral of its own.
    BeforePlane {
        /// n.
        normal: DVec3,
        /// d.
        offset: f64,
        /// The shape of the light.
        shape: u32,
    },
}

impl VisibilityDomain {
    /// Whether what is hit at a distance hides what the integrand is about: whether it lies before the plane of a flat light.
    pub(crate) fn counts(self, x: DVec3, direction: DVec3, distance: f64) -> bool {
        match self {
            Self::Radiance | Self::Distant => true,
            Self::BeforePlane { normal, offset, .. } => {
                // Before the light n·y > d. The light's own plane must not hide it.
                let height = normal.dot(x) - offset;
                normal.dot(direction) * distance + height > SHORT * height
            }
        }
    }
}

/// The parameters of a scene as numbers, and the warp of directions that goes with them.
///
/// [`warp`](Self::warp) and [`border`](Self::border) are calls to whoever differentiates, where data would not do: dual
/// numbers apply a warp's linear form to velocities at once, a tape keeps it for its sweep, and the path goes on with the
/// numbers that come of it. Plain numbers answer both with constants, so that an image pays nothing for them.
pub(crate) trait Calculus {
    /// What is computed with.
    type Number: Number;

    /// Whether directions may be warped: where none is, nobody makes kernels.
    const WARPS: bool = true;

    /// A vertex's place.
    fn position(&self, index: u32) -> Vec3<Self::Number>;

    /// A shading normal before interpolation.
    fn normal(&self, index: u32) -> Vec3<Self::Number>;

    /// The point at which a ray meets an implicit surface, and ∇φ there, for a point x of the ray that is on the surface in value:
    /// x − ω φ(x)/(∇φ·ω) with the denominator as it stands, and ∇φ of that. φ and ∇φ change with their parameters and with
    /// x.
    fn level_set(
        &self,
        implicit: u32,
        x: Vec3<Self::Number>,
        direction: DVec3,
    ) -> (Vec3<Self::Number>, Vec3<Self::Number>);

    /// What a ray meets that leaves a surface.
    fn next_hit(&mut self, scene: &Scene, x: DVec3, from: Surface, direction: DVec3) -> Option<Hit> {
        scene.closest(x, direction, Some(from))
    }

    /// A constant reflectance, with its value at hand.
    fn reflectance(&self, material: usize, value: DVec3) -> Rgb<Self::Number>;

    /// A texel.
    fn texel(&self, texture: usize, index: usize) -> Rgb<Self::Number>;

    /// A roughness, with its value at hand.
    fn roughness(&self, material: usize, value: f64) -> Self::Number;

    /// The radiance of a shape, with its value at hand.
    fn radiance(&self, shape: usize, value: DVec3) -> Rgb<Self::Number>;

    /// The irradiance or intensity of a light, with its value at hand.
    fn intensity(&self, light: usize, value: DVec3) -> Rgb<Self::Number>;

    /// How a point light is shifted, or a directional one turned, in numbers of value 0; nothing if it stands still.
    fn pose(&self, light: usize) -> Option<Vec3<Self::Number>>;

    /// How a spot or projector is turned about its place, in numbers of value 0; nothing if it stands still.
    fn light_turn(&self, light: usize) -> Option<Vec3<Self::Number>>;

    /// The radiance of a constant environment, with its value at hand.
    fn environment(&self, value: DVec3) -> Rgb<Self::Number>;

    /// How the environment map is turned, in numbers of value 0; nothing if it stands still.
    fn environment_turn(&self) -> Option<Vec3<Self::Number>>;

    /// How the camera moves; nothing if it stands still.
    fn camera(&self) -> Option<CameraMotion<Self::Number>>;

    /// Whether a surface that reflects nothing must be followed all the same, because its reflectance is a
    /// parameter.
    fn wants_black(&self, material: usize) -> bool;

    /// A point of the border of a flat emitter that next-event estimation has chosen, as seen from `origin` on surface
    /// `from`, with the kernel of the emitter's light. Nothing if there are no derivatives.
    fn border(
        &mut self,
        origin: Vec3<Self::Number>,
        from: Surface,
        shape: u32,
        kernel: impl FnOnce() -> Kernel,
    ) -> Option<BorderSample<Self::Number>>;

    /// Whether directions towards lights that are chosen may be warped: where none is, nobody makes kernels of lights.
    fn warps_light(&self) -> bool {
        Self::WARPS
    }

    /// Whether ∫ ∇·(V f) dω = 0 over the directions in which a bounce goes, so that any level may be taken from the radiance it is counted with.
    fn levels_bounces(&self) -> bool {
        false
    }

    /// The warp at direction ω as seen from `origin` on surface `from`.
    fn warp(
        &mut self,
        origin: Vec3<Self::Number>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
    ) -> Warped<Self::Number>;
}
