use glam::Vec3;

use super::*;
use crate::geometry::surfel::PADDING;

/// SplitMix64 as numbers in 0..1.
pub(crate) fn numbers(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

fn cloud(n: usize, seed: u64) -> Surfels {
    let mut next = numbers(seed);
    let mut s = Surfels::default();
    for i in 0..n {
        let p = Vec3::new(next() * 3.0, next(), next() * 0.5);
        s.x.push(p.x);
        s.y.push(p.y);
        s.z.push(p.z);
        s.normals.push((p - Vec3::splat(0.3)).normalize_or(Vec3::Y));
        s.albedo.push(Vec3::splat(i as f32));
        s.radiance.push(Vec3::ZERO);
        s.extent.push(0.1);
    }
    for list in [&mut s.x, &mut s.y, &mut s.z] {
        list.extend([0.0; PADDING]);
    }
    s
}

#[test]
fn holds_its_invariants_at_every_size() {
    for (n, leaf) in [(1, 16), (2, 1), (15, 4), (16, 16), (17, 16), (1000, 7), (30_000, 16)] {
        let limits = KdTreeLimits { leaf_points: leaf, leaf_size: 0.0 };
        let before = cloud(n, 7);
        let mut surfels = before.clone();
        let tree = KdTree::build(&mut surfels, limits);
        tree.validate(&surfels, limits).unwrap();
        // Every surfel is still there, with its own attributes.
        for i in 0..n {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let from = surfels.albedo[i].x as usize;
            assert_eq!(surfels.position(i), before.position(from));
            assert_eq!(surfels.normals[i], before.normals[from]);
        }
        let mut seen: Vec<f32> = surfels.albedo.iter().map(|a| a.x).collect();
        seen.sort_by(f32::total_cmp);
        assert!(seen.windows(2).all(|w| w[0] != w[1]));
    }
}

#[test]
fn all_wide_nodes_above_leaves_but_one_are_full() {
    // By medians alone nearly all would hold four or five of the last two.
    for n in [8 * 64, 8 * 4099 - 3, 8 * 5000] {
        let limits = KdTreeLimits { leaf_points: 8, leaf_size: 0.0 };
        let tree = KdTree::build(&mut cloud(n, 13), limits);
        let last: Vec<&WideNode> = tree.wide().iter().filter(|w| w.child == [0; 8]).collect();
        assert_eq!(last.len(), n.div_ceil(64));
        assert!(last.iter().filter(|w| w.used != 0xff).count() <= 1, "{n}");
    }
}

#[test]
fn validation_sees_a_broken_tree() {
    let limits = KdTreeLimits::default();
    let mut surfels = cloud(500, 3);
    let tree = KdTree::build(&mut surfels, limits);
    surfels.x[123] += 10.0;
    assert!(tree.validate(&surfels, limits).is_err());
}

#[test]
fn ends_at_a_size() {
    let limits = KdTreeLimits { leaf_points: 1, leaf_size: 0.25 };
    let mut surfels = cloud(4000, 9);
    let tree = KdTree::build(&mut surfels, limits);
    tree.validate(&surfels, limits).unwrap();
    assert!(tree.statistics().points_per_leaf > 10.0);
}

#[test]
fn points_that_coincide_end_in_leaves() {
    let mut surfels = cloud(100, 5);
    surfels.x.fill(1.0);
    surfels.y.fill(2.0);
    surfels.z.fill(3.0);
    let limits = KdTreeLimits { leaf_points: 8, leaf_size: -1.0 };
    let tree = KdTree::build(&mut surfels, limits);
    tree.validate(&surfels, limits).unwrap();
}

#[test]
fn is_the_same_for_any_number_of_threads() {
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut surfels = cloud(50_000, 11);
        pool.install(|| KdTree::build(&mut surfels, KdTreeLimits::default()));
        (surfels.x, surfels.albedo)
    };
    assert_eq!(build(1), build(3));
}
