//! Representatives: surfels that stand for all surfels of a node, so that a node seen in about a pixel is drawn as
//! one splat.
//!
//! A wide node has [`REPRESENTATIVES`]: one for each child, one for each two neighbours, one for each four.

use glam::{DVec3, Vec3};

use super::wide::{CHILDREN, WIDTH, WideNode};
use crate::geometry::Surfels;

/// Representatives a wide node.
pub const REPRESENTATIVES: u32 = WIDTH + WIDTH / 2 + WIDTH / 4;
/// Offset of those for two neighbours.
pub const PAIRS: u32 = WIDTH;
/// Offset of those for four.
pub const QUADS: u32 = PAIRS + WIDTH / 2;
const EACH: usize = REPRESENTATIVES as usize;

/// Sums over the surfels of a node.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    position: DVec3,
    squares: f64,
    normal: DVec3,
}

impl Moments {
    fn add(&mut self, other: Self) {
        self.count += other.count;
        self.position += other.position;
        self.squares += other.squares;
        self.normal += other.normal;
    }

    fn of(surfels: &Surfels, i: usize) -> Self {
        let position = surfels.position(i).as_dvec3();
        let normal = surfels.normals[i].as_dvec3();
        Self { count: 1.0, position, squares: position.length_squared(), normal }
    }
}

/// Which children the representative in a slot stands for.
fn members(slot: usize) -> std::ops::Range<usize> {
    if slot < CHILDREN {
        return slot..slot + 1;
    }
    let (of, size) = match slot - CHILDREN {
        i if i < CHILDREN / 2 => (i, 2),
        i => (i - CHILDREN / 2, 4),
    };
    of * size..(of + 1) * size
}

/// Appends the representatives of all wide nodes to `surfels`, which are in leaf order, and tells the nodes how large
/// they are. Their colours are left to [`average`].
#[expect(clippy::cast_possible_truncation, reason = "rounded once")]
pub(super) fn append(wide: &mut [WideNode], surfels: &mut Surfels) {
    let n = surfels.len();
    let total = n + wide.len() * EACH;
    for list in [&mut surfels.x, &mut surfels.y, &mut surfels.z] {
        list.truncate(n);
        list.resize(total, 0.0);
    }
    surfels.normals.resize(total, Vec3::Y);
    surfels.albedo.resize(total, Vec3::ZERO);
    surfels.radiance.resize(total, Vec3::ZERO);
    surfels.extent.resize(total, 0.0);
    let mut sums = vec![Moments::default(); wide.len()];
    // Children come after their parents.
    for w in (0..wide.len()).rev() {
        let node = &mut wide[w];
        let mut own = [Moments::default(); CHILDREN];
        let mut extent = [0.0f32; CHILDREN];
        for slot in (0..CHILDREN).filter(|slot| node.used >> slot & 1 != 0) {
            let first = node.first[slot] as usize;
            if node.child[slot] == 0 {
                for i in first..first + node.count[slot] as usize {
                    own[slot].add(Moments::of(surfels, i));
                }
            } else {
                own[slot] = sums[node.child[slot] as usize];
            }
            extent[slot] = surfels.extent[first];
            sums[w].add(own[slot]);
        }
        for slot in 0..EACH {
            let mut all = Moments::default();
            let mut leaf_extent = 0.0f32;
            for child in members(slot) {
                all.add(own[child]);
                leaf_extent = leaf_extent.max(extent[child]);
            }
            if all.count == 0.0 {
                continue;
            }
            let middle = all.position / all.count;
            // A disk's mean squared distance from its middle is half its squared radius.
            let variance = (all.squares / all.count - middle.length_squared()).max(0.0);
            let radius = (2.0 * variance + f64::from(leaf_extent).powi(2)).sqrt() as f32;
            let at = n + w * EACH + slot;
            [surfels.x[at], surfels.y[at], surfels.z[at]] = middle.as_vec3().to_array();
            surfels.normals[at] = all.normal.try_normalize().map_or(Vec3::Y, |n| n.as_vec3());
            surfels.extent[at] = radius;
            if slot < CHILDREN {
                node.extent[slot] = radius;
            }
        }
    }
}

/// Gives the representatives at `from` on the mean of what their surfels have. `first`: the object's first surfel.
pub(super) fn average(wide: &[WideNode], values: &mut [Vec3], first: usize, from: usize) {
    let mut sums = vec![(DVec3::ZERO, 0.0); wide.len()];
    for (w, node) in wide.iter().enumerate().rev() {
        let mut own = [(DVec3::ZERO, 0.0); CHILDREN];
        for slot in (0..CHILDREN).filter(|slot| node.used >> slot & 1 != 0) {
            own[slot] = if node.child[slot] == 0 {
                let begin = first + node.first[slot] as usize;
                let range = begin..begin + node.count[slot] as usize;
                let sum = values[range].iter().map(|v| v.as_dvec3()).sum();
                (sum, f64::from(node.count[slot]))
            } else {
                sums[node.child[slot] as usize]
            };
            sums[w] = (sums[w].0 + own[slot].0, sums[w].1 + own[slot].1);
        }
        for slot in 0..EACH {
            let (sum, count) =
                own[members(slot)].iter().fold((DVec3::ZERO, 0.0), |(s, n), o| (s + o.0, n + o.1));
            if count > 0.0 {
                values[from + w * EACH + slot] = (sum / count).as_vec3();
            }
        }
    }
}
