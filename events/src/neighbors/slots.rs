//! The table of cells: hashed, so that memory follows the grains and not the domain; in a period, where cells are few enough, one slot a cell.

use crate::prefetch::prefetch;

/// Slots for each grain, at least; cells are no smaller than to have one each.
const SLOTS_PER_GRAIN: usize = 4;
/// A hashed table has so many times as many, so that few strangers share a slot, where there are no more grains than these: beyond, memory counts more.
const SPARSE: usize = 4;
const MOST_SPARSE: usize = 1 << 17;
/// Fewest slots.
const FEWEST: usize = 64;

/// How many slots so many grains get.
pub(super) fn slots(grains: usize) -> usize {
    (SLOTS_PER_GRAIN * grains).max(FEWEST).next_power_of_two()
}

/// The first grain in each slot, if there is one.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// What of the number of a cell tells its slot.
    mask: usize,
    first: Vec<u32>,
    /// Whether there is a grain in the slot before each slot (bit 0), in it, and in the slot after it (bit 2): so an empty cell costs next to
    /// nothing.
    occupied: Vec<u8>,
}

impl Slots {
    /// Empty slots for so many cells of a period, which have the numbers from 1 on, or else for so many grains. `nobody` stands for no grain.
    pub(super) fn new(cells: Option<usize>, grains: usize, nobody: u32) -> Self {
        let (slots, mask) = match cells {
            // The first and the last slot have none beside them.
            Some(cells) => (cells + 2, usize::MAX),
            None => {
                let slots = if grains > MOST_SPARSE { slots(grains) } else { SPARSE * slots(grains) };
                (slots, slots - 1)
            }
        };
        Self { mask, first: vec![nobody; slots], occupied: vec![0; slots] }
    }

    /// The slot of the cell with this number.
    #[inline]
    fn slot(&self, number: u32) -> usize {
        number as usize & self.mask
    }

    /// The first grain in the slot of a cell, or nobody.
    #[inline]
    pub(super) fn first(&self, number: u32) -> u32 {
        self.first[self.slot(number)]
    }

    /// Makes `grain`, or `nobody`, the first in the slot of a cell; gives the one that was.
    #[inline]
    pub(super) fn replace_first(&mut self, number: u32, grain: u32, nobody: u32) -> u32 {
        let slot = self.slot(number);
        let before = std::mem::replace(&mut self.first[slot], grain);
        if (before == nobody) != (grain == nobody) {
            for (step, bit) in [(1, 0), (0, 1), (u32::MAX, 2)] {
                let beside = self.slot(number.wrapping_add(step));
                self.occupied[beside] ^= 1 << bit;
            }
        }
        before
    }

    /// Asks the memory for the slot of a cell.
    #[inline]
    pub(super) fn fetch(&self, number: u32) {
        prefetch(&self.occupied, self.slot(number));
        prefetch(&self.first, self.slot(number));
    }

    /// The first grain in the slot of a cell and whether the slots about it are occupied, or zeros where there is no such cell.
    #[inline]
    pub(super) fn glance(&self, number: u32) -> (u32, u8) {
        let slot = self.slot(number);
        let or_zero = |found: Option<(&u32, &u8)>| found.map_or((0, 0), |(&first, &occupied)| (first, occupied));
        or_zero(self.first.get(slot).zip(self.occupied.get(slot)))
    }

    /// Whether the slots before (bit 0), of (bit 1) and after (bit 2) that of a cell are occupied.
    #[inline]
    pub(super) fn occupied(&self, number: u32) -> u8 {
        self.occupied[self.slot(number)]
    }
}
