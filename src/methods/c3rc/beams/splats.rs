//! Splats of a beam, sixteen by sixteen.

/// The kernel of a disk is so many times as wide as the disk that holds a surfel. With 1.3 the squared error was larger by a fifth:
/// fewer splats a pixel tell less of where edges are.
pub(super) const SPREAD: f32 = 1.5;

/// Splats, sixteen by sixteen.
#[derive(Default)]
pub(super) struct Splats {
    pub(super) batches: Vec<Batch>,
    /// Those in use.
    pub(super) len: usize,
    /// Surfels near the beam, to be looked at together.
    pub(super) near: Near,
}

/// A lane is a splat.
#[derive(Clone)]
pub(super) struct Batch {
    pub(super) value: [[f32; WIDE]; VALUES],
    pub(super) surfel: [u32; WIDE],
    /// Which groups of the beam's pixels each may reach, a bit a group.
    pub(super) groups: [u16; WIDE],
    /// Whether they show something; a mirror's hide.
    pub(super) shows: bool,
    /// Lanes of which a part may lie before where some ray starts or is clear of its mirror, and from where on that is.
    pub(super) early: u32,
    /// Lanes seen from behind.
    pub(super) back: u32,
    pub(super) from: f32,
}

/// Where the surfel lies in the plane (u, v), and how far along the axis.
pub(super) const U: usize = 0;
pub(super) const V: usize = 1;
pub(super) const S: usize = 2;
/// The form a u² + 2 b u v + c v², which is 1 at the rim; scene units. The second is 2 b.
pub(super) const FORM: usize = 3;
pub(super) const WEIGHT: usize = 6;
/// One by half the extent along u and v.
pub(super) const PER_HALF: usize = 7;
/// What lies nearer is another surface.
pub(super) const FARTHER: usize = 9;
/// Half its size, px.
pub(super) const SIZE: usize = 10;
/// How the place where a ray meets the disk's plane moves along the axis with the ray's distance along u and v.
pub(super) const TILT: usize = 11;
/// Linear RGB.
pub(super) const RADIANCE: usize = 13;
const VALUES: usize = 16;
/// Surfels looked at together.
pub(super) const WIDE: usize = 16;

impl Batch {
    pub(super) const EMPTY: Self = Self {
        value: [[0.0; WIDE]; VALUES],
        surfel: [0; WIDE],
        groups: [0; WIDE],
        shows: true,
        early: 0,
        back: 0,
        from: 0.0,
    };
}

/// Surfels of one cloud in the beam's frame.
#[derive(Default)]
pub(super) struct Near {
    pub(super) len: usize,
    pub(super) u: [f32; 2 * WIDE],
    pub(super) v: [f32; 2 * WIDE],
    pub(super) s: [f32; 2 * WIDE],
    /// Squared radius of the disk that holds a surfel.
    pub(super) squared: [f32; 2 * WIDE],
    pub(super) surfel: [u32; 2 * WIDE],
}

impl Splats {
    /// Where a splat lies: u, v, s.
    pub(super) fn place(&self, i: usize) -> [f32; 3] {
        let value = &self.batches[i / WIDE].value;
        [value[U][i % WIDE], value[V][i % WIDE], value[S][i % WIDE]]
    }

    pub(super) fn surfel(&self, i: usize) -> u32 {
        self.batches[i / WIDE].surfel[i % WIDE]
    }

    #[cfg(test)]
    pub(super) fn groups(&self, i: usize) -> u16 {
        self.batches[i / WIDE].groups[i % WIDE]
    }

    /// Adds one at u, v, s, as tests have them.
    #[cfg(test)]
    pub(super) fn push(&mut self, place: [f32; 3], surfel: u32, fill: impl FnOnce(&mut Batch)) {
        let batch = next(&mut self.batches, &mut self.len);
        *batch = Batch::EMPTY;
        [batch.value[U][0], batch.value[V][0], batch.value[S][0]] = place;
        (batch.surfel[0], batch.groups[0]) = (surfel, 1);
        fill(batch);
    }
}

/// One more batch; its numbers are any.
pub(super) fn next<'a>(batches: &'a mut Vec<Batch>, len: &mut usize) -> &'a mut Batch {
    if *len == batches.len() {
        batches.resize((2 * *len).max(4), Batch::EMPTY);
    }
    *len += 1;
    &mut batches[*len - 1]
}
