//! Axis-aligned boxes and a static tree over them, for "which items may touch this one" in logarithmic time.
//!
//! The tree is split at the median of the box centres along their widest axis, ties by item number, so it depends on
//! the boxes alone. Overlap is closed: boxes that touch overlap.

use glam::DVec3;

/// Items in a leaf: testing a few boxes costs less than walking down to each.
const LEAF: usize = 8;

/// An axis-aligned box. An empty box has `low > high` and overlaps nothing; so does a box with a NaN in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub low: DVec3,
    /// Greatest coordinates.
    pub high: DVec3,
}

impl Aabb {
    /// The box of nothing: the identity of [`Aabb::union`].
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// The least box round some points.
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Self {
        let mut bounds = Self::EMPTY;
        points.into_iter().for_each(|p| bounds.grow(p));
        bounds
    }

    /// Extends the box to a point.
    pub fn grow(&mut self, point: DVec3) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
    }

    /// The least box round two boxes.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// True when the boxes share a point; touching counts.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        // Without short cuts: in a tree walk the branches would be unpredictable.
        (self.low.cmple(other.high) & other.low.cmple(self.high)).all()
    }

    /// True when the other box lies wholly in this one; equal boxes contain each other.
    pub fn contains(&self, other: &Self) -> bool {
        self.low.cmple(other.low).all() && self.high.cmpge(other.high).all()
    }

    /// The box moved out by `distance` on every side, in scene units.
    #[must_use]
    pub fn inflate(&self, distance: f64) -> Self {
        Self { low: self.low - distance, high: self.high + distance }
    }

    /// True when the box holds no point.
    pub fn is_empty(&self) -> bool {
        !self.low.cmple(self.high).all()
    }

    /// Length of the diagonal, scene units; 0 for an empty box.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.low.distance(self.high) }
    }

    /// Midpoint; not a number for an empty box.
    pub fn centre(&self) -> DVec3 {
        self.low.midpoint(self.high)
    }
}

/// A node and its subtree, in preorder: the first child follows its parent.
#[derive(Debug, Clone)]
struct Node {
    bounds: Aabb,
    /// Leaf: its items are `items[start..start + count]`. Inner node: `start` is the second child and `count` 0.
    start: u32,
    count: u32,
}

/// A static tree of boxes. Building costs O(n log n), a query O(log n + answers) on boxes of similar size.
#[derive(Debug, Clone)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Item numbers and boxes in leaf order.
    items: Vec<(u32, Aabb)>,
}

impl Bvh {
    /// Builds the tree; items are numbered as in `boxes`. Empty and not-a-number boxes are left out.
    pub fn new(boxes: &[Aabb]) -> Self {
        let items: Vec<_> =
            boxes.iter().enumerate().filter(|(_, b)| !b.is_empty()).map(|(k, b)| (k as u32, *b)).collect();
        let mut tree = Self { nodes: Vec::with_capacity(items.len()), items };
        if !tree.items.is_empty() {
            tree.build(0, tree.items.len());
        }
        tree
    }

    /// Appends the subtree of `items[start..end]`. Halving keeps the recursion as shallow as log2 n.
    fn build(&mut self, start: usize, end: usize) {
        let range = &mut self.items[start..end];
        let bounds = range.iter().fold(Aabb::EMPTY, |b, (_, item)| b.union(item));
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, start: start as u32, count: (end - start) as u32 });
        if end - start <= LEAF {
            return;
        }
        let spread = Aabb::of(range.iter().map(|(_, b)| b.centre()));
        let axis = (spread.high - spread.low).max_position();
        let middle = range.len() / 2;
        range.select_nth_unstable_by(middle, |(i, a), (j, b)| {
            a.centre()[axis].total_cmp(&b.centre()[axis]).then(i.cmp(j))
        });
        self.build(start, start + middle);
        self.nodes[node].start = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.build(start + middle, end);
    }

    /// The box round all items.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, |root| root.bounds)
    }

    /// Calls `found` with every item whose box overlaps `query`, in tree order.
    pub fn overlapping(&self, query: &Aabb, found: &mut impl FnMut(u32)) {
        if !self.nodes.is_empty() {
            self.visit(0, query, found);
        }
    }

    fn visit(&self, node: usize, query: &Aabb, found: &mut impl FnMut(u32)) {
        let Node { bounds, start, count } = &self.nodes[node];
        if !bounds.overlaps(query) {
            return;
        }
        if *count == 0 {
            self.visit(node + 1, query, found);
            self.visit(*start as usize, query, found);
        } else {
            for (item, bounds) in &self.items[*start as usize..(*start + *count) as usize] {
                if bounds.overlaps(query) {
                    found(*item);
                }
            }
        }
    }

    /// All pairs of different items whose boxes overlap, lower item first, sorted. Costs O(n log n + pairs) on boxes
    /// of similar size.
    pub fn pairs(&self) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        for &(item, bounds) in &self.items {
            self.overlapping(&bounds, &mut |other| {
                if item < other {
                    pairs.push([item, other]);
                }
            });
        }
        pairs.sort_unstable();
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn a_box() -> impl Strategy<Value = Aabb> {
        (prop::array::uniform3(-8i32..8), prop::array::uniform3(0i32..4)).prop_map(|(low, size)| {
            let low = DVec3::from_array(low.map(f64::from));
            Aabb { low, high: low + DVec3::from_array(size.map(f64::from)) }
        })
    }

    /// Interval by interval, as the definition says.
    fn share_a_point(a: &Aabb, b: &Aabb) -> bool {
        (0..3).all(|k| a.low[k].max(b.low[k]) <= a.high[k].min(b.high[k]))
    }

    proptest! {
        #[test]
        fn finds_what_brute_force_finds(boxes in prop::collection::vec(a_box(), 0..60), query in a_box()) {
            let tree = Bvh::new(&boxes);
            let mut found = Vec::new();
            tree.overlapping(&query, &mut |k| found.push(k));
            found.sort_unstable();
            let n = boxes.len() as u32;
            let expected: Vec<u32> = (0..n).filter(|&k| share_a_point(&boxes[k as usize], &query)).collect();
            prop_assert_eq!(found, expected);
            let mut pairs = Vec::new();
            for i in 0..n {
                pairs.extend((i + 1..n).filter(|&j| share_a_point(&boxes[i as usize], &boxes[j as usize])).map(|j| [i, j]));
            }
            prop_assert_eq!(tree.pairs(), pairs);
        }
    }

    #[test]
    fn empty_and_nan_boxes_are_left_out() {
        let unit = Aabb { low: DVec3::ZERO, high: DVec3::ONE };
        let nan = Aabb { low: DVec3::NAN, high: DVec3::ONE };
        let tree = Bvh::new(&[unit, Aabb::EMPTY, nan, unit]);
        assert_eq!(tree.pairs(), [[0, 3]]);
        assert_eq!(tree.bounds(), unit);
        assert!(Bvh::new(&[]).bounds().is_empty());
    }

    #[test]
    fn measures_of_a_box() {
        let bounds = Aabb::of([DVec3::ZERO, DVec3::new(1.0, 2.0, 2.0)]);
        assert_eq!((bounds.diagonal(), bounds.centre()), (3.0, DVec3::new(0.5, 1.0, 1.0)));
        assert_eq!(Aabb::EMPTY.diagonal(), 0.0);
        assert!(bounds.inflate(0.5).contains(&bounds) && !bounds.contains(&bounds.inflate(0.5)));
    }
}
