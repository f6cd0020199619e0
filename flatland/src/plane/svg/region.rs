//! Fill rules: conversion of rings that may cross to a polygon.

use std::collections::HashMap;

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule as OverlayFillRule;
use i_overlay::core::overlay::{ContourDirection, IntOverlayOptions, Overlay};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;
use usvg::FillRule;

use super::super::{Polygon, PolygonError, orient};
use super::GRID;

/// The region of rings under a fill rule; `None` if it has no area.
pub(super) fn polygon(rings: Vec<Vec<DVec2>>, rule: FillRule) -> Result<Option<Polygon>, PolygonError> {
    let rings = clean(rings);
    if rings.is_empty() {
        return Ok(None);
    }
    match Polygon::new(rings.clone()) {
        Ok(polygon) if rule == FillRule::EvenOdd || is_nonzero_alike(&polygon) => return Ok(Some(polygon)),
        Ok(_) | Err(PolygonError::EdgesMeet { .. }) => {}
        Err(error) => return Err(error),
    }
    let rings = clean(resolve(&rings, rule));
    if rings.is_empty() { Ok(None) } else { Polygon::new(rings).map(Some) }
}

/// Drops repeated vertices and rings of zero area.
fn clean(rings: Vec<Vec<DVec2>>) -> Vec<Vec<DVec2>> {
    rings
        .into_iter()
        .filter_map(|mut ring| {
            ring.dedup();
            while ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            let (&a, &b) = (ring.first()?, ring.get(1)?);
            ring.iter().any(|&c| orient(a, b, c) != 0.0).then_some(ring)
        })
        .collect()
}

/// Whether the nonzero rule fills a polygon like the even-odd rule.
fn is_nonzero_alike(polygon: &Polygon) -> bool {
    // The winding number changes by 1 across an edge: upwards where the interior is to its left.
    // Outermost components have 0 outside, so all their edges must have the interior on one side
    // for 0 to be in their holes too; and so on inwards. Hence: one side per component.
    let key = |p: DVec2| p.to_array().map(f64::to_bits);
    let position = |v: u32| key(polygon.vertices()[v as usize]);
    let boundary: HashMap<_, bool> = polygon
        .edges()
        .map(|e| e.map(|v| key(polygon.vertices()[v])))
        .flat_map(|[a, b]| [([a, b], true), ([b, a], false)])
        .collect();
    let triangles = polygon.triangles();
    let edges = |t: usize| [0, 1, 2].map(|k| [triangles[t][k], triangles[t][(k + 1) % 3]].map(position));
    let owner: HashMap<_, usize> =
        (0..triangles.len()).flat_map(|t| edges(t).map(|edge| (edge, t))).collect();
    let mut seen = vec![false; triangles.len()];
    for first in 0..triangles.len() {
        let mut side = None;
        let mut todo = vec![first];
        while let Some(t) = todo.pop() {
            if std::mem::replace(&mut seen[t], true) {
                continue;
            }
            for [a, b] in edges(t) {
                match boundary.get(&[a, b]) {
                    Some(&left) if *side.get_or_insert(left) != left => return false,
                    Some(_) => {}
                    None => todo.extend(owner.get(&[b, a])),
                }
            }
        }
    }
    true
}

/// Rings that do not cross, with the even-odd region of the given rings.
fn resolve(rings: &[Vec<DVec2>], rule: FillRule) -> Vec<Vec<DVec2>> {
    let rule = match rule {
        FillRule::NonZero => OverlayFillRule::NonZero,
        FillRule::EvenOdd => OverlayFillRule::EvenOdd,
    };
    // Coordinates are at most 10⁶/GRID < 2⁴¹: exact in i64 and, converted back, in f64.
    let to_grid = |p: &DVec2| IntPoint::new((p.x / GRID).round() as i64, (p.y / GRID).round() as i64);
    let contours: Vec<Vec<_>> = rings.iter().map(|ring| ring.iter().map(to_grid).collect()).collect();
    let options = IntOverlayOptions {
        preserve_input_collinear: false,
        output_direction: ContourDirection::CounterClockwise,
        // A vertex on a straight edge may be where another ring touches it.
        preserve_output_collinear: true,
        min_output_area: 0,
        ogc: false,
    };
    let mut overlay = Overlay::<i64>::from_subj_custom(&contours, options, Default::default());
    let shapes = overlay.overlay(OverlayRule::Subject, rule);
    let from_grid = |p: IntPoint<i64>| GRID * DVec2::new(p.x as f64, p.y as f64);
    shapes.into_iter().flatten().map(|ring| ring.into_iter().map(from_grid).collect()).collect()
}
