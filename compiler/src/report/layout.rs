//! Where the nodes of a graph are drawn; the same graph always gives the same places.

use nalgebra::{DMatrix, DVector};

/// Places in a plane whose x points right and y down; neighbours are about 1 apart, the smallest coordinates are 0.
#[derive(Debug, Clone)]
pub struct Layout {
    pub places: Vec<[f64; 2]>,
}

impl Layout {
    /// Of `count` nodes, some `pairs` of which are joined. A chain goes to and fro in rows, few nodes or densely joined ones
    /// stand on a circle, and others where distances in the picture are those along the graph, as far as a plane can show them.
    pub fn new(count: usize, pairs: &[(usize, usize)]) -> Self {
        let neighbours = neighbours(count, pairs);
        let dense = 4 * pairs.len() > count * (count.max(1) - 1);
        let places = if count <= 2 {
            in_rows((0..count).collect(), 2)
        } else if let Some(order) = chain(&neighbours) {
            in_rows(order, longest_row(count))
        } else if pairs.is_empty() {
            grid(count)
        } else if count <= FEW || dense {
            on_a_circle(&around(&neighbours))
        } else {
            by_distance(&neighbours)
        };
        Self { places: from_zero(places) }
    }

    /// Width and height between the outermost nodes.
    pub fn size(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.places.iter().map(|place| place[axis]).fold(0.0, f64::max))
    }
}

/// So many nodes stand on a circle, whatever joins them.
const FEW: usize = 5;

fn neighbours(count: usize, pairs: &[(usize, usize)]) -> Vec<Vec<usize>> {
    let mut neighbours = vec![Vec::new(); count];
    for &(a, b) in pairs {
        neighbours[a].push(b);
        neighbours[b].push(a);
    }
    neighbours.iter_mut().for_each(|all| all.sort_unstable());
    neighbours
}

/// The nodes in order where all are joined in one row.
fn chain(neighbours: &[Vec<usize>]) -> Option<Vec<usize>> {
    if neighbours.iter().any(|all| all.len() > 2) {
        return None;
    }
    let first = neighbours.iter().position(|all| all.len() == 1)?;
    let mut order = vec![first];
    while let Some(&next) = neighbours[order[order.len() - 1]].iter().find(|next| !order.contains(next)) {
        order.push(next);
    }
    (order.len() == neighbours.len()).then_some(order)
}

/// Nodes along a row of a chain, so that rows are about as full as each other.
fn longest_row(count: usize) -> usize {
    const MOST: usize = 6;
    count.div_ceil(count.div_ceil(MOST))
}

/// To and fro.
fn in_rows(order: Vec<usize>, length: usize) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0; 2]; order.len()];
    for (k, node) in order.into_iter().enumerate() {
        let (row, column) = (k / length, k % length);
        let column = if row % 2 == 0 { column } else { length - 1 - column };
        places[node] = [column as f64, row as f64];
    }
    places
}

fn grid(count: usize) -> Vec<[f64; 2]> {
    let width = ((1.6 * count as f64).sqrt().ceil() as usize).max(1);
    (0..count).map(|k| [(k % width) as f64, (k / width) as f64]).collect()
}

/// An order in which nodes that are joined follow each other where that is easily found.
fn around(neighbours: &[Vec<usize>]) -> Vec<usize> {
    let mut order: Vec<usize> = Vec::new();
    while order.len() < neighbours.len() {
        let joined = order.last().and_then(|&last| neighbours[last].iter().find(|next| !order.contains(next)));
        let next = joined.copied().or_else(|| (0..neighbours.len()).find(|next| !order.contains(next)));
        order.extend(next);
    }
    order
}

/// Clockwise from the top; neighbours on it are 1 apart.
fn on_a_circle(order: &[usize]) -> Vec<[f64; 2]> {
    let step = std::f64::consts::TAU / order.len() as f64;
    let radius = 0.5 / (0.5 * step).sin();
    let mut places = vec![[0.0; 2]; order.len()];
    for (k, &node) in order.iter().enumerate() {
        let angle = step * k as f64;
        places[node] = [radius * angle.sin(), -radius * angle.cos()];
    }
    places
}

/// Steps of the majorisation.
const STEPS: usize = 300;

/// Stress majorisation (Gansner, Koren, North, "Graph drawing by stress majorization", 2004), from classical scaling: node i
/// moves to the weighted mean of where every other one wants it.
fn by_distance(neighbours: &[Vec<usize>]) -> Vec<[f64; 2]> {
    let wanted = distances(neighbours);
    let count = neighbours.len();
    let mut places = scaled(&wanted);
    for _ in 0..STEPS {
        for i in 0..count {
            let (mut sum, mut weights) = ([0.0; 2], 0.0);
            for j in (0..count).filter(|&j| j != i) {
                let apart = [places[i][0] - places[j][0], places[i][1] - places[j][1]];
                let length = apart[0].hypot(apart[1]).max(1e-9);
                let weight = wanted[(i, j)].powi(-2);
                for axis in 0..2 {
                    sum[axis] += weight * (places[j][axis] + wanted[(i, j)] * apart[axis] / length);
                }
                weights += weight;
            }
            places[i] = sum.map(|sum| sum / weights);
        }
    }
    lying(places)
}

/// Steps along the graph; parts that nothing joins are a little farther apart than the longest of these.
fn distances(neighbours: &[Vec<usize>]) -> DMatrix<f64> {
    let count = neighbours.len();
    let mut distances = DMatrix::from_element(count, count, f64::INFINITY);
    for start in 0..count {
        distances[(start, start)] = 0.0;
        let mut front = vec![start];
        while let Some(node) = (!front.is_empty()).then(|| front.remove(0)) {
            for &next in &neighbours[node] {
                if distances[(start, next)].is_infinite() {
                    distances[(start, next)] = distances[(start, node)] + 1.0;
                    front.push(next);
                }
            }
        }
    }
    let longest = distances.iter().copied().filter(|d| d.is_finite()).fold(1.0, f64::max);
    distances.map(|d| if d.is_finite() { d } else { longest + 1.0 })
}

/// Classical scaling: the two leading axes of the doubly centred squared distances.
fn scaled(distances: &DMatrix<f64>) -> Vec<[f64; 2]> {
    let count = distances.nrows();
    let squares = distances.map(|d| -0.5 * d * d);
    let means = DVector::from_fn(count, |i, _| squares.row(i).mean());
    let mean = means.mean();
    let centred = DMatrix::from_fn(count, count, |i, j| squares[(i, j)] - means[i] - means[j] + mean);
    let eigen = centred.symmetric_eigen();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let axis = |k: usize| eigen.eigenvectors.column(order[k]) * eigen.eigenvalues[order[k]].max(0.0).sqrt();
    let (x, y) = (axis(0), axis(1));
    // A little apart where distances cannot tell nodes apart.
    (0..count).map(|i| [x[i] + 1e-3 * i as f64, y[i] + 1e-3 * ((i * i) % 7) as f64]).collect()
}

/// Turned so that the long side lies, with the first node on the left and above.
fn lying(places: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let count = places.len() as f64;
    let mean = [0, 1].map(|axis| places.iter().map(|place| place[axis]).sum::<f64>() / count);
    let moment = |a: usize, b: usize| places.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>();
    let angle = 0.5 * (2.0 * moment(0, 1)).atan2(moment(0, 0) - moment(1, 1));
    let (sin, cos) = angle.sin_cos();
    let turned = places.iter().map(|p| {
        let [x, y] = [p[0] - mean[0], p[1] - mean[1]];
        [cos * x + sin * y, cos * y - sin * x]
    });
    let turned: Vec<[f64; 2]> = turned.collect();
    let flips = [0, 1].map(|axis| if turned[0][axis] > 0.0 { -1.0 } else { 1.0 });
    turned.into_iter().map(|p| [p[0] * flips[0], p[1] * flips[1]]).collect()
}

fn from_zero(places: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let least = [0, 1].map(|axis| places.iter().map(|place| place[axis]).fold(f64::INFINITY, f64::min));
    places.into_iter().map(|place| [place[0] - least[0], place[1] - least[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn closest(layout: &Layout) -> f64 {
        let places = &layout.places;
        let pairs = (0..places.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        let apart = |(i, j): (usize, usize)| (places[i][0] - places[j][0]).hypot(places[i][1] - places[j][1]);
        pairs.map(apart).fold(f64::INFINITY, f64::min)
    }

    fn grid_of(width: usize, height: usize) -> Vec<(usize, usize)> {
        let nodes = 0..width * height;
        let right = nodes.clone().filter(|k| k % width + 1 < width).map(|k| (k, k + 1));
        right.chain(nodes.filter(|k| k / width + 1 < height).map(|k| (k, k + width))).collect()
    }

    #[test]
    fn a_chain_goes_to_and_fro() {
        let layout = Layout::new(10, &(0..9).map(|k| (k, k + 1)).collect::<Vec<_>>());
        assert_eq!(layout.size(), [4.0, 1.0]);
        assert_eq!(layout.places[5], [4.0, 1.0]);
    }

    #[test]
    fn nodes_do_not_cover_each_other() {
        let star: Vec<_> = (1..12).map(|k| (0, k)).collect();
        let two_parts = vec![(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (6, 3)];
        for (count, pairs) in [(36, grid_of(6, 6)), (12, star), (7, two_parts), (9, Vec::new()), (4, grid_of(2, 2))] {
            let layout = Layout::new(count, &pairs);
            assert!(closest(&layout) > 0.5, "{count} nodes: {}", closest(&layout));
            assert!(layout.places.iter().flatten().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn a_grid_is_drawn_as_one() {
        let layout = Layout::new(24, &grid_of(6, 4));
        let [width, height] = layout.size();
        assert!(width > 1.2 * height && width < 7.0, "{width} x {height}");
    }

    #[test]
    fn one_node_or_none_is_no_mistake() {
        assert_eq!(Layout::new(1, &[]).places, [[0.0, 0.0]]);
        assert!(Layout::new(0, &[]).places.is_empty());
    }
}
