//! Points as single integers, for the region's inner loops.

use crate::plane::Point;

/// A point's four coordinates in one integer, so that adding and comparing points is adding and comparing integers. Two
/// points of one region never share one: their coordinates differ by at most the number of edges.
pub(crate) fn pack(Point([a, b, c, d]): Point) -> i64 {
    i64::from(a) + (i64::from(b) << 16) + (i64::from(c) << 32) + (i64::from(d) << 48)
}

pub(crate) fn unpack(mut packed: i64) -> Point {
    Point(std::array::from_fn(|_| {
        let low = packed as i16;
        packed = (packed - i64::from(low)) >> 16;
        i32::from(low)
    }))
}

/// How many corners lie at positions of the same hash: nearly always tells that a corner is alone at its place.
#[derive(Debug, Default)]
pub(crate) struct Crowd {
    counts: Vec<u16>,
    shift: u32,
}

impl Crowd {
    /// Empty, for about this many corners.
    pub(crate) fn clear(&mut self, corners: usize) {
        let bits = (16 * corners).next_power_of_two().trailing_zeros().clamp(6, 20);
        self.shift = 64 - bits;
        self.counts.clear();
        self.counts.resize(1 << bits, 0);
    }

    pub(crate) fn at(&mut self, position: i64) -> &mut u16 {
        &mut self.counts[((position as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> self.shift) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packing_loses_nothing_and_adds(a in prop::array::uniform4(-8000..8000), b in prop::array::uniform4(-8000..8000)) {
            let (a, b) = (Point(a), Point(b));
            prop_assert_eq!(unpack(pack(a)), a);
            prop_assert_eq!(unpack(pack(a) + pack(b)), a + b);
        }
    }
}
