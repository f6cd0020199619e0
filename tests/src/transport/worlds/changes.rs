//! Random changes of a world with θ.

use flatland::transport::{CameraTangent, Tangent, World};

use super::Moving;
use crate::dice::Dice;

/// A change of the kind `moving` of a world of size `unit`.
pub(super) fn draw(dice: &mut Dice, moving: Moving, world: &World, unit: f64) -> Tangent {
    let shapes: Vec<usize> = (0..world.shapes().len()).filter(|_| dice.chance(0.5)).collect();
    // At least one.
    let shapes = if shapes.is_empty() { vec![dice.count(0, world.shapes().len() - 1)] } else { shapes };
    let camera = |camera: CameraTangent| Tangent::of_camera(world, camera);
    let none = CameraTangent::default();
    match moving {
        Moving::Translate => Tangent::translate(world, shapes, dice.vector2(unit)),
        Moving::Rotate => Tangent::rotate(world, shapes, dice.vector2(unit)),
        Moving::Scale => Tangent::scale(world, shapes, dice.vector2(unit)),
        Moving::Vertex => {
            let mut change = Tangent::none(world);
            change.vertices[dice.count(0, world.vertex_count() - 1)] = dice.vector2(unit);
            change
        }
        Moving::CameraPosition => camera(CameraTangent { position: dice.vector2(unit), ..none }),
        Moving::CameraAngle => camera(CameraTangent { angle: dice.sign(), ..none }),
        Moving::FieldOfView => camera(CameraTangent { field_of_view: dice.sign(), ..none }),
        Moving::Material => {
            let mut change = Tangent::none(world);
            for (material, shape) in change.materials.iter_mut().zip(world.shapes()) {
                // Relative rates: a narrow lobe has little room. A strength of 0 may, however, become
                // positive.
                let now = shape.material();
                material.reflectance = rate(dice, now.reflectance);
                material.emission = dice.between(-1.0, 1.0) * now.emission;
                if let Some(gloss) = now.gloss {
                    material.gloss_strength = rate(dice, gloss.strength);
                    material.gloss_width = dice.between(-1.0, 1.0) * gloss.width;
                }
            }
            change
        }
        Moving::Environment => Tangent { environment: 1.0, ..Tangent::none(world) },
        Moving::Mixed => {
            let mut sum = Tangent::none(world);
            for part in Moving::ALL.into_iter().filter(|part| *part != Moving::Mixed) {
                sum.add(dice.between(-1.0, 1.0), &draw(dice, part, world, unit));
            }
            sum
        }
    }
}

/// The rate of a scattering coefficient: relative to its value, or, if that is 0, sometimes positive, so that
/// there is a valid world on one side at least.
fn rate(dice: &mut Dice, now: f64) -> f64 {
    match now {
        0.0 if dice.chance(0.5) => dice.between(0.0, 1.0),
        _ => dice.between(-1.0, 1.0) * now,
    }
}
