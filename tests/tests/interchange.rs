//! Scenes of the Mitsuba format, one for each feature, compared with Mitsuba's own results.
//!
//! `tests/interchange` contains the scenes, the program that wrote them, and the program that recorded the
//! values: means of blocks of 8 × 8 pixels, of the image and of its derivative for a motion of the shape
//! `thing` along x. Two numbers are compared for each: the slope of our blocks on Mitsuba's, and the
//! difference of blocks beyond their noise, relative to the root mean square over blocks. `ONLY=words`
//! compares the scenes whose names contain these words.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::student;
use volume3d::gradient::{EdgeSampling, GradientError, Method, Pilot, Progress, Tangent, render};
use volume3d::io::load_scene;
use volume3d::scene::Scene;

/// Scenes with a deliberate deviation, and its reason; the deviations are listed in
/// `volume3d::guide::deviations`.
const DEVIATIONS: [(&str, &str); 1] =
    [("lamp_with_normals", "a mesh emits as far as its faces are seen from the front, and not its normals")];

const RUNS: u64 = 24;
/// Largest difference of blocks beyond noise, relative to their root mean square, for images and for
/// derivatives, whose noise is itself known only to some per cent.
const APART: [f64; 2] = [0.03, 0.06];

/// One scene's record.
#[derive(Deserialize)]
#[serde(untagged)]
enum Record {
    Values {
        image: Blocks,
        derivative: Option<Blocks>,
    },
    /// Mitsuba does not read it.
    Refused {
        #[expect(dead_code, reason = "for whoever reads the file")]
        refused: String,
    },
    /// Name and version of the renderer.
    Renderer(#[expect(dead_code, reason = "for whoever reads the file")] String),
}

/// Means of blocks and their standard errors.
#[derive(Deserialize)]
struct Blocks {
    mean: Vec<[f64; 3]>,
    error: Vec<[f64; 3]>,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("interchange")
}

fn records() -> BTreeMap<String, Record> {
    let text = std::fs::read_to_string(folder().join("values.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn channels(blocks: &[[f64; 3]]) -> impl Iterator<Item = f64> {
    blocks.iter().flatten().copied()
}

fn arrays(blocks: &[DVec3]) -> Vec<[f64; 3]> {
    blocks.iter().map(DVec3::to_array).collect()
}

impl Blocks {
    fn squares(&self) -> f64 {
        channels(&self.mean).map(|t| t * t).sum()
    }

    /// Slope of other blocks on these.
    fn slope(&self, other: &[[f64; 3]]) -> f64 {
        channels(&self.mean).zip(channels(other)).map(|(t, o)| t * o).sum::<f64>() / self.squares()
    }

    /// Slope of the blocks of many runs on these; its error includes the error of these blocks.
    fn slope_of(&self, runs: &[Vec<[f64; 3]>]) -> Estimate {
        let own: f64 = channels(&self.mean).zip(channels(&self.error)).map(|(t, e)| (t * e).powi(2)).sum();
        let noise = Estimate { mean: 0.0, standard_error: own.sqrt() / self.squares() };
        Estimate::of(runs.iter().map(|run| self.slope(run))).plus(noise)
    }

    /// Root mean square difference from the mean of many runs, without the part explained by noise, relative
    /// to the root mean square of these blocks.
    fn apart(&self, runs: &[Vec<[f64; 3]>]) -> f64 {
        let mut sum = 0.0;
        for (i, (t, e)) in channels(&self.mean).zip(channels(&self.error)).enumerate() {
            let found = Estimate::of(runs.iter().map(|run| run[i / 3][i % 3]));
            sum += (found.mean - t).powi(2) - found.standard_error.powi(2) - e.powi(2);
        }
        (sum / self.squares()).max(0.0).sqrt()
    }
}

/// Compares runs with a record and returns the disagreement, if any.
fn compare(
    label: &str,
    record: &Blocks,
    runs: &[Vec<[f64; 3]>],
    most: f64,
    power: &mut Power,
) -> Option<String> {
    let (found, apart) = (record.slope_of(runs), record.apart(runs));
    let limit = student(RUNS - 1);
    let wrong = (found.mean - 1.0).abs() > limit * found.standard_error || apart > most;
    println!("{label}: slope {:.4} ± {:.4}, apart by {apart:.4}", found.mean, found.standard_error);
    if wrong {
        return Some(format!("{label}: slope {found:?}, apart by {apart}"));
    }
    let reference = Estimate::exact(1.0);
    Comparison { found, reference, limit, slack: 0.0 }.accept(power, label, 1.0);
    None
}

/// Scenes whose names contain the requested words, with their records.
fn scenes() -> Vec<(String, Scene, Blocks, Option<Blocks>)> {
    let only = std::env::var("ONLY").unwrap_or_default();
    let mut scenes = vec![];
    for (name, record) in records() {
        let path = folder().join("scenes").join(format!("{name}.xml"));
        if let Record::Values { image, derivative } = record
            && name.contains(&only)
            && DEVIATIONS.iter().all(|(deviation, _)| *deviation != name)
        {
            let scene = Scene::new(load_scene(&path).unwrap_or_else(|error| panic!("{error}"))).unwrap();
            scenes.push((name, scene, image, derivative));
        }
    }
    scenes
}

#[test]
fn images_are_those_of_the_format() {
    let mut power = Power::of("interchange::images_are_those_of_the_format").noticing(0.1);
    let samples = pick(10, 64);
    let mut wrong = vec![];
    for (name, scene, image, _) in scenes() {
        let run = |seed| arrays(&render(&scene, samples, seed, &Progress::none()).unwrap().regions.blocks);
        let runs: Vec<_> = (0..RUNS).map(run).collect();
        wrong.extend(compare(&name, &image, &runs, APART[0], &mut power));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn derivatives_are_those_of_differences_of_its_images() {
    let name = "interchange::derivatives_are_those_of_differences_of_its_images";
    // The ball of many triangles is noisy; in most scenes a bias of 6 to 12 % is noticed.
    let mut power = Power::of(name).noticing(0.3);
    let samples = pick(24, 128);
    let mut wrong = vec![];
    for (name, scene, _, derivative) in scenes() {
        let (Some(derivative), Some(thing)) = (derivative, scene.shape("thing")) else { continue };
        let mut change = Tangent::still(&scene);
        change.translate(&scene, thing, DVec3::X);
        // Light through mirrors and glass, and of lights without extent, takes many samples. Edge sampling
        // refuses it.
        let edges =
            EdgeSampling { samples: 1, primary: 1, secondary: 1, bounces: 1, ..EdgeSampling::default() };
        let refused = edges.forward(&scene, &change, &Progress::none()).err();
        let through_chains =
            matches!(refused, Some(GradientError::Unsupported(what)) if what.missing().is_some());
        let samples = if through_chains { 32 * samples } else { samples };
        if through_chains && pick(true, false) {
            println!("{name}: compared in thorough tests");
            continue;
        }
        // One choice for all runs, from a separate seed.
        let pilot = Pilot { samples, seed: RUNS };
        let runs = |method: &Method| -> Result<Vec<_>, GradientError> {
            let run = |seed| method.with_seed(seed).forward(&scene, &change, &Progress::none());
            (0..RUNS).map(|seed| Ok(arrays(&run(seed)?.regions.blocks))).collect()
        };
        match pilot.for_change(&scene, &change, &Progress::none()).and_then(|choice| runs(&choice.method)) {
            Ok(runs) => wrong.extend(compare(&name, &derivative, &runs, APART[1], &mut power)),
            Err(error) => println!("{name}: {error}"),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
