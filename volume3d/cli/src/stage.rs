//! The text of a scene and of a fit around one mesh.

use glam::DVec3;

/// The upward direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Up {
    Y,
    Z,
}

/// Ratio of the distance from the origin to the radius above which a mesh is moved to the origin, where
/// coordinates have more digits.
const FAR: f64 = 1e3;
/// Range of radii within which a mesh keeps its units.
const SIZES: [f64; 2] = [1e-4, 1e4];

/// Half the camera's field of view, in degrees.
const HALF_VIEW: f64 = 20.0;
/// Room around the mesh's bounding ball in the picture, so that it stays in view as it moves.
const ROOM: f64 = 1.15;

/// A mesh with camera, ground, lamp and sky.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    id: String,
    plugin: &'static str,
    /// The mesh's file, relative to the scene.
    file: String,
    up: Up,
    /// Translation, then scale, applied to the mesh before all else, if necessary.
    placed: Option<(DVec3, f64)>,
    /// The centre of the mesh's bounding box in the scene, and half its diagonal.
    centre: DVec3,
    radius: f64,
    /// The height of its lowest point.
    lowest: f64,
}

impl Stage {
    /// For a mesh with a bounding box, read from a file by a plugin.
    pub(super) fn new(
        id: &str,
        plugin: &'static str,
        file: &str,
        (low, high): (DVec3, DVec3),
        up: Up,
    ) -> Self {
        let (centre, radius) = (0.5 * low + 0.5 * high, (0.5 * high - 0.5 * low).length());
        let is_far = centre.length() > FAR * radius;
        let is_sized = (SIZES[0]..=SIZES[1]).contains(&radius);
        let scale = if is_sized { 1.0 } else { 1.0 / radius };
        let placed = (is_far || !is_sized).then_some((-centre, scale));
        let (low, centre) =
            if placed.is_some() { (scale * (low - centre), DVec3::ZERO) } else { (low, centre) };
        let lowest = match up {
            Up::Y => low.y,
            Up::Z => low.z,
        };
        let (id, file) = (id.to_owned(), file.to_owned());
        Self { id, plugin, file, up, placed, centre, radius: scale * radius, lowest }
    }

    /// The directions right, up and towards the viewer.
    fn axes(&self) -> [DVec3; 3] {
        match self.up {
            Up::Y => [DVec3::X, DVec3::Y, DVec3::Z],
            Up::Z => [DVec3::X, DVec3::Z, DVec3::NEG_Y],
        }
    }

    /// A point by its coordinates along the axes, relative to the centre of the mesh, in radii.
    fn point(&self, right: f64, up: f64, front: f64) -> DVec3 {
        self.centre + self.vector(right, up, front)
    }

    fn vector(&self, right: f64, up: f64, front: f64) -> DVec3 {
        let [x, y, z] = self.axes();
        self.radius * (right * x + up * y + front * z)
    }

    /// A number rounded to four digits relative to the radius.
    fn short(&self, x: f64) -> String {
        let decimals = (3.0 - self.radius.log10().floor()).max(0.0) as usize;
        let text = format!("{x:.decimals$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    }

    fn shorts(&self, v: DVec3) -> String {
        v.to_array().map(|x| self.short(x)).join(", ")
    }

    /// A motion to the right, by a fifth of the radius.
    pub(super) fn motion(&self) -> String {
        self.shorts(self.vector(0.2, 0.0, 0.0)).replace(", ", ",")
    }

    /// A note about the translation and scale of the mesh.
    pub(super) fn moved(&self) -> Option<String> {
        let (shift, scale) = self.placed?;
        let DVec3 { x, y, z } = shift;
        let what = format!("the scene moves `{}` to the origin, by ({x}, {y}, {z})", self.id);
        Some(if scale == 1.0 {
            format!("{what}, because it is far away relative to its size")
        } else {
            format!("{what}, and scales it by {scale:e}: in units of the scene the mesh has radius 1")
        })
    }

    /// The scene, as Mitsuba 3 XML.
    pub(super) fn scene(&self) -> String {
        let [_, up, _] = self.axes();
        let distance = ROOM / HALF_VIEW.to_radians().sin();
        let eye = distance * DVec3::new(0.35, 0.45, 1.0).normalize();
        // Rectangles face along z.
        let (ground_turn, lamp_turn) = match self.up {
            Up::Y => ("            <rotate x=\"1\" angle=\"-90\"/>\n", 90),
            Up::Z => ("", 180),
        };
        let placed = self.placed.map_or(String::new(), |(shift, scale)| {
            let DVec3 { x, y, z } = shift;
            let scale =
                if scale == 1.0 { String::new() } else { format!("            <scale value=\"{scale}\"/>\n") };
            format!(
                "        <transform name=\"to_world\">\n            <translate value=\"{x}, {y}, {z}\"/>\n{scale}        </transform>\n"
            )
        });
        let above = self.centre.dot(up);
        let ground = self.centre - above * up + (self.lowest - 0.05 * self.radius) * up;
        format!(
            r#"<!-- `{id}` on a ground, with a lamp and a grey sky. -->
<scene version="3.0.0">
    <default name="size" value="128"/>
    <integrator type="path">
        <integer name="max_depth" value="3"/>
    </integrator>
    <sensor type="perspective">
        <float name="fov" value="{fov}"/>
        <transform name="to_world">
            <lookat origin="{eye}" target="{centre}" up="{up}"/>
        </transform>
        <film type="hdrfilm">
            <integer name="width" value="$size"/>
            <integer name="height" value="$size"/>
            <rfilter type="tent"/>
        </film>
    </sensor>

    <bsdf type="twosided" id="clay">
        <bsdf type="diffuse">
            <rgb name="reflectance" value="0.6 0.4 0.3"/>
        </bsdf>
    </bsdf>
    <shape type="{plugin}" id="{id}">
        <string name="filename" value="{file}"/>
{placed}        <ref id="clay"/>
    </shape>

    <shape type="rectangle" id="ground">
        <transform name="to_world">
{ground_turn}            <scale value="{ground_size}"/>
            <translate value="{ground}"/>
        </transform>
    </shape>
    <shape type="rectangle" id="lamp">
        <transform name="to_world">
            <scale value="{lamp_size}"/>
            <rotate x="1" angle="{lamp_turn}"/>
            <translate value="{lamp}"/>
        </transform>
        <emitter type="area">
            <rgb name="radiance" value="16"/>
        </emitter>
    </shape>
    <emitter type="constant" id="sky">
        <rgb name="radiance" value="0.3"/>
    </emitter>
</scene>
"#,
            id = self.id,
            plugin = self.plugin,
            file = in_attribute(&self.file),
            fov = 2.0 * HALF_VIEW,
            eye = self.shorts(self.point(eye.x, eye.y, eye.z)),
            centre = self.shorts(self.centre),
            up = up.to_array().map(|x| x.to_string()).join(", "),
            ground_size = self.short(8.0 * self.radius),
            ground = self.shorts(ground),
            lamp_size = self.short(0.6 * self.radius),
            lamp = self.shorts(self.point(0.8, 3.0, 1.0)),
        )
    }

    /// The fit, as TOML. `file` and `run`: its path and the folder of its run, as words of a command line.
    pub(super) fn fit(&self, file: &str, run: &str) -> String {
        format!(
            r#"# The pose of `{id}`: it starts moved and rotated, and is fitted to a picture of its true pose.
#
#   volume3d fit {file} -o {run}
#
# `volume3d fit --example` shows all keys.
scene = "scene.xml"
define = {{ size = "64" }}           # $size in the scene: pixels along each side
steps = 60
gradient = {{ spp = 8, image_spp = 16 }}

# The target is rendered from the scene itself. For a photograph, replace [reference] by:
#   [[view]]
#   target = "photograph.png"
[reference]
scene = "scene.xml"
define = {{ size = "64" }}
spp = 256

[[parameter]]
name = "{id}.translation"          # in units of the scene
rate = {rate}                      # size of a step, approximately
start = [{start}]

[[parameter]]
name = "{id}.rotation"             # a rotation vector, in radians
rate = 0.04
start = [{turn}]
"#,
            id = self.id,
            rate = self.short(0.03 * self.radius),
            start = self.shorts(self.vector(0.14, 0.07, -0.07)),
            turn = {
                let [x, y, z] = self.axes();
                (0.1 * x - 0.3 * y + 0.1 * z).to_array().map(|x| x.to_string()).join(", ")
            },
        )
    }
}

/// Escapes text for an attribute of a scene, in which $ begins a name.
fn in_attribute(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    text.replace('$', "\\$")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_of_the_mesh() {
        let stage = |radius: f64| {
            let corner = DVec3::splat(radius / 3f64.sqrt());
            Stage::new("a", "obj", "a.obj", (-corner, corner), Up::Y)
        };
        assert_eq!(stage(1.0).short(0.12345), "0.123");
        assert_eq!(stage(1e-3).short(1.23456e-4), "0.000123");
        assert_eq!(stage(5e3).short(-1234.56), "-1235");
        assert_eq!(stage(1.0).short(-1e-9), "0");
        assert_eq!(stage(1.0).short(100.0), "100");
    }

    #[test]
    fn what_is_far_is_moved_and_what_is_huge_is_scaled() {
        let place = |centre: DVec3, radius: f64| {
            let half = DVec3::splat(radius / 3f64.sqrt());
            Stage::new("a", "obj", "a.obj", (centre - half, centre + half), Up::Z)
        };
        assert!(place(DVec3::splat(100.0), 1.0).moved().is_none());
        let far = place(DVec3::new(4.5e5, 0.0, 0.0), 1e-3);
        assert!(far.placed.unwrap().1 == 1.0 && far.centre == DVec3::ZERO);
        assert!(far.lowest < 0.0 && far.lowest > -1e-3, "{}", far.lowest);
        let huge = place(DVec3::ZERO, 1e9);
        assert!((huge.radius - 1.0).abs() < 1e-12 && huge.moved().unwrap().contains("scales it"));
    }
}
