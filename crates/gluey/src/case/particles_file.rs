//! Particles from a file: comma-separated columns `x`, `y` (`z` in 3D) and `radius`.

use std::path::Path;

use super::{ParticleProblem, ParticleSpec};

/// The header of a file.
const NAMES_2D: &str = "x,y,radius";
const NAMES_3D: &str = "x,y,z,radius";

/// So many lines that are wrong are told.
const MOST_FAULTS: usize = 20;

/// The particles of the file at `path`, or all that is wrong in it.
pub(super) fn read(path: &Path, dimension: usize) -> Result<Vec<ParticleSpec>, Vec<ParticleProblem>> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        vec![ParticleProblem::Unreadable { path: path.to_owned(), reason: error.to_string() }]
    })?;
    let problem =
        |Fault { line, found, wanted }| ParticleProblem::File { path: path.to_owned(), line, found, wanted };
    parse(&text, dimension).map_err(|faults| faults.into_iter().map(problem).collect())
}

/// What is wrong in a text.
#[derive(Debug, PartialEq)]
struct Fault {
    line: usize,
    found: String,
    wanted: String,
}

/// Empty lines and those that begin with `#` do not count.
fn parse(text: &str, dimension: usize) -> Result<Vec<ParticleSpec>, Vec<Fault>> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let names = if dimension == 2 { NAMES_2D } else { NAMES_3D };
    let wanted = || format!("the header `{names}`");
    let Some((line, header)) = lines.next() else {
        return Err(vec![Fault { line: 1, found: String::new(), wanted: wanted() }]);
    };
    if header.split(',').map(str::trim).ne(names.split(',')) {
        return Err(vec![Fault { line, found: header.to_owned(), wanted: wanted() }]);
    }
    let (mut particles, mut faults) = (Vec::new(), Vec::new());
    for (line, text) in lines {
        match particle(line, text, dimension) {
            Ok(particle) => particles.push(particle),
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
    if faults.is_empty() { Ok(particles) } else { Err(faults) }
}

fn particle(line: usize, text: &str, dimension: usize) -> Result<ParticleSpec, Fault> {
    let names = if dimension == 2 { NAMES_2D } else { NAMES_3D };
    let number = |(index, cell): (usize, &str)| match cell.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => {
            let column = names.split(',').nth(index).unwrap_or("a column that is not in the header");
            Err(Fault { line, found: cell.trim().to_owned(), wanted: format!("a finite number as {column}") })
        }
    };
    let mut numbers = text.split(',').enumerate().map(number).collect::<Result<Vec<f64>, _>>()?;
    match numbers.pop() {
        Some(radius) if numbers.len() == dimension && radius > 0.0 => Ok(ParticleSpec::new(numbers, radius)),
        Some(radius) if numbers.len() == dimension => {
            Err(Fault { line, found: radius.to_string(), wanted: "a positive radius".into() })
        }
        _ => {
            Err(Fault { line, found: text.to_owned(), wanted: format!("{} numbers: {names}", dimension + 1) })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_particles() {
        let text = "# two discs\nx, y, radius\n0.1,0.2,0.05\n\n3e-1,0.4,0.06\n";
        let expected = [ParticleSpec::new(vec![0.1, 0.2], 0.05), ParticleSpec::new(vec![0.3, 0.4], 0.06)];
        assert_eq!(parse(text, 2), Ok(expected.to_vec()));
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
