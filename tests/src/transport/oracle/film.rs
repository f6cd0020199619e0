//! Pixels: ∫ h(u) L(u) du over the pieces of the film on which one line is seen.

use flatland::plane::Filter;
use flatland::transport::Film;
use num_dual::{Dual64, DualNum};

use super::adaptive::{Precision, integrate};
use super::place::Place;
use super::reflection::Reflection;
use super::term::Term;

/// The maximum number of pixels whose filters overlap.
const OVERLAP: usize = 4;

/// A part of the film on which one line is seen and every filter is smooth.
struct Piece {
    ends: [Dual64; 2],
    seen: Option<usize>,
}

/// Half the length of a filter's support.
fn radius(filter: Filter) -> f64 {
    match filter {
        Filter::Box => 0.5,
        Filter::Tent => 1.0,
        Filter::Gaussian => 2.0,
    }
}

/// h at an offset from the pixel's centre, inside the support.
fn profile(filter: Filter, offset: Dual64) -> Dual64 {
    match filter {
        Filter::Box => 1.0.into(),
        Filter::Tent => -offset * offset.re.signum() + 1.0,
        Filter::Gaussian => {
            // σ = ½, lowered to 0 at the radius 2; ∫ exp(−2x²) over [−2, 2] is √(π/2) erf(2√2).
            const ERF: f64 = 0.999_936_657_516_333_8;
            let lowered = (-8.0_f64).exp();
            let mass = (0.5 * std::f64::consts::PI).sqrt() * ERF - 4.0 * lowered;
            ((offset * offset * -2.0).exp() - lowered) / mass
        }
    }
}

/// All pixels.
pub(super) fn image(reflection: &Reflection, film: &Film, bounces: usize, precision: Precision) -> Vec<Term> {
    let mut pixels = vec![Term::default(); film.pixels];
    let reach = radius(film.filter) - 0.5;
    let (first, last) = (-reach, film.pixels as f64 + reach);
    let bounds = events(reflection, first, last);
    // Every filter is smooth between multiples of ½.
    let mut low = first;
    while low < last {
        let high = low + 0.5;
        let centre = 0.5 * (low + high);
        let covered: Vec<usize> =
            (0..film.pixels).filter(|p| (*p as f64 + 0.5 - centre).abs() < radius(film.filter)).collect();
        for piece in pieces(&bounds, low, high) {
            let parts = integral(reflection, film.filter, &covered, &piece, bounces, precision);
            covered.iter().zip(parts).for_each(|(p, part)| pixels[*p] += part);
        }
        low = high;
    }
    pixels
}

/// The film from `first` to `last`, split by the visible line. A vertex with the same line on both sides is
/// no split.
fn events(reflection: &Reflection, first: f64, last: f64) -> Vec<Piece> {
    let scene = &reflection.scene;
    let inside = |u: &Dual64| first < u.re && u.re < last;
    let projected = scene.vertices.iter().filter_map(|v| scene.eye.project(*v)).filter(inside);
    let mut limits: Vec<Dual64> = projected.chain([first.into(), last.into()]).collect();
    limits.sort_by(|a, b| a.re.total_cmp(&b.re));
    let mut found: Vec<Piece> = vec![];
    for pair in limits.windows(2).filter(|pair| pair[0].re < pair[1].re || pair[0].eps != pair[1].eps) {
        let middle = scene.eye.direction((pair[0] + pair[1]) * 0.5).value();
        let seen = scene.first(scene.eye.position.value(), middle, None);
        match found.last_mut() {
            Some(last) if last.seen == seen => last.ends[1] = pair[1],
            _ => found.push(Piece { ends: [pair[0], pair[1]], seen }),
        }
    }
    found
}

/// The parts that lie in a fixed interval.
fn pieces(of: &[Piece], low: f64, high: f64) -> impl Iterator<Item = Piece> + '_ {
    let clip = move |u: Dual64| {
        if u.re <= low {
            low.into()
        } else if u.re >= high {
            high.into()
        } else {
            u
        }
    };
    of.iter()
        .filter(move |p| p.ends[1].re > low && p.ends[0].re < high)
        .map(move |p| Piece { ends: p.ends.map(clip), seen: p.seen })
}

/// The part of each covered pixel due to a piece: u = u₀ + ξ(u₁ − u₀) at fixed ξ.
fn integral(
    reflection: &Reflection,
    filter: Filter,
    covered: &[usize],
    piece: &Piece,
    bounces: usize,
    precision: Precision,
) -> [Term; OVERLAP] {
    let scene = &reflection.scene;
    let width = piece.ends[1] - piece.ends[0];
    let radiance = |u: Dual64| {
        let mut light = Term::new(scene.emission(piece.seen));
        if let Some(line) = piece.seen {
            let direction = scene.eye.direction(u);
            let point = scene.meet(line, scene.eye.position, direction);
            let place = Place::new(scene, line, point, scene.eye.position, direction);
            light += reflection.at(&place, bounces);
        }
        light
    };
    integrate(breaks(reflection, piece, bounces), precision, |xi| {
        let u = piece.ends[0] + width * xi;
        // The terms that cancel where a piece is narrow and its ends move alike.
        let speed = (1.0 - xi) * piece.ends[0].eps.abs() + xi * piece.ends[1].eps.abs();
        let rate = piece.ends[0].eps.abs() + piece.ends[1].eps.abs();
        let light = radiance(u);
        let mut parts = [Term::default(); OVERLAP];
        for (part, pixel) in parts.iter_mut().zip(covered) {
            let h = profile(filter, u - (*pixel as f64 + 0.5));
            *part = light * (h * width);
            let slope = profile(filter, Dual64::new(u.re - (*pixel as f64 + 0.5), 1.0)).eps.abs();
            part.absolute += light.value.re * (h.re * rate + slope * speed * width.re);
        }
        parts
    })
}

/// ξ where the light of a piece is not smooth.
fn breaks(reflection: &Reflection, piece: &Piece, bounces: usize) -> Vec<f64> {
    let scene = &reflection.scene;
    let Some(line) = piece.seen.filter(|_| bounces > 0) else { return vec![] };
    let [from, to] = piece.ends.map(|u| u.re);
    let events = reflection.on_line(line, scene.eye.position.value());
    let seen = events.into_iter().filter_map(|p| scene.eye.project_value(p));
    seen.map(|u| (u - from) / (to - from)).collect()
}
