//! Survey: a pilot's statistics of one view, or of several.

use std::sync::Arc;

use super::agreement::{Agreement, by_square};
use super::choice::{Candidate, Choice, FEWEST, Pilot};
use super::method::Method;
use super::reason::Reason;
use super::split::{PARTS, Split, split};
use super::trial::{Trial, weighted};
use crate::gradient::film::FilmPlane;
use crate::gradient::film::allocation::{Allocation, SIDE};
use crate::gradient::results::result::Kind;
use crate::gradient::run::groups::GROUPS;
use crate::gradient::{EdgeSampling, Field, WarpedArea};

/// Cost of a curve sample beyond its counted rays and means over discontinuities, in rays.
const CURVE: f64 = 1.0;
/// Cost of a sample of [`WarpedArea::default`] relative to one of a softened field, without the pilot;
/// measured range 1.4 to 2.0.
const EXACT_COST: f64 = 1.5;
/// Exponents by which the variance of one sample falls with the number of samples, due to stratification, for
/// each part. Softened fields: measured 0.03 to 0.30 for the area, 0.23 to 0.34 for silhouettes and 0.03 to
/// 0.18 for shadows;
const OF_SOFTENED: [f64; PARTS] = [0.15, 0.30, 0.10, 0.0];
/// softened fields with several reflections, where the area's variance hardly falls (0.04 in a closed box);
const OF_DEEP_SOFTENED: [f64; PARTS] = [0.05, 0.30, 0.10, 0.0];
/// and edge sampling: 0 to 0.5, 0 to 0.28 and 0.02 to 0.06.
const OF_EDGES: [f64; PARTS] = [0.10, 0.15, 0.04, 0.0];
/// Bound on the predicted reduction: the measured range.
const MEASURED: f64 = 1.0 / 64.0;
/// Relative error reduction that edge sampling must promise with a pilot of the minimum size; with larger
/// pilots less, in inverse proportion to the root of the size. A pilot of minimum size estimates the ratio of
/// errors to 10 to 30 % and sees nothing of rare events: where it was about 1, softened fields were at most
/// 1.3 times worse, and edge sampling up to 10 times. Zero if light is reflected more than once: the rare
/// events are then those of the exact mean within lobes. (In a closed box the field's error was twice that of
/// edge sampling, where 1.16 to 1.25 times was expected.)
const DOUBT: f64 = 0.25;
/// Error reduction factor that edge sampling must promise if a kind of curve was never seen, not even by
/// [`AGAIN`] times as many samples: rare contributions may be large, and if none of n samples contributes, at
/// most three in n do (the rule of three).
const UNSEEN_DOUBT: f64 = 4.0;
/// Standard errors by which the exact mean must be better: where two silhouettes meet in a penumbra its tails
/// are heavy, and few samples show too little of them. (Its variance is a sum over squares of the film, and
/// known badly if there are few.)
const ERRORS: f64 = 2.0;
/// Side of the squares of pixels from whose spread the uncertainty of the area's variance is estimated.
const UNCERTAIN: usize = 2;
/// Multiple of the samples of a kind of curve that is drawn if the first samples found nothing.
const AGAIN: usize = 16;
/// Rule of three: if n samples found nothing, the probability of a contribution is at most 3/n, at 95 %
/// confidence.
const RULE_OF_THREE: f64 = 3.0;
/// Number of area samples from which they are allocated unevenly: twice the least.
const SPREAD: usize = 2 * GROUPS;
/// Samples for evaluating the gain of an allocation: effectively unlimited.
const MANY: usize = 1 << 16;
/// Minimum fraction of the budget for the area: 1/8, and 1/2 if parameters other than geometry change, which
/// curves do not cover; and, if possible, one sample for each group from which standard errors are estimated.
/// The image returned with a gradient has no other samples.
const OF_AREA: usize = 8;
const OF_AREA_IF_SMOOTH: usize = 2;

/// Pilot statistics of one view, or of several, on which [`Pilot::choice`] is based.
#[derive(Clone, Debug)]
pub struct Survey {
    /// Whether materials or lights change.
    pub(super) smooth: bool,
    pub(super) softened: Option<Seen>,
    pub(super) edges: Option<Seen>,
    pub(super) exact: Option<Seen>,
    /// Agreement of edge sampling, and of the exact mean, with the softened field.
    pub(super) agreements: [Agreement; 2],
    /// Derivative found by the softened field.
    pub(super) found: Agreement,
    /// Whether listing edges would take too long.
    pub(super) in_haste: bool,
    pub(super) views: usize,
    /// Seed of the pilot's samples.
    pub(super) seed: u64,
}

/// Statistics of one method.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    method: Method,
    /// Numbers of area samples and of curve samples.
    few: (usize, usize),
    /// Variance of one sample of each part, and its cost.
    variances: [f64; PARTS],
    costs: [f64; PARTS],
    /// Number of samples of each part over all pixels, and cost per pixel of those that were repeated.
    counts: [f64; PARTS],
    again: f64,
    /// Relative standard error of the area's variance, from its spread over the film.
    uncertainty: f64,
    /// Exponents by which variances fall with sample counts.
    powers: [f64; PARTS],
    /// Whether light is reflected more than once.
    deep: bool,
    /// Film statistics of a single view, if samples may be allocated over its film.
    film: Option<OnFilm>,
}

/// Distribution of the area's variance over the film, from which the gain of an allocation is estimated.
#[derive(Clone, Debug)]
struct OnFilm {
    plane: FilmPlane,
    /// Variances of pixels.
    variances: Vec<f64>,
    /// Costs of samples in cells.
    costs: Vec<f64>,
}

impl Seen {
    /// From a trial with the given numbers of area samples and curve samples.
    pub(super) fn of(trial: &Trial<'_>, method: Method, (few, curves): (usize, usize)) -> Self {
        let (scene, noise) = (trial.scene, &trial.image.noise);
        let on_film = weighted(&noise.area, trial.weights);
        let area = few as f64 * on_film.iter().sum::<f64>();
        let uncertainty = relative_error(&by_square(UNCERTAIN, scene.size(), |pixel| on_film[pixel]));
        // At least one ray; cells without a sample have none.
        let by_cell: Vec<f64> = noise.work.iter().map(|work| (work / few as f64).max(1.0)).collect();
        let curves_cost = |kind: &Kind| CURVE * kind.count as f64 + kind.work;
        let costs = [
            by_cell.iter().sum::<f64>() / by_cell.len() as f64,
            curves_cost(&noise.kinds.on_film),
            curves_cost(&noise.kinds.before_lights),
            curves_cost(&noise.kinds.before_all_else),
        ];
        let [film, shading, bounces] = trial.curves().map(|variance| curves as f64 * variance);
        let deep = scene.description.integrator.max_depth.is_none_or(|depth| depth > 2);
        let powers = match method {
            Method::WarpedArea(_) if deep => OF_DEEP_SOFTENED,
            Method::WarpedArea(_) => OF_SOFTENED,
            Method::EdgeSampling(_) => OF_EDGES,
        };
        let pixels = on_film.len() as f64;
        let counts = [few, curves, curves, curves].map(|count| count as f64 * pixels);
        // Noise of deep paths is everywhere: in a closed box an allocation gained nothing, where a third was
        // predicted.
        let film_of_area = (matches!(method, Method::WarpedArea(_)) && !deep).then(|| OnFilm {
            plane: FilmPlane::new(scene),
            variances: on_film,
            costs: by_cell,
        });
        let variances = [area, film, shading, bounces];
        Self {
            method,
            few: (few, curves),
            variances,
            costs,
            counts,
            again: 0.0,
            uncertainty,
            powers,
            deep,
            film: film_of_area,
        }
    }

    /// Edge sampling with more samples of the kinds of curves that were not seen; `None` if all were seen.
    pub(super) fn again(&self, seed: u64) -> Option<EdgeSampling> {
        let Method::EdgeSampling(method) = &self.method else { return None };
        let [_, primary, secondary, bounces] =
            std::array::from_fn(|part| if self.is_seen(part) { 1 } else { AGAIN * self.few.1 });
        let again = EdgeSampling { samples: 1, primary, secondary, bounces, seed, ..method.clone() };
        (!self.is_whole()).then_some(again)
    }

    /// Adds the statistics of the repeated kinds.
    pub(super) fn with_again(mut self, trial: &Trial<'_>) -> Self {
        let (again, found) = (AGAIN * self.few.1, trial.curves());
        let ones: f64 = (0..PARTS).filter(|&part| self.is_seen(part)).map(|part| self.costs[part]).sum();
        self.again = ones;
        for part in (1..PARTS).filter(|&part| !self.is_seen(part)).collect::<Vec<_>>() {
            self.variances[part] = again as f64 * found[part - 1];
            self.counts[part] *= AGAIN as f64;
            self.again += again as f64 * self.costs[part];
        }
        self
    }

    /// The sum with other views, which get the same split.
    fn and(self, other: &Self) -> Self {
        let both = |a: [f64; PARTS], b: [f64; PARTS]| std::array::from_fn(|i| a[i] + b[i]);
        let (variances, costs) = (both(self.variances, other.variances), both(self.costs, other.costs));
        let errors = [&self, other].map(|seen| seen.uncertainty * seen.variances[0]);
        let uncertainty = if variances[0] > 0.0 { errors[0].hypot(errors[1]) / variances[0] } else { 1.0 };
        let (counts, again) = (both(self.counts, other.counts), self.again + other.again);
        Self { variances, costs, counts, again, uncertainty, film: None, ..self }
    }

    /// Cost of the survey.
    fn spent(&self) -> f64 {
        let (area, curves) = self.few;
        area as f64 * self.costs[0] + curves as f64 * self.costs[1..].iter().sum::<f64>() + self.again
    }

    /// Whether a part does not exist or was seen.
    fn is_seen(&self, part: usize) -> bool {
        self.costs[part] == 0.0 || self.variances[part] > 0.0
    }

    /// Whether every kind of curve was seen.
    fn is_whole(&self) -> bool {
        (1..PARTS).all(|part| self.is_seen(part))
    }

    /// The best split of a time, in rays per pixel, for the sum of `views` views; the time is that of
    /// `samples` samples of the default.
    fn candidate(&self, time: f64, samples: usize, seed: u64, views: f64, smooth: bool) -> Candidate {
        let part = if smooth { OF_AREA_IF_SMOOTH } else { OF_AREA };
        let of_area = (samples / part).max(samples.min(GROUPS)).max(2);
        let costs = self.costs.map(|cost| cost / views);
        let unseen = self.counts.map(|count| (RULE_OF_THREE / count).min(1.0));
        let split = |variances: [f64; PARTS]| {
            // Sample counts that would be optimal without stratification.
            let many = split(variances, costs, unseen, time, of_area).samples;
            let few = |part: usize| if part == 0 { self.few.0 } else { self.few.1 };
            let stratified =
                |i: usize| (few(i) as f64 / many[i] as f64).clamp(MEASURED, 1.0).powf(self.powers[i]);
            let variances = std::array::from_fn(|i| variances[i] * stratified(i));
            split(variances, costs, unseen, time, of_area)
        };
        if let Some(film) = self.film.as_ref().filter(|_| !smooth) {
            let mut variances = self.variances;
            variances[0] *= film.gain();
            let mut split = split(variances);
            if split.samples[0] >= SPREAD {
                let spread = film.spread(split.samples[0], &film.variances);
                split.samples[0] = spread.mean(&film.plane).round() as usize;
                return self.with(&split, Some(Arc::new(spread)), seed);
            }
        }
        self.with(&split(self.variances), None, seed)
    }

    /// The method with the samples of a split.
    fn with(&self, split: &Split, allocation: Option<Arc<Allocation>>, seed: u64) -> Candidate {
        let [samples, film, shading, bounces] = split.samples;
        // If visible shadows are rare, sampled curves miss them, and the exact field does not.
        let shadows = if self.variances[2] > 0.0 { shading } else { 0 };
        let method = match &self.method {
            Method::WarpedArea(method) => Method::WarpedArea(WarpedArea {
                samples,
                allocation,
                // One number for both kinds.
                sign_changes: (film + shading).div_ceil(2),
                field: match method.field {
                    Field::Softened { .. } => softened(film, shadows),
                    field => field,
                },
                seed,
                ..method.clone()
            }),
            Method::EdgeSampling(method) => Method::EdgeSampling(EdgeSampling {
                samples,
                primary: film,
                secondary: shading,
                bounces,
                seed,
                ..method.clone()
            }),
        };
        Candidate { method, expected_squared_error: split.variance, shares: split.shares, reason: None }
    }
}

impl OnFilm {
    /// Allocation of samples to squares by the variances of pixels.
    fn spread(&self, samples: usize, variances: &[f64]) -> Allocation {
        Allocation::new(&self.plane, SIDE, samples, variances, &self.costs)
    }

    /// Factor by which the variance falls with an allocation of equal total cost. An allocation evaluated on
    /// the samples it was chosen by promises up to twice too much. The pixels are therefore divided into two
    /// halves, alternating pairs of rows, and each is evaluated with the allocation chosen by the other.
    fn gain(&self) -> f64 {
        let even: f64 = self.variances.iter().sum();
        let half = |which: usize| -> Vec<f64> {
            let of = |(i, v): (usize, &f64)| if i / self.plane.columns / 2 % 2 == which { *v } else { 0.0 };
            self.variances.iter().enumerate().map(of).collect()
        };
        let halves = [half(0), half(1)];
        let told =
            |which: usize| self.spread(MANY, &halves[1 - which]).variance(&self.plane, MANY, &halves[which]);
        if even > 0.0 { (told(0) + told(1)) / even } else { 1.0 }
    }
}

impl Survey {
    /// The empty survey, without a choice.
    pub(super) fn nothing() -> Self {
        Self {
            smooth: false,
            softened: None,
            edges: None,
            exact: None,
            agreements: [Agreement::default(); 2],
            found: Agreement::default(),
            in_haste: false,
            views: 1,
            seed: 0,
        }
    }

    /// Whether a pilot would produce the same survey again.
    #[must_use]
    pub fn is_that_of(&self, pilot: &Pilot) -> bool {
        self.softened.is_some() && self.seed == pilot.own_seed()
    }

    /// Expected time of a pilot and its choice relative to this survey, in the units by which the pilot
    /// splits samples; without the pilot's survey if that is this one. `None` if nothing was seen.
    #[must_use]
    pub fn relative_time(&self, pilot: &Pilot) -> Option<f64> {
        let softened = self.softened.as_ref()?;
        let others = [&self.edges, &self.exact].into_iter().flatten();
        let spent = softened.spent() + others.map(Seen::spent).sum::<f64>();
        let again = if self.is_that_of(pilot) { 0.0 } else { pilot.few().0 as f64 / softened.few.0 as f64 };
        let each = self.exact.as_ref().map_or(EXACT_COST * softened.costs[0], |exact| exact.costs[0]);
        Some(again + each * pilot.samples as f64 / spent)
    }

    /// Survey of several views by pilots of equal size: one choice for all of them, by the sum of their
    /// errors.
    ///
    /// ```no_run
    /// # use volume3d::{gradient::{ActiveParameters, Pilot, Progress, Survey}, scene::Scene};
    /// # fn f(views: &[Scene], active: &ActiveParameters) -> Result<(), Box<dyn std::error::Error>> {
    /// let pilot = Pilot { samples: 16, seed: 1 };
    /// let see = |view| pilot.survey(view, None, active, &Progress::none());
    /// let surveys = views.iter().map(see).collect::<Result<Vec<_>, _>>()?;
    /// let method = pilot.choice(&Survey::of_all(surveys)).method;
    /// # Ok(())
    /// # }
    /// ```
    #[must_use]
    pub fn of_all(surveys: impl IntoIterator<Item = Self>) -> Self {
        let mut surveys = surveys.into_iter();
        let Some(first) = surveys.next() else { return Self::nothing() };
        let both = |a: Option<Seen>, b: Option<Seen>| a.zip(b).map(|(a, b)| a.and(&b));
        surveys.fold(first, |a, b| Self {
            smooth: a.smooth || b.smooth,
            softened: both(a.softened, b.softened),
            edges: both(a.edges, b.edges),
            exact: both(a.exact, b.exact),
            agreements: [0, 1].map(|i| a.agreements[i].and(&b.agreements[i])),
            found: a.found.and(&b.found),
            in_haste: a.in_haste || b.in_haste,
            views: a.views + b.views,
            seed: a.seed,
        })
    }
}

impl Pilot {
    /// The better method, from a survey by a pilot of equal size.
    #[must_use]
    pub fn choice(&self, survey: &Survey) -> Choice {
        let Self { samples, seed } = *self;
        let Some(softened) = &survey.softened else {
            let exact = WarpedArea { samples, seed, ..WarpedArea::default() };
            let method = Method::WarpedArea(exact);
            return Choice { method, candidates: vec![], in_haste: survey.in_haste, is_lost: false };
        };
        let views = survey.views as f64;
        let each = survey.exact.as_ref().map_or(EXACT_COST * softened.costs[0], |exact| exact.costs[0]);
        let time = each / views * samples as f64;
        let candidate = |seen: &Seen| seen.candidate(time, samples, seed, views, survey.smooth);
        let mut candidates = vec![candidate(softened)];
        let mut best = 0;
        let [with_edges, with_exact] = &survey.agreements;
        let mut add = |other: Candidate, part: f64, reason: Reason| {
            let best_of_them = candidates[best].expected_squared_error;
            let is_better = other.expected_squared_error < part * best_of_them;
            let other_is_less = other.expected_squared_error < best_of_them;
            let reason = (!is_better && other_is_less).then_some(reason);
            candidates.push(Candidate { reason, ..other });
            best = if is_better { candidates.len() - 1 } else { best };
        };
        if let Some(edges) = &survey.edges {
            // In a large scene of which the film shows a small part, few edges are found by chance.
            let doubt = if edges.deep { 0.0 } else { DOUBT * (FEWEST as f64 / edges.few.0 as f64).sqrt() };
            match edges.is_whole() {
                true => add(candidate(edges), 1.0 - doubt, Reason::Close),
                false if with_edges.is_refuted() => add(candidate(edges), 0.0, Reason::Disagrees),
                false => add(candidate(edges), 1.0 / UNSEEN_DOUBT, Reason::Unseen),
            }
        }
        if let Some(exact) = &survey.exact {
            match with_exact.is_confirmed() {
                true => add(candidate(exact), 1.0 / (1.0 + ERRORS * exact.uncertainty), Reason::Close),
                false => add(candidate(exact), 0.0, Reason::Disagrees),
            }
        }
        let chosen = candidates.remove(best);
        candidates.sort_by(|a, b| a.expected_squared_error.total_cmp(&b.expected_squared_error));
        candidates.insert(0, chosen);
        let found = [&survey.found, with_edges, with_exact].map(Agreement::most);
        let is_lost = candidates[0].expected_squared_error >= found.into_iter().fold(0.0, f64::max);
        Choice { method: candidates[0].method.clone(), candidates, in_haste: false, is_lost }
    }
}

/// Softened field with the default's reach and softness, and exact within lobes: if the film shows a small
/// part of a large scene, few silhouettes seen at bounces are found by chance, and a pilot may see none.
pub(super) fn softened(silhouettes: usize, shadows: usize) -> Field {
    match Field::softened(1) {
        Field::Softened { film, lobe, softness, .. } => {
            Field::Softened { film, lobe, softness, silhouettes, shadows, bounces: 0 }
        }
        other => other,
    }
}

/// Relative standard error of a sum of independent, rare terms; 1 if it is empty.
fn relative_error(terms: &[f64]) -> f64 {
    let sum: f64 = terms.iter().sum();
    let square: f64 = terms.iter().map(|term| term * term).sum();
    if sum > 0.0 { square.sqrt() / sum } else { 1.0 }
}
