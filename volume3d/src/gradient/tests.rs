//! The simplest scenes with known answers.

use flatland::random::{open01, stream};
use flatland::warp::{Debias, Warp};
use glam::{DAffine3, DQuat, DVec3};
use rayon::prelude::*;

use super::*;
use crate::geometry::Mesh;
use crate::scene::{Camera, Description, Environment, Film, Filter, Integrator, Light, Material, Scene};

/// Independent runs of statistical tests.
const SHARED_RUNS: u64 = 2048;

/// The mean of independent runs, and its standard error.
fn statistics(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (spread / (n - 1.0) / n).sqrt())
}

pub(super) fn film(width: usize, filter: Filter) -> Film {
    Film { width, height: width, crop: None, filter }
}

pub(super) fn filters() -> [Filter; 3] {
    [Filter::Box, Filter::Tent { radius: 1.0 }, Filter::Gaussian { deviation: 0.5 }]
}

pub(super) fn at(x: f64, y: f64, z: f64, scale: f64) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, DVec3::new(x, y, z))
}

/// A square of radiance 2 in front of a camera that looks along −z, on radiance 0.5.
pub(super) fn square(filter: Filter) -> Scene {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 1.0);
    let mut d = Description::new(camera, film(6, filter));
    d.add_emitter("square", Mesh::rectangle().transformed(&at(0.05, -0.02, -3.0, 0.7)), DVec3::splat(2.0));
    let radiance = DVec3::splat(0.5);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    Scene::new(d).unwrap()
}

/// A room with a lamp and a block, some walls glossy, some smooth.
pub(super) fn room(filter: Filter) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.1, 0.2, 2.5), DVec3::ZERO, DVec3::Y, 0.9);
    let mut d = Description::new(camera, film(6, filter));
    d.integrator = Integrator { max_depth: Some(4), rr_depth: 3 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.7, 0.6, 0.5)));
    let glossy = d.add_material(Material {
        id: "glossy".to_owned(),
        bsdf: crate::scene::Bsdf::RoughConductor {
            distribution: crate::scene::Microfacets::Ggx,
            alpha: 0.3,
            eta: DVec3::new(0.2, 0.9, 1.1),
            k: DVec3::new(3.9, 2.4, 2.2),
            specular_reflectance: crate::scene::Reflectance::Constant(DVec3::splat(0.9)),
        },
        two_sided: true,
    });
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, -1.0, 0.0, 1.5) * down())), white);
    d.add_shape("back", Mesh::rectangle().transformed(&at(0.0, 0.0, -1.0, 1.5)), glossy);
    d.add_shape("block", Mesh::cube().smooth().transformed(&at(0.1, -0.5, 0.0, 0.3)), white);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&(at(0.0, 1.0, 0.0, 0.4) * up())), DVec3::splat(5.0));
    let radiance = DVec3::new(0.2, 0.3, 0.4);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    Scene::new(d).unwrap()
}

pub(super) fn up() -> DAffine3 {
    DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2)
}

pub(super) fn down() -> DAffine3 {
    DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2)
}

pub(super) fn random_tangent(scene: &Scene, seed: u64) -> Tangent {
    let mut rng = stream(seed, &[]);
    let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
    let mut change = Tangent::still(scene);
    change.positions.iter_mut().for_each(|p| *p = random());
    change.reflectance.iter_mut().for_each(|p| *p = random());
    change.roughness.iter_mut().for_each(|p| *p = random().x);
    change.radiance.iter_mut().for_each(|p| *p = random());
    change.environment = random();
    change.camera = CameraTangent { translation: random(), rotation: random(), field_of_view: random().x };
    change
}

/// Independent runs behind a mean and its error.
pub(super) const RUNS: u64 = 64;

/// How many standard errors a mean may be off: what Student's distribution with [`RUNS`] − 1 degrees of freedom exceeds
/// as rarely as the normal one the 6.49 of the integration tests' threshold.
pub(super) const LIMIT: f64 = 7.8;

/// The mean of the sum of all pixels over runs with seeds of their own, and its standard error.
pub(super) fn total(run: impl Fn(u64) -> Vec<DVec3> + Send + Sync) -> (f64, f64) {
    let sums: Vec<f64> =
        (0..RUNS).into_par_iter().map(|s| run(s).iter().map(|p| p.element_sum()).sum()).collect();
    let n = RUNS as f64;
    let mean = sums.iter().sum::<f64>() / n;
    let squares: f64 = sums.iter().map(|s| (s - mean).powi(2)).sum();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// What one test compares: what is off, and the smallest relative bias that it rejects, which may not exceed 15% in any
/// comparison. It prints a row of the README's table of power.
pub(super) struct Comparisons {
    test: &'static str,
    rows: Vec<(String, f64)>,
    failures: Vec<String>,
}

impl Comparisons {
    pub(super) fn of(test: &'static str) -> Self {
        Self { test, rows: vec![], failures: vec![] }
    }

    /// A mean against its reference. What may be noticed is relative to `scale`: the reference, or the terms that cancel
    /// in it. Where nothing cancels, the same mean less 15% must be rejected.
    pub(super) fn add(
        &mut self,
        name: String,
        found: (f64, f64),
        reference: (f64, f64),
        slack: f64,
        scale: f64,
    ) {
        let tolerance = LIMIT * found.1.hypot(reference.1) + slack;
        let off = (found.0 - reference.0).abs();
        let power = tolerance / scale.abs();
        println!(
            "{name}: {found:?} for {reference:?}, off by {off:.2e} of {tolerance:.2e}, rejects {power:.3}"
        );
        let cancels = reference.0.abs() < 0.9 * scale.abs();
        let less = (0.85 * found.0 - reference.0).abs() > tolerance;
        let right = off <= tolerance && power <= 0.15 && (cancels || less);
        if !right {
            self.failures
                .push(format!("{name}: {found:?} for {reference:?}, rejects {power:.3} of {scale:.3}"));
        }
        self.rows.push((name, power));
    }

    /// What is wrong on purpose must be rejected.
    pub(super) fn reject(&mut self, name: &str, found: (f64, f64), reference: (f64, f64)) {
        let z = (found.0 - reference.0).abs() / found.1.hypot(reference.1);
        println!("control {name}: {found:?} for {reference:?}, z {z:.1}");
        if z.is_nan() || z <= LIMIT {
            self.failures.push(format!("the control {name} was not rejected: {found:?} for {reference:?}"));
        }
    }

    pub(super) fn finish(self) {
        let (name, power) = self.rows.iter().max_by(|a, b| a.1.total_cmp(&b.1)).expect("a comparison");
        println!("power | volume3d::{} | {} | {:.1} % | {name} |", self.test, self.rows.len(), 100.0 * power);
        assert!(self.failures.is_empty(), "{:?}", self.failures);
    }
}

/// Whether the environment asks for everything, as the integration tests have it.
pub(super) fn thorough() -> bool {
    std::env::var("WARPED_AREA_TESTS").is_ok_and(|effort| effort == "thorough")
}

/// Σ |term| of the sum of all pixels.
pub(super) fn terms(image: &GradientImage) -> f64 {
    let terms = image.terms.as_ref().expect("asked for");
    let sum = |term: &[DVec3]| term.iter().map(|p| p.element_sum()).sum::<f64>().abs();
    sum(&terms.interior) + sum(&terms.primary) + sum(&terms.secondary)
}

/// The sum of all pixels of [`square`] is radiance times area: a scaled square's area changes at twice its rate.
pub(super) fn rate_of_square() -> f64 {
    let focal = 3.0 / 0.5_f64.tan();
    let area = (1.4 * focal / 3.0_f64).powi(2);
    // Of three equal channels.
    3.0 * 2.0 * area * 1.5
}

#[test]
fn the_edge_of_a_square_moves_its_area() {
    let mut comparisons = Comparisons::of("the_edge_of_a_square_moves_its_area");
    for filter in filters() {
        let scene = square(filter);
        let mut change = Tangent::still(&scene);
        change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
        let found = total(|seed| {
            let method = WarpedArea { samples: 16, seed, ..WarpedArea::default() };
            method.forward(&scene, &change, &Progress::none()).unwrap().gradient
        });
        // Gaussians cut off are no partition of unity: their sum over pixels is 1 to about a thousandth.
        let slack = if matches!(filter, Filter::Gaussian { .. }) { 2e-3 } else { 1e-9 };
        let exact = rate_of_square();
        comparisons.add(format!("{filter:?}"), found, (exact, 0.0), slack * exact, exact);
    }
    comparisons.finish();
}

#[test]
fn the_image_is_that_without_derivatives_bit_for_bit() {
    for filter in filters() {
        let scene = room(filter);
        let change = random_tangent(&scene, 1);
        let method = WarpedArea { samples: 3, seed: 7, ..WarpedArea::default() };
        let with = method.forward_terms(&scene, &change, &Progress::none()).unwrap();
        let without = method.forward(&scene, &Tangent::still(&scene), &Progress::none()).unwrap();
        assert_eq!(with.image, without.image);
        assert!(without.image.iter().any(|p| p.x > 0.0));
    }
}

/// Of the three terms the interior one knows of no warp and of no jump that moves, the borders of emitters included.
#[test]
fn the_interior_term_is_what_is_left_without_warps() {
    let scene = room(Filter::Tent { radius: 1.0 });
    let change = random_tangent(&scene, 5);
    let method = WarpedArea { samples: 3, seed: 7, control_variate: 0, ..WarpedArea::default() };
    let terms = method.forward_terms(&scene, &change, &Progress::none()).unwrap();
    let interior = &terms.terms.as_ref().unwrap().interior;
    let alone = WarpedArea { warps: false, ..method }.forward(&scene, &change, &Progress::none()).unwrap();
    let scale = alone.gradient.iter().map(|g| g.abs().max_element()).fold(0.0, f64::max);
    assert!(scale > 0.0);
    for (with, without) in interior.iter().zip(&alone.gradient) {
        assert!((*with - *without).abs().max_element() <= 1e-12 * scale, "{with} {without}");
    }
}

/// At the optimum of a squared loss the mean gradient is 0: its image and its derivative must not share samples. The
/// image that comes with a gradient of the same seed does, and is the control.
#[test]
fn an_image_and_a_gradient_of_one_seed_are_independent() {
    let scene = room(Filter::Tent { radius: 1.0 });
    let none = Progress::none();
    let mut active = ActiveParameters::nothing(&scene);
    active.materials[0] = true;
    let slope = |seed: u64, image: &[DVec3]| {
        let target = render(&scene, 1, seed + 10_000, &none).unwrap();
        let adjoint: Vec<DVec3> = image.iter().zip(&target.pixels).map(|(i, t)| 2.0 * (*i - *t)).collect();
        let method = WarpedArea { samples: 1, seed, ..WarpedArea::default() };
        method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.reflectance[0].element_sum()
    };
    let shared = |seed| {
        let method = WarpedArea { samples: 1, seed, ..WarpedArea::default() };
        method.forward(&scene, &Tangent::still(&scene), &none).unwrap().image
    };
    let plain = |seed| render(&scene, 1, seed, &none).unwrap().pixels;
    let slopes = |image: &dyn Fn(u64) -> Vec<DVec3>| -> Vec<f64> {
        (0..SHARED_RUNS).map(|seed| slope(seed, &image(seed))).collect()
    };
    let (mean, error) = statistics(&slopes(&plain));
    let (control, noise) = statistics(&slopes(&shared));
    println!("{mean} ± {error}, with shared samples {control} ± {noise}; sees a bias of {}", 8.0 * error);
    assert!(mean.abs() < 4.0 * error, "{mean} ± {error}");
    assert!(control > 8.0 * error + 4.0 * noise, "the control: {control} ± {noise}");
}

/// A block of smooth normals, whose faces are far from them: many directions that its points shade are below their
/// faces, and auxiliary rays there leave the block at once, through the next face. Points slide over it as the film's
/// warp moves them. Debiased rays must find what the mean over jumps finds, with errors of the same size.
#[test]
fn rays_below_a_face_do_no_harm() {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.7);
    let mut d = Description::new(camera, film(6, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(2), rr_depth: 5 };
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.8)));
    let turned = DAffine3::from_rotation_x(0.6) * DAffine3::from_rotation_y(0.5);
    d.add_shape("block", Mesh::cube().smooth().transformed(&(at(0.1, 0.05, -3.0, 0.5) * turned)), white);
    let radiance = DVec3::new(0.6, 1.0, 0.8);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::X);
    let totals = |method: &WarpedArea| {
        let runs: Vec<f64> = (0..32)
            .map(|seed| {
                let method = WarpedArea { samples: 32, seed, ..method.clone() };
                let image = method.forward(&scene, &change, &Progress::none()).unwrap();
                image.gradient.iter().enumerate().map(|(i, g)| g.element_sum() * (i % 6) as f64).sum()
            })
            .collect();
        statistics(&runs)
    };
    let (exact, error) = totals(&WarpedArea::default());
    let (rays, noise) = totals(&WarpedArea { field: Field::AuxiliaryRays, ..WarpedArea::default() });
    println!(
        "mean over jumps {exact} ± {error}, rays {rays} ± {noise}; sees a bias of {}",
        8.0 * error.hypot(noise)
    );
    assert!((exact - rays).abs() < 4.0 * error.hypot(noise), "{exact} ± {error}, {rays} ± {noise}");
    assert!(noise < 3.0 * error, "{noise} {error}");
}

/// The stated errors of totals and blocks are the scatter over seeds; the root of the sum of squares of pixels' errors is
/// not.
#[test]
fn errors_of_totals_are_the_scatter_over_seeds() {
    let mut d = room(Filter::Tent { radius: 1.0 }).description().clone();
    d.film = film(12, Filter::Tent { radius: 1.0 });
    d.integrator.max_depth = Some(2);
    let scene = Scene::new(d).unwrap();
    let (mut white, mut moves) = (Tangent::still(&scene), Tangent::still(&scene));
    white.reflectance[0] = DVec3::ONE;
    moves.translate(&scene, 2, DVec3::X);
    let none = Progress::none();
    let warped =
        |seed| WarpedArea { samples: 16, seed, ..WarpedArea::default() }.forward(&scene, &white, &none);
    let edges =
        |seed| EdgeSampling { samples: 4, primary: 4, secondary: 4, seed }.forward(&scene, &moves, &none);
    let check = |name: &str, differs: bool, run: &dyn Fn(u64) -> Result<GradientImage, GradientError>| {
        let images: Vec<GradientImage> = (0..500).map(|seed| run(seed).unwrap()).collect();
        let n = images.len() as f64;
        let mean = |f: &dyn Fn(&GradientImage) -> f64| images.iter().map(f).sum::<f64>() / n;
        let scatter = |f: &dyn Fn(&GradientImage) -> f64| {
            let centre = mean(f);
            mean(&|i| (f(i) - centre).powi(2)) * n / (n - 1.0)
        };
        // The scatter is known to 6 % (500 seeds), the stated to 2 % (500 times 7 degrees of freedom), or twice that
        // where tails are longer than a normal's: 30 % is what is seen.
        let ratios = [
            mean(&|i| i.regions.total_error.x.powi(2)) / scatter(&|i| i.regions.total.x),
            mean(&|i| i.regions.sum_error.powi(2)) / scatter(&|i| i.regions.total.element_sum()),
            mean(&|i| i.regions.block_errors[0].y.powi(2)) / scatter(&|i| i.regions.blocks[0].y),
        ];
        let naive = mean(&|i| i.standard_error.iter().map(|e| e.x * e.x).sum::<f64>());
        let naive = naive / scatter(&|i| i.regions.total.x);
        println!("{name}: stated variance over scatter {ratios:?}, from pixels {naive}; sees 30 %");
        assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.3), "{name}: {ratios:?}");
        // The control.
        assert!(!differs || !(0.5..2.0).contains(&naive), "{name}: pixels would do: {naive}");
        let image = &images[0];
        let sum: f64 = image.gradient.iter().map(|g| g.x).sum();
        assert!((sum - image.regions.total.x).abs() < 1e-9 * sum.abs());
        let corner: f64 = (0..64).map(|k| image.gradient[k / 8 * 12 + k % 8].y).sum();
        assert!((corner / 64.0 - image.regions.blocks[0].y).abs() < 1e-9 && image.regions.blocks.len() == 4);
    };
    check("warped area", true, &warped);
    check("edge sampling", true, &edges);
}

#[test]
fn an_outlier_is_one_sample_of_many_with_much_of_the_result() {
    let scene = square(Filter::Box);
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::X);
    let method = WarpedArea { samples: 16, ..WarpedArea::default() };
    let mut image = method.forward(&scene, &change, &Progress::none()).unwrap();
    let largest = image.largest.unwrap();
    assert!(
        image.outlier().is_none() && image.largest_share() > 0.0 && largest.among == 64 * 16,
        "{largest:?}"
    );
    let whole: f64 = image.gradient.iter().map(|g| g.abs().element_sum()).sum();
    image.largest = Some(Contribution { amount: 0.3 * whole, ..largest });
    assert!(image.outlier().is_some() && (image.largest_share() - 0.3).abs() < 1e-12);
    image.largest = Some(Contribution { amount: 0.3 * whole, among: 600, ..largest });
    assert!(image.outlier().is_none(), "few samples have much each");
}

#[test]
fn forward_and_reverse_are_transposes() {
    for (k, filter) in filters().into_iter().enumerate() {
        let scene = room(filter);
        let change = random_tangent(&scene, k as u64);
        let mut rng = stream(5, &[]);
        let adjoint: Vec<DVec3> =
            (0..36).map(|_| DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5))).collect();
        let rays = |debias| WarpedArea {
            field: Field::AuxiliaryRays,
            warp: Warp { debias, ..Warp::default() },
            ..WarpedArea::default()
        };
        for method in [WarpedArea::default(), rays(Debias::Consistent { rays: 4 }), rays(Debias::default())] {
            let method = WarpedArea { samples: 4, ..method };
            let image = method.forward(&scene, &change, &Progress::none()).unwrap();
            let terms = method.forward_terms(&scene, &change, &Progress::none()).unwrap();
            let active = ActiveParameters::everything(&scene);
            let gradient = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
            let pair = |g: &[DVec3]| g.iter().zip(&adjoint).map(|(a, b)| a.dot(*b)).sum::<f64>();
            let (forward, reverse) = (pair(&image.gradient), gradient.dot(&change));
            let split = pair(&terms.gradient);
            assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
            let rotation = Rotation { samples: 4, ..Rotation::default() };
            let rotated = rotation.forward(&scene, &change, &Progress::none()).unwrap();
            let pulled = rotation.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
            let (a, b) = (pair(&rotated.gradient), pulled.dot(&change));
            assert!((a - b).abs() < 1e-9 * a.abs().max(1.0), "rotation: {a} {b}");
            assert!((forward - split).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {split}");
        }
    }
}

#[test]
fn a_closed_white_box_glows_as_the_series_says() {
    // Everything emits e and reflects a: radiance e/(1 − a).
    let camera = Camera::look_at(DVec3::new(0.2, 0.1, 0.3), DVec3::X, DVec3::Y, 1.2);
    let mut d = Description::new(camera, film(4, Filter::Box));
    d.integrator = Integrator { max_depth: None, rr_depth: 5 };
    let material = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    // Turned inside out, so that the inside is the front.
    let cube = Mesh::cube();
    let inside = cube.triangles().iter().map(|t| [t[0], t[2], t[1]]).collect();
    let shape = d.add_shape("box", Mesh::new(cube.positions().to_vec(), inside).unwrap(), material);
    d.shapes[shape].radiance = Some(DVec3::ONE);
    let image = render(&Scene::new(d).unwrap(), 400, 0, &Progress::none()).unwrap();
    for (pixel, error) in image.pixels.iter().zip(&image.standard_error) {
        assert!((pixel.x - 2.0).abs() < 5.0 * error.x && error.x < 0.05, "{pixel} ± {error}");
    }
}

/// What moves before an ideal mirror, and a light without extent that moves, are errors, forward and in reverse.
#[test]
fn what_no_warp_sees_is_refused() {
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, DVec3::Y, 0.8);
    let mut d = Description::new(camera, film(4, Filter::Box));
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    d.add_shape("floor", Mesh::rectangle().transformed(&down()), grey);
    let mut lit = d.clone();
    let (position, intensity) = (DVec3::new(0.3, 2.0, 0.1), DVec3::ONE);
    lit.lights.push(Light::Point { id: "bulb".to_owned(), position, intensity });
    let lit = Scene::new(lit).unwrap();
    d.materials[grey].bsdf = crate::scene::Bsdf::Conductor {
        eta: DVec3::ONE,
        k: DVec3::ONE,
        specular_reflectance: crate::scene::Reflectance::Constant(DVec3::ONE),
    };
    let mirror = Scene::new(d).unwrap();
    let refuses = |scene: &Scene, change: &Tangent, active: &ActiveParameters, unsupported: &Unsupported| {
        let (adjoint, none) = (vec![DVec3::ONE; 16], Progress::none());
        let (warped, edges) = (WarpedArea::default(), EdgeSampling::default());
        let found = [
            warped.forward(scene, change, &none).err(),
            edges.forward(scene, change, &none).err(),
            warped.reverse(scene, &adjoint, active, &none).err(),
            edges.reverse(scene, &adjoint, active, &none).err(),
        ];
        for error in found {
            assert_eq!(error, Some(GradientError::Unsupported(unsupported.clone())));
        }
    };
    let (mut moves, mut shape) = (Tangent::still(&mirror), ActiveParameters::nothing(&mirror));
    moves.translate(&mirror, 0, DVec3::Y);
    shape.shapes[0] = true;
    let reflects = Unsupported::Mirror { shape: "floor".to_owned(), material: "grey".to_owned() };
    refuses(&mirror, &moves, &shape, &reflects);
    let (mut poses, mut active) = (Tangent::still(&lit), ActiveParameters::nothing(&lit));
    poses.pose[0] = DVec3::X;
    active.poses = true;
    refuses(&lit, &poses, &active, &Unsupported::Delta { light: "bulb".to_owned() });
    // Its intensity moves no shadow.
    active.poses = false;
    active.lights = true;
    let result = WarpedArea::default().reverse(&lit, &[DVec3::ONE; 16], &active, &Progress::none());
    assert!(result.is_ok_and(|g| g.by_parameter.intensity[0].min_element() > 0.0));
}
