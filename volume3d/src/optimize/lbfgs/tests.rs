use std::convert::Infallible;
use std::path::Path;

use super::super::{Chart, Loss, Parameters};
use super::*;
use crate::gradient::{Progress, WarpedArea, render};
use crate::io::load_scene;
use crate::scene::Scene;

type Evaluated = Result<(f64, Vec<f64>), Infallible>;

fn rosenbrock(x: &[f64]) -> Evaluated {
    let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
    Ok((a * a + 100.0 * b * b, vec![-2.0 * a - 400.0 * x[0] * b, 200.0 * b]))
}

/// Σ cᵢ (xᵢ − 1)²/2, with c from 1 to 10⁶.
fn quadratic(x: &[f64]) -> Evaluated {
    let weights = (0..x.len()).map(|i| 10.0_f64.powi(i as i32));
    let terms = x.iter().zip(weights).map(|(x, c)| (0.5 * c * (x - 1.0).powi(2), c * (x - 1.0)));
    Ok(terms.fold((0.0, vec![]), |(sum, mut gradient), (value, slope)| {
        gradient.push(slope);
        (sum + value, gradient)
    }))
}

#[test]
fn minima_of_closed_forms_are_found() {
    // From the usual start, in any unit of the loss.
    for unit in [1.0, 1e-9, 1e9] {
        let options = Lbfgs { tolerance: 1e-9, evaluations: 100, ..Lbfgs::new(0.1) };
        let scaled = |x: &[f64]| {
            let (loss, gradient) = rosenbrock(x)?;
            Ok::<_, Infallible>((unit * loss, gradient.iter().map(|g| unit * g).collect()))
        };
        let minimum = lbfgs(&[-1.2, 1.0], &options, scaled).unwrap();
        assert!(minimum.x.iter().all(|x| (x - 1.0).abs() < 1e-5), "{minimum:?}");
        assert!(minimum.end == End::Converged && minimum.evaluations < 60, "{minimum:?}");
    }
    let options = Lbfgs { tolerance: 1e-12, evaluations: 100, ..Lbfgs::new(0.1) };
    let start = [3.0, -2.0, 0.0, 5.0, 1.5, 0.5, -1.0];
    let minimum = lbfgs(&start, &options, quadratic).unwrap();
    // Limited by rounding: 14 digits of the first loss, 2 · 10⁶, are gone.
    assert!(minimum.loss < 1e-14 * quadratic(&start).unwrap().0, "{minimum:?}");
    assert_eq!(minimum.end, End::Converged);
    // A constant loss.
    let flat = lbfgs(&[7.0], &options, |_| Ok::<_, Infallible>((2.0, vec![0.0]))).unwrap();
    assert_eq!(flat, Minimum { x: vec![7.0], loss: 2.0, evaluations: 1, end: End::Converged });
}

#[test]
fn the_first_step_is_as_long_as_stated() {
    let mut places = vec![];
    let record = |x: &[f64]| {
        places.push(x.to_vec());
        quadratic(x)
    };
    lbfgs(&[3.0, 3.0], &Lbfgs { evaluations: 2, ..Lbfgs::new(0.25) }, record).unwrap();
    let length = places[0].iter().zip(&places[1]).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!((length - 0.25).abs() < 1e-12, "{places:?}");
}

#[test]
fn bounds_are_kept() {
    let bounds = vec![[-2.0, 0.5], [f64::NEG_INFINITY, f64::INFINITY]];
    let options = Lbfgs { tolerance: 1e-9, evaluations: 100, bounds, ..Lbfgs::new(0.1) };
    let within = |x: &[f64]| {
        assert!(x[0] <= 0.5 + 1e-12, "{x:?}");
        rosenbrock(x)
    };
    let minimum = lbfgs(&[-1.2, 1.0], &options, within).unwrap();
    assert!((minimum.x[0] - 0.5).abs() < 1e-9 && (minimum.x[1] - 0.25).abs() < 1e-6, "{minimum:?}");
}

#[test]
fn evaluations_are_counted() {
    let options = Lbfgs { evaluations: 7, ..Lbfgs::new(0.1) };
    let minimum = lbfgs(&[-1.2, 1.0], &options, rosenbrock).unwrap();
    assert_eq!((minimum.evaluations, minimum.end), (7, End::Evaluations));
    // The best of all evaluations is returned.
    assert!(minimum.loss < rosenbrock(&[-1.2, 1.0]).unwrap().0);
    assert_eq!(rosenbrock(&minimum.x).unwrap().0, minimum.loss);
}

#[test]
fn what_fails_is_handed_back() {
    let mut left = 4;
    let failing = |x: &[f64]| {
        left -= 1;
        if left == 0 { Err("no scene") } else { Ok(rosenbrock(x).unwrap()) }
    };
    let error = lbfgs(&[-1.2, 1.0], &Lbfgs::new(0.1), failing).unwrap_err();
    assert!(matches!(error, LbfgsError::Evaluation("no scene")), "{error:?}");
    for (what, bad) in [("loss", (f64::NAN, vec![1.0])), ("gradient", (0.0, vec![f64::INFINITY]))] {
        let evaluate =
            |x: &[f64]| Ok::<_, Infallible>(if x[0] < 2.0 { bad.clone() } else { (x[0], vec![1.0]) });
        let error = lbfgs(&[2.05], &Lbfgs::new(0.1), evaluate).unwrap_err();
        let message = error.to_string();
        assert!(message.starts_with(&format!("the {what} is not finite in evaluation 2, at")), "{message}");
    }
}

#[test]
fn a_gradient_of_another_function_ends_the_search() {
    let uphill = |x: &[f64]| quadratic(x).map(|(loss, g)| (loss, g.iter().map(|g| -g).collect()));
    let minimum = lbfgs(&[3.0, 3.0], &Lbfgs::new(0.1), uphill).unwrap();
    assert!(minimum.end == End::Noise && minimum.x == [3.0, 3.0], "{minimum:?}");
}

#[test]
fn options_out_of_range_are_refused() {
    let good = Lbfgs::new(0.1);
    let cases = [
        (Lbfgs { first_step: 0.0, ..good.clone() }, "first step"),
        (Lbfgs { first_step: f64::NAN, ..good.clone() }, "first step"),
        (Lbfgs { evaluations: 0, ..good.clone() }, "no evaluation"),
        (Lbfgs { tolerance: f64::NAN, ..good.clone() }, "tolerance"),
        (Lbfgs { bounds: vec![[0.0, 1.0]; 2], ..good.clone() }, "as many bounds"),
        (Lbfgs { bounds: vec![[3.0, 4.0]], ..good.clone() }, "out of its bounds"),
        (Lbfgs { bounds: vec![[f64::NAN, 4.0]], ..good }, "out of its bounds"),
    ];
    for (options, part) in cases {
        let message = lbfgs(&[1.0], &options, quadratic).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

/// Six numbers from a picture of 32 × 24 pixels, with one seed for all images and one for all gradients.
#[test]
fn the_pose_of_a_block_is_found_in_few_evaluations() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/table.xml");
    let mut description = load_scene(&path).unwrap();
    (description.film.width, description.film.height) = (32, 24);
    let mut scene = Scene::new(description).unwrap();
    let parameters = Parameters::new(&scene, &["block.translation", "block.rotation"]).unwrap();
    let target = render(&scene, 64, 0, &Progress::none()).unwrap().image;
    let mut start = parameters.values(&scene);
    parameters.retract(&mut start, &[0.1, 0.05, -0.05, 0.1, -0.2, 0.1]);
    let chart = Chart::new(&parameters, &start);
    let method = WarpedArea { samples: 16, ..WarpedArea::default() };
    let evaluate = |y: &[f64]| -> Result<_, Box<dyn std::error::Error>> {
        let x = chart.point(y);
        parameters.apply(&x, &mut scene)?;
        let image = render(&scene, 32, 1, &Progress::none())?.image;
        let (loss, adjoint) = Loss::L2.of(&image, &target)?;
        let gradient = method.reverse(&scene, &adjoint, &parameters.active(&scene), &Progress::none())?;
        Ok((loss, chart.gradient(y, &parameters.gradient(&scene, &x, &gradient.by_parameter))))
    };
    let options = Lbfgs { bounds: chart.bounds(), evaluations: 16, ..Lbfgs::new(0.05) };
    let minimum = lbfgs(&[0.0; 6], &options, evaluate).unwrap();
    let x = chart.point(&minimum.x);
    let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let errors = [size(&x[..3]), size(&x[3..])];
    // A tenth of the initial errors of 0.12 units and 0.24 radians: the noise of 32 samples leaves that much.
    assert!(errors[0] < 0.02 && errors[1] < 0.03, "{minimum:?} {errors:?}");
}
