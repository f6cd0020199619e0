//! Chain rule between the parameter vector and the parameters of the scene.

use glam::DVec3;

use super::super::quantity::Quantity;
use super::{Group, Parameters};
use crate::gradient::Tangent;
use crate::scene::{Object, Scene};

impl Parameters {
    /// The derivative by x from that by all parameters of the scene, with the scene at x.
    ///
    /// # Panics
    /// If the lengths do not match.
    #[must_use]
    pub fn gradient(&self, scene: &Scene, x: &[f64], gradient: &Tangent) -> Vec<f64> {
        assert_eq!(x.len(), self.len, "one number for each parameter");
        let mut out = vec![0.0; self.len];
        for group in &self.groups {
            let slice = &mut out[group.range.clone()];
            let mut members = group.members();
            let of = |member: super::Member| member.select(self.by(scene, x, gradient, member.quantity));
            if let Some(first) = members.next() {
                slice.copy_from_slice(&of(first));
            }
            for member in members {
                slice.iter_mut().zip(of(member)).for_each(|(sum, g)| *sum += g);
            }
        }
        out
    }

    /// The derivative by all numbers of a quantity.
    fn by(&self, scene: &Scene, x: &[f64], gradient: &Tangent, quantity: Quantity) -> Vec<f64> {
        let flat = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
        let vector = |v: DVec3| v.to_array().to_vec();
        let posed = |object: Object| {
            let rest = self.rest(object).expect("what is placed has been at rest");
            self.pose(x, object).pull(rest, scene, gradient)
        };
        match quantity {
            Quantity::VertexPositions { shape } => {
                let pose = self.pose(x, Object::Shape(shape));
                let own = gradient.positions_of(scene, shape).iter();
                own.flat_map(|g| (pose.scale * (pose.rotation.inverse() * *g)).to_array()).collect()
            }
            Quantity::Translation { of } => vector(posed(of).translation),
            Quantity::Rotation { of } => vector(posed(of).rotation),
            Quantity::Scale { of } => vec![posed(of).scale],
            Quantity::Sdf { implicit } => gradient.implicits[implicit].parameters.clone(),
            Quantity::Radiance { shape } => vector(gradient.radiance[shape]),
            Quantity::EnvironmentRadiance => vector(gradient.environment),
            Quantity::Intensity { light } => vector(gradient.intensity[light]),
            Quantity::Reflectance { material } => vector(gradient.reflectance[material]),
            Quantity::Roughness { material } => vec![gradient.roughness[material]],
            Quantity::Texture { texture, .. } => flat(&gradient.texels[texture]),
            Quantity::CameraTranslation => vector(gradient.camera.translation),
            Quantity::CameraRotation => vector(gradient.camera.rotation),
            Quantity::FieldOfView => vec![gradient.camera.field_of_view],
        }
    }

    /// The tangent in all parameters of the scene, which is at x, for a direction in x: the transpose of
    /// [`gradient`](Self::gradient).
    ///
    /// # Panics
    /// If the lengths do not match.
    #[must_use]
    pub fn tangent(&self, scene: &Scene, x: &[f64], direction: &[f64]) -> Tangent {
        assert_eq!([x.len(), direction.len()], [self.len; 2], "one number for each parameter");
        let mut tangent = Tangent::still(scene);
        for (group, member) in self.groups.iter().flat_map(|g: &Group| g.members().map(move |m| (g, m))) {
            let size: usize = member.quantity.dimensions(scene).iter().product();
            let mut whole = vec![0.0; size];
            member.put(&direction[group.range.clone()], &mut whole);
            self.add_along(scene, x, member.quantity, &whole, &mut tangent);
        }
        tangent
    }

    /// Adds the tangent of a change of all numbers of a quantity.
    fn add_along(&self, scene: &Scene, x: &[f64], quantity: Quantity, whole: &[f64], tangent: &mut Tangent) {
        let vectors = || whole.chunks_exact(3).map(DVec3::from_slice);
        let vector = || DVec3::from_slice(whole);
        let centre = |object: Object| {
            let rest = self.rest(object).expect("what is placed has been at rest");
            rest.centre + self.pose(x, object).translation
        };
        match quantity {
            Quantity::VertexPositions { shape } => {
                let pose = self.pose(x, Object::Shape(shape));
                let rates = tangent.positions_of_mut(scene, shape).iter_mut();
                rates.zip(vectors()).for_each(|(rate, v)| *rate += pose.scale * (pose.rotation * v));
            }
            Quantity::Translation { of } => tangent.translate_object(scene, of, vector()),
            Quantity::Rotation { of } => tangent.rotate_object(scene, of, centre(of), vector()),
            Quantity::Scale { of } => {
                tangent.scale_object(scene, of, centre(of), whole[0] / self.pose(x, of).scale);
            }
            Quantity::Sdf { implicit } => {
                let rates = tangent.implicits[implicit].parameters.iter_mut();
                rates.zip(whole).for_each(|(rate, s)| *rate += s);
            }
            Quantity::Radiance { shape } => tangent.radiance[shape] += vector(),
            Quantity::EnvironmentRadiance => tangent.environment += vector(),
            Quantity::Intensity { light } => tangent.intensity[light] += vector(),
            Quantity::Reflectance { material } => tangent.reflectance[material] += vector(),
            Quantity::Roughness { material } => tangent.roughness[material] += whole[0],
            Quantity::Texture { texture, .. } => {
                tangent.texels[texture].iter_mut().zip(vectors()).for_each(|(t, v)| *t += v);
            }
            Quantity::CameraTranslation => tangent.camera.translation += vector(),
            Quantity::CameraRotation => tangent.camera.rotation += vector(),
            Quantity::FieldOfView => tangent.camera.field_of_view += whole[0],
        }
    }
}
