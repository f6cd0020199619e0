use flatland::estimator::*;
use flatland::plane::exact::*;
use flatland::plane::*;
use flatland::warp::*;
use glam::*;
fn main() {
    let quad =
        Polygon::simple([(2.3, 2.1), (5.9, 2.7), (5.4, 5.6), (2.0, 4.9)].map(|(x, y)| DVec2::new(x, y)))
            .unwrap();
    let tri = Polygon::simple([(4.3, 1.1), (7.2, 4.2), (3.7, 3.9)].map(|(x, y)| DVec2::new(x, y))).unwrap();
    let g = Shade::quadratic(
        DVec2::new(3.0, 3.0),
        DVec3::new(0.9, 0.5, 0.2),
        [DVec2::new(0.1, 0.05), DVec2::X * 0.1, DVec2::ZERO],
        [DMat2::IDENTITY * 0.05; 3],
        Attachment::Material,
    );
    let scene = Scene::new(
        DVec3::splat(0.2),
        vec![Shape::new(quad, g), Shape::new(tri, Shade::constant(DVec3::new(0.1, 0.7, 0.9)))],
    )
    .unwrap();
    let motion = Motion::rotate([0], DVec2::new(4.0, 4.0)).and(Motion::translate([1], DVec2::new(0.3, 0.7)));
    for filter in [Filter::Box, Filter::Tent, Filter::Gaussian] {
        let film = Film::new(9, 8, filter).unwrap();
        let v = motion.velocities(&scene).unwrap();
        let a = Arrangement::new(&scene, &film).unwrap();
        let b = a.boundary(&film, &v).unwrap();
        let d = a.divergence(&film, &a.oracle(&v));
        let diff = b.zip(&d, |b, d| (b - d).abs());
        println!(
            "{filter:?} max |boundary-divergence| {:e}",
            diff.pixels().iter().map(|p| p.max_element()).fold(0.0, f64::max)
        );
        let exact = Exact.forward(&scene, &motion, &film).unwrap();
        // fd of exact primal
        let h = 1e-4;
        let p = Arrangement::new(&motion.displace(&scene, h).unwrap(), &film).unwrap().primal(&film);
        let m = Arrangement::new(&motion.displace(&scene, -h).unwrap(), &film).unwrap().primal(&film);
        let fd = p.zip(&m, |p, m| (p - m) / (2.0 * h));
        println!(
            "   fd diff {:e}",
            exact
                .mean
                .zip(&fd, |a, b| (a - b).abs())
                .pixels()
                .iter()
                .map(|p| p.max_element())
                .fold(0.0, f64::max)
        );
        let n = 4000;
        let ml = Debias::Multilevel { rays: 8, first: 0.4, ratio: 0.35 };
        let methods: Vec<(String, Box<dyn Method>)> = vec![
            (
                "wa16".into(),
                Box::new(WarpedArea {
                    samples: n,
                    warp: Warp { debias: Debias::Consistent { rays: 16 }, ..Warp::default() },
                    ..WarpedArea::default()
                }),
            ),
            (
                "wa4".into(),
                Box::new(WarpedArea {
                    samples: n,
                    warp: Warp { debias: Debias::Consistent { rays: 4 }, ..Warp::default() },
                    ..WarpedArea::default()
                }),
            ),
            (
                "ml".into(),
                Box::new(WarpedArea {
                    samples: n,
                    warp: Warp { debias: ml, ..Warp::default() },
                    ..WarpedArea::default()
                }),
            ),
            (
                "ml-rep".into(),
                Box::new(WarpedArea {
                    form: Form::Reparameterised,
                    samples: n,
                    warp: Warp { debias: ml, ..Warp::default() },
                    ..WarpedArea::default()
                }),
            ),
            (
                "rr".into(),
                Box::new(WarpedArea {
                    samples: n,
                    warp: Warp { debias: Debias::RussianRoulette { rays: 4, tail: 1.5 }, ..Warp::default() },
                    ..WarpedArea::default()
                }),
            ),
            ("edge".into(), Box::new(EdgeSampling { samples: n, seed: 0 })),
            ("rot".into(), Box::new(Rotation { samples: n, ..Rotation::default() })),
            ("fd".into(), Box::new(FiniteDifference { samples: n, ..FiniteDifference::default() })),
        ];
        let adj = Image::from_pixels(
            &film,
            (0..72).map(|i| DVec3::new((i as f64).sin(), (i as f64).cos(), 1.0)).collect(),
        );
        let re = Exact.reverse(&scene, &film, &adj).unwrap();
        for (name, m) in methods {
            let t = std::time::Instant::now();
            let g = m.forward(&scene, &motion, &film).unwrap();
            let dt = t.elapsed().as_secs_f64();
            let mut chi = 0.0;
            let mut k = 0;
            let mut worst = 0.0_f64;
            let mut var = 0.0;
            let (mut se, mut ss) = (0.0, 0.0);
            for i in 0..72 {
                for c in 0..3 {
                    let (e, m, s) =
                        (exact.mean.pixels()[i][c], g.mean.pixels()[i][c], g.standard_error.pixels()[i][c]);
                    se += e * m;
                    ss += e * e;
                    var += s * s * n as f64;
                    if s > 0.0 {
                        let z = (m - e) / s;
                        chi += z * z;
                        k += 1;
                        worst = worst.max(z.abs());
                    }
                }
            }
            let r = m.reverse(&scene, &film, &adj).unwrap();
            let dot_f = adj.dot(&g.mean);
            let dot_r: f64 = r.mean.iter().zip(&v).map(|(a, b)| a.dot(*b)).sum();
            let rz = r
                .mean
                .iter()
                .zip(&re.mean)
                .zip(&r.standard_error)
                .map(|((a, b), s)| ((*a - *b) / *s).abs().max_element())
                .fold(0.0, f64::max);
            println!(
                "   {name:7} slope {:.4} chi2/n {:.3} worst z {:.2} var*rays {:.1} rays/sample {:.1} time {dt:.2}s  dot {:e} rev z {rz:.2} nonfinite {}",
                se / ss,
                chi / k as f64,
                worst,
                var * g.rays as f64 / (72.0 * n as f64),
                g.rays as f64 / (72.0 * n as f64),
                (dot_f - dot_r).abs(),
                g.non_finite
            );
        }
    }
}
