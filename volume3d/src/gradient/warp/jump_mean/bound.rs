//! Test of the bound of a softened field (Theory 6), in clutter and in a gap of 10⁻⁹.
//!
//! |V| ≤ v, the largest angular velocity of a discontinuity within reach, softened or not, and |∇·V| is of
//! the order of (1 + N) v/ε with N softened discontinuities. The test checks
//!
//! > |∇·V| ≤ (4 + N) v/ε,
//!
//! which N > 4 discontinuities within much less than ε of one border could exceed, up to twofold, if they
//! moved against it; clutter does not. Within a face that opens it is (204 + N) v/ε, as borders of faces
//! narrower than ε/100 are softened by ε/40.

use flatland::random::{open01, stream};
use flatland::sdf::{End, Trace};
use flatland::warp::LinearField as _;
use glam::{DAffine3, DQuat, DVec3};

use super::{AngularSupport, HalfSpace, JumpMean, Known, SceneEdges, Sight, Silhouettes, View};
use crate::geometry::Mesh;
use crate::gradient::{ImplicitField, Tangent};
use crate::path::VisibilityDomain;
use crate::scene::{Camera, Description, Film, Filter, Material, Scene};

const REACH: f64 = 0.05;

/// Angles at which the left faces of blocks are seen.
const EDGE_ON: [f64; 5] = [1e-1, 1e-3, 1e-4, 1e-5, 1e-7];

/// Overlapping leaves, each with its own motion; two sheets 10⁻⁹ apart that separate; and blocks, each with a
/// face that opens or closes; with test directions and the constant of the bound for each.
fn clutter() -> (Scene, Vec<(DVec3, f64)>) {
    let camera = Camera::look_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, 0.5);
    let film = Film { width: 2, height: 2, crop: None, sample_border: true, filter: Filter::Box };
    let mut d = Description::new(camera, film);
    let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
    let mut rng = stream(11, &[]);
    let mut number = || open01(&mut rng) - 0.5;
    for k in 0..40 {
        let turned = DQuat::from_xyzw(number(), number(), number(), number()).normalize();
        let place = DVec3::new(0.6 * number(), 0.6 * number(), -3.0 + number());
        let leaf = DAffine3::from_scale_rotation_translation(DVec3::splat(0.12), turned, place);
        d.add_shape(&format!("leaf {k}"), Mesh::rectangle().transformed(&leaf), paper);
    }
    for (k, x) in [-0.3, 0.3 + 1e-9].into_iter().enumerate() {
        let sheet = DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.3),
            DQuat::IDENTITY,
            DVec3::new(x, 0.0, -2.0),
        );
        d.add_shape(&format!("sheet {k}"), Mesh::rectangle().transformed(&sheet), paper);
    }
    for (k, angle) in EDGE_ON.into_iter().enumerate() {
        let place = DVec3::new(0.05 + 3.0 * angle, 0.7 + 0.1 * k as f64, -3.0);
        let block = DAffine3::from_translation(place) * DAffine3::from_scale(DVec3::new(0.05, 0.02, 0.5));
        d.add_shape(&format!("block {k}"), Mesh::cube().transformed(&block), paper);
    }
    // In the gap, and anywhere.
    let gap = (0..200).map(|_| DVec3::new(1e-9 * number(), 0.3 * number(), -2.0).normalize());
    let mut directions: Vec<(DVec3, f64)> = gap.map(|direction| (direction, 4.0)).collect();
    let anywhere = (0..4000).map(|_| DVec3::new(0.3 * number(), 0.3 * number(), -1.0).normalize());
    directions.extend(anywhere.map(|direction| (direction, 4.0)));
    for (k, angle) in EDGE_ON.into_iter().enumerate() {
        let on_face = (0..200).map(|_| {
            let (x, y) = (3.0 * angle, 0.7 + 0.1 * k as f64 + 0.03 * number());
            DVec3::new(x, y, -3.0 + 0.98 * number()).normalize()
        });
        directions.extend(on_face.map(|direction| (direction, 204.0)));
    }
    (Scene::new(d).unwrap(), directions)
}

#[test]
fn softened_fields_are_bounded() {
    let (scene, directions) = clutter();
    let mut change = Tangent::still(&scene);
    let mut rng = stream(12, &[]);
    for shape in 0..scene.description.shapes.len() {
        let mut number = || open01(&mut rng) - 0.5;
        change.translate(&scene, shape, DVec3::new(number(), number(), number()));
    }
    let tree = SceneEdges::new(&scene);
    tree.measure(&scene);
    let mut trace = Trace { direction: DVec3::ZERO, points: vec![], end: End::Miss };
    for part in [0.05, 0.3, 1.0] {
        let softness = part * REACH;
        // The largest |V|/v, and |∇·V| relative to its bound: softened, and exact.
        let mut worst = [[0.0_f64; 2]; 2];
        for &(u, constant) in &directions {
            let hit = scene.closest(DVec3::ZERO, u, None);
            let triangle = hit.and_then(|hit| hit.surface.triangle());
            let plane = triangle.map(|t| {
                let t = tree.plane(t);
                let (point, normal) = (scene.corners(t)[0], scene.face_normal(t));
                let normal = if normal.dot(point) > 0.0 { -normal } else { normal };
                HalfSpace { normal, point, slack: 1e-6 }
            });
            let field = ImplicitField::default();
            let sight = Sight { origin: DVec3::ZERO, from: None, plane: None, field, known: Known::Nothing };
            let exact = AngularSupport::new(REACH);
            for (worst, reach) in worst.iter_mut().zip([exact.softened(softness), exact]) {
                let all = Silhouettes::All;
                let soft = if reach.shrinkage > 0.0 { softness } else { 0.0 };
                let border_softness = triangle.map_or(0.0, |t| tree.border_softness(t, DVec3::ZERO, soft));
                let planes = plane.as_slice();
                let view = View {
                    origin: DVec3::ZERO,
                    planes,
                    domain: VisibilityDomain::Radiance,
                    seen: triangle,
                    left: None,
                    border_softness,
                    rounding: 1e-12,
                };
                let mean = JumpMean::new(&scene, &tree, all, &view, u, reach, &sight, &mut trace);
                let Some(mean) = mean else { continue };
                let (mut fastest, mut ends) = (0.0_f64, 0);
                let found = mean.field(|seen| {
                    let velocity = seen.angular(seen.followed.velocity(&scene, &change.positions));
                    fastest = fastest.max(velocity.length());
                    ends += 1;
                    velocity
                });
                let bound = (constant + 0.5 * f64::from(ends)) * fastest / softness;
                worst[0] = worst[0].max(found.value.length() / fastest);
                worst[1] = worst[1].max(found.divergence.abs() / bound);
            }
        }
        println!(
            "ε = {part} R: |V| and |∇·V| over their bounds: softened {:?}, exact {:?}",
            worst[0], worst[1]
        );
        assert!(worst.iter().all(|w| w[0] <= 1.0 + 1e-9), "{worst:?}");
        assert!(worst[0][1] <= 1.0, "{worst:?}");
        assert!(worst[1][1] > 1e5, "{worst:?}");
    }
}
