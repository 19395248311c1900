//! Ranks that are processes, as `mpirun` and `srun` start them, with messages by MPI (feature `mpi`).
//!
//! MPI is called by the process's first thread alone, which asks least of an MPI library; the work is in a thread of its own and
//! hands over what is to be sent.

use mpi::Threading;
use mpi::datatype::{Partition, PartitionMut};
use mpi::request::multiple_scope;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use sph::exchange::{Exchange, Tally, Traffic, words};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, PoisonError};

/// As large as that of a process's first thread.
const STACK: usize = 8 << 20;

/// Messages for each rank, or from each.
type Messages = Vec<Vec<f64>>;

/// What is to be sent.
enum Sent {
    Swap(Messages),
    All(Vec<f64>),
    /// To some ranks, and from whom there is something to be received.
    Pass(Vec<(usize, Vec<f64>)>, Vec<usize>),
}

/// This process among the others, for the thread that works.
struct Process {
    rank: usize,
    ranks: usize,
    on_this_machine: usize,
    /// To the thread that calls MPI and back.
    mail: Mutex<(Sender<Sent>, Receiver<Messages>)>,
    tally: Tally,
}

impl Exchange for Process {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.ranks
    }

    fn on_this_machine(&self) -> usize {
        self.on_this_machine
    }

    fn swap(&self, to: Messages) -> Messages {
        if self.ranks == 1 {
            return to;
        }
        self.tally.count(self.rank, &to);
        self.hand_over(Sent::Swap(to))
    }

    fn all(&self, own: &[f64]) -> Messages {
        if self.ranks == 1 {
            return vec![own.to_vec()];
        }
        // MPI does it as it likes; these are the fewest messages.
        let fewest = self.ranks.next_power_of_two().ilog2();
        self.tally.add(u64::from(fewest), (self.ranks - 1) * own.len());
        self.hand_over(Sent::All(own.to_vec()))
    }

    fn pass(&self, to: Vec<(usize, Vec<f64>)>, from: &[usize]) -> Messages {
        to.iter().for_each(|(_, message)| self.tally.add(u64::from(!message.is_empty()), message.len()));
        self.hand_over(Sent::Pass(to, from.to_vec()))
    }

    fn traffic(&self) -> Traffic {
        self.tally.traffic()
    }
}

impl Process {
    fn hand_over(&self, sent: Sent) -> Messages {
        let (out, back) = &*self.mail.lock().unwrap_or_else(PoisonError::into_inner);
        // The other thread is there as long as this one is, or the process ends.
        out.send(sent).ok().and_then(|()| back.recv().ok()).unwrap_or_else(|| vec![Vec::new(); self.ranks])
    }
}

/// Whether a launcher of MPI programs has started this process.
pub fn is_launched() -> bool {
    ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMI_RANK", "PMIX_RANK", "MV2_COMM_WORLD_SIZE"]
        .iter()
        .any(|name| std::env::var_os(name).is_some())
}

/// Runs `work` on this rank of those that were started together. Where it panics, all of them end.
///
/// # Errors
/// MPI that does not start, or a thread that the system does not give.
pub fn over_processes<T: Send>(work: impl FnOnce(&dyn Exchange) -> T + Send) -> Result<T, String> {
    let (universe, _) =
        mpi::initialize_with_threading(Threading::Funneled).ok_or("MPI has been started before in this process")?;
    let world = universe.world();
    let (rank, ranks) = (world.rank(), world.size() as usize);
    let on_this_machine = world.split_shared(rank).size() as usize;
    let (out, taken) = channel::<Sent>();
    let (give, back) = channel::<Messages>();
    let mail = Mutex::new((out, back));
    let own = Process { rank: rank as usize, ranks, on_this_machine, mail, tally: Tally::default() };
    let ended = std::thread::scope(|scope| {
        let body = move || {
            // Moved in, so that its end of the mail closes when the work is done.
            let own = own;
            catch_unwind(AssertUnwindSafe(|| work(&own)))
        };
        let handle = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, body);
        let handle = handle.map_err(|e| format!("rank {rank} of {ranks} cannot start its work: {e}"))?;
        for sent in taken {
            let received = match &sent {
                Sent::Swap(to) => swapped(&world, to),
                Sent::All(own) => gathered(&world, own),
                Sent::Pass(to, from) => passed(&world, to, from),
            };
            let received = received.unwrap_or_else(|problem| end(&world, &problem));
            if give.send(received).is_err() {
                break;
            }
        }
        Ok::<_, String>(handle.join().and_then(|ended| ended))
    });
    match ended {
        Ok(Ok(made)) => Ok(made),
        Ok(Err(payload)) => end(&world, &words(payload.as_ref()).unwrap_or_default()),
        Err(problem) => end(&world, &problem),
    }
}

/// Ends all ranks, with the name of this one.
fn end(world: &SimpleCommunicator, problem: &str) -> ! {
    eprintln!("error: rank {} of {} ended: {problem}", world.rank(), world.size());
    world.abort(1)
}

/// As MPI counts.
fn length(n: usize) -> Result<i32, String> {
    i32::try_from(n).map_err(|_| format!("{n} numbers are too many for a message"))
}

/// Where each message begins among all.
fn starts(counts: &[i32]) -> Vec<i32> {
    let after = |start: &mut i32, n: &i32| {
        let own = *start;
        *start += n;
        Some(own)
    };
    counts.iter().scan(0, after).collect()
}

fn sum(counts: &[i32]) -> usize {
    counts.iter().map(|&n| n as usize).sum()
}

fn cut(mut rest: &[f64], counts: &[i32]) -> Messages {
    let own = |n: &i32| {
        let (own, after) = rest.split_at(*n as usize);
        rest = after;
        own.to_vec()
    };
    counts.iter().map(own).collect()
}

/// Gives each rank its message, and returns theirs.
fn swapped(world: &SimpleCommunicator, to: &Messages) -> Result<Messages, String> {
    let counts = to.iter().map(|m| length(m.len())).collect::<Result<Vec<i32>, _>>()?;
    let mut theirs = vec![0_i32; counts.len()];
    world.all_to_all_into(&counts[..], &mut theirs[..]);
    length(sum(&counts).max(sum(&theirs)))?;
    let sent = to.concat();
    let mut received = vec![0.0; sum(&theirs)];
    {
        let sent = Partition::new(&sent[..], &counts[..], starts(&counts));
        let mut into = PartitionMut::new(&mut received[..], &theirs[..], starts(&theirs));
        world.all_to_all_varcount_into(&sent, &mut into);
    }
    Ok(cut(&received, &theirs))
}

/// Gives all ranks a message, and returns theirs.
fn gathered(world: &SimpleCommunicator, own: &[f64]) -> Result<Messages, String> {
    let mut theirs = vec![0_i32; world.size() as usize];
    world.all_gather_into(&length(own.len())?, &mut theirs[..]);
    length(sum(&theirs))?;
    let mut received = vec![0.0; sum(&theirs)];
    {
        let mut into = PartitionMut::new(&mut received[..], &theirs[..], starts(&theirs));
        world.all_gather_varcount_into(own, &mut into);
    }
    Ok(cut(&received, &theirs))
}

/// Sends messages to some ranks, and returns those of some.
fn passed(world: &SimpleCommunicator, to: &[(usize, Vec<f64>)], from: &[usize]) -> Result<Messages, String> {
    let process = |rank: usize| length(rank).map(|rank| world.process_at_rank(rank));
    to.iter().try_for_each(|(_, message)| length(message.len()).map(|_| ()))?;
    let receivers = to.iter().map(|(rank, _)| process(*rank)).collect::<Result<Vec<_>, _>>()?;
    let senders = from.iter().map(|rank| process(*rank)).collect::<Result<Vec<_>, _>>()?;
    // None waits for another to listen.
    Ok(multiple_scope(to.len(), |scope, sending| {
        for (receiver, (_, message)) in receivers.iter().zip(to) {
            sending.add(receiver.immediate_send(scope, &message[..]));
        }
        let received = senders.iter().map(|sender| sender.receive_vec::<f64>().0).collect();
        sending.wait_all(&mut Vec::new());
        received
    }))
}
