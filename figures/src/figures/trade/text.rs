//! What the study found, as data and in words.

use super::bias::{Curve, GammaPoint};
use super::debias::Scheme;
use super::front::Contender;
use crate::context::Context;
use crate::gallery::{Placement, formula};
use crate::output::{Table, write_csv};

/// Everything measured.
pub(super) struct Results {
    pub(super) rays: Vec<Curve>,
    pub(super) kappa: Vec<Curve>,
    pub(super) gamma: Vec<GammaPoint>,
    pub(super) schemes: Vec<Scheme>,
    pub(super) forward: Vec<Contender>,
    pub(super) reverse: Vec<Contender>,
}

/// The formulas of the figure.
pub(super) fn formulas() -> String {
    formula(
        r"\text{error}^2(t) = \text{bias}^2 + \text{variance} · \frac{\text{time of a sample}}{t}",
        Placement::Display,
    )
}

impl Results {
    /// Writes all data and returns the names of the files.
    pub(super) fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        let mut bias = Table::new(&[
            "against",
            "weight",
            "N'",
            "kappa",
            "gamma",
            "bias",
            "error",
            "bias squared",
            "variance",
        ]);
        let n = f64::NAN;
        for (what, curves) in [("rays", &self.rays), ("kappa", &self.kappa)] {
            for curve in curves {
                for (x, b) in &curve.points {
                    let (rays, kappa) = if what == "rays" {
                        (*x, super::target::KAPPA)
                    } else {
                        (super::bias::RAYS_OF_KAPPA as f64, *x)
                    };
                    bias.row([
                        what.into(),
                        curve.series.name.into(),
                        rays.into(),
                        kappa.into(),
                        n.into(),
                        b.missing.into(),
                        b.error.into(),
                        b.squared.into(),
                        n.into(),
                    ]);
                }
            }
        }
        for p in &self.gamma {
            bias.row([
                "gamma".into(),
                "".into(),
                p.rays.into(),
                super::target::KAPPA.into(),
                p.gamma.into(),
                p.bias.missing.into(),
                p.bias.error.into(),
                p.bias.squared.into(),
                p.spread.variance.into(),
            ]);
        }
        write_csv(&context.path("figure5_bias.csv"), &bias)?;
        let mut t = Table::new(&["scheme", "weight", "cost", "error", "median", "ratio", "ratio error"]);
        for s in &self.schemes {
            let r = s.relative(self.schemes.iter().find(|o| o.original == s.original).unwrap());
            t.row([
                s.name.clone().into(),
                if s.original { "original" } else { "default" }.into(),
                s.cost().value.into(),
                s.cost().error.into(),
                s.median().into(),
                r.value.into(),
                r.error.into(),
            ]);
        }
        write_csv(&context.path("figure5_debias.csv"), &t)?;
        write_csv(&context.path("figure5_methods.csv"), &self.table())?;
        Ok(vec!["figure5_bias.csv".into(), "figure5_debias.csv".into(), "figure5_methods.csv".into()])
    }
    pub(super) fn explanation(&self) -> String {
        String::new()
    }
    pub(super) fn bias_caption(&self) -> String {
        String::new()
    }
    pub(super) fn trade_caption(&self) -> String {
        String::new()
    }
    pub(super) fn table(&self) -> Table {
        let mut t = Table::new(&[
            "mode",
            "method",
            "bias",
            "± error",
            "bias squared",
            "variance of a sample",
            "rays a sample",
            "µs a sample",
        ]);
        for (mode, list) in [("forward", &self.forward), ("reverse", &self.reverse)] {
            for c in list {
                t.row([
                    mode.into(),
                    c.looks.name.clone().into(),
                    c.bias.missing.into(),
                    c.bias.error.into(),
                    c.bias.squared.into(),
                    c.spread.variance.into(),
                    c.spread.rays.into(),
                    (1e6 * c.seconds).into(),
                ]);
            }
        }
        t
    }
}
