//! Checks that random scenes have the degeneracy of their kind.

use flatland::plane::orient;
use glam::DVec3;

use super::*;
use crate::effort::pick;
use crate::oracle;
use crate::worst;

/// Image of a displaced case.
fn displaced(case: &Case, theta: f64) -> Vec<DVec3> {
    let scene = case.motion.displace(&case.scene, theta).expect("a small displacement");
    let velocities = vec![DVec2::ZERO; scene.vertices().len()];
    let pixels = oracle::Oracle::new(&scene, &velocities, &case.film).material(&case.scene).image();
    pixels.iter().map(|p| p.value).collect()
}

/// The largest difference of the one-sided derivatives, over all pixels.
fn kink(case: &Case) -> f64 {
    let step = 1e-7;
    let images = [-step, 0.0, step].map(|theta| displaced(case, theta));
    (0..images[0].len())
        .map(|i| ((images[2][i] - 2.0 * images[1][i] + images[0][i]) / step).abs().max_element())
        .fold(0.0, f64::max)
}

#[test]
fn every_kind_has_a_derivative() {
    for kind in Kind::ALL.into_iter().filter(|kind| *kind != Kind::NearlyCoincident) {
        worst::assert_below(1e-4, 0..pick(20, 60_u64), |seed| {
            let case = random(seed, kind);
            (kink(&case), case.label)
        });
    }
}

#[test]
fn cases_without_a_derivative_have_none() {
    for seed in 0..40 {
        let case = non_differentiable(seed);
        let kink = kink(&case);
        assert!(kink > 0.05, "{}: one-sided derivatives differ by only {kink:e}", case.label);
    }
}

#[test]
fn cases_depend_on_their_knobs_alone_and_fit_their_films() {
    for kind in Kind::ALL {
        for seed in 0..200 {
            let (a, b) = (random(seed, kind), random(seed, kind));
            assert_eq!(a.scene.vertices(), b.scene.vertices());
            assert_eq!(a.velocities().len(), a.scene.vertices().len());
            assert!((1..=5).contains(&a.scene.shapes().len()), "{}", a.label);
            let edges = a.scene.edges().count();
            assert!(edges <= 90, "{}: {edges} edges", a.label);
        }
    }
}

/// The fraction of a kind's cases that have a property.
fn share(kind: Kind, holds: impl Fn(&Case) -> bool) -> f64 {
    (0..100).filter(|&seed| holds(&random(seed, kind))).count() as f64 / 100.0
}

/// Whether a vertex of one shape lies exactly inside an edge of another.
fn has_t_junction(case: &Case) -> bool {
    let vertices = case.scene.vertices();
    case.scene.edges().any(|(shape, [a, b])| {
        let (a, b) = (vertices[a], vertices[b]);
        let own = case.scene.vertex_range(shape);
        vertices.iter().enumerate().any(|(i, &p)| {
            !own.contains(&i)
                && orient(a, b, p) == 0.0
                && (p - a).dot(b - a) > 0.0
                && (p - b).dot(a - b) > 0.0
        })
    })
}

/// The number of pairs of edges of different shapes with the same two ends.
fn shared_edges(case: &Case) -> usize {
    let ends = |e: [usize; 2]| {
        let mut ends = e.map(|v| case.scene.vertices()[v].to_array().map(f64::to_bits));
        ends.sort_unstable();
        ends
    };
    let edges: Vec<_> = case.scene.edges().map(|(shape, e)| (shape, ends(e))).collect();
    let pairs = |&(s, e): &(usize, _)| edges.iter().filter(|&&(t, f)| s < t && e == f).count();
    edges.iter().map(pairs).sum()
}

#[test]
fn degenerate_kinds_are_degenerate() {
    assert!(share(Kind::Generic, has_t_junction) == 0.0);
    assert!(share(Kind::TJunction, has_t_junction) == 1.0);
    assert!(share(Kind::CoincidentHidden, has_t_junction) == 1.0);
    let some = share(Kind::CoincidentTogether, |c| shared_edges(c) > 0);
    assert!(some > 0.3 && some < 0.7, "sectors: {some}");
    let together = share(Kind::CoincidentTogether, |c| shared_edges(c) > 0 || has_t_junction(c));
    assert!(together == 1.0, "{together}");
    assert!(share(Kind::NestedCopies, |c| shared_edges(c) >= 3) == 1.0);
    assert!(share(Kind::FilledHole, |c| shared_edges(c) >= 3) == 1.0);
    let meets = |c: &Case| {
        let v = c.scene.vertices();
        (0..v.len()).any(|i| v[..i].contains(&v[i]))
    };
    assert!(share(Kind::SharedVertex, meets) == 1.0);
    let touches = share(Kind::Touching, |c| meets(c) || has_t_junction(c));
    assert!(touches == 1.0, "{touches}");
}

#[test]
fn corners_and_grids_are_met_exactly() {
    let pixels = |c: &Case, p: DVec2| (p - c.film.corner()) / c.film.pixel();
    let whole = |p: DVec2| p == p.round();
    assert!(share(Kind::VertexOnCorner, |c| c.scene.vertices().iter().any(|&p| whole(pixels(c, p)))) == 1.0);
    let through = |c: &Case| {
        let corners = (0..=c.film.width()).flat_map(|x| (0..=c.film.height()).map(move |y| (x, y)));
        let corners: Vec<_> =
            corners.map(|(x, y)| c.film.corner() + c.film.pixel() * DVec2::new(x as f64, y as f64)).collect();
        c.scene.edges().any(|(_, e)| {
            let [a, b] = e.map(|v| c.scene.vertices()[v]);
            corners
                .iter()
                .any(|&p| orient(a, b, p) == 0.0 && (p - a).dot(b - a) > 0.0 && (p - b).dot(a - b) > 0.0)
        })
    };
    assert!(share(Kind::EdgeThroughCorner, through) == 1.0);
    let aligned = |c: &Case| {
        c.scene.edges().any(|(_, e)| {
            let [a, b] = e.map(|v| 2.0 * pixels(c, c.scene.vertices()[v]));
            a.x == b.x && a.x.fract() == 0.0 || a.y == b.y && a.y.fract() == 0.0
        })
    };
    assert!(share(Kind::GridAligned, aligned) == 1.0);
}

#[test]
fn fewer_shapes_leave_the_others_as_they_are() {
    let many = Knobs { shapes: 5, ..Knobs::random(3, Kind::Generic) };
    let few = Knobs { shapes: 2, ..many };
    let (many, few) = (many.build(), few.build());
    for shape in few.scene.shapes() {
        let same = |s: &flatland::plane::Shape| s.polygon().vertices() == shape.polygon().vertices();
        assert!(many.scene.shapes().iter().any(same));
    }
}

#[test]
fn proptest_draws_every_kind() {
    let config = ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() };
    let seen = std::cell::RefCell::new(std::collections::HashSet::new());
    let runner = || {
        let rng = prop::test_runner::TestRng::deterministic_rng(prop::test_runner::RngAlgorithm::XorShift);
        prop::test_runner::TestRunner::new_with_rng(config.clone(), rng)
    };
    let all = runner().run(&knobs(Kind::ALL.to_vec()), |knobs| {
        seen.borrow_mut().insert(knobs.kind);
        prop_assert_eq!(knobs.build().velocities().len(), knobs.build().scene.vertices().len());
        Ok(())
    });
    assert_eq!(all, Ok(()));
    assert_eq!(seen.borrow().len(), Kind::ALL.len());
    // Failures also shrink to the simplest case.
    let simplest = runner().run(&knobs(Kind::ALL.to_vec()), |_| Err(TestCaseError::fail("always")));
    let simplest = match simplest {
        Err(prop::test_runner::TestError::Fail(_, knobs)) => knobs,
        other => panic!("{other:?}"),
    };
    let Knobs { seed, kind, shapes, vertices, filter } = simplest;
    assert_eq!((seed, kind, shapes, vertices, filter), (0, Kind::Generic, 1, 3, Filter::Box));
}
