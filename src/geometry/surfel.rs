//! Surface point samples as a structure of arrays.

use glam::Vec3;

/// Readable elements behind the last surfel, so that a vector load never leaves the arrays.
pub const PADDING: usize = 32;

/// Surfels (surface point samples) in the local space of their object, as a structure of arrays.
#[derive(Clone, Debug, Default)]
pub struct Surfels {
    /// Coordinates; each of these three has [`PADDING`] elements more than there are surfels.
    pub x: Vec<f32>,
    /// See `x`.
    pub y: Vec<f32>,
    /// See `x`.
    pub z: Vec<f32>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Linear RGB reflectance, 0 to 1.
    pub albedo: Vec<Vec3>,
    /// Linear RGB radiance as shaded; not in 0 to 1 in general.
    pub radiance: Vec<Vec3>,
    /// Radius of the disk that the surfel stands for, local units. [`PADDING`] elements more in a prepared scene.
    pub extent: Vec<f32>,
}

impl Surfels {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }

    /// Position of surfel `i`, local space.
    pub fn position(&self, i: usize) -> Vec3 {
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }
}
