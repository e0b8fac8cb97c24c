//! Many short lists of numbers, in blocks of three: what is asked of a list comes with one cache line, as a rule.

use std::iter::repeat_n;

use crate::prefetch::prefetch;
use crate::table::{Table, make_room, table};

/// Up to three numbers of one list, and where the rest are, in 16 bytes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(crate) struct Block {
    /// The first [`count`](Self::count) of the first three are numbers; the rest of these are 0. The last is how many they are, and four times the
    /// index of the next block of this list, or 0 if there is none.
    pub(crate) words: [u32; 4],
}

impl Block {
    /// So many numbers fit.
    pub(crate) const ROOM: usize = 3;

    /// How many numbers are in the block.
    #[inline]
    pub(crate) fn count(&self) -> usize {
        (self.words[Self::ROOM] % 4) as usize
    }

    /// Where the next block is; 0 stands for nowhere.
    #[inline]
    fn next(&self) -> usize {
        (self.words[Self::ROOM] / 4) as usize
    }

    /// The numbers in the block.
    #[inline]
    pub(crate) fn numbers(&self) -> impl Iterator<Item = u32> + use<> {
        let words = self.words;
        (0..self.count()).map(move |at| words[at])
    }
}

/// The lists, which have no order.
///
/// Blocks are read as a whole, but changed a word at a time: a processor waits when it reads in one piece what was just written in several.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    /// The first block of each list, and further ones, all of them full: these come after the lists.
    blocks: Table<Block>,
    /// Further blocks that are free.
    free: Vec<u32>,
    lists: usize,
}

impl Blocks {
    /// Empty lists.
    pub(crate) fn new(lists: usize) -> Self {
        Self { blocks: table(repeat_n(Block::default(), lists)), free: Vec::new(), lists }
    }

    /// Empties all lists; then there are so many.
    pub(crate) fn reset(&mut self, lists: usize) {
        self.blocks.clear();
        make_room(&mut self.blocks, lists);
        self.blocks.resize(lists, Block::default());
        self.free.clear();
        self.lists = lists;
    }

    /// How many lists there are.
    #[inline]
    pub(crate) fn lists(&self) -> usize {
        self.lists
    }

    /// The first block of a list.
    #[inline]
    pub(crate) fn first(&self, list: usize) -> &Block {
        &self.blocks[list]
    }

    /// The next one of the same list.
    #[inline]
    pub(crate) fn next(&self, block: &Block) -> Option<&Block> {
        (block.next() != 0).then(|| &self.blocks[block.next()])
    }

    /// The numbers in a list.
    #[inline]
    pub(crate) fn numbers(&self, list: usize) -> impl Iterator<Item = u32> + '_ {
        std::iter::successors(Some(self.first(list)), |block| self.next(block)).flat_map(Block::numbers)
    }

    /// Puts a number into a list; tells whether it was empty.
    #[inline]
    pub(crate) fn add(&mut self, list: usize, number: u32) -> bool {
        let words = &mut self.blocks[list].words;
        let end = words[Block::ROOM];
        let count = end as usize % 4;
        if count == Block::ROOM {
            self.set_aside(list, number);
            return false;
        }
        words[count] = number;
        words[Block::ROOM] = end + 1;
        end == 0
    }

    /// Keeps a full block elsewhere, and begins another one with a number.
    #[cold]
    fn set_aside(&mut self, list: usize, number: u32) {
        let block = self.blocks[list];
        let index = if let Some(index) = self.free.pop() {
            self.blocks[index as usize] = block;
            index
        } else {
            self.blocks.push(block);
            (self.blocks.len() - 1) as u32
        };
        self.blocks[list].words = [number, 0, 0, 4 * index + 1];
    }

    /// Takes the first number that `is_it` out of its list; its place goes to another one. Tells whether the list is empty now, or `None` if it is not there.
    #[inline]
    pub(crate) fn remove(&mut self, list: usize, is_it: impl Fn(u32) -> bool) -> Option<bool> {
        let alone = &mut self.blocks[list];
        if alone.words[Block::ROOM] == 1 {
            let found = is_it(alone.words[0]);
            return found.then(|| {
                *alone = Block::default();
                true
            });
        }
        let (index, place) = self.find(list, is_it)?;
        let first = &mut self.blocks[list].words;
        let last = first[Block::ROOM] as usize % 4 - 1;
        let moved = std::mem::take(&mut first[last]);
        first[Block::ROOM] -= 1;
        // It may have been itself.
        if (index, place) != (list, last) {
            self.blocks[index].words[place] = moved;
        }
        if last == 0 {
            let next = self.blocks[list].next();
            self.blocks[list] = std::mem::take(&mut self.blocks[next]);
            self.free.push(next as u32);
        }
        Some(false)
    }

    /// The first number that `is_it` in a list.
    #[inline]
    pub(crate) fn find_mut(&mut self, list: usize, is_it: impl Fn(u32) -> bool) -> Option<&mut u32> {
        let (index, place) = self.find(list, is_it)?;
        Some(&mut self.blocks[index].words[place])
    }

    /// The block that holds it, and where.
    #[inline]
    fn find(&self, list: usize, is_it: impl Fn(u32) -> bool) -> Option<(usize, usize)> {
        let mut index = list;
        loop {
            let block = &self.blocks[index];
            if let Some(place) = (0..block.count()).find(|&place| is_it(block.words[place])) {
                return Some((index, place));
            }
            index = block.next();
            if index == 0 {
                return None;
            }
        }
    }

    /// Takes all numbers out of a list.
    #[inline]
    pub(crate) fn drain(&mut self, list: usize, mut visit: impl FnMut(u32)) {
        let mut block = std::mem::take(&mut self.blocks[list]);
        loop {
            block.numbers().for_each(&mut visit);
            let next = block.next();
            if next == 0 {
                return;
            }
            block = std::mem::take(&mut self.blocks[next]);
            self.free.push(next as u32);
        }
    }

    /// Asks the memory for the first block of a list, if there is such a list.
    #[inline]
    pub(crate) fn fetch(&self, list: usize) {
        prefetch(&self.blocks, list);
    }

    /// The first block of a list, or an empty one where there is no such list.
    #[inline]
    pub(crate) fn glance(&self, list: usize) -> Block {
        self.blocks.get(list).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    /// Short and long lists, what is taken out one by one and all at once: as plain lists have it.
    #[test]
    fn lists_in_blocks_hold_what_plain_lists_hold() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(11);
        let (mut blocks, mut plain) = (Blocks::new(1), vec![Vec::new(); 7]);
        blocks.reset(plain.len());
        assert_eq!(blocks.lists(), 7);
        for step in 0..100_000 {
            let list = random.random_range(0..7);
            let number = random.random_range(1..20);
            // Now more come than go, and now fewer.
            let goes = random.random_range(0..100) < if step / 1000 % 2 == 0 { 45 } else { 55 };
            if step % 997 == 0 {
                let mut all = Vec::new();
                blocks.drain(list, |number| all.push(number));
                all.sort_unstable();
                plain[list].sort_unstable();
                assert_eq!(all, std::mem::take(&mut plain[list]), "step {step}");
            } else if goes {
                let place = plain[list].iter().position(|&other| other == number);
                if let Some(place) = place {
                    plain[list].swap_remove(place);
                }
                let empty = place.map(|_| plain[list].is_empty());
                assert_eq!(blocks.find_mut(list, |other| other == number).copied(), place.map(|_| number));
                assert_eq!(blocks.remove(list, |other| other == number), empty, "step {step}");
            } else {
                assert_eq!(blocks.add(list, number), plain[list].is_empty(), "step {step}");
                plain[list].push(number);
            }
            let mut ours: Vec<u32> = blocks.numbers(list).collect();
            ours.sort_unstable();
            plain[list].sort_unstable();
            assert_eq!(ours, plain[list], "step {step}");
        }
        let held: usize = plain.iter().map(Vec::len).sum();
        assert!(blocks.blocks.len() - blocks.free.len() <= 7 + held / Block::ROOM, "blocks are lost");
    }
}
