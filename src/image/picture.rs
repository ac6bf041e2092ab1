//! A finished picture.

use super::Planes;

/// Linear RGB (sRGB primaries), row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width`·`height` colours; not limited to 0 to 1.
    pub rgb: Vec<[f32; 3]>,
}

impl Picture {
    /// A black picture.
    pub fn black(width: u32, height: u32) -> Self {
        Self { width, height, rgb: vec![[0.0; 3]; width as usize * height as usize] }
    }
}

impl From<&Planes> for Picture {
    /// The reflection.
    fn from(planes: &Planes) -> Self {
        Self { width: planes.width, height: planes.height, rgb: planes.radiance.clone() }
    }
}
