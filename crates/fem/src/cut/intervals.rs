//! Quadrature of functions that are analytic between given points.

/// Longest part of an interval that one rule is used on, in radians.
pub const LONGEST: f64 = 0.75;
/// A square root this near to the end of a part is taken to be there.
const AT_END: f64 = 1e-12;

/// A point where a function of an angle is not analytic.
#[derive(Clone, Copy, Debug)]
pub struct Breakpoint {
    /// The angle.
    pub at: f64,
    /// Whether the function behaves like a square root there: an analytic function of `t` at a distance of
    /// `t^2`.
    pub is_root: bool,
}

/// A part of an interval on which a function is analytic, but for square roots at its ends.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// Where it begins.
    pub from: f64,
    /// Where it ends.
    pub to: f64,
    /// Whether there are square roots at its ends, at one of them at most.
    roots: [bool; 2],
}

/// Memory for the parts of an interval.
#[derive(Debug, Default)]
pub struct Intervals {
    breakpoints: Vec<Breakpoint>,
    cuts: Vec<f64>,
    stack: Vec<[f64; 2]>,
    parts: Vec<Interval>,
}

impl Intervals {
    /// Calls `visit(x, weight)` for the points of a composite Gauss rule on `[from, to]`, cut at the
    /// breakpoints inside.
    pub fn for_each_point(
        &mut self,
        range: [f64; 2],
        breakpoints: impl Iterator<Item = Breakpoint>,
        rule: &[(f64, f64)],
        mut visit: impl FnMut(f64, f64),
    ) {
        for part in self.split(range, breakpoints) {
            rule.iter().map(|&(t, weight)| part.mapped(t, weight)).for_each(|(x, weight)| visit(x, weight));
        }
    }

    /// The parts of `[from, to]`, cut at the breakpoints inside, in ascending order. They are no longer than
    /// twice their distance from a square root, wherever that is.
    pub fn split(
        &mut self,
        [from, to]: [f64; 2],
        breakpoints: impl Iterator<Item = Breakpoint>,
    ) -> &[Interval] {
        let Self { breakpoints: all, cuts, stack, parts } = self;
        all.clear();
        all.extend(breakpoints);
        cuts.clear();
        cuts.extend(all.iter().map(|b| b.at).filter(|at| from < *at && *at < to));
        cuts.extend([from, to]);
        cuts.sort_unstable_by(f64::total_cmp);
        all.retain(|b| b.is_root);
        stack.clear();
        stack.extend(cuts.windows(2).rev().map(|pair| [pair[0], pair[1]]));
        parts.clear();
        while let Some([start, end]) = stack.pop() {
            let length = end - start;
            let is_at = |x: f64| all.iter().any(|root| (root.at - x).abs() <= AT_END);
            let roots = [is_at(start), is_at(end)];
            let beyond = |root: &Breakpoint| (root.at - end).max(start - root.at);
            let distance = all.iter().map(beyond).filter(|&d| d > AT_END).fold(f64::INFINITY, f64::min);
            if length > AT_END && (length > LONGEST.min(2.0 * distance) || roots == [true; 2]) {
                let middle = 0.5 * (start + end);
                stack.extend([[middle, end], [start, middle]]);
            } else {
                parts.push(Interval { from: start, to: end, roots });
            }
        }
        parts
    }
}

impl Interval {
    /// A point of a rule on `[0, 1]`, with its weight.
    fn mapped(&self, t: f64, weight: f64) -> (f64, f64) {
        let Self { from, to, roots } = self;
        let length = to - from;
        match roots {
            [true, _] => (from + length * t * t, 2.0 * length * t * weight),
            [_, true] => (to - length * t * t, 2.0 * length * t * weight),
            _ => (from + length * t, length * weight),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::gauss;

    #[test]
    fn pieces_are_integrated_to_rounding() {
        // A kink at 0.3, square roots on both sides of 0.7.
        let f = |x: f64| (x - 0.3).abs() + (x - 0.7).abs().sqrt() * (1.0 + x).sin();
        let rule = gauss(12);
        let integral = |breakpoints: &[Breakpoint]| {
            let mut sum = 0.0;
            Intervals::default().for_each_point(
                [0.0, 1.0],
                breakpoints.iter().copied(),
                &rule,
                |x, weight| sum += weight * f(x),
            );
            sum
        };
        let point = |at, is_root| Breakpoint { at, is_root };
        let exact = {
            let mut sum = 0.0;
            for k in 0..20_000 {
                let part = [k as f64 / 2e4, (k + 1) as f64 / 2e4];
                Intervals::default()
                    .for_each_point(part, std::iter::empty(), &rule, |x, weight| sum += weight * f(x));
            }
            sum
        };
        let found = integral(&[point(0.7, true), point(0.3, false), point(1.4, true), point(-2.0, false)]);
        assert!((found - exact).abs() < 1e-8, "{found} {exact}");
        assert!((integral(&[]) - exact).abs() > 1e-5);
    }
}
