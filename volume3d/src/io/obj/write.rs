//! OBJ export.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

use crate::geometry::{Mesh, Normals};
use crate::io::{Error, files};

/// Writes a mesh as OBJ, atomically, without rounding: [`read_obj`] returns the same numbers.
///
/// Positions, given normals and texture coordinates keep their own topologies. Angle-weighted normals are not
/// written but recomputed by the reader; a position with several of them, as at a crease, becomes as many
/// vertices, which the reader welds. Whether normals are those of the faces is not written: the scene stores
/// it as `face_normals`.
///
/// # Errors
/// [`Error::File`].
///
/// [`read_obj`]: crate::io::read_obj
pub fn write_obj(path: &Path, mesh: &Mesh) -> Result<(), Error> {
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    files::write(path, |file| write(file, mesh).map_err(error))
}

fn write(file: &mut impl Write, mesh: &Mesh) -> std::io::Result<()> {
    let (vertices, triangles) = vertices(mesh);
    for &vertex in &vertices {
        let p = mesh.positions()[vertex as usize];
        writeln!(file, "v {} {} {}", p.x, p.y, p.z)?;
    }
    let normals = match mesh.normals() {
        Normals::Given(normals) => Some(normals),
        Normals::Face | Normals::AngleWeighted { .. } => None,
    };
    for n in normals.iter().flat_map(|normals| &normals.values) {
        writeln!(file, "vn {} {} {}", n.x, n.y, n.z)?;
    }
    for uv in mesh.uvs().iter().flat_map(|uvs| &uvs.values) {
        writeln!(file, "vt {} {}", uv.x, uv.y)?;
    }
    for (t, corners) in triangles.iter().enumerate() {
        write!(file, "f")?;
        for (k, corner) in corners.iter().enumerate() {
            let normal = normals.map(|n| n.triangles[t][k] + 1);
            let uv = mesh.uvs().map(|uv| uv.triangles[t][k] + 1);
            write!(file, " {}", corner + 1)?;
            match (uv, normal) {
                (None, None) => {}
                (Some(uv), None) => write!(file, "/{uv}")?,
                (None, Some(normal)) => write!(file, "//{normal}")?,
                (Some(uv), Some(normal)) => write!(file, "/{uv}/{normal}")?,
            }
        }
        writeln!(file)?;
    }
    Ok(())
}

/// The position of each vertex of the file, and the vertices of every triangle: a position has as many
/// vertices as it has computed normals, at least one.
fn vertices(mesh: &Mesh) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut vertices: Vec<u32> = (0..mesh.positions().len() as u32).collect();
    let Normals::AngleWeighted { triangles: normals, .. } = mesh.normals() else {
        return (vertices, mesh.triangles().to_vec());
    };
    // The first normal of a position uses the position's own index.
    let mut first = vec![None; vertices.len()];
    let mut others = HashMap::new();
    let mut vertex = |position: u32, normal: u32| {
        if *first[position as usize].get_or_insert(normal) == normal {
            return position;
        }
        *others.entry((position, normal)).or_insert_with(|| {
            vertices.push(position);
            vertices.len() as u32 - 1
        })
    };
    let triangles = mesh.triangles().iter().zip(normals);
    let triangles = triangles.map(|(p, n)| std::array::from_fn(|k| vertex(p[k], n[k]))).collect();
    (vertices, triangles)
}
