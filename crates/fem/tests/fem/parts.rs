//! Parts of a tree, each found without the others: their union is the whole mesh, cell by cell, node by node
//! and constraint by constraint.

use std::collections::HashMap;

use gluey_fem::{Constraint, Cuts, ImplicitTree, NodeMap, Part, TreeMesh};
use gluey_geom::{Aabb, Vector};

type Wants<const D: usize> = dyn Fn(&Vector<D>, f64, u8) -> bool;

struct Example<const D: usize> {
    domain: Aabb<D>,
    roots: [u32; D],
    periodic: [bool; D],
    max_level: u8,
    wants: Box<Wants<D>>,
}

/// A uniform mesh, one around a sphere, one with a single finest corner whose balance reaches far, and one of
/// three roots that is periodic.
fn examples<const D: usize>() -> Vec<Example<D>> {
    let unit = || (Aabb::<D>::unit(), [1; D]);
    let (domain, roots) = unit();
    let finest = if D == 2 { 6 } else { 4 };
    let uniform =
        Example { domain, roots, periodic: [false; D], max_level: 3, wants: Box::new(|_, _, _| true) };
    let shell = |lower: &Vector<D>, h: f64, level: u8| {
        let distance = (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.45)).norm() - 0.3;
        level < 2 || distance.abs() < 1.2 * h
    };
    let sphere = Example { domain, roots, periodic: [false; D], max_level: finest, wants: Box::new(shell) };
    let corner = |lower: &Vector<D>, h: f64, _: u8| {
        (lower + Vector::repeat(0.5 * h) - Vector::repeat(0.487)).amax() <= 0.5 * h
    };
    let point =
        Example { domain, roots, periodic: [false; D], max_level: finest + 1, wants: Box::new(corner) };
    let mut upper = Vector::repeat(1.0);
    upper[0] = 3.0;
    let mut roots = [1; D];
    roots[0] = 3;
    let edge = |lower: &Vector<D>, h: f64, level: u8| level < 1 || (lower.amin() < h && lower[0] > 1.2);
    let domain = Aabb { lower: Vector::zeros(), upper };
    let long = Example { domain, roots, periodic: [true; D], max_level: finest, wants: Box::new(edge) };
    vec![uniform, sphere, point, long]
}

impl<const D: usize> Example<D> {
    fn whole(&self) -> TreeMesh<D> {
        TreeMesh::refine(self.domain, self.roots, self.periodic, self.max_level, &self.wants).unwrap()
    }

    fn implicit(&self) -> ImplicitTree<'_, D> {
        ImplicitTree::new(self.domain, self.roots, self.periodic, self.max_level, &self.wants).unwrap()
    }
}

/// Masters and weights of a hanging node, by the keys of the nodes.
type Named = HashMap<u64, Vec<(u64, u64)>>;

fn named<const D: usize>(nodes: &NodeMap<D>) -> Named {
    let masters = |constraint: &Constraint| {
        let master = |&(node, w): &(u32, f64)| (nodes.key(node as usize), w.to_bits());
        let mut masters: Vec<(u64, u64)> = constraint.masters.iter().map(master).collect();
        masters.sort_unstable();
        (nodes.key(constraint.node as usize), masters)
    };
    nodes.constraints().iter().map(masters).collect()
}

fn parts_make_the_whole<const D: usize>() {
    for example in examples::<D>() {
        let whole = example.whole();
        for ranks in [1, 2, 3, 4, 5, 8] {
            let cuts = Cuts::equal(&mut example.implicit(), ranks);
            for depth in [1, whole.max_level() - 1, whole.max_level()] {
                check_parts(&example, &whole.coarsened(depth), depth, &cuts);
            }
            let count = |rank| example.implicit().count_leaves(&cuts.of(rank));
            let counts: Vec<usize> = (0..ranks).map(count).collect();
            assert_eq!(counts.iter().sum::<usize>(), whole.cell_count());
            let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
            assert!(most - least <= 1, "{counts:?}");
        }
    }
}

fn check_parts<const D: usize>(example: &Example<D>, whole: &TreeMesh<D>, depth: u8, cuts: &Cuts) {
    let parts: Vec<Part<D>> = (0..cuts.count())
        .map(|rank| Part::new(&mut example.implicit(), depth, &cuts.of(rank), &cuts.of(rank)))
        .collect();
    let cells: Vec<_> = parts.iter().flat_map(|part| part.mesh.cells()[part.own()].iter().copied()).collect();
    assert_eq!(cells, whole.cells());
    for part in &parts {
        assert!(part.mesh.cells().iter().all(|cell| whole.find(cell).is_some()));
        assert!(part.own().len() + 1 >= part.inner().len() && part.inner().len() >= part.own().len());
    }
    for degree in [1, 2] {
        let nodes = NodeMap::new(whole, degree);
        let hanging = named(&nodes);
        let mut next = 0;
        for (rank, part) in parts.iter().enumerate() {
            let local = NodeMap::new(&part.mesh, degree);
            let tree = &mut example.implicit();
            let owned = owned(&local, part);
            let hanging_here = named(&local);
            let place: HashMap<u64, usize> = (0..local.node_count()).map(|n| (local.key(n), n)).collect();
            for node in owned.clone() {
                assert_eq!(local.key(node), nodes.key(next), "owned nodes are numbered like all");
                next += 1;
            }
            for &node in local.cells(part.inner()) {
                let key = local.key(node as usize);
                assert_eq!(hanging_here.get(&key), hanging.get(&key), "inner cells know their constraints");
                let masters = hanging_here.get(&key).map(|masters| masters.iter().map(|m| place[&m.0]));
                let regular = masters.map_or(vec![node as usize], Iterator::collect);
                for node in regular {
                    let owner =
                        cuts.owner(tree.first_touching(depth, degree as u32, local.lattice_point(node)));
                    assert_eq!(owner == rank, owned.contains(&node), "owners are known without talking");
                }
            }
        }
        assert_eq!(next, nodes.node_count());
    }
}

/// Nodes that a leaf of the rank touches first.
fn owned<const D: usize>(nodes: &NodeMap<D>, part: &Part<D>) -> std::ops::Range<usize> {
    let touched = |cells| nodes.cells(cells).iter().max().map_or(0, |&n| n as usize + 1);
    let first = touched(0..part.own().start);
    first..touched(0..part.own().end).max(first)
}

#[test]
fn the_union_of_the_parts_is_the_whole_mesh() {
    parts_make_the_whole::<2>();
    parts_make_the_whole::<3>();
}

/// A rank of a thousand-fold larger mesh asks for about as many cells.
#[test]
fn a_part_costs_what_it_holds_and_not_what_the_mesh_has() {
    let wants = |_: &Vector<2>, _: f64, _: u8| true;
    let known = |level: u8| {
        let mut tree = ImplicitTree::new(Aabb::<2>::unit(), [1; 2], [false; 2], level, &wants).unwrap();
        let quarter = tree.end() >> 2;
        // A run of 1024 cells that begins at the centre of the box.
        let keys = 2 * quarter..2 * quarter + 1024;
        let part = Part::new(&mut tree, level, &keys, &keys);
        assert_eq!(part.own().len(), 1024);
        (tree.known_count(), part.mesh.cell_count())
    };
    let (small, large) = (known(7), known(17));
    assert_eq!(small.1, large.1);
    assert!(large.0 < 2 * small.0 + 200, "{small:?} {large:?}");
}
