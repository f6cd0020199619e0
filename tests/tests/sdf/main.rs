//! Implicit flat worlds: every field and baseline against exact derivatives, with its measured bias.

mod case;
mod fields;
mod measured;

use std::f64::consts::FRAC_PI_4;

use flatland::estimator::sdf::{ImplicitHit, RelaxedBoundary};
use flatland::plane::Filter;
use flatland::random::Stream;
use flatland::sdf::exact::{Exact, HarmonicField};
use flatland::sdf::fields::{
    AuxiliaryField, BangaruField, DirectField, MotionField, MovingField, SilhouetteDistance, TracedField,
    ViciniField,
};
use flatland::sdf::shapes::{Circle, Polygon, Shape, SmoothUnion};
use flatland::sdf::{AngularFilm, RayCount, Scene, Sdf, Shading, Tracer};
use flatland::warp::{Circle as Directions, Debias, Field, LinearField as _, Warp};
use glam::DVec2;
use tests::effort::{pick, thorough};
use tests::power::Power;

use case::{Case, assert_slope_1};

fn disc(x: f64, y: f64, r: f64) -> Shape {
    Shape::Circle(Circle::new(DVec2::new(x, y), r).expect("a disc"))
}

/// Two discs, the nearer of which occludes a part of the other, blended over `width` in the free space
/// between them.
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

fn auxiliary(rays: usize, distance: SilhouetteDistance) -> AuxiliaryField {
    let warp = Warp { debias: Debias::Consistent { rays }, ..Warp::default() };
    AuxiliaryField { warp, kappa: 400.0, distance }
}

#[test]
fn consistent_fields_give_the_derivative_of_smooth_shapes() {
    let mut power = Power::of("sdf::consistent_fields_give_the_derivative_of_smooth_shapes");
    let filters = [Filter::Tent, Filter::Box];
    for filter in filters {
        for (name, shape) in [("disc", disc(3.0, 0.2, 1.0)), ("pair", pair(0.5))] {
            if !thorough() && (name, filter) == ("pair", Filter::Box) {
                // One filter and one shape suffice.
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
            if !thorough() && (name, filter) != ("disc", Filter::Box) {
                // Its tails are heavier than those of fields with known silhouettes: one case stands for all.
                continue;
            }
            let unbiased = AuxiliaryField { warp: Warp::default(), ..auxiliary(1, Default::default()) };
            case.assert_right(
                &mut power,
                &label("auxiliary, debiased"),
                &case.traced(pick(10_000, 50_000), &unbiased),
            );
        }
    }
}

/// Inconsistent fields, and methods without a boundary term, must be rejected.
#[test]
fn inconsistent_fields_are_rejected() {
    let mut power = Power::of("sdf::inconsistent_fields_are_rejected");
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    case.assert_wrong("direct", &case.traced(4000, &DirectField));
    let idr = ImplicitHit { samples: 4000, seed: 1 };
    let found = idr.forward(&case.scene, &case.direction, &case.film).expect("valid");
    case.assert_wrong("implicit differentiation", &found);
    // The medial axis between the discs: ∇φ is discontinuous, and so are the weights.
    let kinked = Case::new(pair(0.0), SHADING, Filter::Tent);
    kinked.assert_wrong("pair without blending, Bangaru", &kinked.traced(6000, &BangaruField::default()));
    // The multiplier confines Vicini's field to a neighbourhood without the medial axis.
    let found = kinked.traced(16_000, &ViciniField::default());
    kinked.assert_right(&mut power, "pair without blending, Vicini", &found);
    // Corners: no field built from G is consistent there.
    let flat = Shading { normal: DVec2::ZERO, ..SHADING };
    let corners = Case::new(triangle(), flat, Filter::Tent);
    corners.assert_wrong("triangle, Bangaru", &corners.traced(4000, &BangaruField::default()));
    corners.assert_wrong("triangle, Vicini", &corners.traced(4000, &ViciniField::default()));
    let distance = SilhouetteDistance::default();
    corners.assert_wrong("triangle, auxiliary", &corners.traced(1000, &auxiliary(16, distance)));
    // A field that uses all silhouettes follows corners too.
    let exact = Exact::new(&corners.scene).expect("closed");
    let harmonic = HarmonicField::new(&exact, &corners.direction).expect("fits");
    corners.assert_right(&mut power, "triangle, harmonic", &corners.area(16_000, &harmonic));
}

/// The tracer's field without the projection's term −n ω·U, seen from nearby.
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
    let case = Case::new(disc(1.6, 0.1, 1.0), SHADING, Filter::Tent);
    let field = BangaruField::default();
    case.assert_right(&mut power, "close disc, Bangaru", &case.traced(20_000, &field));
    let unprojected = Unprojected(case.scene.shape(), case.moving(&field));
    case.assert_wrong("close disc, without the curvature term", &case.area(20_000, &unprojected));
}

/// With the number of auxiliary rays of released renderers, each B has its own bias.
#[test]
fn auxiliary_rays_on_a_disc() {
    let mut power = Power::of("sdf::auxiliary_rays_on_a_disc");
    let case = Case::new(disc(3.0, 0.2, 1.0), SHADING, Filter::Tent);
    let slope = |rays, distance| {
        let label = format!("disc, {rays} auxiliary rays, {distance:?}");
        case.slope(&label, &case.traced(10_000, &auxiliary(rays, distance)))
    };
    // The bias of the quotient: a quarter with 4 rays, not noticeable with 64.
    let few = slope(4, SilhouetteDistance::Curvature);
    assert!((0.6..0.9).contains(&few.mean) && 1.0 - few.mean > 4.0 * few.standard_error, "{few:?}");
    assert_slope_1(&mut power, "64 auxiliary rays", slope(64, SilhouetteDistance::Curvature), 0.0);
    // (n·ω)² = 2kts, here 6s, overestimates the distance of the silhouette. |n·ω| = (6s)^½ does so even more:
    // it is small only for very small s, and the field is nearly a Gaussian mean, which has half of the
    // velocity.
    let squared = slope(16, SilhouetteDistance::GrazingSquared);
    assert!((0.65..0.9).contains(&squared.mean), "{squared:?}");
    assert!(1.0 - squared.mean > 4.0 * squared.standard_error, "{squared:?}");
    let grazing = slope(16, SilhouetteDistance::Grazing);
    assert!((grazing.mean - 0.5).abs() < 4.0 * grazing.standard_error + 0.05, "{grazing:?}");
}

#[test]
fn the_band_is_biased_by_its_width() {
    let mut power = Power::of("sdf::the_band_is_biased_by_its_width");
    let case = Case::new(pair(0.5), SHADING, Filter::Tent);
    let slope = |case: &Case, label: &str, width, samples| {
        let band = RelaxedBoundary { samples, width, seed: 1 };
        let found = band.forward(&case.scene, &case.direction, &case.film).expect("valid");
        case.slope(&format!("{label}, band of ε = {width}"), &found)
    };
    let [wide, half, narrow] = [(0.1, 20_000), (0.05, 20_000), (0.005, 200_000)]
        .map(|(width, samples)| slope(&case, "pair", width, samples));
    assert!((1.0 - wide.mean).abs() > 6.0 * wide.standard_error, "{wide:?}");
    assert!((1.0 - half.mean).abs() < 0.75 * (1.0 - wide.mean).abs(), "{half:?} {wide:?}");
    assert_slope_1(&mut power, "pair, narrow band", narrow, 0.02);
    if thorough() {
        // It supports corners like any silhouette.
        let flat = Shading { normal: DVec2::ZERO, ..SHADING };
        let corners = Case::new(triangle(), flat, Filter::Tent);
        let found = slope(&corners, "triangle", 0.005, 300_000);
        assert_slope_1(&mut power, "triangle, narrow band", found, 0.02);
    }
}

/// A disc of radius r, with its centre about 2r from the eye. If every length is scaled, including lengths of
/// motion, tracer and fields, and the shading's slope inversely, the derivative is the same for any r, and so
/// is its estimate.
#[test]
fn tiny_and_huge_discs_are_alike() {
    let mut power = Power::of("sdf::tiny_and_huge_discs_are_alike");
    let mut alike: Option<Vec<f64>> = None;
    for radius in [1e-6, 1.0, 1e6] {
        let tracer = Tracer { far: 10.0 * radius, ..Tracer::default() };
        let shading = Shading { position: SHADING.position / radius, ..SHADING };
        let shape = disc(2.0 * radius, 0.3 * radius, radius);
        let scene = Scene::new(shape, DVec2::ZERO, tracer, shading, 0.3).expect("a scene");
        let film = AngularFilm::new(-FRAC_PI_4, FRAC_PI_4, 6, Filter::Tent).expect("a film");
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
            let samples = pick(30_000, 150_000);
            case.assert_right(&mut power, &format!("r = {radius:e}, Vicini"), &case.traced(samples, &vicini));
        }
    }
}
