//! What a ray hits, in numbers that carry derivatives.

mod implicit;
mod triangle;

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use self::implicit::MovingLevelSet;
use self::triangle::MovingTriangle;
use super::bsdf::{Mixed, Numbers, Shading};
use super::calculus::Calculus;
use super::relief::Tilted;
use super::texture::{lookup, luminance};
use crate::scene::{Bsdf, Reflectance, Relief, Scene, Surface, Value};

/// The least roughness α that a texture gives: below, the lobe is narrower than directions can be told apart.
const LEAST_ALPHA: f64 = 1e-4;

/// A point of a surface that a ray from the viewer hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint<T> {
    pub(crate) surface: Surface,
    pub(crate) position: Vec3<T>,
    /// Towards the viewer, unit length.
    pub(crate) viewer: Vec3<T>,
    moving: Moving<T>,
}

/// The surface in numbers. Of each kind it is asked how far away a ray meets it, and at a point of it for coordinates, for
/// the shading normal and for texture coordinates there.
#[derive(Clone, Copy, Debug)]
enum Moving<T> {
    Triangle(MovingTriangle<T>),
    Implicit(MovingLevelSet<T>),
}

/// A texture where a ray meets a triangle; all of it moves: the ray's origin, its direction and the triangle.
pub(super) fn texture_towards<C: Calculus>(
    scene: &Scene,
    calculus: &C,
    (origin, direction): (Vec3<C::Number>, Vec3<C::Number>),
    triangle: u32,
    texture: usize,
) -> Rgb<C::Number> {
    let moving = MovingTriangle::new(scene, calculus, triangle);
    let point = origin + direction * moving.distance(origin, direction);
    texture_at(scene, calculus, triangle, moving.coordinates(point), texture)
}

/// A texture at a point of a triangle, where its corners have these weights.
pub(super) fn texture_at<C: Calculus>(
    scene: &Scene,
    calculus: &C,
    triangle: u32,
    weights: [C::Number; 3],
    texture: usize,
) -> Rgb<C::Number> {
    let [s, t] = triangle::uv(scene, triangle, weights);
    let image = &scene.description.textures[texture];
    lookup(image, texture, [image.wrap; 2], s, t, calculus)
}

impl<T: Number> SurfacePoint<T> {
    /// Where the ray o + tω meets a surface, at about the given distance. All of it moves: the origin, the direction and the
    /// surface.
    #[inline]
    pub(crate) fn new<C: Calculus<Number = T>>(
        scene: &Scene,
        calculus: &C,
        origin: Vec3<T>,
        direction: Vec3<T>,
        surface: Surface,
        distance: f64,
    ) -> Self {
        let viewer = -direction;
        match surface {
            Surface::Triangle(index) => {
                let triangle = MovingTriangle::new(scene, calculus, index);
                let position = origin + direction * triangle.distance(origin, direction);
                Self { surface, position, viewer, moving: Moving::Triangle(triangle) }
            }
            Surface::Implicit(index) => {
                let near = origin + direction * T::constant(distance);
                let (position, gradient) = calculus.level_set(index, near, direction.value());
                Self { surface, position, viewer, moving: Moving::Implicit(MovingLevelSet { gradient }) }
            }
        }
    }

    /// What reflection depends on; `None` where the surface reflects nothing, whatever its parameters.
    #[inline]
    pub(crate) fn shading<'s, C: Calculus<Number = T>>(
        &self,
        scene: &'s Scene,
        calculus: &C,
    ) -> Option<Shading<'s, T>> {
        let materials = &scene.description.materials;
        let front = scene.material_of(self.surface);
        let own = self.interpolated_normal(scene, calculus);
        let is_behind = own.dot(self.viewer).value() < 0.0;
        let (index, is_open) = match materials[front].back {
            Some(back) if is_behind => (back, true),
            _ => (front, materials[front].two_sided),
        };
        if materials[index].blend.is_none() {
            return self.shading_of(scene, calculus, (index, is_open, false), own);
        }
        self.mixed(scene, calculus, (index, is_open), own)
    }

    /// What a mixture of two materials reflects.
    #[inline(never)]
    fn mixed<'s, C: Calculus<Number = T>>(
        &self,
        scene: &'s Scene,
        calculus: &C,
        (index, is_open): (usize, bool),
        own: Vec3<T>,
    ) -> Option<Shading<'s, T>> {
        let blend = scene.description.materials[index].blend?;
        let other = self.shading_of(scene, calculus, (blend.other, is_open, true), own)?;
        let weight = self.number(scene, calculus, blend.weight);
        let blend = Some(Box::new(Mixed { other, weight }));
        let shading = self.shading_of(scene, calculus, (index, is_open, true), own)?;
        Some(Shading { blend, ..shading }).filter(|s| !s.is_dark())
    }

    /// A number of a material.
    #[inline]
    fn number<C: Calculus<Number = T>>(&self, scene: &Scene, calculus: &C, value: Value) -> T {
        match value {
            Value::Constant(value) => T::constant(value),
            Value::Texture(texture) => luminance(self.texture(scene, calculus, texture)),
        }
    }

    /// What one material reflects, without those it is mixed with, whether its back is open or not. `None` where that is nothing,
    /// unless it is a part of a mixture.
    #[inline]
    fn shading_of<'s, C: Calculus<Number = T>>(
        &self,
        scene: &'s Scene,
        calculus: &C,
        (index, is_open, is_part): (usize, bool, bool),
        own: Vec3<T>,
    ) -> Option<Shading<'s, T>> {
        let material = &scene.description.materials[index];
        let cosine = own.dot(self.viewer).value();
        let transmits = material.bsdf.transmits();
        let mut black = cosine == 0.0 || (cosine < 0.0 && !(is_open || material.two_sided) && !transmits);
        let may_end = material.opacity.is_none() && !is_part;
        if black && may_end {
            return None;
        }
        let on_side = |normal: Vec3<T>| if cosine < 0.0 { -normal } else { normal };
        let (mut normal, mut beneath) = (on_side(own), None);
        if let Some(relief) = &material.relief {
            let tilted = self.relieved(scene, calculus, relief, (own, normal));
            beneath = Some(normal);
            normal = tilted;
            black |= tilted.dot(self.viewer).value() <= 0.0;
        }
        let reflectance = match material.bsdf.reflectance() {
            Reflectance::Constant(c) => {
                black |= *c == DVec3::ZERO && material.bsdf.is_scaled() && !calculus.wants_black(index);
                if black && may_end {
                    return None;
                }
                calculus.reflectance(index, *c)
            }
            Reflectance::Texture(texture) => self.texture(scene, calculus, *texture),
        };
        let roughness = material.bsdf.roughness().map(|alpha| calculus.roughness(index, alpha));
        let along = if material.is_anisotropic() { self.along(scene, normal) } else { None };
        let textured = |alpha, texture| self.textured_alpha(scene, calculus, alpha, texture);
        let [first, second] = material.roughness_textures;
        let across = match (roughness, along.and(material.bsdf.facets())) {
            (Some(alpha), Some(facets)) => textured(alpha * facets.stretch, second),
            _ => T::constant(0.0),
        };
        let roughness = roughness.map(|alpha| textured(alpha, first));
        let (numbers, roughness) = match &material.bsdf {
            Bsdf::Principled(_) | Bsdf::PrincipledThin(_) => {
                self.principled(scene, calculus, &material.bsdf, roughness)
            }
            _ => (None, roughness.unwrap_or(T::constant(0.0))),
        };
        let opacity = material.opacity.as_ref().map(|opacity| {
            luminance(match opacity {
                Reflectance::Constant(c) => Rgb::constant(*c),
                Reflectance::Texture(texture) => self.texture(scene, calculus, *texture),
            })
        });
        Some(Shading {
            bsdf: &material.bsdf,
            coating: scene.coatings[index].as_ref(),
            normal,
            viewer: self.viewer,
            reflectance,
            roughness,
            across,
            numbers,
            along,
            behind: cosine < 0.0 && transmits,
            opacity,
            black,
            beneath,
            blend: None,
        })
    }

    /// α times a texture's luminance, if there is one.
    #[inline]
    fn textured_alpha<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
        alpha: T,
        texture: Option<usize>,
    ) -> T {
        let Some(texture) = texture else { return alpha };
        let alpha = alpha * luminance(self.texture(scene, calculus, texture));
        if alpha.value() < LEAST_ALPHA { T::constant(LEAST_ALPHA) } else { alpha }
    }

    /// The numbers of a principled model at the point, and its roughness there: that of all the surface, where it is given.
    #[inline(never)]
    fn principled<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
        bsdf: &Bsdf,
        roughness: Option<T>,
    ) -> (Option<Box<Numbers<T>>>, T) {
        let number = |value: Value| self.number(scene, calculus, value);
        let mut numbers = match bsdf {
            Bsdf::Principled(solid) => Some(Box::new(Numbers::Solid(solid.map(number)))),
            Bsdf::PrincipledThin(thin) => Some(Box::new(Numbers::Thin(thin.map(number)))),
            _ => None,
        };
        // Where it is the same everywhere it is a parameter.
        let roughness = match (&mut numbers, roughness) {
            (None, alpha) => alpha.unwrap_or(T::constant(0.0)),
            (Some(numbers), given) => {
                let at_point = match &mut **numbers {
                    Numbers::Solid(solid) => &mut solid.roughness,
                    Numbers::Thin(thin) => &mut thin.roughness,
                };
                *at_point = given.unwrap_or(*at_point);
                *at_point
            }
        };
        (numbers, roughness)
    }

    /// The normal that a relief tilts, of the viewer's side, given that of the front and the same on the viewer's side.
    #[inline(never)]
    fn relieved<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
        relief: &Relief,
        (own, normal): (Vec3<T>, Vec3<T>),
    ) -> Vec3<T> {
        let tilted = self.tilted(scene, own).map_or(own, |t| t.normal(scene, calculus, relief));
        // The back is the mirror image of the front.
        let behind = own.dot(self.viewer).value() < 0.0;
        let tilted = if behind { tilted - own * (own.dot(tilted) * 2.0) } else { tilted };
        // One that turns away from the viewer is turned about the surface's own.
        let away = tilted.dot(self.viewer).value() <= 0.0;
        if away { normal * (normal.dot(tilted) * 2.0) - tilted } else { tilted }
    }

    /// The direction of the surface in which the first texture coordinate grows, made orthogonal to a normal.
    fn along(&self, scene: &Scene, normal: Vec3<T>) -> Option<Vec3<T>> {
        let Moving::Triangle(triangle) = &self.moving else { return None };
        let [side, _] = triangle.sides(scene)?;
        let along = side - normal * normal.dot(side);
        (along.dot(along).value() > 0.0).then(|| along.normalized())
    }

    #[inline(never)]
    fn texture<C: Calculus<Number = T>>(&self, scene: &Scene, calculus: &C, texture: usize) -> Rgb<T> {
        let [s, t] = self.uv(scene);
        let image = &scene.description.textures[texture];
        lookup(image, texture, [image.wrap; 2], s, t, calculus)
    }

    /// What a tilted normal follows from, where texture coordinates say so.
    fn tilted(&self, scene: &Scene, normal: Vec3<T>) -> Option<Tilted<T>> {
        let Moving::Triangle(triangle) = &self.moving else { return None };
        let (sides, face) = (triangle.sides(scene)?, triangle.face_normal());
        Some(Tilted { normal, uv: self.uv(scene), sides, face })
    }

    /// The shading normal as it is interpolated, on whichever side.
    #[inline]
    pub(crate) fn interpolated_normal<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
    ) -> Vec3<T> {
        match &self.moving {
            Moving::Triangle(triangle) => {
                triangle.shading_normal(scene, calculus, || triangle.coordinates(self.position))
            }
            Moving::Implicit(level_set) => level_set.normal(),
        }
    }

    /// Texture coordinates; an implicit surface has none, and no texture.
    fn uv(&self, scene: &Scene) -> [T; 2] {
        match &self.moving {
            Moving::Triangle(triangle) => {
                triangle::uv(scene, triangle.index, triangle.coordinates(self.position))
            }
            Moving::Implicit(_) => [T::constant(0.0); 2],
        }
    }
}
