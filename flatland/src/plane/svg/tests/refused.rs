//! Tests of rejected input: errors give name and position, and no input makes the reader panic.

use super::*;
use crate::plane::SceneError;

/// Every error names the element, its id, its position and the cause.
#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    let square = "width='1' height='1'";
    let rect = |attributes: &str| format!("<rect id='bad' {square} {attributes}/>");
    // Causes, and attributes of a square that has them.
    let attributes = [
        ("stroke", "stroke='red'"),
        ("stroke", "fill='none' style='stroke:#000'"),
        ("opacity", "opacity='.5'"),
        ("fill opacity", "fill-opacity='50%'"),
        ("fill opacity", "fill='#ff000080'"),
        ("filter", "filter='blur(2px)'"),
        ("filter", "filter='url(#f)'"),
        ("clip-path", "clip-path='url(#c)'"),
        ("clip-path", "style='clip-path:circle(40%)'"),
        ("mask", "style='mask:url(#m)'"),
        ("mix-blend-mode", "style='mix-blend-mode:multiply'"),
        ("marker-end", "marker-end='url(#m)'"),
        ("radialGradient", "fill='url(#r)'"),
        ("pattern", "fill='url(#p)'"),
        ("nothing", "fill='url(#none) red'"),
        ("rotate", "style='rotate:45deg'"),
        ("background", "style='background:red'"),
        ("-webkit-mask", "style='-webkit-mask:url(#m)'"),
        ("another namespace", "xml:id='r'"),
        ("transform=", "transform='rotate(4'"),
        ("transform=", "transform='turn(4)'"),
        ("transform=", "style='transform:rotate(45deg)'"),
        ("transform=", "transform='scale(1e-9)'"),
        ("fill=", "fill='#12'"),
        ("fill=", "fill='lavendar'"),
        ("fill=", "fill='oklch(0.5 0.2 100)'"),
        ("fill=", "style='fill:var(--a)'"),
        ("stroke=", "stroke='rgb(1,2)'"),
        ("fill-rule=", "fill-rule='odd'"),
        ("opacity=", "opacity='half'"),
        ("rx=", "rx='1vw'"),
        ("rx=", "rx='-1'"),
        ("style=", "style='font:1px/2 a;fill:red'"),
        ("style=", "style='FILL:red'"),
        ("style=", "style='*fill:red'"),
    ];
    let paths =
        ["M0 0L1", "M0 0h5v5zQ", "L0 0h5v5z", "M0 0h5v5z 3 4", "M0 0hNaNv5z", "M0 0hinfv5z", "M0 0h1e999v5z"];
    let paths = paths.iter().chain(&["M0 0h1e99v5z", "M0 0A5 5 0 2 0 9 9", "M0 0A1e-300 5 0 1 0 9 9"]);
    let points = ["0 0 1 1 2", "0 0 1 x"];
    let contents = [
        ("text", "<text id='bad' x='1'>a</text>"),
        ("text", "<text id='bad' visibility='hidden'>a</text>"),
        ("image", "<image id='bad' href='a.png' width='1' height='1'/>"),
        ("foreignObject", "<foreignObject id='bad'/>"),
        ("switch", "<switch id='bad'><g/></switch>"),
        ("script", "<script id='bad'/>"),
        ("blob", "<blob id='bad'/>"),
        ("stroke", "<g stroke='red'><line id='bad' x2='5'/></g>"),
        ("opacity", "<g id='bad' opacity='.5'><rect width='1' height='1'/></g>"),
        ("nothing", "<use id='bad'/>"),
        ("nothing", "<use id='bad' href='#none'/>"),
        ("nothing", "<use id='bad' href='other.svg#a'/>"),
        ("nothing", "<i:a xmlns:i='i' id='i'/><use id='bad' href='#i'/>"),
        ("animate in rect", "<rect width='1' height='1'><animate id='bad'/></rect>"),
        ("given before", "<g id='bad'/><rect id='bad' width='1' height='1'/>"),
        ("given before", "<i:a xmlns:i='i' id='bad'/><rect id='bad' width='1' height='1'/>"),
        ("selector", "<style id='bad'>g > rect { fill: red }</style>"),
        ("selector", "<style id='bad'>g /rect { fill: red }</style>"),
        ("selector", "<style id='bad'>@import 'a'; .a { fill: red }</style>"),
        ("open block", "<style id='bad'>.a { fill: red</style>"),
        ("text/css", "<style id='bad' media='print'>.a { fill: red }</style>"),
        ("filter", "<style id='bad'>.a { filter: blur(2px) }</style>"),
        ("display", "<style id='bad'>.s { display: inline }</style>"),
        ("10⁶", "<g transform='scale(1e5)'><rect id='bad' width='20' height='1'/></g>"),
        ("r=", "<circle id='bad' r='-1'/>"),
        ("viewBox=", "<svg id='bad' viewBox='0 0 0 5'/>"),
        ("clipping", "<symbol id='s'><rect width='3' height='3'/></symbol><use id='bad' href='#s'/>"),
    ];
    let defined = "<filter id='f'/><clipPath id='c'/><mask id='m'/><radialGradient id='r'/><pattern id='p'/>";
    let cases = attributes.map(|(what, text)| (what, rect(text))).into_iter();
    let cases = cases.chain(paths.map(|d| (" d=", format!("<path id='bad' d='{d}'/>"))));
    let cases = cases.chain(points.map(|p| ("points=", format!("<polygon id='bad' points='{p}'/>"))));
    for (what, content) in cases.chain(contents.map(|(what, text)| (what, text.to_owned()))) {
        let defined = if content.contains("id='m'") { "" } else { defined };
        let message = refuse(&format!("{defined}\n{content}")).to_string();
        let place = message.contains("id=\"bad\"> at line 3, column");
        // A number beyond single precision is found when it is read or when it is transformed.
        let is_named = message.contains(what.trim()) || (what == " d=" && message.contains("10⁶"));
        assert!(place && is_named, "{content}: {message}");
    }
    assert!(matches!(refuse("<g id='bad'><use href='#bad'/></g>"), SvgError::Unsupported { .. }));
    // Errors about gradients name the element painted.
    let stops = "<stop/><stop offset='1' stop-color='red'/>";
    for (what, gradient) in [
        ("spreadMethod", format!("<linearGradient id='h' spreadMethod='reflect'>{stops}</linearGradient>")),
        ("two colours", "<linearGradient id='h'><stop/><stop stop-color='red'/></linearGradient>".to_owned()),
        ("stop-opacity", format!("<linearGradient id='h'>{stops}<stop stop-opacity='.5'/></linearGradient>")),
        (
            "no inverse",
            format!(
                "<linearGradient id='h' gradientTransform='matrix(1 1 1 1 0 0)'>{stops}</linearGradient>"
            ),
        ),
    ] {
        let message = refuse(&format!("{gradient}\n{}", rect("fill='url(#h)'"))).to_string();
        assert!(message.contains(what) && message.contains("<rect id=\"bad\"> at line 3"), "{message}");
    }
}

#[test]
fn references_in_circles_are_refused() {
    let cases = [
        "<linearGradient id='a' href='#b'/><linearGradient id='b' href='#c'/>\
         <linearGradient id='c' href='#b'/><rect fill='url(#a)' width='1' height='1'/>",
        "<linearGradient id='a' href='#a'/><rect fill='url(#a)' width='1' height='1'/>",
        "<pattern id='a'><rect fill='url(#b)' width='1' height='1'/></pattern>\
         <pattern id='b'><rect fill='url(#c)' width='1' height='1'/></pattern>\
         <pattern id='c'><rect fill='url(#b)' width='1' height='1'/></pattern>\
         <rect fill='url(#a)' width='1' height='1'/>",
        "<g id='a'><use href='#b'/></g><g id='b'><use href='#a'/></g>",
        "<defs><use id='a' href='#a'/></defs><rect width='1' height='1'/>",
    ];
    for content in cases {
        assert!(matches!(refuse(content), SvgError::Unsupported { .. }), "{content}");
    }
    // 2³⁰ rectangles by 30 uses.
    let mut bomb = "<rect id='u0' width='1' height='1'/>".to_owned();
    for i in 0..30 {
        bomb.push_str(&format!("<g id='u{}'><use href='#u{i}'/><use href='#u{i}'/></g>", i + 1));
    }
    assert!(matches!(refuse(&bomb), SvgError::Unsupported { .. }));
    let deep = |n: usize| format!("{}<rect width='1' height='1'/>{}", "<g>".repeat(n), "</g>".repeat(n));
    assert_eq!(areas(&draw(&deep(250))), [1.0]);
    assert!(matches!(refuse(&deep(300)), SvgError::Unsupported { .. }));
    assert!(matches!(refuse(&deep(100_000)), SvgError::Unsupported { .. }));
}

#[test]
fn broken_documents() {
    let options = SvgOptions::default();
    let error = |text: &str| parse(text, &options).unwrap_err();
    assert!(matches!(error(""), SvgError::Xml { line: 1, .. }));
    assert!(matches!(error("no markup"), SvgError::Xml { .. }));
    let broken = "<svg xmlns='http://www.w3.org/2000/svg'>\n<g>\n  <rect width=1/>\n</g></svg>";
    assert!(matches!(error(broken), SvgError::Xml { line: 3, column: 15, .. }), "{}", error(broken));
    assert!(matches!(error("<svg xmlns='http://www.w3.org/2000/svg'><g>"), SvgError::Xml { .. }));
    assert!(matches!(error("<html/>"), SvgError::Unsupported { .. }));
    assert!(matches!(error("<svg xmlns='http://www.w3.org/2000/svg'/>"), SvgError::Empty));
    let no_size = "<svg xmlns='http://www.w3.org/2000/svg' width='0' height='5'/>";
    assert!(matches!(error(no_size), SvgError::Document { .. }));
    let entity = "<!DOCTYPE svg [<!ENTITY e '<rect width=\"1\" height=\"1\"/>'>]>\
                  <svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'>&e;&e;</svg>";
    assert!(matches!(error(entity), SvgError::Unsupported { .. }));
    let external = "<?xml-stylesheet href='a.css'?><svg xmlns='http://www.w3.org/2000/svg'/>";
    assert!(matches!(error(external), SvgError::Unsupported { .. }));
    let background = SvgOptions { background: DVec3::NAN, ..options };
    let scene = parse(&svg("<rect width='1' height='1'/>"), &background);
    assert!(matches!(scene, Err(SvgError::Scene(SceneError::Background))));
    let missing = read(Path::new("/nonexistent/drawing.svg"), &options).unwrap_err();
    assert!(matches!(&missing, SvgError::Io { path, .. } if path.ends_with("drawing.svg")));
    // The page's colour is a shape behind all others.
    let page = "<svg xmlns='http://www.w3.org/2000/svg' id='page' width='9' height='9' \
                style='background-color:#00f'><rect width='1' height='1'/></svg>";
    let page = parse(page, &options).unwrap();
    assert_eq!((page.name(0), areas(&page)), (Some("page"), vec![81.0, 1.0]));
    // A byte order mark and an entity in an attribute do no harm.
    let marked = "\u{feff}<!DOCTYPE svg [<!ENTITY w '7'>]><svg xmlns='http://www.w3.org/2000/svg' \
                  width='9' height='9'><rect width='&w;' height='&w;'/></svg>";
    assert_eq!(areas(&parse(marked, &options).unwrap()), [49.0]);
}

/// No input makes the reader panic: a document cut short anywhere, and with bytes changed.
#[test]
fn mutated_documents_do_not_panic() {
    let valid = svg("<style>.c1, g rect { fill: #fa0; } #q{opacity:1}</style>\n\
         <defs><linearGradient id='g' x2='0' y2='1' gradientTransform='rotate(9)'>\
         <stop offset='10%' stop-color='red'/><stop offset='1' style='stop-color:#00f'/></linearGradient>\n\
         <linearGradient id='h' xlink:href='#g' xmlns:xlink='http://www.w3.org/1999/xlink'/></defs>\n\
         <g id='q' transform='translate(1,2) rotate(3) scale(.9)' fill='url(#g)'>\n\
         <path class='c1' d='M10,10C20-5 9e1,5 50 60s-30 3-20 9q3 3 4 9t3 1a5 6 7 0 1 8 9z' fill-rule='evenodd'/>\n\
         <polygon points='1,1 9,1 2,8 5,0 6,7' style='fill:url(#h);stroke:none'/><circle cx='50' r='9'/>\n\
         <use href='#r' x='3'/><rect id='r' width='9' height='50%' rx='1'/><ellipse rx='2' ry='3'/></g>");
    let options = SvgOptions::default();
    assert_eq!(parse(&valid, &options).unwrap().scene.shapes().len(), 6);
    for end in (0..valid.len()).filter(|&end| valid.is_char_boundary(end)) {
        assert!(parse(&valid[..end], &options).is_err(), "cut at byte {end}");
    }
    let mut rng = stream(11, &[]);
    let alphabet: Vec<char> = "09-+.,eEMmzAaQ #%()<>/='\"&;:{}\n*@!-xé\u{0}".chars().collect();
    let characters: Vec<char> = valid.chars().collect();
    let mut accepted = 0;
    for _ in 0..4000 {
        let mut mutant = characters.clone();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..mutant.len());
            let new = alphabet[rng.random_range(0..alphabet.len())];
            match rng.random_range(0..4) {
                0 => mutant.insert(at, new),
                1 => drop(mutant.remove(at)),
                2 => {
                    let other = rng.random_range(0..mutant.len());
                    mutant.swap(at, other);
                }
                _ => mutant[at] = new,
            }
        }
        let text: String = mutant.into_iter().collect();
        if let Ok(drawing) = parse(&text, &options) {
            accepted += 1;
            assert!(drawing.scene.vertices().iter().all(|v| v.is_finite()), "{text}");
        }
    }
    assert!(accepted > 0);
}
