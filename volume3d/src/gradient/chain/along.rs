//! Numbers with the derivatives by two coordinates of a ray, in a scene at rest.

use flatland::calculus::{Dual, Rgb, Vec3};
use flatland::sdf::{Jet, Sdf as _};
use glam::DVec3;

use crate::gradient::warp::level_set::level_set;
use crate::path::{BorderSample, Calculus, CameraMotion, Kernel, Warped};
use crate::scene::{Scene, Surface};

/// Two film coordinates or two tangents of a direction.
pub(super) type Pair = Dual<2>;

/// The calculus of derivatives along the rays of a chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct AlongRays<'s> {
    pub(super) scene: &'s Scene,
}

impl Calculus for AlongRays<'_> {
    type Number = Pair;

    const WARPS: bool = false;

    fn position(&self, index: u32) -> Vec3<Pair> {
        Vec3::constant(self.scene.positions[index as usize])
    }

    fn normal(&self, index: u32) -> Vec3<Pair> {
        Vec3::constant(self.scene.normals[index as usize])
    }

    fn level_set(&self, implicit: u32, x: Vec3<Pair>, direction: DVec3) -> (Vec3<Pair>, Vec3<Pair>) {
        let there = self.scene.implicits()[implicit as usize].second_order(x.value());
        level_set(&there, x, direction, |_| Jet::ZERO)
    }

    fn reflectance(&self, _: usize, value: DVec3) -> Rgb<Pair> {
        Rgb::constant(value)
    }

    fn texel(&self, texture: usize, index: usize) -> Rgb<Pair> {
        Rgb::constant(self.scene.description.textures[texture].texels[index])
    }

    fn roughness(&self, _: usize, value: f64) -> Pair {
        Pair::new(value, [0.0; 2])
    }

    fn radiance(&self, _: usize, value: DVec3) -> Rgb<Pair> {
        Rgb::constant(value)
    }

    fn intensity(&self, _: usize, value: DVec3) -> Rgb<Pair> {
        Rgb::constant(value)
    }

    fn pose(&self, _: usize) -> Option<Vec3<Pair>> {
        None
    }

    fn light_turn(&self, _: usize) -> Option<Vec3<Pair>> {
        None
    }

    fn environment(&self, value: DVec3) -> Rgb<Pair> {
        Rgb::constant(value)
    }

    fn environment_turn(&self) -> Option<Vec3<Pair>> {
        None
    }

    fn camera(&self) -> Option<CameraMotion<Pair>> {
        None
    }

    /// A black mirror may have a field.
    fn wants_black(&self, _: usize) -> bool {
        true
    }

    fn border(
        &mut self,
        _: Vec3<Pair>,
        _: Surface,
        _: u32,
        _: impl FnOnce() -> Kernel,
    ) -> Option<BorderSample<Pair>> {
        None
    }

    fn warp(&mut self, _: Vec3<Pair>, _: Surface, direction: DVec3, _: Kernel) -> Warped<Pair> {
        Warped::still(direction)
    }
}
