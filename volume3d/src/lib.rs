//! Warped-area sampling in three dimensions: a path tracer for triangle meshes and implicit surfaces that
//! computes images and their unbiased derivatives.
//!
//! Warp fields from [auxiliary rays](gradient::Field::AuxiliaryRays) are those of [`flatland::warp`] on one
//! more [`Domain`](flatland::warp::Domain), the [sphere](Sphere) of directions; weights, stencils and
//! debiasing are the same, on the film and at every bounce. The default field, the [mean over
//! discontinuities](gradient::Field::JumpMean), is [`flatland::warp::JumpMean`] with great arcs in place of
//! segments: it lists the edges of the meshes once and computes their weighted mean exactly. Its arcs are
//! clipped to what lies in front of the visible face, and include the seams of curved surfaces, which count
//! less near discontinuities. With either field, the borders of flat emitters and the sign changes of shading
//! normals are sampled separately, with the speed that the field leaves them (the residual theorem of
//! [`flatland::boundary`]). Implicit surfaces, [`sdf`], are rendered by sphere tracing, and contribute the
//! points of their tracer to the mean ([`gradient::ImplicitField`]).
//!
//! A scene is read from a file, [`io::load_scene`], or built in code:
//!
//! ```
//! use glam::{DAffine3, DVec3};
//! use volume3d::geometry::Mesh;
//! use volume3d::gradient::{Estimator, Progress, Tangent};
//! use volume3d::scene::{Camera, Description, Film, Filter, Integrator, Material, Scene};
//!
//! let camera = Camera::look_at(DVec3::new(0.0, 1.5, 4.0), DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.7);
//! let filter = Filter::Tent { radius: 1.0 };
//! let film = Film { width: 16, height: 16, crop: None, sample_border: true, filter };
//! let mut description = Description::new(camera, film);
//! description.integrator = Integrator { max_depth: Some(2), rr_depth: 5 };
//! let white = description.add_material(Material::diffuse("white", DVec3::splat(0.7)));
//! let floor = DAffine3::from_rotation_x(-1.5707963267948966) * DAffine3::from_scale(DVec3::splat(3.0));
//! description.add_shape("floor", Mesh::rectangle().transformed(&floor), white);
//! let block = DAffine3::from_translation(DVec3::Y) * DAffine3::from_scale(DVec3::splat(0.4));
//! let block = description.add_shape("block", Mesh::cube().transformed(&block), white);
//! let above = DAffine3::from_translation(3.0 * DVec3::Y) * DAffine3::from_rotation_x(1.5707963267948966);
//! description.add_emitter("lamp", Mesh::rectangle().transformed(&above), DVec3::splat(4.0));
//! let scene = Scene::new(description)?;
//!
//! // Derivative of every pixel as the block moves to the right, with its silhouette and its shadow.
//! let mut change = Tangent::still(&scene);
//! change.translate(&scene, block, DVec3::X);
//! let result = Estimator::default().forward(&scene, &change, &Progress::none())?;
//! assert_eq!(result.gradient.size(), (16, 16));
//! assert!(result.gradient.pixels.iter().any(|g| g.x != 0.0) && result.non_finite.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The [`guide`] leads from a mesh to a fitted pose; it compares methods and settings, and states practical
//! problem sizes.
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | [`geometry`] | meshes and their edges, ray tracing with single rays and bundles |
//! | [`sdf`] | implicit surfaces: formulas, networks, signed distance grids, and conversion from meshes |
//! | [`scene`] | scene description, validation, and update in place |
//! | [`io`] | file readers and writers with typed errors |
//! | `path` | the path tracer, generic over the scalar types of [`flatland::calculus`] |
//! | [`gradient`] | differentiable parameters, forward and reverse mode, one file per method |
//! | [`optimize`] | scene parameters as one vector, losses with adjoints, multi-view objectives, fits |
//! | [`check`] | validation of gradients by finite differences |
//! | [`lint`] | problems of a scene for gradients, with advice |
//! | [`tune`] | bias, noise and time of every method on a scene |
//!
//! The path tracer is generic over its scalar type: plain numbers give the primal image, dual numbers forward
//! mode, and numbers that record a tape reverse mode. So a path has the same value with and without
//! derivatives, forward and reverse mode are a linear map and its transpose, and the derivatives of all
//! continuous dependences are complete by construction. Automatic differentiation does not see the motion of
//! discontinuities: for that the warp is added by hand.
//!
//! # Bias
//!
//! [A page of the guide](guide::bias) lists what is unbiased, what is biased and by how much, what is
//! refused, and where variances are infinite.

pub mod check;
pub mod geometry;
pub mod gradient;
pub mod guide;
mod image;
pub mod io;
mod lanes;
pub mod lint;
mod optics;
pub mod optimize;
mod path;
pub mod scene;
pub mod sdf;
mod sphere;
pub mod tune;

pub use self::image::Image;
pub use path::Kernels;
pub use sphere::Sphere;
