use flatland::estimator::*;
use flatland::plane::*;
use flatland::warp::*;
use glam::*;
fn scene(k: usize) -> (Scene, Motion, Film) {
    let p = |v: &[(f64, f64)]| {
        Polygon::simple(v.iter().map(|&(x, y)| DVec2::new(x, y)).collect::<Vec<_>>()).unwrap()
    };
    match k {
        0 => (
            Scene::new(
                DVec3::ZERO,
                vec![Shape::new(
                    p(&[(0.3, -0.4), (2.5, 0.1), (2.1, 2.4), (-0.2, 1.9)]),
                    Shade::constant(DVec3::ONE),
                )],
            )
            .unwrap(),
            Motion::translate([0], DVec2::new(1.0, 0.4)),
            Film::placed(1, 1, Filter::Tent, DVec2::new(-0.3, 0.3), 1.0).unwrap(),
        ),
        1 => (
            Scene::new(
                DVec3::splat(0.2),
                vec![
                    Shape::new(
                        p(&[(2.3, 2.1), (5.9, 2.7), (5.4, 5.6), (2.0, 4.9)]),
                        Shade::constant(DVec3::ONE),
                    ),
                    Shape::new(p(&[(4.3, 1.1), (7.2, 4.2), (3.7, 3.9)]), Shade::constant(DVec3::splat(0.5))),
                ],
            )
            .unwrap(),
            Motion::rotate([0], DVec2::new(4.0, 4.0)).and(Motion::translate([1], DVec2::new(0.3, 0.7))),
            Film::new(8, 8, Filter::Tent).unwrap(),
        ),
        _ => {
            let n = 64;
            let d: Vec<_> = (0..n)
                .map(|i| {
                    let t = i as f64 / n as f64 * std::f64::consts::TAU;
                    (2.0 + 1.3 * t.cos(), 2.0 + 1.3 * t.sin())
                })
                .collect();
            (
                Scene::new(DVec3::ZERO, vec![Shape::new(p(&d), Shade::constant(DVec3::ONE))]).unwrap(),
                Motion::scale([0], DVec2::new(2.0, 2.0)),
                Film::new(4, 4, Filter::Tent).unwrap(),
            )
        }
    }
}
/// slope, variance per pixel (sum), relative to exact square
fn measure(k: usize, m: &WarpedArea) -> (f64, f64, f64, f64) {
    let (s, mo, f) = scene(k);
    let e = Exact.forward(&s, &mo, &f).unwrap();
    let g = m.forward(&s, &mo, &f).unwrap();
    let n = e.mean.pixels().len();
    let (mut se, mut ss, mut var, mut svar) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..n {
        let (a, b, c) = (e.mean.pixels()[i].x, g.mean.pixels()[i].x, g.standard_error.pixels()[i].x);
        se += a * b;
        ss += a * a;
        var += c * c * m.samples as f64;
        svar += a * a * c * c;
    }
    (se / ss, svar.sqrt() / ss, var / ss, (g.rays as f64 / (n * m.samples) as f64) - 1.0)
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let base = |k: usize| if k == 0 { 400_000 } else { 20_000 };
    let wa = |k: usize, n: usize, kappa, gamma, b, focus, points, debias| {
        let _ = n;
        measure(
            k,
            &WarpedArea {
                samples: base(k),
                kappa,
                warp: Warp {
                    weighting: Weighting::BoundaryAware { gamma, boundary: b },
                    points,
                    focus,
                    debias,
                },
                form: Form::Area,
                seed: 1,
            },
        )
    };
    let kappa = 44.0;
    match args[1].as_str() {
        "bias" => {
            for (name, b, gamma) in [
                ("p1 .6 g3", BoundaryFunction::KernelScaled { scale: 0.6 }, 3.0),
                ("p1 .6 g2", BoundaryFunction::KernelScaled { scale: 0.6 }, 2.0),
                ("p1 .4 g2", BoundaryFunction::KernelScaled { scale: 0.4 }, 2.0),
                ("p2 .6 g2", BoundaryFunction::KernelScaledSquared { scale: 0.6 }, 2.0),
                ("p2 1 g2", BoundaryFunction::KernelScaledSquared { scale: 1.0 }, 2.0),
                ("p2 .8 g1.5", BoundaryFunction::KernelScaledSquared { scale: 0.8 }, 1.5),
                ("p2 1 g3", BoundaryFunction::KernelScaledSquared { scale: 1.0 }, 3.0),
                ("p2 .6 g3", BoundaryFunction::KernelScaledSquared { scale: 0.6 }, 3.0),
            ] {
                for focus in [1.0, 0.5, 0.25] {
                    print!("{name} focus {focus}:");
                    for k in [0, 1, 2] {
                        for rays in [4, 16] {
                            let (s, e, v, _) = wa(
                                k,
                                0,
                                kappa,
                                gamma,
                                b,
                                focus,
                                AuxiliaryPoints::Antithetic,
                                Debias::Consistent { rays },
                            );
                            print!("  {s:.3}±{e:.3} v{v:.0}");
                        }
                    }
                    println!();
                }
            }
        }
        "ml" => {
            for (name, b, gamma) in [
                ("p1 .6 g3", BoundaryFunction::KernelScaled { scale: 0.6 }, 3.0),
                ("p2 .6 g2", BoundaryFunction::KernelScaledSquared { scale: 0.6 }, 2.0),
                ("p2 .6 g3", BoundaryFunction::KernelScaledSquared { scale: 0.6 }, 3.0),
            ] {
                for (points, focus) in [
                    (AuxiliaryPoints::Antithetic, 0.5),
                    (AuxiliaryPoints::Antithetic, 0.3),
                    (AuxiliaryPoints::Antithetic, 0.2),
                    (AuxiliaryPoints::Stratified, 0.3),
                ] {
                    let c16: Vec<_> = [0, 1, 2]
                        .iter()
                        .map(|&k| {
                            let r = wa(k, 0, kappa, gamma, b, focus, points, Debias::Consistent { rays: 16 });
                            print!(" c16 {:.3} v{:.1}", r.0, r.2);
                            r.2 * 16.0
                        })
                        .collect();
                    println!();
                    for rays in [4, 8] {
                        for (first, ratio) in [(0.3, 0.3), (0.3, 0.4), (0.5, 0.35)] {
                            print!("{name} {points:?} focus {focus} N0 {rays} first {first} ratio {ratio}:");
                            for k in [0, 1, 2] {
                                let (s, e, v, r) = wa(
                                    k,
                                    0,
                                    kappa,
                                    gamma,
                                    b,
                                    focus,
                                    points,
                                    Debias::Multilevel { rays, first, ratio },
                                );
                                print!("  {s:.3}±{e:.3} v{v:.0} r{r:.1} ratio {:.2}", v * r / c16[k]);
                            }
                            println!();
                        }
                    }
                }
            }
        }
        _ => {}
    }
}
