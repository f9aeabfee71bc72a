//! Connected components of an undirected graph, given only its edge test.

/// Number of connected components of the graph on `0..n` whose edges `linked(i, j)` tells.
///
/// Every agent is expanded once against those that no component has claimed yet, so a connected graph
/// costs about n tests and one without edges n^2 / 2.
pub(crate) fn num_components(n: usize, linked: impl Fn(usize, usize) -> bool) -> usize {
    let mut unclaimed: Vec<usize> = (0..n).collect();
    let mut frontier = Vec::with_capacity(n);
    let mut count = 0;
    while let Some(start) = unclaimed.pop() {
        count += 1;
        frontier.push(start);
        while let Some(agent) = frontier.pop() {
            unclaimed.retain(|&other| {
                let found = linked(agent, other);
                if found {
                    frontier.push(other);
                }
                !found
            });
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_graphs() {
        assert_eq!(num_components(0, |_, _| true), 0);
        assert_eq!(num_components(5, |_, _| false), 5);
        assert_eq!(num_components(5, |_, _| true), 1);
        assert_eq!(num_components(6, |i, j| i.abs_diff(j) == 1), 1);
        assert_eq!(num_components(6, |i, j| i.abs_diff(j) == 2), 2);
    }
}
