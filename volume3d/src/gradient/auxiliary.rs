//! Warps at a point: from what auxiliary rays hit, or from the jumps near by.

use std::cell::Cell;
use std::f64::consts::FRAC_PI_2;

use flatland::random::{Stream, open01};
use flatland::sdf::fields::MeanPoint;
use flatland::sdf::{End, Trace};
use flatland::warp::{Bundle, Domain, Plane, Stencil, Warp};
use glam::{DVec2, DVec3};

use super::film::FilmPlane;
use super::followed::FollowedPoint;
use super::implicit_field::ImplicitField;
use super::jump_mean::{
    AngularSupport, Cone, HalfSpace, JumpMean, Known, Listed, SceneEdges, Sight, Silhouettes, Subject, View,
    WIDEST,
};
use super::motion::MovingBounds;
use super::nearest_jump::{Jumps, Nearest, nearest_jump};
use super::rigid_motion::{Rigid, RigidMotion};
use super::warps::{DirectionWarp, FilmField, FilmWarp};
use crate::Sphere;
use crate::path::{Kernel, Paths, VisibilityDomain};
use crate::scene::{Hit, Surface, traced_by_this_thread};

/// What a mean over jumps takes, and each piece of an edge in it, relative to a ray: with 1 softened fields took 1.0 to 1.6 times as long
/// as a pilot thought in comparison with edge sampling, on figure 12's scenes, and with 2 it is 0.8 to 1.25 times.
const MEAN: f64 = 2.0;

/// What this thread has done so far, in rays: those it has traced, and means over jumps.
pub(crate) fn work(auxiliary: Option<&Auxiliary<'_>>) -> f64 {
    traced_by_this_thread() as f64 + MEAN * auxiliary.map_or(0.0, |auxiliary| auxiliary.work() as f64)
}

/// Where the velocities that make a field come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Construction {
    /// The mean over jumps near a direction: within so many pixels on the film, so many widths of the kernel elsewhere; softened by so many
    /// pixels on the film, and so many widths within lobes. Towards lights there is none if shadows are sampled as curves. Implicit surfaces give to it what their
    /// field says.
    JumpMean {
        film: f64,
        lobe: f64,
        softness: f64,
        lobe_softness: f64,
        sampled_shadows: bool,
        implicit: ImplicitField,
    },
    /// Weighted with regard to boundaries. On directions velocities fade away from jumps, V_i (1 − B_i).
    Weighted,
    /// One rigid motion per kernel, that of the nearest of so many points.
    Followed { candidates: usize },
}

/// Who makes warps, and traces auxiliary rays for them.
#[derive(Debug)]
pub(crate) struct Auxiliary<'s> {
    pub(crate) paths: &'s Paths<'s>,
    pub(crate) warp: &'s Warp,
    pub(crate) moving: &'s MovingBounds,
    pub(crate) construction: Construction,
    /// The edges of the scene, for fields that are made of them.
    pub(crate) edges: Option<&'s SceneEdges>,
    pub(crate) rng: Stream,
    /// Whether film points come in no order, so that silhouettes near one are of no use for the next.
    pub(crate) scattered: bool,
    rays: u64,
    work: u64,
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
    near: Near,
    /// Caps that were made last, within lobes, towards lights and on the film: those of one shading point are alike.
    supports: [Cell<AngularSupport>; 3],
    /// Memory for rays at implicit surfaces.
    trace: Trace<DVec3>,
    ahead: Ahead,
}

/// Places of the caps that were made last.
const WITHIN_LOBE: usize = 0;
const TOWARDS_LIGHT: usize = 1;
const ON_FILM: usize = 2;

/// The ray that was looked along last, and what was found of it at implicit surfaces.
#[derive(Debug)]
struct Ahead {
    origin: DVec3,
    direction: DVec3,
    /// For each surface, if it is a ray of the camera that passes all meshes.
    points: Vec<MeanPoint<DVec3>>,
    /// If it leaves a surface, whether that keeps away.
    leaves: Option<bool>,
}

impl Ahead {
    fn nothing() -> Self {
        Self { origin: DVec3::ZERO, direction: DVec3::ZERO, points: vec![], leaves: None }
    }

    /// Another ray, of which nothing is known yet.
    fn begin(&mut self, origin: DVec3, direction: DVec3) {
        (self.origin, self.direction, self.leaves) = (origin, direction, None);
        self.points.clear();
    }

    /// What is known of a ray.
    fn of(&self, origin: DVec3, direction: DVec3) -> Known<'_> {
        if (origin, direction) != (self.origin, self.direction) {
            return Known::Nothing;
        }
        match self.leaves {
            Some(keeps_away) => Known::Leaves(keeps_away),
            None if self.points.is_empty() => Known::Nothing,
            None => Known::Points(&self.points),
        }
    }
}

/// The silhouettes that the camera sees near a direction, as they were last looked up.
#[derive(Debug)]
struct Near {
    direction: DVec3,
    /// By how much a direction may differ, as a chord.
    margin: f64,
    edges: Listed,
}

impl<'s> Auxiliary<'s> {
    pub(crate) fn new(
        paths: &'s Paths<'s>,
        warp: &'s Warp,
        moving: &'s MovingBounds,
        construction: Construction,
        edges: Option<&'s SceneEdges>,
        rng: Stream,
    ) -> Self {
        Self {
            paths,
            warp,
            moving,
            construction,
            edges,
            rng,
            scattered: false,
            rays: 0,
            work: 0,
            directions: vec![],
            hits: vec![],
            near: Near { direction: DVec3::ZERO, margin: 0.0, edges: Listed::default() },
            supports: [const { Cell::new(AngularSupport::NONE) }; 3],
            trace: Trace { direction: DVec3::ZERO, points: vec![], end: End::Miss },
            ahead: Ahead::nothing(),
        }
    }

    /// How many rays have been traced.
    pub(crate) fn rays(&self) -> u64 {
        self.rays
    }

    /// What means over jumps took: how many have been made, and pieces of edges in them.
    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    /// Whether there may be a warp at direction ω as seen from x on a surface, if x stands still.
    pub(crate) fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool {
        match self.construction {
            Construction::JumpMean { .. } => {
                self.reach(kernel).is_some_and(|reach| self.moving.may_be_near(x, direction, reach))
            }
            Construction::Weighted | Construction::Followed { .. } => true,
        }
    }

    /// Whether there may be a warp towards a light that is chosen.
    pub(crate) fn warps_light(&self) -> bool {
        !matches!(self.construction, Construction::JumpMean { sampled_shadows: true, .. })
    }

    /// How far away edges count in the mean over jumps; nothing if that is none.
    fn reach(&self, kernel: &Kernel) -> Option<AngularSupport> {
        let Construction::JumpMean { lobe, lobe_softness, .. } = self.construction else {
            return None;
        };
        if kernel.of_light && !self.warps_light() {
            return None;
        }
        let width = 1.0 / kernel.kappa.sqrt();
        let softness = if kernel.of_light { 0.0 } else { lobe_softness * width };
        let place = if kernel.of_light { TOWARDS_LIGHT } else { WITHIN_LOBE };
        Some(self.support(place, lobe * width).softened(softness))
    }

    /// A cap with an angular radius, which is likely the last one there was for what it is for.
    fn support(&self, place: usize, angle: f64) -> AngularSupport {
        let last = &self.supports[place];
        if last.get().angle != angle.min(WIDEST) {
            last.set(AngularSupport::new(angle));
        }
        last.get()
    }

    /// The warp at direction ω as seen from x on a surface; nothing where nothing seen can move.
    pub(crate) fn on_sphere(
        &mut self,
        x: DVec3,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        x_moves: bool,
    ) -> Option<DirectionWarp> {
        let kappa = kernel.kappa;
        if let Construction::JumpMean { .. } = self.construction {
            let reach = self.reach(&kernel)?;
            let mean = self.jump_mean_on_sphere(x, from, direction, kernel, reach, x_moves)?;
            self.work += mean.work();
            return Some(DirectionWarp::JumpMean(mean));
        }
        if let Construction::Followed { candidates } = self.construction {
            // As for weights: what is below the horizon is inside a solid, and arbitrarily near.
            let keep =
                |d: DVec3, distance| kernel.normal.dot(d) > 0.0 && kernel.domain.counts(x, d, distance);
            let motion =
                self.follow::<Sphere>(x, Some(from), direction, kappa, candidates, x_moves, |d| d, keep);
            return motion.map(DirectionWarp::Rigid);
        }
        self.weighted_on_sphere(x, from, direction, kernel, x_moves)
    }

    /// The same from rays around ω, with velocities that fade away from jumps, V_i (1 − B_i).
    ///
    /// Fading costs nothing, and wins little: without it the relative variance at equal time is within 2 % (forward, 8
    /// samples a pixel, debiased) of a sphere that moves over a plane, 20 thin prisms that turn and a block in a closed box.
    fn weighted_on_sphere(
        &mut self,
        x: DVec3,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        x_moves: bool,
    ) -> Option<DirectionWarp> {
        let Kernel { kappa, normal, domain, .. } = kernel;
        let (scene, warp) = (self.paths.scene, self.warp);
        let jumps = match domain {
            VisibilityDomain::Radiance => Jumps::Radiance,
            VisibilityDomain::Distant => Jumps::Visibility { light: None },
            VisibilityDomain::BeforePlane { shape, .. } => Jumps::Visibility { light: Some(shape) },
        };
        let bundle: Bundle<Sphere> = warp.bundle(direction, kappa, &mut self.rng);
        let (face, rounding) = (self.upward(from, x, normal), scene.rounding());
        let sight = |direction: DVec3, hit: Option<Hit>| {
            let hit = hit.filter(|h| normal.dot(direction) > 0.0 && domain.counts(x, direction, h.distance));
            let nearest = hit.map_or(NOWHERE, |h| nearest_jump(scene, &h, x, direction, jumps));
            // With shading normals rays may go below the face, and leave the solid at once through the next one: what
            // they see ends at the face's horizon.
            let height = face.dot(direction);
            let own = |h: Hit| scene.shape_of(h.surface) == scene.shape_of(from);
            let below = height < 0.0 && hit.is_some_and(own);
            let distance = if below { nearest.angle.min(-height) } else { nearest.angle };
            let falloff = warp.falloff(distance, kappa);
            let seen = FollowedPoint::by_ray(scene, hit, x, direction, falloff);
            // The directions of edges this near are known to rounding over their distance.
            let tolerance = 1e-6 * height.abs() + 10.0 * rounding / seen.distance;
            let ends_at_horizon = (distance - height.abs()).abs() <= tolerance;
            let seen = if ends_at_horizon { seen } else { seen.or_crossing(nearest, falloff) };
            (FollowedPoint { horizon: ends_at_horizon.then_some(face), ..seen }, distance)
        };
        let stencil = self.weighted(bundle, kappa, x, Some(from), x_moves, |d| d, sight)?;
        Some(DirectionWarp::Rays(stencil))
    }

    /// The stencil of a bundle of rays and those it asks for; nothing where none of the first may see anything that
    /// moves.
    ///
    /// A ray that misses all that moves says nothing about where more are needed: no velocity changes at what it sees. So
    /// where rays adapt, forward and reverse may draw different ones, as other things move.
    #[expect(clippy::too_many_arguments, reason = "as `follow`")]
    fn weighted<D: Domain>(
        &mut self,
        mut bundle: Bundle<D>,
        kappa: f64,
        origin: DVec3,
        from: Option<Surface>,
        origin_moves: bool,
        ray: impl Fn(D::Vector) -> DVec3,
        sight: impl Fn(DVec3, Option<Hit>) -> (FollowedPoint, f64),
    ) -> Option<Stencil<D, FollowedPoint>> {
        let mut seen: Vec<(FollowedPoint, f64)> = vec![];
        let mut matters: Vec<bool> = vec![];
        loop {
            // Rays that no one has needed yet are traced with the next ones, if those are needed.
            self.directions.clear();
            self.directions.extend(bundle.points().skip(seen.len()).map(&ray));
            let known = matters.len();
            let fresh = &self.directions[known - seen.len()..];
            matters.extend(fresh.iter().map(|&d| origin_moves || self.moving.may_be_hit(origin, d)));
            if matters.contains(&true) {
                self.rays += self.directions.len() as u64;
                self.paths.scene.closest_bundle(origin, &self.directions, from, &mut self.hits);
                seen.extend(self.directions.iter().zip(&self.hits).map(|(&d, &hit)| sight(d, hit)));
            }
            let distances =
                (known..matters.len()).map(|i| if matters[i] { seen[i].1 } else { f64::INFINITY });
            if !self.warp.grow(&mut bundle, kappa, distances, &mut self.rng) {
                break;
            }
        }
        matters.contains(&true).then(|| self.warp.stencil_of(bundle, kappa, seen))
    }

    /// What the camera sees along a ray. The field of implicit surfaces follows the ray as soon as one of them or the camera moves, and its end is
    /// what is seen. So it is whatever moves: images must not depend on that, to the bit.
    pub(crate) fn look(&mut self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let scene = self.paths.scene;
        self.ahead.begin(origin, direction);
        if let Some(field @ ImplicitField::Vicini { .. }) = self.field_of_implicits()
            && scene.passes_meshes(origin, direction)
        {
            let sight = Sight { origin, from: None, plane: None, field, known: Known::Nothing };
            if let Some(hit) = sight.meet(scene, direction, &mut self.ahead.points) {
                return hit;
            }
            self.ahead.points.clear();
        }
        scene.closest(origin, direction, None)
    }

    /// What a ray meets that leaves a surface. Where the field has to know whether the surface keeps away from the ray, the ray does not hit it if so.
    pub(crate) fn look_from(&mut self, x: DVec3, from: Surface, direction: DVec3) -> Option<Hit> {
        let scene = self.paths.scene;
        let mut clear = None;
        if let Some(ImplicitField::Vicini { reach }) = self.field_of_implicits()
            && self.moving.implicit
            && let Surface::Implicit(implicit) = from
        {
            let part = (scene.leaving(implicit), scene.far_of(implicit, x));
            let keeps_away = scene.keeps_away(implicit, (x, direction), part, reach);
            self.ahead.begin(x, direction);
            self.ahead.leaves = Some(keeps_away);
            clear = keeps_away.then_some(implicit);
        }
        scene.closest_beside(x, direction, Some(from), clear)
    }

    /// The warp at a point of the film, at which a surface or nothing is seen; nothing where nothing seen can move.
    pub(crate) fn on_film(
        &mut self,
        film: &FilmPlane,
        u: DVec2,
        seen: Option<Surface>,
        camera_moves: bool,
    ) -> Option<FilmWarp> {
        let kappa = self.paths.kernels.film;
        let ray = |p: DVec2| film.ray(p);
        let origin = film.still.origin.value();
        let field = match self.construction {
            Construction::JumpMean { film: radius, softness, .. } => {
                let [radius, softness] = [radius, softness].map(|pixels| pixels * film.pixel_angle());
                let reach = self.support(ON_FILM, radius).softened(softness);
                let direction = ray(u);
                let from_one_place = !film.has_lens() && !self.scattered;
                let mean = self.jump_mean_on_film(
                    origin,
                    direction,
                    (reach, softness),
                    seen,
                    camera_moves,
                    from_one_place,
                )?;
                self.work += mean.work();
                FilmField::JumpMean(mean, direction)
            }
            Construction::Followed { candidates } => {
                let everything = |_, _| true;
                let motion =
                    self.follow::<Plane>(origin, None, u, kappa, candidates, camera_moves, ray, everything);
                FilmField::Rigid(motion?)
            }
            Construction::Weighted => {
                FilmField::Rays(self.weighted_on_film(film, u, kappa, ray, camera_moves)?)
            }
        };
        Some(FilmWarp { field, film: *film })
    }

    /// The same from rays around the film point u. On the film, where the filter is hardly wider than the kernel, velocities
    /// do not fade.
    fn weighted_on_film(
        &mut self,
        film: &FilmPlane,
        u: DVec2,
        kappa: f64,
        ray: impl Fn(DVec2) -> DVec3,
        camera_moves: bool,
    ) -> Option<Stencil<Plane, FollowedPoint>> {
        let (scene, warp) = (self.paths.scene, self.warp);
        let origin = film.still.origin.value();
        let bundle: Bundle<Plane> = self.warp.bundle(u, kappa, &mut self.rng);
        let sight = |direction: DVec3, hit: Option<Hit>| {
            let nearest = hit.map_or(NOWHERE, |h| {
                let jumps = Jumps::Radiance;
                nearest_jump(scene, &h, origin, direction, jumps)
            });
            let distance = film.scale(direction) * nearest.angle;
            let seen = FollowedPoint::by_ray(scene, hit, origin, direction, 1.0);
            (seen.or_crossing(nearest, warp.falloff(distance, kappa)), distance)
        };
        self.weighted(bundle, kappa, origin, None, camera_moves, ray, sight)
    }

    fn jump_mean_on_film(
        &mut self,
        origin: DVec3,
        direction: DVec3,
        (reach, softness): (AngularSupport, f64),
        seen: Option<Surface>,
        camera_moves: bool,
        from_one_place: bool,
    ) -> Option<JumpMean> {
        if !camera_moves && !self.moving.may_be_near(origin, direction, reach) {
            return None;
        }
        if !from_one_place {
            // No two samples look from the same point of a lens, or at the same pixel.
            self.near.margin = -1.0;
        } else {
            self.gather(origin, direction, reach)?;
        }
        let (scene, tree) = (self.paths.scene, self.edges?);
        let triangle = seen.and_then(Surface::triangle);
        let front = triangle.map(|t| self.front(tree.plane(t), origin));
        let border_softness = triangle.map_or(0.0, |t| tree.border_softness(t, origin, softness));
        let subject = Subject::Radiance(triangle);
        let rounding = self.paths.scene.rounding();
        let view = View { origin, planes: front.as_slice(), subject, left: None, border_softness, rounding };
        let field = self.implicit_field();
        let known = if triangle.is_none() { self.ahead.of(origin, direction) } else { Known::Nothing };
        let sight = Sight { origin, from: None, plane: triangle.map(|t| self.plane_of(t)), field, known };
        let silhouettes =
            if from_one_place { Silhouettes::Listed(&self.near.edges) } else { Silhouettes::All };
        JumpMean::new(scene, tree, silhouettes, &view, direction, reach, &sight, &mut self.trace)
    }

    /// Samples of one pixel look along nearly one direction: silhouettes around it are looked up once for them all.
    fn gather(&mut self, origin: DVec3, direction: DVec3, reach: AngularSupport) -> Option<()> {
        let tree = self.edges?;
        let moved = (direction - self.near.direction).length();
        // Angles are at most π/2 times their chords, of which these are small.
        if moved > self.near.margin {
            let margin = 2.0 * reach.versine.sqrt();
            // A cap that would be too wide is looked up for each direction.
            let margin = if reach.angle + FRAC_PI_2 * margin > WIDEST { 0.0 } else { margin };
            let wide = AngularSupport::new(reach.angle + FRAC_PI_2 * margin);
            let cone = Cone {
                origin,
                axis: direction,
                reach: wide,
                planes: &[],
                rounding: self.paths.scene.rounding(),
            };
            self.near.edges.clear();
            tree.for_each(&cone, |edge| self.near.edges.push(edge, origin));
            (self.near.direction, self.near.margin) = (direction, margin);
        }
        Some(())
    }

    fn jump_mean_on_sphere(
        &mut self,
        x: DVec3,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        reach: AngularSupport,
        x_moves: bool,
    ) -> Option<JumpMean> {
        if !x_moves && !self.moving.may_be_near(x, direction, reach) {
            return None;
        }
        // What lies in the plane of the horizon is not above it.
        let horizon = HalfSpace { normal: kernel.normal, point: x, slack: -self.paths.scene.rounding() };
        let (scene, tree) = (self.paths.scene, self.edges?);
        let (subject, plane, end) = match kernel.domain {
            VisibilityDomain::Distant => (Subject::Cover, None, None),
            VisibilityDomain::Radiance => {
                let triangle = kernel.surface.and_then(Surface::triangle);
                let front = triangle.map(|t| self.front(tree.plane(t), x));
                (Subject::Radiance(triangle), front, triangle.map(|t| self.plane_of(t)))
            }
            VisibilityDomain::BeforePlane { normal, offset, shape } => {
                // Hardly more than rounding: the border of the light's own back, a little behind it, moves with it, and
                // a field that followed it would have to turn between it and what hides the border.
                let slack = 1e4 * self.paths.scene.rounding();
                let plane = HalfSpace { normal, point: offset * normal, slack };
                (Subject::CoverOf(shape), Some(plane), Some((normal, offset)))
            }
        };
        let planes = [horizon, plane.unwrap_or(horizon)];
        let planes = &planes[..1 + usize::from(plane.is_some())];
        let left = from.triangle().map(|t| tree.plane(t));
        let rounding = self.paths.scene.rounding();
        let view = View { origin: x, planes, subject, left, border_softness: 0.0, rounding };
        let known = self.ahead.of(x, direction);
        let sight = Sight { origin: x, from: Some(from), plane: end, field: self.implicit_field(), known };
        let trace = &mut self.trace;
        JumpMean::new(scene, tree, Silhouettes::All, &view, direction, reach, &sight, trace)
    }

    /// The field of implicit surfaces within the mean over jumps.
    fn implicit_field(&self) -> ImplicitField {
        self.field_of_implicits().unwrap_or_default()
    }

    /// The same, if there are any and it is made of their tracer's points.
    fn field_of_implicits(&self) -> Option<ImplicitField> {
        match self.construction {
            Construction::JumpMean { implicit, .. } if !self.paths.scene.description.implicits.is_empty() => {
                Some(implicit)
            }
            Construction::JumpMean { .. } | Construction::Weighted | Construction::Followed { .. } => None,
        }
    }

    /// The side of a triangle's plane on which the viewer is.
    fn front(&self, triangle: u32, viewer: DVec3) -> HalfSpace {
        let [point, ..] = self.paths.scene.corners(triangle);
        let normal = self.upward(Surface::Triangle(triangle), point, viewer - point);
        // What touches a plane counts as before it, and what does so by the rounding of meshes in single precision as well:
        // 10⁻⁶ of the scene. Edges that are behind the plane are hidden, and do no harm.
        HalfSpace { normal, point, slack: 1e7 * self.paths.scene.rounding() }
    }

    /// The plane {y: n·y = d} of a triangle.
    fn plane_of(&self, triangle: u32) -> (DVec3, f64) {
        let normal = self.paths.scene.face_normal(triangle);
        (normal, normal.dot(self.paths.scene.corners(triangle)[0]))
    }

    /// The unit normal of a surface at a point of it, on the side of another vector.
    fn upward(&self, surface: Surface, at: DVec3, side: DVec3) -> DVec3 {
        let normal = self.paths.scene.normal_of(surface, at);
        if normal.dot(side) < 0.0 { -normal } else { normal }
    }

    /// The nearest of some points of a kernel around μ, which is drawn from the kernel around u: what is nearest
    /// hides the rest, and its edge is the one that is seen.
    #[expect(clippy::too_many_arguments, reason = "a ray's origin and the kernel's place are told apart")]
    fn follow<D: Rigid>(
        &mut self,
        origin: DVec3,
        from: Option<Surface>,
        u: D::Vector,
        kappa: f64,
        candidates: usize,
        origin_moves: bool,
        ray: impl Fn(D::Vector) -> DVec3,
        keep: impl Fn(DVec3, f64) -> bool,
    ) -> Option<RigidMotion<D>> {
        let mut draw = |at| {
            let xi = [open01(&mut self.rng), open01(&mut self.rng)];
            D::draw(at, kappa, 1.0, xi).point
        };
        let centre = draw(u);
        let points: Vec<D::Vector> = (0..candidates).map(|_| draw(centre)).collect();
        self.directions.clear();
        self.directions.extend(points.iter().map(|&p| ray(p)));
        if !self.trace(origin, from, origin_moves) {
            return None;
        }
        let nearest = (0..candidates).filter_map(|i| Some((i, self.hits[i]?)));
        let nearest = nearest.filter(|(i, hit)| keep(self.directions[*i], hit.distance));
        let (i, hit) = nearest.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
        let seen = FollowedPoint::by_ray(self.paths.scene, Some(hit), origin, self.directions[i], 1.0);
        let slope = D::project(u, centre - u) * kappa;
        Some(RigidMotion { point: u, at: points[i], seen, slope })
    }

    fn trace(&mut self, origin: DVec3, from: Option<Surface>, origin_moves: bool) -> bool {
        if !origin_moves && !self.directions.iter().any(|&d| self.moving.may_be_hit(origin, d)) {
            return false;
        }
        self.rays += self.directions.len() as u64;
        self.paths.scene.closest_bundle(origin, &self.directions, from, &mut self.hits);
        true
    }
}

/// The nearest jump to a ray that leaves the scene.
const NOWHERE: Nearest = Nearest { angle: f64::INFINITY, crossing: None };
