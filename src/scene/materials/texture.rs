//! A picture on a surface, with smaller and smaller averages of itself (Williams 1983).

use glam::{UVec2, Vec2, Vec3};

use crate::image::color::{linear_to_srgb8, srgb8_to_linear};

/// What a texture shows outside its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again and again.
    Repeat,
    /// The same, every other time mirrored.
    Mirror,
    /// The nearest of its edge.
    Clamp,
}

/// A texture: sRGB bytes, looked up in linear light.
#[derive(Debug, PartialEq)]
pub struct Texture {
    /// From the finest on; each is half as large, rounded down but not to nothing, to a single texel.
    levels: Vec<Level>,
    /// Along u and v.
    wrap: [Wrap; 2],
}

#[derive(Debug, PartialEq)]
struct Level {
    size: UVec2,
    texels: Vec<[u8; 3]>,
}

impl Texture {
    /// `texels`: sRGB, row by row from the upper left.
    ///
    /// # Panics
    /// If there are none, or not as many as the size says.
    pub fn new(width: u32, height: u32, texels: Vec<[u8; 3]>, wrap: [Wrap; 2]) -> Self {
        assert!(!texels.is_empty() && texels.len() as u64 == u64::from(width) * u64::from(height));
        let mut levels = vec![Level { size: UVec2::new(width, height), texels }];
        while let Some(last) = levels.last().filter(|level| level.size.max_element() > 1) {
            let half = last.half();
            levels.push(half);
        }
        Self { levels, wrap }
    }

    /// Bytes that a texture of this size takes.
    pub fn bytes(width: u32, height: u32) -> u64 {
        4 * u64::from(width) * u64::from(height)
    }

    /// Width and height, texels.
    pub fn size(&self) -> Vec2 {
        self.levels[0].size.as_vec2()
    }

    /// Linear RGB at a place (0 to 1 from the upper left), averaged over about `radius` texels.
    pub fn color(&self, uv: Vec2, radius: f32) -> Vec3 {
        let uv = Vec2::new(self.wrap[0].fold(uv.x), self.wrap[1].fold(uv.y));
        // A texel of level n is 2^n wide: as wide as a square of the disk's area.
        let level = (radius * 1.772).log2().clamp(0.0, (self.levels.len() - 1) as f32);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let fine = level as usize;
        let near = self.levels[fine].color(uv, self.wrap);
        match self.levels.get(fine + 1) {
            Some(coarse) if level > fine as f32 => {
                near.lerp(coarse.color(uv, self.wrap), level - fine as f32)
            }
            _ => near,
        }
    }
}

impl Wrap {
    /// A coordinate within the picture, 0 to 1; what is not finite is 0.
    fn fold(self, x: f32) -> f32 {
        let folded = match self {
            Self::Repeat => x - x.floor(),
            Self::Mirror => 1.0 - ((x * 0.5 - (x * 0.5).floor()) * 2.0 - 1.0).abs(),
            Self::Clamp => x,
        };
        if folded.is_finite() { folded.clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The index of a texel next to the picture's edge.
    fn index(self, i: i64, count: u32) -> usize {
        let count = i64::from(count);
        let inside = match self {
            Self::Repeat => i.rem_euclid(count),
            Self::Mirror | Self::Clamp => i.clamp(0, count - 1),
        };
        usize::try_from(inside).unwrap_or(0)
    }
}

impl Level {
    /// Bilinear between the four nearest texels.
    fn color(&self, uv: Vec2, wrap: [Wrap; 2]) -> Vec3 {
        let at = uv * self.size.as_vec2() - 0.5;
        let (low, share) = (at.floor(), at - at.floor());
        #[expect(clippy::cast_possible_truncation, reason = "within the picture")]
        let (x, y) = (low.x as i64, low.y as i64);
        let texel = |dx: i64, dy: i64| {
            let column = wrap[0].index(x + dx, self.size.x);
            let row = wrap[1].index(y + dy, self.size.y);
            linear(self.texels[row * self.size.x as usize + column])
        };
        let above = texel(0, 0).lerp(texel(1, 0), share.x);
        let below = texel(0, 1).lerp(texel(1, 1), share.x);
        above.lerp(below, share.y)
    }

    /// Half as large: each texel the mean of two by two in linear light. An odd row or column at the end goes to its
    /// neighbour's.
    fn half(&self) -> Self {
        let size = (self.size / 2).max(UVec2::ONE);
        let span = |i: u32, half: u32, full: u32| {
            let end = if i + 1 == half { full } else { 2 * i + 2 };
            2 * i..end
        };
        let mut texels = Vec::with_capacity((size.x * size.y) as usize);
        for row in 0..size.y {
            for column in 0..size.x {
                let (mut sum, mut count) = (Vec3::ZERO, 0.0);
                for y in span(row, size.y, self.size.y) {
                    for x in span(column, size.x, self.size.x) {
                        sum += linear(self.texels[(y * self.size.x + x) as usize]);
                        count += 1.0;
                    }
                }
                texels.push((sum / count).to_array().map(linear_to_srgb8));
            }
        }
        Self { size, texels }
    }
}

fn linear(texel: [u8; 3]) -> Vec3 {
    Vec3::from_array(texel.map(srgb8_to_linear))
}
