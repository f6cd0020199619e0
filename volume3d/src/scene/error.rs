//! Errors of scene descriptions.

/// Reason for rejecting a description.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Two objects of one kind have the same name.
    #[error("two {what}s are called `{id}`")]
    Duplicate {
        /// "shape", "material", "texture", "light" or "medium".
        what: &'static str,
        /// The name.
        id: String,
    },
    /// An index is out of range.
    #[error("`{id}` refers to {what} {index}, but there are only {count}")]
    Missing {
        /// Name of the referring object.
        id: String,
        /// "material", "texture" or "medium".
        what: &'static str,
        /// The index.
        index: usize,
        /// Number of objects of the kind.
        count: usize,
    },
    /// A number is out of range.
    #[error("{what} of `{id}` is {value}, but must be {range}")]
    Range {
        /// Name of the object.
        id: String,
        /// Name of the quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Admissible range.
        range: &'static str,
    },
    /// The number of texels does not match the texture's size.
    #[error("texture `{id}` is {width} x {height}, but has {texels} texels")]
    Texels {
        /// Name of the texture.
        id: String,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Number of texels.
        texels: usize,
    },
    /// A textured surface has no texture coordinates.
    #[error("shape `{id}` has a textured material, but no texture coordinates")]
    NoCoordinates {
        /// The shape.
        id: String,
    },
    /// An implicit surface has a transmissive material, but is traced from outside only.
    #[error(
        "implicit surface `{id}` has the transmissive material `{material}`; give it another material, or make it a mesh"
    )]
    Transmits {
        /// The surface.
        id: String,
        /// Its material.
        material: String,
    },
    /// A transmissive material has a bump or normal map.
    #[error("transmissive material `{id}` has a bump or normal map; remove the map")]
    Relief {
        /// The material.
        id: String,
    },
    /// A material cannot be mixed with another, or be its back.
    #[error(
        "materials `{id}` and `{other}` cannot be combined: front and back must not be transmissive, and in a mixture neither may have a bump or normal map, nor the second an opacity, a mixture or a back of its own"
    )]
    Blend {
        /// The material.
        id: String,
        /// Name of the other material.
        other: String,
    },
    /// The vertices of a shape cannot be moved as requested.
    #[error("shape `{id}`: {error}")]
    Mesh {
        /// The shape.
        id: String,
        /// The cause.
        error: crate::geometry::MeshError,
    },
    /// The parameters of an implicit surface are invalid.
    #[error("implicit surface `{id}`: {error}")]
    Implicit {
        /// The surface.
        id: String,
        /// The cause.
        error: flatland::sdf::shapes::ShapeError,
    },
    /// The tracer's parameters are out of range.
    #[error("tracing implicit surfaces: {0}")]
    Tracer(#[from] flatland::sdf::TracerError),
    /// The camera is inside an implicit surface.
    #[error(
        "the camera is inside the implicit surface `{id}`, where φ = {value}; it must be outside, where φ > {least}"
    )]
    Inside {
        /// The surface.
        id: String,
        /// φ at the camera.
        value: f64,
        /// Lower bound on φ: 0, or with a lens the largest change of φ over its radius.
        least: f64,
    },
    /// The camera's frame is not orthonormal.
    #[error("the camera's right, up and forward are not orthonormal")]
    Frame,
    /// An orthographic camera has properties of a perspective one.
    #[error("an orthographic camera can have neither a lens nor a principal point off the centre")]
    Orthographic,
    /// The field of view of an orthographic camera would change.
    #[error("an orthographic camera has no field of view to change")]
    FieldOfView,
    /// The film or its crop has no pixels, or the crop exceeds the film.
    #[error("the film of {width} x {height} pixels has no pixels in its crop window")]
    Film {
        /// Columns of the film.
        width: usize,
        /// Rows of the film.
        height: usize,
    },
    /// A number of a parameter is not finite or outside of its bounds.
    #[error("number {index} of `{name}` is {value}, but must be finite and from {} to {}", .bounds[0], .bounds[1])]
    Parameter {
        /// The parameter.
        name: String,
        /// Index of the number among those of the parameter.
        index: usize,
        /// Its value.
        value: f64,
        /// Lower and upper bound.
        bounds: [f64; 2],
    },
    /// The vector of parameters has another length.
    #[error("{found} numbers are given for parameters of {expected}")]
    Parameters {
        /// Number given.
        found: usize,
        /// Number needed.
        expected: usize,
    },
    /// A parameter belongs to a scene of other objects, or of another topology.
    #[error("`{name}` is a parameter of another scene: here it does not exist, or has another size")]
    OtherScene {
        /// The parameter.
        name: String,
    },
    /// A total count exceeds the range of indices.
    #[error("the scene has {count} {what}, more than {most}")]
    TooLarge {
        /// "vertices", "normals", "texture coordinates" or "triangles".
        what: &'static str,
        /// The count.
        count: usize,
        /// Its maximum.
        most: usize,
    },
}
