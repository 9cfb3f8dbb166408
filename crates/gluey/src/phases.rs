//! Where the wall time goes.

use std::time::Instant;

use serde::{Deserialize, Serialize};

/// Seconds spent in named phases, in the order in which they first occurred.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhaseTable(Vec<(String, f64)>);

impl PhaseTable {
    /// Adds `seconds` to the phase `name`.
    pub fn add(&mut self, name: &str, seconds: f64) {
        match self.0.iter_mut().find(|(known, _)| known == name) {
            Some((_, total)) => *total += seconds,
            None => self.0.push((name.to_owned(), seconds)),
        }
    }

    /// Does `work` and books its time on the phase `name`.
    pub fn time<T>(&mut self, name: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(name, start.elapsed().as_secs_f64());
        result
    }

    /// All phases and their seconds.
    pub fn rows(&self) -> &[(String, f64)] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_one_name_add_up_and_keep_their_order() {
        let mut table = PhaseTable::default();
        table.add("flow", 1.0);
        table.add("contact", 0.5);
        table.add("flow", 2.0);
        assert_eq!(table.time("flow", || 7), 7);
        assert_eq!(table.rows()[1], ("contact".to_owned(), 0.5));
        assert!(table.rows()[0].1 >= 3.0 && table.rows().len() == 2);
    }
}
