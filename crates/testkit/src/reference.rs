//! The reference data of `data/reference`, read by the names in their headers. Where they come from and how
//! exact they are is written in `data/reference/README.md`.

use std::collections::BTreeMap;

/// A table of numbers with named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: BTreeMap<String, Vec<f64>>,
    row_count: usize,
}

/// Why a text is no table, or a table has no such value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TableError {
    /// There is no header line.
    #[error("the table has no header")]
    NoHeader,
    /// Two columns have one name.
    #[error("column {name} appears twice")]
    DuplicateColumn {
        /// The name.
        name: String,
    },
    /// A line has too few or too many fields.
    #[error("line {line} has {found} fields, the header {expected}")]
    FieldCount {
        /// Line of the text, from 1.
        line: usize,
        /// Columns of the header.
        expected: usize,
        /// Fields of the line.
        found: usize,
    },
    /// A field is not a number.
    #[error("line {line}: {field:?} is not a number")]
    NotANumber {
        /// Line of the text, from 1.
        line: usize,
        /// The field.
        field: String,
    },
    /// There is no column of this name.
    #[error("there is no column {name}")]
    NoColumn {
        /// The name asked for.
        name: String,
    },
    /// The abscissa lies outside the table, or the table has fewer than four rows.
    #[error("{at} lies outside column {name}")]
    OutOfRange {
        /// Name of the abscissa.
        name: String,
        /// The value asked for, as text.
        at: String,
    },
}

impl Table {
    /// Reads comma-separated numbers under a header of names; lines that start with `#` are comments.
    pub fn parse(text: &str) -> Result<Self, TableError> {
        let mut lines =
            text.lines().enumerate().filter(|(_, line)| !line.starts_with('#') && !line.trim().is_empty());
        let (_, header) = lines.next().ok_or(TableError::NoHeader)?;
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        let mut values = vec![Vec::new(); names.len()];
        for (index, line) in lines {
            append_row(&mut values, index + 1, line)?;
        }
        let row_count = values[0].len();
        let mut columns = BTreeMap::new();
        for (name, column) in names.into_iter().zip(values) {
            if columns.insert(name.to_owned(), column).is_some() {
                return Err(TableError::DuplicateColumn { name: name.to_owned() });
            }
        }
        Ok(Self { columns, row_count })
    }

    /// Number of rows.
    pub fn row_count(&self) -> usize {
        self.row_count
    }

    /// A column by name.
    pub fn column(&self, name: &str) -> Result<&[f64], TableError> {
        self.columns
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| TableError::NoColumn { name: name.to_owned() })
    }

    /// The value of column `of` where column `over`, which must rise, has the value `at`: the cubic through
    /// the four nearest rows.
    pub fn interpolate(&self, over: &str, of: &str, at: f64) -> Result<f64, TableError> {
        let (x, y) = (self.column(over)?, self.column(of)?);
        let inside = x.len() >= 4 && at >= x[0] && at <= x[x.len() - 1];
        if !inside {
            return Err(TableError::OutOfRange { name: over.to_owned(), at: at.to_string() });
        }
        let above = x.partition_point(|&x| x <= at);
        let first = above.saturating_sub(2).min(x.len() - 4);
        Ok(lagrange(&x[first..first + 4], &y[first..first + 4], at))
    }
}

fn append_row(values: &mut [Vec<f64>], line: usize, text: &str) -> Result<(), TableError> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    if fields.len() != values.len() {
        return Err(TableError::FieldCount { line, expected: values.len(), found: fields.len() });
    }
    for (column, field) in values.iter_mut().zip(fields) {
        let number = field.parse().map_err(|_| TableError::NotANumber { line, field: field.to_owned() })?;
        column.push(number);
    }
    Ok(())
}

fn lagrange(x: &[f64], y: &[f64], at: f64) -> f64 {
    let weight =
        |i: usize| -> f64 { (0..x.len()).filter(|&j| j != i).map(|j| (at - x[j]) / (x[i] - x[j])).product() };
    (0..x.len()).map(|i| weight(i) * y[i]).sum()
}

macro_rules! reference_table {
    ($(#[$doc:meta])* $name:ident, $file:literal) => {
        $(#[$doc])*
        pub fn $name() -> Result<Table, TableError> {
            Table::parse(include_str!(concat!("../../../data/reference/", $file)))
        }
    };
}

reference_table!(
    /// One disc in the box: `x, y, Ux, Uy, omega, eta_diss`.
    single_2d_velocities,
    "single2d_velocities.csv"
);
reference_table!(
    /// Two discs at the centre of the box, by gap and angle: `xi, theta_deg, vn, rot, U1x, ...`.
    pair_2d_velocities,
    "pair2d_velocities.csv"
);
reference_table!(
    /// The doublet of Verdon et al. 2010, figures 5 and 6: `t, D_over_a, theta, x1, y1, x2, y2`.
    pair_2d_trajectory,
    "pair2d_trajectory.csv"
);
reference_table!(
    /// Three discs: `t, x1, y1, ..., gap12_over_a, ..., omega1, ...`.
    trio_2d_trajectory,
    "trio2d_trajectory.csv"
);
reference_table!(
    /// Mobility of two equal spheres (Batchelor and Green 1972):
    /// `r_over_a, xi, A, B, one_minus_A, one_minus_B, C_rot`.
    sphere_pair_mobility,
    "sphere_pair_mobility_unbounded.csv"
);
reference_table!(
    /// Two spheres in unbounded shear: `t, D_over_a, theta, x1, y1, x2, y2, omega_z`.
    pair_3d_trajectory_unbounded,
    "pair3d_trajectory_unbounded.csv"
);
reference_table!(
    /// Two spheres in the unit box: `t, D_over_a, theta, x1, y1, x2, y2`.
    pair_3d_trajectory_box,
    "pair3d_trajectory_box.csv"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_read_and_has_what_is_promised() {
        let tables = [
            (single_2d_velocities(), "omega"),
            (pair_2d_velocities(), "vn"),
            (pair_2d_trajectory(), "theta"),
            (trio_2d_trajectory(), "gap23_over_a"),
            (sphere_pair_mobility(), "C_rot"),
            (pair_3d_trajectory_unbounded(), "omega_z"),
            (pair_3d_trajectory_box(), "D_over_a"),
        ];
        for (table, column) in tables {
            let table = table.expect("readable");
            let values = table.column(column).expect("present");
            assert!(values.len() >= 2 && values.len() == table.row_count());
            assert!(values.iter().all(|value| value.is_finite()), "{column}");
        }
    }

    #[test]
    fn known_facts_are_found_in_the_data() {
        let pair = pair_2d_trajectory().expect("readable");
        let turned = pair.interpolate("t", "theta", 7.769129988).expect("inside");
        assert!((turned - (-0.201_317_108_4 - std::f64::consts::PI)).abs() < 1e-6, "half a turn: {turned}");
        let disc = single_2d_velocities().expect("readable");
        assert_eq!(
            (disc.column("Ux").expect("present")[1], disc.column("y").expect("present")[1]),
            (0.20220057, 0.7)
        );
        let closest = pair_3d_trajectory_unbounded().expect("readable");
        let gap = closest.interpolate("t", "D_over_a", 7.894071).expect("inside");
        assert!((gap - 7.370378e-3).abs() < 1e-6, "{gap}");
    }

    #[test]
    fn interpolation_is_exact_on_cubics_up_to_both_ends() {
        let rows: String = (0..6).map(|k| format!("{},{}\n", k * k, (k * k) * (k * k) * (k * k))).collect();
        let table = Table::parse(&format!("# a comment\nx, cube\n\n{rows}")).expect("valid");
        for at in [0.0, 0.5, 1.0, 7.3, 24.0, 25.0] {
            let value = table.interpolate("x", "cube", at).expect("inside");
            assert!((value - at.powi(3)).abs() < 1e-9, "{at}: {value}");
        }
        for at in [-0.1, 25.1, f64::NAN] {
            assert!(matches!(table.interpolate("x", "cube", at), Err(TableError::OutOfRange { .. })));
        }
    }

    #[test]
    fn what_is_no_table_is_named() {
        assert_eq!(Table::parse("# only a comment\n"), Err(TableError::NoHeader));
        assert_eq!(
            Table::parse("a,b\n1,2\n3\n"),
            Err(TableError::FieldCount { line: 3, expected: 2, found: 1 })
        );
        assert_eq!(Table::parse("a\nx\n"), Err(TableError::NotANumber { line: 2, field: "x".to_owned() }));
        assert_eq!(Table::parse("a,a\n1,2\n"), Err(TableError::DuplicateColumn { name: "a".to_owned() }));
        let table = Table::parse("a\n1\n").expect("valid");
        assert_eq!(table.column("b"), Err(TableError::NoColumn { name: "b".to_owned() }));
        assert!(table.interpolate("a", "a", 1.0).is_err());
    }
}
