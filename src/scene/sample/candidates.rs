//! Candidates: several times as many points as are wanted, each uniform in its own equal share of the area.

use glam::Vec3;
use rayon::prelude::*;

use crate::geometry::Mesh;

/// A point of the surface that may become a surfel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Number of its share of the area.
    pub(super) id: u32,
    /// Index of the triangle that it lies on.
    pub(super) triangle: u32,
    /// Local space.
    pub(super) position: Vec3,
    /// Unit normal of the triangle; zero if it is too thin to have one.
    pub(super) normal: Vec3,
}

/// The surface as an interval `0..area`, triangle by triangle and along a Morton curve in each of them,
/// cut into equal shares with one random point in each. Nothing is stored a candidate: any of them is
/// made again from its number.
pub(super) struct Candidates<'a> {
    mesh: &'a Mesh,
    /// Sum of the areas up to and including each triangle.
    ends: Vec<f64>,
    /// Area of a share.
    share: f64,
    count: u32,
    seed: u64,
}

impl<'a> Candidates<'a> {
    /// `count` candidates, at least one.
    pub(super) fn new(mesh: &'a Mesh, count: u32, seed: u64) -> Self {
        let triangles = mesh.triangles().len();
        let mut ends: Vec<f64> =
            (0..triangles).into_par_iter().map(|t| mesh.triangle_area(t)).collect();
        let mut sum = 0.0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        Self { mesh, ends, share: sum / f64::from(count), count, seed }
    }

    /// How many there are.
    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// What the random numbers depend on.
    pub(super) fn seed(&self) -> u64 {
        self.seed
    }

    /// Area of the surface.
    pub(super) fn area(&self) -> f64 {
        self.ends.last().copied().unwrap_or(0.0)
    }

    /// The triangle on which candidate `id` lies.
    pub(super) fn triangle(&self, id: u32) -> u32 {
        let x = self.coordinate(id);
        index(self.ends.partition_point(|&end| end <= x))
    }

    /// Candidates `first..first + count` in order. `triangle` is that of the first one.
    pub(super) fn run(
        &self,
        first: u32,
        count: u32,
        mut triangle: u32,
    ) -> impl Iterator<Item = Candidate> {
        let mut face = self.face(triangle);
        (first..first + count).map(move |id| {
            let x = self.coordinate(id);
            if self.ends[triangle as usize] <= x {
                while self.ends[triangle as usize] <= x {
                    triangle += 1;
                }
                face = self.face(triangle);
            }
            let [u, v, w] = face.weights(x);
            let [a, b, c] = face.corners;
            Candidate { id, triangle, position: a * u + b * v + c * w, normal: face.normal }
        })
    }

    /// Barycentric weights of a candidate.
    pub(super) fn weights(&self, candidate: &Candidate) -> [f32; 3] {
        self.face(candidate.triangle).weights(self.coordinate(candidate.id))
    }

    /// Where in `0..area` candidate `id` lies.
    fn coordinate(&self, id: u32) -> f64 {
        let x = (f64::from(id) + unit(hash(self.seed ^ u64::from(id)))) * self.share;
        x.min(self.area().next_down())
    }

    fn face(&self, triangle: u32) -> Face {
        let t = triangle as usize;
        let start = if t == 0 { 0.0 } else { self.ends[t - 1] };
        let [a, b, c] = self.mesh.corners(t);
        // In f64: the squares of small edges vanish in f32.
        let normal = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or_zero().as_vec3();
        Face { corners: [a, b, c], normal, start, per_area: (self.ends[t] - start).recip() }
    }
}

/// What is the same for all candidates on a triangle.
struct Face {
    corners: [Vec3; 3],
    normal: Vec3,
    /// Where in `0..area` it starts.
    start: f64,
    per_area: f64,
}

impl Face {
    /// The place `x` in `0..area` as a place in the triangle: `x` is spread over the unit square by the
    /// Morton curve, the square over the triangle by the area-preserving map of Heitz, "A Low-Distortion
    /// Map Between Triangle and Square" (2019). Both keep areas, so equal lengths of `x` are equal areas.
    fn weights(&self, x: f64) -> [f32; 3] {
        const HALF: u32 = 24; // bits a side of the square: as many as an f32 holds
        const SCALE: f64 = (1_u64 << (2 * HALF)) as f64;
        let along = (x - self.start) * self.per_area;
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let bits = ((along * SCALE) as u64).min((1 << (2 * HALF)) - 1);
        let side = |bits: u64| even_bits(bits) as f32 * (1.0 / (1_u32 << HALF) as f32);
        let (mut u, mut v) = (side(bits), side(bits >> 1));
        if v > u {
            u *= 0.5;
            v -= u;
        } else {
            v *= 0.5;
            u -= v;
        }
        [u, v, (1.0 - u - v).max(0.0)]
    }
}

/// Bits 0, 2, 4, … moved together.
fn even_bits(bits: u64) -> u32 {
    let mut x = bits & 0x5555_5555_5555_5555;
    for (shift, mask) in [
        (1, 0x3333_3333_3333_3333),
        (2, 0x0f0f_0f0f_0f0f_0f0f),
        (4, 0x00ff_00ff_00ff_00ff),
        (8, 0x0000_ffff_0000_ffff),
        (16, 0x0000_0000_ffff_ffff),
    ] {
        x = (x | x >> shift) & mask;
    }
    #[expect(clippy::cast_possible_truncation, reason = "masked to 32 bits")]
    let together = x as u32;
    together
}

/// SplitMix64 (Steele, Lea & Flood 2014): a well-mixed word a number.
pub(in crate::scene) fn hash(number: u64) -> u64 {
    let mut z = number.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

/// A random word as a number in `0..1`.
pub(in crate::scene) fn unit(word: u64) -> f64 {
    (word >> 11) as f64 / (1_u64 << 53) as f64
}

/// An index that is known to fit.
pub(in crate::scene) fn index(i: usize) -> u32 {
    u32::try_from(i).expect("fewer than 2^32 triangles and candidates")
}
