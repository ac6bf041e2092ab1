use super::*;

fn texture(width: u32, texels: &[u8], wrap: Wrap) -> Texture {
    let texels: Vec<[u8; 3]> = texels.iter().map(|&v| [v; 3]).collect();
    let height = u32::try_from(texels.len()).unwrap() / width;
    Texture::new(width, height, texels, [wrap; 2])
}

#[test]
fn the_middle_of_a_texel_has_its_colour_and_the_edge_wraps() {
    let of = |wrap| texture(2, &[0, 255, 255, 255], wrap);
    let [repeat, mirror, clamp] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(of);
    for t in [&repeat, &mirror, &clamp] {
        assert_eq!(t.color(Vec2::new(0.25, 0.25), 0.0), Vec3::ZERO, "upper left");
        assert_eq!(t.color(Vec2::new(0.75, 0.25), 0.0), Vec3::ONE, "upper right");
        assert_eq!(t.color(Vec2::new(0.5, 0.25), 0.0), Vec3::splat(0.5), "between, linear");
        assert!(t.color(Vec2::NAN, 0.0).is_finite());
    }
    let beyond = Vec2::new(1.25, 0.25);
    assert_eq!(repeat.color(beyond, 0.0), Vec3::ZERO);
    assert_eq!(mirror.color(beyond, 0.0), Vec3::ONE);
    assert_eq!(clamp.color(beyond, 0.0), Vec3::ONE);
    assert_eq!(repeat.color(Vec2::new(-0.75, 0.25), 0.0), Vec3::ZERO);
    assert_eq!(repeat.color(Vec2::new(0.0, 0.25), 0.0), Vec3::splat(0.5), "over the seam");
    assert_eq!(clamp.color(Vec2::new(0.0, 0.25), 0.0), Vec3::ZERO);
}

#[test]
fn a_large_radius_averages_in_linear_light() {
    let stripes: Vec<u8> = (0..64 * 64).map(|i| if i % 2 == 0 { 0 } else { 255 }).collect();
    let t = texture(64, &stripes, Wrap::Repeat);
    let at = Vec2::new(8.5 / 64.0, 0.5);
    assert_eq!(t.color(at, 0.0), Vec3::ZERO);
    for radius in [1.2, 4.0, 1e9, f32::INFINITY] {
        let color = t.color(at, radius);
        // The mean as a byte.
        assert!((color.x - 0.5).abs() < 0.003, "{radius}: {color}");
    }
    let odd = texture(3, &[0, 0, 255], Wrap::Clamp);
    assert!((odd.color(Vec2::ZERO, 99.0).x - 1.0 / 3.0).abs() < 0.003);
}

#[test]
fn triangles_have_their_own_materials_and_density() {
    let picture = Arc::new(texture(8, &[255; 64], Wrap::Repeat));
    let uv = [Vec2::ZERO, Vec2::X, Vec2::Y];
    let list = vec![
        Material { color: Vec3::X, texture: None },
        Material { color: Vec3::Y, texture: Some(picture) },
    ];
    let materials = Materials::new(vec![0, 1], vec![uv, uv], list);
    let middle = [1.0 / 3.0; 3];
    assert_eq!(materials.color(0, middle, 0.0), Vec3::X);
    assert_eq!(materials.color(1, middle, 0.0), Vec3::Y);
    // A unit square of the texture on two by two units: four texels a unit.
    let corners = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0];
    assert_eq!(materials.texels_per_length(1, corners), 4.0);
    assert_eq!(materials.texels_per_length(0, corners), 0.0);
    assert_eq!(materials.texels_per_length(1, [Vec3::ZERO; 3]), 0.0, "no area");
}
