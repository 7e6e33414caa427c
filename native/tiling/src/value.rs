//! What states are worth: how many tilings they have, the least cost of one, or whether there is one.

use crate::graph::Value;
use num_bigint::BigUint;

/// A number of tilings that can index them.
pub(crate) trait Number: Value + Ord {
    /// `None` when it does not fit.
    fn from_big(number: &BigUint) -> Option<Self>;
    fn to_big(&self) -> BigUint;
    /// Takes `other` away; `self` must not be less.
    fn subtract(&mut self, other: &Self);
    /// Quotient and remainder.
    fn divide(&self, by: &Self) -> (Self, Self);
}

impl Value for u128 {
    fn none() -> Self {
        0
    }
    fn placed(_: i64) -> Self {
        1
    }
    fn is_none(&self) -> bool {
        *self == 0
    }
    fn and(&mut self, part: &Self, _: usize) -> bool {
        self.checked_mul(*part).map(|product| *self = product).is_some()
    }
    fn or(&mut self, other: &Self) -> bool {
        self.checked_add(*other).map(|sum| *self = sum).is_some()
    }
}

impl Number for u128 {
    fn from_big(number: &BigUint) -> Option<Self> {
        number.try_into().ok()
    }
    fn to_big(&self) -> BigUint {
        BigUint::from(*self)
    }
    fn subtract(&mut self, other: &Self) {
        *self -= other;
    }
    fn divide(&self, by: &Self) -> (Self, Self) {
        (self / by, self % by)
    }
}

impl Value for BigUint {
    fn none() -> Self {
        Self::ZERO
    }
    fn placed(_: i64) -> Self {
        Self::from(1u32)
    }
    fn is_none(&self) -> bool {
        *self == Self::ZERO
    }
    fn and(&mut self, part: &Self, _: usize) -> bool {
        *self *= part;
        true
    }
    fn or(&mut self, other: &Self) -> bool {
        *self += other;
        true
    }
}

impl Number for BigUint {
    fn from_big(number: &BigUint) -> Option<Self> {
        Some(number.clone())
    }
    fn to_big(&self) -> BigUint {
        self.clone()
    }
    fn subtract(&mut self, other: &Self) {
        *self -= other;
    }
    fn divide(&self, by: &Self) -> (Self, Self) {
        (self / by, self % by)
    }
}

/// The least cost of a tiling; `None` when there is no tiling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cost(pub(crate) Option<i64>);

impl Value for Cost {
    fn none() -> Self {
        Self(None)
    }
    fn placed(cost: i64) -> Self {
        Self(Some(cost))
    }
    fn is_none(&self) -> bool {
        self.0.is_none()
    }
    fn and(&mut self, part: &Self, copies: usize) -> bool {
        let (Some(sum), Some(cost)) = (self.0, part.0) else {
            self.0 = None;
            return true;
        };
        let total = cost.checked_mul(copies as i64).and_then(|cost| sum.checked_add(cost));
        self.0 = total;
        total.is_some()
    }
    fn or(&mut self, other: &Self) -> bool {
        self.0 = match (self.0, other.0) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        true
    }
}

/// Whether there is a tiling.
impl Value for bool {
    fn none() -> Self {
        false
    }
    fn placed(_: i64) -> Self {
        true
    }
    fn is_none(&self) -> bool {
        !self
    }
    fn and(&mut self, part: &Self, _: usize) -> bool {
        *self &= part;
        true
    }
    fn or(&mut self, other: &Self) -> bool {
        *self |= other;
        true
    }
    fn is_final(&self) -> bool {
        *self
    }
}
