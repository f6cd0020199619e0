//! The views of a fit, with their targets.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use glam::DVec3;
use rand::Rng as _;
use volume3d::Image;
use volume3d::gradient::render;
use volume3d::io::dtu::Folder;
use volume3d::io::views::Views;
use volume3d::io::{Encoding, covered, load_image, load_image_over, read_npy};
use volume3d::optimize::View;
use volume3d::scene::{Camera, Environment, Film, Scene, TraceCounts};

use super::super::file_kind::check_there;
use super::super::output::colour;
use super::super::session::{Bar, Loaded, check_size, located, lost, say, silent};
use super::super::signals::is_stop;
use super::config::{Config, DtuConfig, EncodingConfig, PhotographsConfig, ViewConfig, definitions};

/// All views with their targets, and the files that were read. Several views have their own cameras.
pub(super) fn views(config: &Config, scene: &Scene) -> anyhow::Result<(Vec<View>, Vec<PathBuf>)> {
    if let Some(dtu) = &config.dtu {
        return dtu_views(config, dtu, scene);
    }
    if let Some(photographs) = &config.photographs {
        return posed_views(config, photographs, scene);
    }
    let one = [ViewConfig::default()];
    let asked = if config.views.is_empty() { &one[..] } else { &config.views };
    let mut reference =
        config.reference.as_ref().map(|r| Loaded::read(&r.scene, &definitions(&r.define))).transpose()?;
    reference.iter().for_each(Loaded::say_deviations);
    let mut files = reference.as_ref().map(|r| r.files.clone()).unwrap_or_default();
    let background = config.background.map_or_else(|| sky(scene), DVec3::from_array);
    let mut views: Vec<View> = vec![];
    let bar = Bar::new(asked.len(), "render targets");
    let mut traced = (TraceCounts::default(), 0);
    for (i, view) in asked.iter().enumerate() {
        let name = view.name.clone().unwrap_or_else(|| format!("{}", i + 1));
        if let Some(other) = views.iter().position(|v| v.name == name) {
            bail!("views {} and {} are both called `{name}`", other + 1, i + 1);
        }
        let (camera, film) = (camera(view, scene, &name)?, film(view, scene));
        // A single view may use the scene's camera, so that this can be fitted.
        let is_own = asked.len() == 1 && view.origin.is_none() && view.fov.is_none();
        let camera = (!is_own).then_some(camera);
        check_size(Path::new(&format!("view `{name}`")), (film.width, film.height))?;
        let target = match (&view.target, &mut reference) {
            (Some(path), _) => {
                files.push(path.clone());
                check_there(path, &format!("view `{name}`: target"))?;
                picture(path, view, background, &film, &name)?
            }
            (None, Some(reference)) => {
                let samples = config.reference.as_ref().map_or(1, |r| r.spp);
                let target = rendered(
                    &mut reference.scene,
                    camera.as_ref(),
                    film,
                    samples,
                    seed(config, i),
                    &mut traced,
                );
                target.map_err(|e| if is_stop(&e) { e } else { anyhow!("view `{name}`: {e}") })?
            }
            (None, None) => bail!("view `{name}` has no target: target = \"photo.png\""),
        };
        let weights = view.weights.as_ref().map(|path| {
            files.push(path.clone());
            check_there(path, &format!("view `{name}`: weights"))?;
            let weights = load_image(path, true)?;
            check_picture(&weights, path, &film, &name)?;
            Ok::<_, anyhow::Error>(weights)
        });
        let mask = view.mask.as_ref().map(|path| {
            files.push(path.clone());
            check_there(path, &format!("view `{name}`: mask"))?;
            let mask = load_image(path, true)?;
            check_picture(&mask, path, &film, &name)?;
            let mask = covered(&mask);
            say_of_mask(&mask, &name);
            Ok::<_, anyhow::Error>(mask)
        });
        let (weights, mask) = (weights.transpose()?, mask.transpose()?);
        views.push(View { name, camera, film, target, weights, mask });
        bar.step();
    }
    drop(bar);
    say(&lost(traced.0, traced.1));
    Ok((views, files))
}

/// The views of files of other programs, with the filter of the scene.
fn posed_views(
    config: &Config,
    asked: &PhotographsConfig,
    scene: &Scene,
) -> anyhow::Result<(Vec<View>, Vec<PathBuf>)> {
    let PhotographsConfig { cameras, images, size, views } = asked;
    let Views { list, mut files } = if !cameras.is_dir() {
        if images.is_some() {
            bail!("[photographs]: images is for the folder of a COLMAP model, and cameras names a file");
        }
        check_there(cameras, "[photographs]: cameras")?;
        Views::from_transforms(cameras)?
    } else {
        Views::from_colmap(cameras, images.as_deref())?
    };
    let indices = views.clone().unwrap_or_else(|| (0..list.len()).collect());
    if indices.is_empty() {
        bail!("[photographs]: views = [] leaves no view");
    }
    let background = config.background.map_or_else(|| sky(scene), DVec3::from_array);
    let mut views: Vec<View> = vec![];
    let bar = Bar::new(indices.len(), "read photographs");
    for index in indices {
        let Some(view) = list.get(index) else {
            bail!("[photographs]: there is no view {index}; there are {}, from 0", list.len());
        };
        let name = view.name.clone();
        if views.iter().any(|view| view.name == name) {
            bail!("[photographs]: view {index} is asked for twice");
        }
        let view = match size {
            None => view.clone(),
            Some([width, height]) => view.clone().resized(*width, *height)?,
        };
        let (width, height) = (view.width, view.height);
        check_size(Path::new(&format!("view `{name}`")), (width, height))?;
        let film = Film { width, height, crop: None, ..scene.description().film };
        let (target, weights) = (view.load(background)?, view.load_weights()?);
        files.push(view.picture);
        files.extend(view.weights);
        views.push(View { name, camera: Some(view.camera), film, target, weights, mask: None });
        bar.step();
    }
    Ok((views, files))
}

/// The views of a DTU folder with its cameras, and the filter of the scene.
fn dtu_views(config: &Config, dtu: &DtuConfig, scene: &Scene) -> anyhow::Result<(Vec<View>, Vec<PathBuf>)> {
    let folder = Folder::open(&dtu.folder)?;
    let asked = dtu.views.clone().unwrap_or_else(|| (0..folder.len()).collect());
    if asked.is_empty() {
        bail!("[dtu]: views = [] leaves no view");
    }
    let background = config.background.map_or_else(|| sky(scene), DVec3::from_array);
    let (mut views, mut files): (Vec<View>, _) = (vec![], vec![folder.cameras()]);
    let bar = Bar::new(asked.len(), "read photographs");
    for index in asked {
        let photograph = folder.view(index)?;
        files.extend(folder.pictures(index).into_iter().flatten().map(Path::to_path_buf));
        let name = photograph.name.clone();
        if views.iter().any(|view| view.name == name) {
            bail!("[dtu]: view {index} is listed twice");
        }
        let camera = photograph.camera().map_err(|e| anyhow!("view `{name}`: {e}"))?;
        let (width, height) = photograph.image.size();
        check_size(Path::new(&format!("view `{name}`")), (width, height))?;
        let film = Film { width, height, crop: None, ..scene.description().film };
        let mut target = photograph.image;
        if dtu.cut {
            let outside = target.pixels.iter_mut().zip(&photograph.mask).filter(|(_, seen)| !**seen);
            outside.for_each(|(pixel, _)| *pixel = background);
        }
        let mask = config.masks.as_ref().map(|_| photograph.mask);
        if let Some(mask) = &mask {
            say_of_mask(mask, &name);
        }
        views.push(View { name, camera: Some(camera), film, target, weights: None, mask });
        bar.step();
    }
    Ok((views, files))
}

/// The seed of a target's random numbers, which nothing else uses.
fn seed(config: &Config, view: usize) -> u64 {
    const TARGET: u64 = 1 << 32;
    flatland::random::stream(config.seed, &[TARGET, view as u64]).next_u64()
}

/// The radiance of a constant environment; black for others.
fn sky(scene: &Scene) -> DVec3 {
    match &scene.description().environment {
        Some(Environment::Constant { radiance, .. }) => *radiance,
        _ => DVec3::ZERO,
    }
}

fn camera(view: &ViewConfig, scene: &Scene, name: &str) -> anyhow::Result<Camera> {
    let own = &scene.description().camera;
    if own.orthographic.is_some() && view.fov.is_some() {
        bail!("view `{name}`: fov is given, but the scene's camera is orthographic and has no field of view");
    }
    let fov = match view.fov {
        None => own.field_of_view,
        Some(degrees) if degrees > 0.0 && degrees < 180.0 => degrees.to_radians(),
        Some(degrees) => bail!("view `{name}`: fov is {degrees}, but must be between 0 and 180 degrees"),
    };
    let Some(origin) = view.origin.map(DVec3::from_array) else {
        return Ok(Camera { field_of_view: fov, ..own.clone() });
    };
    let target = view.look_at.map_or(DVec3::ZERO, DVec3::from_array);
    let up = view.up.map_or(DVec3::Y, DVec3::from_array);
    let (direction, finite) = (target - origin, origin.is_finite() && target.is_finite() && up.is_finite());
    if !finite || direction.cross(up).length() <= 1e-9 * direction.length() * up.length() {
        bail!(
            "view `{name}`: a camera at {origin} that looks at {target} with up {up} has no orientation: these must be \
             finite, the points different, and up not along the line between them"
        );
    }
    let camera = Camera::look_at(origin, target, up, fov);
    let Some(distance) = own.orthographic else { return Ok(camera) };
    // The given origin is the centre of the sensor.
    let Camera { right, up, forward, .. } = camera;
    Ok(Camera { origin: origin - distance * forward, right, up, forward, ..own.clone() })
}

fn film(view: &ViewConfig, scene: &Scene) -> Film {
    let film = scene.description().film;
    if view.width.is_none() && view.height.is_none() {
        return film;
    }
    let (width, height) = (view.width.unwrap_or(film.width), view.height.unwrap_or(film.height));
    Film { width, height, crop: None, ..film }
}

/// Warns about a mask without an outline of the shape.
fn say_of_mask(mask: &[bool], name: &str) {
    let covered = mask.iter().filter(|c| **c).count();
    if covered == 0 || covered == mask.len() {
        let what = if covered == 0 {
            "empty: it has no pixel of the shape"
        } else {
            "full: all its pixels are of the shape"
        };
        eprintln!("WARNING: the mask of view `{name}` is {what}");
    }
}

fn picture(
    path: &Path,
    view: &ViewConfig,
    background: DVec3,
    film: &Film,
    name: &str,
) -> anyhow::Result<Image> {
    let image = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
        if let Some(layer) = &view.layer {
            bail!("view `{name}`: layer = \"{layer}\" is given, but only OpenEXR images have layers");
        }
        let array = read_npy(path)?;
        let image = array.to_image().ok_or_else(|| {
            anyhow!(
                "{}: an array of shape {:?} is not a picture; expected height × width × 3, or height × width",
                path.display(),
                array.shape
            )
        })?;
        if let Some(i) = image.pixels.iter().position(|p| !p.is_finite()) {
            bail!("{}: column {}, row {} is not finite", path.display(), i % image.width, i / image.width);
        }
        image
    } else {
        let encoding = match view.encoding {
            None => Encoding::File,
            Some(EncodingConfig::Srgb) => Encoding::Srgb,
            Some(EncodingConfig::Linear) => Encoding::Linear,
        };
        load_image_over(path, background, encoding, view.layer.as_deref())?
    };
    check_picture(&image, path, film, name)?;
    Ok(image)
}

fn check_picture(image: &Image, path: &Path, film: &Film, name: &str) -> anyhow::Result<()> {
    let (width, height) = film.crop.map_or((film.width, film.height), |c| (c.width, c.height));
    if image.size() != (width, height) {
        let (w, h) = image.size();
        bail!(
            "{}: the picture is {w} × {h} pixels, but view `{name}` is {width} × {height}; resize it, or give the view \
             width = {w} and height = {h}",
            path.display()
        );
    }
    Ok(())
}

fn rendered(
    scene: &mut Scene,
    camera: Option<&Camera>,
    film: Film,
    samples: usize,
    seed: u64,
    (traces, traced): &mut (TraceCounts, usize),
) -> anyhow::Result<Image> {
    if let Some(camera) = camera {
        scene.set_camera(camera.clone())?;
    }
    scene.set_film(film)?;
    let rendering = render(scene, samples, seed, &silent())?;
    let (width, height) = rendering.image.size();
    say(&located(&rendering.non_finite));
    *traces += rendering.traces;
    *traced += samples * width * height;
    // The target is also written in single precision.
    let pixels = &rendering.image.pixels;
    if let Some(at) = pixels.iter().position(|p| !p.as_vec3().is_finite()) {
        bail!(
            "the target in column {}, row {} is {}, which exceeds the range of single precision, 3.4e38",
            at % width,
            at / width,
            colour(pixels[at])
        );
    }
    Ok(rendering.image)
}

/// The path of a view's picture in the folder of a run, without its extension.
pub(super) fn view_file(view: usize, what: &str) -> String {
    format!("views/{:03}-{what}", view + 1)
}
