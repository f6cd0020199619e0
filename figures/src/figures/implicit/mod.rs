//! Implicit shapes: fields from the points of sphere tracing, and the causes of their error.

mod ablation;
mod page;
mod world;

use flatland::sdf::fields::BangaruField;

use self::ablation::{Setting, Steepness};
use self::page::Shown;
use self::world::{Coarseness, Curve, World};
use crate::context::Context;
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let world = World::new()?;
    let silhouettes = world.silhouettes()?;
    context.step("fields against direction");
    let (count, repeats) = context.spend((900, 40), (3000, 400));
    let curves = world::curves(&world, count, repeats, context.seed())?;
    context.step("error against steps");
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
    context.png("implicit.png", &page::page(&shown))?;
    let bias = bias_table(&gammas, &lambdas);
    let data = [
        context.csv("implicit_fields.csv", &field_table(&curves))?,
        context.csv("implicit_bias.csv", &bias)?,
    ];
    prose(&gammas, &lambdas, &steepness, &coarse)?.section("implicit", data.to_vec(), bias)
}

fn prose(
    gammas: &[Setting],
    lambdas: &[Setting],
    steepness: &[Steepness],
    coarse: &Coarseness,
) -> anyhow::Result<Prose> {
    let rates = gammas.iter().map(|s| format!("{}: steps<sup>{}</sup>", s.name, powers(s)[1]));
    let errors = lambdas.iter().map(|s| format!("{}: {}", s.name, last(s)));
    let [power_first, power_last] = powers(&gammas[0]);
    let Coarseness { scale, variation, bump } = coarse;
    Prose::new(
        include_str!("implicit.md"),
        &[
            ("rates", &listed(rates)),
            ("power_first", &power_first),
            ("power_last", &power_last),
            ("steps", &number(gammas[0].points.last().map_or(0.0, |p| p[0]))),
            ("errors", &listed(errors)),
            ("default_gamma", &BangaruField::default().gamma),
            ("squares", &squares(steepness)),
            ("scale", &scale),
            ("variation_full", &format!("{:.3}", variation[0])),
            ("variation_short", &format!("{:.3}", variation[1])),
            ("bump_full", &format!("{:.4}", bump[0])),
            ("bump_short", &format!("{:.4}", bump[1])),
            ("rays", &world::RAYS),
        ],
    )
}

fn field_table(curves: &[Curve]) -> Table {
    Table::of(
        curves.iter().flat_map(|curve| curve.values.iter().map(|point| (curve.name, *point))),
        &[
            ("field", &|(name, _)| (*name).into()),
            ("angle", &|(_, [angle, _])| (*angle).into()),
            ("rate", &|(_, [_, rate])| (*rate).into()),
        ],
    )
}

fn bias_table(gammas: &[Setting], lambdas: &[Setting]) -> Table {
    let settings = gammas.iter().chain(lambdas);
    Table::of(
        settings.flat_map(|setting| setting.points.iter().map(|point| (&setting.name, *point))),
        &[
            ("setting", &|(name, _)| name.as_str().into()),
            ("steps", &|(_, [steps, _])| (*steps).into()),
            ("Σ|V − v| / Σ|v| at the last hits", &|(_, [_, bias])| (*bias).into()),
        ],
    )
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
    let square = |s: &Steepness| {
        let Ratio { value, error } = s.square;
        Ratio { value: value / unit.square.value, error: error / unit.square.value }
    };
    listed(steepness.iter().map(|s| format!("γ = {}: {}", s.gamma, square(s).shown())))
}

/// The error with the most steps, in percent.
fn last(setting: &Setting) -> String {
    setting.points.last().map_or_else(String::new, |p| percent(p[1]))
}
