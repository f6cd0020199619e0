//! Origin of a scene's internal coordinates.
//!
//! Map coordinates are large and their differences small: sums and products lose the significant digits. The
//! origin is therefore moved to the surfaces and subtracted from all positions. The public interface uses the
//! coordinates of the description, which is kept unchanged.
//!
//! Along each axis, let s be the size of the bounding box of all surfaces, m its centre, and q ≥ s a power of
//! two. If |m| > 64 q, the origin moves by c, the multiple of q nearest to m. Every point p of a triangle has
//! |p − m| ≤ s/2, and |c − m| ≤ q/2, so that p and c are within a factor of 65/63 of one another and p − c is
//! exact (Sterbenz 1974, theorem 4.3.1). Other positions are rounded to 2⁻⁵³ of their distance from the
//! surfaces, as the first ray from there would round them.

use flatland::sdf::Sdf as _;
use glam::DVec3;

use super::{Camera, Description, ImplicitShape, Light};

/// Distance from the origin, in scene sizes, up to which a scene is not moved: at most six of 53 bits are
/// lost.
const NEAR: f64 = 64.0;

/// Camera, implicit surfaces and lights in internal coordinates.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    /// Origin of the internal coordinates, in the coordinates of the description.
    pub(super) offset: DVec3,
    pub(super) camera: Camera,
    pub(super) implicits: Vec<ImplicitShape>,
    pub(super) lights: Vec<Light>,
}

impl Placed {
    pub(super) fn new(description: &Description) -> Self {
        let offset = offset(description);
        let camera = description.camera.moved(-offset);
        let implicits = description.implicits.iter().map(|shape| shape.moved(-offset)).collect();
        let lights = description.lights.iter().map(|light| light.moved(-offset)).collect();
        Self { offset, camera, implicits, lights }
    }
}

/// Origin of the internal coordinates of a description.
pub(super) fn offset(description: &Description) -> DVec3 {
    let corners = description.shapes.iter().flat_map(|shape| {
        let (triangles, positions) = (shape.mesh.triangles(), shape.mesh.positions());
        triangles.iter().flatten().map(|&corner| positions[corner as usize])
    });
    let boxes = description.implicits.iter().flat_map(|shape| {
        let place = shape.placement.translation;
        let (low, high) = shape.bounds().unwrap_or((place, place));
        [low, high]
    });
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in corners.chain(boxes) {
        (low, high) = (low.min(p), high.max(p));
    }
    let size = (high - low).max_element();
    if !(size.is_finite() && size > 0.0) {
        return DVec3::ZERO;
    }
    let step = size.log2().ceil().exp2();
    (0.5 * low + 0.5 * high).map(|middle| {
        let steps = middle / step;
        match steps.abs() {
            near if near <= NEAR => 0.0,
            // All numbers of that size are multiples.
            far if far >= f64::EPSILON.recip() => middle,
            _ => steps.round() * step,
        }
    })
}

#[cfg(test)]
mod tests {
    use flatland::random::{Stream, open01, stream};

    use super::*;
    use crate::geometry::Mesh;
    use crate::scene::{Film, Filter, Material};

    fn random(rng: &mut Stream) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
    }

    fn of(positions: Vec<DVec3>) -> Description {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.7);
        let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
        let mut d = Description::new(camera, film);
        let white = d.add_material(Material::diffuse("white", DVec3::ONE));
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        d.add_shape("soup", Mesh::new(positions, triangles).unwrap(), white);
        d
    }

    /// The exact rounding error of p − c (Knuth's two-sum).
    fn error(p: f64, c: f64) -> f64 {
        let difference = p - c;
        let back = difference - p;
        (p - (difference - back)) - (c + back)
    }

    /// Subtracting the offset is exact for all sizes and distances, along each axis separately; scenes near
    /// the origin have offset 0.
    #[test]
    fn subtracting_the_offset_is_exact() {
        let mut rng = stream(71, &[]);
        for trial in 0..2000 {
            let size = (40.0 * (open01(&mut rng) - 0.5)).exp2();
            let place = random(&mut rng).map(|x| x * size * (45.0 * (x * 7.0).fract().abs()).exp2());
            let positions: Vec<DVec3> = (0..6).map(|_| place + size * random(&mut rng)).collect();
            let offset = offset(&of(positions.clone()));
            let largest = positions.iter().fold(DVec3::ZERO, |most, p| most.max(p.abs()));
            for axis in 0..3 {
                assert!(
                    offset[axis] != 0.0 || largest[axis] < 2.0 * 2.0 * (NEAR + 2.0) * size,
                    "{trial} {axis}"
                );
                assert!(positions.iter().all(|p| error(p[axis], offset[axis]) == 0.0), "{trial} {axis}");
                assert!(
                    offset[axis] == 0.0
                        || positions.iter().all(|p| (p[axis] - offset[axis]).abs() <= 8.0 * size)
                );
            }
        }
        let near: Vec<DVec3> = (0..6).map(|_| 10.0 + random(&mut rng)).collect();
        assert_eq!(offset(&of(near)), DVec3::ZERO);
        assert_eq!(offset(&of(vec![DVec3::splat(1e9); 3])), DVec3::ZERO);
    }
}
