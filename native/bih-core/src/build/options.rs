//! What a person can choose about the construction, and what is known of a tree before it is built.

use super::frame::{PIECE, most_pieces};
use super::on_demand::OnDemand;
use super::structure::Structure;
use crate::geometry::Triangles;
use crate::tree::{CompactRecord, Node, Record, WIDTH, Wide};

/// What a person can choose about the construction.
#[derive(Debug, Clone, Copy, Default)]
pub struct BuildOptions {
    /// What is built.
    pub structure: Structure,
    /// What the tree is traced as.
    pub layout: Layout,
    /// Whether all is built at once.
    pub build: Build,
    /// Ranges of at most this many triangles are finished at once; none: `PIECE`. Hits do not depend on it.
    pub piece: Option<usize>,
    /// Where ranges are split.
    pub heuristic: Heuristic,
    /// Whether the bucket sort comes before the global heuristic; none: where it pays. The tree is the same.
    pub presort: Option<bool>,
    /// How rays are tested against triangles.
    pub precision: Precision,
    /// Ranges of at most this many triangles become leaves, of wide records `WIDTH` at most; none: the layout's default.
    pub leaf_size: Option<usize>,
}

/// When the tree is built.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Build {
    /// At once.
    #[default]
    Eager,
    /// The upper nodes at once, the pieces below them when a ray comes to one.
    OnDemand,
}

/// Where a range of triangles is split.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// In the middle of the longest side of a cell that is halved from the scene's bounds, as in the paper.
    #[default]
    Global,
    /// In the middle of the longest side of the centres' own bounds.
    Local,
    /// Where the expected cost is least.
    Sah,
}

/// What is traced. The construction is the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Layout {
    /// The 12-byte nodes of the paper.
    #[default]
    Classic,
    /// Records of eight boxes, several levels of the tree in one.
    Wide,
    /// The same with quantised boxes, and the vertices in the caller's arrays only.
    Compact,
}

/// How a ray is tested against a triangle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Precision {
    /// In single precision: for previews.
    Fast,
    /// No ray passes between two triangles that share an edge or a vertex.
    #[default]
    Watertight,
    /// The same decisions, and distances and weights as near to the truth as doubles come.
    Exact,
}

/// Measured in docs/decisions/leaf-size.md.
pub const DEFAULT_LEAF_SIZE: usize = 4;

/// The same for wide records: docs/decisions/wide-records.md.
pub const DEFAULT_WIDE_LEAF_SIZE: usize = 8;

impl Heuristic {
    /// The name that a person knows it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Global => "global",
            Self::Local => "local",
            Self::Sah => "sah",
        }
    }
}

impl Precision {
    /// The name that a person knows it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Watertight => "watertight",
            Self::Exact => "exact",
        }
    }
}

impl Build {
    /// The name that a person knows it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Eager => "eager",
            Self::OnDemand => "on_demand",
        }
    }
}

impl Layout {
    /// The name that a person knows it by.
    pub fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::Wide => "wide",
            Self::Compact => "compact",
        }
    }

    /// The most triangles that its records can refer to.
    pub(super) fn limit(self) -> usize {
        match self {
            Self::Classic => Triangles::LIMIT,
            Self::Wide | Self::Compact => Wide::LIMIT,
        }
    }
}

impl BuildOptions {
    /// The most triangles of a leaf.
    pub(super) fn largest_leaf(&self) -> usize {
        match self.layout {
            Layout::Classic => self.leaf_size.unwrap_or(DEFAULT_LEAF_SIZE).max(1),
            Layout::Wide | Layout::Compact => self.leaf_size.unwrap_or(DEFAULT_WIDE_LEAF_SIZE).clamp(1, WIDTH),
        }
    }

    /// The most triangles of a piece.
    pub(super) fn largest_piece(&self) -> usize {
        self.piece.unwrap_or(PIECE).max(self.largest_leaf())
    }

    /// Whether leaves hold the vertices of their triangles.
    pub(super) fn has_rows(&self, triangles: &Triangles) -> bool {
        self.layout == Layout::Wide && (!triangles.is_double() || self.precision == Precision::Fast)
    }

    /// How many numbers the rows of the leaves take, over so many references.
    pub(crate) fn numbers(&self, triangles: &Triangles, references: usize) -> usize {
        if self.has_rows(triangles) && references > 0 { 9 * references + WIDTH } else { 0 }
    }

    /// Bytes that a tree over `triangles` never exceeds: one leaf a triangle, and one reference each.
    ///
    /// Known before the build, because an object is referred to once (Wächter and Keller 2006, section 3).
    pub fn bound_bytes(&self, triangles: &Triangles) -> usize {
        let count = triangles.len();
        let pieces = most_pieces(count, self.largest_piece());
        let built = self.bound_of_built(triangles, pieces);
        match self.build {
            Build::Eager => built,
            Build::OnDemand => built + OnDemand::bound_bytes(self, triangles, pieces),
        }
    }

    /// Bytes that the construction asks for before it begins: more than it held at once over any mesh that it was tried
    /// with, so that it does not run out in the middle, and less than double.
    pub(super) fn working_bytes(&self, triangles: &Triangles) -> usize {
        let count = triangles.len();
        let item = match self.heuristic {
            Heuristic::Global => size_of::<u64>(),
            _ if self.has_rows(triangles) => 0,
            _ => 9 * size_of::<f32>(),
        };
        if self.build == Build::OnDemand {
            return self.bound_bytes(triangles) + count * item;
        }
        // Leaves are half full, and records have four of them. Pieces are there beside what they are put together to.
        let leaves = (2 * count / self.largest_leaf()).min(count) + 1;
        let nodes = match self.layout {
            Layout::Classic => 2 * Node::BYTES * 2 * leaves,
            Layout::Wide => 2 * Record::BYTES * (leaves / 4 + 1),
            Layout::Compact => (2 * Record::BYTES + CompactRecord::BYTES) * (leaves / 4 + 1),
        };
        let apart = if self.has_rows(triangles) { 0 } else { size_of::<u64>() };
        nodes + count * (size_of::<u32>() + item + apart) + size_of::<f32>() * self.numbers(triangles, count)
    }

    fn bound_of_built(&self, triangles: &Triangles, pieces: usize) -> usize {
        let count = triangles.len();
        let references = size_of::<u32>() * count;
        match self.layout {
            Layout::Classic => Node::BYTES * (2 * count).saturating_sub(1) + references,
            Layout::Wide | Layout::Compact if count == 0 => 0,
            Layout::Compact => CompactRecord::BYTES * most_records(count, pieces) + references,
            Layout::Wide => {
                let numbers = if self.has_rows(triangles) { 9 * count + WIDTH } else { 0 };
                Record::BYTES * most_records(count, pieces) + size_of::<f32>() * numbers + references
            }
        }
    }
}

/// The most records over so many triangles, in so many pieces.
///
/// Take a piece with r records and l leaves, one a triangle at most. The lanes in use are its leaves and its records but
/// the first: l + r − 1. Its records are those of least cost, and each costs something; so a record and its parent have
/// ten lanes or more together, or one record in the place of both would cost less. Put each record of up to four lanes
/// with its parent, which then has w >= 6 lanes and at most w such children of 10 − w lanes or more. That makes
/// (w + k (10 − w)) / (1 + k) lanes a record, k <= w, and at least 8/3, the value for w = k = 8. Only the first record may
/// have fewer, but two. So l + r − 1 >= 8/3 (r − 1) + 2, or r <= (3 l − 1) / 5. The same holds of the top, whose leaves
/// are the pieces. A tree of one leaf has one record.
pub(super) fn most_records(triangles: usize, pieces: usize) -> usize {
    1 + 3 * (triangles + pieces) / 5
}
