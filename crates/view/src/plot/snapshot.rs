//! A picture of the particles of one frame.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use gluey::output::name_of;
use gluey::output::xyz::XyzFrame;
use gluey_geom::Vector;
use gluey_pictures::{Ball, Canvas, PIXELS_PER_MM, Rgb, Stroke, color_scale};
use gluey_suspension::Container;

use super::error::PlotError;
use super::look::{Lines, Look, Viewpoint, near_pairs};
use super::told::{told, told_to};
use crate::contacts::{FrameContact, contacts_of};
use crate::frames::{dimension, frame_files, read_frames};

pub(super) const EDGE: Stroke = Stroke { color: "#777777", width: 1.2, dashes: None };
pub(super) const PERIODIC: Stroke = Stroke { color: "#777777", width: 1.2, dashes: Some("6 4") };
/// Opacity of images across periodic borders.
const IMAGE: f64 = 0.3;
/// Lines between near particles.
const LINK: Stroke = Stroke { color: "#c8471b", width: 2.0, dashes: None };
/// Contacts that slip, and the widest line of a contact.
const SLIPPING: Stroke = Stroke { color: "#0b4f9e", width: 2.0, dashes: Some("5 2.5") };
const WIDEST: f64 = 8.0;
const THINNEST: f64 = 0.8;
/// Length of a sample in the legend.
const SAMPLE: f64 = 28.0;
/// Light around lines of contacts.
const HALO: f64 = 2.0;
/// Parts of an edge in front that are seen or not.
const EDGE_PARTS: usize = 400;
/// Share of white in the colours of the particles that are farthest away, in 3D.
const HAZE: f64 = 0.5;
/// Steps of this share, so that few colours are used.
const HAZE_STEPS: f64 = 8.0;
/// Room around the drawing, and below it for the legend, in SVG pixels.
const MARGIN: f64 = 8.0;
const LEGEND: f64 = 74.0;
/// Width below which the caption has a row of its own, of this height.
const NARROW: f64 = 460.0;
const ROW: f64 = 20.0;

/// The choice of a frame.
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
pub fn snapshot(
    folder: &Path,
    choice: FrameChoice,
    look: &Look,
    width_mm: f64,
) -> Result<(Canvas, PathBuf), PlotError> {
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
        2 => drawn(&read_frames::<2>(&one)?, look, file, width)?,
        _ => drawn(&read_frames::<3>(&one)?, look, file, width)?,
    };
    Ok((canvas, beside_pictures(file)))
}

/// The first of the frames, which is of `file`.
fn drawn<const D: usize>(
    frames: &[XyzFrame<D>],
    look: &Look,
    file: &Path,
    width: f64,
) -> Result<Canvas, PlotError> {
    look.check(frames, file)?;
    let is_sheared = frames[0].strain != 0.0 || frames[0].time == 0.0;
    let contacts = lines_of_contacts(frames, look, file)?;
    Ok(Scene::of(&frames[0], &contacts[0], look, is_sheared).draw_alone(width))
}

/// The contacts of each frame where lines tell of them, which they cannot without a table of their forces.
pub(super) fn lines_of_contacts<const D: usize>(
    frames: &[XyzFrame<D>],
    look: &Look,
    file: &Path,
) -> Result<Vec<Vec<FrameContact<D>>>, PlotError> {
    if look.network != Some(Lines::Forces) {
        return Ok(vec![Vec::new(); frames.len()]);
    }
    contacts_of(file, frames)?.ok_or_else(|| PlotError::NoForcesOfPairs { path: file.to_owned() })
}

/// The number in `particles-<step>.xyz`.
fn step_of(file: &Path) -> Option<usize> {
    stem(file).strip_prefix("particles-")?.parse().ok()
}

fn stem(file: &Path) -> String {
    name_of(file).split('.').next().unwrap_or_default().to_owned()
}

/// Beside the other pictures of the run: `<stem>-plots/particles-<step>` for `<stem>-xyz`.
pub(super) fn beside_pictures(file: &Path) -> PathBuf {
    let folder = file.parent().unwrap_or(Path::new(""));
    let plots = match name_of(folder).strip_suffix("-xyz") {
        Some(run) => folder.with_file_name(format!("{run}-plots")),
        None => folder.join("plots"),
    };
    plots.join(stem(file))
}

/// A sphere or disc before it is put on paper: across, up, towards the reader.
struct Seen {
    at: [f64; 3],
    radius: f64,
    /// What its colour tells.
    measure: f64,
    is_image: bool,
}

/// A line between the centres of two particles.
struct Link {
    ends: [[f64; 3]; 2],
    /// The size of their normal force and whether they slip, where lines tell of contacts.
    contact: Option<(f64, Option<bool>)>,
}

/// The sides of the rectangle that has room in a drawing, and the largest number behind a colour and the
/// width of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneView {
    left: f64,
    right: f64,
    low: f64,
    high: f64,
    most: f64,
    most_force: f64,
}

impl SceneView {
    /// What has room for two of them.
    pub fn around(self, other: Self) -> Self {
        Self {
            left: self.left.min(other.left),
            right: self.right.max(other.right),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            most: self.most.max(other.most),
            most_force: self.most_force.max(other.most_force),
        }
    }
}

/// The visible part of a frame.
pub(super) struct Scene {
    is_flat: bool,
    look: Look,
    balls: Vec<Seen>,
    links: Vec<Link>,
    /// Edges of the box, and whether they are periodic borders of the plane.
    edges: Vec<([[f64; 3]; 2], bool)>,
    caption: String,
}

impl Scene {
    /// What is seen of this frame; the strain is told of runs that are sheared.
    pub fn of<const D: usize>(
        frame: &XyzFrame<D>,
        contacts: &[FrameContact<D>],
        look: &Look,
        is_sheared: bool,
    ) -> Self {
        // The same box, as upright as its images allow.
        let container = frame.container.tilted(frame.container.lattice().reduced().tilt());
        let measures = look.measures(frame);
        let view = look.viewpoint;
        let mut balls = Vec::new();
        for (i, position) in frame.positions.iter().enumerate() {
            let (radius, measure) = (frame.radii[i], measures[i]);
            let own = container.wrapped(position);
            balls.push(Seen { at: view.turned(&own), radius, measure, is_image: false });
            let images = container.images_inside(&own, radius).into_iter();
            let seen = |(_, x)| Seen { at: view.turned(&x), radius, measure, is_image: true };
            balls.extend(images.map(seen));
        }
        balls.sort_by(|one, other| one.at[2].total_cmp(&other.at[2]));
        let links = links(frame, contacts, look, &container);
        let strain = match is_sheared {
            true => format!(", strain *γ* = {}", told_to(frame.strain, 4)),
            false => String::new(),
        };
        let caption = format!("*t* = {}{strain}", told_to(frame.time, 4));
        Self { is_flat: D == 2, look: *look, balls, links, edges: edges(&container, view), caption }
    }

    /// What has room for all of it.
    pub fn view(&self) -> SceneView {
        let room = |axis: usize, sign: f64| {
            let balls = self.balls.iter().map(|ball| sign * ball.at[axis] + ball.radius);
            let ends = self.edges.iter().flat_map(|(ends, _)| ends.map(|end| sign * end[axis]));
            sign * balls.chain(ends).fold(f64::NEG_INFINITY, f64::max)
        };
        let measures = self.balls.iter().map(|ball| ball.measure);
        let most = self.look.end().unwrap_or_else(|| measures.fold(0.0, f64::max));
        let most_force = self.forces().fold(0.0, f64::max);
        let [left, right, low, high] =
            [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)].map(|(axis, sign)| room(axis, sign));
        SceneView { left, right, low, high, most, most_force }
    }

    /// The sizes of the normal forces of contacts that lines tell of.
    fn forces(&self) -> impl Iterator<Item = f64> {
        self.links.iter().filter_map(|link| Some(link.contact?.0))
    }

    fn draw_alone(&self, width: f64) -> Canvas {
        self.draw(&self.view(), width)
    }

    /// A drawing that has room for this view.
    pub fn draw(&self, view: &SceneView, width: f64) -> Canvas {
        let SceneView { left, right, low, high, most, most_force } = *view;
        // Not higher than wide.
        let scale = (width - 2.0 * MARGIN) / (right - left).max(high - low);
        let shift = MARGIN.max(0.5 * (width - scale * (right - left)));
        let on_paper = |at: [f64; 3]| (shift + scale * (at[0] - left), MARGIN + scale * (high - at[1]));
        let shows_forces = self.look.network == Some(Lines::Forces);
        let legend = LEGEND + if width < NARROW { ROW } else { 0.0 } + if shows_forces { ROW } else { 0.0 };
        let height = scale * (high - low) + MARGIN + legend;
        let mut canvas = Canvas::new(width, height);
        self.draw_edges(&mut canvas, on_paper, false);
        for ball in &self.balls {
            let color = color_scale(if most > 0.0 { ball.measure / most } else { 0.0 });
            canvas.ball(&Ball {
                center: on_paper(ball.at),
                radius: scale * ball.radius,
                color: faded(color, self.haze(ball.at[2])),
                is_sphere: !self.is_flat,
                opacity: if ball.is_image { IMAGE } else { 1.0 },
            });
        }
        self.draw_edges(&mut canvas, on_paper, true);
        self.draw_links(&mut canvas, on_paper, most_force);
        self.draw_legend(&mut canvas, most, width, height - legend);
        if shows_forces {
            self.draw_legend_of_forces(&mut canvas, most_force, width < NARROW);
        }
        canvas
    }

    fn draw_links(&self, canvas: &mut Canvas, on_paper: impl Fn([f64; 3]) -> (f64, f64), most_force: f64) {
        for Link { ends: [from, to], contact } in &self.links {
            let stroke = contact.map_or(LINK, |(force, slides)| of_contact(force / most_force, slides));
            let ends = (on_paper(*from), on_paper(*to));
            if contact.is_some() {
                canvas.line(
                    ends.0,
                    ends.1,
                    Stroke { color: "#ffffff", width: stroke.width + HALO, dashes: None },
                );
            }
            canvas.line(ends.0, ends.1, stroke);
        }
    }

    /// Share of white at a depth: none in front, most at the back.
    fn haze(&self, depth: f64) -> f64 {
        let ends = (self.balls.first().map(|ball| ball.at[2]), self.balls.last().map(|ball| ball.at[2]));
        match ends {
            (Some(back), Some(front)) if front > back => {
                HAZE * ((front - depth) / (front - back) * HAZE_STEPS).round() / HAZE_STEPS
            }
            _ => 0.0,
        }
    }

    /// The edges at the corner nearest to the reader, or all others.
    fn draw_edges(&self, canvas: &mut Canvas, on_paper: impl Fn([f64; 3]) -> (f64, f64), in_front: bool) {
        let depths = self.edges.iter().flat_map(|(ends, _)| ends.map(|end| end[2]));
        let nearest = depths.fold(f64::NEG_INFINITY, f64::max);
        let is_in_front = |ends: &[[f64; 3]; 2]| !self.is_flat && ends.iter().any(|end| end[2] >= nearest);
        for (ends, is_periodic) in self.edges.iter().filter(|(ends, _)| is_in_front(ends) == in_front) {
            let stroke = if *is_periodic { PERIODIC } else { EDGE };
            for [from, to] in self.unhidden(*ends) {
                canvas.line(on_paper(from), on_paper(to), stroke);
            }
        }
    }

    /// The parts of an edge that no ball of the box hides. Balls over an edge at the back are drawn later
    /// anyway.
    fn unhidden(&self, [from, to]: [[f64; 3]; 2]) -> Vec<[[f64; 3]; 2]> {
        let at = |n: usize| -> [f64; 3] {
            let part = n as f64 / EDGE_PARTS as f64;
            std::array::from_fn(|d| from[d] + part * (to[d] - from[d]))
        };
        let nearest = self.edges.iter().flat_map(|(ends, _)| ends.map(|end| end[2])).fold(f64::MIN, f64::max);
        if self.is_flat || from[2].max(to[2]) < nearest {
            return vec![[from, to]];
        }
        let is_seen = |x: [f64; 3]| {
            self.balls.iter().filter(|ball| !ball.is_image).all(|ball| {
                let beside = (x[0] - ball.at[0]).powi(2) + (x[1] - ball.at[1]).powi(2);
                let over = ball.radius.powi(2) - beside;
                over <= 0.0 || ball.at[2] + over.sqrt() <= x[2]
            })
        };
        let seen: Vec<usize> = (0..EDGE_PARTS).filter(|n| is_seen(at(*n)) && is_seen(at(n + 1))).collect();
        let runs = seen.chunk_by(|one, other| other - one == 1);
        runs.map(|run| [at(run[0]), at(run[run.len() - 1] + 1)]).collect()
    }

    fn draw_legend(&self, canvas: &mut Canvas, most: f64, width: f64, top: f64) {
        let [name, low, high] = self.look.legend(most, self.is_flat);
        let (left, y, length) = (MARGIN, top + 40.0, 0.4 * width);
        canvas.text(left, y - 7.0, 15.0, "start", &name);
        canvas.color_bar((left, y), (length, 10.0));
        canvas.text(left, y + 25.0, 13.0, "start", &low);
        canvas.text(left + length, y + 25.0, 13.0, "end", &high);
        let below = if width < NARROW { 25.0 + ROW } else { 9.0 };
        canvas.text(width - MARGIN, y + below, 15.0, "end", &self.caption);
    }

    /// What the widths of lines tell, in the row of the caption where it has one, and how contacts that slip
    /// are drawn where there is friction.
    fn draw_legend_of_forces(&self, canvas: &mut Canvas, most_force: f64, is_narrow: bool) {
        let y = canvas.height() - 12.0;
        let has_friction =
            self.links.iter().any(|link| link.contact.is_some_and(|(_, slides)| slides.is_some()));
        let names = match has_friction {
            true => vec![("sticks", Some(false)), ("slips", Some(true))],
            false => vec![("touches", None)],
        };
        let mut left = MARGIN;
        for (name, slides) in names {
            canvas.line((left, y - 4.0), (left + SAMPLE, y - 4.0), of_contact(0.4, slides));
            canvas.text(left + SAMPLE + 6.0, y, 13.0, "start", name);
            left += SAMPLE + 58.0;
        }
        let force = format!("widest: force / 6π*η* = {}", told(most_force));
        let (x, y) = if is_narrow { (MARGIN, y - 17.0) } else { (left, y) };
        canvas.text(x, y, 13.0, "start", &force);
    }
}

/// The stroke of a contact with this share of the largest force.
fn of_contact(share: f64, slides: Option<bool>) -> Stroke {
    let stroke = if slides == Some(true) { SLIPPING } else { LINK };
    Stroke { width: THINNEST + (WIDEST - THINNEST) * share, ..stroke }
}

/// A colour with a share of white.
fn faded(color: Rgb, share: f64) -> Rgb {
    color.map(|part| (f64::from(part) + share * (255.0 - f64::from(part))).round() as u8)
}

/// Lines between the centres of near particles or of contacts; across a border, from either one half of the
/// way.
fn links<const D: usize>(
    frame: &XyzFrame<D>,
    contacts: &[FrameContact<D>],
    look: &Look,
    container: &Container<D>,
) -> Vec<Link> {
    let place = |i: usize| container.wrapped(&frame.positions[i]);
    let between = |first: usize, second: Option<usize>, arm: &Vector<D>, contact| {
        let from = place(first);
        let lines = match second.map(place) {
            Some(to) if (from + arm - to).norm() >= 1e-9 * arm.norm() => {
                vec![[from, from + 0.5 * arm], [to, to - 0.5 * arm]]
            }
            _ => vec![[from, from + arm]],
        };
        let turned = move |ends: [Vector<D>; 2]| ends.map(|end| look.viewpoint.turned(&end));
        lines.into_iter().map(move |ends| Link { ends: turned(ends), contact })
    };
    match look.network {
        None => Vec::new(),
        Some(Lines::Near(reach)) => {
            let pairs = near_pairs(frame, reach).into_iter();
            pairs.flat_map(|([first, second], arm, _)| between(first, Some(second), &arm, None)).collect()
        }
        Some(Lines::Forces) => {
            let line = |one: &FrameContact<D>| {
                between(one.first, one.second, &one.arm, Some((one.force.abs(), one.slides)))
            };
            contacts.iter().flat_map(line).collect()
        }
    }
}

fn edges<const D: usize>(container: &Container<D>, view: Viewpoint) -> Vec<([[f64; 3]; 2], bool)> {
    let (lattice, bounds) = (container.lattice(), container.bounds());
    let corner = |n: usize| {
        let place =
            Vector::<D>::from_fn(|d, _| if n >> d & 1 == 0 { bounds.lower[d] } else { bounds.upper[d] });
        view.turned(&lattice.from_box(&place, bounds.lower[1]))
    };
    let pairs = (0..1 << D).flat_map(|n: usize| (0..D).map(move |d| (n, d)));
    let edges = pairs.filter(|(n, d)| n >> d & 1 == 0);
    // In the plane the edge along one axis is the border across the other.
    edges.map(|(n, d)| ([corner(n), corner(n | 1 << d)], D == 2 && !container.is_walled(1 - d % 2))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 0.5 on the edge from (0, 0) to (2, 0) in front hides the middle half of it.
    #[test]
    fn balls_hide_edges_behind_them() {
        let ball = |depth| Seen { at: [1.0, 0.0, depth], radius: 0.5, measure: 0.0, is_image: false };
        let edge = [[0.0; 3], [2.0, 0.0, 0.0]];
        let scene = |balls| Scene {
            is_flat: false,
            look: Look::default(),
            balls,
            links: Vec::new(),
            edges: vec![(edge, false)],
            caption: String::new(),
        };
        let seen = scene(vec![ball(0.0)]).unhidden(edge);
        assert_eq!(
            seen.iter().map(|ends| ends.map(|end| end[0])).collect::<Vec<_>>(),
            [[0.0, 0.5], [1.5, 2.0]]
        );
        assert_eq!(scene(vec![ball(-0.6)]).unhidden(edge), [edge]);
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
