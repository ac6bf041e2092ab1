//! What a beam has seen so far, and from which depth on it sees no more.

use fearless_simd::{Simd, f32x16};

use super::beam::Beam;
use super::blend::{Blended, blend};
use super::block::GROUPS;
use super::fit::{Bend, Ranges};
use super::splats::{Splats, WIDE};
use crate::geometry::lanes::{Real, Vector};

/// Splats a pixel before it is asked whether they fill the beam (untuned).
const FIRST_LOOK: usize = 40;

/// Memory of a thread for what a beam sees.
#[derive(Default)]
pub(super) struct Room {
    splats: Splats,
    order: Vec<u64>,
    groups: Vec<u16>,
}

/// See the module.
pub(super) struct Seen<'a> {
    pub(super) splats: &'a mut Splats,
    /// Keys of those that may be seen.
    pub(super) order: &'a mut Vec<u64>,
    /// Which groups they may reach, once sorted, and some zeros.
    groups: &'a mut Vec<u16>,
    pub(super) ranges: Ranges,
    pub(super) bend: Bend,
    /// By group: nothing that lies farther is seen.
    pub(super) full: [f32; GROUPS],
    /// With so many splats, [`Seen::settle`] is due.
    pub(super) until: usize,
    /// Nothing that lies farther is seen by any.
    pub(super) full_from: f32,
    /// Whether some group is full.
    pub(super) some_full: bool,
    /// Mirrors hide from that far on along a ray.
    pub(super) clear: f32,
}

impl<'a> Seen<'a> {
    pub(super) fn new<T: Simd>(simd: T, room: &'a mut Room, beam: &Beam, clear: f32) -> Self {
        let Room { splats, order, groups } = room;
        splats.len = 0;
        order.clear();
        let pixels = beam.pixels.iter().map(|p| p.count_ones() as usize).sum::<usize>();
        Self {
            splats,
            order,
            groups,
            ranges: beam.ranges(simd),
            bend: beam.bend(simd),
            full: beam.pixels.map(|pixels| if pixels == 0 { f32::MIN } else { f32::INFINITY }),
            until: FIRST_LOOK * pixels,
            full_from: f32::INFINITY,
            some_full: false,
            clear,
        }
    }

    /// Where the farthest splat lies.
    pub(super) fn farthest(&self) -> f32 {
        let most = self.order.iter().fold(0.0f32, |most, key| most.max(depth_of(*key)));
        most.min(self.full_from)
    }

    /// Whether the splats so far fill all pixels, and up to where.
    #[inline(always)]
    pub(super) fn settle<T: Simd>(&mut self, simd: T, beam: &Beam) {
        self.sort();
        let mut most = 0.0f32;
        for group in (0..GROUPS).filter(|group| beam.pixels[*group] != 0) {
            if self.full[group] == f32::INFINITY {
                self.full[group] = self.blend(simd, beam, group, false).full_from;
                self.some_full |= self.full[group] < f32::INFINITY;
            }
            most = most.max(self.full[group]);
        }
        if most < self.full_from {
            self.full_from = most;
            self.order.retain(|key| depth_of(*key) <= most);
        }
        self.until = self.order.len() + self.order.len().max(self.until / 2);
    }

    /// The groups that are not full before a depth.
    #[inline(always)]
    pub(super) fn open_at<T: Simd>(&self, simd: T, depth: f32) -> u32 {
        let full = F::<T>::load(simd, &self.full);
        #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
        let bits = F::<T>::bits(full.splat(depth).le(full)) as u32;
        bits
    }

    /// Sorts the splats so far, for [`Seen::blend`].
    pub(super) fn sort(&mut self) {
        self.order.sort_unstable();
        self.groups.clear();
        self.groups.extend(self.order.iter().map(|key| {
            let i = index(*key);
            self.splats.batches[i / WIDE].groups[i % WIDE]
        }));
        self.groups.resize(self.order.len().next_multiple_of(AT_ONCE), 0);
    }

    /// What the sorted splats show of a group.
    #[inline(always)]
    pub(super) fn blend<T: Simd>(
        &self,
        simd: T,
        beam: &Beam,
        group: usize,
        describes: bool,
    ) -> Blended {
        blend(simd, beam, group, self.splats, self.order, self.groups, describes)
    }
}

type F<T> = f32x16<T>;

/// Of the groups of splats, so many are looked through at once.
pub(super) const AT_ONCE: usize = 32;

/// Which of some splats may reach a group.
#[inline(always)]
pub(super) fn of_group<T: Simd>(simd: T, groups: &[u16], group: usize) -> u32 {
    use fearless_simd::{SimdBase, SimdMask, u16x32};
    let without = (u16x32::from_slice(simd, groups) & (1u16 << group)).simd_eq(0);
    #[expect(clippy::cast_possible_truncation, reason = "32 bits")]
    let bits = !without.to_bitmask() as u32;
    bits
}

/// Which splat a key names.
#[inline(always)]
pub(super) fn index(key: u64) -> usize {
    #[expect(clippy::cast_possible_truncation, reason = "the low half")]
    let low = key as u32;
    low as usize
}

#[inline(always)]
pub(super) fn depth_of(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

/// What splats are sorted by: depth, number.
#[inline(always)]
pub(super) fn key(depth: f32, number: usize) -> u64 {
    u64::from(depth.to_bits()) << 32 | number as u64
}
