//! PLY export.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use crate::geometry::{Mesh, Normals};
use crate::io::{Error, files};

/// Writes a mesh as binary little-endian PLY in double precision, atomically.
///
/// Given normals and texture coordinates become properties of the vertices. PLY has one topology only: a
/// position that carries several normals or texture coordinates becomes several vertices. [`read_ply`] welds
/// them again; but with angle-weighted normals, a texture seam becomes a crease. Whether the normals are
/// those of the faces is not written: the scene stores it as `face_normals`.
///
/// # Errors
/// [`Error::File`].
///
/// [`read_ply`]: crate::io::read_ply
pub fn write_ply(path: &Path, mesh: &Mesh) -> Result<(), Error> {
    let (vertices, triangles) = split(mesh);
    let normals = match mesh.normals() {
        Normals::Given(normals) => Some(&normals.values),
        Normals::Face | Normals::AngleWeighted { .. } => None,
    };
    let uvs = mesh.uvs().map(|uvs| &uvs.values);
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    files::write(path, |file| {
        let mut write = || {
            write!(file, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", vertices.len())?;
            let names = [("x y z", true), ("nx ny nz", normals.is_some()), ("u v", uvs.is_some())];
            for name in names.iter().filter(|n| n.1).flat_map(|n| n.0.split(' ')) {
                writeln!(file, "property double {name}")?;
            }
            let count = triangles.len();
            write!(file, "element face {count}\nproperty list uchar uint vertex_indices\nend_header\n")?;
            for &[position, normal, uv] in &vertices {
                numbers(file, &mesh.positions()[position as usize].to_array())?;
                if let Some(normals) = normals {
                    numbers(file, &normals[normal as usize].to_array())?;
                }
                if let Some(uvs) = uvs {
                    numbers(file, &uvs[uv as usize].to_array())?;
                }
            }
            for t in &triangles {
                file.write_all(&[3])?;
                t.iter().try_for_each(|i| file.write_all(&i.to_le_bytes()))?;
            }
            Ok(())
        };
        write().map_err(error)
    })
}

fn numbers(file: &mut impl Write, values: &[f64]) -> std::io::Result<()> {
    values.iter().try_for_each(|x| file.write_all(&x.to_le_bytes()))
}

/// Every combination of a position, a normal and a texture coordinate once, and the three combinations of
/// every triangle.
fn split(mesh: &Mesh) -> (Vec<[u32; 3]>, Vec<[u32; 3]>) {
    let normals = match mesh.normals() {
        Normals::Face => None,
        Normals::AngleWeighted { triangles, .. } => Some(triangles),
        Normals::Given(normals) => Some(&normals.triangles),
    };
    let uvs = mesh.uvs().map(|uvs| &uvs.triangles);
    if normals.is_none() && uvs.is_none() {
        // All vertices, used or not, in their order.
        let vertices = (0..mesh.positions().len() as u32).map(|i| [i, 0, 0]).collect();
        return (vertices, mesh.triangles().to_vec());
    }
    let mut index = HashMap::new();
    let mut vertices = vec![];
    let triangle = |t: usize| {
        std::array::from_fn(|c| {
            let vertex = [Some(mesh.triangles()), normals.map(Vec::as_slice), uvs.map(Vec::as_slice)]
                .map(|topology| topology.map_or(0, |topology| topology[t][c]));
            *index.entry(vertex).or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as u32 - 1
            })
        })
    };
    let triangles = (0..mesh.triangles().len()).map(triangle).collect();
    (vertices, triangles)
}
