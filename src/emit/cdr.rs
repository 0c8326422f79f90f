//! CDR, the wire format of ROS 2 messages: little-endian, each value aligned to its own size counted from behind the
//! four-byte head. Only what the seven message types of a command file need.

/// Head of plain little-endian CDR.
const HEAD: [u8; 4] = [0, 1, 0, 0];

/// Writes one message.
#[derive(Debug)]
pub struct Writer {
    bytes: Vec<u8>,
}

impl Default for Writer {
    fn default() -> Self {
        Self { bytes: HEAD.to_vec() }
    }
}

impl Writer {
    /// The message's bytes, head included.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }

    fn align(&mut self, size: usize) {
        let behind = (self.bytes.len() - HEAD.len()).next_multiple_of(size);
        self.bytes.resize(HEAD.len() + behind, 0);
    }

    /// `uint32`, also the length of a sequence.
    pub fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    /// `int32`.
    pub fn i32(&mut self, value: i32) {
        self.align(4);
        self.bytes.extend(value.to_le_bytes());
    }

    /// `float64`. Zero is written without a sign.
    pub fn f64(&mut self, value: f64) {
        self.align(8);
        self.bytes.extend((value + 0.0).to_le_bytes());
    }

    /// Number of elements of a sequence; the elements follow.
    pub fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).expect("a message of 4 GiB fits no memory of ours"));
    }

    /// `string`: its length with the closing zero, its bytes, a zero.
    pub fn string(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// `float64[n]`, or that many fields one after the other.
    pub fn f64_array(&mut self, values: &[f64]) {
        values.iter().for_each(|v| self.f64(*v));
    }

    /// `float64[]`.
    pub fn f64s(&mut self, values: &[f64]) {
        self.length(values.len());
        self.f64_array(values);
    }
}

/// Why bytes are no message of the type expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// Other encapsulation: big-endian, XCDR2, or no CDR at all.
    #[error("not little-endian plain CDR")]
    Head,
    /// The message is shorter than its type.
    #[error("the message is cut short")]
    Short,
    /// The message is longer than its type.
    #[error("{0} bytes are left over behind the message")]
    Long(usize),
    /// A string that is no UTF-8 or has no closing zero.
    #[error("a string is not zero-terminated UTF-8")]
    String,
}

/// Reads one message.
#[derive(Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// Behind the head.
    ///
    /// # Errors
    /// [`CdrError::Head`].
    pub fn new(bytes: &'a [u8]) -> Result<Self, CdrError> {
        match bytes.strip_prefix(&HEAD) {
            Some(bytes) => Ok(Self { bytes, at: 0 }),
            None => Err(CdrError::Head),
        }
    }

    /// Checks that all was read, but for padding to a multiple of four.
    ///
    /// # Errors
    /// [`CdrError::Long`].
    pub fn finish(self) -> Result<(), CdrError> {
        match self.bytes.len().saturating_sub(self.at) {
            left @ 0..=3 if self.bytes[self.bytes.len() - left..].iter().all(|b| *b == 0) => Ok(()),
            left => Err(CdrError::Long(left)),
        }
    }

    fn take(&mut self, align: usize, length: usize) -> Result<&'a [u8], CdrError> {
        let from = self.at.next_multiple_of(align);
        let taken = from.checked_add(length).and_then(|to| self.bytes.get(from..to)).ok_or(CdrError::Short)?;
        self.at = from + length;
        Ok(taken)
    }

    /// `uint32`.
    ///
    /// # Errors
    /// [`CdrError::Short`].
    pub fn u32(&mut self) -> Result<u32, CdrError> {
        let bytes = self.take(4, 4)?;
        Ok(u32::from_le_bytes(bytes.try_into().expect("four bytes taken")))
    }

    /// `int32`.
    ///
    /// # Errors
    /// [`CdrError::Short`].
    pub fn i32(&mut self) -> Result<i32, CdrError> {
        let bytes = self.take(4, 4)?;
        Ok(i32::from_le_bytes(bytes.try_into().expect("four bytes taken")))
    }

    /// `float64`.
    ///
    /// # Errors
    /// [`CdrError::Short`].
    pub fn f64(&mut self) -> Result<f64, CdrError> {
        let bytes = self.take(8, 8)?;
        Ok(f64::from_le_bytes(bytes.try_into().expect("eight bytes taken")))
    }

    /// `string`.
    ///
    /// # Errors
    /// [`CdrError::Short`], [`CdrError::String`].
    pub fn string(&mut self) -> Result<&'a str, CdrError> {
        let length = self.u32()? as usize;
        let text = self.take(1, length)?.strip_suffix(&[0]).ok_or(CdrError::String)?;
        std::str::from_utf8(text).map_err(|_| CdrError::String)
    }

    /// `float64[]`.
    ///
    /// # Errors
    /// [`CdrError::Short`].
    pub fn f64s(&mut self) -> Result<Vec<f64>, CdrError> {
        // Not `with_capacity`: the length may lie.
        (0..self.u32()?).map(|_| self.f64()).collect()
    }

    /// A sequence of anything else.
    ///
    /// # Errors
    /// Those of the elements.
    pub fn sequence<T>(&mut self, element: impl Fn(&mut Self) -> Result<T, CdrError>) -> Result<Vec<T>, CdrError> {
        (0..self.u32()?).map(|_| element(self)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_aligned_to_their_size_behind_the_head() {
        let mut w = Writer::default();
        w.string("ab");
        w.f64(-0.0);
        w.i32(-2);
        w.f64s(&[]);
        let wanted = [
            &[0, 1, 0, 0][..],
            &[3, 0, 0, 0, b'a', b'b', 0, 0][..],
            &[0; 8][..],
            &[254, 255, 255, 255][..],
            &[0; 4][..], // an empty sequence ends here: no padding for elements that are not there
        ]
        .concat();
        assert_eq!(w.finish(), wanted);
    }

    #[test]
    fn what_was_written_reads_back() {
        let mut w = Writer::default();
        w.string("wheel");
        w.f64s(&[1.5, -2.25]);
        w.u32(7);
        w.length(2);
        w.string("");
        w.string("ü");
        let bytes = w.finish();
        let mut r = Reader::new(&bytes).expect("our head");
        assert_eq!(r.string(), Ok("wheel"));
        assert_eq!(r.f64s(), Ok(vec![1.5, -2.25]));
        assert_eq!(r.u32(), Ok(7));
        assert_eq!(r.sequence(|r| r.string()), Ok(vec!["", "ü"]));
        assert_eq!(r.finish(), Ok(()));
    }

    #[test]
    fn lying_lengths_and_foreign_bytes_are_refused_without_allocating_them() {
        assert_eq!(Reader::new(&[0, 0, 0, 0]).err(), Some(CdrError::Head));
        assert_eq!(Reader::new(&[0, 1]).err(), Some(CdrError::Head));
        let lie = [0, 1, 0, 0, 255, 255, 255, 255, 1, 2, 3];
        assert_eq!(Reader::new(&lie).expect("head").f64s(), Err(CdrError::Short));
        assert_eq!(Reader::new(&lie).expect("head").string(), Err(CdrError::Short));
        assert_eq!(Reader::new(&lie).expect("head").finish(), Err(CdrError::Long(7)));
        let open = [0, 1, 0, 0, 1, 0, 0, 0, b'a'];
        assert_eq!(Reader::new(&open).expect("head").string(), Err(CdrError::String));
    }
}
