//! LDR-FLIP: how strongly a person sees two pictures differ when flipping between them.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP: A Difference Evaluator for
//! Alternating Images, HPG 2020. Section numbers below are the paper's.

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;

use super::Picture;

/// Pixels a degree of visual angle: 3840 pixels on 0.7 m, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// Exponent of the colour difference (section 4.1).
const QC: f32 = 0.7;
/// Share of the largest colour difference below which it is mapped to 0..[`PT`] (section 4.1).
const PC: f32 = 0.4;
/// See [`PC`].
const PT: f32 = 0.95;
/// Width of the feature detectors, degrees (section 4.2).
const W: f32 = 0.082;

/// Terms a·sqrt(π/b)·exp(-π²r²/b) of the contrast sensitivity filters, r in degrees.
/// Those of b = 1e-5 have the weight 0.
const ACHROMATIC: (f32, f32) = (1.0, 0.0047);
const RED_GREEN: (f32, f32) = (1.0, 0.0053);
const BLUE_YELLOW: [(f32, f32); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// Columns are the CIE XYZ of the primaries of ITU-R BT.709 with white D65.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols_array(&[
    0.412_390_8,
    0.212_639,
    0.019_330_82,
    0.357_584_33,
    0.715_168_65,
    0.119_194_78,
    0.180_480_8,
    0.072_192_32,
    0.950_532_14,
]);

/// The FLIP map: 0 (equal) to 1 at every pixel. Colours are clamped to 0..1 first.
///
/// FLIP takes sRGB-encoded pictures and begins by decoding them; ours are linear already. It is
/// symmetric in its two pictures.
///
/// # Panics
/// If the pictures differ in size, have no pixels, or hold another number of them than they say.
pub fn flip(a: &Picture, b: &Picture) -> Vec<f32> {
    assert_eq!((a.width, a.height), (b.width, b.height), "FLIP needs pictures of one size");
    for picture in [a, b] {
        let pixels = picture.width as usize * picture.height as usize;
        assert!(pixels > 0 && picture.rgb.len() == pixels, "{} of {pixels}", picture.rgb.len());
    }
    let color = Color::new();
    let (a, b) = (Seen::new(a, &color), Seen::new(b, &color));
    (0..a.lab.len())
        .into_par_iter()
        .map(|i| {
            let by_color = color.redistribute(hyab(a.lab[i], b.lab[i]).powf(QC));
            let [edge, point] =
                std::array::from_fn(|k| (a.features[k][i] - b.features[k][i]).abs());
            // The exponent q_f is one half (section 4.2).
            let by_feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
            by_color.powf(1.0 - by_feature)
        })
        .collect()
}

/// What is compared of one picture.
struct Seen {
    /// CIELab after the contrast sensitivity filters, a and b adjusted by [`hunt`].
    lab: Vec<Vec3>,
    /// Strength of edges and of points.
    features: [Vec<f32>; 2],
}

impl Seen {
    fn new(picture: &Picture, color: &Color) -> Self {
        let width = picture.width as usize;
        // Opponent space YCxCz without its factors and offset: they cancel, as the filters are linear and sum to 1.
        let opponent: Vec<Vec3> = picture
            .rgb
            .par_iter()
            .map(|&rgb| {
                let xyz = color.xyz_from_rgb * Vec3::from(rgb).clamp(Vec3::ZERO, Vec3::ONE);
                Vec3::new(xyz.y, xyz.x - xyz.y, xyz.y - xyz.z)
            })
            .collect();
        let [y, cx, cz] =
            [0, 1, 2].map(|k| opponent.iter().map(|color| color[k]).collect::<Vec<f32>>());

        let filter = |plane: &[f32], (_, b): (f32, f32)| {
            let kernel = sensitivity_kernel(b).0;
            convolve(plane, width, &kernel, &kernel)
        };
        let y_seen = filter(&y, ACHROMATIC);
        let cx_seen = filter(&cx, RED_GREEN);
        let cz_parts = BLUE_YELLOW.map(|term| filter(&cz, term));
        let cz_weights = BLUE_YELLOW.map(|(a, b)| {
            let sum = sensitivity_kernel(b).1;
            a * (std::f32::consts::PI / b).sqrt() * sum * sum
        });
        let cz_share = cz_weights[0] / (cz_weights[0] + cz_weights[1]);

        let lab = (0..y.len())
            .into_par_iter()
            .map(|i| {
                let cz = cz_share * cz_parts[0][i] + (1.0 - cz_share) * cz_parts[1][i];
                let y = y_seen[i];
                let rgb = color.rgb_from_xyz * Vec3::new(y + cx_seen[i], y, y - cz);
                hunt(color.lab(rgb.clamp(Vec3::ZERO, Vec3::ONE)))
            })
            .collect();

        let [smooth, edge, point] = feature_kernels();
        let features = [edge, point].map(|derivative| {
            let across = convolve(&y, width, &derivative, &smooth);
            let down = convolve(&y, width, &smooth, &derivative);
            across.iter().zip(&down).map(|(&x, &y)| Vec2::new(x, y).length()).collect()
        });
        Self { lab, features }
    }
}

struct Color {
    /// XYZ relative to white: every row sums to 1.
    xyz_from_rgb: Mat3,
    rgb_from_xyz: Mat3,
    /// Largest colour difference: green against blue (section 4.1).
    largest: f32,
}

impl Color {
    fn new() -> Self {
        let white = XYZ_FROM_RGB * Vec3::ONE;
        let xyz_from_rgb = Mat3::from_diagonal(white.recip()) * XYZ_FROM_RGB;
        let mut color = Self { xyz_from_rgb, rgb_from_xyz: xyz_from_rgb.inverse(), largest: 0.0 };
        let [green, blue] = [Vec3::Y, Vec3::Z].map(|rgb| hunt(color.lab(rgb)));
        color.largest = hyab(green, blue).powf(QC);
        color
    }

    /// CIELab of a linear RGB colour.
    fn lab(&self, rgb: Vec3) -> Vec3 {
        const DELTA: f32 = 6.0 / 29.0;
        let f = (self.xyz_from_rgb * rgb).map(|t| {
            if t > DELTA * DELTA * DELTA {
                t.cbrt()
            } else {
                t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
            }
        });
        Vec3::new(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
    }

    /// Compresses the large colour differences: 0..`largest` to 0..1 in two linear pieces.
    fn redistribute(&self, difference: f32) -> f32 {
        let bend = PC * self.largest;
        if difference < bend {
            PT / bend * difference
        } else {
            PT + (difference - bend) / (self.largest - bend) * (1.0 - PT)
        }
    }
}

/// Darker colours appear less colourful (Hunt effect).
fn hunt(lab: Vec3) -> Vec3 {
    Vec3::new(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// Distance made for large colour differences: city block in lightness, Euclidean in chroma.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// The profile exp(-π²x²/b) of a contrast sensitivity filter scaled to the sum 1, and its sum before.
/// All have the radius of the widest: three of its standard deviations.
fn sensitivity_kernel(b: f32) -> (Vec<f32>, f32) {
    use std::f32::consts::PI;
    let widest = BLUE_YELLOW[0].1;
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil();
    let profile = sample(radius, |x| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp());
    let sum: f32 = profile.iter().sum();
    (profile.iter().map(|v| v / sum).collect(), sum)
}

/// A Gaussian of sum 1 and its first and second derivatives, whose positive weights sum to 1 and negative ones to -1.
fn feature_kernels() -> [Vec<f32>; 3] {
    let deviation = 0.5 * W * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil();
    let gauss = |x: f32| (-0.5 * (x / deviation).powi(2)).exp();
    let shapes = [
        sample(radius, gauss),
        sample(radius, |x| -x * gauss(x)),
        sample(radius, |x| ((x / deviation).powi(2) - 1.0) * gauss(x)),
    ];
    shapes.map(|shape| {
        let positive: f32 = shape.iter().filter(|&&v| v > 0.0).sum();
        let negative: f32 = -shape.iter().filter(|&&v| v < 0.0).sum::<f32>();
        shape.iter().map(|&v| v / if v > 0.0 { positive } else { negative }).collect()
    })
}

/// `f` at the whole numbers from `-radius` to `radius`.
#[expect(clippy::cast_possible_truncation, reason = "a dozen pixels")]
fn sample(radius: f32, f: impl Fn(f32) -> f32) -> Vec<f32> {
    let radius = radius as i32;
    (-radius..=radius).map(|x| f(x as f32)).collect()
}

/// Filters the rows by `across` and the columns by `down` (odd lengths); the border pixels are repeated outwards.
fn convolve(plane: &[f32], width: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    let accumulate = |out: &mut [f32], weight: f32, source: &[f32]| {
        for (out, &v) in out.iter_mut().zip(source) {
            *out += weight * v;
        }
    };
    let radius = across.len() / 2;
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_exact_mut(width).zip(plane.par_chunks_exact(width)).for_each_init(
        || vec![0.0; width + 2 * radius],
        |padded, (out, row)| {
            padded[..radius].fill(row[0]);
            padded[radius..radius + width].copy_from_slice(row);
            padded[radius + width..].fill(row[width - 1]);
            for (k, &weight) in across.iter().enumerate() {
                accumulate(out, weight, &padded[k..]);
            }
        },
    );
    let (height, radius) = (plane.len() / width, down.len() / 2);
    let mut columns = vec![0.0; plane.len()];
    columns.par_chunks_exact_mut(width).enumerate().for_each(|(y, out)| {
        for (k, &weight) in down.iter().enumerate() {
            let y = (y + k).saturating_sub(radius).min(height - 1);
            accumulate(out, weight, &rows[y * width..(y + 1) * width]);
        }
    });
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::color::srgb8_to_linear;

    const WIDTH: u32 = 48;
    const HEIGHT: u32 = 32;

    fn picture(code: impl Fn(u32, u32, u32) -> u32) -> Picture {
        let mut picture = Picture::black(WIDTH, HEIGHT);
        for (i, rgb) in (0..).zip(&mut picture.rgb) {
            *rgb = [0, 1, 2].map(|channel| {
                srgb8_to_linear(u8::try_from(code(i % WIDTH, i / WIDTH, channel)).unwrap())
            });
        }
        picture
    }

    fn noise(x: u32, y: u32, channel: u32, seed: u32) -> u32 {
        let mut h = x.wrapping_mul(73_856_093)
            ^ y.wrapping_mul(19_349_663)
            ^ channel.wrapping_mul(83_492_791)
            ^ seed.wrapping_mul(2_654_435_761);
        h = (h ^ (h >> 13)).wrapping_mul(0x5bd1_e995);
        (h ^ (h >> 15)) & 255
    }

    /// The pairs of pictures as sRGB codes of (x, y, channel).
    fn pair(name: &str) -> [Picture; 2] {
        match name {
            "gradient" => {
                [0, 1].map(|k| picture(|x, y, c| [5 * x + 12 * k, 8 * y, 128 - 24 * k][c as usize]))
            }
            "checker" => [0, 1].map(|k| picture(|x, y, _| 255 * (((x + k) / 4 + y / 4) % 2))),
            "noise" => [1, 2].map(|seed| picture(|x, y, c| noise(x, y, c, seed))),
            "edge" => [0, 4].map(|shift| {
                picture(|x, y, c| {
                    let right = 2 * x >= WIDTH + y + shift;
                    [[200, 90, 40], [30, 60, 160]][usize::from(right)][c as usize]
                })
            }),
            "blocks" => [0, 1].map(|k| {
                // Red, green, blue, yellow, cyan, magenta, white, black.
                picture(|x, y, c| {
                    let color = (x / 6 + k * (3 * (y / 16) + 1)) % 8;
                    255 * ([1, 2, 4, 3, 6, 5, 7, 0_u32][color as usize] >> c & 1)
                })
            }),
            "line" => {
                [false, true].map(|drawn| {
                    picture(|x, y, c| {
                        if drawn && (x == 20 || y == 9) { [250, 240, 200][c as usize] } else { 90 }
                    })
                })
            }
            _ => unreachable!("{name}"),
        }
    }

    /// Mean and the values at [`PROBES`] by the authors' implementation, flip-evaluator 1.7 of PyPI:
    /// evaluate(a, b, "LDR", inputsRGB=True, applyMagma=False, parameters={"ppd": 67.0}).
    const REFERENCE: [(&str, f64, [f32; 4]); 6] = [
        ("gradient", 0.264_978, [0.226_931, 0.210_295, 0.261_394, 0.323_219]),
        ("checker", 0.313_088, [0.273_553, 0.355_432, 0.264_905, 0.979_479]),
        ("noise", 0.465_965, [0.753_62, 0.700_436, 0.402_812, 0.736_528]),
        ("edge", 0.097_094, [0.0, 0.046_531, 0.062_447, 0.036_297]),
        ("blocks", 0.964_947, [0.987_607, 0.921_949, 0.982_033, 0.994_487]),
        ("line", 0.214_288, [0.008_698, 0.922_587, 0.191_33, 0.0]),
    ];
    const PROBES: [(u32, u32); 4] = [(0, 0), (20, 9), (24, 16), (47, 31)];

    /// Largest deviation from the reference: of the mean, of a pixel.
    fn deviation(map: &[f32], mean: f64, probes: [f32; 4]) -> (f64, f32) {
        let sum: f64 = map.iter().map(|&v| f64::from(v)).sum();
        let pixel = |(x, y)| map[(y * WIDTH + x) as usize];
        let worst =
            PROBES.iter().zip(probes).map(|(&at, v)| (pixel(at) - v).abs()).fold(0.0, f32::max);
        ((sum / map.len() as f64 - mean).abs(), worst)
    }

    #[test]
    fn agrees_with_the_reference_implementation() {
        for (name, mean, probes) in REFERENCE {
            let [a, b] = pair(name);
            let (of_mean, of_pixel) = deviation(&flip(&a, &b), mean, probes);
            assert!(of_mean < 1e-4 && of_pixel < 1e-3, "{name}: {of_mean} {of_pixel}");
            assert_eq!(flip(&a, &b), flip(&b, &a), "{name}: not symmetric");
            // Must fail: the picture rolled by one row is another picture.
            let mut wrong = b;
            wrong.rgb.rotate_right(WIDTH as usize);
            let (of_mean, of_pixel) = deviation(&flip(&a, &wrong), mean, probes);
            assert!(of_mean > 1e-4 || of_pixel > 1e-3, "{name}: cannot fail");
        }
    }

    #[test]
    fn equal_pictures_do_not_differ_and_colors_are_clamped() {
        let [a, mut b] = pair("noise");
        assert!(flip(&a, &a).iter().all(|&v| v == 0.0));
        b.rgb[5] = [1.0, 0.0, 1.0];
        let mut beyond = b.clone();
        beyond.rgb[5] = [7.0, -3.0, 2.0];
        assert_eq!(flip(&a, &b), flip(&a, &beyond));
        // White for black everywhere: lightness differs by all it can, and nothing has features.
        let [black, white] = [0, 255].map(|code| picture(|_, _, _| code));
        let color = Color::new();
        let expected = color.redistribute(100_f32.powf(QC));
        assert!(flip(&black, &white).iter().all(|&v| (v - expected).abs() < 1e-4));
    }
}
