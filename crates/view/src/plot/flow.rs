//! A picture of the flow of one frame, in the plane or in a slice of space: a quantity in colours, arrows of
//! the velocity, particles over them.

mod choice;
mod files;
mod plane;
mod sample;

use std::path::{Path, PathBuf};

use choice::AXES;
use gluey::case::Case;
use gluey::output::vtk::{read_fields, read_particles};
use gluey_geom::Particle;
use gluey_pictures::{Canvas, PIXELS_PER_MM, Raster, Stroke, color_scale};
use gluey_suspension::Container;

use super::error::PlotError;
use super::snapshot::{EDGE, FrameChoice, PERIODIC};
use super::told::{told, told_to};
pub use choice::{FlowOptions, Quantity, SliceChoice};
use files::FlowFrame;
use plane::{PicturePlane, PlaneView};
use sample::{Samples, Sampling};

/// Most pixels of a picture's field along either side.
const MOST_PIXELS: f64 = 640.0;
/// Arrows along the longer side, as long as they have this distance in SVG pixels, or fewer.
const ARROW_COUNT: f64 = 24.0;
const ARROW_DISTANCE: f64 = 18.0;
/// Length of the longest arrow over the distance of arrows.
const ARROW_LENGTH: f64 = 0.8;
/// Arrows that are shorter, in SVG pixels, are left out.
const SHORTEST_ARROW: f64 = 2.0;
/// Part of the field that may lie outside the colours at either end, where pressures in narrow gaps would
/// take all of them.
const CUT: f64 = 0.002;
/// Room beside, over and below the field.
const MARGIN: [f64; 3] = [44.0, 12.0, 124.0];
const PARTICLE: &str = "#d9d9d9";
const PARTICLE_EDGE: Stroke = Stroke { color: "#444444", width: 0.9, dashes: None };

/// The picture of a frame, the last one unless another is chosen, and its path without an extension.
pub fn flow(
    folder: &Path,
    options: FlowOptions,
    frame: Option<FrameChoice>,
    width_mm: f64,
) -> Result<(Canvas, PathBuf), PlotError> {
    let frame = FlowFrame::find(folder, frame.unwrap_or(FrameChoice::Last))?;
    let width = width_mm * PIXELS_PER_MM;
    let canvas = match frame.case.dimension {
        2 => drawn::<2>(&frame, options, width)?,
        _ => drawn::<3>(&frame, options, width)?,
    };
    let slice =
        options.slice.map_or(String::new(), |SliceChoice { axis, at }| format!("-{}={at}", AXES[axis]));
    let name = format!("flow-{}{slice}-{:06}", options.quantity.as_str(), frame.step);
    Ok((canvas, frame.plots.join(name)))
}

fn drawn<const D: usize>(frame: &FlowFrame, options: FlowOptions, width: f64) -> Result<Canvas, PlotError> {
    let fields = read_fields::<D>(&frame.fields)?;
    let particles = read_particles::<D>(&frame.particles)?;
    let shear = sample::shear(&fields).ok_or_else(|| PlotError::NoCells { path: frame.fields.clone() })?;
    let container = frame.case.container::<D>();
    let height = container.bounds().extent()[1];
    let container = container.tilted(shear * height);
    let plane = PicturePlane::of(&container, options.slice)?;
    let view = PlaneView::new(&plane, width, MARGIN);
    let (columns, rows) = view.pixels(MOST_PIXELS);
    let sampling = Sampling { fields: &fields, shear, quantity: options.quantity };
    let samples = sampling.samples(&plane, columns, rows);
    let circles = circles(&container, &particles, &plane);
    let picture = Picture { plane, view, samples, circles, quantity: options.quantity };
    picture.draw(&caption(frame, &picture.plane), &frame.fields)
}

/// Time, strain of what is sheared and, in 3D, where the slice is.
fn caption<const D: usize>(frame: &FlowFrame, plane: &PicturePlane<D>) -> String {
    let Case { time, shear_rate, shear_stress, .. } = &frame.case;
    let slice = match D {
        2 => String::new(),
        _ => format!(", *{}* = {}", AXES[plane.normal], told_to(plane.at, 4)),
    };
    let strain = match *shear_rate != 0.0 || shear_stress.is_some() {
        true => format!(", strain *γ* = {}", told_to(frame.case.strain_after(frame.step), 4)),
        false => String::new(),
    };
    format!("*t* = {}{strain}{slice}", told_to(time.step * frame.step as f64, 4))
}

/// Where the plane cuts particles and their images: centres in the plane and radii.
fn circles<const D: usize>(
    container: &Container<D>,
    particles: &[Particle<D>],
    plane: &PicturePlane<D>,
) -> Vec<((f64, f64), f64)> {
    let mut circles = Vec::new();
    for particle in particles {
        let own = container.wrapped(&particle.pose.position);
        let images = container.images_inside(&own, particle.radius).into_iter().map(|(_, center)| center);
        let all = std::iter::once(own).chain(images);
        circles.extend(all.filter_map(|center| {
            let radius = plane.cut(&center, particle.radius)?;
            Some((plane.place(&center), radius))
        }));
    }
    circles
}

/// The parts of a picture of the flow.
struct Picture<const D: usize> {
    plane: PicturePlane<D>,
    view: PlaneView,
    samples: Samples<D>,
    circles: Vec<((f64, f64), f64)>,
    quantity: Quantity,
}

impl<const D: usize> Picture<D> {
    fn draw(&self, caption: &str, path: &Path) -> Result<Canvas, PlotError> {
        let range = ColorRange::of(self.values_of_fluid(), self.quantity);
        let (width, height) = self.view.canvas();
        let mut canvas = Canvas::new(width, height);
        let colors = self.samples.values().map(|value| value.map(|value| color_scale(range.fraction(value))));
        let raster = Raster::new(self.samples.columns, colors.collect());
        let (corner, size) = self.view.field();
        let failed = |source| PlotError::Png { path: path.to_owned(), source };
        canvas.raster(corner, size, &raster).map_err(failed)?;
        let outline = self.plane.corners.map(|corner| self.view.on_paper(corner));
        let head = 0.25 * self.arrow_distance();
        canvas.clipped(&outline, |canvas| {
            canvas.arrows(&self.arrows(), [255; 3], [40; 3], head);
            for (center, radius) in &self.circles {
                let (center, radius) = (self.view.on_paper(*center), radius * self.view.scale);
                canvas.circle(center, radius, PARTICLE, PARTICLE_EDGE);
            }
        });
        self.draw_outline(&mut canvas, outline);
        self.draw_legend(&mut canvas, &range, caption);
        Ok(canvas)
    }

    /// Values at pixels outside the particles.
    fn values_of_fluid(&self) -> Vec<f64> {
        let samples = self.samples.all.iter().enumerate();
        let fluid = samples.filter_map(|(pixel, sample)| Some((pixel, sample.as_ref()?)));
        fluid.filter(|(pixel, _)| self.is_fluid(*pixel)).map(|(_, sample)| sample.value).collect()
    }

    fn is_fluid(&self, pixel: usize) -> bool {
        let (columns, rows) = (self.samples.columns, self.samples.rows);
        let at = self.plane.middle_of(pixel % columns, pixel / columns, columns, rows);
        self.circles.iter().all(|(center, radius)| (at.0 - center.0).hypot(at.1 - center.1) > *radius)
    }

    /// Distance of arrows, a whole number of which takes the longer side.
    fn arrow_distance(&self) -> f64 {
        let (_, size) = self.view.field();
        let longer = size.0.max(size.1);
        longer / (longer / ARROW_DISTANCE).floor().clamp(1.0, ARROW_COUNT)
    }

    /// Arrows on a grid where there is fluid; the longest is that of the largest velocity in the plane.
    fn arrows(&self) -> Vec<[(f64, f64); 2]> {
        let ((left, top), size) = self.view.field();
        let distance = self.arrow_distance();
        let count = |length: f64| (length / distance).round().max(1.0) as usize;
        let (across, down) = (count(size.0), count(size.1));
        let mut found = Vec::new();
        for (row, column) in (0..down).flat_map(|row| (0..across).map(move |column| (row, column))) {
            let part = [(column as f64 + 0.5) / across as f64, (row as f64 + 0.5) / down as f64];
            let pixel = self.samples.pixel(part);
            let Some(sample) = self.samples.all[pixel].as_ref().filter(|_| self.is_fluid(pixel)) else {
                continue;
            };
            found.push((
                (left + part[0] * size.0, top + part[1] * size.1),
                self.plane.place(&sample.velocity),
            ));
        }
        let fast = found.iter().map(|(_, (u, v))| u.hypot(*v)).fold(0.0, f64::max);
        let scale = ARROW_LENGTH * distance / fast.max(f64::MIN_POSITIVE);
        let long = found.into_iter().filter(|(_, (u, v))| scale * u.hypot(*v) > SHORTEST_ARROW);
        long.map(|((x, y), (u, v))| {
            let (half_u, half_v) = (0.5 * scale * u, -0.5 * scale * v);
            [(x - half_u, y - half_v), (x + half_u, y + half_v)]
        })
        .collect()
    }

    /// Borders, dashed where they are periodic, with the names of the axes and where they end.
    fn draw_outline(&self, canvas: &mut Canvas, outline: [(f64, f64); 4]) {
        let PicturePlane { across, up, is_walled, ends, .. } = &self.plane;
        for (n, walled) in [is_walled[1], is_walled[0], is_walled[1], is_walled[0]].into_iter().enumerate() {
            canvas.line(outline[n], outline[(n + 1) % 4], if walled { EDGE } else { PERIODIC });
        }
        let [lower_left, lower_right, _, upper_left] = outline;
        let below = lower_left.1 + 18.0;
        let middle = |a: f64, b: f64| 0.5 * (a + b);
        let name = |axis: usize| format!("*{}*", AXES[axis]);
        canvas.text(lower_left.0, below, 13.0, "start", &told(ends[0][0]));
        canvas.text(lower_right.0, below, 13.0, "end", &told(ends[0][1]));
        canvas.text(middle(lower_left.0, lower_right.0), below, 15.0, "middle", &name(*across));
        let beside = |x: f64| x - 8.0;
        canvas.text(beside(lower_left.0), lower_left.1, 13.0, "end", &told(ends[1][0]));
        canvas.text(beside(upper_left.0), upper_left.1 + 10.0, 13.0, "end", &told(ends[1][1]));
        let x = beside(middle(lower_left.0, upper_left.0));
        canvas.text(x, middle(lower_left.1, upper_left.1) + 5.0, 15.0, "end", &name(*up));
    }

    fn draw_legend(&self, canvas: &mut Canvas, range: &ColorRange, caption: &str) {
        let (width, height) = self.view.canvas();
        let (left, right) = (MARGIN[0], width - MARGIN[1]);
        let (y, length) = (height - 70.0, 0.5 * (right - left));
        canvas.text(left, y - 7.0, 14.0, "start", self.quantity.label());
        canvas.color_bar((left, y), (length, 10.0));
        let [low, high] = range.labels();
        canvas.text(left, y + 25.0, 13.0, "start", &low);
        canvas.text(left + length, y + 25.0, 13.0, "end", &high);
        canvas.text(left, y + 46.0, 14.0, "start", caption);
        canvas.text(left, y + 63.0, 13.0, "start", "arrows: velocity in this plane");
    }
}

/// The values at the ends of the colours, and whether there are some beyond.
struct ColorRange {
    low: f64,
    high: f64,
    is_cut: [bool; 2],
}

impl ColorRange {
    /// Speeds from 0 to the largest; of other quantities almost all.
    fn of(mut values: Vec<f64>, quantity: Quantity) -> Self {
        values.sort_by(f64::total_cmp);
        let (Some(&least), Some(&most)) = (values.first(), values.last()) else {
            return Self { low: 0.0, high: 0.0, is_cut: [false; 2] };
        };
        if quantity == Quantity::Speed {
            return Self { low: 0.0, high: most, is_cut: [false; 2] };
        }
        let cut = (CUT * values.len() as f64) as usize;
        let (low, high) = (values[cut], values[values.len() - 1 - cut]);
        // Nothing that is told apart: the rounding of a constant.
        let slack = 1e-6 * low.abs().max(high.abs());
        let (low, high) = if high - low > slack { (low, high) } else { (low, low) };
        Self { low, high, is_cut: [least < low - slack, most > high + slack] }
    }

    /// Where a value lies, from 0 to 1; a constant in the middle.
    fn fraction(&self, value: f64) -> f64 {
        if self.high > self.low { (value - self.low) / (self.high - self.low) } else { 0.5 }
    }

    fn labels(&self) -> [String; 2] {
        let [low, high] = [self.low, self.high].map(told);
        let [below, above] = self.is_cut;
        [if below { format!("≤ {low}") } else { low }, if above { format!("≥ {high}") } else { high }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_take_almost_all_of_the_values() {
        let values: Vec<f64> = (0..1000).map(f64::from).rev().collect();
        let range = ColorRange::of(values.clone(), Quantity::Pressure);
        assert_eq!((range.low, range.high, range.is_cut), (2.0, 997.0, [true; 2]));
        assert_eq!(range.labels(), ["≤ 2", "≥ 997"]);
        let range = ColorRange::of(values, Quantity::Speed);
        assert_eq!((range.low, range.high, range.is_cut), (0.0, 999.0, [false; 2]));
        let constant = ColorRange::of(vec![-1.0, -1.0 + 1e-9], Quantity::Vorticity);
        assert_eq!((constant.fraction(-1.0), constant.is_cut), (0.5, [false; 2]));
    }
}
