//! The world with its camera, one path and the auxiliary rays at each of its directions.

use flatland::transport::Camera;
use glam::{DVec2, DVec3};

use super::fans::{DrawnPath, Fan, RAYS};
use super::setting::{FLOOR, LIGHT, OCCLUDER, PIVOT, Setting, WALL, looks};
use crate::figures::common::{display, largest};
use crate::plot::{Align, Canvas, Color, Height, Palette, Pen, Rect, TextStyle, View};

/// The shown part of the world.
pub(super) const LOW: DVec2 = DVec2::new(0.25, -0.5);
pub(super) const HIGH: DVec2 = DVec2::new(9.95, 6.05);
/// Distance of the film from the pinhole and its thickness on the page.
const FILM: f64 = 1.15;
const FILM_WIDTH: f64 = 9.0;
/// Height on the page of the strip of light under the floor.
const STRIP: f64 = 9.0;
/// Side of the enlarged part on the page, and how much larger it is.
const LENS: f64 = 84.0;
const ENLARGED: f64 = 25.0;
/// Multiple of the mean weight from which a ray is drawn strongest.
const HEAVY: f64 = 3.0;

/// The pen of a ray with this share of the weight.
pub(super) fn pen(share: f64) -> Pen {
    let relative = (share * RAYS as f64 / HEAVY).min(1.0);
    let color = Color::hex(0x9a_a0_a8).mix(Palette::VERMILION, relative.sqrt() as f32);
    Pen::new(color.alpha(0.45 + 0.55 * relative as f32), 0.5 + 2.3 * relative)
}

/// Draws the world; `image` is the film's radiance.
pub(super) fn draw(canvas: &mut Canvas, space: Rect, setting: &Setting, path: &DrawnPath, image: &[f64]) {
    let view = View::upward(LOW, HIGH, space);
    canvas.clipped(space, |canvas| {
        let picture = Picture { setting, path, view };
        picture.frustum(canvas);
        for fan in &path.fans {
            picture.fan(canvas, fan);
        }
        picture.light_on_floor(canvas);
        picture.shapes(canvas);
        picture.path(canvas);
        picture.film(canvas, image);
        picture.labels(canvas);
        picture.key(canvas, space);
        picture.lens(canvas, space);
    });
}

struct Picture<'a> {
    setting: &'a Setting,
    path: &'a DrawnPath,
    view: View,
}

impl Picture<'_> {
    fn camera(&self) -> &Camera {
        &self.setting.camera
    }

    /// The point of the film at coordinate u.
    fn on_film(&self, u: f64, distance: f64) -> DVec2 {
        let camera = self.camera();
        let direction = camera.direction(u);
        self.view.at(camera.position + direction * (distance / direction.dot(camera.axes()[0])))
    }

    fn frustum(&self, canvas: &mut Canvas) {
        let camera = self.camera();
        let pinhole = self.view.at(camera.position);
        let ends = [0.0, camera.film.pixels as f64].map(|u| self.on_film(u, 14.0));
        canvas.fill_polygon(&[[pinhole, ends[0], ends[1]]], Color::hex(0xf4_f6_f8));
    }

    fn fan(&self, canvas: &mut Canvas, fan: &Fan) {
        for ray in fan.lightest_first() {
            canvas.line(self.view.at(fan.from), self.view.at(ray.end), &pen(ray.share));
        }
    }

    /// Direct light on the floor, under it.
    fn light_on_floor(&self, canvas: &mut Canvas) {
        const PIECES: usize = 240;
        let points = self.setting.world.shapes()[FLOOR].points();
        for i in 0..PIECES {
            let at = |t: f64| points[0].lerp(points[1], t / PIECES as f64);
            let (a, b) = (self.view.at(at(i as f64)), self.view.at(at(i as f64 + 1.0)));
            let lit = self.setting.lit(at(i as f64 + 0.5).x);
            let shade = Color::hex(0x2a_2d_33).mix(Color::hex(0xff_e9_b8), lit as f32);
            canvas.fill_rect(Rect::new(a.x, a.y + 2.0, b.x - a.x + 0.3, STRIP), shade);
        }
    }

    fn shapes(&self, canvas: &mut Canvas) {
        for (index, shape) in self.setting.world.shapes().iter().enumerate() {
            let points: Vec<DVec2> = shape.points().iter().map(|&p| self.view.at(p)).collect();
            let (_, color) = looks(Some(index));
            if shape.is_closed() {
                canvas.outlined(&points, color.tint(0.55), &Pen::new(color, 2.2));
            } else {
                let width = if index == LIGHT { 6.0 } else { 3.6 };
                canvas.polyline(&points, &Pen::new(color, width));
            }
        }
        self.swing(canvas);
    }

    /// The pivot, and an arrow along the arc.
    fn swing(&self, canvas: &mut Canvas) {
        let ink = looks(Some(OCCLUDER)).1.mix(Color::INK, 0.35);
        let arm = self.setting.occluder() - PIVOT;
        let at = |angle: f64| self.view.at(PIVOT + DVec2::from_angle(angle).rotate(arm));
        canvas.line(self.view.at(PIVOT), at(0.0), &Pen::new(ink, 1.2).dashed());
        canvas.disc(self.view.at(PIVOT), 3.2, ink);
        let arc: Vec<DVec2> = (0..=16).map(|i| at(0.02 * f64::from(i) - 0.16)).collect();
        canvas.polyline(&arc, &Pen::new(ink, 2.2));
        canvas.arrow(at(0.12), at(0.24), &Pen::new(ink, 2.2));
    }

    fn path(&self, canvas: &mut Canvas) {
        let [camera, x1, x2, end] = self.path.points.map(|p| self.view.at(p));
        let lit = self.view.at(self.path.lit);
        let solid = Pen::new(Color::INK, 1.8);
        let towards_light = Pen::new(Palette::ORANGE.mix(Color::INK, 0.45), 1.8).dashed();
        canvas.line(x1, lit, &towards_light);
        canvas.line(x2, end, &towards_light);
        canvas.line(camera, x1, &solid);
        canvas.line(x1, x2, &solid);
        for point in [x1, x2] {
            canvas.disc(point, 4.2, Color::INK);
        }
    }

    fn film(&self, canvas: &mut Canvas, image: &[f64]) {
        let largest = largest(image);
        let half = 0.5 * FILM_WIDTH / self.view.vector(DVec2::X).x;
        let part = |from: usize, to: usize| {
            let corner = |u: usize, side: f64| self.on_film(u as f64, FILM + side * half);
            [corner(from, -1.0), corner(to, -1.0), corner(to, 1.0), corner(from, 1.0)]
        };
        for (i, value) in image.iter().enumerate() {
            canvas.fill_polygon(&[part(i, i + 1)], gray(value / largest));
        }
        canvas.stroke_polygon(&[part(0, image.len())], &Pen::new(Color::INK, 1.0));
        canvas.disc(self.view.at(self.camera().position), 4.5, Color::INK);
    }

    fn labels(&self, canvas: &mut Canvas) {
        let plain = TextStyle::new(11.0, Color::INK).anchored(Align::Left, Height::Middle).halo(Color::WHITE);
        let mut say = |text: &str, at: DVec2, offset: [f64; 2], style: &TextStyle| {
            canvas.text(text, self.view.at(at) + DVec2::from(offset), style);
        };
        let points = |shape: usize| self.setting.world.shapes()[shape].points();
        let [camera, x1, x2, _] = self.path.points;
        let centred = plain.anchored(Align::Centre, Height::Middle);
        let right = plain.anchored(Align::Right, Height::Middle);
        say("camera", camera, [-2.0, -14.0], &centred);
        say("x_{1}", x1, [-8.0, -12.0], &right.bold());
        say("x_{2}", x2, [9.0, 4.0], &plain.bold());
        say("light", points(LIGHT)[1], [9.0, 0.0], &plain);
        say("wall", points(WALL)[0].lerp(points(WALL)[1], 0.45), [8.0, 0.0], &plain);
        say("floor, and its shadow", points(FLOOR)[1], [-4.0, STRIP + 11.0], &right);
        say("occluder,", self.setting.occluder(), [-64.0, 4.0], &right);
        say("swings", self.setting.occluder(), [-64.0, 18.0], &right);
        let end = self.camera().direction(self.camera().film.pixels as f64);
        say("film", self.camera().position + 1.3 * FILM * end, [0.0, -9.0], &centred);
    }

    /// The legend of the lines.
    fn key(&self, canvas: &mut Canvas, space: Rect) {
        let style = TextStyle::new(10.0, Color::INK).anchored(Align::Left, Height::Middle);
        let mean = 1.0 / RAYS as f64;
        let lines = [
            ("path", Pen::new(Color::INK, 1.8)),
            ("emitter ray", Pen::new(Palette::ORANGE.mix(Color::INK, 0.45), 1.8).dashed()),
            ("auxiliary ray, ¼ of the mean weight", pen(0.25 * mean)),
            ("auxiliary ray of the mean weight", pen(mean)),
            ("auxiliary ray, 3 times or more", pen(HEAVY * mean)),
        ];
        let mut at = DVec2::new(space.x + 2.0, space.y + 14.0);
        for (text, pen) in lines {
            canvas.line(at, at + DVec2::new(24.0, 0.0), &pen);
            canvas.text(text, at + DVec2::new(30.0, 0.0), &style);
            at.y += 15.0;
        }
    }

    /// The film sample beside the occluder's outline, enlarged.
    fn lens(&self, canvas: &mut Canvas, space: Rect) {
        let frame = Rect::new(space.x + 4.0, space.bottom() - LENS - 68.0, LENS, LENS);
        let corner = self.path.corner;
        let half = DVec2::splat(0.5 * LENS / (ENLARGED * self.view.vector(DVec2::X).x));
        let near = View::upward(corner - half, corner + half, frame);
        canvas.fill_rect(frame, Color::WHITE);
        canvas.clipped(frame, |canvas| {
            let points = self.setting.world.shapes()[OCCLUDER].points();
            let points: Vec<DVec2> = points.iter().map(|&p| near.at(p)).collect();
            let occluder = looks(Some(OCCLUDER)).1;
            canvas.fill_polygon(&[points.as_slice()], occluder.tint(0.55));
            self.enlarged_rays(canvas, &near);
            canvas.stroke_polygon(&[points.as_slice()], &Pen::new(occluder, 2.2));
        });
        canvas.frame(frame, &Pen::new(Color::INK, 1.0));
        let spot = self.view.at(corner);
        canvas.circle(spot, 5.0, &Pen::new(Color::INK, 1.0));
        let edge = DVec2::new(frame.right(), frame.y);
        let towards = (edge - spot).normalize();
        canvas.line(edge, spot + 5.0 * towards, &Pen::new(Color::INK, 0.6));
        let style = TextStyle::new(10.0, Color::INK).anchored(Align::Left, Height::Top);
        let below = DVec2::new(frame.x, frame.bottom() + 3.0);
        canvas.text(&format!("× {ENLARGED}"), below, &style);
    }

    fn enlarged_rays(&self, canvas: &mut Canvas, near: &View) {
        let Some(fan) = self.path.fans.first() else { return };
        // Only what lies near the frame: enlarged, the whole ray is too long to draw.
        let around = 0.1;
        for ray in fan.lightest_first() {
            let along = (ray.end - fan.from).normalize();
            let nearest = (self.path.corner - fan.from).dot(along);
            let reach = (ray.end - fan.from).length().min(nearest + around);
            let ends = [nearest - around, reach].map(|t| near.at(fan.from + t * along));
            canvas.line(ends[0], ends[1], &pen(ray.share));
        }
    }
}

/// The grey of a relative radiance, encoded for display.
pub(super) fn gray(value: f64) -> Color {
    display(DVec3::splat(value.clamp(0.0, 1.0)))
}
