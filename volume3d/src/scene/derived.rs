//! Cache of data derived from a scene's geometry, computed on demand and kept until the geometry changes.

use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// One value per type.
#[derive(Debug, Default)]
pub(super) struct Derived(Mutex<HashMap<TypeId, Arc<dyn Any + Send + Sync>>>);

impl Clone for Derived {
    /// Shares the values that are known so far.
    fn clone(&self) -> Self {
        Self(Mutex::new(self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()))
    }
}

impl Derived {
    /// Clears the cache.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// The value of a type, computed if absent.
    pub(super) fn get<T: Any + Send + Sync>(&self, make: impl FnOnce() -> T) -> Arc<T> {
        let kind = TypeId::of::<T>();
        // No insertion can panic midway: nothing is computed under the lock.
        let known = |values: &HashMap<TypeId, Arc<dyn Any + Send + Sync>>| {
            values.get(&kind).and_then(|value| Arc::clone(value).downcast::<T>().ok())
        };
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = known(&lock()) {
            return value;
        }
        // Not under the lock: the computation may use other threads, which may access the cache as well.
        let made = Arc::new(make());
        let mut values = lock();
        known(&values).unwrap_or_else(|| {
            values.insert(kind, made.clone());
            made
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::geometry::Mesh;
    use crate::scene::{Camera, Description, Film, Filter, Material, Scene};

    #[derive(Debug)]
    struct Corner(DVec3);

    /// Computed once, and again after a vertex moved or the topology changed.
    #[test]
    fn a_derived_value_follows_the_geometry() {
        let camera = Camera::look_at(DVec3::new(0.0, 3.0, 9.0), DVec3::ZERO, DVec3::Y, 0.9);
        let film = Film { width: 4, height: 4, crop: None, sample_border: true, filter: Filter::Box };
        let mut description = Description::new(camera.clone(), film);
        let clay = description.add_material(Material::diffuse("clay", DVec3::splat(0.5)));
        let shape = description.add_shape("floor", Mesh::rectangle(), clay);
        let mut scene = Scene::new(description).expect("a scene");
        let corner = |scene: &Scene| scene.derived(|scene| Corner(scene.positions[0])).0;
        let before = corner(&scene);
        assert_eq!(scene.derived::<Corner>(|_| panic!("made twice")).0, before);
        scene.set_camera(camera).expect("a camera");
        assert_eq!(scene.derived::<Corner>(|_| panic!("a camera moves no corner")).0, before);
        let moved: Vec<DVec3> = scene.positions.iter().map(|p| *p + DVec3::X).collect();
        let mesh = scene.description.shapes[shape].mesh.clone().with_positions(moved).expect("a mesh");
        scene.set_meshes([(shape, mesh)]).expect("a moved scene");
        assert_eq!(corner(&scene), before + DVec3::X);
        let cube = Mesh::cube();
        let first = cube.positions()[0];
        scene.set_meshes([(shape, cube)]).expect("another topology");
        assert_eq!(corner(&scene), first);
    }
}
