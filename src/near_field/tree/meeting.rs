//! Two branches, or one with itself, cell by cell.

use super::Setup;
use super::acceptance::Acceptance;
use super::branch::Branch;
use super::interact::{MAX_ORDER, Octet};
use crate::near_field::block::LANES;

/// Pairs of grains that cost as much as a product of a moment and a derivative, both ways. Measured with full octets; half or twice as many change
/// little.
const PAIRS_A_PRODUCT: f64 = 0.08;

/// What is summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Quantity {
    Forces,
    Energy,
}

/// One or two branches whose cells act on each other.
enum Pair<'a> {
    Alone(&'a mut Branch),
    Two(&'a mut Branch, &'a mut Branch),
}

/// A meeting on its way through the cells.
pub(super) struct Meeting<'a> {
    setup: &'a Setup<'a>,
    acceptance: &'a Acceptance,
    quantity: Quantity,
    pair: Pair<'a>,
    /// Pairs of cells that wait until there are [`LANES`] of the same order.
    waiting: [Vec<(usize, usize)>; MAX_ORDER + 1],
    octet: Octet,
}

impl<'a> Meeting<'a> {
    /// All pairs of grains within a branch.
    pub(super) fn within(setup: &'a Setup<'a>, acceptance: &'a Acceptance, quantity: Quantity, branch: &'a mut Branch) {
        let mut meeting = Self::new(setup, acceptance, quantity, Pair::Alone(branch));
        meeting.inside(0);
        meeting.finish();
    }

    /// All pairs of a grain in one branch and one in another.
    pub(super) fn between(
        setup: &'a Setup<'a>,
        acceptance: &'a Acceptance,
        quantity: Quantity,
        one: &'a mut Branch,
        other: &'a mut Branch,
    ) {
        let mut meeting = Self::new(setup, acceptance, quantity, Pair::Two(one, other));
        meeting.across(0, 0);
        meeting.finish();
    }

    fn new(setup: &'a Setup<'a>, acceptance: &'a Acceptance, quantity: Quantity, pair: Pair<'a>) -> Self {
        let waiting = std::array::from_fn(|_| Vec::with_capacity(LANES));
        Self { setup, acceptance, quantity, pair, waiting, octet: Octet::new(setup.indices) }
    }

    fn first(&self) -> &Branch {
        match &self.pair {
            Pair::Alone(branch) | Pair::Two(branch, _) => branch,
        }
    }

    fn second(&self) -> &Branch {
        match &self.pair {
            Pair::Alone(branch) | Pair::Two(_, branch) => branch,
        }
    }

    fn first_mut(&mut self) -> &mut Branch {
        match &mut self.pair {
            Pair::Alone(branch) | Pair::Two(branch, _) => branch,
        }
    }

    fn second_mut(&mut self) -> &mut Branch {
        match &mut self.pair {
            Pair::Alone(branch) | Pair::Two(_, branch) => branch,
        }
    }

    /// All pairs within a cell.
    fn inside(&mut self, cell: usize) {
        if let Some([lower, upper]) = self.first().cells[cell].children {
            self.inside(lower);
            self.inside(upper);
            self.across(lower, upper);
        } else {
            self.sum_within(cell);
        }
    }

    /// All pairs of a grain in a cell of the first branch and one in a cell of the second.
    fn across(&mut self, one: usize, other: usize) {
        let (first, second) = (&self.first().cells[one], &self.second().cells[other]);
        let pairs = first.pairs_with(second) as f64;
        if pairs <= self.setup.least_pairs {
            self.sum_pairs(one, other);
            return;
        }
        if let Some(order) = self.acceptance.order(self.setup.law, self.setup.highest_order(), first, second) {
            if pairs <= self.setup.worth[order] {
                self.sum_pairs(one, other);
            } else {
                self.expand(order, one, other);
            }
            return;
        }
        // The larger cell is divided, if it can be.
        match (first.children, second.children) {
            (None, None) => self.sum_pairs(one, other),
            (Some(children), None) => children.into_iter().for_each(|child| self.across(child, other)),
            (Some(children), Some(_)) if first.radius >= second.radius => {
                children.into_iter().for_each(|child| self.across(child, other));
            }
            (_, Some(children)) => children.into_iter().for_each(|child| self.across(one, child)),
        }
    }

    /// Adds what each pair of grains within a cell contributes.
    fn sum_within(&mut self, cell: usize) {
        let (law, quantity) = (self.setup.law, self.quantity);
        let branch = self.first_mut();
        let chunks = branch.cells[cell].chunks.clone();
        match quantity {
            Quantity::Forces => branch.grains.meet_itself(law, chunks),
            Quantity::Energy => branch.energy += branch.grains.energy_within(law, chunks),
        }
    }

    /// Adds what each pair of grains of two cells contributes.
    fn sum_pairs(&mut self, one: usize, other: usize) {
        let law = self.setup.law;
        let (ones, others) = (self.first().cells[one].chunks.clone(), self.second().cells[other].chunks.clone());
        if self.quantity == Quantity::Energy {
            let energy = self.first().grains.energy_with(law, ones, &self.second().grains, others);
            self.first_mut().energy += energy;
            return;
        }
        match &mut self.pair {
            Pair::Alone(branch) => branch.grains.meet_within(law, ones, others),
            Pair::Two(first, second) => first.grains.meet(law, ones, &mut second.grains, others),
        }
    }

    /// Lets two cells wait to be expanded about each other.
    fn expand(&mut self, order: usize, one: usize, other: usize) {
        self.waiting[order].push((one, other));
        if self.waiting[order].len() == LANES {
            self.exchange(order);
        }
    }

    /// Expands what still waits.
    fn finish(&mut self) {
        for order in 0..self.waiting.len() {
            if !self.waiting[order].is_empty() {
                self.exchange(order);
            }
        }
    }

    /// Expands the pairs of cells that wait for this order about each other.
    fn exchange(&mut self, order: usize) {
        let pairs = std::mem::take(&mut self.waiting[order]);
        let count = self.setup.indices.counts[order];
        let mut octet = std::mem::take(&mut self.octet);
        for lane in 0..LANES {
            // Lanes without a pair repeat the last one; nobody looks at them.
            let &(one, other) = pairs.get(lane).unwrap_or(&pairs[pairs.len() - 1]);
            let apart = self.first().cells[one].centre - self.second().cells[other].centre;
            (0..3).for_each(|axis| octet.apart[axis][lane] = apart[axis]);
            let moments = [self.first().moments(one), self.second().moments(other)];
            for (lanes, moments) in [&mut octet.first, &mut octet.second].into_iter().zip(moments) {
                lanes[..count].iter_mut().zip(moments).for_each(|(lanes, moment)| lanes[lane] = *moment);
            }
        }
        octet.exchange(self.setup.law, self.setup.indices, order);
        for (lane, &(one, other)) in pairs.iter().enumerate() {
            add_lane(&octet.first[..count], lane, self.first_mut().potential_mut(one));
            add_lane(&octet.second[..count], lane, self.second_mut().potential_mut(other));
        }
        self.octet = octet;
        self.waiting[order] = pairs;
        self.waiting[order].clear();
    }
}

fn add_lane(lanes: &[[f64; LANES]], lane: usize, potential: &mut [f64]) {
    potential.iter_mut().zip(lanes).for_each(|(potential, lanes)| *potential += lanes[lane]);
}

/// How many pairs of grains cost as much as expanding two cells about each other to this order: products of moments and
/// derivatives, C(order + 6, 6).
pub(super) fn worth(order: usize) -> f64 {
    let products: f64 = (1..=6).map(|i| (order + i) as f64 / i as f64).product();
    PAIRS_A_PRODUCT * products
}
