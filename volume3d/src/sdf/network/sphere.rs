//! Geometric initialisation: weights of a sphere.

use std::f64::consts::{PI, TAU};

use flatland::random::{Stream, open01, stream};
use flatland::sdf::shapes::ShapeError;

use super::{Architecture, Network};

/// Standard deviation of the last weights, as in SAL and IDR.
const LAST: f64 = 1e-4;

impl Network {
    /// A network with φ(x) ≈ |x| − r, by the geometric initialisation of Atzmon and Lipman (SAL, 2020),
    /// Theorem 1, with the encoding as in IDR (Yariv et al. 2020).
    ///
    /// With n rows, hidden weights are normal with variance 2/n, the last ones have mean √(π/n), the bias of
    /// φ is −r, and other biases are 0; so are the weights of all waves of the encoding. A layer then
    /// preserves lengths in the mean, and the mean of the last a_i is |x|/√π √n. The deviation falls as
    /// 1/√width: for 4 × 64 networks (φ + r)/|x| was 0.99 ± 0.33 over 100 seeds. Choose r about half the
    /// object's size: training works best from a sphere inside the region of interest.
    ///
    /// # Errors
    /// If a size is out of range, or the radius is not positive and finite.
    pub fn sphere(architecture: Architecture, radius: f64, seed: u64) -> Result<Self, ShapeError> {
        architecture.check()?;
        if !(radius.is_finite() && radius > 0.0) {
            let (shape, parameter, wanted) = ("network", "radius", "positive and finite");
            return Err(ShapeError::Parameter { shape, parameter, value: radius, wanted });
        }
        let mut rng = stream(seed, &[]);
        let mut parameters = Vec::with_capacity(architecture.parameter_count());
        for k in 0..architecture.hidden {
            let (rows, columns) = architecture.shape(k);
            let deviation = (2.0 / rows as f64).sqrt();
            let learnt = if k == 0 { 3 } else { columns };
            for _ in 0..rows {
                parameters.extend((0..learnt).map(|_| deviation * normal(&mut rng)));
                parameters.extend(std::iter::repeat_n(0.0, columns - learnt));
            }
            parameters.extend(std::iter::repeat_n(0.0, rows));
        }
        let mean = (PI / architecture.width as f64).sqrt();
        parameters.extend((0..architecture.width).map(|_| mean + LAST * normal(&mut rng)));
        parameters.push(-radius);
        Self::new(architecture, parameters)
    }
}

/// A standard normal number (Box and Muller 1958).
fn normal(rng: &mut Stream) -> f64 {
    let (u, v) = (open01(rng), open01(rng));
    (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
}
