//! Tests of faces seen almost edge-on, narrower on the film than the offset of rays that test visibility next
//! to their edges.

use super::*;
use crate::gradient::Field;

const DISTANCE: f64 = 5.0;
const FIELD_OF_VIEW: f64 = 0.8;
const SIDE: usize = 24;

/// A block of the given depth that emits in front of black. Its left face, in the plane x = −0.5, is seen at
/// the given angle in radians.
fn scene(angle: f64, depth: f64) -> Scene {
    let eye = DVec3::new(-0.5 - angle * DISTANCE, 0.2, DISTANCE);
    let camera = Camera::look_at(eye, eye - DVec3::Z * DISTANCE, DVec3::Y, FIELD_OF_VIEW);
    let mut d = Description::new(camera, film(SIDE, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(1);
    let scale = DAffine3::from_scale(DVec3::new(0.5, 0.5, 0.5 * depth));
    d.add_emitter("block", Mesh::cube().transformed(&scale), DVec3::ONE);
    Scene::new(d).unwrap()
}

/// The sum of pixel derivatives times their columns as the block moves along x: the mean of eight runs.
fn total(scene: &Scene, method: Method) -> f64 {
    let mut change = Tangent::still(scene);
    change.translate(scene, 0, DVec3::X);
    let run = |seed| {
        let image = method.with_seed(seed).forward(scene, &change, &Progress::none()).unwrap().gradient;
        (0..SIDE * SIDE).map(|i| image.pixels[i].x * (i % SIDE) as f64).sum::<f64>() / 8.0
    };
    (1..=8).map(run).sum::<f64>()
}

fn softened() -> Method {
    let field =
        Field::Softened { film: 1.2, lobe: 0.5, softness: 0.4, silhouettes: 64, shadows: 1, bounces: 0 };
    Method::WarpedArea(WarpedArea { samples: 64, field, ..WarpedArea::default() })
}

fn exact() -> Method {
    Method::WarpedArea(WarpedArea { samples: 64, ..WarpedArea::default() })
}

fn edges() -> Method {
    let edges = EdgeSampling { samples: 8, primary: 64, secondary: 1, bounces: 1, ..Default::default() };
    Method::EdgeSampling(edges)
}

/// Exact value of [`total`]. Under a tent filter the sum is the first moment of the visible region: a
/// rectangle and, next to it, a trapezoid whose two sides move at the rates of their distances.
fn known(angle: f64, depth: f64) -> f64 {
    let scale = 0.5 * SIDE as f64 / (0.5 * FIELD_OF_VIEW).tan();
    let [near, far] = [0.5, -0.5].map(|z| scale / (DISTANCE - z * depth));
    let moment = |moved: f64| {
        // Film coordinates from the film's centre; the first column is half the film less half a pixel away
        // from it.
        let left = angle * DISTANCE + moved;
        let [l, f, r] = [left * near, left * far, (left + 1.0) * near];
        let middle = 0.5 * SIDE as f64 - 0.5;
        let rectangle = near * ((r - l) * middle + 0.5 * (r * r - l * l));
        let trapezoid = (l - f)
            * (0.5 * (near + far) * middle + (2.0 * f * far + f * near + l * far + 2.0 * l * near) / 6.0);
        rectangle + trapezoid
    };
    let step = 1e-3 * angle * DISTANCE;
    (moment(step) - moment(-step)) / (2.0 * step)
}

/// Rays next to an edge of such a face, near its diagonal, hit the face's other triangle, or the next face if
/// it is narrower still. No silhouette must be lost there, and none counted twice: the block's image moves
/// with the block.
#[test]
fn slivers_are_no_gaps() {
    let mut wrong = vec![];
    // The face is 0.057 times the angle of pixels wide, and rays are offset by a millionth of a pixel.
    for angle in [1e-2, 1e-4, 5e-5, 2.5e-5, 1e-5, 1e-7] {
        let scene = scene(angle, 0.01);
        let [exact, softened, edges] = [exact(), softened(), edges()].map(|method| total(&scene, method));
        println!("angle {angle:e}: exact {exact:.3}, softened {softened:.3}, edges {edges:.3}");
        assert!(exact > 100.0, "{exact}");
        // Results scatter by 1 or 2 %; an edge that is lost or counted twice changes them by a third.
        wrong.extend([softened, edges].into_iter().filter(|found| (found / exact - 1.0).abs() > 0.03));
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// A deep face opens as it moves: its borders move relative to each other by Δv, and between them ∇·V of a
/// field that follows both is Δv over the width, which few samples find. A softened field leaves such borders
/// partly to curve samples.
#[test]
fn slivers_that_open_are_left_to_curves() {
    for angle in [1e-2, 1e-3, 1e-4, 1e-5] {
        let scene = scene(angle, 1.0);
        let known = known(angle, 1.0);
        let [exact, softened, edges] = [exact(), softened(), edges()].map(|method| total(&scene, method));
        println!(
            "angle {angle:e}: known {known:.3}, exact {exact:.3}, softened {softened:.3}, edges {edges:.3}"
        );
        for found in [softened, edges] {
            // Results scatter by 1 %.
            assert!((found / known - 1.0).abs() < 0.03, "{angle:e}: {found} for {known}");
        }
        // Control: samples of the exact mean miss the opening of the face, 12 % of the whole.
        assert!(angle > 1e-5 || exact < 0.95 * known, "{angle:e}: {exact} for {known}");
    }
}
