//! How points of curves are drawn: edges and their weights, surfaces beside them, directions past them, and
//! camera paths to the points that see them.

mod directions;
mod sensor;
mod sides;
mod table;
mod walk;
mod wedge;

pub(super) use self::directions::Directions;
pub(super) use self::sensor::{CameraSubpath, Sensor, Vertex};
pub(super) use self::sides::{Sides, aside, clear, largest, look_past, near};
pub(super) use self::table::Table;
pub(super) use self::walk::{Walk, reflects};
pub(super) use self::wedge::{Aimed, Targets, Wedge};
pub(super) use crate::gradient::edges::{Edge, EdgeList};
