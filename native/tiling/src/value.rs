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
    fn is_final(&self, floor: i64) -> bool {
        self.0.is_some_and(|cost| cost <= floor)
    }
    fn within(self, rhombi: u16) -> Self {
        Self(self.0.filter(|&cost| cost <= i64::from(rhombi)))
    }
}

/// Numbers of tilings by the number of their rhombi.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ByRhombi(pub(crate) Vec<BigUint>);

impl Value for ByRhombi {
    fn none() -> Self {
        Self(Vec::new())
    }
    fn placed(rhombi: i64) -> Self {
        let mut counts = vec![BigUint::ZERO; rhombi as usize];
        counts.push(BigUint::from(1u32));
        Self(counts)
    }
    fn is_none(&self) -> bool {
        self.0.is_empty()
    }
    fn and(&mut self, part: &Self, _: usize) -> bool {
        let length = if self.is_none() || part.is_none() { 0 } else { self.0.len() + part.0.len() - 1 };
        let mut product = vec![BigUint::ZERO; length];
        for (i, a) in self.0.iter().enumerate() {
            for (j, b) in part.0.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        self.0 = product;
        true
    }
    fn or(&mut self, other: &Self) -> bool {
        self.0.resize(self.0.len().max(other.0.len()), BigUint::ZERO);
        self.0.iter_mut().zip(&other.0).for_each(|(sum, count)| *sum += count);
        true
    }
    fn within(mut self, rhombi: u16) -> Self {
        self.0.truncate(usize::from(rhombi) + 1);
        let last = self.0.iter().rposition(|count| *count != BigUint::ZERO);
        self.0.truncate(last.map_or(0, |last| last + 1));
        self
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
    fn is_final(&self, _floor: i64) -> bool {
        *self
    }
}
