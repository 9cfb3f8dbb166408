//! Particles from a file: comma-separated columns `x`, `y` (`z` in 3D) and `radius`.

use std::path::Path;

use super::{ParticleProblem, ParticleSpec};

/// The particles of the file at `path`.
pub(super) fn read(path: &Path, dimension: usize) -> Result<Vec<ParticleSpec>, ParticleProblem> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| ParticleProblem::Unreadable { path: path.to_owned(), reason: error.to_string() })?;
    parse(&text, dimension).map_err(|Fault { line, found, wanted }| ParticleProblem::File {
        path: path.to_owned(),
        line,
        found,
        wanted,
    })
}

/// What is wrong in a text.
#[derive(Debug, PartialEq)]
struct Fault {
    line: usize,
    found: String,
    wanted: String,
}

/// Empty lines and those that begin with `#` do not count.
fn parse(text: &str, dimension: usize) -> Result<Vec<ParticleSpec>, Fault> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let names = if dimension == 2 { "x,y,radius" } else { "x,y,z,radius" };
    let wanted = || format!("the header `{names}`");
    let Some((line, header)) = lines.next() else {
        return Err(Fault { line: 1, found: String::new(), wanted: wanted() });
    };
    if header.split(',').map(str::trim).ne(names.split(',')) {
        return Err(Fault { line, found: header.to_owned(), wanted: wanted() });
    }
    lines.map(|(line, text)| particle(line, text, dimension)).collect()
}

fn particle(line: usize, text: &str, dimension: usize) -> Result<ParticleSpec, Fault> {
    let number = |cell: &str| match cell.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(Fault { line, found: cell.trim().to_owned(), wanted: "a finite number".into() }),
    };
    let mut numbers = text.split(',').map(number).collect::<Result<Vec<f64>, _>>()?;
    match numbers.pop() {
        Some(radius) if numbers.len() == dimension && radius > 0.0 => Ok(ParticleSpec::new(numbers, radius)),
        Some(radius) if numbers.len() == dimension => {
            Err(Fault { line, found: radius.to_string(), wanted: "a positive radius".into() })
        }
        _ => Err(Fault { line, found: text.to_owned(), wanted: format!("{} numbers", dimension + 1) }),
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
        assert_eq!(parse("x,y,z,radius\n", 3), Ok(Vec::new()));
    }

    #[test]
    fn faults_have_their_line_and_value() {
        for (text, line, found) in [
            ("", 1, ""),
            ("x,y,z,radius\n", 1, "x,y,z,radius"),
            ("x,y,radius\n0.1,b,0.05\n", 2, "b"),
            ("x,y,radius\n\n0.1,0.05\n", 3, "0.1,0.05"),
            ("x,y,radius\n0.1,0.1,-1\n", 2, "-1"),
            ("x,y,radius\n0.1,inf,1\n", 2, "inf"),
        ] {
            let fault = parse(text, 2).expect_err(text);
            assert_eq!((fault.line, &*fault.found), (line, found), "{fault:?}");
        }
    }
}
