//! Random plane scenes: generic, degenerate in a named way, and not differentiable.
//!
//! A [`Case`] is built from [`Knobs`] by [`Knobs::build`]. [`random`] draws the knobs from a seed; [`knobs`]
//! lets proptest draw them, so that a failure shrinks to few shapes with few vertices and the simplest
//! filter. All cases except those of [`non_differentiable`] have a derivative, although the derivative of
//! [`Kind::NearlyCoincident`] changes within a displacement of one gap.

mod degenerate;
mod pieces;

use flatland::plane::{Film, Filter, Motion, Scene};
use glam::DVec2;
use proptest::prelude::*;

use degenerate::pieces;
use pieces::{Piece, Window};

use crate::choices::choices;
use crate::dice::Dice;

/// A moving scene and the film that views it.
#[derive(Clone, Debug)]
pub struct Case {
    /// Shapes that cross the film's border.
    pub scene: Scene,
    /// The motion of the scene's vertices with θ.
    pub motion: Motion,
    /// 3 × 3 to 6 × 6 pixels.
    pub film: Film,
    /// The knobs in words, for failure messages.
    pub label: String,
}

impl Case {
    /// The velocity of every vertex.
    pub fn velocities(&self) -> Vec<DVec2> {
        self.motion.velocities(&self.scene).expect("the motion fits its scene")
    }
}

choices! {
    /// Degeneracy of a scene.
    Kind {
        /// None.
        Generic,
        /// Two adjacent polygons share edges, or parts of one, and move together.
        CoincidentTogether,
        /// Two polygons that share part of an edge separate, below a third that occludes that part.
        CoincidentHidden,
        /// Two polygons that move differently have a vertex in common.
        SharedVertex,
        /// A vertex of a polygon lies exactly on another's edge, and they move differently.
        TJunction,
        /// Two polygons, or two rings of one, touch in a point from outside.
        Touching,
        /// An edge runs exactly through a pixel's corner, or through several.
        EdgeThroughCorner,
        /// Vertices lie exactly on pixels' corners.
        VertexOnCorner,
        /// Edges run along the lines where the filter is not smooth; along a box's border they are at rest or
        /// slide along themselves.
        GridAligned,
        /// Polygons 10³ to 10⁶ times as long as wide.
        Sliver,
        /// Edges of two polygons that move differently are 10⁻⁶, 10⁻¹⁰ or 10⁻¹³ pixels apart.
        NearlyCoincident,
        /// Copies of one polygon coincide and move together.
        NestedCopies,
        /// A polygon's hole is exactly filled by another polygon, and both move together.
        FilledHole,
    }
}

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Knobs {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The degeneracy.
    pub kind: Kind,
    /// The number of shapes, 1 to 5; more where the kind needs more.
    pub shapes: usize,
    /// The maximum number of vertices of a ring, 3 to 12.
    pub vertices: usize,
    /// The pixel filter.
    pub filter: Filter,
}

impl Knobs {
    /// Knobs drawn from a seed.
    pub fn random(seed: u64, kind: Kind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX);
        let filter = dice.pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        Self { seed, kind, shapes: dice.count(1, 5), vertices: dice.count(3, 12), filter }
    }

    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> Case {
        let window = Window::random(&mut Dice::new(self.seed, 0), self.filter, self.kind == Kind::Generic);
        let mut stack = pieces(self, &window);
        // The rest is generic, above and below. Each shape has its own dice, so that the others stay as they
        // are when shapes are removed.
        let rest = self.shapes.saturating_sub(stack.len());
        for i in 0..rest {
            let mut dice = Dice::new(self.seed, 100 + i as u64);
            let piece = Piece::generic(&mut dice, &window, self.vertices);
            let place = if dice.chance(0.7) { 0 } else { stack.len() };
            stack.insert(place, piece);
        }
        let background = Dice::new(self.seed, 1).colour();
        let (scene, motion) = pieces::assemble(background, stack);
        Case { scene, motion, film: window.film, label: format!("{self:?}") }
    }
}

/// The case of a kind with all other knobs drawn from a seed.
pub fn random(seed: u64, kind: Kind) -> Case {
    Knobs::random(seed, kind).build()
}

/// Strategy over some kinds; shrinks towards the first kind, one shape, triangles and a box.
pub fn knobs(kinds: Vec<Kind>) -> impl Strategy<Value = Knobs> {
    let filters = vec![Filter::Box, Filter::Tent, Filter::Gaussian];
    let parts = (any::<u64>(), prop::sample::select(kinds), 1..=5_usize, 3..=12_usize);
    (parts, prop::sample::select(filters)).prop_map(|((seed, kind, shapes, vertices), filter)| Knobs {
        seed,
        kind,
        shapes,
        vertices,
        filter,
    })
}

/// A case whose image has no derivative, in a pixel well inside the film: even seeds separate two polygons
/// along a visible edge that they share, odd seeds push an edge across the border of a box pixel that it lies
/// on.
pub fn non_differentiable(seed: u64) -> Case {
    degenerate::non_differentiable(seed)
}

#[cfg(test)]
mod tests;
