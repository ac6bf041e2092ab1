//! Top-down, parallel, median of the longest axis.

use glam::Vec3;
use rayon::prelude::*;

use super::wide::{WIDTH, child_leaves};
use super::{KdTreeLimits, Node, NormalCone};
use crate::geometry::{Aabb, Surfels};

#[derive(Clone, Copy)]
struct Item {
    position: [f32; 3],
    surfel: u32,
}

/// Nodes smaller than this are built without splitting off parallel work.
const PARALLEL_COUNT: usize = 8192;

pub(super) fn build(surfels: &mut Surfels, limits: KdTreeLimits) -> Vec<Node> {
    let n = surfels.len();
    assert!(n > 0 && limits.leaf_points > 0, "{n} surfels, {limits:?}");
    let count = u32::try_from(n).expect("fewer than 2^32 surfels");
    let mut items: Vec<Item> = (0..count)
        .into_par_iter()
        .map(|surfel| Item { position: surfels.position(surfel as usize).to_array(), surfel })
        .collect();
    let smallest = limits.leaf_size * bounds(&items).diagonal();
    let mut nodes = subtree(&mut items, 0, limits.leaf_points, smallest);
    sort(surfels, &items);
    cones(&mut nodes, surfels);
    nodes
}

fn bounds(items: &[Item]) -> Aabb {
    Aabb::of(items.iter().map(|i| Vec3::from_array(i.position)))
}

fn subtree(items: &mut [Item], first: u32, leaf_points: u32, smallest: f32) -> Vec<Node> {
    let bounds = bounds(items);
    #[expect(clippy::cast_possible_truncation, reason = "checked for the root")]
    let count = items.len() as u32;
    let cone = NormalCone { axis: Vec3::ZERO, cosine: -1.0 };
    let node = Node { bounds, cone, first, count, right: 0 };
    if count <= leaf_points || bounds.diagonal() <= smallest {
        spread(items);
        return vec![node];
    }
    // Whole blocks go left, so that all leaves but one are full, and all wide nodes above leaves. Higher up that would cost
    // thin slabs, which is what one of the larger blocks leaves over.
    let block = leaf_points * child_leaves(count.div_ceil(leaf_points)).min(WIDTH);
    let left_count = count.div_ceil(block) / 2 * block;
    let axis = bounds.extent().max_position();
    let key = |i: &Item| i.position[axis];
    // The surfel's index breaks ties, so that the tree does not depend on the selection's inner order.
    items.select_nth_unstable_by(left_count as usize, |a, b| {
        key(a).total_cmp(&key(b)).then(a.surfel.cmp(&b.surfel))
    });
    let (left, right) = items.split_at_mut(left_count as usize);
    let mut build_left = || subtree(left, first, leaf_points, smallest);
    let mut build_right = || subtree(right, first + left_count, leaf_points, smallest);
    let (left, right) = if count as usize >= PARALLEL_COUNT {
        rayon::join(build_left, build_right)
    } else {
        (build_left(), build_right())
    };
    let mut nodes = Vec::with_capacity(1 + left.len() + right.len());
    #[expect(clippy::cast_possible_truncation, reason = "fewer nodes than twice the surfels")]
    nodes.push(Node { right: 1 + left.len() as u32, ..node });
    nodes.extend(left);
    nodes.extend(right);
    nodes
}

/// Orders a leaf's surfels so that neighbours in the list are neighbours in space: every second, or every fourth, one
/// then stands for all.
fn spread(items: &mut [Item]) {
    if items.len() <= 2 {
        return;
    }
    let half = items.len().next_power_of_two() / 2;
    let axis = bounds(items).extent().max_position();
    items.sort_unstable_by(|a, b| {
        a.position[axis].total_cmp(&b.position[axis]).then(a.surfel.cmp(&b.surfel))
    });
    let (left, right) = items.split_at_mut(half);
    spread(left);
    spread(right);
}

/// Brings the surfels into leaf order.
fn sort(surfels: &mut Surfels, items: &[Item]) {
    fn gather<T: Copy + Send + Sync>(list: &mut Vec<T>, items: &[Item], padding: usize) {
        if list.is_empty() {
            return;
        }
        let mut sorted = Vec::with_capacity(items.len() + padding);
        items.par_iter().map(|i| list[i.surfel as usize]).collect_into_vec(&mut sorted);
        let last = sorted[items.len() - 1];
        sorted.extend(std::iter::repeat_n(last, padding));
        *list = sorted;
    }
    let padding = crate::geometry::surfel::PADDING;
    for list in [&mut surfels.x, &mut surfels.y, &mut surfels.z] {
        gather(list, items, padding);
    }
    for list in [&mut surfels.normals, &mut surfels.albedo, &mut surfels.radiance] {
        gather(list, items, 0);
    }
    gather(&mut surfels.extent, items, 0);
}

/// Fills in the normal cones: the axis is the mean normal, the angle reaches the farthest normal.
fn cones(nodes: &mut [Node], surfels: &Surfels) {
    nodes.par_iter_mut().for_each(|node| {
        let range = node.first as usize..(node.first + node.count) as usize;
        let normals = &surfels.normals[range];
        let Some(axis) = normals.iter().sum::<Vec3>().try_normalize() else { return };
        let cosine = normals.iter().map(|n| n.dot(axis)).fold(1.0, f32::min);
        node.cone = NormalCone { axis, cosine };
    });
}
