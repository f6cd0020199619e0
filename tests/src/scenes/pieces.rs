//! Building blocks of random scenes: films, outlines, shades and motions.

use std::f64::consts::TAU;

use flatland::plane::{Attachment, Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use glam::{DMat2, DVec2, DVec3};

use crate::dice::Dice;

/// The film and its unit of length, the pixel. Integer coordinates are pixel corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) film: Film,
}

impl Window {
    /// A film of 3 × 3 to 6 × 6 pixels at a random position. Unless it is `generic`, its corner and pixel are
    /// dyadic, and so are positions at dyadic numbers of pixels.
    pub(super) fn random(dice: &mut Dice, filter: Filter, generic: bool) -> Self {
        let (width, height) = (dice.count(3, 6), dice.count(3, 6));
        let (corner, pixel) = match (dice.count(0, 2), generic) {
            (0, _) => (DVec2::ZERO, 1.0),
            (_, true) => (dice.vector2(20.0), dice.between(0.2, 3.0)),
            (_, false) => {
                let place = (dice.vector2(20.0) * 4.0).round() / 4.0;
                (place, dice.pick(&[0.5, 1.0, 2.0]))
            }
        };
        let film = Film::placed(width, height, filter, corner, pixel).expect("a valid film");
        Self { film }
    }

    /// Its size in pixels.
    pub(super) fn size(&self) -> DVec2 {
        DVec2::new(self.film.width() as f64, self.film.height() as f64)
    }

    /// The position of a point given in pixels.
    pub(super) fn place(&self, p: DVec2) -> DVec2 {
        self.film.corner() + self.film.pixel() * p
    }

    /// A point on the film, at least `margin` pixels from its border.
    pub(super) fn somewhere(&self, dice: &mut Dice, margin: f64) -> DVec2 {
        let size = self.size();
        DVec2::new(dice.between(margin, size.x - margin), dice.between(margin, size.y - margin))
    }

    /// The polygon with rings given in pixels.
    pub(super) fn polygon(&self, rings: &[Vec<DVec2>]) -> Polygon {
        let rings = rings.iter().map(|r| r.iter().map(|p| self.place(*p)).collect()).collect();
        Polygon::new(rings).expect("a simple polygon")
    }
}

/// The motion of one shape; lengths in the scene's unit.
#[derive(Clone, Debug)]
pub(super) enum Move {
    Still,
    Translate(DVec2),
    Rotate(DVec2),
    Scale(DVec2),
    Vertex(usize, DVec2),
    Both(Box<Self>, Box<Self>),
}

impl Move {
    /// A linear velocity field that is not 0 everywhere: shapes that share it stay together.
    pub(super) fn affine(dice: &mut Dice, window: &Window) -> Self {
        let pixel = window.film.pixel();
        let centre = window.place(window.somewhere(dice, 0.0));
        match dice.count(0, 4) {
            0 | 1 => Self::Translate(dice.vector2(pixel)),
            2 => Self::Rotate(centre),
            3 => Self::Scale(centre),
            _ => Self::Both(Box::new(Self::Rotate(centre)), Box::new(Self::Translate(dice.vector2(pixel)))),
        }
    }

    /// A random motion of a polygon of `vertices` vertices.
    pub(super) fn any(dice: &mut Dice, window: &Window, vertices: usize) -> Self {
        match dice.count(0, 5) {
            0 => Self::Still,
            1 | 2 => Self::Vertex(dice.count(0, vertices - 1), dice.vector2(window.film.pixel())),
            _ => Self::affine(dice, window),
        }
    }

    fn motion(&self, shape: usize) -> Motion {
        match self {
            Self::Still => Motion::default(),
            Self::Translate(direction) => Motion::translate([shape], *direction),
            Self::Rotate(centre) => Motion::rotate([shape], *centre),
            Self::Scale(centre) => Motion::scale([shape], *centre),
            Self::Vertex(vertex, direction) => Motion::vertex(shape, *vertex, *direction),
            Self::Both(a, b) => a.motion(shape).and(b.motion(shape)),
        }
    }
}

/// A shape and its motion.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) shape: Shape,
    pub(super) motion: Move,
}

impl Piece {
    /// A polygon with rings in pixels and a random shade.
    pub(super) fn new(dice: &mut Dice, window: &Window, rings: &[Vec<DVec2>], motion: Move) -> Self {
        let polygon = window.polygon(rings);
        Self { shape: Shape::new(polygon, shade(dice, window)), motion }
    }

    /// A star, perhaps with a hole, or now and then a sliver, partly on the film.
    pub(super) fn generic(dice: &mut Dice, window: &Window, vertices: usize) -> Self {
        let centre = window.somewhere(dice, -0.5);
        if dice.chance(0.1) {
            let aspect = 10.0_f64.powf(dice.between(1.0, 3.0));
            let ring = sliver(dice, centre, aspect);
            let motion = Move::affine(dice, window);
            return Self::new(dice, window, &[ring], motion);
        }
        let radius = dice.between(0.7, 2.5);
        let n = dice.count(3, vertices);
        let mut rings = vec![star(dice, centre, radius, n)];
        if n >= 5 && dice.chance(0.3) {
            rings.push(hole(dice, centre, radius));
        }
        let count = rings.iter().map(Vec::len).sum();
        let motion = Move::any(dice, window, count);
        Self::new(dice, window, &rings, motion)
    }
}

/// A star-shaped ring about `centre` of radius 0.5 to 1 times `radius`.
pub(super) fn star(dice: &mut Dice, centre: DVec2, radius: f64, vertices: usize) -> Vec<DVec2> {
    let start = dice.between(0.0, TAU);
    // No angular gap reaches half a turn.
    let jitter = if vertices == 3 { 0.2 } else { 0.3 };
    (0..vertices)
        .map(|k| {
            let angle = start + TAU * (k as f64 + dice.between(-jitter, jitter)) / vertices as f64;
            centre + DVec2::from_angle(angle) * radius * dice.between(0.5, 1.0)
        })
        .collect()
}

/// A ring inside every [`star`] of five vertices or more: the distance of its edges from the centre
/// is at least 0.5 cos(0.32 π) = 0.268 of its radius.
pub(super) fn hole(dice: &mut Dice, centre: DVec2, radius: f64) -> Vec<DVec2> {
    let vertices = dice.count(3, 6);
    star(dice, centre, 0.25 * radius, vertices)
}

/// A thin triangle or quadrilateral of length 1 to 4 about `centre`.
pub(super) fn sliver(dice: &mut Dice, centre: DVec2, aspect: f64) -> Vec<DVec2> {
    let along = DVec2::from_angle(dice.between(0.0, TAU)) * dice.between(0.5, 2.0);
    let across = along.perp() / aspect;
    let (a, b) = (centre - along, centre + along);
    if dice.chance(0.5) {
        vec![a, b, centre + 2.0 * across]
    } else {
        vec![a - across, b - across, b + across, a + across]
    }
}

/// A constant, linear or quadratic shade, attached to the image or to the material.
pub(super) fn shade(dice: &mut Dice, window: &Window) -> Shade {
    let pixel = window.film.pixel();
    let attachment = dice.pick(&[Attachment::Image, Attachment::Material]);
    let anchor = window.place(window.somewhere(dice, 0.0));
    let value = dice.colour();
    let gradient = std::array::from_fn(|_| dice.vector2(0.3 / pixel));
    match dice.count(0, 2) {
        0 => Shade::constant(value),
        1 => Shade::linear(anchor, value, gradient, attachment),
        _ => {
            let hessian = std::array::from_fn(|_| {
                let scale = 0.1 / (pixel * pixel);
                DMat2::from_cols(dice.vector2(scale), dice.vector2(scale))
            });
            Shade::quadratic(anchor, value, gradient, hessian, attachment)
        }
    }
}

/// The scene of a stack, the last on top, and its motion.
pub(super) fn assemble(background: DVec3, stack: Vec<Piece>) -> (Scene, Motion) {
    let motion = stack
        .iter()
        .enumerate()
        .fold(Motion::default(), |all, (shape, piece)| all.and(piece.motion.motion(shape)));
    let shapes = stack.into_iter().map(|piece| piece.shape).collect();
    (Scene::new(background, shapes).expect("a valid scene"), motion)
}
