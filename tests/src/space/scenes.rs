//! Conversion of this module's worlds to scenes of the renderer, with the same motion.

use flatland::plane;
use glam::{DAffine3, DQuat, DVec3};
use volume3d::geometry::Mesh;
use volume3d::gradient::{CameraTangent, Tangent};
use volume3d::scene::{
    Camera, Crop, Description, Environment, Film, Filter, Integrator, Material, Scene, Shape,
};

use super::coverage::{self, CameraMotion};
use super::direct::DirectScene;
use super::irradiance::{Sides, Surface};
use super::worlds::CoverageCase;

/// Distance between the two fronts of a two-sided emitter, relative to its size: far above rounding, far
/// below every tested effect. The renderer's emitters have one side.
const THICKNESS: f64 = 1e-7;

/// A scene and its tangent.
#[derive(Debug)]
pub struct Moving {
    /// The scene.
    pub scene: Scene,
    /// Its derivative with respect to θ.
    pub change: Tangent,
}

/// A scene under construction whose vertices have velocities.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The description so far.
    pub description: Description,
    velocities: Vec<Vec<DVec3>>,
    camera: CameraTangent,
}

impl Stage {
    /// An empty scene in front of a moving camera.
    pub fn new(camera: &coverage::Camera, motion: &CameraMotion, filter: plane::Filter) -> Self {
        let filter = match filter {
            plane::Filter::Box => Filter::Box,
            plane::Filter::Tent => Filter::Tent { radius: 1.0 },
            plane::Filter::Gaussian => Filter::Gaussian { deviation: 0.5 },
        };
        let film =
            Film { width: camera.width, height: camera.height, crop: None, sample_border: true, filter };
        let coverage::Camera { origin, right, up, forward, field_of_view, .. } = *camera;
        let (principal_point, pixel_aspect) = (glam::DVec2::ZERO, 1.0);
        let camera = Camera {
            origin,
            right,
            up,
            forward,
            field_of_view,
            principal_point,
            pixel_aspect,
            lens: None,
            orthographic: None,
        };
        let mut description = Description::new(camera, film);
        description.integrator = Integrator { max_depth: Some(2), rr_depth: 100 };
        let camera = CameraTangent {
            translation: motion.origin,
            rotation: motion.angular,
            field_of_view: motion.field_of_view,
        };
        Self { description, velocities: vec![], camera }
    }

    /// Adds a moving shape, black if it has no other material.
    pub fn add(
        &mut self,
        vertices: &[(DVec3, DVec3)],
        triangles: Vec<[u32; 3]>,
        material: Option<usize>,
        radiance: Option<DVec3>,
    ) {
        let mesh = Mesh::new(vertices.iter().map(|v| v.0).collect(), triangles).expect("a mesh");
        // Coincident vertices have been merged; they have one velocity in all worlds.
        let mut velocities = vec![DVec3::ZERO; mesh.positions().len()];
        for (&to, (_, velocity)) in mesh.sources().iter().zip(vertices) {
            velocities[to as usize] = *velocity;
        }
        let id = format!("shape {}", self.velocities.len());
        let black = || self.description.add_material(Material::diffuse(&id, DVec3::ZERO));
        let material = material.unwrap_or_else(black);
        let (radiance_texture, boundary) = (None, None);
        self.description.shapes.push(Shape { id, mesh, material, radiance, radiance_texture, boundary });
        self.velocities.push(velocities);
    }

    /// Sets the environment's radiance.
    pub fn surround(&mut self, radiance: DVec3) {
        self.description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    }

    /// The finished scene.
    pub fn finish(self) -> Moving {
        let scene = Scene::new(self.description).expect("a scene");
        let mut change = Tangent::still(&scene);
        for (shape, velocities) in self.velocities.iter().enumerate() {
            change.positions_of_mut(&scene, shape).copy_from_slice(velocities);
        }
        change.camera = self.camera;
        Moving { scene, change }
    }
}

/// A square film with `size` pixels a side.
pub fn film(size: usize, filter: Filter) -> Film {
    Film { width: size, height: size, crop: None, sample_border: true, filter }
}

/// A square of half size `half`, facing `normal`.
pub fn plate(centre: DVec3, normal: DVec3, half: f64) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, centre);
    Mesh::rectangle().transformed(&place)
}

/// A mesh of constant radiance, with one shape for every distinct radiance.
pub fn coverage(case: &CoverageCase, crop: Option<Crop>) -> Moving {
    let CoverageCase { mesh, camera, motion, filter, .. } = case;
    let mut stage = Stage::new(camera, &motion.camera, *filter);
    stage.description.film.crop = crop;
    stage.surround(mesh.background);
    let mut shapes: Vec<(DVec3, Vec<[usize; 3]>)> = vec![];
    for (triangle, radiance) in mesh.triangles.iter().zip(&mesh.radiance) {
        match shapes.iter_mut().find(|(of, _)| of == radiance) {
            Some((_, triangles)) => triangles.push(*triangle),
            None => shapes.push((*radiance, vec![*triangle])),
        }
    }
    for (radiance, triangles) in shapes {
        let corners = triangles.iter().flatten().map(|&v| (mesh.positions[v], motion.positions[v]));
        let corners: Vec<_> = corners.collect();
        stage.add(&corners, soup(triangles.len()), None, Some(radiance));
    }
    stage.finish()
}

/// A ground in direct light.
pub fn direct(direct: &DirectScene) -> Moving {
    let mut stage = Stage::new(&direct.camera, &direct.camera_motion, direct.filter);
    stage.surround(direct.world.environment);
    let ground = stage.description.add_material(Material::diffuse("ground", direct.albedo));
    let corners: Vec<_> = direct.ground.corners.into_iter().zip(direct.ground.velocities).collect();
    stage.add(&corners, soup(1), Some(ground), None);
    for surface in &direct.world.surfaces {
        add_surface(&mut stage, surface);
    }
    stage.finish()
}

fn add_surface(stage: &mut Stage, surface: &Surface) {
    let p = &surface.vertices;
    let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
    let fan: Vec<[u32; 3]> = (2..p.len() as u32).map(|k| [0, k - 1, k]).collect();
    let lifted = |height: f64| {
        let corners = p.iter().zip(&surface.velocities);
        corners.map(|(p, v)| (*p + height * normal, *v)).collect::<Vec<_>>()
    };
    let radiance = (surface.radiance != DVec3::ZERO).then_some(surface.radiance);
    if surface.sides == Sides::Front || radiance.is_none() {
        return stage.add(&lifted(0.0), fan, None, radiance);
    }
    let height = THICKNESS * p[0].distance(p[1]);
    let behind = fan.iter().map(|&[a, b, c]| [a, c, b]).collect();
    stage.add(&lifted(height), fan, None, radiance);
    stage.add(&lifted(-height), behind, None, radiance);
}

/// Triangles without shared vertices.
fn soup(count: usize) -> Vec<[u32; 3]> {
    (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()
}
