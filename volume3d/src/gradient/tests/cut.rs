//! Films whose border cuts the filters of pixels beside it: what is known of them.

use super::*;
use crate::gradient::OnPixelBorders;
use crate::gradient::film::filter::{integral, weight};
use crate::scene::Lens;

/// Columns and rows.
const SIDE: usize = 6;
/// Of the square and of what is behind it.
const LIGHT: [f64; 2] = [2.0, 0.5];

/// From where to where the square covers columns and rows: with edges within the film, beside it and on its
/// border.
const PLACES: [[[f64; 2]; 2]; 3] =
    [[[-0.4, 5.7], [0.3, 6.2]], [[0.2, 9.0], [-5.0, 5.5]], [[0.0, 6.0], [2.5, 6.0]]];

fn every_filter() -> [Filter; 5] {
    let mitchell = Filter::Cubic { b: 1.0 / 3.0, c: 1.0 / 3.0 };
    let tent = |radius| Filter::Tent { radius };
    [tent(1.0), tent(2.3), Filter::Gaussian { deviation: 0.5 }, mitchell, Filter::Lanczos { lobes: 3 }]
}

fn cut(scene: &Scene) -> Scene {
    let mut d = scene.description().clone();
    d.film.sample_border = false;
    Scene::new(d).unwrap()
}

/// A square between these columns and rows of the film.
fn between(filter: Filter, [x, y]: [[f64; 2]; 2]) -> Scene {
    let mut d = square(filter).description().clone();
    d.film.sample_border = false;
    // One pixel is as long as this at a distance of 3.
    let pixel = 3.0 * 0.5_f64.tan() / (0.5 * SIDE as f64);
    let middle = [x, y].map(|[low, high]| 0.5 * (low + high) - 0.5 * SIDE as f64);
    let half = [x, y].map(|[low, high]| 0.5 * (high - low) * pixel);
    let place = DAffine3::from_translation(DVec3::new(middle[0] * pixel, -middle[1] * pixel, -3.0))
        * DAffine3::from_scale(DVec3::new(half[0], half[1], 1.0));
    d.shapes[0].mesh = Mesh::rectangle().transformed(&place);
    Scene::new(d).unwrap()
}

/// What the part of the film from `low` to `high` counts for pixel k along an axis, and its derivative by a
/// shift in pixels.
fn along(filter: Filter, [low, high]: [f64; 2], k: usize) -> (f64, f64) {
    let (side, centre) = (SIDE as f64, k as f64 + 0.5);
    let whole = integral(filter, -centre, side - centre);
    let part = integral(filter, low.max(0.0) - centre, high.min(side) - centre) / whole;
    // At the border itself one side of what surrounds it.
    let edge = |x: f64| {
        let within = if x == 0.0 || x == side { 0.5 } else { f64::from(u8::from(0.0 < x && x < side)) };
        within * weight(filter, x - centre) / whole
    };
    (part, edge(high) - edge(low))
}

/// Whatever the number of samples, through a pinhole or a lens, and on films of one column or row.
#[test]
fn a_constant_scene_has_a_constant_image_up_to_the_border() {
    let (none, radiance) = (Progress::none(), DVec3::new(0.7, 0.1, 3.0));
    for (filter, lens) in every_filter()
        .into_iter()
        .flat_map(|filter| [None, Some(Lens { radius: 0.1, focus_distance: 1.0 })].map(|l| (filter, l)))
    {
        for (width, height) in [(6, 6), (2, 3), (1, 5), (1, 1)] {
            let camera = Camera { lens, ..Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.8) };
            let film = crate::scene::Film { height, sample_border: false, ..film(width, filter) };
            let mut d = Description::new(camera, film);
            d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
            let scene = Scene::new(d).unwrap();
            for samples in [1, 2, 3, 16] {
                // A single sample of a single column has no neighbours that are independent of it.
                if samples == 1 && width == 1 {
                    continue;
                }
                let image = render(&scene, samples, 5, &none).unwrap().image;
                let off =
                    image.pixels.iter().map(|p| (*p - radiance).abs().max_element()).fold(0.0, f64::max);
                assert!(off < 1e-12, "{filter:?}, {width} x {height}, {samples} samples: {off:e}");
            }
        }
    }
}

/// Every pixel of a square's image is what the part of the film is that it covers, and every method finds its
/// derivative by a shift: with edges within the film, beside it, and on its border.
#[test]
fn what_the_border_cuts_off_is_known() {
    const RUNS: u64 = 24;
    // Student's with 23 degrees of freedom, for 10⁻¹⁰ and as many comparisons.
    let limit = 7.8 * 1.5;
    let none = Progress::none();
    let mut comparisons = Comparisons::of("what_the_border_cuts_off_is_known");
    let filters = every_filter().into_iter().enumerate().filter(|(k, _)| thorough() || k % 2 == 0);
    for (_, filter) in filters {
        for places in PLACES {
            let scene = between(filter, places);
            let mut change = Tangent::still(&scene);
            change.translate(&scene, 0, DVec3::X * 3.0 * 0.5_f64.tan() / (0.5 * SIDE as f64));
            let [light, behind] = LIGHT;
            let of = |x: usize, y: usize| {
                let ((a, rate), (b, _)) = (along(filter, places[0], x), along(filter, places[1], y));
                [behind + (light - behind) * a * b, (light - behind) * rate * b]
            };
            let area = |seed| WarpedArea { samples: 64, seed, ..WarpedArea::default() };
            let rays = |seed| WarpedArea { field: Field::AuxiliaryRays, samples: 96, ..area(seed) };
            let soft = |seed| WarpedArea { field: Field::softened(64), ..area(seed) };
            let edges = |seed| EdgeSampling { samples: 64, seed, ..EdgeSampling::default() };
            let run = |name: &str, seed: u64| {
                let found = match name {
                    "jump mean" => area(seed).forward(&scene, &change, &none),
                    "softened" => soft(seed).forward(&scene, &change, &none),
                    "rays" => rays(seed).forward(&scene, &change, &none),
                    _ => edges(seed).forward(&scene, &change, &none),
                };
                found.unwrap()
            };
            let mut methods = vec!["jump mean", "softened", "edges"];
            // Once, as their noise is large.
            if filter == (Filter::Tent { radius: 1.0 }) && places == PLACES[0] {
                methods.push("rays");
            }
            let pixels = || (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
            let sum = |run: &GradientImage| run.gradient.pixels.iter().map(|p| p.x).sum::<f64>();
            let whole = pixels().map(|(x, y)| of(x, y)[1]).sum::<f64>();
            let scale = pixels().map(|(x, y)| of(x, y)[1].abs()).sum::<f64>();
            for name in methods {
                let runs: Vec<_> = (0..RUNS).map(|seed| run(name, seed)).collect();
                let label = format!("{filter:?}, {name}, {places:?}");
                let total = statistics(&runs.iter().map(sum).collect::<Vec<_>>());
                comparisons.add(label.clone(), total, (whole, 0.0), 1e-9, scale);
                for (x, y) in pixels() {
                    for (k, expected) in of(x, y).into_iter().enumerate() {
                        let pixel =
                            |run: &GradientImage| [&run.image, &run.gradient][k].pixels[y * SIDE + x].x;
                        let (mean, error) = statistics(&runs.iter().map(pixel).collect::<Vec<_>>());
                        let off = (mean - expected).abs();
                        assert!(
                            off <= limit * error + 1e-9,
                            "{label}, pixel {x} {y}, {k}: {mean} ± {error} for {expected}"
                        );
                    }
                }
            }
            let inside = |seed| WarpedArea { warps: false, ..area(seed) };
            let interior: Vec<_> =
                (0..RUNS).map(|seed| sum(&inside(seed).forward(&scene, &change, &none).unwrap())).collect();
            // Nothing moves within a square of one colour.
            let (mean, error) = statistics(&interior);
            if whole.abs() > 0.1 * scale {
                comparisons.reject("interior only", (mean, error.max(1e-9 * scale)), (whole, 0.0));
            }
        }
    }
    comparisons.finish();
}

/// In a lit room, with all that may move.
#[test]
fn reverse_is_the_transpose_on_films_that_are_cut() {
    for (k, filter) in every_filter().into_iter().enumerate() {
        let scene = cut(&room(filter));
        let (change, adjoint) = (random_tangent(&scene, k as u64), random_adjoint((6, 6)));
        let active = ActiveParameters::everything(&scene);
        let pair = |g: &Image| g.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum::<f64>();
        for field in [Field::default(), Field::softened(4), Field::AuxiliaryRays] {
            let method = WarpedArea { samples: 4, field, ..WarpedArea::default() };
            let image = method.forward(&scene, &change, &Progress::none()).unwrap();
            let gradient = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
            let (forward, reverse) = (pair(&image.gradient), gradient.dot(&change));
            assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
        }
        let method = EdgeSampling { samples: 4, ..EdgeSampling::default() };
        let image = method.forward(&scene, &change, &Progress::none()).unwrap();
        let gradient = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap().by_parameter;
        let (forward, reverse) = (pair(&image.gradient), gradient.dot(&change));
        assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
    }
}

/// Only those on the border of the film, to which the filter ends.
#[test]
fn edges_on_the_border_are_told() {
    let filter = Filter::Tent { radius: 1.0 };
    let found = OnPixelBorders::of(&between(filter, [[1.0, 6.0], [2.0, 4.5]]));
    assert!(matches!(found[..], [OnPixelBorders { edges: 1, .. }]), "{found:?}");
    assert_eq!(OnPixelBorders::of(&between(filter, [[1.0, 5.0], [2.0, 4.5]])), []);
}
