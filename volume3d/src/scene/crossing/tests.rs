use flatland::random::{Stream, open01, stream};
use glam::{DAffine3, DQuat, DVec3};

use super::*;
use crate::geometry::Mesh;
use crate::scene::{Camera, Description, Film, Filter, Material, Scene};

fn random(rng: &mut Stream) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
}

fn scene(meshes: Vec<Mesh>) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO, DVec3::Y, 0.7);
    let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
    let mut d = Description::new(camera, film);
    let white = d.add_material(Material::diffuse("white", DVec3::ONE));
    for (i, mesh) in meshes.into_iter().enumerate() {
        d.add_shape(&i.to_string(), mesh, white);
    }
    Scene::new(d).unwrap()
}

/// Triangles whose sizes span three orders of magnitude.
fn soup(rng: &mut Stream, count: usize, scale: f64) -> Mesh {
    let mut positions = vec![];
    for _ in 0..count {
        let (centre, size) = (random(rng), 10_f64.powf(-3.0 * open01(rng)));
        positions.extend((0..3).map(|_| scale * (centre + size * random(rng))));
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Mesh::new(positions, triangles).unwrap()
}

#[test]
fn the_query_finds_what_comparing_all_pairs_finds() {
    let mut rng = stream(41, &[]);
    for scale in [1.0, 1e-30, 1e30] {
        let scene = scene(vec![soup(&mut rng, 700, scale)]);
        let found: Vec<[u32; 2]> = scene.crossings().all().iter().map(|c| c.triangles).collect();
        let pairs = (0..700).flat_map(|s| (s + 1..700).map(move |t| [s, t]));
        let through = |p: &[u32; 2]| matches!(meeting(&p.map(|t| scene.corners(t))), Meeting::Through(_));
        let expected: Vec<[u32; 2]> = pairs.filter(through).collect();
        assert!(expected.len() > 150, "{}", expected.len());
        assert_eq!(found, expected, "scale {scale:e}");
        for (t, index) in (0..700).flat_map(|t| scene.crossings().of(t).iter().map(move |&i| (t, i))) {
            assert!(scene.crossings().get(index).triangles.contains(&t));
        }
    }
}

/// A point that moves with the velocity of an intersection stays in both planes.
#[test]
fn velocities_keep_points_in_both_planes() {
    let mut rng = stream(42, &[]);
    let scene = scene(vec![soup(&mut rng, 300, 1.0)]);
    let rates: Vec<DVec3> = scene.positions.iter().map(|_| random(&mut rng)).collect();
    let step = 1e-6;
    let moved = |i: u32, side: f64| scene.positions[i as usize] + side * step * rates[i as usize];
    let mut tried = 0;
    for crossing in scene.crossings().all() {
        let along = open01(&mut rng);
        let place = crossing.places[0].lerp(crossing.places[1], along);
        let velocity = crossing.velocity(&scene.triangles, along, &rates);
        for t in crossing.triangles {
            let height = |side: f64| {
                let [a, b, c] = scene.triangles[t as usize].positions.map(|i| moved(i, side));
                (b - a).cross(c - a).normalize().dot(place + side * step * velocity - a)
            };
            let [a, b, c] = scene.corners(t);
            let size = (b - a).cross(c - a).length() / (b - a).length().max((c - a).length());
            // Small triangles rotate far in one step.
            if size > 1e-2 && velocity.length() < 1e2 {
                let rate = (height(1.0) - height(-1.0)) / (2.0 * step);
                assert!(rate.abs() < 1e-6, "{rate} {velocity}");
                tried += 1;
            }
        }
    }
    assert!(tried > 50, "{tried}");
}

#[test]
fn scattering_is_the_transpose_and_a_common_motion_is_its_own() {
    let mut rng = stream(43, &[]);
    let scene = scene(vec![soup(&mut rng, 200, 1.0)]);
    let rates: Vec<DVec3> = scene.positions.iter().map(|_| random(&mut rng)).collect();
    for crossing in scene.crossings().all() {
        let (along, covector) = (open01(&mut rng), random(&mut rng));
        let velocity = crossing.velocity(&scene.triangles, along, &rates);
        let (mut back, mut size) = (0.0, 0.0);
        crossing.scatter(&scene.triangles, along, covector, |i, c| {
            back += c.dot(rates[i as usize]);
            size += c.length();
        });
        assert!((velocity.dot(covector) - back).abs() <= 1e-13 * size);
        let common = random(&mut rng);
        let error =
            crossing.velocity(&scene.triangles, along, &vec![common; scene.positions.len()]).distance(common);
        assert!(error < 1e-12 * (1.0 + size), "{error}");
    }
}

/// Faces in one rotated plane seem to intersect by rounding wherever they touch.
#[test]
fn a_turned_grid_does_not_cross_itself() {
    let n = 12;
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7));
    let places = (0..=n).flat_map(|i| (0..=n).map(move |j| DVec3::new(f64::from(i), f64::from(j), 0.0)));
    let positions = places.map(|p| turn * (0.1 * p)).collect();
    let quads =
        (0..n).flat_map(|i| (0..n).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
    let triangles = quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let scene = scene(vec![Mesh::new(positions, triangles).unwrap()]);
    assert!(scene.crossing_shapes().is_empty() && scene.overlapping_shapes().is_empty());
}

#[test]
fn surfaces_that_cover_one_another_are_named_and_told_when_they_part() {
    let lamp = Mesh::rectangle().transformed(&DAffine3::from_scale(DVec3::new(0.3, 0.2, 1.0)));
    let scene = scene(vec![
        Mesh::rectangle(),
        lamp,
        Mesh::cube().transformed(&DAffine3::from_translation(2.0 * DVec3::X)),
    ]);
    let overlaps = scene.overlapping_shapes();
    assert_eq!(overlaps.iter().map(|o| o.shapes).collect::<Vec<_>>(), [[0, 1]]);
    let moved = |v: DVec3| -> Vec<DVec3> {
        let own = scene.position_range(1);
        (0..scene.positions.len()).map(|i| if own.contains(&i) { v } else { DVec3::ZERO }).collect()
    };
    assert!(scene.parted_shapes(&moved(DVec3::new(1.0, -0.3, 0.0))).is_empty(), "it slides");
    assert_eq!(scene.parted_shapes(&moved(DVec3::Z)).len(), 1);
    let together = vec![DVec3::new(0.3, 0.1, -2.0); scene.positions.len()];
    assert!(scene.parted_shapes(&together).is_empty());
}

/// A rotated box on a rotated floor is in contact with it to rounding, and is reported when it separates.
#[test]
fn contact_is_known_to_the_rounding_of_transforms() {
    let turned = |axis: DVec3, degrees: f64, by: DVec3, size: f64| {
        let turn = DQuat::from_axis_angle(axis, degrees.to_radians());
        DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, by)
    };
    for degrees in [0.0, 25.0, 61.3] {
        let scene = scene(vec![
            Mesh::rectangle().transformed(&turned(DVec3::X, -90.0, DVec3::new(0.0, -0.5, 0.0), 3.0)),
            Mesh::cube().transformed(&turned(DVec3::Y, degrees, DVec3::ZERO, 0.5)),
        ]);
        let own = scene.position_range(1);
        let moved = |v: DVec3| -> Vec<DVec3> {
            (0..scene.positions.len()).map(|i| if own.contains(&i) { v } else { DVec3::ZERO }).collect()
        };
        assert_eq!(scene.overlapping_shapes().len(), 1, "{degrees}");
        assert_eq!(scene.parted_shapes(&moved(DVec3::new(1.0, 0.3, 0.0))).len(), 1, "{degrees}");
        assert!(scene.parted_shapes(&moved(DVec3::X)).is_empty(), "{degrees}");
    }
}

/// A slab on a table, with one side flush with the table's: sliding along that side is no separation, sliding
/// across it is. A position that is no binary fraction, and a rotation, leave both sides together to
/// rounding.
#[test]
fn flush_sides_are_told_when_they_part_and_not_when_they_slide() {
    let turn = DAffine3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7)));
    let block = |half: DVec3, centre: DVec3, turn: DAffine3| {
        Mesh::cube()
            .transformed(&(turn * DAffine3::from_scale_rotation_translation(half, DQuat::IDENTITY, centre)))
    };
    for turn in [DAffine3::IDENTITY, turn] {
        let scene = scene(vec![
            block(DVec3::new(1.0, 0.1, 0.5), DVec3::new(0.0, 0.1, 0.0), turn),
            // Its bottom is at 0.2 and its front at 0.5, up to rounding.
            block(DVec3::new(0.3, 0.05, 0.1), DVec3::new(0.2, 0.25, 0.4), turn),
            Mesh::cube().transformed(&DAffine3::from_translation(9.0 * DVec3::X)),
        ]);
        let moved = |v: DVec3| -> Vec<DVec3> {
            let own = scene.position_range(1);
            let rate = turn.transform_vector3(v);
            (0..scene.positions.len()).map(|i| if own.contains(&i) { rate } else { DVec3::ZERO }).collect()
        };
        let parted = |v: DVec3| -> Vec<[usize; 2]> {
            scene.parted_edges(&moved(v)).iter().map(|o| o.shapes).collect()
        };
        assert_eq!(scene.coinciding_edges().iter().map(|o| o.shapes).collect::<Vec<_>>(), [[0, 1]]);
        assert_eq!(parted(DVec3::Z), [[0, 1]]);
        assert_eq!(parted(DVec3::Y), [[0, 1]]);
        assert_eq!(parted(DVec3::X), <[[usize; 2]; 0]>::default(), "it slides along the side");
        let slides = |v: DVec3| scene.parted_shapes(&moved(v)).is_empty();
        assert!(slides(DVec3::Z) && slides(DVec3::X) && !slides(DVec3::Y));
    }
}

#[test]
fn meshes_with_no_edges_upon_one_another_have_none() {
    let floor = Mesh::rectangle().transformed(&DAffine3::from_scale(DVec3::splat(3.0)));
    let box_on_it = Mesh::cube().transformed(&DAffine3::from_translation(DVec3::Z));
    let scene = scene(vec![floor, box_on_it, Mesh::sphere()]);
    assert!(scene.coinciding_edges().is_empty());
}

/// A surface that continues below another intersects it along the edge in its plane.
#[test]
fn a_surface_passes_through_along_its_own_edge() {
    let row = |y: f64, z: f64| [-0.5, 0.5].map(|x| DVec3::new(x, y, z));
    let bent = |below: f64| {
        let positions = [row(0.0, 1.0), row(0.0, 0.0), row(0.4, below)].concat();
        Mesh::new(positions, vec![[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]]).unwrap()
    };
    let count = |below: f64| {
        let scene = scene(vec![Mesh::rectangle(), bent(below)]);
        scene.crossing_shapes().iter().map(|c| c.segments).sum::<usize>()
    };
    // The rectangle has two triangles.
    assert_eq!(count(-1.0), 2);
    assert_eq!(count(1.0), 0, "it only touches");
}

/// A box of n × n squares per side: corners have integer coordinates and are exact, so that faces share them.
fn squares(n: u32) -> Mesh {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for face in 0..6 {
        let turn = match face {
            0..4 => DQuat::from_rotation_x(f64::from(face) * std::f64::consts::FRAC_PI_2),
            _ => DQuat::from_rotation_y((f64::from(face) - 4.5) * std::f64::consts::PI),
        };
        let along = |i: u32| f64::from(2 * i) - f64::from(n);
        let at = |i: u32, j: u32| (turn * DVec3::new(along(i), along(j), f64::from(n))).round();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let first = positions.len() as u32;
            positions.extend([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    Mesh::new(positions, triangles).unwrap()
}

fn prism(outline: &[[f64; 2]], parts: &[[usize; 3]]) -> Mesh {
    let n = outline.len();
    let ring = |z: f64| outline.iter().map(move |[x, y]| DVec3::new(*x, *y, z));
    let sides = (0..n).flat_map(|i| {
        let j = (i + 1) % n;
        [[i, j, n + j], [i, n + j, n + i]]
    });
    let ends = parts.iter().flat_map(|&[a, b, c]| [[a, c, b], [n + a, n + b, n + c]]);
    let triangles = sides.chain(ends).map(|t| t.map(|i| i as u32)).collect();
    Mesh::new(ring(-0.7).chain(ring(0.4)).collect(), triangles).unwrap()
}

/// Triangles of closed meshes touch in corners and edges, also where corners of one lie exactly in the plane
/// of another by chance.
#[test]
fn closed_meshes_that_are_turned_do_not_pass_through_themselves() {
    let bent = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.4], [0.4, 0.4], [0.4, 1.0], [0.0, 1.0]];
    let closed = [
        Mesh::cube(),
        squares(3),
        prism(&bent, &[[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]]),
        prism(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.01]], &[[0, 1, 2]]),
        Mesh::sphere(),
    ];
    let mut rng = stream(47, &[]);
    for (kind, mesh) in closed.into_iter().enumerate() {
        let trials = if mesh.triangles().len() > 500 { 4 } else { 150 };
        for trial in 0..trials {
            let scale = DVec3::from_array(std::array::from_fn(|_| 0.1 + open01(&mut rng)));
            // Typical user input: whole degrees about one axis; and any rotation.
            let (turn, scale) = match trial % 2 {
                0 => {
                    let turn = DQuat::from_rotation_y((5.0 * f64::from(trial)).to_radians());
                    (turn, DVec3::new(0.3, 0.6, 0.15))
                }
                _ => (DQuat::from_scaled_axis(3.0 * random(&mut rng)), scale),
            };
            let place = if trial % 4 < 2 { DVec3::ZERO } else { random(&mut rng) };
            let map = DAffine3::from_scale_rotation_translation(scale, turn, place);
            let scene = scene(vec![mesh.clone().transformed(&map)]);
            let (crossing, overlapping) = (scene.crossing_shapes(), scene.overlapping_shapes());
            let none = crossing.is_empty() && overlapping.is_empty() && scene.standing_shapes().is_empty();
            assert!(none, "{kind}, {trial}: {crossing:?} {overlapping:?} {:?}", scene.standing_shapes());
        }
    }
}

/// An object standing with an edge on a face slides over it, and separates when lifted; not if the face moves
/// along.
#[test]
fn edges_upon_faces_are_told_when_they_leave_them() {
    let turn = DAffine3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, -1.1, 0.7)));
    for turn in [DAffine3::IDENTITY, turn] {
        let up = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
        let place = DVec3::new(0.1, 0.2, 0.3);
        let wall = turn * DAffine3::from_scale_rotation_translation(DVec3::splat(0.3), up, place);
        let scene = scene(vec![
            Mesh::rectangle().transformed(&(turn * DAffine3::from_scale(DVec3::splat(2.0)))),
            Mesh::rectangle().transformed(&wall),
            Mesh::sphere().transformed(&DAffine3::from_translation(9.0 * DVec3::X)),
        ]);
        let own = scene.position_range(1);
        let moved = |v: DVec3| -> Vec<DVec3> {
            let rate = turn.transform_vector3(v);
            (0..scene.positions.len()).map(|i| if own.contains(&i) { rate } else { DVec3::ZERO }).collect()
        };
        let lifted = |rates: &[DVec3]| -> Vec<[usize; 2]> {
            scene.lifted_edges(rates).iter().map(|o| o.shapes).collect()
        };
        assert_eq!(scene.standing_shapes().iter().map(|o| o.shapes).collect::<Vec<_>>(), [[0, 1]]);
        assert!(scene.overlapping_shapes().is_empty() && scene.coinciding_edges().is_empty());
        assert_eq!(lifted(&moved(DVec3::Z)), [[0, 1]]);
        assert_eq!(lifted(&moved(DVec3::new(1.0, 0.0, -0.1))), [[0, 1]]);
        assert_eq!(lifted(&moved(DVec3::new(1.0, -0.4, 0.0))), <[[usize; 2]; 0]>::default(), "it slides");
        let together = vec![DVec3::new(0.1, 0.2, 0.3); scene.positions.len()];
        assert_eq!(lifted(&together), <[[usize; 2]; 0]>::default());
    }
}
