//! A row of the table: a scene with its reference, and the results of all methods.

use glam::DVec3;
use tests::comparison::Estimate;
use tests::effort::{pick, thorough};
use tests::space::campaign::{Known, Sampler, warped};
use tests::space::scenes::Moving;
use tests::statistics::student;
use volume3d::gradient::{
    ActiveParameters, EdgeSampling, FiniteDifference, GradientError, Pilot, Progress, Tangent, WarpedArea,
    render,
};
use volume3d::scene::Scene;

/// Cells of a row that must be right: their slopes are 1 up to their errors, which are small enough to reject
/// a slope of 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Right {
    pub(crate) image: bool,
    pub(crate) auto: bool,
    pub(crate) warped: bool,
    pub(crate) edges: bool,
}

impl Right {
    pub(crate) const ALL: Self = Self { image: true, auto: true, warped: true, edges: true };
    pub(crate) const NONE: Self = Self { image: true, auto: false, warped: false, edges: false };
}

/// Results of the cells that must be right.
#[derive(Default)]
pub(crate) struct Held {
    /// Messages about wrong cells.
    pub(crate) wrong: Vec<String>,
    /// The smallest bias that each cell would have noticed, relative to the truth.
    pub(crate) noticed: Vec<f64>,
}

/// A scene at an extreme.
pub(crate) struct Row {
    pub(crate) name: String,
    /// The motion, or the error of the scene.
    pub(crate) moving: Result<Moving, String>,
    /// The sum of the image over pixels and channels, if known.
    pub(crate) image: Option<Estimate>,
    /// The sum of the derivative over pixels and channels.
    pub(crate) derivative: Estimate,
    /// The step of the differences from which the derivative was measured; `None` if it is known otherwise.
    pub(crate) step: Option<f64>,
    /// Samples per pixel.
    pub(crate) samples: usize,
    /// Factor on the number of runs.
    pub(crate) runs: f64,
    pub(crate) right: Right,
}

/// Samples per pixel, unless a row states otherwise.
const SAMPLES: usize = 48;

impl Row {
    pub(crate) fn new(
        name: impl Into<String>,
        moving: Result<Moving, String>,
        image: Option<Estimate>,
        derivative: Estimate,
        right: Right,
    ) -> Self {
        let name = name.into();
        Self { name, moving, image, derivative, step: None, samples: SAMPLES, runs: 1.0, right }
    }

    /// A row with numbers that are exact up to rounding.
    pub(crate) fn exact(
        name: impl Into<String>,
        moving: Moving,
        image: f64,
        derivative: f64,
        right: Right,
    ) -> Self {
        Self::new(name, Ok(moving), Some(Estimate::exact(image)), Estimate::exact(derivative), right)
    }

    /// A row with a previously measured derivative by central differences at a step; [`Row::remeasure`]
    /// repeats the measurement.
    pub(crate) fn differences(
        name: impl Into<String>,
        moving: Result<Moving, String>,
        step: f64,
        (mean, standard_error): (f64, f64),
        right: Right,
    ) -> Self {
        let derivative = Estimate { mean, standard_error };
        Self { step: Some(step), ..Self::new(name, moving, None, derivative, right) }
    }

    /// The reference by differences, with new random numbers.
    pub(crate) fn remeasure(&self, samples: usize, runs: u64) -> Option<Estimate> {
        let (step, Moving { scene, change }) = (self.step?, self.moving.as_ref().ok()?);
        let film = &scene.description().film;
        let pixels = film.width * film.height;
        let scene = Scene::new(scene.description().clone()).expect("a scene");
        let (weights, label) = (vec![DVec3::ONE; pixels], self.name.clone());
        let known =
            Known { scene, change: change.clone(), weights, exact: 0.0, error: 0.0, scale: 0.0, label };
        let (found, apart) = known.differences::<2>(FiniteDifference { samples, step, seed: 90_000 }, runs);
        Some(found.plus(Estimate { mean: 0.0, standard_error: apart }))
    }

    /// The cells after the name.
    pub(crate) fn cells(&self, held: &mut Held) -> [String; 7] {
        let Moving { scene, change } = match &self.moving {
            Ok(moving) => moving,
            Err(error) => {
                return std::array::from_fn(|i| if i == 0 { error.clone() } else { "–".to_owned() });
            }
        };
        let (samples, right) = (self.samples, self.right);
        let edges = EdgeSampling {
            samples,
            primary: samples,
            secondary: samples,
            bounces: samples,
            ..EdgeSampling::default()
        };
        let auto = Pilot { samples, seed: 0 };
        let warped = warped(samples);
        let image = match self.image {
            Some(image) => self.cell(image, right.image, "image", held, &|seed| self.render(scene, seed)),
            None => "–".to_owned(),
        };
        let mut forward = |method: &dyn Fn(u64) -> Result<Run, GradientError>, right: bool, what: &str| {
            self.cell(self.derivative, right, what, held, method)
        };
        [
            image,
            forward(&|seed| run(&auto, scene, change, seed), right.auto, "auto"),
            forward(&|seed| run(&warped, scene, change, seed), right.warped, "warped area"),
            forward(&|seed| run(&edges, scene, change, seed), right.edges, "edge sampling"),
            forward(&|seed| self.reversed(&auto, scene, change, seed), right.auto, "auto in reverse"),
            self.transposed(&warped, scene, change, held),
            self.transposed(&edges, scene, change, held),
        ]
    }

    /// Whether the interior term alone is found to be wrong, as it must be if anything visible moves.
    pub(crate) fn notices_the_interior_alone(&self) -> bool {
        let Ok(Moving { scene, change }) = &self.moving else { return false };
        let interior = WarpedArea { warps: false, ..warped(self.samples) };
        let mut held = Held::default();
        self.cell(self.derivative, true, "interior", &mut held, &|seed| run(&interior, scene, change, seed));
        !held.wrong.is_empty()
    }

    fn render(&self, scene: &Scene, seed: u64) -> Result<Run, GradientError> {
        let image = render(scene, self.samples, seed, &Progress::none())?;
        let (found, stated) = (image.regions.total.element_sum(), image.regions.sum_error);
        Ok(Run { found, stated: Some(stated), warned: false })
    }

    /// The table cell of many runs of an estimate.
    fn cell(
        &self,
        truth: Estimate,
        right: bool,
        what: &str,
        held: &mut Held,
        run: &dyn Fn(u64) -> Result<Run, GradientError>,
    ) -> String {
        let count = (self.runs * pick(16.0, 30.0)).round().max(3.0) as u64;
        let runs: Result<Vec<Run>, GradientError> = (0..count).map(|k| run(1000 + 17 * k)).collect();
        let runs = match runs {
            Ok(runs) => runs,
            Err(error) => {
                if right {
                    held.wrong.push(format!("{}, {what}: {error}", self.name));
                }
                return error.to_string();
            }
        };
        let found = Estimate::of(runs.iter().map(|r| r.found)).scaled(1.0 / truth.mean);
        let error = found.standard_error.hypot(truth.standard_error / truth.mean);
        if right {
            let apart = (found.mean - 1.0).abs();
            let noticed = student(count - 1) * error;
            held.noticed.push(noticed);
            if !(apart < noticed.max(ROUNDING) && noticed < 1.0) {
                let name = &self.name;
                held.wrong.push(format!("{name}, {what}: {} ± {error}; notices {noticed}", found.mean));
            }
        }
        let mut words = words(found.mean, error);
        let covers = |r: &&Run| {
            let stated = r.stated.unwrap_or(f64::INFINITY);
            (r.found - truth.mean).abs()
                <= 3.0 * stated.hypot(truth.standard_error) + ROUNDING * truth.mean.abs()
        };
        let covered = runs.iter().filter(covers).count();
        // Eight groups: Student's distribution with seven degrees of freedom is beyond 3 in one run of 50.
        // With one sample per pixel there are at most two groups, which do not determine an error.
        if right && thorough() && self.samples > 1 && (covered as f64) < 0.7 * count as f64 {
            held.wrong.push(format!("{}, {what}: 3 errors cover {covered} of {count}", self.name));
        }
        if covered as f64 <= 0.85 * count as f64 {
            words += &format!("; 3 errors cover {covered} of {count}");
            let warned = runs.iter().filter(|r| r.warned).count();
            words += &if warned > 0 { format!(", {warned} warned") } else { String::new() };
        }
        words
    }

    fn reversed(
        &self,
        method: &impl Sampler,
        scene: &Scene,
        change: &Tangent,
        seed: u64,
    ) -> Result<Run, GradientError> {
        let film = &scene.description().film;
        let ones = volume3d::Image::constant(film.width, film.height, DVec3::ONE);
        let active = active(scene, change);
        let gradient = method.reseeded(seed).reverse(scene, &ones, &active)?;
        let nothing = gradient.by_parameter == Tangent::still(scene);
        let warned = nothing || gradient.outlier().is_some() || !gradient.non_finite.is_empty();
        Ok(Run { found: gradient.by_parameter.dot(change), stated: None, warned })
    }

    /// Relative difference of reverse and forward mode with the same random numbers.
    fn transposed(&self, method: &impl Sampler, scene: &Scene, change: &Tangent, held: &mut Held) -> String {
        let both = run(method, scene, change, 1000)
            .and_then(|forward| Ok((forward.found, self.reversed(method, scene, change, 1000)?.found)));
        match both {
            Ok((forward, reverse)) => {
                let apart = (forward - reverse).abs() / forward.abs().max(self.derivative.mean.abs());
                // NaN is not at most that.
                if apart <= TRANSPOSED {
                    return tests::results::power_of_ten(apart);
                }
                held.wrong.push(format!("{}: {forward} forward, {reverse} in reverse", self.name));
                format!("{apart:.0e}")
            }
            // Forward mode reports the error instead.
            Err(_) => "–".to_owned(),
        }
    }
}

/// The motion.
fn active(scene: &Scene, change: &Tangent) -> ActiveParameters {
    let moves = |shape: usize| change.positions_of(scene, shape).iter().any(|v| *v != DVec3::ZERO);
    let shapes = (0..scene.description().shapes.len()).map(moves).collect();
    let implicits = vec![true; scene.description().implicits.len()];
    let materials = change.reflectance.iter().map(|rate| *rate != DVec3::ZERO).collect();
    ActiveParameters { shapes, implicits, materials, ..ActiveParameters::nothing(scene) }
}

/// Largest difference of reverse and forward mode, relative to the derivative.
const TRANSPOSED: f64 = 1e-6;

/// Relative rounding of references and sums.
const ROUNDING: f64 = 1e-6;

/// One run of an estimate.
struct Run {
    found: f64,
    /// The standard error stated by the run.
    stated: Option<f64>,
    /// Whether the run warns of heavy tails, of an image without visible change, or of non-finite samples.
    warned: bool,
}

fn run(method: &impl Sampler, scene: &Scene, change: &Tangent, seed: u64) -> Result<Run, GradientError> {
    let result = method.reseeded(seed).forward(scene, change)?;
    let (found, stated) = (result.regions.total.element_sum(), result.regions.sum_error);
    let warned = result.is_zero() || result.outlier().is_some() || !result.non_finite.is_empty();
    Ok(Run { found, stated: Some(stated), warned })
}

fn words(found: f64, error: f64) -> String {
    if !(found.is_finite() && error.is_finite()) {
        return format!("{found} ± {error}");
    }
    if error > 1.0 {
        return format!("lost in noise, 1e{:.0} of it", error.log10().round());
    }
    if error < 0.005 { format!("{found:.4} ± {error:.4}") } else { format!("{found:.2} ± {error:.2}") }
}
