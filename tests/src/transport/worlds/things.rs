//! Building blocks of random flat worlds.

use std::f64::consts::TAU;

use flatland::transport::{Gloss, Material, Shape};
use glam::DVec2;

use crate::dice::Dice;

impl Dice {
    /// A segment, an open polyline of two segments, or a polygon of up to five corners, inside a disc: the
    /// corners have increasing angles, so it does not intersect itself.
    pub(super) fn shape(&mut self, centre: DVec2, radius: f64, material: Material) -> Shape {
        let corners = self.count(2, 5);
        let turn = self.between(0.0, TAU);
        let corner = |i: usize, dice: &mut Self| {
            let angle = turn + TAU * (i as f64 + dice.between(-0.3, 0.3)) / corners as f64;
            centre + radius * dice.between(0.4, 1.0) * DVec2::from_angle(angle)
        };
        let points: Vec<_> = (0..corners).map(|i| corner(i, self)).collect();
        if corners > 2 && self.chance(0.7) {
            Shape::closed(points, material)
        } else {
            Shape::open(points, material)
        }
    }

    /// A diffuse material with an albedo up to `albedo`.
    pub(super) fn diffuse(&mut self, albedo: f64) -> Material {
        Material::diffuse(self.between(0.25, 1.0) * albedo)
    }

    /// A material with a lobe of a width in a range, and perhaps a diffuse part.
    pub(super) fn glossy(&mut self, albedo: f64, [narrow, wide]: [f64; 2]) -> Material {
        let reflectance = if self.chance(0.5) { self.between(0.1, 0.5) * albedo } else { 0.0 };
        let strength = self.between(0.5, 1.0) * (albedo - reflectance);
        let gloss = Some(Gloss { strength, width: self.scale(narrow, wide) });
        Material { reflectance, gloss, emission: 0.0 }
    }

    /// An emitter, which may also reflect.
    pub(super) fn emitter(&mut self) -> Material {
        let emission = self.between(0.5, 4.0);
        if self.chance(0.7) { Material::emitter(emission) } else { self.diffuse(0.6).with_emission(emission) }
    }
}
