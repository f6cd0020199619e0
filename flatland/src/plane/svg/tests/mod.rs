//! Tests of the geometry and the colours read from SVG; rejected input is tested in `refused`.

mod refused;

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rand::RngExt;

use super::super::{Polygon, orient};
use super::*;
use crate::random::stream;

/// A document of 100 × 100 with the given content, which begins in line 2.
fn svg(content: &str) -> String {
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"100\">\n{content}\n</svg>")
}

fn draw(content: &str) -> Drawing {
    parse(&svg(content), &SvgOptions::default()).unwrap_or_else(|error| panic!("{content}: {error}"))
}

fn refuse(content: &str) -> SvgError {
    match parse(&svg(content), &SvgOptions::default()) {
        Ok(_) => panic!("not refused: {content}"),
        Err(error) => error,
    }
}

fn area(polygon: &Polygon) -> f64 {
    let v = |i: u32| polygon.vertices()[i as usize];
    polygon.triangles().iter().map(|t| 0.5 * orient(v(t[0]), v(t[1]), v(t[2]))).sum()
}

fn areas(drawing: &Drawing) -> Vec<f64> {
    drawing.scene.shapes().iter().map(|s| area(s.polygon())).collect()
}

#[track_caller]
fn assert_near(value: f64, reference: f64, tolerance: f64) {
    assert!((value - reference).abs() <= tolerance, "{value} is not {reference} within {tolerance}");
}

fn point(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

#[test]
fn rectangle() {
    let drawing = draw("<rect id='r' x='10' y='20' width='30' height='40' fill='#3366cc'/>");
    assert_eq!(drawing.size, point(100.0, 100.0));
    let corners = [(10.0, 20.0), (40.0, 20.0), (40.0, 60.0), (10.0, 60.0)];
    let polygon = drawing.scene.shapes()[0].polygon();
    assert_eq!(polygon.vertices(), corners.map(|(x, y)| point(x, y)));
    let hit = drawing.scene.hit(point(11.0, 59.0));
    assert_eq!(drawing.scene.value(hit.as_ref(), point(11.0, 59.0)), DVec3::new(0.2, 0.4, 0.8));
    assert_eq!(drawing.scene.value(None, point(0.0, 0.0)), DVec3::ONE);
}

#[test]
fn view_box_and_units() {
    let text = "<svg xmlns='http://www.w3.org/2000/svg' width='2in' height='96' viewBox='-1 -1 4 2'>\
                <rect x='-1' y='-1' width='50%' height='1'/></svg>";
    let drawing = parse(text, &SvgOptions::default()).unwrap();
    assert_eq!(drawing.size, point(192.0, 96.0));
    assert_eq!(drawing.scene.bounds(), Some((point(0.0, 0.0), point(96.0, 48.0))));
}

#[test]
fn painters_order_and_names() {
    let drawing = draw(
        "<g id='outer'><g><rect id='a' width='9' height='9'/></g><g id='inner'>\
         <rect width='8' height='8'/><path id='b' d='M0,0h7v7z'/></g></g><rect width='1' height='1'/>",
    );
    let names: Vec<_> = (0..4).map(|i| drawing.name(i)).collect();
    assert_eq!(names, [Some("a"), Some("inner"), Some("b"), None]);
    assert_eq!(drawing.name(4), None);
    assert_eq!(drawing.ids[2], ["b", "inner", "outer"]);
    assert_eq!(drawing.shapes_under("outer"), [0, 1, 2]);
    assert_eq!(drawing.shapes_under("inner"), [1, 2]);
    assert_eq!(drawing.shapes_under("b"), [2]);
    assert!(drawing.shapes_under("nothing").is_empty());
    assert_eq!(drawing.scene.hit(point(0.9, 0.5)).unwrap().shape(), 3);
}

#[test]
fn holes_by_either_rule() {
    let outer = "M0 0H40V40H0z";
    let same = "M10 10H30V30H10z";
    let opposite = "M10 10V30H30V10z";
    let case = |d: &str, rule: &str| areas(&draw(&format!("<path d='{d}' fill-rule='{rule}'/>")))[0];
    assert_eq!(case(&format!("{outer}{same}"), "evenodd"), 1200.0);
    assert_eq!(case(&format!("{outer}{opposite}"), "evenodd"), 1200.0);
    assert_eq!(case(&format!("{outer}{same}"), "nonzero"), 1600.0);
    assert_eq!(case(&format!("{outer}{opposite}"), "nonzero"), 1200.0);
    // An island in the hole, of either orientation.
    for island in ["M15 15H25V25H15z", "M15 15V25H25V15z"] {
        assert_eq!(case(&format!("{outer}{opposite}{island}"), "nonzero"), 1300.0);
        assert_eq!(case(&format!("{outer}{same}{island}"), "evenodd"), 1300.0);
        assert_eq!(case(&format!("{outer}{same}{island}"), "nonzero"), 1600.0);
    }
    // Two components with different orientations.
    assert_eq!(case(&format!("{same}M50 50V60H60V50z"), "nonzero"), 500.0);
}

#[test]
fn star_by_either_rule() {
    // The pentagram {5/2}, of circumradius 40.
    let corners = (0..5).map(|k| {
        let angle = f64::from(2 * k) * 2.0 * PI / 5.0;
        format!("{},{}", 50.0 + 40.0 * angle.sin(), 50.0 - 40.0 * angle.cos())
    });
    let points = corners.collect::<Vec<_>>().join(" ");
    let case =
        |rule: &str| areas(&draw(&format!("<polygon points='{points}' fill-rule='{rule}'/>")))[0] / 1600.0;
    // The edges lie on lines at the distance h = cos 72° from the centre; they form the inner
    // pentagon, of area 5 h² tan 36°, and five tips of height 1 − h over its sides.
    let (h, side) = ((2.0 * PI / 5.0).cos(), 2.0 * (2.0 * PI / 5.0).cos() * (PI / 5.0).tan());
    let inner = 5.0 * 0.5 * h * side;
    let tips = 5.0 * 0.5 * (1.0 - h) * side;
    assert_near(case("nonzero"), inner + tips, 1e-6);
    assert_near(case("evenodd"), tips, 1e-6);
}

#[test]
fn nested_transforms() {
    let drawing = draw(
        "<g transform='translate(50 50)'><g transform='rotate(90) scale(2,1)'>\
         <rect x='1' y='2' width='3' height='4' transform='skewX(45)'/></g></g>",
    );
    // skewX(45): (x + y, y); then (2x, y); then (−y, x); then + 50.
    let place = |x: f64, y: f64| point(50.0 - y, 50.0 + 2.0 * (x + y));
    let expected = [place(1.0, 2.0), place(4.0, 2.0), place(4.0, 6.0), place(1.0, 6.0)];
    for (v, e) in drawing.scene.vertices().iter().zip(expected) {
        assert!(v.distance(e) < 1e-4, "{v} {e}");
    }
    assert_near(areas(&drawing)[0], 24.0, 1e-4);
}

#[test]
fn curves_within_tolerance() {
    let options = |tolerance| SvgOptions { tolerance, ..SvgOptions::default() };
    let mut counts = vec![];
    for tolerance in [1.0, 0.1, 0.01, 0.001] {
        // A scale on top: the tolerance is in pixels of the image.
        let circle = "<g transform='scale(10)'><circle cx='5' cy='5' r='4'/></g>";
        let drawing = parse(&svg(circle), &options(tolerance)).unwrap();
        // Chords are inside; usvg's cubics are off by 2.8·10⁻⁴ r.
        let cubic = 2.8e-4 * 40.0;
        for &v in drawing.scene.vertices() {
            assert_near(v.distance(point(50.0, 50.0)), 40.0, cubic);
        }
        let error = PI * 1600.0 - areas(&drawing)[0];
        assert!(error.abs() < 2.0 * PI * 40.0 * (tolerance + cubic), "{tolerance}: {error}");
        counts.push(drawing.scene.vertices().len());
        // The parabola from (0, 0) over (50, 100) to (100, 0): y = 2x(1 − x/100).
        let drawing = parse(&svg("<path d='M0 0Q50 100 100 0'/>"), &options(tolerance)).unwrap();
        let mut last = DVec2::ZERO;
        for &v in drawing.scene.vertices() {
            let mid = 0.5 * (v + last);
            assert_near(mid.y, 2.0 * mid.x * (1.0 - mid.x / 100.0), tolerance * 1.0001);
            last = v;
        }
        let segments = drawing.scene.vertices().len() - 1;
        assert_eq!(segments, (200.0 / (4.0 * tolerance)).sqrt().ceil() as usize);
    }
    assert!(counts.is_sorted_by(|a, b| a < b), "{counts:?}");
    for tolerance in [0.0, -1.0, 1e-9, f64::NAN, f64::INFINITY] {
        let error = parse(&svg("<rect width='1' height='1'/>"), &options(tolerance)).unwrap_err();
        assert!(matches!(error, SvgError::Tolerance { .. }));
    }
}

#[test]
fn gradient_values() {
    let stops = "<stop offset='0.25' stop-color='#000'/><stop offset='0.75' stop-color='#f00'/>";
    let red = |drawing: &Drawing, x: f64, y: f64| {
        let hit = drawing.scene.hit(point(x, y));
        drawing.scene.value(hit.as_ref(), point(x, y))
    };
    // Bounding box, default vector.
    let drawing = draw(&format!(
        "<linearGradient id='g'>{stops}</linearGradient>\
         <rect x='20' y='20' width='40' height='10' fill='url(#g)'/>"
    ));
    for (x, value) in [(25.0, 0.0), (30.0, 0.0), (35.0, 0.25), (45.0, 0.75), (55.0, 1.0)] {
        let colour = red(&drawing, x, 25.0);
        assert_near(colour.x, value, 1e-6);
        assert_eq!((colour.y, colour.z), (0.0, 0.0));
    }
    // User space, a transform of the gradient with skew, and one of the shape.
    let drawing = draw(&format!(
        "<linearGradient id='g' gradientUnits='userSpaceOnUse' x1='0' y1='0' x2='10' y2='0' \
         gradientTransform='translate(1 2) skewX(45)'>{stops}</linearGradient>\
         <g transform='translate(5 0) rotate(90)'>\
         <rect x='0' y='-90' width='90' height='90' fill='url(#g)'/></g>"
    ));
    for (x, y) in [(0.0, 0.0), (3.0, -1.0), (7.0, -4.0), (5.0, -2.0), (1.0, -5.0)] {
        // In the gradient's coordinates (x, y), in user space (x + y + 1, y + 2), in the image
        // (5 − y', x').
        let (user_x, user_y) = (x + y + 1.0, y + 2.0);
        let (image_x, image_y) = (5.0 - user_y, user_x);
        let t: f64 = x / 10.0;
        let expected = ((t - 0.25) / 0.5).clamp(0.0, 1.0);
        if drawing.scene.hit(point(image_x, image_y)).is_some() {
            assert_near(red(&drawing, image_x, image_y).x, expected, 1e-5);
        }
        // The shade is affine beyond the shape as well.
        let shade = drawing.scene.shapes()[0].shade();
        assert_near(shade.value(point(image_x, image_y)).x, expected, 1e-5);
    }
    // Stops from another gradient; a vector without length paints the last colour.
    let drawing = draw(&format!(
        "<linearGradient id='s'>{stops}</linearGradient>\
         <linearGradient id='g' href='#s' gradientUnits='userSpaceOnUse' x1='3' x2='3'/>\
         <rect width='10' height='10' fill='url(#g)'/>"
    ));
    assert_eq!(red(&drawing, 5.0, 5.0), DVec3::X);
    // Equal colours at one offset are no discontinuity.
    let drawing = draw(
        "<linearGradient id='g'><stop/><stop offset='.5' stop-color='red'/>\
         <stop offset='.5' stop-color='#f00'/><stop offset='1'/></linearGradient>\
         <rect width='10' height='10' fill='url(#g)'/>",
    );
    assert_near(red(&drawing, 4.0, 5.0).x, 0.8, 1e-5);
    assert_near(red(&drawing, 6.0, 5.0).x, 0.8, 1e-5);
    // The attachment is passed on.
    let options = SvgOptions { attachment: Attachment::Material, ..SvgOptions::default() };
    let text = svg(&format!(
        "<linearGradient id='g'>{stops}</linearGradient><rect width='9' height='9' fill='url(#g)'/>"
    ));
    let drawing = parse(&text, &options).unwrap();
    assert_eq!(drawing.scene.shapes()[0].shade().attachment(), Attachment::Material);
}

#[test]
fn invisible_content_is_left_out() {
    let seen = "<rect id='seen' width='10' height='10'/>";
    let hidden = [
        "<g display='none'><text>a</text><image href='a.png'/></g>",
        "<text style='display:none'>a</text>",
        "<g visibility='hidden'><rect width='9' height='9' stroke='red'/></g>",
        "<rect width='9' height='9' fill='none'/>",
        "<rect width='9' height='9' fill-opacity='0'/>",
        "<rect width='9' height='9' fill='transparent'/>",
        "<rect width='9' height='9' opacity='0%'/>",
        "<rect width='0' height='9'/>",
        "<circle r='0'/>",
        "<path/>",
        "<path d=''/>",
        "<path d='M1 1L5 5z'/>",
        "<path d='M1 1L5 5L2 2z'/>",
        "<polyline points='1 1'/>",
        "<line x2='5' y2='5'/>",
        "<rect width='9' height='9' transform='scale(0)'/>",
        "<rect width='9' height='9' stroke='red' stroke-width='0' fill='none'/>",
        "<rect width='9' height='9' stroke='red' stroke-opacity='0' fill='none'/>",
        "<style>.h { display: none }</style><path class='h' d='M0 0h1v1z'/>",
        "<defs><text>a</text><filter id='f'/><mask id='m'/><clipPath id='c'/></defs>",
        "<symbol id='s'><text>a</text></symbol>",
        "<title>t</title><desc>d</desc><metadata><a xmlns='x'>text</a></metadata>",
        "<i:image xmlns:i='http://www.inkscape.org' /><i:g xmlns:i='i'><text>a</text></i:g>",
        "<!-- <text/> -->",
    ];
    for content in hidden {
        let drawing = draw(&format!("{content}{seen}"));
        assert_eq!(drawing.ids, [["seen"]], "{content}");
        let error = refuse(content);
        assert!(matches!(error, SvgError::Empty), "{content}: {error}");
    }
    // Visible inside hidden.
    let drawing = draw("<g visibility='hidden'><rect id='v' visibility='visible' width='9' height='9'/></g>");
    assert_eq!(drawing.shapes_under("v"), [0]);
}

#[test]
fn readable_values_are_read() {
    let cases: &[(&str, f64)] = &[
        ("<path d='m 1-1.5.5e1.5L+9,9 z m2 2 3 0 0 3'/>", f64::NAN),
        ("<path d='M0 0h4v4H0zM10 10l4 0 0 4-4 0'/>", 32.0),
        ("<path d='M0,10a10 10 0 0120 0z'/>", 50.0 * PI),
        ("<path d='M0 10A10 10 0 0,1 20,10Z'/>", 50.0 * PI),
        ("<path d='M0 0T4 0 4 4S0 4 0 4z'/>", f64::NAN),
        ("<polygon points=' 0,0 4,0, 4 4 0 4 '/>", 16.0),
        ("<polyline points='0 0 4 0 4 4'/>", 8.0),
        ("<ellipse rx='10' ry='5'/>", 50.0 * PI),
        ("<rect width='10' height='10' rx='5'/>", 25.0 * PI),
        ("<rect width='10' height='10' rx='auto' ry='0'/>", 100.0),
        (
            "<rect width='4' height='4' transform='translate(1), rotate(30,1,2)\n scale(2 -1) skewY(3)'/>",
            32.0,
        ),
        ("<rect width='1cm' height='1e0in'/>", 9600.0 * 0.96 / 2.54),
        (
            "<style>/* c */ rect.a, #b .c { fill: red !important; ; width: auto }</style><rect class='a' width='4' height='4'/>",
            16.0,
        ),
        (
            "<rect style='fill : rgb(1, 2, 3) ; stroke:none;-inkscape-stroke:none' width='4' height='4'/>",
            16.0,
        ),
        ("<a><rect width='4' height='4' fill='inherit' stroke='none' color='red'/></a>", 16.0),
        (
            "<i:d xmlns:i='i' id='b'/><rect id='a' xmlns:i='i' i:width='x' i:d='y' width='4' height='4'/>",
            16.0,
        ),
        ("<svg x='1' overflow='visible'><rect width='4' height='4'/></svg>", 16.0),
    ];
    for (content, expected) in cases {
        let drawing = draw(content);
        let found: f64 = areas(&drawing).iter().sum();
        if !expected.is_nan() {
            // Arcs are coarse at this size.
            assert!((found / expected - 1.0).abs() < 0.02, "{content}: {found} {expected}");
        }
    }
}

#[test]
fn used_elements_belong_to_the_use() {
    let drawing = draw(
        "<defs><g id='leaf'><rect id='part' width='2' height='2'/><rect width='1' height='1'/></g></defs>\
         <g id='tree'><use id='left' href='#leaf'/>\
         <use xlink:href='#leaf' xmlns:xlink='http://www.w3.org/1999/xlink' x='50' fill='red'/></g>\
         <symbol id='s' overflow='visible'><rect width='3' height='3'/></symbol><use id='from' href='#s'/>",
    );
    assert_eq!(drawing.ids[0], ["left", "tree"]);
    assert_eq!(drawing.shapes_under("left"), [0, 1]);
    assert_eq!(drawing.shapes_under("tree"), [0, 1, 2, 3]);
    assert!(drawing.shapes_under("leaf").is_empty());
    assert_eq!(drawing.shapes_under("from"), [4]);
    assert_eq!(drawing.scene.value(drawing.scene.hit(point(51.5, 1.5)).as_ref(), point(51.5, 1.5)), DVec3::X);
    // Clipping viewports are rejected.
    let error = refuse("<svg width='1' height='1'><rect width='3' height='3'/></svg>");
    assert!(matches!(&error, SvgError::Unsupported { what, .. } if what == "clipping"), "{error}");
}

/// The winding number of u, by crossings of a ray.
fn winding(rings: &[Vec<DVec2>], u: DVec2) -> i32 {
    let mut number = 0;
    for ring in rings {
        for (i, &a) in ring.iter().enumerate() {
            let b = ring[(i + 1) % ring.len()];
            if (a.y <= u.y) != (b.y <= u.y) {
                let side = orient(a, b, u);
                number += i32::from(a.y <= u.y && side > 0.0) - i32::from(a.y > u.y && side < 0.0);
            }
        }
    }
    number
}

/// Random rings, on a small grid so that most are degenerate, and in general position.
#[test]
fn fill_rules_agree_with_winding_numbers() {
    let mut rng = stream(7, &[]);
    for case in 0..3000 {
        let rings: Vec<Vec<DVec2>> = (0..rng.random_range(1..4))
            .map(|_| {
                (0..rng.random_range(3..12))
                    .map(|_| {
                        if case % 2 == 0 {
                            point(f64::from(rng.random_range(0..6)), f64::from(rng.random_range(0..6)))
                        } else {
                            point(rng.random_range(0.0..6.0), rng.random_range(0.0..6.0))
                        }
                    })
                    .collect()
            })
            .collect();
        for rule in [usvg::FillRule::NonZero, usvg::FillRule::EvenOdd] {
            let polygon = region::polygon(rings.clone(), rule)
                .unwrap_or_else(|error| panic!("{case} {rule:?}: {error} {rings:?}"));
            let resolved: Vec<Vec<DVec2>> =
                polygon.iter().flat_map(|p| p.rings().map(<[DVec2]>::to_vec)).collect();
            for _ in 0..50 {
                let u = point(rng.random_range(0.0..6.0), rng.random_range(0.0..6.0));
                let edges = rings.iter().flat_map(|r| (0..r.len()).map(|i| (r[i], r[(i + 1) % r.len()])));
                let distance = edges
                    .map(|(a, b)| super::super::segments::distance_squared(u, a, b))
                    .fold(f64::INFINITY, f64::min);
                if distance.sqrt() < 1e-4 {
                    continue;
                }
                let number = winding(&rings, u);
                let is_in = if rule == usvg::FillRule::NonZero { number != 0 } else { number % 2 != 0 };
                assert_eq!(winding(&resolved, u) % 2 != 0, is_in, "{case} {rule:?} {u} {rings:?}");
            }
        }
    }
}
