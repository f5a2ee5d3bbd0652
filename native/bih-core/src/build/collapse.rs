//! Records of eight children from a binary tree: the choice of least cost.
//!
//! A ray pays for each record that it visits, and visits a box about as often as the box has surface (MacDonald and
//! Booth 1990). So the records wanted are those of least total area; a dynamic programme over how many lanes a node may
//! take finds them (Ylitie, Karras and Laine 2017, section 3.2).

use super::treelet::{Branch, Treelet};
use crate::geometry::Bounds;
use crate::tree::{Child, Orders, Record, WIDTH};

/// What a record costs beside its area, as a share of the treelet's own: fewer of them where areas are equal.
const LEAST_COST: f32 = 1e-6;

/// A node that is one lane by itself.
const WHOLE: u8 = 0;

/// What it costs to give a node at most 1, 2, … 8 lanes, and how many of them its lower child then gets.
#[derive(Debug, Clone, Copy)]
struct Plan {
    costs: [f32; WIDTH],
    /// Lanes of the lower child in the lower four bits, of both in the upper ones. The first entry is that of a record.
    lanes: [u8; WIDTH],
}

/// The dynamic programme, and room for it.
#[derive(Debug, Default)]
pub struct Collapse {
    plans: Vec<Plan>,
}

impl Collapse {
    /// Emit the records of a treelet. `leaf` is given each leaf and the depth of its record, the root's being 1, and
    /// answers what stands in its lane.
    pub fn emit(&mut self, treelet: &Treelet, mut leaf: impl FnMut(&Branch, usize) -> Child) -> Vec<Record> {
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

    fn plan(&mut self, branches: &[Branch]) {
        const LEAF: Plan = Plan { costs: [0.0; WIDTH], lanes: [WHOLE; WIDTH] };
        let largest = half_area(&branches[0].bounds);
        let unit = if largest > 0.0 { 1.0 / largest } else { 0.0 };
        self.plans.clear();
        self.plans.resize(branches.len(), LEAF);
        for index in (0..branches.len()).rev() {
            let branch = &branches[index];
            if !branch.is_leaf() {
                let left = branch.left as usize;
                let cost = (half_area(&branch.bounds) * unit) as f32 + LEAST_COST;
                self.plans[index] = Plan::of(cost, &self.plans[left], &self.plans[left + 1]);
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
    fn of(cost: f32, lower: &Self, upper: &Self) -> Self {
        // Both children inside: costs[i] and shares[i] for i + 1 lanes.
        let mut costs = [f32::INFINITY; WIDTH];
        let mut shares = [0u32; WIDTH];
        let mut padded = [f32::INFINITY; 2 * WIDTH];
        padded[WIDTH..].copy_from_slice(&upper.costs);
        for share in 1..WIDTH {
            for lanes in 0..WIDTH {
                let sum = lower.costs[share - 1] + padded[WIDTH + lanes - share];
                if sum < costs[lanes] {
                    costs[lanes] = sum;
                    shares[lanes] = share as u32;
                }
            }
        }
        let mut plan = Self { costs: [cost + costs[WIDTH - 1]; WIDTH], lanes: [WHOLE; WIDTH] };
        for lanes in 1..WIDTH {
            (plan.costs[lanes], plan.lanes[lanes]) = if costs[lanes] < plan.costs[lanes - 1] {
                (costs[lanes], shares[lanes] as u8 | (lanes as u8 + 1) << 4)
            } else {
                (plan.costs[lanes - 1], plan.lanes[lanes - 1])
            };
        }
        plan.lanes[0] = shares[WIDTH - 1] as u8 | (WIDTH as u8) << 4;
        plan
    }
}

fn half_area(bounds: &Bounds) -> f64 {
    let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| f64::from(bounds.upper[axis]) - f64::from(bounds.lower[axis]));
    x * y + y * z + z * x
}
