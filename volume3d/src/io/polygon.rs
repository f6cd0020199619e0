//! Triangulation of polygons.
//!
//! A fan around the first corner is correct if all its triangles have the orientation of the polygon.
//! Otherwise ears are clipped (Meisters 1975), each with the orientation of the polygon. The triangles'
//! borders add up to the polygon's, and so do their winding numbers: triangles of one orientation cover a
//! polygon once wherever its winding number is 1, hence everywhere inside a simple polygon. This also holds
//! for polygons with holes that are joined to their outline by an edge in both directions, whose duplicated
//! corners a Delaunay triangulation would merge.
//!
//! Orientations are exact, in the coordinate plane that is closest to the polygon's own.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// Maximum number of corners of a face that is not a fan: ear clipping takes quadratic time.
const MOST: usize = 4000;

/// Distance from their plane allowed for corners written with six digits, relative to the largest coordinate.
const DIGITS: f64 = 1e-5;

/// Triangulates polygons and collects notes.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    faces: usize,
    bent: usize,
    /// The largest distance of a corner from its polygon's plane, relative to the polygon's size.
    most_bent: f64,
    crossing: usize,
    too_many: usize,
}

impl Polygons {
    /// The triangles of a polygon of at least three corners, as indices of them: two fewer than corners.
    pub(super) fn triangles(&mut self, corners: &[DVec3]) -> Vec<[usize; 3]> {
        self.faces += 1;
        let fan = || (2..corners.len()).map(|i| [0, i - 1, i]).collect();
        // Area and direction of the polygon (Newell).
        let spans: Vec<DVec3> = corners.iter().map(|p| *p - corners[0]).collect();
        let newell: DVec3 = spans.windows(2).map(|pair| pair[0].cross(pair[1])).sum();
        let Some(normal) = newell.try_normalize().filter(|_| corners.len() > 3) else { return fan() };
        self.flatness(corners, normal);
        let flat = projected(corners, newell);
        if is_fan(&flat) {
            return fan();
        }
        if corners.len() > MOST {
            self.too_many += 1;
            return fan();
        }
        match ears(&flat) {
            Some(triangles) if !crosses_itself(&flat) => triangles,
            _ => {
                self.crossing += 1;
                fan()
            }
        }
    }

    fn flatness(&mut self, corners: &[DVec3], normal: DVec3) {
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let off = corners.iter().map(|p| (*p - middle).dot(normal).abs()).fold(0.0, f64::max);
        let size = corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        let largest = corners.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        if off > DIGITS * largest {
            self.bent += 1;
            self.most_bent = self.most_bent.max(off / size);
        }
    }

    /// Notes on all polygons so far.
    pub(super) fn notes(&self) -> Vec<String> {
        let Self { faces, bent, most_bent, crossing, too_many } = *self;
        let mut notes = vec![];
        if bent > 0 {
            notes.push(format!(
                "{bent} of {faces} faces of more than three corners are not flat, by up to {:.2} % of their size: their \
                 shape is that of the triangles that they are cut into, around the first corner unless that is a dent",
                100.0 * most_bent
            ));
        }
        if crossing > 0 {
            notes.push(format!(
                "{crossing} of {faces} faces of more than three corners cross themselves: they are fans around their first corner, \
                 which cover some places twice"
            ));
        }
        if too_many > 0 {
            notes.push(format!(
                "{too_many} faces have dents and more than {MOST} corners: they are fans around their first corner, which \
                 cover some places twice; triangulate them"
            ));
        }
        notes
    }
}

/// Twice the signed area of a triangle, positive if counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
    orient2d(a, b, c)
}

/// The corners projected along the axis in which the polygon's area is largest, oriented counter-clockwise.
fn projected(corners: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let size = normal.abs();
    let (axis, positive) = if size.z >= size.x && size.z >= size.y {
        (2, normal.z > 0.0)
    } else if size.y >= size.x {
        (1, normal.y > 0.0)
    } else {
        (0, normal.x > 0.0)
    };
    let flat = |p: &DVec3| {
        let (a, b) = (p[(axis + 1) % 3], p[(axis + 2) % 3]);
        if positive { DVec2::new(a, b) } else { DVec2::new(b, a) }
    };
    corners.iter().map(flat).collect()
}

/// Whether the fan around the first corner is counter-clockwise throughout, on one side of the first edge:
/// its triangles follow one another by less than half a turn and cannot overlap.
fn is_fan(flat: &[DVec2]) -> bool {
    let left = |i: usize, j: usize| turn(flat[0], flat[i], flat[j]) >= 0.0;
    flat[0] != flat[1] && (2..flat.len()).all(|i| left(1, i) && left(i - 1, i))
}

/// The triangles of a counter-clockwise polygon, all counter-clockwise or of no area; `None` if ear clipping
/// fails.
fn ears(flat: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut ring: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    let mut start = 0;
    while ring.len() > 3 {
        let n = ring.len();
        let around = |k: usize| [ring[(k + n - 1) % n], ring[k], ring[(k + 1) % n]];
        let candidates = || (0..n).map(|i| (start + i) % n);
        let cut = candidates()
            .find(|&k| is_ear(flat, &ring, k))
            // If only corners of no area are left to clip, they are on the way back of an edge.
            .or_else(|| candidates().find(|&k| turn_of(flat, around(k)) == 0.0))?;
        triangles.push(around(cut));
        ring.remove(cut);
        start = if cut < ring.len() { cut } else { 0 };
    }
    let last = [ring[0], ring[1], ring[2]];
    triangles.push(last);
    (turn_of(flat, last) >= 0.0).then_some(triangles)
}

fn turn_of(flat: &[DVec2], [a, b, c]: [usize; 3]) -> f64 {
    turn(flat[a], flat[b], flat[c])
}

/// Whether a corner is an ear: it turns left, and the rest of the outline does not enter its triangle.
fn is_ear(flat: &[DVec2], ring: &[usize], k: usize) -> bool {
    let n = ring.len();
    let at = |k: usize| flat[ring[k % n]];
    let (a, b, c) = (at(k + n - 1), at(k), at(k + 1));
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    let within = |p: DVec2| turn(a, b, p) > 0.0 && turn(b, c, p) > 0.0;
    (2..n - 1).map(|i| (k + i) % n).all(|i| {
        let p = at(i);
        if p == b {
            // Another corner at the same position: its edges must not pass through the triangle.
            return !within(at(i + 1)) && !within(at(i + n - 1));
        }
        let outside = turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0;
        outside || p == a || p == c
    })
}

/// Whether two edges cross, each in the interior of the other.
fn crosses_itself(flat: &[DVec2]) -> bool {
    let n = flat.len();
    let edge = |i: usize| [flat[i], flat[(i + 1) % n]];
    (0..n).any(|i| {
        let [a, b] = edge(i);
        (i + 2..n).any(|j| {
            let [c, d] = edge(j);
            let apart = |s: f64, t: f64| (s > 0.0 && t < 0.0) || (s < 0.0 && t > 0.0);
            apart(turn(a, b, c), turn(a, b, d)) && apart(turn(c, d, a), turn(c, d, b))
        })
    })
}
