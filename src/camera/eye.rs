//! The eye: a pinhole with square pixels.

use glam::{DVec3, Vec2, Vec3};

/// Picture size in pixels, both at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl ImageSize {
    /// Number of pixels.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A pinhole camera in scene space. Pixel (0, 0) is at the top left; its centre is (0.5, 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Scene space.
    pub position: Vec3,
    /// Unit, to the right of the picture.
    pub right: Vec3,
    /// Unit, to the top of the picture.
    pub up: Vec3,
    /// Unit, into the picture.
    pub forward: Vec3,
    /// Focal length in pixels.
    pub focal_px: f32,
    /// Picture size.
    pub size: ImageSize,
}

impl Eye {
    /// Looks from `position` to `target` (scene space) with a vertical field of view in radians.
    ///
    /// Returns `None` if the two coincide, `up` is parallel to the view, the field of view is not between
    /// 0 and π, or something is not finite.
    #[expect(clippy::cast_possible_truncation, reason = "the eye is f32 by design")]
    pub fn new(
        position: DVec3,
        target: DVec3,
        up: DVec3,
        fov_y: f64,
        size: ImageSize,
    ) -> Option<Self> {
        let forward = (target - position).try_normalize()?;
        let right = forward.cross(up.try_normalize()?);
        if !(right.length() > 1e-6 && fov_y > 0.0 && fov_y < std::f64::consts::PI) {
            return None;
        }
        let right = right.try_normalize()?;
        let focal_px = 0.5 * f64::from(size.height) / (0.5 * fov_y).tan();
        Some(Self {
            position: position.as_vec3(),
            right: right.as_vec3(),
            up: right.cross(forward).as_vec3(),
            forward: forward.as_vec3(),
            focal_px: focal_px as f32,
            size,
        })
    }

    /// Homogeneous pixel coordinates (x·w, y·w, w) of a scene point, linear in it; w is its depth along
    /// `forward`. The picture position is (x·w, y·w)/w where w > 0.
    pub fn homogeneous_px(&self, point: Vec3) -> Vec3 {
        let p = point - self.position;
        let w = p.dot(self.forward);
        Vec3::new(
            self.focal_px * p.dot(self.right) + 0.5 * self.size.width as f32 * w,
            -self.focal_px * p.dot(self.up) + 0.5 * self.size.height as f32 * w,
            w,
        )
    }

    /// Picture position in pixels of a scene point in front of the eye.
    pub fn project_px(&self, point: Vec3) -> Option<Vec2> {
        let h = self.homogeneous_px(point);
        (h.z > 0.0).then(|| Vec2::new(h.x / h.z, h.y / h.z))
    }

    /// Direction (not unit: its component along `forward` is 1) of the view ray through a picture position.
    pub fn ray_through_px(&self, px: Vec2) -> Vec3 {
        self.forward + self.right * ((px.x - 0.5 * self.size.width as f32) / self.focal_px)
            - self.up * ((px.y - 0.5 * self.size.height as f32) / self.focal_px)
    }
}
