//! UTF-16 into UTF-8, block by block.

/// A decoder that keeps what a block leaves unfinished.
#[derive(Clone, Debug)]
pub(super) struct Utf16 {
    is_big_endian: bool,
    /// An odd byte of the block before.
    byte: Option<u8>,
    /// The first half of a pair of surrogates.
    high: Option<u16>,
}

impl Utf16 {
    /// The decoder that a byte order mark asks for.
    pub fn of_mark(start: &[u8]) -> Option<Self> {
        let is_big_endian = match start.get(..2)? {
            [0xff, 0xfe] => false,
            [0xfe, 0xff] => true,
            _ => return None,
        };
        Some(Self {
            is_big_endian,
            byte: None,
            high: None,
        })
    }

    /// The block as UTF-8. What cannot be decoded becomes U+FFFD.
    pub fn decode(&mut self, block: &[u8]) -> Vec<u8> {
        let bytes: Vec<u8> = self
            .byte
            .take()
            .into_iter()
            .chain(block.iter().copied())
            .collect();
        let mut pairs = bytes.chunks_exact(2);
        let units: Vec<u16> = self
            .high
            .take()
            .into_iter()
            .chain(pairs.by_ref().map(|pair| match self.is_big_endian {
                true => u16::from_be_bytes([pair[0], pair[1]]),
                false => u16::from_le_bytes([pair[0], pair[1]]),
            }))
            .collect();
        self.byte = pairs.remainder().first().copied();
        let (whole, high) = match units.split_last() {
            Some((last, rest)) if (0xd800..0xdc00).contains(last) => (rest, Some(*last)),
            _ => (&units[..], None),
        };
        self.high = high;
        let decoded = char::decode_utf16(whole.iter().copied());
        let text: String = decoded
            .map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect();
        text.into_bytes()
    }
}
