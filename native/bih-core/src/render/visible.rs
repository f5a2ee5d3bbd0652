//! Rays among objects that some rays pass through.

use super::appearance::{Appearance, Object};
use super::traced::{Seen, Traced};
use crate::geometry::Ray;

/// What is traced, and whom it shows what.
#[derive(Debug)]
pub(super) struct Visible<'a, T> {
    pub traced: &'a T,
    pub appearance: &'a Appearance<'a>,
    hides_some: bool,
    lets_light_through: bool,
}

impl<'a, T: Traced> Visible<'a, T> {
    pub fn new(traced: &'a T, appearance: &'a Appearance<'a>) -> Self {
        let any = |is: fn(&Object) -> bool| appearance.objects.iter().any(is);
        let (hides_some, lets_light_through) = (any(|object| object.is_hidden), any(|object| object.casts_no_shadow));
        Self { traced, appearance, hides_some, lets_light_through }
    }

    /// The nearest hit of each camera ray.
    pub fn closest(&self, rays: &[Ray], stack: &mut T::Stack, seen: &mut [Option<Seen>]) {
        self.traced.closest(rays, stack, seen);
        if self.hides_some {
            for (ray, seen) in rays.iter().zip(seen) {
                if seen.is_some_and(|seen| self.appearance.object(&seen).is_hidden) {
                    *seen = self.first(ray, stack, |object| !object.is_hidden);
                }
            }
        }
    }

    /// Whether something that casts shadows stands in the way of each ray.
    pub fn occluded(&self, rays: &[Ray], stack: &mut T::Stack, hidden: &mut [bool]) {
        self.traced.occluded(rays, stack, hidden);
        if self.lets_light_through {
            for (ray, is_hidden) in rays.iter().zip(hidden) {
                *is_hidden = *is_hidden && self.first(ray, stack, |object| !object.casts_no_shadow).is_some();
            }
        }
    }

    /// The nearest hit of an object that is `wanted`; another one may be just as near, so all are looked at.
    fn first(&self, ray: &Ray, stack: &mut T::Stack, wanted: impl Fn(&Object) -> bool) -> Option<Seen> {
        let mut all = Vec::new();
        self.traced.all(ray, stack, &mut all);
        all.into_iter().find(|seen| wanted(&self.appearance.object(seen)))
    }
}
