//! Records of eight children from a binary tree: the choice of least cost.
//!
//! A ray pays for each record that it visits, and visits a box about as often as the box has surface (MacDonald and
//! Booth 1990). So the records wanted are those of least total area; a dynamic programme over how many lanes a node may
//! take finds them (Ylitie, Karras and Laine 2017, section 3.2).

use super::source::least;
use super::treelet::{Branch, Treelet};
use crate::geometry::Bounds;
use crate::simd::{self, Kernel, dispatch};
use crate::tree::{Child, Orders, Record, WIDTH};

/// Costs are whole numbers, so that they are compared exactly: those of all records of a treelet sum to less than this.
const LARGEST_COST: i32 = 1 << 26;

/// They stand above three bits.
const COST_SHIFT: u32 = 3;

/// A node that is one lane by itself.
const WHOLE: u8 = 0;

/// What it costs to give a node at most 1, 2, … 8 lanes, and how many of them its lower child then gets.
#[derive(Debug, Clone, Copy)]
struct Plan {
    costs: [i32; WIDTH],
    /// Lanes of the lower child in the lower four bits, of both in the upper ones. The first entry is that of a record.
    lanes: [u8; WIDTH],
}

/// The dynamic programme, and room for it.
#[derive(Debug, Default)]
pub struct Collapse {
    plans: Vec<Plan>,
}

impl Collapse {
    /// Bytes that it takes for each node of a treelet.
    pub const BYTES: usize = size_of::<Plan>();

    /// Emit the records of a treelet. `leaf` is given each leaf and the depth of its record, the root's being 1, and
    /// answers what stands in its lane.
    pub fn emit(&mut self, treelet: &Treelet, leaf: impl FnMut(&Branch, usize) -> Child) -> Vec<Record> {
        dispatch(Emit { collapse: self, treelet, leaf })
    }

    #[inline(always)]
    fn emit_in_lanes(&mut self, treelet: &Treelet, mut leaf: impl FnMut(&Branch, usize) -> Child) -> Vec<Record> {
        let branches = &treelet.branches[..];
        self.plan(branches);
        let mut records = Vec::with_capacity(branches.len() / 8 + 1);
        records.push(Record::EMPTY);
        let mut waiting = vec![(0usize, 0usize, 1usize)];
        while let Some((index, node, depth)) = waiting.pop() {
            let mut lanes = Lanes { nodes: [0; WIDTH], count: 0 };
            let orders = self.open(branches, node, &mut lanes);
            let mut record = Record::EMPTY;
            record.set_orders(orders.finished(lanes.count));
            for (lane, &node) in lanes.nodes[..lanes.count].iter().enumerate() {
                let branch = &branches[node];
                let child = if branch.is_leaf() {
                    leaf(branch, depth)
                } else {
                    waiting.push((records.len(), node, depth + 1));
                    records.push(Record::EMPTY);
                    Child::record(records.len() - 1)
                };
                record.set(lane, &branch.bounds, child);
            }
            records[index] = record;
        }
        records
    }

    #[inline(always)]
    fn plan(&mut self, branches: &[Branch]) {
        const LEAF: Plan = Plan { costs: [0; WIDTH], lanes: [WHOLE; WIDTH] };
        // There are fewer records than leaves. One costs 1 and its share of the area, so that fewer are better.
        let leaves = branches.len() as i32 / 2 + 1;
        let most = f64::from((LARGEST_COST / leaves - 1).max(0));
        let whole = half_area(&branches[0].bounds);
        let unit = if whole > 0.0 { most / whole } else { 0.0 };
        self.plans.clear();
        self.plans.resize(branches.len(), LEAF);
        for index in (0..branches.len()).rev() {
            let branch = &branches[index];
            if !branch.is_leaf() {
                let left = branch.left as usize;
                let cost = 1 + least(half_area(&branch.bounds) * unit, most) as i32;
                self.plans[index] = Plan::of(cost << COST_SHIFT, &self.plans[left], &self.plans[left + 1]);
            }
        }
    }

    /// The lanes of the record that a node becomes.
    fn open(&self, branches: &[Branch], node: usize, lanes: &mut Lanes) -> PartialOrders {
        if branches[node].is_leaf() {
            return lanes.push(node);
        }
        self.divide(branches, node, self.plans[node].lanes[0], lanes)
    }

    /// The lanes of a node that may take so many. They nest no deeper than there are lanes.
    fn spread(&self, branches: &[Branch], node: usize, room: u8, lanes: &mut Lanes) -> PartialOrders {
        let shares = if room == 1 { WHOLE } else { self.plans[node].lanes[usize::from(room) - 1] };
        if shares == WHOLE { lanes.push(node) } else { self.divide(branches, node, shares, lanes) }
    }

    fn divide(&self, branches: &[Branch], node: usize, shares: u8, lanes: &mut Lanes) -> PartialOrders {
        let left = branches[node].left as usize;
        let (lower, both) = (shares & 15, shares >> 4);
        let start = lanes.count;
        let lower_orders = self.spread(branches, left, lower, lanes);
        let middle = lanes.count;
        let upper_orders = self.spread(branches, left + 1, both - lower, lanes);
        PartialOrders::joined(
            (lower_orders, middle - start),
            (upper_orders, lanes.count - middle),
            branches[node].axis(),
        )
    }
}

struct Emit<'a, F> {
    collapse: &'a mut Collapse,
    treelet: &'a Treelet,
    leaf: F,
}

impl<F: FnMut(&Branch, usize) -> Child> Kernel for Emit<'_, F> {
    type Output = Vec<Record>;

    #[inline(always)]
    fn run<L: simd::Lanes>(self) -> Vec<Record> {
        self.collapse.emit_in_lanes(self.treelet, self.leaf)
    }
}

struct Lanes {
    nodes: [usize; WIDTH],
    count: usize,
}

impl Lanes {
    fn push(&mut self, node: usize) -> PartialOrders {
        self.nodes[self.count] = node;
        self.count += 1;
        PartialOrders([self.count as u32 - 1; WIDTH])
    }
}

/// For each octant the lanes of a part of a record, four bits each, the nearest uppermost.
#[derive(Clone, Copy)]
struct PartialOrders([u32; WIDTH]);

impl PartialOrders {
    /// Of two parts, so many lanes each, side by side along the axis.
    fn joined((lower, lower_count): (Self, usize), (upper, upper_count): (Self, usize), axis: usize) -> Self {
        Self(std::array::from_fn(|octant| {
            if octant >> axis & 1 == 0 {
                lower.0[octant] << (4 * upper_count) | upper.0[octant]
            } else {
                upper.0[octant] << (4 * lower_count) | lower.0[octant]
            }
        }))
    }

    /// Of a whole record.
    fn finished(self, count: usize) -> Orders {
        let free = 4 * (WIDTH - count) as u32;
        Orders::new(self.0.map(|order| order << free | 0x0123_4567 & ((1 << free) - 1)))
    }
}

impl Plan {
    #[inline(always)]
    fn of(cost: i32, lower: &Self, upper: &Self) -> Self {
        // Both children as so many lanes, the cheapest shares: the lower one's stands in the bits below the cost.
        let mut padded = [LARGEST_COST << COST_SHIFT; 2 * WIDTH];
        padded[WIDTH..].copy_from_slice(&upper.costs);
        let mut divided = [i32::MAX; WIDTH];
        for share in 1..WIDTH {
            for lanes in 0..WIDTH {
                let sum = (lower.costs[share - 1] + padded[WIDTH + lanes - share]) | share as i32;
                divided[lanes] = divided[lanes].min(sum);
            }
        }
        const SHARE: i32 = (1 << COST_SHIFT) - 1;
        let lanes_of = |lanes: usize| (divided[lanes - 1] & SHARE) as u8 | (lanes as u8) << 4;
        let mut plan = Self { costs: [cost + (divided[WIDTH - 1] & !SHARE); WIDTH], lanes: [WHOLE; WIDTH] };
        plan.lanes[0] = lanes_of(WIDTH);
        let mut best = WHOLE;
        for lanes in 2..=WIDTH {
            let cost = divided[lanes - 1] & !SHARE;
            if cost < plan.costs[lanes - 2] {
                plan.costs[lanes - 1] = cost;
                best = lanes_of(lanes);
            } else {
                plan.costs[lanes - 1] = plan.costs[lanes - 2];
            }
            plan.lanes[lanes - 1] = best;
        }
        plan
    }
}

#[inline(always)]
fn half_area(bounds: &Bounds) -> f64 {
    let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| f64::from(bounds.upper[axis]) - f64::from(bounds.lower[axis]));
    x * y + y * z + z * x
}
