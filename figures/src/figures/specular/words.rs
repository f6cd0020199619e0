//! What figure 8 says, with its numbers.

use super::scene::Lighting;
use super::study::{Place, REACH, Racer, Run, WIDTH_OF_PARTS};
use crate::figures::common::{KNOWN, SETTLED};
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::Table;
use crate::plot::number;

pub(super) const VARIANCE: &str = "figure8_specular.png";
pub(super) const TIME: &str = "figure8_time.png";
pub(super) const VARIANCE_DATA: &str = "figure8_specular.csv";
pub(super) const TIME_DATA: &str = "figure8_time.csv";

/// Under the picture of variances.
pub(super) fn variance_caption() -> String {
    format!(
        "(a) Orange-red arrows: how the object moves. Dashed: the edges of the camera’s view, mirrored. Lobes are \
         drawn as the root of their density over its maximum. (c)–(e) The variance of one sample, summed over pixels, over \
         the sum of squares of the exact derivative. Bars: standard errors from independent runs. Rings: the run was too \
         short to know its variance, which is then likely too low: its standard error is above {KNOWN} of it, or the mean \
         of an unbiased method is more than {SETTLED} standard errors from the exact answer, which is used here to \
         reject runs."
    )
}
pub(super) const TIME_CAPTION: &str = "Variance × time is the time that a given precision takes. Times are the fastest \
    of a few runs on one thread, and vary from run to run; all else in this section does not. Dark object, bright sky \
    throughout.";

/// Everything measured.
pub(super) struct Results {
    pub(super) widths: Vec<Place>,
    pub(super) vertices: Vec<Place>,
}

fn times(value: f64) -> String {
    format!("{} times", number(value))
}

fn name(racer: Racer) -> String {
    racer.name()
}

/// The unbiased method with the least of something, where it is known.
fn best(place: &Place, value: impl Fn(&Run) -> f64) -> Option<Racer> {
    let able = Racer::ALL.into_iter().zip(&place.runs).filter(|(r, run)| r.is_unbiased() && run.is_known());
    able.min_by(|a, b| value(a.1).total_cmp(&value(b.1))).map(|(racer, _)| racer)
}

/// "edge sampling, importance at 6, warped area, unbiased at 1": how often each wins.
fn winners<'a>(places: impl Iterator<Item = &'a Place> + Clone, value: fn(&Run) -> f64) -> String {
    let won = |racer: Racer| places.clone().filter(|p| best(p, value) == Some(racer)).count();
    let list = Racer::ALL.into_iter().map(|racer| (racer, won(racer))).filter(|(_, count)| *count > 0);
    list.map(|(racer, count)| format!("{} at {count}", name(racer))).collect::<Vec<_>>().join("; ")
}

impl Results {
    pub(super) fn section(&self) -> Section {
        let picture = |file: &str, alt: &str| Picture {
            file: file.to_owned(),
            alt: alt.to_owned(),
            caption: String::new(),
        };
        Section {
            id: "specular".to_owned(),
            title: "A near-specular lobe".to_owned(),
            explanation_html: [self.about_lobes(), self.about_vertices(), self.about_checks()].concat(),
            formula_mathml: formula(
                r"g_w(α) = \frac{\sinh w}{2π (\cosh w − \cos α)}, \quad ∂_θ L = ∑_{edges} g_w(α_e) \cos φ_e ΔL \frac{τ·(v − x)}{r} = ∫ ∇·(V g_w L \cos φ) \d φ",
                Placement::Display,
            ),
            pictures: vec![
                picture(
                    VARIANCE,
                    "The set-up, exact derivatives, and variance against lobe width and vertices.",
                ),
                picture(TIME, "Time of a sample, and time for a given precision."),
            ],
            data: vec![VARIANCE_DATA.to_owned(), TIME_DATA.to_owned()],
            table: Some(self.table()),
        }
    }

    fn lit(&self, lighting: Lighting) -> impl Iterator<Item = &Place> + Clone {
        self.widths.iter().filter(move |p| p.lighting == lighting)
    }

    fn about_lobes(&self) -> String {
        let growth = |lighting: Lighting, racer: Racer| {
            let known: Vec<(f64, f64)> = self
                .lit(lighting)
                .filter(|p| p.runs[racer as usize].is_known())
                .map(|p| (p.width, p.runs[racer as usize].variance.value))
                .collect();
            let least = known.iter().min_by(|a, b| a.1.total_cmp(&b.1));
            least.zip(known.last()).map_or_else(
                || "is not known".to_owned(),
                |(least, last)| {
                    let [at, narrowest] = [least.0, last.0].map(number);
                    if at == narrowest {
                        let least = number(least.1);
                        return format!(
                            "falls to {least} at w = {at}; for narrower lobes this run cannot tell"
                        );
                    }
                    format!(
                        "is least, {}, at w = {at} and {} at w = {narrowest}",
                        number(least.1),
                        number(last.1)
                    )
                },
            )
        };
        let [sky, object] = Lighting::ALL;
        format!(
            "<p>Every surface of figure 7 is matt: it scatters light in all directions. Here one shines, and the \
             direction in which light goes on is nearly known. A camera sees a hexagon only by its reflection in a glossy floor, whose lobe has the half width w. \
             The hexagon moves and turns; no other thing moves. Once it is dark before a bright sky, once luminous \
             in the dark. Both derivatives are the same but for their sign; what differs is how paths are drawn. \
             Only in the second case is there an emitter to sample.</p>\
             <p>A narrow lobe is hard for everyone. The value of the lobe at an edge is either nearly 0 or of the \
             order 1/w, so that <em>edge sampling</em> has a variance of the order 1/w. Its choice by importance looks at \
             the lobe first: its variance {edges}. <em>Warped area</em> follows the lobe, but multiplies by its \
             slope, g′/g, which is of the order 1/w wherever V is not 0. V is 0 where no edge is near the lobe: \
             velocities are made to fade away from edges. The <em>harmonic field</em> is not, and its variance \
             {harmonic}. Before the sky, where only light close to the \
             silhouette counts, warped area’s variance {warped}. With the luminous object, where all of the object’s light \
             counts, it {luminous}. The <em>mean over jumps</em> fades by itself: its V is an average of the velocities of the \
             silhouettes within {REACH} kernel widths of the direction, by their inverse distance, and 0 where there is none. \
             It is exact, traces no auxiliary ray and leaves nothing to be debiased; it needs a list of vertices. Before the \
             sky its variance {jumps}. The unbiased method with the least variance × rays, of {count} widths: before the \
             sky {win_sky}; with the luminous object {win_object}.</p>",
            edges = growth(sky, Racer::Importance),
            harmonic = growth(sky, Racer::Harmonic),
            jumps = growth(sky, Racer::JumpMean),
            warped = growth(sky, Racer::Multilevel),
            luminous = growth(object, Racer::Multilevel),
            count = self.lit(sky).count(),
            win_sky = winners(self.lit(sky), Run::rays_cost),
            win_object = winners(self.lit(object), Run::rays_cost),
        )
    }

    fn about_vertices(&self) -> String {
        let (Some(first), Some(last)) = (self.vertices.first(), self.vertices.last()) else {
            return String::new();
        };
        let ratio = |racer: Racer, value: fn(&Run) -> f64| {
            times(value(&last.runs[racer as usize]) / value(&first.runs[racer as usize]))
        };
        let seconds = |run: &Run| run.seconds;
        let overtaken = |value: fn(&Run) -> f64| {
            let edges = [Racer::Uniform, Racer::Importance];
            let ahead = self.vertices.iter().find(|p| best(p, value).is_some_and(|r| !edges.contains(&r)));
            ahead.map_or_else(|| "nowhere".to_owned(), |p| format!("from {} vertices on", p.vertices))
        };
        let known = |racer: Racer| {
            let last = self.vertices.iter().rfind(|p| p.runs[racer as usize].is_known());
            last.map_or(0, |p| p.vertices)
        };
        format!(
            "<p>Then the sides of the hexagon are cut into more and more segments, at w = {width}. Image and \
             derivative stay exactly the same: all new vertices lie between segments alike, and the two silhouettes \
             are two vertices as before. Edge sampling does not know which. Its variance grows in proportion to the \
             vertices it chooses from, and to find importances it looks at every vertex. From {few} to {many} vertices a \
             sample takes {t_importance} as long by importance, {t_uniform} uniformly, {t_jumps} for the mean over jumps, \
             which takes a look at every vertex, {t_harmonic} for the harmonic \
             field, which looks for all jumps, and {t_warped} for warped area, which finds what its rays find. In this \
             run the variance of edge sampling by importance can be told up to {known} vertices, and uniformly up to \
             {known_uniform}: beyond, its samples find too few silhouettes, and it is counted \
             as behind. In variance × rays an unbiased method other than edge sampling is ahead {rays}, in variance × \
             time {time}. A hierarchy over edges with a test for silhouettes would help edge sampling; warped area has no \
             need of one.</p>",
            width = number(WIDTH_OF_PARTS),
            few = first.vertices,
            many = last.vertices,
            t_importance = ratio(Racer::Importance, seconds),
            t_uniform = ratio(Racer::Uniform, seconds),
            t_jumps = ratio(Racer::JumpMean, seconds),
            t_harmonic = ratio(Racer::Harmonic, seconds),
            t_warped = ratio(Racer::Multilevel, seconds),
            known = known(Racer::Importance),
            known_uniform = known(Racer::Uniform),
            rays = overtaken(Run::rays_cost),
            time = overtaken(Run::time_cost),
        )
    }

    fn about_checks(&self) -> String {
        let places = || self.widths.iter().chain(&self.vertices);
        let words = Racer::ALL.into_iter().filter_map(|racer| {
            let runs = || places().map(|p| &p.runs[racer as usize]).filter(|run| run.recovered.error > 0.0);
            let far = |run: &Run| run.deviation().abs();
            let worst = runs().filter(|run| run.is_known()).max_by(|a, b| far(a).total_cmp(&far(b)))?;
            let lost = runs().filter(|run| !run.is_settled()).count();
            let lost = if lost > 0 { format!(", and {lost} too far off") } else { String::new() };
            let (recovered, z) = (worst.recovered.shown(), worst.deviation());
            Some(format!("{}: {recovered} (z = {z:.1}{lost})", name(racer)))
        });
        format!(
            "<p>Every mean was projected on the exact derivative, of which it should recover 1. The worst of the {} \
             places, as far as the variance is known: {}. The few runs behind each standard error make large z likelier \
             than for a normal distribution. “{}” is biased and says so. With narrow lobes the unbiased warped \
             area has rare large samples. A short run misses them, recovers too little, and shows too small a variance and \
             too small an error: such runs, more than {SETTLED} standard errors off, are counted as too far off and not \
             used in any comparison. So the exact answer is used to reject runs, which no user without one could do; with \
             so few runs behind an error about one healthy run in 25 is rejected as well, and a run that passes may still \
             have missed the rarest samples: what is shown of unbiased warped area is at least its variance (figure 10).</p>",
            places().count(),
            words.collect::<Vec<_>>().join("; ").replace('-', "−"),
            name(Racer::Consistent),
        )
    }

    /// Everything that no clock decides.
    pub(super) fn table(&self) -> Table {
        let mut table = Table::new(&[
            "lighting",
            "lobe width",
            "vertices",
            "method",
            "samples a pixel",
            "variance",
            "its standard error",
            "rays a sample",
            "variance × rays",
            "recovered",
            "its standard error",
        ]);
        for (place, racer, run) in self.all() {
            table.row([
                place.lighting.name().into(),
                place.width.into(),
                place.vertices.into(),
                name(racer).into(),
                run.samples.into(),
                run.variance.value.into(),
                run.variance.error.into(),
                run.rays.into(),
                run.rays_cost().into(),
                run.recovered.value.into(),
                run.recovered.error.into(),
            ]);
        }
        table
    }

    /// What the clock said.
    pub(super) fn times(&self) -> Table {
        let header =
            ["lighting", "lobe width", "vertices", "method", "seconds a sample", "variance × seconds"];
        let mut table = Table::new(&header);
        for (place, racer, run) in self.all() {
            table.row([
                place.lighting.name().into(),
                place.width.into(),
                place.vertices.into(),
                name(racer).into(),
                run.seconds.into(),
                run.time_cost().into(),
            ]);
        }
        table
    }

    fn all(&self) -> impl Iterator<Item = (&Place, Racer, &Run)> {
        let places = self.widths.iter().chain(&self.vertices);
        places.flat_map(|p| Racer::ALL.into_iter().zip(&p.runs).map(move |(racer, run)| (p, racer, run)))
    }
}
