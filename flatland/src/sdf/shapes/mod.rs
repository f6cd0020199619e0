//! Implicit shapes in the plane; balls, and unions, intersections and differences, also in space.

mod ball;
mod complement;
mod grid;
mod point;
mod polygon;
mod rounded_box;
mod union;

pub use ball::{Ball, Circle};
pub use complement::{
    Complement, SmoothDifference, SmoothIntersection, smooth_difference, smooth_intersection,
};
pub use grid::{Basis, Grid, Interpolation};
pub use polygon::Polygon;
pub(in crate::sdf) use polygon::segments_meet;
pub use rounded_box::RoundedBox;
pub use union::SmoothUnion;

use glam::DVec2;

use super::distance::{Jet, Sdf, SecondOrder};
use super::space::Space;

/// Reason why a shape cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A parameter is not finite, or not in its range.
    #[error("{shape}: {parameter} = {value} is not {wanted}")]
    Parameter {
        /// Kind of shape.
        shape: &'static str,
        /// Name of the parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Its admissible range.
        wanted: &'static str,
    },
    /// A polygon has fewer than three vertices.
    #[error("polygon: {count} vertices, at least 3 are needed")]
    Vertices {
        /// Number of vertices.
        count: usize,
    },
    /// Two edges of a polygon meet other than at the vertex they share.
    #[error("polygon: edges {first} and {second} meet")]
    NotSimple {
        /// The first edge, from this vertex to the next.
        first: usize,
        /// The second.
        second: usize,
    },
    /// A grid has too few nodes for its interpolation, or their number does not match its size.
    #[error("grid: {found} node values for {width} × {height} nodes, of which at least 2 × 2 are needed")]
    Nodes {
        /// Nodes in x.
        width: usize,
        /// Nodes in y.
        height: usize,
        /// Node values given.
        found: usize,
    },
    /// A list of parameters has the wrong length.
    #[error("{found} parameters for a shape that has {expected}")]
    Count {
        /// Number of the shape's parameters.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// The parameters are inconsistent as a whole.
    #[error("{shape}: {reason}")]
    Unmade {
        /// Kind of shape.
        shape: &'static str,
        /// The cause.
        reason: String,
    },
}

impl ShapeError {
    /// Refuses a parameter that is not finite, or for which `holds` is false.
    ///
    /// # Errors
    /// [`ShapeError::Parameter`].
    pub fn check(
        shape: &'static str,
        parameter: &'static str,
        value: f64,
        wanted: &'static str,
        holds: bool,
    ) -> Result<(), Self> {
        let good = value.is_finite() && holds;
        if good { Ok(()) } else { Err(Self::Parameter { shape, parameter, value, wanted }) }
    }

    /// Refuses a list of parameters of the wrong length.
    fn count(expected: usize, parameters: &[f64]) -> Result<(), Self> {
        let found = parameters.len();
        if expected == found { Ok(()) } else { Err(Self::Count { expected, found }) }
    }
}

/// A shape whose parameters can be read and replaced.
///
/// The coefficients c, whose rates [`Sdf::rate`] takes, are θ itself, except for shapes computed from θ as a
/// whole: for a network baked to a grid they are the nodes of the grid. [`push_forward`](Self::push_forward)
/// and [`pull_back`](Self::pull_back) convert between the two once per gradient, and not at every point.
pub trait Parametric<V: Space>: Sdf<V> + Sized {
    /// θ, in the order of all directions and gradients.
    fn parameters(&self) -> Vec<f64>;

    /// p, the number of entries of θ.
    fn dimension(&self) -> usize {
        self.parameter_count()
    }

    /// ċ = (∂c/∂θ) θ̇, with [`Sdf::parameter_count`] entries.
    fn push_forward(&self, direction: &[f64]) -> Vec<f64> {
        direction.to_vec()
    }

    /// The transpose: ∂L/∂θ from ∂L/∂c.
    fn pull_back(&self, gradient: Vec<f64>) -> Vec<f64> {
        gradient
    }

    /// The shape with other parameters.
    ///
    /// # Errors
    /// A [`ShapeError`] that names the parameter.
    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError>;
}

/// Any of the shapes of the plane.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A disc: centre, radius.
    Circle(Circle),
    /// A rectangle: centre, half extents, angle, rounding.
    Box(RoundedBox),
    /// A simple polygon: its vertices.
    Polygon(Polygon),
    /// Two shapes, blended where they are close: the parameters of both, blending width.
    Union(Box<SmoothUnion<Shape>>),
    /// Samples on a grid: its node values.
    Grid(Grid),
}

macro_rules! each {
    ($self:expr, $shape:ident => $value:expr) => {
        match $self {
            Shape::Circle($shape) => $value,
            Shape::Box($shape) => $value,
            Shape::Polygon($shape) => $value,
            Shape::Union($shape) => $value,
            Shape::Grid($shape) => $value,
        }
    };
}

impl Parametric<DVec2> for Shape {
    fn parameters(&self) -> Vec<f64> {
        each!(self, shape => shape.parameters())
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        ShapeError::count(self.parameter_count(), parameters)?;
        Ok(match self {
            Self::Circle(circle) => Self::Circle(circle.with_parameters(parameters)?),
            Self::Box(_) => Self::Box(RoundedBox::from_parameters(parameters)?),
            Self::Polygon(_) => Self::Polygon(Polygon::from_parameters(parameters)?),
            Self::Union(union) => Self::Union(Box::new(union.with_parameters(parameters)?)),
            Self::Grid(grid) => Self::Grid(grid.with_parameters(parameters)?),
        })
    }
}

impl Sdf<DVec2> for Shape {
    fn jet(&self, x: DVec2) -> Jet<DVec2> {
        each!(self, shape => shape.jet(x))
    }

    fn second_order(&self, x: DVec2) -> SecondOrder<DVec2> {
        each!(self, shape => shape.second_order(x))
    }

    fn level_bounds(&self, level: f64) -> Option<(DVec2, DVec2)> {
        each!(self, shape => shape.level_bounds(level))
    }

    fn parameter_count(&self) -> usize {
        each!(self, shape => shape.parameter_count())
    }

    fn rate(&self, x: DVec2, direction: &[f64]) -> Jet<DVec2> {
        each!(self, shape => shape.rate(x, direction))
    }

    fn add_parameter_gradient(&self, x: DVec2, covector: Jet<DVec2>, gradient: &mut [f64]) {
        each!(self, shape => shape.add_parameter_gradient(x, covector, gradient));
    }
}

#[cfg(test)]
mod tests;
