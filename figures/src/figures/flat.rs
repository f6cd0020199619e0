//! Drawing of flat worlds.

use flatland::transport::{Camera, Shape, Tangent, World};
use glam::DVec2;

use crate::plot::{Align, Canvas, Color, Height, Palette, Pen, TextStyle, View};

/// The colour of a shape, by its material.
fn color(shape: &Shape) -> Color {
    let material = shape.material();
    if material.emission > 0.0 {
        Palette::ORANGE
    } else if material.gloss.is_some() {
        Palette::BLUE
    } else {
        Color::INK.mix(Color::WHITE, 0.25)
    }
}

/// Draws all shapes: polygons filled, luminous ones in orange, glossy ones in blue.
pub(crate) fn draw_world(canvas: &mut Canvas, view: &View, world: &World) {
    for shape in world.shapes() {
        let points: Vec<DVec2> = shape.points().iter().map(|p| view.at(*p)).collect();
        let color = color(shape);
        if shape.is_closed() {
            canvas.outlined(&points, color.tint(0.55), &Pen::new(color, 1.6));
        } else {
            canvas.polyline(&points, &Pen::new(color, 3.0));
        }
    }
}

/// Draws the pinhole and its view up to `depth`.
pub(crate) fn draw_camera(canvas: &mut Canvas, view: &View, camera: &Camera, depth: f64) {
    let ends = [0.0, camera.film.pixels as f64].map(|u| camera.position + depth * camera.direction(u));
    let [a, b] = ends.map(|p| view.at(p));
    let at = view.at(camera.position);
    canvas.fill_polygon(&[[at, a, b]], Palette::GREEN.alpha(0.14));
    for end in [a, b] {
        canvas.line(at, end, &Pen::new(Palette::GREEN.alpha(0.6), 0.9));
    }
    canvas.disc(at, 3.6, Palette::GREEN);
}

/// Draws the velocity of every vertex of one shape, `scale` times as long.
pub(crate) fn draw_motion(
    canvas: &mut Canvas,
    view: &View,
    world: &World,
    (shape, change): (usize, &Tangent),
    scale: f64,
) {
    for (vertex, point) in world.vertices_of(shape).zip(world.shapes()[shape].points()) {
        let tip = *point + scale * change.vertices[vertex];
        canvas.arrow(view.at(*point), view.at(tip), &Pen::new(Palette::VERMILION, 1.4));
    }
}

/// Writes beside a point of the world.
pub(crate) fn label(canvas: &mut Canvas, view: &View, at: DVec2, text: &str, color: Color) {
    let style = TextStyle::new(10.5, color).halo(Color::WHITE).anchored(Align::Centre, Height::Middle);
    canvas.text(text, view.at(at), &style);
}
