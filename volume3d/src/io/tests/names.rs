//! Names in a scene file that refer to several objects.

use glam::DVec3;

use super::scene::with;
use crate::optimize::{Member, Parameters, Quantity};
use crate::scene::{Collection, Object, Scene};

fn scene(content: &str) -> Scene {
    Scene::new(with(content).unwrap()).unwrap()
}

/// A nested material is found by its own name, also if several materials share it.
#[test]
fn materials_within_others_are_found() {
    let scene = scene(
        "<bsdf type='diffuse' id='paint'/>\
         <bsdf type='twosided' id='wall'><bsdf type='roughconductor' id='coat'/></bsdf>\
         <bsdf type='twosided'><ref id='paint'/></bsdf>\
         <shape type='cube' id='one'><ref id='wall'/></shape>\
         <shape type='cube' id='two'><ref id='paint'/></shape>\
         <shape type='cube' id='three'><bsdf type='twosided'><ref id='paint'/></bsdf></shape>",
    );
    let wall = Quantity::find(&scene, "wall.roughness").unwrap();
    assert_eq!(Quantity::find(&scene, "coat.roughness").unwrap(), wall);
    // All painted surfaces change their colour.
    let parameters = Parameters::new(&scene, &["paint.reflectance"]).unwrap();
    let painted: Vec<usize> = parameters.groups()[0]
        .members()
        .map(|Member { quantity, .. }| match quantity {
            Quantity::Reflectance { material } => material,
            other => panic!("{other:?}"),
        })
        .collect();
    let of = |shape: usize| scene.description().shapes[shape].material;
    assert!(painted.contains(&of(1)) && painted.contains(&of(2)) && !painted.contains(&of(0)), "{painted:?}");
}

#[test]
fn instances_and_groups_move_as_one() {
    let mut scene = scene(
        "<shape type='shapegroup' id='g'><shape type='rectangle' id='a'/><shape type='cube'/></shape>\
         <shape type='instance' id='one'><ref id='g'/></shape>\
         <shape type='rectangle' id='alone'/>\
         <shape type='instance' id='two'><ref id='g'/><transform name='to_world'><translate x='5'/></transform></shape>",
    );
    let shapes = |id: &str| {
        let Some(&object @ Object::Collection(Collection::Instances(_))) = scene.named(id).first() else {
            panic!("{id} is no collection")
        };
        scene.description().moved_with(object).shapes
    };
    assert_eq!((shapes("one"), shapes("two"), shapes("g")), (vec![0, 1], vec![3, 4], vec![0, 1, 3, 4]));
    let before = scene.description().clone();
    let parameters = Parameters::new(&scene, &["g.translation", "g.rotation"]).unwrap();
    let quarter = std::f64::consts::FRAC_PI_2;
    parameters.apply(&[1.0, 0.0, 0.0, 0.0, 0.0, quarter], &mut scene).unwrap();
    // Both copies have the same vertices, one 5 to the right: the mean is 2.5 to the right of that of the
    // first.
    let points = [0, 1].map(|s| before.shapes[s].mesh.positions());
    let count = points.iter().map(|p| p.len()).sum::<usize>() as f64;
    let centre = points.into_iter().flatten().sum::<DVec3>() / count + 2.5 * DVec3::X;
    for s in 0..before.shapes.len() {
        let [old, new] = [&before, scene.description()].map(|d| d.shapes[s].mesh.positions());
        for (p, q) in old.iter().zip(new) {
            let arm = *p - centre;
            let turned = centre + DVec3::X + DVec3::new(-arm.y, arm.x, arm.z);
            let expected = if s == 2 { *p } else { turned };
            assert!((*q - expected).length() < 1e-12, "{s} {p} {q} {expected}");
        }
    }
}
