//! Quantities in space with closed forms.

use std::f64::consts::PI;

use glam::DVec3;

use super::coverage::Mesh;

/// e Σ aʲ for j = 0 … `bounces`: the radiance after at most `bounces` scattering events, everywhere in a
/// closed room whose walls all emit e and reflect the fraction a, whatever the shape of the room and whatever
/// objects of the same material move in it.
pub fn furnace_up_to(albedo: f64, emission: f64, bounces: i32) -> f64 {
    (0..=bounces).map(|j| emission * albedo.powi(j)).sum()
}

/// The form factor between two equal rectangles a × b that face each other at a distance c:
/// the share of the diffuse light leaving one that arrives at the other (Howell, configuration C-11).
pub fn parallel_rectangles(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (u, v) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = 0.5 * ((u * v).powi(2) / (1.0 + x * x + y * y)).ln();
    let arcs = x * v * (x / v).atan() + y * u * (y / u).atan() - x * x.atan() - y * y.atan();
    2.0 / (PI * x * y) * (logarithm + arcs)
}

/// The form factor from a rectangle w × l to a rectangle h × l that stands on its side l at a right angle
/// (Howell, configuration C-14).
pub fn perpendicular_rectangles(h: f64, w: f64, l: f64) -> f64 {
    let (h, w) = (h / l, w / l);
    let (h2, w2) = (h * h, w * w);
    let r = (h2 + w2).sqrt();
    let arcs = w * (1.0 / w).atan() + h * (1.0 / h).atan() - r * (1.0 / r).atan();
    let logarithm = ((1.0 + w2) * (1.0 + h2) / (1.0 + w2 + h2)).ln()
        + w2 * (w2 * (1.0 + w2 + h2) / ((1.0 + w2) * (w2 + h2))).ln()
        + h2 * (h2 * (1.0 + h2 + w2) / ((1.0 + h2) * (h2 + w2))).ln();
    (arcs + 0.25 * logarithm) / (PI * w)
}

/// The form factor from a point to a parallel rectangle a × b at the distance c, a corner of which
/// is straight above the point (Howell, configuration B-3).
pub fn element_to_parallel_rectangle(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (u, v) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / u * (y / u).atan() + y / v * (x / v).atan()) / (2.0 * PI)
}

/// The corners of a box from `min` to `max`: corner k has the larger coordinate on axis j where bit j
/// of k is set.
pub fn box_corners(min: DVec3, max: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|bits| {
        let pick = |axis: usize| if bits >> axis & 1 == 1 { max[axis] } else { min[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// The faces of a box by its [`box_corners`], counterclockwise from outside.
pub const BOX_FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The room of [`furnace_up_to`]: a box of 12 triangles whose normals point inwards, all of the radiance
/// `emission`, in front of a black background.
pub fn furnace_room(min: DVec3, max: DVec3, emission: f64) -> Mesh {
    // Seen from inside the order is reversed.
    let triangles: Vec<_> = BOX_FACES.iter().flat_map(|&[a, b, c, d]| [[a, c, b], [a, d, c]]).collect();
    let radiance = vec![DVec3::splat(emission); triangles.len()];
    Mesh { positions: box_corners(min, max).to_vec(), triangles, radiance, background: DVec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn form_factors_have_their_limits() {
        // Tabulated: the faces of a cube see 0.1998 of the opposite and 0.2000 of each other one.
        let (opposite, beside) =
            (parallel_rectangles(1.0, 1.0, 1.0), perpendicular_rectangles(1.0, 1.0, 1.0));
        assert!((opposite - 0.199_824_895_698).abs() < 1e-11, "{opposite}");
        assert!((opposite + 4.0 * beside - 1.0).abs() < 1e-14, "{beside}");
        // A box that is no cube, and the reciprocity relation a w F = b h F'.
        let (a, b, c) = (1.3, 0.4, 2.2);
        let sum = parallel_rectangles(a, b, c)
            + 2.0 * perpendicular_rectangles(c, b, a)
            + 2.0 * perpendicular_rectangles(c, a, b);
        assert!((sum - 1.0).abs() < 1e-14, "{sum}");
        let [there, back] = [perpendicular_rectangles(c, b, a) * b, perpendicular_rectangles(b, c, a) * c];
        assert!((there - back).abs() < 1e-15);
        // Four quarters of an infinite plane.
        assert!((4.0 * element_to_parallel_rectangle(1e9, 1e9, 1.0) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn boxes_face_out_and_rooms_in() {
        let (min, max) = (DVec3::new(-1.0, 2.0, 3.0), DVec3::new(0.5, 2.5, 7.0));
        let (corners, centre) = (box_corners(min, max), 0.5 * (min + max));
        let normal = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).dot(a - centre);
        for [a, b, c, d] in BOX_FACES.map(|face| face.map(|v| corners[v])) {
            assert!(normal(a, b, c) > 0.0 && normal(a, c, d) > 0.0 && a + c == b + d);
        }
        let room = furnace_room(min, max, 1.0);
        assert!(room.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|v| room.positions[v]);
            normal(a, b, c) < 0.0
        }));
    }

    #[test]
    fn a_furnace_is_the_sum_of_its_bounces() {
        assert!((furnace_up_to(0.5, 3.0, 60) - 6.0).abs() < 1e-14);
        assert_eq!(furnace_up_to(0.5, 3.0, 1), 4.5);
    }
}
