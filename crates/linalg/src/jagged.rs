//! Lists of different lengths, one after another in one array.

use std::ops::{Index, Range};

/// Lists of different lengths in one array; list `k` holds the items `starts[k] .. starts[k + 1]`.
///
/// ```
/// use gluey_linalg::Jagged;
///
/// let nodes_of_cells: Jagged<u32> = [vec![0, 1, 4], vec![1, 2]].into_iter().collect();
/// assert_eq!(nodes_of_cells.len(), 2);
/// assert_eq!(nodes_of_cells[1], [1, 2]);
///
/// // The cells of each of the five nodes.
/// let cells = nodes_of_cells.iter().zip(0u32..);
/// let pairs = cells.flat_map(|(nodes, cell)| nodes.iter().map(move |&node| (node as usize, cell)));
/// let cells_of_nodes = Jagged::grouped(5, pairs);
/// assert_eq!(cells_of_nodes[1], [0, 1]);
/// assert!(cells_of_nodes[3].is_empty());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Jagged<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Jagged<T> {
    fn default() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }
}

impl<T> Jagged<T> {
    /// No lists, with room for so many, and for so many items in all.
    pub fn with_capacity(list_count: usize, item_count: usize) -> Self {
        let mut starts = Vec::with_capacity(list_count + 1);
        starts.push(0);
        Self { starts, items: Vec::with_capacity(item_count) }
    }

    /// The items cut at `starts`, which ascends from zero to their number.
    pub(crate) fn from_starts(starts: Vec<u32>, items: Vec<T>) -> Self {
        debug_assert_eq!(starts.last().map(|&end| end as usize), Some(items.len()));
        Self { starts, items }
    }

    /// Appends a list.
    ///
    /// # Panics
    /// Beyond 2^32 items in all.
    pub fn push(&mut self, list: impl IntoIterator<Item = T>) {
        self.items.extend(list);
        self.close();
    }

    /// Appends a list of the items without repetitions, in the order of their first appearance.
    pub fn push_distinct(&mut self, list: impl IntoIterator<Item = T>)
    where
        T: PartialEq,
    {
        let begin = self.items.len();
        for item in list {
            if !self.items[begin..].contains(&item) {
                self.items.push(item);
            }
        }
        self.close();
    }

    fn close(&mut self) {
        self.starts.push(u32::try_from(self.items.len()).expect("at most 2^32 items, as documented"));
    }

    /// Drops all lists and keeps their memory.
    pub fn clear(&mut self) {
        self.starts.truncate(1);
        self.items.clear();
    }

    /// Number of lists.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no list.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where a list lies among all items.
    #[inline(always)]
    pub fn range(&self, list: usize) -> Range<usize> {
        self.starts[list] as usize..self.starts[list + 1] as usize
    }

    /// The lists, one after another.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[T]> + Clone {
        self.starts.windows(2).map(|bounds| &self.items[bounds[0] as usize..bounds[1] as usize])
    }

    /// The items of all lists.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// The items of all lists, to be changed in place.
    pub fn items_mut(&mut self) -> &mut [T] {
        &mut self.items
    }

    /// First item of each list, and the number of items.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }
}

impl<T: Copy> Jagged<T> {
    /// The items of each of `count` groups, in the order in which the pairs of group and item come.
    ///
    /// # Panics
    /// If a pair names a group beyond `count`.
    pub fn grouped(count: usize, pairs: impl Iterator<Item = (usize, T)> + Clone) -> Self {
        let mut starts = vec![0u32; count + 1];
        pairs.clone().for_each(|(group, _)| starts[group + 1] += 1);
        for group in 0..count {
            starts[group + 1] += starts[group];
        }
        let Some((_, any)) = pairs.clone().next() else { return Self { starts, items: Vec::new() } };
        let mut next = starts.clone();
        let mut items = vec![any; starts[count] as usize];
        for (group, item) in pairs {
            let place = &mut next[group];
            items[*place as usize] = item;
            *place += 1;
        }
        Self { starts, items }
    }
}

impl<T> Index<usize> for Jagged<T> {
    type Output = [T];

    #[inline(always)]
    fn index(&self, list: usize) -> &[T] {
        &self.items[self.range(list)]
    }
}

impl<T, L: IntoIterator<Item = T>> FromIterator<L> for Jagged<T> {
    fn from_iter<I: IntoIterator<Item = L>>(lists: I) -> Self {
        let mut jagged = Self::default();
        lists.into_iter().for_each(|list| jagged.push(list));
        jagged
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_come_back_as_they_went_in() {
        let lists = [vec![3, 1], vec![], vec![7]];
        let jagged: Jagged<i32> = lists.clone().into_iter().collect();
        assert_eq!((jagged.len(), jagged.is_empty(), Jagged::<i32>::default().is_empty()), (3, false, true));
        assert!(jagged.iter().eq(lists.iter().map(Vec::as_slice)));
        assert_eq!((&jagged[1], jagged.range(2)), (&[][..], 2..3));
        assert_eq!((jagged.items(), jagged.starts()), (&[3, 1, 7][..], &[0, 2, 2, 3][..]));
        assert_eq!(jagged, Jagged::from_starts(vec![0, 2, 2, 3], vec![3, 1, 7]));

        let mut again = jagged;
        again.items_mut().iter_mut().for_each(|item| *item += 1);
        assert_eq!((&again[0], &again[2]), (&[4, 2][..], &[8][..]));
        again.clear();
        again.push([5]);
        assert!(again.iter().eq([&[5][..]]));
    }

    #[test]
    fn repetitions_inside_a_list_are_dropped() {
        let mut jagged = Jagged::with_capacity(2, 4);
        jagged.push_distinct([2, 5, 2, 1, 5]);
        jagged.push_distinct([5, 5]);
        assert!(jagged.iter().eq([&[2, 5, 1][..], &[5]]));
    }

    #[test]
    fn grouping_keeps_the_order_of_the_items() {
        let pairs = [(2, 'a'), (0, 'b'), (2, 'c'), (0, 'd')];
        let grouped = Jagged::grouped(4, pairs.into_iter());
        assert!(grouped.iter().eq([&['b', 'd'][..], &[], &['a', 'c'], &[]]));
        assert_eq!(Jagged::<u8>::grouped(2, std::iter::empty()).len(), 2);
    }
}
