//! What the parts of a mirror cost: a spout, a handle, a knob.

use std::ops::Range;

use super::triangle_costs;
use crate::camera::Eye;
use crate::error::Result;
use crate::methods::Params;
use crate::scene::PreparedScene;
use crate::scene::builtin;
use crate::scene::description::Source;
use crate::visibility::{NONE_ID, Visibility};

/// What a part of a mirror costs in a frame by the method c3rc.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartCost {
    /// The mirror's name, and the part's if it has several.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Those that a pixel's centre shows.
    pub visible: usize,
    /// Pixels whose centres show it.
    pub pixels: usize,
    /// Visible triangles that surfels are projected for.
    pub projecting: usize,
    /// Surfels projected, over all its triangles.
    pub projections: u64,
    /// Most of them for one triangle.
    pub most: u32,
}

/// The costs of all parts of all mirrors, see [`triangle_costs`].
///
/// # Errors
/// The method refuses its parameters.
pub fn part_costs(
    scene: &PreparedScene,
    eye: &Eye,
    visibility: &Visibility,
    params: &Params,
) -> Result<Vec<PartCost>> {
    let costs = triangle_costs(scene, eye, visibility, params)?;
    let mut pixels = vec![0_usize; costs.len()];
    for &id in visibility.mirror_ids.iter().filter(|&&id| id != NONE_ID) {
        pixels[id as usize] += 1;
    }
    let cost = |(name, range): (String, Range<usize>)| PartCost {
        name,
        triangles: range.len(),
        visible: range.clone().filter(|&t| pixels[t] > 0).count(),
        pixels: pixels[range.clone()].iter().sum(),
        projecting: costs[range.clone()].iter().filter(|&&n| n > 0).count(),
        projections: costs[range.clone()].iter().map(|&n| u64::from(n)).sum(),
        most: costs[range].iter().copied().max().unwrap_or(0),
    };
    Ok(regions(scene).into_iter().map(cost).collect())
}

/// Names and triangles (over all mirrors) of all parts.
fn regions(scene: &PreparedScene) -> Vec<(String, Range<usize>)> {
    let mut list = Vec::new();
    for mirror in &scene.mirrors {
        let (first, count) = (mirror.first_triangle as usize, mirror.mesh.triangles().len());
        let parts = match &mirror.source {
            Some(Source::Shape { name, triangles }) => builtin::regions(name, *triangles),
            _ => vec![("", 0..count)],
        };
        let several = parts.len() > 1;
        list.extend(parts.into_iter().map(|(part, range)| {
            let name =
                if several { format!("{} {part}", mirror.name) } else { mirror.name.clone() };
            (name, first + range.start.min(count)..first + range.end.min(count))
        }));
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::eye::ImageSize;
    use crate::context::Context;
    use crate::frame::Renderer;
    use crate::methods::method;
    use crate::scene::arrange::{self, Request};
    use crate::scene::prepared::{PrepareOptions, PreparedScene};

    #[test]
    fn parts_share_the_frames_projections_and_pixels() {
        let cx = Context::default();
        let request = Request { inputs: vec!["knot".into()], ..Request::default() };
        let scene = arrange::scene(&request, &cx).unwrap();
        let options = PrepareOptions { surfels: 5000, ..PrepareOptions::default() };
        let scene = PreparedScene::new(&scene, &options, &cx).unwrap();
        let eye = scene.eye_for(ImageSize { width: 320, height: 180 }).unwrap();
        let c3rc = method("c3rc").unwrap();
        let mut params = Params::defaults(c3rc.info().params);
        for (id, value) in [("cameras", "triangles"), ("detail", "0")] {
            params.set(c3rc.info().param(id), value).unwrap();
        }
        let mut renderer = Renderer::new();
        let report = renderer.render(&scene, &eye, c3rc, &params, false, &cx).unwrap();
        let parts = part_costs(&scene, &eye, renderer.visibility(), &params).unwrap();
        let names: Vec<&str> = parts.iter().map(|p| p.name.as_str()).collect();
        let expected = ["rim", "body", "knob", "lid", "handle", "spout"];
        assert_eq!(names, expected.map(|part| format!("teapot {part}")));
        assert_eq!(parts.iter().map(|p| p.triangles).sum::<usize>(), scene.mirror_triangle_count());
        assert_eq!(parts.iter().map(|p| p.pixels).sum::<usize>(), report.mirror_pixels);
        assert_eq!(parts.iter().map(|p| p.projections).sum::<u64>(), report.projections.unwrap());
        let mean = |i: usize| parts[i].projections as f64 / parts[i].projecting.max(1) as f64;
        assert!(mean(2) > 2.0 * mean(1), "the knob's cameras are wider: {parts:?}");
    }
}
