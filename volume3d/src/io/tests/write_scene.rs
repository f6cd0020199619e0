//! Written scenes are read again.

use flatland::sdf::shapes::Ball;
use glam::{DAffine2, DAffine3, DMat3, DVec2, DVec3};

use crate::geometry::{Attribute, Mesh, Normals};
use crate::io::{load_scene, read_obj, write_obj, write_scene};
use crate::scene::{
    Blend, Bsdf, Camera, Crop, Description, Dielectric, Environment, Film, Filter, Integrator, Lens, Light,
    Material, Microfacets, Placement, Plastic, Principled, PrincipledThin, Reflectance, Relief, Roughness,
    Scattering, Scene, Texture, Value, Wrap,
};
use crate::sdf::network::{Architecture, Network};
use crate::sdf::{Baked, Grid, Interpolation};

/// A square of two triangles whose diagonal is a crease of computed normals, with a texture seam elsewhere.
fn creased(uvs: bool) -> Mesh {
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.3), DVec3::Y, DVec3::splat(7.0 / 3.0)];
    let mesh = Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let normals = Normals::AngleWeighted { triangles: vec![[0, 1, 2], [4, 5, 3]], count: 6 };
    let mesh = mesh.with_normals(normals).unwrap();
    let values = [0.1, 0.2, 0.3, 0.4].map(|u| DVec2::new(u, 1.0 / u)).to_vec();
    let uvs = uvs.then_some(Attribute { values, triangles: vec![[0, 1, 2], [0, 3, 1]] });
    uvs.map_or(mesh.clone(), |uvs| mesh.with_uvs(uvs).unwrap())
}

fn given() -> Mesh {
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let values = [DVec3::Z, DVec3::X, DVec3::new(0.6, 0.0, 0.8), DVec3::NEG_Y].to_vec();
    Mesh::rectangle().with_normals(Normals::Given(Attribute { values, triangles })).unwrap()
}

fn meshes() -> Vec<Mesh> {
    vec![
        Mesh::cube(),
        Mesh::rectangle().smooth(),
        Mesh::new(vec![DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE], vec![[0, 1, 2]]).unwrap(),
        creased(false),
        creased(true),
        given(),
    ]
}

/// One material of each kind, with whether it is two-sided.
fn transparent_and_coated() -> Vec<(Bsdf, bool)> {
    let facets = Some(Roughness::new(Microfacets::Ggx, 0.3));
    let stretched = Roughness { distribution: Microfacets::Ggx, alpha: 0.25, stretch: 2.0 };
    let colour = || Reflectance::Constant(DVec3::new(0.3, 0.2, 0.1));
    let specular_reflectance = DVec3::new(0.9, 0.8, 0.7);
    let plastic = |facets, scattering| {
        let (eta, diffuse_reflectance) = (1.4, colour());
        Bsdf::Plastic(Plastic { eta, facets, diffuse_reflectance, specular_reflectance, scattering })
    };
    let dielectric =
        |facets| Dielectric { eta: 0.7, facets, specular_reflectance, specular_transmittance: colour() };
    let principled = Principled {
        base_color: colour(),
        roughness: 0.1,
        anisotropic: 0.25,
        metallic: 0.2,
        eta: 1.3,
        spec_tint: 0.4,
        spec_trans: 0.0,
        sheen: 0.6,
        sheen_tint: 0.7,
        flatness: 0.8,
        clearcoat: 0.9,
        clearcoat_gloss: 0.15,
    };
    let thin = PrincipledThin {
        base_color: colour(),
        roughness: 0.1,
        anisotropic: 0.25,
        eta: 1.3,
        spec_tint: 0.4,
        spec_trans: 0.5,
        diff_trans: 1.2,
        sheen: 0.6,
        sheen_tint: 0.7,
        flatness: 0.8,
    };
    vec![
        (plastic(None, Scattering::Linear), true),
        (plastic(facets, Scattering::Nonlinear), false),
        (plastic(facets, Scattering::Once), false),
        (plastic(None, Scattering::Once), false),
        (Bsdf::Dielectric(dielectric(Some(stretched))), false),
        (Bsdf::Dielectric(dielectric(None)), false),
        (Bsdf::Dielectric(dielectric(facets)), false),
        (Bsdf::ThinDielectric(dielectric(None)), false),
        (Bsdf::Principled(principled.map(Value::Constant)), true),
        (
            Bsdf::PrincipledThin(PrincipledThin { sheen: Value::Texture(0), ..thin.map(Value::Constant) }),
            false,
        ),
    ]
}

fn description() -> Description {
    let camera = Camera::look_at(DVec3::new(0.3, 1.0, 6.0), DVec3::new(0.1, 0.0, 0.2), DVec3::Y, 0.7);
    let crop = Some(Crop { x: 1, y: 2, width: 3, height: 4 });
    let film =
        Film { width: 8, height: 9, crop, sample_border: true, filter: Filter::Gaussian { deviation: 0.4 } };
    let camera = Camera { principal_point: DVec2::new(0.05, -0.125), pixel_aspect: 0.75, ..camera };
    let camera = Camera { lens: Some(Lens { radius: 0.125, focus_distance: 5.5 }), ..camera };
    let mut d = Description::new(camera, film);
    (d.integrator, d.samples) = (Integrator { max_depth: Some(3), rr_depth: 2 }, 33);
    d.hide_emitters = true;
    let texels = |n: i32| (0..n).map(|i| DVec3::splat(0.125 * f64::from(i))).collect::<Vec<_>>();
    let to_uv = DAffine2::from_scale_angle_translation(DVec2::new(2.0, -3.0), 0.5, DVec2::new(0.1, 0.2));
    let wrap = Wrap::Mirror;
    let paper =
        Texture { id: "a \"b\" <&> $x".to_owned(), width: 3, height: 2, texels: texels(6), wrap, to_uv };
    let sky = Texture {
        id: "sky".to_owned(),
        width: 2,
        height: 1,
        texels: texels(2),
        wrap: Wrap::Repeat,
        to_uv: DAffine2::IDENTITY,
    };
    let (paper, sky) = (d.add_texture(paper), d.add_texture(sky));
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.1, 0.2, 1.0 / 3.0)));
    let printed = Bsdf::Diffuse { reflectance: Reflectance::Texture(paper) };
    let printed = d.add_material(Material::new("printed", printed, false));
    let (eta, k) = (DVec3::new(0.2, 0.9, 1.1), DVec3::new(3.9, 2.4, 2.2));
    let specular_reflectance = Reflectance::Constant(DVec3::splat(0.9));
    let distribution = Microfacets::Ggx;
    let rough = Bsdf::RoughConductor {
        distribution,
        alpha: 0.3,
        stretch: 2.0,
        eta,
        k,
        specular_reflectance: specular_reflectance.clone(),
    };
    let rough = d.add_material(Material::new("rough", rough, true));
    let mirror = Bsdf::Conductor { eta, k, specular_reflectance };
    let grey = Reflectance::Constant(DVec3::splat(0.5));
    let mirror = d.add_material(Material::new("mirror", mirror, false));
    for (i, (bsdf, two_sided)) in transparent_and_coated().into_iter().enumerate() {
        let material = Material::new(&format!("other {i}"), bsdf, two_sided);
        let opacity = (i % 2 == 1).then(|| Reflectance::Constant(DVec3::splat(0.25)));
        d.add_material(Material { opacity, ..material });
    }
    let textured = Some(paper);
    let frosted = Bsdf::Dielectric(Dielectric {
        eta: 1.5,
        facets: Some(Roughness::new(distribution, 1.0)),
        specular_reflectance: DVec3::ONE,
        specular_transmittance: Reflectance::Constant(DVec3::ONE),
    });
    d.add_material(Material {
        roughness_textures: [textured; 2],
        ..Material::new("frosted", frosted.clone(), false)
    });
    let second = Material::new("brushed", frosted, false);
    d.add_material(Material { roughness_textures: [None, textured], ..second });
    let blend = Some(Blend { other: white, weight: Value::Texture(paper) });
    d.add_material(Material {
        blend,
        ..Material::new("mixed", Bsdf::Diffuse { reflectance: grey.clone() }, false)
    });
    let back = Some(mirror);
    d.add_material(Material {
        back,
        ..Material::new("turned", Bsdf::Diffuse { reflectance: grey.clone() }, true)
    });
    let relief = Some(Relief::Bump { texture: paper, scale: 0.5 });
    d.add_material(Material { relief, ..Material::new("bumpy", Bsdf::Diffuse { reflectance: grey }, true) });
    for (i, mesh) in meshes().into_iter().enumerate() {
        let material = [white, rough, mirror][i % 3];
        let material = if mesh.uvs().is_some() { printed } else { material };
        d.add_shape(&format!("../shape {}", i % 5), mesh, material);
        d.shapes[i].id.push_str(&"'".repeat(i / 5));
    }
    d.shapes[2].radiance = Some(DVec3::new(1.0, 2.0, 3.0));
    (d.shapes[0].radiance, d.shapes[0].radiance_texture) = (Some(DVec3::ONE), Some(paper));
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let (id, irradiance) = ("sun".to_owned(), DVec3::ONE);
    d.lights.push(Light::Directional { id, direction, irradiance, kappa: 50.0 });
    let (id, intensity) = ("bulb".to_owned(), DVec3::splat(0.1));
    d.lights.push(Light::Point { id, position: DVec3::new(5.0, 0.1, 1e-7), intensity });
    let to_world = DMat3::from_rotation_y(0.5);
    d.environment = Some(Environment::Map { id: "sky".to_owned(), texture: sky, scale: 2.0, to_world });
    d
}

/// The position, shading normal and texture coordinates of each corner of each triangle.
fn corners(mesh: &Mesh) -> Vec<(DVec3, DVec3, Option<DVec2>)> {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, 0.7);
    let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
    let mut d = Description::new(camera, film);
    let white = d.add_material(Material::diffuse("white", DVec3::ONE));
    d.add_shape("mesh", mesh.clone(), white);
    let scene = Scene::new(d).unwrap();
    let corner = |t: usize, k: usize| {
        let triangle = scene.triangles[t];
        let normal = scene.normals.get(triangle.normals[k] as usize).copied().unwrap_or_default();
        let uv = mesh.uvs().map(|uvs| uvs.values[uvs.triangles[t][k] as usize]);
        (scene.positions[triangle.positions[k] as usize], normal, uv)
    };
    (0..mesh.triangles().len()).flat_map(|t| [0, 1, 2].map(|k| corner(t, k))).collect()
}

#[test]
fn scenes_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let before = description();
    write_scene(&path, &Scene::new(before.clone()).unwrap()).unwrap();
    let after = load_scene(&path).unwrap();
    assert_eq!(
        (before.film, before.integrator, before.samples),
        (after.film, after.integrator, after.samples)
    );
    assert!((before.camera.field_of_view - after.camera.field_of_view).abs() < 1e-15);
    assert_eq!(before.camera.principal_point, after.camera.principal_point);
    assert_eq!(before.camera.pixel_aspect, after.camera.pixel_aspect);
    let axes = |c: &Camera| [c.origin, c.right, c.up, c.forward];
    for (a, b) in axes(&before.camera).into_iter().zip(axes(&after.camera)) {
        assert!((a - b).length() < 1e-15);
    }
    assert_eq!(before.lights, after.lights);
    assert_eq!(before.environment.is_some(), after.environment.is_some());
    for material in &before.materials {
        let again = after.materials.iter().find(|m| m.id == material.id).unwrap();
        assert_eq!(material.two_sided, again.two_sided);
        assert_eq!(material.opacity, again.opacity);
        assert_eq!(material.relief.is_some(), again.relief.is_some());
        assert_eq!(
            material.roughness_textures.map(|t| t.is_some()),
            again.roughness_textures.map(|t| t.is_some())
        );
        let texture = |m: &Material, d: &Description| match m.bsdf.reflectance() {
            Reflectance::Texture(t) => Some(d.textures[*t].clone()),
            Reflectance::Constant(_) => None,
        };
        match texture(material, &before) {
            None => assert_eq!(material.bsdf, again.bsdf),
            Some(a) => {
                let b = texture(again, &after).unwrap();
                assert_eq!(
                    (a.id, a.width, a.height, a.texels, a.wrap),
                    (b.id, b.width, b.height, b.texels, b.wrap)
                );
                assert!(a.to_uv.abs_diff_eq(b.to_uv, 1e-15));
            }
        }
    }
    for (a, b) in before.shapes.iter().zip(&after.shapes) {
        assert_eq!((&a.id, a.radiance), (&b.id, b.radiance));
        assert_eq!(before.materials[a.material].id, after.materials[b.material].id);
        assert_eq!(corners(&a.mesh), corners(&b.mesh), "{}", a.id);
    }
    // The scene that was read can be written and read again.
    write_scene(&path, &Scene::new(after.clone()).unwrap()).unwrap();
    let twice = load_scene(&path).unwrap();
    assert!(Description { camera: after.camera.clone(), ..twice } == after, "{path:?}");
    // Ids do not lead out of the folder.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn names_that_two_things_have_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let mut d = description();
    d.shapes[0].id = "white".to_owned();
    d.shapes[1].id = "a\u{7}".to_owned();
    d.shapes[2].id = "a_".to_owned();
    // The environment and a material share a texture.
    *d.materials[1].bsdf.reflectance_mut() = Reflectance::Texture(1);
    write_scene(&path, &Scene::new(d.clone()).unwrap()).unwrap();
    let again = load_scene(&path).unwrap();
    assert_eq!(again.shapes.iter().map(|s| s.id.as_str()).collect::<Vec<_>>()[..3], ["white", "a_", "a__"]);
    let printed = again.materials.iter().find(|m| m.id == "printed").unwrap();
    let Reflectance::Texture(texture) = printed.bsdf.reflectance() else { panic!("{printed:?}") };
    assert_eq!(again.textures[*texture].texels, d.textures[1].texels);
}

#[test]
fn meshes_come_back_from_obj() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    for mesh in meshes() {
        let mesh = mesh.transformed(&DAffine3::from_rotation_x(0.3));
        write_obj(&path, &mesh).unwrap();
        let again = read_obj(&std::fs::read(&path).unwrap(), &path).unwrap();
        assert_eq!(again.positions(), mesh.positions());
        let is_face = *mesh.normals() == Normals::Face;
        let again = if is_face { again.with_normals(Normals::Face).unwrap() } else { again };
        assert_eq!(corners(&again), corners(&mesh));
    }
}

/// Grids have their own file, a placement and an interpolation; other implicit surfaces are refused.
#[test]
fn implicit_surfaces_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let mut before = description();
    let nodes = (0..125).map(|i| if i == 62 { -2.5 } else { 0.5 + f64::from(i % 7) }).collect();
    let (low, spacing) = (DVec3::new(-1.0, -2.0, 0.5), DVec3::new(0.5, 0.25, 0.125));
    let grid = Grid::new(Interpolation::Trilinear, low, spacing, [5; 3], nodes).unwrap();
    before.add_implicit("grid", grid.clone().with_interpolation(Interpolation::Cubic), 0);
    before.add_implicit("placed", grid, 0);
    let rotation = DMat3::from_rotation_x(0.7);
    before.implicits[1].placement =
        Placement { scale: 0.5, rotation, translation: DVec3::new(0.0, 0.25, -9.0) };
    before.implicits[0].placement.translation.z = -9.0;
    let network = Network::sphere(Architecture { width: 16, ..Architecture::default() }, 0.5, 1).unwrap();
    let corners = (DVec3::splat(-1.25), DVec3::splat(1.5));
    before.add_implicit("baked", Baked::new(network.clone(), corners, 12).unwrap(), 0);
    before.add_implicit("network", network, 0);
    (2..4).for_each(|i| before.implicits[i].placement.translation.z = -9.0);
    write_scene(&path, &Scene::new(before.clone()).unwrap()).unwrap();
    let after = load_scene(&path).unwrap();
    assert_eq!(after.implicits.len(), 4);
    for (a, b) in before.implicits.iter().zip(&after.implicits) {
        assert_eq!((&a.id, &a.surface), (&b.id, &b.surface));
        assert_eq!(before.materials[a.material].id, after.materials[b.material].id);
        let (a, b) = (a.placement, b.placement);
        assert!((a.scale - b.scale).abs() < 1e-15 && a.translation.distance(b.translation) < 1e-15);
        assert!(a.rotation.abs_diff_eq(b.rotation, 1e-15), "{} {}", a.rotation, b.rotation);
    }
    before.add_implicit("ball", Ball::new(DVec3::new(0.0, 0.0, -9.0), 1.0).unwrap(), 0);
    let error = write_scene(&path, &Scene::new(before).unwrap()).unwrap_err().to_string();
    assert!(error.starts_with("implicit surface `ball` is no grid or network"), "{error}");
}

#[test]
fn a_folder_that_cannot_be_written_to_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error =
        write_scene(&file.join("scene.xml"), &Scene::new(description()).unwrap()).unwrap_err().to_string();
    assert!(error.contains("cannot make") && error.contains("file"), "{error}");
}

/// A factor on the emission of a texture, which the format does not have, goes into the texture.
#[test]
fn a_factor_on_a_textured_radiance_is_written() {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, 0.7);
    let mut d = Description::new(
        camera,
        Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box },
    );
    let texels = vec![DVec3::X, DVec3::new(0.5, 0.25, 1.0)];
    let (id, to_uv) = ("slide".to_owned(), DAffine2::IDENTITY);
    d.add_texture(Texture { id, width: 2, height: 1, texels, wrap: Wrap::Clamp, to_uv });
    let factor = DVec3::new(2.0, 4.0, 8.0);
    d.add_emitter("lamp", Mesh::rectangle(), factor);
    d.shapes[0].radiance_texture = Some(0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.xml");
    write_scene(&path, &Scene::new(d).unwrap()).unwrap();
    let read = load_scene(&path).unwrap();
    let lamp = &read.shapes[0];
    let texture = &read.textures[lamp.radiance_texture.unwrap()];
    let emitted: Vec<DVec3> = texture.texels.iter().map(|texel| lamp.radiance.unwrap() * *texel).collect();
    assert_eq!(emitted, [DVec3::new(2.0, 0.0, 0.0), DVec3::new(1.0, 1.0, 8.0)]);
}

/// An orthographic sensor is written as one, and rotates about the same point when it is read again.
#[test]
fn orthographic_sensors_are_written() {
    let distance = 3e4;
    let origin = DVec3::new(1.0, 2.0, 3.0) + distance * DVec3::Z;
    let camera = Camera::look_at(origin, DVec3::new(1.0, 2.0, 0.0), DVec3::Y, 2.0 * 1e-4_f64.atan());
    let camera = Camera { orthographic: Some(distance), pixel_aspect: 1.5, ..camera };
    let film = Film { width: 8, height: 9, crop: None, sample_border: true, filter: Filter::Box };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("orthographic.xml");
    write_scene(&path, &Scene::new(Description::new(camera.clone(), film)).unwrap()).unwrap();
    let read = load_scene(&path).unwrap().camera;
    assert!(read.pivot().distance(camera.pivot()) < 1e-8 && read.origin.distance(camera.origin) < 1e-8);
    assert!(
        (read.orthographic.unwrap() / distance - 1.0).abs() < 1e-12
            && (read.pixel_aspect - 1.5).abs() < 1e-12
    );
    assert!((read.field_of_view / camera.field_of_view - 1.0).abs() < 1e-12);
}
