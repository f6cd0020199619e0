//! Selected parameters of a scene as one vector of numbers.

mod apply;
mod derivative;
mod poses;

use std::ops::Range;

use glam::{DQuat, DVec3};

pub use self::poses::Placed;
use super::name::ParameterError;
use super::pose::{Pose, Rest, rotation_vector};
use super::quantity::{Member, Quantity};
use crate::gradient::ActiveParameters;
use crate::scene::{Camera, Environment, Object, Reflectance, Scene};

/// One parameter among [`Parameters`].
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Its name; the first if several are tied.
    pub name: String,
    /// The quantity; that of the first if several are tied.
    pub quantity: Quantity,
    /// The component of each vector or colour, if not all three.
    pub component: Option<usize>,
    /// The other parameters with the same values.
    pub tied: Vec<Member>,
    /// The range of its numbers in the vector.
    pub range: Range<usize>,
    /// Lower and upper bound of each number; [`Parameters::retract`] stays within.
    pub bounds: [f64; 2],
}

impl Group {
    /// The first parameter, without those tied to it.
    #[must_use]
    pub fn first(&self) -> Member {
        Member { quantity: self.quantity, component: self.component }
    }

    /// All parameters with its values.
    pub fn members(&self) -> impl Iterator<Item = Member> {
        std::iter::once(self.first()).chain(self.tied.iter().copied())
    }

    /// Whether one of its parameters belongs to this quantity, possibly as a component.
    #[must_use]
    pub fn has(&self, quantity: Quantity) -> bool {
        self.members().any(|member| member.quantity == quantity)
    }

    /// Whether it is a whole rotation vector, whose steps are composed.
    #[must_use]
    pub fn turns(&self) -> bool {
        self.component.is_none() && self.quantity.turns()
    }
}

/// Selected parameters of a scene, as one vector x of numbers.
///
/// Poses are relative to the scene that they were made for: with p₀ the vertices and c₀ their mean there,
///
/// ```text
/// p = c₀ + t + s R (p₀ − c₀),
/// ```
///
/// `translation` is t, `rotation` the rotation vector of R and `scale` s. Derivatives by a rotation are those
/// by a further turn δ about the moving centre c₀ + t, R ← exp(δ) R, and [`retract`](Self::retract) composes
/// steps the same way: rotation vectors are never added. One component of a rotation is a turn about that
/// world axis.
///
/// ```no_run
/// # use volume3d::{gradient::{Estimator, Progress}, optimize::{Adam, Parameters}, scene::Scene};
/// # fn f(scene: &mut Scene, adjoint: &volume3d::Image) -> Result<(), Box<dyn std::error::Error>> {
/// let parameters = Parameters::new(scene, &["bunny.translation", "bunny.rotation"])?;
/// let mut x = parameters.values(scene);
/// let active = parameters.active(scene);
/// let gradient = Estimator::default().reverse(scene, adjoint, &active, &Progress::none())?;
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
}

impl Parameters {
    /// The names of all parameters of a scene, sorted. Names of components, such as `bunny.translation.x`,
    /// are not listed.
    #[must_use]
    pub fn names(scene: &Scene) -> Vec<String> {
        Quantity::names(scene)
    }

    /// The parameters with these names, in this order; see [`Quantity`] for the names.
    ///
    /// # Errors
    /// A [`ParameterError`] if one does not exist, or two are the same.
    pub fn new(scene: &Scene, names: &[impl AsRef<str>]) -> Result<Self, ParameterError> {
        let alone: Vec<[&str; 1]> = names.iter().map(|name| [name.as_ref()]).collect();
        Self::tied(scene, &alone)
    }

    /// Parameters each of which is one name or several tied names. Tied parameters have the same values,
    /// initially those of the first, and the derivative by them is the sum of all their derivatives.
    ///
    /// # Errors
    /// A [`ParameterError`]:
    ///
    /// - if a parameter does not exist, or two are the same,
    /// - if two move one object in different ways,
    /// - if tied parameters differ in size, in bounds, or in whether they are rotations, or
    /// - if a list of names is empty.
    pub fn tied<'n>(scene: &Scene, names: &[impl AsRef<[&'n str]>]) -> Result<Self, ParameterError> {
        let camera = scene.description().camera.clone();
        let mut this = Self { groups: vec![], len: 0, rests: vec![], camera };
        let mut known: Vec<(&str, Member)> = vec![];
        for (index, names) in names.iter().map(AsRef::as_ref).enumerate() {
            let mut own: Vec<(&str, Member)> = vec![];
            for &name in names {
                for member in Quantity::find_all(scene, name)? {
                    for &(other, earlier) in known.iter().chain(&own) {
                        check_pair(scene, [(name, member), (other, earlier)])?;
                    }
                    if let Some(first) = own.first() {
                        check_tie(scene, [(name, member), *first])?;
                    }
                    own.push((name, member));
                }
            }
            let Some(&(name, first)) = own.first() else { return Err(ParameterError::Empty { index }) };
            let Member { quantity, component } = first;
            let size: usize = first.dimensions(scene).iter().product();
            let range = this.len..this.len + size;
            this.len = range.end;
            for object in own.iter().filter_map(|(_, member)| member.quantity.posed()) {
                if this.rest(object).is_none() {
                    this.rests.push(Rest::new(scene, object));
                }
            }
            let (bounds, tied) = (quantity.default_bounds(), own[1..].iter().map(|(_, m)| *m).collect());
            this.groups.push(Group { name: name.to_owned(), quantity, component, tied, range, bounds });
            known.extend(own);
        }
        // The initial values of the scene are always allowed.
        let x = this.values(scene);
        for group in &mut this.groups {
            for value in &x[group.range.clone()] {
                group.bounds = [group.bounds[0].min(*value), group.bounds[1].max(*value)];
            }
        }
        Ok(this)
    }

    /// The groups, in order.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Sets the bounds of one group.
    ///
    /// # Panics
    /// - If there is no such group.
    /// - If the bounds are not in order.
    /// - If the group is a rotation, which has no bounds.
    /// - If the group is a scale and the lower bound is not positive.
    #[must_use]
    pub fn with_bounds(mut self, group: usize, bounds: [f64; 2]) -> Self {
        assert!(bounds[0] <= bounds[1], "the bounds {bounds:?} are in order");
        let quantity = self.groups[group].quantity;
        assert!(!self.groups[group].turns(), "a rotation has no bounds");
        assert!(!matches!(quantity, Quantity::Scale { .. }) || bounds[0] > 0.0, "a scale is positive");
        self.groups[group].bounds = bounds;
        self
    }

    /// Sets the centre, in the scene at rest, of a rotation or scale. All parameters that place the same
    /// object share it.
    ///
    /// # Panics
    /// If there is no such group, or it is neither a rotation nor a scale.
    #[must_use]
    pub fn with_pivot(mut self, group: usize, pivot: DVec3) -> Self {
        for member in self.groups[group].members().collect::<Vec<_>>() {
            let object = match member.quantity {
                Quantity::Rotation { of } | Quantity::Scale { of } => of,
                other => panic!("{other:?} has no pivot"),
            };
            self.rests.iter_mut().filter(|rest| rest.object == object).for_each(|rest| rest.centre = pivot);
        }
        self
    }

    /// Updates the sizes after grids of the scene were refined.
    pub(super) fn resized(mut self, scene: &Scene) -> Self {
        self.len = 0;
        for group in &mut self.groups {
            let size: usize = group.first().dimensions(scene).iter().product();
            group.range = self.len..self.len + size;
            self.len = group.range.end;
        }
        self
    }

    /// The number of values.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "none at all is no use to anybody")]
    pub fn len(&self) -> usize {
        self.len
    }

    /// The parameters that a reverse sweep must report.
    #[must_use]
    pub fn active(&self, scene: &Scene) -> ActiveParameters {
        let mut active = ActiveParameters::nothing(scene);
        let members = self.groups.iter().flat_map(Group::members);
        members.for_each(|member| member.quantity.activate(scene, &mut active));
        active
    }

    /// Their values in the scene for which they were made.
    ///
    /// # Panics
    /// If the scene has another topology.
    #[must_use]
    pub fn values(&self, scene: &Scene) -> Vec<f64> {
        self.groups.iter().flat_map(|group| group.first().select(values(scene, group.quantity))).collect()
    }

    /// Moves x along a step: rotations are composed, everything else is added, and bounds are kept.
    ///
    /// # Panics
    /// If the lengths do not match.
    pub fn retract(&self, x: &mut [f64], step: &[f64]) {
        assert_eq!([x.len(), step.len()], [self.len; 2], "one number for each parameter");
        for group in &self.groups {
            let (x, step) = (&mut x[group.range.clone()], &step[group.range.clone()]);
            if group.turns() {
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

    fn rest(&self, object: Object) -> Option<&Rest> {
        self.rests.iter().find(|rest| rest.object == object)
    }

    /// All quantities of the parameters, each once.
    fn quantities(&self) -> Vec<Quantity> {
        let mut found: Vec<Quantity> = vec![];
        for member in self.groups.iter().flat_map(Group::members) {
            if !found.contains(&member.quantity) {
                found.push(member.quantity);
            }
        }
        found
    }

    /// All numbers of a quantity at x, `otherwise` for those that are not among the parameters; `None` if
    /// none of them is.
    fn whole(&self, x: &[f64], quantity: Quantity, otherwise: impl FnOnce() -> Vec<f64>) -> Option<Vec<f64>> {
        let groups = self.groups.iter().flat_map(|group| group.members().map(move |member| (group, member)));
        let mut own = groups.filter(|(_, member)| member.quantity == quantity).peekable();
        let (group, first) = own.peek()?;
        if first.component.is_none() {
            return Some(x[group.range.clone()].to_vec());
        }
        let mut whole = otherwise();
        own.for_each(|(group, member)| member.put(&x[group.range.clone()], &mut whole));
        Some(whole)
    }

    /// The value of a vector quantity, 0 where it is not a parameter.
    fn vector(&self, x: &[f64], quantity: Quantity) -> Option<DVec3> {
        self.whole(x, quantity, || vec![0.0; 3]).map(|v| DVec3::from_slice(&v))
    }

    fn pose(&self, x: &[f64], of: Object) -> Pose {
        let vector = |quantity| self.vector(x, quantity).unwrap_or(DVec3::ZERO);
        let scale = self.whole(x, Quantity::Scale { of }, || vec![1.0]);
        Pose {
            translation: vector(Quantity::Translation { of }),
            rotation: DQuat::from_scaled_axis(vector(Quantity::Rotation { of })),
            scale: scale.map_or(1.0, |scale| scale[0]),
        }
    }
}

/// All numbers of a quantity in the scene.
fn values(scene: &Scene, quantity: Quantity) -> Vec<f64> {
    let d = scene.description();
    let flat = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
    match quantity {
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
        Quantity::Roughness { material } => vec![d.materials[material].bsdf.roughness().unwrap_or(0.0)],
        Quantity::Texture { texture, .. } => flat(&d.textures[texture].texels),
        Quantity::FieldOfView => vec![d.camera.field_of_view],
        Quantity::Translation { .. }
        | Quantity::Rotation { .. }
        | Quantity::CameraTranslation
        | Quantity::CameraRotation => vec![0.0; 3],
    }
}

/// Checks that two parameters are not the same, and do not move one object in different ways.
fn check_pair(
    scene: &Scene,
    [(name, member), (other, earlier)]: [(&str, Member); 2],
) -> Result<(), ParameterError> {
    let names = || (name.to_owned(), other.to_owned());
    if member.overlaps(earlier) && member.component == earlier.component {
        let (name, other) = names();
        return Err(ParameterError::Twice { name, other });
    }
    if member.quantity.turns() && member.quantity == earlier.quantity {
        let (name, other) = names();
        return Err(ParameterError::Rotation { name, other });
    }
    if member.overlaps(earlier) {
        let (name, other) = names();
        return Err(ParameterError::Twice { name, other });
    }
    let moves = |member: Member| match member.quantity {
        Quantity::VertexPositions { shape } => Some(Object::Shape(shape)),
        quantity => quantity.posed(),
    };
    let (Some(a), Some(b)) = (moves(member), moves(earlier)) else { return Ok(()) };
    if a == b {
        return Ok(());
    }
    let d = scene.description();
    let [a, b] = [a, b].map(|object| d.moved_with(object));
    let common = |a: &[usize], b: &[usize]| a.iter().copied().find(|index| b.contains(index));
    let shape = common(&a.shapes, &b.shapes).map(|s| format!("`{}`", d.shapes[s].id));
    let implicit = common(&a.implicits, &b.implicits).map(|i| format!("`{}`", d.implicits[i].id));
    let light = common(&a.lights, &b.lights).map(|l| format!("`{}`", d.lights[l].id()));
    let environment = (a.environment && b.environment).then(|| "the environment".to_owned());
    match shape.or(implicit).or(light).or(environment) {
        Some(id) => {
            let (name, other) = names();
            Err(ParameterError::Moved { name, other, id })
        }
        None => Ok(()),
    }
}

/// Checks that two parameters may be tied.
fn check_tie(
    scene: &Scene,
    [(name, member), (other, first)]: [(&str, Member); 2],
) -> Result<(), ParameterError> {
    let (name, other) = (name.to_owned(), other.to_owned());
    let [size, other_size] = [member, first].map(|member| member.dimensions(scene).iter().product::<usize>());
    if size != other_size {
        return Err(ParameterError::TiedSizes { name, other, size, other_size });
    }
    let turns = |member: Member| member.component.is_none() && member.quantity.turns();
    if turns(member) != turns(first) {
        return Err(ParameterError::TiedRotation { name, other });
    }
    let [bounds, other_bounds] = [member, first].map(|member| {
        let [low, high] = member.quantity.default_bounds();
        format!("{low} to {high}")
    });
    if bounds != other_bounds {
        return Err(ParameterError::TiedBounds { name, other, bounds, other_bounds });
    }
    Ok(())
}
