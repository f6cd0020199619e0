//! The flat world of the figure, and every field on it.

use std::f64::consts::FRAC_PI_6;

use anyhow::Context as _;
use flatland::random::stream;
use flatland::sdf::exact::{Exact, HarmonicField, Silhouette};
use flatland::sdf::fields::{
    AuxiliaryField, BangaruField, DirectField, MovingField, SilhouetteDistance, TracedField, ViciniField,
};
use flatland::sdf::shapes::{Circle, Shape, SmoothUnion};
use flatland::sdf::{Scene, Sdf, Shading, Tracer};
use flatland::warp::{Circle as Directions, Debias, LinearField as _, Warp, WarpField};
use glam::DVec2;

/// Shading that is brighter the farther away: where one disc covers the other, the image is discontinuous
/// too.
const SHADING: Shading = Shading { base: 0.5, position: DVec2::new(0.2, 0.0), normal: DVec2::ZERO };

/// Auxiliary rays of the field that needs them.
pub(super) const RAYS: usize = 64;

/// Its concentration, in radians⁻²: a kernel 2.3° wide.
pub(super) const KAPPA: f64 = 600.0;

/// The angles shown, to both sides of 0.
pub(super) const REACH: f64 = FRAC_PI_6;

/// Two discs before an eye at the origin, the nearer hiding a part of the other, and a motion.
pub(super) struct World {
    pub(super) scene: Scene,
    pub(super) direction: Vec<f64>,
    pub(super) discs: [Circle; 2],
}

impl World {
    pub(super) fn new() -> anyhow::Result<Self> {
        let discs = [Circle::new(DVec2::new(2.3, -0.35), 0.45)?, Circle::new(DVec2::new(3.6, 0.55), 0.75)?];
        let [near, far] = discs.map(Shape::Circle);
        let union = Shape::Union(Box::new(SmoothUnion::new(near, far, 0.35)?));
        let tracer = Tracer { far: 8.0, ..Tracer::default() };
        let scene = Scene::new(union, DVec2::ZERO, tracer, SHADING, 0.0)?;
        // The near disc moves up, the far one down and grows; the blending width stays.
        let direction = vec![0.0, 0.8, 0.0, 0.0, -0.5, 0.3, 0.0];
        Ok(Self { scene, direction, discs })
    }

    /// Discontinuities of the picture, by increasing angle: at the discs before the black background, and
    /// where one of them covers the other.
    pub(super) fn silhouettes(&self) -> anyhow::Result<Vec<Silhouette>> {
        let exact = Exact::new(&self.scene)?;
        let mut found = exact.silhouettes(&self.direction)?;
        found.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        Ok(found)
    }

    /// dα/dθ of a field in a direction.
    pub(super) fn rate(&self, field: &impl TracedField<Directions>, tracer: Tracer, angle: f64) -> f64 {
        let view = flatland::sdf::View { tracer, ..self.scene.view() };
        let omega = DVec2::from_angle(angle);
        let form = field.form(&view, omega, &mut stream(0, &[]));
        form.field(|x| self.scene.shape().rate(*x, &self.direction)).value.dot(omega.perp())
    }
}

/// V against the angle.
pub(super) struct Curve {
    pub(super) name: &'static str,
    pub(super) values: Vec<[f64; 2]>,
}

/// Every field at equally spaced angles; the one from auxiliary rays as the mean over `repeats`.
pub(super) fn curves(world: &World, count: usize, repeats: usize, seed: u64) -> anyhow::Result<Vec<Curve>> {
    let exact = Exact::new(&world.scene).context("two discs have a closed form")?;
    let harmonic = HarmonicField::new(&exact, &world.direction)?;
    let view = world.scene.view();
    let angle = |i: usize| REACH * (2.0 * (i as f64 + 0.5) / count as f64 - 1.0);
    let sampled = |name, field: &dyn WarpField<Directions>, repeats: usize| {
        let at = |i: usize| {
            let omega = DVec2::from_angle(angle(i));
            let one = |repeat: usize| {
                let mut rng = stream(seed, &[i as u64, repeat as u64]);
                field.at(omega, &mut rng).0.value.dot(omega.perp())
            };
            [angle(i), (0..repeats).map(one).sum::<f64>() / repeats as f64]
        };
        Curve { name, values: (0..count).map(at).collect() }
    };
    let direction = world.direction.as_slice();
    let debias = Debias::Consistent { rays: RAYS };
    let auxiliary = AuxiliaryField {
        warp: Warp { debias, ..Warp::default() },
        kappa: KAPPA,
        distance: SilhouetteDistance::Curvature,
    };
    let (bangaru, vicini) = (BangaruField::default(), ViciniField::default());
    Ok(vec![
        sampled("direct", &MovingField::new(view, &DirectField, direction)?, 1),
        sampled("auxiliary rays", &MovingField::new(view, &auxiliary, direction)?, repeats),
        sampled("Bangaru et al.", &MovingField::new(view, &bangaru, direction)?, 1),
        sampled("Vicini et al.", &MovingField::new(view, &vicini, direction)?, 1),
        sampled("harmonic (exact)", &harmonic, 1),
    ])
}

/// Effect of coarsely spaced points on the fields of a ray's own points, with full steps and with shorter
/// ones.
pub(super) struct Coarseness {
    /// The shorter steps' length, relative to full ones.
    pub(super) scale: f64,
    /// The total variation of Bangaru et al.'s field between the last two silhouettes, over the difference of
    /// its ends: 1 if it is monotone.
    pub(super) variation: [f64; 2],
    /// The largest |V| of Vicini et al.'s field in the middle third between the first two.
    pub(super) bump: [f64; 2],
}

impl Coarseness {
    /// Over `count` directions each.
    pub(super) fn new(world: &World, silhouettes: &[Silhouette], count: usize) -> anyhow::Result<Self> {
        const SCALE: f64 = 0.1;
        let angles: Vec<f64> = silhouettes.iter().map(|s| s.angle).collect();
        let ([first, second, ..], [.., before, last]) = (angles.as_slice(), angles.as_slice()) else {
            anyhow::bail!("the figure's world has too few silhouettes");
        };
        let (near, far, scale) = ([*first, *second], [*before, *last], SCALE);
        let tracers = [1.0, scale].map(|step_scale| Tracer { step_scale, far: 8.0, ..Tracer::default() });
        let angle = |[from, to]: [f64; 2], i: usize| from + (to - from) * (i as f64 + 0.5) / count as f64;
        let third = (near[1] - near[0]) / 3.0;
        let middle = [near[0] + third, near[1] - third];
        Ok(Self {
            scale,
            variation: tracers.map(|tracer| {
                let at = |i| world.rate(&BangaruField::default(), tracer, angle(far, i));
                let values: Vec<f64> = (0..count).map(at).collect();
                let sum: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
                sum / (values[count - 1] - values[0]).abs()
            }),
            bump: tracers.map(|tracer| {
                let at = |i| world.rate(&ViciniField::default(), tracer, angle(middle, i)).abs();
                (0..count).map(at).fold(0.0, f64::max)
            }),
        })
    }
}
