//! Random numbers, below a bound of any size too, that a seed repeats exactly on every machine.

use num_bigint::BigUint;

/// The `SplitMix64` generator (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014).
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Any 64 bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 or 1.
    pub(crate) fn bit(&mut self) -> u8 {
        (self.bits() >> 63) as u8
    }

    /// A number in 0 (included) to 1 (excluded).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number below `bound`, which must not be zero and is small.
    pub(crate) fn index(&mut self, bound: usize) -> usize {
        (self.unit() * bound as f64) as usize
    }

    /// A number below `bound`, which must not be zero; each is equally likely.
    pub(crate) fn below(&mut self, bound: &BigUint) -> BigUint {
        let width = bound.bits();
        loop {
            let words = (0..width.div_ceil(32)).map(|_| (self.bits() >> 32) as u32).collect();
            let number = BigUint::new(words) >> (width.div_ceil(32) * 32 - width);
            if number < *bound {
                return number;
            }
        }
    }
}
