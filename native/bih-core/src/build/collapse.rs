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

/// They stand above three bits, for the lanes that the lower child gets.
const COST_SHIFT: u32 = 3;
const SHARE: i32 = (1 << COST_SHIFT) - 1;

/// What it costs to give a node at most 1, 2, … 8 lanes.
#[derive(Debug, Clone, Copy)]
struct Plan {
    /// One lane: a record of its own. More: that, or divided.
    costs: [i32; WIDTH],
    /// Both children instead of the node, and the lower one's share.
    divided: [i32; WIDTH],
}

impl Plan {
    const LEAF: Self = Self { costs: [0; WIDTH], divided: [i32::MAX; WIDTH] };

    #[inline(always)]
    fn of(cost: i32, lower: &Self, upper: &Self) -> Self {
        let mut padded = [LARGEST_COST << COST_SHIFT; 2 * WIDTH];
        padded[WIDTH..].copy_from_slice(&upper.costs);
        let mut divided = [i32::MAX; WIDTH];
        for share in 1..WIDTH {
            for lanes in 0..WIDTH {
                let sum = (lower.costs[share - 1] + padded[WIDTH + lanes - share]) | share as i32;
                divided[lanes] = divided[lanes].min(sum);
            }
        }
        let whole = cost + (divided[WIDTH - 1] & !SHARE);
        // More lanes never cost more, so there is no need to look at fewer.
        Self { costs: divided.map(|sum| whole.min(sum & !SHARE)), divided }
    }

    /// The lanes of the lower child if the node is divided into so many; none if it is better whole.
    #[inline(always)]
    fn share(&self, lanes: usize) -> Option<usize> {
        let sum = self.divided[lanes - 1];
        (sum & !SHARE < self.costs[0]).then_some((sum & SHARE) as usize)
    }
}

/// The dynamic programme, and room for it.
#[derive(Debug, Default)]
pub struct Collapse {
    plans: Vec<Plan>,
}

impl Collapse {
    /// Bytes that it takes for each node of a treelet.
    pub const BYTES: usize = size_of::<Plan>();

    /// Emit the records of a treelet, the root first. `leaf` is given each leaf and the depth of its record, the root's
    /// being 1, and answers what stands in its lane.
    pub fn emit(&mut self, treelet: &Treelet, leaf: impl FnMut(&Branch, usize) -> Child) -> Vec<Record> {
        dispatch(Emit { collapse: self, treelet, leaf })
    }

    #[inline(always)]
    fn plan(&mut self, treelet: &Treelet) {
        let Treelet { branches, inner, .. } = treelet;
        // There are fewer records than leaves. One costs 1 and its share of the area, so that fewer are better.
        let leaves = inner.len() as i32 + 1;
        let most = f64::from((LARGEST_COST / leaves - 1).max(0));
        let whole = half_area(&branches[0].bounds);
        let unit = if whole > 0.0 { most / whole } else { 0.0 };
        self.plans.clear();
        self.plans.resize(branches.len(), Plan::LEAF);
        for &index in inner.iter().rev() {
            let branch = &branches[index as usize];
            let left = branch.left as usize;
            let cost = 1 + least(half_area(&branch.bounds) * unit, most) as i32;
            self.plans[index as usize] = Plan::of(cost << COST_SHIFT, &self.plans[left], &self.plans[left + 1]);
        }
    }

    #[inline(always)]
    fn emit_records(&mut self, treelet: &Treelet, mut leaf: impl FnMut(&Branch, usize) -> Child) -> Vec<Record> {
        self.plan(treelet);
        let branches = &treelet.branches[..];
        let mut records = Vec::with_capacity(branches.len() / 8 + 1);
        // Each node that becomes a record, in their order, and its depth.
        let mut nodes = vec![(0u32, 1u32)];
        while let Some(&(node, depth)) = nodes.get(records.len()) {
            let (lanes, orders) = self.open(branches, node as usize);
            let mut record = Record::EMPTY;
            record.set_orders(orders);
            for (lane, &node) in lanes.iter().enumerate() {
                let branch = &branches[node as usize];
                let child = if branch.is_leaf() {
                    leaf(branch, depth as usize)
                } else {
                    nodes.push((node, depth + 1));
                    Child::record(nodes.len() - 1)
                };
                record.set(lane, &branch.bounds, child);
            }
            records.push(record);
        }
        records
    }

    /// The lanes of the record that a node becomes, from the lowest part to the highest.
    #[inline(always)]
    fn open(&self, branches: &[Branch], node: usize) -> (Few<u32>, Orders) {
        let mut lanes = Few::default();
        let mut parts: Few<(Part, u32)> = Few::default();
        let mut steps: Few<Step> = Few::default();
        steps.push(Step::Open(node as u32, WIDTH as u32));
        while let Some(step) = steps.pop() {
            match step {
                Step::Open(node, room) => {
                    let branch = &branches[node as usize];
                    let plan = &self.plans[node as usize];
                    let is_root = lanes.len == 0 && steps.len == 0 && parts.len == 0;
                    let share = if branch.is_leaf() {
                        None
                    } else if is_root {
                        Some((plan.divided[WIDTH - 1] & SHARE) as usize)
                    } else {
                        plan.share(room as usize)
                    };
                    match share {
                        None => {
                            parts.push((Part([lanes.len as u32; WIDTH]), 1));
                            lanes.push(node);
                        }
                        Some(share) => {
                            steps.push(Step::Join(branch.axis() as u32));
                            steps.push(Step::Open(branch.left + 1, room - share as u32));
                            steps.push(Step::Open(branch.left, share as u32));
                        }
                    }
                }
                Step::Join(axis) => {
                    let (Some(upper), Some(lower)) = (parts.pop(), parts.pop()) else { unreachable!() };
                    parts.push((Part::joined(lower, upper, axis), lower.1 + upper.1));
                }
            }
        }
        let (part, count) = parts.items[0];
        (lanes, part.finished(count))
    }
}

/// What is still to do for the lanes of a record.
#[derive(Clone, Copy)]
enum Step {
    /// Give a node at most so many lanes.
    Open(u32, u32),
    /// Put the last two parts side by side along an axis.
    Join(u32),
}

impl Default for Step {
    fn default() -> Self {
        Self::Join(0)
    }
}

/// A stack that never holds more than two items a lane.
#[derive(Clone, Copy, Default)]
struct Few<T> {
    items: [T; 2 * WIDTH],
    len: usize,
}

impl<T: Copy> Few<T> {
    #[inline(always)]
    fn push(&mut self, item: T) {
        self.items[self.len] = item;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }

    #[inline(always)]
    fn iter(&self) -> std::slice::Iter<'_, T> {
        self.items[..self.len].iter()
    }
}

/// For each octant the lanes of a part of a record, four bits each, the nearest uppermost.
#[derive(Clone, Copy, Default)]
struct Part([u32; WIDTH]);

impl Part {
    /// Of two parts, so many lanes each, side by side along the axis.
    #[inline(always)]
    fn joined((lower, lower_count): (Self, u32), (upper, upper_count): (Self, u32), axis: u32) -> Self {
        Self(std::array::from_fn(|octant| {
            let lower_first = lower.0[octant] << (4 * upper_count) | upper.0[octant];
            let upper_first = upper.0[octant] << (4 * lower_count) | lower.0[octant];
            if octant as u32 >> axis & 1 == 0 { lower_first } else { upper_first }
        }))
    }

    /// Of a whole record.
    #[inline(always)]
    fn finished(self, count: u32) -> Orders {
        let free = 4 * (WIDTH as u32 - count);
        Orders::new(self.0.map(|order| order << free | 0x0123_4567 & ((1 << free) - 1)))
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
        self.collapse.emit_records(self.treelet, self.leaf)
    }
}

#[inline(always)]
fn half_area(bounds: &Bounds) -> f64 {
    let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| f64::from(bounds.upper[axis]) - f64::from(bounds.lower[axis]));
    x * y + y * z + z * x
}
