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

/// Columns: the reference, then each method; rows: the picture, and FLIP (black is equal, white is as different as can
/// be).
pub(super) fn sheet(reference: &Reference, entries: &[Entry]) -> Picture {
    let window = window(reference);
    let columns = entries.len() + 1;
    let [wide, high] = [window.size[0].max(160) + GAP, window.size[1] + GAP];
    let mut out = Picture::black(pixels(columns * wide), pixels(LINE + 2 * high));
    write(&mut out, [GAP, 6], "reference");
    paste(&mut out, [0, LINE], &reference.picture.rgb, reference.picture.width as usize, window);
    for (k, entry) in entries.iter().enumerate() {
        let left = (k + 1) * wide;
        write(&mut out, [left + GAP, 6], entry.method.info().id);
        let Ok(drawn) = &entry.result else {
            write(&mut out, [left + GAP, LINE + 6], "cannot draw this");
            continue;
        };
        let width = drawn.picture.width as usize;
        paste(&mut out, [left, LINE], &drawn.picture.rgb, width, window);
        let map: Vec<[f32; 3]> =
            drawn.measured.errors.flip_map.iter().map(|&value| heat(value)).collect();
        paste(&mut out, [left, LINE + high], &map, width, window);
    }
    out
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
