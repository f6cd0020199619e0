//! Reverse mode: numbers that record themselves, and the scatter of their adjoints to parameters.

use flatland::random::{Stream, open01};
use glam::{DVec2, DVec3};

use super::auxiliary::Auxiliary;
use super::differential::{Differential, FilmPoint};
use super::film::FilmPlane;
use super::followed::FollowedPoint;
use super::warps::{DirectionWarp, FilmWarp};
use super::{ActiveParameters, Tangent};
use crate::calculus::{Adjoints, Calculus, CameraMotion, Kernel, Number, Rgb, Tape, Variable, Vec3, Warped};
use crate::scene::Scene;

/// What the inputs of a tape are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Input {
    Position(u32),
    Normal(u32),
    Reflectance(u32),
    Texel(u32, u32),
    Roughness(u32),
    Radiance(u32),
    Intensity(u32),
    Pose(u32),
    Environment,
    EnvironmentRotation,
    /// Translation, rotation and field of view.
    Camera,
    /// The film point and the Jacobian of its warp.
    FilmWarp,
    /// A direction and the Jacobian of its warp, by the number of its record.
    Warp(u32),
}

/// A number on the tape.
pub(crate) type Recorded<'t> = Variable<'t, Input>;

/// A warp at a bounce.
#[derive(Debug)]
struct BounceWarp<'t> {
    warping: DirectionWarp,
    origin: Vec3<Recorded<'t>>,
}

/// Which parameters are inputs.
#[derive(Debug)]
pub(crate) struct Inputs {
    pub(crate) active: ActiveParameters,
    /// For every shape.
    pub(crate) textures: Vec<bool>,
    /// For every position, whether it is active.
    pub(crate) positions: Vec<bool>,
    pub(crate) normals: Vec<bool>,
}

impl Inputs {
    pub(crate) fn new(scene: &Scene, active: &ActiveParameters) -> Self {
        let mut positions = vec![false; scene.positions.len()];
        let mut normals = vec![false; scene.normals.len()];
        for shape in (0..active.shapes.len()).filter(|&s| active.shapes[s]) {
            positions[scene.position_range(shape)].fill(true);
            normals[scene.normal_range(shape)].fill(true);
        }
        Self { active: active.clone(), textures: active.textures(scene), positions, normals }
    }
}

/// The calculus of the tape.
pub(crate) struct Reverse<'s, 't> {
    pub(crate) scene: &'s Scene,
    pub(crate) inputs: &'s Inputs,
    pub(crate) tape: &'t Tape<Input>,
    auxiliary: Option<&'t mut Auxiliary<'s>>,
    pub(crate) film: FilmPlane,
    film_warp: Option<FilmWarp>,
    warps: Vec<BounceWarp<'t>>,
    /// Whether all warps on the tape have finite coefficients.
    finite: bool,
}

/// Where adjoints of parameters go.
pub(crate) trait Sink {
    fn position(&mut self, index: u32, covector: DVec3);
    fn normal(&mut self, index: u32, covector: DVec3);
    /// Everything there is little of.
    fn rest(&mut self) -> &mut Tangent;
}

impl<'s, 't> Reverse<'s, 't> {
    pub(crate) fn new(
        scene: &'s Scene,
        inputs: &'s Inputs,
        tape: &'t Tape<Input>,
        auxiliary: Option<&'t mut Auxiliary<'s>>,
        film: FilmPlane,
    ) -> Self {
        Self { scene, inputs, tape, auxiliary, film, film_warp: None, warps: vec![], finite: true }
    }

    fn vector(&self, id: Input, value: DVec3, active: bool) -> Vec3<Recorded<'t>> {
        if active {
            let [x, y, z] = self.tape.inputs(id, value.to_array());
            Vec3::new(x, y, z)
        } else {
            Vec3::constant(value)
        }
    }

    /// The pose of a light, if poses are active.
    fn turn(&self, id: Input) -> Option<Vec3<Recorded<'t>>> {
        self.inputs.active.poses.then(|| self.vector(id, DVec3::ZERO, true))
    }

    fn rgb(&self, id: Input, value: DVec3, active: bool) -> Rgb<Recorded<'t>> {
        let Vec3 { x, y, z } = self.vector(id, value, active);
        Rgb([x, y, z])
    }

    /// Sweeps backwards from the outputs if all that is swept is finite, and says whether it is.
    pub(crate) fn sweep_if_finite(
        &self,
        outputs: &[(Recorded<'t>, f64)],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) -> bool {
        let finite = outputs.iter().all(|(output, adjoint)| (output.value() * adjoint).is_finite());
        let finite = self.finite && finite;
        if finite {
            self.tape.sweep(outputs, adjoints, |id, a, earlier| self.scatter(id, a, earlier, sink));
        }
        finite
    }

    /// Forgets all warps: what has been recorded with them is swept no more.
    pub(crate) fn forget_warps(&mut self) {
        self.film_warp = None;
        self.warps.clear();
        self.finite = true;
    }

    fn scatter(&self, id: Input, a: &[f64], earlier: &mut Adjoints<'_>, sink: &mut impl Sink) {
        let vector = || DVec3::new(a[0], a[1], a[2]);
        match id {
            Input::Position(i) => sink.position(i, vector()),
            Input::Normal(i) => sink.normal(i, vector()),
            Input::Reflectance(i) => sink.rest().reflectance[i as usize] += vector(),
            Input::Texel(t, i) => sink.rest().texels[t as usize][i as usize] += vector(),
            Input::Roughness(i) => sink.rest().roughness[i as usize] += a[0],
            Input::Radiance(i) => sink.rest().radiance[i as usize] += vector(),
            Input::Intensity(i) => sink.rest().intensity[i as usize] += vector(),
            Input::Pose(i) => sink.rest().pose[i as usize] += vector(),
            Input::Environment => sink.rest().environment += vector(),
            Input::EnvironmentRotation => sink.rest().environment_rotation += vector(),
            Input::Camera => {
                let camera = &mut sink.rest().camera;
                camera.translation += vector();
                camera.rotation += DVec3::new(a[3], a[4], a[5]);
                camera.field_of_view += a[6];
            }
            Input::FilmWarp => self.scatter_film(DVec2::new(a[0], a[1]), a[2], sink),
            Input::Warp(record) => {
                let BounceWarp { warping, origin } = &self.warps[record as usize];
                warping.scatter(vector(), a[3], |seen, covector| {
                    if seen.followed.is_nothing() {
                        return;
                    }
                    let c = seen.angular_transpose(covector);
                    self.scatter_hit(seen, c, sink);
                    earlier.add(origin.x, -c.x);
                    earlier.add(origin.y, -c.y);
                    earlier.add(origin.z, -c.z);
                });
            }
        }
    }

    fn scatter_film(&self, a: DVec2, b: f64, sink: &mut impl Sink) {
        let Some(warp) = &self.film_warp else { return };
        let camera = &self.scene.description.camera;
        warp.scatter(&self.film, camera, a, b, |seen, (relative, rotation, zoom)| {
            let mut translation = DVec3::ZERO;
            if !seen.followed.is_nothing() {
                self.scatter_hit(seen, relative / seen.distance, sink);
                translation = -relative / seen.distance;
            }
            if self.inputs.active.camera {
                let camera = &mut sink.rest().camera;
                camera.translation += translation;
                camera.rotation += rotation;
                camera.field_of_view += zoom;
            }
        });
    }

    fn scatter_hit(&self, seen: &FollowedPoint, covector: DVec3, sink: &mut impl Sink) {
        seen.followed.scatter(self.scene, covector, |i, covector| {
            if self.inputs.positions[i as usize] {
                sink.position(i, covector);
            }
        });
    }
}

impl<'t> Differential for Reverse<'_, 't> {
    fn film_warp(&mut self, u: DVec2, triangle: Option<u32>) -> FilmPoint<Recorded<'t>> {
        let constant = Recorded::constant;
        let still = FilmPoint { at: [constant(u.x), constant(u.y)], jacobian: constant(1.0) };
        let moves = self.inputs.active.camera;
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let Some(warp) = auxiliary.on_film(&self.film, u, triangle, moves) else { return still };
        self.finite &= warp.is_finite();
        self.film_warp = Some(warp);
        let [x, y, jacobian] = self.tape.inputs(Input::FilmWarp, [u.x, u.y, 1.0]);
        FilmPoint { at: [x, y], jacobian }
    }

    fn rng(&mut self) -> Option<&mut Stream> {
        self.auxiliary.as_mut().map(|a| &mut a.rng)
    }
}

impl<'t> Calculus for Reverse<'_, 't> {
    type Number = Recorded<'t>;

    fn position(&self, index: u32) -> Vec3<Recorded<'t>> {
        let i = index as usize;
        self.vector(Input::Position(index), self.scene.positions[i], self.inputs.positions[i])
    }

    fn normal(&self, index: u32) -> Vec3<Recorded<'t>> {
        let i = index as usize;
        self.vector(Input::Normal(index), self.scene.normals[i], self.inputs.normals[i])
    }

    fn reflectance(&self, material: usize, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(Input::Reflectance(material as u32), value, self.inputs.active.materials[material])
    }

    fn texel(&self, texture: usize, index: usize) -> Rgb<Recorded<'t>> {
        let value = self.scene.description.textures[texture].texels[index];
        self.rgb(Input::Texel(texture as u32, index as u32), value, self.inputs.textures[texture])
    }

    fn roughness(&self, material: usize, value: f64) -> Recorded<'t> {
        if self.inputs.active.materials[material] {
            self.tape.inputs(Input::Roughness(material as u32), [value])[0]
        } else {
            Recorded::constant(value)
        }
    }

    fn radiance(&self, shape: usize, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(Input::Radiance(shape as u32), value, self.inputs.active.lights)
    }

    fn intensity(&self, light: usize, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(Input::Intensity(light as u32), value, self.inputs.active.lights)
    }

    fn pose(&self, light: usize) -> Option<Vec3<Recorded<'t>>> {
        self.turn(Input::Pose(light as u32))
    }

    fn environment(&self, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(Input::Environment, value, self.inputs.active.lights)
    }

    fn environment_turn(&self) -> Option<Vec3<Recorded<'t>>> {
        self.turn(Input::EnvironmentRotation)
    }

    fn camera(&self) -> Option<CameraMotion<Recorded<'t>>> {
        self.inputs.active.camera.then(|| {
            let [x, y, z, a, b, c, field_of_view] = self.tape.inputs(Input::Camera, [0.0; 7]);
            CameraMotion { translation: Vec3::new(x, y, z), rotation: Vec3::new(a, b, c), field_of_view }
        })
    }

    fn wants_black(&self, material: usize) -> bool {
        self.inputs.active.materials[material]
    }

    fn beside(&mut self) -> Option<f64> {
        self.auxiliary.as_mut().map(|a| open01(&mut a.rng))
    }

    fn warp(
        &mut self,
        origin: Vec3<Recorded<'t>>,
        from: u32,
        direction: DVec3,
        kernel: Kernel,
    ) -> Warped<Recorded<'t>> {
        let constant = || Warped { direction: Vec3::constant(direction), jacobian: Recorded::constant(1.0) };
        let Some(auxiliary) = &mut self.auxiliary else { return constant() };
        let moves = origin.x.is_recorded() || origin.y.is_recorded() || origin.z.is_recorded();
        let stencil = auxiliary.on_sphere(origin.value(), from, direction, kernel, moves);
        let Some(stencil) = stencil else { return constant() };
        self.finite &= stencil.is_finite();
        self.warps.push(BounceWarp { warping: stencil, origin });
        let id = Input::Warp(self.warps.len() as u32 - 1);
        let [x, y, z, jacobian] = self.tape.inputs(id, [direction.x, direction.y, direction.z, 1.0]);
        Warped { direction: Vec3::new(x, y, z), jacobian }
    }
}
