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
//! let film = Film { width: 16, height: 16, crop: None, filter: Filter::Tent { radius: 1.0 } };
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
//! # What is biased when
//!
//! | method | bias |
//! |---|---|
//! | [`gradient::WarpedArea`] with [`JumpMean`](gradient::Field::JumpMean), or [`Softened`](gradient::Field::Softened) with samples of silhouettes | none; with [`sign_changes`](gradient::WarpedArea::sign_changes) 0, jumps of interpolated normals |
//! | the same beside [implicit surfaces](sdf) | that of their tracer's tolerance, 10⁻⁷ radians unless told: at most 0.6 % where that was measured; what is nearer to a ray's beginning on a surface than 10⁻⁴ of the surface's size, which the ray does not see; 10⁻⁶ of that size, at which the weights of its field stop growing; trilinear grids 10 to 25 %; sharp corners; where a mesh or another implicit surface passes through one, the curve in which they meet |
//! | with the [field](gradient::ImplicitField) of the `nearest` points of a ray | that it jumps where points come and go, besides |
//! | with auxiliary rays and a multilevel or roulette [`Debias`](flatland::warp::Debias) | the same |
//! | with a fixed number of auxiliary rays | falls with that number; gradients come out too small |
//! | with `warps: false` | the interior term alone: no silhouette, no shadow moves |
//! | [`gradient::EdgeSampling`] | none |
//! | [`gradient::Rotation`] | wherever edges in one kernel move differently, and by the jumps of interpolated normals |
//! | [`gradient::FiniteDifference`] | ~ step² |
//!
//! Interpolated normals bring jumps of their own. Where a two-sided surface's shading normal turns away from the viewer
//! while its face does not, the surface is lit from its other side, as in Mitsuba 3: a curve that moves over the face,
//! and that the boundary function of no triangle edge knows. And at a fold a light may be above one face's horizon and
//! below the other's. Edge sampling samples both curves, from wherever they are seen. Warped area
//! samples the first with the speed that the warp leaves, v − V; the second consists of edges that its field follows.
//!
//! Surfaces that pass through one another jump along a curve that is no edge of a mesh. The first geometric gradient of a
//! scene looks for such crossings, by a query of the hierarchy with itself that is decided exactly, and every method
//! follows them like edges ([`scene::Scene::crossing_shapes`] counts them). The query takes about 0.05 s for 10⁵ triangles and
//! 0.5 s for 10⁶ on two cores (`cargo bench --bench crossing`), and about 300 bytes are kept for every pair of triangles that
//! cross. Auxiliary rays look at the crossings of the triangle they hit one by one.
//!
//! Where a scene is does not matter: as of coordinates of a map, at 10⁹ of its sizes from the origin, images
//! and gradients are those at the origin to the rounding of the coordinates that are given. The origin of
//! computation is moved to the surfaces, exactly, and where a scene is itself so wide rays pass edges as far
//! aside as its rounding asks for. Meshes whose shape that rounding has changed are told of:
//! [`scene::Scene::coarse_meshes`]. Implicit surfaces should be placed ([`scene::Placement`]) and have small
//! coordinates of their own.
//!
//! Where surfaces cover one another in one plane, as a lamp drawn exactly on a ceiling, rounding decides
//! which is seen: they may slide over one another, but where they part there are two one-sided derivatives
//! and no other, what is found need be neither, and [`scene::Scene::parted_shapes`] tells. So it is with what
//! stands on a face on an edge: [`scene::Scene::lifted_edges`]. The same holds where jumps of different
//! velocities coincide along a whole curve: the two one-sided derivatives differ, and what is found is one of
//! them or between them. So it is with a slab that slides over a table from where their sides are flush:
//! [`scene::Scene::parted_edges`] tells of edges that lie upon one another in space. Those that are seen upon
//! one another from one place only are not told of.
//!
//! What moves in an ideal mirror, behind a surface that light passes or a mask opens, before a bump or normal map, or under
//! a light in one point or one direction, has no unbiased estimate by any warp here: if a shape or the camera moves in a
//! scene that has one of them, that is refused: [`gradient::Unsupported`]. Edge sampling estimates the rest, if it is told to
//! leave these jumps out ([`gradient::EdgeSampling::allow_missing`]), and lists what it left out. Colours, roughnesses, textures and emission have
//! their derivatives through all of them.

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
