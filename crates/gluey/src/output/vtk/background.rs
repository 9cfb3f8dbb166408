//! Writes frames in a thread of its own, beside the next step.
//!
//! One frame may wait while another is written. What fails shows at the next frame, checkpoint or end.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::{VtkFrame, VtkWriter};
use crate::output::FileError;

/// Frames that may wait.
const QUEUE: usize = 1;

/// Counts frames that are on their way to the disk.
#[derive(Clone, Debug, Default)]
pub(crate) struct OnTheirWay(Arc<AtomicUsize>);

impl OnTheirWay {
    /// Returns when there is none, from any thread.
    pub fn wait(&self) {
        while self.0.load(Ordering::Acquire) > 0 {
            thread::sleep(Duration::from_millis(1));
        }
    }

    fn begin(&self) -> Passage {
        self.0.fetch_add(1, Ordering::AcqRel);
        Passage(self.clone())
    }
}

/// A frame that is on its way.
struct Passage(OnTheirWay);

impl Drop for Passage {
    fn drop(&mut self) {
        self.0.0.fetch_sub(1, Ordering::AcqRel);
    }
}

enum FrameMessage<const D: usize> {
    /// A frame, and what ends when it is on disk, or given up.
    VtkFrame(Box<VtkFrame<D>>, Passage),
    /// An answer is due when all frames before are on disk.
    Flush(SyncSender<()>),
}

/// A [`VtkWriter`] in a thread of its own; frames keep their order.
#[derive(Debug)]
pub(crate) struct FrameWriter<const D: usize> {
    folder: PathBuf,
    on_their_way: OnTheirWay,
    queue: Option<SyncSender<FrameMessage<D>>>,
    /// Nothing once it ended, which it does before it is told to only where a frame could not be written.
    thread: Option<JoinHandle<Result<(), FileError>>>,
}

impl<const D: usize> FrameWriter<D> {
    /// Starts the thread; `on_their_way` counts its frames.
    pub fn new(writer: VtkWriter, on_their_way: OnTheirWay) -> Result<Self, FileError> {
        let folder = writer.folder.clone();
        let (queue, messages) = sync_channel(QUEUE);
        let thread = thread::Builder::new().name("frames".to_owned()).spawn(move || serve(writer, messages));
        let thread =
            thread.map_err(|error| FileError::new(&folder, "start a thread for the folder", error))?;
        Ok(Self { folder, on_their_way, queue: Some(queue), thread: Some(thread) })
    }

    /// Has a frame written; waits while two others are on their way.
    pub fn write(&mut self, frame: VtkFrame<D>) -> Result<(), FileError> {
        self.send(FrameMessage::VtkFrame(Box::new(frame), self.on_their_way.begin()))
    }

    /// Returns when all frames are on disk.
    pub fn flush(&mut self) -> Result<(), FileError> {
        let (answer, answered) = sync_channel(1);
        self.send(FrameMessage::Flush(answer))?;
        answered.recv().or_else(|_| self.failure())
    }

    /// Ends the thread when all frames are on disk.
    pub fn finish(mut self) -> Result<(), FileError> {
        if self.thread.is_some() { self.end() } else { self.failure() }
    }

    fn send(&mut self, message: FrameMessage<D>) -> Result<(), FileError> {
        let sent = self.queue.as_ref().map(|queue| queue.send(message));
        if matches!(sent, Some(Ok(()))) { Ok(()) } else { self.failure() }
    }

    /// The error that ended the thread before it was told to.
    fn failure(&mut self) -> Result<(), FileError> {
        self.end()?;
        let lost = io::Error::other("an earlier frame could not be written");
        Err(FileError::new(&self.folder, "write into the folder", lost))
    }

    fn end(&mut self) -> Result<(), FileError> {
        self.queue = None;
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(outcome)) => outcome,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
        }
    }
}

impl<const D: usize> Drop for FrameWriter<D> {
    /// Frames on their way are written, also when the run has failed otherwise.
    fn drop(&mut self) {
        self.queue = None;
        if let Some(thread) = self.thread.take() {
            // The run fails for another reason, which is told.
            let _ = thread.join();
        }
    }
}

fn serve<const D: usize>(
    mut writer: VtkWriter,
    messages: Receiver<FrameMessage<D>>,
) -> Result<(), FileError> {
    for message in messages {
        match message {
            FrameMessage::VtkFrame(frame, _passage) => writer.write(&frame)?,
            // Whoever asked has gone if this fails.
            FrameMessage::Flush(answer) => drop(answer.send(())),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use gluey_contact::Domain;

    use super::*;

    fn frame(step: usize) -> VtkFrame<2> {
        let (particles, twists, contacts, domain) = (vec![], vec![], vec![], Domain::default());
        let (time, in_flow, in_box, fields) = (step as f64, None, None, None);
        VtkFrame { step, time, particles, twists, contacts, in_flow, domain, in_box, fields }
    }

    #[test]
    fn frames_keep_their_order_and_are_there_when_flushed() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut frames =
            FrameWriter::new(VtkWriter::create(folder.path(), &[]).expect("a folder"), OnTheirWay::default())
                .expect("a thread");
        for step in 0..5 {
            frames.write(frame(step)).expect("a frame");
        }
        frames.flush().expect("on disk");
        frames.on_their_way.wait();
        let list = std::fs::read_to_string(folder.path().join("particles.pvd")).expect("a collection");
        let places: Vec<_> = (0..5).map(|step| list.find(&format!("particles-00000{step}.vtu"))).collect();
        assert!(places.is_sorted() && places[0].is_some(), "{list}");
        frames.finish().expect("on disk");
    }

    #[test]
    fn a_frame_that_cannot_be_written_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        // Where a file should be there is a folder.
        std::fs::create_dir(folder.path().join("particles-000001.vtu")).expect("a folder");
        let writer = VtkWriter::create(folder.path(), &[]).expect("a folder");
        let mut frames = FrameWriter::new(writer, OnTheirWay::default()).expect("a thread");
        frames.write(frame(0)).expect("a frame");
        frames.write(frame(1)).expect("not known yet");
        let error = frames.flush().expect_err("a frame is missing");
        assert!(error.path.ends_with("particles-000001.vtu"), "{error}");
        assert!(frames.flush().is_err(), "the frame is still missing");
        frames.on_their_way.wait();
        assert!(frames.write(frame(2)).is_err());
        assert!(frames.finish().is_err());
    }
}
