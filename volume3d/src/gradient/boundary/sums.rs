//! Sums of boundary terms, in forward and reverse mode.

use glam::DVec3;

use super::driver::{Boundary, Driver, Estimate};
use super::{Take, Term};
use crate::gradient::accumulator::Sums;
use crate::gradient::contribution::Contribution;
use crate::gradient::motion::Motion;
use crate::gradient::{ActiveParameters, GradientImage, Progress, Stopped};
use crate::scene::Scene;

/// Mean samples per pixel of each boundary, and their seed.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Effort<'l> {
    pub(in crate::gradient) primary: usize,
    pub(in crate::gradient) secondary: usize,
    pub(in crate::gradient) bounces: usize,
    pub(in crate::gradient) seed: u64,
    /// Control variate, for curves of which only one side counts.
    pub(in crate::gradient) levels: &'l [DVec3],
}

impl<'l> Effort<'l> {
    /// Samples per pixel of a term.
    fn of(&self, term: Term) -> usize {
        match term {
            Term::Primary => self.primary,
            Term::Secondary => self.secondary,
            Term::Bounce => self.bounces,
        }
    }

    pub(super) fn driver<'s>(&self, scene: &'s Scene, term: Term) -> Driver<'s>
    where
        'l: 's,
    {
        let (width, height) = scene.size();
        Driver::new(scene, self.seed, self.of(term).saturating_mul(width * height)).above(self.levels)
    }
}

/// Forward mode: an image, and its terms if separate, to which boundary terms are added.
pub(in crate::gradient) struct Images<'a> {
    pub(in crate::gradient) effort: Effort<'a>,
    pub(in crate::gradient) scene: &'a Scene,
    pub(in crate::gradient) motion: &'a Motion<'a>,
    pub(in crate::gradient) progress: &'a Progress,
    pub(in crate::gradient) image: &'a mut GradientImage,
}

impl Take for Images<'_> {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped> {
        if !boundary.is_empty() && self.effort.of(term) > 0 {
            let driver = self.effort.driver(self.scene, term);
            add(self.image, term, driver.forward(boundary, self.motion, self.progress)?);
        }
        Ok(())
    }
}

fn add(image: &mut GradientImage, which: Term, estimate: Estimate) {
    let kinds = &mut image.noise.kinds;
    let kind = match which {
        Term::Primary => &mut kinds.on_film,
        Term::Secondary => &mut kinds.before_lights,
        Term::Bounce => &mut kinds.before_all_else,
    };
    kind.count += 1;
    kind.work += estimate.work;
    let (terms, noise) = (image.terms.as_mut(), &mut image.noise);
    let (mut term, noise) = match which {
        Term::Primary => (terms.map(|t| &mut t.primary), &mut noise.film_curves),
        Term::Secondary => (terms.map(|t| &mut t.secondary), &mut noise.shading_curves),
        Term::Bounce => (terms.map(|t| &mut t.secondary), &mut noise.bounce_curves),
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

/// Reverse mode: sums to which transposed boundary terms are added.
pub(in crate::gradient) struct Gradients<'a> {
    pub(in crate::gradient) effort: Effort<'a>,
    pub(in crate::gradient) scene: &'a Scene,
    pub(in crate::gradient) adjoint: &'a [DVec3],
    pub(in crate::gradient) active: &'a ActiveParameters,
    pub(in crate::gradient) progress: &'a Progress,
    pub(in crate::gradient) sums: &'a mut Sums,
}

impl Take for Gradients<'_> {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped> {
        if boundary.is_empty() || self.effort.of(term) == 0 {
            return Ok(());
        }
        let driver = self.effort.driver(self.scene, term);
        driver.reverse(boundary, self.adjoint, self.active, self.progress, self.sums)
    }
}
