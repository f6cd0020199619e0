//! `volume3d info`.

use std::fmt::Write as _;

use clap::Args;
use clap::error::ErrorKind;
use flatland::sdf::Sdf as _;
use glam::{DVec2, DVec3};
use volume3d::io::mitsuba::support_table;
use volume3d::lint;
use volume3d::scene::{Camera, Description, Environment, Lens, Light, Medium, Reflectance, Scene};
use volume3d::sdf::{Baked, Grid, Guided};

use super::report::{Outcome, Report, usage};
use super::session::{Loaded, SceneOptions};

/// Lists the contents of a scene: ids for --move and --wrt, sizes, bounding boxes, and the findings of
/// `lint`.
#[derive(Args, Debug)]
pub(super) struct Options {
    #[command(flatten)]
    scene: Option<SceneOptions>,
    /// Lists the supported part of the scene format instead of a scene.
    #[arg(long, exclusive = true)]
    support: bool,
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let Some(scene) = options.scene.as_ref().filter(|_| !options.support) else {
        if options.support {
            return Ok(Report { text: support_table(), outcome: Outcome::Good });
        }
        let text = "give a scene, or --support".to_owned();
        return Err(usage("info", ErrorKind::MissingRequiredArgument, text));
    };
    let Loaded { scene, notes, .. } = scene.load()?;
    let mut text = String::new();
    camera(&mut text, &scene);
    shapes(&mut text, scene.description());
    implicits(&mut text, scene.description());
    instances(&mut text, scene.description());
    materials(&mut text, scene.description());
    media(&mut text, scene.description());
    lights(&mut text, scene.description());
    crossings(&mut text, &scene);
    findings(&mut text, &scene);
    if !notes.is_empty() {
        let _ = writeln!(
            text,
            "notes: {}, about parts of the file that may be read differently than intended",
            notes.len()
        );
        notes.iter().for_each(|note| text += &format!("  {note}\n"));
    }
    Ok(Report { text, outcome: Outcome::Good })
}

fn camera(text: &mut String, scene: &Scene) {
    let d = scene.description();
    let (width, height) = scene.size();
    let degrees = d.camera.field_of_view.to_degrees();
    let depth = d.integrator.max_depth.map_or_else(|| "unlimited".to_owned(), |n| n.to_string());
    let _ = writeln!(text, "image: {width} × {height} pixels, {} spp, filter {:?}", d.samples, d.film.filter);
    let Camera { principal_point, pixel_aspect, lens, .. } = d.camera;
    let pivot = d.camera.pivot();
    let _ = match d.camera.orthographic {
        None => write!(text, "camera: at {pivot}, {degrees:.2}° horizontally"),
        Some(distance) => {
            let width = 2.0 * distance * (0.5 * d.camera.field_of_view).tan();
            write!(text, "camera: orthographic, at {pivot}, {width:.4} wide")
        }
    };
    if principal_point != DVec2::ZERO || pixel_aspect != 1.0 {
        let _ = write!(
            text,
            ", principal point {principal_point} of the film's size from its centre, f_y/f_x {pixel_aspect}"
        );
    }
    if let Some(Lens { radius, focus_distance }) = lens {
        let _ = write!(text, ", a lens of radius {radius} in focus at {focus_distance}");
    }
    let hidden = if d.hide_emitters { "; emitters are hidden" } else { "" };
    let _ = writeln!(text, "; path length {depth}{hidden}");
}

fn shapes(text: &mut String, d: &Description) {
    let triangles: usize = d.shapes.iter().map(|s| s.mesh.triangles().len()).sum();
    let _ = writeln!(text, "shapes: {}, {triangles} triangles", d.shapes.len());
    for shape in &d.shapes {
        let (mesh, material) = (&shape.mesh, &d.materials[shape.material].id);
        let (vertices, triangles) = (mesh.sources().len(), mesh.triangles().len());
        let _ = write!(text, "  `{}`: {vertices} vertices, {triangles} triangles, `{material}`", shape.id);
        let positions = || mesh.positions().iter().copied();
        if let (Some(low), Some(high)) = (positions().reduce(DVec3::min), positions().reduce(DVec3::max)) {
            let _ = write!(text, ", from {low:.4} to {high:.4}");
        }
        if let Some(radiance) = shape.radiance {
            let _ = write!(text, ", emits {radiance}");
        }
        text.push('\n');
    }
}

/// Instances and groups, whose members move together.
fn instances(text: &mut String, d: &Description) {
    if !d.instances.is_empty() {
        let _ = writeln!(text, "instances and groups, whose members move together: {}", d.instances.len());
    }
    for instances in &d.instances {
        let shapes = instances.shapes.iter().map(|&shape| &d.shapes[shape].id);
        let implicits = instances.implicits.iter().map(|&implicit| &d.implicits[implicit].id);
        let members: Vec<String> = shapes.chain(implicits).map(|id| format!("`{id}`")).collect();
        let _ = writeln!(text, "  `{}`: {}", instances.id, members.join(", "));
    }
}

/// Implicit surfaces with their representation.
fn implicits(text: &mut String, d: &Description) {
    if !d.implicits.is_empty() {
        let _ = writeln!(text, "implicit surfaces: {}", d.implicits.len());
    }
    for shape in &d.implicits {
        let (surface, material) = (&shape.surface, &d.materials[shape.material].id);
        let grid = |grid: &Grid| {
            let [nx, ny, nz] = grid.size();
            format!("{nx} × {ny} × {nz} nodes, {}", format!("{:?}", grid.interpolation()).to_lowercase())
        };
        let made = if let Some(own) = surface.downcast() {
            grid(own)
        } else if let Some(baked) = surface.downcast::<Baked>() {
            format!("network of {} weights, on {}", surface.dimension(), grid(baked.grid()))
        } else if let Some(guided) = surface.downcast::<Guided>() {
            format!("network of {} weights, traced with {}", surface.dimension(), grid(guided.baked().grid()))
        } else {
            format!("{} parameters", surface.dimension())
        };
        let _ =
            write!(text, "  `{}`: {made}, `{material}`, slopes up to {:.3}", shape.id, surface.slope_bound());
        let _ = match shape.bounds() {
            Some((low, high)) => writeln!(text, ", in a box from {low:.4} to {high:.4}"),
            None => writeln!(text, ", without a box"),
        };
    }
}

fn materials(text: &mut String, d: &Description) {
    let _ = writeln!(text, "materials: {}", d.materials.len());
    for (index, material) in d.materials.iter().enumerate() {
        let model = material.bsdf.name();
        let others: Vec<String> = d
            .aliases
            .iter()
            .filter(|alias| alias.material == index)
            .map(|alias| format!("`{}`", alias.id))
            .collect();
        let also = if others.is_empty() { String::new() } else { format!(", also {}", others.join(", ")) };
        let roughness =
            material.bsdf.roughness().map_or(String::new(), |alpha| format!(", roughness {alpha}"));
        let reflectance = match material.bsdf.reflectance() {
            Reflectance::Constant(c) => format!("reflectance {c}"),
            Reflectance::Texture(t) => {
                let texture = &d.textures[*t];
                format!("texture `{}` of {} × {}", texture.id, texture.width, texture.height)
            }
        };
        let sides = if material.two_sided { "" } else { ", one side" };
        let other = |role: &str, index: Option<usize>| {
            index.map_or(String::new(), |index| format!(", {role} `{}`", d.materials[index].id))
        };
        let mixed = other("mixed with", material.blend.map(|blend| blend.other));
        let back = other("on its back", material.back);
        let _ = writeln!(
            text,
            "  `{}`: {model}{roughness}, {reflectance}{sides}{mixed}{back}{also}",
            material.id
        );
    }
}

fn media(text: &mut String, d: &Description) {
    if !d.media.is_empty() {
        let _ = writeln!(text, "media: {}, supported by images and finite differences only", d.media.len());
    }
    for Medium { id, extinction, albedo, asymmetry } in &d.media {
        let _ = writeln!(text, "  `{id}`: extinction {extinction}, albedo {albedo}, mean cosine {asymmetry}");
    }
}

fn lights(text: &mut String, d: &Description) {
    let emitters = d.shapes.iter().filter(|s| s.radiance.is_some()).count();
    let count = emitters + d.lights.len() + usize::from(d.environment.is_some());
    let _ = writeln!(text, "emitters: {count}, {emitters} of them shapes");
    for light in &d.lights {
        let _ = match light {
            Light::Point { id, position, intensity } => {
                writeln!(text, "  `{id}`: point at {position}, intensity {intensity}")
            }
            Light::Spot { id, position, intensity, cutoff, .. } => {
                writeln!(text, "  `{id}`: spot at {position}, intensity {intensity}, cutoff {cutoff} rad")
            }
            Light::Projector { id, position, intensity, field_of_view, .. } => {
                writeln!(
                    text,
                    "  `{id}`: projector at {position}, irradiance {intensity}, over {field_of_view} rad"
                )
            }
            Light::Directional { id, direction, irradiance, kappa } => {
                writeln!(text, "  `{id}`: along {direction}, irradiance {irradiance}, kappa {kappa}")
            }
        };
    }
    let _ = match &d.environment {
        Some(Environment::Constant { id, radiance }) => {
            writeln!(text, "  `{id}`: constant environment, radiance {radiance}")
        }
        Some(Environment::Map { id, texture, scale, .. }) => {
            let map = &d.textures[*texture];
            writeln!(text, "  `{id}`: environment map of {} × {}, scale {scale}", map.width, map.height)
        }
        None => Ok(()),
    };
}

/// The curves in which surfaces intersect. Derivatives follow them like edges.
fn crossings(text: &mut String, scene: &Scene) {
    let counts = scene.crossing_shapes();
    if counts.is_empty() {
        return;
    }
    let segments: usize = counts.iter().map(|c| c.segments).sum();
    let pieces = |n: usize| if n == 1 { "1 segment".to_owned() } else { format!("{n} segments") };
    let _ = writeln!(text, "crossings: {}, followed like edges", pieces(segments));
    for count in counts {
        let [a, b] = count.shapes.map(|s| &scene.description().shapes[s].id);
        let with = if count.shapes[0] == count.shapes[1] { "itself".to_owned() } else { format!("`{b}`") };
        let _ = writeln!(text, "  `{a}` passes through {with} in {}", pieces(count.segments));
    }
}

/// The findings of `lint`, without advice.
fn findings(text: &mut String, scene: &Scene) {
    let found = lint::lint(scene);
    let count = if found.is_empty() { "none".to_owned() } else { found.len().to_string() };
    let _ = writeln!(
        text,
        "findings: {count}{}",
        if found.is_empty() { "" } else { "; see `volume3d lint` for advice" }
    );
    for finding in found {
        let _ = writeln!(text, "  {}", finding.message);
    }
}
