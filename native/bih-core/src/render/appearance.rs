//! How what is hit looks: arrays of the caller's, which no tree keeps.

use super::traced::{Seen, Traced};

/// Matter without a material: the reflectance of Blender's default one.
pub const GREY: Surface = Surface { base: [0.8; 3], emission: [0.0; 3], index: 0 };

/// What a material slot holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Reflectance in red, green and blue.
    pub base: [f64; 3],
    /// Radiance of its own.
    pub emission: [f64; 3],
    /// What the pass of material indices shows.
    pub index: i32,
}

/// One instance, or the triangles of one object among those of a tree.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Object {
    /// Row of the surface of its first material slot.
    pub first_surface: u32,
    /// What the pass of object indices shows.
    pub index: i32,
    /// Camera rays pass through it.
    pub is_hidden: bool,
    /// Shadow rays pass through it.
    pub casts_no_shadow: bool,
    /// Where it is seen the picture is empty.
    pub is_holdout: bool,
}

/// What is known of each triangle of a tree.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeshLook<'a> {
    /// Its material slot; none: the first.
    pub materials: Option<&'a [i32]>,
    /// Normals at its three corners; none: its own.
    pub corner_normals: Option<&'a [[[f32; 3]; 3]]>,
}

/// Surfaces, objects and meshes; where there are none, all is one object of grey matter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Appearance<'a> {
    /// By rows.
    pub surfaces: Vec<Surface>,
    /// By instances, or with `first_triangles` by ranges of a tree's triangles.
    pub objects: Vec<Object>,
    /// Where the triangles of each object begin, not falling, from 0.
    pub first_triangles: Option<Vec<u32>>,
    /// One a tree, or none.
    pub meshes: Vec<MeshLook<'a>>,
}

/// A material slot without a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("materials: triangle {triangle} of object {object} has slot {slot}, which is row {row} of {surfaces} surfaces")]
pub struct NoSurface {
    /// Row of the triangle.
    pub triangle: usize,
    /// Row of the object.
    pub object: usize,
    /// Its slot.
    pub slot: i32,
    /// The row of surfaces that this is.
    pub row: i64,
    /// How many there are.
    pub surfaces: usize,
}

impl Appearance<'_> {
    /// Whether all is grey matter with normals of its own and without flags.
    pub(super) fn is_plain(&self) -> bool {
        self.surfaces.is_empty() && self.objects.is_empty() && self.meshes.is_empty()
    }

    /// Row of the object that is seen.
    #[inline]
    pub(super) fn object_of(&self, seen: &Seen) -> usize {
        match &self.first_triangles {
            Some(first) => first.partition_point(|&first| first <= seen.hit.triangle).saturating_sub(1),
            None => seen.instance as usize,
        }
    }

    /// The object that is seen.
    #[inline]
    pub(super) fn object(&self, seen: &Seen) -> Object {
        self.objects.get(self.object_of(seen)).copied().unwrap_or_default()
    }

    /// The surface that is seen.
    #[inline]
    pub(super) fn surface(&self, traced: &impl Traced, seen: &Seen, object: &Object) -> Surface {
        if self.surfaces.is_empty() {
            return GREY;
        }
        let materials = self.meshes.get(traced.tree_of(seen.instance)).and_then(|mesh| mesh.materials);
        let slot = materials.map_or(0, |materials| materials[seen.hit.triangle as usize]);
        self.surfaces[(i64::from(object.first_surface) + i64::from(slot)) as usize]
    }

    /// Whether every triangle's slot has a surface. `shown` gives tree and object of each instance; objects by ranges
    /// are those of one tree with so many `triangles`.
    pub fn check(&self, shown: impl Iterator<Item = (usize, usize)>, triangles: usize) -> Result<(), NoSurface> {
        if self.surfaces.is_empty() {
            return Ok(());
        }
        if let Some(first) = &self.first_triangles {
            let ends = first.iter().skip(1).map(|&end| end as usize).chain([triangles]);
            for (object, (&start, end)) in first.iter().zip(ends).enumerate() {
                self.check_range(object, 0, start as usize..end)?;
            }
            return Ok(());
        }
        shown.into_iter().try_for_each(|(tree, object)| {
            let count = self.meshes.get(tree).and_then(|mesh| mesh.materials).map_or(1, <[i32]>::len);
            self.check_range(object, tree, 0..count)
        })
    }

    fn check_range(&self, object: usize, tree: usize, rows: std::ops::Range<usize>) -> Result<(), NoSurface> {
        let first = self.objects.get(object).map_or(0, |object| i64::from(object.first_surface));
        let materials = self.meshes.get(tree).and_then(|mesh| mesh.materials);
        let surfaces = self.surfaces.len();
        let refuse = |triangle, slot: i32| {
            let row = first + i64::from(slot);
            let is_there = slot >= 0 && row < surfaces as i64;
            if is_there { Ok(()) } else { Err(NoSurface { triangle, object, slot, row, surfaces }) }
        };
        match materials {
            None if rows.is_empty() => Ok(()),
            None => refuse(rows.start, 0),
            Some(materials) => {
                let slots = &materials[rows.clone()];
                // Two numbers tell of nearly all meshes that they are right.
                let ends =
                    slots.iter().fold((i32::MAX, i32::MIN), |(least, most), &slot| (least.min(slot), most.max(slot)));
                if slots.is_empty() || (refuse(0, ends.0).is_ok() && refuse(0, ends.1).is_ok()) {
                    return Ok(());
                }
                rows.zip(slots).try_for_each(|(triangle, &slot)| refuse(triangle, slot))
            }
        }
    }
}
