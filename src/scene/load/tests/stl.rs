use super::*;

fn facets() -> Vec<stl_io::Triangle> {
    let corner = |i: usize| stl_io::Vector::new(POSITIONS[i]);
    let facet = |t: [usize; 3]| stl_io::Triangle {
        normal: stl_io::Vector::new([0.0, 0.0, 1.0]),
        vertices: t.map(corner),
    };
    [[0, 1, 2], [0, 2, 3], [2, 1, 3]].map(facet).to_vec()
}

/// Both kinds, by another hand than the reader's for text.
fn binary() -> Vec<u8> {
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, facets().iter()).unwrap();
    bytes
}

fn text(begin: &str, end: &str, between: &str) -> String {
    let mut text = format!("{begin}\n");
    for (i, facet) in facets().iter().enumerate() {
        text += "  facet normal 0 0 1\n    outer loop\n";
        for v in &facet.vertices {
            text += &format!("      vertex {} {} {}\n", v[0], v[1], v[2]);
        }
        text += "    endloop\n  endfacet\n";
        if i == 0 {
            text += between;
        }
    }
    text + end
}

#[test]
fn stl_in_all_variants_is_the_same_mesh() {
    let wanted = tent(false, false);
    let mut named_solid = binary();
    named_solid[..6].copy_from_slice(b"solid ");
    let upper = text("SOLID A", "ENDSOLID A", "").to_ascii_uppercase();
    for (what, bytes) in [
        ("binary", binary()),
        ("binary that begins as a text does", named_solid),
        ("text", text("solid a b", "endsolid a b\n", "").into_bytes()),
        ("without a name", text("solid", "endsolid", "").into_bytes()),
        ("two solids", text("solid a", "endsolid a\n", "endsolid a\n\nsolid b\n").into_bytes()),
        ("upper case", upper.into_bytes()),
        (
            "slivers",
            text("solid a", "endsolid", "")
                .replace("normal 0 0 1", "normal -nan nan inf")
                .into_bytes(),
        ),
        ("DOS", text("solid a", "endsolid a\n", "").replace('\n', "\r\n").into_bytes()),
    ] {
        let found = load("a.stl", &bytes).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_same(&found, &wanted, what);
    }
}

#[test]
fn bad_stl() {
    let good = binary();
    assert_eq!(complaint("a.stl", &good[..good.len() - 1]), "promises 3 facets, but holds 2");
    assert_eq!(complaint("a.stl", b"hello"), "is neither a binary nor a text STL file");
    let mut many = good.clone();
    many[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(complaint("a.stl", &many), "promises 4294967295 facets, but holds 3");
    let cut = text("solid a", "", "");
    assert_eq!(complaint("a.stl", cut.as_bytes()), "ends before \"endsolid\"");
    assert_eq!(complaint("a.stl", b"solid a\nendsolid a\n"), "has no faces");
    let word = text("solid a", "endsolid", "").replace("vertex 1 0", "vertex one 0");
    assert!(complaint("a.stl", word.as_bytes()).starts_with("facet 0: "));
    let nan = text("solid a", "endsolid", "").replace("vertex 1 0", "vertex nan 0");
    let found = complaint("a.stl", nan.as_bytes());
    assert!(found.starts_with("facet 0: ") && found.contains("finite"), "{found}");
}
