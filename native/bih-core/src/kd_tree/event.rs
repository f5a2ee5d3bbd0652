//! Where the bounds of triangles begin and end along an axis (Wald and Havran 2006).

use crate::geometry::Bounds;

/// What happens at a position; at the same one, ends come before flat triangles and these before starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Happening {
    /// Bounds end here.
    End = 0,
    /// Bounds without extent lie here.
    Planar = 1,
    /// Bounds start here.
    Start = 2,
}

/// Position, happening and number of a triangle in one number, whose order is theirs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Event(u64);

/// Triangles of a node are numbered below this.
const NUMBERS: u64 = 1 << 30;

impl Event {
    fn new(position: f32, happening: Happening, number: usize) -> Self {
        debug_assert!((number as u64) < NUMBERS);
        let bits = position.to_bits();
        // Negative numbers are ordered against their bits.
        let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
        Self(u64::from(ordered) << 32 | (happening as u64) << 30 | number as u64)
    }

    /// Append the events of one triangle.
    pub fn push(events: &mut Vec<Self>, bounds: &Bounds, axis: usize, number: usize) {
        let (lower, upper) = (bounds.lower[axis], bounds.upper[axis]);
        if lower == upper {
            events.push(Self::new(lower, Happening::Planar, number));
        } else {
            events.push(Self::new(lower, Happening::Start, number));
            events.push(Self::new(upper, Happening::End, number));
        }
    }

    /// Where.
    pub fn position(self) -> f32 {
        let ordered = self.key();
        f32::from_bits(if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered })
    }

    /// Equal for events at the same position, and only for those.
    #[inline(always)]
    pub fn key(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// What.
    #[inline(always)]
    pub fn happening(self) -> Happening {
        match self.0 >> 30 & 3 {
            0 => Happening::End,
            1 => Happening::Planar,
            _ => Happening::Start,
        }
    }

    /// Whose.
    #[inline(always)]
    pub fn number(self) -> usize {
        (self.0 & (NUMBERS - 1)) as usize
    }

    /// The same event of a triangle that has another number now.
    #[inline(always)]
    pub fn renumbered(self, number: u32) -> Self {
        Self(self.0 & !(NUMBERS - 1) | u64::from(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_by_position_then_happening_then_number() {
        let positions = [f32::NEG_INFINITY, -2.5, -1e-45, 0.0, 1e-45, 3.0, f32::INFINITY];
        let mut last: Option<Event> = None;
        for position in positions {
            for happening in [Happening::End, Happening::Planar, Happening::Start] {
                for number in [0, (1 << 30) - 1] {
                    let event = Event::new(position, happening, number);
                    assert_eq!((event.position(), event.happening(), event.number()), (position, happening, number));
                    assert_eq!(event.renumbered(7), Event::new(position, happening, 7));
                    assert!(last.is_none_or(|last| last < event));
                    last = Some(event);
                }
            }
        }
    }
}
