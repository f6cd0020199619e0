//! Surface points over numbers.

mod implicit;
mod triangle;

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use self::implicit::MovingLevelSet;
use self::triangle::MovingTriangle;
use super::bsdf::{Mixed, Numbers, Shading};
use super::calculus::Calculus;
use super::normal_map::Tilted;
use super::texture::{lookup, luminance};
use crate::scene::{Bsdf, Reflectance, Relief, Scene, Surface, Value};

/// Least roughness α from a texture: below it, the lobe is narrower than the resolution of directions.
const LEAST_ALPHA: f64 = 1e-4;

/// A surface point hit by a ray from the viewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint<T> {
    pub(crate) surface: Surface,
    pub(crate) position: Vec3<T>,
    /// Unit vector towards the viewer.
    pub(crate) viewer: Vec3<T>,
    moving: Moving<T>,
}

/// A surface over numbers. Each kind provides the distance along a ray and, at a point, the coordinates,
/// shading normal and texture coordinates.
#[derive(Clone, Copy, Debug)]
enum Moving<T> {
    Triangle(MovingTriangle<T>),
    Implicit(MovingLevelSet<T>),
}

/// A texture at the intersection of a ray and a triangle, where the ray's origin and direction and the
/// triangle all move.
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

/// A texture at given barycentric coordinates of a triangle.
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
    /// Intersection of the ray o + tω with a surface near a given distance, where origin, direction and
    /// surface all move.
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

    /// Inputs of the BSDF; `None` if the surface reflects nothing, whatever its parameters.
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

    /// Shading of a mixture of two materials.
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

    /// A parameter of a material.
    #[inline]
    fn number<C: Calculus<Number = T>>(&self, scene: &Scene, calculus: &C, value: Value) -> T {
        match value {
            Value::Constant(value) => T::constant(value),
            Value::Texture(texture) => luminance(self.texture(scene, calculus, texture)),
        }
    }

    /// Shading of one material, without the other part of a mixture. `None` if it neither reflects nor
    /// transmits, unless it is part of a mixture.
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

    /// α times the luminance of its texture, if it has one.
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

    /// Parameters of a principled BSDF at the point, and its roughness there; `roughness` overrides it if
    /// given.
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
        // A constant roughness is a parameter.
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

    /// The bump- or normal-mapped normal on the viewer's side, given the front normal and the normal on the
    /// viewer's side.
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
        // A normal that faces away from the viewer is reflected about the geometric normal.
        let away = tilted.dot(self.viewer).value() <= 0.0;
        if away { normal * (normal.dot(tilted) * 2.0) - tilted } else { tilted }
    }

    /// Direction of increasing first texture coordinate, orthogonalised to a normal.
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

    /// Inputs of a bump- or normal-mapped normal, if texture coordinates define them.
    fn tilted(&self, scene: &Scene, normal: Vec3<T>) -> Option<Tilted<T>> {
        let Moving::Triangle(triangle) = &self.moving else { return None };
        let (sides, face) = (triangle.sides(scene)?, triangle.face_normal());
        Some(Tilted { normal, uv: self.uv(scene), sides, face })
    }

    /// The interpolated shading normal, on either side.
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

    /// The normal of a smooth surface: interpolated, or of an implicit surface; `None` for a flat triangle.
    pub(crate) fn smooth_normal<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
    ) -> Option<Vec3<T>> {
        let flat = matches!(self.moving, Moving::Triangle(triangle) if triangle.is_flat(scene));
        (!flat).then(|| self.interpolated_normal(scene, calculus))
    }

    /// Unit geometric normal of a triangle.
    pub(crate) fn face_normal(&self) -> Option<Vec3<T>> {
        match &self.moving {
            Moving::Triangle(triangle) => Some(triangle.face_normal()),
            Moving::Implicit(_) => None,
        }
    }

    /// Barycentric coordinates in a triangle.
    pub(crate) fn coordinates(&self) -> Option<[T; 3]> {
        match &self.moving {
            Moving::Triangle(triangle) => Some(triangle.coordinates(self.position)),
            Moving::Implicit(_) => None,
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
