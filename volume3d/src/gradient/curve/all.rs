//! All curves of a scene: ∮ Δ[(f − L₀)(v − V)]·ν dl over every kind, in forward and reverse mode.

use std::sync::Arc;

use glam::DVec3;

use super::budget::{Budget, Group, Kind};
use super::drawing::EdgeList;
use super::driver::{Driver, Estimate};
use super::field::WarpField;
use super::film_edges::FilmEdges;
use super::film_sign_changes::FilmSignChanges;
use super::horizons::Horizons;
use super::indirect_edges::IndirectEdges;
use super::inner_sign_changes::InnerSignChanges;
use super::integral::Curve;
use super::moving::Moving;
use super::outlines::Outlines;
use super::reflected_outlines::ReflectedOutlines;
use super::shadow_edges::ShadowEdges;
use crate::gradient::modes::accumulator::Sums;
use crate::gradient::results::contribution::Contribution;
use crate::gradient::warp::motion::Motion;
use crate::gradient::{ActiveParameters, GradientImage, Progress, Stopped};
use crate::path::Paths;

/// All curves across which a field is not the velocity of the discontinuity, with their sample budget.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Curves<'a, V> {
    pub(in crate::gradient) paths: &'a Paths<'a>,
    pub(in crate::gradient) field: V,
    pub(in crate::gradient) budget: Budget<'a>,
}

/// Consumer of curves.
trait Sink {
    fn add(&mut self, kind: Kind, driver: &Driver<'_>, curve: &impl Curve) -> Result<(), Stopped>;
}

impl<V: WarpField> Curves<'_, V> {
    /// Adds their derivatives along a tangent to an image, and to its terms if they are separate.
    pub(in crate::gradient) fn forward(
        &self,
        motion: &Motion<'_>,
        progress: &Progress,
        image: &mut GradientImage,
    ) -> Result<(), Stopped> {
        let moving = Moving::of(self.paths.scene, motion);
        self.each(&moving, &mut Forward { motion, progress, image })
    }

    /// Transpose of [`forward`](Self::forward): adds the derivative of Σ adjoint · I by every active
    /// parameter. The two are transposes if the active shapes are those that move, which determine the
    /// curves that are sampled.
    pub(in crate::gradient) fn reverse(
        &self,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
        sums: &mut Sums,
    ) -> Result<(), Stopped> {
        self.each(&Moving::active(active), &mut Reverse { adjoint, active, progress, sums })
    }

    /// Hands over every kind of curve that has samples.
    fn each(&self, moving: &Moving, sink: &mut impl Sink) -> Result<(), Stopped> {
        if !moving.anything() {
            return Ok(());
        }
        let Self { paths, field, .. } = *self;
        let scene = paths.scene;
        let edges = [
            Kind::FilmEdges,
            Kind::ShadowEdges,
            Kind::IndirectEdges,
            Kind::Outlines,
            Kind::ReflectedOutlines,
        ];
        let has_edges = edges.into_iter().any(|kind| self.budget.of(kind) > 0);
        let list = if has_edges { scene.derived(EdgeList::new) } else { Arc::default() };
        let list = &*list;
        // What rests moves relative to a field, too.
        let everything = Moving::everything(scene);
        let across = if V::IS_ZERO { moving } else { &everything };
        self.kind(sink, Kind::FilmEdges, || FilmEdges::new(paths, list, moving, field))?;
        self.kind(sink, Kind::FilmSignChanges, || FilmSignChanges::new(paths, across, field))?;
        self.kind(sink, Kind::ShadowEdges, || ShadowEdges::new(paths, list, moving, field))?;
        self.kind(sink, Kind::IndirectEdges, || IndirectEdges::new(paths, list, moving, field))?;
        self.kind(sink, Kind::Outlines, || Outlines::new(paths, list, moving, field))?;
        self.kind(sink, Kind::ReflectedOutlines, || ReflectedOutlines::new(paths, list, moving))?;
        self.kind(sink, Kind::Horizons, || Horizons::new(paths, moving, field))?;
        self.kind(sink, Kind::InnerSignChanges, || InnerSignChanges::new(paths, across, field))
    }

    /// Hands over one kind of curve, if it has samples.
    fn kind<K: Curve>(
        &self,
        sink: &mut impl Sink,
        kind: Kind,
        curve: impl FnOnce() -> K,
    ) -> Result<(), Stopped> {
        let needs_normals = matches!(kind, Kind::FilmSignChanges | Kind::Horizons | Kind::InnerSignChanges);
        let scene = self.paths.scene;
        if self.budget.of(kind) == 0 || needs_normals && scene.normals.is_empty() {
            return Ok(());
        }
        let curve = curve();
        if curve.is_empty() { Ok(()) } else { sink.add(kind, &Driver::of(scene, &self.budget, kind), &curve) }
    }
}

struct Forward<'a> {
    motion: &'a Motion<'a>,
    progress: &'a Progress,
    image: &'a mut GradientImage,
}

impl Sink for Forward<'_> {
    fn add(&mut self, kind: Kind, driver: &Driver<'_>, curve: &impl Curve) -> Result<(), Stopped> {
        let estimate = driver.forward(curve, self.motion, self.progress)?;
        add(self.image, kind.group(), estimate);
        Ok(())
    }
}

fn add(image: &mut GradientImage, group: Group, estimate: Estimate) {
    let kinds = &mut image.noise.kinds;
    let kind = match group {
        Group::Film => &mut kinds.on_film,
        Group::Shading => &mut kinds.before_lights,
        Group::Bounces => &mut kinds.before_all_else,
    };
    kind.count += 1;
    kind.work += estimate.work;
    let (terms, noise) = (image.terms.as_mut(), &mut image.noise);
    let (mut term, noise) = match group {
        Group::Film => (terms.map(|t| &mut t.primary), &mut noise.film_curves),
        Group::Shading => (terms.map(|t| &mut t.secondary), &mut noise.shading_curves),
        Group::Bounces => (terms.map(|t| &mut t.secondary), &mut noise.bounce_curves),
    };
    for (i, (mean, variance)) in estimate.mean.iter().zip(&estimate.variance).enumerate() {
        if let Some(term) = &mut term {
            term.pixels[i] += *mean;
        }
        image.gradient.pixels[i] += *mean;
        noise.pixels[i] += *variance;
        let error = &mut image.standard_error.pixels[i];
        *error = (*error * *error + *variance).map(f64::sqrt);
    }
    image.regions.add(&estimate.regions);
    image.auxiliary_rays += estimate.rays;
    image.non_finite.extend(estimate.non_finite);
    Contribution::keep_larger(&mut image.largest, estimate.largest);
}

struct Reverse<'a> {
    adjoint: &'a [DVec3],
    active: &'a ActiveParameters,
    progress: &'a Progress,
    sums: &'a mut Sums,
}

impl Sink for Reverse<'_> {
    fn add(&mut self, _: Kind, driver: &Driver<'_>, curve: &impl Curve) -> Result<(), Stopped> {
        driver.reverse(curve, self.adjoint, self.active, self.progress, self.sums)
    }
}
