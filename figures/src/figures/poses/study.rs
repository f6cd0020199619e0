//! All descents, and their statistics.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use volume3d::gradient::{Progress, render};

use super::fit::{Descent, Distance, Problem};
use super::protocol::{Effort, IMAGE_SAMPLES, NOISY_SAMPLES, SAMPLES, SIDE, equal_time, start};
use super::racer::Racer;
use super::record::{Records, Row, listed};
use super::stage::Stage;
use crate::context::Context;
use crate::seeds::seed_of;
use crate::space::ThreadClock;

/// Kind of a descent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Experiment {
    /// Start away from the object: success rates.
    Away,
    /// Start at the true pose: drift.
    Truth,
    /// Start at the true pose, with a target that cannot be reached.
    Unreachable,
}

/// One descent to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Job {
    pub(super) experiment: Experiment,
    pub(super) stage: Stage,
    pub(super) racer: Racer,
    pub(super) samples: usize,
    pub(super) start: u64,
}

/// All measurements.
pub(super) struct Study {
    pub(super) effort: Effort,
    pub(super) seed: u64,
    pub(super) rows: Vec<Row>,
    records: Records,
}

impl Experiment {
    fn key(self) -> &'static str {
        ["away", "truth", "unreachable"][self as usize]
    }
}

impl Study {
    /// Makes every missing descent.
    pub(super) fn new(context: &Context) -> anyhow::Result<Self> {
        let (effort, seed) = (context.study(Effort::SKETCH, Effort::SHORT, Effort::FULL), context.seed());
        let each_one = effort.of_descents();
        let run = format!("seed {seed}, {SIDE} pixels, {SAMPLES} and {IMAGE_SAMPLES} samples, {each_one}");
        let path = context.path("poses.unfinished.csv");
        let records = Records::open(path, &run)?;
        let jobs: Vec<Job> = jobs(&effort).into_iter().filter(|job| !records.holds(&job.row(&run))).collect();
        context.step("targets");
        let problems = Problems::new(&effort, seed)?;
        let records = Mutex::new(records);
        let descend = |job: &Job| -> anyhow::Result<()> {
            let row = problems.descend(job, &effort, seed, &run)?;
            records.lock().unwrap_or_else(PoisonError::into_inner).add(row)
        };
        each(&jobs, &descend, &|done| context.step(&format!("descents: {done} of {}", jobs.len())))?;
        let mut records = records.into_inner().unwrap_or_else(PoisonError::into_inner);
        records.write()?;
        Ok(Self { effort, seed, rows: records.rows.clone(), records })
    }

    /// The descents of one kind, in the order of their starts.
    pub(super) fn descents(&self, like: &Job) -> Vec<&Row> {
        let row = like.row("");
        let same = |other: &&Row| {
            (&other.experiment, &other.scene, &other.method, other.samples)
                == (&row.experiment, &row.scene, &row.method, row.samples)
        };
        self.rows.iter().filter(same).collect()
    }

    /// Removes the record that served to resume after an interruption.
    pub(super) fn finish(&self) -> anyhow::Result<()> {
        self.records.remove()
    }
}

impl Job {
    /// Its row with no results yet.
    fn row(&self, run: &str) -> Row {
        Row {
            run: run.to_owned(),
            experiment: self.experiment.key().to_owned(),
            scene: self.stage.key().to_owned(),
            method: self.racer.key().to_owned(),
            samples: self.samples,
            start: self.start,
            translation_error: 0.0,
            rotation_error: 0.0,
            seconds: 0.0,
            pose: String::new(),
            errors: String::new(),
        }
    }

    /// Its starting pose.
    pub(super) fn from(&self, seed: u64) -> [f64; 6] {
        if self.experiment == Experiment::Away { start(self.stage, seed, self.start) } else { [0.0; 6] }
    }
}

/// All descents. At equal time many methods have as many samples as at equal steps: these are made once.
fn jobs(effort: &Effort) -> Vec<Job> {
    let mut jobs = vec![];
    let mut add = |experiment, stage, racer, samples, starts| {
        for start in 0..starts {
            let job = Job { experiment, stage, racer, samples, start };
            if !jobs.contains(&job) {
                jobs.push(job);
            }
        }
    };
    for stage in Stage::ALL {
        for racer in Racer::ALL {
            add(Experiment::Away, stage, racer, SAMPLES, effort.starts[stage as usize]);
            add(Experiment::Away, stage, racer, equal_time(stage, racer), effort.starts[stage as usize]);
        }
    }
    for stage in Stage::UNREACHABLE {
        for racer in Racer::ALL {
            add(Experiment::Unreachable, stage, racer, SAMPLES, effort.seeds);
        }
    }
    for racer in Racer::DRIFTING {
        for samples in [SAMPLES, 4 * SAMPLES] {
            add(Experiment::Truth, Stage::Bunny, racer, samples, effort.seeds);
        }
    }
    jobs
}

/// Makes all jobs, each on one thread, as many at once as there are threads; stops at the first failure.
fn each(
    jobs: &[Job],
    descend: &(dyn Fn(&Job) -> anyhow::Result<()> + Sync),
    tell: &(dyn Fn(usize) + Sync),
) -> anyhow::Result<()> {
    let [next, done] = [AtomicUsize::new(0), AtomicUsize::new(0)];
    let work = || -> anyhow::Result<()> {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        while let Some(job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            if let Err(error) = alone.install(|| descend(job)) {
                next.store(jobs.len(), Ordering::Relaxed);
                return Err(error);
            }
            tell(1 + done.fetch_add(1, Ordering::Relaxed));
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..rayon::current_num_threads()).map(|_| scope.spawn(work)).collect();
        let mut ended = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
        ended.try_for_each(|end| end.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

/// Problems to be fitted: every scene, and some with targets that cannot be reached.
pub(super) struct Problems {
    reachable: Vec<Problem>,
    unreachable: Vec<Problem>,
}

/// A problem with a target that can be reached, or not.
pub(super) fn problem(
    stage: Stage,
    is_reachable: bool,
    effort: &Effort,
    seed: u64,
) -> anyhow::Result<Problem> {
    let scene = stage.scene(SIDE, seed)?;
    let parameters = Stage::parameters(&scene)?;
    let seed_of_target = seed_of(seed, &[13, 200, stage as u64, u64::from(is_reachable)]);
    let seen = if is_reachable { stage.scene(SIDE, seed)? } else { stage.unreachable(SIDE, seed)? };
    let samples = if is_reachable { effort.target } else { NOISY_SAMPLES };
    let target = render(&seen, samples, seed_of_target, &Progress::none())?.image;
    Ok(Problem { stage, scene, parameters, target })
}

impl Problems {
    pub(super) fn new(effort: &Effort, seed: u64) -> anyhow::Result<Self> {
        let all = |stages: &[Stage], is_reachable| -> anyhow::Result<Vec<Problem>> {
            stages.iter().map(|&stage| problem(stage, is_reachable, effort, seed)).collect()
        };
        Ok(Self { reachable: all(&Stage::ALL, true)?, unreachable: all(&Stage::UNREACHABLE, false)? })
    }

    fn descend(&self, job: &Job, effort: &Effort, seed: u64, run: &str) -> anyhow::Result<Row> {
        let Job { experiment, stage, racer, samples, start } = *job;
        let problems =
            if experiment == Experiment::Unreachable { &self.unreachable } else { &self.reachable };
        let problem = problems.iter().find(|p| p.stage == stage);
        let problem = anyhow::Context::context(problem, "every job has its problem")?;
        let words = [13, 300, experiment as u64, stage as u64, racer as u64, samples as u64, start];
        let descent = Descent { racer, samples, steps: effort.steps, seed: seed_of(seed, &words) };
        let clock = ThreadClock::start();
        let poses = problem.descend(&job.from(seed), &descent)?;
        let seconds = clock.seconds() / effort.steps as f64;
        let errors = poses.iter().step_by(effort.stride).map(|x| Distance::of(stage, x).relative());
        let errors: Vec<f64> = errors.map(|e| (1e3 * e).round() / 1e3).collect();
        let last = &poses[poses.len() - 1];
        let end = Distance::of(stage, last);
        Ok(Row {
            translation_error: end.shift,
            rotation_error: end.turn,
            seconds,
            pose: listed(last),
            errors: listed(&errors),
            ..job.row(run)
        })
    }
}
