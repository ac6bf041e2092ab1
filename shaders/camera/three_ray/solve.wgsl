// Real roots of c.x + c.y λ + c.z λ² + c.w λ³ in a bracket. WGSL promises nothing about infinities:
// denominators are looked at first.

fn value(c: vec4<f32>, x: f32) -> f32 {
    return c.x + x * (c.y + x * (c.z + x * c.w));
}

fn slope(c: vec4<f32>, x: f32) -> f32 {
    return c.y + x * (c.z * 2.0 + x * (c.w * 3.0));
}

fn bends(c: vec4<f32>, lo: f32, hi: f32) -> bool {
    let changes = !(0.0 < slope(c, lo) * slope(c, hi));
    let t_lo = c.z + lo * c.w * 3.0;
    let t_hi = c.z + hi * c.w * 3.0;
    return changes || (t_lo * t_hi < 0.0 && 0.0 < c.z * c.z - c.y * c.w * 3.0);
}

/// The critical points, clamped to the bracket and in order; `lo` stands for one that is not there.
fn critical_points(c: vec4<f32>, lo: f32, hi: f32) -> vec2<f32> {
    let a = c.w * 3.0;
    let disc = c.z * c.z - c.y * a;
    let root = sqrt(max(disc, 0.0));
    let t = select(-(c.z + root), root - c.z, c.z < 0.0);
    let some = disc >= 0.0;
    var p = lo;
    var q = lo;
    if some && abs(a) > 0.0 {
        p = clamp(t / a, lo, hi);
    }
    if some && abs(t) > 0.0 {
        q = clamp(c.y / t, lo, hi);
    }
    return vec2(min(p, q), max(p, q));
}

struct Root {
    lambda: f32,
    found: bool,
}

/// Whether the cubic, monotone in `lo..=hi`, has a root there.
fn crosses(c: vec4<f32>, lo: f32, hi: f32, closed: bool) -> bool {
    let f_lo = value(c, lo);
    let f_hi = value(c, hi);
    let rising = f_lo < 0.0 && 0.0 <= f_hi;
    let falling = 0.0 < f_lo && f_hi <= 0.0;
    return (rising || falling || (closed && f_lo == 0.0)) && lo <= hi;
}

/// The root in `lo..=hi`, where the cubic must be monotone. One at `lo` counts only if `closed`.
fn monotone_root(c: vec4<f32>, lo: f32, hi: f32, closed: bool) -> Root {
    let f_lo = value(c, lo);
    let f_hi = value(c, hi);
    let rising = f_lo < 0.0 && 0.0 <= f_hi;
    let falling = 0.0 < f_lo && f_hi <= 0.0;
    if !crosses(c, lo, hi, closed) {
        return Root(lo, false);
    }
    var a = lo;
    var b = hi;
    var x = (lo + hi) * 0.5;
    if f_hi != f_lo {
        let chord = lo - f_lo * ((hi - lo) / (f_hi - f_lo));
        if lo <= chord && chord <= hi {
            x = chord;
        }
    }
    for (var step = 0u; step < MAX_STEPS; step++) {
        let f = value(c, x);
        if (rising && f < 0.0) || (falling && 0.0 < f) {
            a = x;
        } else {
            b = x;
        }
        let s = slope(c, x);
        var next = (a + b) * 0.5;
        if s != 0.0 {
            let newton = x - f / s;
            if a <= newton && newton <= b {
                next = newton;
            }
        }
        let near = abs(next - x) <= abs(next) * ROOT_EPSILON;
        x = next;
        if near {
            break;
        }
    }
    return Root(x, true);
}

/// The ends of the pieces of a bracket on which the cubic is monotone: `count` of them, one or three.
struct Pieces {
    ends: vec4<f32>,
    count: u32,
}

fn pieces_between(c: vec4<f32>, lo: f32, hi: f32) -> Pieces {
    if !bends(c, lo, hi) {
        return Pieces(vec4(lo, hi, hi, hi), 1u);
    }
    return Pieces(vec4(lo, critical_points(c, lo, hi), hi), 3u);
}

/// For a piece without a root: that where the cubic turns round nearer to zero than rounding tells, without a root beside
/// it, or on zero itself, where the root is the other piece's end.
fn double_root(c: vec4<f32>, pieces: Pieces, piece: u32, noise: vec2<f32>) -> Root {
    let lo = pieces.ends.x;
    let p = pieces.ends.y;
    let q = pieces.ends.z;
    let hi = pieces.ends.w;
    let middle = crosses(c, p, q, false);
    let at_p = lo < p && p < hi && !middle;
    let touches_p = at_p && !crosses(c, lo, p, true) && abs(value(c, p)) <= noise.x;
    let both_p = touches_p || (at_p && value(c, p) == 0.0);
    if (piece == 0u && touches_p) || (piece == 1u && both_p) {
        return Root(p, true);
    }
    let at_q = lo < q && q < hi && !crosses(c, q, hi, false);
    let touches_q = at_q && !(middle || both_p) && abs(value(c, q)) <= noise.y;
    if (piece == 1u && touches_q) || (piece == 2u && (touches_q || (at_q && value(c, q) == 0.0))) {
        return Root(q, true);
    }
    return Root(lo, false);
}

/// The root in one of the pieces, which are in rising order.
fn root_in_piece(c: vec4<f32>, pieces: Pieces, piece: u32) -> Root {
    return monotone_root(c, pieces.ends[piece], pieces.ends[piece + 1u], piece == 0u);
}
