//! Whether light from one point or in one direction has borders anywhere: shadows, or where its beam ends.

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::{Edges, HalfEdge};
use crate::scene::{Light, NONE, Scene, Texture};

/// Pairs of an outline and a triangle that are looked at. Beyond, there may be shadows.
const MOST: usize = 1 << 30;

/// From where light comes.
#[derive(Clone, Copy, Debug)]
enum Source {
    Point(DVec3),
    /// Along this direction.
    Parallel(DVec3),
}

/// Whether the shading of some surface by a light without extent may jump across a curve that moves with the
/// light: where an outline hides a surface behind it, or where facets of a surface with vertex normals turn
/// away from the light, one by one. Where it says no, there is none. Implicit surfaces and bumps, and more
/// triangles than can be looked at, may have some.
pub(super) fn casts_shadows(scene: &Scene, light: &Light) -> bool {
    let has_relief = scene.description.materials.iter().any(|material| material.relief.is_some());
    if !scene.implicits().is_empty() || has_relief {
        return true;
    }
    let source = match light {
        Light::Directional { direction, .. } => Source::Parallel(*direction),
        Light::Point { position, .. } | Light::Spot { position, .. } | Light::Projector { position, .. } => {
            Source::Point(*position)
        }
    };
    let edges = Edges::of(scene.triangles.iter().map(|t| t.positions));
    let outlines: Vec<&[HalfEdge]> = edges.iter().filter(|sides| is_outline(scene, source, sides)).collect();
    let is_smooth = |sides: &&[HalfEdge]| {
        sides.len() > 1 && sides.iter().any(|s| scene.triangles[s.triangle as usize].normals[0] != NONE)
    };
    if outlines.iter().any(is_smooth) || outlines.len().saturating_mul(scene.triangles.len()) > MOST {
        return true;
    }
    outlines.par_iter().any(|sides| {
        let Some(wedge) = Wedge::new(scene, source, sides[0].ends) else { return false };
        scene.triangles.iter().any(|triangle| wedge.meets(scene, triangle.positions))
    })
}

/// Whether what a light sends jumps where its beam ends: at the border of a slide that is not black there, or
/// of a cone without a margin, unless all surfaces are within.
pub(super) fn beam_ends(scene: &Scene, light: &Light) -> bool {
    let (position, to_world) = match light {
        Light::Spot { position, to_world, .. } | Light::Projector { position, to_world, .. } => {
            (*position, *to_world)
        }
        Light::Directional { .. } | Light::Point { .. } => return false,
    };
    let is_black = |texture: Option<usize>| {
        texture.is_some_and(|index| has_black_border(&scene.description.textures[index]))
    };
    // Both are convex: what has its corners within is within.
    let is_within = |x: DVec3| {
        let local = to_world.transpose() * (x - position);
        match light {
            Light::Spot { cutoff, .. } => local.z > local.length() * cutoff.cos(),
            Light::Projector { field_of_view, aspect, .. } => {
                let width = local.z * (0.5 * field_of_view).tan();
                local.x.abs() < width && local.y.abs() < width / aspect
            }
            _ => true,
        }
    };
    let jumps = match light {
        Light::Spot { cutoff, beam, .. } => beam == cutoff,
        Light::Projector { texture, .. } => !is_black(*texture),
        _ => false,
    };
    jumps && !(scene.implicits().is_empty() && scene.positions.iter().all(|x| is_within(*x)))
}

/// Whether a texture is black all around, however it goes on beyond.
fn has_black_border(texture: &Texture) -> bool {
    let Texture { width, height, ref texels, to_uv, .. } = *texture;
    let is_outer = |i: usize| {
        let (column, row) = (i % width, i / width);
        column == 0 || row == 0 || column + 1 == width || row + 1 == height
    };
    to_uv == glam::DAffine2::IDENTITY && (0..texels.len()).all(|i| !is_outer(i) || texels[i] == DVec3::ZERO)
}

/// Whether a surface ends in an edge as seen from a source, or turns its other side: also where that cannot
/// be told from rounding.
fn is_outline(scene: &Scene, source: Source, sides: &[HalfEdge]) -> bool {
    let [first, second] = sides else { return true };
    let facing = |side: &HalfEdge| {
        let [a, ..] = scene.corners(side.triangle);
        let normal = scene.face_normal(side.triangle);
        let (way, grain) = match source {
            Source::Point(p) => (p - a, scene.grain(a) + scene.grain(p)),
            Source::Parallel(direction) => (-direction, 0.0),
        };
        let cosine = normal.dot(way);
        let rounding = grain + scene.tilt(side.triangle) * way.length();
        if cosine.abs() > rounding { cosine.signum() } else { 0.0 }
    };
    // Triangles that face the same way run along their common edge in opposite senses.
    let sense = if first.ascending == second.ascending { -1.0 } else { 1.0 };
    let (a, b) = (facing(first), sense * facing(second));
    a == 0.0 || a != b
}

/// What is behind an edge: the points beyond it, in the plane of the edge and the source.
struct Wedge {
    ends: [u32; 2],
    places: [DVec3; 2],
    normal: DVec3,
    /// Along the edge, and away from the source across it, unit vectors.
    along: DVec3,
    beyond: DVec3,
    /// By how much each border leans along the edge, going beyond it.
    lean: [f64; 2],
    /// How much rounding of a coordinate may turn the plane.
    lever: f64,
}

impl Wedge {
    /// Nothing if the edge is seen end on: what is next to it has outlines of its own.
    fn new(scene: &Scene, source: Source, ends: [u32; 2]) -> Option<Self> {
        let places = ends.map(|i| scene.positions[i as usize]);
        let [a, b] = places;
        let (length, along) = (a.distance(b), (b - a).try_normalize()?);
        let grain = scene.grain(a) + scene.grain(b);
        let (away, grain) = match source {
            Source::Point(p) => (a - p, grain + scene.grain(p)),
            Source::Parallel(direction) => (direction, grain / length),
        };
        let across = away - away.dot(along) * along;
        let distance = across.length();
        if distance <= grain * (1.0 + away.length() / length) {
            return None;
        }
        let beyond = across / distance;
        let lean = match source {
            Source::Point(p) => places.map(|end| (end - p).dot(along) / distance),
            Source::Parallel(_) => [away.dot(along) / distance; 2],
        };
        let lever = 1.0 / length
            + match source {
                Source::Point(_) => 1.0 / distance,
                Source::Parallel(_) => 0.0,
            };
        Some(Self { ends, places, normal: along.cross(beyond), along, beyond, lean, lever })
    }

    /// By how much what is computed of a point may be off.
    fn rounding(&self, scene: &Scene, x: DVec3) -> f64 {
        let [a, b] = self.places;
        let grain = scene.grain(a) + scene.grain(b) + scene.grain(x);
        grain * (1.0 + self.lever * x.distance(a))
    }

    /// Whether some of a triangle is behind the edge.
    fn meets(&self, scene: &Scene, triangle: [u32; 3]) -> bool {
        let places = triangle.map(|i| scene.positions[i as usize]);
        let heights = [0, 1, 2].map(|k| {
            if self.ends.contains(&triangle[k]) {
                return 0.0;
            }
            let height = self.normal.dot(places[k] - self.places[0]);
            if height.abs() > self.rounding(scene, places[k]) { height } else { 0.0 }
        });
        if heights.iter().all(|h| *h > 0.0) || heights.iter().all(|h| *h < 0.0) {
            return false;
        }
        let mut points: Vec<DVec3> = (0..3).filter(|&k| heights[k] == 0.0).map(|k| places[k]).collect();
        for (j, k) in [(0, 1), (1, 2), (2, 0)] {
            if heights[j] * heights[k] < 0.0 {
                points.push(places[j].lerp(places[k], heights[j] / (heights[j] - heights[k])));
            }
        }
        // A triangle in the plane is behind the edge if one of its sides is: it is bounded, and what is
        // behind is not.
        (0..points.len()).any(|k| self.has(scene, points[k], points[(k + 1) % points.len()]))
    }

    /// Whether some of a line in the plane is behind the edge.
    fn has(&self, scene: &Scene, from: DVec3, to: DVec3) -> bool {
        let rounding = self.rounding(scene, from).max(self.rounding(scene, to));
        let ends = [from, to].map(|x| {
            let beyond = (x - self.places[0]).dot(self.beyond);
            let [first, last] = [0, 1].map(|k| (x - self.places[k]).dot(self.along) - self.lean[k] * beyond);
            (beyond, [first, -last])
        });
        let [(near, first), (far, last)] = ends;
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for k in 0..2 {
            let [a, b] = [first[k] + rounding, last[k] + rounding];
            if a < 0.0 && b < 0.0 {
                return false;
            }
            let crossing = a / (a - b);
            if a < 0.0 {
                low = low.max(crossing);
            } else if b < 0.0 {
                high = high.min(crossing);
            }
        }
        let at = |t: f64| near + t * (far - near);
        low <= high && at(low).max(at(high)) > rounding
    }
}
