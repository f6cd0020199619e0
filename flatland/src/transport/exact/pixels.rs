//! Exact pixels and their derivatives, term by term.

use rayon::prelude::*;

use super::direct::{Surface, SurfaceMotion, emitted, may_scatter};
use super::error::ExactError;
use super::partition::{Jump, Partition, Seen, film_rate};
use crate::quadrature::{Quadrature, adaptive};
use crate::transport::{Camera, Tangent, Terms, World};

/// The exact image of a world and its exact derivative, for light that is scattered at most once.
///
/// Radiance has a closed form at every point of a surface; over the film it is integrated between the places
/// where it is not analytic by adaptive Gauss–Legendre quadrature.
///
/// # Example
///
/// ```
/// use flatland::plane::Filter;
/// use flatland::transport::exact::Exact;
/// use flatland::transport::{Camera, Tangent, Film, Material, Shape, World};
/// use glam::DVec2;
///
/// let floor = Shape::open([DVec2::new(-5.0, 0.0), DVec2::new(5.0, 0.0)], Material::diffuse(0.8));
/// let lamp = Shape::open([DVec2::new(-0.5, 2.0), DVec2::new(0.5, 2.0)], Material::emitter(3.0));
/// let world = World::new(0.0, vec![floor, lamp])?;
/// let film = Film { pixels: 8, filter: Filter::Tent };
/// let camera = Camera { position: DVec2::new(3.0, 2.5), angle: -2.4, field_of_view: 0.9, film };
/// let exact = Exact::default();
/// let image = exact.image(&world, &camera)?;
/// let lifted = Tangent::translate(&world, [1], DVec2::Y);
/// let slope = exact.gradient(&world, &camera, &lifted)?;
/// let step = 1e-5;
/// let above = exact.image(&world.displaced(&lifted, step)?, &camera)?;
/// let found = (above.pixels[4] - image.pixels[4]) / step;
/// assert!((found - slope.pixels[4].total()).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exact {
    /// Largest number of scattering events: 0 for emission only, 1 for direct light as well.
    pub bounces: usize,
    /// Error of the quadrature, relative to the integral of absolute values.
    pub tolerance: f64,
}

impl Default for Exact {
    fn default() -> Self {
        Self { bounces: 1, tolerance: 1e-11 }
    }
}

/// Values of all pixels with their error estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Integrated<T> {
    /// The values.
    pub pixels: Vec<T>,
    /// Estimates of the absolute errors; pessimistic, because they belong to the quadrature's last step but
    /// one. Rounding is additional, about 10⁻¹⁵ of the scale.
    pub errors: Vec<f64>,
    /// Integrals of the absolute values of all terms, to which accuracy is relative.
    pub scales: Vec<f64>,
}

impl<T> Integrated<T> {
    fn collect(pixels: Vec<(T, f64, f64)>) -> Self {
        let mut this = Self { pixels: vec![], errors: vec![], scales: vec![] };
        for (value, error, scale) in pixels {
            this.pixels.push(value);
            this.errors.push(error);
            this.scales.push(scale);
        }
        this
    }
}

impl Exact {
    /// I_p = ∫ h_p(u) L(u) du of every pixel.
    ///
    /// # Errors
    /// An [`ExactError`] that names the parameter.
    pub fn image(&self, world: &World, camera: &Camera) -> Result<Integrated<f64>, ExactError> {
        let film = self.prepare(world, camera, |i| world.material(i).scatters())?;
        let pixels = (0..camera.film.pixels).into_par_iter().map(|pixel| {
            let integral = film.integrate(pixel, self.tolerance, |u| {
                let value = film.radiance(u);
                ([value], value)
            });
            (integral.value[0], integral.error, integral.scale)
        });
        Ok(Integrated::collect(pixels.collect()))
    }

    /// dI_p/dθ of every pixel:
    ///
    /// ```text
    /// interior   ∫ h ∂L/∂θ du           at fixed u and fixed directions at the surface
    /// secondary  ∫ h Σ f cos φ ΔL ψ̇ du   ends of what the surface sees, at fixed u
    /// primary    Σ h(u_e) (L⁻ − L⁺) u̇_e   ends of what the film sees
    /// ```
    ///
    /// # Errors
    /// An [`ExactError`] that names the parameter, or the place where no derivative exists.
    pub fn gradient(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<Integrated<Terms<f64>>, ExactError> {
        change.check(world)?;
        let film = self.prepare(world, camera, |i| may_scatter(world, change, i))?;
        film.partition.check_parting(world, camera, change)?;
        let jumps = &film.partition.jumps;
        let steps: Vec<(&Jump, f64)> = jumps.iter().map(|jump| (jump, film.step(jump, change))).collect();
        steps.iter().try_for_each(|(jump, step)| jump.check(camera, *step))?;
        let pixels = (0..camera.film.pixels).into_par_iter().map(|pixel| {
            let integral = film.integrate(pixel, self.tolerance, |u| film.rate(u, change));
            let [interior, secondary] = integral.value;
            let at = |&(jump, step): &(&Jump, f64)| camera.film.filter_value(pixel, jump.u) * step;
            let primary = steps.iter().map(at).sum();
            let scale = integral.scale + steps.iter().map(|s| at(s).abs()).sum::<f64>();
            (Terms { interior, primary, secondary }, integral.error, scale)
        });
        Ok(Integrated::collect(pixels.collect()))
    }

    fn prepare<'a>(
        &self,
        world: &'a World,
        camera: &'a Camera,
        scatters: impl Fn(usize) -> bool,
    ) -> Result<FilmIntegral<'a>, ExactError> {
        camera.check()?;
        let Self { bounces, tolerance } = *self;
        if bounces > 1 {
            return Err(ExactError::Bounces { bounces });
        }
        if !(1e-14..1.0).contains(&tolerance) {
            return Err(ExactError::Tolerance { tolerance });
        }
        let scatters: Vec<bool> = (0..world.segments().len()).map(|i| bounces > 0 && scatters(i)).collect();
        let partition = Partition::new(world, camera, |i| scatters[i])?;
        Ok(FilmIntegral { world, camera, scatters, partition })
    }
}

struct FilmIntegral<'a> {
    world: &'a World,
    camera: &'a Camera,
    /// For every segment, whether its scattered light matters.
    scatters: Vec<bool>,
    partition: Partition,
}

impl FilmIntegral<'_> {
    /// ∫ h_p f du, with f returning its values and their scale.
    fn integrate<const N: usize>(
        &self,
        pixel: usize,
        tolerance: f64,
        mut f: impl FnMut(f64) -> ([f64; N], f64),
    ) -> Quadrature<N> {
        let film = &self.camera.film;
        let mut pieces = vec![];
        film.cells(pixel).for_each(|cell| self.partition.pieces(cell, &mut pieces));
        let weighted = |u: f64| {
            let h = film.filter_value(pixel, u);
            let (values, scale) = f(u);
            (values.map(|v| h * v), h * scale)
        };
        adaptive(&pieces, weighted, tolerance)
    }

    /// L at u.
    fn radiance(&self, u: f64) -> f64 {
        let seen = self.partition.stretch(u).seen;
        self.radiance_of(seen.map(|i| Seen::on(self.world, self.camera, i, u)))
    }

    fn radiance_of(&self, seen: Option<Seen>) -> f64 {
        match seen {
            Some(Seen { segment, s, direction, .. }) if self.scatters[segment] => {
                Surface::new(self.world, segment, s, -direction).radiance()
            }
            _ => emitted(self.world, seen.map(|s| s.segment)),
        }
    }

    /// Interior and secondary term at u, and their scale.
    fn rate(&self, u: f64, change: &Tangent) -> ([f64; 2], f64) {
        let Some(segment) = self.partition.stretch(u).seen else {
            return ([change.environment, 0.0], change.environment.abs());
        };
        if !self.scatters[segment] {
            let rate = change.materials[self.world.segments()[segment].shape].emission;
            return ([rate, 0.0], rate.abs());
        }
        let seen = Seen::on(self.world, self.camera, segment, u);
        let motion = motion_of_seen(self.world, self.camera, u, &seen, change);
        let rate = Surface::new(self.world, segment, seen.s, -seen.direction).rate(change, &motion);
        ([rate.interior, rate.boundary], rate.magnitude)
    }

    /// (L⁻ − L⁺) u̇ of a discontinuity over the film.
    fn step(&self, jump: &Jump, change: &Tangent) -> f64 {
        let rate = film_rate(self.camera, change, jump.vertex, jump.u, jump.distance);
        if rate == 0.0 {
            return 0.0;
        }
        let seen = jump.sides.map(|side| side.map(|i| Seen::at_jump(self.world, self.camera, i, jump)));
        let [low, high] = seen.map(|side| self.radiance_of(side));
        (low - high) * rate
    }
}

/// Motion of the point seen at u: ẋ = ẋ_o + tψ̇τ + ṫω with ṫ = n·(ẋ_mat − ẋ_o − tψ̇τ)/(n·ω).
pub(super) fn motion_of_seen(
    world: &World,
    camera: &Camera,
    u: f64,
    seen: &Seen,
    change: &Tangent,
) -> SurfaceMotion {
    let Seen { segment, s, distance, direction } = *seen;
    let own = &world.segments()[segment];
    let turn = camera.direction_rate(u).1.dot(&change.camera);
    let carried = change.camera.position + distance * turn * direction.perp();
    let material = own.material_point(s).velocity(&change.vertices);
    let normal = own.normal();
    let receding = normal.dot(material - carried) / normal.dot(direction);
    let ends = own.turning_rate().into_iter().zip(own.vertices);
    SurfaceMotion {
        velocity: carried + receding * direction,
        normal_turn: ends.map(|(covector, v)| covector.dot(change.vertices[v])).sum(),
        outgoing_turn: turn,
    }
}
