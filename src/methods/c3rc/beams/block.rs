//! A block: 16 x 16 pixels of a tile, in groups of 4 x 4.

use crate::visibility::mirror_rays::TILE;

/// Columns and rows of a group.
pub(super) const GROUP: usize = 4;
/// Pixels of a group: lanes.
pub(super) const LANES: usize = GROUP * GROUP;
/// Columns and rows of a block, in groups.
pub(super) const SIDE: usize = 4;
/// Groups of a block: lanes, too.
pub(super) const GROUPS: usize = SIDE * SIDE;
/// Columns and rows of a block, in pixels.
pub(super) const BLOCK: usize = SIDE * GROUP;
/// The pixels of a block that are in no beam yet.
pub(super) struct Block {
    /// First column and row, of the tile.
    pub(super) corner: [usize; 2],
    /// By group, a bit a pixel.
    pub(super) left: [u32; GROUPS],
}

impl Block {
    /// The block that starts at a column and row, with those of a tile's pixels.
    pub(super) fn new(mask: &[u32; TILE], [x, y]: [usize; 2]) -> Self {
        let group = |[x, y]: [usize; 2]| {
            let row = |row: usize| mask[y + row] >> x & ((1 << GROUP) - 1);
            (0..GROUP).fold(0, |all, r| all | row(r) << (GROUP * r))
        };
        let left = std::array::from_fn(|g| group([x + g % SIDE * GROUP, y + g / SIDE * GROUP]));
        Self { corner: [x, y], left }
    }

    /// Where a group begins, in the tile.
    pub(super) fn corner_of(&self, group: usize) -> [usize; 2] {
        [self.corner[0] + group % SIDE * GROUP, self.corner[1] + group / SIDE * GROUP]
    }

    /// A pixel of the tile among those left that lies near the block's middle.
    pub(super) fn seed(&self) -> Option<[usize; 2]> {
        const BY_DISTANCE: [usize; GROUPS] = [5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15];
        let group = BY_DISTANCE.into_iter().find(|g| self.left[*g] != 0)?;
        let [x, y] = self.corner_of(group);
        // Twice the distance of a pixel's middle from the block's.
        let off = |pixel: usize, corner: usize| (2 * (pixel - corner) + 1).abs_diff(BLOCK);
        let own = (0..LANES).filter(|lane| self.left[group] >> lane & 1 != 0);
        own.map(|lane| [x + lane % GROUP, y + lane / GROUP])
            .min_by_key(|[x, y]| off(*x, self.corner[0]).pow(2) + off(*y, self.corner[1]).pow(2))
    }

    /// These pixels, by group, are in a beam now.
    pub(super) fn take(&mut self, pixels: &[u32; GROUPS]) {
        for (left, taken) in self.left.iter_mut().zip(pixels) {
            *left &= !taken;
        }
    }
}
