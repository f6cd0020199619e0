//! Tests of environment maps: sampling density, the layout of the file format, and the variance of the
//! sampled light.

use flatland::calculus::Vec3;
use flatland::random::{open01, stream};
use glam::{DAffine2, DMat3};

use super::*;
use crate::path::environment::distant;
use crate::path::lights::LightId;
use crate::path::plain::Plain;
use crate::scene::{Camera, Description, Environment, Film, Filter, Wrap};

fn map(width: usize, texels: Vec<f64>) -> Scene {
    let camera = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, 0.8);
    let film = Film { width: 2, height: 2, crop: None, sample_border: true, filter: Filter::Box };
    let mut d = Description::new(camera, film);
    let (id, height) = ("sky".to_owned(), texels.len() / width);
    let texels = texels.into_iter().map(DVec3::splat).collect();
    let to_uv = DAffine2::IDENTITY;
    let texture = d.add_texture(Texture { id: id.clone(), width, height, texels, wrap: Wrap::Repeat, to_uv });
    d.environment = Some(Environment::Map { id, texture, scale: 2.0, to_world: DMat3::IDENTITY });
    Scene::new(d).unwrap()
}

/// Maps of one and of many texels, with suns, dark rows and a bright pole.
fn maps() -> Vec<(usize, Vec<f64>)> {
    let mut sun = vec![0.0; 16 * 32];
    sun[3 * 32 + 31] = 5.0;
    let mut pole = vec![0.0; 8 * 4];
    pole[..4].fill(1.0);
    pole[30] = 3.0;
    vec![
        (1, vec![0.7]),
        (2, vec![0.0, 3.0]),
        (1, vec![0.0, 1.0, 0.0]),
        (3, (0..15).map(|i| f64::from(i * i % 7)).collect()),
        (32, sun),
        (4, pole),
        (4, vec![0.0; 12]),
    ]
}

fn direction(u: f64, v: f64) -> DVec3 {
    let ((sin, cos), (across, up)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
    DVec3::new(across * sin, up, -across * cos)
}

fn radiance(scene: &Scene, direction: DVec3) -> f64 {
    distant(scene, &Plain { scene }, LightId::Environment, Vec3::constant(direction)).value().x
}

/// Column i at u = (i + ½)/w, row j at v = j/(h − 1), and the midpoints between columns, across the seam too.
#[test]
fn texels_are_where_the_format_has_them() {
    for (width, texels) in maps() {
        let (scene, height) = (map(width, texels.clone()), texels.len() / width);
        for (k, texel) in texels.iter().enumerate() {
            let (i, j) = (k % width, k / width);
            let at = |along: f64, down: f64| {
                let rows = (height - 1).max(1) as f64;
                radiance(&scene, direction((i as f64 + 0.5 + along) / width as f64, (j as f64 + down) / rows))
            };
            // Slightly off the poles, where all columns meet.
            let down = if j == 0 {
                1e-9
            } else if j + 1 == height {
                -1e-9
            } else {
                0.0
            };
            assert!((at(0.0, down) - 2.0 * texel).abs() < 1e-6, "{width} {i} {j}");
            let next = texels[j * width + (i + 1) % width];
            assert!((at(0.5, down) - texel - next).abs() < 1e-6, "{width} {i} {j}");
        }
    }
}

/// The density of a direction equals the one it was sampled with, its integral is 1, and means over samples
/// are integrals of the map's radiance times 1 and times each coordinate.
#[test]
fn directions_have_the_stated_density() {
    const SAMPLES: usize = 40_000;
    for (case, (width, texels)) in maps().into_iter().enumerate() {
        let scene = map(width, texels);
        let (texture, sampler) = (&scene.description.textures[0], MapSampler::new(&scene, 0));
        let mut rng = stream(case as u64, &[]);
        let (mut sums, mut squares) = ([0.0; 4], [0.0; 4]);
        for _ in 0..SAMPLES {
            let (way, density) = sampler.sample(texture, [(); 3].map(|()| open01(&mut rng)));
            assert!((way.length() - 1.0).abs() < 1e-12);
            let again = sampler.density(texture, way);
            assert!((again - density).abs() <= 1e-6 * density, "{case}: {way} {density} {again}");
            let light = radiance(&scene, way);
            for (k, f) in [light, light * way.x, light * way.y, light * way.z].into_iter().enumerate() {
                sums[k] += f / density;
                squares[k] += (f / density).powi(2);
            }
        }
        // Midpoints of a grid that contains the borders of all patches.
        let (rows, columns) = (1680, 768);
        let (mut whole, mut exact) = (0.0, [0.0; 4]);
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let v = (f64::from(j) + 0.5) / f64::from(rows);
            let way = direction((f64::from(i) + 0.5) / f64::from(columns), v);
            let cell = TAU * PI * (PI * v).sin() / f64::from(rows * columns);
            whole += cell * sampler.density(texture, way);
            let light = radiance(&scene, way);
            for (k, f) in [light, light * way.x, light * way.y, light * way.z].into_iter().enumerate() {
                exact[k] += cell * f;
            }
        }
        assert!((whole - 1.0).abs() < 1e-4, "{case}: {whole}");
        for k in 0..4 {
            let n = SAMPLES as f64;
            let mean = sums[k] / n;
            let error = ((squares[k] / n - mean * mean).max(0.0) / n).sqrt();
            println!("{case} {k}: {mean} ± {error}, exactly {}", exact[k]);
            assert!((mean - exact[k]).abs() <= 5.0 * error + 1e-3 * exact[0], "{case} {k}");
            assert!(error < 0.02 * exact[0].max(1e-9), "{case} {k}: {error}");
        }
    }
}

/// The variance is due to the uniform part of the density alone: one sample of a map's total radiance has a
/// variance of a few hundredths of its square. A density that is constant around texels has a variance of 3
/// for a sun of one texel.
#[test]
fn the_light_of_a_map_is_drawn_evenly() {
    for (case, (width, texels)) in maps().into_iter().enumerate().filter(|(case, _)| *case < 6) {
        let scene = map(width, texels);
        let (texture, sampler) = (&scene.description.textures[0], MapSampler::new(&scene, 0));
        let mut rng = stream(case as u64, &[]);
        let (n, mut sum, mut squares) = (20_000, 0.0, 0.0);
        for _ in 0..n {
            let (way, density) = sampler.sample(texture, [(); 3].map(|()| open01(&mut rng)));
            let light = radiance(&scene, way) / density;
            sum += light;
            squares += light * light;
        }
        let variance = squares * f64::from(n) / (sum * sum) - 1.0;
        println!("{case}: {variance}");
        // On large patches the cosine of the angle is not linear in the angle.
        assert!(variance < if width < 4 { 0.3 } else { 0.08 }, "{case}: {variance}");
    }
}
