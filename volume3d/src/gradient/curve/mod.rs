//! Curves of discontinuity: ∮ Δ[(f − L₀)(v − V)]·ν dl over every kind of curve, for any field V (Theory 7).
//!
//! A kind of curve is one file. It draws points of the curve with a density, and says how fast they move
//! across V: with V = 0 that is edge sampling; where V = v nothing is left, and nothing is computed.
//!
//! | curve | with V = 0 | relative to a field |
//! |---|---|---|
//! | [`film_edges`] | edges and crossings on the film | silhouettes and crossings, if it is softened |
//! | [`film_sign_changes`] | surfaces that turn their other side to the camera | the same |
//! | [`shadow_edges`] | edges in front of emitters | the same, if shadows are sampled |
//! | [`indirect_edges`] | edges in front of all else | silhouettes, if it is softened within lobes |
//! | [`outlines`] | emitters as first hits see them | emitters that are not flat, if shadows are sampled |
//! | [`reflected_outlines`] | emitters as seen after a bounce | none |
//! | [`horizons`] | planes of faces with shading normals | before lights, if shadows are sampled |
//! | [`inner_sign_changes`] | surfaces that turn their other side to one another | the same |
//!
//! Borders of flat emitters relative to a field are added by next-event estimation (`modes/border.rs`).

mod address;
mod all;
mod budget;
mod drawing;
mod driver;
mod edge_lines;
mod eye;
mod field;
mod film_edges;
mod film_sign_changes;
mod horizons;
mod indirect_edges;
mod inner_sign_changes;
mod integral;
mod moving;
mod outlines;
mod reflected_outlines;
mod seen_edge;
mod shadow_edges;
#[cfg(test)]
mod tests;

pub(super) use self::all::Curves;
pub(super) use self::budget::{Budget, Group, Kind};
pub(super) use self::field::{Warping, Zero};
pub(super) use self::shadow_edges::contacts_are_followed;
