//! The shapes of the figure: before an eye at the origin, which looks along z, each with a motion.

use std::f64::consts::TAU;

use anyhow::Result;
use flatland::sdf::shapes::{Ball, Parametric, SmoothUnion};
use flatland::sdf::{Sdf, Tracer, View};
use glam::DVec3;
use rayon::prelude::*;
use volume3d::sdf::analytic::RoundedBox;
use volume3d::sdf::{Grid, Interpolation};

/// Tracer of exact outlines: for functions that are no distance, rays beside an outline need many points.
const EXACT: Tracer = Tracer { step_scale: 1.0, tolerance: 1e-7, max_steps: 6000, far: FAR };

/// Distance at which a ray has left the scene.
pub(super) const FAR: f64 = 10.0;

/// Displacement in time to each side for central differences.
const STEP: f64 = 1e-4;

/// Bisections of an outline, whose differences are taken, and of the last ray that hits, from the largest
/// angle that a shape may have from its axis.
const BISECTIONS: usize = 44;
const FEWER_BISECTIONS: usize = 26;
const WIDEST: f64 = 0.6;

/// The cells of grids along a side where nothing else is said, and the box that they fill.
pub(super) const CELLS: usize = 32;
const BOX: (DVec3, DVec3) = (DVec3::new(-2.2, -2.2, -0.2), DVec3::new(4.2, 4.2, 6.2));

/// The ball of the figure: centre, radius, velocity and growth.
const CENTRE: DVec3 = DVec3::new(0.1, -0.15, 3.0);
const RADIUS: f64 = 1.0;
const VELOCITY: DVec3 = DVec3::new(0.5, 0.8, -0.6);
const GROWTH: f64 = 0.2;

/// Any shape.
type Shape = Box<dyn Sdf<DVec3>>;

/// A moving shape whose outline is star-shaped about an axis.
pub(super) struct Subject {
    pub(super) name: String,
    /// Whether the default fields are unbiased there in theory.
    pub(super) is_smooth: bool,
    pub(super) sdf: Shape,
    pub(super) direction: Vec<f64>,
    axis: DVec3,
    /// The shape at a later time.
    later: Box<dyn Fn(f64) -> Result<Shape> + Sync>,
}

/// A part of an outline: a direction on it, and ∫ v dl over the part, with v the outline's angular velocity
/// outwards.
pub(super) struct Arc {
    pub(super) direction: DVec3,
    pub(super) flux: f64,
}

impl Subject {
    fn new<S: Parametric<DVec3> + Clone + 'static>(
        name: impl Into<String>,
        is_smooth: bool,
        shape: S,
        direction: Vec<f64>,
        axis: DVec3,
    ) -> Result<Self> {
        let (still, rates) = (shape.clone(), direction.clone());
        let later = move |time: f64| -> Result<Shape> {
            let moved: Vec<f64> = still.parameters().iter().zip(&rates).map(|(p, r)| p + time * r).collect();
            Ok(Box::new(still.with_parameters(&moved)?))
        };
        Ok(Self {
            name: name.into(),
            is_smooth,
            sdf: Box::new(shape),
            direction,
            axis: axis.normalize(),
            later: Box::new(later),
        })
    }

    /// The shape at a time earlier, and at as much later.
    pub(super) fn around(&self, time: f64) -> Result<[Shape; 2]> {
        Ok([(self.later)(-time)?, (self.later)(time)?])
    }

    /// A ball with known outline and motion.
    pub(super) fn ball() -> Result<Self> {
        let direction = VELOCITY.to_array().into_iter().chain([GROWTH]).collect();
        Self::new("ball", true, Ball::new(CENTRE, RADIUS)?, direction, CENTRE)
    }

    /// Two balls closer than they are wide, the nearer before a part of the other, blended where they are
    /// within `width` of each other: in free space only, so that the surface is that of both for any width.
    pub(super) fn union(width: f64) -> Result<Self> {
        let near = Ball::new(DVec3::new(-0.35, -0.1, 2.5), 0.5)?;
        let far = Ball::new(DVec3::new(0.5, 0.3, 4.0), 0.8)?;
        let direction = vec![0.5, 0.8, -0.6, 0.5, -0.7, 0.3, 0.4, 0.4, 0.0];
        let name = if width > 0.0 { "smooth union" } else { "plain union" };
        let axis = DVec3::new(-0.14, -0.04, 1.0).normalize() + DVec3::new(0.125, 0.075, 1.0).normalize();
        Self::new(name, width > 0.0, SmoothUnion::new(near, far, width)?, direction, axis)
    }

    /// A box of one size with edges rounded or sharp.
    fn rounded(rounding: f64) -> Result<Self> {
        let half = DVec3::new(0.7, 0.5, 0.6) - rounding;
        let direction = VELOCITY.to_array().into_iter().chain([GROWTH, GROWTH, GROWTH, 0.0]).collect();
        let name = if rounding > 0.0 { "rounded box" } else { "sharp box" };
        Self::new(name, rounding > 0.0, RoundedBox::new(CENTRE, half, rounding)?, direction, CENTRE)
    }

    /// The ball on a grid whose nodes change as its distances do.
    pub(super) fn grid(interpolation: Interpolation, cells: usize) -> Result<Self> {
        let grid = Grid::sampled(interpolation, BOX, cells, |x| (x - CENTRE).length() - RADIUS)?;
        let rate = |index| -(grid.position(index) - CENTRE).normalize_or_zero().dot(VELOCITY) - GROWTH;
        let direction = (0..grid.nodes().len()).map(rate).collect();
        let (name, is_smooth) = match interpolation {
            Interpolation::Cubic => ("cubic grid", true),
            Interpolation::Trilinear => ("trilinear grid", false),
        };
        Self::new(name, is_smooth, grid, direction, CENTRE)
    }

    /// All shapes of the table.
    pub(super) fn all() -> Result<Vec<Self>> {
        Ok(vec![
            Self::ball()?,
            Self::union(0.5)?,
            Self::rounded(0.2)?,
            Self::grid(Interpolation::Cubic, CELLS)?,
            Self::union(0.0)?,
            Self::rounded(0.0)?,
            Self::grid(Interpolation::Trilinear, CELLS)?,
        ])
    }

    /// The outline as `arcs` arcs, by bisection of the shapes before and after.
    pub(super) fn outline(&self, arcs: u32) -> Result<Vec<Arc>> {
        let [before, after] = self.around(STEP)?;
        let (s, t) = self.axis.any_orthonormal_pair();
        let arc = |k: u32| {
            let around = TAU * (f64::from(k) + 0.5) / f64::from(arcs);
            let across = s * around.cos() + t * around.sin();
            let [a, b] = [&before, &after].map(|sdf| last_hit(&**sdf, EXACT, BISECTIONS, self.axis, across));
            let angle = 0.5 * (a + b);
            let width = TAU / f64::from(arcs) * angle.sin();
            let direction = self.axis * angle.cos() + across * angle.sin();
            Arc { direction, flux: (b - a) / (2.0 * STEP) * width }
        };
        Ok((0..arcs).into_par_iter().map(arc).collect())
    }

    /// The last directions that hit for a tracer, around the axis, and the outward direction there for an
    /// outline that is a circle.
    pub(super) fn last_hits(&self, tracer: Tracer, count: u32) -> Vec<(DVec3, DVec3, f64)> {
        let (s, t) = self.axis.any_orthonormal_pair();
        let hit = |k: u32| {
            let around = TAU * (f64::from(k) + 0.5) / f64::from(count);
            let across = s * around.cos() + t * around.sin();
            let angle = last_hit(&*self.sdf, tracer, FEWER_BISECTIONS, self.axis, across);
            let direction = self.axis * angle.cos() + across * angle.sin();
            let outward = across * angle.cos() - self.axis * angle.sin();
            (direction, outward, TAU / f64::from(count) * angle.sin())
        };
        (0..count).into_par_iter().map(hit).collect()
    }

    pub(super) fn view(&self, tracer: Tracer) -> View<'_, DVec3> {
        View { sdf: &*self.sdf, eye: DVec3::ZERO, start: 0.0, tracer }
    }
}

/// The angle from an axis up to which rays hit, in the plane of the axis and a direction across.
fn last_hit(sdf: &dyn Sdf<DVec3>, tracer: Tracer, bisections: usize, axis: DVec3, across: DVec3) -> f64 {
    let view = View { sdf, eye: DVec3::ZERO, start: 0.0, tracer };
    let (mut low, mut high) = (0.0, WIDEST);
    for _ in 0..bisections {
        let middle: f64 = 0.5 * (low + high);
        let hits = view.trace(axis * middle.cos() + across * middle.sin()).hit().is_some();
        if hits { low = middle } else { high = middle }
    }
    low
}
