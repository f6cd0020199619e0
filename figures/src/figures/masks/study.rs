//! Fits with good masks, corrupted masks, or none.

use volume3d::optimize::Loss;
use volume3d::optimize::mask::{Neighbourhood, dilated, eroded, with_holes};
use volume3d::sdf::network::Architecture;

use crate::context::{Context, Quality};
use crate::space::reconstruction::{Effort, Made, Reconstruction, Setup, Spoil, Supervision};
use crate::space::studio::{Light, Subject};

/// The part of the object that holes take, and their side as a part of the film's.
pub(super) const HOLES: (f64, usize) = (0.05, 16);

/// Names of masks with their flaws (an offset in pixels, or another), and the functions that produce them.
pub(super) const MASKS: [(Flaw, Spoil); 9] = [
    (Flaw::Pixels(0), |mask, _, _| Ok(mask.to_vec())),
    (Flaw::Pixels(-4), |mask, size, _| Ok(eroded(mask, size, 4, Neighbourhood::Eight)?)),
    (Flaw::Pixels(-2), |mask, size, _| Ok(eroded(mask, size, 2, Neighbourhood::Eight)?)),
    (Flaw::Pixels(-1), |mask, size, _| Ok(eroded(mask, size, 1, Neighbourhood::Eight)?)),
    (Flaw::Pixels(1), |mask, size, _| Ok(dilated(mask, size, 1, Neighbourhood::Eight)?)),
    (Flaw::Pixels(2), |mask, size, _| Ok(dilated(mask, size, 2, Neighbourhood::Eight)?)),
    (Flaw::Pixels(4), |mask, size, _| Ok(dilated(mask, size, 4, Neighbourhood::Eight)?)),
    (Flaw::Holes, |mask, size, view| Ok(with_holes(mask, size, HOLES.0, size.0 / HOLES.1, view)?)),
    (Flaw::All, |mask, _, _| Ok(vec![true; mask.len()])),
];

/// Flaw of a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flaw {
    /// The mask extends this many pixels farther than the object; fewer if negative.
    Pixels(i32),
    /// Parts of the object are missing.
    Holes,
    /// All pixels belong to the object.
    All,
}

/// Supervision of a fit, by its place among the arms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arm {
    WarpedArea,
    Masks(Flaw),
    /// Exact masks, with as much time as warped area takes.
    Longer,
    /// Without silhouettes and without masks.
    Nothing,
}

impl Arm {
    pub(super) fn name(self) -> String {
        match self {
            Self::WarpedArea => "warped area".to_owned(),
            Self::Longer => "masks, exact, equal time".to_owned(),
            Self::Masks(Flaw::Pixels(0)) => "masks, exact".to_owned(),
            Self::Masks(Flaw::Pixels(n @ 1..)) => format!("masks, {n} px larger"),
            Self::Masks(Flaw::Pixels(n)) => format!("masks, {} px smaller", -n),
            Self::Masks(Flaw::Holes) => "masks with holes".to_owned(),
            Self::Masks(Flaw::All) => "masks of all pixels".to_owned(),
            Self::Nothing => "interior term alone".to_owned(),
        }
    }
}

/// A fit with its supervision.
pub(super) struct Entry {
    pub(super) arm: Arm,
    pub(super) rate: f64,
    pub(super) fit: Reconstruction,
}

impl Entry {
    /// Fits a network at a rate, with the seed of a number.
    pub(super) fn new(
        context: &Context,
        effort: &Effort,
        architecture: Architecture,
        arm: Arm,
        (rate, number): (f64, u64),
    ) -> anyhow::Result<Self> {
        let supervision = match arm {
            Arm::WarpedArea => Supervision::WarpedArea,
            Arm::Nothing => Supervision::Interior,
            Arm::Longer => Supervision::Masks(MASKS[0].1),
            Arm::Masks(flaw) => {
                let spoil = MASKS.iter().find(|(of, _)| *of == flaw).map(|(_, spoil)| *spoil);
                Supervision::Masks(spoil.expect("every flaw has its function"))
            }
        };
        let (subject, made) = (Subject::Bunny, Made::Network(architecture));
        let (name, light) = (arm.name(), Light::Even);
        let setup = Setup { figure: 17, name, subject, light, number, made, rate, supervision };
        Ok(Self { arm, rate, fit: Reconstruction::new(context, effort, &setup)? })
    }
}

/// Measurements of the figure.
pub(super) struct Study {
    pub(super) effort: Effort,
    pub(super) architecture: Architecture,
    /// Rates searched for both arms.
    pub(super) rates: &'static [f64],
    /// All fits: first the search, in the order of rates.
    pub(super) entries: Vec<Entry>,
    /// Steps of the fit with masks that takes as much time as warped area.
    pub(super) longer: u64,
    /// The best rates of warped area and of exact masks.
    pub(super) best: [f64; 2],
}

impl Study {
    pub(super) fn new(context: &Context) -> anyhow::Result<Self> {
        let effort = effort(context.quality());
        let architecture = architecture(context.quality());
        let rates: &[f64] = context.study(&[2e-3], &[2e-3], &[5e-4, 1e-3, 2e-3]);
        let seeds = context.study(1, 1, 3);
        let entry = |arm, rate, number, effort: &Effort| {
            Entry::new(context, effort, architecture, arm, (rate, number))
        };
        let mut entries = vec![];
        let mut best = [rates[0]; 2];
        for (arm, best) in SEARCHED.into_iter().zip(&mut best) {
            let first = entries.len();
            for &rate in rates {
                entries.push(entry(arm, rate, 1, &effort)?);
            }
            let nearest = entries[first..].iter().min_by(|a, b| a.fit.chamfer().total_cmp(&b.fit.chamfer()));
            *best = nearest.map_or(*best, |entry| entry.rate);
            for number in 2..=seeds {
                entries.push(entry(arm, *best, number, &effort)?);
            }
        }
        for (flaw, _) in &MASKS[1..] {
            entries.push(entry(Arm::Masks(*flaw), best[1], 1, &effort)?);
        }
        entries.push(entry(Arm::Nothing, best[1], 1, &effort)?);
        let seconds = |arm| {
            let all = entries.iter().filter(|entry: &&Entry| entry.arm == arm).map(|entry| entry.fit.seconds);
            all.clone().sum::<f64>() / all.count() as f64
        };
        let ratio = seconds(SEARCHED[0]) / seconds(SEARCHED[1]);
        let phases = effort.phases.iter().map(|&steps| (ratio * steps as f64).round().max(1.0) as u64);
        let longer = Effort { phases: phases.collect(), ..effort.clone() };
        entries.push(entry(Arm::Longer, best[1], 1, &longer)?);
        Ok(Self { effort, longer: longer.steps(), architecture, rates, entries, best })
    }

    /// The fits of an arm at its best rate, by seed.
    pub(super) fn of(&self, arm: Arm) -> impl Iterator<Item = &Entry> {
        let best = if arm == Arm::WarpedArea { self.best[0] } else { self.best[1] };
        self.entries.iter().filter(move |entry| entry.arm == arm && entry.rate == best)
    }

    /// The fit of the first seed.
    pub(super) fn first(&self, arm: Arm) -> Option<&Entry> {
        self.of(arm).next()
    }
}

/// Arms whose rate is searched.
pub(super) const SEARCHED: [Arm; 2] = [Arm::WarpedArea, Arm::Masks(Flaw::Pixels(0))];

/// Effort of a fit: whole, live, or just enough to show that everything runs.
pub(super) fn effort(quality: Quality) -> Effort {
    let full = Effort {
        side: 48,
        views: 8,
        batch: 2,
        cells: 20,
        phases: vec![80; 2],
        pixels: None,
        finish: None,
        samples: 8,
        shown: 128,
        points: 100_000,
        meshed: 80,
        every: 20,
        loss: Loss::L1,
    };
    let live = Effort {
        side: 32,
        views: 6,
        cells: 10,
        phases: vec![30, 20],
        samples: 4,
        shown: 32,
        points: 4000,
        meshed: 40,
        every: 10,
        ..full.clone()
    };
    match quality {
        Quality::Full => full,
        Quality::Short => Effort {
            side: 32,
            cells: 12,
            phases: vec![40, 30],
            samples: 4,
            points: 10_000,
            meshed: 48,
            ..full
        },
        Quality::Draft => live,
        Quality::Sketch => Effort {
            side: 16,
            views: 2,
            cells: 6,
            phases: vec![1, 1],
            samples: 1,
            shown: 4,
            points: 200,
            meshed: 12,
            ..live
        },
    }
}

/// The network of a quality.
pub(super) fn architecture(quality: Quality) -> Architecture {
    let width = match quality {
        Quality::Full => 64,
        Quality::Short => 32,
        Quality::Draft => 32,
        Quality::Sketch => 8,
    };
    Architecture { width, frequencies: 4, ..Architecture::default() }
}
