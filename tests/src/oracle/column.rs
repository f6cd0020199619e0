//! The integral of a pixel, column by column.

use flatland::plane::{Attachment, Film, Filter, Scene};
use glam::DVec2;
use num_dual::{Dual64, DualNum};

use super::PixelOracle;
use super::frame::{Edge, Frame, Line, Point};
use super::sweep::{Sweep, Toggle, compare};
use crate::double_double::DoubleDouble;
use crate::dual::Vector2;
use crate::quadrature::rule;

/// Width, as a share of the pixel, below which a slab lies between events that only rounding separates.
const NARROWEST: f64 = 1e-25;

/// Point counts of the rule that integrates a Gaussian, and a quadratic times it, to rounding over lengths up
/// to the given number of σ; 10 points otherwise, on pieces of 2 σ. The error is (n!)³ / ((2n + 1) 2ⁿ
/// ((2n)!)²) (length/σ)²ⁿ times length and peak.
const GAUSSIAN_POINTS: [(f64, usize); 6] = [(0.02, 3), (0.1, 4), (0.22, 5), (0.45, 6), (0.7, 7), (1.0, 8)];

/// The integrand h f.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integrand<'a> {
    pub(super) scene: &'a Scene,
    pub(super) velocities: &'a [DVec2],
    /// Vertex positions of the material when shades were fixed to it.
    pub(super) material: &'a [DVec2],
    pub(super) film: Film,
}

/// The visible content of a stretch of a column, the same throughout a slab.
#[derive(Clone, Copy, Debug, PartialEq)]
struct View {
    shape: Option<usize>,
    /// The triangle of the shape's material, where the shade is attached to it.
    triangle: Option<[usize; 3]>,
    /// The smooth cell of the filter, (column, row).
    cell: [usize; 2],
}

/// A stretch of every column in a slab, between two edges.
struct Stretch {
    from: Line,
    to: Line,
    view: View,
}

/// The integral of pixel (x, y).
pub(super) fn integrate(sweep: &Sweep, integrand: &Integrand, x: usize, y: usize) -> PixelOracle {
    let frame = &sweep.frame;
    let grid = Grid::new(&integrand.film, x, y);
    let lines = grid.lines(frame);
    let origin = frame.turn(grid.centre);
    let (first, last) = (frame.turn(grid.min()).x, frame.turn(grid.max()).x);
    let meets = |e: &Edge| e.left.x < last && e.right.x > first;
    let scene_edges = sweep.edges.iter().filter(|(e, _)| meets(e));
    let edges: Vec<_> = lines
        .iter()
        .chain(scene_edges)
        .map(|(edge, toggles)| (edge, edge.line(origin), toggles.as_slice()))
        .collect();

    // Events outside the pixel's bounding circle change the order only of edges outside the pixel.
    let reach = grid.radius();
    let near = |p: &&Point| (p.y - origin.y).value().abs() <= reach;
    let start = sweep.events.partition_point(|p| p.x <= first);
    let inner = sweep.events[start..].iter().take_while(|p| p.x < last);
    let mut events: Vec<DoubleDouble> = inner.filter(near).map(|p| p.x).collect();
    for (i, (line, _)) in lines.iter().enumerate() {
        let others = edges[..i].iter().chain(&edges[lines.len()..]);
        events.extend(others.filter_map(|(e, ..)| e.crossing(line)).filter(|&x| first < x && x < last));
    }
    events.extend([first, last]);
    events.sort_by(|a, b| compare(*a, *b));

    let mut total = PixelOracle::default();
    let narrowest = NARROWEST * integrand.film.pixel();
    let half = DoubleDouble::from(0.5);
    for slab in events.windows(2) {
        let width = (slab[1] - slab[0]).value();
        if width <= narrowest {
            continue;
        }
        let stretches = stretches(sweep, integrand, &grid, &edges, (slab[0] + slab[1]) * half);
        let start = (slab[0] - origin.x).value();
        // Along a steep edge a column changes faster than the filter does.
        let slope =
            stretches.iter().map(|s| s.from.slope().abs().max(s.to.slope().abs())).fold(1.0, f64::max);
        // Summed in two steps: otherwise the rounding of many small terms adds up.
        let mut sum = PixelOracle::default();
        for (t, weight) in grid.nodes(1.5 * slope * width) {
            for stretch in &stretches {
                add(&mut sum, weight, &stretch.integrate(frame, integrand, &grid, start + t * width));
            }
        }
        add(&mut total, width / frame.area, &sum);
    }
    total
}

fn add(total: &mut PixelOracle, weight: f64, part: &PixelOracle) {
    total.value += weight * part.value;
    total.derivative += weight * part.derivative;
    total.absolute += weight * part.absolute;
}

/// The visible content of the columns near `x` inside the pixel, from bottom to top. Neighbours of equal
/// content are merged, so that hidden edges leave no rounding behind.
fn stretches(
    sweep: &Sweep,
    integrand: &Integrand,
    grid: &Grid,
    edges: &[(&Edge, Line, &[Toggle])],
    x: DoubleDouble,
) -> Vec<Stretch> {
    let mut order: Vec<_> =
        edges.iter().filter(|(e, ..)| e.spans(x)).map(|e| (e.0.height(x), &e.1, e.2)).collect();
    order.sort_by(|a, b| compare(a.0, b.0));
    let mut inside_shape = vec![false; integrand.scene.shapes().len()];
    let mut inside_triangle = vec![false; sweep.triangles.len()];
    // Below all lines a column is to the right of the pixel and below it.
    let (mut column, mut row) = (grid.xs.len(), 0);
    let mut stretches: Vec<Stretch> = vec![];
    let mut open: Option<Stretch> = None;
    for (_, line, toggles) in order {
        for toggle in toggles {
            match *toggle {
                Toggle::Shape(s) => inside_shape[s] ^= true,
                Toggle::Triangle(t) => inside_triangle[t] ^= true,
                Toggle::FilterColumn => column -= 1,
                Toggle::FilterRow => row += 1,
            }
        }
        let in_pixel = (1..grid.xs.len()).contains(&column) && (1..grid.ys.len()).contains(&row);
        let view = in_pixel.then(|| {
            let shape = inside_shape.iter().rposition(|&inside| inside);
            // Where rounding orders two edges wrongly, no triangle may be found, over a region of zero area.
            let found = |&(t, &(owner, _)): &(usize, &(usize, _))| inside_triangle[t] && Some(owner) == shape;
            let triangle = sweep.triangles.iter().enumerate().find(found).map(|(_, t)| t.1);
            View { shape, triangle, cell: [column - 1, row - 1] }
        });
        if let Some(stretch) = &mut open {
            stretch.to = *line;
        }
        if view != open.as_ref().map(|s| s.view) {
            stretches.extend(open.take());
            open = view.map(|view| Stretch { from: *line, to: *line, view });
        }
    }
    stretches
}

impl Stretch {
    /// The integral of h f along the stretch at `x`.
    fn integrate(&self, frame: &Frame, integrand: &Integrand, grid: &Grid, x: f64) -> PixelOracle {
        let mut total = PixelOracle::default();
        let (from, to) = (self.from.at(x), self.to.at(x));
        let length = to - from;
        let end_speed = from.eps.abs() + to.eps.abs();
        for (t, w) in grid.nodes(length.re) {
            let offset = frame.turn_back(x, from + length * t);
            let h = grid.filter(offset, self.view.cell);
            let f = integrand.shade(&self.view, offset + Vector2::still(grid.centre));
            let (mut largest, mut largest_rate) = (0.0_f64, 0.0_f64);
            for (channel, f) in f.into_iter().enumerate() {
                let g = h * f;
                let term = length * g;
                total.value[channel] += w * term.re;
                total.derivative[channel] += w * term.eps;
                largest = largest.max(g.re.abs());
                largest_rate = largest_rate.max(g.eps.abs());
            }
            total.absolute += w * (largest * end_speed + length.re.abs() * largest_rate);
        }
        total
    }
}

impl Integrand<'_> {
    /// f at a moving point.
    fn shade(&self, view: &View, u: Vector2) -> [Dual64; 3] {
        let Some(shape) = view.shape else {
            return self.scene.background().to_array().map(Dual64::from_re);
        };
        let shade = self.scene.shapes()[shape].shade();
        let at = match view.triangle {
            Some(triangle) if shade.attachment() == Attachment::Material => self.material_point(triangle, u),
            _ => u,
        };
        let (value, gradient) = (shade.value(at.value()), shade.gradient(at.value()));
        std::array::from_fn(|c| Dual64::new(value[c], gradient[c].dot(at.rate())))
    }

    /// Position of the material point now at u at the time its shade was fixed: u + Σ b_j (m_j − p_j(θ)),
    /// with b the barycentric coordinates of u in the moving triangle.
    fn material_point(&self, triangle: [usize; 3], u: Vector2) -> Vector2 {
        let corner = triangle.map(|v| Vector2::new(self.scene.vertices()[v], self.velocities[v]));
        let (e1, e2, d) = (corner[1] - corner[0], corner[2] - corner[0], u - corner[0]);
        let area = e1.cross(e2);
        let (b1, b2) = (d.cross(e2) / area, e1.cross(d) / area);
        let b = [-(b1 + b2) + 1.0, b1, b2];
        (0..3).fold(u, |sum, k| sum + (Vector2::still(self.material[triangle[k]]) - corner[k]) * b[k])
    }
}

/// The filter of one pixel, and the lines of the image between its smooth cells.
struct Grid {
    filter: Filter,
    pixel: f64,
    centre: DVec2,
    xs: Vec<f64>,
    ys: Vec<f64>,
    /// Offset subtracted from the Gaussian, and the integral after that.
    lowered: f64,
    gaussian_mass: f64,
}

impl Grid {
    fn new(film: &Film, x: usize, y: usize) -> Self {
        let cells: Vec<_> = film.cells(x, y).collect();
        let lines = |axis: usize| {
            let mut ends: Vec<_> = cells.iter().flat_map(|c| [c.min[axis], c.max[axis]]).collect();
            ends.sort_by(f64::total_cmp);
            ends.dedup();
            if film.filter() == Filter::Gaussian {
                // The filter is smooth everywhere; its cells exist for quadratures that cannot be cut.
                ends.drain(1..ends.len() - 1);
            }
            ends
        };
        // Mass of exp(−2 x²) − e⁻⁸ on [−2, 2], in pixels; statrs's erf is good to 5e-15 only.
        let mass = |start: f64| -> f64 {
            rule(10).iter().map(|(t, w)| w * 0.5 * (-2.0 * (start + 0.5 * t).powi(2)).exp()).sum()
        };
        let lowered = (-8.0_f64).exp();
        let gaussian_mass = 2.0 * [0.0, 0.5, 1.0, 1.5].map(mass).iter().sum::<f64>() - 4.0 * lowered;
        let (xs, ys) = (lines(0), lines(1));
        let (filter, pixel, centre) = (film.filter(), film.pixel(), film.centre(x, y));
        Self { filter, pixel, centre, xs, ys, lowered, gaussian_mass }
    }

    fn min(&self) -> DVec2 {
        DVec2::new(self.xs[0], self.ys[0])
    }

    fn max(&self) -> DVec2 {
        DVec2::new(self.xs[self.xs.len() - 1], self.ys[self.ys.len() - 1])
    }

    /// Slightly more than half the diagonal.
    fn radius(&self) -> f64 {
        0.51 * (self.max() - self.min()).length()
    }

    /// The grid lines as edges that reach past the pixel's columns; their cotangent is at most 7.
    fn lines(&self, frame: &Frame) -> Vec<(Edge, Vec<Toggle>)> {
        let pad = 8.0 * (self.max() - self.min()).max_element();
        let (min, max) = (self.min() - pad, self.max() + pad);
        let fixed = |p: DVec2| (p, DVec2::ZERO);
        let columns = self.xs.iter().map(|&x| {
            let ends = [DVec2::new(x, min.y), DVec2::new(x, max.y)];
            (Edge::new(frame, ends.map(fixed)), vec![Toggle::FilterColumn])
        });
        let rows = self.ys.iter().map(|&y| {
            let ends = [DVec2::new(min.x, y), DVec2::new(max.x, y)];
            (Edge::new(frame, ends.map(fixed)), vec![Toggle::FilterRow])
        });
        columns.chain(rows).collect()
    }

    /// Nodes and weights on [0, 1] that are exact over a length, or accurate to rounding for the Gaussian.
    /// For the other filters h f is of degree 4, and its column and the column's derivative of degree 5.
    fn nodes(&self, length: f64) -> impl Iterator<Item = (f64, f64)> + use<> {
        let (pieces, points) = match self.filter {
            Filter::Box | Filter::Tent => (1.0, 3),
            Filter::Gaussian => {
                let deviations = length.abs() / (0.5 * self.pixel);
                let fits = |(limit, _): &&(f64, usize)| deviations < *limit;
                let points = GAUSSIAN_POINTS.iter().find(fits).map_or(10, |(_, n)| *n);
                ((0.5 * deviations).ceil().max(1.0), points)
            }
        };
        let node = move |k: f64| rule(points).iter().map(move |(t, w)| ((k + t) / pieces, w / pieces));
        (0..pieces as u32).flat_map(move |k| node(f64::from(k)))
    }

    /// h at a moving offset from the centre, as the smooth function that represents it in `cell`.
    fn filter(&self, offset: Vector2, cell: [usize; 2]) -> Dual64 {
        let axis = |k: usize| {
            let x = offset.0[k] / self.pixel;
            match self.filter {
                Filter::Box => Dual64::from_re(1.0),
                Filter::Tent if cell[k] == 0 => x + 1.0,
                Filter::Tent => -x + 1.0,
                Filter::Gaussian => ((x * x * -2.0).exp() - self.lowered) / self.gaussian_mass,
            }
        };
        axis(0) * axis(1) / (self.pixel * self.pixel)
    }
}
