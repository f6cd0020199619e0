//! Plain numbers: no derivatives, warps or auxiliary rays.

use flatland::calculus::{Rgb, Vec3};
use flatland::sdf::Sdf as _;
use glam::DVec3;

use super::calculus::{BorderSample, Calculus, CameraMotion, Kernel, Warped};
use crate::scene::{Scene, Surface};

/// Calculus of the primal image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain<'s> {
    pub(crate) scene: &'s Scene,
}

impl Calculus for Plain<'_> {
    type Number = f64;

    const WARPS: bool = false;

    fn position(&self, index: u32) -> Vec3<f64> {
        Vec3::constant(self.scene.positions[index as usize])
    }

    fn normal(&self, index: u32) -> Vec3<f64> {
        Vec3::constant(self.scene.normals[index as usize])
    }

    fn level_set(&self, implicit: u32, x: Vec3<f64>, _: DVec3) -> (Vec3<f64>, Vec3<f64>) {
        let shape = &self.scene.implicits()[implicit as usize];
        (x, Vec3::constant(shape.jet(x.value()).gradient))
    }

    fn reflectance(&self, _: usize, value: DVec3) -> Rgb<f64> {
        Rgb::constant(value)
    }

    fn texel(&self, texture: usize, index: usize) -> Rgb<f64> {
        Rgb::constant(self.scene.description.textures[texture].texels[index])
    }

    fn roughness(&self, _: usize, value: f64) -> f64 {
        value
    }

    fn radiance(&self, _: usize, value: DVec3) -> Rgb<f64> {
        Rgb::constant(value)
    }

    fn intensity(&self, _: usize, value: DVec3) -> Rgb<f64> {
        Rgb::constant(value)
    }

    fn pose(&self, _: usize) -> Option<Vec3<f64>> {
        None
    }

    fn light_turn(&self, _: usize) -> Option<Vec3<f64>> {
        None
    }

    fn environment(&self, value: DVec3) -> Rgb<f64> {
        Rgb::constant(value)
    }

    fn environment_turn(&self) -> Option<Vec3<f64>> {
        None
    }

    fn camera(&self) -> Option<CameraMotion<f64>> {
        None
    }

    fn wants_black(&self, _: usize) -> bool {
        false
    }

    fn border(
        &mut self,
        _: Vec3<f64>,
        _: Surface,
        _: u32,
        _: impl FnOnce() -> Kernel,
    ) -> Option<BorderSample<f64>> {
        None
    }

    fn warp(&mut self, _: Vec3<f64>, _: Surface, direction: DVec3, _: Kernel) -> Warped<f64> {
        Warped::still(direction)
    }
}
