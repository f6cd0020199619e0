//! Silhouettes on the film: an emitting square grows in front of a brighter sky.

use glam::{DAffine3, DVec3};
use tests::space::scenes::film;
use volume3d::geometry::Mesh;
use volume3d::gradient::Tangent;
use volume3d::scene::{Camera, Description, Environment, Filter, Integrator, Scene};

use super::{Case, edges, exact_mean, power, softened};

#[test]
fn a_square_before_a_bright_sky() {
    let (pixels, half, distance) = (6, 0.6, 3.0);
    let (shines, sky) = (DVec3::new(1.0, 0.5, 2.0), DVec3::new(3.0, 4.0, 5.0));
    let mut power = power("space_curves::a_square_before_a_bright_sky");
    for filter in [Filter::Tent { radius: 1.0 }, Filter::Box] {
        let camera = Camera::look_at(distance * DVec3::Z, DVec3::ZERO, DVec3::Y, 0.8);
        let mut d = Description::new(camera, film(pixels, filter));
        d.integrator = Integrator { max_depth: Some(1), rr_depth: 100 };
        let centre = DVec3::new(0.05, -0.02, 0.0);
        let place =
            DAffine3::from_scale_rotation_translation(DVec3::splat(half), glam::DQuat::IDENTITY, centre);
        d.add_emitter("square", Mesh::rectangle().transformed(&place), shines);
        d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: sky });
        let scene = Scene::new(d).expect("a scene");
        let mut change = Tangent::still(&scene);
        change.scale(&scene, 0, centre, 1.0);
        let side = 2.0 * half / distance * 0.5 * pixels as f64 / 0.4_f64.tan();
        let exact = (shines - sky).element_sum() * 2.0 * side * side;
        let case = Case { scene, change, exact, error: 1e-9 };
        case.accept(&mut power, &format!("edge sampling, {filter:?}"), &edges(1, [32, 1, 1]));
        // With little softening, most of the residual is the field's own motion.
        for softness in [0.05, 0.4, f64::INFINITY] {
            let method = softened(16, softness, [32, 1, 0]);
            case.accept(&mut power, &format!("softened, ε = {softness}, {filter:?}"), &method);
        }
        case.accept(&mut power, &format!("mean over jumps, {filter:?}"), &exact_mean(32));
        case.reject(&format!("silhouettes left out, {filter:?}"), &softened(16, 0.4, [0, 1, 0]));
    }
}
