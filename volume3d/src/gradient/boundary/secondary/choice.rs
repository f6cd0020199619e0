//! Choice of edges, and of directions through their points.

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::super::STILL;
use super::super::list::Edge;
use super::super::table::Table;
use super::super::wedge::{Aimed, Wedge};
use super::beside::Contact;
use super::stretches::{Of, Stretch};
use super::{Light, Secondary};
use crate::path::{LightId, Sequence};
use crate::scene::Surface;

/// Number of trial directions to lights by which the frequency of an edge being a silhouette is estimated.
const PILOTS: usize = 16;

/// Weight of a fold with smooth shading, relative to a crease.
const SMOOTH: f64 = 0.05;

/// Least weight of an edge that was a silhouette in none of the trials.
const LEAST: f64 = 0.05;

/// A direction through a point of an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn<'c> {
    pub(super) direction: DVec3,
    /// Density by solid angle.
    pub(super) density: f64,
    pub(super) passing: Passing<'c>,
}

/// The light sought along a direction.
#[derive(Clone, Copy, Debug)]
pub(super) enum Passing<'c> {
    /// Light of one emitter.
    Of(Aim),
    /// Light of the emitters in contact with the edge.
    From(&'c Contact),
    /// All light except emission.
    Anything,
}

/// The light that a direction was sampled for, and the only surface of it that counts, if it has one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Aim {
    pub(super) id: LightId,
    pub(super) surface: Option<Surface>,
    pub(super) distance: f64,
}

impl Secondary<'_> {
    pub(super) fn weights(&self) -> Table {
        let scene = self.sensor.paths.scene;
        let weigh = |stretch: &Stretch| {
            let edge = &self.list.edges[stretch.edge as usize];
            let ends = edge.span(scene);
            let rate = match self.light {
                Light::Emitted | Light::Shadows => self.emission_rate(stretch, edge),
                Light::Rest | Light::Bounces if self.list.may_jump(scene, edge) => self.solid_angle(edge),
                Light::Rest | Light::Bounces => 0.0,
            };
            ends[0].distance(ends[1]) * stretch.part() * rate
        };
        let mut weights: Vec<f64> = self.stretches.par_iter().map(weigh).collect();
        self.limit_hidden(&mut weights);
        let edge = |i: usize| &self.list.edges[self.stretches[i].edge as usize];
        self.moving.limit_still(&mut weights, STILL, |i| self.moving.has_any(edge(i).shapes));
        Table::new(weights)
    }

    /// Scales the weights of stretches whose shadows are outside the film down to those of the others, if
    /// there are any; to 0 if light is reflected only once, so that they do not contribute.
    fn limit_hidden(&self, weights: &mut [f64]) {
        let sum = |shown: bool| -> f64 {
            self.stretches.iter().zip(&*weights).filter(|(s, _)| s.shown == shown).map(|(_, w)| w).sum()
        };
        let (shown, hidden) = (sum(true), sum(false));
        let factor = if self.longest == 1 { 0.0 } else { (shown / hidden).min(1.0) };
        if shown > 0.0 && factor < 1.0 {
            let all = self.stretches.iter().zip(weights);
            all.filter(|(stretch, _)| !stretch.shown).for_each(|(_, weight)| *weight *= factor);
        }
    }

    /// The emitters of a stretch's contact, if it is one.
    fn touched(&self, stretch: &Stretch) -> &[u32] {
        stretch.contact.map_or(&[], |contact| &self.contacts[contact as usize].shapes)
    }

    /// Directions in which an edge may be a silhouette.
    fn silhouette(&self, edge: &Edge) -> Option<Wedge> {
        self.wedge(edge).or_else(|| Wedge::whole(edge.span(self.sensor.paths.scene)))
    }

    /// Approximate solid angle of lights in front of which a stretch is a silhouette, or the frequency with
    /// which it is one if the solid angle is unknown; 0 only if it never is.
    fn emission_rate(&self, stretch: &Stretch, edge: &Edge) -> f64 {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let emits = |s: u32| scene.description.shapes[s as usize].radiance.is_some();
        if self.light == Light::Emitted && edge.shapes.into_iter().any(emits) || edge.is_crossing() {
            // Edges of emitters are sampled from the camera, and emission is continuous at other crossings.
            return 0.0;
        }
        if self.light == Light::Shadows && paths.lights.is_the_only(edge.shapes[0]) {
            return 0.0;
        }
        if self.list.is_flat(scene, edge) {
            return 0.0;
        }
        if stretch.of == Of::Contact {
            let Some(contact) = stretch.contact.map(|contact| &self.contacts[contact as usize]) else {
                return 0.0;
            };
            // Other edges are weighted by solid angle if it is known, otherwise by the frequency with which
            // they are silhouettes.
            let scale = if self.targets.is_some() { 0.5 } else { 0.25 * FRAC_1_PI * contact.brightness };
            return scale * contact.directions.whole();
        }
        let (ends, except) = (stretch.ends(edge.span(scene)), self.touched(stretch));
        if let Some(targets) = &self.targets {
            let wedge = self.silhouette(edge);
            return wedge.map_or(0.0, |wedge| targets.solid_angle(scene, &wedge, ends, except));
        }
        if except.iter().any(|&shape| paths.lights.is_the_only(shape)) {
            return 0.0;
        }
        let [a, b] = ends;
        let middle = a.midpoint(b);
        let mut count = 0;
        for i in 0..PILOTS {
            // Additive recurrence of the root of x⁴ = x + 1.
            let numbers = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|g| (0.5 + g * i as f64).fract());
            let Some(towards) = paths.lights.sample(scene, middle, numbers) else { continue };
            let normal = towards.sampled.direction.cross(b - a);
            let sides = self.list.occupied(scene, edge, normal);
            count += usize::from(sides[0] != sides[1]);
        }
        let rate = count as f64 / PILOTS as f64;
        if rate > 0.0 || self.may_be_silhouette(edge) { rate.max(LEAST) } else { 0.0 }
    }

    /// Whether an edge of two triangles may be a silhouette in front of a light: whether some light is not
    /// entirely on the same sides of both planes.
    fn may_be_silhouette(&self, edge: &Edge) -> bool {
        let scene = self.sensor.paths.scene;
        let Some(spheres) = self.sensor.paths.lights.spheres() else { return true };
        let Some([u, v]) = edge.limits else { return true };
        let [a, b] = edge.span(scene);
        let e = (b - a).normalize_or_zero();
        spheres.iter().any(|&(centre, radius)| {
            let [f, g] = [u, v].map(|u| u.cross(e).dot(centre - a));
            f.abs() <= radius || g.abs() <= radius || f * g < 0.0
        })
    }

    /// Approximate solid angle in which radiance is discontinuous at an edge, times the contrast.
    fn solid_angle(&self, edge: &Edge) -> f64 {
        if edge.is_crossing() && self.longest == 1 {
            // A constant environment is continuous.
            return 0.0;
        }
        let (anywhere, wedge) = (self.share_anywhere(edge), self.wedge(edge));
        let crease = if edge.jump { 1.0 } else { SMOOTH };
        match wedge {
            None => 4.0 * PI,
            Some(w) if anywhere == 0.0 => 4.0 * w.angle,
            Some(w) => 4.0 * w.angle + 4.0 * PI * crease * w.angle.clamp(LEAST, 1.0),
        }
    }

    /// Fraction of directions that are sampled from the whole sphere; the others are from the wedge.
    ///
    /// Emission and a constant environment are discontinuous only at silhouettes; reflected light is at all
    /// folds, of which a softened field leaves the silhouettes.
    fn share_anywhere(&self, edge: &Edge) -> f64 {
        match self.wedge(edge) {
            None => 1.0,
            Some(_) if self.longest > 1 && self.light == Light::Rest => 0.5,
            Some(_) => 0.0,
        }
    }

    /// Directions in which an edge of two triangles is a silhouette; `None` if every direction counts.
    fn wedge(&self, edge: &Edge) -> Option<Wedge> {
        // A fold through which another surface passes is a crossing as well.
        if self.light == Light::Bounces && edge.crossed {
            return None;
        }
        Wedge::of(self.sensor.paths.scene, self.list, edge)
    }

    /// Samples a direction from a point of a stretch towards the light.
    pub(super) fn draw(&self, stretch: &Stretch, point: DVec3, numbers: &mut Sequence) -> Option<Drawn<'_>> {
        let paths = self.sensor.paths;
        let edge = &self.list.edges[stretch.edge as usize];
        let (c, [a, b]) = (numbers.one(), numbers.pair());
        if self.light.is_emission() {
            return self.draw_towards(stretch, point, [c, a, b]);
        }
        let [p, q] = edge.span(paths.scene);
        let e = (q - p).normalize_or_zero();
        let z = 2.0 * a - 1.0;
        let radius = (1.0 - z * z).sqrt();
        let (wedge, anywhere) = (self.wedge(edge), self.share_anywhere(edge));
        let (s, t) = e.any_orthonormal_pair();
        let (u, v, turn) = match &wedge {
            // The remainder of the random number selects one of the two opposite parts.
            Some(w) if c >= anywhere => {
                let opposite = (c - anywhere) / (1.0 - anywhere) < 0.5;
                (w.u, w.up, w.angle * b + if opposite { PI } else { 0.0 })
            }
            _ => (s, t, TAU * b),
        };
        let (sin, cos) = turn.sin_cos();
        let direction = z * e + radius * (cos * u + sin * v);
        let in_wedge =
            wedge.as_ref().filter(|w| w.holds(direction)).map_or(0.0, |w| (1.0 - anywhere) / (4.0 * w.angle));
        Some(Drawn { direction, density: in_wedge + anywhere / (4.0 * PI), passing: Passing::Anything })
            .filter(|drawn| drawn.density > 0.0)
    }

    /// Samples a direction in which emission may pass.
    fn draw_towards(&self, stretch: &Stretch, point: DVec3, numbers: [f64; 3]) -> Option<Drawn<'_>> {
        let paths = self.sensor.paths;
        let edge = &self.list.edges[stretch.edge as usize];
        let ends = edge.span(paths.scene);
        if let (Of::Contact, Some(contact)) = (stretch.of, stretch.contact) {
            let contact = &self.contacts[contact as usize];
            let direction = contact.directions.sample((ends[1] - ends[0]).normalize_or_zero(), numbers);
            let density = contact.directions.whole().recip();
            return Some(Drawn { direction, density, passing: Passing::From(contact) });
        }
        let except = self.touched(stretch);
        if let Some(targets) = &self.targets {
            let wedge = self.silhouette(edge)?;
            let Aimed { direction, distance, density, surface, id } =
                targets.draw(paths.scene, &wedge, point, except, numbers)?;
            let aim = Aim { id, surface: Some(surface), distance };
            return Some(Drawn { direction, density, passing: Passing::Of(aim) });
        }
        let towards = paths.lights.sample(paths.scene, point, numbers)?;
        if matches!(towards.id, LightId::Shape(shape) if except.contains(&shape)) {
            return None;
        }
        let (direction, density) = (towards.sampled.direction, towards.sampled.density);
        let aim = Aim { id: towards.id, surface: None, distance: towards.distance };
        Some(Drawn { direction, density, passing: Passing::Of(aim) })
    }
}
