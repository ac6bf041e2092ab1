//! What a ray meets that meets nothing else.

pub mod image;
mod resample;

use glam::Vec3;

use super::description::{Environment, Light};
use crate::geometry::lanes::gather::Gather;
use crate::geometry::lanes::{Real, dot_const};

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
        self.radiance_in(direction.to_array(), light).into()
    }

    /// [`Self::radiance`], in lanes.
    #[inline(always)]
    pub fn radiance_in<R: Gather>(&self, direction: [R; 3], light: &Light) -> [R; 3] {
        let height = direction[1];
        let (zenith, horizon, ground) = match self {
            Self::Constant(Vec3 { x, y, z }) => {
                return [height.splat(*x), height.splat(*y), height.splat(*z)];
            }
            Self::Sky { zenith, horizon, ground } => (zenith, horizon, ground),
            Self::Image(image) => return image.radiance_in(direction),
        };
        let (zero, one) = (height.splat(0.0), height.splat(1.0));
        let above = smooth_step(-HORIZON_BLUR, HORIZON_BLUR, height);

        // Air: the horizon's colour where the line of sight through it is long.
        let air = one - height.max(zero).min(one);
        let air2 = air * air;
        let air = air * (air2 * air * 0.85 + 0.15);

        // The ground gets darker towards the feet and takes the colour of the air far away.
        let down = one - (-height).max(zero).min(one);
        let down2 = down * down;
        let down4 = down2 * down2;
        let far = down4 * down4 * down4 * 0.6;
        let feet = down2 * 0.4 + 0.6;

        let sun = sun(direction, light);
        let mut radiance = [zero; 3];
        for (k, radiance) in radiance.iter_mut().enumerate() {
            let far_away = height.splat(horizon[k]);
            let sky = mix(height.splat(zenith[k]), far_away, air) + sun * light.sun[k];
            *radiance = mix(mix(feet * ground[k], far_away, far), sky, above);
        }
        radiance
    }
}

#[inline(always)]
fn mix<R: Real>(from: R, to: R, share: R) -> R {
    from + (to - from) * share
}

/// The sun's disc and the glow about it, which has the colour of the sun.
#[inline(always)]
fn sun<R: Real<Scalar = f32>>(direction: [R; 3], light: &Light) -> R {
    let facing = dot_const(direction, light.to_sun.to_array());
    let facing = facing.max(facing.splat(0.0));
    let p2 = facing * facing;
    let p4 = p2 * p2;
    let p8 = p4 * p4;
    let p16 = p8 * p8;
    let p32 = p16 * p16;
    let p64 = p32 * p32;
    let p128 = p64 * p64;
    let p256 = p128 * p128;
    let p512 = p256 * p256;
    let p1024 = p512 * p512;
    let p2048 = p1024 * p1024;
    let glow = p8 * 0.03 + p32 * 0.08 + p128 * 0.15 + p512 * 0.3 + p2048 * 0.8;
    glow + smooth_step(SUN_EDGE[0], SUN_EDGE[1], facing) * SUN_DISC
}

/// 0 below `from`, 1 above `to`, smooth between.
#[inline(always)]
fn smooth_step<R: Real<Scalar = f32>>(from: f32, to: f32, x: R) -> R {
    let t = ((x - from) * (1.0 / (to - from))).max(x.splat(0.0)).min(x.splat(1.0));
    t * t * (x.splat(3.0) - t * 2.0)
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
