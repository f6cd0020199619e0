//! Checks of correct and of wrong gradients.

use glam::{DAffine3, DVec3};

use super::*;
use crate::geometry::Mesh;
use crate::scene::{Camera, Description, Environment, Film, Filter, Integrator, Material};

/// A film whose pixels are about as wide as the largest default steps.
fn description(origin: DVec3, degrees: f64, (width, height): (usize, usize)) -> Description {
    let camera = Camera::look_at(origin, DVec3::ZERO, DVec3::Y, degrees.to_radians());
    let filter = Filter::Tent { radius: 1.0 };
    let mut d = Description::new(camera, Film { width, height, crop: None, sample_border: true, filter });
    d.integrator = Integrator { max_depth: Some(2), ..Integrator::default() };
    d
}

fn placed(scale: f64, at: [f64; 3]) -> Mesh {
    let scale = DAffine3::from_scale(DVec3::splat(scale));
    Mesh::rectangle().transformed(&(DAffine3::from_translation(DVec3::from(at)) * scale))
}

/// A square before a wall that it shades, lit by a lamp and a grey sky: the scene of the Python tests.
fn lit_square() -> Scene {
    let mut d = description(DVec3::new(0.0, 0.0, 4.0), 30.0, (24, 20));
    let paint = d.add_material(Material::diffuse("paint", DVec3::new(0.8, 0.3, 0.2)));
    let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.6)));
    d.add_shape("square", placed(0.4, [0.0, 0.0, 0.5]), paint);
    d.add_shape("wall", placed(3.0, [0.0; 3]), paper);
    let lamp = DAffine3::from_translation(DVec3::new(0.8, 0.6, 3.0))
        * DAffine3::from_rotation_x(std::f64::consts::PI)
        * DAffine3::from_scale(DVec3::splat(0.3));
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(12.0));
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::splat(0.2) });
    Scene::new(d).unwrap()
}

/// A slightly rotated lit square that casts a shadow on another one.
fn ordinary() -> Scene {
    let mut d = description(DVec3::new(0.0, 0.0, 2.0), 40.0, (24, 24));
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    let square =
        DAffine3::from_rotation_z(13_f64.to_radians()) * DAffine3::from_scale(DVec3::new(0.4, 0.35, 1.0));
    d.add_shape("square", Mesh::rectangle().transformed(&square), grey);
    d.add_shape("wall", placed(1.0, [0.0, 0.0, -0.5]), grey);
    let lamp = DAffine3::from_translation(DVec3::new(0.9, 0.0, 2.5))
        * DAffine3::from_rotation_x(std::f64::consts::PI)
        * DAffine3::from_scale(DVec3::splat(0.5));
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::new(4.0, 5.0, 6.0));
    Scene::new(d).unwrap()
}

fn moved(scene: &Scene, rate: [f64; 3]) -> Tangent {
    let mut change = Tangent::still(scene);
    change.translate(scene, 0, DVec3::from(rate));
    change
}

/// The verdict on a gradient, the method's times a factor.
fn times(checked: &Checked, factor: f64) -> Verdict {
    Verdict::of(Estimate { mean: factor * checked.method.mean, ..checked.method }, &checked.slopes)
}

/// Checks that the method's gradient is not rejected, and that one times each of some factors is.
fn tells_apart(check: &Check, scene: &Scene, rate: [f64; 3], method: &Estimator, wrong: &[f64]) {
    let checked = check.run(scene, &moved(scene, rate), method, &Progress::none()).unwrap();
    for (factor, differs) in std::iter::once((1.0, false)).chain(wrong.iter().map(|f| (*f, true))) {
        let found = times(&checked, factor);
        println!("{factor} of the gradient: {found:?}");
        assert_eq!(matches!(found, Verdict::Differs { .. }), differs, "{factor}: {found:?}, {checked:?}");
    }
}

/// On an ordinary scene a gradient that is 30 % too small or too large is rejected, and the correct one is
/// not.
#[test]
fn a_third_is_found_on_an_ordinary_scene() {
    let (check, scene) = (Check::default(), ordinary());
    tells_apart(&check, &scene, [0.2, 0.1, 0.3], &Estimator::auto(check.samples, 0), &[0.7, 1.3]);
}

/// The largest default steps move the square by three pixels and by one, where the error of finite
/// differences changes its sign: −5 % and +1 %.
#[test]
fn an_error_of_the_step_that_changes_its_sign_is_no_difference() {
    let (scene, rate) = (lit_square(), [1.0, 0.5, 0.0]);
    for seed in 0..3 {
        let check = Check { seed, ..Check::default() };
        tells_apart(&check, &scene, rate, &Estimator::edge_sampling(check.samples, 0), &[]);
    }
    let check = Check { samples: 128, ..Check::default() };
    tells_apart(&check, &scene, rate, &Estimator::edge_sampling(check.samples, 0), &[0.9, 1.1]);
}

#[test]
fn what_cannot_be_checked_says_why() {
    let scene = lit_square();
    let change = moved(&scene, [1.0, 0.0, 0.0]);
    let run = |check: &Check, method: &Estimator, change: &Tangent| {
        check.run(&scene, change, method, &Progress::none()).unwrap_err()
    };
    let check = Check { samples: 1, ..Check::default() };
    let edge = Estimator::edge_sampling(1, 0);
    assert_eq!(run(&check, &Estimator::finite_difference(1, 0.1, 0), &change), CheckError::Reference);
    let steps = Check { steps: vec![0.1, -0.1], ..check.clone() };
    assert_eq!(run(&steps, &edge, &change), GradientError::Step { step: -0.1 }.into());
    assert_eq!(run(&check, &edge, &Tangent::still(&ordinary())), GradientError::Tangent.into());
}
