//! Optics of boundaries and media: Fresnel's equations, microfacets, and phase functions. Independent of
//! scenes and paths.

mod coating;
pub(crate) mod fresnel;
mod microfacets;
pub(crate) mod phase;

pub(crate) use coating::Coating;
pub use microfacets::Microfacets;
