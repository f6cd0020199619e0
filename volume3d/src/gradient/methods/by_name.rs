//! Methods by name.

use super::estimator::Estimator;
use super::finite_difference::FiniteDifference;
use crate::scene::{closest_first, listed};

/// No method has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no method `{name}`; closest first, methods are: {}", listed(.known))]
pub struct UnknownMethod {
    /// The name.
    pub name: String,
    /// The names of all methods, the most similar first.
    pub known: Vec<String>,
}

impl Estimator {
    /// The names of methods, those of the option `--method` of the command line.
    pub const METHODS: [&'static str; 6] =
        ["auto", "warped-area", "edge", "rotation", "finite-difference", "interior"];

    /// The method with a name of [`METHODS`](Self::METHODS), with default options. Finite differences have
    /// the step 10⁻³, in units of the tangent's parameter.
    ///
    /// # Errors
    /// [`UnknownMethod`] with suggestions.
    pub fn by_name(name: &str, samples: usize, seed: u64) -> Result<Self, UnknownMethod> {
        Ok(match name {
            "auto" => Self::auto(samples, seed),
            "warped-area" => Self::warped_area(samples, seed),
            "edge" => Self::edge_sampling(samples, seed),
            "rotation" => Self::rotation(samples, seed),
            "finite-difference" => Self::finite_difference(samples, FiniteDifference::default().step, seed),
            "interior" => Self::interior(samples, seed),
            _ => {
                let mut known = Self::METHODS.map(str::to_owned).to_vec();
                closest_first(name, &mut known);
                return Err(UnknownMethod { name: name.to_owned(), known });
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_method_exists_and_no_other() {
        for name in Estimator::METHODS {
            Estimator::by_name(name, 4, 1).expect("a method");
        }
        let error = Estimator::by_name("warpedarea", 4, 1).unwrap_err().to_string();
        let expected = "there is no method `warpedarea`; closest first, methods are: `warped-area`, ";
        assert!(error.starts_with(expected), "{error}");
    }
}
