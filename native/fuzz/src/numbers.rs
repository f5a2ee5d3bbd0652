//! Numbers out of bytes; zeros when these are used up.

/// What is left of the bytes.
pub struct Numbers<'a>(pub &'a [u8]);

impl Numbers<'_> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut bytes = [0; N];
        let count = N.min(self.0.len());
        let (mine, rest) = self.0.split_at(count);
        bytes[..count].copy_from_slice(mine);
        self.0 = rest;
        bytes
    }

    pub fn byte(&mut self) -> u8 {
        self.array::<1>()[0]
    }

    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    /// A number below `end`, which fits 16 bits; zero where there is none.
    pub fn below(&mut self, end: usize) -> usize {
        usize::from(u16::from_le_bytes(self.array())) % end.max(1)
    }

    /// A coordinate: of a small grid, so that much coincides; a special one; or any that float32 or float64 has.
    pub fn coordinate(&mut self) -> f64 {
        const SPECIAL: [f64; 14] = [
            -0.0,
            0.1,
            1e-45,
            -1e-40,
            1e-20,
            1e18,
            -1e30,
            f32::MAX as f64,
            f32::MIN as f64,
            f32::MIN_POSITIVE as f64,
            1e300,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        match self.byte() {
            grid @ ..192 => f64::from(grid % 24) / 2.0 - 4.0,
            special @ 192..224 => SPECIAL[usize::from(special) % SPECIAL.len()],
            224..248 => f64::from(f32::from_bits(self.word())),
            _ => f64::from_le_bytes(self.array()),
        }
    }

    pub fn point(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.coordinate())
    }
}
