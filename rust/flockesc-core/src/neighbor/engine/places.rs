//! `Places`: lists of places that grow by the set bits of bytes, without a branch per bit.

use crate::agents::FANOUT;

/// A list of places or leaves. Entries from `len` on are unspecified.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    pub(super) places: Vec<u32>,
    pub(super) len: usize,
}

impl Places {
    /// Returns the memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.places.capacity() * size_of::<u32>()
    }

    /// Returns a writer with room for `count` calls of [`Writer::add`].
    #[inline(always)]
    pub(super) fn writer(&mut self, count: usize) -> Writer<'_> {
        let room = self.len + (count + 1) * FANOUT;
        if self.places.len() < room {
            self.places.resize(2 * room, 0);
        }
        Writer {
            places: &mut self.places,
            len: self.len,
        }
    }
}

/// Adds entries to a list. Its length stays in a register while entries are added.
pub(super) struct Writer<'a> {
    places: &'a mut [u32],
    /// The new length of the list. The caller stores it.
    pub(super) len: usize,
}

impl Writer<'_> {
    /// Adds `first` plus the position of every set bit. There is no branch per bit, because it would be
    /// unpredictable.
    #[inline(always)]
    pub(super) fn add(&mut self, first: usize, bits: u8) {
        let places = &mut self.places[self.len..self.len + FANOUT];
        for (place, bit) in places.iter_mut().zip(SET_BITS[bits as usize]) {
            *place = first as u32 + bit;
        }
        self.len += bits.count_ones() as usize;
    }
}

/// Positions of the set bits of every byte, lowest first, padded with zeros.
static SET_BITS: [[u32; FANOUT]; 256] = {
    let mut table = [[0; FANOUT]; 256];
    let mut byte = 0;
    while byte < 256 {
        let (mut bit, mut found) = (0, 0);
        while bit < FANOUT {
            if byte >> bit & 1 == 1 {
                table[byte][found] = bit as u32;
                found += 1;
            }
            bit += 1;
        }
        byte += 1;
    }
    table
};
