//! Neighbor search with a cell list: agents are sorted into square cells, and nine cells are searched.

use crate::flock::Point;

/// A cell list, whose buffers are reused from step to step.
#[derive(Default)]
pub(crate) struct CellList {
    /// Cell of every agent.
    cell: Vec<usize>,
    /// Index at which each cell starts in the sorted arrays, and the end of the last cell.
    start: Vec<usize>,
    /// Agents in the order of their cells.
    order: Vec<usize>,
    positions: Vec<Point>,
    velocities: Vec<Point>,
}

impl CellList {
    /// Writes the sum of the velocities of each agent's neighbors.
    pub(crate) fn sum_neighbors(
        &mut self,
        positions: &[Point],
        velocities: &[Point],
        range: f64,
        sums: &mut [Point],
    ) {
        let (columns, rows) = self.sort(positions, range);
        self.positions.clear();
        self.positions
            .extend(self.order.iter().map(|&i| positions[i]));
        self.velocities.clear();
        self.velocities
            .extend(self.order.iter().map(|&i| velocities[i]));
        for (&agent, &position) in self.order.iter().zip(&self.positions) {
            let (row, column) = (self.cell[agent] / columns, self.cell[agent] % columns);
            let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
            let mut sum = [0.0; 2];
            for near in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
                // Adjacent cells of a row are adjacent in the sorted arrays.
                let first = self.start[near * columns + left];
                let last = self.start[near * columns + right + 1];
                let (r, v) = (&self.positions[first..last], &self.velocities[first..last]);
                let part = sum_in_range(position, r, v, range);
                sum = [sum[0] + part[0], sum[1] + part[1]];
            }
            sums[agent] = sum;
        }
    }

    /// Sorts the agents into cells by counting sort, and returns the numbers of columns and rows.
    fn sort(&mut self, positions: &[Point], range: f64) -> (usize, usize) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for position in positions {
            for axis in 0..2 {
                low[axis] = low[axis].min(position[axis]);
                high[axis] = high[axis].max(position[axis]);
            }
        }
        // At most about as many cells as agents, because smaller cells cost more time than they save.
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let side = range.max((area / positions.len() as f64).sqrt()).max(1e-9);
        let [columns, rows] = [0, 1].map(|axis| ((high[axis] - low[axis]) / side) as usize + 1);
        self.cell.clear();
        self.cell.extend(positions.iter().map(|position| {
            let [column, row] = [0, 1].map(|axis| ((position[axis] - low[axis]) / side) as usize);
            row * columns + column
        }));
        self.start.clear();
        self.start.resize(columns * rows + 1, 0);
        for &cell in &self.cell {
            self.start[cell] += 1;
        }
        let mut end = 0;
        for start in &mut self.start {
            end += *start;
            *start = end;
        }
        // Cells are filled from the back, which moves each cell's end down to its start.
        self.order.resize(positions.len(), 0);
        for (agent, &cell) in self.cell.iter().enumerate().rev() {
            self.start[cell] -= 1;
            self.order[self.start[cell]] = agent;
        }
        (columns, rows)
    }
}

/// Returns the sum of the velocities of the agents within `range` of `position`.
fn sum_in_range(position: Point, positions: &[Point], velocities: &[Point], range: f64) -> Point {
    let mut sum = [0.0; 2];
    for (other, velocity) in positions.iter().zip(velocities) {
        let (dx, dy) = (other[0] - position[0], other[1] - position[1]);
        if dx * dx + dy * dy <= range * range {
            sum[0] += velocity[0];
            sum[1] += velocity[1];
        }
    }
    sum
}
