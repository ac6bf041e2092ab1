//! Linear light and its sRGB encoding (IEC 61966-2-1).

use std::sync::LazyLock;

/// Encodes linear light. Negative values lie on the linear piece; values above 1 are not clamped.
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes to linear light: the inverse of [`linear_to_srgb`].
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The 8-bit code whose encoded value is nearest; NaN gives 0, values outside 0 to 1 the ends.
pub fn linear_to_srgb8(linear: f32) -> u8 {
    CODES.nearest(linear)
}

/// [`linear_to_srgb8`] of each channel.
pub fn linear_to_srgb8_rgb(rgb: [f32; 3]) -> [u8; 3] {
    let codes = &*CODES;
    rgb.map(|linear| codes.nearest(linear))
}

/// Linear light of an 8-bit code.
pub fn srgb8_to_linear(code: u8) -> f32 {
    CODES.linear[code as usize]
}

/// Steps are at least 1/(255·12.92) apart, so a bin of 1/4096 holds at most one.
const BINS: usize = 4096;

struct Codes {
    /// Code at the lower end of each bin; the last is for 1 itself.
    first_in_bin: [u8; BINS + 1],
    /// From here on code + 1 is nearer than code; infinite for 255.
    steps: [f32; 256],
    linear: [f32; 256],
}

impl Codes {
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "0 to BINS; NaN gives 0")]
    fn nearest(&self, linear: f32) -> u8 {
        let linear = linear.clamp(0.0, 1.0);
        let code = self.first_in_bin[(linear * BINS as f32) as usize];
        // At most one step lies within a bin: one comparison decides.
        code + u8::from(linear >= self.steps[code as usize])
    }
}

static CODES: LazyLock<Codes> = LazyLock::new(|| {
    let steps: [f32; 256] = std::array::from_fn(|code| {
        if code == 255 { f32::INFINITY } else { decode((code as f64 + 0.5) / 255.0) }
    });
    let mut code = 0_u8;
    let first_in_bin = std::array::from_fn(|bin| {
        while bin as f32 / BINS as f32 >= steps[code as usize] {
            code += 1;
        }
        code
    });
    Codes { first_in_bin, steps, linear: std::array::from_fn(|code| decode(code as f64 / 255.0)) }
});

#[expect(clippy::cast_possible_truncation, reason = "rounded once, from f64")]
fn decode(encoded: f64) -> f32 {
    (if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) })
        as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_meets_known_values() {
        // Decoded by hand from the standard: the toe, middle grey (code 188 is 0.5029) and white.
        for (linear, encoded) in [(0.0, 0.0), (0.001, 0.01292), (0.5, 0.735_357), (1.0, 1.0)] {
            assert!((linear_to_srgb(linear) - encoded).abs() < 1e-6, "{linear}");
            assert!((srgb_to_linear(encoded) - linear).abs() < 1e-6, "{encoded}");
        }
    }

    #[test]
    fn eight_bits_are_the_nearest_code_everywhere() {
        let exact = |x: f32| {
            let x = f64::from(x);
            let encoded =
                if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            255.0 * encoded
        };
        let check = |x: f32| {
            let off = (f64::from(linear_to_srgb8(x)) - exact(x)).abs();
            // Half a code, and the 4e-5 codes by which the two pieces of the standard disagree.
            assert!(off < 0.5 + 1e-4, "{x}: {off}");
        };
        (0..=1_000_000).for_each(|i| check(i as f32 / 1e6));
        for code in 0..255 {
            let step = CODES.steps[code];
            assert_eq!(usize::from(linear_to_srgb8(step)), code + 1);
            assert_eq!(usize::from(linear_to_srgb8(step.next_down())), code);
        }
    }

    #[test]
    fn every_code_survives_and_the_rest_is_clamped() {
        for code in 0..=255 {
            assert_eq!(linear_to_srgb8(srgb8_to_linear(code)), code);
            let encoded = f32::from(code) / 255.0;
            assert!((srgb_to_linear(encoded) - srgb8_to_linear(code)).abs() < 1e-6, "{code}");
            assert!((linear_to_srgb(srgb_to_linear(encoded)) - encoded).abs() < 1e-6, "{code}");
        }
        assert_eq!(linear_to_srgb8(-1.0), 0);
        assert_eq!(linear_to_srgb8(f32::NAN), 0);
        assert_eq!(linear_to_srgb8(f32::INFINITY), 255);
    }
}
