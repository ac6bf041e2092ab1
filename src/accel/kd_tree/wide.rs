//! The tree as it is walked: eight children a node, side by side for vector tests.

use glam::Vec3;

use super::Node;
use crate::geometry::Aabb;

/// Children of a wide node.
pub const CHILDREN: usize = 8;
pub(super) const WIDTH: u32 = 8;
/// For the rounding of a cone's cosine.
const CONE_SLACK: f32 = 1e-5;

/// Eight boxes and what is in them. Unused ones are empty (count 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WideNode {
    /// Middles by axis.
    pub center: [[f32; CHILDREN]; 3],
    /// Half edge lengths by axis, rounded up so that the box is never smaller than the node's.
    pub half: [[f32; CHILDREN]; 3],
    /// First surfel of each child.
    pub first: [u32; CHILDREN],
    /// Number of surfels of each child.
    pub count: [u32; CHILDREN],
    /// Wide node of each child; 0 for a leaf.
    pub child: [u32; CHILDREN],
    /// Radius of the disk that stands for each child; 0 before there are representatives.
    pub extent: [f32; CHILDREN],
    /// Axis of each child's normal cone, by coordinate.
    pub cone_axis: [[f32; CHILDREN]; 3],
    /// Cosine of its half angle.
    pub cone_cosine: [f32; CHILDREN],
    /// Sine of that.
    pub cone_sine: [f32; CHILDREN],
    /// How many children each child has, if it is no leaf.
    pub parts: [u8; CHILDREN],
    /// Bit i: child i is used.
    pub used: u64,
}

impl WideNode {
    /// No children.
    pub const EMPTY: Self = Self {
        center: [[0.0; CHILDREN]; 3],
        half: [[0.0; CHILDREN]; 3],
        first: [0; CHILDREN],
        count: [0; CHILDREN],
        child: [0; CHILDREN],
        extent: [0.0; CHILDREN],
        cone_axis: [[0.0; CHILDREN]; 3],
        cone_cosine: [-1.0; CHILDREN],
        cone_sine: [0.0; CHILDREN],
        parts: [0; CHILDREN],
        used: 0,
    };

    /// Puts a box into a slot.
    pub fn set_box(&mut self, slot: usize, bounds: Aabb) {
        let center = bounds.center();
        // Half a box by rounded numbers: a hair more than the larger distance to a face.
        let half = (bounds.max - center).max(center - bounds.min) * (1.0 + 2.0 * f32::EPSILON);
        for axis in 0..3 {
            self.center[axis][slot] = center[axis];
            self.half[axis][slot] = half[axis];
        }
        self.used |= 1 << slot;
    }

    /// Puts a normal cone into a slot, a little wider than it is.
    fn set_cone(&mut self, slot: usize, cone: super::NormalCone) {
        for axis in 0..3 {
            self.cone_axis[axis][slot] = cone.axis[axis];
        }
        let cosine = (cone.cosine - CONE_SLACK).clamp(-1.0, 1.0);
        self.cone_cosine[slot] = cosine;
        self.cone_sine[slot] = (1.0 - cosine * cosine).max(0.0).sqrt();
    }

    /// The box in a slot, not smaller than what was put there.
    pub fn get_box(&self, slot: usize) -> Aabb {
        let at = |lists: &[[f32; CHILDREN]; 3]| Vec3::from_array([0, 1, 2].map(|k| lists[k][slot]));
        let (center, half) = (at(&self.center), at(&self.half));
        Aabb { min: center - half, max: center + half }
    }
}

/// Takes up to three binary levels together, the lowest ones always: nearly all nodes are just above the
/// leaves, so those must be full.
pub(super) fn collapse(nodes: &[Node]) -> Vec<WideNode> {
    let leaves = leaf_counts(nodes);
    let mut wide = vec![WideNode::EMPTY];
    // (wide node, the binary node whose descendants it holds)
    let mut open = vec![(0usize, 0usize)];
    while let Some((at, root)) = open.pop() {
        let mut children = Vec::with_capacity(CHILDREN);
        descendants(nodes, &leaves, root, child_leaves(leaves[root]), &mut children);
        for (slot, &index) in children.iter().enumerate() {
            let node = &nodes[index];
            let child = if node.right == 0 { 0 } else { wide.len() };
            if child != 0 {
                wide.push(WideNode::EMPTY);
                open.push((child, index));
            }
            wide[at].set_box(slot, node.bounds);
            wide[at].set_cone(slot, node.cone);
            wide[at].first[slot] = node.first;
            wide[at].count[slot] = node.count;
            wide[at].child[slot] = u32::try_from(child).expect("fewer nodes than surfels");
        }
    }
    for at in 0..wide.len() {
        for slot in 0..CHILDREN {
            let child = wide[at].child[slot] as usize;
            if child != 0 {
                let parts = wide[child].used.count_ones();
                wide[at].parts[slot] = u8::try_from(parts).expect("at most eight");
            }
        }
    }
    wide
}

/// Leaves below each node.
fn leaf_counts(nodes: &[Node]) -> Vec<u32> {
    let mut counts = vec![1; nodes.len()];
    for i in (0..nodes.len()).rev().filter(|&i| nodes[i].right != 0) {
        counts[i] = counts[i + 1] + counts[i + nodes[i].right as usize];
    }
    counts
}

/// The most leaves that a child of a node with so many should hold: a power of eight.
pub(super) fn child_leaves(leaves: u32) -> u32 {
    let mut most = 1;
    while most < leaves.div_ceil(WIDTH) {
        most *= WIDTH;
    }
    most
}

/// Up to eight descendants that share out a node's surfels, in order: the first on each way down that hold no
/// more than `most` leaves. The node itself if it is a leaf.
fn descendants(nodes: &[Node], leaves: &[u32], root: usize, most: u32, list: &mut Vec<usize>) {
    let mut open = vec![(root, CHILDREN)];
    while let Some((index, slots)) = open.pop() {
        let node = &nodes[index];
        // Unbalanced trees (leaves by size) can need more slots than there are: those go one level deeper.
        if node.right == 0 || slots < 2 || (index != root && leaves[index] <= most) {
            list.push(index);
        } else {
            let half = slots / 2;
            open.push((index + node.right as usize, slots - half));
            open.push((index + 1, half));
        }
    }
}

#[cfg(test)]
pub(super) fn validate(wide: &[WideNode], nodes: &[Node]) -> Result<(), String> {
    let mut next = 0;
    let mut open = vec![(0usize, 0usize)];
    while let Some((at, slot)) = open.pop() {
        let node = &wide[at];
        if slot == CHILDREN {
            continue;
        }
        open.push((at, slot + 1));
        if node.used >> slot & 1 == 0 {
            continue;
        }
        if node.child[slot] != 0 {
            open.push((node.child[slot] as usize, 0));
            continue;
        }
        if node.first[slot] != next {
            return Err(format!("wide leaf {at}/{slot} starts at {} not {next}", node.first[slot]));
        }
        next += node.count[slot];
        let (first, count) = (node.first[slot], node.count[slot]);
        let binary = nodes.iter().find(|n| n.right == 0 && n.first == first && n.count == count);
        let inside = binary.is_some_and(|n| {
            let outer = node.get_box(slot);
            outer.contains(n.bounds.min) && outer.contains(n.bounds.max)
        });
        if !inside {
            return Err(format!("the box of wide leaf {at}/{slot} is too small"));
        }
    }
    if next == nodes[0].count { Ok(()) } else { Err(format!("{next} surfels in wide leaves")) }
}
