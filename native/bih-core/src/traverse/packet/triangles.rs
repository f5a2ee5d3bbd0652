//! The triangles of a leaf, and where the lines of rays meet them.

use super::walk::Leaf;
use crate::simd::{Lanes, Mask};
use crate::tree::WIDTH;

/// Eight triangles, the first `count` of a leaf and what follows.
#[derive(Debug, Clone, Copy)]
pub(super) struct LeafTriangles<L> {
    pub v0: [L; 3],
    /// v₀ − v₁
    pub e1: [L; 3],
    /// v₂ − v₀
    pub e2: [L; 3],
    /// e₂ × e₁
    pub normal: [L; 3],
    /// The largest component of the edges.
    pub longest: L,
}

impl<L: Lanes> LeafTriangles<L> {
    #[inline(always)]
    pub fn new(leaf: &Leaf) -> Self {
        let v0 = rows(leaf, 0);
        let v1 = rows(leaf, 3);
        let v2 = rows(leaf, 6);
        let (e1, e2) = (minus(&v0, &v1), minus(&v2, &v0));
        Self { v0, e1, e2, normal: cross(&e2, &e1), longest: largest(&e1).maximum(largest(&e2)) }
    }

    #[inline(always)]
    pub fn stored(&self) -> Stored {
        Stored {
            v0: store(&self.v0),
            e1: store(&self.e1),
            e2: store(&self.e2),
            normal: store(&self.normal),
            longest: self.longest.store(),
        }
    }
}

/// The same in memory, where each can be spread over the lanes.
pub(super) struct Stored {
    v0: [[f32; WIDTH]; 3],
    e1: [[f32; WIDTH]; 3],
    e2: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    longest: [f32; WIDTH],
}

impl Stored {
    /// All, one a lane.
    #[inline(always)]
    pub fn all<L: Lanes>(&self) -> LeafTriangles<L> {
        LeafTriangles {
            v0: load(&self.v0),
            e1: load(&self.e1),
            e2: load(&self.e2),
            normal: load(&self.normal),
            longest: L::load(&self.longest),
        }
    }

    /// One in every lane.
    #[inline(always)]
    pub fn one<L: Lanes>(&self, lane: usize) -> LeafTriangles<L> {
        LeafTriangles {
            v0: splat(&self.v0, lane),
            e1: splat(&self.e1, lane),
            e2: splat(&self.e2, lane),
            normal: splat(&self.normal, lane),
            longest: L::splat(self.longest[lane % WIDTH]),
        }
    }
}

/// Where lines meet the planes of triangles: with c = v₀ − o and n the normal at t = n·c / n·d, where the weights of the
/// second and third vertex are (c × d)·e₂ / n·d and (c × d)·e₁ / n·d.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting<L> {
    /// |n·d|
    pub size: L,
    /// Weight of the second vertex, times `size`.
    pub u: L,
    /// Weight of the third vertex, times `size`.
    pub v: L,
    /// t, times `size`.
    pub t: L,
}

impl<L: Lanes> Meeting<L> {
    /// One ray and eight triangles, or eight rays and one.
    #[inline(always)]
    pub fn new(origin: &[L; 3], direction: &[L; 3], triangles: &LeafTriangles<L>) -> Self {
        let to_vertex = minus(&triangles.v0, origin);
        let moment = cross(&to_vertex, direction);
        let below = dot(&triangles.normal, direction);
        Self {
            size: below.magnitude(),
            u: dot(&moment, &triangles.e2).turned_by(below),
            v: dot(&moment, &triangles.e1).turned_by(below),
            t: dot(&triangles.normal, &to_vertex).turned_by(below),
        }
    }

    /// Where the line meets the triangle, its boundary included, and is not parallel to it.
    #[inline(always)]
    pub fn is_inside(&self) -> L::Mask {
        let zero = L::splat(0.0);
        let weights = zero.at_most(self.u).and(zero.at_most(self.v));
        weights.and(self.u.plus(self.v).at_most(self.size)).and(zero.below(self.size))
    }
}

/// Three rows of a leaf.
#[inline(always)]
fn rows<L: Lanes>(leaf: &Leaf, first: usize) -> [L; 3] {
    [row(leaf, first), row(leaf, first + 1), row(leaf, first + 2)]
}

#[inline(always)]
fn row<L: Lanes>(leaf: &Leaf, row: usize) -> L {
    match leaf.rows.get(row * leaf.count..).and_then(<[f32]>::first_chunk) {
        Some(values) => L::load(values),
        None => L::splat(f32::NAN),
    }
}

#[inline(always)]
fn store<L: Lanes>(v: &[L; 3]) -> [[f32; WIDTH]; 3] {
    [v[0].store(), v[1].store(), v[2].store()]
}

#[inline(always)]
fn load<L: Lanes>(v: &[[f32; WIDTH]; 3]) -> [L; 3] {
    [L::load(&v[0]), L::load(&v[1]), L::load(&v[2])]
}

#[inline(always)]
fn splat<L: Lanes>(v: &[[f32; WIDTH]; 3], lane: usize) -> [L; 3] {
    let lane = lane % WIDTH;
    [L::splat(v[0][lane]), L::splat(v[1][lane]), L::splat(v[2][lane])]
}

#[inline(always)]
pub(super) fn minus<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0].minus(b[0]), a[1].minus(b[1]), a[2].minus(b[2])]
}

#[inline(always)]
pub(super) fn cross<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [component(a[1], b[2], a[2], b[1]), component(a[2], b[0], a[0], b[2]), component(a[0], b[1], a[1], b[0])]
}

/// a · b − c · d; −0 less a number is its negative, whatever it is.
#[inline(always)]
fn component<L: Lanes>(a: L, b: L, c: L, d: L) -> L {
    a.fused(b, L::splat(-0.0).minus(c.times(d)))
}

#[inline(always)]
pub(super) fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].fused(b[0], a[1].fused(b[1], a[2].times(b[2])))
}

#[inline(always)]
fn largest<L: Lanes>(a: &[L; 3]) -> L {
    a[0].magnitude().maximum(a[1].magnitude()).maximum(a[2].magnitude())
}
