//! The sets of one subsystem in planes: two of its states, inputs, outputs or coupling outputs.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::frame::padded;
use super::outline::{Outline, Point, Segment, clipped, selection};
use super::steady::{Row, SteadyStates};
use super::words::label;
use crate::convex::{Polytope, Strips, multiplier};
use crate::design::Design;
use crate::network::NamedPolytope;
use crate::sets::closed_loop_z;
use crate::sizing::SubsystemSizing;

/// Sets in the plane of two signals.
#[derive(Debug, Clone)]
pub struct Plane {
    pub of: Family,
    /// With units, horizontal first.
    pub names: [String; 2],
    /// What the frame shows of both.
    pub ranges: [Point; 2],
    /// Larger ones first, as they are drawn over each other.
    pub shapes: Vec<Shape>,
}

/// What a plane's signals are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    States,
    Inputs,
    Outputs,
    CouplingOutputs,
}

/// One set.
#[derive(Debug, Clone)]
pub struct Shape {
    pub kind: Kind,
    /// `None` where it was not found, as where a linear program failed.
    pub outline: Option<Outline>,
    /// Whether it goes on beyond the frame.
    pub is_cut: bool,
}

/// What a set is; colours, names and equations follow from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Limits,
    Tightened,
    SteadyStates,
    Tube,
    Terminal,
    SetPoints,
    Contract,
    Reserve,
}

/// Both planes of a pair of states.
#[derive(Debug, Clone)]
pub struct StatePlanes {
    /// Where states may be.
    pub places: Plane,
    /// How far states may be off, about 0.
    pub errors: Plane,
}

impl Plane {
    /// Whether nothing of a set that is there can be seen in the frame.
    pub fn hides(&self, shape: &Shape) -> bool {
        let Some(outline) = &shape.outline else { return true };
        let ranges = outline.ranges();
        (0..2).all(|axis| (ranges[axis][1] - ranges[axis][0]) < LEAST * (self.ranges[axis][1] - self.ranges[axis][0]))
    }
}

/// Share of the frame below which a set is a point.
const LEAST: f64 = 0.004;
/// Bounds that are so many times farther than anything that happens are not shown.
const FAR: f64 = 40.0;

/// Pairs of states of subsystem i, the most telling one first, at most `most` of them: outputs against each other, then an
/// output's state and the one that moves it most, then by how much states move each other.
pub fn state_pairs(design: &Design, i: usize, most: usize) -> Vec<[usize; 2]> {
    let s = &design.network.subsystems[i];
    let F = &design.gains.subsystems[i].F;
    let size = &design.sets.subsystems[i].scales.x;
    let read = |k: usize| (0..s.p()).any(|row| s.C[(row, k)] != 0.0);
    let moves = |a: usize, b: usize| {
        let one = |to: usize, from: usize| (F[(to, from)] * size[from] / size[to]).abs();
        one(a, b).max(one(b, a)).min(1e3)
    };
    let worth = |[a, b]: &[usize; 2]| 2e3 * f64::from(u8::from(read(*a)) + u8::from(read(*b))) + moves(*a, *b);
    let mut pairs: Vec<[usize; 2]> = (0..s.n()).flat_map(|b| (0..b).map(move |a| [a, b])).collect();
    pairs.sort_by(|one, other| worth(other).total_cmp(&worth(one)).then(one.cmp(other)));
    pairs.truncate(most);
    pairs
}

/// The sets over states `axes` of subsystem i.
pub fn states(design: &Design, steady: &SteadyStates, i: usize, axes: [usize; 2]) -> StatePlanes {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let map = selection(s.n(), axes);
    let at_rest = AtRest::new(design, axes.map(|k| steady.state(design, i, k)));
    let names = axes.map(|k| label(&s.states[k]));
    let limits = [&plain(&s.X), &sized.X_nom];
    let (places, errors) =
        (Placed { design, i, of_limits: &map, of_errors: &map, at_rest, limits }).plane(Family::States, names.clone());
    let ranges = errors.map(|range| padded(range, 0.12));
    let shapes = deviations(sized, &map, widths(ranges));
    StatePlanes { places, errors: Plane { of: Family::States, names, ranges, shapes } }
}

/// The sets over two inputs: U_i, Uhat_i, the inputs at rest, and what K_i makes of Sigma_i and E_i.
pub fn inputs(design: &Design, steady: &SteadyStates, i: usize, axes: [usize; 2]) -> Plane {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let K = design.gains.subsystems[i].K.select_rows(&axes);
    let at_rest = AtRest::new(design, axes.map(|k| steady.input(design, i, k)));
    let limits = [&plain(&s.U), &sized.U_nom];
    let placed = Placed { design, i, of_limits: &selection(s.m(), axes), of_errors: &K, at_rest, limits };
    placed.plane(Family::Inputs, axes.map(|k| label(&s.inputs[k]))).0
}

/// The sets over two outputs: C_i X_i, C_i Xhat_i and Y_i.
pub fn outputs(design: &Design, i: usize, axes: [usize; 2]) -> Plane {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let C = s.C.select_rows(&axes);
    let Y = axes.map(|k| [sized.Y.min[k], sized.Y.max[k]]);
    let X = plain(&s.X);
    let ranges = [0, 1].map(|a| padded(shown(&X, &C.row(a).transpose(), Y[a]), 0.06));
    let shapes = vec![
        Shape::cut(Kind::Limits, &X, &C, ranges),
        Shape::cut(Kind::Tightened, &sized.X_nom, &C, ranges),
        Shape::whole(Kind::SetPoints, Some(rectangle(Y))),
    ];
    Plane { of: Family::Outputs, names: axes.map(|k| label(&s.outputs[k])), ranges, shapes }
}

/// The sets over two coupling outputs: Z_i, Delta_i^z, and what C_zi + D_zi K_i makes of E_i and Sigma_i.
pub fn coupling_outputs(design: &Design, i: usize, axes: [usize; 2]) -> Plane {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let map = closed_loop_z(s, &design.gains.subsystems[i]).select_rows(&axes);
    let symmetric = |half: &DVector<f64>| rectangle(axes.map(|k| [-half[k], half[k]]));
    let ranges = axes.map(|k| padded([-sized.zeta[k], sized.zeta[k]], 0.08));
    let size = ranges.map(|[low, high]| high - low);
    let image = |set: &Strips| Outline::of_image(&set.to_polytope(), &map, size);
    let shapes = vec![
        Shape::whole(Kind::Contract, Some(symmetric(&sized.zeta))),
        Shape::whole(Kind::Tube, image(&sized.E)),
        Shape::whole(Kind::Reserve, Some(symmetric(&sized.dz))),
        Shape::whole(Kind::Terminal, image(&sized.Sigma)),
    ];
    Plane { of: Family::CouplingOutputs, names: axes.map(|k| s.coupling_outputs[k].clone()), ranges, shapes }
}

/// States or inputs: limits, places at rest, and deviations from them.
struct Placed<'a> {
    design: &'a Design,
    i: usize,
    /// The plane of the limits' variables, and of the states that are off.
    of_limits: &'a DMatrix<f64>,
    of_errors: &'a DMatrix<f64>,
    at_rest: Option<AtRest<'a>>,
    /// As given, and tightened.
    limits: [&'a Polytope; 2],
}

impl Placed<'_> {
    /// The plane, and how far deviations reach in it.
    fn plane(&self, of: Family, names: [String; 2]) -> (Plane, [Point; 2]) {
        let sized = &self.design.sizing.subsystems[self.i];
        let errors = [0, 1].map(|a| reach(sized, &self.of_errors.row(a).transpose()));
        let inner = [0, 1].map(|a| wider(errors[a], self.at_rest.as_ref().map(|rest| rest.range(a))));
        let direction = |a: usize| self.of_limits.row(a).transpose();
        let ranges = [0, 1].map(|a| padded(shown(self.limits[0], &direction(a), inner[a]), 0.06));
        let kinds = [Kind::Limits, Kind::Tightened].into_iter().zip(self.limits);
        let limits = kinds.map(|(kind, set)| Shape::cut(kind, set, self.of_limits, ranges));
        let rest = self.at_rest.iter().map(|rest| Shape::whole(Kind::SteadyStates, rest.outline(widths(ranges))));
        let errors_drawn = deviations(sized, self.of_errors, widths(ranges));
        (Plane { of, names, ranges, shapes: limits.chain(rest).chain(errors_drawn).collect() }, errors)
    }
}

/// Sigma_i and E_i, about 0.
fn deviations(sized: &SubsystemSizing, map: &DMatrix<f64>, size: Point) -> Vec<Shape> {
    let of = |kind: Kind, set: &Strips| Shape::whole(kind, Outline::of_image(&set.to_polytope(), map, size));
    vec![of(Kind::Terminal, &sized.Sigma), of(Kind::Tube, &sized.E)]
}

fn widths(ranges: [Point; 2]) -> Point {
    ranges.map(|[low, high]| high - low)
}

impl Shape {
    fn whole(kind: Kind, outline: Option<Outline>) -> Self {
        Self { kind, outline, is_cut: false }
    }

    /// The image of a set, within the frame, and whether the frame cuts it.
    fn cut(kind: Kind, set: &Polytope, map: &DMatrix<f64>, ranges: [Point; 2]) -> Self {
        let outline = Outline::of_image(&clipped(set, map, ranges), map, widths(ranges));
        Self { kind, is_cut: outline.as_ref().is_some_and(|outline| touches(outline, ranges)), outline }
    }
}

fn touches(outline: &Outline, frame: [Point; 2]) -> bool {
    let ranges = outline.ranges();
    (0..2).any(|axis| {
        let near = 1e-6 * (frame[axis][1] - frame[axis][0]);
        ranges[axis][0] <= frame[axis][0] + near || ranges[axis][1] >= frame[axis][1] - near
    })
}

fn rectangle([x, y]: [Point; 2]) -> Outline {
    Outline { vertices: vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]] }
}

fn plain(set: &NamedPolytope) -> Polytope {
    Polytope { H: set.H.clone(), h: set.h.clone() }
}

/// What the frame shows in direction d: as far as the set reaches, but not much farther than `inner`.
fn shown(set: &Polytope, d: &DVector<f64>, inner: Point) -> Point {
    let reach = |sign: f64| set.support(&(d * sign)).map(|(value, _)| value * sign);
    let size = (inner[1] - inner[0]).max(1e-9);
    let end = |bound: Option<f64>, inner: f64, sign: f64| match bound {
        Some(bound) if bound.is_finite() && (bound - inner).abs() < FAR * size => bound,
        _ => inner + 0.4 * sign * size,
    };
    [end(reach(-1.0), inner[0], -1.0), end(reach(1.0), inner[1], 1.0)]
}

/// The range that E_i and Sigma_i take in direction d.
fn reach(sized: &SubsystemSizing, d: &DVector<f64>) -> Point {
    let of = |set: &Strips| multiplier(&set.P, &set.q, d).map_or(0.0, |proof| proof.on(&set.q));
    let half = of(&sized.E).max(of(&sized.Sigma));
    [-half, half]
}

fn wider(one: Point, other: Option<Point>) -> Point {
    other.map_or(one, |other| [one[0].min(other[0]), one[1].max(other[1])])
}

/// Two rows over the outputs of the network at rest, which are anywhere in the product of all Y_i.
struct AtRest<'a> {
    design: &'a Design,
    rows: [Row; 2],
}

impl<'a> AtRest<'a> {
    fn new(design: &'a Design, [x, y]: [Option<Row>; 2]) -> Option<Self> {
        Some(Self { design, rows: [x?, y?] })
    }

    fn range(&self, axis: usize) -> Point {
        self.rows[axis].iter().fold([0.0, 0.0], |[low, high], &(y, gain)| {
            let ends = self.ends(y).map(|end| gain * end);
            [low + ends[0].min(ends[1]), high + ends[0].max(ends[1])]
        })
    }

    fn outline(&self, size: Point) -> Option<Outline> {
        let [x, y] = self.rows.each_ref().map(|row| row.iter().copied().collect::<BTreeMap<usize, f64>>());
        let outputs: BTreeSet<usize> = x.keys().chain(y.keys()).copied().collect();
        let gain = |row: &BTreeMap<usize, f64>, k: usize| row.get(&k).copied().unwrap_or(0.0);
        let segment = |k: usize| {
            let [low, high] = self.ends(k);
            Segment { along: [gain(&x, k), gain(&y, k)], low, high }
        };
        Outline::of_segments(&outputs.into_iter().map(segment).collect::<Vec<_>>(), size)
    }

    /// Of entry y of the collective outputs.
    fn ends(&self, y: usize) -> Point {
        let starts = &self.design.gains.y_offset;
        let owner = starts.partition_point(|start| *start <= y) - 1;
        let (Y, k) = (&self.design.sizing.subsystems[owner].Y, y - starts[owner]);
        [Y.min[k], Y.max[k]]
    }
}
