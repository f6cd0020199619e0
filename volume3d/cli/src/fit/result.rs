//! The result of a fit: values with units, poses as matrices, and its quality.

use std::fmt::Write as _;

use glam::{DMat3, DQuat, DVec3};
use volume3d::optimize::{Fit, Group, Placed, Quantity};
use volume3d::scene::Scene;

use super::placed_scene::rows;
use super::quality::{Judged, Quality};

/// The largest number of values that are listed; those of larger parameters are in the scene.
pub(super) const LISTED: usize = 12;

/// The unit of a parameter's values.
pub(super) fn unit(group: &Group) -> &'static str {
    match group.quantity {
        Quantity::VertexPositions { .. } | Quantity::Translation { .. } | Quantity::CameraTranslation => {
            "scene units"
        }
        Quantity::Rotation { .. } | Quantity::CameraRotation => "rotation vector, radians",
        Quantity::Scale { .. } => "factor",
        Quantity::Sdf { .. } => "values of the grid or weights of the network",
        Quantity::FieldOfView => "radians",
        Quantity::Roughness { .. } => "roughness",
        Quantity::Radiance { .. }
        | Quantity::EnvironmentRadiance
        | Quantity::Intensity { .. }
        | Quantity::Reflectance { .. }
        | Quantity::Texture { .. } => "linear RGB",
    }
}

/// A pose with the name of its object.
pub(super) struct Pose<'p> {
    pub(super) name: String,
    pub(super) placed: Placed<'p>,
}

impl Pose<'_> {
    /// The distance by which the pivot moved, the rotation angle in degrees, and its axis.
    pub(super) fn motion(&self) -> (f64, f64, DVec3) {
        let map = self.placed.map;
        let distance = (map.transform_point3(self.placed.pivot) - self.placed.pivot).length();
        let scale = map.matrix3.x_axis.length();
        let (axis, angle) = DQuat::from_mat3(&DMat3::from_cols(
            map.matrix3.x_axis / scale,
            map.matrix3.y_axis / scale,
            map.matrix3.z_axis / scale,
        ))
        .to_axis_angle();
        // The smaller of the two angles.
        let (axis, angle) =
            if angle > std::f64::consts::PI { (-axis, std::f64::consts::TAU - angle) } else { (axis, angle) };
        (distance, angle.to_degrees(), axis)
    }
}

/// The poses that a fit found.
pub(super) fn poses(fit: &Fit) -> Vec<Pose<'_>> {
    fit.parameters()
        .placed(fit.result())
        .into_iter()
        .map(|placed| Pose { name: name_of(fit, &placed), placed })
        .collect()
}

/// The object's name, from the first parameter that places it.
fn name_of(fit: &Fit, placed: &Placed<'_>) -> String {
    let places = |q: Quantity| match q {
        Quantity::Translation { of } | Quantity::Rotation { of } | Quantity::Scale { of } => {
            of == placed.object
        }
        _ => false,
    };
    let mut groups = fit.parameters().groups().iter();
    let group = groups.find(|group| places(group.quantity) || group.tied.iter().any(|m| places(m.quantity)));
    let name = group.and_then(|group| Quantity::split_name(&group.name).ok());
    name.map_or_else(String::new, |name| name.what.to_owned())
}

/// The values of a fit, a line per parameter.
pub(super) fn listed(fit: &Fit) -> String {
    let mut text = String::new();
    for group in fit.parameters().groups() {
        let values = &fit.result()[group.range.clone()];
        if values.len() > LISTED {
            let _ = writeln!(text, "{}: {} numbers", group.name, values.len());
        } else {
            let values: Vec<String> = values.iter().map(|v| format!("{v:.6}")).collect();
            let _ = writeln!(text, "{}: {} ({})", group.name, values.join(", "), unit(group));
        }
    }
    for pose in poses(fit) {
        let (distance, angle, _) = pose.motion();
        let _ = writeln!(
            text,
            "pose of `{}`: moved by {distance:.4} scene units and rotated by {angle:.2}°; its matrix is in result.toml",
            pose.name
        );
    }
    text
}

/// The result as TOML, for other programs.
pub(super) fn toml(fit: &Fit, start: &[f64], scene: &Scene, judged: &[Judged]) -> String {
    let records = &fit.state().records;
    let losses = records.first().zip(records.last()).map_or((0.0, 0.0), |(a, b)| (a.loss, b.loss));
    let quality = Quality::of(judged);
    let mut text = format!(
        "# The result of a fit. Lengths are in units of the scene, angles in radians unless named otherwise.\n\
         steps = {}\nfirst_loss = {}\nlast_loss = {}\n\n\
         # Means over views; if a fit has reached its pictures, its residual is about its noise.\n\
         [quality]\nresidual = {}\nnoise = {}\nreached = {}\n",
        records.len(),
        number(losses.0),
        number(losses.1),
        number(quality.residual),
        number(quality.noise),
        quality.is_reached()
    );
    for Judged { view, residual, noise } in judged {
        let view = string(view);
        let _ = writeln!(
            text,
            "\n[[view]]\nname = {view}\nresidual = {}\nnoise = {}",
            number(*residual),
            number(*noise)
        );
    }
    for group in fit.parameters().groups() {
        let _ = writeln!(text, "\n[[parameter]]\nname = {}\nunit = \"{}\"", string(&group.name), unit(group));
        if group.range.len() <= LISTED {
            let from = start.get(group.range.clone()).filter(|_| start.len() == fit.result().len());
            if let Some(from) = from {
                let _ = writeln!(text, "start = {}", list(from));
            }
            let _ = writeln!(text, "value = {}", list(&fit.result()[group.range.clone()]));
        } else {
            let dimensions = group.first().dimensions(scene);
            let _ = writeln!(text, "dimensions = {dimensions:?}    # the values are in fit.xml");
        }
    }
    for pose in poses(fit) {
        let (distance, degrees, axis) = pose.motion();
        let _ = writeln!(
            text,
            "\n# matrix: maps a point (x, y, z, 1) of the scene before the fit to its fitted position; pivot: the centre \
             of rotation before the fit\n\
             [[pose]]\nof = {}\npivot = {}\nmoved = {}\ndegrees = {}\naxis = {}\nmatrix = [",
            string(&pose.name),
            list(&pose.placed.pivot.to_array()),
            number(distance),
            number(degrees),
            list(&axis.to_array())
        );
        rows(&pose.placed.map).iter().for_each(|row| text += &format!("    {},\n", list(row)));
        text.push_str("]\n");
    }
    text
}

fn list(numbers: &[f64]) -> String {
    format!("[{}]", numbers.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "))
}

/// A TOML number, with a decimal point or an exponent.
fn number(x: f64) -> String {
    if x.is_nan() {
        return "nan".to_owned();
    }
    format!("{x:?}")
}

fn string(text: &str) -> String {
    ::toml::Value::String(text.to_owned()).to_string()
}
