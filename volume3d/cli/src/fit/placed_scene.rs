//! Writes the fitted scene. A pose becomes the transform of its mesh.

use std::path::Path;

use anyhow::bail;
use glam::DAffine3;
use volume3d::geometry::Mesh;
use volume3d::io::{read_text, write_bytes, write_scene};
use volume3d::optimize::Parameters;
use volume3d::scene::Scene;

/// Writes a scene with parameters x. Meshes that only a pose moves are written unchanged, with the pose as
/// their `to_world`.
pub(super) fn write(
    path: &Path,
    scene: &mut Scene,
    parameters: &Parameters,
    x: &[f64],
) -> anyhow::Result<()> {
    let mut rest: Vec<(usize, Mesh)> = vec![];
    let mut maps: Vec<(usize, DAffine3)> = vec![];
    for placed in parameters.placed(x) {
        for (shape, mesh) in placed.meshes {
            rest.push((shape, mesh.clone()));
            maps.push((shape, placed.map));
        }
    }
    if !rest.is_empty() {
        scene.set_meshes(rest)?;
    }
    write_scene(path, scene)?;
    if maps.is_empty() {
        return Ok(());
    }
    let text = with_transforms(&read_text(path)?, &maps);
    let Some(text) = text else { bail!("{}: a shape is missing", path.display()) };
    write_bytes(path, text.as_bytes())?;
    Ok(())
}

/// Inserts a `to_world` into shapes, given by their index among the meshes of a written scene.
fn with_transforms(text: &str, maps: &[(usize, DAffine3)]) -> Option<String> {
    let (mut written, mut shape, mut given) = (String::with_capacity(text.len()), None, 0);
    for line in text.lines() {
        written.push_str(line);
        written.push('\n');
        let bare = line.trim_start();
        if bare.starts_with("<shape type=\"ply\"") || bare.starts_with("<shape type=\"obj\"") {
            shape = Some(shape.map_or(0, |shape| shape + 1));
        }
        let map = maps.iter().find(|(index, _)| Some(*index) == shape).map(|(_, map)| map);
        if let (Some(map), true) = (map, bare.starts_with("<string name=\"filename\"")) {
            let indent = " ".repeat(line.len() - bare.len());
            let numbers = rows(map).as_flattened().iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
            written += &format!(
                "{indent}<transform name=\"to_world\">\n{indent}  <matrix value=\"{numbers}\"/>\n{indent}</transform>\n"
            );
            given += 1;
        }
    }
    (given == maps.len()).then_some(written)
}

/// The rows of a map's 4 × 4 matrix for columns (x, y, z, 1).
pub(super) fn rows(map: &DAffine3) -> [[f64; 4]; 4] {
    let (m, t) = (map.matrix3, map.translation);
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}
