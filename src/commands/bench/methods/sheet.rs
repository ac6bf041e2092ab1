//! The contact sheet: the mirrors as each method shows them, over a map of the error.

use catoptric::analysis::methods::{Entry, Reference};
use catoptric::image::{NONE, Picture};
use font8x8::legacy::BASIC_LEGACY;

use crate::commands::compare::heat;

/// Height of a line of text, pixels.
const LINE: usize = 20;
/// Between pictures, pixels.
const GAP: usize = 4;

/// A rectangle of pixels: its top left corner, and its size.
#[derive(Clone, Copy)]
struct Window {
    at: [usize; 2],
    size: [usize; 2],
}

/// The mirrors' place in the picture, with some room around.
fn window(reference: &Reference) -> Window {
    const ROOM: usize = 12;
    let (width, height) = (reference.picture.width as usize, reference.picture.height as usize);
    let mut low = [width, height];
    let mut high = [0, 0];
    for (i, &mirror) in reference.planes.mirror.iter().enumerate() {
        if mirror != NONE {
            let at = [i % width, i / width];
            for k in 0..2 {
                low[k] = low[k].min(at[k].saturating_sub(ROOM));
                high[k] = high[k].max(at[k] + ROOM + 1);
            }
        }
    }
    let high = [high[0].min(width), high[1].min(height)];
    Window { at: low, size: [0, 1].map(|k| high[k].saturating_sub(low[k])) }
}

/// Cells side by side at most.
const COLUMNS: usize = 4;
/// The map of steps is white at so many.
const MOST_STEPS: f32 = 20.0;
/// Of the scale below, pixels.
const SCALE: [usize; 2] = [256, 10];

/// Cells: the reference, then each candidate, with FLIP below (black is equal, white is as different as can be) and, if
/// asked for, the steps of searches.
pub(super) fn sheet(reference: &Reference, entries: &[Entry], steps: bool) -> Picture {
    let window = window(reference);
    let longest = entries.iter().map(|e| e.candidate.label.len()).max().unwrap_or(0);
    let wide = window.size[0].max(8 * longest.max(18)) + GAP;
    let high = window.size[1] + GAP;
    let rows = (entries.len() + 1).div_ceil(COLUMNS);
    let columns = (entries.len() + 1).div_ceil(rows);
    // The first cell is the reference's. Rows of cells without searches have no maps of steps.
    let searched = |entry: &Entry| {
        let planes = entry.result.as_ref().map(|drawn| &drawn.planes.steps);
        planes.is_ok_and(|steps| steps.iter().any(|&n| n != NONE))
    };
    let has_steps = |row: usize| {
        let own = (row * columns).max(1) - 1..((row + 1) * columns - 1).min(entries.len());
        steps && entries[own].iter().any(searched)
    };
    let tall = |row: usize| LINE + (2 + usize::from(has_steps(row))) * high;
    let top = |row: usize| (0..row).map(tall).sum::<usize>();
    let foot = top(rows);
    let scales = LINE * (1 + usize::from(steps));
    let mut out = Picture::black(pixels(columns * wide), pixels(foot + scales));
    let corner = |k: usize| [k % columns * wide, top(k / columns)];
    let below = |[x, y]: [usize; 2], n: usize| [x, y + LINE + n * high];
    let width = reference.picture.width as usize;
    write(&mut out, [GAP, 6], "reference");
    paste(&mut out, below([0, 0], 0), &reference.picture.rgb, width, window);
    for (k, entry) in entries.iter().enumerate() {
        let at = corner(k + 1);
        write(&mut out, [at[0] + GAP, at[1] + 6], &entry.candidate.label);
        let Ok(drawn) = &entry.result else {
            write(&mut out, [at[0] + GAP, at[1] + LINE + 6], "cannot draw this");
            continue;
        };
        paste(&mut out, below(at, 0), &drawn.picture.rgb, width, window);
        let map: Vec<[f32; 3]> =
            drawn.measured.errors.flip_map.iter().map(|&value| heat(value)).collect();
        paste(&mut out, below(at, 1), &map, width, window);
        if has_steps((k + 1) / columns) {
            let shade = |&n: &u32| if n == NONE { [0.0; 3] } else { heat(n as f32 / MOST_STEPS) };
            let map: Vec<[f32; 3]> = drawn.planes.steps.iter().map(shade).collect();
            paste(&mut out, below(at, 2), &map, width, window);
        }
    }
    scale(&mut out, foot, "FLIP 0", "1");
    if steps {
        scale(&mut out, foot + LINE, "steps 0", &format!("{MOST_STEPS:.0} or more"));
    }
    out
}

/// What the colours of a map mean.
fn scale(out: &mut Picture, top: usize, low: &str, high: &str) {
    let left = GAP + 8 * low.len() + 8;
    write(out, [GAP, top + 6], low);
    let own = out.width as usize;
    for y in 0..SCALE[1] {
        for x in (0..SCALE[0]).filter(|x| left + x < own) {
            out.rgb[(top + 5 + y) * own + left + x] = heat(x as f32 / SCALE[0] as f32);
        }
    }
    write(out, [left + SCALE[0] + 8, top + 6], high);
}

fn pixels(n: usize) -> u32 {
    u32::try_from(n).expect("pictures are smaller")
}

fn paste(out: &mut Picture, at: [usize; 2], rgb: &[[f32; 3]], width: usize, window: Window) {
    let own = out.width as usize;
    for y in 0..window.size[1] {
        let from = (window.at[1] + y) * width + window.at[0];
        let to = (at[1] + y) * own + at[0];
        out.rgb[to..to + window.size[0]].copy_from_slice(&rgb[from..from + window.size[0]]);
    }
}

/// A line of text in white, 8 pixels a letter.
fn write(out: &mut Picture, at: [usize; 2], text: &str) {
    let own = out.width as usize;
    for (k, letter) in text.bytes().enumerate() {
        let Some(rows) = BASIC_LEGACY.get(usize::from(letter)) else { continue };
        for (y, row) in rows.iter().enumerate() {
            for x in (0..8).filter(|x| row >> x & 1 == 1) {
                let (x, y) = (at[0] + 8 * k + x, at[1] + y);
                if x < own {
                    out.rgb[y * own + x] = [1.0; 3];
                }
            }
        }
    }
}
