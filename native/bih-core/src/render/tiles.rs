//! The picture in tiles, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::passes::TilePasses;
use super::sampling::sample_offset;
use super::shade::{Lighting, Shader};
use super::surface::Points;
use super::vectors::{Numbers, Vectors, at};
use super::visible::Visible;
use super::{Appearance, Camera, Passes, Seen, Traced, Wanted};
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::Ray;
use crate::memory;
use crate::simd::{FloatEnvironment, Kernel, Lanes, dispatch_common};
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
    corners.into_par_iter().zip(tiles).try_for_each_init(
        || Work::<T>::new(options.seed),
        |work, ((x, y), pixels)| {
            let _standard = FloatEnvironment::standard();
            control.advance(1)?;
            let tile = Tile {
                x: whole.x + x,
                y: whole.y + y,
                width: TILE.min(whole.width - x),
                height: TILE.min(whole.height - y),
            };
            TileRender { scene: &scene, camera, options, tile, control }.trace(pixels, work)
        },
    )?;
    Ok(passes)
}

/// What a thread traces and shades its blocks with.
struct Work<T: Traced> {
    stack: T::Stack,
    rays: [Ray; PACKET],
    seen: [Option<Seen>; PACKET],
    points: Points,
    shader: Shader,
}

impl<T: Traced> Work<T> {
    fn new(seed: u64) -> Self {
        Self {
            stack: T::Stack::default(),
            rays: [Ray::new([0.0; 3], [0.0; 3]); PACKET],
            seen: [None; PACKET],
            points: Points::new(seed),
            shader: Shader::new(),
        }
    }
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
    fn trace(&self, mut pixels: TilePasses, work: &mut Work<T>) -> Result<(), Cancelled> {
        let (width, height) = (self.tile.width as usize, self.tile.height as usize);
        for y in (0..height).step_by(BLOCK) {
            for x in (0..width).step_by(BLOCK) {
                // With many samples a tile takes long.
                self.control.check()?;
                self.trace_block(&Block::new(x, y, width, height), &mut pixels, work);
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
        /// The bits of column and row in turn: eight pixels are four by two, sixteen four by four.
        const ORDER: [[usize; 2]; PACKET] = {
            let mut order = [[0; 2]; PACKET];
            let mut i = 0;
            while i < PACKET {
                order[i] = [i & 1 | i >> 1 & 2 | i >> 2 & 4, i >> 1 & 1 | i >> 2 & 2 | i >> 3 & 4];
                i += 1;
            }
            order
        };
        let mut block = Self { places: [[0; 2]; PACKET], len: 0 };
        for [column, row] in ORDER {
            let place = [x + column, y + row];
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
    fn trace_block(&self, block: &Block, pixels: &mut TilePasses, work: &mut Work<T>) {
        let Self { scene, camera, options, tile, .. } = self;
        let samples = if options.wanted.combined { options.samples } else { 1 };
        let has_normals = options.wanted.combined || options.wanted.normal;
        let len = block.len;
        for (pixel, [x, y]) in work.points.pixels.iter_mut().zip(block.places()) {
            *pixel = [tile.x + *x as u32, tile.y + *y as u32];
        }
        work.seen[len..].fill(None);
        let mut sums = [[0.0; PACKET]; 4];
        for sample in options.first_sample..options.first_sample + samples {
            let Work { stack, rays, seen, points, .. } = work;
            camera.shoot(sample_offset(sample, options.seed), points);
            points.rays(rays);
            scene.closest(&rays[..len], stack, &mut seen[..len]);
            points.sample = sample;
            points.find(scene, seen, has_normals);
            if sample == options.first_sample {
                self.show_first(block, work, pixels);
            }
            if options.wanted.combined {
                let Work { stack, points, shader, .. } = work;
                if points.are_any() {
                    shader.shade(&options.lighting, scene, points, stack);
                }
                let background = &options.background;
                let shown = Add { points, radiance: &shader.radiance, background, sums: &mut sums };
                dispatch_common(shown);
            }
        }
        if options.wanted.combined {
            let mut colours = [[0.0; 4]; PACKET];
            dispatch_common(Mean { sums: &sums, samples, colours: &mut colours });
            for (&place, colour) in block.places().iter().zip(colours) {
                pixels.combined.set(place, colour);
            }
        }
    }

    /// What only the first rays tell.
    fn show_first(&self, block: &Block, work: &mut Work<T>, pixels: &mut TilePasses) {
        let Work { stack, rays, seen, points, .. } = work;
        let places = block.places();
        if pixels.depth.are_wanted() || pixels.normal.are_wanted() || pixels.position.are_wanted() {
            for &place in places {
                pixels.depth.set(place, f32::INFINITY);
            }
            for i in points.places() {
                let position = at(&points.position, i);
                pixels.depth.set(places[i], self.camera.depth(&position) as f32);
                pixels.normal.set(places[i], at(&points.normal, i).map(|x| x as f32));
                pixels.position.set(places[i], position.map(|x| x as f32));
            }
        }
        if pixels.triangle.are_wanted() || pixels.instance.are_wanted() {
            let appearance = self.scene.appearance;
            for (&place, seen) in places.iter().zip(&*seen) {
                pixels.triangle.set(place, seen.map_or(-1, |seen| seen.hit.triangle as i32));
                pixels.instance.set(place, seen.map_or(-1, |seen| appearance.object_of(&seen) as i32));
            }
        }
        if pixels.object_index.are_wanted() || pixels.material_index.are_wanted() {
            for (&place, seen) in places.iter().zip(&*seen) {
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

/// Add what a sample shows: what comes from the points, nothing of a holdout, or what is behind all.
struct Add<'a> {
    points: &'a Points,
    radiance: &'a Vectors,
    background: &'a [f64; 4],
    sums: &'a mut [Numbers; 4],
}

impl Kernel for Add<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { points, radiance, background, sums } = self;
        let are_all_shown = (0..PACKET).fold(true, |all, i| all & points.are_there[i] & !points.are_holdouts[i]);
        for (channel, sums) in sums.iter_mut().enumerate() {
            // The fourth is alpha.
            let shown = |i: usize| if channel < 3 { radiance[channel][i] } else { 1.0 };
            if are_all_shown {
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum += shown(i);
                }
                continue;
            }
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum += match (points.are_there[i], points.are_holdouts[i]) {
                    (false, _) => background[channel],
                    (true, true) => 0.0,
                    (true, false) => shown(i),
                };
            }
        }
    }
}

/// The colours that some samples have added up to.
struct Mean<'a> {
    sums: &'a [Numbers; 4],
    samples: u32,
    colours: &'a mut [[f32; 4]; PACKET],
}

impl Kernel for Mean<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { sums: [red, green, blue, alpha], samples, colours } = self;
        let samples = f64::from(samples);
        for (i, colour) in colours.iter_mut().enumerate() {
            let [red, green, blue, alpha] =
                [red[i] / samples, green[i] / samples, blue[i] / samples, alpha[i] / samples];
            *colour = [red as f32, green as f32, blue as f32, alpha as f32];
        }
    }
}
