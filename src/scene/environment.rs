//! What a ray meets that meets nothing else.

use glam::Vec3;

use super::description::{Environment, Light};

/// Half the height of the band in which the sky turns into the ground, as y of a unit direction.
pub(crate) const HORIZON_BLUR: f32 = 0.015;

/// Cosines of the angles (1.6° and 1.2°) between which the sun's disc fades in. Three times as wide as the real
/// one, so that its reflection in a curved mirror still covers a pixel.
pub(crate) const SUN_EDGE: [f32; 2] = [0.999_61, 0.999_78];

/// Radiance of the disc in units of the sun's irradiance. The real ratio, 15,000, would only make noise.
pub(crate) const SUN_DISC: f32 = 60.0;

impl Environment {
    /// Radiance (linear RGB, unbounded) from a unit `direction` in world axes; +y is up.
    ///
    /// Free of trigonometry, so that a shader can do the same.
    pub fn radiance(&self, direction: Vec3, light: &Light) -> Vec3 {
        let (zenith, horizon, ground) = match *self {
            Self::Constant(radiance) => return radiance,
            Self::Sky { zenith, horizon, ground } => (zenith, horizon, ground),
        };
        let height = direction.y;
        let above = smooth_step(-HORIZON_BLUR, HORIZON_BLUR, height);

        // Air: the horizon's colour where the line of sight through it is long.
        let air = 1.0 - height.clamp(0.0, 1.0);
        let air2 = air * air;
        let sky = zenith.lerp(horizon, air * (0.15 + 0.85 * air2 * air));

        // The ground gets darker towards the feet and takes the colour of the air far away.
        let down = 1.0 - (-height).clamp(0.0, 1.0);
        let down2 = down * down;
        let down4 = down2 * down2;
        let far = down4 * down4 * down4;
        let land = (ground * (0.6 + 0.4 * down2)).lerp(horizon, 0.6 * far);

        land.lerp(sky + sun(direction, light), above)
    }
}

/// The sun's disc and the glow about it, which has the colour of the sun.
fn sun(direction: Vec3, light: &Light) -> Vec3 {
    let facing = direction.dot(light.to_sun).max(0.0);
    let p2 = facing * facing;
    let p4 = p2 * p2;
    let p8 = p4 * p4;
    let p32 = p8 * p8 * p8 * p8;
    let p128 = p32 * p32 * p32 * p32;
    let p512 = p128 * p128 * p128 * p128;
    let p2048 = p512 * p512 * p512 * p512;
    let glow = 0.03 * p8 + 0.08 * p32 + 0.15 * p128 + 0.3 * p512 + 0.8 * p2048;
    light.sun * (glow + SUN_DISC * smooth_step(SUN_EDGE[0], SUN_EDGE[1], facing))
}

/// 0 below `from`, 1 above `to`, smooth between.
fn smooth_step(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKY: Environment = Environment::Sky {
        zenith: Vec3::new(0.1, 0.25, 0.7),
        horizon: Vec3::new(0.7, 0.8, 0.95),
        ground: Vec3::new(0.25, 0.22, 0.2),
    };

    fn light() -> Light {
        let to_sun = Vec3::new(0.6, 0.64, 0.48);
        Light { to_sun, sun: Vec3::new(3.0, 2.8, 2.5), ambient: Vec3::ONE }
    }

    #[test]
    fn constant_is_constant() {
        let constant = Environment::Constant(Vec3::new(0.1, 0.2, 0.3));
        for direction in [Vec3::Y, Vec3::NEG_Y, light().to_sun] {
            assert_eq!(constant.radiance(direction, &light()), Vec3::new(0.1, 0.2, 0.3));
        }
    }

    #[test]
    fn the_sky_is_smooth_and_only_the_sun_is_brighter_than_white() {
        let light = light();
        let across = Vec3::new(-0.8, 0.0, 0.6);
        let mut last: Option<Vec3> = None;
        for step in 0..=20_000 {
            let angle = std::f32::consts::PI * (step as f32 / 20_000.0 - 0.5);
            let radiance = SKY.radiance(across * angle.cos() + Vec3::Y * angle.sin(), &light);
            assert!(radiance.min_element() >= 0.0 && radiance.max_element() < 1.2, "{radiance}");
            if let Some(last) = last {
                assert!(radiance.distance(last) < 0.01, "jump at {angle}");
            }
            last = Some(radiance);
        }
        let sun = SKY.radiance(light.to_sun, &light);
        assert!(sun.min_element() > 50.0);
        let mirrored = SKY.radiance(light.to_sun * Vec3::new(1.0, -1.0, 1.0), &light);
        assert!(mirrored.max_element() < 1.0, "no sun under the ground");
        let low = Light { to_sun: Vec3::new(0.8, -0.6, 0.0), ..light };
        assert!(SKY.radiance(low.to_sun, &low).max_element() < 1.0, "a sun that has set");
    }
}
