//! What ranks tell each other arrives, in the order of ranks, whatever their number is.

use sph_core::exchange::{Alone, Exchange, Group, together};

const RANKS: [usize; 8] = [1, 2, 3, 4, 5, 7, 8, 9];

/// Numbers of a rank: as many as it has, of either sign.
fn numbers(rank: usize) -> Vec<f64> {
    (0..3 * rank + 1).map(|i| ((7 * rank + 13 * i) % 11) as f64 - 4.5).collect()
}

#[test]
fn messages_arrive_in_the_order_of_ranks() {
    for ranks in RANKS {
        let all: Vec<Vec<f64>> = (0..ranks).map(numbers).collect();
        let told = together(ranks, 1, |exchange| {
            let rank = exchange.rank();
            assert_eq!((exchange.ranks(), exchange.on_this_machine()), (ranks, ranks));
            assert_eq!(exchange.all(&numbers(rank)), all);
            // What is for another has its number and the sender's; some have nothing to say.
            let to = |r: usize| if r == (rank + 1) % ranks { Vec::new() } else { vec![rank as f64; r + 1] };
            let from = exchange.swap((0..ranks).map(to).collect());
            for (r, message) in from.iter().enumerate() {
                let silent = rank == (r + 1) % ranks;
                assert_eq!(*message, if silent { Vec::new() } else { vec![r as f64; rank + 1] }, "{ranks} ranks");
            }
            exchange.traffic().messages
        });
        // One message for each doubling, and one to each of the others but one.
        let fewest = u64::from(ranks.next_power_of_two().ilog2()) + (ranks as u64).saturating_sub(2);
        assert_eq!(told.unwrap(), vec![fewest; ranks], "{ranks} ranks");
    }
}

/// Groups that share ranks, each of which comes to them in one order, while others have none: messages and totals are those of the members.
#[test]
fn groups_work_by_themselves() {
    let groups: [&[usize]; 5] = [&[1, 2, 3], &[0, 4], &[2, 5], &[0, 1, 2, 3, 4, 5], &[4, 5]];
    together(7, 1, |exchange| {
        for members in groups {
            let Some(group) = Group::new(exchange, members.to_vec()) else {
                assert!(!members.contains(&exchange.rank()));
                continue;
            };
            let (group, own) = (&group as &dyn Exchange, exchange.rank());
            assert_eq!((group.ranks(), members[group.rank()]), (members.len(), own));
            assert_eq!(group.all(&numbers(own)), members.iter().map(|rank| numbers(*rank)).collect::<Vec<_>>());
            let to = members.iter().map(|rank| vec![own as f64, *rank as f64]).collect();
            let from: Vec<Vec<f64>> = members.iter().map(|rank| vec![*rank as f64, own as f64]).collect();
            assert_eq!(group.swap(to), from);
            assert_eq!(group.sum(own as f64), members.iter().sum::<usize>() as f64);
            // Of these, the first and the last.
            if let Some(pair) = Group::new(group, vec![0, members.len() - 1]) {
                assert_eq!((&pair as &dyn Exchange).max(own as f64), members[members.len() - 1] as f64);
            }
        }
        let others = u64::from(exchange.rank() != 6);
        assert!(exchange.traffic().messages >= others && (others == 1 || exchange.traffic().bytes == 0));
    })
    .unwrap();
}

#[test]
fn totals_are_those_of_all_numbers_in_their_order() {
    for ranks in RANKS {
        let all: Vec<f64> = (0..ranks).flat_map(numbers).collect();
        let mut sorted = all.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let tenths = (0..ranks).fold(0.0, |sum, rank| sum + 0.1 * rank as f64);
        together(ranks, 1, |exchange| {
            let rank = exchange.rank();
            let own = numbers(rank);
            assert_eq!(exchange.count(own.len()), all.len());
            // To the bit, as one rank after the other adds up.
            assert_eq!(exchange.sum(0.1 * rank as f64).to_bits(), tenths.to_bits());
            assert_eq!(exchange.together([1.0, 0.1 * rank as f64]), [ranks as f64, tenths]);
            assert_eq!(exchange.max(-(rank as f64)), 0.0);
            assert!(exchange.any(rank + 1 == ranks) && !exchange.any(false));
            for n in [0, all.len() / 3, all.len() / 2, all.len() - 1] {
                assert_eq!(exchange.nth(&mut own.clone(), n).to_bits(), sorted[n].to_bits(), "{ranks} ranks, {n}");
            }
        })
        .unwrap();
    }
    let alone: &dyn Exchange = &Alone;
    assert_eq!(alone.nth(&mut [3.0, f64::INFINITY, -1.0, -0.0, 0.0], 2), 0.0);
    let parts = [vec![f64::INFINITY, -0.0], vec![f64::NEG_INFINITY, 1e-300], Vec::new()];
    let found =
        together(3, 1, |exchange| (0..4).map(|n| exchange.nth(&mut parts[exchange.rank()].clone(), n)).collect());
    for found in found.unwrap() {
        let found: Vec<f64> = found;
        assert_eq!(found, [f64::NEG_INFINITY, -0.0, 1e-300, f64::INFINITY]);
    }
}

#[test]
fn a_rank_that_ends_ends_all_with_its_name() {
    let ended = together(4, 1, |exchange| {
        exchange.sum(1.0);
        assert!(exchange.rank() != 2, "it had enough");
        exchange.sum(1.0)
    });
    assert_eq!(ended.unwrap_err(), "rank 2 of 4 ended: it had enough");
}
