//! Connected components of a graph given as an edge list.

/// The vertices of each connected component, ascending; components in the order of their first vertex. `edges` holds
/// vertex pairs below `count`; loops and repeats do no harm. Cost: nearly linear.
///
/// # Panics
/// When an edge names a vertex that is not below `count`.
pub fn connected_components(count: usize, edges: impl IntoIterator<Item = (u32, u32)>) -> Vec<Vec<u32>> {
    let mut parent: Vec<u32> = (0..count as u32).collect();
    for (a, b) in edges {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        // The smaller root wins: the root of a component is its first vertex.
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut components: Vec<Vec<u32>> = Vec::new();
    let mut position = vec![0; count];
    for vertex in 0..count as u32 {
        let first = root(&mut parent, vertex);
        if first == vertex {
            position[vertex as usize] = components.len();
            components.push(Vec::new());
        }
        components[position[first as usize]].push(vertex);
    }
    components
}

/// The root of a vertex, halving the path on the way.
fn root(parent: &mut [u32], mut vertex: u32) -> u32 {
    while parent[vertex as usize] != vertex {
        let above = parent[parent[vertex as usize] as usize];
        parent[vertex as usize] = above;
        vertex = above;
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_come_in_order() {
        let edges = [(4, 2), (0, 5), (2, 2), (5, 3)];
        assert_eq!(connected_components(7, edges), [vec![0, 3, 5], vec![1], vec![2, 4], vec![6]]);
        assert!(connected_components(0, []).is_empty());
    }
}
