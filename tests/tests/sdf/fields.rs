//! Deterministic properties of fields and methods: rates, transposes, extremes and refusals.

use std::f64::consts::PI;

use flatland::estimator::sdf::{AreaIntegral, ImplicitHit, RelaxedBoundary};
use flatland::estimator::{Estimate, EstimatorError};
use flatland::plane::Filter;
use flatland::random::{open01, stream};
use flatland::sdf::fields::{
    BangaruField, DirectField, FieldError, MovingField, SilhouetteDistance, TracedField, ViciniField,
};
use flatland::sdf::shapes::{Grid, Interpolation, Shape};
use flatland::sdf::{AngularFilm, End, Scene, Sdf as _, Tracer};
use flatland::warp::{Circle as Directions, LinearField as _};
use glam::DVec2;
use tests::statistics::regression_slope;

use super::case::Case;
use super::{SHADING, auxiliary, disc, pair, triangle};

/// The area integral depends on the field V only through its limits on both sides of a silhouette: for a
/// field that is exact in ω, |V − v| there is the whole bias.
fn error_at(case: &Case, field: &impl TracedField<Directions>, tracer: Tracer, offset: f64) -> f64 {
    let silhouette = case.silhouettes()[1];
    let view = flatland::sdf::View { tracer, ..case.scene.view() };
    let direction = DVec2::from_angle(silhouette.angle + offset);
    let form = field.form(&view, direction, &mut stream(0, &[]));
    let found = form.field(|x| view.sdf.rate(*x, &case.direction));
    (found.value.dot(direction.perp()) - silhouette.rate).abs()
}

#[test]
fn the_mean_of_tracer_points_converges_at_its_rate() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    let tracer = Tracer { far: 10.0, tolerance: 1e-13, max_steps: 100_000, ..Tracer::default() };
    // (γ, rate outside, rate inside): min(1, γ − 1), and half of it. The tolerance allows for the next order,
    // which changes the fitted rate over two decades of offsets: by 0.10 at γ = 2.5 outside, where it is only
    // δ^½ smaller, and by at most 0.02 otherwise.
    for (gamma, outside, inside) in [(3.0, 1.0, 0.5), (2.5, 1.0, 0.5), (1.5, 0.5, 0.25)] {
        let field = BangaruField { gamma, ..BangaruField::default() };
        for (side, expected) in [(1.0, outside), (-1.0, inside)] {
            let offsets = [1e-6, 3e-7, 1e-7, 3e-8, 1e-8];
            let x: Vec<f64> = offsets.iter().map(|d: &f64| d.ln()).collect();
            let y: Vec<f64> =
                offsets.iter().map(|d| error_at(&case, &field, tracer, side * d).ln()).collect();
            let rate = regression_slope(&x, &y);
            println!("γ = {gamma}, side {side}: |V − v| ~ δ^{rate:.2}");
            assert!((rate - expected).abs() < 0.12, "γ = {gamma}, side {side}: {rate} for {expected}");
        }
    }
}

/// The remaining bias is due to rays that run out of steps before the silhouette: they stop at a distance ~
/// 1/steps from it, where the error of G is proportional to that distance.
#[test]
fn twice_as_many_tracer_points_halve_the_bias() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    for step_scale in [1.0, 0.5] {
        let errors = [50, 100, 200, 400, 800].map(|max_steps| {
            let tracer = Tracer { far: 10.0, step_scale, max_steps, tolerance: 1e-14 };
            error_at(&case, &BangaruField::default(), tracer, 1e-12)
        });
        println!("step scale {step_scale}: |V − v| {errors:?}");
        for pair in errors.windows(2) {
            let factor = pair[0] / pair[1];
            assert!((1.6..2.5).contains(&factor), "{errors:?}");
        }
    }
    // Vicini's ε adds a bias of its own, which decreases with ε.
    let tracer = Tracer { far: 10.0, tolerance: 1e-14, max_steps: 200_000, ..Tracer::default() };
    let errors = [1e-2, 1e-3, 1e-4]
        .map(|epsilon| error_at(&case, &ViciniField { epsilon, ..ViciniField::default() }, tracer, 1e-9));
    println!("Vicini, ε = 10⁻², 10⁻³, 10⁻⁴: |V − v| {errors:?}");
    assert!(errors[0] > 3.0 * errors[1] && errors[1] > 3.0 * errors[2], "{errors:?}");
}

fn random_direction(count: usize) -> Vec<f64> {
    let mut rng = stream(11, &[]);
    (0..count).map(|_| open01(&mut rng) - 0.5).collect()
}

fn assert_transposed(
    label: &str,
    case: &Case,
    forward: &Estimate<Vec<f64>>,
    reverse: &Estimate<Vec<f64>>,
    adjoint: &[f64],
) {
    let left: f64 = forward.mean.iter().zip(adjoint).map(|(i, d)| i * d).sum();
    let terms: Vec<f64> = reverse.mean.iter().zip(&case.direction).map(|(g, d)| g * d).collect();
    let right: f64 = terms.iter().sum();
    let size: f64 = 1.0 + terms.iter().map(|t| t.abs()).sum::<f64>();
    println!("{label}: {left} = {right}");
    assert!((left - right).abs() < 1e-10 * size, "{label}: {left} {right}");
    assert_eq!(forward.rays, reverse.rays, "{label}");
    assert_eq!(forward.out_of_steps, reverse.out_of_steps, "{label}");
}

#[test]
fn forward_and_reverse_are_transposed() {
    let low = DVec2::new(-0.5, -3.0);
    let value = |p: DVec2| (p - DVec2::new(3.0, 0.2)).length() - 1.0;
    let grid = Grid::sampled(Interpolation::Bicubic, (low, DVec2::new(5.5, 3.0)), 30, value).expect("a grid");
    for filter in [Filter::Tent, Filter::Box] {
        for shape in [pair(0.5), triangle(), Shape::Grid(grid.clone())] {
            let direction = random_direction(shape.parameter_count());
            let tracer = Tracer { far: 5.0, step_scale: 0.9, ..Tracer::default() };
            let scene = Scene::new(shape, DVec2::ZERO, tracer, SHADING, 0.3).expect("a scene");
            let film = AngularFilm::new(-0.7, 0.7, 5, filter).expect("a film");
            let adjoint = random_direction(film.count());
            let case = Case { scene, film, direction, exact: vec![] };
            let area = AreaIntegral { samples: 20, ..AreaIntegral::default() };
            macro_rules! transposed {
                ($label:expr, $field:expr) => {
                    let field = $field;
                    let forward = area.forward(&case.scene, &case.film, &case.moving(&field));
                    let reverse = area.reverse(&case.scene, &case.film, &adjoint, &field);
                    let (forward, reverse) = (forward.expect("valid"), reverse.expect("valid"));
                    assert_transposed($label, &case, &forward, &reverse, &adjoint);
                };
            }
            transposed!("direct", DirectField);
            transposed!("Bangaru", BangaruField { keep: Some(12), ..BangaruField::default() });
            transposed!("Vicini", ViciniField::default());
            transposed!("auxiliary", auxiliary(8, SilhouetteDistance::GrazingSquared));
            let band = RelaxedBoundary { samples: 20, width: 0.1, seed: 3 };
            let forward = band.forward(&case.scene, &case.direction, &case.film).expect("valid");
            let reverse = band.reverse(&case.scene, &case.film, &adjoint).expect("valid");
            assert_transposed("band", &case, &forward, &reverse, &adjoint);
            let idr = ImplicitHit { samples: 20, seed: 3 };
            let forward = idr.forward(&case.scene, &case.direction, &case.film).expect("valid");
            let reverse = idr.reverse(&case.scene, &case.film, &adjoint).expect("valid");
            assert_transposed("implicit", &case, &forward, &reverse, &adjoint);
        }
    }
}

#[test]
fn nothing_overflows_near_the_surface_or_along_it() {
    // The eye is 10⁻⁹ from the surface: half of all directions hit at once, the others pass along it.
    let tracer = Tracer { far: 10.0, ..Tracer::default() };
    let scene = Scene::new(disc(1.0 + 1e-9, 0.0, 1.0), DVec2::ZERO, tracer, SHADING, 0.3).expect("a scene");
    let film = AngularFilm::new(-3.0, 3.0, 9, Filter::Tent).expect("a film");
    let case = Case { scene, film, direction: vec![1e-9, 1e-9, 1e-9], exact: vec![0.0; 9] };
    for found in [case.traced(300, &BangaruField::default()), case.traced(300, &ViciniField::default())] {
        assert!(found.non_finite.is_empty());
        assert!(found.mean.iter().all(|m| m.is_finite()));
    }
    // Rays within rounding of a silhouette.
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    let silhouette = case.silhouettes()[0].angle;
    for offset in [0.0, 1e-16, -1e-16, 1e-14, -1e-14, 1e-10, -1e-10, 1e-6, -1e-6] {
        let direction = DVec2::from_angle(silhouette + offset);
        let (view, mut rng) = (case.scene.view(), stream(0, &[]));
        let forms = [
            TracedField::<Directions>::form(&BangaruField::default(), &view, direction, &mut rng),
            TracedField::<Directions>::form(&ViciniField::default(), &view, direction, &mut rng),
            TracedField::<Directions>::form(&DirectField, &view, direction, &mut rng),
        ];
        for form in forms {
            let field = form.field(|x| view.sdf.rate(*x, &case.direction));
            assert!(field.value.is_finite() && field.divergence.is_finite(), "{offset} {field:?}");
        }
    }
}

/// Invalid parameters are reported, in forward mode too.
#[test]
fn forward_mode_refuses_what_reverse_mode_does() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    let (area, adjoint) = (AreaIntegral::default(), vec![1.0; case.film.count()]);
    macro_rules! refused {
        ($field:expr) => {
            let field = $field;
            let forward = MovingField::<Directions, _>::new(case.scene.view(), &field, &case.direction);
            let reverse = area.reverse(&case.scene, &case.film, &adjoint, &field);
            let told = forward.err().map(EstimatorError::Field);
            assert!(told.is_some() && told.as_ref() == reverse.as_ref().err(), "{told:?} {reverse:?}");
        };
    }
    refused!(BangaruField { gamma: 0.0, ..BangaruField::default() });
    refused!(BangaruField { keep: Some(0), ..BangaruField::default() });
    refused!(ViciniField { reach: Some(-1.0), ..ViciniField::default() });
    refused!(auxiliary(0, SilhouetteDistance::default()));
    let short = MovingField::<Directions, _>::new(case.scene.view(), &DirectField, &case.direction[..2]);
    assert_eq!(short.err(), Some(FieldError::Direction { expected: 3, found: 2 }));
    // A field of another scene.
    let other = Case::new(pair(0.5), SHADING, Filter::Tent);
    let found = area.forward(&case.scene, &case.film, &other.moving(&DirectField));
    assert_eq!(found, Err(EstimatorError::Direction { expected: 3, found: 7 }));
}

/// n steps along a ray that passes a disc of radius r at the angle δ cover ∫ ds/(tδ + s²/2r) = π (2r/tδ)^½;
/// inside, a logarithm of the tolerance takes the place of π.
#[test]
fn only_rays_at_silhouettes_run_out_of_steps() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    let (view, silhouette) = (case.scene.view(), case.silhouettes()[1]);
    let reach = 2.0 * PI * PI / (silhouette.distance * (view.tracer.max_steps as f64).powi(2));
    let end = |relative: f64| view.trace(DVec2::from_angle(silhouette.angle + relative * reach)).end;
    println!("rays run out of steps within {reach:e} radians outside");
    assert_eq!([end(0.9), end(1.1), end(-2.0)], [End::OutOfSteps, End::Miss, End::Hit]);
    // The estimators report them, also for rays at the ends of pixels.
    let tracer = Tracer { max_steps: 1, ..view.tracer };
    let scene = Scene::new(case.scene.shape().clone(), DVec2::ZERO, tracer, SHADING, 0.3).expect("a scene");
    let film = AngularFilm::new(-0.2, 0.2, 3, Filter::Box).expect("a film");
    let case = Case { scene, film, ..case };
    let found = case.traced(5, &auxiliary(4, SilhouetteDistance::default()));
    assert_eq!([found.rays, found.out_of_steps], [3 * 5 * 2 * 5; 2]);
}
