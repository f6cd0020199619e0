//! Arrangements of random worlds, one function per kind. All are of size about 1; see [`Kind`].

use flatland::transport::{Material, Shape};
use glam::DVec2;

use super::Kind;
use crate::dice::Dice;

/// Shapes, environment and the camera's view.
pub(super) struct Arrangement {
    pub(super) shapes: Vec<Shape>,
    pub(super) environment: f64,
    pub(super) eye: DVec2,
    /// The direction of view.
    pub(super) angle: f64,
    pub(super) field_of_view: f64,
}

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// The widths of lobes that quadrature of moderate order resolves.
const GLOSS: [f64; 2] = [0.02, 0.5];

pub(super) fn arrange(dice: &mut Dice, kind: Kind, shapes: usize) -> Arrangement {
    match kind {
        Kind::Direct => direct(dice),
        Kind::Shadows | Kind::Large | Kind::Small => receiver(dice, shapes, Style::default()),
        Kind::Glossy => receiver(dice, shapes, Style { gloss: Some(GLOSS), ..Style::default() }),
        Kind::NearSpecular => receiver(dice, shapes, Style { gloss: Some([1e-6, 1e-2]), ..Style::default() }),
        Kind::Glowing => receiver(dice, shapes, Style { environment: true, ..Style::default() }),
        Kind::ManyLights => receiver(dice, shapes + 3, Style { lights: 4, ..Style::default() }),
        Kind::Room => room(dice, shapes),
        Kind::GrazingLight => grazing(dice, shapes),
        Kind::TinyEmitter => tiny(dice, shapes),
        Kind::NearWall => near_wall(dice, shapes),
        Kind::Sliver => slivers(dice, shapes),
        Kind::Aligned => aligned(dice, shapes),
    }
}

/// Only a receiver that fills the view and a light, wholly visible from all of it.
fn direct(dice: &mut Dice) -> Arrangement {
    let y = dice.between(-0.2, 0.2);
    let material = if dice.chance(0.5) { dice.diffuse(0.9) } else { dice.glossy(0.9, GLOSS) };
    let floor = Shape::open([p(-60.0, y), p(60.0, y + dice.between(-3.0, 3.0))], material);
    let centre = p(dice.sign() * dice.between(1.5, 3.0), dice.between(5.0, 7.0));
    let half = dice.vector2(1.0);
    let emission = dice.between(0.5, 4.0);
    let light = Shape::open([centre - half, centre + half], Material::emitter(emission));
    let eye = p(dice.between(-0.5, 0.5), dice.between(4.0, 5.0));
    // The steepest ray of a film with the margin of a wide filter stays below the horizon.
    let angle = -std::f64::consts::FRAC_PI_2 + dice.between(-0.2, 0.2);
    let field_of_view = dice.between(0.4, 0.9);
    let environment = if dice.chance(0.5) { 0.0 } else { dice.between(0.0, 0.5) };
    Arrangement { shapes: vec![floor, light], environment, eye, angle, field_of_view }
}

/// The materials and lights of a [`receiver`].
#[derive(Default)]
struct Style {
    gloss: Option<[f64; 2]>,
    environment: bool,
    /// Lights after the first.
    lights: usize,
}

/// A receiver, a light above it, and objects between them.
fn receiver(dice: &mut Dice, shapes: usize, style: Style) -> Arrangement {
    let surface = |dice: &mut Dice| match style.gloss {
        Some(widths) => dice.glossy(0.9, widths),
        None => dice.diffuse(0.9),
    };
    let material = surface(dice);
    let ends = [p(-dice.between(1.5, 3.0), dice.between(-0.3, 0.3)), p(dice.between(1.5, 3.0), 0.1)];
    let mut all = vec![if dice.chance(0.3) {
        Shape::open([ends[0], p(dice.between(-0.4, 0.4), dice.between(-0.4, 0.1)), ends[1]], material)
    } else {
        Shape::open(ends, material)
    }];
    if !style.environment || dice.chance(0.3) {
        let (centre, emission) = (p(dice.between(-1.0, 1.0), dice.between(2.8, 3.2)), dice.emitter());
        let radius = dice.between(0.2, 0.6);
        all.push(dice.shape(centre, radius, emission));
    }
    // One cell of a grid each, so that most arrangements are disjoint at once.
    let mut cells: Vec<DVec2> = (0..8).map(|i| p(f64::from(i % 4) - 1.5, 0.95 + f64::from(i / 4))).collect();
    for i in 0..shapes.min(8) {
        let k = dice.count(0, cells.len() - 1);
        let centre = cells.swap_remove(k) + dice.vector2(0.1);
        let material = if i < style.lights { dice.emitter() } else { surface(dice) };
        let radius = dice.between(0.1, 0.4);
        all.push(dice.shape(centre, radius, material));
    }
    let environment = if style.environment { dice.between(0.2, 2.0) } else { 0.0 };
    let eye = p(dice.between(-2.0, 2.0), dice.between(2.35, 2.5));
    let aim = p(dice.between(-0.8, 0.8), 0.3) - eye;
    Arrangement {
        shapes: all,
        environment,
        eye,
        angle: aim.to_angle(),
        field_of_view: dice.between(0.5, 1.2),
    }
}

/// A closed room with everything inside it.
fn room(dice: &mut Dice, shapes: usize) -> Arrangement {
    let corner = |dice: &mut Dice, x: f64, y: f64| p(x, y) + dice.vector2(0.15);
    let corners = [(-1.5, -1.0), (1.5, -1.0), (1.5, 1.0), (-1.5, 1.0)].map(|(x, y)| corner(dice, x, y));
    let walls = if dice.chance(0.8) { dice.diffuse(0.75) } else { dice.glossy(0.75, [0.2, 0.5]) };
    let mut all = vec![Shape::closed(corners, walls)];
    let spots = [p(0.75, 0.5), p(0.7, -0.4), p(-0.1, 0.45), p(0.0, -0.45)];
    for (i, spot) in spots.into_iter().take(1 + shapes.clamp(1, 3)).enumerate() {
        let material = if i == 0 { dice.emitter() } else { dice.diffuse(0.75) };
        let centre = spot + dice.vector2(0.08);
        let radius = dice.between(0.1, 0.25);
        all.push(dice.shape(centre, radius, material));
    }
    let eye = p(-1.0, 0.0) + dice.vector2(0.2);
    Arrangement {
        shapes: all,
        environment: 0.0,
        eye,
        angle: dice.between(-0.5, 0.5),
        field_of_view: dice.between(0.6, 1.3),
    }
}

/// A light on the line of the receiver, or almost, at grazing incidence.
fn grazing(dice: &mut Dice, shapes: usize) -> Arrangement {
    let mut this = receiver(dice, shapes.min(3), Style { lights: 0, environment: true, gloss: None });
    this.environment = 0.0;
    let height = dice.scale(1e-9, 1e-1);
    let material = *this.shapes[0].material();
    this.shapes[0] = Shape::open([p(-2.0, 0.0), p(2.0, 0.0)], material);
    let x = dice.sign() * dice.between(2.2, 3.0);
    let emission = dice.between(0.5, 4.0);
    let tilt = height * dice.between(-0.5, 1.0);
    this.shapes.push(Shape::open(
        [p(x, height), p(x + dice.between(0.3, 1.0), height + tilt)],
        Material::emitter(emission),
    ));
    this
}

/// A light of a length down to 10⁻¹², with some environment, or so bright that it lights the scene alone.
fn tiny(dice: &mut Dice, shapes: usize) -> Arrangement {
    let mut this = receiver(dice, shapes, Style { environment: true, ..Style::default() });
    let length = dice.scale(1e-12, 1e-3);
    let bright = dice.chance(0.5);
    if bright {
        this.environment = 0.0;
    }
    let emission = dice.between(0.5, 4.0) * if bright { 1.0 / length } else { 1.0 };
    let at = p(dice.between(-1.0, 1.0), dice.between(2.6, 2.8));
    let light = Shape::open(
        [at, at + length * DVec2::from_angle(dice.between(0.0, 3.0))],
        Material::emitter(emission),
    );
    this.shapes.push(light);
    this
}

/// A camera 10⁻⁹ to 10⁻² in front of a wall, looking at it or along it.
fn near_wall(dice: &mut Dice, shapes: usize) -> Arrangement {
    let mut this = receiver(dice, shapes, Style::default());
    let along = DVec2::from_angle(dice.between(-0.5, 0.5));
    let foot = p(dice.between(-1.0, 1.0), -1.2);
    let material = dice.diffuse(0.9).with_emission(dice.between(0.0, 0.5));
    this.shapes.push(Shape::open([foot - along, foot + along], material));
    this.eye = foot + dice.between(-0.5, 0.5) * along + dice.scale(1e-9, 1e-2) * along.perp();
    this.angle = along.to_angle() + dice.between(-2.0, 2.0);
    this
}

/// Polygons 10³ to 10⁶ times as long as wide, in place of other objects.
fn slivers(dice: &mut Dice, shapes: usize) -> Arrangement {
    let mut this = receiver(dice, shapes.min(2), Style::default());
    for i in 0..2 {
        let along = dice.vector2(0.3);
        let across = along.perp() * dice.scale(1e-6, 1e-3);
        let centre = p(dice.between(-1.0, 1.0), 2.0 + 0.4 * f64::from(i));
        let material = dice.diffuse(0.9);
        this.shapes.push(Shape::closed([centre - along, centre + along, centre + across], material));
    }
    this
}

/// Vertices that the camera sees in directions 10⁻⁹ to 10⁻⁴ apart, at different distances.
fn aligned(dice: &mut Dice, shapes: usize) -> Arrangement {
    let mut this = receiver(dice, shapes.min(2), Style::default());
    for _ in 0..dice.count(1, 2) {
        let to = DVec2::from_angle(this.angle + dice.between(-0.3, 0.3));
        for distance in [dice.between(0.15, 0.5), dice.between(0.7, 1.4)] {
            let vertex = this.eye + distance * to + dice.sign() * dice.scale(1e-9, 1e-4) * to.perp();
            let material = dice.diffuse(0.9).with_emission(dice.between(0.0, 0.5));
            let other = vertex + dice.vector2(0.1 + 0.15 * distance);
            this.shapes.push(Shape::open([vertex, other], material));
        }
    }
    this
}
