//! PGM images: P5 (binary, 8 and 16 bit) and P2 (text), comments in the header.

use super::error::MapError;
use super::points::quote;

/// A grey image. Pixel `column, row` is `pixels[row * width + column]`; row 0 is the top.
#[derive(Debug, PartialEq)]
pub(super) struct Image {
    pub(super) width: usize,
    pub(super) height: usize,
    /// White.
    pub(super) max: u16,
    pub(super) pixels: Vec<u16>,
}

/// Reads a PGM.
pub(super) fn read(bytes: &[u8]) -> Result<Image, MapError> {
    let plain = match bytes.get(..2) {
        Some(b"P5") => false,
        Some(b"P2") => true,
        _ => return Err(MapError::NotPgm { found: kind(bytes) }),
    };
    let mut at = 2;
    let width = size(bytes, &mut at, "the width")?;
    let height = size(bytes, &mut at, "the height")?;
    let max = word(bytes, &mut at);
    let max = std::str::from_utf8(max)
        .ok()
        .and_then(|w| w.parse::<u16>().ok())
        .filter(|m| *m > 0)
        .ok_or_else(|| MapError::PgmHeader { expected: "the maximum, 1 to 65535", found: quote(max) })?;
    let body = &bytes[(at + 1).min(bytes.len())..]; // one blank ends the header
    let promised = u128::from(width) * u128::from(height);
    let pixels = if plain { text(body, promised)? } else { binary(body, promised, max, width)? };
    if let Some(index) = pixels.iter().position(|v| *v > max) {
        return Err(MapError::Pixel { index, value: pixels[index].into(), max: max.into() });
    }
    // Their product is the number of pixels read, so each fits.
    Ok(Image { width: width as usize, height: height as usize, max, pixels })
}

fn binary(body: &[u8], promised: u128, max: u16, width: u64) -> Result<Vec<u16>, MapError> {
    let size: u128 = if max > 255 { 2 } else { 1 };
    let (unit, promised_bytes, have_bytes) = ("pixels", promised.saturating_mul(size), body.len() as u128);
    if have_bytes < promised_bytes {
        return Err(MapError::Truncated { unit, promised, promised_bytes, have_bytes });
    }
    // Less than a row may be a newline or padding.
    if have_bytes >= promised_bytes + u128::from(width) * size && have_bytes > promised_bytes + 2 {
        return Err(MapError::Surplus { unit, promised, promised_bytes, have_bytes });
    }
    let body = &body[..promised_bytes as usize];
    Ok(if size == 2 {
        body.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()
    } else {
        body.iter().map(|b| u16::from(*b)).collect()
    })
}

fn text(body: &[u8], promised: u128) -> Result<Vec<u16>, MapError> {
    let mut pixels = Vec::new();
    let mut at = 0;
    loop {
        let word = word(body, &mut at);
        if word.is_empty() {
            break;
        }
        let value = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        let value =
            value.ok_or_else(|| MapError::PgmHeader { expected: "pixels from 0 to 65535", found: quote(word) })?;
        pixels.push(value);
    }
    if pixels.len() as u128 != promised {
        let have = pixels.len() as u64;
        return Err(MapError::RowsDiffer { unit: "pixels", promised: promised.try_into().unwrap_or(u64::MAX), have });
    }
    Ok(pixels)
}

/// A size of the image; sides beyond u32 are no image.
fn size(bytes: &[u8], at: &mut usize, expected: &'static str) -> Result<u64, MapError> {
    let word = word(bytes, at);
    let value = std::str::from_utf8(word).ok().and_then(|w| w.parse::<u32>().ok()).filter(|v| *v > 0);
    value.map(u64::from).ok_or_else(|| MapError::PgmHeader { expected, found: quote(word) })
}

/// The next word; blanks and comments (`#` to the line's end) before it are skipped. Empty at the end.
fn word<'a>(bytes: &'a [u8], at: &mut usize) -> &'a [u8] {
    while let Some(b) = bytes.get(*at) {
        if *b == b'#' {
            while bytes.get(*at).is_some_and(|b| *b != b'\n') {
                *at += 1;
            }
        } else if b.is_ascii_whitespace() {
            *at += 1;
        } else {
            break;
        }
    }
    let start = *at;
    while bytes.get(*at).is_some_and(|b| !b.is_ascii_whitespace() && *b != b'#') {
        *at += 1;
    }
    &bytes[start..*at]
}

/// What an image is that is not a PGM.
fn kind(bytes: &[u8]) -> &'static str {
    match bytes {
        [] => "empty",
        [0x89, b'P', b'N', b'G', ..] => "a PNG",
        [0xFF, 0xD8, ..] => "a JPEG",
        [b'B', b'M', ..] => "a BMP",
        [b'P', b'1' | b'4', ..] => "a black-and-white PBM",
        [b'P', b'3' | b'6', ..] => "a coloured PPM",
        _ => "of an unknown kind",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_stand_anywhere_in_the_header() {
        let image = read(b"P5 # made by hand\n#\n3 # wide\n2\n# white\n255\n\x00\x01\x02\xfd\xfe\xff").expect("good");
        assert_eq!(image, Image { width: 3, height: 2, max: 255, pixels: vec![0, 1, 2, 253, 254, 255] });
    }

    #[test]
    fn the_first_pixel_may_look_like_a_blank_or_a_comment() {
        let image = read(b"P5 2 1 255\n#\n").expect("good");
        assert_eq!(image.pixels, [35, 10]);
    }

    #[test]
    fn sixteen_bits_come_high_byte_first() {
        let image = read(b"P5 2 1 1000\n\x03\xe8\x00\x07").expect("good");
        assert_eq!(image.pixels, [1000, 7]);
    }

    #[test]
    fn text_pixels_are_counted() {
        assert_eq!(read(b"P2 2 2 9\n0 9\n4 5\n").expect("good").pixels, [0, 9, 4, 5]);
        assert!(matches!(read(b"P2 2 2 9\n0 9\n4"), Err(MapError::RowsDiffer { promised: 4, have: 3, .. })));
    }

    #[test]
    fn lies_are_refused_before_memory_is_taken() {
        let error = read(b"P5 4000000000 4000000000 255\n\x00").expect_err("sixteen exabytes");
        assert!(matches!(error, MapError::Truncated { have_bytes: 1, .. }), "{error}");
        assert!(matches!(read(b"P5 2 1 255\n\x00\x01\x02\x03\x04"), Err(MapError::Surplus { .. })));
        assert!(matches!(read(b"P5 2 1 100\n\x00\x65"), Err(MapError::Pixel { index: 1, value: 101, max: 100 })));
        assert!(matches!(read(b"\x89PNG\r\n"), Err(MapError::NotPgm { found: "a PNG" })));
    }
}
