//! The caustic as a PLY file.

use catoptric::analysis::multiplicity::CausticSurface;
use glam::DVec3;
use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Ply, PropertyAccess, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

/// A vertex of the file or a face.
enum Element {
    Vertex { position: DVec3, lambda: f32, triangle: u32 },
    Face(Vec<u32>),
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::Face(Vec::new())
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        let Self::Vertex { position, .. } = self else { return None };
        match name {
            "x" => Some(position.x),
            "y" => Some(position.y),
            "z" => Some(position.z),
            _ => None,
        }
    }

    fn get_float(&self, _name: &str) -> Option<f32> {
        if let Self::Vertex { lambda, .. } = self { Some(*lambda) } else { None }
    }

    fn get_uint(&self, _name: &str) -> Option<u32> {
        if let Self::Vertex { triangle, .. } = self { Some(*triangle) } else { None }
    }

    fn get_list_uint(&self, _name: &str) -> Option<&[u32]> {
        if let Self::Face(corners) = self { Some(corners) } else { None }
    }
}

/// The file: vertices with x, y, z (world space), lambda and mirror_triangle, and faces.
pub(super) fn caustic(surface: &CausticSurface) -> anyhow::Result<Vec<u8>> {
    let (positions, triangles) = surface.triangles();
    let of_rulings = surface
        .strips
        .iter()
        .flat_map(|strip| strip.lambdas.iter().map(|lambda| (*lambda, strip.triangle)))
        .flat_map(|ruling| [ruling; 2]);
    let vertices = positions.into_iter().zip(of_rulings).map(|(position, (lambda, triangle))| {
        let position = position.as_dvec3() + surface.origin;
        Element::Vertex { position, lambda, triangle }
    });
    let mut ply = Ply::<Element>::new();
    ply.header.encoding = Encoding::BinaryLittleEndian;
    let define = |name: &str, properties: &[(&str, PropertyType)]| {
        let mut element = ElementDef::new(name.to_owned());
        for (name, kind) in properties {
            element.properties.add(PropertyDef::new((*name).to_owned(), kind.clone()));
        }
        element
    };
    let double = || PropertyType::Scalar(ScalarType::Double);
    ply.header.elements.add(define(
        "vertex",
        &[
            ("x", double()),
            ("y", double()),
            ("z", double()),
            ("lambda", PropertyType::Scalar(ScalarType::Float)),
            ("mirror_triangle", PropertyType::Scalar(ScalarType::UInt)),
        ],
    ));
    let corners = PropertyType::List(ScalarType::UChar, ScalarType::UInt);
    ply.header.elements.add(define("face", &[("vertex_indices", corners)]));
    ply.payload.insert("vertex".to_owned(), vertices.collect());
    let faces = triangles.into_iter().map(|corners| Element::Face(corners.to_vec()));
    ply.payload.insert("face".to_owned(), faces.collect());
    let mut bytes = Vec::new();
    Writer::new().write_ply(&mut bytes, &mut ply)?;
    Ok(bytes)
}
