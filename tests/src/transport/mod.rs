//! Test support of flat transport.
//!
//! - [`campaign`]: estimates and exact values over many worlds.
//! - [`constants`]: worlds whose pixels or derivatives are known without computing them.
//! - [`oracle`]: pixels and their derivatives in dual numbers, sharing no code with flatland.
//! - [`worlds`]: random worlds, generic and degenerate.

pub mod campaign;
pub mod constants;
pub mod oracle;
pub mod worlds;
