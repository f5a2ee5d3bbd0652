//! What a tree is and what it cost.

/// Times in seconds, sizes in bytes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stats {
    /// Rows of the mesh.
    pub triangles: usize,
    /// Inner nodes and leaves.
    pub nodes: usize,
    /// Leaves alone.
    pub leaves: usize,
    /// Triangles of all leaves; a kd-tree counts one as often as it refers to it.
    pub references: usize,
    /// Nodes that are not yet subdivided: pieces that no ray has come to.
    pub unbuilt: usize,
    /// Depth of the deepest node; the root has 0.
    pub depth: usize,
    /// Nodes and references.
    pub tree_bytes: usize,
    /// What `tree_bytes` was known before the build never to exceed; 0 for a kd-tree, which duplicates references.
    pub bound_bytes: usize,
    /// Memory at the peak of the build, the tree included and the caller's mesh not.
    pub peak_build_bytes: usize,
    /// Wall-clock time of the build; on demand so far, of all threads together.
    pub build_seconds: f64,
    /// Whether the bucket sort came first.
    pub presorted: bool,
    /// Triangles that no ray can hit: non-finite coordinates or zero area.
    pub rejected: usize,
    /// Parts of the construction that this mesh did not need, and why.
    pub left_out: Vec<(String, String)>,
}
