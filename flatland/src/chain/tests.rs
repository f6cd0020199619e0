use std::f64::consts::TAU;

use glam::DVec2;

use super::*;

fn surface(curve: Curve) -> Surface {
    Surface { curve, optics: Optics::Mirror { reflectance: 1.0 } }
}

fn error(surfaces: &[Curve]) -> Option<ChainError> {
    World::new(0.0, surfaces.iter().copied().map(surface).collect(), vec![]).err()
}

#[test]
fn curves_that_meet_are_named() {
    let segment = |a: [f64; 2], b: [f64; 2]| Curve::segment(a.into(), b.into());
    let disc = Curve::arc(DVec2::ZERO, 1.0, 0.3, TAU);
    let meet = Some(ChainError::Meet { first: 0, second: 1 });
    assert_eq!(error(&[segment([0.0, 0.0], [2.0, 0.0]), segment([1.0, -1.0], [1.0, 1.0])]), meet);
    assert_eq!(error(&[segment([0.0, 0.0], [2.0, 0.0]), segment([1.0, 0.0], [1.0, 1.0])]), meet);
    assert_eq!(error(&[disc, segment([0.0, 0.0], [2.0, 0.1])]), meet);
    assert_eq!(error(&[disc, Curve::arc(DVec2::X, 1.0, 2.0, 0.3)]), meet);
    // Overlaps of one line, of one circle, and of equal curves.
    assert_eq!(error(&[segment([0.0, 0.0], [2.0, 0.0]), segment([1.0, 0.0], [3.0, 0.0])]), meet);
    assert_eq!(
        error(&[Curve::arc(DVec2::ZERO, 1.0, 0.0, 1.0), Curve::arc(DVec2::ZERO, 1.0, 0.5, 1.0)]),
        meet
    );
    assert_eq!(error(&[segment([0.0, 0.0], [2.0, 0.0]), segment([2.0, 0.0], [0.0, 0.0])]), meet);
    // Ends may touch; circles around one another do not meet.
    assert_eq!(error(&[segment([0.0, 0.0], [2.0, 0.0]), segment([2.0, 0.0], [1.0, 1.0])]), None);
    assert_eq!(error(&[disc, Curve::arc(DVec2::X, 1.0, -0.5, 1.0)]), None);
    assert_eq!(error(&[disc, Curve::arc(DVec2::new(0.1, 0.0), 0.5, 0.0, TAU)]), None);
    assert_eq!(error(&[disc, segment([-0.5, 0.0], [0.5, 0.0])]), None);
}

#[test]
fn numbers_make_the_same_world_again() {
    let surfaces = vec![
        Surface { curve: Curve::segment(DVec2::ZERO, DVec2::X), optics: Optics::diffuse(0.5) },
        Surface { curve: Curve::arc(DVec2::Y, 0.5, 1.0, -2.0), optics: Optics::Glass { index: 1.5 } },
    ];
    let lights = vec![Light::point(DVec2::new(3.0, 1.0), 2.0)];
    let world = World::new(0.2, surfaces, lights).expect("a world");
    let numbers = world.numbers();
    assert_eq!(world.with(&numbers).expect("a world").numbers(), numbers);
    assert_eq!(numbers[world.first_of_light(0)..], [3.0, 1.0, 2.0, 0.2]);
    assert_eq!(numbers[world.first_of_surface(1)..][..6], [0.0, 1.0, 0.5, 1.0, -2.0, 1.5]);
    let short = world.with(&numbers[1..]).err();
    assert_eq!(short, Some(ChainError::Numbers { expected: numbers.len(), found: numbers.len() - 1 }));
    let mut bad = numbers;
    bad[world.first_of_surface(1) + 5] = 0.0;
    let what = "its index is not positive and finite";
    assert_eq!(world.with(&bad).err(), Some(ChainError::Surface { surface: 1, what }));
}

#[test]
fn exact_integrals_refuse_what_they_cannot_use() {
    let world = World::new(1.0, vec![], vec![]).expect("a world");
    let film = crate::transport::Film { pixels: 2, filter: crate::plane::Filter::Box };
    let camera = crate::transport::Camera { position: DVec2::ZERO, angle: 0.0, field_of_view: 1.0, film };
    let refused = |exact: Exact, camera, rates: &[f64]| exact.image(&world, &camera, rates).err();
    assert_eq!(refused(Exact::default(), camera, &[0.0; 5]), None);
    let short = refused(Exact::default(), camera, &[0.0; 4]);
    assert_eq!(short, Some(ChainError::Numbers { expected: 5, found: 4 }));
    let coarse = Exact { cells: 0, ..Exact::default() };
    assert_eq!(refused(coarse, camera, &[0.0; 5]), Some(ChainError::NoCells));
    let wide = crate::transport::Camera { field_of_view: 4.0, ..camera };
    assert!(matches!(refused(Exact::default(), wide, &[0.0; 5]), Some(ChainError::Camera(_))));
}
