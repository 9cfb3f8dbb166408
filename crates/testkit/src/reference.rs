//! The velocities of `data/reference`, read by the names in their headers. Where they come from and how exact
//! they are is written in `data/reference/README.md`.
//!
//! `gluey` reads trajectories by a table of its own: it lies above the crates whose tests take their data
//! from here, and what is for tests only is not part of a program.

use std::collections::BTreeMap;

/// A table of numbers with named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: BTreeMap<String, Vec<f64>>,
    row_count: usize,
}

/// A reason for which a text is no table, or a table has no such value.
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
    /// Two equal discs in unbounded fluid, by gap: `xi, n, t_F, t_T, r_F, r_T`.
    pair_2d_resistance,
    "pair2d_resistance.csv"
);
reference_table!(
    /// Two equal spheres in unbounded fluid, by gap: `r_over_a, xi, A, B, one_minus_A, one_minus_B, C_rot`
    /// (Batchelor and Green 1972).
    sphere_pair_mobility,
    "sphere_pair_mobility_unbounded.csv"
);
reference_table!(
    /// Spheres of radii 1 and 2 in unbounded fluid, by gap: `gap, one_minus_A, one_minus_B, C1, C2, Mn, Mr`.
    spheres_one_to_two,
    "sphere_pair_1to2.csv"
);
reference_table!(
    /// Rough pairs of equal spheres in contact, in shear: `eps, mu, psi, theta, Fn, Ftx, Fty, Ftz, wx, wy,
    /// wz, slip, S_flow, S_induced, S_contact`.
    rough_pairs,
    "rough_pairs.csv"
);
reference_table!(
    /// Paths of two equal rough spheres in shear: `eps, y0, z0, turn, t_turn, t_end, x, y, z, t_contact`.
    rough_paths,
    "rough_paths.csv"
);
reference_table!(
    /// Square (0) and hexagonal (1) lattices of discs:
    /// `lattice, phi, gap_over_a, drag_F_over_muU, eta_axes_strain, eta_shear, rel_diff_drag`.
    lattices_of_discs,
    "lattices2d.csv"
);
reference_table!(
    /// Simple (0), body-centred (1) and face-centred (2) cubic lattices of spheres:
    /// `lattice, phi, gap_over_a, K, alpha, beta, relchange_K, ...`.
    lattices_of_spheres,
    "lattices3d.csv"
);
reference_table!(
    /// A square lattice of free discs in shear, by the strain of the cell: `phi, strain, eta_r, N1, omega`.
    sheared_square_lattice,
    "sheared_square2d.csv"
);
reference_table!(
    /// A simple cubic lattice of free spheres in shear, by the strain of the cell:
    /// `phi, strain, eta_r, N1, N2, omega_z`.
    sheared_simple_cubic_lattice,
    "sheared_sc3d.csv"
);
reference_table!(
    /// Cells of several free discs in shear: `cell, strain, radius, x, y, u, v, omega, eta_r, N1`, a row a
    /// disc.
    cells_of_discs,
    "cells2d.csv"
);
reference_table!(
    /// Two spheres that meet in unbounded shear: `t, D_over_a, theta, x1, y1, x2, y2, omega_z`.
    pair_3d_trajectory_unbounded,
    "pair3d_trajectory_unbounded.csv"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_is_read_and_has_what_is_promised() {
        for (table, column) in [(single_2d_velocities(), "omega"), (pair_2d_velocities(), "vn")] {
            let table = table.expect("readable");
            let values = table.column(column).expect("present");
            assert!(values.len() >= 2 && values.len() == table.row_count());
            assert!(values.iter().all(|value| value.is_finite()), "{column}");
        }
    }

    #[test]
    fn known_facts_are_found_in_the_data() {
        let disc = single_2d_velocities().expect("readable");
        let at = |column: &str| disc.column(column).expect("present")[1];
        assert_eq!([at("Ux"), at("y")], [0.20220057, 0.7]);
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
    }
}
