//! A step of the card does not allocate.

mod card;

use allocation_counter::measure;
use card::{Bench, MS, read, scenario, write};
use messages::registers::force;

#[test]
fn a_step_does_not_allocate_once_the_host_s_buffers_have_grown() {
    for filter in ["{ cascade = 4 }", "{ delay_ms = 128.0 }"] {
        let filter = format!("force_sensor_if.filter={filter}");
        let scenario = scenario(&[&filter, "force_sensor_if.noise_n=0.5"]);
        let mut bench = Bench::new(&scenario, |t| [10.0 * t; 6]);
        let mut windows = |which: std::ops::Range<u64>| {
            measure(|| {
                for window in which {
                    let from = window * 5 * MS;
                    let mut accesses = [read(from + 1000, force::filter(4)); 8];
                    accesses[7] = write(from + 2000, force::OFFSET, window as i16);
                    bench.window(from + 5 * MS, &accesses);
                }
            })
            .count_total
        };
        assert!(windows(0..10) > 0, "the bench's own buffers grow");
        assert_eq!(windows(10..200), 0, "{filter}");
    }
}
