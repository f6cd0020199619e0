//! A bunny in the corner of a room, under a small lamp, and its rotation.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use anyhow::Context as _;
use glam::{DAffine3, DMat3, DVec3};
use volume3d::geometry::{Mesh, Normals};
use volume3d::gradient::Tangent;
use volume3d::io::read_obj;
use volume3d::scene::{Camera, Description, Film, Filter, Integrator, Material, Scene};

/// The Stanford bunny; see figures/assets/CREDITS.md for its origin.
const BUNNY: &[u8] = include_bytes!("../../../assets/bunny.obj");
/// Its height in the room, in scene units.
const HEIGHT: f64 = 1.0;
/// Half the side of the square lamp, small beside the bunny so that its shadow has a clear edge.
const LAMP: f64 = 0.22;
/// Segments of the longest path: the lamp seen, direct light, and light that one or two surfaces scatter on.
const DEPTH: usize = 4;
/// Segments of paths that carry direct light only.
const DIRECT: usize = 2;

/// The light transport included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Light {
    /// Light from the lamp to a surface and into the camera.
    Direct,
    /// Direct light and light by way of other surfaces.
    All,
}

/// The scene on a film of `side`×`side` pixels, and its change: the bunny turns about its
/// vertical axis, to the right as one looks at it from above, by θ radians.
pub(super) fn bunny(side: usize, light: Light) -> anyhow::Result<(Scene, Tangent)> {
    let eye = DVec3::new(0.3, 1.3, 3.4);
    let camera = Camera::look_at(eye, DVec3::new(-0.08, 0.44, 0.0), DVec3::Y, 0.44);
    let film = Film {
        width: side,
        height: side,
        crop: None,
        sample_border: true,
        filter: Filter::Tent { radius: 1.0 },
    };
    let mut room = Description::new(camera, film);
    let depth = if light == Light::All { DEPTH } else { DIRECT };
    room.integrator = Integrator { max_depth: Some(depth), rr_depth: depth };
    let mut paint = |id: &str, r, g, b| room.add_material(Material::diffuse(id, DVec3::new(r, g, b)));
    let [white, fur, red] =
        [paint("white", 0.72, 0.72, 0.72), paint("fur", 0.68, 0.6, 0.5), paint("red", 0.78, 0.2, 0.12)];
    room.add_shape("floor", wall(DVec3::ZERO, DVec3::Y), white);
    room.add_shape("back", wall(DVec3::new(0.0, 0.0, -0.8), DVec3::Z), white);
    room.add_shape("side", wall(DVec3::new(-0.78, 0.0, 0.0), DVec3::X), red);
    let bunny = room.add_shape("bunny", standing_bunny()?, fur);
    let place = DMat3::from_rotation_x(FRAC_PI_2) * DMat3::from_diagonal(DVec3::splat(LAMP));
    let lamp =
        Mesh::rectangle().transformed(&DAffine3::from_mat3_translation(place, DVec3::new(1.0, 2.2, 0.9)));
    room.add_emitter("lamp", lamp, DVec3::new(62.0, 58.0, 52.0));
    let scene = Scene::new(room)?;
    let mut change = Tangent::still(&scene);
    change.rotate(&scene, bunny, DVec3::ZERO, DVec3::Y);
    Ok((scene, change))
}

/// A wall so wide that its borders are out of sight.
fn wall(at: DVec3, normal: DVec3) -> Mesh {
    const HALF: f64 = 4.0;
    let turn = glam::DQuat::from_rotation_arc(DVec3::Z, normal);
    Mesh::rectangle().transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(HALF), turn, at))
}

/// The bunny upright on the floor, with flat faces: only its edges are discontinuities.
pub(in crate::figures) fn standing_bunny() -> anyhow::Result<Mesh> {
    let mesh = read_obj(BUNNY, Path::new("figures/assets/bunny.obj"))?.with_normals(Normals::Face)?;
    let low = mesh.positions().iter().copied().reduce(DVec3::min).context("the bunny has no vertices")?;
    let high = mesh.positions().iter().copied().fold(low, DVec3::max);
    let scale = HEIGHT / (high.y - low.y);
    let middle = 0.5 * (low + high);
    let foot = DVec3::new(middle.x, low.y, middle.z);
    Ok(mesh.transformed(&DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(scale)),
        translation: -scale * foot,
    }))
}
