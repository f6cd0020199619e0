//! Tests of images of scenes with media against closed forms and quadrature; their derivatives are refused.

use std::f64::consts::PI;

use glam::DAffine2;
use rayon::prelude::*;

use super::comparisons::RUNS;
use super::*;
use crate::scene::{
    Boundary, Bsdf, Dielectric, Light, Medium, Microfacets, Reflectance, Roughness, Texture, Wrap,
};

/// Samples per pixel of one of the images behind a mean.
const SAMPLES: usize = 256;

fn medium(extinction: DVec3, albedo: DVec3, asymmetry: f64) -> Medium {
    Medium { id: "fog".to_owned(), extinction, albedo, asymmetry }
}

/// A material that transmits all light.
fn clear() -> Material {
    let black = Bsdf::Diffuse { reflectance: Reflectance::Constant(DVec3::ZERO) };
    let opacity = Some(Reflectance::Constant(DVec3::ZERO));
    Material { opacity, ..Material::new("clear", black, false) }
}

fn glass(eta: f64) -> Material {
    let (specular_reflectance, specular_transmittance) = (DVec3::ONE, Reflectance::Constant(DVec3::ONE));
    let glass = Dielectric { eta, facets: None, specular_reflectance, specular_transmittance };
    Material::new("glass", Bsdf::Dielectric(glass), false)
}

/// A cube from −1 to 1 filled with a medium, seen from z = 5, by default with a field of view of a millionth
/// of a radian.
fn cube(material: Material, medium: Medium) -> Description {
    let camera = Camera::look_at(DVec3::new(0.1, 0.2, 5.0), DVec3::new(0.1, 0.2, 0.0), DVec3::Y, 1e-6);
    let mut d = Description::new(camera, film(1, Filter::Box));
    let material = d.add_material(material);
    d.media.push(medium);
    d.add_shape("cube", Mesh::cube(), material);
    d.shapes[0].boundary = Some(Boundary { interior: Some(0), exterior: None });
    d
}

fn sky(d: &mut Description, radiance: DVec3) {
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
}

/// The mean of a scene's pixels over runs and its standard error, by channel.
fn means(d: Description, samples: usize) -> [(f64, f64); 3] {
    let scene = Scene::new(d).unwrap();
    let mean = |seed| {
        let image = render(&scene, samples, seed, &Progress::none()).unwrap().image;
        image.pixels.iter().sum::<DVec3>() / image.pixels.len() as f64
    };
    let runs: Vec<DVec3> = (0..RUNS).into_par_iter().map(mean).collect();
    [0, 1, 2].map(|channel| statistics(&runs.iter().map(|run| run[channel]).collect::<Vec<_>>()))
}

fn pixel(d: Description) -> DVec3 {
    render(&Scene::new(d).unwrap(), 4, 0, &Progress::none()).unwrap().image.pixels[0]
}

fn assert_near(found: DVec3, expected: DVec3) {
    assert!((found - expected).abs().max_element() < 1e-9, "{found} for {expected}");
}

/// Pure absorption multiplies radiance by the transmittance, without noise: through a slab, to a camera
/// within a medium, and from a lamp in it.
#[test]
fn absorption_is_exponential() {
    let sigma = DVec3::new(0.5, 1.0, 3.0);
    let through = |length: f64| (-sigma * length).exp();
    let radiance = DVec3::new(0.3, 0.6, 0.9);
    let mut slab = cube(clear(), medium(sigma, DVec3::ZERO, 0.0));
    sky(&mut slab, radiance);
    assert_near(pixel(slab.clone()), radiance * through(2.0));
    // The same behind glass of refractive index 1, and through a second medium within the first.
    let mut matched = slab.clone();
    matched.materials[0] = glass(1.0);
    assert_near(pixel(matched), radiance * through(2.0));
    let mut nested = slab.clone();
    nested.media.push(Medium { id: "core".to_owned(), ..medium(2.0 * sigma, DVec3::ZERO, 0.0) });
    nested.add_shape("core", Mesh::cube().transformed(&at(0.0, 0.0, 0.1, 0.5)), 0);
    nested.shapes[1].boundary = Some(Boundary { interior: Some(1), exterior: Some(0) });
    assert_near(pixel(nested.clone()), radiance * through(1.0) * through(2.0));
    // A surface inside a medium that is not a boundary changes nothing.
    nested.shapes[1].boundary = None;
    assert_near(pixel(nested), radiance * through(2.0));
    // Camera within the medium, and a lamp in it.
    let mut within = slab;
    (within.camera_medium, within.camera.origin.z) = (Some(0), 0.5);
    assert_near(pixel(within.clone()), radiance * through(1.5));
    within.add_emitter("lamp", Mesh::rectangle().transformed(&at(0.0, 0.0, -0.25, 0.5)), DVec3::ONE);
    assert_near(pixel(within.clone()), through(0.75));
    within.hide_emitters = true;
    assert_near(pixel(within), DVec3::ZERO);
}

/// White furnace test: a medium that absorbs nothing is invisible against a uniform sky, however it scatters.
/// Boundaries are clear, index-matched, or glass; the sky is a constant or a map, which next-event estimation
/// samples.
#[test]
fn a_medium_that_absorbs_nothing_is_not_seen_in_a_furnace() {
    let mut comparisons = Comparisons::of("a_medium_that_absorbs_nothing_is_not_seen_in_a_furnace");
    let radiance = DVec3::new(0.5, 1.0, 2.0);
    let furnace = |material: Material, albedo: f64, asymmetry: f64, is_map: bool| {
        let fog = medium(DVec3::new(0.5, 1.0, 2.0), DVec3::splat(albedo), asymmetry);
        let mut d = cube(material, fog);
        d.camera.field_of_view = 0.3;
        sky(&mut d, radiance);
        if is_map {
            let (id, to_uv, wrap) = ("sky".to_owned(), DAffine2::IDENTITY, Wrap::Repeat);
            let texture = Texture { id, width: 2, height: 2, texels: vec![radiance; 4], wrap, to_uv };
            let (texture, to_world) = (d.add_texture(texture), glam::DMat3::IDENTITY);
            d.environment = Some(Environment::Map { id: "sky".to_owned(), texture, scale: 1.0, to_world });
        }
        means(d, SAMPLES)
    };
    let names = ["clear, isotropic", "clear, forward", "clear, backward", "matched", "glass", "clear, a map"];
    let cases = [
        furnace(clear(), 1.0, 0.0, false),
        furnace(clear(), 1.0, 0.8, false),
        furnace(clear(), 1.0, -0.5, false),
        furnace(glass(1.0), 1.0, 0.4, false),
        furnace(glass(1.5), 1.0, 0.4, false),
        furnace(clear(), 1.0, 0.6, true),
    ];
    for (name, found) in names.into_iter().zip(cases) {
        for (channel, found) in found.into_iter().enumerate() {
            let expected = radiance[channel];
            comparisons.add(format!("{name}, {channel}"), found, (expected, 0.0), 1e-9, expected);
        }
    }
    let absorbing = furnace(clear(), 0.95, 0.0, false);
    comparisons.reject("an albedo of 0.95", absorbing[1], (radiance.y, 0.0));
    comparisons.finish();
}

/// Distance from a point in the cube from −1 to 1 to the cube's border, in a direction.
fn way_out(x: DVec3, towards: DVec3) -> f64 {
    let far = (towards.signum() - x) / towards;
    far.min_element()
}

/// Single scattering ∫ σα p(cos θ) e^{−σ(t + s)} E dt along the view axis through the cube, by the midpoint
/// rule. Here s is the length inside the cube of the segment towards the light at y, and E the irradiance
/// without a medium, `worth`.
fn scattered_once(fog: &Medium, y: DVec3, worth: impl Fn(DVec3) -> f64) -> DVec3 {
    let n = 2000;
    let step = 2.0 / f64::from(n);
    let at = |i: i32| {
        let t = (f64::from(i) + 0.5) * step;
        let x = DVec3::new(0.1, 0.2, 1.0 - t);
        let way = (y - x).normalize();
        let s = way_out(x, way);
        // Light travels along −way before scattering and along z after.
        let (g, cosine) = (fog.asymmetry, -way.z);
        let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
        fog.extinction * fog.albedo * (-fog.extinction * (t + s)).exp() * (phase * worth(x) * step)
    };
    (0..n).map(at).sum()
}

/// Single scattering of light from a point, from the sun and from a lamp, against quadrature.
#[test]
fn light_scattered_once_is_its_integral() {
    let mut comparisons = Comparisons::of("light_scattered_once_is_its_integral");
    let fog = medium(DVec3::new(0.3, 1.0, 3.0), DVec3::new(0.9, 0.5, 0.8), 0.6);
    let once = |light: &dyn Fn(&mut Description)| {
        let mut d = cube(clear(), fog.clone());
        d.integrator.max_depth = Some(2);
        light(&mut d);
        means(d, SAMPLES)
    };
    let mut compare = |name: &str, found: [(f64, f64); 3], expected: DVec3| {
        for (channel, found) in found.into_iter().enumerate() {
            let exact = expected[channel];
            comparisons.add(format!("{name}, {channel}"), found, (exact, 0.0), 1e-5 * exact, exact);
        }
    };
    let position = DVec3::new(-0.3, 3.0, -2.0);
    let found = once(&|d| {
        d.lights.push(Light::Point { id: "bulb".to_owned(), position, intensity: DVec3::splat(40.0) });
    });
    compare("a point", found, scattered_once(&fog, position, |x| 40.0 / position.distance_squared(x)));

    let direction = DVec3::new(0.2, -0.6, 0.9).normalize();
    let found = once(&|d| {
        let (id, irradiance, kappa) = ("sun".to_owned(), DVec3::splat(3.0), f64::INFINITY);
        d.lights.push(Light::Directional { id, direction, irradiance, kappa });
    });
    compare("the sun", found, scattered_once(&fog, -1e9 * direction, |_| 3.0));

    // A lamp of 1.2 by 1.2 above the cube, facing down.
    let found = once(&|d| {
        d.add_emitter(
            "lamp",
            Mesh::rectangle().transformed(&(at(0.3, 1.5, -0.4, 0.6) * up())),
            DVec3::splat(5.0),
        );
    });
    let n = 24;
    let place = |i: i32| 1.2 * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
    let area = (1.2 / f64::from(n)).powi(2);
    let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let lamp = cells.map(|(i, j)| {
        let y = DVec3::new(0.3 + place(i), 1.5, -0.4 + place(j));
        scattered_once(&fog, y, |x| {
            let way = y - x;
            5.0 * area * way.normalize().y / way.length_squared()
        })
    });
    compare("a lamp", found, lamp.sum());
    comparisons.finish();
}

/// A room of fog gives the same image as one medium or as two equal ones, one within the other, and in any
/// unit of length.
#[test]
fn a_medium_is_the_sum_of_its_parts() {
    let mut comparisons = Comparisons::of("a_medium_is_the_sum_of_its_parts");
    let room = |unit: f64, is_split: bool, core: f64| {
        let fog = |part: f64| medium(part * DVec3::new(0.5, 1.0, 2.0) / unit, DVec3::new(0.9, 0.8, 0.6), 0.4);
        let mut d = cube(clear(), fog(1.0));
        d.camera = Camera::look_at(unit * DVec3::new(1.0, 1.5, 4.0), DVec3::ZERO, DVec3::Y, 0.8);
        let white = d.add_material(Material::diffuse("white", DVec3::new(0.7, 0.6, 0.5)));
        d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, -1.2, 0.0, 3.0) * down())), white);
        d.add_emitter(
            "lamp",
            Mesh::rectangle().transformed(&(at(0.5, 2.0, 0.0, 0.5) * up())),
            DVec3::splat(5.0),
        );
        if is_split {
            d.media.push(Medium { id: "core".to_owned(), ..fog(core) });
            d.add_shape("core", Mesh::cube().transformed(&at(0.1, 0.1, 0.0, 0.8)), 0);
            let last = d.shapes.len() - 1;
            d.shapes[last].boundary = Some(Boundary { interior: Some(1), exterior: Some(0) });
        }
        for shape in &mut d.shapes {
            shape.mesh = shape.mesh.clone().transformed(&DAffine3::from_scale(DVec3::splat(unit)));
        }
        means(d, 16 * SAMPLES)
    };
    let whole = room(1.0, false, 1.0);
    for (channel, found) in room(1.0, true, 1.0).into_iter().enumerate() {
        comparisons.add(format!("two parts, {channel}"), found, whole[channel], 0.0, whole[channel].0);
    }
    comparisons.reject("a core three times as dense", room(1.0, true, 3.0)[2], whole[2]);
    for (large, small) in room(8.0, false, 1.0).into_iter().zip(whole) {
        assert!((large.0 - small.0).abs() < 1e-9 * small.0, "{large:?} {small:?}");
    }
    comparisons.finish();
}

/// A medium of zero extinction is empty space: in a room of glass, metal, lamps, directional light and sky,
/// the volumetric path tracer agrees with the surface path tracer.
#[test]
fn a_medium_that_loses_nothing_is_empty_space() {
    let mut comparisons = Comparisons::of("a_medium_that_loses_nothing_is_empty_space");
    let furnished = |media: bool| {
        let mut d = room(Filter::Tent { radius: 1.0 }).description().clone();
        d.integrator.max_depth = Some(6);
        let alpha = Some(Roughness::new(Microfacets::Ggx, 0.3));
        for (x, facets) in [(-0.5, None), (0.6, alpha)] {
            let Bsdf::Dielectric(smooth) = glass(1.4).bsdf else { unreachable!() };
            let id = format!("glass at {x}");
            let glass = Material::new(&id, Bsdf::Dielectric(Dielectric { facets, ..smooth }), false);
            let glass = d.add_material(glass);
            d.add_shape(&id, Mesh::cube().transformed(&at(x, 0.1, 0.4, 0.25)), glass);
        }
        for (kappa, direction) in [(f64::INFINITY, DVec3::NEG_Y), (200.0, DVec3::new(0.6, -0.8, 0.0))] {
            let (id, irradiance) = (format!("sun {kappa}"), DVec3::splat(0.5));
            d.lights.push(Light::Directional { id, direction, irradiance, kappa });
        }
        if media {
            d.media.push(medium(DVec3::ZERO, DVec3::ONE, 0.5));
            d.camera_medium = Some(0);
            for shape in &mut d.shapes {
                shape.boundary = Some(Boundary { interior: Some(0), exterior: Some(0) });
            }
        }
        d
    };
    let (without, with) = (means(furnished(false), SAMPLES), means(furnished(true), SAMPLES));
    for channel in 0..3 {
        let expected = without[channel];
        comparisons.add(format!("channel {channel}"), with[channel], expected, 0.0, expected.0);
    }
    comparisons.finish();
}

/// Every method except finite differences refuses a scene with a medium, whatever changes; finite differences
/// give the derivative of the transmittance.
#[test]
fn media_have_no_derivatives_but_differences() {
    let sigma = DVec3::new(0.5, 1.0, 3.0);
    let mut d = cube(clear(), medium(sigma, DVec3::ZERO, 0.0));
    sky(&mut d, DVec3::ONE);
    let scene = Scene::new(d).unwrap();
    let (none, mut change) = (Progress::none(), Tangent::still(&scene));
    change.scale(&scene, 0, DVec3::ZERO, 1.0);
    let found = FiniteDifference { samples: 4, step: 1e-4, seed: 0 }.forward(&scene, &change, &none).unwrap();
    let expected = -2.0 * sigma * (-2.0 * sigma).exp();
    let off = (found.gradient.pixels[0] - expected).abs().max_element();
    assert!(off < 1e-6, "{} for {expected}", found.gradient.pixels[0]);

    let mut colour = Tangent::still(&scene);
    colour.environment = DVec3::ONE;
    let mut active = ActiveParameters::nothing(&scene);
    active.materials[0] = true;
    let adjoint = Image::constant(1, 1, DVec3::ONE);
    let everything = [Missing::Mirror, Missing::Transmission, Missing::PointLight];
    let edges = EdgeSampling { allow_missing: everything.to_vec(), ..EdgeSampling::default() };
    let (warped, rotation) = (WarpedArea::default(), Rotation::default());
    let interior = WarpedArea { warps: false, ..warped.clone() };
    let refused = GradientError::Unsupported(Unsupported::Medium { medium: "fog".to_owned() });
    for change in [&change, &colour] {
        for error in [
            warped.forward(&scene, change, &none).err(),
            interior.forward(&scene, change, &none).err(),
            edges.forward(&scene, change, &none).err(),
            rotation.forward(&scene, change, &none).err(),
        ] {
            assert_eq!(error.as_ref(), Some(&refused));
        }
    }
    for error in [
        warped.reverse(&scene, &adjoint, &active, &none).err(),
        edges.reverse(&scene, &adjoint, &active, &none).err(),
        rotation.reverse(&scene, &adjoint, &active, &none).err(),
    ] {
        assert_eq!(error.as_ref(), Some(&refused));
    }
    assert!(refused.to_string().starts_with("the scene contains medium `fog`"), "{refused}");
}
