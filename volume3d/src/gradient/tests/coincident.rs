//! Tests of borders of narrow faces that coincide with edges of other surfaces, which are not sampled
//! themselves.

use super::*;
use crate::gradient::Field;

/// A prism along y over a polygon in x and z, with the given half length.
fn prism(polygon: &[(f64, f64)], y: f64) -> Mesh {
    let n = polygon.len() as u32;
    let mut positions = vec![];
    for side in [-y, y] {
        positions.extend(polygon.iter().map(|&(x, z)| DVec3::new(x, side, z)));
    }
    let mut t = vec![];
    for i in 0..n {
        let j = (i + 1) % n;
        t.push([i, j + n, j]);
        t.push([i, i + n, j + n]);
    }
    for i in 1..n - 1 {
        t.push([0, i, i + 1]);
        t.push([n, n + i + 1, n + i]);
    }
    Mesh::new(positions, t).unwrap()
}

/// A body with a ridge at x = z = 0 (two wide faces, both visible: no silhouette), and a second body on its
/// right slope. The second body's left face begins at the same ridge and has apparent width `narrow`. The
/// first body has half length `length`, the second 0.6.
fn bodies(narrow: f64, length: f64) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 0.1, 5.0), DVec3::new(0.0, 0.1, 0.0), DVec3::Y, 0.8);
    let mut d = Description::new(camera, film(12, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(1);
    let lower = [(0.0, 0.0), (-1.0, -0.2), (-1.0, -1.5), (1.0, -1.5), (1.0, -1.0)];
    d.add_emitter("lower", prism(&lower, length), DVec3::splat(0.3));
    d.add_emitter("upper", prism(&[(0.0, 0.0), (1.0, -1.0), (1.0, 0.3), (narrow, 0.5)], 0.6), DVec3::ONE);
    Scene::new(d).unwrap()
}

#[test]
fn edges_that_coincide_with_those_of_narrow_faces_are_sampled() {
    let mut comparisons = Comparisons::of("edges_that_coincide_with_those_of_narrow_faces_are_sampled");
    // A ridge with the same ends as the border on it, and a longer one.
    for (narrow, softness, length) in [(0.001, 0.4, 0.6), (0.15, 50.0, 0.6), (0.15, 50.0, 0.8)] {
        let scene = bodies(narrow, length);
        let mut change = Tangent::still(&scene);
        (0..2).for_each(|s| change.translate(&scene, s, DVec3::X));
        let none = Progress::none();
        let rows = |image: Image| -> Vec<DVec3> {
            image.pixels.iter().enumerate().map(|(i, g)| *g * ((i / 12) as f64 / 12.0)).collect()
        };
        let softened = |silhouettes: usize| {
            let field =
                Field::Softened { film: 1.2, lobe: 0.5, softness, silhouettes, shadows: 0, bounces: 0 };
            total(|seed| {
                let method = WarpedArea { samples: 256, seed, field, ..WarpedArea::default() };
                rows(method.forward(&scene, &change, &none).unwrap().gradient)
            })
        };
        let edges = total(|seed| {
            let method = EdgeSampling {
                samples: 8,
                primary: 256,
                secondary: 1,
                bounces: 1,
                seed,
                allow_missing: vec![],
            };
            rows(method.forward(&scene, &change, &none).unwrap().gradient)
        });
        let name = format!("{narrow} wide, ε = {softness}, ridge of {length}");
        comparisons.add(name, softened(256), edges, 0.0, edges.0);
        comparisons.reject("curves left out", softened(0), edges);
    }
    comparisons.finish();
}
