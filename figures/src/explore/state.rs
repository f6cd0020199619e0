//! State of the page: everything that can be dragged or set, and its encoding as a link.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use flatland::plane::Filter;
use flatland::transport::{Camera, CameraTangent, Film, Gloss, Material, Shape, Tangent, World};
use glam::DVec2;

/// Shapes of the world, by index.
pub(super) const FLOOR: usize = 0;
pub(super) const WALL: usize = 1;
pub(super) const LIGHT: usize = 2;
pub(super) const OCCLUDER: usize = 3;

/// Pixels of the film, and its field of view in radians.
const PIXELS: usize = 48;
const FIELD_OF_VIEW: f64 = 1.0;
/// The occluder's corners and radius, and half the light's width.
const CORNERS: usize = 5;
/// The most leaves around the occluder, their least and largest distance from its middle, and the distance of
/// their corners from their own. None meets another shape: where two cross, no vertex tells of the jump.
const LEAVES: usize = 40;
const RING: [f64; 2] = [0.63, 0.82];
const LEAF: f64 = 0.055;
const RADIUS: f64 = 0.55;
const HALF_LIGHT: f64 = 0.75;

/// A number of the state: its name in links, its description, range and initial value.
struct Setting {
    name: &'static str,
    range: [f64; 2],
    first: f64,
}

const fn setting(name: &'static str, range: [f64; 2], first: f64) -> Setting {
    Setting { name, range, first }
}

/// All settings, in the order of [`State`]'s numbers.
const SETTINGS: [Setting; 17] = [
    setting("ox", [1.5, 8.0], 4.9),
    setting("oy", [0.9, 4.6], 1.8),
    setting("oa", [-10.0, 10.0], 0.3),
    setting("lx", [1.5, 8.0], 5.15),
    setting("ly", [5.0, 6.5], 5.8),
    setting("cx", [0.2, 3.0], 0.7),
    setting("cy", [1.0, 5.0], 3.4),
    setting("ca", [-1.2, 0.2], -0.48),
    setting("width", [0.0, 1.0], 0.0),
    setting("kappa", [1.0, 1000.0], 44.0),
    setting("gamma", [0.25, 8.0], 1.0),
    setting("rays", [0.0, 256.0], 16.0),
    setting("samples", [8.0, 1024.0], 64.0),
    setting("seed", [0.0, 4e9], 1.0),
    setting("moves", [0.0, 4.0], 0.0),
    setting("leaves", [0.0, LEAVES as f64], 0.0),
    setting("at", [0.0, PIXELS as f64], 21.0),
];

/// Number of parameters: θ moves the occluder to the right, up or around its middle, the light to the right,
/// or the camera up.
const MOVES: usize = 5;

/// A link that encodes no valid state.
#[derive(Debug, thiserror::Error)]
pub(super) enum StateError {
    #[error("`{0}` is not of the form name=number&name=number")]
    Form(String),
    #[error("there is no setting `{0}`; there are {known}", known = SETTINGS.map(|s| s.name).join(", "))]
    Name(String),
    #[error("{name} = {value} is not between {low} and {high}")]
    Range { name: &'static str, value: f64, low: f64, high: f64 },
}

/// The flat world, its camera, the motion and the method's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State([f64; 17]);

impl Default for State {
    fn default() -> Self {
        Self(SETTINGS.map(|setting| setting.first))
    }
}

impl State {
    /// Reads the part of a link behind its ? or #; missing settings have their initial values.
    pub(super) fn parse(link: &str) -> Result<Self, StateError> {
        let mut state = Self::default();
        for part in link.split('&').filter(|part| !part.is_empty()) {
            let form = || StateError::Form(part.to_owned());
            let (name, value) = part.split_once('=').ok_or_else(form)?;
            let value: f64 = value.parse().map_err(|_| form())?;
            let index = SETTINGS.iter().position(|s| s.name == name);
            let index = index.ok_or_else(|| StateError::Name(name.to_owned()))?;
            let Setting { name, range: [low, high], .. } = SETTINGS[index];
            if !(low..=high).contains(&value) {
                return Err(StateError::Range { name, value, low, high });
            }
            state.0[index] = value;
        }
        Ok(state)
    }

    /// The complete link.
    pub(super) fn link(&self) -> String {
        let mut link = String::new();
        for (setting, value) in SETTINGS.iter().zip(self.0) {
            let and = if link.is_empty() { "" } else { "&" };
            let _ = write!(link, "{and}{}={value}", setting.name);
        }
        link
    }

    /// The name of every setting with its range.
    pub(super) fn ranges() -> impl Iterator<Item = (&'static str, [f64; 2])> {
        SETTINGS.iter().map(|setting| (setting.name, setting.range))
    }

    fn get(&self, name: &str) -> f64 {
        let index = SETTINGS.iter().position(|setting| setting.name == name);
        index.map_or(f64::NAN, |index| self.0[index])
    }

    fn point(&self, x: &str, y: &str) -> DVec2 {
        DVec2::new(self.get(x), self.get(y))
    }

    /// w, the half width of the floor's lobe in radians; `None` if it is matt.
    pub(super) fn lobe(&self) -> Option<f64> {
        Some(self.get("width")).filter(|width| *width > 0.0)
    }

    pub(super) fn kappa(&self) -> f64 {
        self.get("kappa")
    }

    pub(super) fn gamma(&self) -> f64 {
        self.get("gamma")
    }

    /// N′, or `None` for a random number of rays, which leaves no bias.
    pub(super) fn rays(&self) -> Option<usize> {
        Some(self.get("rays") as usize).filter(|rays| *rays > 0)
    }

    pub(super) fn samples(&self) -> usize {
        self.get("samples") as usize
    }

    pub(super) fn seed(&self) -> u64 {
        self.get("seed") as u64
    }

    /// The place on the film around which auxiliary rays are drawn, in pixels.
    pub(super) fn place(&self) -> f64 {
        self.get("at")
    }

    /// The state after θ has grown, whatever its ranges.
    pub(super) fn moved(&self, theta: f64) -> Self {
        let name = ["ox", "oy", "oa", "lx", "cy"][self.get("moves") as usize % MOVES];
        let mut moved = *self;
        if let Some(index) = SETTINGS.iter().position(|setting| setting.name == name) {
            moved.0[index] += theta;
        }
        moved
    }

    /// The shapes that move with the occluder.
    fn plant(&self) -> std::ops::Range<usize> {
        OCCLUDER..OCCLUDER + 1 + self.get("leaves") as usize
    }

    /// A triangle of a ring around the occluder, which turns with it.
    fn leaf(&self, index: usize) -> Shape {
        // A sunflower's spiral (Vogel 1979).
        let part = (index as f64 - 0.5) / LEAVES as f64;
        let far = (RING[0].powi(2) + part * (RING[1].powi(2) - RING[0].powi(2))).sqrt();
        let around = TAU * index as f64 / std::f64::consts::GOLDEN_RATIO;
        let turn = DVec2::from_angle(self.get("oa"));
        let middle = self.point("ox", "oy") + far * turn.rotate(DVec2::from_angle(around));
        let corner = |i: usize| {
            let arm = DVec2::from_angle(3.0 * around + i as f64 * TAU / 3.0);
            middle + LEAF * turn.rotate(arm)
        };
        Shape::closed((0..3).map(corner), Material::diffuse(0.4))
    }

    /// A floor, a wall, a light, a pentagon and leaves around it.
    pub(super) fn world(&self) -> Result<World, flatland::transport::WorldError> {
        let (occluder, light) = (self.point("ox", "oy"), self.point("lx", "ly"));
        let corner = |i: usize| {
            occluder + RADIUS * DVec2::from_angle(self.get("oa") + i as f64 * TAU / CORNERS as f64)
        };
        let line = |a: DVec2, b: DVec2, material| Shape::open([a, b], material);
        let matt = Material::diffuse(0.8);
        let floor = match self.lobe() {
            Some(width) => Material { gloss: Some(Gloss { strength: 0.8, width }), ..Material::diffuse(0.0) },
            None => matt,
        };
        let half = DVec2::new(HALF_LIGHT, 0.0);
        let mut shapes = vec![
            line(DVec2::new(0.1, 0.0), DVec2::new(9.2, 0.0), floor),
            line(DVec2::new(9.3, 0.1), DVec2::new(9.3, 4.6), matt),
            line(light - half, light + half, Material::emitter(6.0)),
            Shape::closed((0..CORNERS).map(corner), Material::diffuse(0.6)),
        ];
        shapes.extend((1..self.plant().len()).map(|index| self.leaf(index)));
        World::new(0.15, shapes)
    }

    pub(super) fn camera(&self) -> Camera {
        let film = Film { pixels: PIXELS, filter: Filter::Tent };
        Camera { position: self.point("cx", "cy"), angle: self.get("ca"), field_of_view: FIELD_OF_VIEW, film }
    }

    /// The tangent of all parameters with respect to θ.
    pub(super) fn change(&self, world: &World) -> Tangent {
        match self.get("moves") as usize % MOVES {
            0 => Tangent::translate(world, self.plant(), DVec2::X),
            1 => Tangent::translate(world, self.plant(), DVec2::Y),
            2 => Tangent::rotate(world, self.plant(), self.point("ox", "oy")),
            3 => Tangent::translate(world, [LIGHT], DVec2::X),
            _ => Tangent::of_camera(world, CameraTangent { position: DVec2::Y, ..CameraTangent::default() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_do_not_meet() {
        let state = State::parse("leaves=40&oy=0.9").unwrap();
        let world = state.world().unwrap();
        let middles: Vec<DVec2> = world.shapes()[OCCLUDER + 1..]
            .iter()
            .map(|leaf| leaf.points().iter().sum::<DVec2>() / 3.0)
            .collect();
        assert_eq!(middles.len(), 40);
        for (i, a) in middles.iter().enumerate() {
            assert!(a.y > LEAF && a.distance(state.point("ox", "oy")) > RADIUS + LEAF, "{a}");
            assert!(middles[..i].iter().all(|b| a.distance(*b) > 2.0 * LEAF), "{i}: {a}");
        }
    }

    #[test]
    fn links_read_back_and_say_what_is_wrong() {
        let state = State::parse("ox=5.5&gamma=2&rays=16").unwrap();
        assert_eq!(State::parse(&state.link()).unwrap(), state);
        assert_eq!((state.get("ox"), state.gamma(), state.rays()), (5.5, 2.0, Some(16)));
        assert_eq!(State::parse("").unwrap(), State::default());
        let error = |link: &str| State::parse(link).unwrap_err().to_string();
        assert!(error("ox").contains("name=number") && error("ox=a").contains("ox=a"));
        assert!(error("zz=1").contains("there are ox, oy"));
        assert_eq!(error("gamma=0"), "gamma = 0 is not between 0.25 and 8");
        assert!(error("gamma=NaN").contains("not between") && error("samples=1e300").contains("1024"));
    }
}
