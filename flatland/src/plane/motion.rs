//! Motions: the dependence of a scene on its parameter θ, a velocity for every vertex.

use glam::DVec2;

use super::{PolygonError, Scene, SceneError};

/// A motion that does not fit its scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The scene has no such shape.
    #[error("motion names shape {shape}; the scene has {count}")]
    NoSuchShape {
        /// Index of the shape.
        shape: usize,
        /// Number of shapes.
        count: usize,
    },
    /// The shape has no such vertex.
    #[error("motion names vertex {vertex} of shape {shape}, which has {count}")]
    NoSuchVertex {
        /// Index of the shape.
        shape: usize,
        /// Index of the vertex.
        vertex: usize,
        /// Number of vertices.
        count: usize,
    },
    /// A direction or centre that is NaN or infinite.
    #[error("motion {part} has a direction or centre that is not finite")]
    NotFinite {
        /// Index of the combined motion.
        part: usize,
    },
    /// The displaced polygon is invalid.
    #[error("shape {shape} displaced by θ = {theta}: {source}")]
    Displaced {
        /// Index of the shape.
        shape: usize,
        /// The displacement.
        theta: f64,
        /// The violation.
        source: PolygonError,
    },
}

#[derive(Clone, Debug, PartialEq)]
enum Part {
    Translate { shapes: Vec<usize>, direction: DVec2 },
    Rotate { shapes: Vec<usize>, centre: DVec2 },
    Scale { shapes: Vec<usize>, centre: DVec2 },
    Vertex { shape: usize, vertex: usize, direction: DVec2 },
}

/// One scalar parameter θ of a scene, at θ = 0. Motions add up by [`and`](Motion::and).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    parts: Vec<Part>,
}

impl Motion {
    fn one(part: Part) -> Self {
        Self { parts: vec![part] }
    }

    /// p(θ) = p + θ direction for every vertex of the shapes.
    #[must_use]
    pub fn translate(shapes: impl IntoIterator<Item = usize>, direction: DVec2) -> Self {
        Self::one(Part::Translate { shapes: shapes.into_iter().collect(), direction })
    }

    /// Rotation by θ radians about `centre`, from +x towards +y (clockwise on the screen, where y points
    /// down).
    #[must_use]
    pub fn rotate(shapes: impl IntoIterator<Item = usize>, centre: DVec2) -> Self {
        Self::one(Part::Rotate { shapes: shapes.into_iter().collect(), centre })
    }

    /// p(θ) = centre + (1 + θ)(p − centre).
    #[must_use]
    pub fn scale(shapes: impl IntoIterator<Item = usize>, centre: DVec2) -> Self {
        Self::one(Part::Scale { shapes: shapes.into_iter().collect(), centre })
    }

    /// p(θ) = p + θ direction for one vertex, counted ring by ring.
    #[must_use]
    pub fn vertex(shape: usize, vertex: usize, direction: DVec2) -> Self {
        Self::one(Part::Vertex { shape, vertex, direction })
    }

    /// The sum of two motions.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.parts.extend(other.parts);
        self
    }

    /// ∂p/∂θ of every vertex of the scene, shape by shape.
    ///
    /// # Errors
    /// A [`MotionError`] that names the missing shape or vertex.
    pub fn velocities(&self, scene: &Scene) -> Result<Vec<DVec2>, MotionError> {
        self.accumulate(scene, |part, p| match part {
            Part::Translate { direction, .. } | Part::Vertex { direction, .. } => *direction,
            Part::Rotate { centre, .. } => (p - centre).perp(),
            Part::Scale { centre, .. } => p - centre,
        })
    }

    /// The scene at another θ. Rotations are finite rotations.
    ///
    /// # Errors
    /// As [`velocities`](Self::velocities), and [`MotionError::Displaced`] if a polygon turns over.
    pub fn displace(&self, scene: &Scene, theta: f64) -> Result<Scene, MotionError> {
        let offsets = self.accumulate(scene, |part, p| match part {
            Part::Translate { direction, .. } | Part::Vertex { direction, .. } => theta * *direction,
            Part::Rotate { centre, .. } => {
                // (R − 1) d, without the cancellation of cos θ − 1.
                let d = p - centre;
                let half = (0.5 * theta).sin();
                theta.sin() * d.perp() - 2.0 * half * half * d
            }
            Part::Scale { centre, .. } => theta * (p - centre),
        })?;
        let vertices: Vec<_> = scene.vertices().iter().zip(&offsets).map(|(p, o)| *p + *o).collect();
        scene.displaced(&vertices).map_err(|error| match error {
            SceneError::Polygon { shape, source } => MotionError::Displaced { shape, theta, source },
            SceneError::Shade { .. } | SceneError::Background => {
                unreachable!("displacement leaves shades alone")
            }
        })
    }

    fn accumulate(
        &self,
        scene: &Scene,
        per_vertex: impl Fn(&Part, DVec2) -> DVec2,
    ) -> Result<Vec<DVec2>, MotionError> {
        let mut total = vec![DVec2::ZERO; scene.vertices().len()];
        let count = scene.shapes().len();
        let range = |shape: usize| {
            if shape < count {
                Ok(scene.vertex_range(shape))
            } else {
                Err(MotionError::NoSuchShape { shape, count })
            }
        };
        for (index, part) in self.parts.iter().enumerate() {
            let (Part::Translate { direction: v, .. }
            | Part::Vertex { direction: v, .. }
            | Part::Rotate { centre: v, .. }
            | Part::Scale { centre: v, .. }) = part;
            if !v.is_finite() {
                return Err(MotionError::NotFinite { part: index });
            }
            match part {
                Part::Translate { shapes, .. } | Part::Rotate { shapes, .. } | Part::Scale { shapes, .. } => {
                    for &shape in shapes {
                        for i in range(shape)? {
                            total[i] += per_vertex(part, scene.vertices()[i]);
                        }
                    }
                }
                Part::Vertex { shape, vertex, .. } => {
                    let range = range(*shape)?;
                    if *vertex >= range.len() {
                        let (shape, vertex, count) = (*shape, *vertex, range.len());
                        return Err(MotionError::NoSuchVertex { shape, vertex, count });
                    }
                    let i = range.start + vertex;
                    total[i] += per_vertex(part, scene.vertices()[i]);
                }
            }
        }
        Ok(total)
    }
}
