//! Some parameters of a scene as one vector of numbers.

use std::ops::Range;

use glam::{DMat3, DQuat, DVec3};

use super::pose::{Pose, Rest, rotation_vector};
use super::quantity::{ParameterError, Quantity};
use crate::geometry::Mesh;
use crate::gradient::{ActiveParameters, Tangent};
use crate::scene::{Camera, Environment, Placement, Reflectance, Scene, SceneError};

/// One parameter among [`Parameters`].
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// What it is of.
    pub quantity: Quantity,
    /// Where its numbers are in the vector.
    pub range: Range<usize>,
    /// The least and the greatest value of each; [`Parameters::retract`] stays within.
    pub bounds: [f64; 2],
}

/// Some parameters of a scene, as one vector x of numbers.
///
/// Poses are relative to the scene that they were made for: with p₀ the vertices and c₀ their mean there,
///
/// ```text
/// p = c₀ + t + s R (p₀ − c₀),
/// ```
///
/// `translation` is t, `rotation` the rotation vector of R and `scale` s. Derivatives by a rotation are those by a further turn δ
/// about the moving centre c₀ + t, R ← exp(δ) R, and [`retract`](Self::retract) composes steps the same way: a vector of
/// rotation is never added to another.
///
/// ```no_run
/// # use volume3d::{gradient::{Estimator, Progress}, optimize::{Adam, Parameters}, scene::Scene};
/// # fn f(scene: &mut Scene, adjoint: &volume3d::Image) -> Result<(), Box<dyn std::error::Error>> {
/// let parameters = Parameters::new(scene, &["bunny.translation", "bunny.rotation"])?;
/// let mut x = parameters.values(scene);
/// let gradient = Estimator::default().reverse(scene, adjoint, &parameters.active(scene), &Progress::none())?;
/// let gradient = parameters.gradient(scene, &x, &gradient.by_parameter);
/// let step = Adam::new(0.01).step(&gradient);
/// parameters.retract(&mut x, &step);
/// parameters.apply(&x, scene)?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Parameters {
    groups: Vec<Group>,
    len: usize,
    rests: Vec<Rest>,
    camera: Camera,
    /// Where implicit surfaces stood.
    placements: Vec<Placement>,
}

impl Parameters {
    /// The parameters with these names, in this order; see [`Quantity`] for what there is.
    ///
    /// # Errors
    /// A [`ParameterError`] if one does not exist, or two are the same.
    pub fn new(scene: &Scene, names: &[impl AsRef<str>]) -> Result<Self, ParameterError> {
        let camera = scene.description().camera.clone();
        let placements = scene.description().implicits.iter().map(|shape| shape.placement).collect();
        let mut this = Self { groups: vec![], len: 0, rests: vec![], camera, placements };
        for name in names {
            let name = name.as_ref();
            let quantity = Quantity::find(scene, name)?;
            if let Some(other) = this.groups.iter().find(|g| g.quantity.is(quantity)) {
                let other = other.name.clone();
                return Err(ParameterError::Twice { name: name.to_owned(), other });
            }
            let size: usize = quantity.dimensions(scene).iter().product();
            let range = this.len..this.len + size;
            this.len = range.end;
            if let Some(shape) = quantity.posed().filter(|&s| this.rest(s).is_none()) {
                this.rests.push(Rest::new(scene, shape));
            }
            let bounds = quantity.default_bounds();
            this.groups.push(Group { name: name.to_owned(), quantity, range, bounds });
        }
        // What a scene begins with is allowed.
        let x = this.values(scene);
        for group in &mut this.groups {
            for value in &x[group.range.clone()] {
                group.bounds = [group.bounds[0].min(*value), group.bounds[1].max(*value)];
            }
        }
        Ok(this)
    }

    /// All of them.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The same, with other bounds for one of them.
    ///
    /// # Panics
    /// If there are not so many, or the bounds are not in order, or the group is a rotation, which has none, or a scale, and
    /// they allow 0.
    #[must_use]
    pub fn with_bounds(mut self, group: usize, bounds: [f64; 2]) -> Self {
        assert!(bounds[0] <= bounds[1], "the bounds {bounds:?} are in order");
        let quantity = self.groups[group].quantity;
        assert!(!quantity.turns(), "a rotation has no bounds");
        assert!(!matches!(quantity, Quantity::Scale { .. }) || bounds[0] > 0.0, "a scale is positive");
        self.groups[group].bounds = bounds;
        self
    }

    /// The same where grids of the scene have other numbers of nodes.
    pub(super) fn resized(mut self, scene: &Scene) -> Self {
        self.len = 0;
        for group in &mut self.groups {
            let size: usize = group.quantity.dimensions(scene).iter().product();
            group.range = self.len..self.len + size;
            self.len = group.range.end;
        }
        self
    }

    /// How many numbers they are.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "none at all is no use to anybody")]
    pub fn len(&self) -> usize {
        self.len
    }

    fn rest(&self, shape: usize) -> Option<&Rest> {
        self.rests.iter().find(|r| r.shape == shape)
    }

    fn group(&self, quantity: Quantity) -> Option<&Group> {
        self.groups.iter().find(|g| g.quantity == quantity)
    }

    fn vector(&self, x: &[f64], quantity: Quantity) -> DVec3 {
        self.group(quantity).map_or(DVec3::ZERO, |g| DVec3::from_slice(&x[g.range.clone()]))
    }

    fn pose(&self, x: &[f64], shape: usize) -> Pose {
        Pose {
            translation: self.vector(x, Quantity::Translation { shape }),
            rotation: DQuat::from_scaled_axis(self.vector(x, Quantity::Rotation { shape })),
            scale: self.group(Quantity::Scale { shape }).map_or(1.0, |g| x[g.range.start]),
        }
    }

    /// Which parameters a reverse sweep must report for them.
    #[must_use]
    pub fn active(&self, scene: &Scene) -> ActiveParameters {
        let mut active = ActiveParameters::nothing(scene);
        self.groups.iter().for_each(|g| g.quantity.activate(&mut active));
        active
    }

    /// Their values in the scene that they were made for.
    ///
    /// # Panics
    /// If they are of a scene of another topology.
    #[must_use]
    pub fn values(&self, scene: &Scene) -> Vec<f64> {
        let d = scene.description();
        let flat = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
        let mut x = Vec::with_capacity(self.len);
        for group in &self.groups {
            x.extend(match group.quantity {
                Quantity::VertexPositions { shape } => flat(d.shapes[shape].mesh.positions()),
                Quantity::Sdf { implicit } => d.implicits[implicit].surface.parameters(),
                Quantity::Scale { .. } => vec![1.0],
                Quantity::Radiance { shape } => flat(&[d.shapes[shape].radiance.unwrap_or(DVec3::ZERO)]),
                Quantity::EnvironmentRadiance => match &d.environment {
                    Some(Environment::Constant { radiance, .. }) => flat(&[*radiance]),
                    _ => vec![0.0; 3],
                },
                Quantity::Intensity { light } => flat(&[d.lights[light].power()]),
                Quantity::Reflectance { material } => match d.materials[material].bsdf.reflectance() {
                    Reflectance::Constant(c) => flat(&[*c]),
                    Reflectance::Texture(_) => vec![0.0; 3],
                },
                Quantity::Roughness { material } => {
                    vec![d.materials[material].bsdf.roughness().unwrap_or(0.0)]
                }
                Quantity::Texture { texture, .. } => flat(&d.textures[texture].texels),
                Quantity::FieldOfView => vec![d.camera.field_of_view],
                Quantity::Translation { .. }
                | Quantity::Rotation { .. }
                | Quantity::ImplicitTranslation { .. }
                | Quantity::ImplicitRotation { .. }
                | Quantity::CameraTranslation
                | Quantity::CameraRotation => vec![0.0; 3],
            });
        }
        x
    }

    /// Gives a scene the values x. What does not follow from them stays as it is; see [`Scene::set_meshes`] for what
    /// it costs.
    ///
    /// # Errors
    /// A [`SceneError`] if a value is out of its range or not finite. Other parameters may have been set by then; applying
    /// valid values sets all.
    ///
    /// # Panics
    /// If x has another length, or the scene another topology.
    pub fn apply(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        assert_eq!(x.len(), self.len, "one number for each parameter");
        // A camera may be within what moves away, or the other way round.
        if self.apply_camera(x, scene).is_ok() {
            self.apply_implicits(x, scene)?;
        } else {
            self.apply_implicits(x, scene)?;
            self.apply_camera(x, scene)?;
        }
        for group in &self.groups {
            let slice = &x[group.range.clone()];
            let vectors = || slice.chunks_exact(3).map(DVec3::from_slice);
            let vector = || DVec3::from_slice(slice);
            match group.quantity {
                Quantity::Radiance { shape } => scene.set_radiance(shape, Some(vector()))?,
                Quantity::EnvironmentRadiance => {
                    let mut environment = scene.description().environment.clone();
                    if let Some(Environment::Constant { radiance, .. }) = &mut environment {
                        *radiance = vector();
                    }
                    scene.set_environment(environment)?;
                }
                Quantity::Intensity { light: index } => {
                    let mut light = scene.description().lights[index].clone();
                    *light.power_mut() = vector();
                    scene.set_light(index, light)?;
                }
                Quantity::Reflectance { material: index } => {
                    let mut material = scene.description().materials[index].clone();
                    *material.bsdf.reflectance_mut() = Reflectance::Constant(vector());
                    scene.set_material(index, material)?;
                }
                Quantity::Roughness { material: index } => {
                    let mut material = scene.description().materials[index].clone();
                    if let Some(alpha) = material.bsdf.roughness_mut() {
                        *alpha = slice[0];
                    }
                    scene.set_material(index, material)?;
                }
                Quantity::Texture { texture: index, .. } => {
                    let mut texture = scene.description().textures[index].clone();
                    texture.texels = vectors().collect();
                    scene.set_texture(index, texture)?;
                }
                _ => {}
            }
        }
        let meshes: Vec<(usize, Mesh)> = self
            .meshes(x, scene)
            .collect::<Result<_, _>>()
            .map_err(|(id, error)| SceneError::Mesh { id, error })?;
        if meshes.is_empty() { Ok(()) } else { scene.set_meshes(meshes) }
    }

    fn apply_implicits(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        for (implicit, rest) in self.placements.iter().enumerate() {
            let named = [
                Quantity::Sdf { implicit },
                Quantity::ImplicitTranslation { implicit },
                Quantity::ImplicitRotation { implicit },
            ];
            let [surface, translation, rotation] = named.map(|quantity| self.group(quantity));
            if [surface, translation, rotation].iter().all(Option::is_none) {
                continue;
            }
            let mut shape = scene.description().implicits[implicit].clone();
            if let Some(group) = surface {
                let made = shape.surface.with_parameters(&x[group.range.clone()]);
                shape.surface = made.map_err(|error| SceneError::Implicit { id: shape.id.clone(), error })?;
            }
            if translation.is_some() {
                shape.placement.translation = rest.translation + self.vector(x, named[1]);
            }
            if rotation.is_some() {
                let turn = DQuat::from_scaled_axis(self.vector(x, named[2]));
                shape.placement.rotation = DMat3::from_quat(turn) * rest.rotation;
            }
            scene.set_implicit(implicit, shape)?;
        }
        Ok(())
    }

    fn apply_camera(&self, x: &[f64], scene: &mut Scene) -> Result<(), SceneError> {
        let (rest, mut camera) = (&self.camera, scene.description().camera.clone());
        let pivot = if self.group(Quantity::CameraTranslation).is_some() {
            rest.pivot() + self.vector(x, Quantity::CameraTranslation)
        } else {
            camera.pivot()
        };
        if self.group(Quantity::CameraRotation).is_some() {
            let turn = DQuat::from_scaled_axis(self.vector(x, Quantity::CameraRotation));
            [camera.right, camera.up, camera.forward] =
                [rest.right, rest.up, rest.forward].map(|axis| turn * axis);
        }
        // A perspective camera turns in place.
        camera.origin = pivot - camera.orthographic.unwrap_or(0.0) * camera.forward;
        if let Some(group) = self.group(Quantity::FieldOfView) {
            camera.field_of_view = x[group.range.start];
        }
        scene.set_camera(camera)
    }

    /// The meshes of shapes that are moved, with their shapes; or the name of one that cannot be.
    fn meshes<'a>(
        &'a self,
        x: &'a [f64],
        scene: &'a Scene,
    ) -> impl Iterator<Item = Result<(usize, Mesh), (String, crate::geometry::MeshError)>> + 'a {
        let shapes = &scene.description().shapes;
        shapes.iter().enumerate().filter_map(move |(s, shape)| {
            let own = self.group(Quantity::VertexPositions { shape: s });
            let rest = self.rest(s);
            let mut mesh = match (own, rest) {
                (None, None) => return None,
                (Some(_), None) => shape.mesh.clone(),
                (_, Some(rest)) => rest.mesh.clone(),
            };
            if let Some(group) = own {
                let positions = x[group.range.clone()].chunks_exact(3).map(DVec3::from_slice).collect();
                mesh = match mesh.with_positions(positions) {
                    Ok(mesh) => mesh,
                    Err(error) => return Some(Err((shape.id.clone(), error))),
                };
            }
            let Some(rest) = rest else { return Some(Ok((s, mesh))) };
            Some(Ok((s, mesh.transformed(&self.pose(x, s).map(rest.centre)))))
        })
    }

    /// The derivative by x from that by all parameters of the scene, where it is at x.
    ///
    /// # Panics
    /// If the lengths do not fit.
    #[must_use]
    pub fn gradient(&self, scene: &Scene, x: &[f64], gradient: &Tangent) -> Vec<f64> {
        assert_eq!(x.len(), self.len, "one number for each parameter");
        let mut out = vec![0.0; self.len];
        for group in &self.groups {
            let slice = &mut out[group.range.clone()];
            let mut put = |v: DVec3| slice.copy_from_slice(&v.to_array());
            let posed = |shape: usize| {
                let rest = self.rest(shape).expect("a shape that is placed has been at rest");
                self.pose(x, shape).pull(rest.centre, scene, shape, gradient)
            };
            match group.quantity {
                Quantity::VertexPositions { shape } => {
                    let pose = self.pose(x, shape);
                    let own = gradient.positions_of(scene, shape).iter();
                    slice.as_chunks_mut::<3>().0.iter_mut().zip(own).for_each(|(slice, g)| {
                        *slice = (pose.scale * (pose.rotation.inverse() * *g)).to_array();
                    });
                }
                Quantity::Translation { shape } => put(posed(shape).translation),
                Quantity::Rotation { shape } => put(posed(shape).rotation),
                Quantity::Scale { shape } => slice[0] = posed(shape).scale,
                Quantity::Sdf { implicit } => {
                    slice.copy_from_slice(&gradient.implicits[implicit].parameters);
                }
                Quantity::ImplicitTranslation { implicit } => put(gradient.implicits[implicit].translation),
                Quantity::ImplicitRotation { implicit } => put(gradient.implicits[implicit].rotation),
                Quantity::Radiance { shape } => put(gradient.radiance[shape]),
                Quantity::EnvironmentRadiance => put(gradient.environment),
                Quantity::Intensity { light } => put(gradient.intensity[light]),
                Quantity::Reflectance { material } => put(gradient.reflectance[material]),
                Quantity::Roughness { material } => slice[0] = gradient.roughness[material],
                Quantity::Texture { texture, .. } => {
                    let chunks = slice.as_chunks_mut::<3>().0.iter_mut();
                    chunks.zip(&gradient.texels[texture]).for_each(|(slice, g)| *slice = g.to_array());
                }
                Quantity::CameraTranslation => put(gradient.camera.translation),
                Quantity::CameraRotation => put(gradient.camera.rotation),
                Quantity::FieldOfView => slice[0] = gradient.camera.field_of_view,
            }
        }
        out
    }

    /// The direction in the space of all parameters of the scene, where it is at x, that a direction in x is: the transpose
    /// of [`gradient`](Self::gradient).
    ///
    /// # Panics
    /// If the lengths do not fit.
    #[must_use]
    pub fn tangent(&self, scene: &Scene, x: &[f64], direction: &[f64]) -> Tangent {
        assert_eq!([x.len(), direction.len()], [self.len; 2], "one number for each parameter");
        let mut tangent = Tangent::still(scene);
        for group in &self.groups {
            let slice = &direction[group.range.clone()];
            let vectors = || slice.chunks_exact(3).map(DVec3::from_slice);
            let vector = || DVec3::from_slice(slice);
            let centre = |shape: usize| {
                let rest = self.rest(shape).expect("a shape that is placed has been at rest");
                rest.centre + self.pose(x, shape).translation
            };
            match group.quantity {
                Quantity::VertexPositions { shape } => {
                    let pose = self.pose(x, shape);
                    let rates = tangent.positions_of_mut(scene, shape).iter_mut();
                    rates.zip(vectors()).for_each(|(rate, v)| *rate += pose.scale * (pose.rotation * v));
                }
                Quantity::Translation { shape } => tangent.translate(scene, shape, vector()),
                Quantity::Rotation { shape } => tangent.rotate(scene, shape, centre(shape), vector()),
                Quantity::Scale { shape } => {
                    tangent.scale(scene, shape, centre(shape), slice[0] / self.pose(x, shape).scale);
                }
                Quantity::Sdf { implicit } => {
                    let rates = tangent.implicits[implicit].parameters.iter_mut();
                    rates.zip(slice).for_each(|(rate, s)| *rate += s);
                }
                Quantity::ImplicitTranslation { implicit } => {
                    tangent.implicits[implicit].translation += vector();
                }
                Quantity::ImplicitRotation { implicit } => tangent.implicits[implicit].rotation += vector(),
                Quantity::Radiance { shape } => tangent.radiance[shape] += vector(),
                Quantity::EnvironmentRadiance => tangent.environment += vector(),
                Quantity::Intensity { light } => tangent.intensity[light] += vector(),
                Quantity::Reflectance { material } => tangent.reflectance[material] += vector(),
                Quantity::Roughness { material } => tangent.roughness[material] += slice[0],
                Quantity::Texture { texture, .. } => {
                    tangent.texels[texture].iter_mut().zip(vectors()).for_each(|(t, v)| *t += v);
                }
                Quantity::CameraTranslation => tangent.camera.translation += vector(),
                Quantity::CameraRotation => tangent.camera.rotation += vector(),
                Quantity::FieldOfView => tangent.camera.field_of_view += slice[0],
            }
        }
        tangent
    }

    /// Goes from x along a step: rotations are composed, everything else is added, and bounds are kept.
    ///
    /// # Panics
    /// If the lengths do not fit.
    pub fn retract(&self, x: &mut [f64], step: &[f64]) {
        assert_eq!([x.len(), step.len()], [self.len; 2], "one number for each parameter");
        for group in &self.groups {
            let (x, step) = (&mut x[group.range.clone()], &step[group.range.clone()]);
            if group.quantity.turns() {
                let [further, so_far] = [step, x].map(|w| DQuat::from_scaled_axis(DVec3::from_slice(w)));
                let turn = (further * so_far).normalize();
                x.copy_from_slice(&rotation_vector(turn).to_array());
            } else {
                x.iter_mut().zip(step).for_each(|(x, s)| *x += s);
            }
            let [low, high] = group.bounds;
            x.iter_mut().for_each(|x| *x = x.clamp(low, high));
        }
    }
}
