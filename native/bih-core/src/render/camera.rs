//! Rays through the pixels of a picture, from one matrix.

use super::surface::Points;
use super::vectors::{Lengths, ZEROS, at, put};
use crate::geometry::{Ray, Vector, dot, normalise, subtract};
use crate::simd::{Kernel, Lanes, dispatch_common};
use crate::traverse::PACKET;

type Matrix = [[f64; 4]; 4];

/// A matrix that is not finite or that has no inverse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("clip_to_world: the matrix is not finite or has no inverse")]
pub struct SingularMatrix;

/// A camera given by the inverse of projection times view, as OpenGL and Blender have it.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    clip_to_world: Matrix,
    /// Gives the depth of a point: a plane whose value grows by one a unit along the viewing axis.
    depth: [f64; 4],
    lens: Option<Lens>,
    width: u32,
    height: u32,
}

/// A camera whose clip planes face it, as nearly all do: both ends of a ray are linear in its place in the picture.
#[derive(Debug, Clone, PartialEq)]
struct Lens {
    /// Of x, of y, and where both are 0.
    origin: [Vector; 3],
    /// From the near plane to the far one; with that at infinity, a direction.
    along: [Vector; 3],
    is_endless: bool,
}

impl Lens {
    fn new(matrix: &Matrix) -> Option<Self> {
        let [w_x, w_y, w_z, w] = matrix[3];
        if w_x != 0.0 || w_y != 0.0 {
            return None;
        }
        let column = |column: usize| -> Vector { std::array::from_fn(|row| matrix[row][column]) };
        let [x, y, z, centre] = [column(0), column(1), column(2), column(3)];
        let near = 1.0 / (w - w_z);
        let is_endless = w + w_z == 0.0;
        // With the far plane at infinity, what is left of its points is their direction, on this side of the camera.
        let far = if is_endless { 0.0 } else { 1.0 / (w + w_z) };
        let (across, through) = if is_endless { (near.signum(), near.signum()) } else { (far - near, far + near) };
        let scaled = |a: &Vector, factor: f64| a.map(|x| factor * x);
        Some(Self {
            origin: [scaled(&x, near), scaled(&y, near), scaled(&subtract(&centre, &z), near)],
            along: [
                scaled(&x, across),
                scaled(&y, across),
                std::array::from_fn(|i| across * centre[i] + through * z[i]),
            ],
            is_endless,
        })
    }
}

/// The rays of points through their places in the picture.
struct Through<'a> {
    lens: &'a Lens,
    size: [f64; 2],
    offset: [f64; 2],
    points: &'a mut Points,
}

impl Kernel for Through<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { lens, size, offset, points } = self;
        let on = |[a, b, c]: &[Vector; 3], [x, y]: [f64; 2]| -> Vector {
            [c[0] + x * a[0] + y * b[0], c[1] + x * a[1] + y * b[1], c[2] + x * a[2] + y * b[2]]
        };
        let place = |i: usize| place(points.pixels[i], size, offset);
        let mut along = ZEROS;
        for i in 0..PACKET {
            put(&mut points.origin, i, &on(&lens.origin, place(i)));
            put(&mut along, i, &on(&lens.along, place(i)));
        }
        let mut lengths = Lengths::of(|i| at(&along, i));
        for i in 0..PACKET {
            let inverse = lengths.inverse(i);
            put(&mut points.view, i, &at(&along, i).map(|x| x * inverse));
        }
        lengths.each_extreme(|i| put(&mut points.view, i, &normalise(&at(&along, i))));
        for i in 0..PACKET {
            let length = dot(&at(&along, i), &at(&points.view, i));
            points.t_max[i] = if lens.is_endless { f64::INFINITY } else { length };
        }
    }
}

/// From -1 to 1 across the picture and up.
#[inline(always)]
fn place(pixel: [u32; 2], size: [f64; 2], offset: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| 2.0 * (f64::from(pixel[axis]) + offset[axis]) / size[axis] - 1.0)
}

impl Camera {
    /// `width` and `height` in pixels.
    pub fn new(clip_to_world: Matrix, width: u32, height: u32) -> Result<Self, SingularMatrix> {
        let world_to_clip = inverse(&clip_to_world).ok_or(SingularMatrix)?;
        let length = |row: &[f64; 4]| row[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        let [_, _, z, w] = world_to_clip;
        // The w of clip space is the distance along the viewing axis if the projection is a perspective one. If not,
        // it is constant, and z runs from -1 on the near plane: depth is counted from there.
        let scale = length(&w);
        let depth = if scale > 1e-12 * w[3].abs() {
            w.map(|x| x / scale)
        } else {
            let scale = length(&z);
            [z[0] / scale, z[1] / scale, z[2] / scale, (z[3] + w[3]) / scale]
        };
        Ok(Self { lens: Lens::new(&clip_to_world), clip_to_world, depth, width, height })
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The ray through pixel (x, y), counted from the lower left, from the near clip plane to the far one; its direction
    /// is of unit length. `offset` is the place within the pixel, from 0 to 1.
    pub fn ray(&self, x: u32, y: u32, offset: [f64; 2]) -> Ray {
        let mut ray = [Ray::new([0.0; 3], [0.0; 3])];
        self.rays(&[[x, y]], offset, &mut ray);
        ray[0]
    }

    /// The rays through pixels, as `ray` gives each.
    pub fn rays(&self, pixels: &[[u32; 2]], offset: [f64; 2], rays: &mut [Ray]) {
        assert_eq!(pixels.len(), rays.len());
        let mut points = Points::new(0);
        let mut some = [Ray::new([0.0; 3], [0.0; 3]); PACKET];
        for (pixels, rays) in pixels.chunks(PACKET).zip(rays.chunks_mut(PACKET)) {
            points.pixels[..pixels.len()].copy_from_slice(pixels);
            self.shoot(offset, &mut points);
            points.rays(&mut some);
            rays.copy_from_slice(&some[..rays.len()]);
        }
    }

    /// Give points the rays through their pixels.
    pub(super) fn shoot(&self, offset: [f64; 2], points: &mut Points) {
        let size = [self.width, self.height].map(f64::from);
        if let Some(lens) = &self.lens {
            return dispatch_common(Through { lens, size, offset, points });
        }
        for i in 0..PACKET {
            let ray = self.unprojected(place(points.pixels[i], size, offset));
            put(&mut points.origin, i, &ray.origin);
            put(&mut points.view, i, &ray.direction);
            points.t_max[i] = ray.t_max;
        }
    }

    /// The ray through a place in the picture, by both of its ends.
    fn unprojected(&self, [x, y]: [f64; 2]) -> Ray {
        let unproject = |z: f64| self.clip_to_world.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3]);
        let near = unproject(-1.0);
        let far = unproject(1.0);
        let origin: Vector = std::array::from_fn(|i| near[i] / near[3]);
        if far[3] == 0.0 {
            // The far plane is at infinity: what is left of the point is its direction.
            let direction = [far[0], far[1], far[2]].map(|component| component * near[3].signum());
            return Ray { direction: normalise(&direction), ..Ray::new(origin, direction) };
        }
        let end: Vector = std::array::from_fn(|i| far[i] / far[3]);
        let along = subtract(&end, &origin);
        let direction = normalise(&along);
        Ray { origin, direction, t_min: 0.0, t_max: dot(&along, &direction) }
    }

    /// Distance along the viewing axis, from the camera, or for an orthographic one from its near plane.
    pub fn depth(&self, point: &Vector) -> f64 {
        let [a, b, c, d] = self.depth;
        a * point[0] + b * point[1] + c * point[2] + d
    }
}

/// By Gauss and Jordan with row pivots; none where the matrix is singular or not finite.
fn inverse(matrix: &Matrix) -> Option<Matrix> {
    let mut left = *matrix;
    let mut right: Matrix = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    for column in 0..4 {
        let pivot = (column..4).max_by(|&a, &b| left[a][column].abs().total_cmp(&left[b][column].abs()))?;
        left.swap(column, pivot);
        right.swap(column, pivot);
        let divisor = left[column][column];
        if divisor == 0.0 {
            return None;
        }
        left[column] = left[column].map(|x| x / divisor);
        right[column] = right[column].map(|x| x / divisor);
        for row in (0..4).filter(|&row| row != column) {
            let factor = left[row][column];
            for k in 0..4 {
                left[row][k] -= factor * left[column][k];
                right[row][k] -= factor * right[column][k];
            }
        }
    }
    right.iter().flatten().all(|x| x.is_finite()).then_some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks along -z from the origin, 90° wide, clip planes at 1 and 3.
    fn perspective() -> Camera {
        let (near, far) = (1.0, 3.0);
        let projection = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, -(far + near) / (far - near), -2.0 * far * near / (far - near)],
            [0.0, 0.0, -1.0, 0.0],
        ];
        Camera::new(inverse(&projection).unwrap(), 2, 2).unwrap()
    }

    #[test]
    fn perspective_rays_start_on_the_near_plane_and_end_on_the_far_one() {
        let ray = perspective().ray(1, 0, [0.5; 2]);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(ray.origin[0], 0.5) && near(ray.origin[1], -0.5) && near(ray.origin[2], -1.0), "{ray:?}");
        let end: Vector = std::array::from_fn(|i| ray.origin[i] + ray.t_max * ray.direction[i]);
        assert!(near(end[0], 1.5) && near(end[1], -1.5) && near(end[2], -3.0), "{ray:?}");
        assert!(near(dot(&ray.direction, &ray.direction), 1.0));
        assert!(near(perspective().depth(&[0.3, -0.2, -2.5]), 2.5));
    }

    /// Many at once are those of both clip planes, to rounding, with a far plane and without.
    #[test]
    fn rays_go_from_one_clip_plane_to_the_other() {
        let finite = [[0.7, 0.1, 0.0, 0.3], [0.0, 0.5, 0.2, -2.0], [0.1, 0.0, 0.6, 5.0], [0.0, 0.0, -0.3, 0.4]];
        let mut endless = finite;
        endless[3] = [0.0, 0.0, -0.4, 0.4];
        for matrix in [finite, endless] {
            let camera = Camera::new(matrix, 9, 7).unwrap();
            let pixels: [_; 2 * PACKET - 1] = std::array::from_fn(|i| [i as u32 % 9, i as u32 / 9]);
            let mut rays = [Ray::new([0.0; 3], [0.0; 3]); 2 * PACKET - 1];
            camera.rays(&pixels, [0.25, 0.75], &mut rays);
            for ([x, y], ray) in pixels.into_iter().zip(rays) {
                assert_eq!(camera.ray(x, y, [0.25, 0.75]), ray);
                let expected = camera.unprojected(place([x, y], [9.0, 7.0], [0.25, 0.75]));
                let near = |a: f64, b: f64| a == b || (a - b).abs() < 1e-12 * a.abs().max(1.0);
                assert!(near(ray.t_max, expected.t_max), "{ray:?} {expected:?}");
                for axis in 0..3 {
                    assert!(near(ray.origin[axis], expected.origin[axis]), "{ray:?} {expected:?}");
                    assert!(near(ray.direction[axis], expected.direction[axis]), "{ray:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn an_orthographic_depth_counts_from_the_near_plane() {
        // 4 units wide, clip planes at 1 and 5.
        let projection = [[0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, -0.5, -1.5], [0.0, 0.0, 0.0, 1.0]];
        let camera = Camera::new(inverse(&projection).unwrap(), 4, 4).unwrap();
        assert_eq!(camera.depth(&[1.0, 2.0, -3.0]), 2.0);
        let ray = camera.ray(0, 3, [0.5; 2]);
        assert_eq!((ray.origin, ray.direction, ray.t_max), ([-1.5, 1.5, -1.0], [0.0, 0.0, -1.0], 4.0));
    }

    #[test]
    fn singular_matrices_are_refused() {
        assert_eq!(Camera::new([[0.0; 4]; 4], 1, 1), Err(SingularMatrix));
        assert_eq!(Camera::new([[f64::NAN; 4]; 4], 1, 1), Err(SingularMatrix));
    }
}
