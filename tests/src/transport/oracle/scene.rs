//! A world and its camera in dual numbers, with visibility by brute force.

use flatland::transport::{Camera, Material, MaterialTangent, Tangent, World};
use glam::DVec2;
use num_dual::{Dual64, DualNum};

use crate::dual::{Vector, Vector2};

/// A line segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// The end points, as indices of vertices.
    pub(super) vertices: [usize; 2],
    /// Vector from the first to the second.
    pub(super) edge: Vector2,
    /// Its direction.
    pub(super) tangent: Vector2,
    pub(super) surface: Surface,
}

/// A material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub(super) reflectance: Dual64,
    pub(super) emission: Dual64,
    /// Strength and width.
    pub(super) gloss: Option<[Dual64; 2]>,
}

/// Everything that depends on θ, at θ = 0.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    pub(super) vertices: Vec<Vector2>,
    pub(super) lines: Vec<Line>,
    pub(super) environment: Dual64,
    pub(super) eye: Eye,
}

/// The camera: u ↦ ω = a + (2u/n − 1) T b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye {
    pub(super) position: Vector2,
    axes: [Vector2; 2],
    tan: Dual64,
    pixels: f64,
}

impl Surface {
    fn new(material: &Material, change: &MaterialTangent) -> Self {
        Self {
            reflectance: Dual64::new(material.reflectance, change.reflectance),
            emission: Dual64::new(material.emission, change.emission),
            gloss: material.gloss.map(|g| {
                [Dual64::new(g.strength, change.gloss_strength), Dual64::new(g.width, change.gloss_width)]
            }),
        }
    }

    /// Whether it scatters light, or would if θ changed.
    pub(super) fn scatters(&self) -> bool {
        let strength = self.gloss.map_or(Dual64::from(0.0), |[s, _]| s);
        !is_nothing(self.reflectance) || !is_nothing(strength)
    }
}

/// Whether a dual number is 0 with derivative 0.
pub(super) fn is_nothing(x: Dual64) -> bool {
    x.re == 0.0 && x.eps == 0.0
}

impl Eye {
    fn new(camera: &Camera, change: &Tangent) -> Self {
        let angle = Dual64::new(camera.angle, change.camera.angle);
        let axis = Vector([angle.cos(), angle.sin()]);
        Self {
            position: Vector2::new(camera.position, change.camera.position),
            axes: [axis, axis.turned()],
            tan: (Dual64::new(camera.field_of_view, change.camera.field_of_view) * 0.5).tan(),
            pixels: camera.film.pixels as f64,
        }
    }

    /// ω(u), not normalised.
    pub(super) fn direction(&self, u: Dual64) -> Vector2 {
        self.axes[0] + self.axes[1] * ((u * (2.0 / self.pixels) - 1.0) * self.tan)
    }

    /// The film coordinate of a point, if it is in front.
    pub(super) fn project(&self, point: Vector2) -> Option<Dual64> {
        let d = point - self.position;
        let [depth, side] = self.axes.map(|axis| d.dot(axis));
        (depth.re > 0.0).then(|| (side / (depth * self.tan) + 1.0) * (0.5 * self.pixels))
    }

    /// The film coordinate of a point at rest.
    pub(super) fn project_value(&self, point: DVec2) -> Option<f64> {
        self.project(Vector2::still(point)).map(|u| u.re)
    }
}

impl Scene {
    pub(super) fn new(world: &World, camera: &Camera, change: &Tangent) -> Self {
        let vertices: Vec<Vector2> =
            world.vertices().zip(&change.vertices).map(|(p, v)| Vector2::new(p, *v)).collect();
        let line = |segment: &flatland::transport::Segment| {
            let [a, b] = segment.vertices;
            let edge = vertices[b] - vertices[a];
            let material = world.shapes()[segment.shape].material();
            let surface = Surface::new(material, &change.materials[segment.shape]);
            Line { vertices: [a, b], edge, tangent: edge.unit(), surface }
        };
        let lines = world.segments().iter().map(line).collect();
        let environment = Dual64::new(world.environment(), change.environment);
        Self { vertices, lines, environment, eye: Eye::new(camera, change) }
    }

    /// The end points of a line at θ = 0.
    pub(super) fn ends(&self, line: usize) -> [DVec2; 2] {
        self.lines[line].vertices.map(|v| self.vertices[v].value())
    }

    /// The radiance emitted by a line, or by the environment.
    pub(super) fn emission(&self, seen: Option<usize>) -> Dual64 {
        seen.map_or(self.environment, |line| self.lines[line].surface.emission)
    }

    /// The first line met from a point of the line `own`, or from free space.
    pub(super) fn first(&self, from: DVec2, direction: DVec2, own: Option<usize>) -> Option<usize> {
        let mut nearest = (f64::INFINITY, None);
        for (i, line) in self.lines.iter().enumerate().filter(|(i, _)| Some(*i) != own) {
            let [a, b] = line.vertices.map(|v| self.vertices[v].value() - from);
            if (direction.perp_dot(a) < 0.0) == (direction.perp_dot(b) < 0.0) {
                continue;
            }
            let edge = line.edge.value();
            let distance = a.perp_dot(edge) / direction.perp_dot(edge);
            if distance > 0.0 && distance < nearest.0 {
                nearest = (distance, Some(i));
            }
        }
        nearest.1
    }

    /// Whether a line that is not `own` and does not end in one of the vertices `but` crosses pq.
    pub(super) fn is_blocked(&self, p: DVec2, q: DVec2, own: usize, but: [usize; 2]) -> bool {
        self.lines.iter().enumerate().any(|(i, line)| {
            let [a, b] = self.ends(i);
            let apart = |o: DVec2, d: DVec2, x: DVec2, y: DVec2| {
                (d.perp_dot(x - o) < 0.0) != (d.perp_dot(y - o) < 0.0)
            };
            i != own
                && !line.vertices.iter().any(|v| but.contains(v))
                && apart(p, q - p, a, b)
                && apart(a, b - a, p, q)
        })
    }

    /// The intersection of a ray with a line: the point of the line in direction `d` from `from`, computed
    /// from its nearer end, so that it lies on the line to rounding.
    pub(super) fn meet(&self, line: usize, from: Vector2, d: Vector2) -> Vector2 {
        let [a, b] = self.lines[line].vertices.map(|v| self.vertices[v]);
        let edge = self.lines[line].edge;
        let [left, right] = [a, b].map(|p| d.cross(p - from));
        let s = left / (left - right);
        if s.re <= 0.5 { a + edge * s } else { b + edge * (right / (left - right)) }
    }
}
