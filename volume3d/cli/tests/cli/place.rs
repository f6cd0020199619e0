//! A folder with a scene, and the program run in it.

use std::path::PathBuf;
use std::process::{Command, Output};

use glam::DVec3;
use tempfile::TempDir;
use volume3d::Image;
use volume3d::io::{Array, read_exr, read_npy, write_exr, write_png};

const SCENE: &str = r#"<scene version="3.0.0">
  <default name="size" value="8"/>
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <film type="hdrfilm">
      <integer name="width" value="$size"/><integer name="height" value="$size"/><rfilter type="tent"/>
    </film>
    <transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
  </sensor>
  <bsdf type="twosided" id="plain"><bsdf type="diffuse"><rgb name="reflectance" value="0.6,0.5,0.4"/></bsdf></bsdf>
  <bsdf type="twosided" id="metal"><bsdf type="roughconductor"><float name="alpha" value="0.4"/></bsdf></bsdf>
  <bsdf type="twosided" id="paper"><bsdf type="diffuse">
    <texture type="bitmap" name="reflectance"><string name="filename" value="paper.png"/></texture>
  </bsdf></bsdf>
  <shape type="obj" id="sheet"><string name="filename" value="sheet.obj"/><ref id="plain"/></shape>
  <shape type="rectangle" id="back">
    <transform name="to_world"><scale value="3"/><translate z="-1"/></transform><ref id="paper"/>
  </shape>
  <shape type="cube" id="block">
    <transform name="to_world"><scale value="0.2"/><translate x="-0.9"/></transform><ref id="metal"/>
  </shape>
  <shape type="rectangle" id="lamp">
    <transform name="to_world"><rotate x="1" angle="180"/><translate z="3.5"/></transform>
    <emitter type="area"><rgb name="radiance" value="4,5,6"/></emitter>
  </shape>
  <!-- more -->
</scene>"#;

/// Two triangles whose six vertices are at four places.
const SHEET: &str =
    "v -.5 -.5 0\nv .6 -.4 0\nv .5 .5 .1\nv .5 .5 .1\nv -.4 .6 0\nv -.5 -.5 0\nf 1 2 3\nf 4 5 6\n";

/// A folder with the scene.
pub(crate) struct Place(TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        Self::with("")
    }

    /// With more in the scene.
    pub(crate) fn with(more: &str) -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        std::fs::write(place.path("scene.xml"), SCENE.replace("<!-- more -->", more)).unwrap();
        std::fs::write(place.path("sheet.obj"), SHEET).unwrap();
        let pixels = vec![DVec3::splat(0.2), DVec3::splat(0.8)];
        write_png(&place.path("paper.png"), &Image { width: 2, height: 1, pixels }).unwrap();
        place
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program, with a line of arguments.
    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_volume3d"));
        command.current_dir(self.0.path()).args(line.split_whitespace());
        command
    }

    /// What it says on both channels, and its exit code.
    pub(crate) fn run(&self, line: &str) -> (i32, String) {
        let Output { status, stdout, stderr } = self.command(line).output().unwrap();
        let text = String::from_utf8([stdout, stderr].concat()).unwrap();
        (status.code().unwrap_or(-1), text)
    }

    /// That it fails with a code and a message that contains some words.
    pub(crate) fn fail(&self, line: &str, code: i32, words: &[&str]) -> String {
        let (found, text) = self.run(line);
        let says = words.iter().all(|words| text.contains(words));
        assert!(found == code && says, "{line}: exit {found}, expected {code} and {words:?}: {text}");
        assert!(!text.contains("panicked"), "{line}: {text}");
        text
    }

    pub(crate) fn succeed(&self, line: &str) -> String {
        let (code, text) = self.run(line);
        assert_eq!(code, 0, "{line}: {text}");
        text
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// An adjoint of 8 × 8 pixels.
    pub(crate) fn write_adjoint(&self, pixels: Vec<DVec3>) {
        write_exr(&self.path("adj.exr"), &Image { width: 8, height: 8, pixels }).unwrap();
    }

    pub(crate) fn exr(&self, name: &str) -> Image {
        read_exr(&self.path(name)).unwrap()
    }

    pub(crate) fn npy(&self, name: &str) -> Array {
        read_npy(&self.path(name)).unwrap()
    }
}

pub(crate) fn sum(image: &Image) -> f64 {
    image.pixels.iter().map(|p| p.element_sum()).sum()
}
