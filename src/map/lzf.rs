//! LZF, the compression of `DATA binary_compressed`.

/// No code of LZF makes more than this many bytes of one: a match of 264 bytes takes three.
const BEST_RATIO: usize = 88;

/// Unpacks `packed` into exactly `size` bytes.
///
/// # Errors
/// Where in `packed` it went wrong, and how many bytes had been unpacked by then. Memory follows what is really unpacked, not
/// `size`.
pub(super) fn unpack(packed: &[u8], size: usize) -> Result<Vec<u8>, (usize, usize)> {
    if size > packed.len().saturating_mul(BEST_RATIO) {
        return Err((0, 0));
    }
    let mut out: Vec<u8> = Vec::with_capacity(size.min(packed.len().saturating_mul(4)));
    let mut at = 0;
    while at < packed.len() {
        let begin = at;
        let fault = |out: &Vec<u8>| (begin, out.len());
        let control = packed[at] as usize;
        at += 1;
        if control < 32 {
            let literal = packed.get(at..at + control + 1).ok_or_else(|| fault(&out))?;
            out.extend_from_slice(literal);
            at += control + 1;
        } else {
            let mut length = control >> 5;
            if length == 7 {
                length += *packed.get(at).ok_or_else(|| fault(&out))? as usize;
                at += 1;
            }
            let low = *packed.get(at).ok_or_else(|| fault(&out))? as usize;
            at += 1;
            let back = ((control & 31) << 8) + low + 1;
            let start = out.len().checked_sub(back).ok_or_else(|| fault(&out))?;
            // Byte by byte where it may read what it has just written.
            if back >= length + 2 {
                out.extend_from_within(start..start + length + 2);
            } else {
                for k in start..start + length + 2 {
                    out.push(out[k]);
                }
            }
        }
        if out.len() > size {
            return Err(fault(&out));
        }
    }
    if out.len() == size { Ok(out) } else { Err((at, out.len())) }
}

/// Packs bytes, for tests: greedy matches by a table of the last place of each three bytes.
#[cfg(test)]
pub(super) fn pack(bytes: &[u8]) -> Vec<u8> {
    let mut last = std::collections::BTreeMap::new();
    let (mut out, mut literal, mut at) = (Vec::new(), Vec::new(), 0);
    let flush = |out: &mut Vec<u8>, literal: &mut Vec<u8>| {
        for run in literal.chunks(32) {
            out.push(run.len() as u8 - 1);
            out.extend(run);
        }
        literal.clear();
    };
    while at < bytes.len() {
        let found = bytes.get(at..at + 3).and_then(|key| last.insert(key, at)).filter(|p| at - p <= 8192);
        let length =
            found.map_or(0, |p| (0..264.min(bytes.len() - at)).take_while(|k| bytes[p + k] == bytes[at + k]).count());
        if length >= 3 {
            flush(&mut out, &mut literal);
            let back = at - found.expect("a match was found") - 1;
            let code = length - 2;
            if code < 7 {
                out.push((code << 5 | back >> 8) as u8);
            } else {
                out.extend([(7 << 5 | back >> 8) as u8, (code - 7) as u8]);
            }
            out.push(back as u8);
            at += length;
        } else {
            literal.push(bytes[at]);
            at += 1;
        }
    }
    flush(&mut out, &mut literal);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_match_may_overlap_what_it_writes() {
        // One literal `a`, then nine bytes from one back.
        assert_eq!(unpack(&[0, b'a', 7 << 5, 0, 0], 10), Ok(vec![b'a'; 10]));
    }

    #[test]
    fn a_match_before_the_beginning_is_damage() {
        assert_eq!(unpack(&[0, b'a', 1 << 5, 1], 4), Err((2, 1)));
    }

    proptest! {
        #[test]
        fn unpacking_undoes_packing(bytes in prop::collection::vec(0u8..4, 0..2000)) {
            let packed = pack(&bytes);
            let unpacked = unpack(&packed, bytes.len());
            prop_assert_eq!(unpacked.as_ref(), Ok(&bytes));
            prop_assert!(unpack(&packed, bytes.len() + 1).is_err());
        }

        #[test]
        fn garbage_is_refused_or_unpacked_but_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..300), size in 0usize..5000) {
            let _ = unpack(&bytes, size);
        }
    }
}
