//! A near-specular lobe: edge sampling and warped area on an object seen by reflection.

mod picture;
mod scene;
mod study;

use self::scene::Lighting;
use self::study::{Place, REACH, Racer, Run, WIDTH_OF_PARTS};
use crate::context::Context;
use crate::figures::common::{KNOWN, SETTLED, listed};
use crate::gallery::Section;
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::prose::Prose;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    context.step("the lobe narrows");
    let widths = study::against_width(context)?;
    context.step("the object has more vertices");
    let vertices = study::against_vertices(context)?;
    let results = Results { widths, vertices };
    let prose = results.prose()?;
    let Results { widths, vertices } = &results;
    let canvas = picture::variance(widths, vertices)?;
    context.png("specular.png", &canvas)?;
    let canvas = picture::time(widths, vertices);
    context.png("specular_time.png", &canvas)?;
    let table = results.table();
    let data = [context.csv("specular.csv", &table)?, context.csv("specular_time.csv", &results.times())?];
    prose.section("specular", data.to_vec(), table)
}

/// A number of a run, or a dash if no sample contributed.
fn seen(run: &Run, value: f64) -> Cell {
    if run.variance.value > 0.0 { value.into() } else { "–".into() }
}

/// All measurements.
struct Results {
    widths: Vec<Place>,
    vertices: Vec<Place>,
}

/// The unbiased method with the least value of something, where it is known.
fn best(place: &Place, value: impl Fn(&Run) -> f64) -> Option<Racer> {
    let able = Racer::ALL.into_iter().zip(&place.runs).filter(|(r, run)| r.is_unbiased() && run.is_known());
    able.min_by(|a, b| value(a.1).total_cmp(&value(b.1))).map(|(racer, _)| racer)
}

/// "edge sampling, importance at 6, warped area, unbiased at 1": how often each wins.
fn winners<'a>(places: impl Iterator<Item = &'a Place> + Clone, value: fn(&Run) -> f64) -> String {
    let won = |racer: Racer| places.clone().filter(|p| best(p, value) == Some(racer)).count();
    let list = Racer::ALL.into_iter().map(|racer| (racer, won(racer))).filter(|(_, count)| *count > 0);
    listed(list.map(|(racer, count)| format!("{} at {count}", racer.looks().name)))
}

/// Growth of a variance as the lobe narrows.
fn growth<'a>(places: impl Iterator<Item = &'a Place>, racer: Racer) -> String {
    let runs = places.map(|place| (place.width, &place.runs[racer as usize]));
    let known: Vec<(f64, f64)> =
        runs.filter(|(_, run)| run.is_known()).map(|(width, run)| (width, run.variance.value)).collect();
    let least = known.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((least, last)) = least.zip(known.last()) else { return "is not known".to_owned() };
    let ([at, least], [narrowest, last]) = ([least.0, least.1].map(number), [last.0, last.1].map(number));
    if at == narrowest {
        format!("falls to {least} at w = {at}; for narrower lobes this run cannot tell")
    } else {
        format!("is least, {least}, at w = {at} and {last} at w = {narrowest}")
    }
}

impl Results {
    /// The text on lobes, vertices and checks.
    fn prose(&self) -> anyhow::Result<Prose> {
        let [sky, object] = Lighting::ALL;
        let (first, last) = (&self.vertices[0], &self.vertices[self.vertices.len() - 1]);
        let times =
            |racer: Racer| number(last.runs[racer as usize].seconds / first.runs[racer as usize].seconds);
        let known = |racer: Racer| {
            let last = self.vertices.iter().rfind(|p| p.runs[racer as usize].is_known());
            last.map_or(0, |p| p.vertices)
        };
        Prose::new(
            include_str!("specular.md"),
            &[
                ("growth_edges", &growth(self.lit(sky), Racer::Importance)),
                ("growth_jumps", &growth(self.lit(sky), Racer::JumpMean)),
                ("reach", &REACH),
                ("growth_harmonic", &growth(self.lit(sky), Racer::Harmonic)),
                ("growth_sky", &growth(self.lit(sky), Racer::Multilevel)),
                ("growth_object", &growth(self.lit(object), Racer::Multilevel)),
                ("widths", &self.lit(sky).count()),
                ("winners_sky", &winners(self.lit(sky), Run::rays_cost)),
                ("winners_object", &winners(self.lit(object), Run::rays_cost)),
                ("width", &number(WIDTH_OF_PARTS)),
                ("few", &first.vertices),
                ("many", &last.vertices),
                ("time_importance", &times(Racer::Importance)),
                ("time_uniform", &times(Racer::Uniform)),
                ("time_jumps", &times(Racer::JumpMean)),
                ("time_harmonic", &times(Racer::Harmonic)),
                ("time_warped", &times(Racer::Multilevel)),
                ("known_importance", &known(Racer::Importance)),
                ("known_uniform", &known(Racer::Uniform)),
                ("ahead_rays", &self.overtaken(Run::rays_cost)),
                ("ahead_time", &self.overtaken(Run::time_cost)),
                ("places", &(self.widths.len() + self.vertices.len())),
                ("worst", &self.worst()),
                ("consistent", &Racer::Consistent.looks().name),
                ("settled", &SETTLED),
                ("known", &KNOWN),
            ],
        )
    }

    fn lit(&self, lighting: Lighting) -> impl Iterator<Item = &Place> + Clone {
        self.widths.iter().filter(move |p| p.lighting == lighting)
    }

    /// Number of vertices from which a method other than edge sampling has the least value of something.
    fn overtaken(&self, value: fn(&Run) -> f64) -> String {
        let edges = [Racer::Uniform, Racer::Importance];
        let ahead = self.vertices.iter().find(|p| best(p, value).is_some_and(|r| !edges.contains(&r)));
        ahead.map_or_else(|| "nowhere".to_owned(), |p| format!("from {} vertices on", p.vertices))
    }

    /// The mean of every method farthest from the exact derivative.
    fn worst(&self) -> String {
        let words = Racer::ALL.into_iter().filter_map(|racer| {
            let places = || self.widths.iter().chain(&self.vertices);
            let runs = || places().map(|p| &p.runs[racer as usize]).filter(|run| run.recovered.error > 0.0);
            let far = |run: &Run| run.deviation().abs();
            let worst = runs().filter(|run| run.is_known()).max_by(|a, b| far(a).total_cmp(&far(b)))?;
            let lost = runs().filter(|run| !run.is_settled()).count();
            let lost = if lost > 0 { format!(", and {lost} too far off") } else { String::new() };
            let (recovered, z) = (worst.recovered.shown(), worst.deviation());
            Some(format!("{}: {recovered} (z = {z:.1}{lost})", racer.looks().name))
        });
        listed(words).replace('-', "−")
    }

    /// All measurements except times.
    fn table(&self) -> Table {
        Table::of(
            self.all(),
            &[
                ("lighting", &|(place, ..)| place.lighting.name().into()),
                ("lobe width", &|(place, ..)| place.width.into()),
                ("vertices", &|(place, ..)| place.vertices.into()),
                ("method", &|(_, racer, _)| racer.looks().name.into()),
                ("samples a pixel", &|(.., run)| run.samples.into()),
                ("variance", &|(.., run)| seen(run, run.variance.value)),
                ("its standard error", &|(.., run)| seen(run, run.variance.error)),
                ("rays a sample", &|(.., run)| run.rays.into()),
                ("variance × rays", &|(.., run)| seen(run, run.rays_cost())),
                ("recovered", &|(.., run)| seen(run, run.recovered.value)),
                ("its standard error", &|(.., run)| seen(run, run.recovered.error)),
            ],
        )
    }

    /// Measured times.
    fn times(&self) -> Table {
        Table::of(
            self.all(),
            &[
                ("lighting", &|(place, ..)| place.lighting.name().into()),
                ("lobe width", &|(place, ..)| place.width.into()),
                ("vertices", &|(place, ..)| place.vertices.into()),
                ("method", &|(_, racer, _)| racer.looks().name.into()),
                ("seconds a sample", &|(.., run)| run.seconds.into()),
                ("variance × seconds", &|(.., run)| run.time_cost().into()),
            ],
        )
    }

    fn all(&self) -> impl Iterator<Item = (&Place, Racer, &Run)> {
        let places = self.widths.iter().chain(&self.vertices);
        places.flat_map(|p| Racer::ALL.into_iter().zip(&p.runs).map(move |(racer, run)| (p, racer, run)))
    }
}
