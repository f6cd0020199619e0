//! Random flat worlds: generic by content, and degenerate in a named way.
//!
//! A [`Case`] is built from [`Knobs`] by [`Knobs::build`]; [`Knobs::random`] draws the knobs from a
//! seed. All cases have a derivative.

mod changes;
mod scenes;
mod things;

use flatland::plane::Filter;
use flatland::transport::{Camera, Film, Shape, Tangent, World};

use crate::choices::choices;
use crate::dice::Dice;
use scenes::Arrangement;

/// A world, its camera, and a parameter.
#[derive(Clone, Debug)]
pub struct Case {
    /// The world.
    pub world: World,
    /// 4 to 12 pixels.
    pub camera: Camera,
    /// The tangent of both with respect to θ.
    pub change: Tangent,
    /// The knobs in words, for failure messages.
    pub label: String,
}

choices! {
    /// Content of a world, or its degeneracy.
    Kind {
        /// Kinds without anything degenerate.
        GENERIC {
            /// A receiver that fills the view and a light, wholly visible from all of it: no discontinuity on
            /// the film.
            Direct,
            /// A receiver, a light, and objects between them.
            Shadows,
            /// Shadows with lobes 0.02 to 0.5 wide.
            Glossy,
            /// A receiver, a light and objects in an environment that emits.
            Glowing,
            /// Up to five lights.
            ManyLights,
            /// A closed room around everything, of an albedo below 0.8.
            Room,
        }
        /// Degenerate kinds.
        DEGENERATE {
            /// A light 10⁻⁹ to 10⁻¹ over the line of the receiver.
            GrazingLight,
            /// A light 10⁻¹² to 10⁻³ long.
            TinyEmitter,
            /// A camera 10⁻⁹ to 10⁻² from a wall.
            NearWall,
            /// Lobes 10⁻⁶ to 10⁻² wide.
            NearSpecular,
            /// Polygons 10³ to 10⁶ times as long as wide.
            Sliver,
            /// Vertices 10⁻⁹ to 10⁻⁴ from one line through the camera.
            Aligned,
            /// 10⁶ times as large as the others.
            Large,
            /// 10⁻⁶ times as large.
            Small,
        }
    }
}

choices! {
    /// The parameters that θ changes.
    Moving {
        /// Geometric parameters.
        GEOMETRIC {
            /// Translation of some shapes.
            Translate,
            /// Rotation of some shapes about a point.
            Rotate,
            /// Scaling of some shapes about a point.
            Scale,
            /// One vertex.
            Vertex,
            /// The camera's position.
            CameraPosition,
            /// The camera's angle.
            CameraAngle,
            /// The field of view.
            FieldOfView,
        }
        /// Other parameters.
        OTHER {
            /// Every parameter of every material.
            Material,
            /// The environment's radiance.
            Environment,
            /// Everything at once.
            Mixed,
        }
    }
}

impl Kind {
    /// The unit of length.
    fn unit(self) -> f64 {
        match self {
            Self::Large => 1e6,
            Self::Small => 1e-6,
            _ => 1.0,
        }
    }
}

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knobs {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The content.
    pub kind: Kind,
    /// The motion.
    pub moving: Moving,
    /// The number of shapes in addition to those of the kind, 0 to 4; some kinds bound it.
    pub shapes: usize,
    /// The number of pixels, 4 to 12.
    pub pixels: usize,
    /// The pixel filter.
    pub filter: Filter,
}

impl Knobs {
    /// Knobs drawn from a seed.
    pub fn random(seed: u64, kind: Kind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX - kind as u64);
        let filter = dice.pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        let moving = dice.pick(&Moving::ALL);
        Self { seed, kind, moving, shapes: dice.count(0, 4), pixels: dice.count(4, 12), filter }
    }

    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> Case {
        let unit = self.kind.unit();
        for attempt in 0..1000 {
            let mut dice = Dice::new(self.seed, attempt);
            let Arrangement { shapes, environment, eye, angle, field_of_view } =
                scenes::arrange(&mut dice, self.kind, self.shapes);
            let shapes = shapes.iter().map(|shape| scaled(shape, unit)).collect();
            let Ok(world) = World::new(environment, shapes) else { continue };
            let film = Film { pixels: self.pixels, filter: self.filter };
            let camera = Camera { position: eye * unit, angle, field_of_view, film };
            camera.check().expect("a valid camera");
            let change = changes::draw(&mut dice, self.moving, &world, unit);
            return Case { world, camera, change, label: format!("{self:?}") };
        }
        panic!("no disjoint arrangement: {self:?}");
    }
}

/// The case of a kind with all other knobs drawn from a seed.
pub fn random(seed: u64, kind: Kind) -> Case {
    Knobs::random(seed, kind).build()
}

fn scaled(shape: &Shape, unit: f64) -> Shape {
    let points = shape.points().iter().map(|p| *p * unit);
    if shape.is_closed() {
        Shape::closed(points, *shape.material())
    } else {
        Shape::open(points, *shape.material())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_built_repeatably_and_quickly() {
        let start = std::time::Instant::now();
        let mut count = 0_u32;
        for kind in Kind::ALL {
            for seed in 0..50 {
                let [a, b] = [random(seed, kind), random(seed, kind)];
                assert_eq!(format!("{a:?}"), format!("{b:?}"));
                a.change.check(&a.world).expect("the change fits");
                count += 2;
            }
        }
        println!("{:.0} cases a second", f64::from(count) / start.elapsed().as_secs_f64());
    }
}
