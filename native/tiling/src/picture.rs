//! Pictures of tilings.

use crate::plane::Point;
use crate::tile::{Kind, Tile, Tiling};
use std::fmt::Write;

impl Tile {
    /// By how many times 30 degrees the tile is turned against one with an edge along the x axis: 0 to 2 for squares, 0
    /// to 3 for triangles, 0 to 5 for rhombi, whose other symmetries need no name.
    pub fn orientation(self) -> u8 {
        self.direction
            % match self.kind {
                Kind::Triangle => 4,
                Kind::Square => 3,
                Kind::Rhombus => 6,
            }
    }
}

impl Tiling {
    /// An SVG picture `width` pixels wide, y upwards: triangles warm, squares cold, a shade for each orientation;
    /// rhombi magenta.
    pub fn svg(&self, width: u32) -> String {
        const TRIANGLES: [&str; 4] = ["#f6c65b", "#f2a541", "#fbe3a3", "#e98a3c"];
        const SQUARES: [&str; 3] = ["#9cc4e4", "#5a95c4", "#c9e0f0"];
        const RHOMBUS: &str = "#c2347e";
        const MARGIN: f64 = 4.0;
        let corners = || self.tiles.iter().flat_map(|tile| tile.corners()).map(Point::position);
        let range = |axis: usize| {
            let values = corners().map(move |position| position[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let ((left, right), (bottom, top)) = (range(0), range(1));
        let scale = (f64::from(width) - 2.0 * MARGIN) / (right - left).max(1.0);
        let height = if self.tiles.is_empty() { 0.0 } else { (top - bottom) * scale + 2.0 * MARGIN };
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height:.0}\" stroke=\"#22303c\" \
             stroke-linejoin=\"round\">\n"
        );
        for tile in &self.tiles {
            let colour = match tile.kind {
                Kind::Triangle => TRIANGLES[tile.orientation() as usize],
                Kind::Square => SQUARES[tile.orientation() as usize],
                Kind::Rhombus => RHOMBUS,
            };
            let _ = write!(svg, "<polygon fill=\"{colour}\" points=\"");
            for corner in tile.corners() {
                let [x, y] = corner.position();
                let _ = write!(svg, "{:.2},{:.2} ", MARGIN + (x - left) * scale, MARGIN + (top - y) * scale);
            }
            svg.push_str("\"/>\n");
        }
        svg + "</svg>\n"
    }
}

#[cfg(test)]
mod tests {
    use crate::{Boundary, Options, Tilings};
    use mesh::Monitor;

    #[test]
    fn a_picture_has_every_tile_once_inside_its_frame() {
        let boundary = Boundary::new(&[5; 12]).unwrap();
        let mut tilings = Tilings::new(&boundary, &Options::default(), &Monitor::new()).unwrap();
        let svg = tilings.get(&0u32.into(), &Monitor::new()).unwrap().unwrap().svg(400);
        assert_eq!(svg.matches("<polygon").count(), 18);
        let numbers: Vec<f64> = svg
            .lines()
            .filter_map(|line| line.split("points=\"").nth(1))
            .flat_map(|points| points.split(['"', ' ', ',']).filter_map(|number| number.parse().ok()))
            .collect();
        assert_eq!(numbers.len(), 2 * (12 * 3 + 6 * 4));
        assert!(numbers.iter().all(|n| (3.9..396.2).contains(n)));
    }
}
