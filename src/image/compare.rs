//! How far a picture is from a reference.

use std::collections::BTreeMap;

use super::{NONE, Picture, Planes, flip};
use crate::error::{Error, Result};

/// Over which pixels of the reference two pictures are compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Set {
    /// All pixels.
    All,
    /// The pixel and its eight neighbours are a mirror's; so none at the border of the picture.
    Mirror,
    /// An object is reflected in the pixel or in one of its eight neighbours.
    Objects,
    /// One of the objects with these ids is reflected in the pixel or in one of its eight neighbours.
    Named(Vec<u32>),
}

/// One of the two sides of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// What is seen.
    pub picture: &'a Picture,
    /// What is known of its pixels.
    pub planes: Option<&'a Planes>,
}

/// What [`compare`] found. `None` = it needs planes that were not given, or there is nothing to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Pixels in the set.
    pub pixels: usize,
    /// Root of the mean squared difference over the pixels and the channels of linear RGB, unclamped.
    pub rmse: f64,
    /// -20·log10(rmse) in dB: the peak is 1. `None` if the pictures are equal (it is infinite).
    pub psnr: Option<f64>,
    /// Mean of [`flip::flip`] over the set; the map itself is made of the whole pictures.
    pub flip: f64,
    /// Objects as the planes of both tell.
    pub objects: Option<Objects>,
    /// FLIP at every pixel of the picture.
    pub flip_map: Vec<f32>,
}

/// Comparison by object id, within the set. With [`Set::Named`] only the named objects count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Objects {
    /// All that count, together.
    pub total: Count,
    /// Each that was met on either side.
    pub by_id: BTreeMap<u32, Count>,
    /// Distance of the world positions where both reflect the same object.
    pub position: Option<Percentiles>,
}

/// Pixels of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// The reference reflects it.
    pub reference: usize,
    /// The reference reflects it, the other side reflects nothing or another object.
    pub missing: usize,
    /// The other side reflects it, the reference reflects no object.
    pub extra: usize,
}

impl Count {
    /// `missing` as a share of the reference's pixels (of one pixel if there are none).
    pub fn missing_share(self) -> f64 {
        self.missing as f64 / self.reference.max(1) as f64
    }

    /// `extra` as a share of the reference's pixels (of one pixel if there are none); may exceed 1.
    pub fn extra_share(self) -> f64 {
        self.extra as f64 / self.reference.max(1) as f64
    }
}

/// Percentiles by nearest rank: the smallest value that at least that share of the values does not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentiles {
    /// 50 %.
    pub median: f32,
    /// 95 %.
    pub p95: f32,
    /// 99 %.
    pub p99: f32,
}

impl Percentiles {
    /// `None` if there are no values.
    pub fn of(mut values: Vec<f32>) -> Option<Self> {
        values.sort_unstable_by(f32::total_cmp);
        let rank =
            |percent: usize| values.get((values.len() * percent).div_ceil(100).max(1) - 1).copied();
        Some(Self { median: rank(50)?, p95: rank(95)?, p99: rank(99)? })
    }
}

/// Compares `a` with `reference` over a set of the reference's pixels.
///
/// # Errors
/// Sizes differ, the set needs planes that the reference lacks, or has no pixel.
pub fn compare(a: Side<'_>, reference: Side<'_>, set: &Set) -> Result<Comparison> {
    let (inside, pixels, rmse) = difference(a, reference, set)?;
    let chosen = || (0..inside.len()).filter(|&i| inside[i]);
    let flip_map = flip::flip(a.picture, reference.picture);
    let flip = chosen().map(|i| f64::from(flip_map[i])).sum::<f64>() / pixels as f64;
    let objects = a.planes.zip(reference.planes).map(|(a, b)| compare_objects(a, b, set, chosen()));
    let psnr = (rmse > 0.0).then(|| -20.0 * rmse.log10());
    Ok(Comparison { pixels, rmse, psnr, flip, objects, flip_map })
}

/// Only [`Comparison::rmse`], which takes a fraction of the time.
///
/// # Errors
/// As [`compare`].
pub fn rmse(a: Side<'_>, reference: Side<'_>, set: &Set) -> Result<f64> {
    difference(a, reference, set).map(|(_, _, rmse)| rmse)
}

/// Which pixels are in the set, their number, and the RMSE over them.
fn difference(a: Side<'_>, reference: Side<'_>, set: &Set) -> Result<(Vec<bool>, usize, f64)> {
    check_sizes(a, reference)?;
    let inside = members(reference, set)?;
    let pixels = inside.iter().filter(|&&inside| inside).count();
    if pixels == 0 {
        return Err(Error::input(
            "reference",
            "",
            "has no pixel in the set to be compared",
            "choose another set, or a view that shows it",
        ));
    }
    let chosen = || (0..inside.len()).filter(|&i| inside[i]);
    let squares: f64 = chosen()
        .flat_map(|i| std::iter::zip(a.picture.rgb[i], reference.picture.rgb[i]))
        .map(|(a, b)| (f64::from(a) - f64::from(b)).powi(2))
        .sum();
    let rmse = (squares / (3 * pixels) as f64).sqrt();
    Ok((inside, pixels, rmse))
}

/// Gives the objects of `planes` the ids that the objects of the same name have in the reference, so that
/// scenes with other objects can be compared. The k-th object of a name goes to the reference's k-th; one that
/// the reference lacks gets an id beyond its. Does nothing if one side has no names.
pub fn renumber(planes: &mut Planes, names: &[String], reference_names: &[String]) {
    if names == reference_names || names.is_empty() || reference_names.is_empty() {
        return;
    }
    let reference_id = |old: usize| {
        let name = names.get(old)?;
        let earlier = names[..old].iter().filter(|&other| other == name).count();
        let same = (0..).zip(reference_names).filter(|&(_, other)| other == name);
        same.map(|(id, _)| id).nth(earlier)
    };
    let beyond = u32::try_from(reference_names.len()).unwrap_or(NONE);
    let new_id =
        |old: u32| reference_id(old as usize).unwrap_or(beyond.saturating_add(old).min(NONE - 1));
    let mut new_ids = BTreeMap::new();
    for id in planes.object.iter_mut().filter(|id| **id != NONE) {
        *id = *new_ids.entry(*id).or_insert_with_key(|&old| new_id(old));
    }
}

fn check_sizes(a: Side<'_>, reference: Side<'_>) -> Result<()> {
    let Picture { width, height, .. } = *reference.picture;
    let of_planes = |planes: &Planes| (planes.width, planes.height);
    for (name, size) in [
        ("picture to compare", Some((a.picture.width, a.picture.height))),
        ("planes of the picture to compare", a.planes.map(of_planes)),
        ("planes of the reference", reference.planes.map(of_planes)),
    ] {
        if let Some((w, h)) = size.filter(|&size| size != (width, height)) {
            return Err(Error::input(
                name,
                "",
                format!("{w}x{h} pixels, but the reference picture has {width}x{height}"),
                "render both at one size",
            ));
        }
    }
    Ok(())
}

/// Which pixels are in the set.
fn members(reference: Side<'_>, set: &Set) -> Result<Vec<bool>> {
    let Picture { width, height, ref rgb } = *reference.picture;
    if *set == Set::All {
        return Ok(vec![true; rgb.len()]);
    }
    let planes = reference.planes.ok_or_else(|| {
        Error::input(
            "reference",
            "",
            "is a mere picture, which does not tell mirrors and objects",
            "give its AOV file (`render --aov FILE`) with --aov-b, or compare --where all",
        )
    })?;
    let around = |i: usize| neighbourhood(i, width as usize, height as usize);
    let holds = |i: usize| match set {
        Set::All => true,
        Set::Mirror => around(i).filter(|&j| planes.mirror[j] != NONE).count() == 9,
        Set::Objects => around(i).any(|j| planes.object[j] != NONE),
        Set::Named(ids) => around(i).any(|j| ids.contains(&planes.object[j])),
    };
    Ok((0..rgb.len()).map(holds).collect())
}

/// The pixel and those of its eight neighbours that lie in the picture.
fn neighbourhood(i: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (i % width, i / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| y * width + x))
}

fn compare_objects(
    a: &Planes,
    reference: &Planes,
    set: &Set,
    chosen: impl Iterator<Item = usize>,
) -> Objects {
    let counts = |id: u32| match set {
        Set::Named(ids) => ids.contains(&id),
        _ => id != NONE,
    };
    let mut objects = Objects::default();
    let mut distances = Vec::new();
    for i in chosen {
        let (seen, expected) = (a.object[i], reference.object[i]);
        let mut add = |id: u32, change: fn(&mut Count)| {
            change(&mut objects.total);
            change(objects.by_id.entry(id).or_default());
        };
        if counts(expected) {
            add(expected, |count| count.reference += 1);
            if seen == expected {
                let [p, q] = [a.position[i], reference.position[i]].map(glam::Vec3::from);
                distances.push(p.distance(q));
            } else {
                add(expected, |count| count.missing += 1);
            }
        } else if expected == NONE && counts(seen) {
            add(seen, |count| count.extra += 1);
        }
    }
    objects.position = Percentiles::of(distances);
    objects
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: u32 = 8;
    const HEIGHT: u32 = 6;

    fn at(x: u32, y: u32) -> usize {
        (y * WIDTH + x) as usize
    }

    /// All mirror but the left two columns; object 3 at (4, 2) and (5, 2), object 1 at (7, 5).
    fn reference() -> (Picture, Planes) {
        let mut planes = Planes::empty(WIDTH, HEIGHT);
        for y in 0..HEIGHT {
            (2..WIDTH).for_each(|x| planes.mirror[at(x, y)] = 0);
        }
        planes.object[at(4, 2)] = 3;
        planes.object[at(5, 2)] = 3;
        planes.object[at(7, 5)] = 1;
        (Picture::black(WIDTH, HEIGHT), planes)
    }

    fn run(a: &(Picture, Planes), set: &Set) -> Comparison {
        let b = reference();
        compare(side(a), side(&b), set).unwrap()
    }

    fn side(of: &(Picture, Planes)) -> Side<'_> {
        Side { picture: &of.0, planes: Some(&of.1) }
    }

    fn count(reference: usize, missing: usize, extra: usize) -> Count {
        Count { reference, missing, extra }
    }

    #[test]
    fn sets_are_eroded_mirrors_and_dilated_objects() {
        let same = reference();
        assert_eq!(run(&same, &Set::All).pixels, 48);
        // Columns 3 to 6, rows 1 to 4.
        assert_eq!(run(&same, &Set::Mirror).pixels, 4 * 4);
        // 4x3 around object 3 and 2x2 in the corner.
        assert_eq!(run(&same, &Set::Objects).pixels, 12 + 4);
        assert_eq!(run(&same, &Set::Named(vec![3])).pixels, 12);
        let none = compare(side(&same), side(&same), &Set::Named(vec![2]));
        assert!(none.unwrap_err().to_string().contains("no pixel in the set"));
    }

    #[test]
    fn rmse_and_psnr_have_their_closed_form() {
        let mut a = reference();
        // One channel off by 1/2 in 12 of the pixels: mean square (1/4)/3 over these.
        for (x, y) in (3..7).flat_map(|x| (1..4).map(move |y| (x, y))) {
            a.0.rgb[at(x, y)][1] = 0.5;
        }
        let inside = run(&a, &Set::Named(vec![3]));
        assert!((inside.rmse - (1.0_f64 / 12.0).sqrt()).abs() < 1e-12, "{}", inside.rmse);
        assert!((inside.psnr.unwrap() - 10.0 * 12_f64.log10()).abs() < 1e-12);
        // Over the whole picture the same squares are spread over four times the pixels.
        let all = run(&a, &Set::All);
        assert!((all.rmse - 0.5 * inside.rmse).abs() < 1e-12, "{}", all.rmse);
        assert!(all.flip < inside.flip && inside.flip > 0.1, "{} {}", all.flip, inside.flip);
        let equal = run(&reference(), &Set::All);
        assert_eq!((equal.rmse, equal.psnr, equal.flip), (0.0, None, 0.0));
    }

    #[test]
    fn missing_extra_and_mistaken_objects_are_counted_by_id() {
        let mut a = reference();
        a.1.object[at(4, 2)] = 1; // mistaken: object 3 is missing, object 1 is not extra
        a.1.object[at(7, 5)] = NONE;
        a.1.object[at(0, 0)] = 1; // extra, but far from any object
        a.1.object[at(5, 3)] = 3; // extra, beside its object
        let objects = run(&a, &Set::All).objects.unwrap();
        assert_eq!(objects.total, count(3, 2, 2));
        assert_eq!(objects.by_id, BTreeMap::from([(1, count(1, 1, 1)), (3, count(2, 1, 1))]));
        assert_eq!(objects.total.missing_share(), 2.0 / 3.0);
        assert_eq!(run(&a, &Set::Objects).objects.unwrap().total, count(3, 2, 1));
        assert_eq!(run(&a, &Set::Named(vec![1])).objects.unwrap().total, count(1, 1, 0));
        // With a named object, nothing is said of its neighbours: this one is mistaken, not extra.
        let mut beside = reference();
        beside.1.object[at(6, 2)] = 1;
        a.1.object[at(6, 2)] = 3;
        let found = compare(side(&a), side(&beside), &Set::Named(vec![3])).unwrap();
        assert_eq!(found.objects.unwrap().total, count(2, 1, 1));
        // The picture without any object must miss all and hold no position.
        let empty = (Picture::black(WIDTH, HEIGHT), Planes::empty(WIDTH, HEIGHT));
        let nothing = run(&empty, &Set::Objects).objects.unwrap();
        assert_eq!((nothing.total.missing_share(), nothing.position), (1.0, None));
        let same = run(&reference(), &Set::All).objects.unwrap();
        assert_eq!(same.total, count(3, 0, 0));
    }

    #[test]
    fn positions_are_compared_where_the_object_is_the_same() {
        let mut a = reference();
        a.1.position[at(4, 2)] = [3.0, 4.0, 0.0];
        a.1.position[at(5, 2)] = [0.0, 0.0, 2.0];
        a.1.position[at(0, 0)] = [9.0; 3]; // no object
        a.1.object[at(7, 5)] = 2; // mistaken
        a.1.position[at(7, 5)] = [9.0; 3];
        let position = run(&a, &Set::All).objects.unwrap().position;
        assert_eq!(position, Some(Percentiles { median: 2.0, p95: 5.0, p99: 5.0 }));
    }

    #[test]
    fn percentiles_are_by_nearest_rank() {
        let hundred: Vec<f32> = (1..=100).rev().map(|v| v as f32).collect();
        let of = |n| Percentiles::of(hundred[hundred.len() - n..].to_vec()).unwrap();
        assert_eq!(of(100), Percentiles { median: 50.0, p95: 95.0, p99: 99.0 });
        assert_eq!(of(20), Percentiles { median: 10.0, p95: 19.0, p99: 20.0 });
        assert_eq!(of(1), Percentiles { median: 1.0, p95: 1.0, p99: 1.0 });
        assert_eq!(Percentiles::of(Vec::new()), None);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let b = reference();
        let small = Picture::black(WIDTH, HEIGHT - 1);
        let bare = |picture| Side { picture, planes: None };
        let error = compare(bare(&small), side(&b), &Set::All).unwrap_err().to_string();
        assert!(error.contains("8x5 pixels, but the reference picture has 8x6"), "{error}");
        let planes = Planes::empty(WIDTH + 1, HEIGHT);
        let wide = Side { picture: &b.0, planes: Some(&planes) };
        assert!(compare(wide, side(&b), &Set::All).is_err());
        assert!(compare(side(&b), wide, &Set::All).is_err());
        let error = compare(side(&b), bare(&b.0), &Set::Mirror).unwrap_err().to_string();
        assert!(error.contains("give its AOV file"), "{error}");
        let pictures = compare(bare(&b.0), bare(&b.0), &Set::All).unwrap();
        assert_eq!(pictures.objects, None);
    }

    #[test]
    fn objects_are_matched_by_name() {
        let names = |list: &str| list.split(' ').map(String::from).collect::<Vec<_>>();
        let mut planes = Planes::empty(6, 1);
        planes.object = vec![0, 1, 2, 3, 9, NONE];
        let old = planes.object.clone();
        renumber(&mut planes, &names("cat dog cat cow"), &names("cat dog cat cow"));
        assert_eq!(planes.object, old);
        renumber(&mut planes, &[], &names("dog cat"));
        assert_eq!(planes.object, old);
        renumber(&mut planes, &names("cat dog cat cow"), &names("dog cow cat"));
        // cat: 2; dog: 0; the second cat and the unnamed ninth: beyond; cow: 1.
        assert_eq!(planes.object, [2, 0, 3 + 2, 1, 3 + 9, NONE]);
    }
}
