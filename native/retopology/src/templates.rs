//! Templates that an artist chooses for a pair of base triangles: section 7, Fig. 11.
//!
//! "Any template having two alignment edges can be mapped to triangles paired by the graph matching." Two such triangles
//! make a four-sided patch, so that a template is a pattern of quads with four sides here; its strips are multiplied to the counts
//! along the patch. A small catalogue is built in; a file of the same form adds to it.

use crate::base::Base;
use crate::measures::Measures;
use crate::patch::{Patch, Rim};
use crate::sources::distance_to_segment;
use mesh::DVec3;
use quadrangulate::CustomPattern;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A template as a catalogue file lists it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Template {
    /// Its name, unlike any other's.
    pub name: String,
    /// Four sides, counter-clockwise: the vertices of each, the last being the first of the next.
    pub sides: Vec<Vec<u32>>,
    /// Quads, counter-clockwise.
    pub quads: Vec<[u32; 4]>,
}

/// Templates to choose from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalogue {
    /// In any order.
    pub templates: Vec<Template>,
}

/// A template for the pair of base triangles that share a base edge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TemplateChoice {
    /// Name in the catalogue.
    pub template: String,
    /// Quarter turns: the template's first side is the patch's side that starts this many corners after the base edge's first end.
    pub turn: usize,
}

/// Where a template goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TemplatePlace {
    /// The pair of base triangles that share this base edge.
    Edge(u32),
    /// The pair whose common base edge is nearest to this point, scene units.
    Point(DVec3),
}

/// Why a catalogue or a choice cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TemplateError {
    /// The file is no catalogue.
    #[error("the catalogue cannot be read: {message}")]
    Unreadable {
        /// What the reader says, with line and column.
        message: String,
    },
    /// A template that is no pattern of quads with four sides.
    #[error("template {name:?}: {reason}")]
    Bad {
        /// Its name.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// Two templates of one name.
    #[error("the catalogue has two templates named {name:?}; rename one")]
    Twice {
        /// The name.
        name: String,
    },
    /// A choice of a template that the catalogue does not have.
    #[error("the catalogue has no template named {name:?}")]
    Unknown {
        /// The name.
        name: String,
    },
    /// A choice for an edge that is no diagonal of a pair.
    #[error(
        "base edge {edge} is no diagonal of a pair of triangles: it is a feature, a border, or its pair touches itself or another choice's"
    )]
    NoPair {
        /// The base edge.
        edge: u32,
    },
    /// No pair of triangles can have a template: all edges are features.
    #[error("no pair of base triangles can have a template: all base edges are features or borders")]
    NoPairs,
    /// The counts along a patch cannot be made to fit.
    #[error(
        "the template at base edge {edge} cannot have the counts of its neighbours; choose templates farther apart"
    )]
    DoesNotFit {
        /// The base edge.
        edge: u32,
    },
}

impl Default for Catalogue {
    /// The built-in templates: `plain`, one quad; `knuckle`, a loop of edges round the middle, as animators lay it over joints,
    /// eyes and mouths.
    fn default() -> Self {
        let plain = Template {
            name: "plain".into(),
            sides: vec![vec![0, 1], vec![1, 2], vec![2, 3], vec![3, 0]],
            quads: vec![[0, 1, 2, 3]],
        };
        // A grid of three by three; its middle quad, 5 6 10 9, has a smaller one inside.
        let mut quads: Vec<[u32; 4]> = (0..9)
            .filter(|k| *k != 4)
            .map(|k| {
                let v = k / 3 * 4 + k % 3;
                [v, v + 1, v + 5, v + 4]
            })
            .collect();
        quads.extend([[5, 6, 17, 16], [6, 10, 18, 17], [10, 9, 19, 18], [9, 5, 16, 19], [16, 17, 18, 19]]);
        let sides = vec![vec![0, 1, 2, 3], vec![3, 7, 11, 15], vec![15, 14, 13, 12], vec![12, 8, 4, 0]];
        Self { templates: vec![plain, Template { name: "knuckle".into(), sides, quads }] }
    }
}

impl Catalogue {
    /// Reads a catalogue and checks every template. O(quads).
    ///
    /// # Errors
    /// [`TemplateError`]: unreadable, a bad template, a name used twice.
    pub fn from_json(text: &str) -> Result<Self, TemplateError> {
        let catalogue: Self =
            serde_json::from_str(text).map_err(|error| TemplateError::Unreadable { message: error.to_string() })?;
        catalogue.check()?;
        Ok(catalogue)
    }

    /// The catalogue as text that [`Catalogue::from_json`] reads.
    ///
    /// # Errors
    /// [`TemplateError::Unreadable`] should the writer fail.
    pub fn to_json(&self) -> Result<String, TemplateError> {
        serde_json::to_string_pretty(self).map_err(|error| TemplateError::Unreadable { message: error.to_string() })
    }

    /// Adds the templates of another catalogue.
    ///
    /// # Errors
    /// [`TemplateError::Twice`] when a name is in both; nothing is added then.
    pub fn extend(&mut self, other: Self) -> Result<(), TemplateError> {
        let mut both = self.clone();
        both.templates.extend(other.templates);
        both.check()?;
        *self = both;
        Ok(())
    }

    fn check(&self) -> Result<(), TemplateError> {
        for (i, template) in self.templates.iter().enumerate() {
            if self.templates[..i].iter().any(|other| other.name == template.name) {
                return Err(TemplateError::Twice { name: template.name.clone() });
            }
            template.pattern()?;
        }
        Ok(())
    }

    /// The pattern of a name.
    pub(crate) fn pattern(&self, name: &str) -> Result<CustomPattern, TemplateError> {
        let found = self.templates.iter().find(|template| template.name == name);
        found.ok_or_else(|| TemplateError::Unknown { name: name.into() })?.pattern()
    }
}

/// A template that was chosen, ready for use.
#[derive(Debug)]
pub(crate) struct Chosen {
    pub edge: u32,
    /// The triangles on both sides of the edge, ascending.
    pub pair: [u32; 2],
    turn: usize,
    pub pattern: CustomPattern,
}

/// The base edge at each place. O(surface).
pub(crate) fn edges_at(
    base: &Base,
    measures: &Measures,
    places: &[(TemplatePlace, TemplateChoice)],
) -> Result<BTreeMap<u32, TemplateChoice>, TemplateError> {
    let mut choices = BTreeMap::new();
    for (place, choice) in places {
        let edge = match *place {
            TemplatePlace::Edge(edge) => edge,
            TemplatePlace::Point(point) => {
                let at = |v: u32| base.surface.positions[v as usize];
                let away = |edge: u32| {
                    let steps = base.edges[edge as usize].path.windows(2);
                    steps.map(|step| distance_to_segment(point, at(step[0]), at(step[1]))).fold(f64::INFINITY, f64::min)
                };
                let free = (0..base.edges.len() as u32).filter(|&e| pair_at(base, measures, e).is_some());
                free.map(|e| (away(e), e)).min_by(|a, b| a.0.total_cmp(&b.0)).ok_or(TemplateError::NoPairs)?.1
            }
        };
        if choices.insert(edge, choice.clone()).is_some() {
            return Err(TemplateError::NoPair { edge });
        }
    }
    Ok(choices)
}

/// The two triangles beside a base edge, ascending, when they can be a patch.
fn pair_at(base: &Base, measures: &Measures, edge: u32) -> Option<[u32; 2]> {
    if measures.rails.get(edge as usize) != Some(&false) {
        return None;
    }
    let beside = (0..base.triangles.len() as u32).filter(|&t| base.triangle_edges[t as usize].contains(&edge));
    let pair: [u32; 2] = beside.collect::<Vec<_>>().try_into().ok()?;
    Rim::new(base, measures, &pair).is_some().then_some(pair)
}

/// Looks up all choices.
pub(crate) fn chosen(
    base: &Base,
    measures: &Measures,
    catalogue: &Catalogue,
    choices: &BTreeMap<u32, TemplateChoice>,
) -> Result<Vec<Chosen>, TemplateError> {
    catalogue.check()?;
    let mut all: Vec<Chosen> = Vec::new();
    for (&edge, choice) in choices {
        let pair = pair_at(base, measures, edge);
        let is_free = |pair: &[u32; 2]| !all.iter().any(|other| other.pair.iter().any(|t| pair.contains(t)));
        let pair = pair.filter(is_free).ok_or(TemplateError::NoPair { edge })?;
        all.push(Chosen { edge, pair, turn: choice.turn, pattern: catalogue.pattern(&choice.template)? });
    }
    Ok(all)
}

impl Chosen {
    /// The patch of the pair as the template sees it: its first side first.
    pub fn orient(&self, base: &Base, patch: Patch, index: usize) -> Patch {
        let end = base.edges[self.edge as usize].ends[0];
        let at = |k: usize| patch.border[patch.corners[k]] as usize;
        let first = (0..patch.corners.len()).find(|&k| base.triangles[at(k) / 3][at(k) % 3] == end).unwrap_or(0);
        Patch { template: Some(index), ..patch.turned(first + self.turn) }
    }
}

impl Template {
    fn pattern(&self) -> Result<CustomPattern, TemplateError> {
        let bad = |reason| TemplateError::Bad { name: self.name.clone(), reason };
        if self.sides.len() != 4 {
            return Err(bad("it must have four sides"));
        }
        CustomPattern::new(&self.name, &self.sides, &self.quads).map_err(bad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_catalogue_survives_its_file() {
        let catalogue = Catalogue::default();
        let text = catalogue.to_json().unwrap();
        assert_eq!(Catalogue::from_json(&text), Ok(catalogue.clone()));
        assert!(matches!(catalogue.clone().extend(catalogue), Err(TemplateError::Twice { name }) if name == "plain"));
    }

    #[test]
    fn bad_catalogues_are_refused_with_a_reason() {
        assert!(matches!(Catalogue::from_json("{"), Err(TemplateError::Unreadable { .. })));
        assert!(matches!(
            Catalogue::from_json(r#"{"templates": [], "more": 1}"#),
            Err(TemplateError::Unreadable { .. })
        ));
        let one = |sides: &str, quads: &str| {
            Catalogue::from_json(&format!(r#"{{"templates": [{{"name": "t", "sides": {sides}, "quads": {quads}}}]}}"#))
        };
        let square = "[[0,1],[1,2],[2,3],[3,0]]";
        assert!(one(square, "[[0,1,2,3]]").is_ok());
        for (sides, quads) in [
            ("[[0,1],[1,2],[2,3,0]]", "[[0,1,2,3]]"),
            (square, "[[0,3,2,1]]"),
            (square, "[[0,1,2,2]]"),
            (square, "[[0,1,2,3],[4,5,6,7]]"),
            (square, "[]"),
        ] {
            assert!(
                matches!(one(sides, quads), Err(TemplateError::Bad { name, .. }) if name == "t"),
                "{sides} {quads}"
            );
        }
        assert!(matches!(Catalogue::default().pattern("none"), Err(TemplateError::Unknown { .. })));
    }
}
