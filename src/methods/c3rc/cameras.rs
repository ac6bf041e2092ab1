//! From visible patches to cameras: construction rays, guard band, whole-object rejection, object space.

use fearless_simd::{Level, dispatch};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::super::FrameInput;
use super::footprint::Footprint;
use super::guard::{self, Guard, MAX_GUARD, Outline};
use crate::accel::kd_tree::{CHILDREN, WideNode};
use crate::camera::Eye;
use crate::camera::RayScale;
use crate::camera::three_ray::multiplicity::mixed_sign_range;
use crate::camera::three_ray::{BoxTest, Rays, ThreeRay, ViewVolume, array};
use crate::cull::{Tested, test_children};
use crate::geometry::Similarity;
use crate::geometry::lanes::simd_level;
use crate::plan::{CELL_SLACK_PX, CameraInstance, EVENNESS, Gaze, SplatShape, Volume};
use crate::scene::prepared::{Cloud, PreparedScene};
use crate::visibility::Patch;

/// Surfels a hair behind the mirror still count as touching it: this share of the eye's distance (untuned).
pub(super) const CONTACT: f64 = 1e-5;
/// λ ends at this many times the farthest object's distance over the shortest ray: rays interpolated much
/// shorter than the three given ones are not followed further.
const SHORTENING: f64 = 1e3;
/// No camera has more than so many times the detail that was asked for (untuned).
const MOST_DETAIL: f64 = 64.0;
/// For the rounding of a gaze's cosine.
const GAZE_SLACK: f64 = 1e-5;

/// What the cameras depend on besides the scene.
#[derive(Clone, Copy)]
pub(super) struct CameraSettings {
    pub(super) ray_scale: RayScale,
    pub(super) shape: SplatShape,
    pub(super) detail: f64,
    /// Whether mirrors hide what lies behind them.
    pub(super) mirror_occlusion: bool,
}

impl CameraSettings {
    /// How far a splat may lie from a pixel's centre that it covers, in pixels.
    fn reach(self) -> f64 {
        f64::from(self.shape.reach())
    }
}

/// The cameras of all patches, by patch and object, and where each patch's begin.
pub(super) fn cameras(
    frame: FrameInput<'_>,
    patches: &[Patch],
    settings: CameraSettings,
) -> (Vec<CameraInstance>, Vec<u32>) {
    let top = Top::new(frame.scene, frame.eye);
    let lists: Vec<Vec<CameraInstance>> = patches
        .par_chunks(32)
        .enumerate()
        .map(|(chunk, patches)| {
            let mut list = Vec::new();
            for (i, patch) in patches.iter().enumerate() {
                let index = u32::try_from(chunk * 32 + i).expect("fewer patches than pixels");
                let view = of_triangle(frame, patch, settings.ray_scale);
                of_view(frame, &top, &view, index, settings, &mut list);
            }
            list
        })
        .collect();
    let cameras: Vec<CameraInstance> = lists.concat();
    let starts = starts(&cameras, patches.len());
    (cameras, starts)
}

/// Where each patch's cameras begin.
pub(super) fn starts(cameras: &[CameraInstance], patches: usize) -> Vec<u32> {
    let mut starts = vec![0u32; patches + 1];
    for camera in cameras {
        starts[camera.patch as usize + 1] += 1;
    }
    for i in 0..patches {
        starts[i + 1] += starts[i];
    }
    starts
}

/// A patch and its rays, scene space.
pub(super) struct View<'a> {
    pub(super) patch: &'a Patch,
    pub(super) rays: Rays,
    /// Positive where a corner's ray leaves the mirror on the side that is seen.
    pub(super) front: [f64; 3],
    /// Of a cell: what holds its pixels, and how far beyond it its rays may be continued, in pixels.
    pub(super) outline: Option<(Outline, DVec2)>,
}

fn of_triangle<'a>(frame: FrameInput<'_>, patch: &'a Patch, scale: RayScale) -> View<'a> {
    let position = frame.eye.position;
    let mirror = frame.scene.mirror_triangle(patch.triangle.0);
    let whole = Rays {
        origins: mirror.corners.map(|v| v.as_dvec3()),
        directions: mirror.corner_directions(position, scale),
    };
    let facing = DVec3::from_array(mirror.facing_seen(position));
    let front = patch.corners.map(|w| w.dot(facing));
    View { patch, rays: whole.part(patch.corners), front, outline: None }
}

/// The clouds' boxes in scene space, eight at a time.
pub(super) struct Top {
    pub(super) objects: Vec<WideNode>,
    pub(super) mirrors: Vec<WideNode>,
    /// By group and slot, the objects' first: how far a kernel reaches beyond its surfel, scene units.
    pub(super) reaches: Vec<[f32; CHILDREN]>,
    /// Mirrors nearer to where a ray starts than this do not hide what it sees.
    pub(super) clearance: f64,
    /// No object is farther from the eye than this.
    reach: f64,
    pub(super) level: Level,
}

impl Top {
    pub(super) fn new(scene: &PreparedScene, eye: &Eye) -> Self {
        let (objects, mirrors) = scene.clouds.split_at(scene.objects.len());
        let far = |cloud: &Cloud| {
            let b = cloud.bounds;
            let far = (b.min - eye.position).abs().max((b.max - eye.position).abs());
            far.as_dvec3().length()
        };
        Self {
            objects: groups(objects),
            mirrors: groups(mirrors),
            reaches: reaches(objects).chain(reaches(mirrors)).collect(),
            clearance: f64::from(scene.mirror_clearance()),
            reach: objects.iter().map(far).fold(0.0, f64::max),
            level: simd_level(),
        }
    }
}

/// How far surfels' kernels reach.
fn reaches(clouds: &[Cloud]) -> impl Iterator<Item = [f32; CHILDREN]> {
    clouds.chunks(CHILDREN).map(|clouds| {
        let mut reach = [0.0; CHILDREN];
        for (reach, cloud) in reach.iter_mut().zip(clouds) {
            #[expect(clippy::cast_possible_truncation, reason = "a bound, not a measure")]
            let scale = cloud.to_scene.scale as f32;
            *reach = 2.0 * cloud.extent * scale;
        }
        reach
    })
}

fn groups(clouds: &[Cloud]) -> Vec<WideNode> {
    let of = |clouds: &[Cloud]| {
        let mut group = WideNode::EMPTY;
        for (slot, cloud) in clouds.iter().enumerate() {
            group.set_box(slot, cloud.bounds);
        }
        group
    };
    clouds.chunks(CHILDREN).map(of).collect()
}

/// What a view may see at most.
struct Bounds {
    corners_px: [DVec3; 3],
    volume: Volume,
    lambda: [f32; 2],
}

impl Bounds {
    /// `None` if the view's triangle has no area.
    fn new(eye: &Eye, top: &Top, view: &View<'_>, settings: CameraSettings) -> Option<Self> {
        let View { patch, rays, outline, .. } = view;
        let [v1, v2, v3] = rays.origins;
        if (v2 - v1).cross(v3 - v1) == DVec3::ZERO {
            return None;
        }
        let position = eye.position.as_dvec3();
        let corners_px = rays.origins.map(|v| homogeneous(eye, v));
        let reach = settings.reach();
        let around = match outline {
            Some(outline) => Grown::around(outline, &corners_px, reach, DVec2::INFINITY),
            None => Grown::Three(guard::around(&corners_px, patch, reach)),
        };
        let shortest = rays.directions.iter().map(|d| d.length()).fold(f64::INFINITY, f64::min);
        let size = rays.origins.map(|v| (v - position).length());
        let farthest = size.iter().fold(0.0, |m: f64, &s| m.max(s));
        #[expect(clippy::cast_possible_truncation, reason = "a bound, not a measure")]
        let lambda = [
            (-CONTACT * farthest / shortest) as f32,
            (SHORTENING * (top.reach + farthest) / shortest) as f32,
        ];
        Some(Self { corners_px, volume: around.volume(rays), lambda })
    }

    fn test(&self, top: &Top, group: &WideNode, lambda: [f32; 2]) -> Tested {
        let test = BoxTest::Slab;
        match &self.volume {
            Volume::Three(v) => {
                dispatch!(top.level, simd => test_children(simd, group, v, test, lambda))
            }
            Volume::Four(v) => {
                dispatch!(top.level, simd => test_children(simd, group, v, test, lambda))
            }
        }
    }
}

/// Whether a view may see an object at all.
pub(super) fn sees_objects(
    eye: &Eye,
    top: &Top,
    view: &View<'_>,
    settings: CameraSettings,
) -> bool {
    Bounds::new(eye, top, view, settings)
        .is_some_and(|b| top.objects.iter().any(|g| b.test(top, g, b.lambda).meets & g.used != 0))
}

/// Appends the cameras of one view: one for each object that it may see, then one for each mirror that may hide it.
pub(super) fn of_view(
    frame: FrameInput<'_>,
    top: &Top,
    view: &View<'_>,
    index: u32,
    settings: CameraSettings,
    out: &mut Vec<CameraInstance>,
) {
    let FrameInput { scene, eye, visibility } = frame;
    let View { patch, rays, front, outline } = view;
    let Some(bounds) = Bounds::new(eye, top, view, settings) else { return };
    let corners_px = bounds.corners_px;
    let position = eye.position.as_dvec3();
    let reach = settings.reach();
    // Most patches see no object.
    let mut exact = None;
    let hiders = if settings.mirror_occlusion { &top.mirrors[..] } else { &[] };
    let length = rays.directions.iter().map(|d| d.length()).sum::<f64>() / 3.0;
    #[expect(clippy::cast_possible_truncation, reason = "not a sharp limit")]
    let clear = (top.clearance / length) as f32;
    let mut farthest = f32::NEG_INFINITY;
    let groups = top.objects.iter().map(|group| (group, false));
    for (g, (group, hides)) in groups.chain(hiders.iter().map(|group| (group, true))).enumerate() {
        // What hides nothing need not be looked at.
        let lambda = if hides { [clear, farthest] } else { bounds.lambda };
        if lambda[0] >= lambda[1] {
            break;
        }
        let tested = bounds.test(top, group, lambda);
        let mut bits = tested.meets & group.used;
        while bits != 0 {
            let slot = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let object = match hides {
                true => scene.objects.len() + (g - top.objects.len()) * CHILDREN + slot,
                false => g * CHILDREN + slot,
            };
            let cloud = &scene.clouds[object];
            let to_scene = &cloud.to_scene;
            let range = [tested.lo[slot], tested.hi[slot]];
            if !hides {
                farthest = farthest.max(range[1]);
            }
            let range_f64 = range.map(f64::from);
            let radius = f64::from(EVENNESS) * to_scene.scale * f64::from(cloud.extent);
            let (screen, guard, footprint, leaves) = exact.get_or_insert_with(|| {
                let screen = screen_forms(eye, patch, rays.origins);
                let guard = match outline {
                    Some(_) => None,
                    None => Some(Guard::new(&corners_px, visibility, patch, reach)),
                };
                let before = corners_px.iter().all(|c| c.z > 0.0);
                let px = |c: DVec3| if before { c.truncate() / c.z } else { DVec2::NAN };
                let mirror = scene.mirror_triangle(patch.triangle.0);
                let leaves = !mirror.is_seen_from_behind(eye.position);
                (screen, guard, Footprint::new(&corners_px.map(px), rays), leaves)
            });
            let detail = match outline {
                Some(_) => settings.detail,
                None => own_detail(settings.detail, &corners_px, footprint, range_f64),
            };
            // A representative's disk has the area of a share of a pixel.
            let holds = |lambda: f64| {
                let area = if detail > 0.0 { footprint.area_per_px(lambda) / detail } else { 0.0 };
                radius.max(f64::from(EVENNESS) * (area / std::f64::consts::PI).sqrt())
            };
            let grown = match (guard, outline) {
                (Some(guard), _) => {
                    Grown::Three(guard.margins(guard::splat_px(holds, footprint, range_f64)))
                }
                (None, Some(outline)) => {
                    let [lo, hi] = range_f64;
                    let extent =
                        |lambda: f64| footprint.extent_px(lambda, outline.0.along) * holds(lambda);
                    let extents = [lo, 0.5 * (lo + hi), hi].map(extent);
                    let most = extents.into_iter().fold(DVec2::ZERO, DVec2::max);
                    Grown::around(outline, &corners_px, reach, most)
                }
                (None, None) => unreachable!("triangles have guards"),
            };
            let own = rays_in(to_scene, rays);
            let own_grown = grown.triangle(&own);
            let several = mixed_sign_range(&own_grown, range_f64[0], range_f64[1]);
            let from_eye = rays.origins.map(|v| v - position);
            #[expect(clippy::cast_possible_truncation, reason = "rounded once")]
            out.push(CameraInstance {
                patch: index,
                object: u32::try_from(object).expect("fewer than 2^32 objects"),
                camera: ThreeRay {
                    // What hides is best left out where it is not certain.
                    disk: if settings.shape == SplatShape::Ellipse && !hides {
                        EVENNESS * cloud.extent
                    } else {
                        0.0
                    },
                    ..grown.camera(&own)
                },
                volume: grown.volume(&own),
                lambda: range,
                several: several.map_or([1.0, 0.0], |(a, b)| [a as f32, b as f32]),
                direction: [0, 1, 2].map(|k| linear_form(rays.directions.map(|d| d[k]))),
                rotation: {
                    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| to_scene.direction(v));
                    [0, 1, 2].map(|k| axes.map(|axis| axis[k] as f32))
                },
                screen: *screen,
                per_px: [footprint.base, footprint.per_lambda]
                    .map(|m| [m.x_axis, m.y_axis].map(|x| array(x / radius))),
                gaze: gaze(cloud, &own_grown, hides && *leaves),
                representatives: cloud.representatives.start,
                detail: detail as f32,
                radius: radius as f32,
                extent: cloud.extent,
                footprint: {
                    // In the object's space, where the culling is.
                    let per_unit = to_scene.scale.powi(-2);
                    footprint.quadratics().map(|q| q.map(|x| (x * per_unit) as f32))
                },
                guard: grown.guard(),
                front: linear_form(*front),
                from_eye: [0, 1, 2].map(|k| linear_form(from_eye.map(|v| v[k]))),
            });
        }
    }
}

/// What a camera has to see, beyond its patch's own pixels.
enum Grown {
    /// The margins of a triangle's weights.
    Three(DVec3),
    /// The weights of the corners of a rectangle on the screen.
    Four([DVec3; 4]),
}

impl Grown {
    /// Of a cell, for splats that are so long at most along its outline's sides.
    fn around(
        (outline, most): &(Outline, DVec2),
        corners_px: &[DVec3; 3],
        reach: f64,
        splat_px: DVec2,
    ) -> Self {
        let px = splat_px.min(DVec2::splat(reach)).min(*most) + f64::from(CELL_SLACK_PX);
        Self::Four(guard::weights_of(corners_px, outline.grown(px)))
    }

    fn volume(&self, rays: &Rays) -> Volume {
        match self {
            Self::Three(margins) => Volume::Three(ViewVolume::new(&rays.grown(*margins))),
            Self::Four(corners) => Volume::Four(ViewVolume::new(&rays.part(*corners))),
        }
    }

    fn camera(&self, rays: &Rays) -> ThreeRay<f32> {
        match self {
            Self::Three(margins) => ThreeRay::new(rays, &rays.grown(*margins)),
            Self::Four(corners) => ThreeRay::new(rays, &rays.part(*corners)),
        }
    }

    /// A triangle that holds it.
    fn triangle(&self, rays: &Rays) -> Rays {
        match self {
            Self::Three(margins) => rays.grown(*margins),
            Self::Four(corners) => {
                rays.grown(-corners.iter().copied().fold(DVec3::INFINITY, DVec3::min))
            }
        }
    }

    /// How far outside the triangle images are drawn; where the screen's rectangle decides: everywhere.
    fn guard(&self) -> [f32; 3] {
        match self {
            Self::Three(margins) => array(*margins),
            Self::Four(_) => [f32::MAX; 3],
        }
    }
}

/// The detail for one camera: more than `detail` where its triangle is so thin that a representative could cover all of
/// its pixels from beyond the guard band.
fn own_detail(detail: f64, corners: &[DVec3; 3], footprint: &Footprint, range: [f64; 2]) -> f64 {
    let px = corners.map(|c| c.truncate() / c.z);
    let edges = [px[1] - px[0], px[2] - px[1], px[0] - px[2]];
    let longest = edges.iter().fold(0.0, |m: f64, e| m.max(e.length()));
    let band = MAX_GUARD * edges[0].perp_dot(edges[1]).abs() / longest;
    let [lo, hi] = range;
    let reach = [lo, 0.5 * (lo + hi), hi]
        .into_iter()
        .map(|lambda| {
            let radius =
                f64::from(EVENNESS) * (footprint.area_per_px(lambda) / std::f64::consts::PI).sqrt();
            radius * footprint.px_per_unit(lambda)
        })
        .fold(0.0, f64::max);
    let needed = (reach / band).powi(2);
    if needed.is_finite() { detail.max(needed.min(detail * MOST_DETAIL)) } else { detail }
}

/// See [`CameraInstance::gaze`]. From inside an object its far side is seen from behind; `leaves`: the rays start on its
/// outside or elsewhere.
#[expect(clippy::cast_possible_truncation, reason = "rounded once, with a margin")]
fn gaze(cloud: &Cloud, rays: &Rays, leaves: bool) -> Option<Gaze> {
    let bounds = cloud.tree.bounds();
    let outside = |v: &DVec3| !bounds.contains(v.as_vec3());
    if !cloud.closed || !(leaves || rays.origins.iter().all(outside)) {
        return None;
    }
    let axis = rays.axis()?;
    let cosines = rays.directions.iter().map(|d| d.normalize_or_zero().dot(axis));
    let cosine = cosines.fold(1.0, f64::min) - GAZE_SLACK;
    let sine = (1.0 - cosine * cosine).sqrt();
    (cosine > 0.0).then_some(Gaze { axis: array(axis), cosine: cosine as f32, sine: sine as f32 })
}

fn rays_in(to_scene: &Similarity, rays: &Rays) -> Rays {
    Rays {
        origins: rays.origins.map(|v| to_scene.inverse_point(v)),
        directions: rays.directions.map(|d| to_scene.inverse_direction(d) / to_scene.scale),
    }
}

/// Values at the corners as value_1 + b2·(value_2 - value_1) + b3·(value_3 - value_1).
#[expect(clippy::cast_possible_truncation, reason = "rounded once")]
fn linear_form(values: [f64; 3]) -> [f32; 3] {
    let [a, b, c] = values;
    [a as f32, (b - a) as f32, (c - a) as f32]
}

fn homogeneous(eye: &Eye, v: DVec3) -> DVec3 {
    let p = v - eye.position.as_dvec3();
    let w = p.dot(eye.forward.as_dvec3());
    let focal = f64::from(eye.focal_px);
    DVec3::new(
        focal * p.dot(eye.right.as_dvec3()) + 0.5 * f64::from(eye.size.width) * w,
        -focal * p.dot(eye.up.as_dvec3()) + 0.5 * f64::from(eye.size.height) * w,
        w,
    )
}

fn screen_forms(eye: &Eye, patch: &Patch, corners: [DVec3; 3]) -> [[f32; 3]; 3] {
    let [left, top] = patch.rect.min.map(f64::from);
    let h = corners.map(|v| homogeneous(eye, v));
    [
        linear_form(h.map(|h| h.x - left * h.z)),
        linear_form(h.map(|h| h.y - top * h.z)),
        linear_form(h.map(|h| h.z)),
    ]
}
