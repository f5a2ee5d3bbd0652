//! Queries of the kd-tree and of the classic tree, alone and in packets, and how they agree with the naive ones.

use std::array::from_fn;
use std::cmp::Ordering;
use std::ops::ControlFlow;

use bih_core::intersect::{Distance, RayTest, weights};
use bih_core::kd_tree::{LANES, Packet, Stack, walk, walk_packet};
use bih_core::traverse::{Uncounted, naive_closest, naive_occluded};
use bih_core::tree::BinaryTree;
use bih_core::{Hit, Ray, Tree, Triangles};

/// The nearest of the triangles offered, as any leaf would find it.
pub struct Nearest<'a> {
    triangles: &'a Triangles<'a>,
    ray: Ray,
    test: RayTest,
    best: Option<(u32, Distance)>,
}

impl<'a> Nearest<'a> {
    pub fn new(tree: &impl BinaryTree, triangles: &'a Triangles, ray: &Ray) -> Self {
        Self { triangles, ray: *ray, test: RayTest::new(ray, tree.bounds()), best: None }
    }

    pub fn within(&self, row: u32) -> Option<Distance> {
        let corners = self.triangles.corners(row);
        if !self.test.is_inside(&corners) {
            return None;
        }
        let distance = Distance::new(&self.test, &corners);
        let within = distance.compare_with(self.ray.t_min, &self.test, &corners) != Ordering::Less
            && distance.compare_with(self.ray.t_max, &self.test, &corners) != Ordering::Greater;
        within.then_some(distance)
    }

    pub fn offer(&mut self, rows: &[u32]) {
        for &row in rows {
            let Some(distance) = self.within(row) else { continue };
            let order = self.best.map_or(Ordering::Less, |(best, best_distance)| {
                let [corners, best_corners] = [row, best].map(|row| self.triangles.corners(row));
                distance.compare(&corners, &best_distance, &best_corners, &self.test).then(row.cmp(&best))
            });
            if order == Ordering::Less {
                self.best = Some((row, distance));
            }
        }
    }

    pub fn limit(&self) -> f64 {
        self.best.map_or(self.ray.t_max, |(_, distance)| distance.upper())
    }

    pub fn hit(&self) -> Option<Hit> {
        self.best.map(|(row, distance)| {
            let corners = self.triangles.corners(row);
            let [u, v] = weights(&self.test, &corners);
            Hit { t: distance.refined(&self.test, &corners).t, triangle: row, u, v }
        })
    }
}

pub fn closest(tree: &impl BinaryTree, triangles: &Triangles, ray: &Ray) -> Option<Hit> {
    let mut nearest = Nearest::new(tree, triangles, ray);
    walk(tree, ray, &mut Stack::default(), &mut Uncounted, |rows| {
        nearest.offer(rows);
        ControlFlow::Continue(nearest.limit())
    });
    nearest.hit()
}

pub fn occluded(tree: &impl BinaryTree, triangles: &Triangles, ray: &Ray) -> bool {
    let nearest = Nearest::new(tree, triangles, ray);
    let mut found = false;
    walk(tree, ray, &mut Stack::default(), &mut Uncounted, |rows| {
        found = rows.iter().any(|&row| nearest.within(row).is_some());
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(ray.t_max) }
    });
    found
}

pub fn closest_of_packet(
    tree: &impl BinaryTree,
    triangles: &Triangles,
    packet: &Packet,
    rays: &[Ray; LANES],
) -> [Option<Hit>; LANES] {
    let mut nearest: [Nearest; LANES] = from_fn(|lane| Nearest::new(tree, triangles, &rays[lane]));
    walk_packet(tree, packet, &mut Stack::default(), &mut Uncounted, |rows, active| {
        (0..LANES).filter(|&lane| active[lane]).for_each(|lane| nearest[lane].offer(rows));
        from_fn(|lane| nearest[lane].limit())
    });
    nearest.map(|nearest| nearest.hit())
}

pub fn occluded_of_packet(
    tree: &impl BinaryTree,
    triangles: &Triangles,
    packet: &Packet,
    rays: &[Ray; LANES],
) -> [bool; LANES] {
    let mut found = [false; LANES];
    walk_packet(tree, packet, &mut Stack::default(), &mut Uncounted, |rows, active| {
        for lane in (0..LANES).filter(|&lane| active[lane]) {
            let nearest = Nearest::new(tree, triangles, &rays[lane]);
            found[lane] |= rows.iter().any(|&row| nearest.within(row).is_some());
        }
        from_fn(|lane| if found[lane] { f64::NEG_INFINITY } else { rays[lane].t_max })
    });
    found
}

/// Packets of rays with the signs of the first, the last ones incomplete.
pub fn packets(rays: &[Ray]) -> Vec<([Ray; LANES], [bool; LANES])> {
    let alike = |ray: &Ray, first: &Ray| {
        let direction = from_fn(|i| ray.direction[i].copysign(first.direction[i]));
        Ray { direction, ..*ray }
    };
    let chunk = |rays: &[Ray]| {
        let lane = |lane| rays.get(lane).map_or(rays[0], |ray| alike(ray, &rays[0]));
        (from_fn(lane), from_fn(|lane| lane < rays.len() && rays[lane].is_valid()))
    };
    rays.chunks(LANES).map(chunk).collect()
}

pub fn agree_on(tree: &impl BinaryTree, naive: &Tree, triangles: &Triangles, rays: &[Ray]) {
    for ray in rays.iter().filter(|ray| ray.is_valid()) {
        let found = closest(tree, triangles, ray);
        assert_eq!(found, naive_closest(naive, triangles, ray), "{ray:?}");
        assert_eq!(occluded(tree, triangles, ray), naive_occluded(naive, triangles, ray), "{ray:?}");
    }
    for (rays, active) in packets(rays) {
        let Some(packet) = Packet::new(&rays, active) else {
            assert_eq!(active, [false; LANES]);
            continue;
        };
        let found = closest_of_packet(tree, triangles, &packet, &rays);
        let hidden = occluded_of_packet(tree, triangles, &packet, &rays);
        for lane in 0..LANES {
            let truth = active[lane].then(|| naive_closest(naive, triangles, &rays[lane])).flatten();
            assert_eq!(found[lane], truth, "{:?}", rays[lane]);
            assert_eq!(hidden[lane], truth.is_some(), "{:?}", rays[lane]);
        }
    }
}
