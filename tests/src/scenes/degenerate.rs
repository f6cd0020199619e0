//! Scenes with one degeneracy each.
//!
//! A point that must lie exactly on a line is the midpoint of two points on a grid of 1/64 pixel; the film's
//! corner and pixel are dyadic too, so that no step rounds.

use std::f64::consts::PI;

use flatland::plane::{Film, Filter, Polygon, Shade, Shape};
use glam::{DVec2, DVec3};

use super::pieces::{Move, Piece, Window, assemble, hole, sliver, star};
use super::{Case, Kind, Knobs};
use crate::dice::Dice;

/// The pieces that give a scene the knobs' degeneracy, in painter's order; none if it is generic.
pub(super) fn pieces(knobs: &Knobs, window: &Window) -> Vec<Piece> {
    let dice = &mut Dice::new(knobs.seed, 2);
    match knobs.kind {
        Kind::Generic => vec![],
        Kind::CoincidentTogether => coincident_together(dice, window, knobs.vertices),
        Kind::CoincidentHidden => coincident_hidden(dice, window),
        Kind::SharedVertex => shared_vertex(dice, window, knobs.vertices),
        Kind::TJunction => t_junction(dice, window, knobs.vertices),
        Kind::Touching => touching(dice, window, knobs.vertices),
        Kind::EdgeThroughCorner => edge_through_corner(dice, window),
        Kind::VertexOnCorner => vertex_on_corner(dice, window, knobs.vertices),
        Kind::GridAligned => grid_aligned(dice, window),
        Kind::Sliver => slivers(dice, window),
        Kind::NearlyCoincident => nearly_coincident(dice, window),
        Kind::NestedCopies => nested_copies(dice, window, knobs.vertices),
        Kind::FilledHole => filled_hole(dice, window, knobs.vertices),
    }
}

/// The nearest multiple of 1/64.
fn dyadic(p: DVec2) -> DVec2 {
    (p * 64.0).round() / 64.0
}

/// A dyadic vector of length about `length`, not close to either axis.
fn oblique(dice: &mut Dice, length: f64) -> DVec2 {
    let angle = dice.between(0.1, 0.4) * PI + dice.pick(&[0.0, 0.5, 1.0, 1.5]) * PI;
    dyadic(DVec2::from_angle(angle) * length)
}

/// A dyadic point on the film and two dyadic vectors that span a lattice, neither along an axis.
fn lattice(dice: &mut Dice, window: &Window) -> impl Fn(f64, f64) -> DVec2 + use<> {
    let origin = dyadic(window.somewhere(dice, 0.5));
    let length = dice.between(0.4, 1.0);
    let e = oblique(dice, length);
    let f = dyadic(e.perp() + 0.3 * oblique(dice, length));
    move |i, j| origin + i * e + j * f
}

fn rectangle(at: &impl Fn(f64, f64) -> DVec2, i: [f64; 2], j: [f64; 2]) -> Vec<DVec2> {
    vec![at(i[0], j[0]), at(i[1], j[0]), at(i[1], j[1]), at(i[0], j[1])]
}

/// Moves `ring` so that vertex `k` is exactly at `p`.
fn pin(ring: &mut [DVec2], k: usize, p: DVec2) {
    let offset = p - ring[k];
    ring.iter_mut().for_each(|q| *q += offset);
    ring[k] = p;
}

/// Polygons of one ring, each with a motion of its own.
fn each(dice: &mut Dice, window: &Window, rings: [Vec<DVec2>; 2], motions: [Move; 2]) -> Vec<Piece> {
    rings.into_iter().zip(motions).map(|(r, m)| Piece::new(dice, window, &[r], m)).collect()
}

fn coincident_together(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let motion = Move::affine(dice, window);
    let rings = if dice.chance(0.5) {
        // Two sectors of one star.
        let centre = window.somewhere(dice, 0.2);
        let radius = dice.between(1.0, 2.5);
        let n = dice.count(3, vertices);
        let ring = star(dice, centre, radius, n);
        let cut = dice.count(1, n - 1);
        let sector = |from: usize, to: usize| {
            std::iter::once(centre).chain((from..=to).map(|k| ring[k % n])).collect::<Vec<_>>()
        };
        [sector(0, cut), sector(cut, n)]
    } else {
        // Bricks of two courses.
        let at = lattice(dice, window);
        [rectangle(&at, [-2.0, 1.0], [0.0, 1.0]), rectangle(&at, [-1.0, 2.0], [1.0, 2.0])]
    };
    rings.map(|r| Piece::new(dice, window, &[r], motion.clone())).into()
}

fn coincident_hidden(dice: &mut Dice, window: &Window) -> Vec<Piece> {
    let at = lattice(dice, window);
    let rings = [
        rectangle(&at, [-2.0, 2.0], [-2.0, 0.0]),
        rectangle(&at, [-1.0, 1.0], [0.0, 2.0]),
        rectangle(&at, [-1.5, 1.5], [-0.5, 0.5]),
    ];
    rings
        .map(|r| {
            let motion = Move::affine(dice, window);
            Piece::new(dice, window, &[r], motion)
        })
        .into()
}

fn shared_vertex(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let meeting = window.somewhere(dice, 0.0);
    let count = dice.count(2, 3);
    (0..count)
        .map(|_| {
            let (radius, n) = (dice.between(0.7, 2.0), dice.count(3, vertices));
            let mut ring = star(dice, meeting, radius, n);
            pin(&mut ring, dice.count(0, n - 1), meeting);
            let motion = Move::any(dice, window, n);
            Piece::new(dice, window, &[ring], motion)
        })
        .collect()
}

fn t_junction(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let at = lattice(dice, window);
    let first = rectangle(&at, [-2.0, 2.0], [-1.0, 1.0]);
    // On the edge from (−2, 1) to (2, 1).
    let place = at(dice.pick(&[-1.0, -0.5, 0.0, 0.25, 1.0, 1.5]), 1.0);
    let (radius, n) = (dice.between(0.7, 2.0), dice.count(3, vertices));
    let mut second = star(dice, place, radius, n);
    pin(&mut second, dice.count(0, n - 1), place);
    let motions = [Move::any(dice, window, 4), Move::any(dice, window, n)];
    let mut pieces = each(dice, window, [first, second], motions);
    if dice.chance(0.5) {
        pieces.reverse();
    }
    pieces
}

/// A ring from `tip` that stays within a quarter of a turn around `direction`.
fn wedge(dice: &mut Dice, tip: DVec2, direction: DVec2, vertices: usize) -> Vec<DVec2> {
    let n = vertices - 1;
    let rest = (0..n).map(|k| {
        let turn = 0.45 * PI * (2.0 * (k as f64 + dice.between(0.1, 0.9)) / n as f64 - 1.0);
        tip + DVec2::from_angle(turn).rotate(direction) * dice.between(0.7, 1.5)
    });
    std::iter::once(tip).chain(rest).collect()
}

fn touching(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let at = lattice(dice, window);
    let (a, b) = (dice.count(3, vertices), dice.count(3, vertices));
    match dice.count(0, 2) {
        0 => {
            // Tip to tip.
            let (tip, direction) = (at(0.0, 0.0), DVec2::from_angle(dice.between(0.0, PI)));
            let rings = [wedge(dice, tip, direction, a), wedge(dice, tip, -direction, b)];
            let motions = [Move::any(dice, window, a), Move::any(dice, window, b)];
            each(dice, window, rings, motions)
        }
        1 => {
            // Tip to edge.
            let rectangle = rectangle(&at, [-1.0, 1.0], [-1.0, 0.0]);
            let edge = at(1.0, 0.0) - at(-1.0, 0.0);
            let outward =
                if edge.perp().dot(at(0.0, 1.0) - at(0.0, 0.0)) > 0.0 { edge.perp() } else { -edge.perp() };
            let tip = wedge(dice, at(0.0, 0.0), outward.normalize(), b);
            let motions = [Move::any(dice, window, 4), Move::any(dice, window, b)];
            each(dice, window, [rectangle, tip], motions)
        }
        _ => {
            // Two rings of one polygon, which may separate.
            let (tip, direction) = (at(0.0, 0.0), DVec2::from_angle(dice.between(0.0, PI)));
            let rings = [wedge(dice, tip, direction, a), wedge(dice, tip, -direction, b)];
            let motion = Move::any(dice, window, a + b);
            vec![Piece::new(dice, window, &rings, motion)]
        }
    }
}

/// A pixel corner inside the film.
fn pixel_corner(dice: &mut Dice, window: &Window) -> DVec2 {
    window.somewhere(dice, 0.6).round()
}

fn edge_through_corner(dice: &mut Dice, window: &Window) -> Vec<Piece> {
    let corner = pixel_corner(dice, window);
    // Slope 1 meets a corner in every row.
    let length = dice.between(0.5, 2.0);
    let half =
        if dice.chance(0.5) { oblique(dice, length) } else { DVec2::new(2.5, dice.pick(&[-2.5, 2.5])) };
    let across = dyadic(half.perp() * dice.between(0.2, 0.8));
    let ring = vec![corner - half, corner + half, corner + half + across, corner - half + across];
    let motion = Move::any(dice, window, 4);
    vec![Piece::new(dice, window, &[ring], motion)]
}

fn vertex_on_corner(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let corner = pixel_corner(dice, window);
    let ring = if dice.chance(0.5) {
        let (radius, n) = (dice.between(0.7, 2.0), dice.count(3, vertices));
        let mut ring = star(dice, corner, radius, n);
        pin(&mut ring, dice.count(0, n - 1), corner);
        ring
    } else {
        // Every vertex on a corner, no edge along an axis.
        [(0.0, -1.0), (2.0, 0.0), (1.0, 2.0), (-1.0, 1.0)].map(|(x, y)| corner + DVec2::new(x, y)).into()
    };
    let motion = Move::any(dice, window, ring.len());
    vec![Piece::new(dice, window, &[ring], motion)]
}

fn grid_aligned(dice: &mut Dice, window: &Window) -> Vec<Piece> {
    let corner = pixel_corner(dice, window);
    let axis_rectangle = |x: [f64; 2], y: [f64; 2]| {
        vec![DVec2::new(x[0], y[0]), DVec2::new(x[1], y[0]), DVec2::new(x[1], y[1]), DVec2::new(x[0], y[1])]
    };
    if window.film.filter() != Filter::Box {
        // A tent is not smooth on lines through pixel centres; a Gaussian's cells end on these and on pixel
        // borders.
        let min = corner - DVec2::new(dice.pick(&[0.5, 1.0, 1.5]), dice.pick(&[0.5, 1.0]));
        let max = corner + DVec2::new(dice.pick(&[0.5, 1.0]), dice.pick(&[0.5, 1.0, 2.0]));
        let motion = Move::any(dice, window, 4);
        return vec![Piece::new(dice, window, &[axis_rectangle([min.x, max.x], [min.y, max.y])], motion)];
    }
    // At rest, or sliding along the two edges that lie on pixel borders.
    let ends = [-dice.between(0.2, 1.8), dice.between(0.2, 1.8)];
    let whole = [-1.0, dice.pick(&[1.0, 2.0])];
    let speed = dice.pick(&[-1.0, 0.7]) * window.film.pixel();
    let (x, y, motion) = match dice.count(0, 2) {
        0 => (whole, whole, Move::Still),
        1 => (ends, whole, Move::Translate(speed * DVec2::X)),
        _ => (whole, ends, Move::Translate(speed * DVec2::Y)),
    };
    let fixed =
        Piece::new(dice, window, &[axis_rectangle(x.map(|x| corner.x + x), y.map(|y| corner.y + y))], motion);
    let over = Piece::generic(dice, window, 6);
    vec![fixed, over]
}

fn slivers(dice: &mut Dice, window: &Window) -> Vec<Piece> {
    let count = dice.count(1, 2);
    (0..count)
        .map(|_| {
            let aspect = 10.0_f64.powf(dice.between(3.0, 6.0));
            let centre = window.somewhere(dice, 0.3);
            let ring = sliver(dice, centre, aspect);
            let motion = Move::affine(dice, window);
            Piece::new(dice, window, &[ring], motion)
        })
        .collect()
}

fn nearly_coincident(dice: &mut Dice, window: &Window) -> Vec<Piece> {
    let at = lattice(dice, window);
    let first = rectangle(&at, [-2.0, 2.0], [-1.5, 0.0]);
    let across = at(0.0, 1.0) - at(0.0, 0.0);
    let gap = dice.pick(&[1e-6, 1e-10, 1e-13]) * across.normalize();
    // Separated, overlapping, crossing, or diverging from one common end.
    let ends = [[1.0, 1.0], [-1.0, -1.0], [1.0, -0.6], [-0.7, 1.0], [0.0, 1.0], [0.0, -1.0]];
    let [left, right] = dice.pick(&ends);
    let from = if left == 0.0 { -2.0 } else { dice.pick(&[-2.0, -1.0]) };
    let to = dice.pick(&[1.0, 2.0]);
    // On either side of the first one's edge; oblique, so that no other edge is near another.
    let side = dice.pick(&[-1.0, 1.0]);
    let second = vec![
        at(from, 0.0) + left * gap,
        at(to, 0.0) + right * gap,
        at(to + 0.35, side),
        at(from + 0.35, side),
    ];
    let pixel = window.film.pixel();
    let away = dice.pick(&[-1.0, 1.0]) * pixel * across + dice.vector2(0.2 * pixel);
    let motions = [Move::affine(dice, window), Move::Translate(away)];
    each(dice, window, [first, second], motions)
}

fn nested_copies(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let centre = window.somewhere(dice, 0.0);
    let (radius, n) = (dice.between(0.7, 2.5), dice.count(3, vertices));
    let ring = star(dice, centre, radius, n);
    let motion = Move::affine(dice, window);
    let count = dice.count(2, 3);
    (0..count)
        .map(|_| {
            // The same outline from another vertex, perhaps reversed.
            let mut copy = ring.clone();
            copy.rotate_left(dice.count(0, n - 1));
            if dice.chance(0.5) {
                copy.reverse();
            }
            Piece::new(dice, window, &[copy], motion.clone())
        })
        .collect()
}

fn filled_hole(dice: &mut Dice, window: &Window, vertices: usize) -> Vec<Piece> {
    let centre = window.somewhere(dice, 0.0);
    let (radius, n) = (dice.between(2.0, 4.0), dice.count(5, vertices.max(5)));
    let (outer, inner) = (star(dice, centre, radius, n), hole(dice, centre, radius));
    let motion = Move::affine(dice, window);
    let ring = Piece::new(dice, window, &[outer, inner.clone()], motion.clone());
    let filling = Piece::new(dice, window, &[inner], motion);
    if dice.chance(0.5) { vec![ring, filling] } else { vec![filling, ring] }
}

/// See [`super::non_differentiable`].
pub(super) fn non_differentiable(seed: u64) -> Case {
    let dice = &mut Dice::new(seed, 3);
    let constant = |ring: Vec<DVec2>, colour: DVec3, motion: Move| {
        let polygon = Polygon::simple(ring).expect("a simple polygon");
        Piece { shape: Shape::new(polygon, Shade::constant(colour)), motion }
    };
    // Three colours, any two of them at least 0.3 apart in every channel.
    let dark = DVec3::splat(dice.between(0.0, 0.1));
    let middle = DVec3::splat(dice.between(0.4, 0.6));
    let bright = DVec3::splat(dice.between(0.9, 1.0));
    let (filter, stack, what) = if seed.is_multiple_of(2) {
        let e = oblique(dice, 1.0);
        let f = e.perp();
        let at = |i: f64, j: f64| DVec2::splat(2.5) + i * e + j * f;
        let along = dice.between(-0.5, 0.5);
        let apart = dice.pick(&[-1.0, 1.0]) * dice.between(0.5, 1.0) * f + along * e;
        let first = constant(rectangle(&at, [-1.0, 1.0], [-1.0, 0.0]), middle, Move::Still);
        let second = constant(rectangle(&at, [-1.0, 1.0], [0.0, 1.0]), bright, Move::Translate(apart));
        let filter = dice.pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        (filter, vec![first, second], "torn edge")
    } else {
        let side = dice.between(0.3, 1.7);
        let ring = |x0: f64, x1: f64, y0: f64, y1: f64| {
            vec![DVec2::new(x0, y0), DVec2::new(x1, y0), DVec2::new(x1, y1), DVec2::new(x0, y1)]
        };
        let push = dice.pick(&[-1.0, 1.0]) * dice.between(0.5, 1.0);
        let (ring, direction) = if dice.chance(0.5) {
            (ring(2.0, 2.0 + side, 0.6, 4.3), DVec2::X)
        } else {
            (ring(0.6, 4.3, 2.0, 2.0 + side), DVec2::Y)
        };
        (Filter::Box, vec![constant(ring, bright, Move::Translate(push * direction))], "box border")
    };
    let (scene, motion) = assemble(dark, stack);
    let film = Film::new(5, 5, filter).expect("a valid film");
    Case { scene, motion, film, label: format!("not differentiable: {what}, seed {seed}") }
}
