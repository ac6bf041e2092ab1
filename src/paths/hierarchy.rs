//! A tree over cameras, walked with boxes of points: each node is tested as one moving set (Mei et al. section 5.2
//! turned around; the test is sweep separation).

use glam::DVec3;

use super::cameras::Camera;

/// Directions along which nodes are separated from boxes: the axes and the diagonals of a cube.
const NORMALS: [DVec3; 7] = [
    DVec3::X,
    DVec3::Y,
    DVec3::Z,
    DVec3::ONE,
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
];

/// Margin for rounding and for weights down to -TIE, as a share of the largest term.
const MARGIN: f64 = 1e-8;

/// n·v and n·d of all cameras of a node along one direction n.
#[derive(Clone, Copy)]
struct Span {
    start: [f64; 2],
    speed: [f64; 2],
}

/// A node: a camera, or two nodes behind one another.
struct Node {
    spans: [Span; NORMALS.len()],
    /// Index of the camera in a leaf, else of the second child; the first one follows its parent.
    next: u32,
    leaf: bool,
}

/// See the module.
pub(super) struct Hierarchy {
    nodes: Vec<Node>,
}

impl Hierarchy {
    pub(super) fn new(cameras: &[Camera]) -> Self {
        let mut order: Vec<u32> = (0..).zip(cameras).map(|(i, _)| i).collect();
        let mut nodes = Vec::with_capacity(2 * cameras.len());
        if !cameras.is_empty() {
            build(cameras, &mut order, &mut nodes);
        }
        Self { nodes }
    }

    /// Hands every camera that may see a point of the box to `visit`, in no order that matters.
    pub(super) fn visit(&self, min: DVec3, max: DVec3, mut visit: impl FnMut(u32)) {
        let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
        let slabs = NORMALS.map(|n| {
            let (middle, reach) = (n.dot(center), n.abs().dot(half));
            let margin = MARGIN * (n.abs().dot(center.abs()) + reach);
            [middle - reach - margin, middle + reach + margin]
        });
        let mut stack = Vec::with_capacity(64);
        if !self.nodes.is_empty() {
            stack.push(0);
        }
        while let Some(at) = stack.pop() {
            let node: &Node = &self.nodes[at as usize];
            if !node.meets(&slabs) {
                continue;
            }
            if node.leaf {
                visit(node.next);
            } else {
                stack.push(node.next);
                stack.push(at + 1);
            }
        }
    }
}

fn build(cameras: &[Camera], order: &mut [u32], nodes: &mut Vec<Node>) {
    let at = nodes.len();
    let mut spans = NORMALS.map(|_| Span {
        start: [f64::INFINITY, f64::NEG_INFINITY],
        speed: [f64::INFINITY, f64::NEG_INFINITY],
    });
    for &i in order.iter() {
        let rays = &cameras[i as usize].rays;
        for (span, n) in spans.iter_mut().zip(NORMALS) {
            for k in 0..3 {
                span.add(n.dot(rays.origins[k]), n.dot(rays.directions[k]));
            }
        }
    }
    for span in &mut spans {
        span.grow();
    }
    let leaf = order.len() == 1;
    nodes.push(Node { spans, next: order[0], leaf });
    if leaf {
        return;
    }
    // The widest of where cameras start and where they are at λ = 1.
    let keys = |i: u32| {
        let rays = &cameras[i as usize].rays;
        let v = rays.origins.iter().sum::<DVec3>() / 3.0;
        let d = rays.directions.iter().sum::<DVec3>() / 3.0;
        [v.x, v.y, v.z, d.x, d.y, d.z]
    };
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 6];
    for &i in order.iter() {
        for (range, key) in range.iter_mut().zip(keys(i)) {
            *range = [range[0].min(key), range[1].max(key)];
        }
    }
    let width = |k: &usize| range[*k][1] - range[*k][0];
    let axis = (0..6).max_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0);
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| {
        keys(*a)[axis].total_cmp(&keys(*b)[axis]).then(a.cmp(b))
    });
    let (first, second) = order.split_at_mut(half);
    build(cameras, first, nodes);
    nodes[at].next = u32::try_from(nodes.len()).expect("triangles have 32-bit indices");
    build(cameras, second, nodes);
}

impl Span {
    fn add(&mut self, start: f64, speed: f64) {
        self.start = [self.start[0].min(start), self.start[1].max(start)];
        self.speed = [self.speed[0].min(speed), self.speed[1].max(speed)];
    }

    fn grow(&mut self) {
        for [low, high] in [&mut self.start, &mut self.speed] {
            let margin = MARGIN * low.abs().max(high.abs());
            *low -= margin;
            *high += margin;
        }
    }
}

impl Node {
    /// Whether at some λ ≥ 0 no direction separates the node's triangles T(λ) from the slabs.
    fn meets(&self, slabs: &[[f64; 2]; NORMALS.len()]) -> bool {
        let (mut lo, mut hi) = (0.0f64, f64::INFINITY);
        for (span, [low, high]) in self.spans.iter().zip(slabs) {
            // start + λ speed ≤ high for the lowest, ≥ low for the highest.
            for (room, speed) in
                [(high - span.start[0], span.speed[0]), (span.start[1] - low, -span.speed[1])]
            {
                if speed > 0.0 {
                    hi = hi.min(room / speed);
                } else if speed < 0.0 {
                    lo = lo.max(room / speed);
                } else if room < 0.0 {
                    return false;
                }
            }
        }
        lo <= hi * (1.0 + MARGIN)
    }
}
