//! Test of ∇·V of the mean over discontinuities against finite differences of V.

use flatland::random::{open01, stream};
use flatland::sdf::{End, Trace};
use flatland::warp::LinearField as _;
use glam::{DAffine3, DQuat, DVec3, EulerRot};

use super::{AngularSupport, JumpMean, Known, SceneEdges, Sight, Silhouettes, View};
use crate::geometry::Mesh;
use crate::gradient::{ImplicitField, Tangent};
use crate::path::VisibilityDomain;
use crate::scene::{Camera, Description, Film, Filter, Material, Scene};

/// Two moving sheets on both sides of the test directions.
fn sheets() -> (Scene, Tangent) {
    let camera = Camera::look_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, 0.5);
    let film = Film { width: 2, height: 2, crop: None, sample_border: true, filter: Filter::Box };
    let mut d = Description::new(camera, film);
    let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
    for (k, (x, z)) in [(-1.0, -2.0), (1.2, -2.5)].into_iter().enumerate() {
        let turned = DQuat::from_euler(EulerRot::XYZ, 0.3, -0.4, 0.1 + k as f64);
        let place = DVec3::new(x, 0.1, z);
        let sheet = DAffine3::from_scale_rotation_translation(DVec3::splat(0.4), turned, place);
        d.add_shape(&format!("sheet {k}"), Mesh::rectangle().transformed(&sheet), paper);
    }
    let scene = Scene::new(d).expect("a scene");
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::new(0.7, -0.4, 0.9));
    change.translate(&scene, 1, DVec3::new(-0.2, 0.8, 0.3));
    (scene, change)
}

/// Includes directions far from what moves, where velocities point out of the sphere: a tenth of the term −2
/// u·V is a hundred thousand times the error of the differences there.
#[test]
fn divergences_are_those_of_differences() {
    let (scene, change) = sheets();
    let tree = SceneEdges::new(&scene);
    let field = ImplicitField::default();
    let sight = Sight { origin: DVec3::ZERO, from: None, plane: None, field, known: Known::Nothing };
    let mut trace = Trace { direction: DVec3::ZERO, points: vec![], end: End::Miss };
    let exact = AngularSupport::new(0.8);
    for reach in [exact, exact.softened(0.3)] {
        let mut at = |u: DVec3| {
            let view = View {
                origin: DVec3::ZERO,
                planes: &[],
                domain: VisibilityDomain::Radiance,
                seen: None,
                left: None,
                border_softness: 0.0,
                rounding: 1e-12,
            };
            let mean = JumpMean::new(&scene, &tree, Silhouettes::All, &view, u, reach, &sight, &mut trace);
            let mean = mean.expect("jumps near by");
            mean.field(|seen| seen.angular(seen.followed.velocity(&scene, &change.positions)))
        };
        let (mut rng, h, mut worst, mut largest) = (stream(7, &[]), 1e-5, 0.0_f64, 0.0_f64);
        for _ in 0..50 {
            let mut number = || 0.3 * (open01(&mut rng) - 0.5);
            let u = DVec3::new(number(), number(), -1.0).normalize();
            assert!(scene.closest(DVec3::ZERO, u, None).is_none(), "{u}");
            let (a, b) = u.any_orthonormal_pair();
            let slope = [a, b].map(|e| {
                let [plus, minus] = [h, -h].map(|h| at((u + h * e).normalize()).value);
                (plus - minus).dot(e) / (2.0 * h)
            });
            let found = at(u).divergence;
            worst = worst.max((found - slope[0] - slope[1]).abs());
            largest = largest.max(found.abs());
        }
        println!("{reach:?}: off by {worst:.1e}, divergences up to {largest}");
        assert!(worst < 1e-6 * largest && largest > 0.1, "{worst} of {largest}");
    }
}
