//! The table of cells: hashed, so that memory follows the grains and not the domain; in a period, where cells are few enough, one slot a cell.

use std::iter::repeat_n;

use crate::blocks::{Block, Blocks};
use crate::prefetch::prefetch;
use crate::table::{Table, table};

/// Slots for each grain, at least; cells are no smaller than to have one each.
const SLOTS_PER_GRAIN: usize = 4;
/// A hashed table has so many times as many, so that few strangers share a slot, where there are no more grains than these: beyond, memory counts more.
const SPARSE: usize = 4;
const MOST_SPARSE: usize = 1 << 17;
/// Into so many cells for each grain a period is cut beyond that number: half as many, which costs nothing where most of the time is spent waiting for memory.
const CELLS_PER_GRAIN: usize = 2;
/// Fewest slots, and most: with more than some ten million grains more of them share one.
const FEWEST: usize = 64;
pub(super) const MOST_SLOTS: usize = 1 << 26;
/// A grain whose cell, as its stored position sees it, lies beyond the period: it cannot be looked at without a shift.
pub(super) const TURNED: u32 = 1 << 31;

/// How many slots so many grains get.
pub(super) fn slots(grains: usize) -> usize {
    (SLOTS_PER_GRAIN * grains).max(FEWEST).next_power_of_two().min(MOST_SLOTS)
}

/// How many slots the hashed table for so many grains has: a power of two.
pub(super) fn hashed_slots(grains: usize) -> usize {
    if grains > MOST_SPARSE { slots(grains) } else { SPARSE * slots(grains) }
}

/// Into how many cells a period is cut for so many grains, at most.
pub(super) fn cells_of_period(grains: usize) -> usize {
    // Two more slots have no cell.
    if grains > MOST_SPARSE { (CELLS_PER_GRAIN * grains).min(MOST_SLOTS - 2) } else { slots(grains) }
}

impl Block {
    /// Not 0 if one of its grains is [`TURNED`].
    #[inline]
    pub(super) fn turned(&self) -> u32 {
        (self.words[0] | self.words[1] | self.words[2]) & TURNED
    }

    /// The grains in the block.
    #[inline]
    pub(super) fn grains(&self) -> impl Iterator<Item = u32> + use<> {
        self.numbers().map(|grain| grain & !TURNED)
    }
}

/// The grains in each slot.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// What of the number of a cell tells its slot.
    mask: usize,
    /// The grains in each slot, with the bit [`TURNED`] or without.
    grains: Blocks,
    /// Whether there is a grain in the slot before each slot (bit 0), in it, and in the slot after it (bit 2): so an empty cell costs next to
    /// nothing.
    occupied: Table<u8>,
}

impl Slots {
    /// Empty slots for so many cells of a period, which have the numbers from 1 on, or else for so many grains.
    pub(super) fn new(cells: Option<usize>, grains: usize) -> Self {
        let (slots, mask) = match cells {
            // The first and the last slot have none beside them.
            Some(cells) => (cells + 2, usize::MAX),
            None => {
                let slots = hashed_slots(grains);
                (slots, slots - 1)
            }
        };
        assert!(slots <= MOST_SLOTS, "a period of {slots} cells");
        Self { mask, grains: Blocks::new(slots), occupied: table(repeat_n(0, slots)) }
    }

    /// Index of the first block of a cell.
    #[inline]
    fn first(&self, number: u32) -> usize {
        number as usize & self.mask
    }

    /// The first block of a cell.
    #[inline]
    pub(super) fn first_block(&self, number: u32) -> &Block {
        self.grains.first(self.first(number))
    }

    /// The next one of the same cell.
    #[inline]
    pub(super) fn next_block(&self, block: &Block) -> Option<&Block> {
        self.grains.next(block)
    }

    /// Puts `grain`, which may be [`TURNED`], into a cell.
    #[inline]
    pub(super) fn insert(&mut self, number: u32, grain: u32) {
        if self.grains.add(self.first(number), grain) {
            self.toggle(number);
        }
    }

    /// Takes `grain` out of its cell.
    #[inline]
    pub(super) fn remove(&mut self, number: u32, grain: u32) {
        match self.grains.remove(self.first(number), |other| other & !TURNED == grain) {
            Some(true) => self.toggle(number),
            Some(false) => {}
            None => panic!("grain {grain} is not in its cell"),
        }
    }

    /// Says whether `grain` is [`TURNED`] (that bit, or 0).
    pub(super) fn turn(&mut self, number: u32, grain: u32, turned: u32) {
        let found = self.grains.find_mut(self.first(number), |other| other & !TURNED == grain);
        *found.unwrap_or_else(|| panic!("grain {grain} is not in its cell")) = grain | turned;
    }

    /// Tells the slots beside a slot, and itself, that its first grain has come, or its last one has gone.
    #[inline]
    fn toggle(&mut self, number: u32) {
        for (step, bit) in [(1, 0), (0, 1), (u32::MAX, 2)] {
            let beside = self.first(number.wrapping_add(step));
            self.occupied[beside] ^= 1 << bit;
        }
    }

    /// Whether the slots before (bit 0), of (bit 1) and after (bit 2) that of a cell are occupied.
    #[inline]
    pub(super) fn occupied(&self, number: u32) -> u8 {
        self.occupied[self.first(number)]
    }

    /// Asks the memory for the slot of a cell.
    #[inline]
    pub(super) fn fetch(&self, number: u32) {
        prefetch(&self.occupied, self.first(number));
        self.grains.fetch(self.first(number));
    }

    /// Asks the memory for the slots before, of and after that of a cell.
    #[inline]
    pub(super) fn fetch_three(&self, number: u32) {
        prefetch(&self.occupied, self.first(number));
        // Three blocks may lie in two cache lines.
        self.grains.fetch(self.first(number.wrapping_sub(1)));
        self.grains.fetch(self.first(number.wrapping_add(1)));
    }

    /// The grains in the first block of a cell and whether the slots about it are occupied; nothing where there is no such cell.
    #[inline]
    pub(super) fn glance(&self, number: u32) -> (Block, u8) {
        let first = self.first(number);
        (self.grains.glance(first), self.occupied.get(first).copied().unwrap_or_default())
    }
}
