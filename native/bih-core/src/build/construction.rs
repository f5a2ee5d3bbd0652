//! One construction: what is sorted by the heuristic chosen, and the frame that it is sorted in.

use std::sync::Mutex;

use super::accepted::Accepted;
use super::extent::Extent;
use super::frame::{Emission, Frame, Split};
use super::global::{Coding, Global, Grids};
use super::keys::{Keys, row_bits};
use super::leaves::Places;
use super::local::Local;
use super::options::{Build, BuildOptions, Heuristic};
use super::pieces::Pieces;
use super::presort;
use super::reference::{self, Reference};
use super::sah::Sah;
use super::structure::Structure;
use crate::control::{Cancelled, Control};
use crate::pages;

/// What it is made of, and what is found out on the way.
pub struct Construction<'a> {
    pub accepted: Accepted<'a>,
    pub extent: &'a Extent,
    pub options: &'a BuildOptions,
    pub control: &'a Control,
    /// Whether the bucket sort came first.
    pub presorted: bool,
    pub left_out: Vec<(&'static str, String)>,
    /// The pieces that are left to the rays.
    pub pieces: Option<Pieces>,
    /// The most memory held at once, beside references and rows.
    pub peak_bytes: usize,
}

impl Construction<'_> {
    /// How many numbers the rows of the leaves take.
    pub fn numbers(&self) -> usize {
        self.options.numbers(self.accepted.triangles, self.accepted.len())
    }

    /// Whether pieces are left to the rays.
    pub fn is_on_demand(&self) -> bool {
        self.options.build == Build::OnDemand && self.accepted.len() > self.options.largest_piece()
    }

    /// Build and fill the places; on demand without them.
    pub fn run<E: Emission>(&mut self, emission: E, places: Places) -> Result<E::Output, Cancelled> {
        if self.accepted.len() == 0 {
            return Ok(E::Output::default());
        }
        match self.options.heuristic {
            Heuristic::Global => self.by_keys(emission, places),
            Heuristic::Local => self.by_references(Local, emission, places),
            Heuristic::Sah if self.options.structure == Structure::Bvh => {
                self.by_references(Sah::THOROUGH, emission, places)
            }
            Heuristic::Sah => self.by_references(Sah::QUICK, emission, places),
        }
    }

    fn by_keys<E: Emission>(&mut self, emission: E, places: Places) -> Result<E::Output, Cancelled> {
        let Accepted { triangles, .. } = self.accepted;
        let keys = Keys::new(self.accepted, self.extent);
        self.presorted = self.options.presort.unwrap_or(keys.accepted.len() > presort::WORTHWHILE);
        let (items, sorted) = if self.presorted {
            // The rows of the leaves are not written yet: there is room.
            let (_, room, _) = bytemuck::pod_align_to_mut::<f32, u64>(places.rows);
            let mut apart = Vec::new();
            let scratch = if room.is_empty() {
                apart = pages::zeroed(keys.accepted.len());
                &mut apart
            } else {
                &mut room[..keys.accepted.len()]
            };
            let items = presort::bucket_sort(&keys, scratch, self.control)?;
            self.peak_bytes = size_of_val(&items[..]) + size_of_val(&apart[..]);
            (items, presort::SORTED)
        } else {
            let reason = match self.options.presort {
                None => format!("{} triangles or fewer", presort::WORTHWHILE),
                Some(_) => "not wanted".to_owned(),
            };
            self.left_out.push(("presort", reason));
            (keys.in_order(self.control)?, 0)
        };
        let state = Coding::new(keys.grid.axes, sorted);
        let grids = self.is_on_demand().then(|| Grids { scene: keys.grid, others: Mutex::default() });
        let split = Global { triangles, row_bits: row_bits(triangles.len()), grids };
        self.construct(split, state, items, emission, places)
    }

    fn by_references<S: Split<Item = Reference, State = ()>, E: Emission>(
        &mut self,
        split: S,
        emission: E,
        places: Places,
    ) -> Result<E::Output, Cancelled> {
        self.left_out.push(("presort", "it sorts by the cells of the global heuristic".to_owned()));
        let count = self.accepted.len();
        let mut items = Vec::new();
        if places.rows.is_empty() {
            items = pages::zeroed(count);
            reference::collect(&self.accepted, &mut items, self.control)?;
        } else {
            reference::collect(&self.accepted, S::in_rows(&mut places.rows[..9 * count]), self.control)?;
        }
        self.construct(split, (), items, emission, places)
    }

    fn construct<S: Split, E: Emission>(
        &mut self,
        split: S,
        state: S::State,
        items: Vec<S::Item>,
        emission: E,
        places: Places,
    ) -> Result<E::Output, Cancelled> {
        let Accepted { triangles, .. } = self.accepted;
        let leaf_size = self.options.largest_leaf();
        let longest = self.options.largest_piece();
        let frame = Frame { split, emission, triangles, leaf_size, longest, control: self.control };
        let built = if self.is_on_demand() {
            let (built, pieces) = frame.lay_out(items, state)?;
            self.pieces = Some(pieces);
            built
        } else {
            frame.construct(items, state, places)?
        };
        self.peak_bytes = self.peak_bytes.max(built.peak_bytes);
        if built.skipped > 0 {
            let reason = format!("{} halvings had all objects on one side", built.skipped);
            self.left_out.push(("nodes of empty halves", reason));
        }
        Ok(built.output)
    }
}
