//! What a picture shows, pass by pass.

use crate::pages;

/// Which passes are made; what nobody wants is neither computed nor kept.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Colours; without them only the first sample is traced and nothing shaded.
    pub combined: bool,
    /// Distances along the viewing axis.
    pub depth: bool,
    /// Normals.
    pub normal: bool,
    /// Places.
    pub position: bool,
    /// Rows of triangles.
    pub triangle: bool,
    /// Rows of instances, or of the objects of one tree.
    pub instance: bool,
    /// What the objects' own index says.
    pub object_index: bool,
    /// What the surfaces' own index says.
    pub material_index: bool,
    /// The work of the rays through the centres: they are traced once more, one by one.
    pub cost: bool,
}

impl Wanted {
    /// Every pass.
    pub const ALL: Self = Self {
        combined: true,
        depth: true,
        normal: true,
        position: true,
        triangle: true,
        instance: true,
        object_index: true,
        material_index: true,
        cost: true,
    };

    /// What they take, all together.
    pub(super) fn pixel_bytes(&self) -> usize {
        let Self { combined, depth, normal, position, triangle, instance, object_index, material_index, cost } = *self;
        let numbers = [(combined, 4), (normal, 3), (position, 3), (cost, 2)];
        let single = [depth, triangle, instance, object_index, material_index].map(|is_wanted| (is_wanted, 1));
        let wanted = numbers.into_iter().chain(single).filter(|(is_wanted, _)| *is_wanted);
        size_of::<f32>() * wanted.map(|(_, count)| count).sum::<usize>()
    }
}

/// A picture or a tile of it, row by row from the lower left; passes that nobody wanted are empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Passes {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Scene-linear red, green, blue and alpha, the colours multiplied by alpha; the mean of all samples.
    pub combined: Vec<[f32; 4]>,
    /// Distance along the viewing axis; infinite for a miss.
    pub depth: Vec<f32>,
    /// Unit normal that faces the ray; zero for a miss.
    pub normal: Vec<[f32; 3]>,
    /// Where the surface is hit; zero for a miss.
    pub position: Vec<[f32; 3]>,
    /// Row of the triangle; -1 for a miss.
    pub triangle: Vec<i32>,
    /// Row of the instance, or of the object among those of one tree; -1 for a miss.
    pub instance: Vec<i32>,
    /// The object's own index; 0 for a miss.
    pub object_index: Vec<i32>,
    /// The surface's own index; 0 for a miss.
    pub material_index: Vec<i32>,
    /// Nodes visited and triangles tested by the ray through the centre.
    pub cost: Vec<[f32; 2]>,
}

/// The pixels of one tile in the passes of the whole picture.
#[derive(Debug, Default)]
pub(super) struct TilePasses<'a> {
    pub combined: Pixels<'a, [f32; 4]>,
    pub depth: Pixels<'a, f32>,
    pub normal: Pixels<'a, [f32; 3]>,
    pub position: Pixels<'a, [f32; 3]>,
    pub triangle: Pixels<'a, i32>,
    pub instance: Pixels<'a, i32>,
    pub object_index: Pixels<'a, i32>,
    pub material_index: Pixels<'a, i32>,
    pub cost: Pixels<'a, [f32; 2]>,
}

impl Passes {
    /// Room for what is wanted.
    pub(super) fn new(width: usize, height: usize, wanted: &Wanted) -> Self {
        let count = |is_wanted| if is_wanted { width * height } else { 0 };
        Self {
            width,
            height,
            combined: pages::zeroed(count(wanted.combined)),
            depth: pages::zeroed(count(wanted.depth)),
            normal: pages::zeroed(count(wanted.normal)),
            position: pages::zeroed(count(wanted.position)),
            triangle: pages::zeroed(count(wanted.triangle)),
            instance: pages::zeroed(count(wanted.instance)),
            object_index: pages::zeroed(count(wanted.object_index)),
            material_index: pages::zeroed(count(wanted.material_index)),
            cost: pages::zeroed(count(wanted.cost)),
        }
    }

    /// Tiles of so many pixels a side, row by row; those at the right and at the top may be smaller.
    pub(super) fn tiles(&mut self, side: usize) -> Vec<TilePasses<'_>> {
        let (columns, rows) = (self.width.div_ceil(side), self.height.div_ceil(side));
        let mut tiles: Vec<_> = (0..columns * rows).map(|_| TilePasses::default()).collect();
        share(&mut self.combined, self.width, side, &mut tiles, |tile| &mut tile.combined);
        share(&mut self.depth, self.width, side, &mut tiles, |tile| &mut tile.depth);
        share(&mut self.normal, self.width, side, &mut tiles, |tile| &mut tile.normal);
        share(&mut self.position, self.width, side, &mut tiles, |tile| &mut tile.position);
        share(&mut self.triangle, self.width, side, &mut tiles, |tile| &mut tile.triangle);
        share(&mut self.instance, self.width, side, &mut tiles, |tile| &mut tile.instance);
        share(&mut self.object_index, self.width, side, &mut tiles, |tile| &mut tile.object_index);
        share(&mut self.material_index, self.width, side, &mut tiles, |tile| &mut tile.material_index);
        share(&mut self.cost, self.width, side, &mut tiles, |tile| &mut tile.cost);
        tiles
    }
}

/// Some rows of a pass, from the lowest; none of one that nobody wants.
#[derive(Debug)]
pub(super) struct Pixels<'a, T>(Vec<&'a mut [T]>);

impl<T> Default for Pixels<'_, T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Pixels<'_, T> {
    pub fn are_wanted(&self) -> bool {
        !self.0.is_empty()
    }

    /// Nothing where the pass is not wanted.
    pub fn set(&mut self, [x, y]: [usize; 2], value: T) {
        if let Some(row) = self.0.get_mut(y) {
            row[x] = value;
        }
    }
}

/// Give each tile its part of each row.
fn share<'a, T>(
    pass: &'a mut [T],
    width: usize,
    side: usize,
    tiles: &mut [TilePasses<'a>],
    pixels: impl for<'t> Fn(&'t mut TilePasses<'a>) -> &'t mut Pixels<'a, T>,
) {
    let columns = width.div_ceil(side);
    for (y, row) in pass.chunks_mut(width.max(1)).enumerate() {
        let band = &mut tiles[y / side * columns..];
        for (tile, part) in band.iter_mut().zip(row.chunks_mut(side)) {
            pixels(tile).0.push(part);
        }
    }
}
