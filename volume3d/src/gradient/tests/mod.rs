//! Tests of gradients on simple scenes with known answers.

mod camera;
mod chains;
mod coincident;
pub(crate) mod comparisons;
mod cut;
mod differences;
mod exact;
mod far;
mod filters;
mod hidden;
mod images;
mod lens;
mod materials;
mod media;
mod missing;
mod mixtures;
mod moving_lights;
mod pilot;
mod pixel_borders;
pub(crate) mod scenes;
mod slivers;
mod softened;
mod tails;
mod textured_lights;

use flatland::sdf::shapes::{Ball, SmoothUnion};
use glam::{DAffine3, DVec3};

use super::*;
use crate::Image;
use crate::geometry::Mesh;
use crate::scene::{Camera, Description, Environment, Filter, Integrator, Material, Scene};

pub(super) use comparisons::{Comparisons, statistics, terms, thorough, total};
pub(super) use scenes::{
    at, down, film, filters, random_adjoint, random_tangent, rate_of_square, room, square, up,
};

/// Independent runs of the statistical test.
const SHARED_RUNS: u64 = 2048;

#[test]
fn the_edge_of_a_square_moves_its_area() {
    let mut comparisons = Comparisons::of("the_edge_of_a_square_moves_its_area");
    for filter in filters() {
        let scene = square(filter);
        let mut change = Tangent::still(&scene);
        change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
        let found = total(|seed| {
            let method = WarpedArea { samples: 16, seed, ..WarpedArea::default() };
            method.forward(&scene, &change, &Progress::none()).unwrap().gradient.pixels
        });
        // Truncated Gaussians are not a partition of unity: their sum over pixels is 1 to about a thousandth.
        let slack = if matches!(filter, Filter::Gaussian { .. }) { 2e-3 } else { 1e-9 };
        let exact = rate_of_square();
        comparisons.add(format!("{filter:?}"), found, (exact, 0.0), slack * exact, exact);
    }
    comparisons.finish();
}

/// At the optimum of a squared loss the mean gradient is 0 only if the image and its derivative do not share
/// samples. Control: the image computed with a gradient of the same seed, which shares them.
#[test]
fn an_image_and_a_gradient_of_one_seed_are_independent() {
    let scene = room(Filter::Tent { radius: 1.0 });
    let none = Progress::none();
    let mut active = ActiveParameters::nothing(&scene);
    active.materials[0] = true;
    let slope = |seed: u64, image: &Image| {
        let target = render(&scene, 1, seed + 10_000, &none).unwrap();
        let pixels = image.pixels.iter().zip(&target.image.pixels).map(|(i, t)| 2.0 * (*i - *t)).collect();
        let adjoint = image.with_pixels(pixels);
        let method = WarpedArea { samples: 1, seed, ..WarpedArea::default() };
        method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.reflectance[0].element_sum()
    };
    let shared = |seed| {
        let method = WarpedArea { samples: 1, seed, ..WarpedArea::default() };
        method.forward(&scene, &Tangent::still(&scene), &none).unwrap().image
    };
    let plain = |seed| render(&scene, 1, seed, &none).unwrap().image;
    let slopes = |image: &dyn Fn(u64) -> Image| -> Vec<f64> {
        (0..SHARED_RUNS).map(|seed| slope(seed, &image(seed))).collect()
    };
    let (mean, error) = statistics(&slopes(&plain));
    let (control, noise) = statistics(&slopes(&shared));
    println!("{mean} ± {error}, with shared samples {control} ± {noise}; sees a bias of {}", 8.0 * error);
    assert!(mean.abs() < 4.0 * error, "{mean} ± {error}");
    assert!(control > 8.0 * error + 4.0 * noise, "the control: {control} ± {noise}");
}

/// A mesh and two implicit surfaces, one of which is concave; any of them moves, or the camera, or nothing.
#[test]
fn images_do_not_depend_on_what_moves() {
    let mut d = Description::new(
        Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.9),
        film(12, Filter::Tent { radius: 1.0 }),
    );
    d.integrator = Integrator { max_depth: Some(3), rr_depth: 5 };
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.8)));
    d.add_shape("block", Mesh::cube().transformed(&at(0.5, 0.1, -4.0, 0.4)), white);
    let ball = |x: f64, y: f64, z: f64, radius: f64| Ball::new(DVec3::new(x, y, z), radius).unwrap();
    let waist = SmoothUnion::new(ball(-0.7, 0.1, -3.5, 0.4), ball(0.2, -0.3, -3.2, 0.35), 0.3).unwrap();
    d.add_implicit("waist", waist, white);
    d.add_implicit("ball", ball(-0.2, 0.7, -3.8, 0.3), white);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
    let scene = Scene::new(d).unwrap();
    let mut changes = [(); 4].map(|()| Tangent::still(&scene));
    changes[1].translate(&scene, 0, DVec3::X);
    changes[2].implicits[0].translation = DVec3::Y;
    changes[3].camera.translation = DVec3::X;
    let method = WarpedArea { samples: 16, ..WarpedArea::default() };
    let image = |change: &Tangent| method.forward(&scene, change, &Progress::none()).unwrap().image.pixels;
    let still = image(&changes[0]);
    assert!(changes[1..].iter().all(|change| image(change) == still));
}

/// A block with smooth shading normals that deviate far from its faces: many shading directions are below the
/// faces, and auxiliary rays in such directions leave the block at once through the next face. Shading points
/// slide over it with the film's warp. Debiased auxiliary rays must agree with the mean over discontinuities,
/// with errors of the same size.
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
                image.gradient.pixels.iter().enumerate().map(|(i, g)| g.element_sum() * (i % 6) as f64).sum()
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

/// Standard errors of totals, blocks and pixels equal the standard deviation over seeds. For totals, the root
/// of the sum of the squared errors of pixels does not.
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
    let edges = |seed| {
        EdgeSampling { samples: 4, primary: 4, secondary: 4, bounces: 4, seed, allow_missing: vec![] }
            .forward(&scene, &moves, &none)
    };
    let check = |name: &str, differs: bool, run: &dyn Fn(u64) -> Result<GradientImage, GradientError>| {
        let images: Vec<GradientImage> = (0..500).map(|seed| run(seed).unwrap()).collect();
        let n = images.len() as f64;
        let mean = |f: &dyn Fn(&GradientImage) -> f64| images.iter().map(f).sum::<f64>() / n;
        let scatter = |f: &dyn Fn(&GradientImage) -> f64| {
            let centre = mean(f);
            mean(&|i| (f(i) - centre).powi(2)) * n / (n - 1.0)
        };
        let of_channel = |k: usize, c: usize| scatter(&|i| i.gradient.pixels[k][c]);
        let of_pixels: f64 = (0..144).map(|k| (0..3).map(|c| of_channel(k, c)).sum::<f64>()).sum();
        // The variance over seeds is known to 6 % (500 seeds), the estimated variance to 2 % (500 times 7
        // degrees of freedom), or twice that with tails heavier than normal: the test detects 30 %.
        let ratios = [
            mean(&|i| i.regions.total_error.x.powi(2)) / scatter(&|i| i.regions.total.x),
            mean(&|i| i.regions.sum_error.powi(2)) / scatter(&|i| i.regions.total.element_sum()),
            mean(&|i| i.regions.block_errors[0].y.powi(2)) / scatter(&|i| i.regions.blocks[0].y),
            mean(&|i| i.standard_error.pixels.iter().map(|e| e.length_squared()).sum::<f64>()) / of_pixels,
        ];
        let naive = mean(&|i| i.standard_error.pixels.iter().map(|e| e.x * e.x).sum::<f64>());
        let naive = naive / scatter(&|i| i.regions.total.x);
        println!("{name}: stated variance over scatter {ratios:?}, from pixels {naive}; sees 30 %");
        assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.3), "{name}: {ratios:?}");
        // Control: the estimate from the errors of pixels is wrong.
        assert!(!differs || !(0.5..2.0).contains(&naive), "{name}: pixels would do: {naive}");
        let image = &images[0];
        let sum: f64 = image.gradient.pixels.iter().map(|g| g.x).sum();
        assert!((sum - image.regions.total.x).abs() < 1e-9 * sum.abs());
        let corner: f64 = (0..64).map(|k| image.gradient.pixels[k / 8 * 12 + k % 8].y).sum();
        assert!((corner / 64.0 - image.regions.blocks[0].y).abs() < 1e-9 && image.regions.blocks.len() == 4);
    };
    check("warped area", true, &warped);
    check("edge sampling", true, &edges);
}

/// Standard errors of pixels whose noise comes from curve samples alone equal the standard deviation over
/// seeds.
#[test]
fn errors_of_curves_are_the_scatter_over_seeds() {
    let scene = square(Filter::Tent { radius: 1.0 });
    let mut change = Tangent::still(&scene);
    change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
    let images: Vec<GradientImage> = (0..500)
        .map(|seed| {
            let [primary, secondary, bounces] = [16, 1, 1];
            let method =
                EdgeSampling { samples: 16, primary, secondary, bounces, seed, allow_missing: vec![] };
            method.forward(&scene, &change, &Progress::none()).unwrap()
        })
        .collect();
    let (mut stated, mut scatter) = (0.0, 0.0);
    for k in 0..images[0].gradient.pixels.len() {
        let values: Vec<f64> = images.iter().map(|i| i.gradient.pixels[k].x).collect();
        scatter += statistics(&values).1.powi(2) * 500.0;
        stated += images.iter().map(|i| i.standard_error.pixels[k].x.powi(2)).sum::<f64>() / 500.0;
    }
    println!("stated variance {stated}, scatter {scatter}; sees 30 %");
    assert!(scatter > 0.0 && (stated / scatter - 1.0).abs() < 0.3, "{stated} for {scatter}");
}

/// All surfaces emit e and reflect a: radiance e/(1 − a). Russian roulette begins late, when few paths are
/// left, or at once; then the test detects a bias of 2 % in the weight of the surviving paths.
#[test]
fn a_closed_white_box_glows_as_the_series_says() {
    let camera = Camera::look_at(DVec3::new(0.2, 0.1, 0.3), DVec3::X, DVec3::Y, 1.2);
    let mut d = Description::new(camera, film(4, Filter::Box));
    let material = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    // Turned inside out, so that the inside is the front.
    let cube = Mesh::cube();
    let inside = cube.triangles().iter().map(|t| [t[0], t[2], t[1]]).collect();
    let shape = d.add_shape("box", Mesh::new(cube.positions().to_vec(), inside).unwrap(), material);
    d.shapes[shape].radiance = Some(DVec3::ONE);
    for (rr_depth, samples) in [(5, 400), (1, 6400)] {
        d.integrator = Integrator { max_depth: None, rr_depth };
        let rendering = render(&Scene::new(d.clone()).unwrap(), samples, 0, &Progress::none()).unwrap();
        let errors = &rendering.standard_error.pixels;
        for (pixel, error) in rendering.image.pixels.iter().zip(errors) {
            assert!((pixel.x - 2.0).abs() < 5.0 * error.x && error.x < 0.05, "{pixel} ± {error}");
        }
        let mean = rendering.image.pixels.iter().map(|p| p.x).sum::<f64>() / 16.0;
        let error = errors.iter().map(|e| e.x * e.x).sum::<f64>().sqrt() / 16.0;
        println!("roulette from {rr_depth}: {mean} ± {error}");
        assert!((mean - 2.0).abs() < 5.0 * error, "{mean} ± {error}");
        // A loss of 2 % from the first bounce on would give 1/(1 − .49).
        assert!(rr_depth > 1 || 10.0 * error < 0.04, "± {error}");
    }
}

#[test]
fn an_image_without_samples_is_refused() {
    let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 1.2);
    let scene = Scene::new(Description::new(camera, film(4, Filter::Box))).unwrap();
    let error = render(&scene, 0, 0, &Progress::none()).unwrap_err();
    assert_eq!(error, GradientError::Samples { samples: 0, least: 1 });
}

/// Behind a black wall a path has throughput 0, but its derivative by the wall's reflectance is the radiance
/// arriving there, with the contributions of all walls that light it. Russian roulette, which depends on the
/// throughput, must not end such paths.
#[test]
fn russian_roulette_spares_paths_behind_black_walls() {
    let room = |rr_depth| {
        let camera = Camera::look_at(DVec3::new(0.0, 0.0, 0.5), DVec3::NEG_Z, DVec3::Y, 0.5);
        let mut d = Description::new(camera, film(2, Filter::Box));
        d.integrator = Integrator { max_depth: Some(12), rr_depth };
        let black = d.add_material(Material::diffuse("black", DVec3::ZERO));
        let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.7)));
        let cube = Mesh::cube();
        let inside = cube.triangles().iter().map(|t| [t[0], t[2], t[1]]).collect();
        d.add_shape("walls", Mesh::new(cube.positions().to_vec(), inside).unwrap(), grey);
        d.add_shape("wall", Mesh::rectangle().transformed(&at(0.0, 0.0, -0.9, 1.0)), black);
        d.shapes.iter_mut().for_each(|shape| shape.radiance = Some(DVec3::ONE));
        Scene::new(d).unwrap()
    };
    let derivative = |rr_depth| {
        let scene = room(rr_depth);
        total(|seed| {
            let mut change = Tangent::still(&scene);
            change.reflectance[0] = DVec3::ONE;
            let method = WarpedArea { samples: 64, seed, ..WarpedArea::default() };
            method.forward(&scene, &change, &Progress::none()).unwrap().gradient.pixels
        })
    };
    let mut comparisons = Comparisons::of("russian_roulette_spares_paths_behind_black_walls");
    let (found, reference) = (derivative(2), derivative(100));
    comparisons.add("rr_depth 2".to_owned(), found, reference, 0.0, reference.0);
    // If paths ended there, the result would be the walls' emission alone.
    comparisons.reject("emission alone", (12.0, 0.0), reference);
    comparisons.finish();
}

/// Every reverse mode refuses an adjoint of another size, or with a pixel that is not finite, by its place.
#[test]
fn bad_adjoints_are_refused() {
    let scene = square(Filter::Box);
    let (active, none) = (ActiveParameters::everything(&scene), Progress::none());
    let (width, height) = scene.size();
    for name in Estimator::METHODS.into_iter().filter(|name| *name != "finite-difference") {
        let estimator = Estimator::by_name(name, 1, 0).unwrap();
        for bad in [f64::NAN, f64::NEG_INFINITY] {
            let mut adjoint = Image::constant(width, height, DVec3::ONE);
            adjoint.pixels[2 * width + 1].y = bad;
            let error = estimator.reverse(&scene, &adjoint, &active, &none).unwrap_err();
            let GradientError::NonFiniteAdjoint { x: 1, y: 2, value } = error else {
                panic!("{name}: {error}");
            };
            assert_eq!(value.to_array().map(f64::to_bits), [1.0, bad, 1.0].map(f64::to_bits));
        }
        let larger = Image::constant(width, height + 1, DVec3::ONE);
        let error = estimator.reverse(&scene, &larger, &active, &none).unwrap_err();
        assert!(matches!(error, GradientError::Adjoint { .. }), "{name}: {error}");
    }
}
