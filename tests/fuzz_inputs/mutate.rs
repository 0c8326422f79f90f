//! Changes to valid files, as damage and malice make them. Reproducible: all chance is a seed's.

/// splitmix64.
pub struct Chance(pub u64);

impl Chance {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `limit`; 0 if that is 0.
    pub fn below(&mut self, limit: usize) -> usize {
        if limit == 0 { 0 } else { (self.next() % limit as u64) as usize }
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

/// Numbers in text at the ends of what numbers can be, and beyond.
const WORDS: [&str; 40] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "0.5",
    "-0.0",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-320",
    "1e-9",
    "1e6",
    "1e12",
    "-1e12",
    "nan",
    "NaN",
    "inf",
    "-inf",
    ".nan",
    ".inf",
    "-.inf",
    "127",
    "255",
    "256",
    "32767",
    "65535",
    "65536",
    "2147483647",
    "-2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "340282366920938463463374607431768211456",
    "0x7fffffff",
    "1_000",
];

/// Pieces that mean something in some of the languages.
const PIECES: [&[u8]; 36] = [
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xc3\x28",
    b"\0",
    b"\r\n",
    b"\n",
    b"\t",
    b" ",
    b"#",
    b"//",
    b",",
    b";",
    b":",
    b": ",
    b"- ",
    b"[",
    b"]",
    b"{",
    b"}",
    b"\"",
    b"'",
    b"&a ",
    b"*a",
    b"<<: *a",
    b"!!binary ",
    b"---\n",
    b"? ",
    b"|\n",
    b"<!DOCTYPE a [<!ENTITY b \"c\">]>",
    b"&b;",
    b"<a>",
    b"</robot>",
    b"<!--",
    b"\xe2\x80\xa8",
    b"\x1b[31m",
    b"%YAML 1.2\n",
];

/// Up to four changes of `seed`; `other` is another valid file of its kind. Never longer than `longest` by much.
pub fn mutated(seed: &[u8], other: &[u8], longest: usize, chance: &mut Chance) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=chance.below(4) {
        change(&mut bytes, other, chance);
        bytes.truncate(longest);
    }
    bytes
}

fn change(bytes: &mut Vec<u8>, other: &[u8], chance: &mut Chance) {
    let at = chance.below(bytes.len() + 1);
    // Headers decide most: half of all changes are near the beginning.
    let at = if chance.below(2) == 0 { at.min(chance.below(256)) } else { at };
    match chance.below(16) {
        0 | 1 => flip(bytes, at, chance),
        2 => {
            if let Some(byte) = bytes.get_mut(at) {
                *byte = chance.one(&[0, 1, 0x7f, 0x80, 0xff, b' ', b'\n', b'0', b'9', b'-']);
            }
        }
        3 => bytes.truncate(at),
        4 => {
            let more: Vec<u8> = (0..1 + chance.below(16)).map(|_| chance.next() as u8).collect();
            insert(bytes, at, &more);
        }
        5 | 6 => {
            let piece = chance.one(&PIECES);
            insert(bytes, at, piece);
        }
        7 => {
            let end = (at + 1 + chance.below(64)).min(bytes.len());
            bytes.drain(at.min(end)..end);
        }
        // A block once more, once or often.
        8 => {
            let end = (at + 1 + chance.below(128)).min(bytes.len());
            let block = bytes[at.min(end)..end].to_vec();
            let times = if chance.below(8) == 0 { 1 + chance.below(200) } else { 1 + chance.below(3) };
            insert(bytes, at, &block.repeat(times));
        }
        9 => {
            let from = chance.below(other.len());
            let end = (from + 1 + chance.below(256)).min(other.len());
            if chance.below(2) == 0 {
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            } else {
                insert(bytes, at, &other[from..end]);
            }
        }
        10..=12 => number(bytes, at, chance),
        13 => binary_number(bytes, at, chance),
        // Lines and line ends.
        14 => match chance.below(3) {
            0 => *bytes = String::from_utf8_lossy(bytes).replace('\n', "\r\n").into_bytes(),
            1 => swap_lines(bytes, chance),
            _ => insert(bytes, 0, b"\xef\xbb\xbf"),
        },
        // Nested deeply.
        _ => {
            let (open, close): (&[u8], &[u8]) =
                chance.one(&[(b"[", b"]"), (b"{\"a\":", b"}"), (b"<a>", b"</a>"), (b"- ", b""), (b"(", b")")]);
            let depth = chance.one(&[3, 40, 200, 3000]);
            let mut nest = open.repeat(depth);
            nest.extend(close.repeat(depth));
            insert(bytes, at, &nest);
        }
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, more: &[u8]) {
    let at = at.min(bytes.len());
    bytes.splice(at..at, more.iter().copied());
}

fn flip(bytes: &mut [u8], at: usize, chance: &mut Chance) {
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << chance.below(8);
    }
}

/// The first number in text from `at` on becomes an extreme one.
fn number(bytes: &mut Vec<u8>, at: usize, chance: &mut Chance) {
    let digit = |b: &u8| b.is_ascii_digit();
    let Some(begin) = bytes[at.min(bytes.len())..].iter().position(digit).map(|n| at + n) else { return };
    let end = bytes[begin..].iter().position(|b| !(digit(b) || *b == b'.')).map_or(bytes.len(), |n| begin + n);
    bytes.splice(begin..end, chance.one(&WORDS).bytes());
}

fn binary_number(bytes: &mut [u8], at: usize, chance: &mut Chance) {
    let doubles = [f64::NAN, f64::INFINITY, -1.0, 1e300, 5e-324, 0.0].map(f64::to_le_bytes);
    let longs = [u64::MAX, 1 << 63, 1 << 40, 1 << 32, 0, i64::MAX as u64].map(u64::to_le_bytes);
    let words = [u32::MAX, 1 << 31, 0x7fff_ffff, 0, 1, f32::NAN.to_bits()].map(u32::to_le_bytes);
    let halves = [u16::MAX, 1 << 15, 0, 1].map(u16::to_le_bytes);
    let mut value = match chance.below(4) {
        0 => chance.one(&doubles).to_vec(),
        1 => chance.one(&longs).to_vec(),
        2 => chance.one(&words).to_vec(),
        _ => chance.one(&halves).to_vec(),
    };
    if chance.below(4) == 0 {
        value.reverse();
    }
    if let Some(place) = bytes.get_mut(at..at + value.len()) {
        place.copy_from_slice(&value);
    }
}

fn swap_lines(bytes: &mut Vec<u8>, chance: &mut Chance) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|b| *b == b'\n').collect();
    let (a, b) = (chance.below(lines.len()), chance.below(lines.len()));
    if !lines.is_empty() {
        lines.swap(a, b);
    }
    *bytes = lines.concat();
}
