//! Pictures over time: panels stacked over one time axis, as SVG. Knows no plant.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
pub use plotters::style::RGBColor as Colour;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// What plotters says went wrong while drawing.
pub type DrawError = Box<dyn std::error::Error + Send + Sync>;

/// Colours that stay apart for colour-blind eyes: M. Okabe and K. Ito, "Color Universal Design", 2008.
pub mod colour {
    use plotters::style::RGBColor;

    pub const BLACK: RGBColor = RGBColor(0, 0, 0);
    pub const GREY: RGBColor = RGBColor(120, 120, 120);
    pub const BLUE: RGBColor = RGBColor(0, 114, 178);
    pub const SKY: RGBColor = RGBColor(86, 180, 233);
    pub const ORANGE: RGBColor = RGBColor(230, 159, 0);
    pub const VERMILION: RGBColor = RGBColor(213, 94, 0);
}

/// Panels over a common time axis.
#[derive(Debug, Clone)]
pub struct Figure {
    pub title: String,
    /// The time axis runs from 0 to this, s.
    pub end: f64,
    pub panels: Vec<Panel>,
    /// What happened at single moments: thin lines across all panels.
    pub marks: Vec<Mark>,
}

/// A moment.
#[derive(Debug, Clone)]
pub struct Mark {
    /// s.
    pub time: f64,
    pub colour: RGBColor,
}

/// One quantity, or several in the same unit, over time.
#[derive(Debug, Clone)]
pub struct Panel {
    /// What the axis says: `y1 [cm]`.
    pub axis: String,
    /// Height of the plotting area, px.
    pub height: u32,
    pub lines: Vec<Line>,
    pub bands: Vec<Band>,
    pub limits: Vec<Limit>,
}

#[derive(Debug, Clone)]
pub struct Line {
    pub label: String,
    /// (time in s, value), in order of time.
    pub points: Vec<(f64, f64)>,
    pub stroke: Stroke,
    pub colour: RGBColor,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    Solid,
    Dashed,
    DashDotted,
    Dotted,
}

/// Values from `low` to `high`, shaded.
#[derive(Debug, Clone)]
pub struct Band {
    pub label: String,
    pub low: f64,
    pub high: f64,
    pub colour: RGBColor,
}

/// Value that must not be passed: a thin line where the panel's range reaches it, else a note beside the legend.
#[derive(Debug, Clone)]
pub struct Limit {
    /// `h1 ≤ 27.6 cm`; empty where another limit's label covers this one.
    pub label: String,
    pub value: f64,
    /// Whether the panel's range is widened to reach it.
    pub show: bool,
    pub colour: RGBColor,
}

/// Drawn twice as large as shown: the SVG writer rounds to whole pixels, and half of one is fine enough.
const SCALE: u32 = 2;
const WIDTH: u32 = 900 * SCALE;
const TITLE: u32 = 34 * SCALE;
const LEGEND: u32 = 28 * SCALE;
const TIME_AXIS: u32 = 44 * SCALE;
const LEFT: u32 = 66 * SCALE;
/// Between the picture's edge and the axis' name: viewers disagree where rotated letters stand.
const EDGE: u32 = 10 * SCALE;
const RIGHT: u32 = 22 * SCALE;
const TEXT: u32 = 13 * SCALE;
const THICK: u32 = 3 * SCALE / 2;
/// Length of a line's sample in the legend.
const SAMPLE: i32 = 34 * SCALE as i32;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn = Result<(), DrawError>;

impl Figure {
    /// The picture as the text of an SVG file.
    ///
    /// # Errors
    /// What plotters reports.
    pub fn to_svg(&self) -> Result<String, DrawError> {
        let height = TITLE + TIME_AXIS + self.panels.iter().map(|panel| LEGEND + panel.height * SCALE).sum::<u32>();
        let mut svg = String::new();
        self.draw(&SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area())?;
        let drawn = format!("width=\"{WIDTH}\" height=\"{height}\"");
        let shown = format!("width=\"{}\" height=\"{}\"", WIDTH / SCALE, height / SCALE);
        Ok(svg.replacen(&drawn, &shown, 1))
    }

    fn draw(&self, root: &Area) -> Drawn {
        root.fill(&WHITE)?;
        let title = text(TEXT + 2 * SCALE, colour::BLACK, HPos::Left);
        root.draw_text(&self.title, &title, (LEFT as i32, TITLE as i32 / 2))?;
        let mut rest = root.split_vertically(TITLE).1;
        for (k, panel) in self.panels.iter().enumerate() {
            let time_axis = if k + 1 == self.panels.len() { TIME_AXIS } else { 0 };
            let (top, below) = rest.split_vertically(LEGEND + panel.height * SCALE + time_axis);
            let (legend, plot) = top.split_vertically(LEGEND);
            panel.draw_legend(&legend)?;
            panel.draw(&plot, self.end, time_axis, &self.marks)?;
            rest = below;
        }
        root.present()?;
        Ok(())
    }
}

impl Panel {
    fn draw(&self, area: &Area, end: f64, time_axis: u32, marks: &[Mark]) -> Drawn {
        let (low, high) = self.range();
        let mut chart = ChartBuilder::on(area)
            .margin_left(EDGE)
            .margin_right(RIGHT)
            .set_label_area_size(LabelAreaPosition::Left, LEFT - EDGE)
            .set_label_area_size(LabelAreaPosition::Bottom, time_axis)
            .build_cartesian_2d(0.0..end, low..high)?;
        for band in &self.bands {
            chart.draw_series([Rectangle::new([(0.0, band.low), (end, band.high)], band.fill())])?;
        }
        self.draw_mesh(&mut chart, time_axis > 0, high - low)?;
        for mark in marks {
            let upright = [(mark.time, low), (mark.time, high)];
            Stroke::Dotted.draw(area, &pixels(&chart, area, &upright), mark.colour)?;
        }
        for limit in self.limits.iter().filter(|limit| self.reaches(limit)) {
            let across = [(0.0, limit.value), (end, limit.value)];
            Stroke::Dotted.draw(area, &pixels(&chart, area, &across), limit.colour)?;
        }
        for line in &self.lines {
            line.stroke.draw(area, &pixels(&chart, area, &line.points), line.colour)?;
        }
        Ok(())
    }

    fn draw_mesh(&self, chart: &mut Chart, with_time: bool, span: f64) -> Drawn {
        let style = ("sans-serif", TEXT).into_font().color(&colour::BLACK);
        let label = |value: &f64| number(*value);
        let value_label = |value: &f64| short(*value, decimals(span));
        let mut mesh = chart.configure_mesh();
        mesh.light_line_style(TRANSPARENT).bold_line_style(colour::GREY.mix(0.25)).axis_style(colour::GREY);
        mesh.label_style(style.clone()).axis_desc_style(style);
        mesh.x_labels(13).y_labels(6).x_label_formatter(&label).y_label_formatter(&value_label).y_desc(&self.axis);
        if with_time {
            mesh.x_desc("time [s]");
        }
        mesh.draw()?;
        Ok(())
    }

    fn draw_legend(&self, area: &Area) -> Drawn {
        let middle = LEGEND as i32 / 2 + SCALE as i32;
        let mut x = LEFT as i32;
        for band in &self.bands {
            let half = 5 * SCALE as i32;
            area.draw(&Rectangle::new([(x, middle - half), (x + SAMPLE, middle + half)], band.fill()))?;
            x = write_label(area, (x, middle), &band.label)?;
        }
        for line in &self.lines {
            line.stroke.draw(area, &[(x, middle), (x + SAMPLE, middle)], line.colour)?;
            x = write_label(area, (x, middle), &line.label)?;
        }
        for limit in self.limits.iter().filter(|limit| self.reaches(limit) && !limit.label.is_empty()) {
            Stroke::Dotted.draw(area, &[(x, middle), (x + SAMPLE, middle)], limit.colour)?;
            x = write_label(area, (x, middle), &limit.label)?;
        }
        let style = text(TEXT - SCALE, colour::GREY, HPos::Right);
        area.draw_text(&self.note(), &style, ((WIDTH - RIGHT) as i32, middle))?;
        Ok(())
    }

    /// What the legend says of limits that lie outside the panel.
    fn note(&self) -> String {
        let outside: Vec<_> =
            self.limits.iter().filter(|l| !self.reaches(l) && !l.label.is_empty()).map(|l| l.label.clone()).collect();
        if outside.is_empty() { String::new() } else { format!("off the scale: {}", outside.join(", ")) }
    }

    fn reaches(&self, limit: &Limit) -> bool {
        let (low, high) = self.range();
        (low..=high).contains(&limit.value)
    }

    /// Range of the axis: all that is drawn, and a margin.
    fn range(&self) -> (f64, f64) {
        let lines = self.lines.iter().flat_map(|line| line.points.iter().map(|point| point.1));
        let bands = self.bands.iter().flat_map(|band| [band.low, band.high]);
        let limits = self.limits.iter().filter(|limit| limit.show).map(|limit| limit.value);
        let drawn = lines.chain(bands).chain(limits);
        let (low, high) = drawn.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let margin = 0.06 * (high - low).max(1e-3);
        (low - margin, high + margin)
    }
}

impl Band {
    fn fill(&self) -> ShapeStyle {
        self.colour.mix(0.16).filled()
    }
}

impl Stroke {
    /// Lengths of pen down, pen up, pen down, ... in px; empty for a pen that stays down.
    fn pattern(self) -> &'static [f64] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[7.0, 4.0],
            Self::DashDotted => &[9.0, 3.0, 2.0, 3.0],
            Self::Dotted => &[1.5, 2.5],
        }
    }

    fn draw(self, area: &Area, path: &[Pixel], colour: RGBColor) -> Drawn {
        let pattern: Vec<_> = self.pattern().iter().map(|length| length * f64::from(SCALE)).collect();
        for piece in dashes(path, &pattern) {
            area.draw(&PathElement::new(piece, colour.stroke_width(THICK)))?;
        }
        Ok(())
    }
}

type Pixel = (i32, i32);

/// The pieces of `path` that a pen leaves which goes down and up in turn along the lengths of `pattern`.
fn dashes(path: &[Pixel], pattern: &[f64]) -> Vec<Vec<Pixel>> {
    if pattern.is_empty() {
        return vec![path.to_vec()];
    }
    let mut pen = Pen { pattern, phase: 0, left: pattern[0], pieces: vec![path.iter().take(1).copied().collect()] };
    path.windows(2).for_each(|ends| pen.go(ends[0], ends[1]));
    pen.pieces.retain(|piece| piece.len() > 1);
    pen.pieces
}

struct Pen<'a> {
    pattern: &'a [f64],
    /// Where in the pattern; the pen is down in even phases.
    phase: usize,
    /// Length left of this phase.
    left: f64,
    pieces: Vec<Vec<Pixel>>,
}

impl Pen<'_> {
    fn go(&mut self, from: Pixel, to: Pixel) {
        let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
        let length = (dx * dx + dy * dy).sqrt();
        let mut gone = 0.0;
        while length - gone > self.left {
            gone += self.left;
            let share = gone / length;
            self.turn((from.0 + (share * dx).round() as i32, from.1 + (share * dy).round() as i32));
        }
        self.left -= length - gone;
        self.touch(to);
    }

    fn turn(&mut self, at: Pixel) {
        self.touch(at);
        self.phase = (self.phase + 1) % self.pattern.len();
        self.left = self.pattern[self.phase];
        if self.phase.is_multiple_of(2) {
            self.pieces.push(vec![at]);
        }
    }

    fn touch(&mut self, at: Pixel) {
        if let (0, Some(piece)) = (self.phase % 2, self.pieces.last_mut()) {
            piece.push(at);
        }
    }
}

/// `points` of the chart as pixels of `area`, in which the chart is drawn.
fn pixels(chart: &Chart, area: &Area, points: &[(f64, f64)]) -> Vec<Pixel> {
    let (x, y) = area.get_pixel_range();
    let on_area = |(px, py): Pixel| (px - x.start, py - y.start);
    straightened(points.iter().map(|point| on_area(chart.backend_coord(point))))
}

/// The same line without the points that lie on the way from the one before to the one after.
fn straightened(points: impl Iterator<Item = Pixel>) -> Vec<Pixel> {
    let mut kept: Vec<Pixel> = Vec::new();
    for next in points {
        while let [.., before, last] = kept[..]
            && on_the_way(before, last, next)
        {
            kept.pop();
        }
        kept.push(next);
    }
    kept
}

fn on_the_way(from: Pixel, by: Pixel, to: Pixel) -> bool {
    let (first, second) = ((by.0 - from.0, by.1 - from.1), (to.0 - by.0, to.1 - by.1));
    let turns = i64::from(first.0) * i64::from(second.1) != i64::from(first.1) * i64::from(second.0);
    let turns_back = i64::from(first.0) * i64::from(second.0) + i64::from(first.1) * i64::from(second.1) < 0;
    !turns && !turns_back
}

/// Writes what belongs to the sample at `at`; returns where the next sample begins.
fn write_label(area: &Area, at: Pixel, label: &str) -> Result<i32, DrawError> {
    let start = at.0 + SAMPLE + 6 * SCALE as i32;
    area.draw_text(label, &text(TEXT, colour::BLACK, HPos::Left), (start, at.1))?;
    // The viewer's font is not known here; sans-serif letters are about half as wide as high.
    let width = 0.52 * f64::from(TEXT) * label.chars().count() as f64;
    Ok(start + width as i32 + 18 * SCALE as i32)
}

fn text(size: u32, colour: RGBColor, side: HPos) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&colour).pos(Pos::new(side, VPos::Center))
}

/// At most three decimals, no trailing zeros, a true minus sign.
pub fn number(value: f64) -> String {
    short(value, 3)
}

/// As many decimals as tell the labels of an axis over `span` apart, at least three.
fn decimals(span: f64) -> usize {
    (1..12).find(|k| span * 10f64.powi(*k) >= 10.0).map_or(12, |k| k as usize + 1).max(3)
}

fn short(value: f64, decimals: usize) -> String {
    let digits = format!("{value:.decimals$}");
    let short = digits.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.replace('-', "\u{2212}") }
}

#[cfg(test)]
mod tests {
    use super::{dashes, decimals, number, short, straightened};

    #[test]
    fn a_pattern_goes_on_over_corners() {
        let corner = [(0, 0), (10, 0), (10, 10)];
        let pieces = dashes(&corner, &[8.0, 1.0, 5.0, 2.0]);
        assert_eq!(pieces, vec![vec![(0, 0), (8, 0)], vec![(9, 0), (10, 0), (10, 4)], vec![(10, 6), (10, 10)]]);
        assert_eq!(dashes(&corner, &[]), vec![corner.to_vec()]);
    }

    #[test]
    fn points_on_the_way_are_left_out_and_corners_kept() {
        let points = [(0, 0), (1, 0), (1, 0), (3, 0), (3, 4), (3, 2), (4, 3), (6, 5), (6, 5)];
        let kept = straightened(points.into_iter());
        assert_eq!(kept, [(0, 0), (3, 0), (3, 4), (3, 2), (6, 5)]);
    }

    #[test]
    fn numbers_are_short() {
        let written = [-1.0, -0.000_01, 0.3, 12.345_6, 100.0].map(number);
        assert_eq!(written, ["\u{2212}1", "0", "0.3", "12.346", "100"]);
    }

    #[test]
    fn small_axes_have_labels_that_differ() {
        assert_eq!([1000.0, 1.0, 0.01, 1e-3, 2e-6].map(decimals), [3, 3, 4, 5, 8]);
        assert_eq!([1.25e-4, 1.5e-4].map(|value| short(value, decimals(1e-4))), ["0.000125", "0.00015"]);
    }
}
