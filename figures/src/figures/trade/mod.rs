//! Figure 5: bias, variance and time: what a fixed number of auxiliary rays gets wrong, what it costs to
//! set it right, and which method is best at equal time.

pub(super) mod bias;
mod cells;
mod data;
pub(super) mod debias;
mod front;
mod page;
pub(super) mod regression;
mod stratified;
mod target;
mod text;

use self::target::Target;
use crate::context::Context;
use crate::gallery::{Picture, Section};
use crate::output::write_png;

const BIAS: &str = "figure5_bias.png";
const TRADE: &str = "figure5_trade.png";

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let image = Target::image()?;

    context.step("5 bias against N′");
    let rays = bias::against_rays(context, &image);

    context.step("5 bias against κ");
    let kappa = bias::against_kappa(context, &image);

    context.step("5 bias and variance against γ");
    let gamma = bias::against_gamma(context, &image)?;
    write_png(&context.path(BIAS), &page::bias_page(&image, &rays, &kappa, &gamma).canvas)?;

    context.step("5 debiasing schemes");
    let schemes = debias::schemes(context, &image)?;

    context.step("5 error at equal time");
    let forward = front::contenders(context, &image)?;
    let reverse = front::contenders(context, &Target::vertices()?)?;
    write_png(&context.path(TRADE), &page::trade_page(&schemes, &forward, &reverse).canvas)?;
    let results = text::Results { rays, kappa, gamma, schemes, forward, reverse };
    let data = results.write(context)?;
    Ok(Section {
        id: "trade".to_owned(),
        title: "Bias, variance and time: the trade".to_owned(),
        explanation_html: results.explanation(),
        formula_mathml: text::formulas(),
        pictures: vec![
            Picture {
                file: BIAS.to_owned(),
                alt: "Bias of the gradient against auxiliary rays, κ and γ, for several weights".to_owned(),
                caption: results.bias_caption(),
            },
            Picture {
                file: TRADE.to_owned(),
                alt: "Relative cost of debiasing schemes, and error against time of all methods".to_owned(),
                caption: results.trade_caption(),
            },
        ],
        data,
        table: Some(results.methods()),
    })
}
