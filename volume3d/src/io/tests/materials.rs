//! Materials and point-like lights in scene files.

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
    // `specular` ½ is Schlick's 4 %.
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
    // A focal length of 50 mm with a square film whose diagonal is 43.27 mm.
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
    // The second part may be two-sided by itself.
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
        assert_eq!((material.roughness_textures, material.bsdf.roughness()), ([Some(texture); 2], Some(1.0)));
    }
    // The two numbers of a checkerboard are exchanged.
    let colours = |material: &str| with(material).unwrap().textures[0].texels[0].x;
    let board = |name: &str| alpha.replace("'alpha'", &format!("'{name}'"));
    assert_eq!(colours(&format!("<bsdf type='diffuse'>{}</bsdf>", board("reflectance"))), 0.0);
    for (plugin, name, inner) in [
        ("roughconductor", "alpha", ""),
        ("principled", "metallic", ""),
        ("mask", "opacity", "<bsdf type='diffuse'/>"),
        ("blendbsdf", "weight", "<bsdf type='diffuse'/><bsdf type='diffuse'/>"),
    ] {
        let body = format!("<bsdf type='{plugin}'>{}{inner}</bsdf>", board(name));
        assert_eq!(colours(&body), 0.2, "{plugin}");
    }
    // A checkerboard used for both colours and numbers is two textures.
    let both = format!(
        "{}<bsdf type='principled'><ref name='base_color' id='t'/><ref name='roughness' id='t'/></bsdf>",
        alpha.replace("name='alpha'", "id='t'")
    );
    let firsts: Vec<f64> = with(&both).unwrap().textures.iter().map(|t| t.texels[0].x).collect();
    assert_eq!(firsts, [0.0, 0.2]);
    // Along u and across it: two textures, a texture and a number, a number and a texture.
    let (u, v) = (alpha.replace("'alpha'", "'alpha_u'"), alpha.replace("'alpha'", "'alpha_v'"));
    let number = |axis: char| format!("<float name='alpha_{axis}' value='.3'/>");
    let cases = [
        (format!("{u}{v}"), [Some(0), Some(1)], 1.0, 1.0),
        (format!("{u}{}", number('v')), [Some(0), None], 1.0, 0.3),
        (format!("{}{v}", number('u')), [None, Some(0)], 0.3, 1.0),
    ];
    for (body, textures, along, across) in cases {
        for plugin in ["roughconductor", "roughdielectric", "pplastic"] {
            let scene = with(&format!("<bsdf type='{plugin}'>{body}</bsdf>")).unwrap();
            let found = &scene.materials[0];
            let facets = found.bsdf.facets().unwrap();
            assert_eq!((found.roughness_textures, facets.alpha), (textures, along), "{body}");
            assert!((facets.alpha * facets.stretch - across).abs() < 1e-15, "{body}");
            crate::scene::Scene::new(scene).unwrap();
        }
    }
}

/// A constant texture becomes a constant, for colours and numbers, inline and by reference.
#[test]
fn constant_textures() {
    let texture =
        |plugin: &str, value: &str| format!("<texture name='NAME' type='{plugin}'>{value}</texture>");
    let third = "<float name='value' value='.25'/>";
    let colour = "<vector name='value' value='.1 .2 .3'/>";
    let spread = "<vector name='value' x='.1' y='.2' z='.3'/>";
    let rgb = "<rgb name='color' value='.1 .2 .3'/>";
    let cases = [
        (texture("rawconstant", third), DVec3::splat(0.25)),
        (texture("uniform", third), DVec3::splat(0.25)),
        (texture("rawconstant", colour), DVec3::new(0.1, 0.2, 0.3)),
        (texture("rawconstant", spread), DVec3::new(0.1, 0.2, 0.3)),
        (texture("srgb", rgb), DVec3::new(0.1, 0.2, 0.3)),
    ];
    for (text, expected) in cases {
        let named = text.replace("NAME", "reflectance");
        let found = material(&format!("<bsdf type='diffuse'>{named}</bsdf>")).bsdf;
        assert_eq!(found, Bsdf::Diffuse { reflectance: Reflectance::Constant(expected) }, "{text}");
        let grey = DVec3::new(0.2126, 0.7152, 0.0722).dot(expected);
        for (plugin, name) in
            [("roughconductor", "alpha"), ("roughplastic", "alpha"), ("principled", "roughness")]
        {
            let named = text.replace("NAME", name);
            let found = material(&format!("<bsdf type='{plugin}'>{named}</bsdf>")).bsdf.roughness().unwrap();
            assert!((found - grey).abs() < 1e-12, "{plugin} {text}: {found} {grey}");
        }
    }
    let of_reference = format!(
        "{}<bsdf type='diffuse'><ref name='reflectance' id='t'/></bsdf>",
        texture("rawconstant", third).replace("name='NAME'", "id='t'")
    );
    assert_eq!(material(&of_reference).bsdf.reflectance(), &Reflectance::Constant(DVec3::splat(0.25)));
    // Where an image is required, it has one texel.
    let relief = "<bsdf type='normalmap'><texture name='normalmap' type='rawconstant'><vector name='value' value='.5 .5 1'/>\
                  </texture><bsdf type='diffuse'/></bsdf>";
    let scene = with(relief).unwrap();
    assert_eq!((scene.textures.len(), scene.textures[0].texels[0]), (1, DVec3::new(0.5, 0.5, 1.0)));
    let lamp = "<shape type='cube'><emitter type='area'><texture name='radiance' type='uniform'><float name='value' \
                value='3'/></texture></emitter></shape>";
    assert_eq!(with(lamp).unwrap().shapes[0].radiance, Some(DVec3::splat(3.0)));
}

/// Without facets a boundary is smooth, and without a change of index there is no boundary.
#[test]
fn materials_at_their_limits() {
    let of = |plugin: &str, body: &str| material(&format!("<bsdf type='{plugin}'>{body}</bsdf>")).bsdf;
    let zero = "<float name='alpha' value='0'/>";
    let zeros = "<float name='alpha_u' value='0'/><float name='alpha_v' value='0'/>";
    for body in [zero, zeros] {
        assert_eq!(of("roughconductor", body), of("conductor", ""));
        assert_eq!(of("roughdielectric", body), of("dielectric", ""));
    }
    assert_eq!(of("roughplastic", zero), of("plastic", ""));
    let Bsdf::Plastic(once) = of("pplastic", zero) else { panic!() };
    assert_eq!((once.facets, once.scattering), (None, Scattering::Once));
    // α = 0 along one axis only becomes the minimum α.
    let one = of("roughconductor", "<float name='alpha_u' value='0'/><float name='alpha_v' value='.3'/>");
    let facets = one.facets().unwrap();
    assert!(facets.alpha == 1e-4 && (facets.alpha * facets.stretch - 0.3).abs() < 1e-15);
    assert_eq!(of("roughconductor", "<float name='alpha' value='1e-7'/>").roughness(), Some(1e-4));

    let same = "<float name='int_ior' value='1.3'/><float name='ext_ior' value='1.3'/>";
    let Bsdf::Dielectric(boundary) = of("roughdielectric", same) else { panic!() };
    assert_eq!((boundary.eta, boundary.facets), (1.0, None));
    for plugin in ["plastic", "roughplastic", "pplastic"] {
        assert_eq!(of(plugin, same), of("diffuse", ""), "{plugin}");
    }
    let principled = "<float name='eta' value='1'/><float name='roughness' value='0'/>";
    for plugin in ["principled", "principledthin"] {
        let found = of(plugin, principled);
        assert_eq!((found.relative_index(), found.roughness()), (Some(1.0), Some(0.0)));
        let mut d = with("").unwrap();
        d.add_material(Material::new("limit", found, false));
        crate::scene::Scene::new(d).unwrap();
    }
}

/// In lenient mode a metal becomes a metal, glass becomes glass, and possible metals become metal, with all
/// readable parameters.
#[test]
fn nothing_turns_metal_grey() {
    use crate::io::{ReadOptions, read_scene_with};
    let read = |bsdf: &str| {
        let text = format!(
            "<scene version='3.0.0'>{}<shape type='cube'>{bsdf}</shape></scene>",
            super::scene::SENSOR
        );
        let options = ReadOptions { is_lenient: true, ..ReadOptions::default() };
        let open = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
        let read = read_scene_with(text.as_bytes(), super::here("dir/s.xml"), &options, &open);
        let (scene, notes) = read.unwrap();
        let material = scene.materials[scene.shapes[0].material].clone();
        crate::scene::Scene::new(scene).unwrap();
        (material, notes)
    };
    let wrong = "<texture name='alpha' type='bitmap'><string name='filename' value='none.png'/></texture>";
    let gold = "<string name='material' value='Au'/><string name='distribution' value='ggx'/>";
    let rough = format!("<bsdf type='roughconductor'>{wrong}{gold}</bsdf>");
    let expected = material(&format!("<bsdf type='roughconductor'>{gold}</bsdf>")).bsdf;
    for wrapped in [
        rough.clone(),
        format!("<bsdf type='twosided'>{rough}</bsdf>"),
        format!("<bsdf type='bumpmap'>{wrong}{rough}</bsdf>"),
        format!(
            "<bsdf type='blendbsdf'><float name='weight' value='2'/><bsdf type='diffuse'/>{rough}</bsdf>"
        ),
    ] {
        let (found, notes) = read(&wrapped);
        assert_eq!((&found.bsdf, found.two_sided), (&expected, true), "{wrapped}");
        assert!(
            notes.iter().any(|note| note.text.starts_with("the material is the metal alone")),
            "{notes:?}"
        );
    }
    let unknown = "<bsdf type='conductor'><string name='material' value='Unobtainium'/></bsdf>";
    assert!(matches!(read(unknown).0.bsdf, Bsdf::Conductor { k: DVec3::ONE, .. }));
    let glass = format!("<bsdf type='roughdielectric'>{wrong}<float name='int_ior' value='2'/></bsdf>");
    let (found, _) = read(&glass);
    assert_eq!((found.bsdf.relative_index(), found.two_sided), (Some(2.0 / 1.000_277), false));
    let metallic = wrong.replace("'alpha'", "'metallic'");
    let Bsdf::Principled(p) = read(&format!("<bsdf type='principled'>{metallic}</bsdf>")).0.bsdf else {
        panic!()
    };
    assert_eq!(p.metallic, Value::Constant(1.0));
}
