//! Rigid motion with a uniform scale, in f64 so that far-away scenes lose nothing.

use glam::{DQuat, DVec3};

/// `x ↦ rotation · (scale · x) + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// In the target space.
    pub translation: DVec3,
    /// Positive.
    pub scale: f64,
}

impl Default for Similarity {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Similarity {
    /// Changes nothing.
    pub const IDENTITY: Self =
        Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO, scale: 1.0 };

    /// Maps a point.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * (p * self.scale) + self.translation
    }

    /// Rotates a direction; its length stays.
    pub fn direction(&self, d: DVec3) -> DVec3 {
        self.rotation * d
    }

    /// Maps a point back.
    pub fn inverse_point(&self, p: DVec3) -> DVec3 {
        self.rotation.conjugate() * (p - self.translation) / self.scale
    }

    /// Rotates a direction back; its length stays.
    pub fn inverse_direction(&self, d: DVec3) -> DVec3 {
        self.rotation.conjugate() * d
    }

    /// Undoes it.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        let scale = self.scale.recip();
        Self { rotation, translation: rotation * (self.translation * -scale), scale }
    }

    /// First `self`, then `next`.
    #[must_use]
    pub fn then(&self, next: &Self) -> Self {
        Self {
            rotation: (next.rotation * self.rotation).normalize(),
            translation: next.point(self.translation),
            scale: next.scale * self.scale,
        }
    }
}
