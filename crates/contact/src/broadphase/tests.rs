use super::*;

fn brute_force<const D: usize>(centers: &[Vector<D>], radii: &[f64], asker_count: usize) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for i in 0..asker_count {
        for j in i + 1..centers.len() {
            if (centers[i] - centers[j]).norm() <= radii[i] + radii[j] {
                pairs.push((i as u32, j as u32));
            }
        }
    }
    pairs
}

fn check<const D: usize>() {
    for (count, stretch) in [(0, 1.0), (1, 1.0), (2, 1.0), (3, 1e6), (50, 1.0), (200, 1.0), (200, 50.0)] {
        // A quasi-random cloud, denser than one neighbour each, stretched along the first axis.
        let centers: Vec<Vector<D>> = (0..count)
            .map(|i| Vector::from_fn(|d, _| (0.5 + i as f64 * [0.7548, 0.5698, 0.4301][d]).fract()))
            .map(|mut x: Vector<D>| {
                x[0] *= stretch;
                x
            })
            .collect();
        for sizes in [1.0, 30.0] {
            let radii: Vec<f64> = (0..count)
                .map(|i| 0.03 + 0.001 * (i % 50) as f64)
                .map(|r| if r > 0.078 { sizes * r } else { r })
                .collect();
            for asker_count in [count, 2 * count / 3] {
                let expected = brute_force(&centers, &radii, asker_count);
                let mut pairs = vec![(7, 7)];
                let ways: [&mut dyn Broadphase<D>; 3] =
                    [&mut CellList::default(), &mut Hierarchy, &mut BestOf::default()];
                for way in ways {
                    way.meeting(&centers, &radii, asker_count, &mut pairs);
                    assert_eq!(pairs, expected, "{count} balls in {D}D");
                }
                assert!(count < 200 || stretch > 1.0 || !pairs.is_empty());
            }
        }
    }
}

#[test]
fn pairs_equal_brute_force() {
    check::<2>();
    check::<3>();
}

/// Balls as far from each other as numbers go, alone and beside many that are near each other; and as near.
#[test]
fn searches_end_wherever_balls_are() {
    let near = |i: usize| Vector::<3>::from_fn(|d, _| (i as f64 * [0.7548, 0.5698, 0.4301][d]).fract());
    for far in [1e15, 1e200, 1e300, 1.7e308, 5e-324] {
        for (count, sizes) in [(2, 1.0), (3, 100.0), (30_000, 1.0), (3000, 100.0)] {
            let mut centers: Vec<Vector<3>> = (0..count).map(near).collect();
            let mut radii = vec![0.01; count];
            radii[0] *= sizes;
            centers[count - 1] = Vector::repeat(-far);
            centers[1] = Vector::repeat(far);
            let [mut best, mut others] = [Vec::new(), Vec::new()];
            BestOf::default().meeting(&centers, &radii, count, &mut best);
            Hierarchy.meeting(&centers, &radii, count, &mut others);
            assert!(best == others && (count < 30_000 || best.len() > 1000), "{far} {count}");
        }
    }
    let (centers, mut pairs) = ([0.0, 5e-324, 1e-323].map(Vector::<2>::repeat), Vec::new());
    for radius in [0.0, 5e-324] {
        CellList::default().meeting(&centers, &[radius; 3], 3, &mut pairs);
    }
}

/// Where one ball is far from all others, all others are in one cell: the hierarchy looks for them.
#[test]
fn a_cell_that_holds_all_is_crowded() {
    let mut centers: Vec<Vector<3>> =
        (0..8000).map(|i| Vector::from_fn(|d, _| (i as f64 * [0.7548, 0.5698, 0.4301][d]).fract())).collect();
    let radii = vec![0.025; 8000];
    let mut cells = CellList::default();
    assert!(!cells.is_crowded(&centers, &radii));
    centers[0] = Vector::repeat(1e300);
    assert!(cells.is_crowded(&centers, &radii));
}
