//! What the six passes lose in frame buffers of 4 to 16 bits, f16 and f32, and what they take: a Markdown table, and a plot if a
//! file is named.
//!
//! `cargo run --release -p caustic-heightfield --example precision -- docs/src/pictures/pond-precision.svg`

#[path = "../tests/papers_experiment/mod.rs"]
mod papers_experiment;

use std::error::Error;
use std::time::Instant;

use caustic_heightfield::adjusted::{Fixed, Float, Format};
use caustic_heightfield::{
    Accumulation, Convolution, ConvolutionSettings, HeightField, Pond, PondError, SixPassSettings, SixPasses,
    relative_rms,
};
use half::f16;
use papers_experiment::{papers_pond, pebbles};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

const SIZE: [usize; 2] = [128, 128];
/// The paper's.
const KERNEL: Option<usize> = Some(7);
/// How often each is timed; the median counts.
const ROUNDS: usize = 15;
/// Readable on light and on dark pages.
const GREY: RGBColor = RGBColor(128, 128, 128);
/// Told apart by people who see colours differently, too (Okabe & Ito).
const COLORS: [RGBColor; 4] =
    [RGBColor(0, 114, 178), RGBColor(86, 180, 233), RGBColor(213, 94, 0), RGBColor(230, 159, 0)];
/// How scales are chosen and where sums are rounded: the columns of the table and the lines of the plot.
const WAYS: [(&str, bool, Accumulation); 4] = [
    ("compiled, per term", false, Accumulation::PerTerm),
    ("compiled, per tap", false, Accumulation::PerTap),
    ("by hand, per term", true, Accumulation::PerTerm),
    ("by hand, per tap", true, Accumulation::PerTap),
];

/// Relative RMS error and milliseconds.
#[derive(Clone, Copy)]
struct Price {
    error: f64,
    ms: f64,
}

/// What is measured: a surface, its pond, and its floor in f64.
struct Subject {
    surface: HeightField,
    pond: Pond,
    floor: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let subject = Subject::new(50.0)?;
    let fixed = |bits: u32, by_hand: bool| {
        let format = Fixed::new(bits).expect("4 to 16");
        if by_hand { format.by_hand() } else { format }
    };
    let mut lines: Vec<Vec<(f64, Price)>> = vec![Vec::new(); WAYS.len()];
    println!("| format | {} | milliseconds per term, per tap |", WAYS.map(|(name, ..)| name).join(" | "));
    println!("|---|---|---|---|---|---|");
    for bits in Fixed::BITS {
        let mut row = Vec::new();
        for ((_, by_hand, accumulation), line) in WAYS.iter().zip(&mut lines) {
            let price = subject.price(fixed(bits, *by_hand), *accumulation)?;
            line.push((f64::from(bits), price));
            row.push(price);
        }
        print_row(&format!("fixed{bits}"), &row);
    }
    let floats = [
        (
            "f16",
            [Accumulation::PerTerm, Accumulation::PerTap].map(|a| subject.price(Float::<f16>::default(), a)),
        ),
        (
            "f32",
            [Accumulation::PerTerm, Accumulation::PerTap].map(|a| subject.price(Float::<f32>::default(), a)),
        ),
    ];
    let mut marks = Vec::new();
    for (name, prices) in floats {
        let [per_term, per_tap] = prices;
        let prices = [per_term?, per_tap?];
        print_row(name, &prices);
        marks.push((name, prices));
    }
    println!();
    for scattering in [10.0, 50.0, 200.0] {
        let price = Subject::new(scattering)?.price(fixed(8, false), Accumulation::PerTerm)?;
        println!("a = {scattering}: fixed8, compiled, per term {:.1} %", 100.0 * price.error);
    }
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, svg(&lines, &marks)?)?;
    }
    Ok(())
}

fn print_row(name: &str, prices: &[Price]) {
    let percent = |price: &Price| match 100.0 * price.error {
        e if e >= 0.01 => format!("{e:.2} %"),
        e => format!("{e:.1e} %"),
    };
    let mut errors: Vec<String> = prices.iter().map(percent).collect();
    errors.resize(WAYS.len(), "-".into());
    println!("| {name} | {} | {:.1}, {:.1} |", errors.join(" | "), prices[0].ms, prices[1].ms);
}

impl Subject {
    /// That of the paper's experiment with another lobe.
    fn new(scattering: f64) -> Result<Self, PondError> {
        let (surface, pond) = (pebbles(SIZE), Pond { scattering, ..papers_pond() });
        let settings = ConvolutionSettings { kernel_samples: KERNEL, ..ConvolutionSettings::default() };
        let method = Convolution::<f64>::new(SIZE, surface.extent_m, &pond, settings)?;
        let floor = method.floor(&surface)?.irradiance;
        Ok(Self { surface, pond, floor })
    }

    fn price<F: Format>(&self, format: F, accumulation: Accumulation) -> Result<Price, PondError> {
        let settings = SixPassSettings { kernel_samples: KERNEL, accumulation };
        let method = SixPasses::new(std::slice::from_ref(&self.surface), &self.pond, settings, format)?;
        let (floor, _) = method.irradiance(&self.surface)?;
        let mut times_ms = Vec::with_capacity(ROUNDS);
        for _ in 0..ROUNDS {
            let start = Instant::now();
            std::hint::black_box(method.irradiance(&self.surface)?);
            times_ms.push(1e3 * start.elapsed().as_secs_f64());
        }
        times_ms.sort_by(f64::total_cmp);
        Ok(Price { error: relative_rms(&floor, &self.floor), ms: times_ms[ROUNDS / 2] })
    }
}

/// Error against bits on the left, against milliseconds on the right.
fn svg(lines: &[Vec<(f64, Price)>], floats: &[(&str, [Price; 2])]) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, (920, 360)).into_drawing_area();
        let (left, right) = root.split_horizontally(500);
        let mut of_bits = chart(&left, "error against bits", "bits of the frame buffer", 3.5..16.5_f64)?;
        for ((line, color), (name, ..)) in lines.iter().zip(COLORS).zip(WAYS) {
            let places = line.iter().map(|(bits, price)| (*bits, price.error));
            of_bits
                .draw_series(LineSeries::new(places, color.stroke_width(2)))?
                .label(name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        }
        for (name, prices) in floats {
            let line = [(3.5, prices[0].error), (16.5, prices[0].error)];
            of_bits.draw_series(LineSeries::new(line, GREY.stroke_width(1)))?;
            let label = Text::new((*name).to_owned(), (3.7, prices[0].error * 2.2), grey(12));
            of_bits.draw_series(std::iter::once(label))?;
        }
        of_bits
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .label_font(grey(11))
            .border_style(TRANSPARENT)
            .draw()?;

        let all =
            || lines.iter().flatten().map(|(_, price)| *price).chain(floats.iter().flat_map(|(_, p)| *p));
        let slowest = all().map(|price| price.ms).fold(0.0, f64::max);
        let fastest = all().map(|price| price.ms).fold(f64::INFINITY, f64::min);
        let range = 0.7 * fastest..1.4 * slowest;
        let x = "milliseconds, 128 x 128, 7 x 7, on a CPU";
        let mut of_time = chart(&right, "error against time", x, range.log_scale())?;
        for (line, color) in lines.iter().zip(COLORS) {
            let discs = line.iter().map(|(_, p)| Circle::new((p.ms, p.error), 3, color.filled()));
            of_time.draw_series(discs)?;
        }
        for (name, prices) in floats {
            for price in prices {
                let place = (price.ms, price.error);
                of_time.draw_series([TriangleMarker::new(place, 5, GREY.filled())])?;
                of_time.draw_series([Text::new((*name).to_owned(), (place.0 * 1.06, place.1), grey(11))])?;
            }
        }
        root.present()?;
    }
    Ok(text)
}

type Chart<'a, 'b, X> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, LogCoord<f64>>>;

fn grey(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&GREY)
}

/// An empty chart of errors.
fn chart<'a, 'b, X: Ranged<ValueType = f64> + ValueFormatter<f64>>(
    area: &DrawingArea<SVGBackend<'b>, Shift>,
    caption: &str,
    x: &str,
    coordinates: impl AsRangedCoord<CoordDescType = X, Value = f64>,
) -> Result<Chart<'a, 'b, X>, Box<dyn Error>> {
    let mut chart = ChartBuilder::on(area)
        .caption(caption, grey(15))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(60)
        .build_cartesian_2d(coordinates, (1e-7..2.0_f64).log_scale())?;
    chart
        .configure_mesh()
        .axis_style(GREY)
        .bold_line_style(GREY.mix(0.3))
        .light_line_style(TRANSPARENT)
        .label_style(grey(11))
        .axis_desc_style(grey(12))
        .x_desc(x)
        .y_desc("relative RMS error")
        .x_labels(13)
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|error| format!("{error:.0e}"))
        .draw()?;
    Ok(chart)
}
