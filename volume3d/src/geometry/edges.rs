//! Edges of a mesh, with their adjacent triangles.

use rayon::prelude::*;

/// A half-edge: a side of a triangle.
///
/// Ordered by edge, then by triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HalfEdge {
    /// Both ends, the lower index first.
    pub ends: [u32; 2],
    /// The triangle.
    pub triangle: u32,
    /// The corner k at which the side starts; it ends at corner k + 1.
    pub corner: u32,
    /// Whether the triangle traverses the side from the lower index to the higher. Two triangles that face
    /// the same way traverse their common edge in opposite directions.
    pub ascending: bool,
}

/// Adjacency of triangles: all half-edges, grouped by edge.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Edges {
    sides: Vec<HalfEdge>,
}

impl Edges {
    /// From triangles, given by the indices of their corners, in time O(n log n).
    ///
    /// A triangle with a repeated corner has an edge with equal ends.
    #[must_use]
    pub fn of(triangles: impl ExactSizeIterator<Item = [u32; 3]> + Clone) -> Self {
        let count = 3 * triangles.len();
        let sides = (0..).zip(triangles).flat_map(|(triangle, corners): (u32, [u32; 3])| {
            [0, 1, 2].map(|corner| {
                let [a, b] = [corners[corner], corners[(corner + 1) % 3]];
                let ends = [a.min(b), a.max(b)];
                HalfEdge { ends, triangle, corner: corner as u32, ascending: a < b }
            })
        });
        Self { sides: in_order(sides, count) }
    }

    /// The half-edges of every edge, in the order of their ends.
    pub fn iter(&self) -> impl Iterator<Item = &[HalfEdge]> {
        self.sides.chunk_by(|a, b| a.ends == b.ends)
    }

    /// Both ends of every edge, the lower index first; without edges with equal ends.
    pub(crate) fn ends(&self) -> impl Iterator<Item = [u32; 2]> {
        self.iter().map(|sides| sides[0].ends).filter(|[a, b]| a != b)
    }
}

/// Sorts by the lower ends, by counting and without a second table, and then those few that share one.
fn in_order(sides: impl Iterator<Item = HalfEdge> + Clone, count: usize) -> Vec<HalfEdge> {
    let Some(first) = sides.clone().next() else { return vec![] };
    let largest = sides.clone().map(|side| side.ends[0]).max().unwrap_or(0) as usize;
    if largest > MOST * count {
        let mut sorted: Vec<HalfEdge> = sides.collect();
        sorted.par_sort_unstable();
        return sorted;
    }
    let mut next = vec![0_u32; largest + 2];
    sides.clone().for_each(|side| next[side.ends[0] as usize + 1] += 1);
    for end in 0..=largest {
        next[end + 1] += next[end];
    }
    let mut sorted = vec![first; count];
    for side in sides {
        let place = &mut next[side.ends[0] as usize];
        sorted[*place as usize] = side;
        *place += 1;
    }
    // Each entry is now the start of the next.
    let mut begin = 0;
    for &end in &next[..=largest] {
        sorted[begin..end as usize].sort_unstable();
        begin = end as usize;
    }
    sorted
}

/// Counting sort is used if ends are at most this many times the number of sides.
const MOST: usize = 4;

#[cfg(test)]
mod tests {
    use flatland::random::stream;
    use rand::Rng as _;

    use super::*;

    /// With and without counting sort.
    #[test]
    fn sides_are_in_order() {
        let mut rng = stream(7, &[]);
        for vertices in [3, 20, 1 << 20] {
            let triangles: Vec<[u32; 3]> =
                (0..500).map(|_| [(); 3].map(|()| rng.next_u32() % vertices)).collect();
            let edges = Edges::of(triangles.iter().copied());
            assert!(edges.sides.is_sorted() && edges.sides.len() == 1500, "{vertices}");
        }
        assert_eq!(Edges::of([].into_iter()).iter().count(), 0);
    }

    #[test]
    fn two_triangles_of_a_square_share_their_diagonal_in_opposite_senses() {
        let edges = Edges::of([[0, 1, 2], [0, 2, 3]].into_iter());
        let counts: Vec<_> = edges.iter().map(|sides| (sides[0].ends, sides.len())).collect();
        assert_eq!(counts, [([0, 1], 1), ([0, 2], 2), ([0, 3], 1), ([1, 2], 1), ([2, 3], 1)]);
        let diagonal = edges.iter().nth(1).unwrap();
        assert_eq!(
            diagonal.iter().map(|s| (s.triangle, s.corner, s.ascending)).collect::<Vec<_>>(),
            [(0, 2, false), (1, 0, true)]
        );
    }
}
