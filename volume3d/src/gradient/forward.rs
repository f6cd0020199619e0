//! Forward mode: numbers with the derivative along one change.

use flatland::random::open01;
use glam::{DVec2, DVec3};

use super::auxiliary::Auxiliary;
use super::film::FilmPlane;
use super::followed::FollowedPoint;
use super::motion::Motion;
use crate::calculus::{Calculus, Dual, Frame, Kernel, Number, Rgb, Vec3, Warped};
use crate::scene::{Environment, Scene};

/// Which part of a derivative a tangent is. With three lanes the terms are kept apart:
///
/// - interior: everything moves, no sample does;
/// - primary: what the warp of the film moves, down the whole path;
/// - secondary: what the warps at bounces move, with the motion of scene and shading points they see.
///
/// With one lane they are summed.
const INTERIOR: usize = 0;
const PRIMARY: usize = 1;
const SECONDARY: usize = 2;

/// The calculus of N-lane dual numbers. N is 1 or 3.
#[derive(Debug)]
pub(crate) struct Forward<'s, const N: usize> {
    pub(crate) scene: &'s Scene,
    pub(crate) motion: &'s Motion<'s>,
    /// `None` is no warp at all: the interior term alone.
    pub(crate) auxiliary: Option<Auxiliary<'s>>,
}

/// A number that changes at a rate of its own.
fn moving<const N: usize>(value: f64, rate: f64) -> Dual<N> {
    let mut tangent = [0.0; N];
    tangent[INTERIOR] = rate;
    Dual::new(value, tangent)
}

fn moving3<const N: usize>(value: DVec3, rate: DVec3) -> Vec3<Dual<N>> {
    Vec3::new(moving(value.x, rate.x), moving(value.y, rate.y), moving(value.z, rate.z))
}

fn moving_rgb<const N: usize>(value: DVec3, rate: DVec3) -> Rgb<Dual<N>> {
    Rgb([moving(value.x, rate.x), moving(value.y, rate.y), moving(value.z, rate.z)])
}

fn lane<const N: usize>(v: Vec3<Dual<N>>, lane: usize) -> DVec3 {
    DVec3::new(v.x.tangent[lane], v.y.tangent[lane], v.z.tangent[lane])
}

impl<const N: usize> Forward<'_, N> {
    fn velocity(&self, seen: &FollowedPoint) -> DVec3 {
        seen.followed.velocity(self.scene, |i| self.motion.change.positions[i as usize])
    }

    /// The camera's frame.
    pub(crate) fn frame(&self, film: &FilmPlane) -> Frame<Dual<N>> {
        let camera = &self.scene.description.camera;
        let change = &self.motion.change.camera;
        let turned = |axis: DVec3| moving3(axis, change.rotation.cross(axis));
        let still = film.frame(camera);
        Frame {
            origin: moving3(camera.origin, change.translation),
            right: turned(camera.right),
            up: turned(camera.up),
            forward: turned(camera.forward),
            focal: moving(still.focal, film.focal_rate(camera) * change.field_of_view),
        }
    }

    /// The warp at a point of the film, at which a triangle or nothing is seen.
    pub(crate) fn film_warp(
        &mut self,
        film: &FilmPlane,
        u: DVec2,
        kappa: f64,
        triangle: Option<u32>,
    ) -> ([Dual<N>; 2], Dual<N>) {
        let still = ([Dual::constant(u.x), Dual::constant(u.y)], Dual::constant(1.0));
        let moves = self.motion.camera_moves;
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let Some(warp) = auxiliary.on_film(film, u, kappa, triangle, moves) else { return still };
        let change = &self.motion.change.camera;
        let field = warp.field(film, &self.scene.description.camera, change, |seen| {
            if seen.followed.is_nothing() {
                return DVec3::ZERO;
            }
            (self.velocity(seen) - change.translation) / seen.distance
        });
        let at = if N == 1 { INTERIOR } else { PRIMARY };
        let along = |value: f64, rate: f64| {
            let mut tangent = [0.0; N];
            tangent[at] = rate;
            Dual::new(value, tangent)
        };
        ([along(u.x, field.value.x), along(u.y, field.value.y)], along(1.0, field.divergence))
    }
}

impl<const N: usize> Calculus for Forward<'_, N> {
    type Number = Dual<N>;

    fn position(&self, index: u32) -> Vec3<Dual<N>> {
        let i = index as usize;
        moving3(self.scene.positions[i], self.motion.change.positions[i])
    }

    fn normal(&self, index: u32) -> Vec3<Dual<N>> {
        let i = index as usize;
        moving3(self.scene.normals[i], self.motion.normals[i])
    }

    fn reflectance(&self, material: usize, value: DVec3) -> Rgb<Dual<N>> {
        moving_rgb(value, self.motion.change.reflectance[material])
    }

    fn texel(&self, texture: usize, index: usize) -> Rgb<Dual<N>> {
        let value = self.scene.description.textures[texture].texels[index];
        moving_rgb(value, self.motion.change.texels[texture][index])
    }

    fn roughness(&self, material: usize, value: f64) -> Dual<N> {
        moving(value, self.motion.change.roughness[material])
    }

    fn radiance(&self, shape: usize, value: DVec3) -> Rgb<Dual<N>> {
        moving_rgb(value, self.motion.change.radiance[shape])
    }

    fn intensity(&self, light: usize, value: DVec3) -> Rgb<Dual<N>> {
        moving_rgb(value, self.motion.change.intensity[light])
    }

    fn place(&self, light: usize, value: DVec3) -> Vec3<Dual<N>> {
        let pose = self.motion.change.pose[light];
        let rate = match self.scene.description.lights[light] {
            crate::scene::Light::Point { .. } => pose,
            crate::scene::Light::Directional { .. } => pose.cross(value),
        };
        moving3(value, rate)
    }

    fn environment(&self, value: DVec3) -> Rgb<Dual<N>> {
        moving_rgb(value, self.motion.change.environment)
    }

    fn environment_direction(&self, direction: Vec3<Dual<N>>) -> Vec3<Dual<N>> {
        let Some(Environment::Map { to_world, .. }) = &self.scene.description.environment else {
            return direction;
        };
        let w = self.motion.change.environment_rotation;
        let axis = |a: DVec3| moving3::<N>(a, w.cross(a)).dot(direction);
        Vec3::new(axis(to_world.x_axis), axis(to_world.y_axis), axis(to_world.z_axis))
    }

    fn wants_black(&self, material: usize) -> bool {
        self.motion.change.reflectance[material] != DVec3::ZERO
    }

    fn beside(&mut self) -> Option<f64> {
        self.auxiliary.as_mut().map(|a| open01(&mut a.rng))
    }

    fn warp(
        &mut self,
        origin: Vec3<Dual<N>>,
        from: u32,
        direction: DVec3,
        kernel: Kernel,
    ) -> Warped<Dual<N>> {
        let still = Warped { direction: Vec3::constant(direction), jacobian: Dual::constant(1.0) };
        let rates: [DVec3; N] = std::array::from_fn(|l| lane(origin, l));
        let moves = rates.iter().any(|r| *r != DVec3::ZERO);
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let stencil = auxiliary.on_sphere(origin.value(), from, direction, kernel, moves);
        let Some(stencil) = stencil else { return still };
        let mut warped = still;
        for l in 0..N {
            // The interior lane is not warped; one lane alone holds all.
            let origin_rate = match l {
                INTERIOR if N == 1 => rates[INTERIOR],
                INTERIOR => continue,
                SECONDARY => rates[INTERIOR] + rates[SECONDARY],
                _ => rates[l],
            };
            let material = N == 1 || l == SECONDARY;
            if !material && origin_rate == DVec3::ZERO {
                continue;
            }
            let field = stencil.field(|seen| {
                if seen.followed.is_nothing() {
                    return DVec3::ZERO;
                }
                let velocity = if material { self.velocity(seen) } else { DVec3::ZERO };
                seen.angular(velocity - origin_rate)
            });
            warped.direction.x.tangent[l] = field.value.x;
            warped.direction.y.tangent[l] = field.value.y;
            warped.direction.z.tangent[l] = field.value.z;
            warped.jacobian.tangent[l] = field.divergence;
        }

        warped
    }
}
