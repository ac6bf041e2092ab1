//! Real numbers in lanes: the numeric kernels are written once over [`Real`] and run on f32, f64 and on
//! vectors of any width. None of the operations is fused or approximate, so every instruction set gives
//! the same bits.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use fearless_simd::{
    Level, Select, Simd, SimdBase, SimdFloat, SimdFrom, SimdInt, SimdMask, f32x8, f32x16, f64x8,
    u32x8, u32x16,
};

pub mod gather;

/// A scalar that camera constants are stored in.
pub trait Scalar:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Square root of the precision: the error of one more step of a method that converges quadratically is below
    /// the precision when its last step was below this.
    const ROOT_EPSILON: f64;
    /// Largest relative error of a rounding.
    const ROUNDING: f64;
    /// Steps after which bisection alone ends at the precision, or nearly so.
    const ROOT_STEPS: usize;
    /// Rounds to this type.
    fn from_f64(value: f64) -> Self;
    /// Exact.
    fn to_f64(self) -> f64;
}

impl Scalar for f32 {
    const ROOT_EPSILON: f64 = 1.0 / (1 << 12) as f64;
    const ROUNDING: f64 = 0.5 * Self::EPSILON as f64;
    const ROOT_STEPS: usize = 24;
    #[expect(clippy::cast_possible_truncation, reason = "the one rounding")]
    fn from_f64(value: f64) -> Self {
        value as Self
    }
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Scalar for f64 {
    const ROOT_EPSILON: f64 = 1.0 / (1 << 26) as f64;
    const ROUNDING: f64 = 0.5 * Self::EPSILON;
    const ROOT_STEPS: usize = 56;
    fn from_f64(value: f64) -> Self {
        value
    }
    fn to_f64(self) -> f64 {
        self
    }
}

/// One or several numbers that go through the same arithmetic.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<Self::Scalar, Output = Self>
    + Sub<Self::Scalar, Output = Self>
    + Mul<Self::Scalar, Output = Self>
{
    /// The type of one lane.
    type Scalar: Scalar;
    /// One truth value a lane.
    type Mask: Copy
        + BitAnd<Output = Self::Mask>
        + BitOr<Output = Self::Mask>
        + Not<Output = Self::Mask>;

    /// `value` in every lane; `self` only says which lanes.
    fn splat(self, value: Self::Scalar) -> Self;
    /// `self < other`; false where one is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`; false where one is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `mask ? a : b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Whether some lane is true.
    fn any(mask: Self::Mask) -> bool;
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The largest whole number that is not larger.
    fn floor(self) -> Self;

    /// The smaller one; `other` where one is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    /// The larger one; `other` where one is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
}

macro_rules! scalar_real {
    ($t:ty) => {
        impl Real for $t {
            type Scalar = $t;
            type Mask = bool;
            #[inline(always)]
            fn splat(self, value: $t) -> Self {
                value
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn select(mask: bool, a: Self, b: Self) -> Self {
                if mask { a } else { b }
            }
            #[inline(always)]
            fn any(mask: bool) -> bool {
                mask
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            #[inline(always)]
            fn floor(self) -> Self {
                <$t>::floor(self)
            }
        }
    };
}
scalar_real!(f32);
scalar_real!(f64);

/// f32 lanes in a vector register (or several).
pub trait Vector<S: Simd>: Real<Scalar = f32> {
    /// Number of lanes.
    const LANES: u32;
    /// `value` in every lane.
    fn broadcast(simd: S, value: f32) -> Self;
    /// The first `LANES` elements of `slice`.
    fn load(simd: S, slice: &[f32]) -> Self;
    /// Into the first `LANES` elements of `slice`.
    fn store(self, slice: &mut [f32]);
    /// The least lane. None may be NaN; of both zeros it is either.
    fn least(self) -> f32;
    /// The largest, likewise.
    fn most(self) -> f32;
    /// Bit i = lane i.
    fn bits(mask: Self::Mask) -> u64;
    /// Lane i = bit i.
    fn mask(simd: S, bits: u64) -> Self::Mask;
    /// The lanes of `mask`, in order, into the front of `out`, which has room for `LANES`; what lies behind them is
    /// overwritten.
    fn compress(self, mask: Self::Mask, out: &mut [f32]);
    /// [`Vector::compress`] of the first `LANES` of `numbers`.
    fn compress_numbers(simd: S, numbers: &[u32], mask: Self::Mask, out: &mut [u32]);
    /// The low and the high halves of the first `LANES` of `words`, each as a signed number of 32767ths.
    fn halves(simd: S, words: &[u32]) -> [Self; 2];
    /// [`Vector::compress`] of `16 (y stride + x) + tag`. Where the mask holds, x, y and tag must be whole, not
    /// negative and below 2^31, 2^31 and 16, and the result in u32.
    fn compress_cells(cell: [Self; 2], stride: u32, tag: Self, mask: Self::Mask, out: &mut [u32]);
}

macro_rules! vector_real {
    ($t:ident, $scalar:ty) => {
        impl<S: Simd> Real for $t<S> {
            type Scalar = $scalar;
            type Mask = <Self as SimdBase<S>>::Mask;
            #[inline(always)]
            fn splat(self, value: $scalar) -> Self {
                Self::simd_from(fearless_simd::ExtractToken::token(&self), value)
            }
            #[inline(always)]
            fn lt(self, other: Self) -> Self::Mask {
                self.simd_lt(other)
            }
            #[inline(always)]
            fn le(self, other: Self) -> Self::Mask {
                self.simd_le(other)
            }
            #[inline(always)]
            fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
                mask.select(a, b)
            }
            #[inline(always)]
            fn any(mask: Self::Mask) -> bool {
                mask.any_true()
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                SimdFloat::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                SimdFloat::copysign(self, Real::splat(self, 0.0))
            }
            #[inline(always)]
            fn floor(self) -> Self {
                SimdFloat::floor(self)
            }
        }
    };
}
vector_real!(f32x8, f32);
vector_real!(f32x16, f32);
vector_real!(f64x8, f64);

macro_rules! vector_of_floats {
    ($t:ident, $u:ident, $n:literal) => {
        impl<S: Simd> Vector<S> for $t<S> {
            const LANES: u32 = $n;
            #[inline(always)]
            fn broadcast(simd: S, value: f32) -> Self {
                Self::simd_from(simd, value)
            }
            #[inline(always)]
            fn load(simd: S, slice: &[f32]) -> Self {
                Self::from_slice(simd, &slice[..$n])
            }
            #[inline(always)]
            fn store(self, slice: &mut [f32]) {
                self.store_slice(&mut slice[..$n]);
            }
            #[inline(always)]
            fn least(self) -> f32 {
                self.reduce_min()
            }
            #[inline(always)]
            fn most(self) -> f32 {
                self.reduce_max()
            }
            #[inline(always)]
            fn bits(mask: Self::Mask) -> u64 {
                mask.to_bitmask()
            }
            #[inline(always)]
            fn mask(simd: S, bits: u64) -> Self::Mask {
                <Self::Mask as SimdMask<S>>::from_bitmask(simd, bits)
            }
            #[inline(always)]
            fn compress(self, mask: Self::Mask, out: &mut [f32]) {
                SimdBase::compress(self, mask).store_slice(&mut out[..$n]);
            }
            #[inline(always)]
            fn compress_numbers(simd: S, numbers: &[u32], mask: Self::Mask, out: &mut [u32]) {
                let numbers = $u::from_slice(simd, &numbers[..$n]);
                SimdBase::compress(numbers, mask).store_slice(&mut out[..$n]);
            }
            #[inline(always)]
            fn halves(simd: S, words: &[u32]) -> [Self; 2] {
                // As numbers without a sign, 32768 more.
                let words = $u::from_slice(simd, &words[..$n]) ^ 0x8000_8000;
                let (low, high): (Self, Self) =
                    ((words & 0xffff).to_float(), (words >> 16).to_float());
                [(low - 32768.0) * (1.0 / 32767.0), (high - 32768.0) * (1.0 / 32767.0)]
            }
            #[inline(always)]
            fn compress_cells(
                [x, y]: [Self; 2],
                stride: u32,
                tag: Self,
                mask: Self::Mask,
                out: &mut [u32],
            ) {
                let (x, y, tag): ($u<S>, $u<S>, $u<S>) = (x.to_int(), y.to_int(), tag.to_int());
                let cells = ((y * stride + x) << 4) | tag;
                SimdBase::compress(cells, mask).store_slice(&mut out[..$n]);
            }
        }
    };
}
vector_of_floats!(f32x8, u32x8, 8);
vector_of_floats!(f32x16, u32x16, 16);

/// Two vectors side by side: a kernel whose operations wait for each other runs two chains at once.
#[derive(Clone, Copy, Debug)]
pub struct Pair<V>(V, V);

macro_rules! pair_operator {
    ($operator:ident, $method:ident) => {
        impl<V: Real> $operator for Pair<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}
pair_operator!(Add, add);
pair_operator!(Sub, sub);
pair_operator!(Mul, mul);
pair_operator!(Div, div);

macro_rules! pair_scalar_operator {
    ($operator:ident, $method:ident) => {
        impl<V: Real<Scalar = f32>> $operator<f32> for Pair<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f32) -> Self {
                Self(self.0.$method(other), self.1.$method(other))
            }
        }
    };
}
pair_scalar_operator!(Add, add);
pair_scalar_operator!(Sub, sub);
pair_scalar_operator!(Mul, mul);

impl<V: Real> Neg for Pair<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

/// The truth values of a [`Pair`].
#[derive(Clone, Copy)]
pub struct PairMask<M>(M, M);

impl<M: BitAnd<Output = M>> BitAnd for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}

impl<M: BitOr<Output = M>> BitOr for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0, self.1 | other.1)
    }
}

impl<M: Not<Output = M>> Not for PairMask<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

impl<V: Real<Scalar = f32>> Real for Pair<V> {
    type Scalar = f32;
    type Mask = PairMask<V::Mask>;
    #[inline(always)]
    fn splat(self, value: f32) -> Self {
        Self(self.0.splat(value), self.1.splat(value))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        PairMask(self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        PairMask(self.0.le(other.0), self.1.le(other.1))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        Self(V::select(mask.0, a.0, b.0), V::select(mask.1, a.1, b.1))
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        V::any(mask.0 | mask.1)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.floor(), self.1.floor())
    }
}

impl<S: Simd, V: Vector<S>> Vector<S> for Pair<V> {
    const LANES: u32 = 2 * V::LANES;
    #[inline(always)]
    fn broadcast(simd: S, value: f32) -> Self {
        Self(V::broadcast(simd, value), V::broadcast(simd, value))
    }
    #[inline(always)]
    fn load(simd: S, slice: &[f32]) -> Self {
        Self(V::load(simd, slice), V::load(simd, &slice[V::LANES as usize..]))
    }
    #[inline(always)]
    fn store(self, slice: &mut [f32]) {
        self.0.store(slice);
        self.1.store(&mut slice[V::LANES as usize..]);
    }
    #[inline(always)]
    fn least(self) -> f32 {
        self.0.least().min(self.1.least())
    }
    #[inline(always)]
    fn most(self) -> f32 {
        self.0.most().max(self.1.most())
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u64 {
        V::bits(mask.0) | V::bits(mask.1) << V::LANES
    }
    #[inline(always)]
    fn mask(simd: S, bits: u64) -> Self::Mask {
        PairMask(V::mask(simd, bits), V::mask(simd, bits >> V::LANES))
    }
    #[inline(always)]
    fn compress(self, mask: Self::Mask, out: &mut [f32]) {
        self.0.compress(mask.0, out);
        self.1.compress(mask.1, &mut out[V::bits(mask.0).count_ones() as usize..]);
    }
    #[inline(always)]
    fn compress_numbers(simd: S, numbers: &[u32], mask: Self::Mask, out: &mut [u32]) {
        V::compress_numbers(simd, numbers, mask.0, out);
        let out = &mut out[V::bits(mask.0).count_ones() as usize..];
        V::compress_numbers(simd, &numbers[V::LANES as usize..], mask.1, out);
    }
    #[inline(always)]
    fn halves(simd: S, words: &[u32]) -> [Self; 2] {
        let [a, b] = V::halves(simd, words);
        let [c, d] = V::halves(simd, &words[V::LANES as usize..]);
        [Self(a, c), Self(b, d)]
    }
    #[inline(always)]
    fn compress_cells(
        [x, y]: [Self; 2],
        stride: u32,
        tag: Self,
        mask: Self::Mask,
        out: &mut [u32],
    ) {
        V::compress_cells([x.0, y.0], stride, tag.0, mask.0, out);
        let out = &mut out[V::bits(mask.0).count_ones() as usize..];
        V::compress_cells([x.1, y.1], stride, tag.1, mask.1, out);
    }
}

/// Environment variable that lowers the instruction set: `sse2`, `sse4.2`, `avx2` or `avx512`.
pub const SIMD_VARIABLE: &str = "CATOPTRIC_SIMD";

/// The best instruction set of this machine, or the lower one that [`SIMD_VARIABLE`] names, if there is that.
///
/// # Errors
/// What the variable says, if that is no name.
pub fn requested_level() -> Result<Level, String> {
    let best = Level::new();
    let Ok(name) = std::env::var(SIMD_VARIABLE) else { return Ok(best) };
    if !["sse2", "sse4.2", "avx2", "avx512"].contains(&name.as_str()) {
        return Err(name);
    }
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let lower = match name.as_str() {
        "sse2" => best.as_sse2().map(Level::Sse2),
        "sse4.2" => best.as_sse4_2().map(Level::Sse4_2),
        "avx2" => best.as_avx2().map(Level::Avx2),
        _ => None,
    };
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    let lower = None;
    Ok(lower.unwrap_or(best))
}

/// [`requested_level`], or the best where that is an error.
pub fn simd_level() -> Level {
    requested_level().unwrap_or_else(|_| Level::new())
}

/// Dot product.
#[inline(always)]
pub fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Dot product with a constant vector.
#[inline(always)]
pub fn dot_const<R: Real>(a: [R; 3], b: [R::Scalar; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
#[inline(always)]
pub fn cross<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests;
