//! The streams of frames of a run: those of the case, and those that the options ask for.

use std::path::{Path, PathBuf};

use gluey_contact::ContactLaw;
use gluey_geom::{Dim, Space, Vector};
use gluey_suspension::Container;

use super::contacts::Surrounded;
use super::error::RunError;
use super::options::{RunOptions, VtkOptions, XyzOptions};
use crate::case::{Case, Interval, OutputKind};
use crate::checkpoint::FlowPieces;
use crate::output::vtk::{FrameWriter, OnTheirWay, ShownBox, VtkEncoding, VtkFrame, VtkWriter};
use crate::output::xyz::{XyzFrame, XyzWriter};
use crate::output::{FileError, ResultPaths};
use crate::simulation::{Simulation, StepError};

/// The other ranks that share the flow of a run.
pub(super) trait Others {
    /// Number of ranks, this one among them.
    fn rank_count(&self) -> usize;

    /// Has them write the fields in their cells at a step, as one of the streams of the run. All are on disk
    /// then.
    fn write_fields(&self, stream: usize, step: usize) -> Result<(), FileError>;

    /// Writes, with them, what the flow after the last step that was remembered starts from, in files for a
    /// checkpoint that is to be written next; none if it starts from nothing. All are on disk then.
    fn write_flow(&self, checkpoint: &Path, name: u64) -> Result<Option<FlowPieces>, FileError>;
}

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

    /// How numbers are stored in the files for ParaView, if it has such.
    #[cfg(feature = "ranks")]
    pub fn encoding(&self) -> Option<VtkEncoding> {
        match self.format {
            FrameFormat::Vtk { encoding, .. } => Some(encoding),
            FrameFormat::Xyz { .. } => None,
        }
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
pub(super) struct Frames<'a, const D: usize>
where
    Dim<D>: Space<D>,
{
    streams: Vec<(Interval, Stream<D>)>,
    others: Option<&'a dyn Others>,
    on_their_way: OnTheirWay,
}

enum Stream<const D: usize>
where
    Dim<D>: Space<D>,
{
    Vtk { writer: FrameWriter<D>, with_fields: bool },
    Xyz(XyzWriter),
}

impl<'a, const D: usize> Frames<'a, D>
where
    Dim<D>: Space<D>,
{
    /// Prepares the folders for a run that begins at `step`; of the steps done, those with files stay listed.
    pub fn create(
        case: &Case,
        options: &RunOptions,
        step: usize,
        others: Option<&'a dyn Others>,
    ) -> Result<Self, FileError> {
        let on_their_way = OnTheirWay::default();
        let stream = |stream: StreamOptions| {
            let StreamOptions { folder, interval, format } = stream;
            let opened = match format {
                FrameFormat::Xyz { gzip } => Stream::Xyz(XyzWriter::create(&folder, gzip)?),
                FrameFormat::Vtk { encoding, with_fields } => {
                    let writer = vtk_writer(case, &folder, interval, step)?.encoded(encoding);
                    let writer = match others {
                        Some(others) => writer.in_pieces(others.rank_count()),
                        None => writer,
                    };
                    Stream::Vtk { writer: FrameWriter::new(writer, on_their_way.clone())?, with_fields }
                }
            };
            Ok((interval, opened))
        };
        let streams = StreamOptions::of_run(case, options).into_iter().map(stream);
        Ok(Self { streams: streams.collect::<Result<_, _>>()?, others, on_their_way })
    }

    /// The frames that are not on disk yet.
    pub fn on_their_way(&self) -> OnTheirWay {
        self.on_their_way.clone()
    }

    /// Writes what is due of the simulation as it is.
    pub fn write<H, C>(&mut self, case: &Case, simulation: &Simulation<D, H, C>) -> Result<(), RunError>
    where
        H: gluey_motion::Hydrodynamics<D>,
        C: Surrounded<D>,
    {
        let (step, time) = (simulation.step_index(), simulation.time());
        let (particles, twists) = (simulation.particles(), simulation.twists());
        let due =
            |interval: &Interval| interval.is_due(step, case.shear_rate * case.time.step, case.time.step);
        for (index, (_, stream)) in self.streams.iter_mut().enumerate().filter(|(_, (every, _))| due(every)) {
            match stream {
                Stream::Vtk { writer, with_fields } => {
                    if let (true, Some(others)) = (*with_fields, self.others) {
                        others.write_fields(index, step)?;
                    }
                    let domain = simulation.contact().domain().clone();
                    let shown =
                        || ShownBox { container: container(case, simulation), slide: simulation.slide() };
                    writer.write(VtkFrame {
                        step,
                        time,
                        particles: particles.to_vec(),
                        twists: twists.to_vec(),
                        contacts: simulation.contacts().to_vec(),
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
            }
        }
        Ok(())
    }

    /// Returns when all frames are on disk.
    pub fn flush(&mut self) -> Result<(), FileError> {
        self.streams.iter_mut().try_for_each(|(_, stream)| match stream {
            Stream::Vtk { writer, .. } => writer.flush(),
            Stream::Xyz(_) => Ok(()),
        })
    }

    /// Ends all streams when their frames are on disk.
    pub fn finish(self) -> Result<(), FileError> {
        self.streams.into_iter().try_for_each(|(_, stream)| match stream {
            Stream::Vtk { writer, .. } => writer.finish(),
            Stream::Xyz(_) => Ok(()),
        })
    }
}

/// What contacts exert on each particle; nothing where there is no contact model.
fn contact_forces<const D: usize, H, C>(
    simulation: &Simulation<D, H, C>,
) -> Result<Option<Vec<Vector<D>>>, RunError>
where
    Dim<D>: Space<D>,
    H: gluey_motion::Hydrodynamics<D>,
    C: Surrounded<D>,
{
    let contact = simulation.contact();
    if contact.params().law == ContactLaw::None {
        return Ok(None);
    }
    let (step, time) = (simulation.step_index(), simulation.time());
    let forces = contact.of_network(simulation.particles(), |network| network.forces());
    Ok(Some(forces.map_err(|source| StepError::Contact { step, time, source })?))
}

/// The box as it is sheared now.
fn container<const D: usize, H, C>(case: &Case, simulation: &Simulation<D, H, C>) -> Container<D>
where
    Dim<D>: Space<D>,
    H: gluey_motion::Hydrodynamics<D>,
    C: Surrounded<D>,
{
    let container = case.container();
    container.tilted(simulation.strain() * container.bounds().extent()[1])
}

fn vtk_writer(case: &Case, folder: &Path, interval: Interval, step: usize) -> Result<VtkWriter, FileError> {
    let strain = case.shear_rate * case.time.step;
    let done = (0..step).filter(|&step| interval.is_due(step, strain, case.time.step));
    let done: Vec<(usize, f64)> = done.map(|step| (step, step as f64 * case.time.step)).collect();
    VtkWriter::create(folder, &done)
}
