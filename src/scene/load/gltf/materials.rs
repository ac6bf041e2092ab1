//! Materials of a glTF file: base colours, textures, and which are mirrors.

use std::path::Path;

use glam::{Affine2, Vec2, Vec3};
use gltf::image::Source;
use gltf::mesh::Primitive;
use gltf::texture::WrappingMode;
use gltf::{Gltf, Material as Given};

use super::super::GET_IT_AGAIN;
use super::super::nearby::Nearby;
use super::super::textures::{Key, Textures};
use super::{buffers, rgb};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::image::color::linear_to_srgb;
use crate::scene::materials::{Material, Texture, Wrap};

/// Metal at least so pure and at most so rough is a mirror.
const METALLIC: f32 = 0.9;
const ROUGH: f32 = 0.1;

/// A file's materials by their index.
pub(super) struct Palette {
    list: Vec<Entry>,
    /// What could not be read.
    pub notes: Vec<String>,
}

struct Entry {
    material: Material,
    /// Which texture coordinates, and what becomes of them.
    coordinates: Option<(u32, Affine2)>,
    mirror: Option<Vec3>,
}

impl Palette {
    pub(super) fn read(
        path: &Path,
        file: &Gltf,
        buffers: &[Vec<u8>],
        nearby: Nearby<'_>,
        cx: &Context,
    ) -> Result<Self> {
        let mut reader = Reader { path, buffers, nearby, cx, textures: Textures::default() };
        let mut list = Vec::new();
        for given in file.materials() {
            list.push(reader.entry(&given)?);
        }
        Ok(Self { list, notes: reader.textures.notes })
    }

    fn entry(&self, primitive: &Primitive<'_>) -> Option<&Entry> {
        self.list.get(primitive.material().index()?)
    }

    /// What its surface shows; white without a material.
    pub(super) fn material(&self, primitive: &Primitive<'_>) -> Material {
        let plain = Material { color: Vec3::ONE, texture: None };
        self.entry(primitive).map_or(plain, |entry| entry.material.clone())
    }

    /// Which texture coordinates it uses, and what becomes of them.
    pub(super) fn coordinates(&self, primitive: &Primitive<'_>) -> Option<(u32, Affine2)> {
        self.entry(primitive)?.coordinates
    }

    /// The index of its material and what that reflects, if it is a mirror.
    pub(super) fn mirror(&self, primitive: &Primitive<'_>) -> Option<(usize, Vec3)> {
        let index = primitive.material().index()?;
        Some((index, self.list.get(index)?.mirror?))
    }

    /// Linear RGB factor of what that material reflects.
    pub(super) fn tint(&self, material: usize) -> Vec3 {
        self.list[material].mirror.unwrap_or(Vec3::ONE)
    }
}

struct Reader<'a> {
    path: &'a Path,
    buffers: &'a [Vec<u8>],
    nearby: Nearby<'a>,
    cx: &'a Context,
    textures: Textures,
}

impl Reader<'_> {
    fn entry(&mut self, given: &Given<'_>) -> Result<Entry> {
        let pbr = given.pbr_metallic_roughness();
        let color = rgb(pbr.base_color_factor());
        let (mut metallic, mut roughness) = (pbr.metallic_factor(), pbr.roughness_factor());
        if let Some(info) = pbr.metallic_roughness_texture()
            && metallic >= METALLIC
            && let Some(texture) = self.texture(&info.texture())?
        {
            // Data, not a colour: the mean of the bytes as they are, or almost.
            let mean = texture.color(Vec2::splat(0.5), f32::INFINITY).map(linear_to_srgb);
            (roughness, metallic) = (roughness * mean.y, metallic * mean.z);
        }
        let mirror =
            (metallic >= METALLIC && roughness <= ROUGH && !given.unlit()).then_some(color);
        let (mut texture, mut coordinates) = (None, None);
        if let Some(info) = pbr.base_color_texture().filter(|_| mirror.is_none()) {
            let of_transform = |t: &gltf::texture::TextureTransform<'_>| {
                // Scaled, turned, moved (KHR_texture_transform); its angle runs against ours.
                Affine2::from_scale_angle_translation(
                    Vec2::from_array(t.scale()),
                    -t.rotation(),
                    Vec2::from_array(t.offset()),
                )
            };
            let own = info.texture_transform();
            let set = own.as_ref().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord());
            coordinates = Some((set, own.as_ref().map_or(Affine2::IDENTITY, of_transform)));
            texture = self.texture(&info.texture())?;
        }
        let coordinates = coordinates.filter(|_| texture.is_some());
        Ok(Entry { material: Material { color, texture }, coordinates, mirror })
    }

    fn texture(&mut self, texture: &gltf::Texture<'_>) -> Result<Option<std::sync::Arc<Texture>>> {
        let sampler = texture.sampler();
        let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        });
        let image = texture.source();
        let place = format!("image {}", image.index());
        let (path, buffers, nearby, cx) = (self.path, self.buffers, self.nearby, self.cx);
        let name = match image.source() {
            Source::Uri { uri, .. } if !uri.starts_with("data:") => Path::new(uri).to_owned(),
            _ => Path::new(&format!("{}, {place}", path.display())).to_owned(),
        };
        let bytes = || match image.source() {
            Source::View { view, .. } => {
                let buffer = buffers.get(view.buffer().index()).map_or(&[][..], Vec::as_slice);
                let end = view.offset().checked_add(view.length());
                let bytes = end.and_then(|end| buffer.get(view.offset()..end));
                let problem = "lies outside of its buffer";
                bytes
                    .map(<[u8]>::to_vec)
                    .ok_or_else(|| Error::file(path, place.as_str(), problem, GET_IT_AGAIN))
            }
            Source::Uri { uri, .. } => buffers::resource(path, &place, uri, nearby, cx),
        };
        self.textures.get(Key::Image(image.index(), wrap), &name, bytes, cx)
    }
}
