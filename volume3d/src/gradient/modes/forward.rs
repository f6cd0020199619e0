//! Forward mode: dual numbers with the derivative along one tangent.

use flatland::calculus::{Dual, Number, Rgb, Vec3};
use flatland::random::Stream;
use flatland::sdf::{Jet, Sdf as _};
use flatland::warp::{Field, LinearField as _};
use glam::{DVec2, DVec3};

use super::border::border;

use super::differential::Differential;
use crate::gradient::CameraTangent;
use crate::gradient::auxiliary::Auxiliary;
use crate::gradient::chain::{self, Through};
use crate::gradient::film::{FilmPlane, FilmPoint};
use crate::gradient::warp::level_set::{lane, level_set};
use crate::gradient::warp::motion::Motion;
use crate::path::{BorderSample, Branch, Calculus, CameraMotion, Frame, Kernel, Warped};
use crate::scene::{Hit, Scene, Surface};

/// Lane of a dual number. Three lanes keep the terms apart:
///
/// - interior: all parameters change, no sample moves;
/// - primary: motion by the warp of the film, along the whole path;
/// - secondary: motion by the warps at bounces, with the motion of scene and shading points.
///
/// One lane holds their sum.
const INTERIOR: usize = 0;
const PRIMARY: usize = 1;
const SECONDARY: usize = 2;

/// N-lane dual numbers, N = 1 or 3.
#[derive(Debug)]
pub(crate) struct Forward<'s, const N: usize> {
    pub(crate) scene: &'s Scene,
    pub(crate) motion: &'s Motion<'s>,
    /// `None` for no warp: the interior term alone.
    pub(crate) auxiliary: Option<Auxiliary<'s>>,
}

/// A number with a given rate.
fn moving<const N: usize>(value: f64, rate: f64) -> Dual<N> {
    let mut tangent = [0.0; N];
    tangent[INTERIOR] = rate;
    Dual::new(value, tangent)
}

fn moving3<const N: usize>(value: DVec3, rate: DVec3) -> Vec3<Dual<N>> {
    Vec3::new(moving(value.x, rate.x), moving(value.y, rate.y), moving(value.z, rate.z))
}

/// A vector of value 0 with a given rate; `None` if the rate is 0.
fn turning<const N: usize>(rate: DVec3) -> Option<Vec3<Dual<N>>> {
    (rate != DVec3::ZERO).then(|| moving3(DVec3::ZERO, rate))
}

fn moving_rgb<const N: usize>(value: DVec3, rate: DVec3) -> Rgb<Dual<N>> {
    Rgb([moving(value.x, rate.x), moving(value.y, rate.y), moving(value.z, rate.z)])
}

/// The rate of a field, which is not the interior term's: motion of the scene goes to `lane`.
fn to_warp<const N: usize>(mut rate: Dual<N>, lane: usize) -> Dual<N> {
    if N > 1 {
        rate.tangent[lane] += rate.tangent[INTERIOR];
        rate.tangent[INTERIOR] = 0.0;
    }
    rate
}

impl<const N: usize> Differential for Forward<'_, N> {
    fn look(&mut self, scene: &Scene, origin: DVec3, direction: DVec3) -> Option<Hit> {
        match &mut self.auxiliary {
            Some(auxiliary) => auxiliary.look(origin, direction),
            None => scene.closest(origin, direction, None),
        }
    }

    fn film_warp(&mut self, film: &FilmPlane, u: DVec2, seen: Option<Surface>) -> FilmPoint<Dual<N>> {
        let still =
            FilmPoint { at: [Dual::constant(u.x), Dual::constant(u.y)], jacobian: Dual::constant(1.0) };
        let moves = self.motion.camera_moves;
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let Some(warp) = auxiliary.on_film(film, u, seen, moves) else { return still };
        let (scene, change) = (self.scene, &self.motion.change.camera);
        let origin_rate = film.origin_rate(change);
        let field = warp.field(|seen| {
            let relative = if seen.followed.is_nothing() {
                -origin_rate * film.background()
            } else {
                (self.motion.velocity(scene, &seen.followed) - origin_rate) / seen.distance
            };
            warp.apparent(seen.direction, relative, change)
        });
        let implicit = warp
            .level_set_field(|tap| self.motion.level_set_rate(scene, tap) + warp.camera_rate(tap, change));
        let field =
            Field { value: field.value + implicit.value, divergence: field.divergence + implicit.divergence };
        let at = if N == 1 { INTERIOR } else { PRIMARY };
        let along = |value: f64, rate: f64| {
            let mut tangent = [0.0; N];
            tangent[at] = rate;
            Dual::new(value, tangent)
        };
        FilmPoint {
            at: [along(u.x, field.value.x), along(u.y, field.value.y)],
            jacobian: along(1.0, field.divergence),
        }
    }

    fn chain_film_warp(
        &mut self,
        film: &FilmPlane,
        frame: &Frame<Dual<N>>,
        u: DVec2,
        through: Through<'_>,
    ) -> Option<FilmPoint<Dual<N>>> {
        let auxiliary = self.auxiliary.as_mut().filter(|a| a.follows_chains)?;
        let kernel = chain::Kernel { warp: auxiliary.warp, kappa: auxiliary.paths.kernels.film };
        let bundle = auxiliary.chain_bundle(u, kernel.kappa);
        let (warp, rays) = chain::on_film(self, self.scene, (film, frame), u, &bundle, kernel, through);
        self.auxiliary.as_mut()?.count(rays);
        let still =
            FilmPoint { at: [Dual::constant(u.x), Dual::constant(u.y)], jacobian: Dual::constant(1.0) };
        Some(warp.map_or(still, |warp| chain::film_point(u, &warp.map(|rate| to_warp(rate, PRIMARY)))))
    }

    fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool {
        self.auxiliary.as_ref().is_some_and(|auxiliary| auxiliary.may_warp(x, direction, kernel))
    }

    fn rng(&mut self) -> Option<&mut Stream> {
        self.auxiliary.as_mut().map(|a| &mut a.rng)
    }
}

impl<const N: usize> Calculus for Forward<'_, N> {
    type Number = Dual<N>;

    fn next_hit(&mut self, scene: &Scene, x: DVec3, from: Surface, direction: DVec3) -> Option<Hit> {
        match &mut self.auxiliary {
            Some(auxiliary) => auxiliary.look_from(x, from, direction),
            None => scene.closest(x, direction, Some(from)),
        }
    }

    fn position(&self, index: u32) -> Vec3<Dual<N>> {
        let i = index as usize;
        moving3(self.scene.positions[i], self.motion.change.positions[i])
    }

    fn normal(&self, index: u32) -> Vec3<Dual<N>> {
        let i = index as usize;
        moving3(self.scene.normals[i], self.motion.normals[i])
    }

    fn level_set(&self, implicit: u32, x: Vec3<Dual<N>>, direction: DVec3) -> (Vec3<Dual<N>>, Vec3<Dual<N>>) {
        let shape = &self.scene.implicits()[implicit as usize];
        let at = x.value();
        let there = shape.second_order(at);
        let rates = &self.motion.implicits[implicit as usize];
        let moves = self.motion.moves_implicit[implicit as usize];
        let own = if moves { rates.rate(shape, at, &there) } else { Jet::ZERO };
        level_set(&there, x, direction, |lane| if lane == INTERIOR { own } else { Jet::ZERO })
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

    fn pose(&self, light: usize) -> Option<Vec3<Dual<N>>> {
        turning(self.motion.change.pose[light])
    }

    fn light_turn(&self, light: usize) -> Option<Vec3<Dual<N>>> {
        turning(self.motion.change.light_rotation[light])
    }

    fn environment(&self, value: DVec3) -> Rgb<Dual<N>> {
        moving_rgb(value, self.motion.change.environment)
    }

    fn environment_turn(&self) -> Option<Vec3<Dual<N>>> {
        turning(self.motion.change.environment_rotation)
    }

    fn camera(&self) -> Option<CameraMotion<Dual<N>>> {
        let CameraTangent { translation, rotation, field_of_view } = self.motion.change.camera;
        self.motion.camera_moves.then(|| CameraMotion {
            translation: moving3(DVec3::ZERO, translation),
            rotation: moving3(DVec3::ZERO, rotation),
            field_of_view: moving(0.0, field_of_view),
        })
    }

    fn wants_black(&self, material: usize) -> bool {
        self.motion.change.reflectance[material] != DVec3::ZERO
    }

    fn border(
        &mut self,
        origin: Vec3<Dual<N>>,
        from: Surface,
        shape: u32,
        kernel: impl FnOnce() -> Kernel,
    ) -> Option<BorderSample<Dual<N>>> {
        let paths = self.auxiliary.as_ref()?.paths;
        let mut sample = border(self, paths, origin, from, shape, kernel)?;
        if N > 1 {
            // Motion of a discontinuity does not belong to the interior term.
            sample.speed.tangent[SECONDARY] += sample.speed.tangent[INTERIOR];
            sample.speed.tangent[INTERIOR] = 0.0;
        }
        Some(sample)
    }

    fn warps_light(&self) -> bool {
        self.auxiliary.as_ref().is_some_and(Auxiliary::warps_light)
    }

    fn levels_bounces(&self) -> bool {
        self.auxiliary.as_ref().is_some_and(Auxiliary::levels_bounces)
    }

    fn warp(
        &mut self,
        origin: Vec3<Dual<N>>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
    ) -> Warped<Dual<N>> {
        let still = Warped::still(direction);
        let rates: [DVec3; N] = std::array::from_fn(|l| lane(origin, l));
        let moves = rates.iter().any(|r| *r != DVec3::ZERO);
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let warp = auxiliary.on_sphere(origin.value(), from, direction, kernel, moves);
        let Some(warp) = warp else { return still };
        let scene = self.scene;
        let mut warped = still;
        for l in 0..N {
            // The interior lane is not warped; a single lane holds all terms.
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
            let field = warp.field(|seen| {
                if seen.followed.is_nothing() {
                    return DVec3::ZERO;
                }
                let velocity =
                    if material { self.motion.velocity(scene, &seen.followed) } else { DVec3::ZERO };
                seen.angular(velocity - origin_rate)
            });
            let implicit = warp.level_set_field(|tap| {
                let material = if material { self.motion.level_set_rate(scene, tap) } else { Jet::ZERO };
                material + tap.there.advected(origin_rate)
            });
            let field = Field {
                value: field.value + implicit.value,
                divergence: field.divergence + implicit.divergence,
            };
            warped.direction.x.tangent[l] = field.value.x;
            warped.direction.y.tangent[l] = field.value.y;
            warped.direction.z.tangent[l] = field.value.z;
            warped.jacobian.tangent[l] = field.divergence;
        }
        warped
    }

    fn follows_chains(&self) -> bool {
        self.auxiliary.as_ref().is_some_and(|auxiliary| auxiliary.follows_chains)
    }

    fn chain_warp(
        &mut self,
        origin: Vec3<Dual<N>>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        chain: &[Branch],
        light: Option<usize>,
    ) -> Warped<Dual<N>> {
        let still = Warped::still(direction);
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let kernel = chain::Kernel { warp: auxiliary.warp, kappa: kernel.kappa };
        let bundle = auxiliary.chain_bundle(direction, kernel.kappa);
        let (start, through) = ((origin, from), Through { chain, light });
        let (warp, rays) = chain::on_sphere(self, self.scene, start, direction, &bundle, kernel, through);
        if let Some(auxiliary) = &mut self.auxiliary {
            auxiliary.count(rays);
        }
        warp.map_or(still, |warp| chain::warped(direction, &warp.map(|rate| to_warp(rate, SECONDARY))))
    }
}
