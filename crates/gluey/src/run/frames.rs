//! The streams of frames of a run: those of the case, and those that the options ask for.

use std::path::{Path, PathBuf};

use gluey_contact::{ContactForce, ContactLaw};
use gluey_geom::Vector;
use gluey_parallel::Communicator;
use gluey_suspension::Container;

use super::contacts::Surrounded;
use super::error::RunError;
use super::options::{RunOptions, VtkOptions, XyzOptions};
use super::sharing::RunRanks;
use crate::case::{Case, Interval, OutputKind};
use crate::output::vtk::{FrameWriter, OnTheirWay, ShownBox, VtkEncoding, VtkFrame, VtkWriter, write_piece};
use crate::output::xyz::{XyzFrame, XyzWriter};
use crate::output::{FileError, ResultPaths};
use crate::simulation::{Simulation, StepError};

/// A stream of frames that a run is to write.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StreamOptions {
    pub folder: PathBuf,
    interval: Interval,
    format: FrameFormat,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum FrameFormat {
    Vtk { encoding: VtkEncoding, with_fields: bool },
    Xyz { gzip: bool },
}

impl StreamOptions {
    /// All streams of a run. One that the options ask for takes the place of the case's with its folder.
    pub fn of_run(case: &Case, options: &RunOptions) -> Vec<Self> {
        let paths = ResultPaths::of_csv(&options.csv);
        let asked = [options.vtk.as_ref().map(Self::vtk), options.xyz.as_ref().map(Self::xyz)];
        let asked: Vec<Self> = asked.into_iter().flatten().collect();
        let of_case = case.output.iter().map(|output| Self {
            folder: paths.frames(output.label()),
            interval: output.interval(),
            format: match output.kind {
                OutputKind::Vtk => FrameFormat::Vtk {
                    encoding: VtkEncoding { compression: output.compression, precision: output.precision },
                    with_fields: output.fields,
                },
                OutputKind::Xyz => FrameFormat::Xyz { gzip: output.compression > 0 },
            },
        });
        let others = of_case.filter(|stream| asked.iter().all(|other| other.folder != stream.folder));
        others.chain(asked.iter().cloned()).collect()
    }

    fn vtk(options: &VtkOptions) -> Self {
        let format = FrameFormat::Vtk { encoding: options.encoding, with_fields: true };
        Self { folder: options.folder.clone(), interval: Interval::Steps(options.every), format }
    }

    fn xyz(options: &XyzOptions) -> Self {
        let format = FrameFormat::Xyz { gzip: options.gzip };
        Self { folder: options.folder.clone(), interval: Interval::Steps(options.every), format }
    }
}

/// The streams of a run that is going on.
pub(super) struct Frames<const D: usize> {
    streams: Vec<(Interval, Stream<D>)>,
    /// Number of this rank among those that share the flow.
    rank: usize,
    on_their_way: OnTheirWay,
}

enum Stream<const D: usize> {
    Vtk {
        writer: FrameWriter<D>,
        with_fields: bool,
    },
    Xyz(XyzWriter),
    /// On ranks other than zero, whose fields the frames of rank zero name.
    Piece {
        folder: PathBuf,
        encoding: VtkEncoding,
    },
}

impl<const D: usize> Frames<D> {
    /// Prepares the folders for a run that begins at `step`; of the steps done, those with files stay listed.
    pub fn create(
        case: &Case,
        options: &RunOptions,
        step: usize,
        sharing: &RunRanks<'_>,
    ) -> Result<Self, FileError> {
        let (rank, on_their_way) = (sharing.ranks.rank(), OnTheirWay::default());
        let stream = |StreamOptions { folder, interval, format }: StreamOptions| {
            let opened = match format {
                FrameFormat::Vtk { encoding, with_fields: true } if rank > 0 => {
                    Stream::Piece { folder, encoding }
                }
                _ if rank > 0 => return Ok(None),
                FrameFormat::Xyz { gzip } => Stream::Xyz(XyzWriter::create(&folder, gzip)?),
                FrameFormat::Vtk { encoding, with_fields } => {
                    let writer = vtk_writer(case, &folder, interval, step)?.encoded(encoding);
                    let writer = match sharing.rank_count() {
                        0 => writer,
                        count => writer.in_pieces(count),
                    };
                    Stream::Vtk { writer: FrameWriter::new(writer, on_their_way.clone())?, with_fields }
                }
            };
            Ok(Some((interval, opened)))
        };
        let streams = StreamOptions::of_run(case, options).into_iter().map(stream);
        let streams = streams.filter_map(Result::transpose).collect::<Result<_, _>>()?;
        Ok(Self { streams, rank, on_their_way })
    }

    /// The frames that are not on disk yet.
    pub fn on_their_way(&self) -> OnTheirWay {
        self.on_their_way.clone()
    }

    /// Writes the fields in the cells of this rank into the pieces that are due, unless it is rank zero.
    pub fn write_pieces<H, C>(&self, case: &Case, simulation: &Simulation<D, H, C>) -> Result<(), FileError>
    where
        H: gluey_motion::Hydrodynamics<D>,
        C: Surrounded<D>,
    {
        let step = simulation.step_index();
        for (_, stream) in self.streams.iter().filter(|(interval, _)| is_due(case, interval, step)) {
            if let (Stream::Piece { folder, encoding }, Some(fields)) = (stream, simulation.fields()) {
                write_piece(folder, step, self.rank, &fields, *encoding)?;
            }
        }
        Ok(())
    }

    /// Writes what is due of the simulation as it is, when the pieces of other ranks are there.
    pub fn write<H, C>(&mut self, case: &Case, simulation: &Simulation<D, H, C>) -> Result<(), RunError>
    where
        H: gluey_motion::Hydrodynamics<D>,
        C: Surrounded<D>,
    {
        let (step, time) = (simulation.step_index(), simulation.time());
        let (particles, twists) = (simulation.particles(), simulation.twists());
        for (_, stream) in self.streams.iter_mut().filter(|(interval, _)| is_due(case, interval, step)) {
            match stream {
                Stream::Vtk { writer, with_fields } => {
                    let domain = simulation.contact().domain().clone();
                    let shown =
                        || ShownBox { container: container(case, simulation), slide: simulation.slide() };
                    writer.write(VtkFrame {
                        step,
                        time,
                        particles: particles.to_vec(),
                        twists: twists.to_vec(),
                        contacts: simulation.contacts().to_vec(),
                        in_flow: simulation.contact().forces_in_flow(),
                        in_box: domain.is_periodic().then(shown),
                        domain,
                        fields: with_fields.then(|| simulation.fields()).flatten(),
                    })?;
                }
                Stream::Xyz(writer) => {
                    let container = container(case, simulation);
                    let strain = case.strain_after(step);
                    let frame = XyzFrame::of(time, strain, container, particles, twists);
                    let frame = match contact_forces(simulation)? {
                        Some(forces) => frame.with_contact_forces(forces),
                        None => frame,
                    };
                    writer.write(step, &frame)?;
                }
                Stream::Piece { .. } => {}
            }
        }
        Ok(())
    }

    /// Returns when all frames are on disk.
    pub fn flush(&mut self) -> Result<(), FileError> {
        self.streams.iter_mut().try_for_each(|(_, stream)| match stream {
            Stream::Vtk { writer, .. } => writer.flush(),
            Stream::Xyz(_) | Stream::Piece { .. } => Ok(()),
        })
    }

    /// Ends all streams when their frames are on disk.
    pub fn finish(self) -> Result<(), FileError> {
        self.streams.into_iter().try_for_each(|(_, stream)| match stream {
            Stream::Vtk { writer, .. } => writer.finish(),
            Stream::Xyz(_) | Stream::Piece { .. } => Ok(()),
        })
    }
}

/// What contacts exert on each particle; nothing where there is no contact model.
fn contact_forces<const D: usize, H, C>(
    simulation: &Simulation<D, H, C>,
) -> Result<Option<Vec<Vector<D>>>, RunError>
where
    H: gluey_motion::Hydrodynamics<D>,
    C: Surrounded<D>,
{
    let contact = simulation.contact();
    if let Some(forces) = contact.forces_in_flow() {
        return Ok(Some(added_up(&forces, simulation.particles().len())));
    }
    if contact.params().law == ContactLaw::None {
        return Ok(None);
    }
    let (step, time) = (simulation.step_index(), simulation.time());
    let forces = contact.of_network(simulation.particles(), |network| network.forces());
    Ok(Some(forces.map_err(|source| StepError::Contact { step, time, source })?))
}

/// The sum of forces on each of so many particles.
fn added_up<const D: usize>(forces: &[ContactForce<D>], count: usize) -> Vec<Vector<D>> {
    let mut sums = vec![Vector::zeros(); count];
    for ContactForce { pair, force, .. } in forces {
        let (first, second) = pair.particles();
        sums[first] -= force;
        second.into_iter().for_each(|second| sums[second] += force);
    }
    sums
}

/// The box as it is sheared now.
fn container<const D: usize, H, C>(case: &Case, simulation: &Simulation<D, H, C>) -> Container<D>
where
    H: gluey_motion::Hydrodynamics<D>,
    C: Surrounded<D>,
{
    let container = case.container();
    container.tilted(simulation.strain() * container.bounds().extent()[1])
}

/// Whether a step of a case has a frame.
fn is_due(case: &Case, interval: &Interval, step: usize) -> bool {
    interval.is_due(step, case.shear_rate * case.time.step, case.time.step)
}

fn vtk_writer(case: &Case, folder: &Path, interval: Interval, step: usize) -> Result<VtkWriter, FileError> {
    let done = (0..step).filter(|&step| is_due(case, &interval, step));
    let done: Vec<(usize, f64)> = done.map(|step| (step, step as f64 * case.time.step)).collect();
    VtkWriter::create(folder, &done)
}
