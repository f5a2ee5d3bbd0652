//! Counting the work of a ray, or not.

/// Told of each step of a traversal; `Uncounted` compiles to nothing.
pub trait Counter {
    /// Whether the order of steps must be the same each time.
    const COUNTS: bool;
    /// A node, inner or leaf, is visited.
    fn visit_node(&mut self);
    /// Triangles are tested.
    fn test_triangles(&mut self, count: usize);
}

/// Counts nothing.
#[derive(Debug, Default, Clone, Copy)]
pub struct Uncounted;

impl Counter for Uncounted {
    const COUNTS: bool = false;
    #[inline(always)]
    fn visit_node(&mut self) {}
    #[inline(always)]
    fn test_triangles(&mut self, _: usize) {}
}

/// Nodes visited and triangles tested.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Nodes visited, leaves included.
    pub nodes: u32,
    /// Triangles tested.
    pub triangles: u32,
}

impl Counter for Counts {
    const COUNTS: bool = true;
    #[inline(always)]
    fn visit_node(&mut self) {
        self.nodes += 1;
    }
    #[inline(always)]
    fn test_triangles(&mut self, count: usize) {
        self.triangles += count as u32;
    }
}
