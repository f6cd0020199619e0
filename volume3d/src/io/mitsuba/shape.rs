//! Shapes.

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::attribute::{self, Attributes};
use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::{emitter, support, transform};
use crate::geometry::{Attribute, Mesh, Normals, TOLERANCE};
use crate::io::soup::Soup;
use crate::io::{At, Error, MeshFormat, MeshProblem, Place, serialized};
use crate::scene::{Material, Shape, parts};

impl<'a> Reader<'a> {
    pub(super) fn shape(&mut self, element: &'a Element) -> Result<(), Error> {
        let object = Object::new(element, &self.ids)?;
        let bsdf = object.at_most_one("<bsdf>")?;
        self.attributes = None;
        let asks = bsdf.is_some_and(|bsdf| self.asks(bsdf));
        let mesh = match object.plugin {
            "obj" => self.mesh_file(&object, Some(MeshFormat::Obj), asks)?,
            "ply" => self.mesh_file(&object, Some(MeshFormat::Ply), asks)?,
            "serialized" => self.mesh_file(&object, None, asks)?,
            "rectangle" => built_in(&object, Mesh::rectangle())?,
            "cube" => built_in(&object, Mesh::cube())?,
            "sphere" => sphere(&object)?,
            "disk" => curved(&object, Mesh::disk())?,
            "cylinder" => cylinder(&object)?,
            "bsplinecurve" | "linearcurve" => self.curves(&object)?,
            "shapegroup" => return Self::shape_group(&object),
            "instance" => return self.instance(element, &object),
            "sdfgrid" => return self.sdf_grid(element, &object),
            "sdfnetwork" => return self.sdf_network(element, &object),
            _ => return Err(object.unknown_plugin("shape", support::SHAPES)),
        };
        let mesh = match object.transform("to_world")? {
            // `to_world` was already applied to a curve's control points, but not to its radii.
            Some(_) if object.plugin.ends_with("curve") => mesh,
            Some(element) if object.plugin == "sphere" => {
                let center = object.vector("center")?.unwrap_or(DVec3::ZERO);
                mesh.transformed(&transform::of_sphere(element, center, &self.journal)?)
            }
            Some(element) => placed(element, mesh, object.plugin)?,
            None => mesh,
        };
        let attributes = self.attributes.take();
        let emitted = match object.at_most_one("<emitter>")? {
            Some(emitter) => {
                let radiance =
                    Object::new(emitter, &self.ids).and_then(|object| emitter::area(self, &object));
                self.journal.accept(radiance, emitter, "the shape does not emit")
            }
            None => None,
        };
        let material = match bsdf {
            Some(bsdf) if asks => self.material_of_attributes(bsdf, attributes),
            Some(bsdf) => self.material_or_grey(bsdf),
            None => self.default_material(emitted.is_some()),
        };
        if asks && let Some((_, Some(_))) = emitted {
            return Err(element.unsupported(attribute::BESIDE_TEXTURES, attribute::ALONE));
        }
        self.check_seen(element, material, mesh.uvs())?;
        let is_file = matches!(object.plugin, "obj" | "ply" | "serialized");
        let is_textured =
            emitted.is_some_and(|(_, texture)| texture.is_some()) || self.needs_coordinates(material);
        let mesh = if is_file && is_textured && mesh.uvs().is_none() {
            self.journal.note_image(element, EACH_TRIANGLE);
            coordinates_of_triangles(&object, mesh)?
        } else {
            mesh
        };
        let boundary = self.boundary(&object, material)?;
        object.finish()?;
        let id = self.name(element, self.shapes.len());
        if matches!(object.plugin, "sphere" | "disk" | "cylinder" | "bsplinecurve" | "linearcurve") {
            let (plugin, count) = (object.plugin, mesh.triangles().len());
            let percent = 100.0 * TOLERANCE;
            self.journal.note_shape(
                element,
                format!(
                    "{plugin} `{id}` is a mesh of {count} triangles, within {percent} % of its radius; gradients are \
                     those of the mesh"
                ),
            );
        }
        let is_file = matches!(object.plugin, "obj" | "ply" | "serialized");
        let mesh = if emitted.is_some() && is_file { self.emitting(element, mesh, &id) } else { mesh };
        let (radiance, radiance_texture) = emitted.unzip();
        let radiance_texture = radiance_texture.flatten();
        self.shapes.push(Shape { id, mesh, material, radiance, radiance_texture, boundary });
        Ok(())
    }

    /// An emitting mesh. In Mitsuba the side of emission follows the vertex normals, here the faces: faces
    /// are oriented by their normals, and remaining differences are noted.
    fn emitting(&self, element: &Element, mesh: Mesh, id: &str) -> Mesh {
        let count = mesh.triangles().len();
        let (mesh, turned) = mesh.with_fronts_by_normals();
        if turned > 0 {
            let what = format!(
                "{turned} of the {count} triangles of `{id}` are turned to where their vertex normals point, from where it \
                 emits in Mitsuba"
            );
            self.journal.note(element, what);
        }
        if mesh.has_bent_normals() {
            let what = format!(
                "`{id}` emits as far as its faces are seen from the front; Mitsuba emits as far as its smooth normals \
                 are: set face_normals for the same light in both"
            );
            self.journal.note_image(element, what);
        }
        mesh
    }

    /// A material, or grey if it is refused, so that errors of the rest of the shape are reported too.
    fn material_or_grey(&mut self, bsdf: &'a Element) -> usize {
        let material = self.material(bsdf);
        let instead = self.instead(bsdf);
        match self.journal.accept(material, bsdf, instead) {
            Some(material) => material,
            None => self.substitute(bsdf),
        }
    }

    /// Whether a material uses texture coordinates.
    fn needs_coordinates(&self, material: usize) -> bool {
        let needs = |material: &Material| material.textures().next().is_some() || material.is_anisotropic();
        parts(&self.materials, material).into_iter().any(|part| needs(&self.materials[part]))
    }

    /// Whether a surface transmits no light.
    pub(super) fn is_opaque(&self, material: usize) -> bool {
        parts(&self.materials, material).into_iter().all(|part| {
            let Material { bsdf, opacity, .. } = &self.materials[part];
            !bsdf.transmits() && opacity.is_none()
        })
    }

    /// The mesh of a file; with texture coordinates for the file's attributes, if these are used.
    fn mesh_file(
        &mut self,
        object: &Object<'a>,
        format: Option<MeshFormat>,
        asks: bool,
    ) -> Result<Mesh, Error> {
        let element = object.element;
        let name = object.string("filename")?.ok_or_else(|| object.missing("filename"))?;
        let index = match format {
            None => {
                object.integer_in("shape_index", 0..=i64::from(u32::MAX), "a whole number of at least 0")?
            }
            Some(_) => None,
        };
        let (path, bytes) = self.file(element, name)?;
        let parsed = match format {
            Some(format) => format.parse(&bytes, &path).map(|soup| (soup, false)),
            None => serialized::parse(&bytes, &path, index.unwrap_or(0) as usize),
        };
        let (mut soup, face_normals) = parsed.map_err(|error| element.referenced(error))?;
        for note in &soup.notes {
            self.journal.note_image(element, format!("{}: {note}", path.display()));
        }
        // Mitsuba's first texture row is at v = 0; most OBJ files mean v = 1.
        if object.boolean("flip_tex_coords")?.unwrap_or(format == Some(MeshFormat::Obj)) {
            soup.flip_texture_coordinates();
        }
        if object.boolean("flip_normals")? == Some(true) {
            soup.flip_normals();
        }
        if object.float("max_smooth_angle")?.is_some() {
            object.note(
                "max_smooth_angle is ignored: normals are those of the file, or smooth where it has none",
            );
        }
        let face_normals = object.boolean("face_normals")?.unwrap_or(face_normals);
        if asks && format == Some(MeshFormat::Ply) {
            soup.uvs = Some(attribute::coordinates(soup.triangles.len()));
            self.attributes =
                Some(Attributes { path: path.clone(), bytes, triangles: soup.triangles.clone() });
        }
        soup.into_mesh(face_normals).map_err(|error| {
            let problem = MeshProblem::Geometry(error);
            element.referenced(Error::Mesh { place: Place::new(&path, At::Whole), problem })
        })
    }
}

/// The mesh of a shape under its transform, which must be invertible. If a `rotate` has an axis that is not
/// of length 1, Mitsuba 3 transforms normals by the matrix itself, including face normals of built-in shapes
/// and instances. Disks and cylinders lie where rays find them by the inverse that Mitsuba assumes.
pub(super) fn placed(element: &Element, mesh: Mesh, plugin: &str) -> Result<Mesh, Error> {
    let map = transform::invertible(element)?;
    if !transform::has_other_axes(element) {
        return Ok(mesh.transformed(&map));
    }
    let other = transform::inverse_of_inverse(element)?;
    let is_flat = matches!(mesh.normals(), Normals::Face);
    Ok(match plugin {
        "disk" | "cylinder" => mesh.transformed(&other),
        "rectangle" | "cube" | "instance" if is_flat => {
            mesh.with_given_face_normals().transformed_with_normals_of(&map, &other)
        }
        _ => mesh.transformed_with_normals_of(&map, &other),
    })
}

/// Note on a mesh without texture coordinates that needs some.
const EACH_TRIANGLE: &str = "the file has no texture coordinates: each of its triangles shows the texture anew, as in Mitsuba, from its \
                             first corner along its sides";

/// Default texture coordinates of a mesh, as in Mitsuba: those of a triangle's corners are (0, 0), (1, 0) and
/// (0, 1), in the order of the file, which flipped normals and a mirror reverse.
fn coordinates_of_triangles(object: &Object<'_>, mesh: Mesh) -> Result<Mesh, Error> {
    let flips = object.boolean("flip_normals")? == Some(true);
    let mirrors = match object.affine("to_world")? {
        Some((_, map)) => map.matrix3.determinant() < 0.0,
        None => false,
    };
    let corners = if flips == mirrors { [0, 1, 2] } else { [0, 2, 1] };
    let values = vec![DVec2::ZERO, DVec2::X, DVec2::Y];
    let uvs = Attribute { values, triangles: vec![corners; mesh.triangles().len()] };
    mesh.with_uvs(uvs).map_err(|error| {
        let place = object.element.place();
        Error::Mesh { place, problem: MeshProblem::Geometry(error) }
    })
}

/// A shape with flat faces, which always has face normals.
fn built_in(object: &Object<'_>, mesh: Mesh) -> Result<Mesh, Error> {
    object.boolean("face_normals")?;
    if object.boolean("flip_normals")? != Some(true) {
        return Ok(mesh);
    }
    turned(object, Soup::from_faces(&mesh), true)
}

/// A curved shape with the normals of the exact surface.
fn curved(object: &Object<'_>, mesh: Mesh) -> Result<Mesh, Error> {
    if object.boolean("flip_normals")? == Some(true) {
        turned(object, Soup::from(mesh), false)
    } else {
        Ok(mesh)
    }
}

fn turned(object: &Object<'_>, mut soup: Soup, face_normals: bool) -> Result<Mesh, Error> {
    soup.flip_normals();
    soup.into_mesh(face_normals).map_err(|error| {
        let place = object.element.place();
        Error::Mesh { place, problem: MeshProblem::Geometry(error) }
    })
}

fn sphere(object: &Object<'_>) -> Result<Mesh, Error> {
    let center = object.vector("center")?.unwrap_or(DVec3::ZERO);
    let radius = object.positive("radius")?.unwrap_or(1.0);
    let map = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(radius)), center);
    Ok(curved(object, Mesh::sphere())?.transformed(&map))
}

/// A cylinder from `p0` to `p1`, whose line is the axis.
fn cylinder(object: &Object<'_>) -> Result<Mesh, Error> {
    let p0 = object.vector("p0")?.unwrap_or(DVec3::ZERO);
    let p1 = object.vector("p1")?.unwrap_or(DVec3::Z);
    let radius = object.positive("radius")?.unwrap_or(1.0);
    let axis = (p1 - p0).try_normalize();
    let axis =
        axis.ok_or_else(|| object.element.bad_value("p1", &p1.to_string(), "a point other than p0"))?;
    let [s, t] = transform::across(axis);
    let map = DAffine3::from_mat3_translation(DMat3::from_cols(radius * s, radius * t, p1 - p0), p0);
    Ok(curved(object, Mesh::cylinder())?.transformed(&map))
}
