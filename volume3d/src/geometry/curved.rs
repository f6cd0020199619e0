//! Meshes of spheres, disks and cylinders.
//!
//! Vertices and their normals, which are interpolated, are those of the surface. No point of a mesh is
//! farther from its surface than [`TOLERANCE`] times the radius.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::mesh::{Attribute, Mesh, Normals};

/// Largest distance between a curved surface and its mesh, relative to the radius.
///
/// Areas, and with them the light that a sphere emits, are too small by less than twice that.
pub const TOLERANCE: f64 = 1e-3;

/// Segments of a circle: 1 − cos(π/72) = 9.5·10⁻⁴.
const AROUND: u32 = 72;

/// Meridians of a sphere. With half as many segments from pole to pole, the centre of a quadrilateral is
/// 1 − cos²(π/104) = 9.1·10⁻⁴ below the sphere.
const MERIDIANS: u32 = 104;

impl Mesh {
    /// The unit sphere about the origin, facing outwards, within [`TOLERANCE`]; 10 608 triangles.
    ///
    /// Texture coordinates are (φ/2π, θ/π), with the azimuth φ from +x over +y and θ from +z.
    #[must_use]
    pub fn sphere() -> Self {
        let rings = MERIDIANS / 2;
        let point = |u: f64, v: f64| {
            let ((sin_phi, cos_phi), (sin, cos)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
            DVec3::new(sin * cos_phi, sin * sin_phi, cos)
        };
        let mut patch = Patch::default();
        for i in 0..=rings {
            for j in 0..=MERIDIANS {
                let (u, v) = (f64::from(j) / f64::from(MERIDIANS), f64::from(i) / f64::from(rings));
                // The last meridian is the first, and at a pole all coincide.
                let place = match i {
                    0 => DVec3::Z,
                    i if i == rings => DVec3::NEG_Z,
                    _ => point(f64::from(j % MERIDIANS) / f64::from(MERIDIANS), v),
                };
                // At a pole, the texture coordinate of a triangle's corner lies between those of its two
                // other corners.
                let half = 0.5 / f64::from(MERIDIANS);
                let u = match i {
                    0 => u - half,
                    i if i == rings => u + half,
                    _ => u,
                };
                patch.vertex(place, place, DVec2::new(u, v));
            }
        }
        let row = MERIDIANS + 1;
        for i in 0..rings {
            for j in 0..MERIDIANS {
                let [a, b] = [i * row + j, (i + 1) * row + j];
                if i > 0 {
                    patch.triangles.push([a, b, a + 1]);
                }
                if i + 1 < rings {
                    patch.triangles.push([a + 1, b, b + 1]);
                }
            }
        }
        patch.into_mesh()
    }

    /// The unit disk in the plane z = 0, facing +z, within [`TOLERANCE`]; 72 triangles. Texture coordinates:
    /// (r, φ/2π).
    #[must_use]
    pub fn disk() -> Self {
        let mut patch = Patch::default();
        for j in 0..AROUND {
            let (at, next) = (circle(j), circle(j + 1));
            let first = patch.positions.len() as u32;
            let turn = |j: f64| j / f64::from(AROUND);
            patch.vertex(DVec3::ZERO, DVec3::Z, DVec2::new(0.0, turn(f64::from(j) + 0.5)));
            patch.vertex(at.extend(0.0), DVec3::Z, DVec2::new(1.0, turn(f64::from(j))));
            patch.vertex(next.extend(0.0), DVec3::Z, DVec2::new(1.0, turn(f64::from(j + 1))));
            patch.triangles.push([first, first + 1, first + 2]);
        }
        patch.into_mesh()
    }

    /// The cylinder of radius 1 about the z axis from z = 0 to 1, without caps, facing outwards, within
    /// [`TOLERANCE`]; 144 triangles. Texture coordinates: (φ/2π, z).
    #[must_use]
    pub fn cylinder() -> Self {
        let mut patch = Patch::default();
        for j in 0..=AROUND {
            for z in [0.0, 1.0] {
                let normal = circle(j).extend(0.0);
                patch.vertex(normal + z * DVec3::Z, normal, DVec2::new(f64::from(j) / f64::from(AROUND), z));
            }
        }
        for j in 0..AROUND {
            let [a, b] = [2 * j, 2 * j + 2];
            patch.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
        patch.into_mesh()
    }
}

/// Point j of [`AROUND`] on the unit circle; the last is the first.
fn circle(j: u32) -> DVec2 {
    DVec2::from_angle(TAU * f64::from(j % AROUND) / f64::from(AROUND))
}

/// Vertices, each with a normal and a texture coordinate.
#[derive(Default)]
struct Patch {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    uvs: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

impl Patch {
    fn vertex(&mut self, position: DVec3, normal: DVec3, uv: DVec2) {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
    }

    fn into_mesh(self) -> Mesh {
        let Self { positions, normals, uvs, triangles } = self;
        let mesh = Mesh::new(positions, triangles.clone())
            // Positions without duplicates.
            .and_then(|mesh| Mesh::new(mesh.positions().to_vec(), mesh.triangles().to_vec()))
            .and_then(|mesh| {
                mesh.with_normals(Normals::Given(Attribute { values: normals, triangles: triangles.clone() }))
            })
            .and_then(|mesh| mesh.with_uvs(Attribute { values: uvs, triangles }));
        mesh.expect("indices are in range, and all numbers finite")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of all triangles.
    fn corners(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        mesh.triangles().iter().map(|t| t.map(|k| mesh.positions()[k as usize]))
    }

    fn area(mesh: &Mesh) -> f64 {
        corners(mesh).map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length()).sum()
    }

    /// Vertices are on the surface, and no triangle is farther from it than the tolerance: for a triangle
    /// inside a sphere, the point nearest to the centre is farthest from the surface, and no nearer than the
    /// triangle's plane.
    #[test]
    fn meshes_are_near_their_surfaces() {
        let sphere = Mesh::sphere();
        assert_eq!(sphere.triangles().len(), 10608);
        for [a, b, c] in corners(&sphere) {
            assert!([a, b, c].iter().all(|p| (p.length() - 1.0).abs() < 1e-15));
            let normal = (b - a).cross(c - a).normalize();
            assert!(normal.dot(a) > 1.0 - TOLERANCE, "{a} {b} {c}");
        }
        let cylinder = Mesh::cylinder();
        for [a, b, c] in corners(&cylinder) {
            let normal = (b - a).cross(c - a).normalize();
            assert!(normal.dot(a) > 1.0 - TOLERANCE && normal.z.abs() < 1e-12, "{a} {b} {c}");
        }
        for [a, b, c] in corners(&Mesh::disk()) {
            assert!((b - a).cross(c - a).z > 0.0);
            assert!((0.5 * (b + c)).length() > 1.0 - TOLERANCE);
        }
        for (mesh, exact) in [(sphere, 4.0 * PI), (cylinder, TAU), (Mesh::disk(), PI)] {
            let part = area(&mesh) / exact;
            assert!(part < 1.0 && part > 1.0 - 2.0 * TOLERANCE, "{part}");
        }
    }

    /// Normals are those of the surface at every vertex, and closed surfaces are closed.
    #[test]
    fn spheres_are_closed() {
        let mesh = Mesh::sphere();
        let mut edges = std::collections::HashMap::new();
        for t in mesh.triangles() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&sum| sum == 0));
        assert_eq!(mesh.sources().len(), mesh.positions().len());
        let Normals::Given(normals) = mesh.normals() else { panic!("given") };
        for (t, n) in mesh.triangles().iter().zip(&normals.triangles) {
            for k in 0..3 {
                assert_eq!(mesh.positions()[t[k] as usize], normals.values[n[k] as usize]);
            }
        }
    }
}
