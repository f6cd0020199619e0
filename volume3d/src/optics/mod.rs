//! What a boundary between two media does to light, in numbers: Fresnel's equations, and the facets of rough ones; and how
//! the particles of a medium scatter it. It knows nothing of scenes and paths.

mod coating;
pub(crate) mod fresnel;
mod microfacets;
pub(crate) mod phase;

pub(crate) use coating::Coating;
pub use microfacets::Microfacets;
