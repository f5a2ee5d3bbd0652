//! What is known of a pixel, and pictures of it.

/// Everything that one pixel can show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pixel {
    /// Scene-linear red, green, blue and alpha, the colours multiplied by alpha; the mean of all samples.
    pub combined: [f32; 4],
    /// Distance along the viewing axis; infinite for a miss.
    pub depth: f32,
    /// Unit normal that faces the ray; zero for a miss, and where normals were not wanted.
    pub normal: [f32; 3],
    /// Where the surface is hit; zero for a miss.
    pub position: [f32; 3],
    /// Row of the triangle; -1 for a miss.
    pub triangle: i32,
    /// Nodes visited and triangles tested by the ray through the centre.
    pub cost: [f32; 2],
}

impl Pixel {
    /// A pixel in which nothing was hit.
    pub const MISS: Self = Self {
        combined: [0.0; 4],
        depth: f32::INFINITY,
        normal: [0.0; 3],
        position: [0.0; 3],
        triangle: -1,
        cost: [0.0; 2],
    };
}

/// The pixels of a picture or of a tile of it, row by row from the lower left.
#[derive(Debug, Clone, PartialEq)]
pub struct Passes {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// All of them.
    pub pixels: Vec<Pixel>,
}
