//! Colours that come with a mesh: a material a triangle, with textures.

use std::sync::Arc;

use glam::{Vec2, Vec3};

mod texture;

pub use texture::{Texture, Wrap};

/// What the triangles of a mesh are made of.
#[derive(Debug, PartialEq)]
pub struct Materials {
    of_triangle: Vec<u32>,
    uv: Vec<[Vec2; 3]>,
    list: Vec<Material>,
}

/// A diffuse material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Linear RGB reflectance, a factor of the texture's.
    pub color: Vec3,
    /// By the triangles' texture coordinates.
    pub texture: Option<Arc<Texture>>,
}

impl Materials {
    /// `of_triangle`: for each triangle, which of `list` it has; `uv`: the texture coordinates of each triangle's corners,
    /// from the picture's upper left corner, or empty if there are none.
    ///
    /// # Panics
    /// If a triangle names no material, or the lists differ in length.
    pub fn new(of_triangle: Vec<u32>, uv: Vec<[Vec2; 3]>, list: Vec<Material>) -> Self {
        assert!(of_triangle.iter().all(|&m| (m as usize) < list.len()), "a material that is none");
        assert!(uv.is_empty() || uv.len() == of_triangle.len(), "coordinates for each triangle");
        Self { of_triangle, uv, list }
    }

    /// All of them.
    pub fn list(&self) -> &[Material] {
        &self.list
    }

    /// What it was made of.
    #[cfg(feature = "cli")]
    pub(super) fn parts(&self) -> (Vec<u32>, Vec<[Vec2; 3]>, Vec<Material>) {
        (self.of_triangle.clone(), self.uv.clone(), self.list.clone())
    }

    /// Colour at a point of a triangle; `texels`: radius over which a texture is averaged, in its finest texels.
    pub fn color(&self, triangle: usize, weights: [f32; 3], texels: f32) -> Vec3 {
        let material = &self.list[self.of_triangle[triangle] as usize];
        let (Some(texture), Some(uv)) = (&material.texture, self.uv.get(triangle)) else {
            return material.color;
        };
        let at = uv[0] * weights[0] + uv[1] * weights[1] + uv[2] * weights[2];
        material.color * texture.color(at, texels)
    }

    /// Radius in texels of a disk as large as the parallelogram that a point of a triangle spans with two others.
    pub fn texels_across(&self, triangle: usize, here: [f32; 3], others: [[f32; 3]; 2]) -> f32 {
        let material = &self.list[self.of_triangle[triangle] as usize];
        let (Some(texture), Some(uv)) = (&material.texture, self.uv.get(triangle)) else {
            return 0.0;
        };
        let at = |w: [f32; 3]| (uv[0] * w[0] + uv[1] * w[1] + uv[2] * w[2]) * texture.size();
        let [right, below] = others.map(|other| at(other) - at(here));
        (right.perp_dot(below).abs() * std::f32::consts::FRAC_1_PI).sqrt()
    }

    /// Texels of a triangle's texture a unit of length, in the mean over its directions; 0 without a texture.
    pub fn texels_per_length(&self, triangle: usize, [a, b, c]: [Vec3; 3]) -> f32 {
        let material = &self.list[self.of_triangle[triangle] as usize];
        let (Some(texture), Some(uv)) = (&material.texture, self.uv.get(triangle)) else {
            return 0.0;
        };
        let scale = texture.size();
        let (u, v) = ((uv[1] - uv[0]) * scale, (uv[2] - uv[0]) * scale);
        let area = (b - a).cross(c - a).length();
        let density = (u.perp_dot(v).abs() / area).sqrt();
        if density.is_finite() { density } else { 0.0 }
    }
}

#[cfg(test)]
mod tests;
