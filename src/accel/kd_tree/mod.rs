//! A kd-tree over surfels whose nodes are contiguous ranges (Mei et al. section 4): leaf order is buffer order.
//!
//! Built binary (median of the longest axis, tight boxes, normal cones), walked eight-wide. It lives in the
//! object's space, so a rigid motion or a uniform scale of the object never touches it.

mod build;
pub mod representatives;
mod wide;

use glam::Vec3;

use crate::geometry::{Aabb, Surfels};

pub use wide::{CHILDREN, WideNode};

/// When a node becomes a leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KdTreeLimits {
    /// At most so many surfels a leaf (the paper's tables: about 122). At least 1.
    pub leaf_points: u32,
    /// A node whose diagonal is at most this share of the root's is a leaf, whatever it holds.
    pub leaf_size: f32,
}

impl Default for KdTreeLimits {
    /// Measured on a scan of 437,645 surfels: 71 % of the projections are valid with 8 and 68 % with 16, which is
    /// the faster one by about a tenth.
    fn default() -> Self {
        Self { leaf_points: 8, leaf_size: 0.0 }
    }
}

/// Directions within an angle of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalCone {
    /// Unit, or zero if the cone is everything.
    pub axis: Vec3,
    /// Cosine of the half angle; -1 if the cone is everything.
    pub cosine: f32,
}

/// A node of the binary tree, in preorder: the left child follows its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Tight box of its surfels.
    pub bounds: Aabb,
    /// Contains the normals of its surfels.
    pub cone: NormalCone,
    /// First surfel.
    pub first: u32,
    /// Number of surfels.
    pub count: u32,
    /// Distance in the node list from this node to its right child; 0 for a leaf.
    pub right: u32,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct KdTree {
    wide: Vec<WideNode>,
    /// Tight.
    bounds: Aabb,
    surfels: u32,
    statistics: KdTreeStatistics,
    /// A frame needs the wide ones only.
    #[cfg(test)]
    nodes: Vec<Node>,
}

/// Figures of a tree, as in the paper's Table 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KdTreeStatistics {
    /// Number of leaves.
    pub leaves: usize,
    /// Mean depth of a leaf (the root has depth 0), in binary levels.
    pub mean_depth: f64,
    /// Mean number of surfels a leaf.
    pub points_per_leaf: f64,
}

impl KdTree {
    /// Builds the tree and sorts the surfels into leaf order.
    ///
    /// # Panics
    /// If there are no surfels, or `limits.leaf_points` is 0.
    pub fn build(surfels: &mut Surfels, limits: KdTreeLimits) -> Self {
        let nodes = build::build(surfels, limits);
        Self {
            wide: wide::collapse(&nodes),
            bounds: nodes[0].bounds,
            surfels: nodes[0].count,
            statistics: KdTreeStatistics::of(&nodes),
            #[cfg(test)]
            nodes,
        }
    }

    /// Appends the representatives of all wide nodes to `surfels` (see [`representatives`]): those of wide node w
    /// begin at `w` · [`REPRESENTATIVES`](representatives::REPRESENTATIVES) behind the surfels. Their colours are left to [`KdTree::average`].
    pub fn append_representatives(&mut self, surfels: &mut Surfels) {
        representatives::append(&mut self.wide, surfels);
    }

    /// Gives every representative the mean of its surfels' values. `first`: the first surfel in `values`; the
    /// representatives follow the surfels.
    pub fn average(&self, values: &mut [Vec3], first: usize) {
        representatives::average(&self.wide, values, first, first + self.surfels as usize);
    }

    /// The eight-wide nodes; the first is the root.
    pub fn wide(&self) -> &[WideNode] {
        &self.wide
    }

    /// Tight box of all surfels.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Radius of a disk of the area that a surfel has to itself, as the leaves' boxes tell: nine of ten leaves need no
    /// larger one.
    pub fn spacing_extent(&self) -> f32 {
        let of_leaf = |(node, slot): (&WideNode, usize)| {
            let [a, b, c] = node.get_box(slot).extent().to_array();
            let (longest, n) = (a.max(b).max(c), node.count[slot] as f32);
            let second = (a + b + c - longest - a.min(b).min(c)).max(longest / n);
            // A square of k x k surfels reaches over k - 1 spacings.
            (longest * second).sqrt() / (n.sqrt() - 1.0).max(0.5)
        };
        let slots = self.wide.iter().flat_map(|node| (0..CHILDREN).map(move |slot| (node, slot)));
        let leaves = slots.filter(|(node, slot)| node.child[*slot] == 0 && node.count[*slot] > 1);
        let mut spacings: Vec<f32> = leaves.map(of_leaf).filter(|s| *s > 0.0).collect();
        // Of one surfel, or several at one place, nothing is known.
        let Some(last) = spacings.len().checked_sub(1) else {
            let Aabb { min, max } = self.bounds();
            return (0.01 * min.abs().max(max.abs()).max_element()).max(f32::MIN_POSITIVE.sqrt());
        };
        let (_, spacing, _) = spacings.select_nth_unstable_by(last * 9 / 10, f32::total_cmp);
        *spacing / std::f32::consts::PI.sqrt()
    }

    /// Leaves, depth and filling.
    pub fn statistics(&self) -> KdTreeStatistics {
        self.statistics
    }

    /// Checks every invariant; else says which node breaks which.
    #[cfg(test)]
    pub(crate) fn validate(&self, surfels: &Surfels, limits: KdTreeLimits) -> Result<(), String> {
        let mut next = 0u32;
        for (i, node) in self.nodes.iter().enumerate() {
            let range = node.first as usize..(node.first + node.count) as usize;
            if node.count == 0 {
                return Err(format!("node {i} is empty"));
            }
            if Aabb::of(range.clone().map(|s| surfels.position(s))) != node.bounds {
                return Err(format!("the box of node {i} is not tight"));
            }
            for s in range {
                if surfels.normals[s].dot(node.cone.axis) < node.cone.cosine {
                    return Err(format!("the normal of surfel {s} leaves the cone of node {i}"));
                }
            }
            if node.right == 0 {
                if node.first != next {
                    return Err(format!("leaf {i} starts at {} instead of {next}", node.first));
                }
                next += node.count;
                let small = node.bounds.diagonal() <= limits.leaf_size * self.bounds().diagonal();
                if node.count > limits.leaf_points && !small {
                    return Err(format!("leaf {i} holds {} surfels", node.count));
                }
            } else {
                let (left, right) = (&self.nodes[i + 1], &self.nodes[i + node.right as usize]);
                if left.first != node.first
                    || right.first != node.first + left.count
                    || left.count + right.count != node.count
                {
                    return Err(format!("the children of node {i} do not share out its range"));
                }
            }
        }
        if next as usize != surfels.len() {
            return Err(format!("the leaves hold {next} of {} surfels", surfels.len()));
        }
        wide::validate(&self.wide, &self.nodes)
    }
}

impl KdTreeStatistics {
    fn of(nodes: &[Node]) -> Self {
        let mut depths = Vec::with_capacity(64);
        let (mut leaves, mut depth_sum) = (0usize, 0usize);
        for node in nodes {
            let depth = depths.pop().unwrap_or(0usize);
            if node.right == 0 {
                leaves += 1;
                depth_sum += depth;
            } else {
                depths.push(depth + 1);
                depths.push(depth + 1);
            }
        }
        Self {
            leaves,
            mean_depth: depth_sum as f64 / leaves as f64,
            points_per_leaf: f64::from(nodes[0].count) / leaves as f64,
        }
    }
}

#[cfg(test)]
mod tests;
