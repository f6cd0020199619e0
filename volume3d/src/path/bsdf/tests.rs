//! Tests of whole BSDFs: sampling, energy, reciprocity.

use flatland::calculus::Dual;
use flatland::random::{open01, stream};

use std::f64::consts::{PI, TAU};

use super::*;
use crate::optics::Coating;
use crate::scene::{Dielectric, Principled, PrincipledThin, Reflectance, Roughness, Scattering, Value};

/// Reflection models; transmissive ones come last.
fn bsdfs() -> Vec<Bsdf> {
    let white = || Reflectance::Constant(DVec3::ONE);
    let rough = |distribution, stretch| Bsdf::RoughConductor {
        distribution,
        alpha: 0.3,
        stretch,
        eta: DVec3::ZERO,
        k: DVec3::ONE,
        specular_reflectance: white(),
    };
    let facets = |distribution| Some(Roughness::new(distribution, ALPHA));
    let stretched = |distribution| Some(Roughness { distribution, alpha: ALPHA, stretch: 0.6 });
    let plastic = |facets, scattering| {
        let (diffuse_reflectance, specular_reflectance) = (white(), DVec3::splat(0.9));
        Bsdf::Plastic(Plastic { eta: 1.5, facets, diffuse_reflectance, specular_reflectance, scattering })
    };
    let principled_of = |eta, spec_trans: f64, anisotropic| {
        let principled = Principled {
            base_color: white(),
            roughness: ROOT,
            anisotropic,
            metallic: 0.3,
            eta,
            spec_tint: 0.5,
            spec_trans,
            sheen: 0.1,
            sheen_tint: 0.5,
            flatness: 0.5,
            clearcoat: 0.1,
            clearcoat_gloss: 0.1,
        };
        Bsdf::Principled(principled.map(Value::Constant))
    };
    let principled = |spec_trans, anisotropic| principled_of(1.4, spec_trans, anisotropic);
    let sheet = |anisotropic| {
        let sheet = PrincipledThin {
            base_color: white(),
            roughness: ROOT,
            anisotropic,
            eta: 1.9,
            spec_tint: 0.5,
            spec_trans: 0.4,
            diff_trans: 0.8,
            sheen: 0.1,
            sheen_tint: 0.5,
            flatness: 0.5,
        };
        Bsdf::PrincipledThin(sheet.map(Value::Constant))
    };
    vec![
        Bsdf::Diffuse { reflectance: white() },
        rough(Microfacets::Beckmann, 1.0),
        rough(Microfacets::Ggx, 1.0),
        rough(Microfacets::Beckmann, 2.5),
        rough(Microfacets::Ggx, 0.4),
        plastic(None, Scattering::Linear),
        plastic(facets(Microfacets::Beckmann), Scattering::Linear),
        plastic(facets(Microfacets::Ggx), Scattering::Nonlinear),
        plastic(facets(Microfacets::Ggx), Scattering::Once),
        principled(0.0, 0.0),
        principled(0.0, 0.7),
        principled_of(1.0, 0.0, 0.0),
        principled(0.6, 0.0),
        principled(0.6, 0.7),
        dielectric(facets(Microfacets::Beckmann)),
        dielectric(facets(Microfacets::Ggx)),
        plastic(stretched(Microfacets::Beckmann), Scattering::Once),
        dielectric(stretched(Microfacets::Beckmann)),
        dielectric(stretched(Microfacets::Ggx)),
        sheet(0.0),
        sheet(0.7),
    ]
}

const ALPHA: f64 = 0.3;

/// The roughness of principled models that corresponds to α, about √α.
const ROOT: f64 = 0.55;

fn dielectric(facets: Option<Roughness>) -> Bsdf {
    let specular_transmittance = Reflectance::Constant(DVec3::ONE);
    Bsdf::Dielectric(Dielectric {
        eta: 1.5,
        facets,
        specular_reflectance: DVec3::ONE,
        specular_transmittance,
    })
}

/// A direction perpendicular to the normal.
const ALONG: DVec3 = DVec3::new(0.48, 0.8, -0.36);

/// The parameters of a principled model, with the given roughness.
fn numbers<T: Number>(bsdf: &Bsdf, roughness: T) -> Option<Box<Numbers<T>>> {
    let constant = |value: Value| T::constant(value.constant().expect("a constant"));
    Some(Box::new(match bsdf {
        Bsdf::Principled(p) => Numbers::Solid(Principled { roughness, ..p.map(constant) }),
        Bsdf::PrincipledThin(p) => Numbers::Thin(PrincipledThin { roughness, ..p.map(constant) }),
        _ => return None,
    }))
}

/// A shading point whose viewer is in front of or behind a surface with normal (0.6, 0, 0.8).
fn shading<'s>(bsdf: &'s Bsdf, coating: &'s Option<Coating>, viewer: DVec3) -> Shading<'s, f64> {
    let normal = DVec3::new(0.6, 0.0, 0.8);
    let behind = normal.dot(viewer) < 0.0;
    Shading {
        bsdf,
        coating: coating.as_ref(),
        normal: Vec3::constant(if behind { -normal } else { normal }),
        viewer: Vec3::constant(viewer),
        reflectance: Rgb::constant(DVec3::ONE),
        roughness: bsdf.roughness().unwrap_or(0.0),
        across: bsdf.facets().map_or(0.0, |facets| facets.alpha * facets.stretch),
        numbers: numbers(bsdf, bsdf.roughness().unwrap_or(0.0)),
        along: bsdf.is_anisotropic().then_some(Vec3::constant(ALONG)),
        behind,
        opacity: None,
        black: false,
        beneath: None,
        blend: None,
    }
}

/// The first of two models mixed with the second.
fn mixture<'s>(
    [first, second]: [&'s Bsdf; 2],
    coatings: [&'s Option<Coating>; 2],
    viewer: DVec3,
) -> Shading<'s, f64> {
    let [first, other] =
        [(first, coatings[0]), (second, coatings[1])].map(|(bsdf, c)| shading(bsdf, c, viewer));
    Shading { blend: Some(Box::new(Mixed { other, weight: 0.3 })), ..first }
}

/// ∫ f cos and ∫ p (ω·a)² of a mixture, by uniform directions and by sampling.
#[test]
fn mixtures_are_sampled_by_their_density() {
    let models = bsdfs();
    let opaque: Vec<&Bsdf> = models.iter().filter(|bsdf| !bsdf.transmits()).collect();
    let viewer = DVec3::new(0.0, 0.6, 0.8);
    let axis = DVec3::new(0.3, 0.5, 0.81).normalize();
    for pair in opaque.windows(2) {
        let coatings = [pair[0].coating(), pair[1].coating()];
        let mixed = mixture([pair[0], pair[1]], [&coatings[0], &coatings[1]], viewer);
        let alone = [0, 1].map(|k| shading(pair[k], &coatings[k], viewer));
        let (mut rng, n) = (stream(2, &[]), 200_000);
        let (mut uniformly, mut sampled) = ([0.0; 2], [0.0; 2]);
        for _ in 0..n {
            let direction = uniform(&mut rng);
            let value = mixed.evaluate(Vec3::constant(direction)).value().x;
            let [a, b] = [0, 1].map(|k| alone[k].evaluate(Vec3::constant(direction)).value().x);
            assert!((value - 0.7 * a - 0.3 * b).abs() < 1e-12 * value.max(1.0), "{pair:?}");
            uniformly[0] += 4.0 * PI * value;
            uniformly[1] += 4.0 * PI * mixed.density(direction) * direction.dot(axis).powi(2);
            let xi = [(); 3].map(|()| open01(&mut rng));
            if let Some(Bounce::Smooth(s)) = mixed.sample(xi) {
                sampled[0] += mixed.evaluate(Vec3::constant(s.direction)).value().x / s.density;
                sampled[1] += s.direction.dot(axis).powi(2);
            }
        }
        for i in 0..2 {
            let (a, b) = (uniformly[i] / f64::from(n), sampled[i] / f64::from(n));
            assert!((a - b).abs() < 0.03 * a.abs().max(b.abs()), "{pair:?} {i}: {a} {b}");
        }
    }
}

/// A random direction, uniform on the unit sphere.
fn uniform(rng: &mut flatland::random::Stream) -> DVec3 {
    let z = 2.0 * open01(rng) - 1.0;
    let (sin, cos) = (TAU * open01(rng)).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

#[test]
fn sampling_agrees_with_its_density_and_with_the_albedo() {
    for bsdf in &bsdfs() {
        let coating = bsdf.coating();
        for viewer in [DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8), DVec3::new(-0.48, -0.6, -0.64)] {
            let shading = shading(bsdf, &coating, viewer);
            if shading.behind && !bsdf.transmits() {
                continue;
            }
            let mut rng = stream(1, &[]);
            let n = 400_000;
            let axis = DVec3::new(0.3, 0.5, 0.81).normalize();
            // ∫ f cos and ∫ p (ω·a)², by uniform directions and by sampling.
            let (mut uniformly, mut sampled) = ([0.0; 2], [0.0; 2]);
            for _ in 0..n {
                let direction = uniform(&mut rng);
                let value = shading.evaluate(Vec3::constant(direction)).value().x;
                uniformly[0] += 4.0 * PI * value;
                uniformly[1] += 4.0 * PI * shading.density(direction) * direction.dot(axis).powi(2);
                let xi = [(); 3].map(|()| open01(&mut rng));
                if let Some(Bounce::Smooth(s)) = shading.sample(xi) {
                    sampled[0] += shading.evaluate(Vec3::constant(s.direction)).value().x / s.density;
                    sampled[1] += s.direction.dot(axis).powi(2);
                }
            }
            for i in 0..2 {
                let (a, b) = (uniformly[i] / f64::from(n), sampled[i] / f64::from(n));
                // Refracted lobes are narrow: uniform directions estimate their integral with a standard
                // error of 1 %.
                let tolerance = if bsdf.transmits() { 0.05 } else { 0.02 };
                let scale = a.abs().max(b.abs());
                assert!((a - b).abs() < tolerance * scale, "{bsdf:?} {viewer} {i}: {a} {b}");
            }
            // Radiance is scaled by η² in a denser medium, so that the integral may exceed 1 from within.
            // Principled models add sheen and a coat to a white base, and do not conserve energy.
            let most = if shading.behind { 1.5 * 1.5 } else { 1.005 };
            let balanced = !matches!(bsdf, Bsdf::Principled(_) | Bsdf::PrincipledThin(_));
            let albedo = sampled[0] / f64::from(n);
            assert!(
                !balanced || albedo < most,
                "no surface reflects more than it receives: {bsdf:?} {albedo}"
            );
        }
    }
}

#[test]
fn reflection_is_reciprocal() {
    let mut rng = stream(3, &[]);
    for bsdf in &bsdfs() {
        let coating = bsdf.coating();
        for _ in 0..100 {
            let (a, b) = (uniform(&mut rng), uniform(&mut rng));
            let n = DVec3::new(0.6, 0.0, 0.8);
            if a.dot(n) > 0.01 && b.dot(n) > 0.01 {
                let f = |i: DVec3, o: DVec3| {
                    shading(bsdf, &coating, i).evaluate(Vec3::constant(o)).value().x / o.dot(n)
                };
                assert!((f(a, b) - f(b, a)).abs() < 1e-10 * f(a, b));
            }
        }
    }
}

/// f(v, ω) η² = f(ω, v) across a boundary: in thermodynamic equilibrium radiance is proportional to η².
#[test]
fn refraction_is_reciprocal_but_for_the_compression_of_radiance() {
    let mut rng = stream(4, &[]);
    let normal = DVec3::new(0.6, 0.0, 0.8);
    let mut found = 0;
    for distribution in [Microfacets::Beckmann, Microfacets::Ggx] {
        let bsdf = dielectric(Some(Roughness::new(distribution, ALPHA)));
        for _ in 0..4000 {
            let (above, below) = (uniform(&mut rng), uniform(&mut rng));
            if above.dot(normal) < 0.05 || below.dot(normal) > -0.05 {
                continue;
            }
            let f = |i: DVec3, o: DVec3| {
                shading(&bsdf, &None, i).evaluate(Vec3::constant(o)).value().x / o.dot(normal).abs()
            };
            let (inwards, outwards) = (f(above, below) * 1.5 * 1.5, f(below, above));
            assert!((inwards - outwards).abs() <= 1e-8 * outwards, "{inwards} {outwards}");
            found += usize::from(outwards > 0.0);
        }
    }
    assert!(found > 20, "facets refract one direction into another");
}

/// Reflectance and transmittance of an ideal boundary add up to 1, and refracted directions obey Snell's law
/// from both sides.
#[test]
fn smooth_boundaries_lose_nothing() {
    let bsdf = dielectric(None);
    let normal = DVec3::new(0.6, 0.0, 0.8);
    for (viewer, eta) in [(DVec3::new(0.0, 0.6, 0.8), 1.5), (DVec3::new(0.0, -0.2, -0.979_795_9), 1.0 / 1.5)]
    {
        let viewer = viewer.normalize();
        let shading = shading(&bsdf, &None, viewer);
        let (mut reflected, mut passed) = (0.0, 0.0);
        for i in 0..1000 {
            let Some(Bounce::Ideal(ideal)) = shading.sample([0.5, 0.5, (f64::from(i) + 0.5) / 1000.0]) else {
                panic!("a smooth boundary is ideal");
            };
            let direction = ideal.direction.value();
            assert!((direction.length() - 1.0).abs() < 1e-12);
            if direction.dot(normal) * viewer.dot(normal) > 0.0 {
                reflected += 1e-3 * ideal.factor.value().x;
            } else {
                let [incoming, outgoing] = [viewer, direction].map(|d| d.cross(normal).length());
                assert!((incoming - eta * outgoing).abs() < 1e-12, "{incoming} {outgoing}");
                passed += 1e-3 * ideal.factor.value().x;
            }
        }
        let expected = fresnel::dielectric(viewer.dot(normal).abs(), eta).0;
        assert!((reflected - expected).abs() < 2e-3, "{reflected} {expected}");
        assert!((passed * eta * eta - (1.0 - expected)).abs() < 2e-3, "{passed} {expected}");
    }
}

/// Derivatives by the roughness and the colour, also of the coating, agree with differences.
#[test]
fn derivatives_by_parameters_are_those_of_differences() {
    // The same step as in the coating's own test; see there.
    let (viewer, h) = (DVec3::new(0.0, 0.6, 0.8), 5e-3);
    for bsdf in &bsdfs() {
        let Some(alpha) = bsdf.roughness() else { continue };
        let coating = bsdf.coating();
        for direction in [DVec3::new(0.8, -0.36, 0.48), DVec3::new(-0.1, -0.5, -0.8).normalize()] {
            let at = |alpha: f64, colour: f64| {
                let mut changed = bsdf.clone();
                *changed.roughness_mut().expect("it has one") = alpha;
                let coating = changed.coating();
                let mut shading = shading(&changed, &coating, viewer);
                shading.reflectance = Rgb::constant(DVec3::splat(colour));
                shading.evaluate(Vec3::constant(direction)).value().x
            };
            let still = shading(bsdf, &coating, viewer);
            let moving = Shading {
                bsdf,
                coating: still.coating,
                normal: Vec3::constant(still.normal.value()),
                viewer: Vec3::constant(viewer),
                reflectance: Rgb([Dual::new(0.7, [0.0, 1.0]); 3]),
                roughness: Dual::new(alpha, [1.0, 0.0]),
                across: {
                    let stretch = bsdf.facets().map_or(0.0, |facets| facets.stretch);
                    Dual::new(alpha * stretch, [stretch, 0.0])
                },
                numbers: numbers(bsdf, Dual::new(alpha, [1.0, 0.0])),
                along: still.along.map(|along| Vec3::constant(along.value())),
                behind: false,
                opacity: None,
                black: false,
                beneath: None,
                blend: None,
            };
            let found = moving.evaluate(Vec3::constant(direction)).0[0].tangent;
            let expected = [
                (at(alpha + h, 0.7) - at(alpha - h, 0.7)) / (2.0 * h),
                (at(alpha, 0.7 + h) - at(alpha, 0.7 - h)) / (2.0 * h),
            ];
            for (found, expected) in found.into_iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-3 + 2e-2 * expected.abs(),
                    "{bsdf:?}: {found} {expected}"
                );
            }
        }
    }
}
