//! Tangents: rates of a world and its camera by a parameter θ; gradients have the same type.

use std::ops::{Add, AddAssign, Mul};

use glam::DVec2;

use super::{Camera, CameraTangent, Material, Shape, World, WorldError};

/// A rate of every parameter: the direction of a derivative, or a gradient.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tangent {
    /// Velocity of every vertex.
    pub vertices: Vec<DVec2>,
    /// Rates of every shape's material.
    pub materials: Vec<MaterialTangent>,
    /// Rate of the environment's radiance.
    pub environment: f64,
    /// Rates of the camera.
    pub camera: CameraTangent,
}

/// Rates of a [`Material`]'s parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MaterialTangent {
    /// Rate of ρ.
    pub reflectance: f64,
    /// Rate of the emitted radiance.
    pub emission: f64,
    /// Rate of the gloss strength s; ignored by a material without gloss.
    pub gloss_strength: f64,
    /// Rate of the gloss width w; ignored by a material without gloss.
    pub gloss_width: f64,
}

/// A derivative separated into its terms. Their sum is the derivative; the value of each is independent of
/// the choice of the warp field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<T> {
    /// ∫ ∂f/∂θ at fixed film coordinates and fixed directions.
    pub interior: T,
    /// Discontinuities over the film: the boundary integral of primary visibility.
    pub primary: T,
    /// Discontinuities over the directions at a surface: shadows and reflections.
    pub secondary: T,
}

impl<T> Terms<T> {
    /// Maps every term.
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Terms<U> {
        Terms { interior: f(self.interior), primary: f(self.primary), secondary: f(self.secondary) }
    }

    /// The terms in order.
    pub fn to_array(self) -> [T; 3] {
        [self.interior, self.primary, self.secondary]
    }
}

impl<T: Add<Output = T>> Terms<T> {
    /// The derivative.
    pub fn total(self) -> T {
        self.interior + self.primary + self.secondary
    }
}

impl AddAssign for Terms<f64> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.interior += other.interior;
        self.primary += other.primary;
        self.secondary += other.secondary;
    }
}

impl Mul<f64> for Terms<f64> {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f64) -> Self {
        self.map(|term| term * factor)
    }
}

/// Reason why a tangent does not fit its world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TangentError {
    /// The tangent has another number of vertices or shapes than the world.
    #[error("a change of {vertices} vertices and {shapes} shapes for a world of {expected:?}")]
    Size {
        /// Number of vertices of the tangent.
        vertices: usize,
        /// Number of shapes of the tangent.
        shapes: usize,
        /// Numbers of vertices and shapes of the world.
        expected: (usize, usize),
    },
    /// A rate that is NaN or infinite.
    #[error("a rate of the change is not finite: {what}")]
    NotFinite {
        /// Name of the rate.
        what: String,
    },
}

impl World {
    /// The world with all parameters changed linearly by `theta` times a tangent. For the camera see
    /// [`Tangent::displaced_camera`].
    ///
    /// # Errors
    /// A [`WorldError`] if the result is invalid.
    ///
    /// # Panics
    /// If the tangent belongs to another world.
    pub fn displaced(&self, change: &Tangent, theta: f64) -> Result<Self, WorldError> {
        let displaced = |(i, shape): (usize, &Shape)| {
            let velocities = &change.vertices[self.vertices_of(i)];
            let points = shape.points().iter().zip(velocities).map(|(p, v)| *p + theta * *v);
            let mut material = *shape.material();
            change.materials[i].displace(&mut material, theta);
            if shape.is_closed() { Shape::closed(points, material) } else { Shape::open(points, material) }
        };
        let shapes = self.shapes().iter().enumerate().map(displaced).collect();
        Self::new(self.environment() + theta * change.environment, shapes)
    }
}

impl Tangent {
    /// The zero tangent of a world.
    #[must_use]
    pub fn none(world: &World) -> Self {
        Self {
            vertices: vec![DVec2::ZERO; world.vertex_count()],
            materials: vec![MaterialTangent::default(); world.shapes().len()],
            ..Self::default()
        }
    }

    /// p(θ) = p + θ direction for every vertex of the given shapes.
    ///
    /// # Panics
    /// If the world has no such shape.
    #[must_use]
    pub fn translate(world: &World, shapes: impl IntoIterator<Item = usize>, direction: DVec2) -> Self {
        Self::moving(world, shapes, |_| direction)
    }

    /// Rotation of the given shapes by θ radians about `centre`, from +x towards +y, to first order.
    ///
    /// # Panics
    /// If the world has no such shape.
    #[must_use]
    pub fn rotate(world: &World, shapes: impl IntoIterator<Item = usize>, centre: DVec2) -> Self {
        Self::moving(world, shapes, |p| (p - centre).perp())
    }

    /// p(θ) = centre + (1 + θ)(p − centre) for every vertex of the given shapes.
    ///
    /// # Panics
    /// If the world has no such shape.
    #[must_use]
    pub fn scale(world: &World, shapes: impl IntoIterator<Item = usize>, centre: DVec2) -> Self {
        Self::moving(world, shapes, |p| p - centre)
    }

    /// A velocity for every vertex of the given shapes.
    ///
    /// # Panics
    /// If the world has no such shape.
    #[must_use]
    pub fn moving(
        world: &World,
        shapes: impl IntoIterator<Item = usize>,
        velocity: impl Fn(DVec2) -> DVec2,
    ) -> Self {
        let mut this = Self::none(world);
        for shape in shapes {
            for (v, p) in world.vertices_of(shape).zip(world.shapes()[shape].points()) {
                this.vertices[v] = velocity(*p);
            }
        }
        this
    }

    /// A tangent of the camera alone.
    #[must_use]
    pub fn of_camera(world: &World, camera: CameraTangent) -> Self {
        Self { camera, ..Self::none(world) }
    }

    /// The sum of two tangents.
    ///
    /// # Panics
    /// If they belong to different worlds.
    #[must_use]
    pub fn and(mut self, other: &Self) -> Self {
        self.add(1.0, other);
        self
    }

    /// Adds `factor` times another tangent.
    ///
    /// # Panics
    /// If they belong to different worlds.
    pub fn add(&mut self, factor: f64, other: &Self) {
        assert_eq!(self.vertices.len(), other.vertices.len(), "changes of different worlds");
        assert_eq!(self.materials.len(), other.materials.len(), "changes of different worlds");
        self.vertices.iter_mut().zip(&other.vertices).for_each(|(a, b)| *a += factor * *b);
        self.materials.iter_mut().zip(&other.materials).for_each(|(a, b)| a.add(factor, b));
        self.environment += factor * other.environment;
        self.camera.add(factor, &other.camera);
    }

    /// Sum of products of all rates.
    ///
    /// # Panics
    /// If they belong to different worlds.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        assert_eq!(self.vertices.len(), other.vertices.len(), "changes of different worlds");
        assert_eq!(self.materials.len(), other.materials.len(), "changes of different worlds");
        let vertices: f64 = self.vertices.iter().zip(&other.vertices).map(|(a, b)| a.dot(*b)).sum();
        let materials: f64 = self.materials.iter().zip(&other.materials).map(|(a, b)| a.dot(b)).sum();
        vertices + materials + self.environment * other.environment + self.camera.dot(&other.camera)
    }

    /// All rates, in a fixed order: for statistics over gradients.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.vertices
            .iter()
            .flat_map(DVec2::to_array)
            .chain(self.materials.iter().flat_map(MaterialTangent::to_array))
            .chain([self.environment])
            .chain(self.camera.to_array())
    }

    /// From rates in the order of [`values`](Self::values); missing ones are 0.
    #[must_use]
    pub(crate) fn of_values(world: &World, values: impl IntoIterator<Item = f64>) -> Self {
        let mut values = values.into_iter();
        let mut next = || values.next().unwrap_or(0.0);
        let mut vector = || DVec2::new(next(), next());
        let vertices = (0..world.vertex_count()).map(|_| vector()).collect();
        let mut material = || MaterialTangent {
            reflectance: next(),
            emission: next(),
            gloss_strength: next(),
            gloss_width: next(),
        };
        let materials = (0..world.shapes().len()).map(|_| material()).collect();
        let environment = next();
        let position = DVec2::new(next(), next());
        let camera = CameraTangent { position, angle: next(), field_of_view: next() };
        Self { vertices, materials, environment, camera }
    }

    /// Whether any geometry moves. Otherwise no auxiliary ray is traced.
    #[must_use]
    pub fn is_geometric(&self) -> bool {
        self.vertices.iter().any(|v| *v != DVec2::ZERO) || self.camera != CameraTangent::default()
    }

    /// The camera changed by `theta` times this tangent.
    #[must_use]
    pub fn displaced_camera(&self, camera: &Camera, theta: f64) -> Camera {
        Camera {
            position: camera.position + theta * self.camera.position,
            angle: camera.angle + theta * self.camera.angle,
            field_of_view: camera.field_of_view + theta * self.camera.field_of_view,
            film: camera.film,
        }
    }

    /// Checks that the tangent fits a world.
    ///
    /// # Errors
    /// A [`TangentError`] that names the mismatch.
    pub fn check(&self, world: &World) -> Result<(), TangentError> {
        let expected = (world.vertex_count(), world.shapes().len());
        let (vertices, shapes) = (self.vertices.len(), self.materials.len());
        if (vertices, shapes) != expected {
            return Err(TangentError::Size { vertices, shapes, expected });
        }
        let fail = |what: String| Err(TangentError::NotFinite { what });
        if let Some(v) = self.vertices.iter().position(|v| !v.is_finite()) {
            return fail(format!("of vertex {v}"));
        }
        if let Some(m) = self.materials.iter().position(|m| m.to_array().iter().any(|x| !x.is_finite())) {
            return fail(format!("of the material of shape {m}"));
        }
        if self.values().any(|x| !x.is_finite()) {
            return fail("of the environment or the camera".to_owned());
        }
        Ok(())
    }
}

/// A group of parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Parameters {
    /// The coordinates of a vertex.
    Vertex(usize),
    /// Parameters of a shape's material, in the order of a [`MaterialTangent`].
    Material(usize),
    /// The environment's radiance.
    Environment,
    /// Parameters of the camera, in the order of a [`CameraTangent`].
    Camera,
}

impl Parameters {
    /// Number of parameters of all groups.
    pub(crate) fn count(world: &World) -> usize {
        Self::Camera.first(world) + 4
    }

    /// Index of the first of them in the order of [`Tangent::values`].
    pub(crate) fn first(self, world: &World) -> usize {
        let materials = 2 * world.vertex_count();
        let environment = materials + 4 * world.shapes().len();
        match self {
            Self::Vertex(vertex) => 2 * vertex,
            Self::Material(shape) => materials + 4 * shape,
            Self::Environment => environment,
            Self::Camera => environment + 1,
        }
    }
}

/// Derivative of one sample of dI/dθ, term by term, by the rate of one parameter: forward mode multiplies,
/// reverse mode scatters, and each is the transpose of the other by construction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Covector {
    /// Its index in the order of [`Tangent::values`].
    pub(crate) parameter: usize,
    pub(crate) terms: Terms<f64>,
}

impl MaterialTangent {
    /// The rates in order.
    #[must_use]
    pub fn to_array(&self) -> [f64; 4] {
        [self.reflectance, self.emission, self.gloss_strength, self.gloss_width]
    }

    /// Sum of the products.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        self.to_array().into_iter().zip(other.to_array()).map(|(a, b)| a * b).sum()
    }

    /// Adds `factor` times another.
    pub fn add(&mut self, factor: f64, other: &Self) {
        self.reflectance += factor * other.reflectance;
        self.emission += factor * other.emission;
        self.gloss_strength += factor * other.gloss_strength;
        self.gloss_width += factor * other.gloss_width;
    }

    pub(super) fn displace(&self, material: &mut Material, theta: f64) {
        material.reflectance += theta * self.reflectance;
        material.emission += theta * self.emission;
        if let Some(gloss) = &mut material.gloss {
            gloss.strength += theta * self.gloss_strength;
            gloss.width += theta * self.gloss_width;
        }
    }
}
