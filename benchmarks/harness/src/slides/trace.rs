//! The nearest hit: the child nearer to the ray's origin first, by the sign of the direction.

use super::SlidesTree;
use crate::mesh::Mesh;
use crate::rays::{Found, Ray};
use crate::vector::{cross, dot, subtract};

/// 1 + 2 γ(3): what the far plane's distance must grow by so that rounding hides no box (Ize, "Robust BVH Ray Traversal",
/// JCGT 2013).
const PADDING: f32 = 1.0000004;

/// A part of the ray in a node.
#[derive(Clone, Copy)]
struct Step {
    node: usize,
    near: f32,
    far: f32,
}

impl SlidesTree<'_> {
    pub fn nearest(&self, ray: &Ray) -> Found {
        let mut found = (f32::INFINITY, u32::MAX);
        let inverse = ray.direction.map(f32::recip);
        let (mut near, mut far) = (ray.t_min, ray.t_max);
        for axis in 0..3 {
            let planes = [self.bounds.lower[axis], self.bounds.upper[axis]];
            let [enter, leave] = if inverse[axis].is_sign_negative() { [planes[1], planes[0]] } else { planes };
            near = near.max((enter - ray.origin[axis]) * inverse[axis] / PADDING);
            far = far.min((leave - ray.origin[axis]) * inverse[axis] * PADDING);
        }
        let mut stack = vec![Step { node: 0, near, far }];
        while let Some(Step { mut node, mut near, mut far }) = stack.pop() {
            far = far.min(found.0);
            while near <= far {
                let this = &self.nodes[node];
                if this.is_leaf() {
                    let row = self.order[this.place()];
                    if let Some(t) = hit(self.mesh, row, ray)
                        && t < found.0
                    {
                        found = (t, row);
                    }
                    break;
                }
                let axis = this.axis();
                let [first, second] = this.clip().map(|plane| (plane - ray.origin[axis]) * inverse[axis]);
                // A plane that the ray runs in gives NaN, which minimum and maximum pass over.
                let is_turned = inverse[axis].is_sign_negative();
                let (front, back) = if is_turned { (second, first) } else { (first, second) };
                let (nearer, farther) = (this.child() + usize::from(is_turned), this.child() + usize::from(!is_turned));
                let ahead = Step { node: nearer, near, far: far.min(padded_up(front)) };
                let behind = Step { node: farther, near: near.max(padded_down(back)), far };
                if ahead.near <= ahead.far {
                    if behind.near <= behind.far {
                        stack.push(behind);
                    }
                    Step { node, near, far } = ahead;
                } else {
                    Step { node, near, far } = behind;
                }
            }
        }
        found
    }
}

fn padded_up(t: f32) -> f32 {
    if t > 0.0 { t * PADDING } else { t / PADDING }
}

fn padded_down(t: f32) -> f32 {
    if t > 0.0 { t / PADDING } else { t * PADDING }
}

/// Möller and Trumbore 1997.
fn hit(mesh: &Mesh, row: u32, ray: &Ray) -> Option<f32> {
    let [a, b, c] = mesh.corners(row);
    let (ab, ac) = (subtract(b, a), subtract(c, a));
    let p = cross(ray.direction, ac);
    let inverse = dot(ab, p).recip();
    let s = subtract(ray.origin, a);
    let u = dot(s, p) * inverse;
    let q = cross(s, ab);
    let v = dot(ray.direction, q) * inverse;
    let t = dot(ac, q) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.t_min && t <= ray.t_max).then_some(t)
}

/// Every object in turn.
#[cfg(test)]
pub fn naive(mesh: &Mesh, ray: &Ray) -> Found {
    let hits = (0..mesh.triangles.len() as u32).filter_map(|row| hit(mesh, row, ray).map(|t| (t, row)));
    hits.fold((f32::INFINITY, u32::MAX), |best, found| if found.0 < best.0 { found } else { best })
}
