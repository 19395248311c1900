//! Ranks that are threads of one process.

use super::{Alone, Exchange, Tally, Traffic, doubling};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};

/// One of several ranks that are threads of a process.
struct Together {
    rank: usize,
    to: Vec<Sender<Vec<f64>>>,
    from: Vec<Mutex<Receiver<Vec<f64>>>>,
    tally: Tally,
}

/// What a rank ends with when another has ended before it.
struct Bereft;

fn bereft() -> ! {
    resume_unwind(Box::new(Bereft))
}

impl Together {
    fn send(&self, rank: usize, message: Vec<f64>) {
        self.to[rank].send(message).unwrap_or_else(|_| bereft());
    }

    fn receive(&self, rank: usize) -> Vec<f64> {
        let received = self.from[rank].lock().map_or(None, |channel| channel.recv().ok());
        received.unwrap_or_else(|| bereft())
    }
}

impl Exchange for Together {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.to.len()
    }

    fn on_this_machine(&self) -> usize {
        self.to.len()
    }

    /// Unwinds where another rank has ended, as a process ends whose MPI is aborted; [`together`] says which it was.
    fn swap(&self, to: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        self.tally.count(self.rank, &to);
        to.into_iter().enumerate().for_each(|(rank, message)| self.send(rank, message));
        (0..self.ranks()).map(|rank| self.receive(rank)).collect()
    }

    fn all(&self, own: &[f64]) -> Vec<Vec<f64>> {
        doubling((self.rank, self.ranks()), own, |(to, message), from| {
            self.tally.add(1, message.len());
            self.send(to, message);
            self.receive(from)
        })
    }

    fn pass(&self, to: Vec<(usize, Vec<f64>)>, from: &[usize]) -> Vec<Vec<f64>> {
        for (rank, message) in to {
            self.tally.add(u64::from(!message.is_empty()), message.len());
            self.send(rank, message);
        }
        from.iter().map(|rank| self.receive(*rank)).collect()
    }

    fn traffic(&self) -> Traffic {
        self.tally.traffic()
    }
}

/// Runs `work` on so many ranks, each of which is a thread with `threads` of its own; returns what each made.
///
/// # Errors
/// The rank that ended by a panic, with its words, or threads that the system does not give.
pub fn together<T: Send>(
    ranks: usize,
    threads: usize,
    work: impl Fn(&dyn Exchange) -> T + Sync,
) -> Result<Vec<T>, String> {
    if ranks == 1 {
        return Ok(vec![work(&Alone)]);
    }
    let mut all: Vec<Together> =
        (0..ranks).map(|rank| Together { rank, to: Vec::new(), from: Vec::new(), tally: Tally::default() }).collect();
    for sender in 0..ranks {
        for receiver in 0..ranks {
            let (to, from) = channel();
            all[sender].to.push(to);
            all[receiver].from.push(Mutex::new(from));
        }
    }
    // Each rank waits for others in its own pool: in a shared one it would keep the threads that these need.
    let pools: Result<Vec<_>, _> =
        (0..ranks).map(|_| rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build()).collect();
    let pools = pools.map_err(|e| format!("{ranks} ranks of {threads} threads cannot be started: {e}"))?;
    let run = |own: Together, pool: rayon::ThreadPool| {
        // Its channels close with it, so that others do not wait for a rank that has ended.
        catch_unwind(AssertUnwindSafe(|| pool.install(|| work(&own))))
    };
    let ended: Vec<std::thread::Result<T>> = std::thread::scope(|scope| {
        let run = &run;
        let handles: Vec<_> =
            all.into_iter().zip(pools).map(|(own, pool)| scope.spawn(move || run(own, pool))).collect();
        handles.into_iter().map(|handle| handle.join().and_then(|ended| ended)).collect()
    });
    let faulty = ended.iter().enumerate().find_map(|(rank, r)| Some((rank, words(r.as_ref().err()?.as_ref())?)));
    match faulty {
        Some((rank, words)) => Err(format!("rank {rank} of {ranks} ended: {words}")),
        None => {
            ended.into_iter().collect::<Result<_, _>>().map_err(|_| "the ranks ended for no reason of their own".into())
        }
    }
}

/// What a panic that was caught says; none where another rank has ended before.
pub fn words(payload: &(dyn std::any::Any + Send)) -> Option<String> {
    if payload.is::<Bereft>() {
        return None;
    }
    let text =
        payload.downcast_ref::<&str>().map(|s| (*s).to_owned()).or_else(|| payload.downcast_ref::<String>().cloned());
    Some(text.unwrap_or_else(|| "it panicked".into()))
}
