//! The segment of intersection of two triangles (Möller 1997).

use anyhow::Result;
use glam::DVec3;

use super::plane::{Corner, Planes};

/// Crossings shorter than this, relative to the triangles' parts of the line, are touching corners.
const NO_LENGTH: f64 = 1e-11;

/// The segment in which two triangles pass through one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The numbers of the two in the mesh.
    pub triangles: [usize; 2],
    /// The ends of the common segment at θ = 0.
    pub ends: [DVec3; 2],
}

impl Crossing {
    pub(super) fn of(planes: &Planes, triangles: [usize; 2]) -> Result<Option<Self>> {
        let [first, second] = triangles;
        if planes.plane_of(first) == planes.plane_of(second) || apart(planes, triangles) {
            return Ok(None);
        }
        let (Some(first), Some(second)) = (chord(planes, first, second)?, chord(planes, second, first)?)
        else {
            return Ok(None);
        };
        // Both lie on the line of intersection of the two planes, so either gives its direction.
        let direction = first[1] - first[0];
        let sorted = |[p, q]: [DVec3; 2]| if direction.dot(q - p) < 0.0 { [q, p] } else { [p, q] };
        let (first, second) = (sorted(first), sorted(second));
        let later = |p: DVec3, q: DVec3| if direction.dot(q - p) > 0.0 { q } else { p };
        let earlier = |p: DVec3, q: DVec3| if direction.dot(q - p) > 0.0 { p } else { q };
        let ends = [later(first[0], second[0]), earlier(first[1], second[1])];
        let length = direction.dot(ends[1] - ends[0]) / direction.length();
        let size = first[0].distance(first[1]).max(second[0].distance(second[1]));
        Ok((length > NO_LENGTH * size).then_some(Self { triangles, ends }))
    }
}

/// Whether the bounding boxes of two triangles are disjoint.
fn apart(planes: &Planes, triangles: [usize; 2]) -> bool {
    let [a, b] = triangles.map(|t| {
        let corners = planes.corners(t).map(|v| planes.place(Corner::Vertex(v)).value());
        [corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2])]
    });
    a[0].cmpgt(b[1]).any() || b[0].cmpgt(a[1]).any()
}

/// The part of a triangle in the plane of another, if the plane divides it.
fn chord(planes: &Planes, triangle: usize, other: usize) -> Result<Option<[DVec3; 2]>> {
    let (corners, plane) = (planes.corners(triangle), planes.plane_of(other));
    let mut sides = [0.0; 3];
    for (side, v) in sides.iter_mut().zip(corners) {
        *side = planes.side(triangle, Corner::Vertex(v), plane)?;
    }
    let mut points = vec![];
    for k in 0..3 {
        let (u, v) = (corners[k], corners[(k + 1) % 3]);
        let product = sides[k] * sides[(k + 1) % 3];
        if sides[k] == 0.0 {
            points.push(Corner::Vertex(u));
        } else if product < 0.0 {
            points.push(Corner::Edge([u.min(v), u.max(v)], plane));
        }
    }
    let divides = sides.iter().any(|s| *s > 0.0) && sides.iter().any(|s| *s < 0.0);
    Ok(match points[..] {
        [p, q] if divides => Some([p, q].map(|c| planes.place(c).value())),
        _ => None,
    })
}
