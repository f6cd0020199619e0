use super::*;

fn square(x: f64, y: f64, side: f64) -> Polygon {
    let corner = |dx, dy| DVec2::new(x + dx * side, y + dy * side);
    Polygon::simple([corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)]).unwrap()
}

fn two_squares() -> Scene {
    let below = Shape::new(square(0.0, 0.0, 4.0), Shade::constant(DVec3::X));
    let above = Shape::new(square(1.0, 1.0, 1.0), Shade::constant(DVec3::Y));
    Scene::new(DVec3::ZERO, vec![below, above]).unwrap()
}

#[test]
fn the_topmost_is_seen_and_can_be_taken_away() {
    let scene = two_squares();
    let u = DVec2::new(1.5, 1.25);
    assert_eq!(scene.hit(u).unwrap().shape(), 1);
    assert_eq!(scene.hit_below(u, 1).unwrap().shape(), 0);
    assert!(scene.hit_below(u, 0).is_none());
    assert_eq!(scene.hit(DVec2::new(3.0, 0.5)).unwrap().shape(), 0);
    assert!(scene.hit(DVec2::new(9.0, 0.5)).is_none());
}

#[test]
fn the_distance_is_to_the_boundary_of_what_is_seen() {
    let scene = two_squares();
    let distance = |x, y| {
        let u = DVec2::new(x, y);
        scene.boundary_distance(scene.hit(u).as_ref(), u, 10.0)
    };
    assert_eq!(distance(1.5, 1.25), 0.25);
    // Next to the small square but on the large one: only the large one's edges count.
    assert!((distance(2.01, 1.5) - 1.5).abs() < 1e-15);
    assert_eq!(distance(-5.0, 0.0), 10.0);
}

#[test]
fn no_point_falls_between_triangles() {
    let scene = two_squares();
    for i in 0..1000 {
        // On the diagonals, and within a rounding error of them.
        let t = f64::from(i) / 1000.0 * 4.0;
        for e in [0.0, 1e-16, -1e-16] {
            assert!(scene.hit_below(DVec2::new(t, (t + e).clamp(0.0, 4.0)), 1).is_some());
            assert!(scene.hit_below(DVec2::new(t, (4.0 - t + e).clamp(0.0, 4.0)), 1).is_some());
        }
    }
}

#[test]
fn a_densely_sampled_outline_hides_no_point() {
    use crate::random::{open01, stream};
    let corner = |i: i32| {
        let t = std::f64::consts::TAU * f64::from(i) / 900.0;
        3.0 * (1.0 + 0.3 * (9.0 * t).sin()) * DVec2::from_angle(t)
    };
    let polygon = Polygon::simple((0..900).map(corner).collect::<Vec<_>>()).unwrap();
    let scene = Scene::new(DVec3::ZERO, vec![Shape::new(polygon, Shade::constant(DVec3::ONE))]).unwrap();
    assert!(scene.tree_triangles.len() > 2 * scene.triangles.len(), "slivers are split");
    let mut rng = stream(1, &[]);
    let mut probes: Vec<DVec2> =
        (0..20_000).map(|_| 8.0 * (DVec2::new(open01(&mut rng), open01(&mut rng)) - 0.5)).collect();
    probes.extend_from_slice(scene.vertices());
    for u in probes {
        let brute = (0..scene.triangles.len()).any(|i| scene.barycentric(i, u).is_some());
        assert_eq!(scene.hit(u).is_some(), brute, "{u}");
    }
}

#[test]
fn material_shades_go_along() {
    let shade = Shade::linear(DVec2::ZERO, DVec3::ZERO, [DVec2::X; 3], Attachment::Material);
    let scene = Scene::new(DVec3::ZERO, vec![Shape::new(square(0.0, 0.0, 1.0), shade)]).unwrap();
    let moved: Vec<_> = scene.vertices().iter().map(|p| 2.0 * *p + DVec2::X).collect();
    let moved = scene.displaced(&moved).unwrap();
    let u = DVec2::new(2.0, 1.0);
    let hit = moved.hit(u).unwrap();
    assert_eq!(moved.value(Some(&hit), u), DVec3::splat(0.5));
    assert_eq!(moved.gradient(Some(&hit), u)[0], DVec2::new(0.5, 0.0));
}
