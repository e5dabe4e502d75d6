//! Diagonal blocks of a matrix whose rows and columns can be put in a block triangular order.
//!
//! A transversal pairs every row with a column where it has an entry (Duff, ACM Trans. Math. Softw. 7, 1981, 315).
//! A row then needs those rows that are paired with its other columns; rows that need each other are a block
//! (Tarjan, SIAM J. Comput. 1, 1972, 146).

use std::collections::VecDeque;

const NONE: usize = usize::MAX;

/// The smallest blocks, as paired rows and columns: rows of a block have entries in columns of their own and of
/// earlier blocks only. `None` when every matrix of this pattern is singular.
pub fn diagonal_blocks(n: usize, pattern: impl Iterator<Item = (usize, usize)>) -> Option<Vec<Vec<(usize, usize)>>> {
    let mut columns = vec![Vec::new(); n];
    for (row, column) in pattern {
        columns[row].push(column);
    }
    let row_of = transversal(&columns)?;
    let mut column_of = vec![NONE; n];
    for (column, &row) in row_of.iter().enumerate() {
        column_of[row] = column;
    }
    let needs: Vec<Vec<usize>> = columns.iter().map(|c| c.iter().map(|&j| row_of[j]).collect()).collect();
    let blocks = strong_components(&needs);
    Some(blocks.into_iter().map(|rows| rows.into_iter().map(|row| (row, column_of[row])).collect()).collect())
}

/// The row paired with every column, by shortest augmenting paths.
fn transversal(columns: &[Vec<usize>]) -> Option<Vec<usize>> {
    let n = columns.len();
    let mut row_of = vec![NONE; n];
    let mut column_of = vec![NONE; n];
    // Row from which a column was reached, and in which search.
    let mut reached_from = vec![NONE; n];
    let mut search = vec![NONE; n];
    for start in 0..n {
        let mut waiting = VecDeque::from([start]);
        let mut free = None;
        'search: while let Some(row) = waiting.pop_front() {
            for &column in &columns[row] {
                if std::mem::replace(&mut search[column], start) == start {
                    continue;
                }
                reached_from[column] = row;
                if row_of[column] == NONE {
                    free = Some(column);
                    break 'search;
                }
                waiting.push_back(row_of[column]);
            }
        }
        let mut column = free?;
        loop {
            let row = reached_from[column];
            row_of[column] = row;
            let before = std::mem::replace(&mut column_of[row], column);
            if row == start {
                break;
            }
            column = before;
        }
    }
    Some(row_of)
}

/// Nodes that need each other, those that others need first.
fn strong_components(needs: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let n = needs.len();
    // When a node was met, and the earliest one met that is known to need it and be needed by it.
    let (mut met, mut earliest) = (vec![NONE; n], vec![NONE; n]);
    let mut closed = vec![false; n];
    let mut open = Vec::new();
    let mut components = Vec::new();
    let mut time = 0;
    for start in 0..n {
        let mut path = vec![(start, 0)];
        while let Some((node, edge)) = path.pop() {
            if edge == 0 {
                if met[node] != NONE {
                    continue;
                }
                met[node] = time;
                earliest[node] = time;
                time += 1;
                open.push(node);
            }
            if let Some(&other) = needs[node].get(edge) {
                path.push((node, edge + 1));
                if met[other] == NONE {
                    path.push((other, 0));
                } else if !closed[other] {
                    earliest[node] = earliest[node].min(met[other]);
                }
                continue;
            }
            if earliest[node] == met[node] {
                let first = open.iter().rposition(|&o| o == node).unwrap_or_default();
                let component = open.split_off(first);
                for &o in &component {
                    closed[o] = true;
                }
                components.push(component);
            }
            if let Some(&(parent, _)) = path.last() {
                earliest[parent] = earliest[parent].min(earliest[node]);
            }
        }
    }
    components
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Rows that reach each other, by the transitive closure of what they need.
    fn by_closure(n: usize, needs: impl Fn(usize, usize) -> bool) -> Vec<Vec<bool>> {
        let mut reach: Vec<Vec<bool>> = (0..n).map(|i| (0..n).map(|j| i == j || needs(i, j)).collect()).collect();
        for k in 0..n {
            for i in 0..n {
                for j in 0..n {
                    reach[i][j] |= reach[i][k] && reach[k][j];
                }
            }
        }
        reach
    }

    /// Whether rows from one on can be paired with columns that are not used yet: all ways are tried.
    fn pairs(row: usize, n: usize, used: usize, pattern: &[(usize, usize)]) -> bool {
        let fits = |j: usize| used >> j & 1 == 0 && pattern.contains(&(row, j));
        row == n || (0..n).any(|j| fits(j) && pairs(row + 1, n, used | 1 << j, pattern))
    }

    #[test]
    fn blocks_are_triangular_and_as_small_as_can_be() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        let mut singular = 0;
        for round in 0..400 {
            let n = 1 + round % 12;
            let pattern: Vec<(usize, usize)> =
                (0..n * n).map(|k| (k / n, k % n)).filter(|_| rng.random::<f64>() < 1.6 / n as f64).collect();
            let Some(blocks) = diagonal_blocks(n, pattern.iter().copied()) else {
                singular += 1;
                assert!(!pairs(0, n, 0, &pattern));
                continue;
            };
            let paired: Vec<(usize, usize)> = blocks.concat();
            assert_eq!(paired.len(), n);
            assert!(paired.iter().all(|pair| pattern.contains(pair)));
            let column_of = |row: usize| paired.iter().find(|p| p.0 == row).expect("every row is paired").1;
            let reach = by_closure(n, |i, j| pattern.contains(&(i, column_of(j))));
            let block_of = |row: usize| blocks.iter().position(|b| b.iter().any(|p| p.0 == row)).expect("in a block");
            for i in 0..n {
                for j in 0..n {
                    assert_eq!(reach[i][j] && reach[j][i], block_of(i) == block_of(j));
                    assert!(!reach[i][j] || block_of(j) <= block_of(i));
                }
            }
        }
        assert!((50..350).contains(&singular));
    }
}
