use fearless_simd::dispatch;

use super::*;

#[inline(always)]
fn compressed<S: Simd, V: Vector<S>>(
    simd: S,
    bits: u64,
    [x, y, tag]: [&[f32]; 3],
) -> (Vec<f32>, Vec<u32>, Vec<u32>) {
    let lanes = V::LANES as usize;
    let (mut values, mut numbers, mut cells) =
        (vec![0.0; 2 * lanes], vec![0; 2 * lanes], vec![0; 2 * lanes]);
    let mask = V::mask(simd, bits);
    let n = V::bits(mask).count_ones() as usize;
    let (x, y, tag) = (V::load(simd, x), V::load(simd, y), V::load(simd, tag));
    x.compress(mask, &mut values);
    let counted: Vec<u32> = (1000..1000 + V::LANES).collect();
    V::compress_numbers(simd, &counted, mask, &mut numbers);
    V::compress_cells([x, y], 77, tag, mask, &mut cells);
    values.truncate(n);
    numbers.truncate(n);
    cells.truncate(n);
    (values, numbers, cells)
}

#[test]
fn compressing_keeps_the_lanes_of_the_mask_in_order() {
    let x: Vec<f32> = (0..32u8).map(|i| f32::from(i) + 3.0).collect();
    let y: Vec<f32> = (0..32u8).map(|i| f32::from(i % 7)).collect();
    let tag: Vec<f32> = (0..32u8).map(|i| f32::from(i % 16)).collect();
    let level = simd_level();
    for bits in [0, 1, 0x8000_0001, 0xdead_beef, 0x00ff_ff00, 0xffff_ffff_u64] {
        for lanes in [8u32, 16, 32] {
            let bits = bits & ((1 << lanes) - 1);
            let kept: Vec<u8> = (0..32u8).filter(|i| bits >> i & 1 != 0).collect();
            let input = [&x[..], &y[..], &tag[..]];
            let (values, numbers, cells) = match lanes {
                8 => dispatch!(level, simd => compressed::<_, f32x8<_>>(simd, bits, input)),
                16 => dispatch!(level, simd => compressed::<_, f32x16<_>>(simd, bits, input)),
                _ => {
                    dispatch!(level, simd => compressed::<_, Pair<f32x16<_>>>(simd, bits, input))
                }
            };
            let at = |i: &u8| usize::from(*i);
            assert_eq!(values, kept.iter().map(|i| x[at(i)]).collect::<Vec<_>>(), "{bits:x}");
            let expected: Vec<u32> = kept.iter().map(|&i| 1000 + u32::from(i)).collect();
            assert_eq!(numbers, expected, "{bits:x}");
            let cell = |&i: &u8| {
                let (x, y, tag) = (u32::from(i) + 3, u32::from(i % 7), u32::from(i % 16));
                16 * (77 * y + x) + tag
            };
            assert_eq!(cells, kept.iter().map(cell).collect::<Vec<_>>(), "{bits:x}");
        }
    }
}
