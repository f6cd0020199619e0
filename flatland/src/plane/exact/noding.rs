//! Noding: splitting segments at each other until they meet in end points only.
//!
//! Crossings are found by exact predicates and rounded to doubles, which bends segments by a rounding error
//! and may make them meet again; the pieces are therefore split again until nothing meets ("iterated noding",
//! as in the JTS topology suite). A crossing within rounding of an end point of its segments is replaced by
//! that end point; otherwise bundles of almost coincident segments would be split for ever.

use std::collections::HashMap;

use glam::DVec2;

use super::ExactError;
use crate::plane::box_tree::{Aabb, BoxTree};
use crate::plane::segments::{Meeting, crossing};

/// A piece of a source segment between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// The nodes, in the direction of the source.
    pub(super) nodes: [u32; 2],
    /// Index of the source segment.
    pub(super) source: u32,
}

/// Nodes at distinct positions, and the pieces between them.
#[derive(Debug, Default)]
pub(super) struct Noded {
    pub(super) nodes: Vec<DVec2>,
    pub(super) pieces: Vec<Piece>,
    ids: HashMap<[u64; 2], u32>,
}

/// Largest number of rounds. Two are typical; each further one must bend a segment by another rounding error.
const ROUNDS: usize = 32;
/// Distance from a crossing to an end point below which it is replaced, relative to the coordinates: 16 units
/// in the last place.
const SNAP: f64 = 3.552_713_678_800_501e-15;
/// Round from which that distance doubles with every round, so that the rounds terminate.
const PATIENCE: usize = 6;

impl Noded {
    /// Splits `sources` at their crossings and contacts.
    pub(super) fn new(sources: &[[DVec2; 2]]) -> Result<Self, ExactError> {
        let mut this = Self::default();
        for (source, ends) in (0_u32..).zip(sources) {
            let nodes = ends.map(|p| this.node(p));
            this.pieces.push(Piece { nodes, source });
        }
        for round in 0_usize.. {
            let snap = SNAP * f64::from(1_u32 << round.saturating_sub(PATIENCE).min(30));
            let splits = this.splits(snap);
            let Some(&(_, first)) = splits.first() else { break };
            if round == ROUNDS {
                return Err(ExactError::Noding { rounds: ROUNDS, at: this.nodes[first as usize] });
            }
            this.split(splits);
        }
        Ok(this)
    }

    /// The node at p, created if there is none.
    pub(super) fn node(&mut self, p: DVec2) -> u32 {
        // −0 and 0 are equal, and magnitudes below spade's minimum become 0.
        let p = DVec2::from(p.to_array().map(|x| if x.abs() < spade::MIN_ALLOWED_VALUE { 0.0 } else { x }));
        *self.ids.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
            self.nodes.push(p);
            u32::try_from(self.nodes.len() - 1).expect("fewer than 2³² nodes")
        })
    }

    /// All (piece, node) where a node lies inside a piece or was made by a crossing, sorted.
    fn splits(&mut self, snap: f64) -> Vec<(u32, u32)> {
        let ends: Vec<_> = self.pieces.iter().map(|p| p.nodes.map(|n| self.nodes[n as usize])).collect();
        let boxes: Vec<_> = ends.iter().map(|e| Aabb::of(*e)).collect();
        let tree = BoxTree::build(&boxes);
        let mut splits = vec![];
        let mut add = |piece: usize, node: u32, pieces: &[Piece]| {
            if !pieces[piece].nodes.contains(&node) {
                splits.push((piece as u32, node));
            }
        };
        for i in 0..ends.len() {
            let mut crossings = vec![];
            tree.visit(
                |b| b.overlaps(&boxes[i]),
                |j| {
                    if j <= i || !boxes[i].overlaps(&boxes[j]) {
                        return;
                    }
                    let meeting = Meeting::of(ends[i], ends[j]);
                    for k in 0..2 {
                        if meeting.on_first[k] {
                            add(i, self.pieces[j].nodes[k], &self.pieces);
                        }
                        if meeting.on_second[k] {
                            add(j, self.pieces[i].nodes[k], &self.pieces);
                        }
                    }
                    if meeting.crosses {
                        crossings.push((j, crossing(ends[i], ends[j])));
                    }
                },
            );
            for (j, p) in crossings {
                let near = |&&n: &&u32| {
                    let end = self.nodes[n as usize];
                    end.distance(p) <= snap * end.abs().max_element()
                };
                let ends = [self.pieces[i].nodes, self.pieces[j].nodes];
                let snapped = ends.as_flattened().iter().find(near).copied();
                let node = snapped.unwrap_or_else(|| self.node(p));
                add(i, node, &self.pieces);
                add(j, node, &self.pieces);
            }
        }
        splits.sort_unstable();
        splits.dedup();
        splits
    }

    fn split(&mut self, splits: Vec<(u32, u32)>) {
        let mut splits = splits.into_iter().peekable();
        let mut pieces = Vec::with_capacity(self.pieces.len() * 2);
        for (i, piece) in (0_u32..).zip(&self.pieces) {
            let [a, b] = piece.nodes.map(|n| self.nodes[n as usize]);
            let mut inner = vec![];
            while let Some((_, node)) = splits.next_if(|&(p, _)| p == i) {
                inner.push(((self.nodes[node as usize] - a).dot(b - a), node));
            }
            inner.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
            let mut from = piece.nodes[0];
            for to in inner.into_iter().map(|(_, node)| node).chain([piece.nodes[1]]) {
                pieces.push(Piece { nodes: [from, to], source: piece.source });
                from = to;
            }
        }
        self.pieces = pieces;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{open01, stream};

    #[test]
    fn a_cross_becomes_four_pieces() {
        let p = DVec2::new;
        let noded = Noded::new(&[[p(0., 0.), p(2., 2.)], [p(0., 2.), p(2., 0.)]]).unwrap();
        assert_eq!(noded.nodes.len(), 5);
        assert_eq!(noded.pieces.len(), 4);
    }

    #[test]
    fn nothing_meets_afterwards() {
        // Random segments, and bundles that coincide to within a few rounding errors.
        for seed in 0..20 {
            let mut rng = stream(seed, &[]);
            let mut segments = vec![];
            for _ in 0..25 {
                let [a, b, c] = [(); 3].map(|()| DVec2::new(open01(&mut rng), open01(&mut rng)));
                segments.extend([[a, b], [a + 1e-16 * c, b - 2e-16 * c], [a, b], [b - 1e-13 * c, a]]);
            }
            let noded = Noded::new(&segments).unwrap();
            for (i, p) in noded.pieces.iter().enumerate() {
                for q in &noded.pieces[..i] {
                    let ends = [p, q].map(|piece| piece.nodes.map(|n| noded.nodes[n as usize]));
                    assert!(Meeting::of(ends[0], ends[1]).is_none());
                }
            }
        }
    }
}
