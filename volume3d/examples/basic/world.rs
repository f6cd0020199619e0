//! The scene of the basic example: moving triangles, their rays, and what lies at a hit.

use std::path::Path;

use flatland::calculus::{Dual, Number as _, Vec3};
use glam::DVec3;
use volume3d::geometry::{Accelerator, Hit, Ray};
use volume3d::gradient::Tangent;
use volume3d::io::read_scene;
use volume3d::scene::{Reflectance, Scene};

/// A number with its derivative d/dε.
pub(crate) type D = Dual<1>;

/// Triangles with the velocities of their vertices.
pub(crate) struct World {
    accelerator: Accelerator,
    positions: Vec<DVec3>,
    velocities: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The edges of each triangle that are edges of its flat face, as i for the edge from corner i to i + 1.
    edges: Vec<Vec<usize>>,
    /// Reflectance and emitted radiance of each triangle.
    shades: Vec<[f64; 2]>,
    /// The triangles that emit.
    pub(crate) lights: Vec<u32>,
}

/// A point that moves, and the triangle on which it lies, which its rays do not hit.
#[derive(Clone, Copy)]
pub(crate) struct Eye {
    pub(crate) at: DVec3,
    pub(crate) rate: DVec3,
    pub(crate) on: Option<u32>,
}

/// A hit as the ray moves.
pub(crate) struct Surface {
    pub(crate) reflectance: f64,
    /// The radiance that it emits towards the ray; lights shine on their front only.
    pub(crate) emitted: f64,
    pub(crate) point: Vec3<D>,
    /// The unit normal on the ray's side.
    pub(crate) normal: Vec3<D>,
}

impl World {
    /// The first channel of a scene of diffuse meshes without textures, and of area lights.
    pub(crate) fn new(scene: &Scene, change: &Tangent) -> Self {
        let (mut positions, mut triangles, mut shades) = (vec![], vec![], vec![]);
        for shape in &scene.description().shapes {
            let first = positions.len() as u32;
            let material = &scene.description().materials[shape.material];
            let Reflectance::Constant(albedo) = material.bsdf.reflectance() else { panic!("a texture") };
            positions.extend_from_slice(shape.mesh.positions());
            triangles.extend(shape.mesh.triangles().iter().map(|t| t.map(|vertex| first + vertex)));
            shades.resize(triangles.len(), [albedo.x, shape.radiance.map_or(0.0, |l| l.x)]);
        }
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            (b - a).cross(c - a).normalize()
        };
        let goes_on = |t: &[u32; 3], [a, b]: [u32; 2]| {
            let mut others = triangles.iter().filter(|other| *other != t);
            others.any(|o| o.contains(&a) && o.contains(&b) && normal(o).dot(normal(t)) > 0.999_999)
        };
        let ends = |t: &[u32; 3]| (0..3).filter(|i| !goes_on(t, [t[*i], t[(i + 1) % 3]])).collect();
        Self {
            accelerator: Accelerator::build(&positions, &triangles),
            edges: triangles.iter().map(ends).collect(),
            lights: (0..triangles.len() as u32).filter(|i| shades[*i as usize][1] > 0.0).collect(),
            velocities: change.positions.clone(),
            shades,
            positions,
            triangles,
        }
    }

    pub(crate) fn trace(&self, eye: Eye, direction: DVec3) -> Option<Hit> {
        let (origin, from) = (eye.at, eye.on);
        self.accelerator.closest(&Ray { origin, direction, near: 0.0, far: f64::INFINITY, from })
    }

    pub(crate) fn corners(&self, triangle: u32) -> [Vec3<D>; 3] {
        let vertices = self.triangles[triangle as usize].map(|v| v as usize);
        vertices.map(|v| moving(self.positions[v], self.velocities[v]))
    }

    /// The sine of the angle in which the eye sees a hit from the nearest edge of its face.
    pub(crate) fn distance_to_edge(&self, eye: Eye, direction: DVec3, hit: &Hit) -> f64 {
        let corners = self.corners(hit.triangle).map(|c| c.value() - eye.at);
        let sine = |i: usize| corners[i].cross(corners[(i + 1) % 3]).normalize().dot(direction).abs();
        self.edges[hit.triangle as usize].iter().map(|i| sine(*i)).fold(f64::INFINITY, f64::min)
    }

    /// The velocity of the material point that is hit.
    pub(crate) fn velocity(&self, hit: &Hit) -> DVec3 {
        let vertices = self.triangles[hit.triangle as usize].map(|v| self.velocities[v as usize]);
        (0..3).map(|i| hit.barycentric[i] * vertices[i]).sum()
    }

    pub(crate) fn surface(&self, hit: &Hit, eye: Eye, direction: Vec3<D>) -> Surface {
        let [a, b, c] = self.corners(hit.triangle);
        let (normal, origin) = ((b - a).cross(c - a).normalized(), moving(eye.at, eye.rate));
        let point = origin + direction * (normal.dot(a - origin) / normal.dot(direction));
        let is_front = normal.dot(direction).value() < 0.0;
        let [reflectance, radiance] = self.shades[hit.triangle as usize];
        let (emitted, normal) = if is_front { (radiance, normal) } else { (0.0, -normal) };
        Surface { reflectance, emitted, point, normal }
    }
}

pub(crate) fn moving(v: DVec3, rate: DVec3) -> Vec3<D> {
    Vec3::new(D::new(v.x, [rate.x]), D::new(v.y, [rate.y]), D::new(v.z, [rate.z]))
}

pub(crate) fn rate(v: Vec3<D>) -> DVec3 {
    DVec3::new(v.x.slope(), v.y.slope(), v.z.slope())
}

/// `scenes/table.xml` on a small film, without its sky and its second bounce, and its block's motion to the
/// right.
pub(crate) fn table() -> (Scene, Tangent) {
    let no_files = |_: &Path| Err(std::io::ErrorKind::NotFound.into());
    let text = include_bytes!("../../scenes/table.xml");
    let mut description = read_scene(text, Path::new("table.xml"), &[], &no_files).expect("a scene");
    (description.film.width, description.film.height) = (12, 9);
    (description.integrator.max_depth, description.environment) = (Some(2), None);
    let scene = Scene::new(description).expect("a scene");
    let mut change = Tangent::still(&scene);
    change.translate(&scene, scene.find_shape("block").expect("a block"), DVec3::X);
    (scene, change)
}
