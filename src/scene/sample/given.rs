//! Surfels of things that were given as points: fewer of them, with colours.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::geometry::Surfels;
use crate::geometry::surfel::PADDING;
use crate::scene::description::Paint;

/// So many of them, at the same distance in their order, each as much larger; all of them if there are no more. They are even
/// in space, too, if the order follows it.
pub fn thinned(surfels: &Surfels, most: usize) -> Surfels {
    let count = surfels.len();
    if count <= most {
        return surfels.clone();
    }
    let most = most.max(1);
    let which: Vec<usize> = (0..most).map(|k| (k * count + count / 2) / most).collect();
    #[expect(clippy::cast_possible_truncation, reason = "rounded")]
    let larger = (count as f64 / which.len() as f64).sqrt() as f32;
    let vectors = |list: &[Vec3]| which.par_iter().map(|&i| list[i]).collect();
    let numbers = |list: &[f32]| {
        let mut own: Vec<f32> = Vec::with_capacity(which.len() + PADDING);
        own.par_extend(which.par_iter().map(|&i| list[i]));
        own
    };
    let axis = |list: &[f32]| {
        let mut own = numbers(list);
        own.resize(which.len() + PADDING, own.last().copied().unwrap_or(0.0));
        own
    };
    let mut extent = numbers(&surfels.extent);
    extent.par_iter_mut().for_each(|extent| *extent *= larger);
    Surfels {
        x: axis(&surfels.x),
        y: axis(&surfels.y),
        z: axis(&surfels.z),
        normals: vectors(&surfels.normals),
        albedo: vectors(&surfels.albedo),
        radiance: vectors(&surfels.radiance),
        extent,
    }
}

/// Gives surfels the colours of a paint; those of vertices and materials are their own already.
pub fn colored(surfels: &mut Surfels, paint: &Paint) {
    match paint {
        Paint::Vertex | Paint::Materials(_) => {}
        Paint::Constant(color) => surfels.albedo.fill(*color),
        Paint::Pattern { kind, colors, period } => {
            for i in 0..surfels.len() {
                let odd = kind.is_odd((surfels.position(i) / *period).to_array());
                surfels.albedo[i] = colors[usize::from(odd)];
            }
        }
    }
}

/// Surfels whose normals cancel out to this part of their area, and point out of a volume, enclose it: a scan may lack what
/// its body stood on (untuned).
const OPEN: f64 = 0.05;

/// Whether surfels enclose something with outward normals, as closed meshes do.
pub fn enclose(surfels: &Surfels) -> bool {
    let middle = (0..surfels.len()).map(|i| surfels.position(i).as_dvec3()).sum::<DVec3>()
        / surfels.len().max(1) as f64;
    let (mut sum, mut volume, mut total) = (DVec3::ZERO, 0.0, 0.0);
    for i in 0..surfels.len() {
        let area = f64::from(surfels.extent[i]).powi(2);
        let normal = surfels.normals[i].as_dvec3();
        sum += normal * area;
        volume += normal.dot(surfels.position(i).as_dvec3() - middle) * area;
        total += area;
    }
    volume > 0.0 && sum.length() < OPEN * total
}

/// What surfels stand for together, in the square of their unit.
pub fn area(surfels: &Surfels) -> f64 {
    let of = |&extent: &f32| f64::from(extent).powi(2) * std::f64::consts::PI;
    surfels.extent[..surfels.len()].iter().map(of).sum()
}

/// The extent of surfels that are all alike and stand for as much.
pub fn mean_extent(surfels: &Surfels) -> f32 {
    let each = area(surfels) / std::f64::consts::PI / surfels.len().max(1) as f64;
    #[expect(clippy::cast_possible_truncation, reason = "rounded")]
    let extent = each.sqrt() as f32;
    extent
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_enclose_and_sheets_do_not() {
        let around = |turn: fn(Vec3) -> Vec3| {
            let at = |i: usize| {
                let (z, angle) = ((i as f32 + 0.5) / 500.0 - 1.0, i as f32 * 2.399_963);
                let r = (1.0 - z * z).max(0.0).sqrt();
                Vec3::new(r * angle.cos(), r * angle.sin(), z) + 9.0
            };
            let axis = |k: usize| -> Vec<f32> { (0..1000 + PADDING).map(|i| at(i)[k]).collect() };
            Surfels {
                x: axis(0),
                y: axis(1),
                z: axis(2),
                normals: (0..1000).map(|i| turn(at(i) - 9.0)).collect(),
                albedo: vec![Vec3::ONE; 1000],
                radiance: vec![Vec3::ZERO; 1000],
                extent: vec![0.1; 1000],
            }
        };
        assert!(enclose(&around(|n| n)));
        assert!(!enclose(&around(|n| -n)), "a hollow");
        assert!(!enclose(&around(|n| if n.z < 0.0 { -n } else { n })), "a sheet over a sheet");
    }

    #[test]
    fn fewer_surfels_cover_the_same_area() {
        let count = 1000;
        let axis = |f: fn(usize) -> f32| -> Vec<f32> { (0..count + PADDING).map(f).collect() };
        let all = Surfels {
            x: axis(|i| i as f32),
            y: axis(|_| 0.0),
            z: axis(|_| 1.0),
            normals: vec![Vec3::Y; count],
            albedo: (0..count).map(|i| Vec3::splat(i as f32)).collect(),
            radiance: vec![Vec3::ZERO; count],
            extent: vec![0.5; count],
        };
        for most in [1, 3, 100, 999] {
            let some = thinned(&all, most);
            assert_eq!((some.len(), some.x.len(), some.extent.len()), (most, most + PADDING, most));
            assert!((area(&some) / area(&all) - 1.0).abs() < 1e-5);
            let steps: Vec<f32> = some.x[..most].windows(2).map(|w| w[1] - w[0]).collect();
            let even = count as f32 / most as f32;
            assert!(steps.iter().all(|step| (step - even).abs() <= 1.0), "{most}: {steps:?}");
            assert!((0..most).all(|i| some.albedo[i].x == some.x[i]));
        }
        assert_eq!(thinned(&all, 0).len(), 1);
        assert_eq!(thinned(&all, 5000).x, all.x);
        assert!(!enclose(&all), "a row");
        let mut painted = all;
        colored(&mut painted, &Paint::Constant(Vec3::X));
        assert_eq!(painted.albedo[7], Vec3::X);
    }
}
