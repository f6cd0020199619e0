//! Emitters near edges, and contacts.
//!
//! The solid angle of an emitter varies along an edge on the scale of the distance between them. Edges are
//! cut into pieces no longer than that distance, or than a fraction of the emitter, so that it varies little
//! within a piece. A piece that lies on an emitter is a *contact*. No direction leads from it towards the
//! emitter: light comes from the edge itself and is discontinuous in every direction in which the edge is a
//! silhouette. For contacts, directions are sampled uniformly.

use std::ops::Range;

use glam::DVec3;

use crate::geometry::closest_point;
use crate::gradient::curve::drawing::{Directions, Edge, EdgeList, Targets, Wedge};
use crate::path::Paths;
use crate::scene::Scene;

/// Number of emitting shapes that edges are always compared with; more are compared as long as there are at
/// most [`MOST`] pairs of an edge and a shape.
const MANY: usize = 64;
const MOST: usize = 10_000_000;

/// Distance up to which a point counts as in an emitter's plane: this many roundings (10⁻⁹ of the scene),
/// plus the rounding of the input coordinates. Wider gaps are covered by directions towards the emitter.
const TOUCHING: f64 = 1e4;

/// Least weight of a faint light in the choice of edges.
const FAINT: f64 = 0.01;

/// Largest length of pieces near an emitter, relative to its size.
const PART: f64 = 0.25;

/// Largest length of pieces near a shape of many triangles, relative to it. For pieces nearer to its bounding
/// ball than a fraction [`NEAR`] of the radius, its light is searched in all directions; pieces farther away
/// do not touch it.
const PART_OF_BALL: f64 = 0.0625;
const NEAR: f64 = 0.1;

/// An emitting triangle, or the bounding ball of an emitting shape.
#[derive(Clone, Debug)]
struct Body {
    shape: u32,
    form: Form,
    size: f64,
}

#[derive(Clone, Debug)]
enum Form {
    Triangle { corners: [DVec3; 3], normal: DVec3 },
    Ball(DVec3),
}

impl Body {
    /// Largest length of pieces near it, relative to its size.
    fn part(&self) -> f64 {
        match self.form {
            Form::Triangle { .. } => PART,
            Form::Ball(_) => PART_OF_BALL,
        }
    }

    fn distance(&self, x: DVec3) -> f64 {
        match &self.form {
            Form::Triangle { corners, .. } => x.distance(closest_point(x, corners)),
            Form::Ball(centre) => (x.distance(*centre) - self.size).max(0.0),
        }
    }
}

/// All emitters, unless there are too many ([`contacts_are_followed`]).
#[derive(Clone, Debug, Default)]
pub(super) struct Bodies {
    bodies: Vec<Body>,
    /// Height above a triangle that counts as 0, for rounding.
    slack: f64,
}

/// A piece of an edge that lies on emitters, or very near emitters of many triangles.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    pub(super) shapes: Vec<u32>,
    pub(super) directions: Directions,
    /// Radiance of the brightest of them relative to the brightest emitter, at least [`FAINT`].
    pub(super) brightness: f64,
}

/// Whether edges on emitters are detected, which is skipped for very many emitters and edges.
pub(in crate::gradient) fn contacts_are_followed(scene: &Scene) -> bool {
    let emitting = scene.description.shapes.iter().filter(|shape| shape.radiance.is_some()).count();
    emitting <= MANY || emitting.saturating_mul(3 * scene.triangles.len()) <= MOST
}

impl Bodies {
    /// Triangles towards which directions can be sampled, or bounding balls of shapes.
    pub(super) fn new(paths: &Paths<'_>, targets: Option<&Targets>) -> Self {
        let scene = paths.scene;
        let bodies: Vec<Body> = match targets {
            Some(targets) => targets.triangles.iter().map(|&t| triangle(scene, t)).collect(),
            None => {
                let ball = |(shape, centre, size)| Body { shape, form: Form::Ball(centre), size };
                paths.lights.shapes().map(ball).collect()
            }
        };
        let few = targets.is_some() || contacts_are_followed(scene);
        let grain = scene.positions.iter().map(|p| scene.grain(*p)).fold(0.0, f64::max);
        Self { bodies: if few { bodies } else { vec![] }, slack: TOUCHING * scene.rounding() + grain }
    }

    /// Calls back with the pieces of the remaining part of an edge, with the given ends.
    pub(super) fn cut(
        &self,
        along: Range<f64>,
        ends: [DVec3; 2],
        piece: &mut impl FnMut(Range<f64>, [DVec3; 2]),
    ) {
        let (length, middle) = (ends[0].distance(ends[1]), ends[0].midpoint(ends[1]));
        let is_long = |body: &Body| {
            body.size > 0.0 && length > body.part() * body.size && length > body.distance(middle)
        };
        if self.bodies.iter().any(is_long) {
            let (half, place) = (0.5 * (along.start + along.end), middle);
            self.cut(along.start..half, [ends[0], place], piece);
            self.cut(half..along.end, [place, ends[1]], piece);
        } else {
            piece(along, ends);
        }
    }

    /// The contact of a piece of an edge, if it is one.
    pub(super) fn contact(
        &self,
        scene: &Scene,
        list: &EdgeList,
        edge: &Edge,
        ends: [DVec3; 2],
    ) -> Option<Contact> {
        let (mut shapes, mut normals) = (vec![], vec![]);
        for body in &self.bodies {
            if edge.shapes.contains(&body.shape) || !self.touches(body, ends) {
                continue;
            }
            if !shapes.contains(&body.shape) {
                shapes.push(body.shape);
            }
            normals.push(match body.form {
                Form::Triangle { normal, .. } => Some(normal),
                Form::Ball(_) => None,
            });
        }
        let first = *normals.first()?;
        let flat =
            |shape: &u32| self.bodies.iter().filter(|b| b.shape == *shape).count() == self.on(first, *shape);
        let front = first.filter(|_| normals.iter().all(|n| *n == first) && shapes.iter().all(flat));
        let directions = match (Wedge::of(scene, list, edge).filter(|_| !edge.crossed), front) {
            (Some(wedge), _) => Directions::Wedge(wedge),
            (None, Some(normal)) => Directions::Front(normal),
            (None, None) => Directions::All,
        };
        let radiance =
            |shape: u32| scene.description.shapes[shape as usize].radiance.map_or(0.0, DVec3::max_element);
        let brightest = |shapes: &mut dyn Iterator<Item = u32>| shapes.map(radiance).fold(0.0, f64::max);
        let all = brightest(&mut self.bodies.iter().map(|body| body.shape));
        let brightness = (brightest(&mut shapes.iter().copied()) / all).max(FAINT);
        Some(Contact { shapes, directions, brightness })
    }

    /// Number of a shape's triangles with this normal.
    fn on(&self, normal: Option<DVec3>, shape: u32) -> usize {
        let has = |body: &&Body| matches!(body.form, Form::Triangle { normal: n, .. } if Some(n) == normal);
        self.bodies.iter().filter(|b| b.shape == shape).filter(has).count()
    }

    fn touches(&self, body: &Body, ends: [DVec3; 2]) -> bool {
        let lies_on = match &body.form {
            Form::Triangle { corners, normal } => {
                ends.into_iter().all(|p| normal.dot(p - corners[0]).abs() <= self.slack)
            }
            Form::Ball(_) => true,
        };
        let near = match body.form {
            Form::Triangle { .. } => body.size,
            Form::Ball(_) => NEAR * body.size,
        };
        lies_on && body.distance(ends[0].midpoint(ends[1])) <= near
    }
}

fn triangle(scene: &Scene, index: u32) -> Body {
    let corners = scene.corners(index);
    let [a, b, c] = corners;
    let size = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let shape = scene.triangles[index as usize].shape;
    Body { shape, form: Form::Triangle { corners, normal: scene.face_normal(index) }, size }
}
