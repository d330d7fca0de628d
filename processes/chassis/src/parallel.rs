//! Independent jobs on all cores.

use crossbeam::channel;

/// Number of cores that jobs are spread over.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Does every job on all cores; the answers keep the jobs' order.
pub fn parallel<J: Sync, A: Send>(jobs: &[J], work: impl Fn(&J) -> A + Sync) -> Vec<A> {
    let (give, take) = channel::unbounded();
    let (answer, answers) = channel::unbounded();
    for job in jobs.iter().enumerate() {
        // the receiver lives until the end of this function
        let _ = give.send(job);
    }
    drop(give);
    std::thread::scope(|scope| {
        for _ in 0..cores().min(jobs.len()) {
            let (take, answer, work) = (take.clone(), answer.clone(), &work);
            scope.spawn(move || {
                for (i, job) in take {
                    let _ = answer.send((i, work(job)));
                }
            });
        }
    });
    drop(answer);
    let mut answers: Vec<(usize, A)> = answers.into_iter().collect();
    answers.sort_by_key(|(i, _)| *i);
    answers.into_iter().map(|(_, answer)| answer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_keep_the_order_of_their_jobs() {
        let jobs: Vec<u64> = (0..200).collect();
        let squares: Vec<u64> = jobs.iter().map(|job| job * job).collect();
        assert_eq!(parallel(&jobs, |job| job * job), squares);
        assert!(parallel(&[] as &[u64], |job| *job).is_empty());
    }
}
