//! A text file that grows line by line, and goes on growing after its writer was killed.
//!
//! A [`DraftMark`] in a checkpoint says how far the file had come. A run that resumes keeps all whole lines
//! behind the mark: what it writes there is compared with them, byte by byte, until there are no more. One
//! that cannot have the same bits leaves them where they are and goes on in a draft of its own.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use blake3::Hasher;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{FileError, create_draft, draft_path, rename};

/// The place that a file had come to.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DraftMark {
    /// Number of the draft.
    pub draft: u32,
    /// Bytes.
    pub bytes: u64,
    /// Lines.
    pub lines: u64,
    /// Their blake3 digest.
    pub digest: [u8; 32],
    /// Whether lines behind it are to be left alone, since those to come will differ in their last digits.
    #[serde(skip)]
    pub is_last: bool,
}

/// Rows could not be written or gone on with; those on disk are as they were.
#[derive(Debug, Error)]
pub enum RowsError {
    /// The file system refused.
    #[error(transparent)]
    Output(#[from] FileError),
    /// The rows that a checkpoint counts on are not there.
    #[error(
        "the {lines} lines that the checkpoint counts on are neither in {} nor in {}",
        draft.display(),
        complete.display()
    )]
    Missing {
        /// The file that was not complete when the checkpoint was written.
        draft: PathBuf,
        /// Its name when it is complete.
        complete: PathBuf,
        /// Lines up to the checkpoint.
        lines: u64,
    },
    /// A row on disk is not the one that is computed now.
    #[error("{}:{line}: the row on disk differs from the one that is computed now", path.display())]
    Differs {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
    },
    /// A row on disk is not one of such a run.
    #[error("{}:{line}: not a row of this run", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
    },
}

/// The growing file: draft `number` of `complete`.
#[derive(Debug)]
pub(crate) struct Draft {
    complete: PathBuf,
    number: u32,
    path: PathBuf,
    file: File,
    /// Bytes that lie on disk, in whole lines; more than `bytes` while a resumed run catches up.
    on_disk: u64,
    bytes: u64,
    lines: u64,
    hasher: Hasher,
    buffer: Vec<u8>,
}

impl Draft {
    /// The first draft of `complete` that is not there yet.
    pub fn create(complete: &Path) -> Result<Self, FileError> {
        let created = create_draft(complete);
        let draft = created.and_then(|(number, _)| Self::open(complete, number, &DraftMark::default()));
        draft.map_err(|error| FileError::new(complete, "create the file", error))
    }

    /// The same for a table with this header.
    pub fn with_header(complete: &Path, header: &str) -> Result<Self, RowsError> {
        let mut draft = Self::create(complete)?;
        draft.write(&format!("{header}\n"))?;
        Ok(draft)
    }

    /// Goes on at `mark` with the draft that was marked, of which only half a last line is taken away. Where
    /// its run was completed, the rows are copied to a new draft; the complete file stays until this run
    /// replaces it.
    pub fn resume(complete: &Path, mark: &DraftMark) -> Result<Self, RowsError> {
        let path = draft_path(complete, mark.draft);
        let failed = |error| FileError::new(complete, "go on with the file", error);
        if holds(&path, mark).map_err(failed)? {
            if mark.is_last {
                let copy = copy(&path, complete, mark.bytes).map_err(failed)?;
                return Ok(Self::open(complete, copy, mark).map_err(failed)?);
            }
            return Ok(Self::open(complete, mark.draft, mark).map_err(failed)?);
        }
        if holds(complete, mark).map_err(failed)? {
            let bytes = if mark.is_last { mark.bytes } else { u64::MAX };
            let copy = copy(complete, complete, bytes).map_err(failed)?;
            return Ok(Self::open(complete, copy, mark).map_err(failed)?);
        }
        Err(RowsError::Missing { draft: path, complete: complete.to_owned(), lines: mark.lines })
    }

    fn open(complete: &Path, number: u32, mark: &DraftMark) -> io::Result<Self> {
        let path = draft_path(complete, number);
        let mut file = File::options().read(true).write(true).open(&path)?;
        let mut hasher = Hasher::new();
        hasher.update_reader((&file).take(mark.bytes))?;
        let on_disk = mark.bytes + whole_lines(BufReader::new(&file))?;
        file.set_len(on_disk)?;
        file.seek(SeekFrom::Start(mark.bytes))?;
        let (bytes, lines) = (mark.bytes, mark.lines);
        Ok(Self {
            complete: complete.to_owned(),
            number,
            path,
            file,
            on_disk,
            bytes,
            lines,
            hasher,
            buffer: Vec::new(),
        })
    }

    /// Visits the lines up to here; `visit` says whether it could read the line.
    pub fn visit(&mut self, mut visit: impl FnMut(u64, &str) -> bool) -> Result<(), RowsError> {
        let failed = |error| FileError::new(&self.path, "read the file", error);
        self.file.rewind().map_err(failed)?;
        for (line, text) in (1..).zip(BufReader::new((&self.file).take(self.bytes)).lines()) {
            if !visit(line, &text.map_err(failed)?) {
                return Err(RowsError::Unreadable { path: self.path.clone(), line });
            }
        }
        self.file.seek(SeekFrom::Start(self.bytes)).map_err(failed)?;
        Ok(())
    }

    /// Adds whole lines; they are with the operating system when this returns.
    pub fn write(&mut self, text: &str) -> Result<(), RowsError> {
        let known = text.len().min((self.on_disk - self.bytes) as usize);
        let (known, new) = text.as_bytes().split_at(known);
        self.compare(known)?;
        self.file.write_all(new).map_err(|error| FileError::new(&self.path, "write a row", error))?;
        self.hasher.update(text.as_bytes());
        self.bytes += text.len() as u64;
        self.lines += text.lines().count() as u64;
        self.on_disk = self.on_disk.max(self.bytes);
        Ok(())
    }

    /// Adds a line that begins with `fixed`, the same whenever it is computed, and ends with `varying`, which
    /// is not. Where a resumed run catches up, the line on disk stays as it was.
    pub fn write_varying(&mut self, fixed: &str, varying: &str) -> Result<(), RowsError> {
        if self.on_disk == self.bytes {
            return self.write(&format!("{fixed}{varying}\n"));
        }
        let failed = |error| FileError::new(&self.path, "read the file", error);
        let mut found = Vec::new();
        BufReader::new(&self.file).read_until(b'\n', &mut found).map_err(failed)?;
        if !found.starts_with(fixed.as_bytes()) {
            return Err(RowsError::Differs { path: self.path.clone(), line: self.lines + 1 });
        }
        self.hasher.update(&found);
        self.bytes += found.len() as u64;
        self.lines += 1;
        (&self.file).seek(SeekFrom::Start(self.bytes)).map_err(failed)?;
        Ok(())
    }

    /// Demands that the next bytes on disk are `expected`.
    fn compare(&mut self, expected: &[u8]) -> Result<(), RowsError> {
        self.buffer.resize(expected.len(), 0);
        let read = self.file.read_exact(&mut self.buffer);
        read.map_err(|error| FileError::new(&self.path, "read the file", error))?;
        match self.buffer.iter().zip(expected).position(|(found, expected)| found != expected) {
            None => Ok(()),
            Some(place) => {
                let before = expected[..place].iter().filter(|&&byte| byte == b'\n').count() as u64;
                Err(RowsError::Differs { path: self.path.clone(), line: self.lines + before + 1 })
            }
        }
    }

    /// Where it is until it is complete.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How far the file has come.
    pub fn mark(&self) -> DraftMark {
        let digest = *self.hasher.finalize().as_bytes();
        DraftMark { draft: self.number, bytes: self.bytes, lines: self.lines, digest, is_last: false }
    }

    /// Gives the complete file its name. Where an earlier run had come further than this one goes, its rows
    /// stay in the draft.
    pub fn finish(self) -> Result<(), FileError> {
        let finish = || -> io::Result<()> {
            if self.bytes == self.on_disk {
                self.file.sync_all()?;
                return rename(&self.path, &self.complete);
            }
            let copy = copy(&self.path, &self.complete, self.bytes)?;
            rename(&draft_path(&self.complete, copy), &self.complete)
        };
        finish().map_err(|error| FileError::new(&self.complete, "complete the file", error))
    }
}

/// Whether the file is there and begins as it was marked.
fn holds(path: &Path, mark: &DraftMark) -> io::Result<bool> {
    let file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        opened => opened?,
    };
    let mut hasher = Hasher::new();
    hasher.update_reader(file.take(mark.bytes))?;
    Ok(hasher.count() == mark.bytes && *hasher.finalize().as_bytes() == mark.digest)
}

/// Copies the first `bytes` of a file to a new draft of `path`, and gives its number.
fn copy(from: &Path, path: &Path, bytes: u64) -> io::Result<u32> {
    let mut source = File::open(from)?.take(bytes);
    let (number, mut file) = create_draft(path)?;
    let copied = io::copy(&mut source, &mut file).and_then(|_| file.sync_all());
    if copied.is_err() {
        // Half a copy is of no use; that it stays is the lesser fault.
        let _ = fs::remove_file(draft_path(path, number));
    }
    copied.map(|()| number)
}

/// Bytes of whole lines that a reader has left.
fn whole_lines(mut reader: impl BufRead) -> io::Result<u64> {
    let (mut bytes, mut line) = (0, Vec::new());
    loop {
        line.clear();
        reader.read_until(b'\n', &mut line)?;
        if line.last() != Some(&b'\n') {
            return Ok(bytes);
        }
        bytes += line.len() as u64;
    }
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    /// A folder with a draft of four lines and a half, and the mark behind the second.
    fn killed() -> (TempDir, PathBuf, DraftMark) {
        let folder = tempfile::tempdir().expect("a folder");
        let complete = folder.path().join("t.csv");
        let mut draft = Draft::create(&complete).expect("a file");
        draft.write("t\n0\n").expect("lines");
        let mark = draft.mark();
        draft.write("1\n2\n3").expect("lines");
        (folder, complete, mark)
    }

    fn read(path: &Path) -> String {
        fs::read_to_string(path).expect("a file")
    }

    #[test]
    fn whole_lines_are_kept_and_not_written_again() {
        let (_folder, complete, mark) = killed();
        let path = draft_path(&complete, 1);
        let mut draft = Draft::resume(&complete, &mark).expect("marked");
        assert_eq!(read(&path), "t\n0\n1\n2\n");
        let mut seen = Vec::new();
        let visit = |line, text: &str| {
            seen.push((line, text.to_owned()));
            true
        };
        draft.visit(visit).expect("lines");
        assert_eq!(seen, [(1, "t".to_owned()), (2, "0".to_owned())]);
        draft.write("1\n").expect("as before");
        draft.write("2\n3\n").expect("as before, then new");
        assert_eq!(read(&path), "t\n0\n1\n2\n3\n");
        assert_eq!(draft.mark().lines, 5);
        draft.finish().expect("complete");
        assert_eq!(read(&complete), "t\n0\n1\n2\n3\n");
        assert!(!path.exists());
    }

    #[test]
    fn a_new_draft_leaves_those_that_are_there() {
        let (_folder, complete, _) = killed();
        assert_eq!(Draft::create(&complete).expect("a file").mark().draft, 2);
        assert_eq!(read(&draft_path(&complete, 1)), "t\n0\n1\n2\n3");
    }

    #[test]
    fn a_line_that_differs_is_named_and_nothing_is_changed() {
        let (_folder, complete, mark) = killed();
        let mut draft = Draft::resume(&complete, &mark).expect("marked");
        match draft.write("1\n5\n") {
            Err(RowsError::Differs { line: 4, .. }) => {}
            other => panic!("{other:?}"),
        }
        assert_eq!(read(&draft_path(&complete, 1)), "t\n0\n1\n2\n");
    }

    #[test]
    fn lines_behind_the_last_mark_stay_in_their_draft() {
        let (_folder, complete, mark) = killed();
        let mut draft = Draft::resume(&complete, &DraftMark { is_last: true, ..mark }).expect("marked");
        draft.write("5\n").expect("another line");
        assert_eq!(draft.mark().draft, 2);
        draft.finish().expect("complete");
        assert_eq!(read(&complete), "t\n0\n5\n");
        assert_eq!(read(&draft_path(&complete, 1)), "t\n0\n1\n2\n3");
    }

    #[test]
    fn a_line_that_varies_stays_as_it_was_written_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let complete = folder.path().join("t.csv");
        let mut draft = Draft::create(&complete).expect("a file");
        draft.write("n,s\n").expect("a line");
        let mark = draft.mark();
        draft.write("1,0.5\n2,0.25\n3").expect("lines");
        let mut draft = Draft::resume(&complete, &mark).expect("marked");
        draft.write_varying("1,", "7").expect("as before");
        match draft.write_varying("5,", "7") {
            Err(RowsError::Differs { line: 3, .. }) => {}
            other => panic!("{other:?}"),
        }
        let mut draft = Draft::resume(&complete, &mark).expect("marked");
        for (fixed, varying) in [("1,", "8"), ("2,", "8"), ("3,", "8")] {
            draft.write_varying(fixed, varying).expect("as before, then new");
        }
        let end = draft.mark();
        draft.finish().expect("complete");
        assert_eq!(read(&complete), "n,s\n1,0.5\n2,0.25\n3,8\n");
        assert!(holds(&complete, &end).expect("a file"), "the digest is not that of the file");
    }

    #[test]
    fn a_file_that_was_not_marked_is_left_alone() {
        let (_folder, complete, mark) = killed();
        for text in ["t\n1\n2\n3", "t\n", ""] {
            fs::write(draft_path(&complete, 1), text).expect("a file");
            match Draft::resume(&complete, &mark) {
                Err(RowsError::Missing { lines: 2, .. }) => {}
                other => panic!("{other:?}"),
            }
            assert_eq!(read(&draft_path(&complete, 1)), text);
        }
    }

    #[test]
    fn a_complete_file_is_gone_on_with_in_a_copy() {
        let (_folder, complete, mark) = killed();
        fs::rename(draft_path(&complete, 1), &complete).expect("renamed");
        let mut draft = Draft::resume(&complete, &mark).expect("marked");
        draft.write("1\n2\n3\n4\n").expect("as before, then new");
        assert_eq!(read(&complete), "t\n0\n1\n2\n3");
        draft.finish().expect("complete");
        assert_eq!(read(&complete), "t\n0\n1\n2\n3\n4\n");
    }

    #[test]
    fn rows_beyond_the_end_of_a_run_stay_in_the_draft() {
        let (folder, complete, mark) = killed();
        let mut draft = Draft::resume(&complete, &mark).expect("marked");
        draft.write("1\n").expect("as before");
        draft.finish().expect("complete");
        assert_eq!(
            (read(&complete), read(&draft_path(&complete, 1))),
            ("t\n0\n1\n".into(), "t\n0\n1\n2\n".into())
        );
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 2);
    }
}
