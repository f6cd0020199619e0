//! Known biases are asserted, so that nobody removes or worsens them unnoticed.

use flatland::estimator::transport::{Method as _, WarpedArea as PathWarpedArea};
use flatland::estimator::{Construction, Exact, Method, Rotation, WarpedArea};
use flatland::plane::{Film, Filter, Image, Motion, Polygon, Scene, Shade, Shape};
use flatland::transport::fields::Construction as PathConstruction;
use flatland::transport::{self, Camera, Paths, Tangent, World};
use flatland::warp::{BoundaryFunction, Debias, Warp, Weighting};
use glam::{DVec2, DVec3};
use tests::effort::thorough;
use tests::power::Power;
use tests::statistics::suite_threshold;

fn white(points: Vec<DVec2>) -> Shape {
    Shape::new(Polygon::simple(points).expect("simple"), Shade::constant(DVec3::ONE))
}

fn disc(centre: DVec2, radius: f64) -> Shape {
    let corner = |i: i32| centre + radius * DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / 96.0);
    white((0..96).map(corner).collect())
}

fn film() -> Film {
    Film::new(8, 8, Filter::Tent).expect("a film")
}

/// A disc that rotates about its own centre: its image changes only at the corners of the 96-gon. A static
/// bar may cover a part of it.
fn turning_disc(bar: bool) -> (Scene, Motion) {
    let mut shapes = vec![disc(DVec2::splat(4.0), 2.6)];
    if bar {
        let corners = [(4.4, 0.3), (6.0, 0.3), (6.0, 7.7), (4.4, 7.7)];
        let grey = Shade::constant(DVec3::splat(0.5));
        let polygon = Polygon::simple(corners.map(|(x, y)| DVec2::new(x, y))).expect("simple");
        shapes.push(Shape::new(polygon, grey));
    }
    let scene = Scene::new(DVec3::ZERO, shapes).expect("a scene");
    (scene, Motion::rotate([0], DVec2::splat(4.0)))
}

/// The largest |z| of any pixel against the exact derivative. The power is the smallest noticeable fraction
/// of the silhouettes' own speed that leaks into the image.
///
/// The derivative is 0 except at the polygon's corners. G is the derivative of a disc whose silhouettes move
/// in normal direction as fast as they rotate here: ⟨G, found − exact⟩/⟨G, G⟩ is the leaked fraction, and
/// counts as one more z.
fn leak(power: &mut Power, name: &str, method: &impl Method, scene: &Scene, motion: &Motion) -> f64 {
    let exact = Exact.forward(scene, motion, &film()).expect("differentiable").mean;
    let found = method.forward(scene, motion, &film()).expect("valid");
    let grown = Exact.forward(scene, &Motion::scale([0], DVec2::splat(4.0)), &film());
    let grown: Vec<f64> = grown.expect("differentiable").mean.pixels().iter().map(|p| p.x).collect();
    let pixels = exact.pixels().iter().zip(found.mean.pixels()).zip(found.standard_error.pixels());
    let pixels: Vec<(f64, f64)> =
        pixels.map(|((exact, found), error)| (found.x - exact.x, error.x)).collect();
    leaked(power, name, &pixels, &grown)
}

/// The largest |z| of pixels, each given by its deviation and standard error, and of their sum weighted by a
/// derivative, which determines the power.
fn leaked(power: &mut Power, name: &str, pixels: &[(f64, f64)], weights: &[f64]) -> f64 {
    let norm: f64 = weights.iter().map(|g| g * g).sum();
    let weighted = pixels.iter().zip(weights);
    let (sum, variance) = weighted.fold((0.0, 0.0), |(sum, variance), ((off, error), g)| {
        (sum + g * off / norm, variance + (g * error / norm).powi(2))
    });
    let leak = (sum, variance.sqrt());
    // A pixel without spread must be exact up to rounding.
    let z =
        |(off, error): &(f64, f64)| if off.is_nan() { f64::INFINITY } else { (off / error.max(1e-12)).abs() };
    let worst = pixels.iter().chain([&leak]).map(z).fold(0.0, f64::max);
    println!("{name}: leaks {:.4} ± {:.4} of the speed, worst |z| {worst:.2}", leak.0, leak.1);
    power.add(name, suite_threshold() * leak.1, 1.0);
    worst
}

/// The regression of a gradient image on the exact one.
fn slope(found: &Image, exact: &Image) -> f64 {
    exact.dot(found) / exact.dot(exact)
}

/// On a disc alone, a kernel follows points on either side of a boundary point equally often, and the normal
/// parts of their velocities cancel: no bias, by mirror symmetry.
#[test]
fn rotation_is_right_on_a_turning_disc_alone() {
    let (scene, motion) = turning_disc(false);
    let rotation = Rotation { samples: 6000, ..Rotation::default() };
    let mut power = Power::of("known_biases::rotation_is_right_on_a_turning_disc_alone");
    let z = leak(&mut power, "disc alone", &rotation, &scene, &motion);
    assert!(z < suite_threshold(), "{z}");
}

/// The bar breaks the symmetry: kernels near it follow it and do not move, or follow only the visible rest of
/// the disc.
#[test]
fn rotation_is_biased_on_a_turning_disc_behind_a_bar() {
    let (scene, motion) = turning_disc(true);
    let rotation = Rotation { samples: 20_000, kappa: 10.0, ..Rotation::default() };
    let mut power = Power::of("known_biases::rotation_is_biased_on_a_turning_disc_behind_a_bar");
    let z = leak(&mut power, "disc behind a bar, rotation", &rotation, &scene, &motion);
    assert!(z > suite_threshold(), "{z}");
    let construction = Construction::Auxiliary { warp: Warp::default(), kappa: 10.0 };
    let warped = WarpedArea { samples: 4000, construction, ..WarpedArea::default() };
    let z = leak(&mut power, "disc behind a bar, warped area", &warped, &scene, &motion);
    assert!(z < suite_threshold(), "{z}");
}

/// A growing disc: points inside it are slower than its boundary.
fn growing_disc() -> (Scene, Motion) {
    let scene = Scene::new(DVec3::ZERO, vec![disc(DVec2::splat(4.0), 2.6)]).expect("a scene");
    (scene, Motion::scale([0], DVec2::splat(4.0)))
}

/// In a flat world, visible points of a rotating disc all move to one side, except for its silhouettes, which
/// are at rest: following any of the points moves both silhouettes.
#[test]
fn rotation_is_biased_on_a_turning_disc_in_a_flat_world() {
    let corner = |i: i32| DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / 96.0);
    let disc = transport::Shape::closed((0..96).map(corner), transport::Material::emitter(1.0));
    let world = World::new(0.0, vec![disc]).expect("a world");
    let film = transport::Film { pixels: 8, filter: Filter::Tent };
    let camera = Camera { position: DVec2::new(0.0, 4.0), angle: -1.5, field_of_view: 0.8, film };
    let change = Tangent::rotate(&world, [0], DVec2::ZERO);
    let paths = Paths { bounces: 0, ..Paths::default() };
    let exact = transport::exact::Exact { bounces: 0, ..Default::default() };
    let exact = exact.gradient(&world, &camera, &change).expect("differentiable").pixels;
    let grows = Tangent::moving(&world, [0], |p| p);
    let integral = transport::exact::Exact { bounces: 0, ..Default::default() };
    let grown = integral.gradient(&world, &camera, &grows).expect("differentiable").pixels;
    let grown: Vec<f64> = grown.iter().map(|terms| terms.total()).collect();
    let mut power = Power::of("known_biases::rotation_is_biased_on_a_turning_disc_in_a_flat_world");
    let mut worst = |name, construction, samples| {
        let method = PathWarpedArea { samples, paths, construction, ..PathWarpedArea::default() };
        let found = method.forward(&world, &camera, &change).expect("valid");
        let off = found.total().into_iter().zip(&exact).map(|(found, exact)| found - exact.total());
        let pixels: Vec<(f64, f64)> = off.zip(found.standard_error.total.iter().copied()).collect();
        leaked(&mut power, name, &pixels, &grown)
    };
    let rotation = worst("in a flat world, rotation", PathConstruction::Followed { candidates: 4 }, 64_000);
    // Its tails are heavy: many samples are needed to confirm a zero.
    let warped = if thorough() {
        worst("in a flat world, warped area", PathConstruction::default(), 900_000)
    } else {
        worst("in a flat world, harmonic field", PathConstruction::Harmonic, 16_000)
    };
    assert!(rotation > suite_threshold() && warped < suite_threshold(), "{rotation} {warped}");
}

#[test]
fn the_gaussian_field_loses_about_half_of_every_silhouette() {
    let (scene, motion) = growing_disc();
    let exact = Exact.forward(&scene, &motion, &film()).expect("differentiable").mean;
    let attenuation = |rays| {
        let debias = Debias::Consistent { rays };
        let warp = Warp { weighting: Weighting::Gaussian, radial_exponent: 1.0, debias, ..Warp::default() };
        let method = WarpedArea { samples: 2000, construction: warp.into(), ..WarpedArea::default() };
        slope(&method.forward(&scene, &motion, &film()).expect("valid").mean, &exact)
    };
    let (few, many) = (attenuation(8), attenuation(128));
    println!("Gaussian field: slope {few:.3} with 8 rays, {many:.3} with 128");
    // At the silhouette half of the kernel moves and half is at rest.
    assert!((0.35..0.65).contains(&few) && (0.35..0.65).contains(&many), "{few} {many}");
}

#[test]
fn below_its_bound_gamma_is_biased_whatever_the_number_of_rays() {
    let (scene, motion) = growing_disc();
    let exact = Exact.forward(&scene, &motion, &film()).expect("differentiable").mean;
    let slope = |gamma: f64, rays| {
        let boundary = BoundaryFunction::KernelScaled { scale: 0.6 };
        let weighting = Weighting::BoundaryAware { gamma, boundary };
        let warp = Warp { weighting, debias: Debias::Consistent { rays }, ..Warp::default() };
        let method = WarpedArea { samples: 500, construction: warp.into(), ..WarpedArea::default() };
        slope(&method.forward(&scene, &motion, &film()).expect("valid").mean, &exact)
    };
    // The bound is 3/2 for B linear in the distance.
    let [below, above] = [1.0, 3.0].map(|gamma| {
        let (few, many) = (slope(gamma, 32), slope(gamma, 256));
        println!("γ = {gamma}: slope {few:.3} with 32 rays, {many:.3} with 256");
        many
    });
    assert!(below < 0.85 && above > 0.96, "{below} {above}");
}
