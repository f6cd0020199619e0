//! Warped-area sampling in two dimensions, with exact reference solutions.
//!
//! The derivative of an integral whose integrand f(u, θ) has moving discontinuities is
//!
//! ```text
//! dI/dθ = ∫ ∂f/∂θ du + ∮ Δf (v·ν) dl          (Reynolds transport theorem)
//!       = ∫ ∂f/∂θ du + ∫ ∇·(V f) du            (divergence theorem)
//! ```
//!
//! where Δf is the jump of f across a discontinuity curve, v the curve's velocity and ν its normal. V is any
//! continuous vector field with V·ν = v·ν on the curve. *Warped-area sampling* (Bangaru, Li and Durand 2020,
//! "Unbiased warped-area sampling for differentiable rendering") estimates such a field from auxiliary rays,
//! without a list of edges.
//!
//! Where the edges are known, V may also be a weighted mean of their velocities, which is exact and has less
//! variance.
//!
//! "Theory 5" in a comment is page 5 of `volume3d::guide::theory`, where statements are proved.
//!
//! - [`calculus`]: scalar types for automatic differentiation, forward (dual numbers) and reverse (a tape).
//!   Path integrands, here and in `volume3d`, the reparameterised form and radiosity are generic over them.
//! - [`warp`]: estimators of (V, ∇·V) from auxiliary points, and their transposes, generic over the domain:
//!   line, plane, circle and (in `volume3d`) sphere; and the mean over discontinuities, which are points or
//!   segments here and great arcs in `volume3d`.
//! - [`boundary`]: the residual of a field that does not match the velocity of the discontinuities, and the
//!   residual theorem; edge sampling is the case V = 0.
//! - [`plane`]: scenes of polygons in the image plane, for which all integrals above have closed forms; read
//!   from SVG files with the feature `svg`.
//! - [`transport`]: two-dimensional worlds with light scattering, integrated over the directions of a circle,
//!   with exact images and derivatives.
//! - [`chain`]: mirrors, glass, openings and lights without extent, up to the first diffuse surface, with
//!   exact derivatives.
//! - [`sdf`]: two-dimensional implicit shapes, and warp fields built from the points of a sphere tracer.
//! - [`estimator`]: methods of image differentiation behind one trait; those for paths are in
//!   [`estimator::transport`].
//!
//! # Exact, unbiased and biased methods
//!
//! Exact, to rounding:
//!
//! - [`estimator::Exact`]: image, interior term and edge integral of every pixel for box and tent filters,
//!   and for Gaussian filters to 10⁻¹² by quadrature. Also the divergence integral, except for an
//!   error of order ε/g (ε the rounding unit) where boundaries at distance g move apart.
//! - [`transport::exact::Exact`](transport::exact): light scattered at most once, to 10⁻⁹ of the sum of the
//!   absolute terms. Radiosity of diffuse surfaces comes with an error estimate, which is too small where
//!   light varies over less than 10⁻⁵ of a segment.
//! - [`sdf::exact`]: discs, polygons and rectangles.
//!
//! Unbiased, if no two visible edges coincide:
//!
//! - Edge sampling, and warped area with the mean over discontinuities, exact or softened.
//! - Warped area with auxiliary points, if γ is above its bound (1/p + ½ in the plane, for a boundary
//!   function B ~ sᵖ) and the points are debiased: [`Debias`](warp::Debias), which states which moments are
//!   finite.
//!
//! Consistent: auxiliary points without debiasing, which are biased for any fixed number of points.
//!
//! Biased:
//!
//! - Gaussian weights, the rotation heuristic, γ below its bound, finite differences.
//! - For implicit shapes: fields built from tracer points, by rays that run out of steps; every field at
//!   sharp corners; the relaxed boundary, by O(ε); implicit differentiation, by the whole boundary term.
//!
//! Refused by the exact methods: edges on a border of a box-filtered pixel that move across it, and visible
//! edges that coincide and move apart.
//!
//! # Example
//!
//! A square moves to the right over a black background. The derivative of the image is positive at its right
//! side, which advances, and negative at its left side, which recedes.
//!
//! ```
//! use flatland::estimator::{Exact, Method, WarpedArea};
//! use flatland::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};
//! use glam::{DVec2, DVec3};
//!
//! let corners = [(2.3, 2.3), (5.7, 2.3), (5.7, 5.7), (2.3, 5.7)];
//! let square = Polygon::simple(corners.map(|(x, y)| DVec2::new(x, y)))?;
//! let scene = Scene::new(DVec3::ZERO, vec![Shape::new(square, Shade::constant(DVec3::ONE))])?;
//! let film = Film::new(8, 8, Filter::Tent)?;
//! let motion = Motion::translate([0], DVec2::X);
//!
//! let exact = Exact.forward(&scene, &motion, &film)?;
//! let warped = WarpedArea { samples: 256, ..WarpedArea::default() }.forward(&scene, &motion, &film)?;
//! let (left, right) = (exact.mean.pixel(2, 4).x, exact.mean.pixel(5, 4).x);
//! assert!(left < -0.5 && right > 0.5);
//! assert!((warped.mean.pixel(5, 4).x - right).abs() < 6.0 * warped.standard_error.pixel(5, 4).x);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod boundary;
pub mod calculus;
pub mod chain;
pub mod estimator;
pub mod moments;
pub mod plane;
mod quadrature;
pub mod random;
pub mod sdf;
pub mod transport;
pub mod warp;
