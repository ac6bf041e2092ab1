//! `catoptric compare A B`: how far a picture is from a reference.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use catoptric::image::compare::{self, Comparison, Count, Percentiles, Set, Side};
use catoptric::image::{Picture, Planes, aov, color, io};
use serde_json::{Value, json};

use super::{check_apart, say};

/// Compare a picture with a reference
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Args {
    /// The picture: PNG, EXR, HDR or a file written with --aov (its reflection)
    a: PathBuf,
    /// The reference: likewise
    b: PathBuf,
    /// Pixels to compare, as the reference shows them: all, mirror (and its 8 neighbours are mirror), object or
    /// object=NAME (grown by one pixel)
    #[arg(long = "where", value_name = "SET", default_value = "all")]
    place: Where,
    /// AOV file of A, where A is a mere picture
    #[arg(long, value_name = "FILE")]
    aov_a: Option<PathBuf>,
    /// AOV file of B, where B is a mere picture
    #[arg(long, value_name = "FILE")]
    aov_b: Option<PathBuf>,
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the FLIP map as a picture: black is equal, white is as different as can be
    #[arg(long, value_name = "FILE")]
    heatmap: Option<PathBuf>,
}

/// [`Set`] before the names are looked up in the reference.
#[derive(Clone, Debug)]
enum Where {
    All,
    Mirror,
    Objects,
    Object(String),
}

impl std::str::FromStr for Where {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("object=")) {
            ("all", _) => Ok(Self::All),
            ("mirror", _) => Ok(Self::Mirror),
            ("object", _) => Ok(Self::Objects),
            (_, Some(name)) => Ok(Self::Object(name.into())),
            _ => Err("expected all, mirror, object or object=NAME".into()),
        }
    }
}

impl std::fmt::Display for Where {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::Mirror => f.write_str("mirror"),
            Self::Objects => f.write_str("object"),
            Self::Object(name) => write!(f, "object={name}"),
        }
    }
}

/// Compares, prints, and writes what was asked for.
pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    if let Some(path) = &args.json {
        io::check_place(path)?;
    }
    if let Some(path) = &args.heatmap {
        io::check_output(path)?;
    }
    check_apart(&[("--json", args.json.as_deref()), ("--heatmap", args.heatmap.as_deref())])?;
    let mut a = Input::read(&args.a, args.aov_a.as_deref())?;
    let b = Input::read(&args.b, args.aov_b.as_deref())?;
    if let Some(planes) = &mut a.planes {
        compare::renumber(planes, &a.names, &b.names);
    }
    let set = b.set(&args.place, &args.b)?;
    let found = compare::compare(a.side(), b.side(), &set)
        .with_context(|| format!("comparing {} with {}", args.a.display(), args.b.display()))?;
    say!("{}", report(&found, &args.place, &b.names));
    if let Some(path) = &args.json {
        let mut text = serde_json::to_string_pretty(&to_json(&found, &args.place, &b.names))?;
        text.push('\n');
        io::write_bytes(path, text.as_bytes())?;
    }
    if let Some(path) = &args.heatmap {
        let rgb = found.flip_map.iter().map(|&value| heat(value)).collect();
        io::write_picture(path, &Picture { rgb, ..b.picture })?;
    }
    Ok(())
}

/// One side, as read.
struct Input {
    picture: Picture,
    planes: Option<Planes>,
    names: Vec<String>,
}

impl Input {
    fn read(path: &Path, aov: Option<&Path>) -> anyhow::Result<Self> {
        let aov = aov.or_else(|| aov::is_aov(path).then_some(path));
        let (planes, names) = aov.map(aov::read_aov).transpose()?.unzip();
        let picture = match &planes {
            Some(planes) if aov == Some(path) => planes.into(),
            _ => io::read_picture(path)?,
        };
        Ok(Self { picture, planes, names: names.unwrap_or_default() })
    }

    fn side(&self) -> Side<'_> {
        Side { picture: &self.picture, planes: self.planes.as_ref() }
    }

    /// As the reference: a name stands for all objects that bear it.
    fn set(&self, place: &Where, path: &Path) -> anyhow::Result<Set> {
        Ok(match place {
            Where::All => Set::All,
            Where::Mirror => Set::Mirror,
            Where::Objects => Set::Objects,
            Where::Object(_) if self.planes.is_none() => Set::Objects, // refused by the comparison
            Where::Object(wanted) => {
                let named = (0..).zip(&self.names).filter(|(_, name)| *name == wanted);
                let ids: Vec<u32> = named.map(|(id, _)| id).collect();
                if ids.is_empty() {
                    let names = self.names.join(", ");
                    bail!("{}: has no object {wanted:?}; it has: {names}", path.display());
                }
                Set::Named(ids)
            }
        })
    }
}

/// The objects' names; a number where there is none.
fn name_of(id: u32, names: &[String]) -> String {
    names.get(id as usize).cloned().unwrap_or_else(|| format!("#{id}"))
}

fn report(found: &Comparison, place: &Where, names: &[String]) -> String {
    let psnr = found.psnr.map_or("infinite".into(), |psnr| format!("{psnr:.2} dB"));
    let mut lines = vec![
        format!("pixels    {} ({place})", found.pixels),
        format!("rmse      {:.6} (linear RGB)", found.rmse),
        format!("psnr      {psnr} (peak 1)"),
        format!("flip      {:.6} (mean, {} pixels a degree)", found.flip, pixels_per_degree()),
    ];
    let shares = |count: Count| {
        let Count { reference, missing, extra } = count;
        format!(
            "missing {:.4} % ({missing}), extra {:.4} % ({extra}) of {reference}",
            100.0 * count.missing_share(),
            100.0 * count.extra_share(),
        )
    };
    match &found.objects {
        None => lines.push("objects   not compared: needs the AOV files of both".into()),
        Some(objects) => {
            lines.push(format!("objects   {}", shares(objects.total)));
            // The worst ones; all are in the JSON.
            let mut by_id: Vec<_> = objects.by_id.iter().collect();
            by_id.sort_by_key(|(id, count)| (std::cmp::Reverse(count.missing + count.extra), **id));
            let faulty = by_id.iter().filter(|(_, count)| count.missing + count.extra > 0);
            lines.extend(faulty.take(WORST).map(|(id, count)| {
                format!("          {}: {}", name_of(**id, names), shares(**count))
            }));
            lines.push(match objects.position {
                None => "position  no pixel shows the same object".into(),
                Some(Percentiles { median, p95, p99 }) => {
                    format!("position  median {median:.3e}, 95 % {p95:.3e}, 99 % {p99:.3e} (world)")
                }
            });
        }
    }
    lines.join("\n")
}

/// Objects listed at most.
const WORST: usize = 5;

fn pixels_per_degree() -> f32 {
    catoptric::image::flip::PIXELS_PER_DEGREE
}

/// `null` where planes are lacking; `psnr` also if the pictures are equal, `position` if no pixel shows the same object.
fn to_json(found: &Comparison, place: &Where, names: &[String]) -> Value {
    let objects = found.objects.as_ref();
    let position = objects.and_then(|objects| objects.position);
    let by_id = objects.map(|objects| {
        let one = |(&id, count): (&u32, &Count)| {
            json!({
                "id": id,
                "name": names.get(id as usize),
                "pixels": count.reference,
                "missing": count.missing_share(),
                "extra": count.extra_share(),
                "missing_pixels": count.missing,
                "extra_pixels": count.extra,
            })
        };
        objects.by_id.iter().map(one).collect::<Vec<_>>()
    });
    json!({
        "where": place.to_string(),
        "pixels": found.pixels,
        "rmse": found.rmse,
        "psnr": found.psnr,
        "flip": found.flip,
        "missing": objects.map(|objects| objects.total.missing_share()),
        "extra": objects.map(|objects| objects.total.extra_share()),
        "position": position.map(|Percentiles { median, p95, p99 }| {
            json!({ "median": median, "p95": p95, "p99": p99 })
        }),
        "objects": by_id,
    })
}

/// Linear colour of a FLIP value: black, violet, red, orange, white in even steps of growing lightness.
pub(crate) fn heat(value: f32) -> [f32; 3] {
    const STOPS: [[f32; 3]; 5] =
        [[0.0; 3], [0.30, 0.08, 0.45], [0.80, 0.20, 0.35], [1.0, 0.65, 0.30], [1.0; 3]];
    let position = value.clamp(0.0, 1.0) * 4.0;
    #[expect(clippy::cast_possible_truncation, reason = "0 to 3")]
    let i = (position as usize).min(3);
    let t = position - i as f32;
    std::array::from_fn(|k| {
        color::srgb_to_linear(STOPS[i][k] + t * (STOPS[i + 1][k] - STOPS[i][k]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric::image::{NONE, Reason};
    use clap::Parser;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    /// A mirror of 20x15 pixels that shows a "fox" on the left, a "hen" on the right.
    fn planes() -> Planes {
        let mut planes = Planes::empty(20, 15);
        for i in 0..planes.radiance.len() {
            planes.mirror[i] = 0;
            planes.object[i] = match i % 20 {
                2..8 => 0,
                12..18 => 1,
                _ => NONE,
            };
            let object = planes.object[i] != NONE;
            planes.reason[i] = (if object { Reason::Object } else { Reason::Environment }) as u32;
            planes.radiance[i] = if object { [0.9, 0.5, 0.1] } else { [0.1, 0.2, 0.4] };
        }
        planes
    }

    struct Folder(tempfile::TempDir);

    impl Folder {
        fn new() -> Self {
            let folder = Self(tempfile::tempdir().unwrap());
            let names = ["fox", "hen"].map(String::from);
            aov::write_aov(&folder.path("b.exr"), &planes(), &names).unwrap();
            // The hen is gone, and the fox is the second object of another scene and a bit off.
            let mut a = planes();
            for i in 0..a.object.len() {
                if a.object[i] == 1 {
                    (a.object[i], a.radiance[i]) = (NONE, [0.1, 0.2, 0.4]);
                } else if a.object[i] == 0 {
                    (a.object[i], a.position[i]) = (1, [0.0, 0.25, 0.0]);
                }
            }
            let names = ["cat", "fox"].map(String::from);
            aov::write_aov(&folder.path("a.exr"), &a, &names).unwrap();
            for (name, planes) in [("a.png", &a), ("b.png", &planes())] {
                io::write_picture(&folder.path(name), &planes.into()).unwrap();
            }
            folder
        }

        fn path(&self, name: &str) -> PathBuf {
            self.0.path().join(name)
        }

        /// Runs with words in which those with a dot name files; gives the JSON.
        fn compare(&self, line: &str) -> anyhow::Result<Value> {
            let words = ["compare", "--json", "out.json"].into_iter().chain(line.split(' '));
            let words = words.map(|word| match word.contains('.') {
                true => self.path(word).display().to_string(),
                false => word.to_string(),
            });
            run(Line::try_parse_from(words)?.args)?;
            Ok(serde_json::from_slice(&std::fs::read(self.path("out.json"))?)?)
        }
    }

    #[test]
    fn a_lost_object_is_seen() {
        let folder = Folder::new();
        let found = folder.compare("a.exr b.exr --where object --heatmap map.png").unwrap();
        assert_eq!((&found["missing"], &found["extra"]), (&json!(0.5), &json!(0.0)));
        assert_eq!(found["position"], json!({"median": 0.25, "p95": 0.25, "p99": 0.25}));
        assert_eq!(found["objects"][1]["name"], "hen");
        assert_eq!(found["objects"][1]["missing"], 1.0);
        assert!(found["flip"].as_f64() > Some(0.1) && found["rmse"].as_f64() > Some(0.1));
        let map = io::read_picture(&folder.path("map.png")).unwrap();
        assert!(map.rgb[7 * 20] == [0.0; 3] && map.rgb[7 * 20 + 15] != [0.0; 3]);
        // The fox alone looks alike.
        let fox = folder.compare("a.exr b.exr --where object=fox").unwrap();
        assert_eq!((&fox["missing"], &fox["rmse"]), (&json!(0.0), &json!(0.0)));
        assert_eq!(fox["pixels"], 8 * 15);
        let same = folder.compare("b.exr b.exr --where mirror").unwrap();
        assert_eq!((&same["missing"], &same["flip"]), (&json!(0.0), &json!(0.0)));
        assert_eq!((&same["pixels"], &same["psnr"]), (&json!(18 * 13), &Value::Null));
    }

    #[test]
    fn planes_may_lie_apart_or_be_lacking() {
        let folder = Folder::new();
        let exr = folder.compare("a.exr b.exr --where object").unwrap();
        let png = "a.png b.png --aov-a a.exr --aov-b b.exr --where object";
        let apart = folder.compare(png).unwrap();
        assert_eq!(apart["objects"], exr["objects"]);
        let [of_exr, of_png] = [&exr, &apart].map(|found| found["rmse"].as_f64().unwrap());
        assert!(of_exr != of_png && (of_exr - of_png).abs() < 1e-2, "8 bits differ a little");
        let bare = folder.compare("a.png b.png").unwrap();
        for key in ["missing", "extra", "position", "objects"] {
            assert_eq!(bare[key], Value::Null, "{key}");
        }
        assert!(bare["psnr"].is_number());
    }

    #[test]
    fn bad_requests_are_refused_before_anything_is_written() {
        let folder = Folder::new();
        for (line, expected) in [
            ("a.exr b.exr --where object=cow", "it has: fox, hen"),
            ("a.exr b.exr --where objects", "expected all, mirror, object or object=NAME"),
            ("a.exr b.png --where mirror", "give its AOV file"),
            ("a.exr b.png --where object=fox", "give its AOV file"),
            ("a.exr c.png", "does not exist"),
            ("a.exr b.exr --heatmap map.txt", ".png, .exr or .hdr"),
            ("a.png b.png --aov-b b.png", "no complete EXR file"),
        ] {
            let error = format!("{:#}", folder.compare(line).unwrap_err());
            assert!(error.contains(expected), "{line}: {error}");
            assert!(!folder.path("out.json").exists(), "{line}");
        }
    }
}
