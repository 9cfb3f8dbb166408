//! Mobility functions of two equal force- and torque-free spheres in a linear flow.
//!
//! `A`, `B` are those of Batchelor and Green (1972, J. Fluid Mech. 56, 375, DOI 10.1017/S0022112072002927),
//! `C` the coefficient of the spin. Tabulated from the exact bispherical series (relative error 1e-9) for
//! gaps of 1e-7 to 18 radii; nearer, the lubrication limit; farther, the method of reflections.

/// Gaps above which the far-field series are used, in radii.
const FAR: f64 = 18.0;
/// Nodes of the local polynomial.
const NODE_COUNT: usize = 8;

const TABLE: &str = include_str!("../data/sphere_pair_mobility_unbounded.csv");

/// Relative motion of a pair: with `r = X2 - X1`, `n = r/|r|`, strain rate `E` and fluid spin `w`,
/// `U2 - U1 = w x r + n (1-A) n.E.r + (1-B) (I - n n).E.r`, and both spins are `w + C n x (E.n)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairCoefficients {
    /// `1 - A`: 0 at contact, 1 far away.
    pub one_minus_a: f64,
    /// `1 - B`: 0.594 at contact, 1 far away.
    pub one_minus_b: f64,
    /// `C`: 0 far away.
    pub spin: f64,
}

/// A row in the variables in which it is interpolated: all three are smooth in `ln xi` and nearly straight at
/// both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Separation {
    /// `ln xi`, `xi` the gap in radii.
    log_gap: f64,
    /// `ln((1-A)/A)`, `ln((1-B)/B)`, `ln C`.
    logs: [f64; 3],
}

impl Separation {
    fn coefficients(logs: [f64; 3]) -> PairCoefficients {
        let share = |y: f64| 1.0 / (1.0 + (-y).exp());
        PairCoefficients { one_minus_a: share(logs[0]), one_minus_b: share(logs[1]), spin: logs[2].exp() }
    }
}

/// A function `(p L + q)/(L + s)` of `L = ln(1/xi)`: the form that lubrication gives to tangential
/// mobilities.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lubricated {
    p: f64,
    q: f64,
    s: f64,
}

impl Lubricated {
    /// Through three points `(L, value)`.
    fn through(points: [(f64, f64); 3]) -> Self {
        let [(l0, f0), (l1, f1), (l2, f2)] = points;
        // p (L - L0) - s (f - f0) = f L - f0 L0 for the other two.
        let (a1, b1, c1) = (l1 - l0, f0 - f1, f1 * l1 - f0 * l0);
        let (a2, b2, c2) = (l2 - l0, f0 - f2, f2 * l2 - f0 * l0);
        let determinant = a1 * b2 - a2 * b1;
        let p = (c1 * b2 - c2 * b1) / determinant;
        let s = (a1 * c2 - a2 * c1) / determinant;
        Self { p, q: f0 * (l0 + s) - p * l0, s }
    }

    /// Value at the gap `xi`; the limit at contact for `xi <= 0`.
    fn at(&self, xi: f64) -> f64 {
        if xi <= 0.0 {
            return self.p;
        }
        let l = -xi.ln();
        (self.p * l + self.q) / (l + self.s)
    }
}

/// `A`, `B` and `C` at any gap.
#[derive(Clone, Debug, PartialEq)]
pub struct MobilityTable {
    rows: Vec<Separation>,
    /// `(1-A)/xi` at contact.
    normal_slope: f64,
    tangential: Lubricated,
    spin: Lubricated,
    /// Smallest gap of the table.
    near: f64,
}

impl Default for MobilityTable {
    fn default() -> Self {
        Self::new()
    }
}

impl MobilityTable {
    /// Reads the embedded table.
    pub fn new() -> Self {
        Self::from_rows(parse(TABLE))
    }

    /// Coefficients at the gap `xi` (in radii). For `xi <= 0` (overlap) those of contact: no relative normal
    /// motion.
    pub fn at(&self, xi: f64) -> PairCoefficients {
        if xi < self.near {
            self.lubrication(xi)
        } else if xi > FAR {
            far_field(xi + 2.0)
        } else {
            Separation::coefficients(interpolate(self.window(xi.ln()), xi.ln()))
        }
    }

    fn from_rows(rows: Vec<Separation>) -> Self {
        let first = Separation::coefficients(rows[0].logs);
        let near = rows[0].log_gap.exp();
        let fit = |value: fn(&PairCoefficients) -> f64| {
            Lubricated::through(
                [0, 1, 2].map(|i| (-rows[i].log_gap, value(&Separation::coefficients(rows[i].logs)))),
            )
        };
        let (tangential, spin) = (fit(|c| c.one_minus_b), fit(|c| c.spin));
        Self { normal_slope: first.one_minus_a / near, tangential, spin, near, rows }
    }

    fn lubrication(&self, xi: f64) -> PairCoefficients {
        PairCoefficients {
            one_minus_a: self.normal_slope * xi.max(0.0),
            one_minus_b: self.tangential.at(xi),
            spin: self.spin.at(xi),
        }
    }

    /// The nodes around `log_gap`, half of them on each side where the table allows.
    fn window(&self, log_gap: f64) -> &[Separation] {
        let above = self.rows.partition_point(|row| row.log_gap < log_gap);
        let start = above.saturating_sub(NODE_COUNT / 2).min(self.rows.len() - NODE_COUNT);
        &self.rows[start..start + NODE_COUNT]
    }
}

/// Lagrange's polynomial through `nodes`.
fn interpolate(nodes: &[Separation], log_gap: f64) -> [f64; 3] {
    let mut logs = [0.0; 3];
    for (i, node) in nodes.iter().enumerate() {
        let mut weight = 1.0;
        for (j, other) in nodes.iter().enumerate() {
            if i != j {
                weight *= (log_gap - other.log_gap) / (node.log_gap - other.log_gap);
            }
        }
        for k in 0..3 {
            logs[k] += weight * node.logs[k];
        }
    }
    logs
}

/// Reflections to the order r^-6 (Batchelor and Green 1972, eqs. 3.8-3.9); `r` in radii.
fn far_field(r: f64) -> PairCoefficients {
    let (r3, r5) = (r.powi(3), r.powi(5));
    PairCoefficients {
        one_minus_a: 1.0 - 5.0 / r3 + 8.0 / r5 - 25.0 / (r3 * r3),
        one_minus_b: 1.0 - 16.0 / (3.0 * r5),
        spin: 2.5 / r3 - 6.25 / (r3 * r3),
    }
}

/// Rows of the table, columns `r, xi, A, B, 1-A, 1-B, C`, gaps increasing.
fn parse(table: &str) -> Vec<Separation> {
    let numbers = |line: &str| -> Vec<f64> {
        line.split(',').map(|field| field.trim().parse().expect("the embedded table holds numbers")).collect()
    };
    let lines = table.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    let mut rows: Vec<Separation> = lines
        .map(|line| {
            let row = numbers(line);
            Separation {
                log_gap: row[1].ln(),
                logs: [(row[4] / row[2]).ln(), (row[5] / row[3]).ln(), row[6].ln()],
            }
        })
        .collect();
    // The last gap stands there twice.
    rows.dedup_by_key(|row| row.log_gap);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    fn difference(a: &PairCoefficients, b: &PairCoefficients) -> f64 {
        let relative = |x: f64, y: f64| ((x - y) / y).abs();
        relative(a.one_minus_a, b.one_minus_a)
            .max(relative(a.one_minus_b, b.one_minus_b))
            .max(relative(a.spin, b.spin))
    }

    #[test]
    fn table_points_come_back() {
        let table = MobilityTable::new();
        assert_eq!(table.rows.len(), 100);
        for row in &table.rows {
            let there = table.at(row.log_gap.exp());
            assert!(difference(&there, &Separation::coefficients(row.logs)) < 1e-12, "{row:?}");
        }
    }

    #[test]
    fn a_left_out_point_is_predicted() {
        let rows = parse(TABLE);
        let mut worst = 0f64;
        for out in 4..rows.len() - 4 {
            let mut fewer = rows.clone();
            fewer.remove(out);
            let there = MobilityTable::from_rows(fewer).at(rows[out].log_gap.exp());
            worst = worst.max(difference(&there, &Separation::coefficients(rows[out].logs)));
        }
        println!("left-out error {worst:e}");
        // With the spacing doubled at the point: at the true spacing the polynomial is better still.
        assert!(worst < 5e-7, "{worst:e}");
    }

    #[test]
    fn limits_join_the_table() {
        let table = MobilityTable::new();
        for (inside, outside) in [(FAR, FAR * (1.0 + 1e-12)), (1e-7, 1e-7 * (1.0 - 1e-9))] {
            let jump = difference(&table.at(inside), &table.at(outside));
            println!("jump at {inside:e}: {jump:e}");
            assert!(jump < 1e-6, "{inside:e}: {jump:e}");
        }
    }

    #[test]
    fn lubrication_forms_predict_the_table_from_below() {
        let rows = parse(TABLE);
        let nearer = MobilityTable::from_rows(rows[1..].to_vec());
        let jump = difference(&nearer.at(1e-7), &Separation::coefficients(rows[0].logs));
        println!("extrapolation by a factor of three: {jump:e}");
        assert!(jump < 2e-5, "{jump:e}");
        let contact = nearer.at(0.0);
        println!("contact: {contact:?}");
        // Batchelor and Green (1972): B = 0.406 at contact.
        assert!((contact.one_minus_b - 0.594).abs() < 2e-3, "{contact:?}");
        assert_eq!(contact.one_minus_a, 0.0);
        assert_eq!(nearer.at(-0.1), contact);
    }
}
