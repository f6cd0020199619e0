//! Warped-area sampling in three dimensions: a path tracer for triangle meshes whose images come with their
//! derivatives.
//!
//! Fields of [auxiliary rays](gradient::Field::AuxiliaryRays) are those of [`flatland::warp`], with one more
//! [`Domain`](flatland::warp::Domain), the [sphere](Sphere) of directions: weights, stencils and debiasing
//! are unchanged, on the film and at every bounce. The default field, the [mean over
//! jumps](gradient::Field::JumpMean), follows [`flatland::warp::JumpMean`] with great arcs in place of
//! segments, clipped to what is before the face that is seen, and with the seams of curved surfaces, which
//! yield to jumps: it lists the edges of meshes once, and takes their exact mean. Beside either field the
//! borders of flat emitters and the sign changes of shading normals are sampled with the speed that the field
//! leaves them, by the residual theorem of [`flatland::boundary`]. Implicit surfaces, [`sdf`], are rendered
//! by sphere tracing, and join that mean by the points of their tracer ([`gradient::ImplicitField`]).
//!
//! A scene is read from a file, [`io::load_scene`], or built:
//!
//! ```
//! use glam::{DAffine3, DVec3};
//! use volume3d::geometry::Mesh;
//! use volume3d::gradient::{Progress, Tangent, WarpedArea};
//! use volume3d::scene::{Camera, Description, Film, Filter, Integrator, Material, Scene};
//!
//! let camera = Camera::look_at(DVec3::new(0.0, 1.5, 4.0), DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.7);
//! let film = Film { width: 16, height: 16, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } };
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
//! // How does every pixel change when the block moves to the right? Its silhouette and its shadow move with it.
//! let mut change = Tangent::still(&scene);
//! change.translate(&scene, block, DVec3::X);
//! let result = WarpedArea::default().forward(&scene, &change, &Progress::none())?;
//! assert_eq!(result.gradient.size(), (16, 16));
//! assert!(result.gradient.pixels.iter().any(|g| g.x != 0.0) && result.non_finite.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The [`guide`] leads from a mesh to a fitted pose, and says which method and settings to take, and how large a problem may be.
//!
//! # How it is built
//!
//! | room | holds |
//! |---|---|
//! | [`geometry`] | meshes and their edges, the tracing of rays and bundles of rays |
//! | [`sdf`] | implicit surfaces: formulas, networks, and grids of signed distances, with how they are made from meshes |
//! | [`scene`] | what a scene is made of, checked, and updated in place |
//! | [`io`] | readers and writers that end in a value or a typed error |
//! | `path` | the path tracer, written once over the numbers of [`flatland::calculus`] |
//! | [`gradient`] | what may change; one sample over numbers, forward and reverse; one file a method |
//! | [`optimize`] | parameters of a scene as one vector, losses with their adjoints, objectives of several views, fits |
//!
//! The path tracer is one program over a number type. With plain numbers it is the primal; with dual numbers, forward
//! mode; with numbers that write to a tape, reverse mode. So a path has the same value with and without derivatives,
//! forward and reverse are one linear map and its transpose, and the derivative of everything continuous
//! is complete by construction. What is added by hand is what no differentiation of the program would find: the warp.
//!
//! # What is biased
//!
//! [A page of the guide](guide::bias) lists what is unbiased, what is biased and by how much, what is
//! refused, and where variances are not finite.

pub mod geometry;
pub mod gradient;
pub mod guide;
mod image;
pub mod io;
mod lanes;
mod optics;
pub mod optimize;
mod path;
pub mod scene;
pub mod sdf;
mod sphere;

pub use self::image::Image;
pub use path::Kernels;
pub use sphere::Sphere;
