//! Edges in front of emitters, as seen from shading points: shadows (Theory 9).
//!
//! Directions through edge points are those of lights. At edges of an emitter its own light does not count:
//! that is an [outline](super::outlines). With V = 0 the outlines have all emission at edges of emitters, so
//! that only edges of other shapes are left.
//!
//! Towards lights V = 0 for meshes, and the whole motion of shadows is residual: that of an edge in front of
//! a light as seen from the shading point, which slides along its surface with the warps of the film and of
//! earlier directions. For implicit surfaces V is their contribution to the field, independent of mesh edges:
//! there it is continuous, as rays end at the light's plane whatever is in front of it, and the residual is
//! v − V.

mod beside;
mod stretches;
#[cfg(test)]
mod tests;

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use rayon::prelude::*;

pub(in crate::gradient) use self::beside::contacts_are_followed;
use self::beside::{Bodies, Contact};
use self::stretches::{Of, Shown, Stretch, stretches};
use super::address::{Address, SHADOW_EDGE};
use super::drawing::{Aimed, CameraSubpath, Edge, EdgeList, Table, Targets, Wedge};
use super::edge_lines::{EdgeLines, View};
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use super::seen_edge::LitEdge;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, LightId, Paths};
use crate::scene::{Hit, Surface};

/// Number of trial directions to lights by which the frequency of an edge being a silhouette is estimated.
const PILOTS: usize = 16;

/// Least weight of an edge that was a silhouette in none of the trials.
const LEAST: f64 = 0.05;

/// Edges in front of emitters.
#[derive(Debug)]
pub(super) struct ShadowEdges<'a, V> {
    field: V,
    lines: EdgeLines<'a>,
    targets: Option<Targets>,
    /// Stretches to choose from.
    stretches: Vec<Stretch>,
    contacts: Vec<Contact>,
    table: Table,
}

/// A direction through a point of an edge.
#[derive(Clone, Copy, Debug)]
struct Drawn<'c> {
    direction: DVec3,
    /// Density by solid angle.
    density: f64,
    passing: Passing<'c>,
}

/// The light whose end is sought along a direction.
#[derive(Clone, Copy, Debug)]
enum Passing<'c> {
    /// Light of one emitter.
    Of(Aim),
    /// Light of the emitters in contact with the edge.
    From(&'c Contact),
}

/// The light that a direction was sampled for, and the only surface of it that counts, if it has one.
#[derive(Clone, Copy, Debug)]
struct Aim {
    id: LightId,
    surface: Option<Surface>,
    distance: f64,
}

impl<'a, V: WarpField> ShadowEdges<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &'a Moving, field: V) -> Self {
        let (lines, targets) = (EdgeLines::new(paths, list, moving), Targets::new(paths));
        let mut shadows =
            Self { field, lines, targets, stretches: vec![], contacts: vec![], table: Table::default() };
        if shadows.lines.longest > 0 {
            shadows.cut(Shown::new(&shadows.lines.sensor).as_ref());
        }
        shadows
    }

    /// Cuts all edges into stretches and computes their weights.
    fn cut(&mut self, shown: Option<&Shown>) {
        let EdgeLines { sensor, list, .. } = &self.lines;
        let bodies = Bodies::new(sensor.paths, self.targets.as_ref());
        (self.stretches, self.contacts) = stretches(list, sensor, shown, &bodies);
        self.table = self.weights();
    }

    fn weights(&self) -> Table {
        let EdgeLines { sensor, list, moving, .. } = &self.lines;
        let weigh = |stretch: &Stretch| {
            let edge = &list.edges[stretch.edge as usize];
            let ends = edge.span(sensor.paths.scene);
            ends[0].distance(ends[1]) * stretch.part() * self.emission_rate(stretch, edge)
        };
        let mut weights: Vec<f64> = self.stretches.par_iter().map(weigh).collect();
        self.limit_hidden(&mut weights);
        let edge = |i: usize| &list.edges[self.stretches[i].edge as usize];
        moving.limit_still(&mut weights, |i| moving.has_any(edge(i).shapes));
        Table::new(weights)
    }

    /// Scales the weights of stretches whose shadows are outside the film down to those of the others, if
    /// there are any; to 0 if light is reflected only once, so that they do not contribute.
    fn limit_hidden(&self, weights: &mut [f64]) {
        let sum = |shown: bool| -> f64 {
            self.stretches.iter().zip(&*weights).filter(|(s, _)| s.shown == shown).map(|(_, w)| w).sum()
        };
        let (shown, hidden) = (sum(true), sum(false));
        let factor = if self.lines.longest == 1 { 0.0 } else { (shown / hidden).min(1.0) };
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
    fn wedge(&self, edge: &Edge) -> Option<Wedge> {
        let scene = self.lines.sensor.paths.scene;
        Wedge::of(scene, self.lines.list, edge).or_else(|| Wedge::whole(edge.span(scene)))
    }

    /// Approximate solid angle of lights in front of which a stretch is a silhouette, or the frequency with
    /// which it is one if the solid angle is unknown; 0 only if it never is.
    fn emission_rate(&self, stretch: &Stretch, edge: &Edge) -> f64 {
        let paths = self.lines.sensor.paths;
        let scene = paths.scene;
        let emits = |s: u32| scene.description.shapes[s as usize].radiance.is_some();
        if edge.is_crossing() {
            return 0.0;
        }
        let is_outline = if V::IS_ZERO {
            edge.shapes.into_iter().any(emits)
        } else {
            paths.lights.is_the_only(edge.shapes[0])
        };
        if is_outline {
            return 0.0;
        }
        if self.lines.list.is_flat(scene, edge) {
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
            let wedge = self.wedge(edge);
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
            let sides = self.lines.list.occupied(scene, edge, normal);
            count += usize::from(sides[0] != sides[1]);
        }
        let rate = count as f64 / PILOTS as f64;
        if rate > 0.0 || self.may_be_silhouette(edge) { rate.max(LEAST) } else { 0.0 }
    }

    /// Whether an edge of two triangles may be a silhouette in front of a light: whether some light is not
    /// entirely on the same sides of both planes.
    fn may_be_silhouette(&self, edge: &Edge) -> bool {
        let (scene, lights) = (self.lines.sensor.paths.scene, &self.lines.sensor.paths.lights);
        let Some(spheres) = lights.spheres() else { return true };
        let Some([u, v]) = edge.limits else { return true };
        let [a, b] = edge.span(scene);
        let e = (b - a).normalize_or_zero();
        spheres.iter().any(|&(centre, radius)| {
            let [f, g] = [u, v].map(|u| u.cross(e).dot(centre - a));
            f.abs() <= radius || g.abs() <= radius || f * g < 0.0
        })
    }

    /// Samples a direction in which emission may pass.
    fn direction(&self, stretch: &Stretch, point: DVec3, numbers: [f64; 3]) -> Option<Drawn<'_>> {
        let paths = self.lines.sensor.paths;
        let edge = &self.lines.list.edges[stretch.edge as usize];
        let ends = edge.span(paths.scene);
        if let (Of::Contact, Some(contact)) = (stretch.of, stretch.contact) {
            let contact = &self.contacts[contact as usize];
            let direction = contact.directions.sample((ends[1] - ends[0]).normalize_or_zero(), numbers);
            let density = contact.directions.whole().recip();
            return Some(Drawn { direction, density, passing: Passing::From(contact) });
        }
        let except = self.touched(stretch);
        if let Some(targets) = &self.targets {
            let wedge = self.wedge(edge)?;
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

    /// Whether a light ends at an edge that is not its own.
    fn is_shadow(edge: &Edge, passing: Passing<'_>) -> bool {
        match passing {
            Passing::Of(Aim { id: LightId::Shape(shape), .. }) => V::IS_ZERO || !edge.shapes.contains(&shape),
            _ => true,
        }
    }

    /// Calls back with the lights that end at an edge, and their difference of radiance on its sides.
    fn each_light(&self, view: &View, passing: Passing<'_>, mut found: impl FnMut(LightId, [DVec3; 2])) {
        let (paths, hits) = (self.lines.sensor.paths, view.sides.hits);
        let shape = |hit: &Hit| paths.scene.shape_of(hit.surface);
        match passing {
            Passing::Of(aim) => {
                let its = |hit: &Hit| aim.surface.is_none_or(|s| s == hit.surface);
                let light = |side: usize| paths.lit(aim.id, hits[side].filter(its), view.directions[side]);
                found(aim.id, [light(0), light(1)]);
            }
            Passing::From(contact) => {
                let emits =
                    |hit: Hit| paths.scene.description.shapes[shape(&hit) as usize].radiance.is_some();
                // If an emitter's own edge coincides with this one, it has the whole discontinuity.
                if view.sides.other.and_then(|side| hits[side]).is_some_and(emits) {
                    return;
                }
                // One light at a time: each has its own field.
                for &of in &contact.shapes {
                    let light = |side: usize| match hits[side] {
                        Some(hit) if shape(&hit) == of => paths.lit_by_all(Some(hit), view.directions[side]),
                        _ => DVec3::ZERO,
                    };
                    found(LightId::Shape(of), [light(0), light(1)]);
                }
            }
        }
    }
}

impl<V: WarpField> Curve for ShadowEdges<'_, V> {
    type Field = V;
    type Point = LitEdge;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Every camera path that sees emission end at one point of an edge.
    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &LitEdge)) {
        let scene = self.lines.sensor.paths.scene;
        let mut numbers = address.numbers(SHADOW_EDGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let stretch = &self.stretches[chosen.index];
        let edge = &self.lines.list.edges[stretch.edge as usize];
        let [a, b] = edge.span(scene);
        let along = stretch.place(chosen.rest);
        let (c, [s, t]) = (numbers.one(), numbers.pair());
        let Some(drawn) = self.direction(stretch, a.lerp(b, along), [c, s, t]) else { return };
        let line = self.lines.line(edge, along, drawn.direction);
        if !Self::is_shadow(edge, drawn.passing) || !self.lines.ends_surface(&line) {
            return;
        }
        if let Passing::Of(aim) = drawn.passing
            && scene.blocked(line.point, line.direction, line.near, aim.distance)
        {
            return;
        }
        let scale = stretch.part() * a.distance(b) / (chosen.probability * drawn.density);
        self.lines.trace::<V>(&line, address, |path, view| {
            let factor = path.weight * scale * view.sides.share;
            self.each_light(view, drawn.passing, |emitter, [before, behind]| {
                if before != behind {
                    let light = before * factor - behind * factor;
                    found(path, &LitEdge { edge: view.edge, emitter, light });
                }
            });
        });
    }

    fn difference(&self, _: &CameraSubpath<'_>, point: &LitEdge) -> Difference {
        Difference::of(point.light)
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        point: &LitEdge,
    ) -> C::Number {
        point.speed::<V, C>(self.lines.sensor.paths, calculus, frame, path)
    }
}
