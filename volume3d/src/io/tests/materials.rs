//! Materials and lights in a point, as scenes say them.

use glam::DVec3;

use super::scene::{material, with};
use crate::scene::{Blend, Bsdf, Light, Material, Microfacets, Reflectance, Scattering, Value};

#[test]
fn materials() {
    let grey = |x| Reflectance::Constant(DVec3::splat(x));
    let diffuse = |reflectance| Bsdf::Diffuse { reflectance };
    assert_eq!(material("<bsdf type='diffuse' id='m'/>").bsdf, diffuse(grey(0.5)));
    let found = material("<bsdf type='diffuse' id='m'><rgb name='reflectance' value='.1 .2 .3'/></bsdf>");
    let colour = Reflectance::Constant(DVec3::new(0.1, 0.2, 0.3));
    assert_eq!(found, Material::new("m", diffuse(colour), false));
    let found = material("<bsdf type='twosided' id='two'><bsdf type='diffuse' id='m'/></bsdf>");
    assert_eq!(found, Material::new("two", diffuse(grey(0.5)), true));

    let Bsdf::Conductor { eta, k, specular_reflectance } = material("<bsdf type='conductor'/>").bsdf else {
        panic!()
    };
    assert_eq!((eta, k, specular_reflectance), (DVec3::ZERO, DVec3::ONE, grey(1.0)));
    let gold = "<bsdf type='conductor'><rgb name='eta' value='.1, .4, 1.4'/><float name='k' value='2'/>\
                <spectrum name='specular_reflectance' value='.9'/></bsdf>";
    let Bsdf::Conductor { eta, k, specular_reflectance } = material(gold).bsdf else { panic!() };
    assert_eq!((eta, k, specular_reflectance), (DVec3::new(0.1, 0.4, 1.4), DVec3::splat(2.0), grey(0.9)));

    let rough = |body: &str| match material(&format!("<bsdf type='roughconductor'>{body}</bsdf>")).bsdf {
        Bsdf::RoughConductor { distribution, alpha, .. } => (distribution, alpha),
        other => panic!("{other:?}"),
    };
    assert_eq!(rough("<string name='material' value='none'/>"), (Microfacets::Beckmann, 0.1));
    let ggx = "<string name='distribution' value='ggx'/><float name='alpha' value='.3'/>\
               <boolean name='sample_visible' value='false'/>";
    assert_eq!(rough(ggx), (Microfacets::Ggx, 0.3));
    let both = "<float name='alpha_u' value='.2'/><float name='alpha_v' value='.2'/>";
    assert_eq!(rough(both), (Microfacets::Beckmann, 0.2));
    let brushed = "<bsdf type='roughconductor'><float name='alpha_u' value='.2'/><float name='alpha_v' value='.1'/></bsdf>";
    let Bsdf::RoughConductor { alpha, stretch, .. } = material(brushed).bsdf else { panic!() };
    assert_eq!((alpha, stretch), (0.2, 0.5));
    let board = "<bsdf type='principled'><float name='anisotropic' value='.25'/>\
                 <texture type='checkerboard' name='metallic'/></bsdf>";
    let Bsdf::Principled(numbers) = material(board).bsdf else { panic!() };
    assert_eq!((numbers.anisotropic, numbers.metallic), (Value::Constant(0.25), Value::Texture(0)));
}

#[test]
fn coated_and_transparent_materials() {
    let eta = |body: &str| material(body).bsdf.relative_index().unwrap();
    assert_eq!(eta("<bsdf type='plastic'/>"), 1.49 / 1.000_277);
    assert_eq!(eta("<bsdf type='roughdielectric'/>"), 1.5046 / 1.000_277);
    let named = "<bsdf type='thindielectric'><string name='int_ior' value='Water'/><float name='ext_ior' value='2'/></bsdf>";
    assert_eq!(eta(named), 1.333 / 2.0);
    // Schlick's 4 % is specular ½.
    let principled = eta("<bsdf type='principled'/>");
    assert!((((principled - 1.0) / (principled + 1.0)).powi(2) - 0.04).abs() < 1e-12);
    let facets = |body: &str| material(body).bsdf.facets();
    assert_eq!(facets("<bsdf type='dielectric'/>"), None);
    assert_eq!(facets("<bsdf type='roughplastic'/>").unwrap().alpha, 0.1);
    let wrapped = "<bsdf type='mask' id='m'><float name='opacity' value='.3'/>\
                   <bsdf type='twosided'><bsdf type='plastic'/></bsdf></bsdf>";
    let found = material(wrapped);
    assert_eq!((found.id.as_str(), found.two_sided), ("m", true));
    assert_eq!(found.opacity, Some(Reflectance::Constant(DVec3::splat(0.3))));
}

#[test]
fn lights_in_a_point() {
    let light = |body: &str| {
        let scene = with(body).unwrap();
        scene.lights.into_iter().next().unwrap()
    };
    let Light::Spot { cutoff, beam, intensity, .. } = light("<emitter type='spot'/>") else { panic!() };
    assert!((cutoff - 20_f64.to_radians()).abs() < 1e-15 && (beam - 15_f64.to_radians()).abs() < 1e-15);
    assert_eq!(intensity, DVec3::ONE);
    let projector = "<emitter type='projector'><float name='fov' value='90'/><rgb name='irradiance' value='1 2 3'/>\
                     <float name='scale' value='2'/></emitter>";
    let Light::Projector { intensity, field_of_view, aspect, texture, .. } = light(projector) else {
        panic!()
    };
    assert_eq!((intensity, aspect, texture), (DVec3::new(2.0, 4.0, 6.0), 1.0, None));
    assert!((field_of_view - 90_f64.to_radians()).abs() < 1e-15);
    let plain = light("<emitter type='projector'><float name='irradiance' value='1'/></emitter>");
    let Light::Projector { field_of_view, .. } = plain else { panic!() };
    // A lens of 50 mm before a square as high as its diagonal of 43.27 mm allows.
    let half = 0.5 * 36_f64.hypot(24.0) * 0.5_f64.sqrt() / 50.0;
    assert!((field_of_view - 2.0 * half.atan()).abs() < 1e-12, "{field_of_view}");
}

#[test]
fn two_materials_in_one() {
    let scene = with(
        "<bsdf type='blendbsdf' id='m'><float name='weight' value='.25'/><bsdf type='diffuse'/><bsdf type='plastic' id='p'/></bsdf>",
    )
    .unwrap();
    let [other, mixed] = &scene.materials[..] else { panic!("{:?}", scene.materials) };
    assert_eq!((other.id.as_str(), mixed.id.as_str()), ("p", "m"));
    assert!(matches!((&mixed.bsdf, &other.bsdf), (Bsdf::Diffuse { .. }, Bsdf::Plastic(_))));
    assert_eq!(mixed.blend, Some(Blend { other: 0, weight: Value::Constant(0.25) }));
    let turned = "<bsdf type='twosided' id='m'><bsdf type='diffuse'/><bsdf type='conductor'/></bsdf>";
    let scene = with(turned).unwrap();
    assert_eq!((scene.materials[1].back, scene.materials[1].two_sided), (Some(0), true));
    let weight = "<float name='weight' value='.5'/>";
    let (matt, both) = ("<bsdf type='diffuse'/>", "<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>");
    let masked = "<bsdf type='mask'><bsdf type='diffuse'/></bsdf>";
    let mixture =
        |parts: [&str; 2]| with(&format!("<bsdf type='blendbsdf'>{weight}{}{}</bsdf>", parts[0], parts[1]));
    assert!(mixture([both, both]).unwrap().materials[1].two_sided);
    // A second part may have two sides by itself.
    let sides: Vec<bool> = mixture([matt, both]).unwrap().materials.iter().map(|m| m.two_sided).collect();
    assert_eq!(sides, [true, false]);
    let nested = format!("<bsdf type='blendbsdf'>{weight}{matt}{matt}</bsdf>");
    let refused = [[both, matt], [masked, matt], [matt, masked], [&nested, matt], [matt, &nested]];
    for parts in refused {
        let text = super::message(mixture(parts));
        assert!(text.contains("not supported") && text.contains("dir/s.xml:"), "{parts:?}: {text}");
    }
    let text = super::message(with(&format!("<bsdf type='blendbsdf'>{weight}{matt}</bsdf>")));
    assert!(text.contains("two"), "{text}");
}

#[test]
fn plastic_for_polarised_light() {
    let found = material("<bsdf type='pplastic'><float name='alpha' value='.06'/></bsdf>");
    let Bsdf::Plastic(plastic) = &found.bsdf else { panic!("{found:?}") };
    assert_eq!((plastic.scattering, plastic.facets.unwrap().alpha), (Scattering::Once, 0.06));
}

#[test]
fn nothing() {
    assert_eq!(material("<bsdf type='null'/>").opacity, Some(Reflectance::Constant(DVec3::ZERO)));
    let turned = with("<bsdf type='twosided'><bsdf type='null'/></bsdf>");
    assert!(super::message(turned).contains("light passes"));
}

#[test]
fn roughnesses_may_be_textures() {
    let alpha = "<texture name='alpha' type='checkerboard'><float name='color0' value='0'/></texture>";
    let scene = with(&format!(
        "<bsdf type='roughdielectric'>{alpha}</bsdf><bsdf type='roughconductor'>{alpha}</bsdf>"
    ))
    .unwrap();
    for (material, texture) in scene.materials.iter().zip([0, 1]) {
        assert_eq!((material.roughness_texture, material.bsdf.roughness()), (Some(texture), Some(1.0)));
    }
    let text = super::message(with(&format!("<bsdf type='roughplastic'>{alpha}</bsdf>")));
    assert!(text.contains("dir/s.xml:") && text.contains("alpha"), "{text}");
}
