use flatland::random::{Stream, open01, stream};
use glam::DVec3;

use super::{MeshDistanceError, MeshDistances, from_mesh};
use crate::geometry::Mesh;
use crate::sdf::{Grid, Interpolation};

/// A sphere of radius 1: a cube with its sides cut into squares, projected.
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

/// The mesh with its triangles kept, reversed or removed.
fn changed(mesh: &Mesh, change: impl Fn(usize, [u32; 3], &mut Stream) -> Option<[u32; 3]>) -> Mesh {
    let mut random = stream(7, &[]);
    let triangles = mesh.triangles().iter().enumerate();
    let triangles = triangles.filter_map(|(i, &t)| change(i, t, &mut random)).collect();
    Mesh::new(mesh.positions().to_vec(), triangles).unwrap()
}

fn convert(mesh: &Mesh, cells: usize) -> MeshDistances {
    from_mesh(mesh, Interpolation::Cubic, cells, 0.1).unwrap()
}

/// Number of nodes farther than half a cell from the surface with the wrong sign.
fn wrong_signs(found: &Grid, truth: &Grid) -> usize {
    assert_eq!(found.size(), truth.size());
    let far = 0.5 * truth.spacing().x;
    let pairs = found.nodes().iter().zip(truth.nodes());
    pairs.filter(|(a, b)| b.abs() > far && (**a < 0.0) != (**b < 0.0)).count()
}

/// The facets lie below the sphere by at most 1 − cos of their angle.
#[test]
fn distances_to_a_ball_are_exact() {
    let sagitta = 1e-3;
    let MeshDistances { grid, doubtful, lost } = convert(&sphere(48), 40);
    assert_eq!((doubtful, lost), (0, 0.0));
    for (index, &value) in grid.nodes().iter().enumerate() {
        let exact = grid.position(index).length() - 1.0;
        assert!((-1e-12..sagitta).contains(&(value - exact)), "{index}: {value} for {exact}");
    }
}

#[test]
fn distances_to_a_cube_are_exact() {
    let MeshDistances { grid, doubtful, lost } = convert(&Mesh::cube(), 21);
    assert_eq!((doubtful, lost), (0, 0.0));
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
    // A sixth of the sphere is missing: the hole is closed by a lid, and nodes near it are reported as
    // doubtful.
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

/// A cube of side 1 with its corner at `place`.
fn cube_at(place: DVec3) -> Mesh {
    let positions = Mesh::cube().positions().iter().map(|p| place + 0.5 * (*p + 1.0)).collect();
    Mesh::new(positions, Mesh::cube().triangles().to_vec()).unwrap()
}

/// Files in single precision. Control: far from the origin the box would move by up to a cell if it were
/// rounded after the distances were computed.
#[test]
fn far_from_the_origin_a_file_has_the_distances_of_its_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.vol");
    for place in [DVec3::new(1e6, -2e6, 3e5), DVec3::new(0.1, 7.3, -1e4), DVec3::splat(1e-3)] {
        let MeshDistances { grid, lost, .. } = convert(&cube_at(place), 64);
        assert_eq!(lost, 0.0);
        crate::io::write_sdf(&path, &grid).unwrap();
        let read = crate::io::read_sdf(&path, Interpolation::Cubic).unwrap();
        assert_eq!((read.low(), read.high()), (grid.low(), grid.high()));
        for (index, &value) in read.nodes().iter().enumerate() {
            let q = (read.position(index) - place - 0.5).abs() - 0.5;
            let exact = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
            assert!((value - exact).abs() < 2e-7 * (1.0 + exact.abs()), "{index}: {value} for {exact}");
        }
    }
    let far = Grid::new(
        Interpolation::Cubic,
        DVec3::splat(1e6 + 0.01),
        DVec3::splat(0.01),
        [2, 2, 2],
        vec![-1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
    );
    let error = crate::io::write_sdf(&path, &far.unwrap()).unwrap_err().to_string();
    assert!(error.contains("too far from the origin for cells so small"), "{error}");
}

/// A plate of unit side between the walls of a cube, and the fraction of the total area lost with it.
#[test]
fn thin_parts_are_lost_with_word() {
    let with_plate = |thickness: f64| {
        let plate = cube_at(DVec3::ZERO);
        let plate =
            plate.positions().iter().map(|p| DVec3::new(p.x, p.y, 0.4 + thickness * p.z) + 2.0 * DVec3::Y);
        let mut positions = cube_at(DVec3::ZERO).positions().to_vec();
        let first = positions.len() as u32;
        positions.extend(plate);
        let mut triangles = Mesh::cube().triangles().to_vec();
        triangles.extend(Mesh::cube().triangles().iter().map(|t| t.map(|i| i + first)));
        convert(&Mesh::new(positions, triangles).unwrap(), 64).lost
    };
    // 3 long with margins of 0.3: cells of 0.056. The plate has 2 of 8 parts of the area, besides its thin
    // sides.
    let thin = with_plate(1e-4);
    assert!((thin - 0.25).abs() < 1e-3, "{thin}");
    assert_eq!(with_plate(0.2), 0.0);
}
