use std::path::Path;

use flatland::sdf::Sdf as _;
use glam::DVec3;

use super::{RedistanceError, Slopes, redistance};
use crate::io::read_obj;
use crate::sdf::analytic::Knot;
use crate::sdf::{Grid, Interpolation, from_mesh, isosurface};

const BUNNY: &[u8] = include_bytes!("../../../../figures/assets/bunny.obj");
const CORNERS: (DVec3, DVec3) = (DVec3::splat(-1.0), DVec3::splat(1.0));

fn ball(interpolation: Interpolation, cells: usize) -> Grid {
    Grid::sampled(interpolation, CORNERS, cells, |x| (x - 0.03).length() - 0.6).unwrap()
}

fn knot(cells: usize) -> Grid {
    let knot = Knot::new(DVec3::ZERO, (2, 3), (0.55, 0.25), 0.1).unwrap();
    Grid::sampled(Interpolation::Cubic, CORNERS, cells, |x| knot.jet(x).value).unwrap()
}

fn bunny(cells: usize) -> Grid {
    let mesh = read_obj(BUNNY, Path::new("bunny.obj")).unwrap();
    from_mesh(&mesh, Interpolation::Cubic, cells, 0.1).unwrap().grid
}

/// The grid with every node multiplied by a factor that depends on its position.
fn times(grid: &Grid, factor: impl Fn(DVec3, f64) -> f64) -> Grid {
    let nodes = grid.nodes().iter().enumerate();
    let nodes = nodes.map(|(index, &value)| value * factor(grid.position(index), value)).collect();
    Grid::new(grid.interpolation(), grid.low(), grid.spacing(), grid.size(), nodes).unwrap()
}

/// Slopes from 1 to 3, varying with a wavelength of 0.73 in a box of side 2.
fn distorted(grid: &Grid) -> Grid {
    times(grid, |x, _| 2.0 + (7.0 * x.x + 5.0 * x.y).sin())
}

/// Deviation of φ from 0, in cells, and of |∇φ| from 1 at given points: maximum and root mean square of φ,
/// and root mean square of the slopes.
fn off(grid: &Grid, points: &[DVec3]) -> (f64, f64, f64) {
    let (mut most, mut square, mut slopes) = (0.0_f64, 0.0, 0.0);
    for &x in points {
        let jet = grid.jet(x);
        let (value, slope) = (jet.value / grid.spacing().x, jet.gradient.length() - 1.0);
        most = most.max(value.abs());
        square += value * value;
        slopes += slope * slope;
    }
    let count = points.len() as f64;
    (most, (square / count).sqrt(), (slopes / count).sqrt())
}

fn surface(grid: &Grid) -> Vec<DVec3> {
    let cells = grid.size().into_iter().max().unwrap() - 1;
    isosurface(grid, (grid.low(), grid.high()), cells).unwrap().positions().to_vec()
}

fn same_signs(a: &Grid, b: &Grid) -> bool {
    a.nodes().iter().zip(b.nodes()).all(|(a, b)| (*a > 0.0) == (*b > 0.0))
}

/// Prints errors and times over repeated redistancing.
#[test]
#[ignore = "takes minutes"]
fn measure() {
    for (name, grid) in [("ball", ball(Interpolation::Cubic, 64)), ("knot", knot(64)), ("bunny", bunny(64))] {
        for (kind, grid) in [("as sampled", grid.clone()), ("distorted", distorted(&grid))] {
            let points = surface(&grid);
            let mut new = grid.clone();
            let begin = off(&grid, &points);
            println!("{name} {kind} before: {begin:.7?} bound {:.3}", grid.slope_bound());
            for round in 1..=100 {
                let clock = std::time::Instant::now();
                let next = redistance(&new, Slopes::Overall).unwrap();
                let time = clock.elapsed();
                assert!(same_signs(&new, &next));
                new = next;
                if [1, 2, 10, 100].contains(&round) {
                    let off = off(&new, &points);
                    println!("{name} {kind} {round}: {off:.7?} bound {:.3} {time:.1?}", new.slope_bound());
                }
            }
        }
    }
    for cells in [64, 128] {
        let grid = ball(Interpolation::Cubic, cells);
        let clock = std::time::Instant::now();
        redistance(&grid, Slopes::Overall).unwrap();
        println!("{cells} cells: {:.1?}", clock.elapsed());
    }
}

#[test]
fn the_surface_stays_however_often_distances_are_made() {
    for (name, grid) in [
        ("ball", ball(Interpolation::Cubic, 24)),
        ("knot", knot(32)),
        ("bunny", bunny(32)),
        ("distorted bunny", distorted(&bunny(32))),
    ] {
        let points = surface(&grid);
        let mut new = redistance(&grid, Slopes::Overall).unwrap();
        let slope_bound = new.slope_bound();
        for _ in 0..30 {
            let next = redistance(&new, Slopes::Overall).unwrap();
            assert!(same_signs(&next, &grid), "{name}");
            new = next;
        }
        let (most, ..) = off(&new, &points);
        assert!(most < 1e-11, "{name}: {most} after 31 times");
        assert!(new.slope_bound() < 1.01 * slope_bound, "{name}: {slope_bound}, then {}", new.slope_bound());
        // No new surface appears.
        let (most, ..) = off(&grid, &surface(&new));
        assert!(most < 1e-10, "{name}: {most}");
    }
}

/// The surface hardly moves for smooth distances, whose mean slope is 1 everywhere.
#[test]
fn local_slopes_hardly_move_what_is_a_distance() {
    for (name, grid, most) in [("ball", ball(Interpolation::Cubic, 32), 1e-6), ("knot", knot(48), 1e-3)] {
        let points = surface(&grid);
        let mut new = grid;
        for _ in 0..20 {
            new = redistance(&new, Slopes::Local).unwrap();
        }
        let (found, ..) = off(&new, &points);
        assert!(found < most, "{name}: {found} after 20 times");
    }
}

#[test]
fn slopes_return_to_one() {
    let grid = ball(Interpolation::Cubic, 48);
    let points = surface(&grid);
    let thrice = redistance(&times(&grid, |_, _| 3.0), Slopes::Overall).unwrap();
    let (most, _, slopes) = off(&thrice, &points);
    assert!(most < 1e-12 && slopes < 1e-3, "{most} {slopes}");
    let wavy = distorted(&grid);
    let points = surface(&wavy);
    let (_, _, before) = off(&wavy, &points);
    let mut new = wavy;
    for _ in 0..3 {
        new = redistance(&new, Slopes::Local).unwrap();
    }
    let (most, _, after) = off(&new, &points);
    // Variations over 18 cells, which the lattice with spacing 8 mostly resolves.
    assert!(most < 0.01 && before > 1.0 && after < 0.2, "{most} {before} {after}");
}

/// Values away from the surface are discarded. The error of the upwind scheme is about one cell, slightly
/// more on larger grids.
#[test]
fn distances_far_away_have_errors_of_a_cell() {
    for interpolation in [Interpolation::Trilinear, Interpolation::Cubic] {
        for cells in [24, 48] {
            let grid = ball(interpolation, cells);
            let h = grid.spacing().x;
            let spoilt = times(&grid, |x, value| if value.abs() > 7.0 * h { 1.5 + x.x } else { 1.0 });
            let new = redistance(&spoilt, Slopes::Overall).unwrap();
            // The largest value is at the centre, or in a corner.
            let errors = new.nodes().iter().zip(grid.nodes()).map(|(a, b)| (a - b).abs());
            let most = errors.fold(0.0, f64::max);
            assert!(most < 1.2 * h, "{cells}: {most}");
        }
    }
}

#[test]
fn cells_need_not_be_cubes() {
    let (spacing, size) = (DVec3::new(0.05, 0.08, 0.11), [41, 27, 21]);
    let low = DVec3::new(-1.0, -1.0, -1.1);
    let mut nodes = vec![];
    for index in 0..41 * 27 * 21 {
        let place = [index % 41, index / 41 % 27, index / 41 / 27].map(|i| i as f64);
        nodes.push((low + spacing * DVec3::from_array(place)).length() - 0.5);
    }
    for interpolation in [Interpolation::Trilinear, Interpolation::Cubic] {
        let grid = Grid::new(interpolation, low, spacing, size, nodes.clone()).unwrap();
        let new = redistance(&times(&grid, |_, _| 0.2), Slopes::Overall).unwrap();
        for (a, b) in new.nodes().iter().zip(grid.nodes()) {
            assert!((a - b).abs() < 0.11, "{a} for {b}");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let grid = distorted(&knot(24));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| redistance(&grid, Slopes::Local).unwrap())
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_has_no_surface_is_refused() {
    let mut nodes = vec![-1.0; 343];
    nodes[171] = 0.1;
    let grid =
        |interpolation| Grid::new(interpolation, DVec3::ZERO, DVec3::ONE, [7, 7, 7], nodes.clone()).unwrap();
    // The spline smooths the one positive node away.
    assert_eq!(redistance(&grid(Interpolation::Cubic), Slopes::Local), Err(RedistanceError::NoSurface));
    assert!(redistance(&grid(Interpolation::Trilinear), Slopes::Local).is_ok());
    let huge = Grid::new(
        Interpolation::Trilinear,
        DVec3::ZERO,
        DVec3::ONE,
        [7, 7, 7],
        nodes.iter().map(|v| v * 1e308).collect(),
    )
    .unwrap();
    let tiny = Grid::new(
        Interpolation::Trilinear,
        DVec3::ZERO,
        DVec3::ONE,
        [7, 7, 7],
        nodes.iter().map(|v| v * 1e-308).collect(),
    )
    .unwrap();
    for grid in [huge, tiny] {
        // Slopes or their squares overflow: the result is an error, or finite.
        assert!(
            redistance(&grid, Slopes::Local).map_or(true, |new| new.nodes().iter().all(|v| v.is_finite()))
        );
    }
}
