//! `vmerack bus sim`: the arbiter as a queueing system. The simulation is `vme::queueing`; here are its
//! arguments, its table and its JSON.

use clap::{Args, ValueEnum};
use serde::Serialize;
use vme::arbiter::{LEVELS, Mode};
use vme::queueing::{Observed, Offered, simulate};
use vme::traffic::Arrivals;

/// Arguments of `vmerack bus sim`.
#[derive(Debug, Clone, Args)]
pub struct SimArgs {
    /// How the arbiter chooses: PRI (priority), RRS (round robin) or SGL (BR3* and daisy chain only).
    #[arg(long, value_enum, ignore_case = true, default_value = "PRI")]
    mode: ModeName,

    /// Time for which each transfer keeps the bus in ns, arbitration included.
    #[arg(long, value_name = "N", default_value_t = 1_000)]
    service_ns: u64,

    /// Utilisation offered at each level, highest first: L3,L2,L1,L0.
    ///
    /// With SGL the four are requesters on BR3*, in slots 1 to 4.
    #[arg(long, value_name = "L3,L2,L1,L0", value_parser = load, allow_negative_numbers = true)]
    load: [f64; LEVELS],

    /// When requests arrive; they queue without bound at their level.
    #[arg(long, value_enum, default_value = "poisson")]
    arrivals: ArrivalsName,

    /// Transfers to carry out.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    transfers: u64,

    /// Seed of the arrivals.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,

    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ModeName {
    #[value(name = "PRI")]
    Pri,
    #[value(name = "RRS")]
    Rrs,
    #[value(name = "SGL")]
    Sgl,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ArrivalsName {
    Poisson,
    Periodic,
}

/// Runs the simulation and returns the exit code.
pub fn run(args: &SimArgs) -> u8 {
    let offered = args.offered();
    let observed = match simulate(&offered) {
        Ok(observed) => observed,
        Err(error) => {
            eprintln!("error: {error}");
            return 2;
        }
    };
    if args.json {
        println!("{}", json(&offered, &observed));
    } else {
        print!("{}", table(&offered, &observed));
    }
    0
}

impl SimArgs {
    fn offered(&self) -> Offered {
        Offered {
            mode: match self.mode {
                ModeName::Pri => Mode::Pri,
                ModeName::Rrs => Mode::Rrs,
                ModeName::Sgl => Mode::Sgl,
            },
            service_ns: self.service_ns,
            load: self.load,
            arrivals: match self.arrivals {
                ArrivalsName::Poisson => Arrivals::Poisson,
                ArrivalsName::Periodic => Arrivals::Periodic,
            },
            transfers: self.transfers,
            seed: self.seed,
        }
    }
}

/// Four utilisations, highest level first, in the order of the levels.
fn load(text: &str) -> Result<[f64; LEVELS], String> {
    let expected = || format!("expected {LEVELS} numbers from 0 to 100, as in 0.2,0.3,0.3,0");
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let mut load: [f64; LEVELS] = numbers.map_err(|_| expected())?.try_into().map_err(|_| expected())?;
    load.reverse();
    if load.iter().all(|load| (0.0..=100.0).contains(load)) { Ok(load) } else { Err(expected()) }
}

fn json(offered: &Offered, observed: &Observed) -> String {
    #[derive(Serialize)]
    struct Output<'a> {
        mode: Mode,
        arrivals: Arrivals,
        service_ns: u64,
        transfers: u64,
        seed: u64,
        #[serde(flatten)]
        observed: &'a Observed,
    }
    let output = Output {
        mode: offered.mode,
        arrivals: offered.arrivals,
        service_ns: offered.service_ns,
        transfers: offered.transfers,
        seed: offered.seed,
        observed,
    };
    format!("{:#}", serde_json::json!(output))
}

fn table(offered: &Offered, observed: &Observed) -> String {
    let mut text = format!("{:>5} {:>12} {:>14} {:>12} {:>12} {:>12}\n", "level", "n", "mean wait ns", "p99 ns", "max ns", "utilisation");
    let whole = |value: Option<u64>| value.map_or("-".into(), |value| value.to_string());
    for level in &observed.levels {
        let mean = level.mean_wait_ns.map_or("-".into(), |mean| format!("{mean:.1}"));
        let (p99, max) = (whole(level.p99_wait_ns), whole(level.max_wait_ns));
        text += &format!("{:>5} {:>12} {mean:>14} {p99:>12} {max:>12} {:>12.4}\n", level.level, level.n, level.utilisation);
    }
    let offered: f64 = offered.load.iter().sum();
    if offered >= 1.0 {
        text += &format!("offered utilisation {offered:.3}: the queues grow for as long as the simulation runs\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_are_read_highest_level_first() {
        assert_eq!(load("0.2,0.3, 0.4,0"), Ok([0.0, 0.4, 0.3, 0.2]));
        for bad in ["", "0.1", "1,2,3,4,5", "a,b,c,d", "-1,0,0,0", "nan,0,0,0", "inf,0,0,0"] {
            assert!(load(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_json_lists_every_level_highest_first() {
        let offered = Offered {
            mode: Mode::Pri,
            service_ns: 1000,
            load: [0.0, 0.3, 0.3, 0.2],
            arrivals: Arrivals::Poisson,
            transfers: 5_000,
            seed: 1,
        };
        let observed = simulate(&offered).unwrap();
        let parsed: serde_json::Value = serde_json::from_str(&json(&offered, &observed)).unwrap();
        let levels = parsed["levels"].as_array().unwrap();
        assert_eq!(levels.iter().map(|level| level["level"].as_u64().unwrap()).collect::<Vec<_>>(), [3, 2, 1, 0]);
        assert_eq!(levels.iter().map(|level| level["n"].as_u64().unwrap()).sum::<u64>(), 5_000);
        assert!(levels[0]["mean_wait_ns"].is_number() && levels[3]["mean_wait_ns"].is_null());
        assert_eq!(parsed["mode"], "PRI");
    }
}
