//! Figure 9: implicit shapes: fields from the points of sphere tracing, and what decides their bias.

mod ablation;
mod page;
mod world;

use self::ablation::Setting;
use self::page::Shown;
use self::world::{Curve, World};
use crate::context::Context;
use crate::gallery::{Picture, Placement, Section, formula};
use crate::output::{Table, write_csv, write_png};
use crate::plot::number;

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
    context.step("9 bias against steps");
    let most = context.spend(3200, 12_800);
    let (gammas, lambdas) = (ablation::gammas(&world, most)?, ablation::lambdas(&world, most)?);
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
        explanation_html: explanation(&gammas, &lambdas),
        formula_mathml: formula(
            r"V(ω) = P_ω \frac{∑_i ℓ_i S_i^{-γ} G(x_i)/t_i}{∑_i ℓ_i S_i^{-γ}}, \quad S = |φ| + λ|∇φ·ω|, \quad G = -\frac{∂_θφ ∇φ}{|∇φ|^2}",
            Placement::Display,
        ),
        pictures: vec![Picture {
            file: PICTURE.to_owned(),
            alt: "Tracer points of four rays, warp fields against direction, and bias against steps"
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
    let mut table = Table::new(&["setting", "steps", "relative bias"]);
    for setting in gammas.iter().chain(lambdas) {
        for [steps, bias] in &setting.points {
            table.row([setting.name.clone().into(), (*steps).into(), (*bias).into()]);
        }
    }
    table
}

/// The power of the number of steps with which a bias falls, from the last two points.
fn power(setting: &Setting) -> String {
    let [.., [n, a], [m, b]] = setting.points.as_slice() else { return "?".to_owned() };
    format!("{:.2}", (b / a).ln() / (m / n).ln()).replace('-', "−")
}

/// The bias with the most steps, in percent.
fn last(setting: &Setting) -> String {
    setting.points.last().map_or_else(String::new, |p| format!("{} %", number(100.0 * p[1])))
}

fn explanation(gammas: &[Setting], lambdas: &[Setting]) -> String {
    let rates: Vec<String> =
        gammas.iter().map(|s| format!("{}: steps<sup>{}</sup>", s.name, power(s))).collect();
    let steps = gammas.first().and_then(|s| s.points.last()).map_or(0.0, |p| p[0]);
    let widths: Vec<String> = lambdas.iter().map(|s| format!("{}: {}", s.name, last(s))).collect();
    format!(
        "<p>The surface of an <em>implicit shape</em> is where a function φ is zero. A ray finds it by \
         <em>sphere tracing</em>: it goes on by the distance φ, again and again. The points on its way know \
         how far the surface is (φ) and whether the ray passes along it (∇φ·ω). Bangaru et al. (2022) make a \
         warp field of these points alone, without auxiliary rays: a mean of the velocities G of the level \
         sets, with weights that grow without bound where the ray touches a silhouette. Vicini et al. \
         (2022) take G once, at a mean distance, and only near the surface.</p>\
         <p>Both are continuous and meet the velocity of every silhouette, marked by dots. The direct field \
         jumps there. Yet between the silhouettes they differ: any field that keeps the two rules will \
         do, and the harmonic one is the smoothest.</p>\
         <p>What is left of the bias comes from rays so close to a silhouette that they run out of \
         steps. The bias of the derivative of white discs on black falls with the steps allowed as {}. \
         With {} steps it is, by parameters: {}. An ε that keeps the weights finite leaves a bias that no \
         number of steps removes.</p>",
        rates.join("; "),
        number(steps),
        widths.join("; "),
    )
}

fn caption() -> String {
    format!(
        "(a) Two discs move (arrows; the far one also grows). Points of four rays by weight, γ = 3 and \
         λ = 0.1. Far from a silhouette weights spread over the ray; beside one they gather where it \
         touches. (b) The angular velocity V; the field of auxiliary rays is a mean over estimates of {} \
         rays. (c, d) Relative bias of the angular velocities at the last rays that hit.",
        world::RAYS
    )
}
