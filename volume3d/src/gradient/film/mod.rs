//! The film: positions of samples, filters, and the sums of samples by pixel.

pub(super) mod allocation;
mod border;
pub(super) mod camera_rays;
mod cut;
mod cut_edges;
pub(super) mod driver;
pub(super) mod film_accumulator;
pub(super) mod filter;
pub(super) mod pixel_borders;
mod plane;
mod point;
mod rounding;
pub(super) mod unit_weights;
mod weights;

pub(crate) use self::cut_edges::CutEdges;
pub(crate) use self::plane::FilmPlane;
pub(crate) use self::point::FilmPoint;
pub(crate) use self::weights::NEAR;
