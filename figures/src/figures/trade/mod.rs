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
use crate::gallery::Section;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let image = Target::image()?;

    context.step("5 bias against N′");
    let rays = bias::against_rays(context, &image);

    context.step("5 bias against κ");
    let kappa = bias::against_kappa(context, &image);

    context.step("5 bias and variance against γ");
    let gamma = bias::against_gamma(context, &image)?;
    context.png("figure5_bias.png", &page::bias_page(&image, &rays, &kappa, &gamma).canvas)?;

    context.step("5 debiasing schemes");
    let schemes = debias::schemes(context, &image)?;

    context.step("5 error at equal time");
    let forward = front::contenders(context, &image)?;
    let reverse = front::contenders(context, &Target::vertices()?)?;
    context.png("figure5_trade.png", &page::trade_page(&schemes, &forward, &reverse).canvas)?;
    let results = text::Results { rays, kappa, gamma, schemes, forward, reverse };
    let data = results.write(context)?;
    results.prose()?.section("trade", data, results.methods())
}
