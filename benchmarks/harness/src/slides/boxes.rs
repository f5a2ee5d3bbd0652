//! The boxes of objects: all that the construction looks at.

use bih_core::Bounds;

use crate::mesh::Mesh;

pub struct Boxes {
    pub each: Vec<Bounds>,
    pub whole: Bounds,
}

impl Boxes {
    pub fn of(mesh: &Mesh) -> Self {
        let each: Vec<_> = (0..mesh.triangles.len() as u32)
            .map(|row| {
                let corners = mesh.corners(row);
                corners
                    .iter()
                    .fold(Bounds::EMPTY, |bounds, corner| bounds.union(&Bounds { lower: *corner, upper: *corner }))
            })
            .collect();
        Self::new(each)
    }

    pub fn new(each: Vec<Bounds>) -> Self {
        let whole = each.iter().fold(Bounds::EMPTY, |whole, bounds| whole.union(bounds));
        Self { each, whole }
    }

    /// Twice the centre of an object's box along an axis.
    #[inline(always)]
    pub fn place(&self, object: u32, axis: usize) -> f32 {
        let bounds = &self.each[object as usize];
        bounds.lower[axis] + bounds.upper[axis]
    }
}
