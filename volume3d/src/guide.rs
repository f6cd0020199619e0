//! User guide: from a mesh to a fitted pose.
//!
//! | page | contents |
//! |---|---|
//! | [`start`] | a scene around a mesh, a rendering, a verified gradient, a pose fitted to a picture |
//! | [`mesh`] | a mesh from pictures, by all its vertices |
//! | [`texture`] | a texture from pictures, and colours of vertices |
//! | [`methods`] | choice of method and settings |
//! | [`bias`] | unbiased, biased and refused cases; heavy tails |
//! | [`surfaces`] | surface reconstruction from pictures, as a distance grid or a neural network |
//! | [`deviations`] | differences from the Mitsuba format, with their sizes |
//! | [`python`] | the Python package: gradients, losses, PyTorch and JAX, comparisons with other renderers |
//! | [`size`] | practical problem sizes, with time, threads and memory |
//! | [`theory`] | the mathematics in twelve pages: theorem, fields, curves, paths, implicit surfaces, bias, chains |

#[doc = include_str!("../guide/start.md")]
pub mod start {}

// Pages show their pictures where the folder of the guide is not beside them: the first definition of a link
// counts.
#[doc = concat!("[picture]: data:image/png;base64,", include_str!("../guide/pictures/mesh.png.b64"))]
#[doc = include_str!("../guide/mesh.md")]
pub mod mesh {}

#[doc = concat!("[picture]: data:image/png;base64,", include_str!("../guide/pictures/texture.png.b64"))]
#[doc = include_str!("../guide/texture.md")]
pub mod texture {}

#[doc = include_str!("../guide/methods.md")]
pub mod methods {}

#[doc = include_str!("../guide/bias.md")]
pub mod bias {}

#[doc = include_str!("../guide/surfaces.md")]
pub mod surfaces {}

#[doc = include_str!("../guide/deviations.md")]
pub mod deviations {}

#[doc = include_str!("../guide/python.md")]
pub mod python {}

#[doc = include_str!("../guide/size.md")]
pub mod size {}

#[doc = include_str!("../guide/theory.md")]
pub mod theory {
    #[doc = include_str!("../guide/theory-01-boundary-term.md")]
    pub mod boundary_term {}

    #[doc = include_str!("../guide/theory-02-boundary-to-area.md")]
    pub mod boundary_to_area {}

    #[doc = include_str!("../guide/theory-03-auxiliary-rays.md")]
    pub mod auxiliary_rays {}

    #[doc = include_str!("../guide/theory-04-debiasing.md")]
    pub mod debiasing {}

    #[doc = include_str!("../guide/theory-05-edges-field.md")]
    pub mod edges_field {}

    #[doc = include_str!("../guide/theory-06-softened-fields.md")]
    pub mod softened_fields {}

    #[doc = include_str!("../guide/theory-07-residual-theorem.md")]
    pub mod residual_theorem {}

    #[doc = include_str!("../guide/theory-08-paths.md")]
    pub mod paths {}

    #[doc = include_str!("../guide/theory-09-curves-in-space.md")]
    pub mod curves_in_space {}

    #[doc = include_str!("../guide/theory-10-implicit-surfaces.md")]
    pub mod implicit_surfaces {}

    #[doc = include_str!("../guide/theory-11-bias.md")]
    pub mod bias {}

    #[doc = include_str!("../guide/theory-12-chains.md")]
    pub mod chains {}
}
