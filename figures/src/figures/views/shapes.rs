//! Target shapes, and the initial meshes of fits.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::DVec3;
use volume3d::geometry::Mesh;

use crate::space::target;

/// A shape to be found from its views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    /// Genus 0, from a sphere.
    Bunny,
    /// Genus 1, from a round torus.
    Ring,
}

impl Subject {
    pub(super) const ALL: [Self; 2] = [Self::Bunny, Self::Ring];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Bunny => "bunny",
            Self::Ring => "ring",
        }
    }

    /// The target, smooth, about the origin.
    pub(super) fn target(self) -> anyhow::Result<Mesh> {
        let mesh = match self {
            Self::Bunny => target::bunny()?,
            Self::Ring => target::placed(tube([120, 48], |u, v| {
                // Three waves around a ring, whose oval section makes one and a half turns on the way.
                let (away, up) = (DVec3::new(u.cos(), 0.0, u.sin()), DVec3::Y);
                let centre = (0.75 + 0.1 * (3.0 * u).cos()) * away + 0.22 * (3.0 * u).sin() * up;
                let (turn, radius) = (1.5 * u, 0.24 * (1.0 + 0.25 * (u + 1.0).cos()));
                let (p, q) = (1.3 * radius * (v - turn).cos(), 0.75 * radius * (v - turn).sin());
                let (sine, cosine) = turn.sin_cos();
                centre + (p * cosine - q * sine) * away + (p * sine + q * cosine) * up
            })?)?,
        };
        Ok(mesh.smooth())
    }

    /// The initial mesh of a fit, of the target's genus: the coarsest mesh of all.
    pub(super) fn start(self, coarse: bool) -> anyhow::Result<Mesh> {
        Ok(match self {
            Self::Bunny => sphere(0.5, if coarse { 2 } else { 3 })?.smooth(),
            Self::Ring => tube(if coarse { [20, 8] } else { [40, 16] }, |u, v| {
                let away = DVec3::new(u.cos(), 0.0, u.sin());
                (0.6 + 0.2 * v.cos()) * away + 0.2 * v.sin() * DVec3::Y
            })?
            .smooth(),
        })
    }
}

/// A closed surface of two angles u and v, facing outwards where v turns from the side away from the axis
/// upwards.
fn tube([around, across]: [usize; 2], at: impl Fn(f64, f64) -> DVec3) -> anyhow::Result<Mesh> {
    let angle = |i: usize, count: usize| TAU * i as f64 / count as f64;
    let index = |i: usize, j: usize| ((i % around) * across + j % across) as u32;
    let cells = || (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    let positions = cells().map(|(i, j)| at(angle(i, around), angle(j, across))).collect();
    let triangles = cells()
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    Ok(Mesh::new(positions, triangles)?)
}

/// An icosahedron whose faces are split in four `levels` times, on a sphere.
fn sphere(radius: f64, levels: usize) -> anyhow::Result<Mesh> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let corners: Vec<DVec3> = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)]
        .into_iter()
        .flat_map(|(a, b)| [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)])
        .collect();
    // Edges have the length 2; the next distance is 3.2.
    let adjacent = |a: usize, b: usize| corners[a].distance(corners[b]) < 2.1;
    let triples = (0..12).flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| [a, b, c])));
    let faces = triples.filter(|&[a, b, c]| adjacent(a, b) && adjacent(b, c) && adjacent(c, a));
    let outwards = |[a, b, c]: [usize; 3]| {
        let out = (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(corners[a]) > 0.0;
        if out { [a, b, c] } else { [a, c, b] }.map(|i| i as u32)
    };
    let mut mesh = Mesh::new(corners.clone(), faces.map(outwards).collect())?;
    for _ in 0..levels {
        mesh = subdivided(&mesh)?;
    }
    let on_sphere = mesh.positions().iter().map(|p| radius * p.normalize()).collect();
    Ok(mesh.with_positions(on_sphere)?)
}

/// Every triangle split in four, by the middles of its edges: the same surface.
pub(super) fn subdivided(mesh: &Mesh) -> anyhow::Result<Mesh> {
    let mut positions = mesh.positions().to_vec();
    let mut middles = HashMap::new();
    let mut triangles = Vec::with_capacity(4 * mesh.triangles().len());
    for &[a, b, c] in mesh.triangles() {
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(0.5 * (positions[a as usize] + positions[b as usize]));
                positions.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Ok(Mesh::new(positions, triangles)?.smooth())
}

#[cfg(test)]
mod tests {
    use volume3d::geometry::Edges;

    use super::*;

    /// V − E + F.
    fn euler(mesh: &Mesh) -> i64 {
        let edges = Edges::of(mesh.triangles().iter().copied());
        assert!(edges.iter().all(|sides| sides.len() == 2 && sides[0].ascending != sides[1].ascending));
        mesh.positions().len() as i64 - edges.iter().count() as i64 + mesh.triangles().len() as i64
    }

    /// The volume within, positive if triangles face outwards.
    fn volume(mesh: &Mesh) -> f64 {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.positions()[i as usize]);
            a.dot(b.cross(c)) / 6.0
        };
        mesh.triangles().iter().map(of).sum()
    }

    #[test]
    fn starts_have_the_genus_of_targets_and_face_outwards() {
        for (subject, characteristic) in [(Subject::Bunny, 2), (Subject::Ring, 0)] {
            let (start, target) = (subject.start(false).unwrap(), subject.target().unwrap());
            assert_eq!(euler(&start), characteristic);
            assert_eq!(euler(&subdivided(&start).unwrap()), characteristic);
            assert!(volume(&start) > 0.0 && volume(&target) > 0.0);
            let low = target.positions().iter().copied().reduce(DVec3::min).unwrap();
            let high = target.positions().iter().copied().reduce(DVec3::max).unwrap();
            assert!((low.distance(high) - target::DIAGONAL).abs() < 1e-12 && (low + high).length() < 1e-12);
        }
        assert_eq!(euler(&Subject::Ring.target().unwrap()), 0);
    }
}
