use super::*;
use crate::random::{open01, stream};

fn random_boxes(n: usize) -> Vec<Aabb> {
    let mut rng = stream(3, &[n as u64]);
    let mut point = || DVec2::new(open01(&mut rng), open01(&mut rng));
    (0..n)
        .map(|_| {
            let (a, b) = (point(), point());
            Aabb::of([a, a.lerp(b, 0.1)])
        })
        .collect()
}

#[test]
fn visits_exactly_the_overlapping_boxes() {
    for n in [0, 1, 5, 300] {
        let boxes = random_boxes(n);
        let tree = BoxTree::build(&boxes);
        let p = DVec2::new(0.4, 0.6);
        let mut seen = vec![];
        tree.visit(
            |b| b.contains(p),
            |i| {
                if boxes[i].contains(p) {
                    seen.push(i);
                }
            },
        );
        seen.sort_unstable();
        let expected: Vec<_> = (0..n).filter(|&i| boxes[i].contains(p)).collect();
        assert_eq!(seen, expected);
    }
}

#[test]
fn last_at_equals_brute_force() {
    let boxes = random_boxes(400);
    let tree = BoxTree::build(&boxes);
    let mut rng = stream(5, &[]);
    for _ in 0..100 {
        let p = DVec2::new(open01(&mut rng), open01(&mut rng));
        let accept = |i: usize| (i.is_multiple_of(3) && boxes[i].contains(p)).then_some(());
        let brute = (0..400).rev().find(|&i| accept(i).is_some());
        assert_eq!(tree.last_at(p, accept).map(|(i, ())| i), brute);
    }
}

#[test]
fn nearest_equals_brute_force() {
    let boxes = random_boxes(200);
    let tree = BoxTree::build(&boxes);
    let p = DVec2::new(-0.3, 0.2);
    let brute = boxes.iter().map(|b| b.distance_squared(p)).fold(f64::INFINITY, f64::min);
    let (_, found) = tree.nearest(p, f64::INFINITY, |i| boxes[i].distance_squared(p)).unwrap();
    assert_eq!(found.to_bits(), brute.to_bits());
}

#[test]
fn identical_boxes_do_not_overflow_the_stack() {
    let b = Aabb::of([DVec2::ZERO, DVec2::ONE]);
    let tree = BoxTree::build(&vec![b; 10_000]);
    let mut count = 0;
    tree.visit(|_| true, |_| count += 1);
    assert_eq!(count, 10_000);
}
