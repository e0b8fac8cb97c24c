//! Everyone meets everyone once, many at a time, always in the same order.

use rayon::iter::{IndexedParallelIterator as _, IntoParallelRefMutIterator as _, ParallelIterator as _};

/// Lets each of `players` meet each other one once, in rounds in which nobody plays twice.
///
/// The meetings of a round run in parallel, with both players at hand to be changed. Who meets whom when depends on their number only (the
/// circle method: all but the first move on by one seat after each round), so that whatever a player adds up, it adds up in
/// the same order with any number of threads.
pub(super) fn tournament<T: Send>(players: &mut Vec<T>, meet: impl Fn(&mut T, &mut T) + Sync) {
    // Of an odd number one has a free round: the empty seat's opponent.
    let mut seats: Vec<Option<T>> = players.drain(..).map(Some).collect();
    let count = seats.len();
    if count % 2 == 1 {
        seats.push(None);
    }
    for _ in 1..seats.len() {
        let half = seats.len() / 2;
        let (left, right) = seats.split_at_mut(half);
        left.par_iter_mut().zip(right.par_iter_mut().rev()).for_each(|pair| {
            if let (Some(one), Some(other)) = pair {
                meet(one, other);
            }
        });
        seats[1..].rotate_right(1);
    }
    players.extend(seats.into_iter().flatten());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everyone_meets_everyone_once_and_returns_to_their_seat() {
        for count in 0..12 {
            let mut players: Vec<(usize, Vec<usize>)> = (0..count).map(|id| (id, Vec::new())).collect();
            tournament(&mut players, |(a, met_by_a), (b, met_by_b)| {
                met_by_a.push(*b);
                met_by_b.push(*a);
            });
            for (seat, (id, met)) in players.iter_mut().enumerate() {
                met.sort_unstable();
                assert_eq!(*id, seat);
                assert_eq!(*met, (0..count).filter(|&other| other != seat).collect::<Vec<_>>());
            }
        }
    }
}
