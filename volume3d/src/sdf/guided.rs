//! A neural SDF traced directly, accelerated by its baked grid.

use flatland::sdf::shapes::{Parametric, ShapeError};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::{DMat3, DVec3};

use super::{Baked, Grid};

/// Safety factor on the greatest slope found near the surface.
const MARGIN: f64 = 1.25;

/// A neural SDF traced directly: its grid g guides rays to it, and near the surface φ is the network's own.
///
/// ```text
/// φ(x; θ) = g(x) + w(g(x)) (N(x; θ)/s − g(x)),   w = 1 where |g| ≤ h, 0 where |g| ≥ 3h, a quintic between,
/// ```
///
/// with h the grid's spacing and s the mean slope of the network N at the surface. The surface is the
/// network's, without the spline's deviation, as long as that is less than h; away from it φ is a distance,
/// unlike the network, at the cost of a grid. Parts where N is negative beyond 3h from the grid's surface are
/// not seen, as with the grid.
///
/// The parameters are the weights. Other weights imply another grid; derivatives treat it as constant, which
/// moves no surface, as g does not affect where φ is 0.
///
/// The bound on |∇φ| is the grid's, or 1.25 times the greatest value found at the nodes near the surface, if
/// that is more: not a guarantee; rays that find more are [counted](crate::scene::Scene::trace_counts). It is
/// expensive: a gradient sample takes more than 100 times as long as on the grid, as sphere tracing evaluates
/// the network some hundred times within 3h of the surface. Fit on the grid, and finish on the network, if at
/// all, in few steps with few pixels. Batched transposes use single precision, to which forward and reverse
/// mode agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Guided {
    baked: Baked,
    slope_bound: f64,
}

/// w, dw/dg and d²w/dg².
#[derive(Clone, Copy)]
struct Weight {
    value: f64,
    slope: f64,
    curvature: f64,
}

impl Guided {
    /// From a baked network.
    #[must_use]
    pub fn new(baked: Baked) -> Self {
        let mut guided = Self { baked, slope_bound: 0.0 };
        let (points, networks) = guided.baked.beside();
        let slope = |(x, network): (&DVec3, Jet<DVec3>)| {
            let grid = guided.grid().jet(*x);
            let jet = guided.jet_of(grid, network);
            if jet.value > 0.0 { jet.gradient.length() } else { 0.0 }
        };
        let steepest = points.iter().zip(networks).map(slope).fold(0.0, f64::max);
        guided.slope_bound = guided.grid().slope_bound().max(MARGIN * steepest);
        guided
    }

    /// The baked network.
    #[must_use]
    pub fn baked(&self) -> &Baked {
        &self.baked
    }

    fn grid(&self) -> &Grid {
        self.baked.grid()
    }

    /// w for a value of the grid.
    fn weight(&self, g: f64) -> Weight {
        let h = self.grid().spacing().max_element();
        let t = ((g.abs() - h) / (2.0 * h)).clamp(0.0, 1.0);
        let per_length = g.signum() / (2.0 * h);
        Weight {
            value: 1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t)),
            slope: -30.0 * (t * (1.0 - t)).powi(2) * per_length,
            curvature: -60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) * per_length * per_length,
        }
    }

    /// φ and ∇φ = ∇g + w ∇D + D w′ ∇g, with D = N/s − g.
    fn jet_of(&self, grid: Jet<DVec3>, network: Jet<DVec3>) -> Jet<DVec3> {
        let weight = self.weight(grid.value);
        let beyond = network * self.baked.per_slope() + grid * -1.0;
        let gradient =
            grid.gradient + beyond.gradient * weight.value + grid.gradient * (beyond.value * weight.slope);
        Jet { value: grid.value + weight.value * beyond.value, gradient }
    }

    /// The covector of (N, ∇N) from one of (φ, ∇φ) at x; `None` where φ is the grid's.
    fn covector(&self, x: DVec3, Jet { value: c, gradient: q }: Jet<DVec3>) -> Option<Jet<DVec3>> {
        let grid = self.grid().jet(x);
        let weight = self.weight(grid.value);
        let value = c * weight.value + q.dot(grid.gradient) * weight.slope;
        let covector = Jet { value, gradient: q * weight.value } * self.baked.per_slope();
        (weight.value > 0.0).then_some(covector)
    }
}

impl Sdf<DVec3> for Guided {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        let grid = self.grid().jet(x);
        if self.weight(grid.value).value == 0.0 {
            return grid;
        }
        self.jet_of(grid, self.baked.network().jet(x))
    }

    fn value(&self, x: DVec3) -> f64 {
        let grid = self.grid().value(x);
        match self.weight(grid).value {
            0.0 => grid,
            weight => grid + weight * (self.baked.network().value(x) * self.baked.per_slope() - grid),
        }
    }

    /// ∇²φ = (1 + D w′) ∇²g + w ∇²D + w′ (∇g ∇Dᵀ + ∇D ∇gᵀ) + D w″ ∇g ∇gᵀ.
    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        let grid = self.grid().second_order(x);
        let weight = self.weight(grid.jet.value);
        if weight.value == 0.0 {
            return grid;
        }
        let (network, scale) = (self.baked.network().second_order(x), self.baked.per_slope());
        let beyond = network.jet * scale + grid.jet * -1.0;
        let bent = network.hessian * scale - grid.hessian;
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let (a, b) = (grid.jet.gradient, beyond.gradient);
        let hessian = grid.hessian * (1.0 + beyond.value * weight.slope)
            + bent * weight.value
            + (outer(a, b) + outer(b, a)) * weight.slope
            + outer(a, a) * (beyond.value * weight.curvature);
        SecondOrder { jet: self.jet_of(grid.jet, network.jet), hessian }
    }

    fn slope_bound(&self) -> f64 {
        self.slope_bound
    }

    fn slope_bound_everywhere(&self) -> f64 {
        self.slope_bound.max(self.grid().slope_bound_everywhere())
    }

    /// Bounds of the grid, whose sign φ has beyond 3h of its surface.
    fn level_bounds(&self, level: f64) -> Option<(DVec3, DVec3)> {
        self.grid().level_bounds(level)
    }

    fn parameter_count(&self) -> usize {
        self.baked.network().parameter_count()
    }

    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        let grid = self.grid().jet(x);
        let weight = self.weight(grid.value);
        if weight.value == 0.0 {
            return Jet::ZERO;
        }
        let rate = self.baked.network().rate(x, direction) * self.baked.per_slope();
        let gradient = rate.gradient * weight.value + grid.gradient * (weight.slope * rate.value);
        Jet { value: weight.value * rate.value, gradient }
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        if let Some(covector) = self.covector(x, covector) {
            self.baked.network().add_parameter_gradient(x, covector, gradient);
        }
    }

    fn add_parameter_gradients(&self, taps: &[(DVec3, Jet<DVec3>)], gradient: &mut [f64]) {
        let beside = taps.iter().filter_map(|&(x, covector)| Some((x, self.covector(x, covector)?)));
        let (points, covectors): (Vec<DVec3>, Vec<Jet<DVec3>>) = beside.unzip();
        self.baked.add_network_gradient(&points, &covectors, gradient);
    }
}

impl Parametric<DVec3> for Guided {
    /// The weights.
    fn parameters(&self) -> Vec<f64> {
        self.baked.network().parameters()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        Ok(Self::new(self.baked.with_parameters(parameters)?))
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;
    use crate::sdf::network::{Architecture, Network};

    fn guided() -> Guided {
        let architecture = Architecture { hidden: 2, width: 32, sharpness: 20.0, frequencies: 0 };
        let network = Network::sphere(architecture, 0.7, 4).expect("a network");
        Guided::new(Baked::new(network, (DVec3::splat(-1.5), DVec3::splat(1.5)), 12).expect("a grid"))
    }

    /// Points at all distances from the surface.
    fn points() -> Vec<DVec3> {
        let mut random = stream(1, &[]);
        (0..300).map(|_| DVec3::from_array([(); 3].map(|()| 2.8 * open01(&mut random) - 1.4))).collect()
    }

    /// At points with weights 0, 1 and between.
    #[test]
    fn derivatives_are_those_of_the_value() {
        let guided = guided();
        let (h, v) = (1e-5, DVec3::new(0.3, -0.5, 0.8));
        let mut counts = [0; 3];
        for x in points() {
            let weight = guided.weight(guided.grid().value(x)).value;
            counts[if weight == 0.0 {
                0
            } else if weight == 1.0 {
                2
            } else {
                1
            }] += 1;
            let (there, ahead, behind) =
                (guided.second_order(x), guided.jet(x + h * v), guided.jet(x - h * v));
            assert_eq!((there.jet, there.jet.value), (guided.jet(x), guided.value(x)));
            let slope = (ahead.value - behind.value) / (2.0 * h);
            assert!((there.jet.gradient.dot(v) - slope).abs() < 1e-7, "{x}: {slope}");
            let bent = (ahead.gradient - behind.gradient) / (2.0 * h);
            // The grid's second derivatives have kinks.
            assert!((there.hessian * v).distance(bent) < 1e-3 * (1.0 + bent.length()), "{x}: {bent}");
        }
        assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    }

    /// The grid and s are constant; batched transposes have single precision.
    #[test]
    fn rates_are_those_of_the_network_and_have_a_transpose() {
        let guided = guided();
        let mut random = stream(2, &[]);
        let weights = guided.parameters();
        let way: Vec<f64> = weights.iter().map(|_| open01(&mut random) - 0.5).collect();
        let network = guided.baked.network();
        let moved = |h: f64| {
            let moved: Vec<f64> = weights.iter().zip(&way).map(|(w, v)| w + h * v).collect();
            network.with_parameters(&moved).expect("weights")
        };
        let (after, before) = (moved(1e-5), moved(-1e-5));
        let (mut forward, mut taps) = (0.0, vec![]);
        let mut one_by_one = vec![0.0; weights.len()];
        for x in points() {
            let (grid, rate) = (guided.grid().jet(x), guided.rate(x, &way));
            let [a, b] = [&after, &before].map(|network| guided.jet_of(grid, network.jet(x)));
            let (value, gradient) = ((a.value - b.value) / 2e-5, (a.gradient - b.gradient) / 2e-5);
            assert!((rate.value - value).abs() < 1e-6, "{x}: {} for {value}", rate.value);
            assert!(rate.gradient.distance(gradient) < 1e-4 * (1.0 + gradient.length()), "{x}");
            let covector = Jet { value: open01(&mut random), gradient: DVec3::splat(open01(&mut random)) };
            forward += rate.dot(covector);
            guided.add_parameter_gradient(x, covector, &mut one_by_one);
            taps.push((x, covector));
        }
        let mut together = vec![0.0; weights.len()];
        guided.add_parameter_gradients(&taps, &mut together);
        let dot = |gradient: &[f64]| gradient.iter().zip(&way).map(|(g, v)| g * v).sum::<f64>();
        assert!((dot(&one_by_one) - forward).abs() < 1e-12 * forward.abs());
        assert!((dot(&together) - forward).abs() < 1e-5 * forward.abs());
    }

    /// Along rays from inside, the root is the network's, not the spline's.
    #[test]
    fn the_surface_is_that_of_the_network() {
        let guided = guided();
        let root = |value: &dyn Fn(DVec3) -> f64, way: DVec3| {
            let (mut low, mut high) = (0.0, 1.4);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if value(middle * way) < 0.0 { low = middle } else { high = middle }
            }
            low
        };
        let mut apart = 0.0_f64;
        for way in points().into_iter().map(DVec3::normalize) {
            let found = root(&|x| guided.value(x), way);
            let expected = root(&|x| guided.baked.network().value(x), way);
            assert!((found - expected).abs() < 1e-12, "{way}: {found} {expected}");
            apart = apart.max((found - root(&|x| guided.grid().value(x), way)).abs());
        }
        assert!(apart > 1e-4, "the grid is elsewhere: {apart}");
        assert!(guided.bounds() == guided.grid().bounds() && guided.bounds().is_some());
    }
}
