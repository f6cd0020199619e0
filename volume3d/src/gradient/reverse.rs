//! Reverse mode: numbers that record themselves, and the scatter of their adjoints to parameters.

use std::cell::RefCell;

use flatland::random::open01;
use glam::{DVec2, DVec3};

use super::auxiliary::Auxiliary;
use super::film::FilmPlane;
use super::followed::FollowedPoint;
use super::warps::{DirectionWarp, FilmWarp};
use super::{ActiveParameters, Tangent};
use crate::calculus::{Adjoints, Calculus, Frame, Kernel, Number, Rgb, Tape, Variable, Vec3, Warped};
use crate::scene::{Environment, Light, Scene};

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
    pub(crate) auxiliary: Option<Auxiliary<'s>>,
    pub(crate) film: FilmPlane,
    film_warp: Option<FilmWarp>,
    warps: RefCell<Vec<BounceWarp<'t>>>,
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
        auxiliary: Option<Auxiliary<'s>>,
        film: FilmPlane,
    ) -> Self {
        Self {
            scene,
            inputs,
            tape,
            auxiliary,
            film,
            film_warp: None,
            warps: RefCell::default(),
            finite: true,
        }
    }

    fn vector(&self, id: Input, value: DVec3, active: bool) -> Vec3<Recorded<'t>> {
        if active {
            let [x, y, z] = self.tape.inputs(id, value.to_array());
            Vec3::new(x, y, z)
        } else {
            Vec3::constant(value)
        }
    }

    fn rgb(&self, id: Input, value: DVec3, active: bool) -> Rgb<Recorded<'t>> {
        let Vec3 { x, y, z } = self.vector(id, value, active);
        Rgb([x, y, z])
    }

    /// The camera's frame.
    pub(crate) fn frame(&self) -> Frame<Recorded<'t>> {
        let camera = &self.scene.description.camera;
        let still = self.film.frame(camera);
        let constant = |v: Vec3<f64>| Vec3::constant(v.value());
        if !self.inputs.active.camera {
            return Frame {
                origin: constant(still.origin),
                right: constant(still.right),
                up: constant(still.up),
                forward: constant(still.forward),
                focal: Recorded::constant(still.focal),
            };
        }
        let [ox, oy, oz, wx, wy, wz, zoom] =
            self.tape.inputs(Input::Camera, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let shift = Vec3::new(ox, oy, oz);
        let turn = Vec3::new(wx, wy, wz);
        let turned = |axis: DVec3| Vec3::constant(axis) + turn.cross(Vec3::constant(axis));
        Frame {
            origin: Vec3::constant(camera.origin) + shift,
            right: turned(camera.right),
            up: turned(camera.up),
            forward: turned(camera.forward),
            focal: Recorded::constant(still.focal) + zoom * self.film.focal_rate(camera),
        }
    }

    /// The warp at a point of the film, at which a triangle or nothing is seen.
    pub(crate) fn film_warp(
        &mut self,
        u: DVec2,
        kappa: f64,
        triangle: Option<u32>,
    ) -> ([Recorded<'t>; 2], Recorded<'t>) {
        let constant = Recorded::constant;
        let still = ([constant(u.x), constant(u.y)], constant(1.0));
        let moves = self.inputs.active.camera;
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let Some(warp) = auxiliary.on_film(&self.film, u, kappa, triangle, moves) else { return still };
        self.finite &= warp.is_finite();
        self.film_warp = Some(warp);
        let [x, y, jacobian] = self.tape.inputs(Input::FilmWarp, [u.x, u.y, 1.0]);
        ([x, y], jacobian)
    }

    /// Sweeps if all that is swept is finite, and says whether it is.
    pub(crate) fn sweep_if_finite(
        &mut self,
        outputs: &[(Recorded<'t>, f64)],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) -> bool {
        let finite = outputs.iter().all(|(output, adjoint)| (output.value() * adjoint).is_finite());
        let finite = std::mem::replace(&mut self.finite, true) && finite;
        if finite {
            self.sweep(outputs, adjoints, sink);
        }
        finite
    }

    /// Sweeps backwards from the outputs, and empties the tape's records of warps.
    pub(crate) fn sweep(
        &mut self,
        outputs: &[(Recorded<'t>, f64)],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) {
        self.tape.sweep(outputs, adjoints, |id, a, earlier| self.scatter(id, a, earlier, sink));
        self.film_warp = None;
        self.warps.get_mut().clear();
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
                let warps = self.warps.borrow();
                let BounceWarp { warping, origin } = &warps[record as usize];
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

    fn place(&self, light: usize, value: DVec3) -> Vec3<Recorded<'t>> {
        let active = self.inputs.active.poses;
        match self.scene.description.lights[light] {
            Light::Point { .. } => self.vector(Input::Pose(light as u32), value, active),
            Light::Directional { .. } => {
                let turn = self.vector(Input::Pose(light as u32), DVec3::ZERO, active);
                Vec3::constant(value) + turn.cross(Vec3::constant(value))
            }
        }
    }

    fn environment(&self, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(Input::Environment, value, self.inputs.active.lights)
    }

    fn environment_direction(&self, direction: Vec3<Recorded<'t>>) -> Vec3<Recorded<'t>> {
        let Some(Environment::Map { to_world, .. }) = &self.scene.description.environment else {
            return direction;
        };
        let turn = self.vector(Input::EnvironmentRotation, DVec3::ZERO, self.inputs.active.poses);
        let axis = |a: DVec3| (Vec3::constant(a) + turn.cross(Vec3::constant(a))).dot(direction);
        Vec3::new(axis(to_world.x_axis), axis(to_world.y_axis), axis(to_world.z_axis))
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
        let warps = self.warps.get_mut();
        warps.push(BounceWarp { warping: stencil, origin });
        let id = Input::Warp(warps.len() as u32 - 1);
        let [x, y, z, jacobian] = self.tape.inputs(id, [direction.x, direction.y, direction.z, 1.0]);
        Warped { direction: Vec3::new(x, y, z), jacobian }
    }
}
