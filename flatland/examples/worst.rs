use flatland::plane::*;
use flatland::random::*;
use flatland::warp::*;
use glam::*;
fn main() {
    let p = |v: &[(f64, f64)]| {
        Polygon::simple(v.iter().map(|&(x, y)| DVec2::new(x, y)).collect::<Vec<_>>()).unwrap()
    };
    let s = Scene::new(
        DVec3::splat(0.2),
        vec![
            Shape::new(p(&[(2.3, 2.1), (5.9, 2.7), (5.4, 5.6), (2.0, 4.9)]), Shade::constant(DVec3::ONE)),
            Shape::new(p(&[(4.3, 1.1), (7.2, 4.2), (3.7, 3.9)]), Shade::constant(DVec3::splat(0.5))),
        ],
    )
    .unwrap();
    let mo = Motion::rotate([0], DVec2::new(4.0, 4.0)).and(Motion::translate([1], DVec2::new(0.3, 0.7)));
    let vel = mo.velocities(&s).unwrap();
    let kappa = 44.0;
    let focus: f64 = std::env::args().nth(1).unwrap().parse().unwrap();
    let b = BoundaryFunction::KernelScaledSquared { scale: 0.6 };
    let w = Warp {
        weighting: Weighting::BoundaryAware { gamma: 2.0, boundary: b },
        points: AuxiliaryPoints::Antithetic,
        focus,
        debias: Debias::Multilevel { rays: 8, first: 0.3, ratio: 0.3 },
    };
    let mut all = vec![];
    for i in 0..1_000_000u64 {
        let mut rng = stream(i, &[]);
        let u = DVec2::new(1.0 + 7.0 * open01(&mut rng), 0.5 + 6.0 * open01(&mut rng));
        let reach = w.reach(kappa);
        let st = w.stencil::<Plane, _>(u, kappa, &mut rng, |q| {
            let h = s.hit(q);
            let d = h.as_ref().map_or(f64::INFINITY, |h| s.boundary_distance(Some(h), q, reach));
            ((h, q, d), d)
        });
        let f = st.field(|h| h.0.map_or(DVec2::ZERO, |h| h.velocity(&vel)));
        all.push((f.divergence.abs(), f.divergence, u, st.terms().len(), i));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let tot: f64 = all.iter().map(|a| a.0 * a.0).sum();
    println!("E div^2 {}", tot / 1e6);
    let arr = exact::Arrangement::new(&s, &Film::new(8, 8, Filter::Tent).unwrap()).unwrap();
    for a in &all[..12] {
        let dist = arr
            .silhouettes()
            .map(|([p, q], _)| {
                let d = q - p;
                let t = ((a.2 - p).dot(d) / d.length_squared()).clamp(0.0, 1.0);
                (a.2 - p - t * d).length()
            })
            .fold(9.0, f64::min);
        println!(
            "div {:.1} u {} rays {} share {:.3} hit {:?} silh dist/width {:.4}",
            a.1,
            a.2,
            a.3,
            a.0 * a.0 / tot,
            s.hit(a.2).map(|h| h.shape()),
            dist * kappa.sqrt()
        );
    }
    let a = &all[0];
    let mut rng = stream(a.4, &[]);
    let _ = (open01(&mut rng), open01(&mut rng));
    let st = w.stencil::<Plane, _>(a.2, kappa, &mut rng, |q| {
        let h = s.hit(q);
        let d = h.as_ref().map_or(f64::INFINITY, |h| s.boundary_distance(Some(h), q, w.reach(kappa)));
        ((h, q, d), d)
    });
    let mut t: Vec<_> = st.terms().iter().collect();
    t.sort_by(|x, y| (y.divergence.length()).total_cmp(&x.divergence.length()));
    for x in &t[..10.min(t.len())] {
        println!(
            "  r {:.2e} shape {:?} dist {:.2e} w {:.3} M {} v {}",
            (x.hit.1 - a.2).length() * kappa.sqrt(),
            x.hit.0.map(|h| h.shape()),
            x.hit.2 * kappa.sqrt(),
            x.weight,
            x.divergence,
            x.hit.0.map_or(DVec2::ZERO, |h| h.velocity(&vel))
        );
    }
    // consistent reference
    for n in [8, 16, 64, 1024, 65536, 1 << 20] {
        let wc = Warp { debias: Debias::Consistent { rays: n }, ..w };
        let f = wc
            .stencil::<Plane, _>(a.2, kappa, &mut stream(5, &[]), |q| {
                let h = s.hit(q);
                let d = h.as_ref().map_or(f64::INFINITY, |h| s.boundary_distance(Some(h), q, w.reach(kappa)));
                (h, d)
            })
            .field(|h| h.map_or(DVec2::ZERO, |h| h.velocity(&vel)));
        println!("  N {n} {f:?}");
    }
}
