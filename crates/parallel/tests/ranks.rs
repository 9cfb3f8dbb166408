//! Ranks as threads: sums, gathers and ghosts for any number of them, and what happens when one dies.

#![allow(clippy::unwrap_used, reason = "a failure here is a failing test")]

use gluey_parallel::{Alone, Communicator, GhostPlan, Message, RankFailure, Threads, Wanted, route};

const SIZES: [usize; 7] = [1, 2, 3, 4, 5, 8, 13];

#[test]
fn sums_are_right_and_the_same_on_all_ranks_and_runs() {
    for size in SIZES {
        let run = || {
            Threads::run(size, |ranks| {
                let x = 1.0 + ranks.rank() as f64;
                let mut sums = [x, x * x, 1.0 / (3.0 * x), 0.1];
                ranks.sum(&mut sums);
                sums
            })
            .unwrap()
        };
        let sums = run();
        let n = size as f64;
        assert_eq!(sums[0][0], n * (n + 1.0) / 2.0);
        assert_eq!(sums[0][1], n * (n + 1.0) * (2.0 * n + 1.0) / 6.0);
        assert!((sums[0][3] - 0.1 * n).abs() < 1e-14);
        assert!(sums.iter().all(|s| s == &sums[0]));
        assert_eq!(run(), sums);
    }
}

#[test]
fn a_rank_that_is_alone_keeps_its_bits_and_sends_nothing() {
    let alone = Alone::default();
    let mut values = [0.1, -0.0, f64::MIN_POSITIVE];
    alone.sum(&mut values);
    assert_eq!(values.map(f64::to_bits), [0.1, -0.0, f64::MIN_POSITIVE].map(f64::to_bits));
    assert_eq!(alone.all_gather(&[3, 5]), [3, 5]);
    assert_eq!((alone.traffic().messages, alone.traffic().reductions), (0, 1));
}

#[test]
fn gathered_items_stand_in_the_order_of_the_ranks() {
    for size in SIZES {
        let gathered = Threads::run(size, |ranks| {
            let rank = ranks.rank() as u64;
            ranks.all_gather(&[rank, u64::MAX - rank])
        });
        let want: Vec<u64> = (0..size as u64).flat_map(|rank| [rank, u64::MAX - rank]).collect();
        assert!(gathered.unwrap().iter().all(|items| items == &want));
    }
}

/// A line of numbers, cut into equal pieces with `reach` ghosts on either side.
struct Line {
    plan: GhostPlan,
    first: usize,
    own: usize,
    below: usize,
}

const LENGTH: usize = 60;
const REACH: usize = 7;

fn line(ranks: &dyn Communicator) -> Line {
    let (rank, size) = (ranks.rank(), ranks.size());
    let first_of = |rank: usize| rank * LENGTH / size;
    let (first, end) = (first_of(rank), first_of(rank + 1));
    let start = first.saturating_sub(REACH);
    let stop = (end + REACH).min(LENGTH);
    let owner = |k: usize| (0..size).find(|&r| (first_of(r)..first_of(r + 1)).contains(&k)).unwrap();
    let ghosts = (start..first).chain(end..stop);
    let wanted =
        ghosts.map(|k| Wanted { owner: owner(k), key: k as u64, place: (k - start) as u32 }).collect();
    let find = |key: u64| (first..end).contains(&(key as usize)).then(|| (key as usize - start) as u32);
    Line { plan: GhostPlan::new(ranks, wanted, find), first: start, own: end - first, below: first - start }
}

#[test]
fn ghosts_follow_their_owners_and_give_back_what_they_collect() {
    for size in SIZES {
        Threads::run(size, |ranks| {
            let Line { mut plan, first, own, below } = line(ranks);
            let length = own + plan.ghost_count();
            let mut x = vec![f64::NAN; 2 * length];
            for k in below..below + own {
                x[2 * k] = (first + k) as f64;
                x[2 * k + 1] = -0.5;
            }
            plan.update::<f64, 2>(ranks, &mut x);
            assert!((0..length).all(|k| x[2 * k] == (first + k) as f64 && x[2 * k + 1] == -0.5));
            // Every rank adds one wherever it reaches: the owner counts the ranks that see it.
            let mut seen = vec![1.0f32; length];
            plan.accumulate::<f32, 1>(ranks, &mut seen);
            let reach = |r: usize| {
                let (start, end) = (r * LENGTH / size, (r + 1) * LENGTH / size);
                start.saturating_sub(REACH)..(end + REACH).min(LENGTH)
            };
            for k in 0..length {
                let want = (0..size).filter(|&r| reach(r).contains(&(first + k))).count() as f32;
                assert_eq!(seen[k], if (below..below + own).contains(&k) { want } else { 0.0 });
            }
        })
        .unwrap();
    }
}

/// `(G x) . y = x . (G^T y)` with sums over all ranks.
#[test]
fn accumulation_is_the_transpose_of_the_update() {
    for size in SIZES {
        Threads::run(size, |ranks| {
            let Line { mut plan, own, below, .. } = line(ranks);
            let length = own + plan.ghost_count();
            let wave = |k: f64| (0..length).map(move |i| (k * (i + 31 * ranks.rank()) as f64).sin());
            let owned = below..below + own;
            let mut x: Vec<f64> =
                wave(0.7).enumerate().map(|(i, x)| if owned.contains(&i) { x } else { 0.0 }).collect();
            let mut y: Vec<f64> = wave(1.1).collect();
            let (before_x, before_y) = (x.clone(), y.clone());
            plan.update::<f64, 1>(ranks, &mut x);
            plan.accumulate::<f64, 1>(ranks, &mut y);
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let mut sums = [dot(&x, &before_y), dot(&before_x, &y)];
            ranks.sum(&mut sums);
            assert!((sums[0] - sums[1]).abs() < 1e-13, "{sums:?}");
        })
        .unwrap();
    }
}

#[test]
fn a_rank_that_dies_ends_all_and_is_named() {
    for size in [2, 3, 8] {
        let failure = Threads::run(size, |ranks| {
            for round in 0..10 {
                assert!(round < 3 || ranks.rank() != 1, "no memory left in round {round}");
                ranks.sum(&mut [1.0]);
            }
        })
        .unwrap_err();
        assert_eq!((failure.rank, failure.size), (1, size));
        let text = failure.to_string();
        assert_eq!(text, format!("rank 1 of {size} failed: no memory left in round 3"));
    }
}

#[test]
fn the_failure_of_a_rank_is_that_of_all() {
    let told = "körper 7: no equation ".repeat(50);
    for size in SIZES {
        let failing = [size / 2, size - 1];
        let outcomes = Threads::run(size, |ranks| {
            let text = failing.contains(&ranks.rank()).then(|| format!("{told}{}", ranks.rank()));
            [None, text, Some(String::new())].map(|own| ranks.first_failure(own))
        });
        let says = |rank: usize, message: &str| Some(RankFailure { rank, size, message: message.to_owned() });
        let expected = [None, says(size / 2, &format!("{told}{}", size / 2)), says(0, "")];
        assert!(outcomes.unwrap().iter().all(|found| found == &expected), "{size} ranks");
    }
}

#[test]
fn what_is_not_a_number_is_largest_on_any_rank() {
    for size in SIZES {
        for lost in 0..size {
            let found = Threads::run(size, |ranks| {
                let own = if ranks.rank() == lost { f64::NAN } else { 1.0 };
                let mut largest = [own, ranks.rank() as f64, -1.0];
                ranks.reduce(&mut [], &mut largest);
                largest
            });
            let is_right = |found: &[f64; 3]| found[0].is_nan() && found[1..] == [size as f64 - 1.0, -1.0];
            assert!(found.unwrap().iter().all(is_right), "{size} ranks, {lost}");
        }
    }
}

#[test]
fn all_ranks_take_what_rank_zero_shares() {
    for size in SIZES {
        let shared = Threads::run(size, |ranks| {
            let mut values = [0.5 + ranks.rank() as f64, -0.0, 1e300];
            ranks.share(&mut values);
            values.map(f64::to_bits)
        });
        assert_eq!(shared.unwrap(), vec![[0.5, -0.0, 1e300].map(f64::to_bits); size]);
    }
}

#[test]
fn traffic_is_counted() {
    let traffic = Threads::run(4, |ranks| {
        let next = Message { rank: (ranks.rank() + 1) % 4, bytes: vec![7; 100] };
        let mut from = [Message { rank: (ranks.rank() + 3) % 4, bytes: vec![0; 100] }];
        ranks.exchange(&[next], &mut from);
        assert_eq!(from[0].bytes, [7; 100]);
        let before = ranks.traffic();
        ranks.sum(&mut [1.0, 2.0]);
        (before, ranks.traffic().since(before))
    })
    .unwrap();
    for (exchange, _) in &traffic {
        assert_eq!((exchange.messages, exchange.bytes, exchange.exchanges), (1, 100, 1));
    }
    // Up and down a tree of four: six messages of two numbers.
    let messages: u64 = traffic.iter().map(|t| t.1.messages).sum();
    let bytes: u64 = traffic.iter().map(|t| t.1.bytes).sum();
    assert_eq!((messages, bytes), (6, 96));
    assert!(traffic.iter().all(|t| t.1.reductions == 1));
}

/// Two fields in one vector, of one component and of two, whose ghosts travel together.
#[test]
fn joined_plans_do_what_each_does() {
    for size in SIZES {
        Threads::run(size, |ranks| {
            let Line { plan, own, below, .. } = line(ranks);
            let length = own + plan.ghost_count();
            let value = |k: usize| (k as f64 + 0.3 * ranks.rank() as f64).sin();
            let mut one: Vec<f64> = (0..length).map(value).collect();
            let mut two: Vec<f64> = (0..2 * length).map(|k| value(k + 7)).collect();
            let mut both: Vec<f64> = one.iter().chain(&two).copied().collect();
            let mut joined = GhostPlan::joined(&[(&plan, 1, 0), (&plan, 2, length)]);
            let mut plan = plan;
            let before = ranks.traffic();
            joined.accumulate::<f64, 1>(ranks, &mut both);
            joined.update::<f64, 1>(ranks, &mut both);
            let of_joined = ranks.traffic().since(before);
            plan.accumulate::<f64, 1>(ranks, &mut one);
            plan.accumulate::<f64, 2>(ranks, &mut two);
            plan.update::<f64, 1>(ranks, &mut one);
            plan.update::<f64, 2>(ranks, &mut two);
            let of_each = ranks.traffic().since(before).since(of_joined);
            assert_eq!(both, [one, two].concat());
            assert_eq!((2 * of_joined.messages, of_joined.bytes), (of_each.messages, of_each.bytes));
            assert!(own == 0 || below + own <= length);
        })
        .unwrap();
    }
}

#[test]
fn restricted_plans_leave_out_what_a_rank_does_not_keep() {
    for size in SIZES {
        Threads::run(size, |ranks| {
            let Line { plan, first, own, below } = line(ranks);
            let length = own + plan.ghost_count();
            // Each rank keeps other ghosts.
            let keeps = |place: u32| (first + place as usize + ranks.rank()).is_multiple_of(3);
            let mut few = plan.restricted(ranks, keeps);
            let mut x = vec![f64::NAN; length];
            (below..below + own).for_each(|k| x[k] = (first + k) as f64);
            few.update::<f64, 1>(ranks, &mut x);
            for k in (0..length).filter(|k| !(below..below + own).contains(k)) {
                assert_eq!(x[k] == (first + k) as f64, keeps(k as u32));
            }
        })
        .unwrap();
    }
}

/// Records come by rank, of each in the order in which they were given, those of a rank for itself among
/// them.
#[test]
fn records_reach_ranks_that_do_not_expect_them() {
    for size in SIZES {
        let received = Threads::run(size, |ranks| {
            let me = ranks.rank() as u64;
            // To every second rank, twice to itself.
            let others = (0..size).filter(|rank| rank % 2 == 0).map(|rank| (rank, [me, 7]));
            let own = [(ranks.rank(), [me, 8]), (ranks.rank(), [me, 9])];
            route(ranks, others.chain(own).collect())
        })
        .unwrap();
        for (rank, records) in received.into_iter().enumerate() {
            let of = |other: u64| {
                let all = if rank % 2 == 0 { vec![[other, 7]] } else { Vec::new() };
                let own = if other == rank as u64 { vec![[other, 8], [other, 9]] } else { Vec::new() };
                [all, own].concat()
            };
            assert_eq!(records, (0..size as u64).flat_map(of).collect::<Vec<_>>());
        }
    }
}
