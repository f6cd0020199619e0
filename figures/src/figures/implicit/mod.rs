//! Figure 9: implicit shapes: fields from the points of sphere tracing, and what decides their error.

mod ablation;
mod page;
mod world;

use flatland::sdf::fields::BangaruField;

use self::ablation::{Setting, Steepness};
use self::page::Shown;
use self::world::{Coarseness, Curve, World};
use crate::context::Context;
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Table, write_csv, write_png};
use crate::plot::number;
use crate::ratio::Ratio;

const PICTURE: &str = "figure9_implicit.png";
const FIELDS: &str = "figure9_fields.csv";
const BIAS: &str = "figure9_bias.csv";

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let world = World::new()?;
    let silhouettes = world.silhouettes()?;
    context.step("9 fields against direction");
    let (count, repeats) = context.spend((900, 40), (3000, 400));
    let curves = world::curves(&world, count, repeats, context.seed())?;
    context.step("9 error against steps");
    let most = context.spend(3200, 12_800);
    let (gammas, lambdas) = (ablation::gammas(&world, most)?, ablation::lambdas(&world, most)?);
    let steepness = ablation::steepness(&world, context.spend(3000, 200_000), context.seed());
    let coarse = Coarseness::new(&world, &silhouettes, count)?;
    let shown = Shown {
        world: &world,
        silhouettes: &silhouettes,
        curves: &curves,
        gammas: &gammas,
        lambdas: &lambdas,
    };
    write_png(&context.path(PICTURE), &page::page(&shown).canvas)?;
    write_csv(&context.path(FIELDS), &field_table(&curves))?;
    let bias = bias_table(&gammas, &lambdas);
    write_csv(&context.path(BIAS), &bias)?;
    Ok(Section {
        id: "implicit".to_owned(),
        title: "Implicit shapes: fields from tracer points".to_owned(),
        explanation_html: [explanation(&gammas, &lambdas, &steepness), about_points(&coarse)].concat(),
        formula_mathml: formula(
            r"V(ω) = P_ω \frac{∑_i ℓ_i S_i^{-γ} G(x_i)/t_i}{∑_i ℓ_i S_i^{-γ}}, \quad S = |φ| + λ|∇φ·ω|, \quad G = -\frac{∂_θφ ∇φ}{|∇φ|^2}",
            Placement::Display,
        ),
        pictures: vec![Picture {
            file: PICTURE.to_owned(),
            alt:
                "Tracer points of four rays, warp fields against direction, and the error of V against steps"
                    .to_owned(),
            caption: caption(),
        }],
        data: vec![FIELDS.to_owned(), BIAS.to_owned()],
        table: Some(bias),
    })
}

fn field_table(curves: &[Curve]) -> Table {
    let mut table = Table::new(&["field", "angle", "rate"]);
    for curve in curves {
        for [angle, rate] in &curve.values {
            table.row([curve.name.into(), (*angle).into(), (*rate).into()]);
        }
    }
    table
}

fn bias_table(gammas: &[Setting], lambdas: &[Setting]) -> Table {
    let mut table = Table::new(&["setting", "steps", "Σ|V − v| / Σ|v| at the last hits"]);
    for setting in gammas.iter().chain(lambdas) {
        for [steps, bias] in &setting.points {
            table.row([setting.name.clone().into(), (*steps).into(), (*bias).into()]);
        }
    }
    table
}

/// The power of the number of steps with which an error falls between two points.
fn power([[n, a], [m, b]]: [[f64; 2]; 2]) -> String {
    format!("{:.2}", (b / a).ln() / (m / n).ln()).replace('-', "−")
}

/// The power between the first two points, and that between the last two.
fn powers(setting: &Setting) -> [String; 2] {
    match setting.points.as_slice() {
        [a, b, .., c, d] => [power([*a, *b]), power([*c, *d])],
        _ => [(); 2].map(|()| "?".to_owned()),
    }
}

/// The mean square of ∇·V by γ, in units of that of the default γ.
fn squares(steepness: &[Steepness]) -> String {
    let default = BangaruField::default().gamma;
    let Some(unit) = steepness.iter().find(|s| s.gamma == default) else { return String::new() };
    let one = |s: &Steepness| {
        let Ratio { value, error } = s.square;
        format!(
            "γ = {}: {}",
            s.gamma,
            Ratio { value: value / unit.square.value, error: error / unit.square.value }.shown()
        )
    };
    steepness.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// The error with the most steps, in percent.
fn last(setting: &Setting) -> String {
    setting.points.last().map_or_else(String::new, |p| format!("{} %", number(100.0 * p[1])))
}

fn explanation(gammas: &[Setting], lambdas: &[Setting], steepness: &[Steepness]) -> String {
    let rates: Vec<String> =
        gammas.iter().map(|s| format!("{}: steps<sup>{}</sup>", s.name, powers(s)[1])).collect();
    let slow = gammas.first().map_or_else(Default::default, powers);
    let steps = gammas.first().and_then(|s| s.points.last()).map_or(0.0, |p| p[0]);
    let widths: Vec<String> = lambdas.iter().map(|s| format!("{}: {}", s.name, last(s))).collect();
    format!(
        "<p>Figures 7 and 8 knew their shapes by vertices, and a hit knew how far the next jump is. The surface of an <em>implicit shape</em> is where a function φ is zero. A ray finds it by \
         <em>sphere tracing</em>: it goes on by the distance φ, again and again. The points on its way know \
         how far the surface is (φ) and whether the ray passes along it (∇φ·ω). Bangaru et al. (2022) make a \
         warp field of these points alone, without auxiliary rays: a mean of the velocities G of the level \
         sets, with weights that grow without bound where the ray touches a silhouette. Vicini et al. \
         (2022) take G once, at a mean distance, and only near the surface.</p>\
         <p>Both are continuous and meet the velocity of every silhouette, marked by dots. The direct field \
         jumps there. Yet between the silhouettes they differ: any field that keeps the two rules will \
         do, and the harmonic one is the smoothest.</p>\
         <p>What is left of the bias comes from rays so close to a silhouette that they run out of \
         steps. Shown is the error of V at the last rays that hit: Σ|V − v|/Σ|v| over the ends of the discs before the \
         background, v the silhouette’s own velocity. For discs of one brightness it is all the bias there is, because the \
         area integral of an exact field over the rays that hit is V at their ends. Between the last two numbers of \
         steps, of which one is twice the other, it falls as {}. Theory asks for γ > 1, and at γ = 1 the \
         curve flattens, from steps<sup>{}</sup> at first to steps<sup>{}</sup>: it does not converge as a power. \
         With {} steps the error is, by parameters: {}. An ε that keeps the weights finite leaves an error that no \
         number of steps removes.</p>\
         <p>The picture shows bias only, and there the largest γ is best. It is not in variance: Bangaru et al. report \
         γ = 6 as unstable. The mean square of ∇·V over directions that hit, which is what the variance comes from, is \
         here, in units of that of the default γ = {}: {}. (It diverges logarithmically at silhouettes for every γ, so that such a number \
         depends a little on how many directions are drawn.)</p>",
        rates.join("; "),
        slow[0],
        slow[1],
        number(steps),
        widths.join("; "),
        BangaruField::default().gamma,
        squares(steepness),
    )
}

fn about_points(coarse: &Coarseness) -> String {
    let Coarseness { scale, variation, bump } = coarse;
    format!(
        "<p>The wiggles of Bangaru et al.’s field and the small side bumps of Vicini et al.’s come from the few points \
         that full steps leave on a ray. With steps of {scale} of the length, the total variation of the former between the \
         last two silhouettes falls from {:.3} to {:.3} times the difference of its ends (1: no wiggles), and the largest \
         |V| of the latter in the middle third of the near disc from {:.4} to {:.4}. Neither biases the derivative: \
         the fields stay continuous.</p>",
        variation[0], variation[1], bump[0], bump[1],
    )
}

fn caption() -> String {
    format!(
        "(a) Two discs move (arrows; the far one also grows). Points of four rays by weight, γ = 3 and \
         λ = 0.1. Far from a silhouette weights spread over the ray; beside one they gather where it \
         touches. (b) The angular velocity V; the field of auxiliary rays is a mean over estimates of {} \
         rays. (c, d) Error of V at the last rays that hit: bias, not variance.",
        world::RAYS
    )
}
