//! What the figure shows, in words and as data.

use flatland::transport::Terms;

use super::fans::{DrawnPath, RAYS, REACH};
use super::study::{
    CONSISTENT, Comparison, EDGES, Entry, FIXED, JUMPS, REACH as JUMP_REACH, STEP, Study, WARPED,
};
use crate::context::Context;
use crate::figures::common::largest;
use crate::gallery::{Placement, formula};
use crate::output::{Cell, Table, write_csv};
use crate::plot::number;
use crate::ratio::Ratio;

/// Standard errors on either side that a band shows.
pub(super) const BAND: f64 = 2.0;

/// The part of the largest derivative below which one is negligible.
const NEGLIGIBLE: f64 = 0.05;
/// So many rays of a direction are its heaviest.
const HEAVIEST: usize = RAYS / 4;

/// The formulas of the figure.
pub(super) fn formulas() -> String {
    formula(
        r"∂_θ I = ∫ [∂_θ f + ∇_u·(f V_0) + ∑_k ∇_{ω_k}·(f V_k)] \d u \d ω_1 \d ω_2 …, \quad V_0 ≈ \frac{∑_i w_i V_i}{∑_i w_i}, \quad V_k ≈ \frac{∑_i w_i (1 − B_i) V_i}{∑_i w_i}",
        Placement::Display,
    )
}

fn inline(source: &str) -> String {
    formula(source, Placement::Inline)
}

/// "0.99 ± 0.01", with as many digits as the error allows.
pub(super) fn measured([value, error]: [f64; 2]) -> String {
    Ratio { value, error }.shown().replace('-', "−")
}

fn percent(part: f64) -> String {
    format!("{} %", number(100.0 * part))
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

    /// The figure in a few paragraphs.
    pub(super) fn explanation(&self) -> String {
        [self.about_the_path(), self.about_the_terms(), self.about_the_methods()].concat()
    }

    fn about_the_path(&self) -> String {
        let heaviest = |i: usize| {
            let (share, farthest) = self.path.fans[i].heaviest(HEAVIEST);
            format!(
                "{} of the weight, and lie within {} kernel widths of a jump",
                percent(share),
                number(farthest)
            )
        };
        format!(
            "<p>So far light went straight from a drawing to the film. In this figure it is scattered on its way. A flat \
             world has everything that a path tracer in space has: a camera, surfaces, a light, \
             shadows, and light that is scattered more than once; only that a film is a line and directions \
             are a circle. A path is a chain of directions: from the camera to {x1} on the floor, from there to \
             the light (the <em>emitter ray</em>, dashed) and on to the wall (the <em>scattered ray</em>, drawn at random by how the surface scatters light), and again. \
             What is seen in each direction jumps at silhouettes, and silhouettes move. So each direction, and \
             the film sample itself, gets a warp of its own: {RAYS} auxiliary rays are drawn around it, and the \
             velocities of what they hit are averaged with the boundary-aware weight w = (D + B)<sup>−γ</sup>. At surfaces \
             the velocity {vi} of a hit is multiplied by 1 − {bi} first: B is 0 at a jump and 1 far from it, so that V fades \
             away where there is no jump to follow, and light that sees none is left alone. On the film V does not fade. Rays \
             spread over the <em>kernel width</em>, κ<sup>−½</sup>, in pixels on the film and in radians at surfaces. A ray is \
             drawn as thick and as red as its weight. Around the emitter ray at {x1}, the heaviest {HEAVIEST} rays hold {emitter}; around \
             the scattered ray, {scattered}. Rays beside silhouettes dominate, and so V takes on the silhouette’s velocity \
             where it must.</p>",
            x1 = inline("x_1"),
            emitter = heaviest(1),
            scattered = heaviest(2),
            vi = inline("V_i"),
            bi = inline("B_i"),
        )
    }

    fn about_the_terms(&self) -> String {
        let exact = &self.study.exact;
        let squares = |k: usize| exact.iter().map(|t| t.to_array()[k].powi(2)).sum::<f64>();
        let size = |k: usize| percent(squares(k) / (0..3).map(squares).sum::<f64>());
        format!(
            "<p>When the occluder swings to the right, three things happen. Its surface turns under the \
             light, so that the cosines change at fixed film coordinates and directions: the <em>interior</em> \
             term ({} of the sum of the three’s squares). Its outline moves over the film: the \
             <em>primary</em> term ({}), narrow peaks. And its \
             shadow, that of the light and the faint one of the sky, moves over what the camera sees: the \
             <em>secondary</em> term ({}), which a warp of the film alone would miss. That is what one bounce shows; with two, \
             the light that other things receive from the occluder and from its shadow changes as well.</p>",
            size(0),
            size(1),
            size(2),
        )
    }

    fn about_the_methods(&self) -> String {
        let line = |name: &str| {
            let c = self.compared(name);
            format!("{} with a noise of {}", measured(c.slope), percent(c.noise))
        };
        let worst = self.worst(WARPED);
        let twice = self.study.twice.each_ref().map(|e| {
            let c = Comparison::new(&e.image, &self.study.exact_twice);
            format!("{} with a noise of {}", measured(c.slope), percent(c.noise))
        });
        format!(
            "<p>Every method got {:.1} million rays. The slope is that of the regression of its curve on the \
             exact one: 1 for the right derivative. <em>Warped area</em> has slope \
             {}. Its number of auxiliary rays is random (the <em>multilevel</em> scheme of figures 5 and 10), which removes \
             the bias in the mean. It knows no edges: it only traces rays. With a fixed number of {FIXED} auxiliary rays instead it \
             has {}: the bias of a quotient of means is left in. The <em>mean over jumps</em> has {}: its V is an average \
             of the velocities of the silhouettes within {} kernel widths, by their inverse distance, so that V is exact, no \
             auxiliary ray is traced, and nothing is left to be debiased; all it needs is a list of vertices, of which it \
             need not know which are seen. The <em>harmonic field</em> ({}) and <em>edge \
             sampling</em> ({}) look every vertex up, which a flat world of {} vertices makes cheap. <em>Finite \
             differences</em> (central, step {STEP} rad) have slope {}; the same quotient of exact images has \
             slope {:.4}, which is the bias of the step alone. <em>Rotation</em>, the motion of one nearby hit for the \
             whole kernel, has {}; the <em>direct field</em>, which jumps at silhouettes, {}, and the \
             <em>interior</em> alone, {}.</p>\
             <p>Warped area’s noise has heavy tails in the penumbra, the half-shadow from which a part of the light is seen, where the occluder’s silhouette and the end \
             of the light are seen close to each other: V must fall from the velocity of one to that of the other \
             in between. Few samples carry much of it, so its standard errors are uncertain themselves and likely too small: its worst \
             pixel, number {}, is off by {:.1} of them.</p>\
             <p>Light that is scattered twice is exact by radiosity (to {} of the largest derivative). Warped \
             area has slope {} there, the mean over jumps {}, edge sampling {}.</p>",
            self.study.rays as f64 * 1e-6,
            line(WARPED),
            line(CONSISTENT),
            line(JUMPS),
            number(JUMP_REACH),
            line("harmonic field"),
            line(EDGES),
            self.vertices,
            line("finite differences"),
            self.study.exact_difference,
            line("rotation"),
            line("direct field"),
            line("interior only"),
            worst.0,
            worst.1,
            number(self.study.radiosity_error),
            twice[0],
            twice[1],
            twice[2],
        )
    }

    pub(super) fn world_caption(&self) -> String {
        let error = |i: usize| self.study.images[i].iter().map(|p| p[1]).fold(0.0, f64::max);
        format!(
            "(a) The directions of the path are chosen for the picture; the auxiliary rays are drawn and weighted \
             as by the estimator, but {RAYS} to every direction, and with angles for the distances to jumps, which \
             the estimator takes to first order. The strip under the floor is the direct light on it. \
             Around the film sample beside the occluder’s outline they lie so close together that they are \
             shown enlarged. (b) Standard errors are at most {}. (c) Bands show ±{BAND} standard errors of warped \
             area. (d) Of each direction in (a), the share of every auxiliary ray; the strip says what is seen, \
             up to {REACH} kernel widths to either side.",
            number(error(0).max(error(1))),
        )
    }

    pub(super) fn methods_caption(&self) -> String {
        let names: Vec<&str> = self.study.twice.iter().map(|e| e.looks.name).collect();
        format!(
            "Thin: exact. Coloured: the estimate, with ±{BAND} standard errors. Noise is the root mean square of the \
             standard errors, relative to that of the exact derivative. Last panel: slopes of {} for light that \
             is scattered up to twice; what lies beyond the frame is cut off.",
            names.join(", "),
        )
    }

    /// A row per method.
    pub(super) fn table(&self) -> Table {
        let mut table = Table::new(&[
            "bounces",
            "method",
            "slope on the exact derivative",
            "± standard error",
            "noise, relative",
            "error, relative",
            "rays a sample",
            "samples a pixel",
            "seconds",
        ]);
        let exact = self.study.total();
        let once = self.study.entries.iter().map(|e| (1_usize, e, &exact));
        let twice = self.study.twice.iter().map(|e| (2, e, &self.study.exact_twice));
        for (bounces, entry, exact) in once.chain(twice) {
            let c = Comparison::new(&entry.image, exact);
            let samples = entry.samples * exact.len();
            table.row([
                bounces.into(),
                entry.looks.name.into(),
                c.slope[0].into(),
                c.slope[1].into(),
                c.noise.into(),
                c.error.into(),
                (entry.image.rays as f64 / samples as f64).into(),
                entry.samples.into(),
                entry.seconds.into(),
            ]);
        }
        table
    }

    /// Writes all data and returns the names of the files.
    pub(super) fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        let files = [
            ("figure7_derivative.csv", self.derivatives()),
            ("figure7_image.csv", self.images()),
            ("figure7_two_bounces.csv", self.twice()),
            ("figure7_auxiliary_rays.csv", self.rays()),
            ("figure7_methods.csv", self.table()),
        ];
        for (file, table) in &files {
            write_csv(&context.path(file), table)?;
        }
        Ok(files.map(|(file, _)| file.to_owned()).to_vec())
    }

    fn derivatives(&self) -> Table {
        let mut table = Table::new(&[
            "method",
            "pixel",
            "interior",
            "primary",
            "secondary",
            "interior_error",
            "primary_error",
            "secondary_error",
            "total",
            "total_error",
        ]);
        let mut rows = |name: &str, means: &[Terms<f64>], errors: &[Terms<f64>], all: &[f64]| {
            for (i, ((mean, error), total)) in means.iter().zip(errors).zip(all).enumerate() {
                let mut row: Vec<Cell> = vec![name.into(), i.into()];
                row.extend(mean.to_array().into_iter().chain(error.to_array()).map(Cell::from));
                row.extend([mean.total().into(), (*total).into()]);
                table.row(row);
            }
        };
        let none = vec![Terms::default(); self.study.exact.len()];
        rows("exact", &self.study.exact, &none, &vec![0.0; none.len()]);
        for entry in &self.study.entries {
            let image = &entry.image;
            rows(entry.looks.name, &image.mean, &image.term_error, &image.standard_error);
        }
        table
    }

    fn twice(&self) -> Table {
        let columns =
            self.study.twice.iter().flat_map(|e| ["", "_error"].map(|end| format!("{}{end}", e.looks.name)));
        let columns: Vec<String> = ["pixel", "exact"].map(str::to_owned).into_iter().chain(columns).collect();
        let mut table = Table::new(&columns.iter().map(String::as_str).collect::<Vec<_>>());
        for (i, exact) in self.study.exact_twice.iter().enumerate() {
            let of = |e: &Entry| [e.image.mean[i].total(), e.image.standard_error[i]];
            let numbers = [*exact].into_iter().chain(self.study.twice.iter().flat_map(of));
            table.row(std::iter::once(i.into()).chain(numbers.map(Cell::from)));
        }
        table
    }

    fn images(&self) -> Table {
        let mut table = Table::new(&[
            "pixel",
            "one_bounce_exact",
            "one_bounce",
            "one_bounce_error",
            "two_bounces_exact",
            "two_bounces",
            "two_bounces_error",
        ]);
        for (i, exact) in self.study.exact_image.iter().enumerate() {
            let [one, two] = self.study.images.each_ref().map(|image| image[i]);
            let twice = self.study.exact_image_twice[i];
            let numbers = [*exact, one[0], one[1], twice, two[0], two[1]];
            table.row(std::iter::once(i.into()).chain(numbers.map(Cell::from)));
        }
        table
    }

    fn rays(&self) -> Table {
        let mut table = Table::new(&[
            "direction",
            "from_x",
            "from_y",
            "to_x",
            "to_y",
            "offset_in_kernel_widths",
            "share",
        ]);
        for (i, fan) in self.path.fans.iter().enumerate() {
            for ray in &fan.rays {
                let numbers = [fan.from.x, fan.from.y, ray.end.x, ray.end.y, ray.offset, ray.share];
                table.row(std::iter::once(i.into()).chain(numbers.map(Cell::from)));
            }
        }
        table
    }
}
