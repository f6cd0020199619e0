//! Scan tests of the two conditions on a warp field: at every curve across which the visible shape changes, V
//! is continuous and equals the curve's velocity.

use glam::{DVec2, DVec3};

use super::*;
use crate::plane::{Polygon, Shade, Shape};
use crate::random::stream;
use crate::warp::{Debias, Weighting};

/// A name, a scene, and the velocities of its vertices.
struct Kind {
    name: &'static str,
    scene: Scene,
    velocities: Vec<DVec2>,
}

fn square(low: f64, high: f64) -> Vec<DVec2> {
    [(low, low), (high, low), (high, high), (low, high)].map(DVec2::from).to_vec()
}

fn star(centre: DVec2, radii: [f64; 2], turn: f64) -> Vec<DVec2> {
    let corner = |i: usize| radii[i % 2] * DVec2::from_angle(turn + i as f64 * std::f64::consts::TAU / 10.0);
    (0..10).map(|i| centre + corner(i)).collect()
}

/// A scene of rings, and a velocity for every vertex as a function of its shape's index and its position.
fn kind(
    name: &'static str,
    shapes: Vec<Vec<Vec<DVec2>>>,
    mut velocity: impl FnMut(usize, DVec2) -> DVec2,
) -> Kind {
    let shape = |rings| Shape::new(Polygon::new(rings).expect("a polygon"), Shade::constant(DVec3::ONE));
    let scene = Scene::new(DVec3::ZERO, shapes.into_iter().map(shape).collect()).expect("a scene");
    let of = |shape: usize| scene.vertices()[scene.vertex_range(shape)].iter().map(move |p| (shape, *p));
    let vertices: Vec<_> = (0..scene.shapes().len()).flat_map(of).collect();
    let velocities = vertices.into_iter().map(|(shape, p)| velocity(shape, p)).collect();
    Kind { name, scene, velocities }
}

/// A velocity that is linear in the position, so that coincident edges move together.
fn together(_: usize, p: DVec2) -> DVec2 {
    DVec2::new(0.3 * p.y - 0.2 * p.x + 0.5, 0.7 * p.x - 0.4)
}

fn kinds() -> Vec<Kind> {
    let mut rng = stream(8, &[]);
    let mut any = |_: usize, _: DVec2| DVec2::new(open01(&mut rng) - 0.5, open01(&mut rng) - 0.5);
    let stars = [(-0.2, 0.1, 0.3), (0.3, 0.2, 0.9), (0.0, -0.4, 2.0)]
        .map(|(x, y, turn)| vec![star(DVec2::new(x, y), [0.7, 0.3], turn)]);
    let big = || vec![square(-1.0, 1.0)];
    let tip = vec![[(1.0, 0.25), (0.5, -0.6), (0.4, 0.7)].map(DVec2::from).to_vec()];
    let small = || vec![square(-0.5, 0.5)];
    let beside = vec![[(0.5, -0.5), (0.9, -0.2), (0.5, 0.5)].map(DVec2::from).to_vec()];
    let hidden = vec![star(DVec2::new(0.1, 0.0), [0.4, 0.2], 0.5)];
    vec![
        kind("concave corners", stars[..1].to_vec(), &mut any),
        kind("painter's overlaps", stars.to_vec(), &mut any),
        kind("T-junctions of equal velocity", vec![big(), tip], together),
        kind("nested copies", vec![small(), small(), stars[0].clone()], together),
        kind("neighbours along an edge", vec![small(), beside], together),
        kind("a filled hole", vec![vec![square(-1.0, 1.0), square(-0.5, 0.5)], small()], together),
        kind("coincident edges that part, hidden", vec![small(), small(), big(), hidden], &mut any),
    ]
}

/// Result of a scan: the number of curves met, the largest |V⁺ − V⁻|, and the largest |(V − v)·ν|.
#[derive(Default)]
struct Found {
    met: usize,
    jump: f64,
    miss: f64,
}

/// Steps along random lines until the visible shape changes, and bisects the step down to rounding.
fn scan(kind: &Kind, field: &impl WarpField<Plane>) -> Found {
    let scene = &kind.scene;
    let shape = |u: DVec2| scene.hit(u).map(|hit| hit.shape());
    let mut rng = stream(9, &[]);
    let mut found = Found::default();
    for line in 0..150 {
        let direction = DVec2::from_angle(std::f64::consts::TAU * open01(&mut rng));
        let middle = (2.0 * open01(&mut rng) - 1.0) * direction.perp();
        let at = |t: f64| middle + t * direction;
        let steps = 120;
        for i in 0..steps {
            let [mut low, mut high] = [i, i + 1].map(|i| 3.0 * f64::from(i) / f64::from(steps) - 1.5);
            let sides = [low, high].map(|t| shape(at(t)));
            if sides[0] == sides[1] {
                continue;
            }
            while high - low > 1e-15 {
                let t = 0.5 * (low + high);
                if t == low || t == high {
                    break;
                }
                if shape(at(t)) == sides[0] { low = t } else { high = t }
            }
            let [before, after] = [low - 1e-11, high + 1e-11].map(at);
            // Three shapes may meet in one step.
            let (Some(owner), true) = (shape(before).max(shape(after)), shape(before) != shape(after)) else {
                continue;
            };
            let velocity = scene.nearest_hit(at(low), owner).expect("a hit").velocity(&kind.velocities);
            let [a, b] = [before, after].map(|u| field.at(u, &mut stream(line, &[])).0.value);
            found.met += 1;
            found.jump = found.jump.max((a - b).length());
            found.miss = found.miss.max((a - velocity).length()).max((b - velocity).length());
        }
    }
    found
}

#[test]
fn the_mean_over_jumps_keeps_both_rules_on_every_curve() {
    println!("{:36} {:>5} {:>9} {:>9} {:>9} {:>9}", "curves", "met", "jump", "miss", "direct", "Gaussian");
    for kind in kinds() {
        let (scene, velocities) = (&kind.scene, kind.velocities.as_slice());
        let jumps = SceneJumps::new(scene, JumpMean { reach: 0.3 });
        let mean = scan(&kind, &JumpField { scene, velocities, jumps });
        let debias = Debias::Consistent { rays: 64 };
        let warp = Warp { weighting: Weighting::Gaussian, debias, ..Warp::default() };
        let gaussian = scan(&kind, &AuxiliaryField { scene, velocities, warp, kappa: 100.0 });
        let direct = scan(&kind, &DirectField { scene, velocities });
        println!(
            "{:36} {:5} {:9.1e} {:9.1e} {:9.1e} {:9.1e}",
            kind.name, mean.met, mean.jump, mean.miss, direct.jump, gaussian.miss
        );
        assert!(mean.met > 100, "{}: {}", kind.name, mean.met);
        assert!(mean.jump < 1e-6 && mean.miss < 1e-6, "{}: {} {}", kind.name, mean.jump, mean.miss);
        assert!(direct.jump > 0.05 && gaussian.miss > 0.05, "{} finds no fault", kind.name);
    }
}
