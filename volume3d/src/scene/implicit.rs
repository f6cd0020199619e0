//! Implicit surfaces of a scene: φ(x) = 0, φ > 0 outside.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use flatland::sdf::shapes::{Parametric, ShapeError};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::{DMat3, DVec3};

use crate::sdf::{Baked, Guided};

/// Interface of implicit surfaces to scenes. Implemented for every 3-D [`Parametric`] shape.
pub trait Implicit: Sdf<DVec3> + Any + Debug + Send + Sync {
    /// [`Parametric::parameters`].
    fn parameters(&self) -> Vec<f64>;

    /// [`Parametric::dimension`].
    fn dimension(&self) -> usize;

    /// [`Parametric::push_forward`].
    fn push_forward(&self, direction: &[f64]) -> Vec<f64>;

    /// [`Parametric::pull_back`].
    fn pull_back(&self, gradient: Vec<f64>) -> Vec<f64>;

    /// The surface with other parameters.
    ///
    /// # Errors
    /// A [`ShapeError`] that names the parameter.
    fn with_parameters(&self, parameters: &[f64]) -> Result<ImplicitSurface, ShapeError>;

    /// Whether another surface is equal.
    fn is_same(&self, other: &dyn Implicit) -> bool;
}

impl<S: Parametric<DVec3> + Debug + PartialEq + Send + Sync + 'static> Implicit for S {
    fn parameters(&self) -> Vec<f64> {
        Parametric::parameters(self)
    }

    fn dimension(&self) -> usize {
        Parametric::dimension(self)
    }

    fn push_forward(&self, direction: &[f64]) -> Vec<f64> {
        Parametric::push_forward(self, direction)
    }

    fn pull_back(&self, gradient: Vec<f64>) -> Vec<f64> {
        Parametric::pull_back(self, gradient)
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<ImplicitSurface, ShapeError> {
        Parametric::with_parameters(self, parameters).map(ImplicitSurface::new)
    }

    fn is_same(&self, other: &dyn Implicit) -> bool {
        (other as &dyn Any).downcast_ref::<S>().is_some_and(|other| self == other)
    }
}

/// An implicit surface of any kind. Clones share it.
#[derive(Clone, Debug)]
pub struct ImplicitSurface(Arc<dyn Implicit>);

impl ImplicitSurface {
    /// A surface for scenes.
    pub fn new(surface: impl Implicit) -> Self {
        Self(Arc::new(surface))
    }

    /// The surface as its original type, if it is `S`.
    #[must_use]
    pub fn downcast<S: Implicit>(&self) -> Option<&S> {
        (&*self.0 as &dyn Any).downcast_ref()
    }
}

impl ImplicitSurface {
    /// The network whose weights are its parameters, baked or traced directly.
    pub(crate) fn network(&self) -> Option<&Baked> {
        self.downcast().or_else(|| self.downcast().map(Guided::baked))
    }
}

impl std::ops::Deref for ImplicitSurface {
    type Target = dyn Implicit;
    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

impl PartialEq for ImplicitSurface {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0.is_same(&*other.0)
    }
}

/// Placement of an implicit surface: x = s R y + p for its points y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// s, positive.
    pub scale: f64,
    /// R, a rotation.
    pub rotation: DMat3,
    /// p, scene units: position of its own origin, about which it rotates.
    pub translation: DVec3,
}

impl Default for Placement {
    /// The identity placement.
    fn default() -> Self {
        Self { scale: 1.0, rotation: DMat3::IDENTITY, translation: DVec3::ZERO }
    }
}

/// An implicit surface with placement and material. It does not emit.
///
/// In world coordinates its function, which [`Sdf`] evaluates, is s φ(Rᵀ(x − p)/s); its parameters are the
/// surface's. The rates of its placement are in [`ImplicitTangent`](crate::gradient::ImplicitTangent).
#[derive(Clone, Debug, PartialEq)]
pub struct ImplicitShape {
    /// Name in messages and queries; different from the names of all meshes.
    pub id: String,
    /// φ.
    pub surface: ImplicitSurface,
    /// Placement.
    pub placement: Placement,
    /// Index of its material in the scene. It has no texture coordinates.
    pub material: usize,
}

impl ImplicitShape {
    /// The shape translated.
    pub(super) fn moved(&self, by: DVec3) -> Self {
        let translation = self.placement.translation + by;
        Self { placement: Placement { translation, ..self.placement }, ..self.clone() }
    }

    /// y, for a world point x.
    pub(crate) fn local(&self, x: DVec3) -> DVec3 {
        let Placement { scale, rotation, translation } = self.placement;
        rotation.transpose() * (x - translation) / scale
    }

    /// A world covector of φ and ∇φ in the surface's own coordinates.
    fn local_covector(&self, covector: Jet<DVec3>) -> Jet<DVec3> {
        let Placement { scale, rotation, .. } = self.placement;
        Jet { value: scale * covector.value, gradient: rotation.transpose() * covector.gradient }
    }

    pub(crate) fn placed(&self, jet: Jet<DVec3>) -> Jet<DVec3> {
        let Placement { scale, rotation, .. } = self.placement;
        Jet { value: scale * jet.value, gradient: rotation * jet.gradient }
    }

    pub(crate) fn placed_second_order(
        &self,
        SecondOrder { jet, hessian }: SecondOrder<DVec3>,
    ) -> SecondOrder<DVec3> {
        let Placement { scale, rotation, .. } = self.placement;
        let hessian = rotation * hessian * rotation.transpose() * scale.recip();
        SecondOrder { jet: self.placed(jet), hessian }
    }
}

impl Sdf<DVec3> for ImplicitShape {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        self.placed(self.surface.jet(self.local(x)))
    }

    fn value(&self, x: DVec3) -> f64 {
        self.placement.scale * self.surface.value(self.local(x))
    }

    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        self.placed_second_order(self.surface.second_order(self.local(x)))
    }

    fn slope_bound(&self) -> f64 {
        self.surface.slope_bound()
    }

    fn slope_bound_everywhere(&self) -> f64 {
        self.surface.slope_bound_everywhere()
    }

    fn second_derivative_bound(&self) -> f64 {
        self.surface.second_derivative_bound() / self.placement.scale
    }

    fn level_bounds(&self, level: f64) -> Option<(DVec3, DVec3)> {
        let Placement { scale, rotation, translation } = self.placement;
        let (low, high) = self.surface.level_bounds(level / scale)?;
        let centre = rotation * (0.5 * (low + high)) * scale + translation;
        let half = 0.5 * (high - low) * scale;
        let [x, y, z] = [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(DVec3::abs);
        let reach = x * half.x + y * half.y + z * half.z;
        Some((centre - reach, centre + reach))
    }

    fn parameter_count(&self) -> usize {
        self.surface.parameter_count()
    }

    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        self.placed(self.surface.rate(self.local(x), direction))
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        self.surface.add_parameter_gradient(self.local(x), self.local_covector(covector), gradient);
    }

    fn add_parameter_gradients(&self, taps: &[(DVec3, Jet<DVec3>)], gradient: &mut [f64]) {
        let local = |&(x, covector): &(DVec3, Jet<DVec3>)| (self.local(x), self.local_covector(covector));
        self.surface.add_parameter_gradients(&taps.iter().map(local).collect::<Vec<_>>(), gradient);
    }
}

#[cfg(test)]
mod tests {
    use flatland::sdf::shapes::{Ball, SmoothUnion};

    use super::*;
    use crate::gradient::{EdgeSampling, GradientError, Progress, Rotation, Tangent, Unsupported, render};
    use crate::optimize::Parameters;
    use crate::scene::{
        Camera, Description, Environment, Film, Filter, Material, Scene, SceneError, Texture, Wrap,
    };
    use crate::sdf::{Grid, Interpolation};

    fn ball(z: f64, radius: f64) -> Ball<DVec3> {
        Ball::new(DVec3::new(0.0, 0.0, z), radius).expect("a ball")
    }

    fn description() -> Description {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::Z, DVec3::Y, 0.9);
        let film = Film { width: 8, height: 8, crop: None, sample_border: true, filter: Filter::Box };
        let mut description = Description::new(camera, film);
        description.environment = Some(Environment::Constant { id: "sky".into(), radiance: DVec3::ONE });
        let clay = description.add_material(Material::diffuse("clay", DVec3::splat(0.5)));
        description.add_implicit("ball", ball(4.0, 1.0), clay);
        description
    }

    #[test]
    fn bad_placements_are_refused() {
        let refused = |change: &dyn Fn(&mut Description)| {
            let mut description = description();
            change(&mut description);
            Scene::new(description).expect_err("a bad scene").to_string()
        };
        let placement = |d: &mut Description, change: &dyn Fn(&mut Placement)| {
            change(&mut d.implicits[0].placement);
        };
        let message = refused(&|d| placement(d, &|p| p.translation.z = -4.0));
        assert!(
            message.contains("the camera is inside the implicit surface `ball`, where φ = -1"),
            "{message}"
        );
        let message = refused(&|d| placement(d, &|p| p.translation.x = f64::NAN));
        assert_eq!(message, "a coordinate of `ball` is NaN, but must be finite");
        let message = refused(&|d| placement(d, &|p| p.scale = 0.0));
        assert_eq!(message, "the scale of `ball` is 0, but must be positive and finite");
        let message = refused(&|d| placement(d, &|p| p.rotation.x_axis *= 2.0));
        assert!(message.contains("rotation"), "{message}");
        let message = refused(&|d| d.implicits[0].material = 7);
        assert!(message.contains("material 7"), "{message}");
        let message = refused(&|d| d.tracer.tolerance = 2.0);
        assert!(message.contains("tolerance 2"), "{message}");
        let message = refused(&|d| {
            d.add_shape("ball", crate::geometry::Mesh::cube(), 0);
        });
        assert!(message.contains("two shapes are called `ball`"), "{message}");
        let message = refused(&|d| {
            let wrap = Wrap::Repeat;
            let (texels, to_uv) = (vec![DVec3::ONE], glam::DAffine2::IDENTITY);
            let paper = Texture { id: "paper".into(), width: 1, height: 1, texels, wrap, to_uv };
            let paper = d.add_texture(paper);
            *d.materials[0].bsdf.reflectance_mut() = crate::scene::Reflectance::Texture(paper);
        });
        assert!(message.contains("no texture coordinates"), "{message}");
    }

    #[test]
    fn methods_for_meshes_refuse_what_moves() {
        let scene = Scene::new(description()).expect("a scene");
        let mut change = Tangent::still(&scene);
        change.implicits[0].translation = DVec3::X;
        let refused = |result: Result<_, GradientError>| {
            let implicit = |e| matches!(e, GradientError::Unsupported(Unsupported::Implicit { .. }));
            assert!(result.is_err_and(implicit));
        };
        refused(EdgeSampling::default().forward(&scene, &change, &Progress::none()).map(|_| ()));
        refused(Rotation::default().forward(&scene, &change, &Progress::none()).map(|_| ()));
        let still = Tangent::still(&scene);
        assert!(EdgeSampling::default().forward(&scene, &still, &Progress::none()).is_ok());
    }

    /// Updating a surface directly or by its parameters gives the scene built with it.
    #[test]
    fn updates_are_scenes_built_anew() {
        let mut scene = Scene::new(description()).expect("a scene");
        let parameters = Parameters::new(&scene, &["ball.sdf", "ball.translation", "ball.rotation"]);
        let parameters = parameters.expect("there are such parameters");
        let x = parameters.values(&scene);
        assert_eq!(x, [0.0, 0.0, 4.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let moved = [0.1, 0.0, 4.2, 0.8, 0.3, -0.1, 0.5, 0.0, 0.0, 0.2];
        parameters.apply(&moved, &mut scene).expect("a ball elsewhere");
        let mut anew = description();
        anew.implicits[0].surface =
            ImplicitSurface::new(Ball::new(DVec3::new(0.1, 0.0, 4.2), 0.8).expect("a ball"));
        let placement = &mut anew.implicits[0].placement;
        placement.translation = DVec3::new(0.3, -0.1, 0.5);
        placement.rotation = DMat3::from_quat(glam::DQuat::from_rotation_z(0.2));
        assert!(
            anew.implicits[0]
                .placement
                .rotation
                .abs_diff_eq(scene.description().implicits[0].placement.rotation, 1e-15)
        );
        anew.implicits[0].placement = scene.description().implicits[0].placement;
        assert_eq!(*scene.description(), anew);
        let image = |scene: &Scene| render(scene, 4, 1, &Progress::none()).expect("an image").image;
        assert!(image(&scene) == image(&Scene::new(anew).expect("a scene")));
        // A rejected update changes nothing.
        let before = scene.description().clone();
        let mut bad = moved;
        bad[3] = -1.0;
        assert!(matches!(parameters.apply(&bad, &mut scene), Err(SceneError::Implicit { .. })));
        let mut inside = before.implicits[0].clone();
        inside.placement.translation.z = -4.2;
        assert!(matches!(scene.set_implicit(0, inside), Err(SceneError::Inside { .. })));
        assert_eq!(*scene.description(), before);
        assert!(scene.set_implicit(1, before.implicits[0].clone()).is_err());
        let textured = {
            let mut description = before.clone();
            let wrap = Wrap::Repeat;
            let (texels, to_uv) = (vec![DVec3::ONE], glam::DAffine2::IDENTITY);
            let id = "paper".into();
            description.add_texture(Texture { id, width: 1, height: 1, texels, wrap, to_uv });
            let mut scene = Scene::new(description).expect("a scene");
            let mut material = scene.description().materials[0].clone();
            *material.bsdf.reflectance_mut() = crate::scene::Reflectance::Texture(0);
            scene.set_material(0, material)
        };
        assert!(matches!(textured, Err(SceneError::NoCoordinates { .. })));
    }

    /// With few steps, rays are lost near the outline and nowhere else.
    #[test]
    fn lost_rays_have_a_place() {
        let mut few = description();
        few.film = Film { width: 32, height: 32, ..few.film };
        few.integrator.max_depth = Some(1);
        let all = render(&Scene::new(few.clone()).expect("a scene"), 4, 1, &Progress::none());
        let all = all.expect("an image");
        assert!(all.lost_rays.is_none(), "{:?}", all.traces);
        few.tracer.max_steps = 4;
        let scene = Scene::new(few).expect("a scene");
        let rendering = render(&scene, 4, 1, &Progress::none()).expect("an image");
        let lost = rendering.lost_rays.expect("rays are lost");
        let sum: f64 = lost.pixels.iter().map(|p| p.x).sum();
        assert!(sum > 0.0 && sum == rendering.traces.out_of_steps as f64, "{sum} {:?}", rendering.traces);
        // Radius in pixels: tan(asin ¼) / tan 0.45 of half the film.
        let radius = 16.0 * 15.0_f64.sqrt().recip() / 0.45_f64.tan();
        for (i, p) in lost.pixels.iter().enumerate().filter(|(_, p)| p.x > 0.0) {
            let at = DVec3::new((i % 32) as f64 - 15.5, (i / 32) as f64 - 15.5, 0.0).length();
            assert!((at - radius).abs() < 3.0, "{at} {}", p.x);
        }
    }

    /// A ray that passes within the tracer's tolerance is not a hit, where ∇φ·ω would be nearly 0; nor does a
    /// grazing ray miss. With values alone, and with a bound on second derivatives.
    #[test]
    fn hits_do_not_know_the_tolerance() {
        let grid = {
            let corners = (DVec3::new(-1.5, -1.5, 2.5), DVec3::new(1.5, 1.5, 5.5));
            let distance = |x: DVec3| (x - 4.0 * DVec3::Z).length() - 1.0;
            let grid = Grid::sampled(Interpolation::Cubic, corners, 24, distance).expect("a grid");
            grid.prefiltered().expect("coefficients")
        };
        let mut of_grid = description();
        of_grid.implicits[0].surface = ImplicitSurface::new(grid);
        // A union has no bound on second derivatives.
        let mut of_union = description();
        let union = SmoothUnion::new(ball(4.0, 1.0), ball(4.0, 0.9), 0.0).expect("a union");
        of_union.implicits[0].surface = ImplicitSurface::new(union);
        for description in [description(), of_union, of_grid] {
            let scene = Scene::new(description).expect("a scene");
            let shape = &scene.description().implicits[0];
            let hit = |angle: f64| {
                scene
                    .closest(DVec3::ZERO, DVec3::new(angle.sin(), 0.0, angle.cos()), None)
                    .map(|h| h.distance)
            };
            let (mut inside, mut outside) = (0.2, 0.3);
            while outside - inside > 1e-15 {
                let middle = 0.5 * (inside + outside);
                if hit(middle).is_some() { inside = middle } else { outside = middle }
            }
            // The least φ along a ray is 0 at the silhouette.
            let least = |angle: f64| {
                let way = DVec3::new(angle.sin(), 0.0, angle.cos());
                let middle = hit(inside).expect("a hit");
                (-5_000..5_000)
                    .map(|i| shape.value((middle + 1e-6 * f64::from(i)) * way))
                    .fold(f64::INFINITY, f64::min)
            };
            assert!(least(inside).abs() < 1e-10, "{}", least(inside));
            for beside in [1e-9, 1e-8, 1e-7, 1e-6] {
                assert!(hit(inside - beside).is_some() && hit(inside + beside).is_none(), "{beside}");
            }
        }
    }

    /// From far away the tolerance, an angle, exceeds the spacing of small objects: the nearest of them is
    /// hit nevertheless.
    #[test]
    fn far_away_the_first_of_small_things_is_met() {
        for distance in [1e2, 1e4, 1e5] {
            let at = |x: f64, z: f64| Ball::new(DVec3::new(x, 0.0, distance + z), 0.05).expect("a ball");
            let balls = [at(0.0, 0.0), at(0.03, 0.12)];
            let mut pair = description();
            pair.tracer.far = 1e6;
            let union = SmoothUnion::new(balls[0], balls[1], 0.0).expect("a union");
            pair.implicits[0].surface = ImplicitSurface::new(union);
            let scene = Scene::new(pair).expect("a scene");
            for i in 0..2000 {
                let x = -0.05 + 0.13 * (f64::from(i) + 0.5) / 2000.0;
                let way = DVec3::new(x, 0.0, distance).normalize();
                let passed = balls.map(|ball| {
                    let along = ball.centre().dot(way);
                    (along, (ball.centre() - along * way).length())
                });
                // Near silhouettes rays run out of steps, and are counted.
                if passed.iter().any(|(_, across)| (across - 0.05).abs() < 1e-4) {
                    continue;
                }
                let first = passed.into_iter().filter(|(_, across)| *across < 0.05);
                let first = first.map(|(along, across)| along - (0.05_f64.powi(2) - across * across).sqrt());
                let Some(first) = first.reduce(f64::min) else { continue };
                let hit = scene.closest(-scene.offset(), way, None).map_or(f64::INFINITY, |hit| hit.distance);
                assert!((hit - first).abs() < 1e-6, "{distance} {x}: {hit} {first}");
            }
        }
    }

    /// Along its axis a ball of radius 1 at distance 4 is 3 away, and rays graze it at the right angle.
    #[test]
    fn rays_meet_it_where_it_is() {
        let mut description = description();
        description.implicits[0].placement = Placement { scale: 0.5, ..Placement::default() };
        let scene = Scene::new(description).expect("a scene");
        let hit = scene.closest(DVec3::ZERO, DVec3::Z, None).expect("a hit");
        assert!((hit.distance - 1.5).abs() < 1e-14, "{}", hit.distance);
        let graze = (0.5_f64 / 2.0).asin();
        let seen = |angle: f64| scene.closest(DVec3::ZERO, DVec3::new(angle.sin(), 0.0, angle.cos()), None);
        assert!(seen(graze - 1e-4).is_some() && seen(graze + 1e-4).is_none());
        assert!(
            scene.blocked(DVec3::ZERO, DVec3::Z, 0.0, 2.0) && !scene.blocked(DVec3::ZERO, DVec3::Z, 0.0, 1.4)
        );
        assert!(scene.beyond(DVec3::ZERO, DVec3::X, 0.0).is_none());
        // The target point does not occlude itself, though it is within the tolerance of the surface in front
        // of it.
        for angle in [0.0, 0.1, 0.2, 0.24] {
            let way = DVec3::new(f64::sin(angle), 0.0, f64::cos(angle));
            let hit = scene.closest(DVec3::ZERO, way, None).expect("a hit");
            assert!(!scene.blocked(DVec3::ZERO, way, 0.0, hit.distance), "{angle}");
        }
        // It is invisible from its own surface.
        let surface = Some(hit.surface);
        assert!(scene.closest(DVec3::Z * hit.distance, DVec3::new(0.6, 0.0, -0.8), surface).is_none());
        assert!(
            scene
                .closest(DVec3::Z * hit.distance, DVec3::new(1.0, 0.0, -0.01).normalize(), surface)
                .is_none()
        );
    }
}
