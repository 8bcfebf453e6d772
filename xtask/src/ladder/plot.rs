//! Error against milliseconds, log-log, as SVG: a colour per method, a marker per executor, the Pareto fronts as lines.

use std::ops::Range;

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::front::{Price, digits};

/// A scene's prices in one kind of error.
pub(super) struct Plot {
    /// Above it.
    pub(super) title: String,
    /// What the error is.
    pub(super) error: &'static str,
    /// One a rung and executor.
    pub(super) points: Vec<Point>,
}

/// A rung on an executor.
pub(super) struct Point {
    pub(super) price: Price,
    /// One of the family's.
    pub(super) method: &'static str,
    pub(super) executor: &'static str,
    pub(super) on_front: bool,
    /// Beside the marker where it is on the front.
    pub(super) label: String,
}

/// Plots that share a legend.
pub(super) struct Family {
    /// Names of the methods, in the order of their colours.
    pub(super) methods: &'static [&'static str],
    /// What lines are, and what their labels say.
    pub(super) labels: &'static str,
}

impl Family {
    fn color(&self, method: &str) -> RGBColor {
        let place = self.methods.iter().position(|name| *name == method);
        COLORS[place.unwrap_or_default() % COLORS.len()]
    }
}

/// Told apart by people who see colours differently, too (Okabe & Ito).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

/// Readable on light and on dark pages.
const GREY: RGBColor = RGBColor(128, 128, 128);

/// Pixels of a plot, and of the legend above several.
const SIZE: (u32, u32) = (460, 330);
const LEGEND: u32 = 24;

/// Most ticks on an axis.
const TICKS: usize = 9;

/// An axis ends at no less than so many times where it starts.
const LEAST_EXTENT: f64 = 6.0;

/// Room round the points, as a factor.
const ROOM: f64 = 1.3;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Plots side by side under one legend, as one SVG.
pub(super) fn svg(plots: &[Plot], columns: usize, family: &Family) -> Result<String> {
    let columns = columns.clamp(1, plots.len().max(1));
    let rows = plots.len().div_ceil(columns).max(1);
    let mut text = String::new();
    let size = (SIZE.0 * columns as u32, SIZE.1 * rows as u32 + LEGEND);
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let (top, rest) = root.split_vertically(LEGEND);
        legend(&top, plots, family)?;
        for (area, plot) in rest.split_evenly((rows, columns)).iter().zip(plots) {
            draw(area, plot, family)?;
        }
        root.present().map_err(undrawable)?;
    }
    Ok(text)
}

fn undrawable(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}

fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&GREY)
}

/// Methods and executors that the plots have.
fn legend(area: &Area<'_>, plots: &[Plot], family: &Family) -> Result<()> {
    let points = || plots.iter().flat_map(|plot| &plot.points);
    let mut x = 14;
    let middle = LEGEND as i32 / 2;
    let style = font(13).pos(Pos::new(HPos::Left, VPos::Center));
    let mut entry = |marker: Option<(RGBColor, &'static str)>, text: &str| {
        if let Some((color, executor)) = marker {
            let marker = Marker { place: (x, middle), executor, radius: 5, style: color.filled() };
            area.draw(&marker).map_err(undrawable)?;
        }
        area.draw_text(text, &style, (x + 12, middle)).map_err(undrawable)?;
        x += 34 + 7 * text.chars().count() as i32;
        Ok::<_, anyhow::Error>(())
    };
    for method in family.methods.iter().filter(|method| points().any(|p| p.method == **method)) {
        entry(Some((family.color(method), EXECUTORS[0])), method)?;
    }
    for executor in EXECUTORS {
        if points().any(|p| p.executor == executor) {
            entry(Some((GREY, executor)), executor)?;
        }
    }
    entry(None, family.labels)
}

fn draw(area: &Area<'_>, plot: &Plot, family: &Family) -> Result<()> {
    let prices = || plot.points.iter().map(|point| point.price);
    let (Some(x), Some(y)) = (extent(prices().map(|p| p.ms)), extent(prices().map(|p| p.error))) else {
        let style = font(13);
        return area.draw_text(&format!("{}: no prices", plot.title), &style, (20, 20)).map_err(undrawable);
    };
    let mut chart = ChartBuilder::on(area)
        .caption(&plot.title, font(15))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(54)
        .build_cartesian_2d(
            x.clone().log_scale().with_key_points(ticks(&x)),
            y.clone().log_scale().with_key_points(ticks(&y)),
        )
        .map_err(undrawable)?;
    chart
        .configure_mesh()
        .axis_style(GREY)
        .bold_line_style(GREY.mix(0.3))
        .light_line_style(TRANSPARENT)
        .label_style(font(11))
        .axis_desc_style(font(12))
        .x_desc("milliseconds per frame")
        .y_desc(plot.error)
        .x_labels(TICKS)
        .y_labels(TICKS)
        .x_label_formatter(&|v| label(*v))
        .y_label_formatter(&|v| label(*v))
        .draw()
        .map_err(undrawable)?;
    for executor in EXECUTORS {
        let mut front: Vec<_> = plot.points.iter().filter(|p| p.on_front && p.executor == executor).collect();
        front.sort_by(|a, b| a.price.ms.total_cmp(&b.price.ms));
        let line = front.iter().map(|point| (point.price.ms, point.price.error));
        chart.draw_series(LineSeries::new(line, GREY.stroke_width(1))).map_err(undrawable)?;
    }
    let markers = plot.points.iter().map(|point| {
        let (radius, opacity) = if point.on_front { (5, 1.0) } else { (3, 0.5) };
        let style = family.color(point.method).mix(opacity).filled();
        Marker { place: (point.price.ms, point.price.error), executor: point.executor, radius, style }
    });
    chart.draw_series(markers).map_err(undrawable)?;
    // One executor's names will do: the others' fronts have much the same rungs.
    let named = EXECUTORS.into_iter().find(|executor| plot.points.iter().any(|p| p.executor == *executor));
    let labels = plot.points.iter().filter(|p| p.on_front && Some(p.executor) == named).map(|point| {
        let place = (point.price.ms, point.price.error);
        let mut style = font(10).pos(Pos::new(HPos::Left, VPos::Bottom));
        style.color = family.color(point.method).to_backend_color();
        EmptyElement::at(place) + Text::new(point.label.clone(), (6, -3), style)
    });
    chart.draw_series(labels).map_err(undrawable)?;
    Ok(())
}

/// In the order of their markers.
const EXECUTORS: [&str; 3] = ["cpu", "wgpu", "vulkan"];

/// A disc, a triangle or a cross at a place of a plot or of the legend.
struct Marker<C> {
    place: C,
    executor: &'static str,
    radius: i32,
    style: ShapeStyle,
}

impl<'a, C> PointCollection<'a, C> for &'a Marker<C> {
    type Point = &'a C;
    type IntoIter = std::iter::Once<&'a C>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.place)
    }
}

impl<C, B: DrawingBackend> Drawable<B> for Marker<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut places: I,
        backend: &mut B,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<B::ErrorType>> {
        let Some((x, y)) = places.next() else { return Ok(()) };
        let (r, style) = (self.radius, &self.style);
        match EXECUTORS.iter().position(|known| *known == self.executor) {
            Some(0) => backend.draw_circle((x, y), r as u32, style, true),
            Some(1) => backend.fill_polygon([(x, y - r - 1), (x + r + 1, y + r), (x - r - 1, y + r)], style),
            _ => {
                let style = style.stroke_width(2);
                backend.draw_line((x - r, y - r), (x + r, y + r), &style)?;
                backend.draw_line((x - r, y + r), (x + r, y - r), &style)
            }
        }
    }
}

/// From below the least to above the largest; none of nothing.
fn extent(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    // What is 0 has no place on a logarithmic axis.
    let (low, high) =
        values.filter(|v| *v > 0.0).fold((f64::MAX, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    (high > 0.0).then(|| {
        // Close figures look close.
        let room = ROOM.max((LEAST_EXTENT * low / high).sqrt());
        low / room..high * room
    })
}

/// 1, 2 and 5 of each decade within the range, or its powers of ten where that is too many.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let of = |digits: &[f64]| -> Vec<f64> {
        let all = decades.clone().flat_map(|decade| digits.iter().map(move |d| d * 10.0_f64.powi(decade)));
        all.filter(|tick| range.contains(tick)).collect()
    };
    let fine = of(&[1.0, 2.0, 5.0]);
    if fine.len() <= TICKS { fine } else { of(&[1.0]) }
}

/// Without zeros that say nothing.
fn label(value: f64) -> String {
    let text = digits(value);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAMILY: Family = Family { methods: &["asm"], labels: "lines: what nothing beats" };

    fn point(ms: f64, error: f64, executor: &'static str, on_front: bool) -> Point {
        Point { price: Price { ms, error }, method: "asm", executor, on_front, label: "3, 128".into() }
    }

    #[test]
    fn a_plot_has_a_marker_for_each_rung_and_a_line() {
        let points =
            vec![point(1.0, 4.0, "cpu", true), point(8.0, 0.5, "cpu", true), point(9.0, 0.7, "wgpu", false)];
        let plot = Plot { title: "sphere".into(), error: "ΔE", points };
        let svg = svg(&[plot], 1, &FAMILY).expect("drawn");
        // One more in the legend.
        assert_eq!(svg.matches("<circle").count(), 2 + 2, "{svg}");
        // The front's rungs have names, on the first executor.
        assert_eq!(svg.matches("3, 128").count(), 2, "{svg}");
        assert!(svg.contains("sphere") && svg.contains("ΔE") && svg.contains("<polyline"), "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn nothing_and_one_point_can_be_drawn() {
        let plot = |points| Plot { title: "gem".into(), error: "ΔE", points };
        let svg = svg(&[plot(vec![]), plot(vec![point(2.0, 2.0, "cpu", true)])], 2, &FAMILY).expect("drawn");
        assert!(svg.contains("gem: no prices") && !svg.contains("NaN"), "{svg}");
    }

    #[test]
    fn every_axis_has_some_ticks_and_not_too_many() {
        assert_eq!(ticks(&(3.0..60.0)), [5.0, 10.0, 20.0, 50.0]);
        let many = ticks(&(0.02..9000.0));
        assert_eq!(many.first().map(|t| label(*t)), Some("0.1".into()));
        assert!(many.len() <= TICKS, "{many:?}");
    }

    #[test]
    fn close_figures_look_close() {
        let range = extent([42.0, 46.0].into_iter()).expect("figures");
        assert!((range.end / range.start - LEAST_EXTENT).abs() < 1e-9, "{range:?}");
        assert!(ticks(&range).len() >= 2, "{range:?}");
        assert_eq!(extent([1.0, 100.0].into_iter()), Some(1.0 / ROOM..100.0 * ROOM));
        assert_eq!(extent([0.0].into_iter()), None);
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!([1000.0, 10.0, 0.1, 0.025].map(label), ["1000", "10", "0.1", "0.025"]);
    }
}
