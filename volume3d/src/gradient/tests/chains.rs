//! Tests of light through chains: ideal mirrors, glass and masks, and lights without extent.

use super::materials::{glass, plastic};
use super::*;
use crate::scene::{Bsdf, Light, Reflectance};

/// A camera in front of the origin, a little above it.
fn before(width: usize, depth: usize, filter: Filter) -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 2.0, 4.0), DVec3::new(0.0, 0.3, 0.0), DVec3::Y, 0.7);
    let mut d = Description::new(camera, film(width, filter));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 100 };
    d
}

fn mirror() -> Bsdf {
    let (eta, k) = (DVec3::ZERO, DVec3::ONE);
    Bsdf::Conductor { eta, k, specular_reflectance: Reflectance::Constant(DVec3::splat(0.9)) }
}

/// A lamp that shines down from above the far end of a mirror; only its reflection is seen.
fn over_a_mirror(filter: Filter) -> Scene {
    let mut d = before(12, 3, filter);
    let mirror = d.add_material(Material::new("mirror", mirror(), true));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 0.9) * down())), mirror);
    let tilted = at(0.1, 1.2, -2.0, 0.4) * DAffine3::from_rotation_z(0.2) * up();
    d.add_emitter("lamp", Mesh::rectangle().transformed(&tilted), DVec3::splat(2.0));
    Scene::new(d).unwrap()
}

/// The same without a mirror: the lamp's mirror image below a hole in a black floor.
fn below_a_hole(filter: Filter) -> Scene {
    let mut d = over_a_mirror(filter).description().clone();
    let mirrored = DAffine3::from_scale(DVec3::new(1.0, -1.0, 1.0));
    let lamp = d.shapes.remove(1);
    let mesh = lamp.mesh.transformed(&mirrored);
    let (a, b) = (0.9, 9.0);
    let frame = [(-b, -a, -b, b), (a, b, -b, b), (-a, a, -b, -a), (-a, a, a, b)].map(|(x, y, z, w)| {
        let corner = |x, z| DVec3::new(x, 0.0, z);
        let corners = vec![corner(x, z), corner(y, z), corner(y, w), corner(x, w)];
        Mesh::new(corners, vec![[0, 2, 1], [0, 3, 2]]).unwrap()
    });
    d.materials[0].bsdf = Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::ZERO) };
    d.shapes.clear();
    for (k, side) in frame.into_iter().enumerate() {
        d.add_shape(&format!("side {k}"), side, 0);
    }
    d.add_emitter("image", mesh, DVec3::splat(2.0 * 0.9));
    Scene::new(d).unwrap()
}

/// Sum over pixels, weighted by the column.
fn across(image: &Image) -> Vec<DVec3> {
    let middle = 0.5 * (image.width as f64 - 1.0);
    let column = |i: usize| (i % image.width) as f64 - middle;
    image.pixels.iter().enumerate().map(|(i, g)| *g * column(i)).collect()
}

/// Sum over pixels, weighted by the row.
fn along(image: &Image) -> Vec<DVec3> {
    let middle = 0.5 * (image.height as f64 - 1.0);
    image.pixels.iter().enumerate().map(|(i, g)| *g * ((i / image.width) as f64 - middle)).collect()
}

/// A lamp and a camera before a flat mirror have the derivative of the mirrored lamp behind a hole, by edge
/// sampling. Controls: the interior term alone, and what is seen directly.
#[test]
fn a_flat_mirror_is_a_hole_before_a_mirror_image() {
    let mut comparisons = Comparisons::of("a_flat_mirror_is_a_hole_before_a_mirror_image");
    let (v, none) = (DVec3::new(0.8, 0.4, 0.4), Progress::none());
    for filter in [Filter::Box, Filter::Tent { radius: 1.0 }] {
        let (scene, twin) = (over_a_mirror(filter), below_a_hole(filter));
        let lamp = |scene: &Scene, mirrored: f64| {
            let mut change = Tangent::still(scene);
            change.translate(scene, scene.description().shapes.len() - 1, v * DVec3::new(1.0, mirrored, 1.0));
            change
        };
        let camera = |scene: &Scene| {
            let mut change = Tangent::still(scene);
            change.camera.translation = v;
            change.camera.rotation = DVec3::new(0.1, -0.2, 0.3);
            change
        };
        // A mirror that moves by v moves the image by twice its normal component.
        let mut floor = [Tangent::still(&scene), Tangent::still(&twin)];
        floor[0].translate(&scene, 0, v);
        (0..4).for_each(|side| floor[1].translate(&twin, side, v));
        floor[1].translate(&twin, 4, DVec3::Y * (2.0 * v.y));
        let cases = [
            ("lamp", 64, [lamp(&scene, 1.0), lamp(&twin, -1.0)], across as fn(&Image) -> Vec<DVec3>),
            ("camera", 192, [camera(&scene), camera(&twin)], along),
            ("mirror", 160, floor, along),
        ];
        for (name, samples, [change, other], weighted) in cases {
            // With box pixels, a bias of 15 % would take more samples.
            if name == "camera" && filter == Filter::Box {
                continue;
            }
            let field = |field: Field, warps: bool| {
                total(|seed| {
                    let method = WarpedArea { samples, field, warps, seed, ..WarpedArea::default() };
                    weighted(&method.forward(&scene, &change, &none).unwrap().gradient)
                })
            };
            let exact = total(|seed| {
                let method = EdgeSampling { samples: 512, primary: 512, seed, ..EdgeSampling::default() };
                weighted(&method.forward(&twin, &other, &none).unwrap().gradient)
            });
            let name = format!("{name}, {filter:?}");
            comparisons.add(name.clone(), field(Field::default(), true), exact, 0.0, exact.0);
            comparisons.reject(&format!("{name}: interior"), field(Field::default(), false), exact);
            let direct = total(|seed| {
                let allow_missing = vec![Missing::Mirror];
                let method =
                    EdgeSampling { samples: 24, primary: 24, seed, allow_missing, ..EdgeSampling::default() };
                weighted(&method.forward(&scene, &change, &none).unwrap().gradient)
            });
            comparisons.reject(&format!("{name}: seen directly"), direct, exact);
        }
    }
    comparisons.finish();
}

/// A scene, and what moves in it.
struct Case {
    name: &'static str,
    scene: Scene,
    /// The shape that moves; `None` for the light.
    moved: Option<usize>,
    /// Samples per pixel of the method and of finite differences, with which a bias of 15 % is seen; none if
    /// that takes minutes.
    samples: Option<(usize, usize)>,
    /// Whether it is compared only in thorough tests.
    takes_long: bool,
}

impl Case {
    fn new(name: &'static str, scene: Scene, moved: Option<usize>) -> Self {
        Self { name, scene, moved, samples: None, takes_long: false }
    }

    fn compared(self, samples: usize, of_differences: usize) -> Self {
        Self { samples: Some((samples, of_differences)), ..self }
    }

    fn thorough(self, samples: usize, of_differences: usize) -> Self {
        Self { takes_long: true, ..self.compared(samples, of_differences) }
    }
}

/// A lamp behind something that it shines through.
fn behind(material: Material, pane: Mesh, lamp: f64) -> Scene {
    let mut d = before(12, 3, Filter::Tent { radius: 1.0 });
    d.camera = Camera::look_at(DVec3::new(0.0, 0.3, 4.0), DVec3::ZERO, DVec3::Y, 0.7);
    let material = d.add_material(material);
    d.add_shape("pane", pane, material);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&at(0.1, 0.1, -1.5, lamp)), DVec3::splat(2.0));
    Scene::new(d).unwrap()
}

/// A floor that shows the shadow of a block out of view.
fn shadow(light: Light) -> Scene {
    let mut d = before(12, 2, Filter::Tent { radius: 1.0 });
    d.camera = Camera::look_at(DVec3::new(0.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y, 0.7);
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.6)));
    let block = at(0.2, 2.2, 0.3, 0.3) * DAffine3::from_rotation_y(0.4);
    d.add_shape("block", Mesh::cube().transformed(&block), grey);
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 2.0) * down())), grey);
    d.lights.push(light);
    Scene::new(d).unwrap()
}

fn bulb() -> Light {
    let (id, position) = ("light".to_owned(), DVec3::new(0.3, 3.2, 0.4));
    Light::Point { id, position, intensity: DVec3::splat(10.0) }
}

fn sun() -> Light {
    let (id, direction) = ("light".to_owned(), DVec3::new(-0.1, -1.0, -0.1).normalize());
    Light::Directional { id, direction, irradiance: DVec3::splat(2.0), kappa: f64::INFINITY }
}

/// All kinds of chain. A lamp seen in a ball, through a slab or through a lens takes many samples.
fn cases() -> Vec<Case> {
    let plain = |bsdf: Bsdf| Material::new("material", bsdf, true);
    let turned = |x: f64, z: f64| {
        let size = DAffine3::from_scale(DVec3::new(x, x, z));
        DAffine3::from_rotation_y(0.4) * DAffine3::from_rotation_x(0.3) * size
    };
    let opacity = Some(Reflectance::Constant(DVec3::splat(0.4)));
    let mask = Material { opacity, ..Material::diffuse("mask", DVec3::splat(0.5)) };
    let pane = |size| Mesh::rectangle().transformed(&turned(size, 1.0));
    let slab = Mesh::cube().transformed(&turned(0.9, 0.3));
    let lens = Mesh::sphere().smooth().transformed(&DAffine3::from_scale(DVec3::new(0.9, 0.9, 0.25)));
    let over = |mesh: Mesh, bsdf: Bsdf, lamp: DAffine3| {
        let mut d = over_a_mirror(Filter::Tent { radius: 1.0 }).description().clone();
        d.materials[0].bsdf = bsdf;
        d.shapes[0].mesh = mesh;
        d.shapes[1].mesh = Mesh::rectangle().transformed(&lamp);
        d.shapes[1].radiance = Some(DVec3::splat(6.0));
        Scene::new(d).unwrap()
    };
    let ball = Mesh::sphere().smooth().transformed(&at(0.0, -0.1, 0.0, 0.8));
    let floor = Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 0.9) * down()));
    let above = at(0.1, 1.4, 0.7, 0.4) * up();
    let ahead = at(0.1, 1.0, -1.4, 0.35) * DAffine3::from_rotation_x(1.05);
    let thin = plain(Bsdf::ThinDielectric(glass(None)));
    let glass = || plain(Bsdf::Dielectric(glass(None)));
    let lamp = Some(1);
    vec![
        Case::new("lamp in a coated floor", over(floor, plastic(None), ahead), lamp).compared(24, 768),
        Case::new("lamp behind a mask", behind(mask.clone(), pane(0.9), 0.35), lamp).compared(64, 512),
        Case::new("mask before a lamp", behind(mask, pane(0.3), 1.0), Some(0)).compared(96, 768),
        Case::new("lamp behind a pane", behind(thin, pane(0.9), 0.35), lamp).compared(48, 384),
        Case::new("lamp in a mirrored ball", over(ball, mirror(), above), lamp).thorough(64, 8192),
        Case::new("lamp behind a slab", behind(glass(), slab, 0.35), lamp).thorough(128, 768),
        Case::new("lens", behind(glass(), lens, 0.35), Some(0)),
        Case::new("bulb over a block", shadow(bulb()), None).compared(128, 96),
        Case::new("block under a bulb", shadow(bulb()), Some(0)).thorough(384, 96),
        Case::new("floor under a bulb", shadow(bulb()), Some(1)),
        Case::new("block under the sun", shadow(sun()), Some(0)).thorough(1024, 384),
        Case::new("sun over a block", shadow(sun()), None),
    ]
}

/// The derivatives of light through chains are those of finite differences. Control: the interior term alone.
#[test]
fn chains_have_the_derivative_of_differences() {
    let mut comparisons = Comparisons::of("chains_have_the_derivative_of_differences");
    let none = Progress::none();
    for Case { name, scene, moved, samples, takes_long } in cases() {
        let Some((samples, of_differences)) = samples.filter(|_| thorough() || !takes_long) else { continue };
        let mut change = Tangent::still(&scene);
        match moved {
            Some(shape) => change.translate(&scene, shape, DVec3::X),
            None => change.pose[0] = DVec3::X,
        }
        let warped = |warps: bool, samples: usize| {
            total(|seed| {
                let method = WarpedArea { samples, warps, seed, ..WarpedArea::default() };
                across(&method.forward(&scene, &change, &none).unwrap().gradient)
            })
        };
        let differences = total(|seed| {
            let method = FiniteDifference { samples: of_differences, step: 2e-2, seed };
            across(&method.forward(&scene, &change, &none).unwrap().gradient)
        });
        comparisons.add(name.to_owned(), warped(true, samples), differences, 0.0, differences.0);
        comparisons.reject(&format!("{name}: interior"), warped(false, 4), differences);
    }
    comparisons.finish();
}

/// Forward and reverse mode are transposes, with every parameter, and for both kinds of pixel.
#[test]
fn chains_have_a_transpose() {
    let none = Progress::none();
    let mut all = cases();
    all.push(Case::new("lamp in a mirror, box", over_a_mirror(Filter::Box), Some(0)));
    for Case { name, scene, moved, .. } in all {
        let (mut change, mut active) = (random_tangent(&scene, 7), ActiveParameters::everything(&scene));
        if moved.is_none() {
            change.pose[0] = DVec3::new(0.3, -0.1, 0.2);
        } else {
            active.poses.fill(false);
        }
        let (adjoint, method) =
            (random_adjoint(scene.size()), WarpedArea { samples: 2, ..WarpedArea::default() });
        let image = method.forward(&scene, &change, &none).unwrap().gradient;
        let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
        let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
        assert!((forward - reverse).abs() < 1e-8 * forward.abs(), "{name}: {forward} {reverse}");
    }
}

/// The terms add up to the whole.
#[test]
fn terms_of_chains_add_up() {
    for Case { name, scene, moved, .. } in cases() {
        let mut change = random_tangent(&scene, 3);
        if moved.is_none() {
            change.pose[0] = DVec3::new(0.3, -0.1, 0.2);
        }
        let method = WarpedArea { samples: 2, ..WarpedArea::default() };
        let [whole, split] = [
            method.forward(&scene, &change, &Progress::none()).unwrap(),
            method.forward_terms(&scene, &change, &Progress::none()).unwrap(),
        ];
        let scale = whole.gradient.pixels.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        for (a, b) in whole.gradient.pixels.iter().zip(&split.gradient.pixels) {
            assert!((*a - *b).abs().max_element() < 1e-9 * scale, "{name}: {a} {b}");
        }
    }
}
