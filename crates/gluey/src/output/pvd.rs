//! ParaView collections: which file belongs to which time.

use std::fmt::Write;
use std::path::Path;

use super::{FileError, write_atomically};

/// Writes a collection of files, named relative to its own folder, with the time of each.
pub fn write(path: &Path, entries: &[(f64, String)]) -> Result<(), FileError> {
    write_atomically(path, document(entries).as_bytes())
}

fn document(entries: &[(f64, String)]) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n",
    );
    for (time, file) in entries {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "<DataSet timestep=\"{time}\" part=\"0\" file=\"{file}\"/>");
    }
    text.push_str("</Collection>\n</VTKFile>\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_listed_with_its_time() {
        let text = document(&[(0.0, "a-0.vtu".into()), (0.1, "a-4.vtu".into())]);
        assert_eq!(text.matches("<DataSet").count(), 2);
        assert!(text.contains("timestep=\"0.1\" part=\"0\" file=\"a-4.vtu\""));
    }
}
