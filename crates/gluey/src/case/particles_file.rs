//! Particles from a file: comma-separated columns `x`, `y` (`z` in 3D) and `radius`.

use std::path::{Path, PathBuf};

use super::error::{CaseIssue, IssuePlace, KeyPart};
use super::findings::Violation;
use super::{ParticleProblem, ParticleSpec};
use crate::number_text::shown;
use crate::text::{self, NotText};

/// The header of a file.
const NAMES_2D: &str = "x,y,radius";
const NAMES_3D: &str = "x,y,z,radius";

/// What helps where other programs write lists in other ways.
const COMMAS: &str = "columns are separated by commas, decimals by a point";

/// What other programs put between columns.
const OTHER_SEPARATORS: [char; 3] = [';', '|', '\t'];

/// So many lines that are wrong are told.
const MOST_FAULTS: usize = 20;

/// The particles of a file, and where they stand in it.
#[derive(Debug, PartialEq)]
pub(super) struct ParticleList {
    pub particles: Vec<ParticleSpec>,
    file: PathBuf,
    /// Lines of the particles, from 1, and what is written there.
    rows: Vec<(usize, String)>,
}

impl ParticleList {
    /// What is wrong with a particle, at its row.
    pub fn issue(&self, Violation { key, problem }: &Violation) -> Option<(usize, CaseIssue)> {
        let index = match key.0.get(..2) {
            Some([_, KeyPart::Index(index)]) if key.is_of_particles() => *index,
            _ => return None,
        };
        let (line, row) = self.rows.get(index)?;
        let (place, value) =
            (IssuePlace::List { file: self.file.clone(), line: *line }, Some(text::visible(row)));
        Some((*line, CaseIssue { place, key: key.clone(), value, problem: problem.clone() }))
    }
}

/// The particles of the file at `path`, or all that is wrong in it.
pub(super) fn read(path: &Path, dimension: usize) -> Result<ParticleList, Vec<ParticleProblem>> {
    let file = path.to_owned();
    let text = text::read(path).map_err(|error| {
        let (path, reason, is_not_text) = (file.clone(), error.to_string(), NotText::is_in(&error));
        vec![ParticleProblem::Unreadable { path, reason, is_not_text }]
    })?;
    let problem =
        |Fault { line, found, wanted }| ParticleProblem::File { path: file.clone(), line, found, wanted };
    match parse(&text, dimension) {
        Ok((particles, rows)) => Ok(ParticleList { particles, file, rows }),
        Err(faults) => Err(faults.into_iter().map(problem).collect()),
    }
}

/// An error in a text.
#[derive(Debug, PartialEq)]
struct Fault {
    line: usize,
    found: String,
    wanted: String,
}

/// Particles, their lines, and what is written there.
type ParticleRows = (Vec<ParticleSpec>, Vec<(usize, String)>);

/// Empty lines and those that begin with `#` do not count.
fn parse(text: &str, dimension: usize) -> Result<ParticleRows, Vec<Fault>> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let names = names(dimension);
    let Some((line, header)) = lines.next() else {
        return Err(vec![Fault { line: 1, found: String::new(), wanted: format!("the header `{names}`") }]);
    };
    if header.split(',').map(str::trim).ne(names.split(',')) {
        return Err(vec![Fault { line, found: header.to_owned(), wanted: header_wanted(header, dimension) }]);
    }
    let (mut particles, mut rows, mut faults) = (Vec::new(), Vec::new(), Vec::new());
    for (line, text) in lines {
        match particle(line, text, dimension) {
            Ok(particle) => {
                particles.push(particle);
                rows.push((line, text.to_owned()));
            }
            Err(fault) => faults.push(fault),
        }
        if faults.len() == MOST_FAULTS {
            break;
        }
    }
    if particles.is_empty() && faults.is_empty() {
        return Err(vec![Fault {
            line,
            found: header.to_owned(),
            wanted: "a line for each particle below".into(),
        }]);
    }
    if faults.is_empty() { Ok((particles, rows)) } else { Err(faults) }
}

fn names(dimension: usize) -> &'static str {
    if dimension == 2 { NAMES_2D } else { NAMES_3D }
}

/// What a header that is another one should be, and why it may be none.
fn header_wanted(header: &str, dimension: usize) -> String {
    let wanted = format!("the header `{}`", names(dimension));
    let is_of_other_dimension = header.split(',').map(str::trim).eq(names(5 - dimension).split(','));
    match (is_of_other_dimension, is_separated_otherwise(header)) {
        (true, _) => format!("{wanted}, for the case has dimension = {dimension}"),
        (_, true) => format!("{wanted}: {COMMAS}"),
        _ => wanted,
    }
}

/// Whether columns seem to be separated by something else than commas.
fn is_separated_otherwise(text: &str) -> bool {
    text.contains(OTHER_SEPARATORS) || (!text.contains(',') && text.trim().contains(char::is_whitespace))
}

fn particle(line: usize, text: &str, dimension: usize) -> Result<ParticleSpec, Fault> {
    let names = names(dimension);
    let fault = |found: &str, wanted: String, is_otherwise: bool| {
        let wanted = if is_otherwise { format!("{wanted}: {COMMAS}") } else { wanted };
        Fault { line, found: found.to_owned(), wanted }
    };
    let number = |(index, cell): (usize, &str)| match cell.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => {
            let column = names.split(',').nth(index).unwrap_or("a column that is not in the header");
            let is_otherwise = is_separated_otherwise(cell);
            Err(fault(cell.trim(), format!("a finite number as {column}"), is_otherwise))
        }
    };
    let count = dimension + 1;
    if text.contains(OTHER_SEPARATORS) {
        return Err(fault(text, format!("{count} numbers: {names}"), true));
    }
    let mut numbers = text.split(',').enumerate().map(number).collect::<Result<Vec<f64>, _>>()?;
    match numbers.pop() {
        Some(radius) if numbers.len() == dimension && radius > 0.0 => Ok(ParticleSpec::new(numbers, radius)),
        Some(radius) if numbers.len() == dimension => {
            Err(fault(&shown(radius), "a positive radius".into(), false))
        }
        // Decimals with commas make two numbers of one.
        _ => Err(fault(text, format!("{count} numbers: {names}"), numbers.len() + 1 == 2 * count)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_particles() {
        let text = "# two discs\nx, y, radius\n0.1,0.2,0.05\n\n3e-1,0.4,0.06\n";
        let expected = [ParticleSpec::new(vec![0.1, 0.2], 0.05), ParticleSpec::new(vec![0.3, 0.4], 0.06)];
        let rows = [(3, "0.1,0.2,0.05".to_owned()), (5, "3e-1,0.4,0.06".to_owned())];
        assert_eq!(parse(text, 2), Ok((expected.to_vec(), rows.to_vec())));
    }

    /// What spreadsheets and other programs write is told from what is only wrong.
    #[test]
    fn other_ways_to_write_a_list_are_told() {
        for text in [
            "x;y;radius\n0,3;0,4;0,05\n",
            "x\ty\tradius\n",
            "x y radius\n",
            "x,y,radius\n0.3;0.4;0.05\n",
            "x,y,radius\n0.3\t0.4\t0.05\n",
            "x,y,radius\n0,3,0,4,0,05\n",
        ] {
            let faults = parse(text, 2).expect_err(text);
            assert!(faults[0].wanted.ends_with(COMMAS), "{faults:?}");
        }
        for (text, dimension) in [("x,y,z,radius\n", 2), ("x, y, radius\n", 3)] {
            let faults = parse(text, dimension).expect_err(text);
            assert!(
                faults[0].wanted.ends_with(&format!("the case has dimension = {dimension}")),
                "{faults:?}"
            );
        }
        for text in ["a,b,c\n", "x,y,radius\n0.3,half,0.05\n", "x,y,radius\n0.3,0.05\n"] {
            let faults = parse(text, 2).expect_err(text);
            assert!(!faults[0].wanted.contains(COMMAS), "{faults:?}");
        }
    }

    #[test]
    fn faults_have_their_line_and_value() {
        for (text, line, found) in [
            ("", 1, ""),
            ("x,y,z,radius\n", 1, "x,y,z,radius"),
            ("x,y,radius\n", 1, "x,y,radius"),
            ("x,y,radius\n0.1,b,0.05\n", 2, "b"),
            ("x,y,radius\n\n0.1,0.05\n", 3, "0.1,0.05"),
            ("x,y,radius\n0.1,0.1,-1\n", 2, "-1"),
            ("x,y,radius\n0.1,inf,1\n", 2, "inf"),
        ] {
            let faults = parse(text, 2).expect_err(text);
            let [fault] = &faults[..] else { panic!("{faults:?}") };
            assert_eq!((fault.line, &*fault.found), (line, found), "{fault:?}");
        }
        let lines = "0.1,b,0.05\n0.1,0.1,0.05\n0.1,0.1,-1\n".repeat(30);
        let faults = parse(&format!("x,y,radius\n{lines}"), 2).expect_err("wrong lines");
        assert_eq!((faults.len(), faults[0].line, faults[1].line), (MOST_FAULTS, 2, 4));
    }
}
