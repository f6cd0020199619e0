use flatland::random::{Stream, open01, stream};
use glam::DVec3;

use super::{MeshDistanceError, MeshDistances, from_mesh};
use crate::geometry::Mesh;
use crate::sdf::{Grid, Interpolation};

/// A sphere of radius 1, as a cube whose sides are cut into squares and blown up.
fn sphere(cuts: u32) -> Mesh {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for side in 0..6 {
        let first = positions.len() as u32;
        let normal = DVec3::AXES[side % 3] * if side < 3 { 1.0 } else { -1.0 };
        let u = DVec3::AXES[(side + 1) % 3];
        let v = normal.cross(u);
        for i in 0..=cuts {
            for j in 0..=cuts {
                let [s, t] = [i, j].map(|k| 2.0 * f64::from(k) / f64::from(cuts) - 1.0);
                positions.push((normal + s * u + t * v).normalize());
                if i < cuts && j < cuts {
                    let [a, b, c, d] =
                        [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(k, l)| first + (i + k) * (cuts + 1) + j + l);
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    Mesh::new(positions, triangles).unwrap()
}

/// The mesh with its triangles kept, turned or left out.
fn changed(mesh: &Mesh, change: impl Fn(usize, [u32; 3], &mut Stream) -> Option<[u32; 3]>) -> Mesh {
    let mut random = stream(7, &[]);
    let triangles = mesh.triangles().iter().enumerate();
    let triangles = triangles.filter_map(|(i, &t)| change(i, t, &mut random)).collect();
    Mesh::new(mesh.positions().to_vec(), triangles).unwrap()
}

fn convert(mesh: &Mesh, cells: usize) -> MeshDistances {
    from_mesh(mesh, Interpolation::Cubic, cells, 0.1).unwrap()
}

/// Nodes farther than half a cell from the surface whose sign is another.
fn wrong_signs(found: &Grid, truth: &Grid) -> usize {
    assert_eq!(found.size(), truth.size());
    let far = 0.5 * truth.spacing().x;
    let pairs = found.nodes().iter().zip(truth.nodes());
    pairs.filter(|(a, b)| b.abs() > far && (**a < 0.0) != (**b < 0.0)).count()
}

/// The sphere's facets lie within 1 − cos of their angle below it.
#[test]
fn distances_to_a_ball_are_exact() {
    let sagitta = 1e-3;
    let MeshDistances { grid, doubtful } = convert(&sphere(48), 40);
    assert_eq!(doubtful, 0);
    for (index, &value) in grid.nodes().iter().enumerate() {
        let exact = grid.position(index).length() - 1.0;
        assert!((-1e-12..sagitta).contains(&(value - exact)), "{index}: {value} for {exact}");
    }
}

#[test]
fn distances_to_a_cube_are_exact() {
    let MeshDistances { grid, doubtful } = convert(&Mesh::cube(), 21);
    assert_eq!(doubtful, 0);
    for (index, &value) in grid.nodes().iter().enumerate() {
        let q = grid.position(index).abs() - 1.0;
        let exact = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
        assert!((value - exact).abs() < 1e-13, "{index}: {value} for {exact}");
    }
}

#[test]
fn signs_survive_holes_and_turned_triangles() {
    let whole = sphere(24);
    let truth = convert(&whole, 32).grid;
    let outside_in = changed(&whole, |_, [a, b, c], _| Some([a, c, b]));
    assert_eq!(wrong_signs(&convert(&outside_in, 32).grid, &truth), 0);
    let missing = convert(&changed(&whole, |_, t, r| (open01(r) > 0.05).then_some(t)), 32);
    let wrong = wrong_signs(&missing.grid, &truth);
    assert!(wrong < 10, "{wrong} of 35,937");
    let turned = convert(
        &changed(&whole, |_, [a, b, c], r| Some(if open01(r) > 0.1 { [a, b, c] } else { [a, c, b] })),
        32,
    );
    let wrong = wrong_signs(&turned.grid, &truth);
    assert!(wrong < 100, "{wrong} of 35,937");
    // A sixth of the sphere is gone: a lid is put on it, and is called doubtful.
    let open = convert(&changed(&whole, |i, t, _| (i >= 24 * 24 * 2).then_some(t)), 32);
    assert!(open.doubtful > 100, "{}", open.doubtful);
    let centre = open.grid.nodes()[open.grid.nodes().len() / 2];
    assert!(centre < -0.9, "{centre}");
}

#[test]
fn threads_change_nothing() {
    let mesh = sphere(12);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| convert(&mesh, 20))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn what_has_no_inside_is_refused() {
    let error =
        |mesh: &Mesh, cells, margin| from_mesh(mesh, Interpolation::Cubic, cells, margin).unwrap_err();
    let flat = Mesh::new(vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], vec![[0, 1, 2]]).unwrap();
    assert_eq!(error(&flat, 8, 0.1), MeshDistanceError::Empty);
    assert_eq!(error(&Mesh::cube(), 0, 0.1), MeshDistanceError::Cells { cells: 0 });
    assert_eq!(error(&Mesh::cube(), 8, -1.0), MeshDistanceError::Margin { margin: -1.0 });
    let text = error(&Mesh::rectangle(), 8, 0.1).to_string();
    assert!(text.contains("every node is positive") && text.contains("encloses no node"), "{text}");
}
