//! Auxiliary rays in a scene: what they hit, and the stencils they make.

use flatland::random::{Stream, open01};
use flatland::warp::{Bundle, Plane, Warp};
use glam::{DVec2, DVec3};

use super::rigid::{Following, Rigid, Warping};
use crate::Sphere;
use crate::calculus::{Kernel, Sees};
use crate::geometry::{Hit, Jumps};
use crate::path::{Paths, SHORT};
use crate::scene::Scene;

/// What an auxiliary ray of a bounce hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// The triangle and the weights of its corners; nothing where the ray leaves the scene.
    pub(crate) hit: Option<Hit>,
    /// The ray's direction.
    pub(crate) direction: DVec3,
    /// 1 − B: velocities may fade away from jumps, and the field stays continuous and consistent.
    pub(crate) nearness: f64,
}

impl Seen {
    /// The corners of what was hit, with their weights.
    pub(crate) fn corners(&self, scene: &Scene) -> Option<[(u32, f64); 3]> {
        let hit = self.hit?;
        let corners = scene.triangles[hit.triangle as usize].positions;
        Some(std::array::from_fn(|k| (corners[k], hit.barycentric[k])))
    }
}

/// Boxes around everything that moves. A bundle that misses them all sees no motion, and need not be traced if
/// its origin stands still.
#[derive(Clone, Debug, Default)]
pub(crate) struct MovingBounds {
    boxes: Vec<(DVec3, DVec3)>,
}

/// More boxes than this are one box.
const MOST_BOXES: usize = 8;

impl MovingBounds {
    /// Of the shapes that move.
    pub(crate) fn new(scene: &Scene, moves: &[bool]) -> Self {
        let mut boxes: Vec<(DVec3, DVec3)> = vec![];
        for shape in (0..moves.len()).filter(|&s| moves[s]) {
            let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for p in &scene.positions[scene.position_range(shape)] {
                (low, high) = (low.min(*p), high.max(*p));
            }
            if low.x <= high.x {
                // The slab test's own rounding must not lose a ray.
                let margin =
                    1e-9 * (high - low).max_element() + 1e-12 * high.abs().max(low.abs()).max_element();
                boxes.push((low - margin, high + margin));
            }
        }
        if boxes.len() > MOST_BOXES {
            let all = boxes
                .iter()
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), b| (l.min(b.0), h.max(b.1)));
            boxes = vec![all];
        }
        Self { boxes }
    }

    pub(crate) fn may_be_hit(&self, origin: DVec3, direction: DVec3) -> bool {
        let inverse = direction.recip();
        self.boxes.iter().any(|&(low, high)| {
            let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
            // NaN arises where a ray runs within a face of the box: max and min then drop it.
            let (near, far) = (a.min(b), a.max(b));
            near.x.max(near.y).max(near.z).max(0.0) <= far.x.min(far.y).min(far.z)
        })
    }
}

/// How the velocities of what auxiliary rays see become a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Construction {
    /// Weighted with regard to boundaries; velocities fade away from jumps, or do not.
    Weighted { fades: bool },
    /// One rigid motion per kernel, that of the nearest of so many points.
    Followed { candidates: usize },
}

/// Who traces auxiliary rays.
#[derive(Debug)]
pub(crate) struct Auxiliary<'s> {
    pub(crate) paths: &'s Paths<'s>,
    pub(crate) warp: &'s Warp,
    pub(crate) moving: &'s MovingBounds,
    pub(crate) construction: Construction,
    pub(crate) rng: Stream,
    /// How many rays have been traced.
    pub(crate) rays: u64,
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
}

impl<'s> Auxiliary<'s> {
    pub(crate) fn new(
        paths: &'s Paths<'s>,
        warp: &'s Warp,
        moving: &'s MovingBounds,
        construction: Construction,
        rng: Stream,
    ) -> Self {
        Self { paths, warp, moving, construction, rng, rays: 0, directions: vec![], hits: vec![] }
    }

    /// The stencil at direction ω as seen from x on a triangle; nothing where nothing seen can move.
    pub(crate) fn on_sphere(
        &mut self,
        x: DVec3,
        from: u32,
        direction: DVec3,
        kernel: Kernel,
        x_moves: bool,
    ) -> Option<Warping<Sphere>> {
        let kappa = kernel.kappa;
        if let Construction::Followed { candidates } = self.construction {
            return self.follow::<Sphere>(x, Some(from), direction, kappa, candidates, x_moves, |d| d);
        }
        let fades = self.construction == Construction::Weighted { fades: true };
        let bundle: Bundle<Sphere> = self.warp.bundle(direction, kappa, &mut self.rng);
        self.directions.clear();
        self.directions.extend(bundle.points());
        if !self.trace(x, Some(from), x_moves) {
            return None;
        }
        let scene = self.paths.scene;
        let hits = self
            .directions
            .iter()
            .zip(&self.hits)
            .map(|(&direction, &hit)| {
                let hit = hit.filter(|h| {
                    kernel.normal.dot(direction) > 0.0 && counts(kernel.sees, x, direction, h.distance)
                });
                let jumps = match kernel.sees {
                    Sees::Radiance => Jumps::Radiance,
                    Sees::Beyond | Sees::Before { .. } => Jumps::Visibility,
                };
                let distance = hit.map_or(f64::INFINITY, |h| {
                    scene.edges.angular_distance(scene, h.triangle, x, direction, h.distance, jumps)
                });
                let nearness = if fades { self.warp.nearness(distance, kappa) } else { 1.0 };
                (Seen { hit, direction, nearness }, distance)
            })
            .collect();
        Some(Warping::Weighted(self.warp.stencil_of(bundle, kappa, hits)))
    }

    /// The stencil at a point of the film; nothing where nothing seen can move. `ray` turns film points into
    /// directions, `scale` is the film's pixels a radian around a direction.
    pub(crate) fn on_film(
        &mut self,
        origin: DVec3,
        u: DVec2,
        kappa: f64,
        ray: impl Fn(DVec2) -> DVec3,
        scale: impl Fn(DVec3) -> f64,
        camera_moves: bool,
    ) -> Option<Warping<Plane>> {
        if let Construction::Followed { candidates } = self.construction {
            return self.follow::<Plane>(origin, None, u, kappa, candidates, camera_moves, ray);
        }
        let bundle: Bundle<Plane> = self.warp.bundle(u, kappa, &mut self.rng);
        self.directions.clear();
        self.directions.extend(bundle.points().map(ray));
        if !self.trace(origin, None, camera_moves) {
            return None;
        }
        let scene = self.paths.scene;
        let hits = self
            .directions
            .iter()
            .zip(&self.hits)
            .map(|(&direction, &hit)| {
                let distance = hit.map_or(f64::INFINITY, |h| {
                    scale(direction)
                        * scene.edges.angular_distance(
                            scene,
                            h.triangle,
                            origin,
                            direction,
                            h.distance,
                            Jumps::Radiance,
                        )
                });
                (Seen { hit, direction, nearness: 1.0 }, distance)
            })
            .collect();
        Some(Warping::Weighted(self.warp.stencil_of(bundle, kappa, hits)))
    }

    /// The nearest of some points of a kernel around μ, which is drawn from the kernel around u: what is nearest
    /// hides the rest, and its edge is the one that is seen.
    #[expect(clippy::too_many_arguments, reason = "a ray's origin and the kernel's place are told apart")]
    fn follow<D: Rigid>(
        &mut self,
        origin: DVec3,
        from: Option<u32>,
        u: D::Vector,
        kappa: f64,
        candidates: usize,
        origin_moves: bool,
        ray: impl Fn(D::Vector) -> DVec3,
    ) -> Option<Warping<D>> {
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
        let (i, hit) = nearest.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
        let seen = Seen { hit: Some(hit), direction: self.directions[i], nearness: 1.0 };
        let slope = D::project(u, centre - u) * kappa;
        Some(Warping::Followed(Following { point: u, at: points[i], seen, slope }))
    }

    fn trace(&mut self, origin: DVec3, from: Option<u32>, origin_moves: bool) -> bool {
        if !origin_moves && !self.directions.iter().any(|&d| self.moving.may_be_hit(origin, d)) {
            return false;
        }
        self.rays += self.directions.len() as u64;
        self.paths.closest_bundle(origin, &self.directions, from, &mut self.hits);
        true
    }
}

/// Whether a hit hides what the integrand is about: whether it lies before the plane of a flat light.
fn counts(sees: Sees, x: DVec3, direction: DVec3, distance: f64) -> bool {
    match sees {
        Sees::Radiance | Sees::Beyond => true,
        Sees::Before { normal, offset } => {
            // Before the light n·y > d. The light's own plane must not hide it.
            let height = normal.dot(x) - offset;
            normal.dot(direction) * distance + height > SHORT * height
        }
    }
}
