//! A picture of the particles of one frame.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use gluey_geom::{Dim, Space, Vector};
use gluey_pictures::{Ball, Canvas, PIXELS_PER_MM, Stroke, color_scale};
use gluey_suspension::Container;

use super::error::PlotError;
use crate::analyse::frames::{dimension, frame_files, read_frames};
use crate::output::xyz::XyzFrame;

const EDGE: Stroke = Stroke { color: "#777777", width: 1.2, dashes: None };
const PERIODIC: Stroke = Stroke { color: "#777777", width: 1.2, dashes: Some("6 4") };
/// Opacity of images across periodic borders.
const IMAGE: f64 = 0.3;
/// Angles of the view of three dimensions, about the vertical and then about the horizontal.
const YAW: f64 = -0.55;
const PITCH: f64 = 0.35;
/// Room around the drawing, and below it for the legend, in SVG pixels.
const MARGIN: f64 = 8.0;
const LEGEND: f64 = 56.0;

/// Which frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameChoice {
    /// The last one.
    Last,
    /// That of a step of the run.
    Step(usize),
}

impl FromStr for FrameChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("last", _) => Ok(Self::Last),
            (_, Ok(step)) => Ok(Self::Step(step)),
            _ => Err("expected `last` or the number of a step".into()),
        }
    }
}

/// The picture of a frame, and its path without an extension.
pub fn snapshot(folder: &Path, choice: FrameChoice, width_mm: f64) -> Result<(Canvas, PathBuf), PlotError> {
    let files = frame_files(folder)?;
    let file = match choice {
        FrameChoice::Last => files.last(),
        FrameChoice::Step(step) => files.iter().find(|file| step_of(file) == Some(step)),
    };
    let file = file.ok_or_else(|| PlotError::NoFrame {
        folder: folder.to_owned(),
        steps: files.iter().filter_map(|file| step_of(file)).collect(),
    })?;
    let one = [file.clone()];
    let width = width_mm * PIXELS_PER_MM;
    let canvas = match dimension(&one)? {
        2 => Scene::of(&read_frames::<2>(&one)?[0]).draw_alone(width),
        _ => Scene::of(&read_frames::<3>(&one)?[0]).draw_alone(width),
    };
    Ok((canvas, beside_pictures(file)))
}

/// The number in `particles-<step>.xyz`.
fn step_of(file: &Path) -> Option<usize> {
    stem(file).strip_prefix("particles-")?.parse().ok()
}

fn stem(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    name.split('.').next().unwrap_or_default().to_owned()
}

/// Beside the other pictures of the run: `<stem>-plots/particles-<step>` for `<stem>-xyz`.
pub(super) fn beside_pictures(file: &Path) -> PathBuf {
    let folder = file.parent().unwrap_or(Path::new(""));
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let plots = match name.strip_suffix("-xyz") {
        Some(run) => folder.with_file_name(format!("{run}-plots")),
        None => folder.join("plots"),
    };
    plots.join(stem(file))
}

/// A sphere or disc before it is put on paper: across, up, towards the reader.
struct Seen {
    at: [f64; 3],
    radius: f64,
    speed: f64,
    is_image: bool,
}

/// What has room in a drawing: the sides of a rectangle, and the largest speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    left: f64,
    right: f64,
    low: f64,
    high: f64,
    fast: f64,
}

impl View {
    /// What has room for two of them.
    pub fn around(self, other: Self) -> Self {
        Self {
            left: self.left.min(other.left),
            right: self.right.max(other.right),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            fast: self.fast.max(other.fast),
        }
    }
}

/// What is seen of a frame.
pub(super) struct Scene {
    is_flat: bool,
    balls: Vec<Seen>,
    /// Edges of the box, and whether they are periodic borders of the plane.
    edges: Vec<([[f64; 3]; 2], bool)>,
    caption: String,
}

impl Scene {
    /// What is seen of this frame.
    pub fn of<const D: usize>(frame: &XyzFrame<D>) -> Self
    where
        Dim<D>: Space<D>,
    {
        // The same box, as upright as its images allow.
        let container = frame.container.tilted(frame.container.lattice().reduced().tilt());
        let mut balls = Vec::new();
        for (i, position) in frame.positions.iter().enumerate() {
            let (radius, speed) = (frame.radii[i], frame.velocities[i].norm());
            let own = container.wrapped(position);
            balls.push(Seen { at: turned(&own), radius, speed, is_image: false });
            let images = images(&container, &own, radius);
            balls.extend(images.iter().map(|x| Seen { at: turned(x), radius, speed, is_image: true }));
        }
        balls.sort_by(|one, other| one.at[2].total_cmp(&other.at[2]));
        let caption = format!("*t* = {:.4}, strain *γ* = {:.4}", frame.time, frame.strain);
        Self { is_flat: D == 2, balls, edges: edges(&container), caption }
    }

    /// What has room for all of it.
    pub fn view(&self) -> View {
        let room = |axis: usize, sign: f64| {
            let balls = self.balls.iter().map(|ball| sign * ball.at[axis] + ball.radius);
            let ends = self.edges.iter().flat_map(|(ends, _)| ends.map(|end| sign * end[axis]));
            sign * balls.chain(ends).fold(f64::NEG_INFINITY, f64::max)
        };
        let fast = self.balls.iter().map(|ball| ball.speed).fold(0.0, f64::max);
        View { left: room(0, -1.0), right: room(0, 1.0), low: room(1, -1.0), high: room(1, 1.0), fast }
    }

    fn draw_alone(&self, width: f64) -> Canvas {
        self.draw(&self.view(), width)
    }

    /// A drawing that has room for this view.
    pub fn draw(&self, view: &View, width: f64) -> Canvas {
        let View { left, right, low, high, fast } = *view;
        // Not higher than wide.
        let scale = (width - 2.0 * MARGIN) / (right - left).max(high - low);
        let shift = MARGIN.max(0.5 * (width - scale * (right - left)));
        let on_paper = |at: [f64; 3]| (shift + scale * (at[0] - left), MARGIN + scale * (high - at[1]));
        let height = scale * (high - low) + MARGIN + LEGEND;
        let mut canvas = Canvas::new(width, height);
        self.draw_edges(&mut canvas, on_paper, false);
        for ball in &self.balls {
            canvas.ball(&Ball {
                center: on_paper(ball.at),
                radius: scale * ball.radius,
                color: color_scale(if fast > 0.0 { ball.speed / fast } else { 0.0 }),
                is_sphere: !self.is_flat,
                opacity: if ball.is_image { IMAGE } else { 1.0 },
            });
        }
        self.draw_edges(&mut canvas, on_paper, true);
        self.draw_legend(&mut canvas, fast, (width, height - LEGEND));
        canvas
    }

    /// The edges at the corner nearest to the reader, or all others.
    fn draw_edges(&self, canvas: &mut Canvas, on_paper: impl Fn([f64; 3]) -> (f64, f64), in_front: bool) {
        let depths = self.edges.iter().flat_map(|(ends, _)| ends.map(|end| end[2]));
        let nearest = depths.fold(f64::NEG_INFINITY, f64::max);
        let is_in_front = |ends: &[[f64; 3]; 2]| !self.is_flat && ends.iter().any(|end| end[2] >= nearest);
        for (ends, is_periodic) in self.edges.iter().filter(|(ends, _)| is_in_front(ends) == in_front) {
            let stroke = if *is_periodic { PERIODIC } else { EDGE };
            canvas.line(on_paper(ends[0]), on_paper(ends[1]), stroke);
        }
    }

    fn draw_legend(&self, canvas: &mut Canvas, fast: f64, (width, top): (f64, f64)) {
        let (y, length) = (top + 22.0, 0.3 * width);
        canvas.text(MARGIN, y + 9.0, 15.0, "start", "speed");
        let left = MARGIN + 46.0;
        canvas.color_bar((left, y), (length, 10.0));
        canvas.text(left, y + 25.0, 13.0, "start", "0");
        canvas.text(left + length, y + 25.0, 13.0, "end", &format!("{fast:.3}"));
        canvas.text(width - MARGIN, y + 9.0, 15.0, "end", &self.caption);
    }
}

/// Across, up and towards the reader; a plane is seen from the front.
fn turned<const D: usize>(x: &Vector<D>) -> [f64; 3] {
    if D == 2 {
        return [x[0], x[1], 0.0];
    }
    let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (YAW.sin_cos(), PITCH.sin_cos());
    let across = cos_yaw * x[0] + sin_yaw * x[2];
    let back = cos_yaw * x[2] - sin_yaw * x[0];
    [across, cos_pitch * x[1] - sin_pitch * back, sin_pitch * x[1] + cos_pitch * back]
}

/// Images of a ball that reach into the box, without the ball.
fn images<const D: usize>(container: &Container<D>, x: &Vector<D>, radius: f64) -> Vec<Vector<D>> {
    let (lattice, bounds) = (container.lattice(), container.bounds());
    let all = (0..3_i32.pow(D as u32)).map(|n| std::array::from_fn(|d| n / 3_i32.pow(d as u32) % 3 - 1));
    let periodic = all.filter(|image: &[i32; D]| {
        *image != [0; D] && (0..D).all(|d| image[d] == 0 || !container.is_walled(d))
    });
    // Along x a slanted border is further away than it is straight across.
    let slant = 1.0_f64.hypot(lattice.shear());
    let reaches = |image: &Vector<D>| {
        let place = lattice.to_box(image, bounds.lower[1]);
        (0..D).all(|d| {
            let reach = if d == 0 { radius * slant } else { radius };
            place[d] > bounds.lower[d] - reach && place[d] < bounds.upper[d] + reach
        })
    };
    periodic.map(|image| *x + lattice.shift(&image)).filter(reaches).collect()
}

fn edges<const D: usize>(container: &Container<D>) -> Vec<([[f64; 3]; 2], bool)> {
    let (lattice, bounds) = (container.lattice(), container.bounds());
    let corner = |n: usize| {
        let place =
            Vector::<D>::from_fn(|d, _| if n >> d & 1 == 0 { bounds.lower[d] } else { bounds.upper[d] });
        turned(&lattice.from_box(&place, bounds.lower[1]))
    };
    let pairs = (0..1 << D).flat_map(|n: usize| (0..D).map(move |d| (n, d)));
    let edges = pairs.filter(|(n, d)| n >> d & 1 == 0);
    // In the plane the edge along one axis is the border across the other.
    edges.map(|(n, d)| ([corner(n), corner(n | 1 << d)], D == 2 && !container.is_walled(1 - d % 2))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_across_periodic_borders_have_images() {
        let container = Container::<2>::periodic(&Vector::<2>::repeat(1.0)).tilted(0.25);
        let inside = Vector::<2>::new(0.6, 0.5);
        assert!(images(&container, &inside, 0.1).is_empty());
        let found = images(&container, &Vector::<2>::new(0.5, 0.95), 0.1);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0] - Vector::<2>::new(0.25, -0.05)).norm() < 1e-12, "{found:?}");
        assert_eq!(images(&container, &Vector::<2>::new(0.05, 0.05), 0.1).len(), 3, "in a corner");
    }

    #[test]
    fn frames_are_named_by_their_step() {
        assert_eq!("last".parse(), Ok(FrameChoice::Last));
        assert_eq!("12".parse(), Ok(FrameChoice::Step(12)));
        assert!("first".parse::<FrameChoice>().is_err());
        let file = Path::new("out/pair-xyz/particles-000012.xyz.gz");
        assert_eq!(step_of(file), Some(12));
        assert_eq!(beside_pictures(file), Path::new("out/pair-plots/particles-000012"));
    }
}
