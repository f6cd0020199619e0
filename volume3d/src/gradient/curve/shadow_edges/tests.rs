//! Tests of the selection of edge stretches where the film shows a small part of a scene.

use flatland::calculus::Vec3;
use flatland::random::{Stream, open01, stream};
use glam::{DVec2, DVec3};

use super::*;
use crate::geometry::Mesh;
use crate::gradient::curve::budget::Kind;
use crate::gradient::curve::drawing::Sensor;
use crate::gradient::curve::driver::Driver;
use crate::gradient::curve::field::Zero;
use crate::gradient::film::FilmPlane;
use crate::gradient::tests::{Comparisons, at, down, film, thorough, total, up};
use crate::gradient::warp::motion::Motion;
use crate::gradient::{EdgeSampling, Progress, Tangent};
use crate::path::Kernels;
use crate::scene::{Camera, Crop, Description, Film, Filter, Integrator, Material, Scene};

/// A floor under a small lamp, with two leaves between them, in front of a wall. The film is a crop, around
/// the image of `place`, of a film of 24² pixels. The shadow of the second leaf is visible only after a
/// bounce.
fn shadow(depth: usize, place: DVec3, [width, height]: [usize; 2]) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.3, 2.0, 3.0), DVec3::new(0.0, 0.2, 0.0), DVec3::Y, 0.8);
    let mut d = Description::new(camera, film(24, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 5 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 2.0) * down())), white);
    d.add_shape("leaf", Mesh::rectangle().transformed(&(at(0.1, 0.7, 0.1, 0.4) * down())), white);
    d.add_shape("second leaf", Mesh::rectangle().transformed(&(at(0.1, 0.7, 1.2, 0.4) * down())), white);
    d.add_shape("wall", Mesh::rectangle().transformed(&at(0.0, 2.0, -0.75, 2.0)), white);
    let lamp = Mesh::rectangle().transformed(&(at(0.3, 2.4, 0.2, 0.3) * up()));
    d.add_emitter("lamp", lamp, DVec3::splat(20.0));
    let whole = FilmPlane::new(&Scene::new(d.clone()).unwrap());
    let [x, y] = whole.project(&whole.still, Vec3::constant(place));
    let first = (DVec2::new(x, y) - 0.5 * DVec2::new(width as f64, height as f64)).round();
    let crop = Crop { x: first.x as usize, y: first.y as usize, width, height };
    d.film = Film { crop: Some(crop), ..d.film };
    Scene::new(d).unwrap()
}

/// The sampler with its edges cut anew into stretches for `shown`.
fn drawn<'a>(mut part: ShadowEdges<'a, Zero>, shown: Option<&Shown>) -> ShadowEdges<'a, Zero> {
    part.cut(shown);
    part
}

/// Stretches whose shadows are visible drawn more often, against all stretches drawn uniformly.
#[test]
fn small_films_see_all_shadows() {
    let mut comparisons = Comparisons::of("edge_sampling::small_films_see_all_shadows");
    let corner = DVec3::new(0.0, 0.15, -0.75);
    for (name, depth, place, size) in
        [("an edge of the shadow", 2, EDGE, [3, 2]), ("what a floor reflects", 3, corner, [16, 5])]
    {
        let scene = shadow(depth, place, size);
        let mut change = Tangent::still(&scene);
        let leaf = if depth == 2 { 1 } else { 2 };
        change.translate(&scene, leaf, DVec3::new(0.1, 0.05, 0.3));
        let (motion, list) = (Motion::new(&scene, &change), EdgeList::new(&scene));
        let (paths, moving) = (Paths::new(&scene, Kernels::default()), Moving::of(&scene, &motion));
        let part = || ShadowEdges::new(&paths, &list, &moving, Zero);
        let run = |part: &ShadowEdges<'_, Zero>, secondary: usize, first: u64| {
            total(|seed| {
                let method = EdgeSampling { secondary, seed: first + seed, ..EdgeSampling::default() };
                let driver = Driver::of(&scene, &method.budget(), Kind::ShadowEdges);
                driver.forward(part, &motion, &Progress::none()).unwrap().mean
            })
        };
        let samples = match depth {
            2 => 256,
            _ if thorough() => 4096,
            _ => 2048,
        };
        let shown = Shown::new(&part().lines.sensor).expect("there is one light, and no lens");
        let found = run(&part(), samples, 0);
        let reference = run(&drawn(part(), None), samples, 100);
        comparisons.add(name.to_owned(), found, reference, 0.0, reference.0);
        let control = if depth == 2 {
            // Control: stretches selected for a lamp that is elsewhere.
            let mut moved = shown;
            moved.lights.iter_mut().for_each(|(centre, _)| centre.x += 2.0);
            drawn(part(), Some(&moved))
        } else {
            // Control: stretches that the film does not show have weight zero.
            let mut hidden = part();
            let longest = std::mem::replace(&mut hidden.lines.longest, 1);
            hidden.cut(Some(&shown));
            hidden.lines.longest = longest;
            hidden
        };
        comparisons.reject(name, run(&control, samples, 200), reference);
        let hidden = |part: &ShadowEdges<'_, Zero>| -> f64 {
            let weight = |(i, s): (usize, &Stretch)| if s.shown { 0.0 } else { part.table.weight(i) };
            part.stretches.iter().enumerate().map(weight).sum::<f64>() / part.table.total()
        };
        println!("{name}: {:.3} of what is drawn is hidden", hidden(&part()));
        assert!(if depth == 2 { hidden(&part()) == 0.0 } else { hidden(&part()) > 0.4 });
    }
    comparisons.finish();
}

fn point(rng: &mut Stream) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
}

/// A point on the floor at the edge of the shadow.
const EDGE: DVec3 = DVec3::new(0.02, 0.0, -0.46);

/// Random light paths from a ball past a stretch to a point visible on the film: a stretch with such a path
/// is never rejected.
#[test]
fn no_stretch_is_refused_whose_shadow_is_seen() {
    let scene = shadow(2, EDGE, [8, 6]);
    let paths = Paths::new(&scene, Kernels::default());
    let sensor = Sensor::new(&paths);
    let mut shown = Shown::new(&sensor).expect("there is one light, and no lens");
    let (film, (low, high)) = (&sensor.film, scene.bounds().unwrap());
    let mut rng = stream(3, &[]);
    let (mut seen, mut refused, mut wrong) = (0, 0, 0);
    for trial in 0..40_000 {
        let light = (3.0 * point(&mut rng), 10_f64.powf(-2.0 * open01(&mut rng)));
        let (middle, size) = (2.0 * point(&mut rng) + DVec3::Y, [0.01, 0.3][trial % 2]);
        let ends = [middle, middle + size * point(&mut rng)];
        let mut with = |light| {
            shown.lights = vec![light];
            shown.has(ends)
        };
        let (whole, centre) = (with(light), with((light.0, 0.0)));
        refused += usize::from(!whole);
        for _ in 0..20 {
            let from = light.0 + light.1 * point(&mut rng).clamp_length_max(1.0);
            let past = ends[0].lerp(ends[1], open01(&mut rng));
            let x = past + 10_f64.powf(3.0 * open01(&mut rng) - 2.0) * (past - from);
            let before = film.forward().dot(x - film.still.origin.value()) > 0.0;
            let [u, v] = film.project(&film.still, Vec3::constant(x));
            if before && x.cmpge(low).all() && x.cmple(high).all() && film.cell(DVec2::new(u, v)).is_some() {
                assert!(whole, "trial {trial}");
                seen += 1;
                wrong += usize::from(!centre);
            }
        }
    }
    println!("{seen} points seen, {refused} stretches refused, {wrong} points missed if lights were points");
    assert!(seen > 500 && refused > 20_000 && wrong > 20, "{seen} {refused} {wrong}");
}
