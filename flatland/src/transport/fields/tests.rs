//! Fields over a small world, against differences and by their definition.

use glam::DVec2;

use super::*;
use crate::plane::Filter;
use crate::random::stream;
use crate::transport::{Film, Material, Shape, Tangent};
use crate::warp::assert_transposed;

fn world() -> (World, Camera, Tangent) {
    let p = DVec2::new;
    let shapes = vec![
        Shape::open([p(-3.0, 0.0), p(3.0, 0.3)], Material::diffuse(0.5)),
        Shape::closed([p(-0.5, 1.0), p(0.4, 1.2), p(-0.1, 1.7)], Material::diffuse(0.5)),
    ];
    let world = World::new(0.0, shapes).expect("a world");
    let film = Film { pixels: 6, filter: Filter::Tent };
    let camera = Camera { position: p(0.3, 3.0), angle: -1.6, field_of_view: 1.4, film };
    let mut change = Tangent::moving(&world, [0, 1], |p| DVec2::new(0.3 * p.y + 0.1, p.x * p.x - 0.4));
    change.camera = CameraTangent { position: p(0.2, -0.5), angle: 0.7, field_of_view: -0.4 };
    (world, camera, change)
}

/// V and ∇·V of a construction at a film coordinate, and at an angle around a free point.
fn both(construction: Construction, at: f64) -> [[f64; 2]; 2] {
    let (world, camera, change) = world();
    let mut rng = stream(1, &[]);
    let film = construction.over_film(&world, &camera, at, 44.0, &mut rng);
    let (origin, moves) = (Origin::free(camera.position), change.camera.position);
    let direction = DVec2::from_angle(-2.1 + 0.2 * at);
    let around = construction.around(&world, origin, direction, 20.0, &mut rng);
    let still = CameraTangent::default();
    [film.at(&change.vertices, moves, &change.camera), around.at(&change.vertices, moves, &still)]
}

#[test]
fn divergences_are_slopes() {
    for construction in [Construction::Direct, Construction::Harmonic] {
        for at in [0.7, 2.1, 3.4, 4.9] {
            let h = 1e-6;
            let (plus, here, minus) =
                (both(construction, at + h), both(construction, at), both(construction, at - h));
            for (domain, step) in [(0, 2.0 * h), (1, 0.4 * h)] {
                let slope = (plus[domain][0] - minus[domain][0]) / step;
                let found = here[domain][1];
                assert!(
                    (slope - found).abs() < 1e-6 * (1.0 + found.abs()),
                    "{construction:?} {at} {domain}: {slope} {found}"
                );
            }
        }
    }
}

#[test]
fn the_direct_field_is_the_velocity_of_what_is_seen() {
    // Followed by a displaced camera, the point seen at u is seen at u + V θ.
    let (world, camera, change) = world();
    for u in [0.7, 2.9, 4.9] {
        let hit = world.trace(Origin::free(camera.position), camera.direction(u)).expect("a hit");
        let velocity = world.segments()[hit.segment].material_point(hit.s).velocity(&change.vertices);
        let project = |theta: f64| {
            let moved = change.displaced_camera(&camera, theta);
            moved.project(world.point(&hit) + theta * velocity).expect("in front")
        };
        let rate = (project(1e-6) - project(-1e-6)) / 2e-6;
        assert!((rate - both(Construction::Direct, u)[0][0]).abs() < 1e-7);
    }
}

/// E ∇·V of the followed motion is the slope of E V: the kernel's own slope is all there is.
#[test]
fn a_followed_motion_has_the_slope_of_its_mean() {
    let construction = Construction::Followed { candidates: 2 };
    let (world, camera, change) = world();
    let origin = Origin::free(camera.position);
    let mean = |angle: f64| {
        let mut sum = [0.0; 2];
        for i in 0..200_000 {
            let mut rng = stream(2, &[i]);
            let direction = DVec2::from_angle(angle);
            let field = construction.around(&world, origin, direction, 20.0, &mut rng);
            let at = field.at(&change.vertices, change.camera.position, &CameraTangent::default());
            sum = [sum[0] + at[0] / 2e5, sum[1] + at[1] / 2e5];
        }
        sum
    };
    let (plus, here, minus) = (mean(-1.65), mean(-1.7), mean(-1.75));
    let slope = (plus[0] - minus[0]) / 0.1;
    assert!((slope - here[1]).abs() < 0.1 * (1.0 + slope.abs()), "{slope} {here:?}");
}

#[test]
fn scatter_is_the_transpose_of_field() {
    let (world, camera, change) = world();
    let origin = Origin::free(camera.position);
    let velocity = |p: &MaterialPoint| p.velocity(&change.vertices) - change.camera.position;
    for construction in [Construction::default(), Construction::Harmonic, Construction::Direct] {
        let mut rng = stream(3, &[]);
        let film = construction.over_film(&world, &camera, 2.9, 44.0, &mut rng);
        let around = construction.around(&world, origin, DVec2::from_angle(-1.7), 20.0, &mut rng);
        for field in [film, around] {
            assert!(!field.terms.is_empty());
            assert_transposed(&field, (0.3, -1.1), velocity, DVec2::dot);
        }
    }
}
