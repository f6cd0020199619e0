//! Mesh attributes as textures: numbers at vertices or faces.
//!
//! Such a texture is an image with 2 × 2 texels per triangle, and the mesh has separate texture coordinates
//! for it. Three of the texels have the values at the corners. The fourth extends them to an affine function,
//! so that bilinear interpolation of the four equals linear interpolation between the corners exactly.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;

use glam::{DVec2, DVec3};

use super::element::Element;
use super::object::Ids;
use crate::Image;
use crate::geometry::Attribute;

/// The refused feature, and the alternative.
pub(super) const BESIDE_TEXTURES: &str = "a mesh_attribute beside textures of other kinds";
pub(super) const ALONE: &str = "give the surface attributes, or images, but not both";

/// A mesh file, and its triangles by the vertices of the file.
pub(super) struct Attributes {
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The elements that contain an attribute, directly or by reference, found backwards from the attributes, so
/// that each is visited once.
pub(super) fn asking(root: &Element, ids: &Ids<'_>) -> HashSet<*const Element> {
    let is_attribute =
        |element: &Element| element.tag == "texture" && element.attribute("type") == Some("mesh_attribute");
    let (mut elements, mut left) = (vec![], vec![root]);
    while let Some(element) = left.pop() {
        elements.push(element);
        left.extend(&element.children);
    }
    let mut found: Vec<*const Element> = elements
        .iter()
        .filter(|element| is_attribute(element))
        .map(|&element| std::ptr::from_ref(element))
        .collect();
    if found.is_empty() {
        return HashSet::new();
    }
    let mut around: HashMap<*const Element, Vec<*const Element>> = HashMap::new();
    for &element in &elements {
        for child in &element.children {
            let id = child.attribute("id").filter(|_| child.tag == "ref");
            let target = id.and_then(|id| ids.get(id)).unwrap_or(child);
            around.entry(std::ptr::from_ref(target)).or_default().push(std::ptr::from_ref(element));
        }
    }
    let mut asking: HashSet<*const Element> = HashSet::new();
    while let Some(element) = found.pop() {
        if asking.insert(element) {
            found.extend(around.get(&element).into_iter().flatten());
        }
    }
    asking
}

/// The number of triangles whose texels are side by side in a row.
fn columns(triangles: usize) -> usize {
    (triangles as f64).sqrt().ceil().max(1.0) as usize
}

/// The texels of the three corners of a triangle, by column and row.
fn texels(triangle: usize, columns: usize) -> [[usize; 2]; 3] {
    let (x, y) = (2 * (triangle % columns), 2 * (triangle / columns));
    [[x, y], [x + 1, y], [x, y + 1]]
}

/// Columns and rows of the image for `triangles` triangles.
fn size(triangles: usize) -> [usize; 2] {
    let columns = columns(triangles);
    [2 * columns, 2 * triangles.div_ceil(columns).max(1)]
}

/// The texture coordinates of a mesh for all of its attributes.
pub(super) fn coordinates(triangles: usize) -> Attribute<DVec2> {
    let [width, height] = size(triangles);
    let place = |[x, y]: [usize; 2]| {
        DVec2::new((x as f64 + 0.5) / width as f64, 1.0 - (y as f64 + 0.5) / height as f64)
    };
    let columns = columns(triangles);
    let values = (0..triangles).flat_map(|k| texels(k, columns).map(place)).collect();
    let corners = (0..triangles as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    Attribute { values, triangles: corners }
}

/// The image of an attribute, given at the corners of all triangles.
pub(super) fn image(corners: impl ExactSizeIterator<Item = [DVec3; 3]>) -> Image {
    let ([width, height], columns) = (size(corners.len()), columns(corners.len()));
    let mut pixels = vec![DVec3::ZERO; width * height];
    for (k, [a, b, c]) in corners.enumerate() {
        for ([x, y], value) in texels(k, columns).into_iter().zip([a, b, c]) {
            pixels[y * width + x] = value;
        }
        let [_, [x, _], [_, y]] = [[0, 0], texels(k, columns)[1], texels(k, columns)[2]];
        pixels[y * width + x] = b + c - a;
    }
    Image { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The interpolation between the texels of a triangle equals that between its corners, for any layout.
    #[test]
    fn an_image_has_what_the_corners_have() {
        let value = |k: usize, corner: usize| DVec3::new(k as f64, corner as f64, (k * corner) as f64);
        for count in [1, 2, 3, 5, 16, 17] {
            let image = image((0..count).map(|k| [0, 1, 2].map(|corner| value(k, corner))));
            let coordinates = coordinates(count);
            let at = |uv: DVec2| {
                let place =
                    DVec2::new(uv.x, 1.0 - uv.y) * DVec2::new(image.width as f64, image.height as f64) - 0.5;
                let (corner, part) = (place.floor(), place - place.floor());
                let texel = |x: usize, y: usize| {
                    let (x, y) = (corner.x as usize + x, corner.y as usize + y);
                    image.pixels[y.min(image.height - 1) * image.width + x.min(image.width - 1)]
                };
                let row = |y| texel(0, y).lerp(texel(1, y), part.x);
                row(0).lerp(row(1), part.y)
            };
            for (k, corners) in coordinates.triangles.iter().enumerate() {
                let uvs = corners.map(|i| coordinates.values[i as usize]);
                for weights in [[0.2, 0.5, 0.3], [0.6, 0.1, 0.3], [0.05, 0.05, 0.9]] {
                    let uv = (0..3).map(|i| weights[i] * uvs[i]).sum();
                    let expected: DVec3 = (0..3).map(|i| weights[i] * value(k, i)).sum();
                    assert!((at(uv) - expected).length() < 1e-9, "{count} {k}: {} {expected}", at(uv));
                }
            }
        }
    }
}
