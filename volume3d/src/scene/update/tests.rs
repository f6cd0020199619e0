use flatland::random::{Stream, open01, stream};
use glam::{DAffine2, DAffine3, DVec2, DVec3};

use super::*;
use crate::geometry::{Attribute, Ray};
use crate::scene::{Camera, Film, Filter, Reflectance, Wrap};

fn random(rng: &mut Stream) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
}

/// A grid of n × n squares over [−1, 1]², with texture coordinates.
fn sheet(n: u32) -> Mesh {
    let corners = || (0..=n).flat_map(move |j| (0..=n).map(move |i| DVec2::new(f64::from(i), f64::from(j))));
    let positions = corners().map(|c| (2.0 / f64::from(n) * c - 1.0).extend(0.0)).collect();
    let square = |i: u32, j: u32| {
        let a = j * (n + 1) + i;
        [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
    };
    let triangles: Vec<[u32; 3]> = (0..n).flat_map(|j| (0..n).flat_map(move |i| square(i, j))).collect();
    let uvs =
        Attribute { values: corners().map(|c| c / f64::from(n)).collect(), triangles: triangles.clone() };
    Mesh::new(positions, triangles).and_then(|mesh| mesh.with_uvs(uvs)).unwrap()
}

fn given(mesh: Mesh) -> Mesh {
    let triangles = mesh.triangles().to_vec();
    let values = mesh.positions().iter().map(|p| *p + DVec3::Z).collect();
    mesh.with_normals(Normals::Given(Attribute { values, triangles })).unwrap()
}

/// Intersecting sheets: flat-shaded, smooth and with given normals.
fn description() -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO, DVec3::Y, 0.7);
    let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
    let mut d = Description::new(camera, film);
    let white = d.add_material(Material::diffuse("white", DVec3::ONE));
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    let texels = vec![DVec3::ONE; 4];
    let (wrap, to_uv) = (Wrap::Repeat, DAffine2::IDENTITY);
    d.add_texture(Texture { id: "squares".to_owned(), width: 2, height: 2, texels, wrap, to_uv });
    d.add_shape("flat", sheet(4), white);
    d.add_shape("smooth", sheet(5).smooth(), grey);
    d.add_shape("given", given(sheet(3)), white);
    d
}

/// Asserts that a scene equals a new one from its description, and that rays hit the same.
fn assert_up_to_date(scene: &Scene, rng: &mut Stream) {
    let new = Scene::new(scene.description().clone()).unwrap();
    assert_eq!(scene.positions, new.positions);
    assert_eq!(scene.normals, new.normals);
    assert_eq!(scene.rounding(), new.rounding());
    for t in 0..new.triangles.len() as u32 {
        assert_eq!(scene.adjacency.beyond(t), new.adjacency.beyond(t));
        assert_eq!(scene.radius(t).to_bits(), new.radius(t).to_bits());
    }
    let pairs = |s: &Scene| s.crossings().all().iter().map(|c| (c.triangles, c.places)).collect::<Vec<_>>();
    assert_eq!(pairs(scene), pairs(&new));
    for _ in 0..1000 {
        let (origin, direction) = (2.0 * random(rng), random(rng).normalize());
        let ray = Ray { origin, direction, near: 0.0, far: f64::INFINITY, from: None };
        assert_eq!(scene.accelerator.closest(&ray), new.accelerator.closest(&ray));
    }
}

#[test]
fn moved_vertices_make_the_scene_that_would_be_built_anew() {
    let mut scene = Scene::new(description()).unwrap();
    for step in 0..6 {
        let mut rng = stream(61, &[step]);
        let size = [0.0, 1e-3, 0.3, 3.0, 0.3, 1e-3][step as usize];
        let moved: Vec<(usize, Mesh)> = (0..3)
            .filter(|shape| step % 4 != *shape)
            .map(|shape| {
                let mesh = scene.description().shapes[shape as usize].mesh.clone();
                let positions = mesh.positions().iter().map(|p| *p + size * random(&mut rng)).collect();
                let turned = DAffine3::from_rotation_y(0.3 * size);
                (shape as usize, mesh.with_positions(positions).unwrap().transformed(&turned))
            })
            .collect();
        scene.set_meshes(moved).unwrap();
        assert_up_to_date(&scene, &mut rng);
    }
    // Beyond the camera, which is moved later.
    let far = DAffine3::from_translation(DVec3::splat(1e6));
    scene.set_meshes([(0, scene.description().shapes[0].mesh.clone().transformed(&far))]).unwrap();
    assert_up_to_date(&scene, &mut stream(61, &[9]));
    let camera = Camera { origin: DVec3::splat(1e7), ..scene.description().camera.clone() };
    scene.set_camera(camera).unwrap();
    assert_up_to_date(&scene, &mut stream(61, &[10]));
    // Intersections were computed in between, and again after vertices had moved.
    assert!(!scene.crossings().all().is_empty());
}

/// The origin of the scene's internal coordinates follows its surfaces, and stays while they hardly move.
#[test]
fn scenes_that_move_far_away_are_as_if_built_anew() {
    let mut scene = Scene::new(description()).unwrap();
    let light =
        |x: f64| Light::Point { id: "bulb".to_owned(), position: DVec3::splat(x), intensity: DVec3::ONE };
    scene.description.lights.push(light(3.0));
    scene = Scene::new(scene.description).unwrap();
    let mut offsets = vec![];
    for (seed, by) in [(1, 1e6), (2, 0.25), (3, 1e3), (4, -1.001_000_25e6)] {
        let place = DAffine3::from_translation(DVec3::new(by, -2.0 * by, 0.5 * by));
        let moved =
            |shape: usize| (shape, scene.description().shapes[shape].mesh.clone().transformed(&place));
        let moved = [0, 1, 2].map(moved);
        scene.set_meshes(moved).unwrap();
        let mut rng = stream(65, &[seed]);
        assert_up_to_date(&scene, &mut rng);
        let origin = scene.description().shapes[0].mesh.positions()[0] + 9.0 * DVec3::Z;
        scene.set_camera(Camera { origin, ..scene.description().camera.clone() }).unwrap();
        scene.set_light(0, light(origin.x)).unwrap();
        assert_up_to_date(&scene, &mut rng);
        assert_eq!(scene.camera().origin, origin - scene.offset());
        assert_eq!(scene.lights(), [light(origin.x).moved(-scene.offset())]);
        offsets.push(scene.offset());
    }
    assert!(offsets[0] == offsets[1] && offsets[0] != offsets[2] && offsets[3] == DVec3::ZERO, "{offsets:?}");
}

#[test]
fn other_triangles_are_a_new_scene() {
    let mut scene = Scene::new(description()).unwrap();
    scene.set_meshes([(1, sheet(2)), (0, given(sheet(7)))]).unwrap();
    assert_up_to_date(&scene, &mut stream(62, &[]));
    scene.set_meshes([(1, sheet(2).smooth())]).unwrap();
    assert_up_to_date(&scene, &mut stream(63, &[]));
}

#[test]
fn a_material_that_gains_a_texture_shades_edges_anew() {
    let mut torn = sheet(4);
    let uvs = torn.uvs().unwrap().clone();
    let values = uvs.values.iter().enumerate().map(|(i, uv)| *uv * (1.0 + (i % 2) as f64)).collect();
    let triangles: Vec<[u32; 3]> = uvs.triangles.iter().map(|t| [t[0], t[1], t[2] - t[2] % 2]).collect();
    torn = torn.with_uvs(Attribute { values, triangles }).unwrap();
    let mut scene = Scene::new(description()).unwrap();
    scene.set_meshes([(0, torn)]).unwrap();
    let creases = |s: &Scene| (0..32).map(|t| s.adjacency.beyond(t)).collect::<Vec<_>>();
    let plain = creases(&scene);
    let mut white = scene.description().materials[0].clone();
    white.bsdf = crate::scene::Bsdf::Diffuse { reflectance: Reflectance::Texture(0) };
    // The shape with given normals also has texture coordinates.
    scene.set_material(0, white).unwrap();
    assert_ne!(creases(&scene), plain);
    assert_up_to_date(&scene, &mut stream(64, &[]));
}

#[test]
fn what_is_refused_leaves_the_scene_as_it_was() {
    let mut scene = Scene::new(description()).unwrap();
    let before = scene.description().clone();
    let missing =
        |what, index, count| SceneError::Missing { id: "the update".to_owned(), what, index, count };
    assert_eq!(scene.set_meshes([(0, sheet(2)), (3, sheet(1))]), Err(missing("shape", 3, 3)));
    assert_eq!(scene.set_radiance(7, None), Err(missing("shape", 7, 3)));
    let nowhere = before.shapes[0].mesh.clone().transformed(&DAffine3::from_translation(DVec3::NAN));
    assert!(matches!(scene.set_meshes([(0, nowhere)]), Err(SceneError::Mesh { .. })));
    let film = Film { width: 0, ..before.film };
    assert!(matches!(scene.set_film(film), Err(SceneError::Film { .. })));
    let textured = Material {
        bsdf: crate::scene::Bsdf::Diffuse { reflectance: Reflectance::Texture(1) },
        ..Material::diffuse("white", DVec3::ONE)
    };
    assert!(matches!(scene.set_material(0, textured), Err(SceneError::Missing { index: 1, .. })));
    let taken = Material::diffuse("grey", DVec3::ONE);
    assert!(matches!(scene.set_material(0, taken), Err(SceneError::Duplicate { .. })));
    let negative = Material::diffuse("white", DVec3::NEG_ONE);
    assert!(matches!(scene.set_material(0, negative), Err(SceneError::Range { .. })));
    assert!(matches!(scene.set_radiance(0, Some(DVec3::NAN)), Err(SceneError::Range { .. })));
    let blind = Camera { field_of_view: 4.0, ..before.camera.clone() };
    assert!(matches!(scene.set_camera(blind), Err(SceneError::Range { .. })));
    let texels = Texture { texels: vec![], ..before.textures[0].clone() };
    assert!(matches!(scene.set_texture(0, texels), Err(SceneError::Texels { .. })));
    let few = before.shapes[0].mesh.clone().with_positions(vec![DVec3::ZERO]);
    assert_eq!(few, Err(crate::geometry::MeshError::Positions { found: 1, expected: 25 }));
    assert_eq!(scene.description(), &before);
    assert_up_to_date(&scene, &mut stream(65, &[]));
}
