//! Backward connection of shading points to the camera: the part of a path before a discontinuity.

use flatland::calculus::Vec3;
use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec2, DVec3};

use crate::gradient::film::FilmPlane;
use crate::path::{Frame, Paths, Plain, Sequence, SurfacePoint};
use crate::scene::Surface;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Vertex {
    pub(in crate::gradient::curve) position: DVec3,
    pub(in crate::gradient::curve) surface: Surface,
}

/// Fraction of backward directions on the far side of a surface with shading normals, which may reflect light
/// from below the face.
const BELOW: f64 = 0.1;

/// Fraction of backward directions that are uniform; the others have a density proportional to the cosine. A
/// moving path vertex slides with 1/cos θ in the direction in which the previous vertex sees it: with the
/// cosine density alone, the mean of 1/cos²θ diverges near contact.
const UNIFORM: f64 = 0.5;

/// Largest continuation probability of backward paths of unlimited length.
const SURVIVAL: f64 = 0.95;

/// Connects shading points to the film.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Sensor<'a> {
    pub(in crate::gradient::curve) paths: &'a Paths<'a>,
    pub(in crate::gradient::curve) film: FilmPlane,
    pub(in crate::gradient::curve) frame: Frame<f64>,
}

/// A path from the camera to a shading point; for curves on the film, to the surface seen beside them.
#[derive(Clone, Debug)]
pub(in crate::gradient::curve) struct CameraSubpath<'v> {
    /// The film, through the sampled point of the lens.
    pub(in crate::gradient::curve) film: &'v FilmPlane,
    pub(in crate::gradient::curve) at: DVec2,
    /// Shading points, last of the path first; none where the camera sees no surface.
    pub(in crate::gradient::curve) vertices: &'v [Vertex],
    /// Path throughput Π f cos θ …, see [`Sensor::each_subpath`]; 1 for curves on the film.
    pub(in crate::gradient::curve) weight: DVec3,
}

impl<'a> Sensor<'a> {
    pub(in crate::gradient::curve) fn new(paths: &'a Paths<'a>) -> Self {
        let film = FilmPlane::new(paths.scene);
        Self { paths, film, frame: film.still }
    }

    /// This sensor through a random point of the lens, if there is one.
    pub(in crate::gradient::curve) fn through(&self, numbers: &mut Sequence) -> Self {
        let film = self.film.through(numbers);
        Self { film, frame: film.still, ..*self }
    }

    /// f cos θ_s/cos θ_g: reflection at a vertex towards `viewer` of light from `towards`, per solid angle
    /// projected on the face instead of the shading normal.
    fn reflection(&self, viewer: DVec3, vertex: &Vertex, towards: DVec3) -> DVec3 {
        let scene = self.paths.scene;
        let plain = Plain { scene };
        let direction = (vertex.position - viewer).normalize_or_zero();
        let (origin, direction) = (Vec3::constant(viewer), Vec3::constant(direction));
        let point = SurfacePoint::new(
            scene,
            &plain,
            origin,
            direction,
            vertex.surface,
            viewer.distance(vertex.position),
        );
        let Some(shading) = point.shading(scene, &plain) else { return DVec3::ZERO };
        let cosine = self.paths.scene.normal_of(vertex.surface, vertex.position).dot(towards).abs();
        shading.evaluate(Vec3::constant(towards)).value() / cosine
    }

    /// Every path of at most `longest` segments from the camera to a shading point that light reaches from
    /// direction `towards`.
    ///
    /// With x₁ … x_k the shading points from the camera on, n_j the face normals and ω_j the direction from
    /// x_j to the next, the measure du dω₁ … dω_{k−1} of paths from the camera is reversed:
    ///
    /// > du = (f²/cos³θ) (|n₁·ω₀|/|x₁ − o|²) dA₁,
    /// > dω_{j−1} dA_{j−1} = (|n_j·ω_{j−1}|/d²) (d²/|n_{j−1}·ω_{j−1}|) dω′_j dA_j,
    ///
    /// with ω′_j the backward direction. The weight is that of ∫ … |n_k·ω_k| dA_k.
    pub(in crate::gradient::curve) fn each_subpath(
        &self,
        last: Vertex,
        mut towards: DVec3,
        longest: usize,
        numbers: &mut Sequence,
        mut f: impl FnMut(CameraSubpath<'_>),
    ) {
        let sensor = self.through(numbers);
        let mut vertices = vec![last];
        let mut throughput = DVec3::ONE;
        loop {
            let vertex = vertices[vertices.len() - 1];
            if let Some((at, weight)) = sensor.connect(&vertex, towards) {
                f(CameraSubpath { film: &sensor.film, at, vertices: &vertices, weight: throughput * weight });
            }
            if vertices.len() >= longest {
                return;
            }
            if vertices.len() > 2 {
                let survival = throughput.max_element().clamp(0.0, SURVIVAL);
                if numbers.one() >= survival {
                    return;
                }
                throughput /= survival;
            }
            let Some((next, factor)) = self.extend(&vertex, towards, numbers) else { return };
            throughput *= factor;
            if throughput == DVec3::ZERO {
                return;
            }
            towards = (vertex.position - next.position).normalize();
            vertices.push(next);
        }
    }

    /// Film point of a vertex, and f cos θ_s/cos θ_g · du/dA.
    fn connect(&self, vertex: &Vertex, towards: DVec3) -> Option<(DVec2, DVec3)> {
        let origin = self.frame.origin.value();
        let way = vertex.position - origin;
        let distance = way.length();
        let direction = way / distance;
        let cosine = direction.dot(self.frame.forward.value());
        if cosine <= 0.0 {
            return None;
        }
        let at = DVec2::from(self.film.project(&self.frame, Vec3::constant(vertex.position)));
        self.film.cell(at)?;
        let weight = self.reflection(origin, vertex, towards) * self.film_area(vertex);
        if weight == DVec3::ZERO || self.paths.scene.hidden_from_camera(origin, direction, distance) {
            return None;
        }
        Some((at, weight))
    }

    /// du/dA: film area, in pixels, per unit of surface area; 0 if it is not visible.
    pub(in crate::gradient::curve) fn film_area(&self, vertex: &Vertex) -> f64 {
        let way = vertex.position - self.frame.origin.value();
        let distance = way.length();
        let direction = way / distance;
        let cosine = direction.dot(self.frame.forward.value());
        let slope = self.paths.scene.normal_of(vertex.surface, vertex.position).dot(direction).abs();
        self.film.focal_area() * slope / (cosine.powi(3) * distance * distance)
    }

    /// Extends a path backwards by one vertex, with f cos θ_s/cos θ_g · |n·ω′|/density.
    fn extend(&self, vertex: &Vertex, towards: DVec3, numbers: &mut Sequence) -> Option<(Vertex, DVec3)> {
        let scene = self.paths.scene;
        let face = self.paths.scene.normal_of(vertex.surface, vertex.position);
        let face = if face.dot(towards) < 0.0 { -face } else { face };
        let ([side, kind], [a, b]) = (numbers.pair(), numbers.pair());
        let bends = scene.has_shading_normals(vertex.surface);
        let (normal, share) = match bends {
            false => (face, 1.0),
            true if side < BELOW => (-face, BELOW),
            true => (face, 1.0 - BELOW),
        };
        let (s, t) = normal.any_orthonormal_pair();
        let (sin, cos) = (TAU * b).sin_cos();
        let cosine = if kind < UNIFORM { a } else { (1.0 - a).sqrt() };
        let direction = (1.0 - cosine * cosine).sqrt() * (cos * s + sin * t) + cosine * normal;
        let hit = scene.closest(vertex.position, direction, Some(vertex.surface))?;
        let next = Vertex { position: vertex.position + direction * hit.distance, surface: hit.surface };
        let density = share * FRAC_1_PI * (0.5 * UNIFORM + (1.0 - UNIFORM) * cosine);
        let factor = self.reflection(next.position, vertex, towards) * (cosine / density);
        Some((next, factor))
    }
}
