//! Warped-area sampling in two dimensions: derived, exact, proved.
//!
//! The derivative of an integral whose integrand jumps across moving curves is
//!
//! ```text
//! dI/dθ = ∫ ∂f/∂θ du + ∮ Δf (v·ν) dl          (Reynolds transport theorem)
//!       = ∫ ∂f/∂θ du + ∫ ∇·(V f) du            (divergence theorem)
//! ```
//!
//! for every field V that is continuous and equals the velocity v of the jump, along its
//! normal ν, on the jump. *Warped-area sampling* (Bangaru, Li and Durand 2020, "Unbiased
//! warped-area sampling for differentiable rendering") estimates such a field from auxiliary
//! rays alone, so that no edge ever has to be found.
//!
//! Where edges are known, V may also be a mean of their own velocities: exact, and with less variance.
//!
//! "Theory 5" in a comment is page 5 of `volume3d::guide::theory`, where statements are proved.
//!
//! - [`calculus`]: numbers that carry derivatives or record themselves: over them the integrands of paths, in flat worlds and
//!   in `volume3d`, the reparameterised form and radiosity are written once.
//! - [`warp`]: the machinery that turns auxiliary points into (V, ∇·V) and its transpose, written once for the line, the
//!   plane, the circle and (in `volume3d`) the sphere; and the mean over jumps, of points and of segments (`volume3d` has
//!   that of great arcs).
//! - [`boundary`]: what a field that is not boundary consistent leaves over: the residual theorem, of which edge
//!   sampling is the case V = 0.
//! - [`plane`]: polygons over the image plane, where every integral above is known exactly; read from SVG files with the
//!   feature `svg`.
//! - [`transport`]: flat worlds in which light is scattered, over the directions of a circle, and
//!   their exact images and derivatives.
//! - [`sdf`]: implicit flat shapes, and the fields made of a sphere tracer's own points.
//! - [`estimator`]: the methods that differentiate an image, behind one trait; along paths in
//!   [`estimator::transport`].
//!
//! # What is exact, unbiased, biased
//!
//! | | |
//! |---|---|
//! | exact, to rounding | [`estimator::Exact`]: image, interior term and edge integral of every pixel, for box and tent filters; Gaussian filters to 10⁻¹² by quadrature; the divergence integral too, but for ε/g where boundaries a distance g apart move apart |
//! | | [`transport::exact::Exact`](transport::exact) of light scattered at most once, to 10⁻⁹ of the sum of absolute terms; radiosity of diffuse surfaces with a stated error, which is too small where light varies on less than 10⁻⁵ of a segment; [`sdf::exact`] of discs, polygons and rectangles |
//! | unbiased | warped area with the mean over jumps, exact or softened; with auxiliary points if γ is above its bound (1/p + ½ in the plane, for a boundary function B ~ sᵖ) and they are debiased: [`Debias`](warp::Debias), whose documentation says which moments are finite; edge sampling. All of them if no two visible edges coincide |
//! | consistent | auxiliary points without debiasing: biased at every fixed number of them |
//! | biased | Gaussian weights; the rotation heuristic; γ below its bound; finite differences |
//! | | implicit shapes: fields made of tracer points, by rays that run out of steps; every field at sharp corners; the relaxed boundary, by O(ε); implicit differentiation, by the whole boundary term |
//! | refused | by the exact engines: edges that move across the border of a box pixel on which they lie; visible edges that coincide and part |
//!
//! # Example
//!
//! A square moves to the right over a black background. The derivative of the image is positive
//! where its right side advances and negative where its left side withdraws.
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
pub mod estimator;
pub mod moments;
pub mod plane;
mod quadrature;
pub mod random;
pub mod sdf;
pub mod transport;
pub mod warp;
