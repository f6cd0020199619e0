//! Meshes in front of a camera.

use flatland::plane::Filter;
use glam::{DVec2, DVec3};

use super::moves::Affine;
use super::stage::{Body, Stage};
use crate::choices::choices;
use crate::dice::Dice;
use crate::space::coverage::{Camera, Mesh, Motion, ProjectedScene};

/// A mesh, a camera and their motion.
#[derive(Clone, Debug)]
pub struct CoverageCase {
    /// Open triangles face the camera and closed solids outwards: counterclockwise from where they are seen,
    /// so that it does not matter whether back sides emit.
    pub mesh: Mesh,
    /// 4 × 4 to 8 × 8 pixels.
    pub camera: Camera,
    /// A derivative with respect to θ.
    pub motion: Motion,
    /// The pixel filter.
    pub filter: Filter,
    /// The knobs in words, for failure messages.
    pub label: String,
}

choices! {
    /// Content of a case, or its degeneracy.
    CoverageKind {
        /// Kinds without anything degenerate.
        GENERIC {
            /// One triangle.
            Triangle,
            /// A quadrilateral of two triangles, of one radiance or of two.
            Quad,
            /// A closed convex mesh of up to 20 triangles, every one of its own radiance.
            Solid,
            /// Two or three bodies behind each other or at the same place, where they may pass through one
            /// another.
            Shells,
            /// A large body about a point of the film's border.
            Border,
        }
        /// Degenerate kinds.
        DEGENERATE {
            /// A triangle 10² to 10⁵ times as long as wide, in front of another body.
            Sliver,
            /// A triangle seen at an angle of 10⁻⁴ to 10⁻¹ to its plane, in front of another body.
            Grazing,
            /// [`Shells`](Self::Shells) with a unit of length of 10⁻⁶.
            Small,
            /// Shells with a unit of length of 10⁶.
            Large,
            /// Shells at a distance of 10⁶ from the origin.
            FarFromOrigin,
        }
    }
}

choices! {
    /// The parameters that θ changes.
    CoverageMoving {
        /// Translation of one body.
        Translate,
        /// Rotation of one body.
        Rotate,
        /// Scaling of one body about a point.
        Scale,
        /// One vertex.
        Vertex,
        /// The camera's position.
        CameraPosition,
        /// The camera's direction of view and its roll.
        CameraRotation,
        /// The field of view.
        FieldOfView,
        /// Everything at once.
        Mixed,
    }
}

impl CoverageKind {
    /// The unit of length.
    pub fn unit(self) -> f64 {
        match self {
            Self::Small => 1e-6,
            Self::Large => 1e6,
            _ => 1.0,
        }
    }
}

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoverageKnobs {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The content.
    pub kind: CoverageKind,
    /// The motion.
    pub moving: CoverageMoving,
    /// The pixel filter.
    pub filter: Filter,
}

impl CoverageKnobs {
    /// Knobs of a kind, all others drawn from a seed.
    pub fn random(seed: u64, kind: CoverageKind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX - kind as u64);
        let filter = dice.pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        Self { seed, kind, moving: dice.pick(&CoverageMoving::ALL), filter }
    }

    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> CoverageCase {
        let purpose = |attempt: u64| 10_000 * attempt + self.kind as u64;
        let case = (0..100).find_map(|attempt| self.attempt(Dice::new(self.seed, purpose(attempt))));
        case.unwrap_or_else(|| panic!("no case for {self:?}"))
    }

    /// `None` where there is no exact reference: bodies drawn independently may occlude each other
    /// cyclically, or a motion may bend the plane of two triangles that another one crosses. Another attempt
    /// is made then.
    fn attempt(&self, dice: Dice) -> Option<CoverageCase> {
        let mut stage = Stage::new(dice);
        stage.furnish(self.kind);
        stage.set_in_motion(self.moving);
        let Stage { mut mesh, mut camera, mut motion, mut dice, .. } = stage;
        let unit = self.kind.unit();
        let place = match self.kind {
            CoverageKind::FarFromOrigin => 1e6 * dice.direction(),
            _ => DVec3::ZERO,
        };
        mesh.positions.iter_mut().for_each(|p| *p = unit * *p + place);
        motion.positions.iter_mut().for_each(|v| *v *= unit);
        camera.origin = unit * camera.origin + place;
        motion.camera.origin *= unit;
        ProjectedScene::new(&mesh, &camera, &motion, self.filter).ok()?.derivative().ok()?;
        Some(CoverageCase { mesh, camera, motion, filter: self.filter, label: format!("{self:?}") })
    }
}

impl Stage {
    fn furnish(&mut self, kind: CoverageKind) {
        let depth = self.dice.between(1.5, 5.0);
        match kind {
            CoverageKind::Triangle => self.flat_in_view(depth, 3),
            CoverageKind::Quad => self.flat_in_view(depth, 4),
            CoverageKind::Solid => self.solid_in_view(depth),
            CoverageKind::Shells
            | CoverageKind::Small
            | CoverageKind::Large
            | CoverageKind::FarFromOrigin => {
                let count = self.dice.count(2, 3);
                self.among_each_other(count);
            }
            CoverageKind::Border => self.at_border(depth),
            CoverageKind::Sliver => self.sliver(depth),
            CoverageKind::Grazing => self.grazing(depth),
        }
        if matches!(kind, CoverageKind::Sliver | CoverageKind::Grazing) && self.dice.chance(0.7) {
            let depth = self.next_depth();
            self.solid_in_view(depth);
        }
    }

    /// A point of the film, not near its border.
    fn somewhere(&mut self) -> DVec2 {
        let size = self.size();
        size * DVec2::new(self.dice.between(0.25, 0.75), self.dice.between(0.25, 0.75))
    }

    /// The length at a depth that spans `pixels` pixels, but far shorter than the depth.
    fn length(&self, pixels: f64, depth: f64) -> f64 {
        (pixels / self.camera.pixels_per_slope()).min(0.6) * depth
    }

    /// A depth for the next body: about the depth of the last one, or so far behind it that a body of up to
    /// 0.6 of the depth is entirely behind it.
    fn next_depth(&mut self) -> f64 {
        let Body { centre, radius, .. } = self.bodies[self.bodies.len() - 1];
        let depth = (centre - self.camera.origin).dot(self.camera.forward);
        if self.dice.chance(0.5) {
            return depth + 0.5 * self.dice.between(-radius, radius);
        }
        1.05 * (depth + radius) / (1.0 - 0.6) * self.dice.between(1.0, 1.5)
    }

    /// A triangle or quadrilateral.
    fn flat_in_view(&mut self, depth: f64, corners: usize) {
        let u = self.somewhere();
        self.flat_at(u, depth, corners);
    }

    fn flat_at(&mut self, u: DVec2, depth: f64, corners: usize) {
        let centre = self.place(u, depth);
        let pixels = self.dice.between(0.8, 3.0);
        let radius = self.length(pixels, depth);
        let ring = self.dice.convex_ring(radius, corners);
        let normal = self.facing(centre, 0.3);
        self.flat(centre, normal, radius, &ring);
    }

    fn solid_in_view(&mut self, depth: f64) {
        let u = self.somewhere();
        let pixels = self.dice.between(1.0, 3.0);
        self.solid(self.place(u, depth), self.length(pixels, depth));
    }

    fn among_each_other(&mut self, count: usize) {
        let mut depth = self.dice.between(1.5, 2.5);
        for _ in 0..count {
            match self.dice.count(0, 3) {
                0 => self.flat_in_view(depth, 3),
                1 => self.flat_in_view(depth, 4),
                _ => self.solid_in_view(depth),
            }
            depth = self.next_depth();
        }
    }

    fn at_border(&mut self, depth: f64) {
        let size = self.size();
        let (along, end) = (self.dice.between(0.0, 1.0), f64::from(u8::from(self.dice.chance(0.5))));
        let share = if self.dice.chance(0.5) { DVec2::new(along, end) } else { DVec2::new(end, along) };
        let (u, pixels) = (share * size, self.dice.between(2.0, 5.0));
        match self.dice.count(0, 2) {
            0 => self.flat_at(u, depth, 3),
            1 => self.flat_at(u, depth, 4),
            _ => self.solid(self.place(u, depth), self.length(pixels, depth)),
        }
    }

    fn sliver(&mut self, depth: f64) {
        let u = self.somewhere();
        let (centre, radius) = (self.place(u, depth), self.length(3.0, depth));
        let width = radius / self.dice.scale(1e2, 1e5);
        let along = DVec2::from_angle(self.dice.between(0.0, std::f64::consts::TAU));
        let ring = [-radius * along, radius * along, width * along.perp()];
        let normal = self.facing(centre, 0.3);
        self.flat(centre, normal, radius, &ring);
    }

    fn grazing(&mut self, depth: f64) {
        let u = self.somewhere();
        let (centre, radius) = (self.place(u, depth), self.length(3.0, depth));
        let sight = (centre - self.camera.origin).normalize();
        let across = sight.cross(self.dice.direction()).normalize();
        let angle = self.dice.scale(1e-4, 1e-1);
        let ring = self.dice.convex_ring(radius, 3);
        self.flat(centre, angle.cos() * across - angle.sin() * sight, radius, &ring);
    }

    /// Adds a motion whose speeds on the film are about a pixel per unit of θ.
    fn set_in_motion(&mut self, moving: CoverageMoving) {
        let index = self.dice.count(0, self.bodies.len() - 1);
        let Body { vertices, centre, radius } = self.bodies[index].clone();
        let camera = &mut self.motion.camera;
        let affine = match moving {
            CoverageMoving::Translate => Affine::translation(self.dice.vector3(radius)),
            CoverageMoving::Rotate => {
                Affine::rotation(centre + self.dice.vector3(radius), self.dice.vector3(1.0))
            }
            CoverageMoving::Scale => Affine::scaling(
                centre + self.dice.vector3(radius),
                self.dice.sign() * self.dice.between(0.3, 1.0),
            ),
            CoverageMoving::Vertex => {
                let vertex = self.dice.count(vertices.start, vertices.end - 1);
                self.motion.positions[vertex] += self.dice.vector3(radius);
                return;
            }
            CoverageMoving::CameraPosition => {
                camera.origin += self.dice.vector3(radius);
                return;
            }
            CoverageMoving::CameraRotation => {
                camera.angular += self.dice.vector3(0.3);
                return;
            }
            CoverageMoving::FieldOfView => {
                camera.field_of_view += self.dice.sign() * self.dice.between(0.1, 0.4);
                return;
            }
            CoverageMoving::Mixed => {
                for part in CoverageMoving::ALL.into_iter().filter(|part| *part != CoverageMoving::Mixed) {
                    self.set_in_motion(part);
                }
                return;
            }
        };
        self.carry(index, &affine);
    }
}
