//! Tests of transmissive materials, coatings, opacity masks, and bump and normal maps: appearance,
//! derivatives, refusals.

use std::f64::consts::PI;

use glam::{DAffine2, DMat3, DVec3};

use super::*;
use crate::scene::{
    Bsdf, Dielectric, Light, Microfacets, Plastic, Principled, Reflectance, Relief, Roughness, Scattering,
    Texture, Value, Wrap,
};

fn white() -> Reflectance {
    Reflectance::Constant(DVec3::ONE)
}

pub(super) fn glass(facets: Option<Roughness>) -> Dielectric {
    Dielectric { eta: 1.5, facets, specular_reflectance: DVec3::ONE, specular_transmittance: white() }
}

pub(super) fn plastic(facets: Option<Roughness>) -> Bsdf {
    Bsdf::Plastic(Plastic {
        eta: 1.5,
        facets,
        diffuse_reflectance: Reflectance::Constant(DVec3::new(0.7, 0.5, 0.3)),
        specular_reflectance: DVec3::splat(0.8),
        scattering: Scattering::Nonlinear,
    })
}

fn principled(spec_trans: f64) -> Bsdf {
    let principled = Principled {
        base_color: Reflectance::Constant(DVec3::new(0.7, 0.5, 0.3)),
        roughness: 0.5,
        anisotropic: 0.0,
        metallic: 0.2,
        eta: 1.4,
        spec_tint: 0.5,
        spec_trans,
        sheen: 0.3,
        sheen_tint: 0.5,
        flatness: 0.5,
        clearcoat: 0.5,
        clearcoat_gloss: 0.2,
    };
    Bsdf::Principled(principled.map(Value::Constant))
}

fn rough() -> Option<Roughness> {
    Some(Roughness::new(Microfacets::Ggx, 0.3))
}

/// A cube of a material in front of a sky of radiance 1.
fn cube(material: Material) -> Description {
    let camera = Camera::look_at(DVec3::new(0.3, 0.6, 4.0), DVec3::ZERO, DVec3::Y, 0.7);
    let mut d = Description::new(camera, film(6, Filter::Box));
    d.integrator.rr_depth = 1000;
    let material = d.add_material(material);
    d.add_shape("cube", Mesh::cube(), material);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
    d
}

/// White furnace test: an object that absorbs nothing is invisible against a uniform sky, however it
/// scatters.
#[test]
fn a_white_furnace_hides_what_absorbs_nothing() {
    let masked = Material {
        opacity: Some(Reflectance::Constant(DVec3::splat(0.4))),
        ..Material::new("masked", Bsdf::ThinDielectric(glass(None)), false)
    };
    let ideal = [
        Material::new("glass", Bsdf::Dielectric(glass(None)), false),
        Material::new("plate", Bsdf::ThinDielectric(glass(None)), false),
        masked,
    ];
    for material in ideal {
        let id = material.id.clone();
        let scene = Scene::new(cube(material)).unwrap();
        for pixel in render(&scene, 16, 1, &Progress::none()).unwrap().image.pixels {
            assert!((pixel - DVec3::ONE).abs().max_element() < 1e-12, "{id}: {pixel}");
        }
    }
}

/// The brightness of a lamp through a thin plate follows from Fresnel's equations; only paths that pass
/// straight through find it.
#[test]
fn a_lamp_is_seen_through_a_plate() {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 0.2);
    let mut d = Description::new(camera, film(2, Filter::Box));
    let plate = d.add_material(Material::new("plate", Bsdf::ThinDielectric(glass(None)), false));
    d.add_shape("plate", Mesh::rectangle(), plate);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&at(0.0, 0.0, -1.0, 2.0)), DVec3::splat(3.0));
    let scene = Scene::new(d).unwrap();
    let (samples, expected) = (1 << 14, 3.0 * (1.0 - 2.0 * 0.04 / 1.04));
    let image = render(&scene, samples, 1, &Progress::none()).unwrap().image;
    let mean = image.pixels.iter().map(|p| p.x).sum::<f64>() / image.pixels.len() as f64;
    // Six standard errors of the binary choice of transmission, which is also the smallest detectable bias:
    // 0.6 % of the radiance.
    let error = 6.0 * 3.0 * (0.077_f64 * 0.923 / (4 * samples) as f64).sqrt();
    assert!((mean - expected).abs() < error, "{mean} {expected} {error}");
}

/// Colours and roughnesses have derivatives along all paths, the same forward and in reverse.
#[test]
fn continuous_derivatives_are_transposes() {
    let models = [
        plastic(None),
        plastic(rough()),
        Bsdf::Dielectric(glass(None)),
        Bsdf::Dielectric(glass(rough())),
        Bsdf::ThinDielectric(glass(None)),
        principled(0.0),
        principled(0.6),
    ];
    for bsdf in models {
        let opacity = Some(Reflectance::Constant(DVec3::splat(0.9)));
        let mut d = cube(Material { opacity, ..Material::new("material", bsdf.clone(), false) });
        d.integrator.max_depth = Some(6);
        d.add_emitter(
            "lamp",
            Mesh::rectangle().transformed(&(at(0.0, 3.0, 0.0, 1.0) * up())),
            DVec3::splat(5.0),
        );
        let scene = Scene::new(d).unwrap();
        let mut change = Tangent::still(&scene);
        change.reflectance[0] = DVec3::new(0.3, -0.2, 0.5);
        change.roughness[0] = if bsdf.roughness().is_some() { 0.7 } else { 0.0 };
        change.radiance[1] = DVec3::new(0.1, 0.2, 0.3);
        let adjoint = random_adjoint((6, 6));
        let mut active = ActiveParameters::nothing(&scene);
        (active.materials[0], active.lights) = (true, true);
        let method = WarpedArea { samples: 16, ..WarpedArea::default() };
        let image = method.forward(&scene, &change, &Progress::none()).unwrap();
        let gradient = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
        let forward: f64 = image.gradient.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
        let reverse = gradient.dot(&change);
        assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{bsdf:?}: {forward} {reverse}");
        assert!(gradient.reflectance[0] != DVec3::ZERO, "{bsdf:?}");
    }
}

/// A sheet that fills the film turns in its own plane below a lamp: only the axes of its microfacets change,
/// or the parameters read from a texture. Control: isotropic facets have no such derivative.
#[test]
fn facets_and_numbers_turn_with_their_surface() {
    let brushed = |stretch: f64| Bsdf::RoughConductor {
        distribution: Microfacets::Ggx,
        alpha: 0.4,
        stretch,
        eta: DVec3::ZERO,
        k: DVec3::ONE,
        specular_reflectance: Reflectance::Constant(DVec3::splat(0.8)),
    };
    let textured = |spec_trans: f64| {
        let Bsdf::Principled(solid) = principled(spec_trans) else { panic!("a principled material") };
        let (value, anisotropic) = (Value::Texture(0), Value::Constant(0.7));
        let numbers =
            Principled { roughness: value, metallic: value, clearcoat: value, anisotropic, ..solid };
        Bsdf::Principled(numbers)
    };
    let below_a_lamp = |bsdf: Bsdf, across: Option<usize>| {
        let camera = Camera::look_at(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, 0.3);
        let mut d = Description::new(camera, film(4, Filter::Tent { radius: 1.0 }));
        d.integrator.max_depth = Some(2);
        let texels = [0.9, 0.2, 0.3, 0.7].map(DVec3::splat).to_vec();
        let to_uv = DAffine2::IDENTITY;
        d.add_texture(Texture {
            id: "numbers".to_owned(),
            width: 2,
            height: 2,
            texels,
            wrap: Wrap::Clamp,
            to_uv,
        });
        let material = Material::new("material", bsdf, true);
        let material = d.add_material(Material { roughness_textures: [None, across], ..material });
        d.add_shape("sheet", Mesh::rectangle(), material);
        let lamp = Mesh::rectangle().transformed(&(at(0.6, 0.4, 2.0, 0.3) * DAffine3::from_rotation_y(PI)));
        d.add_emitter("lamp", lamp, DVec3::splat(3.0));
        Scene::new(d).unwrap()
    };
    let none = Progress::none();
    let mut comparisons = Comparisons::of("facets_and_numbers_turn_with_their_surface");
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 4) as f64)).collect()
    };
    let turning = |scene: &Scene| {
        let mut change = Tangent::still(scene);
        change.rotate(scene, 0, DVec3::ZERO, DVec3::Z);
        change
    };
    let warped = |scene: &Scene| {
        let change = turning(scene);
        total(|seed| {
            let method = WarpedArea { samples: 32, seed, ..WarpedArea::default() };
            weighted(method.forward(scene, &change, &none).unwrap().gradient)
        })
    };
    let differences = |scene: &Scene| {
        let change = turning(scene);
        total(|seed| {
            let method = FiniteDifference { samples: 512, step: 3e-2, seed };
            weighted(method.forward(scene, &change, &none).unwrap().gradient)
        })
    };
    let isotropic = warped(&below_a_lamp(brushed(1.0), None));
    for (name, bsdf, across) in [
        ("brushed metal", brushed(0.3), None),
        ("a metal that a texture brushes", brushed(0.8), Some(0)),
        ("a textured principled material", textured(0.0), None),
    ] {
        let scene = below_a_lamp(bsdf, across);
        let expected = differences(&scene);
        comparisons.add(name.into(), warped(&scene), expected, 0.0, expected.0);
        comparisons.reject("facets without axes", isotropic, expected);
        let (mut change, mut active) = (turning(&scene), ActiveParameters::nothing(&scene));
        (active.shapes[0], active.materials[0]) = (true, true);
        change.texels[0].iter_mut().for_each(|t| *t = DVec3::new(0.3, -0.1, 0.2));
        let (adjoint, method) = (random_adjoint(scene.size()), WarpedArea::default());
        let image = method.forward(&scene, &change, &none).unwrap().gradient;
        let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
        let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
        assert!((forward - reverse).abs() < 1e-9 * forward.abs(), "{name}: {forward} {reverse}");
    }
    comparisons.finish();
}

/// Texture coordinates that are continuous, but not linear: the axes of brushed metal turn at the diagonal of
/// a sheet, where its reflection is discontinuous. The discontinuity moves with the sheet; fields and edge
/// sampling account for it. Control: the derivative without warps differs.
#[test]
fn axes_that_turn_at_an_edge_are_a_jump() {
    let camera = Camera::look_at(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, 0.3);
    let mut d = Description::new(camera, film(4, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let uvs = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 0.0)].map(|(u, v)| glam::DVec2::new(u, v)).to_vec();
    let sheet = Mesh::rectangle();
    let triangles = sheet.triangles().to_vec();
    let sheet = sheet.with_uvs(crate::geometry::Attribute { values: uvs, triangles }).unwrap();
    let metal = |stretch| {
        let specular_reflectance = Reflectance::Constant(DVec3::splat(0.8));
        let (distribution, eta, k) = (Microfacets::Ggx, DVec3::ZERO, DVec3::ONE);
        let bsdf = Bsdf::RoughConductor { distribution, alpha: 0.5, stretch, eta, k, specular_reflectance };
        Material::new("metal", bsdf, true)
    };
    let material = d.add_material(metal(0.2));
    d.add_shape("sheet", sheet, material);
    let lamp = Mesh::rectangle().transformed(&(at(0.75, -0.3, 2.0, 0.3) * DAffine3::from_rotation_y(PI)));
    d.add_emitter("lamp", lamp, DVec3::splat(3.0));
    let mut scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::new(1.0, 0.3, 0.0));
    let none = Progress::none();
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 4) as f64)).collect()
    };
    let warped = |samples, warps| {
        total(|seed| {
            let method = WarpedArea { samples, seed, warps, ..WarpedArea::default() };
            weighted(method.forward(&scene, &change, &none).unwrap().gradient)
        })
    };
    let edges = total(|seed| {
        let method =
            EdgeSampling { samples: 64, primary: 256, secondary: 1, bounces: 1, seed, allow_missing: vec![] };
        weighted(method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let differences = total(|seed| {
        let method = FiniteDifference { samples: 2048, step: 2e-2, seed };
        weighted(method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let mut comparisons = Comparisons::of("axes_that_turn_at_an_edge_are_a_jump");
    comparisons.add("warped area".into(), warped(1536, true), edges, 0.0, edges.0);
    comparisons.add("differences".into(), differences, edges, 0.0, edges.0);
    comparisons.reject("no jump", warped(16, false), edges);
    comparisons.finish();
    // The discontinuity appears and disappears with the anisotropy, in an updated scene as in a new one.
    let jumps = |scene: &Scene| (0..3).filter(|&k| scene.adjacency.smooth(0, k).is_some()).count();
    let mut found = vec![jumps(&scene)];
    for stretch in [1.0, 0.3, 1.0] {
        scene.set_material(0, metal(stretch)).unwrap();
        found.push(jumps(&scene));
    }
    assert_eq!(found, [0, 1, 0, 1]);
}

/// Without texture coordinates there is no anisotropy.
#[test]
fn facets_without_coordinates_are_the_same_in_all_directions() {
    let image = |stretch: f64| {
        let bsdf = Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha: 0.3,
            stretch,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance: white(),
        };
        let mut d = cube(Material::new("material", bsdf, true));
        let bare = Mesh::new(d.shapes[0].mesh.positions().to_vec(), d.shapes[0].mesh.triangles().to_vec());
        d.shapes[0].mesh = bare.unwrap();
        render(&Scene::new(d).unwrap(), 4, 0, &Progress::none()).unwrap().image
    };
    assert_eq!(image(1.0), image(0.4));
}

/// Discontinuities that the methods do not handle are refused by name, and nothing else is: bump maps, and by
/// edge sampling mirrors and transmission.
#[test]
fn moving_geometry_is_refused_where_jumps_are_lost() {
    let texels = vec![DVec3::splat(0.5); 4];
    let texture = Texture {
        id: "grey".to_owned(),
        width: 2,
        height: 2,
        texels,
        wrap: Wrap::Repeat,
        to_uv: DAffine2::IDENTITY,
    };
    let names = || ("cube".to_owned(), "material".to_owned());
    let transmission = || {
        let (shape, material) = names();
        Some(Unsupported::Transmission { shape, material })
    };
    let plain = |bsdf: Bsdf| Material::new("material", bsdf, false);
    let (shape, material) = names();
    let mirror = Some(Unsupported::Mirror { shape, material });
    let (shape, material) = names();
    let relief = Some(Unsupported::Relief { shape, material });
    let bump = Relief::Bump { texture: 0, scale: 1.0 };
    let cases = [
        (plain(plastic(None)), mirror),
        (plain(plastic(rough())), None),
        (plain(Bsdf::Dielectric(glass(None))), transmission()),
        (plain(Bsdf::Dielectric(glass(rough()))), transmission()),
        (plain(Bsdf::ThinDielectric(glass(None))), transmission()),
        (plain(principled(0.0)), None),
        (plain(principled(0.5)), transmission()),
        (Material { opacity: Some(Reflectance::Texture(0)), ..plain(plastic(rough())) }, transmission()),
        (Material { relief: Some(bump), ..plain(plastic(rough())) }, relief),
    ];
    for (material, expected) in cases {
        let mut d = cube(Material::diffuse("material", DVec3::ONE));
        d.add_texture(texture.clone());
        let uvs = crate::geometry::Attribute {
            values: vec![glam::DVec2::ZERO, glam::DVec2::X, glam::DVec2::Y],
            triangles: vec![[0, 1, 2]; 12],
        };
        d.shapes[0].mesh = d.shapes[0].mesh.clone().with_uvs(uvs).unwrap();
        d.materials[0] = material;
        let scene = Scene::new(d).unwrap();
        let mut change = Tangent::still(&scene);
        change.translate(&scene, 0, DVec3::X);
        let method = EdgeSampling { samples: 1, primary: 1, secondary: 1, ..EdgeSampling::default() };
        let found = method.forward(&scene, &change, &Progress::none()).err();
        let is_relief = |e: &Unsupported| matches!(e, Unsupported::Relief { .. });
        let refused = expected.clone().filter(is_relief).map(GradientError::Unsupported);
        assert_eq!(found, expected.map(GradientError::Unsupported));
        let warped = WarpedArea { samples: 1, ..WarpedArea::default() };
        assert_eq!(warped.forward(&scene, &change, &Progress::none()).err(), refused);
        let mut d = scene.description().clone();
        d.integrator.max_depth = Some(1);
        let dark = method.forward(&Scene::new(d).unwrap(), &change, &Progress::none());
        assert!(dark.is_ok(), "where nothing but emission is seen, nothing is lost");
    }
}

/// A spot light is a point light within its cone, and dark beyond.
#[test]
fn spots_are_point_lights_within_their_cone() {
    let mut d = cube(Material::diffuse("white", DVec3::ONE));
    d.environment = None;
    let (position, intensity) = (DVec3::new(0.0, 0.0, 5.0), DVec3::splat(4.0));
    let mut lit = |light: Light| {
        d.lights = vec![light];
        render(&Scene::new(d.clone()).unwrap(), 4, 1, &Progress::none()).unwrap().image.pixels
    };
    let point = lit(Light::Point { id: "light".to_owned(), position, intensity });
    let mut spot = |beam: f64| {
        // The light points along −z.
        let (id, to_world) = ("light".to_owned(), DMat3::from_rotation_y(PI));
        lit(Light::Spot { id, position, to_world, intensity, cutoff: beam + 0.01, beam, texture: None })
    };
    assert_eq!(spot(1.2), point, "all is in the cone");
    let narrow = spot(0.01);
    assert!(narrow.iter().zip(&point).all(|(a, b)| a.x <= b.x) && narrow != point, "only the middle is");
}
