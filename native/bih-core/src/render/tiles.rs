//! The picture in tiles, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::camera::sample_offset;
use super::shade::{Lighting, Surface};
use super::{Camera, Passes, Pixel};
use crate::control::{Cancelled, Control};
use crate::geometry::{Ray, Triangles, add_scaled, cross, dot, normalise, subtract};
use crate::simd::{FloatEnvironment, Kernel, Lanes, dispatch};
use crate::traverse::{Counts, Hit, Stack, closest};
use crate::tree::Tree;

/// Side of a tile in pixels: some milliseconds of work a sample.
const TILE: u32 = 32;

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
    /// Rays a pixel, at least 1; the first goes through its centre.
    pub samples: u32,
    /// Shifts the samples but the first.
    pub seed: u64,
    /// What shines.
    pub lighting: Lighting,
    /// Whether colours are wanted; without, only the first sample is traced and nothing shaded.
    pub combined: bool,
}

/// Trace one picture.
pub fn render(
    tree: &Tree,
    triangles: &Triangles,
    camera: &Camera,
    options: &RenderOptions,
    control: &Control,
) -> Result<Passes, Cancelled> {
    let whole = options.tile;
    let tiles: Vec<Tile> = (0..whole.height.div_ceil(TILE))
        .flat_map(|row| (0..whole.width.div_ceil(TILE)).map(move |column| (column * TILE, row * TILE)))
        .map(|(x, y)| Tile {
            x: whole.x + x,
            y: whole.y + y,
            width: TILE.min(whole.width - x),
            height: TILE.min(whole.height - y),
        })
        .collect();
    control.start(tiles.len());
    let traced = tiles
        .par_iter()
        .map(|tile| {
            let _standard = FloatEnvironment::standard();
            control.advance(1)?;
            let pixels = dispatch(TileKernel { tree, triangles, camera, options, tile, control })?;
            Ok((tile, pixels))
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;

    let (width, height) = (whole.width as usize, whole.height as usize);
    let mut pixels = vec![Pixel::MISS; width * height];
    for (tile, part) in traced {
        let (left, bottom) = ((tile.x - whole.x) as usize, (tile.y - whole.y) as usize);
        for (row, part) in part.chunks_exact(tile.width as usize).enumerate() {
            let start = (bottom + row) * width + left;
            pixels[start..start + part.len()].copy_from_slice(part);
        }
    }
    Ok(Passes { width, height, pixels })
}

/// The pixels of one tile.
struct TileKernel<'a> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    camera: &'a Camera,
    options: &'a RenderOptions,
    tile: &'a Tile,
    control: &'a Control,
}

impl Kernel for TileKernel<'_> {
    type Output = Result<Vec<Pixel>, Cancelled>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { tree, triangles, camera, options, tile, control } = self;
        let mut stack = Stack::default();
        let mut pixels = Vec::with_capacity((tile.width * tile.height) as usize);
        for y in tile.y..tile.y + tile.height {
            // With many samples a tile takes long.
            control.check()?;
            for x in tile.x..tile.x + tile.width {
                pixels.push(trace_pixel::<L>(tree, triangles, camera, options, x, y, &mut stack));
            }
        }
        Ok(pixels)
    }
}

#[inline(always)]
fn trace_pixel<L: Lanes>(
    tree: &Tree,
    triangles: &Triangles,
    camera: &Camera,
    options: &RenderOptions,
    x: u32,
    y: u32,
    stack: &mut Stack,
) -> Pixel {
    // No closures: see `Kernel`.
    let mut pixel = Pixel::MISS;
    let mut sum = [0.0; 4];
    let samples = if options.combined { options.samples } else { 1 };
    for sample in 0..samples {
        let ray = camera.ray(x, y, sample_offset(sample, options.seed));
        if !ray.is_valid() {
            continue;
        }
        let mut counts = Counts::default();
        let hit = closest::<L, _>(tree, triangles, &ray, stack, &mut counts);
        if sample == 0 {
            pixel.cost = [counts.nodes as f32, counts.triangles as f32];
        }
        let Some(hit) = hit else { continue };
        let surface = surface(triangles, &ray, &hit);
        if sample == 0 {
            pixel.depth = camera.depth(&surface.position) as f32;
            pixel.normal = surface.normal.map(|x| x as f32);
            pixel.position = surface.position.map(|x| x as f32);
            pixel.triangle = hit.triangle as i32;
        }
        if options.combined {
            let [red, green, blue] = options.lighting.shade::<L>(tree, triangles, &surface, &ray.direction, stack);
            for (sum, value) in sum.iter_mut().zip([red, green, blue, 1.0]) {
                *sum += value;
            }
        }
    }
    pixel.combined = sum.map(|x| (x / f64::from(samples)) as f32);
    pixel
}

fn surface(triangles: &Triangles, ray: &Ray, hit: &Hit) -> Surface {
    let [a, b, c] = triangles.corners(hit.triangle);
    let normal = normalise(&cross(&normalise(&subtract(&b, &a)), &normalise(&subtract(&c, &a))));
    let away = dot(&normal, &ray.direction) > 0.0;
    // The hit is right to 2^-40 of t, the roundings of origin + t · direction are far below that of the larger of both.
    let largest = ray.origin.iter().fold(hit.t, |largest, x| largest.max(x.abs()));
    Surface {
        error: 2.0 * largest / (1u64 << 40) as f64,
        position: add_scaled(&ray.origin, hit.t, &ray.direction),
        normal: if away { normal.map(|x| -x) } else { normal },
    }
}
