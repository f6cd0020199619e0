//! Validation of scene descriptions.

use std::collections::HashSet;

use flatland::sdf::Sdf as _;
use glam::{DMat3, DVec2, DVec3};

use super::{
    Blend, Bsdf, Camera, Description, Environment, Film, Filter, ImplicitShape, Light, Material, Placement,
    Reflectance, Roughness, Scattering, SceneError, Shape, Texture,
};
use crate::geometry::{Accelerator, Mesh, MeshError, Normals};

pub(super) fn check(description: &Description) -> Result<(), SceneError> {
    let Description {
        camera, film, textures, materials, shapes, implicits, tracer, lights, environment, ..
    } = description;
    self::camera(camera)?;
    self::film(film)?;
    unique("texture", textures.iter().map(|t| &t.id))?;
    unique("material", materials.iter().map(|m| &m.id))?;
    unique("shape", shapes.iter().map(|s| &s.id).chain(implicits.iter().map(|s| &s.id)))?;
    unique("light", lights.iter().map(Light::id))?;
    textures.iter().try_for_each(texture)?;
    for (index, material) in materials.iter().enumerate() {
        self::material(material, textures.len())?;
        parts_of(index, material, materials)?;
    }
    for shape in shapes {
        material_of(&shape.id, shape.material, materials)?;
        mesh(&shape.id, &shape.mesh)?;
        coordinates(&shape.id, &shape.mesh, shape.is_textured(materials))?;
        shape.radiance_texture.map_or(Ok(()), |index| check_index(&shape.id, index, textures.len()))?;
        if let Some(radiance) = shape.radiance {
            not_negative(&shape.id, "the radiance", radiance)?;
        }
    }
    tracer.check()?;
    for shape in implicits {
        implicit(shape, materials)?;
        outside(shape, camera)?;
    }
    for light in lights {
        self::light(light, textures.len())?;
    }
    if let Some(environment) = environment {
        self::environment(environment, textures.len())?;
    }
    count(shapes)
}

/// The material of a shape.
fn material_of<'m>(id: &str, index: usize, materials: &'m [Material]) -> Result<&'m Material, SceneError> {
    let (what, count) = ("material", materials.len());
    materials.get(index).ok_or_else(|| SceneError::Missing { id: id.to_owned(), what, index, count })
}

/// Checks that transforms have kept positions finite.
pub(super) fn mesh(id: &str, mesh: &Mesh) -> Result<(), SceneError> {
    match mesh.positions().iter().position(|p| !p.is_finite()) {
        None => Ok(()),
        Some(index) => {
            let error = MeshError::NotFinite { what: "position", index };
            Err(SceneError::Mesh { id: id.to_owned(), error })
        }
    }
}

/// Checks that a textured surface has texture coordinates.
pub(super) fn coordinates(id: &str, mesh: &Mesh, textured: bool) -> Result<(), SceneError> {
    if textured && mesh.uvs().is_none() {
        return Err(SceneError::NoCoordinates { id: id.to_owned() });
    }
    Ok(())
}

/// Checks the placement of an implicit surface, and that its material has no texture.
pub(super) fn implicit(shape: &ImplicitShape, materials: &[Material]) -> Result<(), SceneError> {
    let Placement { scale, rotation, translation } = shape.placement;
    let range = |what, value, range| Err(SceneError::Range { id: shape.id.clone(), what, value, range });
    if !(scale.is_finite() && scale > 0.0) {
        return range("the scale", scale, "positive and finite");
    }
    if let Some(&value) = translation.to_array().iter().find(|p| !p.is_finite()) {
        return range("a coordinate", value, "finite");
    }
    let turned = (rotation * rotation.transpose() - DMat3::IDENTITY).to_cols_array();
    let error = turned.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if !(error < 1e-6 && rotation.determinant() > 0.0) {
        return range("the deviation of its rotation from one", error, "0 to rounding, with determinant 1");
    }
    let material = material_of(&shape.id, shape.material, materials)?;
    on_implicit(shape, material, materials)
}

/// Checks that the materials to which a material refers come before it and are admissible there.
pub(super) fn parts_of(index: usize, material: &Material, materials: &[Material]) -> Result<(), SceneError> {
    let id = &material.id;
    if let Some(other) = material.others().find(|&other| other >= index) {
        let what = "material that stands before it";
        return Err(SceneError::Missing { id: id.clone(), what, index: other, count: index });
    }
    let blended = |other: &Material| SceneError::Blend { id: id.clone(), other: other.id.clone() };
    if let Some(back) = material.back.map(|back| &materials[back])
        && (material.bsdf.transmits() || back.bsdf.transmits())
    {
        return Err(blended(back));
    }
    let Some(Blend { other, weight }) = material.blend else { return Ok(()) };
    if let Some(weight) = weight.constant() {
        range((0.0..=1.0).contains(&weight), id, "the weight", weight, "in [0, 1]")?;
    }
    let other = &materials[other];
    let is_even = material.relief.is_none() && other.relief.is_none();
    if is_even && other.opacity.is_none() && other.others().next().is_none() {
        return Ok(());
    }
    Err(blended(other))
}

/// Checks that a material is admissible for implicit surfaces, which have no texture coordinates and are
/// traced from outside only.
pub(super) fn on_implicit(
    shape: &ImplicitShape,
    material: &Material,
    materials: &[Material],
) -> Result<(), SceneError> {
    material.others().try_for_each(|other| on_implicit(shape, &materials[other], materials))?;
    if material.textures().next().is_some() {
        return Err(SceneError::NoCoordinates { id: shape.id.clone() });
    }
    if material.bsdf.transmits() || material.opacity.is_some() {
        return Err(SceneError::Transmits { id: shape.id.clone(), material: material.id.clone() });
    }
    Ok(())
}

/// Checks that the camera, with its whole lens, is outside an implicit surface.
pub(super) fn outside(shape: &ImplicitShape, camera: &Camera) -> Result<(), SceneError> {
    let value = shape.jet(camera.origin).value;
    let least = camera.lens.map_or(0.0, |lens| lens.radius * shape.slope_bound());
    if value > least { Ok(()) } else { Err(SceneError::Inside { id: shape.id.clone(), value, least }) }
}

/// Checks that counts fit into indices.
pub(super) fn count(shapes: &[Shape]) -> Result<(), SceneError> {
    let sum = |of: fn(&Mesh) -> usize| shapes.iter().map(|s| of(&s.mesh)).sum::<usize>();
    let normals = |mesh: &Mesh| match mesh.normals() {
        Normals::Face => 0,
        Normals::AngleWeighted { count, .. } => *count,
        Normals::Given(given) => given.values.len(),
    };
    let tables: [(&str, usize, usize); 4] = [
        ("vertices", sum(|m| m.positions().len()), u32::MAX as usize - 1),
        ("normals", sum(normals), u32::MAX as usize - 1),
        ("texture coordinates", sum(|m| m.uvs().map_or(0, |uvs| uvs.values.len())), u32::MAX as usize - 1),
        ("triangles", sum(|m| m.triangles().len()), Accelerator::MOST),
    ];
    match tables.into_iter().find(|(_, count, most)| count > most) {
        None => Ok(()),
        Some((what, count, most)) => Err(SceneError::TooLarge { what, count, most }),
    }
}

/// Checks that a new name is not in use.
pub(super) fn renamed<'a>(
    what: &'static str,
    old: &str,
    new: &str,
    mut all: impl Iterator<Item = &'a String>,
) -> Result<(), SceneError> {
    if new != old && all.any(|id| id == new) {
        return Err(SceneError::Duplicate { what, id: new.to_owned() });
    }
    Ok(())
}

pub(super) fn camera(camera: &Camera) -> Result<(), SceneError> {
    let Camera {
        origin,
        right,
        up,
        forward,
        field_of_view,
        principal_point,
        pixel_aspect,
        lens,
        orthographic,
    } = camera;
    let frame = [*right, *up, *forward];
    // Frames read from six-digit files are orthonormal to about this precision.
    let tolerance = 1e-5;
    let orthonormal = (0..3)
        .all(|i| (0..3).all(|j| (frame[i].dot(frame[j]) - if i == j { 1.0 } else { 0.0 }).abs() < tolerance));
    if !orthonormal || !origin.is_finite() {
        return Err(SceneError::Frame);
    }
    let in_range = *field_of_view > 0.0 && *field_of_view < std::f64::consts::PI;
    range(in_range, "camera", "the field of view", *field_of_view, "in (0, pi)")?;
    for offset in principal_point.to_array() {
        range(offset.is_finite(), "camera", "the principal point", offset, "finite")?;
    }
    let in_range = pixel_aspect.is_finite() && *pixel_aspect > 0.0;
    range(in_range, "camera", "the pixel aspect", *pixel_aspect, "positive and finite")?;
    let sizes = lens.iter().flat_map(|lens| {
        [("the radius of the lens", lens.radius), ("the distance in focus", lens.focus_distance)]
    });
    if orthographic.is_some() && (lens.is_some() || *principal_point != DVec2::ZERO) {
        return Err(SceneError::Orthographic);
    }
    let distance = orthographic.map(|distance| ("the distance of an orthographic sensor", distance));
    for (what, size) in sizes.chain(distance) {
        range(size.is_finite() && size > 0.0, "camera", what, size, "positive and finite")?;
    }
    Ok(())
}

pub(super) fn film(film: &Film) -> Result<(), SceneError> {
    let inside = film.crop.is_none_or(|c| {
        let fits = |start: usize, size: usize, whole: usize| size > 0 && start.saturating_add(size) <= whole;
        fits(c.x, c.width, film.width) && fits(c.y, c.height, film.height)
    });
    if !inside || film.width == 0 || film.height == 0 {
        return Err(SceneError::Film { width: film.width, height: film.height });
    }
    match film.filter {
        Filter::Box => Ok(()),
        Filter::Tent { radius } => {
            range(radius > 0.0 && radius <= 16.0, "film", "the tent's radius", radius, "in (0, 16]")
        }
        Filter::Gaussian { deviation } => {
            let good = deviation > 0.0 && deviation <= 4.0;
            range(good, "film", "the Gaussian's standard deviation", deviation, "in (0, 4]")
        }
        Filter::Cubic { b, c } => {
            let bad = [b, c].into_iter().find(|x| !(0.0..=1.0).contains(x));
            range(bad.is_none(), "film", "the filter's B or C", bad.unwrap_or(0.0), "in [0, 1]")
        }
        Filter::Lanczos { lobes } => {
            let good = (1..=16).contains(&lobes);
            range(good, "film", "the number of lobes", f64::from(lobes), "from 1 to 16")
        }
    }
}

pub(super) fn texture(texture: &Texture) -> Result<(), SceneError> {
    let Texture { id, width, height, texels, .. } = texture;
    if texels.is_empty() || width.checked_mul(*height) != Some(texels.len()) {
        return Err(SceneError::Texels {
            id: id.clone(),
            width: *width,
            height: *height,
            texels: texels.len(),
        });
    }
    let bad = texels.iter().find(|t| !t.is_finite());
    range(bad.is_none(), id, "a texel", f64::NAN, "finite")
}

pub(super) fn material(material: &Material, textures: usize) -> Result<(), SceneError> {
    let id = &material.id;
    if let Reflectance::Constant(c) = material.bsdf.reflectance() {
        not_negative(id, "the reflectance", *c)?;
    }
    material.textures().try_for_each(|index| check_index(id, index, textures))?;
    if let Some(Roughness { alpha, stretch, .. }) = material.bsdf.facets() {
        // Below, the lobe is narrower than the resolution of directions.
        range((1e-4..=1.0).contains(&alpha), id, "the roughness", alpha, "in [1e-4, 1]")?;
        let across = alpha * stretch;
        // The stretch is a quotient of two roughnesses: quotient and product are rounded once each.
        let most = 1.0 + 2.0 * f64::EPSILON;
        range((1e-4..=most).contains(&across), id, "the roughness across u", across, "in [1e-4, 1]")?;
    }
    let coated = matches!(&material.bsdf, Bsdf::Plastic(p) if p.scattering != Scattering::Once);
    let rough = material.bsdf.facets().is_some() && !coated;
    let textured = material.roughness_textures.iter().flatten().count() as f64;
    range(
        rough || textured == 0.0,
        id,
        "textures of its roughness",
        textured,
        "0 unless it is a rough conductor or dielectric, or plastic whose light is scattered once",
    )?;
    if let Some([eta, k]) = material.bsdf.index_of_refraction() {
        not_negative(id, "eta", eta)?;
        not_negative(id, "k", k)?;
    }
    if let Some(eta) = material.bsdf.relative_index() {
        range(
            eta > 0.0 && eta.is_finite(),
            id,
            "the relative index of refraction",
            eta,
            "positive and finite",
        )?;
        // At an index of 1 microfacets have no refraction formula, and a coating no boundary.
        let refracts = match &material.bsdf {
            Bsdf::Dielectric(dielectric) => dielectric.facets.is_some(),
            Bsdf::Plastic(_) => true,
            solid @ Bsdf::Principled(_) => solid.transmits(),
            _ => false,
        };
        range(eta != 1.0 || !refracts, id, "the relative index of refraction", eta, "other than 1")?;
    }
    let numbers = material.bsdf.values().into_iter();
    for (what, value, most) in numbers.filter_map(|(what, value, most)| Some((what, value.constant()?, most)))
    {
        range(
            (0.0..=most).contains(&value),
            id,
            what,
            value,
            if most > 1.0 { "in [0, 2]" } else { "in [0, 1]" },
        )?;
    }
    match &material.bsdf {
        Bsdf::Plastic(plastic) => not_negative(id, "the specular reflectance", plastic.specular_reflectance)?,
        Bsdf::Dielectric(dielectric) | Bsdf::ThinDielectric(dielectric) => {
            not_negative(id, "the specular reflectance", dielectric.specular_reflectance)?;
        }
        _ => {}
    }
    if let Some(Reflectance::Constant(opacity)) = material.opacity {
        let most = opacity.max_element();
        range(opacity.min_element() >= 0.0 && most <= 1.0, id, "the opacity", most, "in [0, 1]")?;
    }
    if material.relief.is_some() && material.bsdf.transmits() {
        let id = id.clone();
        return Err(SceneError::Relief { id });
    }
    Ok(())
}

pub(super) fn light(light: &Light, textures: usize) -> Result<(), SceneError> {
    match light {
        Light::Directional { id, direction, irradiance, kappa } => {
            not_negative(id, "the irradiance", *irradiance)?;
            let length = direction.length();
            range((length - 1.0).abs() < 1e-6, id, "the direction's length", length, "1")?;
            range(*kappa > 0.0, id, "kappa", *kappa, "positive")
        }
        Light::Point { id, position, intensity } => {
            not_negative(id, "the intensity", *intensity)?;
            range(position.is_finite(), id, "a coordinate of the position", f64::NAN, "finite")
        }
        Light::Spot { id, position, to_world, intensity, cutoff, beam, texture } => {
            not_negative(id, "the intensity", *intensity)?;
            range(position.is_finite(), id, "a coordinate of the position", f64::NAN, "finite")?;
            rotation(id, to_world)?;
            let right = f64::to_radians(90.0);
            range(
                (0.0..right).contains(cutoff) && *cutoff > 0.0,
                id,
                "the cutoff angle",
                *cutoff,
                "in (0, pi/2)",
            )?;
            range(
                (0.0..=*cutoff).contains(beam),
                id,
                "the beam width",
                *beam,
                "between 0 and the cutoff angle",
            )?;
            texture.map_or(Ok(()), |index| check_index(id, index, textures))
        }
        Light::Projector { id, position, to_world, intensity, field_of_view, aspect, texture } => {
            not_negative(id, "the irradiance", *intensity)?;
            range(position.is_finite(), id, "a coordinate of the position", f64::NAN, "finite")?;
            rotation(id, to_world)?;
            let in_range = *field_of_view > 0.0 && *field_of_view < std::f64::consts::PI;
            range(in_range, id, "the field of view", *field_of_view, "in (0, pi)")?;
            range(*aspect > 0.0 && aspect.is_finite(), id, "the aspect", *aspect, "positive and finite")?;
            texture.map_or(Ok(()), |index| check_index(id, index, textures))
        }
    }
}

fn rotation(id: &str, to_world: &DMat3) -> Result<(), SceneError> {
    let error = (*to_world * to_world.transpose() - DMat3::IDENTITY).to_cols_array();
    let worst = error.iter().fold(0.0_f64, |worst, e| worst.max(e.abs()));
    range(worst < 1e-5, id, "the distance of to_world from a rotation", worst, "0")
}

pub(super) fn environment(environment: &Environment, textures: usize) -> Result<(), SceneError> {
    match environment {
        Environment::Constant { id, radiance } => not_negative(id, "the radiance", *radiance),
        Environment::Map { id, texture, scale, to_world } => {
            check_index(id, *texture, textures)?;
            range(*scale >= 0.0 && scale.is_finite(), id, "the scale", *scale, "finite and not negative")?;
            rotation(id, to_world)
        }
    }
}

fn check_index(id: &str, index: usize, count: usize) -> Result<(), SceneError> {
    if index < count {
        Ok(())
    } else {
        Err(SceneError::Missing { id: id.to_owned(), what: "texture", index, count })
    }
}

pub(super) fn not_negative(id: &str, what: &'static str, c: DVec3) -> Result<(), SceneError> {
    let bad = c.to_array().into_iter().find(|x| !(*x >= 0.0 && x.is_finite()));
    range(bad.is_none(), id, what, bad.unwrap_or(0.0), "finite and not negative")
}

pub(super) fn range(
    good: bool,
    id: &str,
    what: &'static str,
    value: f64,
    range: &'static str,
) -> Result<(), SceneError> {
    if good { Ok(()) } else { Err(SceneError::Range { id: id.to_owned(), what, value, range }) }
}

pub(super) fn unique<'a>(
    what: &'static str,
    ids: impl Iterator<Item = &'a String>,
) -> Result<(), SceneError> {
    let mut seen = HashSet::new();
    for id in ids {
        if !seen.insert(id) {
            return Err(SceneError::Duplicate { what, id: id.clone() });
        }
    }
    Ok(())
}
