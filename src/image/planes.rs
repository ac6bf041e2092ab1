//! The planes of a picture: its colour and, where asked for, what was seen at every pixel (AOVs).

/// Marks "no such thing" in the integer planes.
pub const NONE: u32 = u32::MAX;

/// What a mirror pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Reason {
    /// The pixel is not a mirror's.
    NotMirror = 0,
    /// It reflects an object.
    Object = 1,
    /// It reflects the environment.
    Environment = 2,
}

/// The reflection and what it shows at each pixel, row by row from the top. Every plane has
/// `width`·`height` elements. Positions and normals are in world space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// Pixels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Linear RGB radiance of the reflection (black where there is no mirror).
    pub radiance: Vec<[f32; 3]>,
    /// Reflected surface point, world space; zero where no object is reflected.
    pub position: Vec<[f32; 3]>,
    /// Its unit normal; zero where no object is reflected.
    pub normal: Vec<[f32; 3]>,
    /// Ray parameter λ along the (unnormalised) camera ray; 0 where no object is reflected.
    pub lambda: Vec<f32>,
    /// Sub-pixel picture position of the winning surfel in pixels; the pixel centre for rays.
    pub splat: Vec<[f32; 2]>,
    /// Share of the pixel covered by reflected objects, 0 to 1.
    pub coverage: Vec<f32>,
    /// Index of the mirror, or [`NONE`].
    pub mirror: Vec<u32>,
    /// Index of the triangle within its mirror, or [`NONE`].
    pub mirror_triangle: Vec<u32>,
    /// Index of the reflected object, or [`NONE`].
    pub object: Vec<u32>,
    /// Index of the winning surfel, or [`NONE`] (rays have none).
    pub surfel: Vec<u32>,
    /// Images of the winning surfel in its camera, or [`NONE`].
    pub images: Vec<u32>,
    /// Steps of the search for what is shown, or [`NONE`].
    pub steps: Vec<u32>,
    /// [`Reason`] as a number.
    pub reason: Vec<u32>,
}

impl Planes {
    /// Planes of one size with no mirror anywhere.
    pub fn empty(width: u32, height: u32) -> Self {
        let n = width as usize * height as usize;
        Self {
            width,
            height,
            radiance: vec![[0.0; 3]; n],
            position: vec![[0.0; 3]; n],
            normal: vec![[0.0; 3]; n],
            lambda: vec![0.0; n],
            splat: vec![[0.0; 2]; n],
            coverage: vec![0.0; n],
            mirror: vec![NONE; n],
            mirror_triangle: vec![NONE; n],
            object: vec![NONE; n],
            surfel: vec![NONE; n],
            images: vec![NONE; n],
            steps: vec![NONE; n],
            reason: vec![Reason::NotMirror as u32; n],
        }
    }
}
