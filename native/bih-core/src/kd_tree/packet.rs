//! Four rays at a time, as Wald, Slusallek, Benthin and Wagner 2001, "Interactive Rendering with Coherent Ray Tracing":
//! nodes are fetched once for a 2 × 2 packet, and its rays step through them side by side.

use super::walk::{BinaryTree, DEEPEST};
use crate::geometry::{Bounds, Ray};
use crate::traverse::Counter;
use crate::tree::Kind;

/// Rays of a packet.
pub const LANES: usize = 4;

/// One number a ray.
type Lane = [f64; LANES];

/// Relative width that covers the roundings of a plane's distance, as for a single ray.
const PAD: f64 = 4.0 * f64::EPSILON;

/// Four rays whose directions have the same signs, so that all see the children of a node in the same order.
#[derive(Debug, Clone, Copy)]
pub struct Packet {
    origin: [Lane; 3],
    /// 1/d rounded towards zero and away from it.
    least: [Lane; 3],
    most: [Lane; 3],
    negative: [bool; 3],
    near: Lane,
    far: Lane,
}

/// A node to visit later, and the part of each ray that lies in it; of a ray that misses it the part is empty.
#[derive(Debug, Clone, Copy)]
struct Entry {
    node: usize,
    near: Lane,
    far: Lane,
}

/// Room for one node a level. Made once for many packets.
#[derive(Debug, Clone)]
pub struct PacketStack {
    entries: [Entry; DEEPEST],
}

impl Default for PacketStack {
    fn default() -> Self {
        Self { entries: [Entry { node: 0, near: [0.0; LANES], far: [0.0; LANES] }; DEEPEST] }
    }
}

/// 1/d rounded towards zero and away from it, both with the sign of d.
fn reciprocals(direction: f64) -> (f64, f64) {
    let reciprocal = 1.0 / direction;
    let (least, most) = if direction == 0.0 {
        (f64::INFINITY, f64::INFINITY)
    } else if reciprocal.is_infinite() {
        (f64::MAX, f64::INFINITY)
    } else if reciprocal.is_subnormal() {
        (0.0, f64::MIN_POSITIVE)
    } else {
        (reciprocal.abs() * (1.0 - PAD), reciprocal.abs() * (1.0 + PAD))
    };
    (least.copysign(direction), most.copysign(direction))
}

impl Packet {
    /// None where the directions of active rays differ in a sign: these are to be traced one by one. Rays that are not
    /// active meet no leaf; an invalid ray must not be active.
    pub fn new(rays: &[Ray; LANES], active: [bool; LANES]) -> Option<Self> {
        let example = rays[active.iter().position(|&active| active)?];
        let mut packet = Self {
            origin: [[0.0; LANES]; 3],
            least: [[1.0; LANES]; 3],
            most: [[1.0; LANES]; 3],
            negative: example.direction.map(f64::is_sign_negative),
            near: [f64::INFINITY; LANES],
            far: [f64::NEG_INFINITY; LANES],
        };
        for lane in (0..LANES).filter(|&lane| active[lane]) {
            let ray = &rays[lane];
            for axis in 0..3 {
                if ray.direction[axis].is_sign_negative() != packet.negative[axis] {
                    return None;
                }
                packet.origin[axis][lane] = ray.origin[axis];
                (packet.least[axis][lane], packet.most[axis][lane]) = reciprocals(ray.direction[axis]);
            }
            packet.near[lane] = ray.t_min;
            packet.far[lane] = ray.t_max;
        }
        Some(packet)
    }

    /// Bounds on the t at which the rays meet a plane: at most, and at least; NaN where a ray lies in it.
    #[inline(always)]
    fn crossings(&self, axis: usize, plane: f32) -> (Lane, Lane) {
        let (mut earliest, mut latest) = ([0.0; LANES], [0.0; LANES]);
        let (least, most, origin) = (&self.least[axis], &self.most[axis], &self.origin[axis]);
        for lane in 0..LANES {
            let offset = f64::from(plane) - origin[lane];
            let (towards_zero, away) = (offset * least[lane], offset * most[lane]);
            // Of an offset ahead of the ray the first is the smaller one, behind it the larger one.
            let is_ahead = (offset < 0.0) == self.negative[axis];
            earliest[lane] = if is_ahead { towards_zero } else { away } - f64::MIN_POSITIVE;
            latest[lane] = if is_ahead { away } else { towards_zero } + f64::MIN_POSITIVE;
        }
        (earliest, latest)
    }

    /// The parts of the rays within the bounds.
    fn clip(&self, bounds: &Bounds) -> (Lane, Lane) {
        let (mut near, mut far) = (self.near, self.far);
        for axis in 0..3 {
            let [mut entry, mut exit] = [bounds.lower[axis], bounds.upper[axis]];
            if self.negative[axis] {
                std::mem::swap(&mut entry, &mut exit);
            }
            near = larger(&self.crossings(axis, entry).0, &near);
            far = smaller(&self.crossings(axis, exit).1, &far);
        }
        (near, far)
    }
}

/// The smaller of two numbers, the second where the first is NaN.
#[inline(always)]
fn smaller(a: &Lane, b: &Lane) -> Lane {
    let mut least = *b;
    for lane in 0..LANES {
        least[lane] = if a[lane] < b[lane] { a[lane] } else { b[lane] };
    }
    least
}

/// The larger of two numbers, the second where the first is NaN.
#[inline(always)]
fn larger(a: &Lane, b: &Lane) -> Lane {
    let mut most = *b;
    for lane in 0..LANES {
        most[lane] = if a[lane] > b[lane] { a[lane] } else { b[lane] };
    }
    most
}

/// The lanes in which `a` does not exceed `b`.
#[inline(always)]
fn in_order(a: &Lane, b: &Lane) -> [bool; LANES] {
    let mut mask = [false; LANES];
    for lane in 0..LANES {
        mask[lane] = a[lane] <= b[lane];
    }
    mask
}

#[inline(always)]
fn any(mask: [bool; LANES]) -> bool {
    mask[0] | mask[1] | mask[2] | mask[3]
}

/// Visit the leaves that any ray of the packet crosses, front to back. `leaf` is told which rays cross it, and answers
/// how far each ray still matters: negative infinity where it is done.
#[inline(always)]
pub fn walk_packet<T: BinaryTree, C: Counter>(
    tree: &T,
    packet: &Packet,
    stack: &mut PacketStack,
    counter: &mut C,
    mut leaf: impl FnMut(&[u32], [bool; LANES]) -> [f64; LANES],
) {
    if tree.is_empty() {
        return;
    }
    let (near, far) = packet.clip(tree.bounds());
    let mut limit = packet.far;
    let mut waiting = 0;
    let mut entry = Entry { node: 0, near, far };
    loop {
        let reach = smaller(&entry.far, &limit);
        let active = in_order(&entry.near, &reach);
        if any(active) {
            counter.visit_node();
            match tree.kind(entry.node) {
                Kind::Inner { axis, left, clip } => {
                    let backwards = usize::from(packet.negative[axis]);
                    let first_ends = packet.crossings(axis, clip[backwards]).1;
                    let second_starts = packet.crossings(axis, clip[1 - backwards]).0;
                    let first = Entry { node: left + backwards, near: entry.near, far: smaller(&first_ends, &reach) };
                    let second =
                        Entry { node: left + 1 - backwards, near: larger(&second_starts, &entry.near), far: reach };
                    if !any(in_order(&second.near, &second.far)) {
                        entry = first;
                    } else if !any(in_order(&first.near, &first.far)) {
                        entry = second;
                    } else {
                        stack.entries[waiting] = second;
                        waiting += 1;
                        entry = first;
                    }
                    continue;
                }
                Kind::Leaf { first, count } => {
                    counter.test_triangles(count);
                    if count > 0 {
                        limit = leaf(&tree.references()[first..first + count], active);
                    }
                }
            }
        }
        if waiting == 0 {
            return;
        }
        waiting -= 1;
        entry = stack.entries[waiting];
    }
}

#[cfg(test)]
mod tests {
    use super::super::interval::Crossing;
    use super::*;

    #[test]
    fn crossings_are_those_of_single_rays_bit_for_bit() {
        let directions = [1.0, -1.0, 3.0, -0.1, 0.0, -0.0, 1e-300, -1e-300, 1e300, 5e-324, -f64::MAX];
        for direction in directions {
            let rays = [-2.0, 0.0, 2.5, 1e-44].map(|x| Ray::new([x, 0.0, 0.0], [direction, 1.0, 0.0]));
            let packet = Packet::new(&rays, [true; LANES]).unwrap();
            for plane in [-3.0f32, -1e-38, 0.0, 1e-44, 2.5] {
                let (earliest, latest) = packet.crossings(0, plane);
                for lane in 0..LANES {
                    let single = Crossing::new(&rays[lane]);
                    let bits = |x: f64| if x.is_nan() { None } else { Some(x.to_bits()) };
                    assert_eq!(bits(earliest[lane]), bits(single.earliest(0, plane)), "{direction} {plane}");
                    assert_eq!(bits(latest[lane]), bits(single.latest(0, plane)), "{direction} {plane}");
                }
            }
        }
    }

    #[test]
    fn rays_of_different_octants_are_no_packet() {
        let mut rays = [Ray::new([0.0; 3], [1.0, 0.0, 0.0]); LANES];
        rays[2].direction[1] = -0.0;
        assert!(Packet::new(&rays, [true; LANES]).is_none());
        assert!(Packet::new(&rays, [true, true, false, true]).is_some());
        assert!(Packet::new(&rays, [false; LANES]).is_none());
    }
}
