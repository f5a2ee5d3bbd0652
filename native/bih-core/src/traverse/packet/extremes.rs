//! The smallest and the largest of the numbers of many rays.

use super::GROUPS;
use super::rays::Group;
use super::slabs::is_negative;
use crate::simd::Lanes;
use crate::tree::WIDTH;

/// Of origins and directions along each axis, and the smallest t_min.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extremes<L> {
    pub least_origin: [L; 3],
    pub most_origin: [L; 3],
    pub least_direction: [L; 3],
    pub most_direction: [L; 3],
    t_min: L,
}

impl<L: Lanes> Extremes<L> {
    /// Of all rays, in all lanes.
    #[inline(always)]
    pub fn of_all(groups: &[Group<L>; GROUPS]) -> Self {
        let first = &groups[0];
        let mut extremes = Self {
            least_origin: first.origin,
            most_origin: first.origin,
            least_direction: first.direction,
            most_direction: first.direction,
            t_min: first.t_min,
        };
        for group in &groups[1..] {
            for axis in 0..3 {
                extremes.least_origin[axis] = extremes.least_origin[axis].minimum(group.origin[axis]);
                extremes.most_origin[axis] = extremes.most_origin[axis].maximum(group.origin[axis]);
                extremes.least_direction[axis] = extremes.least_direction[axis].minimum(group.direction[axis]);
                extremes.most_direction[axis] = extremes.most_direction[axis].maximum(group.direction[axis]);
            }
            extremes.t_min = extremes.t_min.minimum(group.t_min);
        }
        for axis in 0..3 {
            extremes.least_origin[axis] = L::splat(extremes.least_origin[axis].smallest());
            extremes.most_origin[axis] = L::splat(extremes.most_origin[axis].largest());
            extremes.least_direction[axis] = L::splat(extremes.least_direction[axis].smallest());
            extremes.most_direction[axis] = L::splat(extremes.most_direction[axis].largest());
        }
        extremes.t_min = L::splat(extremes.t_min.smallest());
        extremes
    }

    /// Of each group, in its lane.
    #[inline(always)]
    pub fn of_each(groups: &[Group<L>; GROUPS]) -> Self {
        let [a, b, c, d, e, f, g, h] = groups;
        let [x, y, z] = [
            [a.origin[0], b.origin[0], c.origin[0], d.origin[0], e.origin[0], f.origin[0], g.origin[0], h.origin[0]],
            [a.origin[1], b.origin[1], c.origin[1], d.origin[1], e.origin[1], f.origin[1], g.origin[1], h.origin[1]],
            [a.origin[2], b.origin[2], c.origin[2], d.origin[2], e.origin[2], f.origin[2], g.origin[2], h.origin[2]],
        ];
        let ([x, x_most], [y, y_most], [z, z_most]) = (extremes(x), extremes(y), extremes(z));
        let mut of_each = Self {
            least_origin: [x, y, z],
            most_origin: [x_most, y_most, z_most],
            least_direction: [x; 3],
            most_direction: [x; 3],
            t_min: extremes([a.t_min, b.t_min, c.t_min, d.t_min, e.t_min, f.t_min, g.t_min, h.t_min])[0],
        };
        for axis in 0..3 {
            [of_each.least_direction[axis], of_each.most_direction[axis]] = extremes([
                a.direction[axis],
                b.direction[axis],
                c.direction[axis],
                d.direction[axis],
                e.direction[axis],
                f.direction[axis],
                g.direction[axis],
                h.direction[axis],
            ]);
        }
        of_each
    }

    /// The ray that enters boxes first, whatever their planes, and the one that leaves them last.
    #[inline(always)]
    pub fn first_and_last(&self, octant: usize) -> [Group<L>; 2] {
        let mut first =
            Group { origin: self.most_origin, direction: self.most_direction, t_min: self.t_min, t_max: self.t_min };
        let mut last = Group { origin: self.least_origin, direction: self.least_direction, ..first };
        for axis in 0..3 {
            if is_negative(octant, axis) {
                std::mem::swap(&mut first.origin[axis], &mut last.origin[axis]);
                std::mem::swap(&mut first.direction[axis], &mut last.direction[axis]);
            }
        }
        [first, last]
    }
}

/// The smallest and the largest of each.
#[inline(always)]
fn extremes<L: Lanes>(rows: [L; WIDTH]) -> [L; 2] {
    let [a, b, c, d, e, f, g, h] = L::transposed(rows);
    [
        a.minimum(b).minimum(c.minimum(d)).minimum(e.minimum(f).minimum(g.minimum(h))),
        a.maximum(b).maximum(c.maximum(d)).maximum(e.maximum(f).maximum(g.maximum(h))),
    ]
}
