//! Every construction of the warp field on the example, with estimates for the picture and for measurements.

use flatland::plane::exact::{HarmonicField, OracleField};
use flatland::plane::fields::{AuxiliaryField, DirectField, FollowedField, JumpField, SceneJumps};
use flatland::random::{Stream, stream};
use flatland::warp::{AuxiliaryPoints, Debias, Field, JumpMean, Plane, Warp, WarpField, Weighting};
use glam::DVec2;
use rayon::prelude::*;

use super::example::{EXTENT, Example, WIDTH, grid};

/// Reach of the mean over discontinuities, in kernel widths.
pub(super) const REACH: f64 = 3.0;

/// Effort per estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Pixels per kernel width in a picture: of an exactly known field, and of an estimated one.
    pub(super) pixels: [usize; 2],
    /// Auxiliary rays a pixel.
    pub(super) rays: usize,
    /// Walks a pixel, for the harmonic field.
    pub(super) walks: usize,
    /// Independent estimates at each point at which a rule is measured.
    pub(super) repeats: usize,
}

/// A warp field with the numbers of estimates to be averaged.
pub(super) struct Construction<'a> {
    pub(super) name: &'static str,
    /// Description for a legend.
    pub(super) summary: &'static str,
    /// The field of the picture and how many estimates make a pixel.
    picture: (Box<dyn WarpField<Plane> + 'a>, usize),
    /// The unbiased estimate for the measurements, and how many.
    pub(super) measured: (Box<dyn WarpField<Plane> + 'a>, usize),
}

/// All seven, in the order of the theory; the harmonic field comes at two tolerances, for pictures and for
/// numbers.
pub(super) fn all<'a>(
    example: &'a Example,
    oracle: &'a OracleField<'a>,
    harmonic: [&'a HarmonicField<'a>; 2],
    effort: Effort,
    seed: u64,
) -> Vec<Construction<'a>> {
    let (scene, velocities) = (&example.scene, example.velocities.as_slice());
    let kappa = WIDTH.powi(-2);
    let auxiliary = |name, summary, weighting| {
        let field = |warp| -> Box<dyn WarpField<Plane> + 'a> {
            Box::new(AuxiliaryField { scene, velocities, warp, kappa })
        };
        // Close to a silhouette the levels converge fast enough for a finite variance up to a radial exponent
        // of 1/4.
        let unbiased = Warp { weighting, radial_exponent: 0.2, ..Warp::default() };
        let points = AuxiliaryPoints::Stratified;
        let many = Warp { points, debias: Debias::Consistent { rays: effort.rays }, ..unbiased };
        Construction { name, summary, picture: (field(many), 1), measured: (field(unbiased), effort.repeats) }
    };
    let jumps = SceneJumps::new(scene, JumpMean { reach: REACH * WIDTH });
    let followed = FollowedField { scene, velocities, kappa, candidates: 4 };
    // A field that needs no averaging.
    fn one<'a>(
        name: &'static str,
        summary: &'static str,
        field: impl WarpField<Plane> + Clone + 'a,
    ) -> Construction<'a> {
        Construction { name, summary, picture: (Box::new(field.clone()), 1), measured: (Box::new(field), 1) }
    }
    vec![
        one("direct", "velocity of the point seen", DirectField { scene, velocities }),
        auxiliary("Gaussian", "direct field, filtered", Weighting::Gaussian),
        auxiliary("boundary-aware", "the method", Weighting::default()),
        one("mean over jumps", "edges by 1/distance", JumpField { scene, velocities, jumps }),
        one("oracle", "v interpolated on triangles", oracle.clone()),
        Construction {
            name: "harmonic",
            summary: "ΔV = 0 in between",
            picture: (Box::new(harmonic[0].clone()), effort.walks / 2),
            measured: (Box::new(harmonic[1].clone()), effort.repeats / 2),
        },
        one("rotation", "one motion per kernel", PerKernel { field: followed, seed }),
    ]
}

/// The rotation method's field: every kernel of a grid follows one point seen in it.
#[derive(Clone, Copy, Debug)]
struct PerKernel<'a> {
    field: FollowedField<'a>,
    seed: u64,
}

impl WarpField<Plane> for PerKernel<'_> {
    fn at(&self, u: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        let cell = (u / WIDTH).floor();
        let address = [7, cell.x.to_bits(), cell.y.to_bits()];
        self.field.at((cell + 0.5) * WIDTH, &mut stream(self.seed, &address))
    }
}

/// V and ∇·V on the pixels of a picture, row by row.
pub(super) struct Sampled {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) fields: Vec<Field<DVec2>>,
}

impl Sampled {
    /// The field at the pixel that holds u.
    pub(super) fn near(&self, u: DVec2) -> DVec2 {
        let size = DVec2::new(self.width as f64, self.height as f64);
        let pixel = (u / EXTENT * size).clamp(DVec2::ZERO, size - 1.0);
        self.fields[pixel.y as usize * self.width + pixel.x as usize].value
    }
}

impl Construction<'_> {
    /// The field in the picture; every pixel has its own random numbers.
    pub(super) fn sample(&self, effort: Effort, seed: u64) -> Sampled {
        let (field, repeats) = &self.picture;
        let fine = effort.pixels[usize::from(self.measured.1 > 1)];
        let [width, height] = grid().map(|cells| cells * fine);
        let pixel = WIDTH / fine as f64;
        let fields = (0..width * height).into_par_iter().map(|i| {
            let centre = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5) * pixel;
            let mut rng = stream(seed, &[1, i as u64]);
            let mut sum = Field::<DVec2>::ZERO;
            for _ in 0..*repeats {
                let one = field.at(centre, &mut rng).0;
                sum = Field { value: sum.value + one.value, divergence: sum.divergence + one.divergence };
            }
            let share = (*repeats as f64).recip();
            Field { value: share * sum.value, divergence: share * sum.divergence }
        });
        Sampled { width, height, fields: fields.collect() }
    }
}
