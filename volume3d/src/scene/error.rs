//! What a description may be refused for.

/// What is wrong with a description.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Two things of one kind have the same name.
    #[error("two {what}s are called `{id}`")]
    Duplicate {
        /// "shape", "material", "texture", "light" or "medium".
        what: &'static str,
        /// The name.
        id: String,
    },
    /// An index points nowhere.
    #[error("`{id}` refers to {what} {index}, but there are only {count}")]
    Missing {
        /// Who refers.
        id: String,
        /// "material", "texture" or "medium".
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A number is out of its range.
    #[error("{what} of `{id}` is {value}, but must be {range}")]
    Range {
        /// Whose it is.
        id: String,
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// A texture has not as many texels as its size says.
    #[error("texture `{id}` is {width} x {height}, but has {texels} texels")]
    Texels {
        /// Its name.
        id: String,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// How many texels there are.
        texels: usize,
    },
    /// A surface has a texture but no texture coordinates.
    #[error("shape `{id}` has a textured material, but no texture coordinates")]
    NoCoordinates {
        /// The shape.
        id: String,
    },
    /// Light passes the material of an implicit surface, which rays meet from without only.
    #[error(
        "light passes material `{material}`, which implicit surface `{id}` has; give it another, or make it a mesh"
    )]
    Transmits {
        /// The surface.
        id: String,
        /// Its material.
        material: String,
    },
    /// The normals of a material that light passes are tilted.
    #[error("light passes material `{id}`, whose normals a texture tilts; leave out the bump or normal map")]
    Relief {
        /// The material.
        id: String,
    },
    /// A material cannot be mixed with another.
    #[error(
        "materials `{id}` and `{other}` cannot be mixed, or be the two sides of one: light passes a side, or a mask, a relief or another back is within one"
    )]
    Blend {
        /// The material.
        id: String,
        /// The one it is mixed with.
        other: String,
    },
    /// The vertices of a shape cannot be moved where they should.
    #[error("shape `{id}`: {error}")]
    Mesh {
        /// The shape.
        id: String,
        /// What is wrong.
        error: crate::geometry::MeshError,
    },
    /// The parameters of an implicit surface make none.
    #[error("implicit surface `{id}`: {error}")]
    Implicit {
        /// The surface.
        id: String,
        /// What is wrong.
        error: flatland::sdf::shapes::ShapeError,
    },
    /// The numbers for tracing rays at implicit surfaces are out of range.
    #[error("tracing implicit surfaces: {0}")]
    Tracer(#[from] flatland::sdf::TracerError),
    /// The camera looks from within a surface.
    #[error(
        "the camera is inside the implicit surface `{id}`, where φ = {value}; it must be outside, where φ > {least}"
    )]
    Inside {
        /// The surface.
        id: String,
        /// φ at the camera.
        value: f64,
        /// What it must be above: 0, or with a lens what φ may change over its radius.
        least: f64,
    },
    /// The camera's frame is not orthonormal.
    #[error("the camera's right, up and forward are not orthonormal")]
    Frame,
    /// A camera that stands for an orthographic sensor has what only a perspective one has.
    #[error("an orthographic camera has no lens, and its axis meets the middle of the film")]
    Orthographic,
    /// The field of view of a camera that has none would change.
    #[error("an orthographic camera has no field of view that could change")]
    FieldOfView,
    /// The film or its crop has no pixels, or the crop leaves the film.
    #[error("the film of {width} x {height} pixels has no pixels in its crop window")]
    Film {
        /// Columns of the film.
        width: usize,
        /// Rows of the film.
        height: usize,
    },
    /// More of something in all than indices count.
    #[error("the scene has {count} {what}, more than {most}")]
    TooLarge {
        /// "vertices", "normals", "texture coordinates" or "triangles".
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there may be.
        most: usize,
    },
}
