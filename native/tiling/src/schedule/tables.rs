//! The schedule as text: JSON that reads back equal, and CSV tables for spreadsheets.

use super::{PanelRow, Schedule, ScheduleError, VERSION};

/// What a CSV table lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Table {
    /// One row a panel.
    Panels,
    /// One row a type of panels.
    Types,
    /// One row a node.
    Nodes,
    /// One row an edge.
    Edges,
}

impl Schedule {
    /// All of it as JSON. Numbers keep every digit.
    ///
    /// # Errors
    /// None that this crate knows of; serialisation may fail in principle.
    pub fn to_json(&self) -> Result<String, ScheduleError> {
        serde_json::to_string_pretty(self).map_err(|cause| ScheduleError::Text(cause.to_string()))
    }

    /// Reads what [`Self::to_json`] wrote.
    ///
    /// # Errors
    /// [`ScheduleError::Text`] when it is no JSON, lacks something, or names nodes, panels or types that it does not have.
    pub fn from_json(text: &str) -> Result<Self, ScheduleError> {
        let schedule: Self = serde_json::from_str(text).map_err(|cause| ScheduleError::Text(cause.to_string()))?;
        schedule.check().map_err(ScheduleError::Text)?;
        Ok(schedule)
    }

    fn check(&self) -> Result<(), String> {
        if self.version != VERSION {
            return Err(format!("its version is {}, this library reads version {VERSION}", self.version));
        }
        let (nodes, panels, types) = (self.nodes.len(), self.panels.len(), self.types.len());
        let below = |index: u32, count: usize| (index as usize) < count;
        if let Some(v) = self.nodes.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(format!("node {v} has no position"));
        }
        for (id, panel) in self.panels.iter().enumerate() {
            let n = panel.nodes.len();
            let sound = panel.id as usize == id
                && (n == 3 || n == 4)
                && panel.nodes.iter().all(|&v| below(v, nodes))
                && below(panel.kind, types)
                && self.types[panel.kind as usize].corners as usize == n
                && below(panel.first, n)
                && panel.neighbours.len() == n
                && panel.neighbours.iter().flatten().all(|&other| below(other, panels))
                && panel.edges.len() == n
                && panel.diagonals.len() == 2 * (n - 3);
            if !sound {
                return Err(format!("panel {id} is not complete, or names what is not there"));
            }
        }
        let is_sound = |model: u32, corners: u32| {
            below(model, panels) && self.panels[model as usize].nodes.len() == corners as usize
        };
        if let Some(row) = self.types.iter().find(|row| !is_sound(row.model, row.corners)) {
            return Err(format!("the model of type {} is no such panel", row.name));
        }
        let is_sound = |edge: &super::EdgeRow| {
            edge.nodes.iter().all(|&v| below(v, nodes))
                && edge.panels.iter().all(|&panel| below(panel, panels))
                && below(edge.class, self.edge_classes.len())
        };
        match self.edges.iter().position(|edge| !is_sound(edge)) {
            Some(e) => Err(format!("edge {e} names what is not there")),
            None => Ok(()),
        }
    }

    /// One table as comma-separated values with a line of headings. Cells of a triangle that only quads have are empty.
    ///
    /// # Errors
    /// None that this crate knows of; the writer may fail in principle.
    pub fn to_csv(&self, table: Table) -> Result<String, ScheduleError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let mut write =
            |row: Vec<String>| writer.write_record(row).map_err(|cause| ScheduleError::Text(cause.to_string()));
        match table {
            Table::Panels => {
                write(panel_headings())?;
                self.panels.iter().try_for_each(|panel| write(self.panel_cells(panel)))?;
            }
            Table::Types => {
                let heads = ["type", "corners", "count", "mirrored", "model", "misfit", "area"].map(str::to_owned);
                write([heads.to_vec(), numbered("edge", 4), numbered("diagonal", 2)].concat())?;
                for row in &self.types {
                    let counts = [row.corners, row.count, row.mirrored, row.model].map(|n| n.to_string());
                    let lengths = [row.misfit, row.area].map(|x| x.to_string());
                    let first = [vec![row.name.clone()], counts.to_vec(), lengths.to_vec()].concat();
                    write([first, padded(&row.edges, 4), padded(&row.diagonals, 2)].concat())?;
                }
            }
            Table::Nodes => {
                write(["node", "x", "y", "z"].map(str::to_owned).to_vec())?;
                for (id, p) in self.nodes.iter().enumerate() {
                    write([vec![id.to_string()], p.map(|x| x.to_string()).to_vec()].concat())?;
                }
            }
            Table::Edges => {
                write(
                    ["edge", "node_1", "node_2", "length", "class", "class_length", "panels"]
                        .map(str::to_owned)
                        .to_vec(),
                )?;
                for (id, edge) in self.edges.iter().enumerate() {
                    let class = &self.edge_classes[edge.class as usize];
                    let panels: Vec<String> = edge.panels.iter().map(u32::to_string).collect();
                    write(vec![
                        id.to_string(),
                        edge.nodes[0].to_string(),
                        edge.nodes[1].to_string(),
                        edge.length.to_string(),
                        class.name.clone(),
                        class.length.to_string(),
                        panels.join(" "),
                    ])?;
                }
            }
        }
        let bytes = writer.into_inner().map_err(|cause| ScheduleError::Text(cause.to_string()))?;
        String::from_utf8(bytes).map_err(|cause| ScheduleError::Text(cause.to_string()))
    }

    fn panel_cells(&self, panel: &PanelRow) -> Vec<String> {
        let neighbours =
            panel.neighbours.iter().map(|other| other.map_or(String::new(), |id| id.to_string())).collect();
        let mut cells = vec![
            panel.id.to_string(),
            self.types[panel.kind as usize].name.clone(),
            panel.nodes.len().to_string(),
            panel.mirrored.to_string(),
        ];
        cells.extend([panel.misfit, panel.area, panel.planarity, panel.deviation].map(|x| x.to_string()));
        cells.extend(padded(&panel.nodes, 4));
        cells.extend(resized(neighbours, 4));
        cells.extend(padded(&panel.edges, 4));
        cells.extend(padded(&panel.diagonals, 2));
        cells
    }
}

fn panel_headings() -> Vec<String> {
    let heads = ["panel", "type", "corners", "mirrored", "misfit", "area", "planarity", "deviation"].map(str::to_owned);
    let lists = [("node", 4), ("neighbour", 4), ("edge", 4), ("diagonal", 2)];
    heads.into_iter().chain(lists.into_iter().flat_map(|(name, n)| numbered(name, n))).collect()
}

/// Headings of a list: `edge_1`, `edge_2`, ...
fn numbered(name: &str, n: usize) -> Vec<String> {
    (1..=n).map(|k| format!("{name}_{k}")).collect()
}

/// The cells of a list, the last ones empty.
fn padded<T: ToString>(values: &[T], n: usize) -> Vec<String> {
    resized(values.iter().map(ToString::to_string).collect(), n)
}

fn resized(mut cells: Vec<String>, n: usize) -> Vec<String> {
    cells.resize(n, String::new());
    cells
}
