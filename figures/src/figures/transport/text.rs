//! The numbers of `transport.md`, and the data.

use flatland::transport::Terms;

use super::fans::{DrawnPath, RAYS, REACH};
use super::study::{
    CONSISTENT, Comparison, EDGES, Entry, FIXED, JUMPS, REACH as JUMP_REACH, STEP, Study, WARPED,
};
use crate::context::Context;
use crate::figures::common::{largest, percent};
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;

/// Standard errors on either side that a band shows.
pub(super) const BAND: f64 = 2.0;

/// The part of the largest derivative below which one is negligible.
const NEGLIGIBLE: f64 = 0.05;
/// So many rays of a direction are its heaviest.
const HEAVIEST: usize = RAYS / 4;

/// "0.99 ± 0.01", with as many digits as the error allows.
pub(super) fn measured([value, error]: [f64; 2]) -> String {
    Ratio { value, error }.shown()
}

/// Everything the words follow from.
pub(super) struct Results<'a> {
    pub(super) study: &'a Study,
    pub(super) path: &'a DrawnPath,
    /// Of the world.
    pub(super) vertices: usize,
}

impl Results<'_> {
    fn compared(&self, name: &str) -> Comparison {
        let exact = self.study.total();
        let entry = self.study.entry(name);
        entry.map_or(Comparison::NONE, |e| Comparison::new(&e.image, &exact))
    }

    /// The pixel of the largest error in its own standard errors, and that ratio, where the derivative is not negligible.
    fn worst(&self, name: &str) -> (usize, f64) {
        let exact = self.study.total();
        let least = NEGLIGIBLE * largest(&exact);
        let Some(entry) = self.study.entry(name) else { return (0, f64::NAN) };
        let ratio =
            |(i, e): (usize, &f64)| (entry.image.mean[i].total() - e).abs() / entry.image.standard_error[i];
        let ratios = exact.iter().enumerate().filter(|(_, e)| e.abs() > least).map(|x| (x.0, ratio(x)));
        ratios.fold((0, 0.0), |worst, one| if one.1 > worst.1 { one } else { worst })
    }

    /// The text on the path, the terms and the methods.
    pub(super) fn prose(&self) -> anyhow::Result<Prose> {
        let Study { exact, images, twice, .. } = self.study;
        let squares = |k: usize| exact.iter().map(|t| t.to_array()[k].powi(2)).sum::<f64>();
        let size = |k: usize| percent(squares(k) / (0..3).map(squares).sum::<f64>());
        let shown = |c: Comparison| format!("{} with a noise of {}", measured(c.slope), percent(c.noise));
        let slope = |name: &str| shown(self.compared(name));
        let twice_slope = |e: &Entry| shown(Comparison::new(&e.image, &self.study.exact_twice));
        let [emitter, scattered] = [1, 2].map(|i| self.path.fans[i].heaviest(HEAVIEST));
        let (worst_pixel, worst_ratio) = self.worst(WARPED);
        let image_error = images.iter().flatten().map(|p| p[1]).fold(0.0, f64::max);
        Prose::new(
            include_str!("transport.md"),
            &[
                ("rays", &RAYS),
                ("heaviest", &HEAVIEST),
                ("emitter_share", &percent(emitter.0)),
                ("emitter_reach", &number(emitter.1)),
                ("scattered_share", &percent(scattered.0)),
                ("scattered_reach", &number(scattered.1)),
                ("interior", &size(0)),
                ("primary", &size(1)),
                ("secondary", &size(2)),
                ("million_rays", &format!("{:.1}", self.study.rays as f64 * 1e-6)),
                ("warped", &slope(WARPED)),
                ("fixed", &FIXED),
                ("consistent", &slope(CONSISTENT)),
                ("jumps", &slope(JUMPS)),
                ("jump_reach", &number(JUMP_REACH)),
                ("harmonic", &slope("harmonic field")),
                ("edges", &slope(EDGES)),
                ("vertices", &self.vertices),
                ("step", &STEP),
                ("differences", &slope("finite differences")),
                ("exact_difference", &format!("{:.4}", self.study.exact_difference)),
                ("rotation", &slope("rotation")),
                ("direct", &slope("direct field")),
                ("interior_only", &slope("interior only")),
                ("worst_pixel", &worst_pixel),
                ("worst_ratio", &format!("{worst_ratio:.1}")),
                ("radiosity_error", &number(self.study.radiosity_error)),
                ("twice_warped", &twice_slope(&twice[0])),
                ("twice_jumps", &twice_slope(&twice[1])),
                ("twice_edges", &twice_slope(&twice[2])),
                ("image_error", &number(image_error)),
                ("band", &BAND),
                ("reach", &REACH),
                ("twice_names", &twice.each_ref().map(|e| e.looks.name).join(", ")),
            ],
        )
    }

    /// A row per method.
    pub(super) fn table(&self) -> Table {
        let pixels = self.study.exact.len();
        let compared =
            |bounces: usize, e: &'_ Entry, exact: &[f64]| (bounces, Comparison::new(&e.image, exact));
        let exact = self.study.total();
        let once = self.study.entries.iter().map(|e| (e, compared(1, e, &exact)));
        let twice = self.study.twice.iter().map(|e| (e, compared(2, e, &self.study.exact_twice)));
        Table::of(
            once.chain(twice),
            &[
                ("bounces", &|(_, (bounces, _))| (*bounces).into()),
                ("method", &|(e, _)| e.looks.name.into()),
                ("slope on the exact derivative", &|(_, (_, c))| c.slope[0].into()),
                ("± standard error", &|(_, (_, c))| c.slope[1].into()),
                ("noise, relative", &|(_, (_, c))| c.noise.into()),
                ("error, relative", &|(_, (_, c))| c.error.into()),
                ("rays a sample", &|(e, _)| (e.image.rays as f64 / (e.samples * pixels) as f64).into()),
                ("samples a pixel", &|(e, _)| e.samples.into()),
                ("seconds", &|(e, _)| e.seconds.into()),
            ],
        )
    }

    /// Writes all data and returns the names of the files.
    pub(super) fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        Ok(vec![
            context.csv("figure7_derivative.csv", &self.derivatives())?,
            context.csv("figure7_image.csv", &self.images())?,
            context.csv("figure7_two_bounces.csv", &self.twice())?,
            context.csv("figure7_auxiliary_rays.csv", &self.rays())?,
            context.csv("figure7_methods.csv", &self.table())?,
        ])
    }

    fn derivatives(&self) -> Table {
        let pixels = 0..self.study.exact.len();
        let exact = pixels.clone().map(|i| ("exact", i, self.study.exact[i], Terms::default(), 0.0));
        let estimates = self.study.entries.iter().flat_map(|entry| {
            let image = &entry.image;
            let row =
                move |i| (entry.looks.name, i, image.mean[i], image.term_error[i], image.standard_error[i]);
            pixels.clone().map(row)
        });
        Table::of(
            exact.chain(estimates),
            &[
                ("method", &|(name, ..)| (*name).into()),
                ("pixel", &|(_, i, ..)| (*i).into()),
                ("interior", &|(_, _, mean, ..)| mean.interior.into()),
                ("primary", &|(_, _, mean, ..)| mean.primary.into()),
                ("secondary", &|(_, _, mean, ..)| mean.secondary.into()),
                ("interior_error", &|(.., error, _)| error.interior.into()),
                ("primary_error", &|(.., error, _)| error.primary.into()),
                ("secondary_error", &|(.., error, _)| error.secondary.into()),
                ("total", &|(_, _, mean, ..)| mean.total().into()),
                ("total_error", &|(.., error)| (*error).into()),
            ],
        )
    }

    fn twice(&self) -> Table {
        let [a, b, c] = &self.study.twice;
        let errors = [a, b, c].map(|e| format!("{}_error", e.looks.name));
        Table::of(
            0..self.study.exact_twice.len(),
            &[
                ("pixel", &|i| (*i).into()),
                ("exact", &|i| self.study.exact_twice[*i].into()),
                (a.looks.name, &|i| a.image.mean[*i].total().into()),
                (&errors[0], &|i| a.image.standard_error[*i].into()),
                (b.looks.name, &|i| b.image.mean[*i].total().into()),
                (&errors[1], &|i| b.image.standard_error[*i].into()),
                (c.looks.name, &|i| c.image.mean[*i].total().into()),
                (&errors[2], &|i| c.image.standard_error[*i].into()),
            ],
        )
    }

    fn images(&self) -> Table {
        let [one, two] = &self.study.images;
        Table::of(
            0..self.study.exact_image.len(),
            &[
                ("pixel", &|i| (*i).into()),
                ("one_bounce_exact", &|i| self.study.exact_image[*i].into()),
                ("one_bounce", &|i| one[*i][0].into()),
                ("one_bounce_error", &|i| one[*i][1].into()),
                ("two_bounces_exact", &|i| self.study.exact_image_twice[*i].into()),
                ("two_bounces", &|i| two[*i][0].into()),
                ("two_bounces_error", &|i| two[*i][1].into()),
            ],
        )
    }

    fn rays(&self) -> Table {
        let fans = self.path.fans.iter().enumerate();
        Table::of(
            fans.flat_map(|(i, fan)| fan.rays.iter().map(move |ray| (i, fan, ray))),
            &[
                ("direction", &|(i, ..)| (*i).into()),
                ("from_x", &|(_, fan, _)| fan.from.x.into()),
                ("from_y", &|(_, fan, _)| fan.from.y.into()),
                ("to_x", &|(.., ray)| ray.end.x.into()),
                ("to_y", &|(.., ray)| ray.end.y.into()),
                ("offset_in_kernel_widths", &|(.., ray)| ray.offset.into()),
                ("share", &|(.., ray)| ray.share.into()),
            ],
        )
    }
}
