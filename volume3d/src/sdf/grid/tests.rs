use flatland::random::{Stream, open01, stream};
use flatland::sdf::shapes::Parametric as _;
use flatland::sdf::{Jet, Sdf as _};
use glam::DVec3;

use super::{Grid, GridError, Interpolation};

const BOTH: [Interpolation; 2] = [Interpolation::Trilinear, Interpolation::Cubic];

fn vector(random: &mut Stream, reach: f64) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| reach * (2.0 * open01(random) - 1.0)))
}

/// A grid of random nodes with cells that are not cubes.
fn rough(interpolation: Interpolation) -> Grid {
    let (size, mut random) = ([5, 6, 7], stream(1, &[]));
    let nodes = (0..210).map(|_| open01(&mut random) - 0.5).collect();
    let spacing = DVec3::new(0.3, 0.25, 0.2);
    Grid::new(interpolation, DVec3::new(-0.7, -0.6, -0.5), spacing, size, nodes).unwrap()
}

fn ball(interpolation: Interpolation, cells: usize) -> Grid {
    let corners = (DVec3::splat(-1.0), DVec3::splat(1.0));
    Grid::sampled(interpolation, corners, cells, |x| (x - 0.03).length() - 0.6).unwrap()
}

/// Points inside and some beyond the border.
#[test]
fn derivatives_are_those_of_the_value() {
    let h = 1e-5;
    let open = BOTH.map(|interpolation| (rough(interpolation), 0.9));
    let closed = BOTH.map(|interpolation| (ball(interpolation, 16), 1.6));
    for (grid, reach) in open.into_iter().chain(closed) {
        let (mut random, mut checked) = (stream(2, &[]), 0);
        for _ in 0..400 {
            let (x, v) = (vector(&mut random, reach), vector(&mut random, 1.0));
            let local = (x - grid.low()) / grid.spacing();
            // A trilinear gradient is discontinuous at nodes, and a cubic Hessian has kinks there.
            if (local - local.round()).abs().min_element() < 1e-3 {
                continue;
            }
            checked += 1;
            let direction: Vec<f64> = grid.nodes().iter().map(|_| open01(&mut random) - 0.5).collect();
            let moved = |h: f64| {
                let nodes: Vec<f64> = grid.nodes().iter().zip(&direction).map(|(p, d)| p + h * d).collect();
                grid.with_parameters(&nodes).unwrap()
            };
            let difference = |f: &dyn Fn(f64) -> f64| (f(h) - f(-h)) / (2.0 * h);
            let (second, rate) = (grid.second_order(x), grid.rate(x, &direction));
            assert_eq!(second.jet, grid.jet(x));
            assert_eq!(second.jet.value, grid.value(x));
            let bend = second.hessian * v;
            let along = |axis: usize| difference(&|h| grid.jet(x + h * v).gradient[axis]);
            let pairs = [
                (second.jet.gradient.dot(v), difference(&|h| grid.jet(x + h * v).value)),
                (bend.x, along(0)),
                (bend.y, along(1)),
                (bend.z, along(2)),
                (rate.value, difference(&|h| moved(h).jet(x).value)),
                (rate.gradient.dot(v), difference(&|h| moved(h).jet(x).gradient.dot(v))),
            ];
            for (index, (found, expected)) in pairs.into_iter().enumerate() {
                let error = (found - expected).abs();
                assert!(error < 1e-6 * (1.0 + expected.abs()), "{index} at {x}: {found} for {expected}");
            }
        }
        assert!(checked > 300, "{checked}");
    }
}

#[test]
fn the_parameter_gradient_is_the_transpose_of_the_rate() {
    let open = BOTH.map(|interpolation| (rough(interpolation), 1.0));
    let closed = BOTH.map(|interpolation| (ball(interpolation, 16), 1.6));
    for (grid, reach) in open.into_iter().chain(closed) {
        let mut random = stream(3, &[]);
        for _ in 0..300 {
            let x = vector(&mut random, reach);
            let covector = Jet { value: open01(&mut random) - 0.5, gradient: vector(&mut random, 1.0) };
            let direction: Vec<f64> = grid.nodes().iter().map(|_| open01(&mut random) - 0.5).collect();
            let mut gradient = vec![0.0; direction.len()];
            grid.add_parameter_gradient(x, covector, &mut gradient);
            let reverse: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
            let forward = covector.dot(grid.rate(x, &direction));
            let size = 1.0 + gradient.iter().map(|g| g.abs()).sum::<f64>();
            assert!((forward - reverse).abs() < 1e-14 * size, "{x}: {forward} {reverse}");
        }
    }
}

/// The bound on |∇φ| where φ > 0, for random nodes, which come close to it, and for distances, where it is
/// little above 1.
#[test]
fn no_slope_exceeds_the_bound() {
    for interpolation in BOTH {
        for (grid, reached) in [(rough(interpolation), 0.3), (ball(interpolation, 32), 0.8)] {
            let (mut random, mut most) = (stream(4, &[]), 0.0_f64);
            for _ in 0..100_000 {
                let jet = grid.jet(vector(&mut random, 1.05));
                if jet.value > 0.0 {
                    most = most.max(jet.gradient.length());
                }
            }
            let bound = grid.slope_bound();
            assert!(most <= bound * (1.0 + 1e-12) && most > reached * bound, "{most} {bound}");
        }
        assert!(ball(interpolation, 32).slope_bound() < 1.2);
        let plane = Grid::sampled(interpolation, (-DVec3::ONE, DVec3::ONE), 8, |x| {
            DVec3::new(2.0, 3.0, 6.0).dot(x) / 7.0
        });
        assert!((plane.unwrap().slope_bound() - 1.0).abs() < 1e-12);
    }
}

/// Away from the border, where nodes are repeated.
#[test]
fn subdivision_is_the_same_function() {
    for interpolation in BOTH {
        let grid = rough(interpolation);
        let finer = grid.subdivided().unwrap();
        assert_eq!((finer.size(), finer.high()), ([9, 11, 13], grid.high()));
        let (mut random, mut checked) = (stream(6, &[]), 0);
        for _ in 0..1000 {
            let x = vector(&mut random, 0.9);
            let inside = (x - grid.low()).min(grid.high() - x) / grid.spacing();
            if inside.min_element() > 1.0 {
                checked += 1;
                let (a, b) = (grid.jet(x), finer.jet(x));
                assert!((a.value - b.value).abs() < 1e-14, "{x}");
                assert!((a.gradient - b.gradient).length() < 1e-12, "{x}");
            }
        }
        assert!(checked > 50, "{checked}");
    }
}

/// The bound on second derivatives where φ > 0, for random nodes and for distances. A trilinear grid has no
/// bound.
#[test]
fn no_second_derivative_exceeds_the_bound() {
    assert_eq!(rough(Interpolation::Trilinear).second_derivative_bound(), f64::INFINITY);
    for (grid, reached) in [(rough(Interpolation::Cubic), 0.2), (ball(Interpolation::Cubic, 32), 0.2)] {
        let (mut random, mut most) = (stream(5, &[]), 0.0_f64);
        for _ in 0..100_000 {
            // Beyond the border of a closed grid φ is another function.
            let there = grid.second_order(vector(&mut random, 1.0));
            if there.jet.value > 0.0 {
                let s = vector(&mut random, 1.0).normalize();
                most = most.max(s.dot(there.hessian * s).abs());
            }
        }
        let bound = grid.second_derivative_bound();
        assert!(most <= bound * (1.0 + 1e-12) && most > reached * bound, "{most} {bound}");
    }
}

/// The spline reproduces linear functions, and smooths curved ones: it adds h²/6 times the Laplacian.
#[test]
fn a_ball_is_found_where_it_is() {
    let on_surface = DVec3::splat(0.03) + 0.6 * DVec3::new(2.0, -3.0, 6.0) / 7.0;
    let trilinear = ball(Interpolation::Trilinear, 64).jet(on_surface).value;
    assert!(trilinear.abs() < 1e-3, "{trilinear}");
    let (cubic, h) = (ball(Interpolation::Cubic, 64).jet(on_surface).value, 2.0 / 64.0);
    let smoothed = h * h / 6.0 * 2.0 / 0.6;
    assert!((cubic - smoothed).abs() < 0.05 * smoothed, "{cubic} {smoothed}");
}

/// Prefiltered, a ball's spline lacks the error of h²/6 times the Laplacian, and the remaining error is of
/// higher order.
#[test]
fn prefiltered_splines_pass_close_to_their_samples() {
    let on_surface = DVec3::splat(0.03) + 0.6 * DVec3::new(2.0, -3.0, 6.0) / 7.0;
    let errors = [32, 64].map(|cells| {
        let grid = ball(Interpolation::Cubic, cells);
        let new = grid.clone().prefiltered().unwrap();
        assert!(new.slope_bound() < grid.slope_bound() + 0.03, "{}", new.slope_bound());
        let far = 2.0 * grid.spacing().length();
        assert!(grid.nodes().iter().zip(new.nodes()).all(|(d, c)| d == c || d.abs() < far));
        new.jet(on_surface).value.abs()
    });
    assert!(errors[0] < 1e-5 && errors[1] < 0.15 * errors[0], "{errors:?}");
    let plane = |interpolation| {
        let value = |x: DVec3| DVec3::new(2.0, 3.0, 6.0).dot(x) / 7.0;
        Grid::sampled(interpolation, (-DVec3::ONE, DVec3::ONE), 8, value).unwrap()
    };
    for grid in BOTH.map(plane) {
        let new = grid.clone().prefiltered().unwrap();
        assert!(grid.nodes().iter().zip(new.nodes()).all(|(d, c)| (d - c).abs() < 1e-15));
    }
    let trilinear = ball(Interpolation::Trilinear, 16);
    assert_eq!(trilinear.clone().prefiltered(), Ok(trilinear));
}

/// Beyond the border φ combines its value on the border and the distance from the border, and does not exceed
/// the distance from the surface.
#[test]
fn beyond_the_border_phi_grows() {
    for (interpolation, margin) in [(Interpolation::Trilinear, 0.0), (Interpolation::Cubic, 1.0)] {
        let grid = ball(interpolation, 16);
        for far in [3.0, 1e10, 1e150] {
            let x = DVec3::new(far, -far, far);
            let jet = grid.jet(x);
            let corner = (DVec3::new(0.97, -1.03, 0.97)).length() - 0.6;
            let box_corner = DVec3::new(grid.high().x, grid.low().y, grid.high().z)
                + DVec3::new(1.0, -1.0, 1.0) * margin * grid.spacing();
            let expected = corner.hypot(x.distance(box_corner));
            assert!((jet.value - expected).abs() < 1e-12 * expected, "{} {expected}", jet.value);
            assert!(jet.gradient.length() <= 1.0 + 1e-12);
        }
        let mut random = stream(7, &[]);
        for _ in 0..1000 {
            let x = vector(&mut random, 3.0);
            let distance = (x - DVec3::new(0.03, 0.03, 0.03)).length() - 0.6;
            assert!(grid.jet(x).value <= distance + 0.02, "{x}");
        }
    }
}

#[test]
fn bad_grids_are_refused() {
    let new = |size, spacing, nodes| Grid::new(Interpolation::Cubic, DVec3::ZERO, spacing, size, nodes);
    let good = vec![-1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    let with = |index: usize, value: f64| {
        let mut nodes = good.clone();
        nodes[index] = value;
        nodes
    };
    assert!(new([2, 3, 2], DVec3::ONE, good.clone()).is_ok());
    let few = new([12, 1, 1], DVec3::ONE, good.clone()).unwrap_err();
    assert_eq!(few.to_string(), "a grid of 12 × 1 × 1 nodes has no cell; at least 2 × 2 × 2 are needed");
    let count = new([2, 2, 2], DVec3::ONE, good.clone()).unwrap_err();
    assert_eq!(count, GridError::Count { size: [2, 2, 2], found: 12 });
    let huge = new([usize::MAX, 2, 2], DVec3::ONE, good.clone());
    assert!(matches!(huge, Err(GridError::Count { .. })));
    let nan = new([2, 3, 2], DVec3::ONE, with(9, f64::NAN)).unwrap_err();
    assert_eq!(nan.to_string(), "node (1, 1, 1) is NaN; every node must be finite");
    let infinite = new([2, 3, 2], DVec3::ONE, with(5, f64::INFINITY));
    assert!(matches!(infinite, Err(GridError::NotFinite { node: [1, 2, 0], .. })));
    let empty = new([2, 3, 2], DVec3::ONE, with(0, 2.0));
    assert_eq!(empty, Err(GridError::OneSign { sign: "positive" }));
    let full = new([2, 3, 2], DVec3::ONE, vec![-1.0; 12]);
    assert_eq!(full, Err(GridError::OneSign { sign: "0 or negative" }));
    for spacing in [DVec3::new(1.0, 0.0, 1.0), DVec3::NAN, DVec3::INFINITY] {
        assert!(matches!(new([2, 3, 2], spacing, good.clone()), Err(GridError::Place { .. })));
    }
    let grid = new([2, 3, 2], DVec3::ONE, good.clone()).unwrap();
    assert!(grid.with_parameters(&good).is_ok());
    assert!(grid.with_parameters(&good[1..]).is_err() && grid.with_parameters(&with(0, 1.0)).is_err());
}

/// Closing does not change a closed grid, however near its surface comes to the border; in an open grid it
/// changes only nodes of the border that are inside.
#[test]
fn closing_changes_no_more_than_it_must() {
    for interpolation in BOTH {
        let near = |radius: f64| {
            let corners = (DVec3::NEG_ONE, DVec3::ONE);
            Grid::sampled(interpolation, corners, 16, |x| x.length() - radius).expect("a grid")
        };
        let closed = near(0.86);
        assert!(closed.bounds().is_some());
        assert_eq!(closed.clone().closed().as_ref(), Ok(&closed));
        let open = near(1.05);
        assert_eq!(open.bounds(), None);
        let made = open.clone().closed().expect("a grid");
        assert!(made.bounds().is_some());
        for (index, (before, after)) in open.nodes().iter().zip(made.nodes()).enumerate() {
            let is_border = made.position(index).abs().max_element() > 0.8;
            assert!(before == after || (is_border && *before <= 0.0 && *after > 0.0), "{index}");
        }
    }
    // Thin grids consist almost only of border.
    let corners = (DVec3::new(-1.0, -1.0, -0.15), DVec3::new(1.0, 1.0, 0.15));
    let thin = Grid::sampled(Interpolation::Trilinear, corners, 20, |x| {
        (x / DVec3::new(1.0, 1.0, 0.15)).length() - 0.6
    });
    let thin = thin.expect("a grid");
    assert_eq!(thin.clone().closed(), Ok(thin));
}

/// The box encloses the nodes unless the surface, or the level, reaches the border.
#[test]
fn the_box_is_that_of_the_nodes_if_the_border_is_outside() {
    for interpolation in BOTH {
        let grid = ball(interpolation, 16);
        assert_eq!(grid.bounds(), Some((grid.low(), grid.high())));
        // The nearest layers are 0.97 and, for splines, 0.845 from the centre.
        assert!(grid.level_bounds(0.24).is_some() && grid.level_bounds(0.38).is_none());
        assert_eq!(grid.level_bounds(0.3).is_some(), interpolation == Interpolation::Trilinear);
        assert_eq!(rough(interpolation).bounds(), None);
        let mut random = stream(5, &[]);
        for _ in 0..2000 {
            let x = vector(&mut random, 1.5);
            assert!(x.abs().max_element() <= 1.0 || grid.jet(x).value > 0.24, "{x}");
        }
    }
}

/// The distance from two points has a ridge between them that is oblique to the axes: node differences
/// overestimate slopes there by up to √2. No slope exceeds the bound of a neighbouring cell.
#[test]
fn ridges_hardly_count_in_slope_bounds() {
    let (a, b) = (DVec3::new(0.5, 0.4, 0.45), DVec3::new(-0.5, -0.4, -0.45));
    let phi = |x: DVec3| (x - a).length().min((x - b).length()) - 0.3;
    let grid = Grid::sampled(Interpolation::Cubic, (-DVec3::ONE, DVec3::ONE), 40, phi).unwrap();
    let mut random = stream(9, &[]);
    let points = (0..20_000).map(|_| vector(&mut random, 1.0));
    let outside = points.map(|x| grid.jet(x)).filter(|jet| jet.value > 0.0);
    let most = outside.map(|jet| jet.gradient.length()).fold(0.0, f64::max);
    let bound = grid.slope_bound();
    assert!(most <= bound && bound < 1.11, "{most} {bound}");
    assert!(grid.slope_bound_everywhere() > 1.3, "{}", grid.slope_bound_everywhere());
}
