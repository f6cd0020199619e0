//! Scenes under construction: moving bodies of a mesh in front of a camera, and lights of a ground.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::moves::Affine;
use super::solids::Solid;
use crate::dice::Dice;
use crate::space::coverage::{Camera, Mesh, Motion};

/// One body: its vertices, its centre and its size.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) vertices: Range<usize>,
    pub(super) centre: DVec3,
    pub(super) radius: f64,
}

/// A mesh under construction.
pub(super) struct Stage {
    pub(super) dice: Dice,
    pub(super) camera: Camera,
    pub(super) mesh: Mesh,
    pub(super) motion: Motion,
    pub(super) bodies: Vec<Body>,
}

impl Stage {
    /// An empty mesh in front of a randomly placed camera of 4 × 4 to 8 × 8 pixels.
    pub(super) fn new(mut dice: Dice) -> Self {
        let frame = dice.frame();
        let camera = Camera {
            origin: dice.vector3(2.0),
            right: frame.x_axis,
            up: frame.y_axis,
            forward: -frame.z_axis,
            field_of_view: dice.between(0.4, 1.3),
            width: dice.count(4, 8),
            height: dice.count(4, 8),
        };
        let mesh = Mesh { positions: vec![], triangles: vec![], radiance: vec![], background: dice.colour() };
        Self { dice, camera, mesh, motion: Motion::default(), bodies: vec![] }
    }

    /// The film's size in pixels.
    pub(super) fn size(&self) -> DVec2 {
        DVec2::new(self.camera.width as f64, self.camera.height as f64)
    }

    /// The point at a depth whose image is u.
    pub(super) fn place(&self, u: DVec2, depth: f64) -> DVec3 {
        self.camera.origin + depth * self.camera.direction(u)
    }

    /// A normal that faces the camera from a point, at a cosine of this or more to the line of sight.
    pub(super) fn facing(&mut self, from: DVec3, cosine: f64) -> DVec3 {
        let sight = (from - self.camera.origin).normalize();
        loop {
            let normal = self.dice.direction();
            if normal.dot(sight) < -cosine {
                return normal;
            }
        }
    }

    pub(super) fn is_seen_from_front(&self, [a, b, c]: [DVec3; 3]) -> bool {
        (b - a).cross(c - a).dot(self.camera.origin - a) > 0.0
    }

    /// Adds a body. Open triangles are turned towards the camera; triangles of solids face outwards as given.
    pub(super) fn add(&mut self, centre: DVec3, radius: f64, corners: Vec<DVec3>, triangles: &[[usize; 3]]) {
        let start = self.mesh.positions.len();
        let is_open = triangles.len() <= 2;
        for t in triangles {
            let is_turned = is_open && !self.is_seen_from_front(t.map(|v| corners[v]));
            let t = if is_turned { [t[0], t[2], t[1]] } else { *t };
            self.mesh.triangles.push(t.map(|v| v + start));
            let radiance = self.dice.colour();
            self.mesh.radiance.push(radiance);
        }
        self.mesh.positions.extend(corners);
        self.motion.positions.resize(self.mesh.positions.len(), DVec3::ZERO);
        self.bodies.push(Body { vertices: start..self.mesh.positions.len(), centre, radius });
    }

    /// Adds a triangle or, for four corners, two, of one radiance or of two.
    pub(super) fn flat(&mut self, centre: DVec3, normal: DVec3, radius: f64, ring: &[DVec2]) {
        let corners = in_plane(centre, normal, ring);
        let triangles: Vec<_> = (2..corners.len()).map(|k| [0, k - 1, k]).collect();
        self.add(centre, radius, corners, &triangles);
        if triangles.len() == 2 && self.dice.chance(0.5) {
            let last = self.mesh.radiance.len() - 1;
            self.mesh.radiance[last] = self.mesh.radiance[last - 1];
        }
    }

    /// Adds a closed convex solid.
    pub(super) fn solid(&mut self, centre: DVec3, radius: f64) {
        let solid = Solid::random(&mut self.dice);
        let largest = solid.corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let corners = solid.corners.iter().map(|c| centre + *c * (radius / largest)).collect();
        self.add(centre, radius, corners, &solid.triangles);
    }

    /// Moves a body.
    pub(super) fn carry(&mut self, body: usize, affine: &Affine) {
        let vertices = self.bodies[body].vertices.clone();
        affine.carry(&self.mesh.positions[vertices.clone()], &mut self.motion.positions[vertices]);
    }
}

/// Points of the plane through `centre` normal to `normal`, counterclockwise around it.
pub(super) fn in_plane(centre: DVec3, normal: DVec3, ring: &[DVec2]) -> Vec<DVec3> {
    let (x, y) = normal.any_orthonormal_pair();
    ring.iter().map(|p| centre + p.x * x + p.y * y).collect()
}
