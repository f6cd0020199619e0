//! Tests of `figures peers` on a folder with one small scene.

use clap::Parser as _;
use glam::DVec3;
use volume3d::Image;
use volume3d::gradient::Tangent;
use volume3d::io::{Array, Precision, load_scene, write_npy};
use volume3d::scene::Scene;

use super::*;

/// A block on a film of 8×8 pixels under a sky.
pub(super) fn tiny_scene() -> Scene {
    let folder = folder();
    Scene::new(load_scene(&folder.path().join("cube_scene/cube_scene.xml")).unwrap()).unwrap()
}

#[derive(clap::Parser)]
struct Command {
    #[command(flatten)]
    options: Options,
}

fn options(arguments: &[&str]) -> Result<Options, clap::Error> {
    Command::try_parse_from(["peers"].iter().chain(arguments)).map(|command| command.options)
}

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="2"/></integrator>
    <sensor type="perspective"><float name="fov" value="40"/>
      <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
      <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
        <string name="pixel_format" value="rgb"/><rfilter type="box"/></film></sensor>
    <bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></bsdf>
    <shape type="cube" id="block"><ref id="white"/></shape>
    <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
  </scene>"#;

/// A folder with one scene, and a reference from many samples.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(at("cube_scene")).unwrap();
    std::fs::create_dir_all(at("ref")).unwrap();
    std::fs::write(at("cube_scene/cube_scene.xml"), SCENE).unwrap();
    let theta = r#"{"kind": "translate", "axis": [1, 0, 0], "meshes": ["block"], "fd_step": 0.01}"#;
    std::fs::write(at("cube_scene/theta.json"), theta).unwrap();
    let header = "scene,normals,filter,method,system,label,spp,seeds,seconds,reverse_seconds,relmse,rel_variance,rel_bias2,slope\n";
    let row = "cube_scene,face,box,projective,m 3,none,16,8,1,,100,100,1000,0.5\n";
    std::fs::write(at("results.csv"), format!("{header}{row}")).unwrap();
    let zeros = Array { shape: vec![8, 8, 3], values: vec![0.0; 192] };
    let array = |image: &Image| Array {
        values: image.pixels.iter().flat_map(DVec3::to_array).collect(),
        ..zeros.clone()
    };
    let scene = Scene::new(load_scene(&at("cube_scene/cube_scene.xml")).unwrap()).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::X);
    let edges = Method::of_key("edge-sampling").unwrap();
    let task = Task { scene: &scene, change: &change, samples: 256, step: 0.01, seed: 5 };
    let truth = edges.estimate(&task, &Progress::none()).unwrap();
    for (what, array) in
        [("grad", array(&truth.gradient)), ("img", array(&truth.image)), ("varmean", zeros.clone())]
    {
        write_npy(&at(&format!("ref/cube_scene_box_{what}.npy")), &array, Precision::Single).unwrap();
    }
    folder
}

#[test]
fn rows_are_measured_once() {
    let folder = folder();
    let scenes = folder.path().to_str().unwrap();
    let out = folder.path().join("out");
    let run = |more: &[&str]| {
        let fixed = ["--scenes", scenes, "--samples", "8", "--runs", "3", "--out", out.to_str().unwrap()];
        let options = options(&[&fixed, more].concat()).unwrap();
        let references = folder.path().join("ref");
        let groups = options.groups(&Group::all(&references).unwrap()).unwrap();
        let mut records = Records::open(out.join("peers_runs.csv")).unwrap();
        let refused = options.measure(&references, &groups, &mut records).unwrap();
        assert!(refused.is_empty(), "{refused:?}");
        let stored = Stored::read(&folder.path().join("results.csv")).unwrap();
        options.write(&groups, &records, &stored).unwrap();
        records.rows
    };
    let first = run(&["--methods", "edge-sampling"]);
    assert_eq!(first.len(), 1);
    let row = &first[0];
    assert!((row.slope - 1.0).abs() < 0.2, "{row:?}");
    assert!((row.radiance_ratio - 1.0).abs() < 0.05, "{row:?}");
    // The existing row stays as it was, its time included; the other is added.
    let second = run(&["--methods", "edge-sampling,finite-differences"]);
    assert_eq!((second.len(), &second[0]), (2, row));
    // After a repeated measurement all but the time is the same.
    let third = run(&["--methods", "edge-sampling", "--again"]);
    let again = third.iter().find(|r| r.settings() == row.settings()).unwrap();
    assert_eq!(Row { seconds: row.seconds, ..again.clone() }, *row);
    let text = std::fs::read_to_string(out.join("peers.md")).unwrap();
    assert!(text.contains("| cube_scene | face | box | ours | edge sampling |") && text.contains("ours, "));
    assert!(out.join("peers.csv").is_file());
}

#[test]
fn faults_name_what_is_wrong() {
    let folder = folder();
    let scenes = folder.path().to_str().unwrap();
    let references = folder.path().join("ref");
    let all = Group::all(&references).unwrap();
    let wrong = options(&["--scenes", scenes, "--only", "cubes"]).unwrap();
    let error = wrong.groups(&all).unwrap_err().to_string();
    assert!(error.contains("“cubes”") && error.contains("cube_scene"), "{error}");
    let none = options(&["--scenes", scenes, "--filters", "tent"]).unwrap();
    assert!(none.groups(&all).is_err());
    let error = Group::all(folder.path()).unwrap_err().to_string();
    assert!(error.contains("holds no gradient image"), "{error}");
    let load = || Case::load(folder.path(), &references, &all[0]);
    assert!(load().is_ok());
    let small = Array { shape: vec![4, 4, 3], values: vec![0.0; 48] };
    let path = references.join("cube_scene_box_varmean.npy");
    write_npy(&path, &small, Precision::Single).unwrap();
    let error = format!("{:#}", load().err().unwrap());
    assert!(error.contains("varmean.npy") && error.contains("[4, 4, 3]"), "{error}");
    std::fs::remove_file(folder.path().join("cube_scene/theta.json")).unwrap();
    assert!(format!("{:#}", load().err().unwrap()).contains("theta.json"));
    for bad in [["--times", "0"], ["--times", "2,x"], ["--runs", "2"], ["--methods", "magic"]] {
        assert!(options(&[&["--scenes", scenes][..], &bad].concat()).is_err(), "{bad:?}");
    }
}
