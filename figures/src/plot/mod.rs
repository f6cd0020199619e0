//! Plotting: shapes, text, axes and colour maps on tiny-skia, in one visual language.
//!
//! Lengths are logical pixels; a canvas holds twice as many device pixels each way.

mod axes;
mod canvas;
mod color;
mod colorbar;
mod colormap;
mod dark;
mod geometry;
mod layout;
mod legend;
mod marks;
mod raster;
mod rows;

mod scale;
mod text;

pub(crate) use axes::{Axes, Axis};
pub(crate) use canvas::{Canvas, Kept, Pen};
pub(crate) use color::{Color, Palette};
pub(crate) use colormap::Shading;
pub(crate) use dark::{dark, darkened, light};
pub(crate) use geometry::{Rect, View};
pub(crate) use layout::{Figure, GUTTER, PANEL_TITLE_ROOM};
pub(crate) use legend::Legend;
pub(crate) use marks::{Marker, Style, cut};
pub(crate) use raster::Raster;
pub(crate) use rows::Rows;
pub(crate) use scale::number;
pub(crate) use text::{Align, Height, TextStyle};
