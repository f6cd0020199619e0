//! What the study found, as data.

use super::bias::{Curve, RAYS_OF_KAPPA};
use super::debias::name;
use super::target::KAPPA;
use super::text::Results;
use crate::context::Context;
use crate::output::{Cell, Table, write_csv};

impl Results {
    /// Writes everything and returns the names of the files.
    pub(super) fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        let files = [
            ("figure5_bias.csv", self.biases()),
            ("figure5_debiasing.csv", self.debiasing()),
            ("figure5_methods.csv", self.methods()),
        ];
        for (file, table) in &files {
            write_csv(&context.path(file), table)?;
        }
        Ok(files.map(|(file, _)| file.to_owned()).to_vec())
    }

    fn biases(&self) -> Table {
        let mut table = Table::new(&[
            "varied",
            "weight",
            "auxiliary rays",
            "kappa",
            "gamma",
            "missing part",
            "its standard error",
            "squared relative bias",
            "variance of a sample",
        ]);
        let mut rows = |varied: &str, curves: &[Curve]| {
            for curve in curves {
                for (x, bias) in &curve.points {
                    let (rays, kappa) =
                        if varied == "rays" { (*x, KAPPA) } else { (RAYS_OF_KAPPA as f64, *x) };
                    let [gamma, variance] = ["", ""].map(Cell::from);
                    table.row([
                        varied.into(),
                        curve.series.name.into(),
                        rays.into(),
                        kappa.into(),
                        gamma,
                        bias.missing.into(),
                        bias.error.into(),
                        bias.squared.into(),
                        variance,
                    ]);
                }
            }
        };
        rows("rays", &self.rays);
        rows("kappa", &self.kappa);
        for point in &self.gamma {
            table.row([
                "gamma".into(),
                "linear B, radial exponent 0.3".into(),
                (point.rays as f64).into(),
                KAPPA.into(),
                point.gamma.into(),
                point.bias.missing.into(),
                point.bias.error.into(),
                point.bias.squared.into(),
                point.spread.variance.into(),
            ]);
        }
        table
    }

    fn debiasing(&self) -> Table {
        let mut table = Table::new(&[
            "scheme",
            "weight",
            "variance × rays",
            "its standard error",
            "median of batches",
            "relative to 16 rays of the same weight",
            "its standard error",
            "relative to 16 rays of the original's weight",
            "its standard error",
        ]);
        for scheme in &self.schemes {
            let cost = scheme.cost();
            let mut row: Vec<Cell> = vec![
                name(scheme.debias).into(),
                if scheme.original { "original" } else { "default" }.into(),
                cost.value.into(),
                cost.error.into(),
                scheme.median().into(),
            ];
            for original in [scheme.original, true] {
                let reference = self.schemes.iter().find(|s| s.original == original);
                let ratio = reference.map(|reference| scheme.relative(reference));
                row.push(ratio.map_or(f64::NAN, |r| r.value).into());
                row.push(ratio.map_or(f64::NAN, |r| r.error).into());
            }
            table.row(row);
        }
        table
    }

    /// Every method of the second picture.
    pub(super) fn methods(&self) -> Table {
        let mut table = Table::new(&[
            "derivative",
            "method",
            "missing part",
            "± error",
            "bias², relative",
            "variance of a sample",
            "rays a sample",
            "µs a sample",
        ]);
        for (derivative, contenders) in [("image", &self.forward), ("vertices", &self.reverse)] {
            for contender in contenders {
                table.row([
                    derivative.into(),
                    contender.looks.name.clone().into(),
                    contender.bias.missing.into(),
                    contender.bias.error.into(),
                    contender.bias.squared.into(),
                    contender.spread.variance.into(),
                    contender.spread.rays.into(),
                    (1e6 * contender.seconds).into(),
                ]);
            }
        }
        table
    }
}
