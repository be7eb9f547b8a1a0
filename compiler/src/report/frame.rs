//! Axes of a chart: from the user's numbers to places in an SVG.

use maud::{Markup, html};

use crate::summary::short;

/// A rectangle of the page that shows a range of two quantities. y points up.
#[derive(Debug, Clone)]
pub struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl Frame {
    pub fn px(&self, x: f64) -> f64 {
        self.left + self.width * (x - self.x[0]) / (self.x[1] - self.x[0])
    }

    pub fn py(&self, y: f64) -> f64 {
        self.top + self.height * (self.y[1] - y) / (self.y[1] - self.y[0])
    }

    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// `x,y x,y ...` for polygons and polylines.
    pub fn points<'a>(&self, all: impl IntoIterator<Item = &'a [f64; 2]>) -> String {
        let mut text = String::new();
        for [x, y] in all {
            if !text.is_empty() {
                text.push(' ');
            }
            text += &format!("{},{}", place(self.px(*x)), place(self.py(*y)));
        }
        text
    }

    /// What the script needs to read numbers off: left, top, width, height, then both ranges.
    pub fn data(&self) -> String {
        let Self { left, top, width, height, x, y } = self;
        format!("{left} {top} {width} {height} {:e} {:e} {:e} {:e}", x[0], x[1], y[0], y[1])
    }

    /// Border, grid lines with numbers, and names of the axes.
    pub fn axes(&self, x_name: &str, y_name: &str) -> Markup {
        html! {
            rect.frame x=(place(self.left)) y=(place(self.top)) width=(place(self.width)) height=(place(self.height)) {}
            g.grid {
                @for x in ticks(self.x, 6) {
                    line x1=(place(self.px(x))) x2=(place(self.px(x))) y1=(place(self.top)) y2=(place(self.bottom())) {}
                    text x=(place(self.px(x))) y=(place(self.bottom() + 13.0)) text-anchor="middle" { (short(x)) }
                }
                @for y in ticks(self.y, 5) {
                    line y1=(place(self.py(y))) y2=(place(self.py(y))) x1=(place(self.left)) x2=(place(self.right())) {}
                    text x=(place(self.left - 5.0)) y=(place(self.py(y) + 3.5)) text-anchor="end" { (short(y)) }
                }
            }
            @if !x_name.is_empty() {
                text.axis x=(place(self.left + 0.5 * self.width)) y=(place(self.bottom() + 29.0)) text-anchor="middle" { (x_name) }
            }
            @if !y_name.is_empty() {
                text.axis x=(place(self.left - 44.0)) y=(place(self.top + 0.5 * self.height)) text-anchor="middle"
                    transform=(format!("rotate(-90 {} {})", place(self.left - 44.0), place(self.top + 0.5 * self.height))) { (y_name) }
            }
        }
    }
}

/// A coordinate with two decimals at most.
pub fn place(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Round numbers within a range, about `count` of them.
pub fn ticks([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let width = high - low;
    if !(width > 0.0 && width.is_finite()) {
        return Vec::new();
    }
    let rough = width / count as f64;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= rough * 0.999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// The range with a margin of that share on both sides; 1 wide where it has no width.
pub fn padded([low, high]: [f64; 2], share: f64) -> [f64; 2] {
    let width = if high > low { high - low } else { 1.0 };
    [low - share * width, high + share * width]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([-12.4, 27.6], 5), [-10.0, 0.0, 10.0, 20.0]);
        assert_eq!(ticks([0.0, 1.0], 5), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert!(ticks([1.0, 1.0], 5).is_empty() && ticks([0.0, f64::INFINITY], 5).is_empty());
    }

    #[test]
    fn places_are_short() {
        assert_eq!([1.0, 1.25, -0.001, 10.126].map(place), ["1", "1.25", "0", "10.13"]);
    }
}
