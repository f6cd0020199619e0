//! Softened fields before lights of all kinds, beside edge sampling and differences.

use super::*;
use crate::gradient::Field;
use crate::scene::Light;

/// A ground and a plate before it that the camera sees, under a block that emits, which hides a second one and the sun from parts of
/// the ground.
fn scene() -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 0.3, 3.0), DVec3::ZERO, DVec3::Y, 0.4);
    let mut d = Description::new(camera, film(3, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let paper = d.add_material(Material::diffuse("paper", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("ground", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 1.5)), paper);
    let turned = DAffine3::from_rotation_y(0.5) * DAffine3::from_rotation_x(-0.3);
    d.add_shape("plate", Mesh::rectangle().transformed(&(at(0.25, 0.1, 0.5, 0.25) * turned)), paper);
    let block = |x: f64, y: f64, z: f64| Mesh::cube().transformed(&(at(x, y, z, 0.2) * turned));
    d.add_emitter("block", block(0.6, 0.5, 1.2), DVec3::splat(8.0));
    d.add_emitter("behind", block(1.0, 0.8, 1.9), DVec3::splat(20.0));
    let lamp = Mesh::rectangle().transformed(&(at(-0.9, 0.4, 1.5, 0.3) * DAffine3::from_rotation_y(2.4)));
    d.add_emitter("lamp", lamp, DVec3::splat(6.0));
    let direction = DVec3::new(-0.4, -0.5, -1.0).normalize();
    d.lights.push(Light::Directional { id: "sun".into(), direction, irradiance: DVec3::ONE, kappa: 40.0 });
    d
}

#[test]
fn softened_fields_follow_shadows_and_outlines_of_all_lights() {
    let scene = Scene::new(scene()).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.5, 0.2, -0.3));
    for shape in 2..5 {
        change.translate(&scene, shape, DVec3::new(-0.5, -0.3, -1.0));
    }
    let none = Progress::none();
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 3) as f64)).collect()
    };
    let softened = |shadows: usize, warps: bool| {
        let field = Field::Softened { film: 1.2, lobe: 0.5, softness: 0.4, silhouettes: 64, shadows };
        total(|seed| {
            let method = WarpedArea { samples: 64, seed, field, warps, ..WarpedArea::default() };
            weighted(method.forward(&scene, &change, &none).unwrap().gradient)
        })
    };
    let edges = total(|seed| {
        let method = EdgeSampling { samples: 32, primary: 64, secondary: 256, seed, allow_missing: vec![] };
        weighted(method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let mut comparisons = Comparisons::of("softened_fields_follow_shadows_and_outlines_of_all_lights");
    comparisons.add("softened".into(), softened(256, true), edges, 0.0, edges.0);
    comparisons.add("softened, exact shadows".into(), softened(0, true), edges, 0.0, edges.0);
    comparisons.reject("interior only", softened(0, false), edges);
    comparisons.finish();
}
