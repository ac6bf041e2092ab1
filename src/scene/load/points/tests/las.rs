//! LAS and LAZ, written by the crate that reads them.

use ::las::point::Format;
use ::las::{Builder, Color, Point, Transform, Vector, Writer};

use super::super::*;
use crate::error::Result;

/// A file of points 10 cm apart, far from zero, as a survey has them.
fn written(format: u8, minor: u8, compressed: bool, count: u32, color: Option<u16>) -> Vec<u8> {
    let mut builder = Builder::from((1, minor));
    builder.point_format = Format::new(format).unwrap();
    builder.point_format.is_compressed = compressed;
    builder.point_format.extra_bytes = 2;
    let transform = |offset| Transform { scale: 0.001, offset };
    builder.transforms = Vector { x: transform(4.5e6), y: transform(-5.7e5), z: transform(0.0) };
    let format = builder.point_format;
    let file = io::Cursor::new(Vec::new());
    let mut writer = Writer::new(file, builder.into_header().unwrap()).unwrap();
    for i in 0..count {
        let place = place(i);
        let rgb = color.map(|c| Color::new(c, c / 2, 0)).filter(|_| format.has_color);
        writer
            .write_point(Point {
                x: place.x,
                y: place.y,
                z: place.z,
                intensity: u16::try_from(i % 1000).unwrap(),
                gps_time: format.has_gps_time.then_some(0.5),
                color: if format.has_color { rgb.or(Some(Color::default())) } else { None },
                nir: format.has_nir.then_some(7),
                extra_bytes: vec![1, 2],
                ..Point::default()
            })
            .unwrap();
    }
    writer.close().unwrap();
    writer.into_inner().unwrap().into_inner()
}

/// As the file's integers give it, exactly.
fn place(i: u32) -> DVec3 {
    let [x, y, z] = [i % 17, i / 17, i % 5].map(|k| f64::from(100 * k + 7));
    DVec3::new(0.001 * x + 4.5e6, 0.001 * -y - 5.7e5, 0.001 * z)
}

fn read(name: &str, bytes: &[u8]) -> Result<(PointLayout, Vec<FilePoint>)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let mut reader = PointReader::open(&path)?;
    let mut all = Vec::new();
    loop {
        let part = reader.read_whole(1000)?;
        all.extend_from_slice(&part);
        // Damaged files may go on for long.
        if part.is_empty() || all.len() > 100_000 {
            return Ok((reader.layout(), all));
        }
    }
}

const FORMATS: [(u8, u8); 6] = [(0, 0), (1, 2), (2, 2), (3, 3), (6, 4), (8, 4)];

#[test]
fn points_come_back_exactly() {
    // More than a chunk and than a batch.
    let count = 70_000;
    for (format, minor) in FORMATS {
        for compressed in [false, true] {
            let name = if compressed { "a.LAZ" } else { "a.las" };
            let bytes = written(format, minor, compressed, count, Some(60_000));
            let (layout, points) = read(name, &bytes).unwrap();
            assert_eq!(points.len(), count as usize, "{format} {compressed}");
            let has_color = [2, 3, 8].contains(&format);
            let colors = if has_color { Colors::ByLargest } else { Colors::Intensity };
            assert_eq!(layout, PointLayout { normals: false, colors: Some(colors) });
            for (point, i) in points.iter().zip(0..) {
                assert_eq!(point.position, place(i), "{format} {compressed} {i}");
                let grey = Vec3::splat((i % 1000) as f32);
                let color = if has_color { Vec3::new(6e4, 3e4, 0.0) } else { grey };
                assert_eq!(point.color, color, "{format} {compressed} {i}");
            }
        }
    }
}

#[test]
fn colours_that_nobody_filled_in_are_none() {
    let (layout, _) = read("a.las", &written(2, 2, false, 50, None)).unwrap();
    assert_eq!(layout.colors, Some(Colors::Intensity));
    let (layout, _) = read("a.las", &written(2, 2, false, 1, None)).unwrap();
    assert_eq!(layout.colors, None);
    let empty = read("a.las", &written(2, 2, false, 0, None)).unwrap_err().to_string();
    assert!(empty.contains("has no points"), "{empty}");
}

/// Cut off anywhere, or any byte another one: an error that names the file, or other points; no panic, no absurd request for
/// memory, no end of waiting.
#[test]
fn damaged_files_end() {
    for (format, minor) in [(2, 2), (7, 4)] {
        for compressed in [false, true] {
            let good = written(format, minor, compressed, 60, Some(9));
            let check = |bytes: &[u8], what: String| {
                if let Err(e) = read("a.laz", bytes) {
                    let e = e.to_string();
                    assert!(e.contains("a.laz: ") && !e.contains('\n'), "{what}: {e}");
                    return true;
                }
                false
            };
            for length in 1..good.len() {
                let failed =
                    check(&good[..length], format!("{format} {compressed} cut at {length}"));
                // The table of chunks comes last, and behind it nothing that is needed.
                assert!(failed || length > good.len() - 100, "{format} {compressed} {length}");
            }
            for at in 0..good.len() {
                for value in [0, 0x7f, 0xff, good[at] ^ 1] {
                    let mut bad = good.clone();
                    bad[at] = value;
                    check(&bad, format!("{format} {compressed} byte {at} is {value}"));
                }
            }
        }
    }
}

#[test]
fn what_a_header_promises_is_checked() {
    let put = |bytes: &mut Vec<u8>, at: usize, value: &[u8]| {
        bytes[at..at + value.len()].copy_from_slice(value);
    };
    let number = |v: u32| v.to_le_bytes().to_vec();
    for (what, format, at, value, expected) in [
        ("signature", 2, 0, b"LASX".to_vec(), "has a bad header"),
        ("points", 2, 107, number(99), "promises 99 points"),
        ("start", 2, 96, number(u32::MAX), "says that its points begin"),
        ("records", 2, 100, number(u32::MAX), "says that its points begin"),
        ("scale", 2, 131, f64::NAN.to_le_bytes().to_vec(), "scales x by NaN"),
        ("format", 2, 104, vec![63], "has a bad header"),
        ("extended", 7, 235, vec![0xff; 8], "has no extended record"),
        ("length", 2, 105, vec![3, 0], "has a bad header"),
    ] {
        let mut bytes = written(format, if format > 5 { 4 } else { 2 }, false, 60, Some(9));
        put(&mut bytes, at, &value);
        if what == "extended" {
            put(&mut bytes, 243, &number(1));
        }
        let error = read("a.las", &bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{what}: {error}");
    }
    // Where the table of chunks is, how many it has, and how long a layer is.
    let good = written(7, 4, true, 60, Some(9));
    let start = u32::from_le_bytes(good[96..100].try_into().unwrap()) as usize;
    let table = u64::from_le_bytes(good[start..start + 8].try_into().unwrap());
    let table = usize::try_from(table).unwrap();
    // A point of format 7 with two more bytes, and the count of the chunk.
    let first_layer = start + 8 + 38 + 4;
    for (at, expected) in [
        (table + 4, "no readable table of its chunks"),
        (first_layer, "a chunk that is longer than the file"),
    ] {
        let mut bytes = good.clone();
        put(&mut bytes, at, &u32::MAX.to_le_bytes());
        let error = read("a.laz", &bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
