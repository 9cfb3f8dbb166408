//! Some of the unknowns, with numbers of their own.

/// Stands for the number of an unknown that is left out.
const NONE: u32 = u32::MAX;

/// Some of the positions in a vector, numbered in ascending order.
///
/// With `E` the matrix of zeros and ones that places the entries of a short vector in a long one,
/// [`Subset::scatter`] is `E`, [`Subset::gather`] is `E^T`.
///
/// ```
/// use gluey_linalg::Subset;
///
/// let odd = Subset::new(5, |position| position % 2 == 1);
/// let mut short = [0.0; 2];
/// odd.gather(&[0.0, 10.0, 20.0, 30.0, 40.0], &mut short);
/// assert_eq!(short, [10.0, 30.0]);
/// assert_eq!((odd.number(3), odd.number(4)), (Some(1), None));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Subset {
    positions: Vec<u32>,
    number: Vec<u32>,
}

impl Subset {
    /// The positions below `whole` for which `keep` holds.
    pub fn new(whole: usize, keep: impl Fn(usize) -> bool) -> Self {
        let positions: Vec<u32> = (0..whole as u32).filter(|&position| keep(position as usize)).collect();
        let mut number = vec![NONE; whole];
        for (own, &position) in positions.iter().enumerate() {
            number[position as usize] = own as u32;
        }
        Self { positions, number }
    }

    /// Number of positions in it.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether no position is in it.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Length of the vectors it selects from.
    pub fn whole(&self) -> usize {
        self.number.len()
    }

    /// The positions in it, ascending: that of number 0, 1, ...
    pub fn positions(&self) -> &[u32] {
        &self.positions
    }

    /// Number of a position, if that is in it.
    #[inline(always)]
    pub fn number(&self, position: usize) -> Option<usize> {
        let number = self.number[position];
        (number != NONE).then_some(number as usize)
    }

    /// Whether a position is in it.
    pub fn contains(&self, position: usize) -> bool {
        self.number[position] != NONE
    }

    /// `short = E^T long`: the entries at the positions.
    pub fn gather<T: Copy>(&self, long: &[T], short: &mut [T]) {
        for (value, &position) in short.iter_mut().zip(&self.positions) {
            *value = long[position as usize];
        }
    }

    /// `long = E short`: zero away from the positions.
    pub fn scatter<T: Copy + Default>(&self, short: &[T], long: &mut [T]) {
        long.fill(T::default());
        for (value, &position) in short.iter().zip(&self.positions) {
            long[position as usize] = *value;
        }
    }

    /// `long += E short`.
    pub fn scatter_add<T: Copy + std::ops::AddAssign>(&self, short: &[T], long: &mut [T]) {
        for (value, &position) in short.iter().zip(&self.positions) {
            long[position as usize] += *value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gathering_undoes_scattering() {
        let subset = Subset::new(6, |k| k != 1 && k != 4);
        assert_eq!((subset.len(), subset.whole(), subset.is_empty()), (4, 6, false));
        assert_eq!(subset.positions(), [0, 2, 3, 5]);
        let short = [1, 2, 3, 4];
        let (mut long, mut back) = ([9; 6], [0; 4]);
        subset.scatter(&short, &mut long);
        assert_eq!(long, [1, 0, 2, 3, 0, 4]);
        subset.gather(&long, &mut back);
        assert_eq!(back, short);
        subset.scatter_add(&short, &mut long);
        assert_eq!(long, [2, 0, 4, 6, 0, 8]);
    }

    #[test]
    fn numbers_and_positions_are_inverse() {
        let subset = Subset::new(10, |k| k % 3 == 1);
        for position in 0..10 {
            match subset.number(position) {
                Some(number) => assert_eq!(subset.positions()[number] as usize, position),
                None => assert!(!subset.contains(position)),
            }
        }
        assert!(Subset::new(3, |_| false).is_empty());
    }
}
