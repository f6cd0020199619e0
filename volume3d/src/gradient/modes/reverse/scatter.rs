//! Propagation of adjoints to parameters.

use flatland::calculus::{Adjoints, Vec3};
use flatland::sdf::{Jet, LevelSetVelocity, Sdf as _, SecondOrder};
use flatland::warp::LinearField as _;
use glam::{DVec2, DVec3};

use super::mode::{BounceWarp, Input, LevelSetPoint, Recorded, Reverse};
use crate::gradient::modes::accumulator::Accumulator;
use crate::gradient::warp::followed::{Followed, FollowedPoint};

impl<'t> Reverse<'_, 't> {
    pub(super) fn scatter(&self, id: Input, a: &[f64], earlier: &mut Adjoints<'_>, sums: &mut Accumulator) {
        let vector = || DVec3::from_slice(a);
        match id {
            Input::Parameter(row) if a.len() == 1 => sums.add(row, DVec3::X * a[0]),
            Input::Parameter(row) => sums.add(row, vector()),
            Input::Camera => self.scatter_camera(vector(), DVec3::from_slice(&a[3..]), a[6], sums),
            Input::FilmWarp => self.scatter_film(DVec2::new(a[0], a[1]), a[2], sums),
            Input::Warp(record) => {
                let BounceWarp { warp, origin } = &self.warps[record as usize];
                warp.scatter(vector(), a[3], |seen, covector| {
                    if seen.followed.is_nothing() {
                        return;
                    }
                    let c = seen.angular_transpose(covector);
                    self.scatter_hit(seen, c, sums);
                    earlier.add(origin.x, -c.x);
                    earlier.add(origin.y, -c.y);
                    earlier.add(origin.z, -c.z);
                });
                warp.scatter_level_sets(vector(), a[3], |tap, covector| {
                    self.scatter_implicit(tap.implicit, tap.point(), &tap.there, covector, sums);
                    add_all(earlier, *origin, tap.there.advected_transpose(covector));
                });
            }
            Input::LevelSet(record) => {
                let level_sets = self.level_sets.borrow();
                let LevelSetPoint { implicit, there, direction, x } = &level_sets[record as usize];
                let gradient = DVec3::from_slice(&a[3..]);
                // x − ω φ/(∇φ·ω), and ∇φ there.
                let moved = vector() + there.hessian * gradient;
                let value = -moved.dot(*direction) / there.jet.gradient.dot(*direction);
                self.scatter_implicit(*implicit, x.value(), there, Jet { value, gradient }, sums);
                add_all(earlier, *x, moved + there.jet.gradient * value);
            }
        }
    }

    /// Adds the contribution of a covector of (φ̇, ∇φ̇) at x to an implicit surface.
    fn scatter_implicit(
        &self,
        implicit: u32,
        x: DVec3,
        there: &SecondOrder<DVec3>,
        covector: Jet<DVec3>,
        sums: &mut Accumulator,
    ) {
        if self.inputs.active.implicits[implicit as usize] {
            let shape = &self.scene.implicits()[implicit as usize];
            sums.add_implicit(implicit, shape, x, there, covector);
        }
    }

    fn scatter_film(&self, a: DVec2, b: f64, sums: &mut Accumulator) {
        let Some(warp) = &self.film_warp else { return };
        warp.scatter(a, b, |seen, covector| {
            let translation = if seen.followed.is_nothing() {
                -covector * warp.film.background()
            } else {
                self.scatter_hit(seen, covector / seen.distance, sums);
                -covector / seen.distance
            };
            if self.inputs.active.camera {
                let (rotation, zoom) = warp.apparent_transpose(seen.direction, covector);
                let rotation = rotation + warp.film.origin_rate_transpose(translation);
                self.scatter_camera(translation, rotation, zoom, sums);
            }
        });
        warp.scatter_level_sets(a, b, |tap, covector| {
            self.scatter_implicit(tap.implicit, tap.point(), &tap.there, covector, sums);
            if self.inputs.active.camera {
                let (translation, rotation, zoom) = warp.camera_rate_transpose(tap, covector);
                self.scatter_camera(translation, rotation, zoom, sums);
            }
        });
    }

    fn scatter_camera(&self, translation: DVec3, rotation: DVec3, zoom: f64, sums: &mut Accumulator) {
        let covectors = [translation, rotation, DVec3::X * zoom];
        self.inputs.rows.camera().into_iter().zip(covectors).for_each(|(row, c)| sums.add(row, c));
    }

    fn scatter_hit(&self, seen: &FollowedPoint, covector: DVec3, sums: &mut Accumulator) {
        if let Followed::LevelSet { implicit, x } = seen.followed {
            let there = self.scene.implicits()[implicit as usize].second_order(x);
            let value = LevelSetVelocity::new(there.jet.gradient).e().dot(covector);
            let covector = Jet { value, gradient: DVec3::ZERO };
            self.scatter_implicit(implicit, x, &there, covector, sums);
        }
        seen.followed.scatter(self.scene, covector, |i, covector| {
            if self.inputs.positions[i as usize] {
                sums.add(i, covector);
            }
        });
    }
}

/// Adds to the adjoint of an earlier vector.
fn add_all(earlier: &mut Adjoints<'_>, vector: Vec3<Recorded<'_>>, amount: DVec3) {
    earlier.add(vector.x, amount.x);
    earlier.add(vector.y, amount.y);
    earlier.add(vector.z, amount.z);
}
