//! Rays side by side, as packets are given.

use crate::rays::Ray;

/// One number for each ray of a packet.
pub type Lanes<T, const N: usize> = [T; N];

#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Packet<const N: usize> {
    pub origin: [Lanes<f32, N>; 3],
    pub t_min: Lanes<f32, N>,
    pub direction: [Lanes<f32, N>; 3],
    pub t_max: Lanes<f32, N>,
    /// -1 for a ray, 0 for none.
    pub valid: Lanes<i32, N>,
}

impl<const N: usize> Packet<N> {
    /// The last one may hold fewer.
    pub fn all(rays: &[Ray]) -> Vec<Self> {
        rays.chunks(N).map(Self::new).collect()
    }

    /// At most N rays; the rest are not valid.
    pub fn new(rays: &[Ray]) -> Self {
        let ray = |lane: usize| rays[lane.min(rays.len() - 1)];
        Self {
            origin: std::array::from_fn(|axis| std::array::from_fn(|lane| ray(lane).origin[axis])),
            t_min: std::array::from_fn(|lane| ray(lane).t_min),
            direction: std::array::from_fn(|axis| std::array::from_fn(|lane| ray(lane).direction[axis])),
            t_max: std::array::from_fn(|lane| ray(lane).t_max),
            valid: std::array::from_fn(|lane| if lane < rays.len() { -1 } else { 0 }),
        }
    }
}
