//! For whoever begins: from a mesh to a fitted pose, what to choose, and what to expect.
//!
//! | page | what it says |
//! |---|---|
//! | [`start`] | a scene around a mesh, a picture, a gradient that is checked, a pose from a picture |
//! | [`methods`] | which method and which settings, and how to find out |
//! | [`bias`] | what is unbiased, biased and refused, and where tails are heavy |
//! | [`surfaces`] | a surface of unknown shape from pictures: as a grid of distances, and as a network |
//! | [`size`] | how large a problem is practical, and what it takes in time, threads and memory |
//! | [`theory`] | the mathematics in eleven pages: theorem, fields, curves, paths, implicit surfaces, bias |

#[doc = include_str!("../guide/start.md")]
pub mod start {}

#[doc = include_str!("../guide/methods.md")]
pub mod methods {}

#[doc = include_str!("../guide/bias.md")]
pub mod bias {}

#[doc = include_str!("../guide/surfaces.md")]
pub mod surfaces {}

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
}
