//! The picture in tiles, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::passes::TilePasses;
use super::sampling::{Sampler, sample_offset};
use super::shade::Lighting;
use super::surface::Found;
use super::visible::Visible;
use super::{Appearance, Camera, Passes, Seen, Traced, Wanted};
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::Ray;
use crate::memory;
use crate::simd::FloatEnvironment;
use crate::traverse::{Counts, PACKET};

/// Side of a tile in pixels: some milliseconds of work a sample.
const TILE: u32 = 32;
/// Side of what is traced as one packet.
const BLOCK: usize = 8;

/// A part of the picture in pixels from the lower left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// What a person can choose about the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// The part to render.
    pub tile: Tile,
    /// Rays a pixel, at least 1; sample 0 goes through its centre.
    pub samples: u32,
    /// The first of them, so that several pictures share one sequence; with all of `samples` it is no more than
    /// `u32::MAX`.
    pub first_sample: u32,
    /// Shifts the samples but sample 0.
    pub seed: u64,
    /// What shines.
    pub lighting: Lighting,
    /// Red, green, blue and alpha where nothing is hit, the colours multiplied by alpha.
    pub background: [f64; 4],
    /// What it shows.
    pub wanted: Wanted,
}

/// Trace one picture. `appearance` was checked.
pub fn render<T: Traced>(
    traced: &T,
    appearance: &Appearance,
    camera: &Camera,
    options: &RenderOptions,
    control: &Control,
) -> Result<Passes, Error> {
    let whole = options.tile;
    // Tiles know where each of their rows is.
    let pixel_bytes = options.wanted.pixel_bytes() + 4;
    let bytes = pixel_bytes * whole.width as usize * whole.height as usize;
    memory::room("the picture", bytes + traced.piece_bytes())?;
    let mut passes = Passes::new(whole.width as usize, whole.height as usize, &options.wanted);
    let corners: Vec<_> = (0..whole.height.div_ceil(TILE))
        .flat_map(|row| (0..whole.width.div_ceil(TILE)).map(move |column| (column * TILE, row * TILE)))
        .collect();
    control.start(corners.len());
    let tiles = passes.tiles(TILE as usize);
    let scene = Visible::new(traced, appearance);
    corners.into_par_iter().zip(tiles).try_for_each_init(T::Stack::default, |stack, ((x, y), pixels)| {
        let _standard = FloatEnvironment::standard();
        control.advance(1)?;
        let tile = Tile {
            x: whole.x + x,
            y: whole.y + y,
            width: TILE.min(whole.width - x),
            height: TILE.min(whole.height - y),
        };
        TileRender { scene: &scene, camera, options, tile, control }.trace(pixels, stack)
    })?;
    Ok(passes)
}

/// One tile.
struct TileRender<'a, T> {
    scene: &'a Visible<'a, T>,
    camera: &'a Camera,
    options: &'a RenderOptions,
    tile: Tile,
    control: &'a Control,
}

impl<T: Traced> TileRender<'_, T> {
    fn trace(&self, mut pixels: TilePasses, stack: &mut T::Stack) -> Result<(), Cancelled> {
        let (width, height) = (self.tile.width as usize, self.tile.height as usize);
        for y in (0..height).step_by(BLOCK) {
            for x in (0..width).step_by(BLOCK) {
                // With many samples a tile takes long.
                self.control.check()?;
                self.trace_block(&Block::new(x, y, width, height), &mut pixels, stack);
            }
        }
        Ok(())
    }
}

/// Places in a tile, those near to each other side by side.
struct Block {
    places: [[usize; 2]; PACKET],
    len: usize,
}

impl Block {
    /// The part within the tile of `BLOCK` columns from x and as many rows from y.
    fn new(x: usize, y: usize, width: usize, height: usize) -> Self {
        let mut block = Self { places: [[0; 2]; PACKET], len: 0 };
        for i in 0..PACKET {
            // The bits of column and row in turn: eight pixels are four by two, sixteen four by four.
            let place = [x + (i & 1 | i >> 1 & 2 | i >> 2 & 4), y + (i >> 1 & 1 | i >> 2 & 2 | i >> 3 & 4)];
            if place[0] < width && place[1] < height {
                block.places[block.len] = place;
                block.len += 1;
            }
        }
        block
    }

    fn places(&self) -> &[[usize; 2]] {
        &self.places[..self.len]
    }
}

impl<T: Traced> TileRender<'_, T> {
    fn trace_block(&self, block: &Block, pixels: &mut TilePasses, stack: &mut T::Stack) {
        let Self { scene, camera, options, tile, .. } = self;
        let mut sums = [[0.0; 4]; PACKET];
        let mut rays = [Ray::new([0.0; 3], [0.0; 3]); PACKET];
        let mut seen = [None; PACKET];
        let mut found = Found::new();
        let samples = if options.wanted.combined { options.samples } else { 1 };
        let has_normals = options.wanted.combined || options.wanted.normal;
        let len = block.len;
        for sample in options.first_sample..options.first_sample + samples {
            let offset = sample_offset(sample, options.seed);
            let pixel = |[x, y]: [usize; 2]| [tile.x + x as u32, tile.y + y as u32];
            for (ray, &place) in rays.iter_mut().zip(block.places()) {
                let [x, y] = pixel(place);
                *ray = camera.ray(x, y, offset);
            }
            scene.closest(&rays[..len], stack, &mut seen[..len]);
            found.clear();
            for (i, (ray, seen)) in rays.iter().zip(&seen).enumerate().take(len) {
                match seen {
                    Some(seen) => {
                        let sampler = Sampler::new(options.seed, pixel(block.places[i]), sample);
                        found.push(i, scene, ray, seen, has_normals, sampler);
                    }
                    None => add(&mut sums[i], &options.background),
                }
            }
            if sample == options.first_sample {
                self.show_first(block, &rays, &seen, &found, pixels, stack);
            }
            if options.wanted.combined {
                let radiance = options.lighting.shade(scene, found.points(), stack);
                for ((&i, is_holdout), [red, green, blue]) in found.pixels().iter().zip(found.holdouts()).zip(radiance)
                {
                    if !is_holdout {
                        add(&mut sums[i], &[red, green, blue, 1.0]);
                    }
                }
            }
        }
        for (&place, sum) in block.places().iter().zip(&sums) {
            pixels.combined.set(place, sum.map(|x| (x / f64::from(samples)) as f32));
        }
    }

    /// What only the first rays tell.
    fn show_first(
        &self,
        block: &Block,
        rays: &[Ray; PACKET],
        seen: &[Option<Seen>; PACKET],
        found: &Found,
        pixels: &mut TilePasses,
        stack: &mut T::Stack,
    ) {
        let places = block.places();
        if pixels.depth.are_wanted() || pixels.normal.are_wanted() || pixels.position.are_wanted() {
            for &place in places {
                pixels.depth.set(place, f32::INFINITY);
            }
            for (&i, point) in found.pixels().iter().zip(found.points()) {
                pixels.depth.set(places[i], self.camera.depth(&point.position) as f32);
                pixels.normal.set(places[i], point.normal.map(|x| x as f32));
                pixels.position.set(places[i], point.position.map(|x| x as f32));
            }
        }
        if pixels.triangle.are_wanted() || pixels.instance.are_wanted() {
            let appearance = self.scene.appearance;
            for (&place, seen) in places.iter().zip(seen) {
                pixels.triangle.set(place, seen.map_or(-1, |seen| seen.hit.triangle as i32));
                pixels.instance.set(place, seen.map_or(-1, |seen| appearance.object_of(&seen) as i32));
            }
        }
        if pixels.object_index.are_wanted() || pixels.material_index.are_wanted() {
            for (&place, seen) in places.iter().zip(seen) {
                if let Some(seen) = seen {
                    let object = self.scene.appearance.object(seen);
                    let surface = self.scene.appearance.surface(self.scene.traced, seen, &object);
                    pixels.object_index.set(place, object.index);
                    pixels.material_index.set(place, surface.index);
                }
            }
        }
        if pixels.cost.are_wanted() {
            let mut counts = [Counts::default(); PACKET];
            self.scene.traced.cost(&rays[..block.len], stack, &mut counts[..block.len]);
            for (&place, counts) in places.iter().zip(&counts) {
                pixels.cost.set(place, [counts.nodes as f32, counts.triangles as f32]);
            }
        }
    }
}

fn add(sum: &mut [f64; 4], colour: &[f64; 4]) {
    for (sum, value) in sum.iter_mut().zip(colour) {
        *sum += value;
    }
}
