//! Tests that sheaves of rays hit what each ray hits alone.

use flatland::random::{Stream, stream};
use glam::DVec3;
use rand::Rng as _;

use super::super::{Accelerator, Goal, Ray, Shadows, Sheaf};

fn number(rng: &mut Stream) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

fn point(rng: &mut Stream) -> DVec3 {
    DVec3::new(number(rng), number(rng), number(rng)) * 2.0 - 1.0
}

/// A large square, small triangles above it, and a second square above those.
fn scene(rng: &mut Stream, triangles: u32, size: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = vec![];
    for height in [-1.0, 1.5] {
        positions.extend(
            [[-4.0, -4.0], [4.0, -4.0], [-4.0, 4.0], [4.0, 4.0]].map(|[x, z]| DVec3::new(x, height, z)),
        );
    }
    let mut faces = vec![[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]];
    for _ in 0..triangles {
        let (centre, first) = (point(rng), positions.len() as u32);
        positions.extend((0..3).map(|_| centre + size * point(rng)));
        faces.push([first, first + 1, first + 2]);
    }
    (positions, faces)
}

/// The sheaf of the rays in `members`, out of sixteen with the same near end.
fn side_by_side(rays: &[Ray; Sheaf::MOST], members: u32) -> Sheaf {
    let mut sheaf = Sheaf { near: rays[0].near, members, ..Sheaf::EMPTY };
    for (at, ray) in rays.iter().enumerate() {
        for axis in 0..3 {
            sheaf.origins[axis][at] = ray.origin[axis];
            sheaf.directions[axis][at] = ray.direction[axis];
        }
        sheaf.far[at] = ray.far;
        sheaf.from[at] = ray.from.unwrap_or(u32::MAX);
    }
    sheaf
}

/// Bit masks of the rays of two sheaves that hit anything.
fn occluded(accelerator: &Accelerator, sheaf: &Sheaf, end: Option<&Goal<'_>>, other: &Sheaf) -> [u32; 2] {
    accelerator.occluded_sheaves(&[Shadows { sheaf, end }, Shadows { sheaf: other, end: None }])
}

/// Parallel rays from above the lower square, except for cases that a fan cannot trace: rays that are not a
/// number, begin before the origin, or go on beyond the end.
#[test]
fn what_no_fan_can_trace_goes_alone() {
    let (positions, faces) = scene(&mut stream(6, &[]), 0, 0.1);
    let accelerator = Accelerator::build(&positions, &faces);
    let rays = |origin: DVec3, direction: DVec3, near: f64, far: f64| {
        let ray = |at: usize| Ray {
            origin: origin + DVec3::X * (0.01 * at as f64),
            direction,
            near,
            far,
            from: None,
        };
        std::array::from_fn::<_, { Sheaf::MOST }, _>(ray)
    };
    let check = |rays: &[Ray; Sheaf::MOST], hit: bool| {
        let sheaf = side_by_side(rays, 0xFFFF);
        let alone = rays.map(|ray| accelerator.closest(&ray));
        // Stale hits in the buffer must be overwritten.
        let mut hits = [accelerator.closest(&rays[1]); Sheaf::MOST];
        accelerator.closest_sheaf(&sheaf, &mut hits);
        assert_eq!(hits, alone);
        let hits = (0..16).fold(0, |m, at| m | u32::from(alone[at].is_some()) << at);
        let few = Sheaf { members: 0b11 & sheaf.members, ..sheaf };
        assert_eq!(occluded(&accelerator, &sheaf, None, &few), [hits, hits & 0b11]);
        assert_eq!(alone[1].is_some(), hit);
    };
    let inside = DVec3::new(0.1, 0.0, 0.2);
    for at in 0..Sheaf::MOST {
        let mut some = rays(inside, DVec3::Y, 0.0, f64::INFINITY);
        some[at].origin.x = if at == 1 { 0.1 } else { f64::NAN };
        check(&some, true);
    }
    check(&rays(inside, DVec3::Y, -10.0, 0.0), true);
    check(&rays(inside, DVec3::Y, 0.0, 1.0), false);
    for (far, away) in [(f64::INFINITY, 0.0), (3e14, 1e14)] {
        let end = inside + DVec3::Y;
        let some = rays(inside - DVec3::Y * away, DVec3::Y, 0.0, far)
            .map(|ray| Ray { direction: (end - ray.origin).normalize(), ..ray });
        let distances = some.map(|ray| ray.origin.distance(end));
        let goal = Goal { point: end, distances: &distances };
        let alone = (0..16).fold(0, |m, at| m | u32::from(accelerator.occluded(&some[at])) << at);
        let found = occluded(&accelerator, &side_by_side(&some, 0xFFFF), Some(&goal), &Sheaf::EMPTY);
        assert_eq!(found, [alone, 0]);
        assert_eq!(alone, 0xFFFF);
    }
}

/// Sheaves of rays that leave the lower square close to one another.
#[test]
fn sheaves_meet_what_their_rays_meet() {
    let mut rng = stream(5, &[]);
    for (triangles, size) in [(0, 0.1), (20, 0.5), (400, 0.1), (3000, 0.05), (30_000, 0.02)] {
        let (positions, faces) = scene(&mut rng, triangles, size);
        let accelerator = Accelerator::build(&positions, &faces);
        let (mut dark, mut checked) = (0, 0);
        for round in 0..300 {
            let width = [0.02, 0.2, 1.0][round % 3];
            let corner = DVec3::new(2.0 * number(&mut rng) - 1.0, -1.0, 2.0 * number(&mut rng) - 1.0);
            let end = DVec3::new(2.0 * number(&mut rng) - 1.0, 1.5, 2.0 * number(&mut rng) - 1.0);
            let common =
                DVec3::new(number(&mut rng) - 0.5, number(&mut rng), number(&mut rng) - 0.5).normalize();
            let mut rays =
                [Ray { origin: DVec3::ZERO, direction: DVec3::X, near: 1e-12, far: 0.0, from: None };
                    Sheaf::MOST];
            let mut distances = [0.0; Sheaf::MOST];
            for (ray, distance) in rays.iter_mut().zip(&mut distances) {
                let origin = corner + width * DVec3::new(number(&mut rng), 0.0, number(&mut rng));
                let from = accelerator.closest(&Ray {
                    origin: origin + DVec3::Y * 1e-3,
                    direction: -DVec3::Y,
                    near: 0.0,
                    far: 1.0,
                    from: None,
                });
                *distance = origin.distance(end);
                *ray = Ray {
                    origin,
                    direction: (end - origin) / *distance,
                    from: from.map(|hit| hit.triangle),
                    far: *distance * (1.0 - 1e-10),
                    ..*ray
                };
            }
            let sheaf = |rays: &[Ray; Sheaf::MOST]| side_by_side(rays, 0xFFFF & !(1 << (round % 16)));
            let of = |sheaf: &Sheaf, test: &dyn Fn(usize) -> bool| {
                (0..Sheaf::MOST)
                    .filter(|&at| sheaf.members >> at & 1 == 1 && test(at))
                    .fold(0, |m, at| m | 1 << at)
            };
            let own = 2 + u32::from(round % 2 == 0);
            let target = Some(own);
            let towards = Sheaf { target: [own; Sheaf::MOST], ..sheaf(&rays) };
            let alike = rays.map(|ray| Ray { direction: common, far: f64::INFINITY, ..ray });
            let parallel = sheaf(&alike);
            let goal = Goal { point: end, distances: &distances };
            let [found, others] = occluded(&accelerator, &towards, Some(&goal), &parallel);
            assert_eq!(
                found,
                of(&towards, &|at| accelerator.occluded_before(&rays[at], target)),
                "{triangles} {round}"
            );
            assert_eq!(others, of(&parallel, &|at| accelerator.occluded(&alike[at])), "{triangles} {round}");
            dark += found.count_ones();
            checked += towards.members.count_ones();
            // Scattered origins, on no surface: no fan can trace these rays.
            let apart = rays.map(|ray| Ray {
                origin: point(&mut rng),
                direction: point(&mut rng).normalize(),
                far: 3.0 * number(&mut rng),
                from: None,
                ..ray
            });
            let scattered = sheaf(&apart);
            let alone = of(&scattered, &|at| accelerator.occluded(&apart[at]));
            let both = occluded(&accelerator, &scattered, None, &parallel);
            assert_eq!(both, [alone, others], "{triangles} {round}");
            let mut hits = [None; Sheaf::MOST];
            accelerator.closest_sheaf(&parallel, &mut hits);
            for (at, hit) in hits.iter().enumerate() {
                let alone =
                    if parallel.members >> at & 1 == 1 { accelerator.closest(&alike[at]) } else { None };
                assert_eq!(*hit, alone, "{triangles} {round} {at}");
            }
        }
        assert!(triangles < 100 || (dark > checked / 50 && dark < checked), "{dark} of {checked}");
    }
}
