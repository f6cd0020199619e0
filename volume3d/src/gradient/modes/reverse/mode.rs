//! Reverse mode: numbers recorded on a tape, and the propagation of their adjoints to parameters.

use std::cell::{Cell, RefCell};

use flatland::calculus::{Number, Rgb, Tape, Variable, Vec3};
use flatland::random::Stream;
use flatland::sdf::{Sdf as _, SecondOrder};
use glam::{DVec2, DVec3};

use crate::gradient::ActiveParameters;
use crate::gradient::auxiliary::Auxiliary;
use crate::gradient::chain::{self, Through};
use crate::gradient::film::{FilmPlane, FilmPoint};
use crate::gradient::modes::accumulator::Accumulator;
use crate::gradient::modes::border::border;
use crate::gradient::modes::differential::Differential;
use crate::gradient::parameters::rows::Rows;
use crate::gradient::warp::warps::{DirectionWarp, FilmWarp};
use crate::path::{BorderSample, Branch, Calculus, CameraMotion, Frame, Kernel, Warped};
use crate::scene::{Hit, Scene, Surface};

/// Input of a tape.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Input {
    /// A row of the parameter table: three numbers, or the first.
    Parameter(u32),
    /// Translation, rotation and field of view.
    Camera,
    /// The film point and the Jacobian of its warp.
    FilmWarp,
    /// A warped direction and the Jacobian of its warp, by the index of its record.
    Warp(u32),
    /// A point of an implicit surface and ∇φ there, by the index of its record.
    LevelSet(u32),
}

/// A number on the tape.
pub(crate) type Recorded<'t> = Variable<'t, Input>;

/// A warp at a bounce.
#[derive(Debug)]
pub(super) struct BounceWarp<'t> {
    pub(super) warp: DirectionWarp,
    pub(super) origin: Vec3<Recorded<'t>>,
}

/// A point of an implicit surface.
#[derive(Debug)]
pub(super) struct LevelSetPoint<'t> {
    pub(super) implicit: u32,
    pub(super) there: SecondOrder<DVec3>,
    pub(super) direction: DVec3,
    pub(super) x: Vec3<Recorded<'t>>,
}

/// Selection of the parameters that are inputs.
#[derive(Debug)]
pub(crate) struct Inputs {
    pub(crate) rows: Rows,
    pub(crate) active: ActiveParameters,
    /// Whether each texture's texels are active.
    pub(crate) textures: Vec<bool>,
    /// Whether each position is active.
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
        let rows = Rows::new(scene);
        Self { rows, active: active.clone(), textures: active.textures(scene), positions, normals }
    }
}

/// Calculus of numbers on the tape.
pub(crate) struct Reverse<'s, 't> {
    pub(crate) scene: &'s Scene,
    pub(crate) inputs: &'s Inputs,
    pub(crate) tape: &'t Tape<Input>,
    pub(super) auxiliary: Option<&'t mut Auxiliary<'s>>,
    pub(super) film_warp: Option<FilmWarp>,
    pub(super) warps: Vec<BounceWarp<'t>>,
    pub(super) level_sets: RefCell<Vec<LevelSetPoint<'t>>>,
    /// Whether all warps on the tape have finite coefficients.
    pub(super) finite: Cell<bool>,
}

impl<'s, 't> Reverse<'s, 't> {
    pub(crate) fn new(
        scene: &'s Scene,
        inputs: &'s Inputs,
        tape: &'t Tape<Input>,
        auxiliary: Option<&'t mut Auxiliary<'s>>,
    ) -> Self {
        Self {
            scene,
            inputs,
            tape,
            auxiliary,
            film_warp: None,
            warps: vec![],
            level_sets: RefCell::default(),
            finite: Cell::new(true),
        }
    }

    fn vector(&self, row: u32, value: DVec3, active: bool) -> Vec3<Recorded<'t>> {
        if active {
            let [x, y, z] = self.tape.inputs(Input::Parameter(row), value.to_array());
            Vec3::new(x, y, z)
        } else {
            Vec3::constant(value)
        }
    }

    /// A shift or turn, if it is active.
    fn turn(&self, row: u32, active: bool) -> Option<Vec3<Recorded<'t>>> {
        active.then(|| self.vector(row, DVec3::ZERO, true))
    }

    fn rgb(&self, row: u32, value: DVec3, active: bool) -> Rgb<Recorded<'t>> {
        let Vec3 { x, y, z } = self.vector(row, value, active);
        Rgb([x, y, z])
    }

    /// Sweeps backwards from the outputs if everything on the way is finite; returns whether it is.
    pub(crate) fn sweep_if_finite(
        &self,
        outputs: &[(Recorded<'t>, f64)],
        adjoints: &mut Vec<f64>,
        sums: &mut Accumulator,
    ) -> bool {
        let finite = outputs.iter().all(|(output, adjoint)| (output.value() * adjoint).is_finite());
        let finite = self.finite.get() && finite;
        if finite {
            self.tape.sweep(outputs, adjoints, |id, a, earlier| self.scatter(id, a, earlier, sums));
        }
        finite
    }

    /// Discards all warps; what was recorded with them is not swept again.
    pub(crate) fn forget_warps(&mut self) {
        self.film_warp = None;
        self.warps.clear();
        self.level_sets.get_mut().clear();
        self.finite.set(true);
    }
}

impl<'t> Differential for Reverse<'_, 't> {
    fn look(&mut self, scene: &Scene, origin: DVec3, direction: DVec3) -> Option<Hit> {
        match &mut self.auxiliary {
            Some(auxiliary) => auxiliary.look(origin, direction),
            None => scene.closest(origin, direction, None),
        }
    }

    fn film_warp(&mut self, film: &FilmPlane, u: DVec2, seen: Option<Surface>) -> FilmPoint<Recorded<'t>> {
        let constant = Recorded::constant;
        let still = FilmPoint { at: [constant(u.x), constant(u.y)], jacobian: constant(1.0) };
        let moves = self.inputs.active.camera;
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let Some(warp) = auxiliary.on_film(film, u, seen, moves) else { return still };
        self.finite.set(self.finite.get() && warp.is_finite());
        self.film_warp = Some(warp);
        let [x, y, jacobian] = self.tape.inputs(Input::FilmWarp, [u.x, u.y, 1.0]);
        FilmPoint { at: [x, y], jacobian }
    }

    fn chain_film_warp(
        &mut self,
        film: &FilmPlane,
        frame: &Frame<Recorded<'t>>,
        u: DVec2,
        through: Through<'_>,
    ) -> Option<FilmPoint<Recorded<'t>>> {
        let auxiliary = self.auxiliary.as_mut().filter(|a| a.follows_chains)?;
        let kernel = chain::Kernel { warp: auxiliary.warp, kappa: auxiliary.paths.kernels.film };
        let bundle = auxiliary.chain_bundle(u, kernel.kappa);
        let (warp, rays) = chain::on_film(self, self.scene, (film, frame), u, &bundle, kernel, through);
        self.auxiliary.as_mut()?.count(rays);
        let constant = Recorded::constant;
        let still = FilmPoint { at: [constant(u.x), constant(u.y)], jacobian: constant(1.0) };
        Some(warp.map_or(still, |warp| chain::film_point(u, &warp)))
    }

    fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool {
        self.auxiliary.as_ref().is_some_and(|auxiliary| auxiliary.may_warp(x, direction, kernel))
    }

    fn rng(&mut self) -> Option<&mut Stream> {
        self.auxiliary.as_mut().map(|a| &mut a.rng)
    }
}

impl<'t> Calculus for Reverse<'_, 't> {
    type Number = Recorded<'t>;

    fn next_hit(&mut self, scene: &Scene, x: DVec3, from: Surface, direction: DVec3) -> Option<Hit> {
        match &mut self.auxiliary {
            Some(auxiliary) => auxiliary.look_from(x, from, direction),
            None => scene.closest(x, direction, Some(from)),
        }
    }

    fn position(&self, index: u32) -> Vec3<Recorded<'t>> {
        let i = index as usize;
        self.vector(index, self.scene.positions[i], self.inputs.positions[i])
    }

    fn normal(&self, index: u32) -> Vec3<Recorded<'t>> {
        let i = index as usize;
        self.vector(self.inputs.rows.normal(index), self.scene.normals[i], self.inputs.normals[i])
    }

    fn level_set(
        &self,
        implicit: u32,
        x: Vec3<Recorded<'t>>,
        direction: DVec3,
    ) -> (Vec3<Recorded<'t>>, Vec3<Recorded<'t>>) {
        let at = x.value();
        let there = self.scene.implicits()[implicit as usize].second_order(at);
        let gradient = there.jet.gradient;
        let active = self.inputs.active.implicits[implicit as usize];
        if !active && [x.x, x.y, x.z].iter().all(|x| x.is_still()) {
            return (x, Vec3::constant(gradient));
        }
        // A ray tangent to the surface has no point on it that moves at finite speed.
        self.finite.set(self.finite.get() && gradient.dot(direction) != 0.0);
        let mut level_sets = self.level_sets.borrow_mut();
        level_sets.push(LevelSetPoint { implicit, there, direction, x });
        let id = Input::LevelSet(level_sets.len() as u32 - 1);
        let values = [at.x, at.y, at.z, gradient.x, gradient.y, gradient.z];
        let [x, y, z, a, b, c] = self.tape.inputs(id, values);
        (Vec3::new(x, y, z), Vec3::new(a, b, c))
    }

    fn reflectance(&self, material: usize, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(self.inputs.rows.reflectance(material), value, self.inputs.active.materials[material])
    }

    fn texel(&self, texture: usize, index: usize) -> Rgb<Recorded<'t>> {
        let value = self.scene.description.textures[texture].texels[index];
        self.rgb(self.inputs.rows.texel(texture, index), value, self.inputs.textures[texture])
    }

    fn roughness(&self, material: usize, value: f64) -> Recorded<'t> {
        if self.inputs.active.materials[material] {
            self.tape.inputs(Input::Parameter(self.inputs.rows.roughness(material)), [value])[0]
        } else {
            Recorded::constant(value)
        }
    }

    fn radiance(&self, shape: usize, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(self.inputs.rows.radiance(shape), value, self.inputs.active.lights)
    }

    fn intensity(&self, light: usize, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(self.inputs.rows.intensity(light), value, self.inputs.active.lights)
    }

    fn pose(&self, light: usize) -> Option<Vec3<Recorded<'t>>> {
        self.turn(self.inputs.rows.pose(light), self.inputs.active.poses[light])
    }

    fn light_turn(&self, light: usize) -> Option<Vec3<Recorded<'t>>> {
        self.turn(self.inputs.rows.light_rotation(light), self.inputs.active.poses[light])
    }

    fn environment(&self, value: DVec3) -> Rgb<Recorded<'t>> {
        self.rgb(self.inputs.rows.environment(), value, self.inputs.active.lights)
    }

    fn environment_turn(&self) -> Option<Vec3<Recorded<'t>>> {
        self.turn(self.inputs.rows.environment_turn(), self.inputs.active.environment_rotation)
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

    fn border(
        &mut self,
        origin: Vec3<Recorded<'t>>,
        from: Surface,
        shape: u32,
        kernel: impl FnOnce() -> Kernel,
    ) -> Option<BorderSample<Recorded<'t>>> {
        let paths = self.auxiliary.as_ref()?.paths;
        border(self, paths, origin, from, shape, kernel)
    }

    fn warps_light(&self) -> bool {
        self.auxiliary.as_ref().is_some_and(|auxiliary| auxiliary.warps_light())
    }

    fn levels_bounces(&self) -> bool {
        self.auxiliary.as_ref().is_some_and(|auxiliary| auxiliary.levels_bounces())
    }

    fn warp(
        &mut self,
        origin: Vec3<Recorded<'t>>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
    ) -> Warped<Recorded<'t>> {
        let constant = || Warped::still(direction);
        let Some(auxiliary) = &mut self.auxiliary else { return constant() };
        let moves = [origin.x, origin.y, origin.z].iter().any(|x| !x.is_still());
        let warp = auxiliary.on_sphere(origin.value(), from, direction, kernel, moves);
        let Some(warp) = warp else { return constant() };
        self.finite.set(self.finite.get() && warp.is_finite());
        self.warps.push(BounceWarp { warp, origin });
        let id = Input::Warp(self.warps.len() as u32 - 1);
        let [x, y, z, jacobian] = self.tape.inputs(id, [direction.x, direction.y, direction.z, 1.0]);
        Warped { direction: Vec3::new(x, y, z), jacobian }
    }

    fn follows_chains(&self) -> bool {
        self.auxiliary.as_ref().is_some_and(|auxiliary| auxiliary.follows_chains)
    }

    fn chain_warp(
        &mut self,
        origin: Vec3<Recorded<'t>>,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        chain: &[Branch],
        light: Option<usize>,
    ) -> Warped<Recorded<'t>> {
        let still = Warped::still(direction);
        let Some(auxiliary) = &mut self.auxiliary else { return still };
        let kernel = chain::Kernel { warp: auxiliary.warp, kappa: kernel.kappa };
        let bundle = auxiliary.chain_bundle(direction, kernel.kappa);
        let (start, through) = ((origin, from), Through { chain, light });
        let (warp, rays) = chain::on_sphere(self, self.scene, start, direction, &bundle, kernel, through);
        if let Some(auxiliary) = &mut self.auxiliary {
            auxiliary.count(rays);
        }
        warp.map_or(still, |warp| chain::warped(direction, &warp))
    }
}
