//! Table of the compared methods, one row each.

use flatland::warp::{Debias, Warp};
use volume3d::Kernels;
use volume3d::gradient::{
    EdgeSampling, Field, FiniteDifference, GradientError, GradientImage, Pilot, Progress, Rotation, Tangent,
    WarpedArea,
};
use volume3d::scene::Scene;

use crate::plot::{Color, Palette};

/// A gradient image to be estimated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Task<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) change: &'a Tangent,
    /// Samples a pixel.
    pub(crate) samples: usize,
    /// The step of finite differences, in units of the change's parameter.
    pub(crate) step: f64,
    pub(crate) seed: u64,
}

type Estimate = fn(&Task<'_>, &Progress) -> Result<GradientImage, GradientError>;

/// A method under the name it has in options, tables and legends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    /// Key in options and files of results.
    pub(crate) key: &'static str,
    /// Name on pages.
    pub(crate) name: &'static str,
    pub(crate) color: Color,
    /// Samples a pixel with which all methods take about the same time on direct light.
    pub(crate) samples: usize,
    estimate: Estimate,
}

/// Every method, in the order of legends. To add one, add an entry here.
pub(crate) const METHODS: &[Method] = &[
    Method::new(["warped-area", "warped area"], Palette::BLUE, 12, |task, progress| {
        warped_area(task).forward(task.scene, task.change, progress)
    }),
    Method::new(["auxiliary-rays", "warped area, auxiliary rays"], Palette::GREEN, 6, |task, progress| {
        let method = WarpedArea { field: Field::AuxiliaryRays, ..warped_area(task) };
        method.forward(task.scene, task.change, progress)
    }),
    Method::new(
        ["auxiliary-rays-16", "16 auxiliary rays, not debiased"],
        Palette::SKY,
        12,
        |task, progress| {
            let warp = Warp { debias: Debias::Consistent { rays: 16 }, ..WarpedArea::default().warp };
            let method = WarpedArea { field: Field::AuxiliaryRays, warp, ..warped_area(task) };
            method.forward(task.scene, task.change, progress)
        },
    ),
    Method::new(["rotation", "rotation"], Palette::PURPLE, 24, |task, progress| {
        // Kernels as wide as a pixel: narrower ones see fewer edges at once, and have less bias and more
        // variance.
        let kernels = Kernels { film: 1.0, ..Kernels::default() };
        let method = Rotation { samples: task.samples, kernels, seed: task.seed, ..Rotation::default() };
        method.forward(task.scene, task.change, progress)
    }),
    Method::new(["edge-sampling", "edge sampling"], Palette::VERMILION, 16, |task, progress| {
        edge_sampling(task).forward(task.scene, task.change, progress)
    }),
    Method::new(["finite-differences", "finite differences"], Palette::GREY, 48, |task, progress| {
        let method = FiniteDifference { samples: task.samples, step: task.step, seed: task.seed };
        method.forward(task.scene, task.change, progress)
    }),
    Method::new(["softened", "warped area, softened field"], Palette::ORANGE, 12, |task, progress| {
        let method = WarpedArea { field: Field::softened(task.samples), ..warped_area(task) };
        method.forward(task.scene, task.change, progress)
    }),
    // The time of the pilot counts: it takes 8 samples however few are requested.
    Method::new(["automatic", "what a pilot chooses"], Palette::OCHRE, 40, |task, progress| {
        let pilot = Pilot { samples: task.samples, seed: task.seed };
        let choice = pilot.for_change(task.scene, task.change, progress)?;
        choice.method.forward(task.scene, task.change, progress)
    }),
];

impl Method {
    const fn new(names: [&'static str; 2], color: Color, samples: usize, estimate: Estimate) -> Self {
        let [key, name] = names;
        Self { key, name, color, samples, estimate }
    }

    /// The method with the key `key`.
    pub(crate) fn of_key(key: &str) -> Option<&'static Self> {
        METHODS.iter().find(|method| method.key == key)
    }

    /// One gradient image.
    pub(crate) fn estimate(
        &self,
        task: &Task<'_>,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        (self.estimate)(task, progress)
    }
}

fn warped_area(task: &Task<'_>) -> WarpedArea {
    WarpedArea { samples: task.samples, seed: task.seed, ..WarpedArea::default() }
}

/// Edge samples in the default's proportion to paths.
fn edge_sampling(task: &Task<'_>) -> EdgeSampling {
    let default = EdgeSampling::default();
    let share = |count: usize| (count * task.samples).div_ceil(default.samples);
    EdgeSampling {
        samples: task.samples,
        primary: share(default.primary),
        secondary: share(default.secondary),
        bounces: share(default.secondary),
        seed: task.seed,
        ..default
    }
}
