//! How even a thinned cloud is, and how large the disks are.

use std::num::NonZero;

use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::*;
use crate::geometry::Mesh;
use crate::scene::description::Paint;
use crate::scene::sample::sample;

fn tree(points: &[Vec3]) -> ImmutableKdTree<f32, 3> {
    let points: Vec<[f32; 3]> = points.iter().map(|p| p.to_array()).collect();
    ImmutableKdTree::new_from_slice(&points).unwrap()
}

/// Mean distance of nearest neighbours by that of white noise (Clark & Evans 1954), and the least distance in mean spacings.
fn evenness(points: &[Vec3], area: f32) -> (f32, f32) {
    let spacing = (area / points.len() as f32).sqrt();
    let tree = tree(points);
    let two = NonZero::new(2).unwrap();
    let near = |p: &Vec3| {
        let found = tree.query(&p.to_array()).nearest_n::<SquaredEuclidean<f32>>(two).execute();
        found[1].distance.sqrt() / spacing
    };
    let near: Vec<f32> = points.iter().map(near).collect();
    (2.0 * near.iter().sum::<f32>() / near.len() as f32, near.iter().copied().fold(9.0, f32::min))
}

#[test]
fn a_dense_cloud_is_thinned_evenly() {
    let (white, _) = evenness(&noise(100_000), 1.0);
    assert!((white - 1.0).abs() < 0.02, "{white}");
    for (dense, most) in [(400_000, 20_000), (400_000, 90_000), (400_000, 250_000)] {
        let found = made(&noise(dense), most);
        let count = found.surfels.len();
        assert!(count <= most && count as f64 > 0.985 * most as f64, "{count} of {most}");
        assert_eq!(found.counts.thinned + found.counts.outliers + count, found.counts.read);
        let (ratio, closest) = evenness(&places(&found), 1.0);
        println!("{dense} to {count}: {ratio} {closest}");
        assert!(ratio > 1.2, "{dense} to {count}: {ratio}");
    }
    // A hundred times as dense on one half: the other one keeps what it has.
    let mut uneven = noise(200_000);
    uneven.iter_mut().for_each(|p| p.x = if p.x < 0.01 { p.x * 50.0 } else { 0.5 + p.x * 0.5 });
    let found = places(&made(&uneven, 8_000));
    let sparse = found.iter().filter(|p| p.x < 0.5).count();
    println!("{sparse} of {} on the sparse half", found.len());
    assert!(sparse > 1_500, "{sparse}");
}

/// Part of a plane that lies further than so many extents from all disks' middles.
fn holes(cloud: &PointCloud, times: f32) -> f64 {
    let points = places(cloud);
    let tree = tree(&points);
    let twenty = NonZero::new(20).unwrap();
    let probes: Vec<Vec3> = (0..50_000)
        .map(|i| {
            Vec3::new(
                0.05 + 0.9 * unit32((1 << 50) + 2 * i),
                0.0,
                0.05 + 0.9 * unit32((1 << 50) + 2 * i + 1),
            )
        })
        .collect();
    let open = probes.iter().filter(|p| {
        let found = tree.query(&p.to_array()).nearest_n::<SquaredEuclidean<f32>>(twenty).execute();
        found.iter().all(|n| n.distance.sqrt() > times * cloud.surfels.extent[n.item as usize])
    });
    open.count() as f64 / probes.len() as f64
}

#[test]
fn disks_are_as_large_as_their_share_of_the_area_and_leave_no_holes() {
    let corners = vec![Vec3::ZERO, Vec3::Z, Vec3::ONE - Vec3::Y, Vec3::X];
    let plane = Mesh::new(corners, vec![], vec![], vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let even = sample(&plane, &Paint::Vertex, 40_000, 1, &Context::default()).unwrap();
    let truth = even.extent[0];
    let even = made(&(0..even.len()).map(|i| even.position(i)).collect::<Vec<_>>(), usize::MAX);
    let mean = even.surfels.extent.iter().sum::<f32>() / 40_000.0;
    println!("even: {mean} for {truth}");
    assert!((mean / truth - 1.0).abs() < 0.05, "{mean} for {truth}");
    let largest = even.surfels.extent.iter().copied().fold(0.0, f32::max);
    println!("largest {}", largest / truth);
    assert!(largest < 2.5 * truth, "{largest}");

    let random = made(&noise(40_000), usize::MAX);
    let truth = (1.0_f32 / 40_000.0 / std::f32::consts::PI).sqrt();
    let extents = &random.surfels.extent;
    let mean = extents.iter().sum::<f32>() / extents.len() as f32;
    let largest = extents.iter().copied().fold(0.0, f32::max);
    println!("random: mean {} largest {}", mean / truth, largest / truth);
    for (times, most) in [(1.0, 0.2), (1.3, 0.025), (1.6, 0.004)] {
        let open = [holes(&random, times), holes(&even, times)];
        println!("{times}: {open:?}");
        assert!(open[0] < most && open[1] < most, "{times}: {open:?}");
    }
    assert!(holes(&even, 1.6) < 1e-4);
    assert!(largest < 5.0 * truth);
}
