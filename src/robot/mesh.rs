//! Vertices of STL (ascii, binary) and OBJ files.
//!
//! Own readers. What a hull needs is the vertices alone; `stl_io` refuses `facet normal nan nan nan`, takes a binary file whose
//! header begins with `solid ` for text, and stops after the first of several solids, which would make the hull too small.

/// Why a mesh file has no vertices for us.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Neither STL nor OBJ by its ending.
    #[error("mesh format `.{0}` is not supported")]
    Format(String),
    /// A binary STL is shorter than its own count of triangles says.
    #[error("binary STL of {bytes} bytes cannot hold its {triangles} triangles ({needed} bytes): cut short?")]
    Truncated {
        /// As in the header.
        triangles: u32,
        /// Length of the file.
        bytes: usize,
        /// Length that the header asks for.
        needed: u64,
    },
    /// An ascii STL without its last line, or with an incomplete triangle.
    #[error("ascii STL has {vertices} vertices and no `endsolid` at its end: cut short?")]
    Unfinished {
        /// Vertices up to there.
        vertices: usize,
    },
    /// A vertex that is not three finite numbers; `place` counts lines (text) or triangles (binary) from 1.
    #[error("vertex in {unit} {place} is not three finite numbers")]
    NotFinite {
        /// `line` or `triangle`.
        unit: &'static str,
        /// From 1.
        place: usize,
    },
    /// No vertex at all.
    #[error("no vertices")]
    Empty,
}

/// Bytes before the triangles of a binary STL: a comment and the count.
const STL_HEADER: usize = 84;
/// Normal, three vertices, attribute.
const STL_TRIANGLE: usize = 50;

/// The vertices of a mesh file, as written (no scale). `name` tells the format by its ending.
///
/// # Errors
/// [`MeshError`]: unknown format, truncated or not finite.
pub fn vertices(name: &str, bytes: &[u8]) -> Result<Vec<[f64; 3]>, MeshError> {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
    let points = match ending.as_str() {
        "stl" => stl(bytes)?,
        "obj" => text_vertices(bytes, "v")?,
        _ => return Err(MeshError::Format(ending)),
    };
    if points.is_empty() { Err(MeshError::Empty) } else { Ok(points) }
}

fn stl(bytes: &[u8]) -> Result<Vec<[f64; 3]>, MeshError> {
    let count = bytes.get(80..STL_HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let needed = |triangles: u32| STL_HEADER as u64 + STL_TRIANGLE as u64 * u64::from(triangles);
    // Binary files may begin with "solid" too; the length tells them apart, and text has no zero bytes.
    let exact = count.is_some_and(|n| needed(n) == bytes.len() as u64);
    if !exact && bytes.trim_ascii_start().starts_with(b"solid") && !bytes.contains(&0) {
        return ascii_stl(bytes);
    }
    match count {
        None => Err(MeshError::Truncated { triangles: 0, bytes: bytes.len(), needed: needed(0) }),
        Some(triangles) if needed(triangles) > bytes.len() as u64 => {
            Err(MeshError::Truncated { triangles, bytes: bytes.len(), needed: needed(triangles) })
        }
        Some(triangles) => binary_stl(bytes, triangles as usize),
    }
}

fn binary_stl(bytes: &[u8], triangles: usize) -> Result<Vec<[f64; 3]>, MeshError> {
    let mut points = Vec::with_capacity(3 * triangles);
    for (place, triangle) in bytes[STL_HEADER..].chunks_exact(STL_TRIANGLE).take(triangles).enumerate() {
        for vertex in triangle[12..48].chunks_exact(12) {
            let number =
                |i: usize| f64::from(f32::from_le_bytes([vertex[i], vertex[i + 1], vertex[i + 2], vertex[i + 3]]));
            let point = [number(0), number(4), number(8)];
            if !point.iter().all(|v| v.is_finite()) {
                return Err(MeshError::NotFinite { unit: "triangle", place: place + 1 });
            }
            points.push(point);
        }
    }
    Ok(points)
}

fn ascii_stl(bytes: &[u8]) -> Result<Vec<[f64; 3]>, MeshError> {
    let points = text_vertices(bytes, "vertex")?;
    let text = bytes.trim_ascii_end();
    let last_line = text.rsplit(|b| *b == b'\n').next().unwrap_or(text).trim_ascii_start();
    if points.len() % 3 == 0 && last_line.to_ascii_lowercase().starts_with(b"endsolid") {
        Ok(points)
    } else {
        Err(MeshError::Unfinished { vertices: points.len() })
    }
}

/// Points of all lines `key x y z …`.
fn text_vertices(bytes: &[u8], key: &str) -> Result<Vec<[f64; 3]>, MeshError> {
    let mut points = Vec::new();
    // Names and comments may be in any encoding; numbers are ASCII.
    for (line, text) in bytes.split(|b| *b == b'\n').enumerate() {
        let text = String::from_utf8_lossy(text);
        let mut words = text.split_whitespace();
        if words.next().is_none_or(|word| !word.eq_ignore_ascii_case(key)) {
            continue;
        }
        let numbers: Vec<f64> = words.take(3).map_while(|w| w.parse().ok()).filter(|v: &f64| v.is_finite()).collect();
        match numbers[..] {
            [x, y, z] => points.push([x, y, z]),
            _ => return Err(MeshError::NotFinite { unit: "line", place: line + 1 }),
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary(triangles: &[[[f32; 3]; 3]], header: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes[..header.len()].copy_from_slice(header);
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for triangle in triangles {
            bytes.extend([0; 12]);
            bytes.extend(triangle.iter().flatten().flat_map(|v| v.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.5]];
    const ASCII: &str = "solid a\nfacet normal nan nan nan\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 2e0 0.5\n \
                         endloop\nendfacet\nendsolid a\n";

    #[test]
    fn ascii_and_binary_give_the_same_vertices() {
        let expected: Vec<[f64; 3]> = TRIANGLE.iter().map(|v| v.map(f64::from)).collect();
        assert_eq!(vertices("a.STL", &binary(&[TRIANGLE], b"")).unwrap(), expected);
        assert_eq!(vertices("a.stl", &binary(&[TRIANGLE], b"solid but binary")).unwrap(), expected);
        assert_eq!(vertices("a.stl", ASCII.as_bytes()).unwrap(), expected);
        assert_eq!(vertices("a.obj", b"# c\nv 0 0 0\nvn 9 9 9\nv 1 0 0 1.0\r\nv 0 2 .5\nf 1 2 3").unwrap(), expected);
    }

    #[test]
    fn an_independent_reader_agrees_on_binary_files() {
        let bytes = binary(&[TRIANGLE, TRIANGLE.map(|v| v.map(|c| c + 0.3))], b"x");
        let peer = stl_io::read_stl(&mut std::io::Cursor::new(&bytes)).unwrap();
        let indexed = peer.faces.iter().flat_map(|f| f.vertices).map(|i| peer.vertices[i].0.map(f64::from));
        assert_eq!(vertices("a.stl", &bytes).unwrap(), indexed.collect::<Vec<_>>());
    }

    #[test]
    fn several_solids_in_one_file_all_count() {
        assert_eq!(vertices("a.stl", ASCII.repeat(2).as_bytes()).unwrap().len(), 6);
    }

    #[test]
    fn every_cut_of_a_file_is_refused() {
        let bytes = binary(&[TRIANGLE, TRIANGLE], b"");
        for length in 0..bytes.len() {
            assert!(matches!(vertices("a.stl", &bytes[..length]), Err(MeshError::Truncated { .. })), "{length}");
        }
        for length in 0..ASCII.len() - "endsolid a\n".len() {
            assert!(vertices("a.stl", &ASCII.as_bytes()[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn a_header_that_lies_about_its_count_allocates_nothing() {
        let mut bytes = binary(&[TRIANGLE], b"");
        bytes[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
        let error = vertices("a.stl", &bytes).unwrap_err();
        assert!(matches!(error, MeshError::Truncated { triangles: u32::MAX, bytes: 134, .. }), "{error}");
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused_with_their_place() {
        let bad = binary(&[TRIANGLE, [[0.0; 3], [f32::NAN, 0.0, 0.0], [0.0; 3]]], b"");
        assert_eq!(vertices("a.stl", &bad), Err(MeshError::NotFinite { unit: "triangle", place: 2 }));
        assert_eq!(vertices("a.obj", b"v 0 0 0\nv 1 2\n"), Err(MeshError::NotFinite { unit: "line", place: 2 }));
        assert_eq!(vertices("a.obj", b"v inf 0 0\n"), Err(MeshError::NotFinite { unit: "line", place: 1 }));
        assert_eq!(vertices("a.obj", b"f 1 2 3\n"), Err(MeshError::Empty));
        assert_eq!(vertices("a.DAE", b""), Err(MeshError::Format("dae".into())));
    }
}
