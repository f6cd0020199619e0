//! Implicit flat worlds: every field and baseline against exact derivatives, with its measured bias.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4, PI};

use flatland::random::{Stream, open01, stream};
use flatland::sdf::estimator::{AreaIntegral, Estimate, EstimatorError, ImplicitHit, RelaxedBoundary};
use flatland::sdf::exact::{Exact, HarmonicField, Silhouette};
use flatland::sdf::fields::{
    AuxiliaryField, BangaruField, DirectField, FieldError, MotionField, MovingField, SilhouetteDistance,
    TracedField, ViciniField,
};
use flatland::sdf::shapes::{Circle, Grid, Interpolation, Polygon, RoundedBox, Shape, SmoothUnion};
use flatland::sdf::{AngularFilm, AngularFilter, End, RayCount, Scene, Sdf, Shading, Tracer};
use flatland::warp::{Circle as Directions, Debias, Field, LinearField as _, Warp};
use glam::DVec2;
use tests::effort::{pick, thorough};
use tests::power::{NOTICED, Power};
use tests::statistics::{regression_slope, suite_threshold};

fn disc(x: f64, y: f64, r: f64) -> Shape {
    Shape::Circle(Circle::new(DVec2::new(x, y), r).expect("a disc"))
}

/// Two discs, the nearer hiding a part of the other, blended over `width` in the free space between.
fn pair(width: f64) -> Shape {
    let union = SmoothUnion::new(disc(2.5, -0.5, 0.4), disc(4.0, 0.6, 0.7), width);
    Shape::Union(Box::new(union.expect("a union")))
}

fn triangle() -> Shape {
    let corners = [(2.5, -0.6), (3.5, 0.2), (2.6, 0.8)].map(|(x, y)| DVec2::new(x, y));
    Shape::Polygon(Polygon::new(corners.to_vec()).expect("simple"))
}

const SHADING: Shading =
    Shading { base: 1.0, position: DVec2::new(0.1, -0.2), normal: DVec2::new(-0.4, 0.3) };

/// Differences of up to this count as none.
const ROUNDING: f64 = 1e-9;

/// A scene, a motion and the exact derivative of its image.
struct Case {
    scene: Scene,
    film: AngularFilm,
    direction: Vec<f64>,
    exact: Vec<f64>,
}

impl Case {
    fn new(shape: Shape, shading: Shading, filter: AngularFilter) -> Self {
        let tracer = Tracer { far: 10.0, ..Tracer::default() };
        let mut direction: Vec<f64> =
            (0..shape.parameter_count()).map(|i| 0.5 + (1.3 * i as f64).sin()).collect();
        if matches!(shape, Shape::Union(_)) {
            // The blending width changes nothing that is seen.
            *direction.last_mut().expect("a width") = 0.0;
        }
        let scene = Scene::new(shape, DVec2::ZERO, tracer, shading, 0.3).expect("a scene");
        let film = AngularFilm::new(-FRAC_PI_4, FRAC_PI_4, 12, filter).expect("a film");
        Self::of(scene, film, direction)
    }

    fn of(scene: Scene, film: AngularFilm, direction: Vec<f64>) -> Self {
        let found = Exact::new(&scene).expect("closed").derivative(&film, &direction).expect("fits");
        let exact = found.iter().map(|[interior, boundary]| interior + boundary).collect();
        Self { scene, film, direction, exact }
    }

    fn silhouettes(&self) -> Vec<Silhouette> {
        Exact::new(&self.scene).expect("closed").silhouettes(&self.direction).expect("fits")
    }

    fn area(&self, samples: usize, field: &impl MotionField<Directions>) -> Estimate {
        let method = AreaIntegral { samples, seed: 1, ..AreaIntegral::default() };
        method.forward(&self.scene, &self.film, field).expect("valid")
    }

    fn traced(&self, samples: usize, field: &impl TracedField<Directions>) -> Estimate {
        self.area(samples, &self.moving(field))
    }

    fn moving<'a, F: TracedField<Directions>>(&'a self, field: &'a F) -> MovingField<'a, Directions, F> {
        MovingField::new(self.scene.view(), field, &self.direction).expect("valid")
    }

    /// The largest |z| of a pixel.
    fn worst(&self, label: &str, found: &Estimate) -> f64 {
        assert_eq!(found.non_finite, 0, "{label}");
        // Those within 5·10⁻⁸ r/t radians of a silhouette, of four at most in 1.6 radians: one in 10⁷ is expected, and
        // biases the estimate by less than its own share.
        assert!(found.out_of_steps <= 1 + found.rays / 1_000_000, "{label}: {} rays", found.out_of_steps);
        let pixels = found.mean.iter().zip(&self.exact).zip(&found.standard_error);
        let z = pixels.map(|((mean, exact), error)| {
            let off = (mean - exact).abs();
            if off <= ROUNDING && !error.is_nan() { 0.0 } else { (off - ROUNDING) / error }
        });
        z.fold(0.0, |worst, z| if z.is_nan() { f64::INFINITY } else { worst.max(z) })
    }

    /// The regression of an estimate on the exact derivative, and its standard error.
    fn slope(&self, label: &str, found: &Estimate) -> (f64, f64) {
        let norm: f64 = self.exact.iter().map(|e| e * e).sum();
        let product: f64 = self.exact.iter().zip(&found.mean).map(|(e, m)| e * m).sum();
        let noise: f64 = self.exact.iter().zip(&found.standard_error).map(|(e, s)| (e * s).powi(2)).sum();
        let (slope, error) = (product / norm, noise.sqrt() / norm);
        let worst = self.worst(label, found);
        println!("{label}: slope {slope:.3} ± {error:.3}, worst |z| {worst:.1}, {} rays", found.rays);
        (slope, error)
    }

    /// No pixel beyond the suite's threshold, nor the regression over all of them, beyond which all of it less a bias
    /// that must be noticed is.
    fn assert_right(&self, power: &mut Power, label: &str, found: &Estimate) {
        let (slope, error) = self.slope(label, found);
        let worst = self.worst(label, found);
        assert!(worst < suite_threshold(), "{label}: worst |z| {worst}");
        let tolerance = suite_threshold() * error;
        assert!((slope - 1.0).abs() < tolerance, "{label}: {slope} ± {error}");
        let less = 1.0 - NOTICED;
        assert!((less * slope - 1.0).abs() > less * tolerance, "{label} would pass with a bias of {NOTICED}");
        power.add(label, tolerance, 1.0);
    }

    fn assert_wrong(&self, label: &str, found: &Estimate) {
        self.slope(label, found);
        let worst = self.worst(label, found);
        assert!(worst > suite_threshold(), "{label} was not rejected: worst |z| {worst}");
    }
}

fn auxiliary(rays: usize, distance: SilhouetteDistance) -> AuxiliaryField {
    let warp = Warp { debias: Debias::Consistent { rays }, ..Warp::default() };
    AuxiliaryField { warp, kappa: 400.0, distance }
}

#[test]
fn consistent_fields_give_the_derivative_of_smooth_shapes() {
    let mut power = Power::of("sdf::consistent_fields_give_the_derivative_of_smooth_shapes");
    let filters = [AngularFilter::Tent, AngularFilter::Box];
    for filter in filters {
        for (name, shape) in [("disc", disc(3.0, 0.2, 1.0)), ("pair", pair(0.5))] {
            if !thorough() && (name, filter) == ("pair", AngularFilter::Box) {
                // A filter and a shape by themselves have to do.
                continue;
            }
            let case = Case::new(shape, SHADING, filter);
            let label = |field: &str| format!("{name}, {filter:?}, {field}");
            let harmonic = {
                let exact = Exact::new(&case.scene).expect("closed");
                HarmonicField::new(&exact, &case.direction).expect("fits")
            };
            case.assert_right(&mut power, &label("harmonic"), &case.area(16_000, &harmonic));
            case.assert_right(&mut power, &label("Bangaru"), &case.traced(16_000, &BangaruField::default()));
            case.assert_right(&mut power, &label("Vicini"), &case.traced(16_000, &ViciniField::default()));
            if !thorough() && (name, filter) != ("disc", AngularFilter::Box) {
                // Heavier tails than fields that are known have: one case stands for all.
                continue;
            }
            let unbiased = AuxiliaryField { warp: Warp::default(), ..auxiliary(1, Default::default()) };
            case.assert_right(
                &mut power,
                &label("auxiliary, debiased"),
                &case.traced(pick(10_000, 100_000), &unbiased),
            );
        }
    }
    power.finish();
}

/// What must be rejected: fields that break a rule, and methods without a boundary term.
#[test]
fn inconsistent_fields_are_rejected() {
    let mut power = Power::of("sdf::inconsistent_fields_are_rejected");
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
    case.assert_wrong("direct", &case.traced(4000, &DirectField));
    let idr = ImplicitHit { samples: 4000, seed: 1 };
    let found = idr.forward(&case.scene, &case.direction, &case.film).expect("valid");
    case.assert_wrong("implicit differentiation", &found);
    // The medial axis between the discs: ∇φ jumps, and with it the weights.
    let kinked = Case::new(pair(0.0), SHADING, AngularFilter::Tent);
    case_bias_of_the_kink(&mut power, &kinked);
    // Corners: no field made of G can be consistent.
    let flat = Shading { normal: DVec2::ZERO, ..SHADING };
    let corners = Case::new(triangle(), flat, AngularFilter::Tent);
    corners.assert_wrong("triangle, Bangaru", &corners.traced(4000, &BangaruField::default()));
    corners.assert_wrong("triangle, Vicini", &corners.traced(4000, &ViciniField::default()));
    let distance = SilhouetteDistance::default();
    corners.assert_wrong("triangle, auxiliary", &corners.traced(1000, &auxiliary(16, distance)));
    // A field that knows all silhouettes follows corners as well.
    let exact = Exact::new(&corners.scene).expect("closed");
    let harmonic = HarmonicField::new(&exact, &corners.direction).expect("fits");
    corners.assert_right(&mut power, "triangle, harmonic", &corners.area(16_000, &harmonic));
    power.finish();
}

fn case_bias_of_the_kink(power: &mut Power, kinked: &Case) {
    kinked.assert_wrong("pair without blending, Bangaru", &kinked.traced(6000, &BangaruField::default()));
    // The multiplier confines Vicini's field to where the medial axis is not.
    kinked.assert_right(
        power,
        "pair without blending, Vicini",
        &kinked.traced(16_000, &ViciniField::default()),
    );
}

/// The tracer's field without the term −n ω·U of the projection, seen from close by.
struct Unprojected<'a, F>(&'a Shape, MovingField<'a, Directions, F>);

impl<F: TracedField<Directions>> MotionField<Directions> for Unprojected<'_, F> {
    fn direction(&self) -> &[f64] {
        self.1.direction()
    }

    fn sample(&self, u: DVec2, rng: &mut Stream) -> (Field<DVec2>, RayCount) {
        let form = self.1.form(u, rng);
        let rate = |x| self.0.rate(x, self.direction());
        let along: f64 = form.taps().iter().map(|tap| tap.value.dot(u) * rate(tap.point).value).sum();
        let field = form.field(|x| rate(*x));
        (Field { divergence: field.divergence + along, ..field }, form.rays())
    }
}

#[test]
fn the_curvature_term_is_needed() {
    let mut power = Power::of("sdf::the_curvature_term_is_needed");
    let case = Case::new(disc(1.6, 0.1, 1.0), SHADING, AngularFilter::Tent);
    let field = BangaruField::default();
    case.assert_right(&mut power, "close disc, Bangaru", &case.traced(20_000, &field));
    let unprojected = Unprojected(case.scene.shape(), case.moving(&field));
    case.assert_wrong("close disc, without the curvature term", &case.area(20_000, &unprojected));
    power.finish();
}

/// With as many auxiliary rays as released renderers use, each B has its own bias.
#[test]
fn auxiliary_rays_on_a_disc() {
    let mut power = Power::of("sdf::auxiliary_rays_on_a_disc");
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
    let slope = |rays, distance| {
        let label = format!("disc, {rays} auxiliary rays, {distance:?}");
        case.slope(&label, &case.traced(10_000, &auxiliary(rays, distance)))
    };
    // The bias of the quotient: a fourth with 4 rays, not visible with 64.
    let (few, few_error) = slope(4, SilhouetteDistance::Curvature);
    assert!((0.6..0.9).contains(&few) && 1.0 - few > 4.0 * few_error, "{few} ± {few_error}");
    let (many, many_error) = slope(64, SilhouetteDistance::Curvature);
    assert!((many - 1.0).abs() < suite_threshold() * many_error, "{many} ± {many_error}");
    power.add("64 auxiliary rays", suite_threshold() * many_error, 1.0);
    // (n·ω)² = 2kts, here 6s, takes the silhouette for farther away than it is. |n·ω| = (6s)^½ does so all
    // the more: it is small only where s is very small, and the field is nearly a Gaussian mean, which
    // has half of the velocity.
    let (squared, squared_error) = slope(16, SilhouetteDistance::GrazingSquared);
    assert!((0.65..0.9).contains(&squared) && 1.0 - squared > 4.0 * squared_error, "{squared}");
    let (grazing, grazing_error) = slope(16, SilhouetteDistance::Grazing);
    assert!((grazing - 0.5).abs() < 4.0 * grazing_error + 0.05, "{grazing} ± {grazing_error}");
    power.finish();
}

/// Of the field V the area integral sees only its limits on both sides of a silhouette: for a field
/// that is exact in ω, |V − v| there is the whole bias.
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
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
    let tracer = Tracer { far: 10.0, tolerance: 1e-13, max_steps: 100_000, ..Tracer::default() };
    // (γ, rate outside, rate inside): min(1, γ − 1), and half of it. The tolerance is for the next order,
    // which over two decades of offsets changes the fitted rate: by 0.10 at γ = 2.5 outside, where it is
    // only δ^½ smaller, and by 0.02 at most otherwise.
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

/// Rays that run out of steps before the silhouette are the bias that is left: they stop at a distance
/// ~ 1/steps before it, where G is as far off.
#[test]
fn twice_as_many_tracer_points_halve_the_bias() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
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
    // Vicini's ε leaves a bias of its own, which falls with it.
    let tracer = Tracer { far: 10.0, tolerance: 1e-14, max_steps: 200_000, ..Tracer::default() };
    let errors = [1e-2, 1e-3, 1e-4]
        .map(|epsilon| error_at(&case, &ViciniField { epsilon, ..ViciniField::default() }, tracer, 1e-9));
    println!("Vicini, ε = 10⁻², 10⁻³, 10⁻⁴: |V − v| {errors:?}");
    assert!(errors[0] > 3.0 * errors[1] && errors[1] > 3.0 * errors[2], "{errors:?}");
}

#[test]
fn the_band_is_biased_by_its_width() {
    let mut power = Power::of("sdf::the_band_is_biased_by_its_width");
    let case = Case::new(pair(0.5), SHADING, AngularFilter::Tent);
    let slope = |width, samples| {
        let band = RelaxedBoundary { samples, width, seed: 1 };
        let found = band.forward(&case.scene, &case.direction, &case.film).expect("valid");
        case.slope(&format!("pair, band of ε = {width}"), &found)
    };
    let [(wide, wide_error), (half, _), (narrow, error)] =
        [(0.1, 20_000), (0.05, 20_000), (0.005, 200_000)].map(|(width, samples)| slope(width, samples));
    assert!((1.0 - wide).abs() > 6.0 * wide_error, "{wide}");
    assert!((1.0 - half).abs() < 0.75 * (1.0 - wide).abs(), "{half} {wide}");
    let tolerance = suite_threshold() * error + 0.02;
    assert!((narrow - 1.0).abs() < tolerance, "{narrow} ± {error}");
    power.add("pair, narrow band", tolerance, 1.0);
    if !thorough() {
        return power.finish();
    }
    // Corners are as good as any silhouette to it.
    let corners = Case::new(triangle(), Shading { normal: DVec2::ZERO, ..SHADING }, AngularFilter::Tent);
    let band = RelaxedBoundary { samples: 300_000, width: 0.005, seed: 1 };
    let found = band.forward(&corners.scene, &corners.direction, &corners.film).expect("valid");
    let (slope, error) = corners.slope("triangle, band of ε = 0.005", &found);
    let tolerance = suite_threshold() * error + 0.02;
    assert!((slope - 1.0).abs() < tolerance, "{slope} ± {error}");
    power.add("triangle, narrow band", tolerance, 1.0);
    power.finish();
}

fn random_direction(count: usize) -> Vec<f64> {
    let mut rng = stream(11, &[]);
    (0..count).map(|_| open01(&mut rng) - 0.5).collect()
}

fn assert_transposed(label: &str, case: &Case, forward: &Estimate, reverse: &Estimate, adjoint: &[f64]) {
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
    for filter in [AngularFilter::Tent, AngularFilter::Box] {
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

/// A disc of radius r, its centre about 2r from the eye. With every length scaled, the motion's and those
/// of the tracer and of the fields included, and the shading's slope by the inverse, the derivative is
/// the same for any r, and found as well.
#[test]
fn tiny_and_huge_discs_are_alike() {
    let mut power = Power::of("sdf::tiny_and_huge_discs_are_alike");
    let mut alike: Option<Vec<f64>> = None;
    for radius in [1e-6, 1.0, 1e6] {
        let tracer = Tracer { far: 10.0 * radius, ..Tracer::default() };
        let shading = Shading { position: SHADING.position / radius, ..SHADING };
        let shape = disc(2.0 * radius, 0.3 * radius, radius);
        let scene = Scene::new(shape, DVec2::ZERO, tracer, shading, 0.3).expect("a scene");
        let film = AngularFilm::new(-FRAC_PI_4, FRAC_PI_4, 6, AngularFilter::Tent).expect("a film");
        let direction = [0.3 * radius, 0.7 * radius, 0.5 * radius];
        let case = Case::of(scene, film, direction.to_vec());
        let first = alike.get_or_insert_with(|| case.exact.clone());
        // Twice the 10⁻¹¹ of the quadrature, at derivatives below 10.
        assert!(first.iter().zip(&case.exact).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", case.exact);
        case.assert_right(
            &mut power,
            &format!("r = {radius:e}, Bangaru"),
            &case.traced(10_000, &BangaruField::default()),
        );
        let vicini = ViciniField { epsilon: 1e-6 * radius, ..ViciniField::default() };
        if radius >= 1.0 || thorough() {
            let samples = pick(30_000, 400_000);
            case.assert_right(&mut power, &format!("r = {radius:e}, Vicini"), &case.traced(samples, &vicini));
        }
    }
    power.finish();
}

#[test]
fn nothing_overflows_near_the_surface_or_along_it() {
    // The eye 10⁻⁹ before the surface: half of all directions hit at once, the others pass along it.
    let tracer = Tracer { far: 10.0, ..Tracer::default() };
    let scene = Scene::new(disc(1.0 + 1e-9, 0.0, 1.0), DVec2::ZERO, tracer, SHADING, 0.3).expect("a scene");
    let film = AngularFilm::new(-3.0, 3.0, 9, AngularFilter::Tent).expect("a film");
    let case = Case { scene, film, direction: vec![1e-9, 1e-9, 1e-9], exact: vec![0.0; 9] };
    for found in [case.traced(300, &BangaruField::default()), case.traced(300, &ViciniField::default())] {
        assert_eq!(found.non_finite, 0);
        assert!(found.mean.iter().all(|m| m.is_finite()));
    }
    // Rays within rounding of a silhouette.
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
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

/// A mistake in the parameters is told, in forward mode too.
#[test]
fn forward_mode_refuses_what_reverse_mode_does() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
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
    let other = Case::new(pair(0.5), SHADING, AngularFilter::Tent);
    let found = area.forward(&case.scene, &case.film, &other.moving(&DirectField));
    assert_eq!(found, Err(EstimatorError::Direction { expected: 3, found: 7 }));
}

/// n steps along a ray that passes a disc of radius r at the angle δ cover ∫ ds/(tδ + s²/2r) = π (2r/tδ)^½;
/// inside, a logarithm of the tolerance takes the place of π.
#[test]
fn only_rays_at_silhouettes_run_out_of_steps() {
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, AngularFilter::Tent);
    let (view, silhouette) = (case.scene.view(), case.silhouettes()[1]);
    let reach = 2.0 * PI * PI / (silhouette.distance * (view.tracer.max_steps as f64).powi(2));
    let end = |relative: f64| view.trace(DVec2::from_angle(silhouette.angle + relative * reach)).end;
    println!("rays run out of steps within {reach:e} radians outside");
    assert_eq!([end(0.9), end(1.1), end(-2.0)], [End::OutOfSteps, End::Miss, End::Hit]);
    // And the estimators say so, also of rays at the ends of pixels.
    let tracer = Tracer { max_steps: 1, ..view.tracer };
    let scene = Scene::new(case.scene.shape().clone(), DVec2::ZERO, tracer, SHADING, 0.3).expect("a scene");
    let film = AngularFilm::new(-0.2, 0.2, 3, AngularFilter::Box).expect("a film");
    let case = Case { scene, film, ..case };
    let found = case.traced(5, &auxiliary(4, SilhouetteDistance::default()));
    assert_eq!([found.rays, found.out_of_steps], [3 * 5 * 2 * 5; 2]);
}

/// The angles between which a shape is seen that is one piece around `inside`, to rounding.
fn ends(scene: &Scene, inside: f64) -> [f64; 2] {
    [-1.0, 1.0].map(|side| {
        let (mut hit, mut miss) = (inside, inside + side);
        for _ in 0..60 {
            let middle = 0.5 * (hit + miss);
            let seen = scene.view().trace(DVec2::from_angle(middle)).hit().is_some();
            if seen { hit = middle } else { miss = middle }
        }
        hit
    })
}

/// The image of such a shape, by sums over each smooth piece of `count` rays, which α = a + (b − a)(1 − cos πs)/2
/// makes dense where the square roots at its ends are.
fn dense_image(scene: &Scene, film: &AngularFilm, inside: f64, count: usize) -> Vec<f64> {
    let silhouettes = ends(scene, inside);
    let of_pixel = |pixel: usize| {
        let centre = film.centre(pixel);
        let (low, high) = (centre - film.radius(), centre + film.radius());
        let mut cuts = vec![low, centre, high];
        cuts.extend(silhouettes.into_iter().filter(|&angle| low < angle && angle < high));
        cuts.sort_by(f64::total_cmp);
        let piece = |ends: &[f64]| {
            let half = 0.5 * (ends[1] - ends[0]);
            let at = |i: usize| {
                let (sin, cos) = (PI * (i as f64 + 0.5) / count as f64).sin_cos();
                let angle = ends[0] + half * (1.0 - cos);
                let radiance = scene.radiance(&scene.view().trace(DVec2::from_angle(angle)));
                film.value(angle - centre) * radiance * half * sin
            };
            PI / count as f64 * (0..count).map(at).sum::<f64>()
        };
        cuts.windows(2).map(piece).sum()
    };
    (0..film.count()).map(of_pixel).collect()
}

/// Central differences of [`dense_image`]. Rays within 10⁻⁹ radians of a silhouette count as misses at
/// ±h alike; h = 10⁻³ leaves h² of truncation, below the statistical error of the estimates by a factor
/// of 100.
fn measured(shape: Shape, shading: Shading, direction: Vec<f64>, inside: f64) -> Case {
    let (h, count) = (1e-3, 400);
    let tracer = Tracer { far: 5.0, step_scale: FRAC_1_SQRT_2, ..Tracer::default() };
    let film = AngularFilm::new(-0.5, 0.6, 12, AngularFilter::Tent).expect("a film");
    let at = |h: f64| {
        let theta = shape.parameters().iter().zip(&direction).map(|(p, d)| p + h * d).collect::<Vec<_>>();
        let moved = shape.with_parameters(&theta).expect("still a shape");
        Scene::new(moved, DVec2::ZERO, tracer, shading, 0.3).expect("a scene")
    };
    let [plus, minus] = [h, -h].map(|h| dense_image(&at(h), &film, inside, count));
    let exact = plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * h)).collect();
    Case { scene: at(0.0), film, direction, exact }
}

/// The yardstick itself, on a disc, which has a closed form.
#[test]
fn central_differences_of_dense_images_are_exact_enough() {
    let direction = vec![0.5, 1.4, 1.0];
    let case = measured(disc(3.0, 0.2, 1.0), SHADING, direction.clone(), 0.06);
    let exact = Case::of(case.scene, case.film, direction).exact;
    let worst = case.exact.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("central differences: off by {worst:e}");
    assert!(worst < 1e-4, "{worst}");
}

/// Distances on a grid: a spline is smooth enough for both fields, and bilinear interpolation, across
/// whose cells ∇φ jumps, is not.
#[test]
fn grids_must_be_smooth() {
    let mut power = Power::of("sdf::grids_must_be_smooth");
    let corners = (DVec2::new(-0.5, -3.0), DVec2::new(5.5, 3.0));
    let value = |p: DVec2| (p - DVec2::new(3.0, 0.2)).length() - 1.0;
    // Without the normal, which jumps where ∇φ does: what fails is the field, not the shading.
    let flat = Shading { normal: DVec2::ZERO, ..SHADING };
    let case = |interpolation, shading| {
        let grid = Shape::Grid(Grid::sampled(interpolation, corners, 30, value).expect("a grid"));
        let direction = (0..grid.parameter_count()).map(|i| 0.5 + (1.3 * i as f64).sin()).collect();
        measured(grid, shading, direction, 0.06)
    };
    let smooth = case(Interpolation::Bicubic, SHADING);
    smooth.assert_right(
        &mut power,
        "bicubic grid, Bangaru",
        &smooth.traced(36_000, &BangaruField::default()),
    );
    if thorough() {
        let vicini = ViciniField::default();
        smooth.assert_right(&mut power, "bicubic grid, Vicini", &smooth.traced(36_000, &vicini));
    }
    let kinked = case(Interpolation::Bilinear, flat);
    kinked.assert_wrong("bilinear grid, Bangaru", &kinked.traced(6000, &BangaruField::default()));
    power.finish();
}

/// The cure for corners.
#[test]
fn rounded_corners_are_smooth_silhouettes() {
    let mut power = Power::of("sdf::rounded_corners_are_smooth_silhouettes");
    let rounded = RoundedBox::new(DVec2::new(3.0, 0.2), DVec2::new(0.5, 0.4), 0.4, 0.2).expect("a box");
    let direction = vec![0.5, 1.4, 1.0, -0.2, 0.6, 0.8];
    let case = measured(Shape::Box(rounded), SHADING, direction, 0.06);
    case.assert_right(&mut power, "rounded box, Bangaru", &case.traced(36_000, &BangaruField::default()));
    case.assert_right(&mut power, "rounded box, Vicini", &case.traced(36_000, &ViciniField::default()));
    power.finish();
}
