//! What the study found, as data.

use super::bias::RAYS_OF_KAPPA;
use super::debias::{Ratio, Scheme, name};
use super::regression::Bias;
use super::target::KAPPA;
use super::text::Results;
use crate::context::Context;
use crate::output::{Cell, Table};

/// A curve's name, what varies along it, and a point: rays, κ, γ if it is not the weight's own, bias, and variance if known.
struct Point<'a> {
    varied: &'static str,
    weight: &'a str,
    rays: f64,
    kappa: f64,
    gamma: Option<f64>,
    bias: &'a Bias,
    variance: Option<f64>,
}

impl Results {
    /// Writes everything and returns the names of the files.
    pub(super) fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        Ok(vec![
            context.csv("figure5_bias.csv", &self.biases())?,
            context.csv("figure5_debiasing.csv", &self.debiasing())?,
            context.csv("figure5_methods.csv", &self.methods())?,
        ])
    }

    fn biases(&self) -> Table {
        let mut points = vec![];
        for (varied, curves) in [("rays", &self.rays), ("kappa", &self.kappa)] {
            for curve in curves {
                for (x, bias) in &curve.points {
                    let (rays, kappa) =
                        if varied == "rays" { (*x, KAPPA) } else { (RAYS_OF_KAPPA as f64, *x) };
                    let weight = curve.series.name;
                    points.push(Point { varied, weight, rays, kappa, gamma: None, bias, variance: None });
                }
            }
        }
        points.extend(self.gamma.iter().map(|point| Point {
            varied: "gamma",
            weight: "linear B, radial exponent 0.3",
            rays: point.rays as f64,
            kappa: KAPPA,
            gamma: Some(point.gamma),
            bias: &point.bias,
            variance: Some(point.spread.variance),
        }));
        let known = |value: Option<f64>| value.map_or_else(|| "".into(), Cell::from);
        Table::of(
            points,
            &[
                ("varied", &|p| p.varied.into()),
                ("weight", &|p| p.weight.into()),
                ("auxiliary rays", &|p| p.rays.into()),
                ("kappa", &|p| p.kappa.into()),
                ("gamma", &|p| known(p.gamma)),
                ("missing part", &|p| p.bias.missing.into()),
                ("its standard error", &|p| p.bias.error.into()),
                ("squared relative bias", &|p| p.bias.squared.into()),
                ("variance of a sample", &|p| known(p.variance)),
            ],
        )
    }

    fn debiasing(&self) -> Table {
        let relative = |scheme: &Scheme, original: bool| {
            let reference = self.schemes.iter().find(|s| s.original == original);
            reference.map_or(Ratio { value: f64::NAN, error: f64::NAN }, |one| scheme.relative(one))
        };
        Table::of(
            &self.schemes,
            &[
                ("scheme", &|s| name(s.debias).into()),
                ("weight", &|s| if s.original { "original" } else { "default" }.into()),
                ("variance × rays", &|s| s.cost().value.into()),
                ("its standard error", &|s| s.cost().error.into()),
                ("median of batches", &|s| s.median().into()),
                ("relative to 16 rays of the same weight", &|s| relative(s, s.original).value.into()),
                ("its standard error", &|s| relative(s, s.original).error.into()),
                ("relative to 16 rays of the original's weight", &|s| relative(s, true).value.into()),
                ("its standard error", &|s| relative(s, true).error.into()),
            ],
        )
    }

    /// Every method of the second picture.
    pub(super) fn methods(&self) -> Table {
        let forward = self.forward.iter().map(|contender| ("image", contender));
        Table::of(
            forward.chain(self.reverse.iter().map(|contender| ("vertices", contender))),
            &[
                ("derivative", &|(derivative, _)| (*derivative).into()),
                ("method", &|(_, c)| c.looks.name.clone().into()),
                ("missing part", &|(_, c)| c.bias.missing.into()),
                ("± error", &|(_, c)| c.bias.error.into()),
                ("bias², relative", &|(_, c)| c.bias.squared.into()),
                ("variance of a sample", &|(_, c)| c.spread.variance.into()),
                ("rays a sample", &|(_, c)| c.spread.rays.into()),
                ("µs a sample", &|(_, c)| (1e6 * c.seconds).into()),
            ],
        )
    }
}
