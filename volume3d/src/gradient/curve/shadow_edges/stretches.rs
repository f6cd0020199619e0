//! Stretches of edges, and whether their shadows may be visible on the film.
//!
//! The shadow of an edge lies behind it: light from a ball (c, r) that passes a stretch with midpoint m and
//! half-length h continues at m + s (m − c), s ≥ 0, to within h + s (r + h). That is in front of a plane with
//! unit normal n only if n·(m + s (m − c)) + h + s (r + h) is large enough, which bounds s. If the bounds of
//! all planes of the view frustum and of the scene's bounding box leave no s, the shadow of the stretch is
//! visible only after another reflection.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::beside::{Bodies, Contact};
use crate::gradient::curve::drawing::{EdgeList, Sensor};

/// Light that is sought past a stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    /// Light of all emitters except those of a contact: directions are sampled towards lights.
    Lights,
    /// Light of the contact's emitters.
    Contact,
}

/// A part of an edge.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    /// Index of the edge.
    pub(super) edge: u32,
    /// Range along the edge.
    pub(super) along: Range<f64>,
    /// Whether its shadows may be visible.
    pub(super) shown: bool,
    pub(super) of: Of,
    /// Index of its contact, if it is one.
    pub(super) contact: Option<u32>,
}

impl Stretch {
    /// Its length as a fraction of the edge.
    pub(super) fn part(&self) -> f64 {
        self.along.end - self.along.start
    }

    /// Both ends, given those of the edge.
    pub(super) fn ends(&self, [a, b]: [DVec3; 2]) -> [DVec3; 2] {
        [self.along.start, self.along.end].map(|s| a.lerp(b, s))
    }

    /// Position along the edge, from a fraction of the stretch.
    pub(super) fn place(&self, rest: f64) -> f64 {
        self.along.start + rest * self.part()
    }
}

/// Length, relative to the scene, at which subdivision stops; it stops earlier if all shadows of a stretch
/// are visible or none.
const SHORTEST: f64 = 1.0 / 128.0;

/// Enlargement of half spaces, in roundings: superfluous stretches cost samples, no bias.
const SLACK: f64 = 1e4;

/// Number of lights above which shadows are assumed to be everywhere.
const MANY: usize = 16;

/// {x: n·x ≥ d}, |n| = 1.
#[derive(Clone, Copy, Debug)]
struct HalfSpace {
    normal: DVec3,
    level: f64,
}

/// Balls around the lights, and the region in which shadows are visible.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    /// Bounding balls of lights.
    pub(super) lights: Vec<(DVec3, f64)>,
    within: Vec<HalfSpace>,
    shortest: f64,
}

impl Shown {
    /// `None` if that is everywhere: light from infinity or from many lights, or a camera with a lens.
    pub(super) fn new(sensor: &Sensor<'_>) -> Option<Self> {
        let scene = sensor.paths.scene;
        let (lights, (low, high)) = (sensor.paths.lights.spheres()?, scene.bounds()?);
        let film = &sensor.film;
        if film.has_lens() || lights.len() > MANY {
            return None;
        }
        let slack = SLACK * scene.rounding();
        let (origin, (first, last)) = (film.still.origin.value(), film.bounds());
        let corners = [first, DVec2::new(last.x, first.y), last, DVec2::new(first.x, last.y)];
        let corners = corners.map(|u| film.ray(u));
        let middle: DVec3 = corners.iter().sum();
        let sides = (0..4).map(|k| {
            let normal = corners[k].cross(corners[(k + 1) % 4]).normalize();
            let normal = if normal.dot(middle) < 0.0 { -normal } else { normal };
            HalfSpace { normal, level: normal.dot(origin) - slack }
        });
        let faces = DVec3::AXES.into_iter().flat_map(|axis| {
            let least = HalfSpace { normal: axis, level: axis.dot(low) - slack };
            let most = HalfSpace { normal: -axis, level: -axis.dot(high) - slack };
            [least, most]
        });
        let within = sides.chain(faces).collect();
        Some(Self { lights, within, shortest: SHORTEST * (high - low).max_element() })
    }

    /// Whether shadows of the segment between two points may be visible.
    pub(super) fn has(&self, [a, b]: [DVec3; 2]) -> bool {
        let (middle, half) = (a.midpoint(b), 0.5 * a.distance(b));
        self.lights.iter().any(|&(centre, radius)| {
            let (way, wider) = (middle - centre, radius + half);
            let (mut first, mut last) = (0.0_f64, f64::INFINITY);
            for HalfSpace { normal, level } in &self.within {
                let (height, rate) = (normal.dot(middle) - level + half, normal.dot(way) + wider);
                if rate > 0.0 {
                    first = first.max(-height / rate);
                } else if height < 0.0 {
                    return false;
                } else if rate < 0.0 {
                    last = last.min(-height / rate);
                }
            }
            first <= last
        })
    }

    /// Subdivides a stretch with these ends; consecutive pieces with the same visibility are merged.
    fn cut(&self, whole: &Stretch, ends: [DVec3; 2], first: usize, found: &mut Vec<Stretch>) {
        let shown = self.has(ends);
        if shown && ends[0].distance(ends[1]) > self.shortest {
            let along = &whole.along;
            let (middle, place) = (0.5 * (along.start + along.end), ends[0].midpoint(ends[1]));
            let half = |along| Stretch { along, ..whole.clone() };
            self.cut(&half(along.start..middle), [ends[0], place], first, found);
            self.cut(&half(middle..along.end), [place, ends[1]], first, found);
            return;
        }
        match found[first..].last_mut() {
            Some(last) if last.shown == shown => last.along.end = whole.along.end,
            _ => found.push(Stretch { shown, ..whole.clone() }),
        }
    }
}

/// All edges as stretches, in order, and the contacts among them.
pub(super) fn stretches(
    list: &EdgeList,
    sensor: &Sensor<'_>,
    shown: Option<&Shown>,
    bodies: &Bodies,
) -> (Vec<Stretch>, Vec<Contact>) {
    let scene = sensor.paths.scene;
    let (mut found, mut contacts) = (vec![], vec![]);
    for (edge, index) in list.edges.iter().zip(0..) {
        bodies.cut(0.0..1.0, edge.span(scene), &mut |along, ends| {
            let contact = bodies.contact(scene, list, edge, ends).map(|contact| {
                contacts.push(contact);
                contacts.len() as u32 - 1
            });
            let of = if contact.is_some() { &[Of::Lights, Of::Contact][..] } else { &[Of::Lights] };
            for &of in of {
                let whole = Stretch { edge: index, along: along.clone(), shown: true, of, contact };
                match shown {
                    Some(shown) => shown.cut(&whole, ends, found.len(), &mut found),
                    None => found.push(whole),
                }
            }
        });
    }
    (found, contacts)
}
