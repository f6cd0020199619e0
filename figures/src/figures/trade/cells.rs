//! A partition of the plane that is finer towards edges.

use glam::DVec2;

/// Sides of cells, in units of the kernel's width, at the edges.
const FINEST: f64 = 0.36;
/// Sides of cells relative to their distance from the edges.
const GRADING: f64 = 0.6;
/// The largest side.
const COARSEST: f64 = 0.3;

/// A rectangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Its least corner.
    pub(super) low: DVec2,
    pub(super) size: DVec2,
}

/// A quadtree over the box from `low` to `high`, for a kernel of concentration `kappa`.
pub(super) fn graded((low, high): (DVec2, DVec2), edges: &[[DVec2; 2]], kappa: f64) -> Vec<Cell> {
    let finest = FINEST / kappa.sqrt();
    let mut done = vec![];
    let mut open = vec![Cell { low, size: high - low }];
    while let Some(cell) = open.pop() {
        let centre = cell.low + 0.5 * cell.size;
        let distance = edges.iter().map(|&edge| distance(centre, edge)).fold(f64::INFINITY, f64::min);
        if cell.size.max_element() <= (GRADING * distance).clamp(finest, COARSEST.max(finest)) {
            done.push(cell);
            continue;
        }
        let size = 0.5 * cell.size;
        for corner in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
            open.push(Cell { low: cell.low + corner * size, size });
        }
    }
    done
}

fn distance(u: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let along = b - a;
    let t = ((u - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    u.distance(a + t * along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_fill_the_box_and_are_finest_at_edges() {
        let cells = graded((DVec2::ZERO, DVec2::ONE), &[[DVec2::splat(0.2), DVec2::splat(0.7)]], 100.0);
        let area: f64 = cells.iter().map(|cell| cell.size.x * cell.size.y).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let size_at = |u: DVec2| {
            let inside = |cell: &&Cell| u.cmpge(cell.low).all() && u.cmplt(cell.low + cell.size).all();
            cells.iter().find(inside).map(|cell| cell.size.x)
        };
        assert!(size_at(DVec2::splat(0.5)) < size_at(DVec2::new(0.95, 0.05)));
    }
}
