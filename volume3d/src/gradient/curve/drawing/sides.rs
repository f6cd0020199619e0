//! Surfaces on both sides of an edge point.

use glam::DVec3;

use crate::gradient::edges::{Edge, EdgeList, are_folded};
use crate::scene::{Hit, Scene, Surface};

/// Least angle, in radians, between an edge and the rays that pass it: several thousand times the rounding of
/// a direction.
const ASIDE: f64 = 1e-12;

/// Distance at which the rays pass the edge, in units of coordinate rounding. The edge point has an error of
/// two units, viewer and direction of one each, and the triangle test of about four.
const CLEAR: f64 = 16.0;

/// Bound, with a margin, on the angle by which rounding of coordinates rotates a direction, in radians.
pub(in crate::gradient::curve) fn clear(largest: f64, distance: f64) -> f64 {
    CLEAR * f64::EPSILON * largest / distance
}

/// Angle between an edge point, at a distance from x, and the rays from x that pass it on either side. Their
/// hits represent the limits at the edge, and differ from them only if another edge is within the angle. It
/// exceeds the rounding of the rays: 10⁻¹² up to 300 distances from the origin, then proportional to the
/// distance from the origin.
pub(in crate::gradient::curve) fn aside(ends: [DVec3; 2], x: DVec3, distance: f64) -> f64 {
    ASIDE.max(clear(largest(&[x, ends[0], ends[1]]), distance))
}

/// The largest coordinate of the points.
pub(in crate::gradient::curve) fn largest(points: &[DVec3]) -> f64 {
    points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// Distance from an edge point at which rays through it start, so that its own triangles do not block them:
/// 10⁻⁹ of the coordinates. A ray at 4·10⁻⁶ from a triangle's plane has then left the rounding of that plane.
/// For edges shorter than 1/4000 of the coordinates it is the geometric mean of rounding and length, which
/// balances missed nearby geometry against directions that graze the edge's triangles.
pub(in crate::gradient::curve) fn near(scene: &Scene, list: &EdgeList, edge: &Edge) -> f64 {
    let [a, b] = edge.span(scene);
    let corners = list.triangles(edge).map(|t| largest(&scene.corners(t)));
    let largest = corners.fold(largest(&[a, b]), f64::max);
    (START * largest).min((clear(largest, 1.0) * a.distance(b)).sqrt())
}

/// See [`near`].
const START: f64 = 1e-9;

/// Two surfaces touch if their distances from the viewer differ by less than this fraction of the distance,
/// or by less than `TOUCH_BY_ANGLE` times the angle of [`aside`]: at an angle α to the ray a surface is hit
/// within that angle over tan α of the edge.
const TOUCH: f64 = 1e-6;
const TOUCH_BY_ANGLE: f64 = 1e3;

/// Hits before and behind an edge (normal side).
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Sides {
    pub(in crate::gradient::curve) hits: [Option<Hit>; 2],
    /// 1/2 where the edges of two surfaces coincide, as between wall and floor: each finds the whole
    /// discontinuity.
    pub(in crate::gradient::curve) share: f64,
    /// The side, if there is exactly one, of another surface whose edge coincides with this one.
    pub(in crate::gradient::curve) other: Option<usize>,
}

impl Sides {
    /// Fraction of a discontinuity of emission that is assigned to an emitter's edge: all of it if the
    /// coincident edge belongs to a shape that does not emit, such as a frame, which is assigned none of it.
    pub(in crate::gradient::curve) fn share_of_emission(&self, scene: &Scene) -> f64 {
        let emits =
            |hit: Hit| scene.description.shapes[scene.shape_of(hit.surface) as usize].radiance.is_some();
        match self.other.map(|side| self.hits[side]) {
            Some(Some(hit)) if !emits(hit) => 1.0,
            _ => self.share,
        }
    }
}

/// Traces rays past an edge point at distance t on both sides; `None` if the edge is occluded.
pub(in crate::gradient::curve) fn look_past(
    scene: &Scene,
    list: &EdgeList,
    edge: &Edge,
    (origin, from): (DVec3, Option<Surface>),
    directions: [DVec3; 2],
    t: f64,
) -> Option<Sides> {
    let hits = directions.map(|d| scene.closest(origin, d, from));
    let owns = hits.map(|h| h.is_some_and(|h| list.has(edge, h.surface)));
    // Rarely needed.
    let touch = || TOUCH.max(TOUCH_BY_ANGLE * aside(edge.span(scene), origin, t)) * t;
    let touches =
        |h: Hit| (h.distance - t).abs() < touch() && is_between(scene, origin, directions, h.surface);
    let coincides = |side: usize| hits[side].is_some_and(|h| list.has_there(edge, h.surface) || touches(h));
    let (doubled, other) = match owns {
        [false, false] => return None,
        // A crossing may run along an edge of another triangle.
        [true, true] => {
            let shares = edge.is_crossing() && !edge.runs_along_an_edge(scene);
            (shares && hits.into_iter().flatten().any(touches), None)
        }
        [true, false] => (coincides(1), Some(1)),
        [false, true] => (coincides(0), Some(0)),
    };
    let between = if edge.is_crossing() { None } else { cross_between(scene, origin, directions, hits) };
    if between == Some(Between::OwnEdge) {
        return None;
    }
    let crossed = between.is_some();
    let other = other.filter(|_| doubled && !crossed && !edge.is_crossing());
    Some(Sides { hits, share: if doubled || crossed { 0.5 } else { 1.0 }, other })
}

/// A crossing in the list that is seen between two directions in which its triangles are hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Between {
    /// It runs along an edge within a plane of one of the two and covers the whole discontinuity: it may
    /// leave this edge as it moves.
    OwnEdge,
    Other,
}

fn cross_between(
    scene: &Scene,
    origin: DVec3,
    [before, behind]: [DVec3; 2],
    hits: [Option<Hit>; 2],
) -> Option<Between> {
    let [Some(a), Some(b)] = hits else { return None };
    let [Surface::Triangle(first), Surface::Triangle(second)] = [a.surface, b.surface] else { return None };
    let crossings = scene.crossings();
    [first, second].iter().flat_map(|&t| crossings.of(t)).map(|&i| crossings.get(i)).find_map(|crossing| {
        let [p, q] = crossing.places.map(|p| p - origin);
        let plane = p.cross(q);
        let [own, through] = crossing.triangles;
        let meet = |t: u32| [[t, through], [through, t]].contains(&[first, second]);
        let meets = meet(own) || crossing.continued.is_some_and(meet);
        if !meets || plane.dot(before) * plane.dot(behind) > 0.0 {
            return None;
        }
        match crossing.continued {
            None => Some(Between::Other),
            // The edge represents the crossing.
            Some(other) if are_folded(scene, own, other) => None,
            Some(_) => Some(Between::OwnEdge),
        }
    })
}

/// Whether an edge at which a triangle is discontinuous is seen between two directions: rays past it then
/// find both surfaces too. If it is farther aside, each edge has a discontinuity of its own.
fn is_between(scene: &Scene, origin: DVec3, [before, behind]: [DVec3; 2], surface: Surface) -> bool {
    let Surface::Triangle(triangle) = surface else { return false };
    let p = scene.corners(triangle).map(|p| p - origin);
    (0..3).any(|k| {
        let plane = p[k].cross(p[(k + 1) % 3]);
        scene.adjacency.jumps(triangle, k) && plane.dot(before) * plane.dot(behind) <= 0.0
    })
}

#[cfg(test)]
mod tests {
    use glam::{DAffine2, DVec2, DVec3};

    use super::*;
    use crate::geometry::{Attribute, Mesh};
    use crate::gradient::tests::film;
    use crate::scene::{Camera, Description, Filter, Material, Reflectance, Texture, Wrap};

    /// A floor of two triangles, bent along x = z = 0, where its texture may have a seam, and a wall that
    /// stands on this line.
    fn wall_in_a_fold(bend: f64, seam: bool) -> Scene {
        let camera = Camera::look_at(DVec3::new(0.5, 0.0, 2.0), DVec3::ZERO, DVec3::Y, 0.5);
        let mut d = Description::new(camera, film(2, Filter::Box));
        let texels = [0.2, 0.5, 0.7, 0.9].map(DVec3::splat).to_vec();
        let (id, wrap) = ("slide".to_owned(), Wrap::Clamp);
        d.add_texture(Texture { id, width: 2, height: 2, texels, wrap, to_uv: DAffine2::IDENTITY });
        let mut paper = Material::diffuse("paper", DVec3::ONE);
        *paper.bsdf.reflectance_mut() = Reflectance::Texture(0);
        let paper = d.add_material(paper);
        let corners = [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, -bend], [-1.0, 0.0, -bend]];
        let uvs = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.1, 0.9], [0.6, 0.3]].map(DVec2::from);
        let of_second = if seam { [4, 3, 5] } else { [1, 3, 0] };
        let floor = Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 2, 1], [1, 3, 0]])
            .and_then(|mesh| {
                let triangles = vec![[0, 2, 1], of_second];
                mesh.with_uvs(Attribute { values: uvs.to_vec(), triangles })
            })
            .unwrap();
        d.add_shape("floor", floor, paper);
        let corners =
            [[0.0, -0.5, -0.5], [0.0, 0.5, -0.5], [0.0, 0.5, 0.7], [0.0, -0.5, 0.7]].map(DVec3::from);
        let wall = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let white = d.add_material(Material::diffuse("white", DVec3::ONE));
        d.add_shape("wall", wall, white);
        Scene::new(d).unwrap()
    }

    /// Sum of the shares of all edges at a point of the line, seen from one side of the wall.
    fn counted(scene: &Scene, x: f64) -> f64 {
        let list = EdgeList::new(scene);
        let (eye, place) = (DVec3::new(x, 0.1, 1.0), DVec3::new(0.0, 0.1, 0.0));
        let way = (place - eye).normalize();
        let across = aside([place; 2], eye, eye.distance(place)) * way.cross(DVec3::Y).normalize();
        let directions = [-1.0, 1.0].map(|s| (way + s * across).normalize());
        let runs_there = |edge: &&Edge| {
            let [a, b] = edge.span(scene);
            [a, b].iter().all(|p| p.x.hypot(p.z) < 1e-12) && (a.y - place.y) * (b.y - place.y) < 0.0
        };
        let share = |edge: &Edge| {
            let sides = look_past(scene, &list, edge, (eye, None), directions, eye.distance(place));
            sides.map_or(0.0, |sides| sides.share)
        };
        let edges =
            list.edges.iter().filter(runs_there).filter(|edge| list.may_be_discontinuous(scene, edge));
        edges.map(share).sum()
    }

    /// A floor that ends where a wall stands on it: each has an edge there, and each finds the whole
    /// discontinuity.
    #[test]
    fn edges_at_one_place_are_counted_once() {
        let camera = Camera::look_at(DVec3::new(0.5, 0.0, 2.0), DVec3::ZERO, DVec3::Y, 0.5);
        let mut d = Description::new(camera, film(2, Filter::Box));
        let white = d.add_material(Material::diffuse("white", DVec3::ONE));
        for (name, far) in [("floor", [1.0, 0.0, 0.0]), ("wall", [0.0, 0.0, 0.7])] {
            let far = DVec3::from(far);
            let corners = [-0.5 * DVec3::Y, 0.5 * DVec3::Y, far + 0.5 * DVec3::Y, far - 0.5 * DVec3::Y];
            let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
            d.add_shape(name, mesh, white);
        }
        assert_eq!(counted(&Scene::new(d).unwrap(), 0.5), 1.0);
    }

    #[test]
    fn what_passes_through_a_fold_is_counted_once() {
        for bend in [0.0, 1e-13, 1e-9, 1e-6, 1e-3] {
            for seam in [false, true] {
                let scene = wall_in_a_fold(bend, seam);
                for x in [-0.5, 0.5] {
                    assert_eq!(counted(&scene, x), 1.0, "bend {bend}, seam {seam}, seen from {x}");
                }
            }
        }
    }
}
