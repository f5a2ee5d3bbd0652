//! Places of samples in a pixel, on lights and in directions: the same on every machine.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::geometry::{Vector, add_scaled, cross, normalise};

/// The place of a sample within its pixel: the centre first, then an additive recurrence that fills the square evenly
/// (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences"; the plastic number). `seed` shifts all but
/// the first.
pub fn sample_offset(sample: u32, seed: u64) -> [f64; 2] {
    const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    if sample == 0 {
        return [0.5; 2];
    }
    let shift = if seed == 0 { [0.0; 2] } else { [unit(scramble(seed)), unit(scramble(seed ^ u64::MAX))] };
    std::array::from_fn(|i| (0.5 + f64::from(sample) * STEP[i] + shift[i]).fract())
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn scramble(x: u64) -> u64 {
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// The upper 53 bits as a number from 0 to 1.
fn unit(x: u64) -> f64 {
    (x >> 11) as f64 / (1u64 << 53) as f64
}

/// Numbers for one sample of one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sampler {
    pixel: u64,
    sample: u32,
}

impl Sampler {
    pub fn new(seed: u64, [x, y]: [u32; 2], sample: u32) -> Self {
        Self { pixel: scramble(scramble(seed ^ 0x9e37_79b9_7f4a_7c15) ^ (u64::from(y) << 32 | u64::from(x))), sample }
    }

    /// A place in the unit square: each dimension has points of its own, which over the samples fill it evenly.
    ///
    /// The first two dimensions of Sobol's sequence, shuffled and scrambled (Burley 2020, "Practical Hash-based Owen
    /// Scrambling", sections 3 and 4).
    pub fn square(&self, dimension: u32) -> [f64; 2] {
        let hash = scramble(self.pixel ^ u64::from(dimension).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let other = scramble(hash);
        let index = scrambled(self.sample, hash as u32);
        let x = scrambled(index.reverse_bits(), (hash >> 32) as u32);
        let y = scrambled(second_dimension(index), other as u32);
        [x, y].map(|bits| (f64::from(bits) + 0.5) / (1u64 << 32) as f64)
    }
}

/// Sobol's second dimension.
fn second_dimension(mut index: u32) -> u32 {
    let (mut direction, mut bits) = (1u32 << 31, 0);
    while index != 0 {
        if index & 1 == 1 {
            bits ^= direction;
        }
        index >>= 1;
        direction ^= direction >> 1;
    }
    bits
}

/// A nested uniform scramble of a binary fraction (Burley 2020, listing 3; the hash of Laine and Karras 2011).
fn scrambled(bits: u32, seed: u32) -> u32 {
    let mut x = bits.reverse_bits().wrapping_add(seed);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6u32] {
        x ^= x.wrapping_mul(factor);
    }
    x.reverse_bits()
}

/// A direction of the cone about `axis`, a unit vector, evenly by solid angle; `depth` is 1 less the cosine of the cone's
/// half angle.
pub(super) fn in_cone(axis: &Vector, depth: f64, [u, v]: [f64; 2]) -> Vector {
    let below = u * depth;
    around(axis, 1.0 - below, (below * (2.0 - below)).max(0.0).sqrt(), v)
}

/// A direction of the hemisphere about `axis`, a unit vector, as often as its cosine.
pub(super) fn by_cosine(axis: &Vector, [u, v]: [f64; 2]) -> Vector {
    around(axis, (1.0 - u).sqrt(), u.sqrt(), v)
}

/// A point of the unit disk, evenly.
pub(super) fn on_disk([u, v]: [f64; 2]) -> [f64; 2] {
    let (sine, cosine) = sine_cosine(v * TAU);
    [u.sqrt() * cosine, u.sqrt() * sine]
}

/// The direction with this cosine and sine to `axis`, by a share of a turn about it.
fn around(axis: &Vector, cosine: f64, sine: f64, turn: f64) -> Vector {
    // Across the shortest component.
    let mut shortest = [0.0; 3];
    let least = (0..3).min_by(|&a, &b| axis[a].abs().total_cmp(&axis[b].abs())).unwrap_or(0);
    shortest[least] = 1.0;
    let side = normalise(&cross(axis, &shortest));
    let other = cross(axis, &side);
    let (y, x) = sine_cosine(turn * TAU);
    let flat = add_scaled(&side.map(|s| s * x * sine), y * sine, &other);
    add_scaled(&flat, cosine, axis)
}

/// Both of an angle of at most some turns, to 1e-15: the system's own differ from one processor to the next.
pub(super) fn sine_cosine(angle: f64) -> (f64, f64) {
    let quarter = (angle / FRAC_PI_2).round();
    let x = angle - quarter * FRAC_PI_2;
    let square = x * x;
    // Taylor's series to x^17 and x^16, right on an eighth of a turn to either side.
    let series = |first: u32, terms: u32| {
        let last = first + 2 * terms;
        (1..=terms).fold(1.0, |sum, i| {
            let n = f64::from(last - 2 * (i - 1));
            1.0 - square / (n * (n - 1.0)) * sum
        })
    };
    let (sine, cosine) = (x * series(1, 8), series(0, 8));
    match quarter.rem_euclid(4.0) as u32 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::dot;

    #[test]
    fn samples_start_at_the_centre_and_stay_in_the_pixel() {
        assert_eq!(sample_offset(0, 7), [0.5; 2]);
        for sample in 1..1000 {
            assert!(sample_offset(sample, 42).iter().all(|x| (0.0..1.0).contains(x)));
        }
        assert_ne!(sample_offset(1, 1), sample_offset(1, 2));
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_system() {
        for i in -1000..=1000 {
            let angle = f64::from(i) * 0.01;
            let (sine, cosine) = sine_cosine(angle);
            assert!((sine - angle.sin()).abs() < 2e-15 && (cosine - angle.cos()).abs() < 2e-15, "{angle}");
        }
    }

    /// Sixteen samples of any pixel and dimension: one in each column, each row and each of 4 x 4 cells.
    #[test]
    fn samples_fill_the_square_evenly() {
        for (pixel, dimension) in [([0, 0], 0), ([3, 5], 1), ([70_000, 9], 12)] {
            for cells in [[16, 1], [1, 16], [4, 4], [8, 2]] {
                let mut counts = [0; 16];
                for sample in 0..16 {
                    let place = Sampler::new(7, pixel, sample).square(dimension);
                    assert!(place.iter().all(|x| (0.0..1.0).contains(x)));
                    let [column, row] = [0, 1].map(|i| (place[i] * f64::from(cells[i])) as usize);
                    counts[row * cells[0] as usize + column] += 1;
                }
                assert_eq!(counts, [1; 16], "{pixel:?} {dimension} {cells:?}");
            }
        }
    }

    #[test]
    fn pixels_and_dimensions_have_samples_of_their_own() {
        let first = Sampler::new(7, [1, 2], 3).square(0);
        for other in [Sampler::new(8, [1, 2], 3), Sampler::new(7, [2, 1], 3), Sampler::new(7, [1, 2], 4)] {
            assert_ne!(first, other.square(0));
        }
        assert_ne!(first, Sampler::new(7, [1, 2], 3).square(1));
    }

    #[test]
    fn directions_lie_in_their_cone() {
        let axis = normalise(&[1.0, -2.0, 0.5]);
        for sample in 0..256 {
            let square = Sampler::new(1, [0, 0], sample).square(0);
            for depth in [1e-12, 0.2, 1.0, 2.0] {
                let direction = in_cone(&axis, depth, square);
                assert!((dot(&direction, &direction) - 1.0).abs() < 1e-12);
                assert!(1.0 - dot(&direction, &axis) <= depth + 1e-12);
            }
        }
    }
}
