//! Exact integrals over pixels.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::ExactError;
use super::arrangement::{Arrangement, Boundary};
use super::oracle::OracleField;
use super::quadrature::{Clipped, Point, Rule};
use crate::plane::segments::clip_segment;
use crate::plane::{Film, Filter, FilterCell, Hit, Image};

/// Relative difference up to which velocities of two coincident edges count as equal, for rounding in their
/// interpolation.
const SAME: f64 = 1e-12;

/// Length, relative to the coordinates, below which pieces are crossings blurred by rounding: the error of
/// choosing one of their owners is as small.
const SMEARED: f64 = 1e-12;

impl Arrangement<'_> {
    /// ∫ h f du of every pixel.
    #[must_use]
    pub fn primal(&self, film: &Film) -> Image {
        let rule = Rule::of(film);
        self.pixels(film, |pixel, centre, sum| {
            self.each_clipped(film, pixel, |face, _, clipped| {
                let surface = self.surface(face);
                for piece in clipped.pieces() {
                    rule.triangle(&piece, |p, w| {
                        *sum += w * film.filter_value(centre, p.u) * self.value(surface, p.u);
                    });
                }
            });
        })
    }

    /// ∫ h ∂f/∂θ du of every pixel: the contribution of shades carried by moving material.
    ///
    /// # Errors
    /// [`ExactError::Velocities`].
    pub fn interior(&self, film: &Film, velocities: &[DVec2]) -> Result<Image, ExactError> {
        self.check(velocities)?;
        let rule = Rule::of(film);
        Ok(self.pixels(film, |pixel, centre, sum| {
            self.each_clipped(film, pixel, |face, _, clipped| {
                let Surface::Material(hit) = self.surface(face) else { return };
                for piece in clipped.pieces() {
                    rule.triangle(&piece, |&Point { u, .. }, w| {
                        let hit = self.scene.move_hit(&hit, u);
                        let f = self.scene.theta_derivative(Some(&hit), u, velocities);
                        *sum += w * film.filter_value(centre, u) * f;
                    });
                }
            });
        }))
    }

    /// ∮ h Δf (v·ν) dl of every pixel, over the visible silhouettes.
    ///
    /// # Errors
    /// [`ExactError::EdgesPart`] or [`ExactError::PixelEdge`] where the derivative does not exist, and
    /// [`ExactError::Velocities`].
    pub fn boundary(&self, film: &Film, velocities: &[DVec2]) -> Result<Image, ExactError> {
        self.check(velocities)?;
        self.check_differentiable(film, velocities)?;
        let rule = Rule::of(film);
        Ok(self.pixels(film, |pixel, centre, sum| {
            self.each_boundary(film, pixel, |b, t0, t1| {
                let (ends, normal) = self.boundary_velocity(b, velocities);
                self.along(b, t0, t1, rule, |u, t, w| {
                    let jump = self.jump(b, u);
                    *sum += w * film.filter_value(centre, u) * ends[0].lerp(ends[1], t).dot(normal) * jump;
                });
            });
        }))
    }

    /// ∫ ∇·(V h f) du − ∮ f (V·n) dl of every pixel; the second only if the filter is discontinuous.
    #[must_use]
    pub fn divergence(&self, film: &Film, oracle: &OracleField<'_>) -> Image {
        let rule = Rule::of(film);
        self.pixels(film, |pixel, centre, sum| {
            self.each_clipped(film, pixel, |face, cell, clipped| {
                let surface = self.surface(face);
                for piece in clipped.pieces() {
                    rule.triangle(&piece, |point, w| {
                        let u = point.u;
                        let (f, g) = (self.value(surface, u), self.slope(surface, u));
                        let v = oracle.in_triangle(face, point.barycentric);
                        let h = film.filter_value(centre, u);
                        let slope = film.filter_gradient(centre, u).dot(v) + h * oracle.divergence[face];
                        *sum += w * (slope * f + h * DVec3::from(g.map(|g| g.dot(v))));
                    });
                }
                if film.filter() == Filter::Box {
                    let h = 1.0 / (film.pixel() * film.pixel());
                    each_side(clipped, cell, |[p, q], outward| {
                        rule.segment(|t, w| {
                            let point = p.lerp(q, t);
                            let v = oracle.in_triangle(face, point.barycentric);
                            let flux = w * (q.u - p.u).length() * h * v.dot(outward);
                            *sum -= flux * self.value(surface, point.u);
                        });
                    });
                }
            });
        })
    }

    /// The gradient of Σ adjoint · image with respect to every vertex: the transpose of
    /// [`interior`](Self::interior) + [`boundary`](Self::boundary).
    ///
    /// # Errors
    /// [`ExactError::EdgesPart`] where edges of different shapes coincide, because each may move alone, and
    /// [`ExactError::PixelEdge`].
    ///
    /// # Panics
    /// If the adjoint is smaller than the film.
    pub fn gradient(&self, film: &Film, adjoint: &Image) -> Result<Vec<DVec2>, ExactError> {
        for b in self.boundaries.iter().filter(|b| self.on_film(b, film)) {
            if let [first, second, ..] = b.owners[..]
                && !self.is_smeared_crossing(b)
            {
                return Err(self.parting(b, first, second));
            }
            self.check_pixel_edge(b, film, |_| true)?;
        }
        let rule = Rule::of(film);
        let rows: Vec<Vec<DVec2>> = (0..film.height())
            .into_par_iter()
            .map(|y| {
                let mut gradient = vec![DVec2::ZERO; self.scene.vertices().len()];
                for x in 0..film.width() {
                    self.pixel_gradient(film, [x, y], adjoint.pixel(x, y), rule, &mut gradient);
                }
                gradient
            })
            .collect();
        let mut sum = vec![DVec2::ZERO; self.scene.vertices().len()];
        rows.iter().for_each(|row| crate::plane::add(&mut sum, row));
        Ok(sum)
    }

    fn pixel_gradient(
        &self,
        film: &Film,
        pixel: [usize; 2],
        adjoint: DVec3,
        rule: &Rule,
        gradient: &mut [DVec2],
    ) {
        let centre = film.centre(pixel[0], pixel[1]);
        self.each_clipped(film, pixel, |face, _, clipped| {
            let Surface::Material(hit) = self.surface(face) else { return };
            for piece in clipped.pieces() {
                rule.triangle(&piece, |&Point { u, .. }, w| {
                    let hit = self.scene.move_hit(&hit, u);
                    if let Some(g) = self.scene.material_gradient(Some(&hit), u) {
                        let covector = (0..3).map(|c| adjoint[c] * g[c]).sum::<DVec2>();
                        let covector = -w * film.filter_value(centre, u) * covector;
                        hit.point().scatter(covector, |vertex, part| gradient[vertex] += part);
                    }
                });
            }
        });
        self.each_boundary(film, pixel, |b, t0, t1| {
            let normal = self.boundary_normal(b);
            let [v0, v1] = self.edges[b.owners[0] as usize].1;
            let (p, d) = (self.scene.vertices()[v0], self.scene.vertices()[v1] - self.scene.vertices()[v0]);
            self.along(b, t0, t1, rule, |u, _, w| {
                let jump = self.jump(b, u);
                let covector = w * film.filter_value(centre, u) * adjoint.dot(jump) * normal;
                let s = (u - p).dot(d) / d.length_squared();
                gradient[v0] += (1.0 - s) * covector;
                gradient[v1] += s * covector;
            });
        });
    }

    fn check(&self, velocities: &[DVec2]) -> Result<(), ExactError> {
        let (expected, found) = (self.scene.vertices().len(), velocities.len());
        if expected != found || !velocities.iter().all(|v| v.is_finite()) {
            return Err(ExactError::Velocities { expected, found });
        }
        Ok(())
    }

    /// Refuses motions for which the left derivative differs from the right one.
    fn check_differentiable(&self, film: &Film, velocities: &[DVec2]) -> Result<(), ExactError> {
        for b in self.boundaries.iter().filter(|b| self.on_film(b, film)) {
            let ends = b.nodes.map(|n| self.nodes[n as usize]);
            let normal = self.boundary_normal(b);
            let velocity = |owner: u32| ends.map(|p| self.edge_velocity(owner, p, velocities));
            let first = velocity(b.owners[0]);
            if self.is_smeared_crossing(b) {
                continue;
            }
            for &other in &b.owners[1..] {
                let second = velocity(other);
                let scale = first.iter().chain(&second).map(|v| v.length()).fold(0.0, f64::max);
                let apart = |k: usize| (first[k] - second[k]).dot(normal).abs() > SAME * scale;
                if apart(0) || apart(1) {
                    return Err(self.parting(b, b.owners[0], other));
                }
            }
            self.check_pixel_edge(b, film, |normal| first.iter().any(|v| v.dot(normal) != 0.0))?;
        }
        Ok(())
    }

    /// Whether edges seem to coincide only because rounding made two nodes of one crossing.
    fn is_smeared_crossing(&self, b: &Boundary) -> bool {
        let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
        p.distance(q) <= SMEARED * p.abs().max(q.abs()).max_element()
    }

    fn parting(&self, b: &Boundary, first: u32, second: u32) -> ExactError {
        let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
        let shape = |owner: u32| self.edges[owner as usize].0;
        ExactError::EdgesPart { first: shape(first), second: shape(second), at: p.midpoint(q) }
    }

    /// Refuses a discontinuity that lies on a box pixel's edge and may cross it.
    fn check_pixel_edge(
        &self,
        b: &Boundary,
        film: &Film,
        crosses: impl Fn(DVec2) -> bool,
    ) -> Result<(), ExactError> {
        let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
        if film.filter() != Filter::Box || b.minus == b.plus {
            return Ok(());
        }
        for (axis, normal) in [(0, DVec2::X), (1, DVec2::Y)] {
            if p[axis] == q[axis] && film.is_pixel_edge(axis, p[axis]) && crosses(normal) {
                let shape = self.edges[b.owners[0] as usize].0;
                return Err(ExactError::PixelEdge { shape, at: p.midpoint(q) });
            }
        }
        Ok(())
    }

    fn on_film(&self, b: &Boundary, film: &Film) -> bool {
        let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
        let (min, max) = film.extent();
        p.min(q).cmple(max).all() && p.max(q).cmpge(min).all()
    }

    fn pixels(&self, film: &Film, integrate: impl Fn([usize; 2], DVec2, &mut DVec3) + Sync) -> Image {
        let width = film.width();
        let pixels = (0..width * film.height()).into_par_iter().map(|i| {
            let mut sum = DVec3::ZERO;
            let [x, y] = [i % width, i / width];
            integrate([x, y], film.centre(x, y), &mut sum);
            sum
        });
        Image::from_pixels(film, pixels.collect())
    }

    fn each_clipped(
        &self,
        film: &Film,
        [x, y]: [usize; 2],
        mut visit: impl FnMut(usize, &FilterCell, &Clipped),
    ) {
        for cell in film.cells(x, y) {
            self.faces_in(cell.min, cell.max, |face| {
                let clipped = Clipped::new(self.corners(face), &cell);
                if !clipped.corners().is_empty() {
                    visit(face, &cell, &clipped);
                }
            });
        }
    }

    fn each_boundary(&self, film: &Film, [x, y]: [usize; 2], mut visit: impl FnMut(&Boundary, f64, f64)) {
        for cell in film.cells(x, y) {
            self.boundaries_in(cell.min, cell.max, |i| {
                let b = &self.boundaries[i];
                let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
                if b.minus != b.plus
                    && let Some((t0, t1)) = clip_segment(p, q, &cell)
                {
                    visit(b, t0, t1);
                }
            });
        }
    }

    /// Calls `f(u, t, dl)` along the part [t0, t1] of a boundary.
    fn along(&self, b: &Boundary, t0: f64, t1: f64, rule: &Rule, mut f: impl FnMut(DVec2, f64, f64)) {
        let [p, q] = b.nodes.map(|n| self.nodes[n as usize]);
        let length = (q - p).length() * (t1 - t0);
        rule.segment(|s, w| {
            let t = t0 + s * (t1 - t0);
            f(p.lerp(q, t), t, w * length);
        });
    }

    /// Appearance of the visible shape of a face.
    fn surface(&self, face: usize) -> Surface {
        let Some(shape) = self.visible[face].map(|s| s as usize) else { return Surface::Background };
        if !self.scene.shapes()[shape].shade().is_carried() {
            return Surface::Image(shape);
        }
        let [a, b, c] = self.corners(face);
        let hit = self.scene.nearest_hit((a + b + c) / 3.0, shape);
        hit.map_or(Surface::Image(shape), Surface::Material)
    }

    fn value(&self, surface: Surface, u: DVec2) -> DVec3 {
        match surface {
            Surface::Background => self.scene.background(),
            Surface::Image(shape) => self.scene.shapes()[shape].shade().value(u),
            Surface::Material(hit) => self.scene.value(Some(&self.scene.move_hit(&hit, u)), u),
        }
    }

    fn slope(&self, surface: Surface, u: DVec2) -> [DVec2; 3] {
        match surface {
            Surface::Background => [DVec2::ZERO; 3],
            Surface::Image(shape) => self.scene.shapes()[shape].shade().gradient(u),
            Surface::Material(hit) => self.scene.gradient(Some(&self.scene.move_hit(&hit, u)), u),
        }
    }

    /// f⁻ − f⁺ at a point of a boundary.
    fn jump(&self, b: &Boundary, u: DVec2) -> DVec3 {
        let side = |shape: Option<u32>| {
            shape.map_or(self.scene.background(), |s| self.scene.shape_value(s as usize, u))
        };
        side(b.minus) - side(b.plus)
    }
}

/// Shade of a face: fixed to the image, or carried by a triangle of material.
#[derive(Clone, Copy, Debug)]
enum Surface {
    Background,
    Image(usize),
    Material(Hit),
}

/// Calls `f` with each side of a clipped triangle that lies on a side of its cell, and the cell's
/// outward normal there.
fn each_side(clipped: &Clipped, cell: &FilterCell, mut f: impl FnMut([&Point; 2], DVec2)) {
    let corners = clipped.corners();
    for (i, p) in corners.iter().enumerate() {
        let q = &corners[(i + 1) % corners.len()];
        for (axis, normal) in [(0, DVec2::X), (1, DVec2::Y)] {
            for (side, outward) in [(cell.min[axis], -normal), (cell.max[axis], normal)] {
                if p.u[axis] == side && q.u[axis] == side {
                    f([p, q], outward);
                }
            }
        }
    }
}
