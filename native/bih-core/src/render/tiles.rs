//! The picture in tiles, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::camera::sample_offset;
use super::passes::TilePasses;
use super::shade::{Lighting, Surface};
use super::{Camera, Passes, Wanted};
use crate::build::Precision;
use crate::control::{Cancelled, Control};
use crate::geometry::{Corners, Ray, Triangles, Vector, add_scaled, dot, normal, subtract};
use crate::simd::FloatEnvironment;
use crate::traverse::{Counts, Hit, PACKET, Stack, Tracer, Way};
use crate::tree::Tree;

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
    /// Rays a pixel, at least 1; the first goes through its centre.
    pub samples: u32,
    /// Shifts the samples but the first.
    pub seed: u64,
    /// What shines.
    pub lighting: Lighting,
    /// What it shows.
    pub wanted: Wanted,
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
    let mut passes = Passes::new(whole.width as usize, whole.height as usize, &options.wanted);
    let corners: Vec<_> = (0..whole.height.div_ceil(TILE))
        .flat_map(|row| (0..whole.width.div_ceil(TILE)).map(move |column| (column * TILE, row * TILE)))
        .collect();
    control.start(corners.len());
    let tiles = passes.tiles(TILE as usize);
    corners.into_par_iter().zip(tiles).try_for_each_init(Stack::default, |stack, ((x, y), pixels)| {
        let _standard = FloatEnvironment::standard();
        control.advance(1)?;
        let tile = Tile {
            x: whole.x + x,
            y: whole.y + y,
            width: TILE.min(whole.width - x),
            height: TILE.min(whole.height - y),
        };
        TileRender { tracer: Tracer::new(tree, triangles), camera, options, tile, control }.trace(pixels, stack)
    })?;
    Ok(passes)
}

/// One tile.
struct TileRender<'a> {
    tracer: Tracer<'a>,
    camera: &'a Camera,
    options: &'a RenderOptions,
    tile: Tile,
    control: &'a Control,
}

impl TileRender<'_> {
    fn trace(&self, mut pixels: TilePasses, stack: &mut Stack) -> Result<(), Cancelled> {
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

impl TileRender<'_> {
    fn trace_block(&self, block: &Block, pixels: &mut TilePasses, stack: &mut Stack) {
        let Self { tracer, camera, options, tile, .. } = self;
        let mut sums = [[0.0; 4]; PACKET];
        let mut rays = [Ray::new([0.0; 3], [0.0; 3]); PACKET];
        let mut hits = [None; PACKET];
        let mut found = Found::new();
        let samples = if options.wanted.combined { options.samples } else { 1 };
        let len = block.len;
        for sample in 0..samples {
            let offset = sample_offset(sample, options.seed);
            for (ray, &[x, y]) in rays.iter_mut().zip(block.places()) {
                *ray = camera.ray(tile.x + x as u32, tile.y + y as u32, offset);
            }
            tracer.closest(&rays[..len], Way::Packets, stack, &mut hits[..len]);
            found.len = 0;
            let has_normals = options.wanted.combined || options.wanted.normal;
            for (i, (ray, hit)) in rays.iter().zip(&hits).enumerate().take(len) {
                if let Some(hit) = hit {
                    found.push(i, &surface(tracer, ray, hit, has_normals), &ray.direction);
                }
            }
            if sample == 0 {
                self.show_centres(block, &rays, &hits, &found, pixels, stack);
            }
            if options.wanted.combined {
                let lighting = &options.lighting;
                let radiance = lighting.shade(tracer, found.surfaces(), found.views(), stack);
                for (&i, [red, green, blue]) in found.pixels().iter().zip(radiance) {
                    for (sum, value) in sums[i].iter_mut().zip([red, green, blue, 1.0]) {
                        *sum += value;
                    }
                }
            }
        }
        for (&place, sum) in block.places().iter().zip(&sums) {
            pixels.combined.set(place, sum.map(|x| (x / f64::from(samples)) as f32));
        }
    }

    /// What only the rays through the centres tell.
    fn show_centres(
        &self,
        block: &Block,
        rays: &[Ray; PACKET],
        hits: &[Option<Hit>; PACKET],
        found: &Found,
        pixels: &mut TilePasses,
        stack: &mut Stack,
    ) {
        let places = block.places();
        if pixels.depth.are_wanted() || pixels.normal.are_wanted() || pixels.position.are_wanted() {
            for &place in places {
                pixels.depth.set(place, f32::INFINITY);
            }
            for (&i, surface) in found.pixels().iter().zip(found.surfaces()) {
                pixels.depth.set(places[i], self.camera.depth(&surface.position) as f32);
                pixels.normal.set(places[i], surface.normal.map(|x| x as f32));
                pixels.position.set(places[i], surface.position.map(|x| x as f32));
            }
        }
        if pixels.triangle.are_wanted() {
            for (&place, hit) in places.iter().zip(hits) {
                pixels.triangle.set(place, hit.map_or(-1, |hit| hit.triangle as i32));
            }
        }
        if pixels.cost.are_wanted() {
            let mut counts = [Counts::default(); PACKET];
            self.tracer.cost(&rays[..block.len], stack, &mut counts[..block.len]);
            for (&place, counts) in places.iter().zip(&counts) {
                pixels.cost.set(place, [counts.nodes as f32, counts.triangles as f32]);
            }
        }
    }
}

/// What is hit in a block, and through which of its pixels.
struct Found {
    len: usize,
    pixels: [usize; PACKET],
    surfaces: [Surface; PACKET],
    views: [Vector; PACKET],
}

impl Found {
    fn new() -> Self {
        let surface = Surface { position: [0.0; 3], normal: [0.0; 3], error: 0.0 };
        Self { len: 0, pixels: [0; PACKET], surfaces: [surface; PACKET], views: [[0.0; 3]; PACKET] }
    }

    fn push(&mut self, pixel: usize, surface: &Surface, view: &Vector) {
        self.pixels[self.len] = pixel;
        self.surfaces[self.len] = *surface;
        self.views[self.len] = *view;
        self.len += 1;
    }

    fn pixels(&self) -> &[usize] {
        &self.pixels[..self.len]
    }

    fn surfaces(&self) -> &[Surface] {
        &self.surfaces[..self.len]
    }

    fn views(&self) -> &[Vector] {
        &self.views[..self.len]
    }
}

/// What a ray hits; without the normal where nothing needs it.
fn surface(tracer: &Tracer, ray: &Ray, hit: &Hit, has_normal: bool) -> Surface {
    let corners = tracer.triangles.corners(hit.triangle);
    let normal = if has_normal { facing(&corners, ray) } else { [0.0; 3] };
    let (position, error) = match tracer.tree.precision() {
        Precision::Watertight | Precision::Exact => along(ray, hit),
        Precision::Fast => within(&corners, hit),
    };
    Surface { error, position, normal }
}

/// The unit normal of a triangle on the side that a ray comes from.
fn facing([a, b, c]: &Corners, ray: &Ray) -> Vector {
    let normal = normal(&subtract(b, a), &subtract(c, a));
    let away = dot(&normal, &ray.direction) > 0.0;
    if away { normal.map(|x| -x) } else { normal }
}

/// Where a ray is at a hit, and how far that can be from the triangle.
fn along(ray: &Ray, hit: &Hit) -> (Vector, f64) {
    // The hit is right to 2^-40 of t, the roundings of origin + t · direction are far below that of the larger of both.
    let largest = ray.origin.iter().fold(hit.t, |largest, x| largest.max(x.abs()));
    (add_scaled(&ray.origin, hit.t, &ray.direction), 2.0 * largest / (1u64 << 40) as f64)
}

/// The point of a triangle that the weights of a hit name, and how far rays of single precision may see it elsewhere.
fn within(corners: &Corners, hit: &Hit) -> (Vector, f64) {
    let [a, b, c] = corners;
    let position = add_scaled(&add_scaled(a, hit.u, &subtract(b, a)), hit.v, &subtract(c, a));
    // The weights, however wrong, leave the point in the triangle's plane; a ray that starts there is rounded by half a
    // unit in the last place of a coordinate, and finds the plane with a few such errors.
    let largest = corners.as_flattened().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    (position, 8.0 * f64::from(f32::EPSILON) * largest)
}
