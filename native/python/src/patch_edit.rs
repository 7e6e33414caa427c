//! Edits of patch graphs: what `zigzag` and `zigzag_patch` of both kinds of results share.

use crate::errors::{self, InfeasibleError, QuadloomError};
use ::tiling::{EditError, PatchGraph, Zigzag, zigzags_of_patch};
use pyo3::prelude::*;

/// What a caller may say of a zigzag.
pub struct Wish {
    pub edges: i32,
    pub pair: bool,
    pub spread: bool,
    pub position: f64,
}

impl Wish {
    fn on(&self, py: Python<'_>, side: u32) -> PyResult<Zigzag> {
        if !(0.0..=1.0).contains(&self.position) {
            let sentence = format!("position is {}, but it must lie between 0 and 1", self.position);
            return Err(errors::raise_plain::<QuadloomError>(py, "option", sentence));
        }
        let &Self { edges, pair, spread, position } = self;
        Ok(Zigzag { side, edges, pair, spread, position })
    }

    /// On one side.
    pub fn on_side(&self, py: Python<'_>, graph: Option<&PatchGraph>, side: i64) -> PyResult<Vec<Zigzag>> {
        let graph = graph.ok_or_else(|| to_exception(py, &EditError::NoPatches))?;
        let count = graph.sides.len();
        let index = u32::try_from(side).ok().filter(|&side| (side as usize) < count);
        let no_side = || EditError::NoSuchSide { side: side.clamp(0, i64::from(u32::MAX)) as u32, count };
        Ok(vec![self.on(py, index.ok_or_else(|| to_exception(py, &no_side()))?)?])
    }

    /// On the sides of a patch, beginning with the one that leaves a corner.
    pub fn on_patch(
        &self,
        py: Python<'_>,
        graph: Option<&PatchGraph>,
        patch: i64,
        first: usize,
    ) -> PyResult<Vec<Zigzag>> {
        let graph = graph.ok_or_else(|| to_exception(py, &EditError::NoPatches))?;
        let index = u32::try_from(patch.max(-1)).unwrap_or(u32::MAX);
        zigzags_of_patch(graph, index, first, self.on(py, 0)?).map_err(|error| to_exception(py, &error))
    }
}

/// The exception for an edit that is not possible.
pub fn to_exception(py: Python<'_>, error: &EditError) -> PyErr {
    let sentence = error.to_string();
    let infeasible = |code: &str, sides: &[u32], patches: &[u32]| {
        let elements = [("sides".to_owned(), sides), ("patches".to_owned(), patches)];
        errors::raise::<InfeasibleError>(py, code, sentence.clone(), None, elements)
    };
    match *error {
        EditError::NoPatches => infeasible("no_patches", &[], &[]),
        EditError::NoSuchSide { .. } | EditError::NoSuchPatch { .. } | EditError::Edges { .. } => {
            errors::raise_plain::<QuadloomError>(py, "option", sentence)
        }
        EditError::Shape { patch, .. } => infeasible("patch_sides", &[], &[patch]),
        EditError::Open { side, .. } => infeasible("zigzag_open", &[side], &[]),
        EditError::Untileable { side, patch } => infeasible("zigzag_untileable", &[side], &[patch]),
    }
}
