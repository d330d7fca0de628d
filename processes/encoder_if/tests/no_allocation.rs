//! A step of the cards does not allocate.

mod cards;

use allocation_counter::measure;
use cards::{Bench, MS, scenario};
use messages::registers::encoder;

#[test]
fn a_step_does_not_allocate_once_the_host_s_buffers_have_grown() {
    for delay in ["encoder_if.delay_ms=0", "encoder_if.delay_ms=100"] {
        let mut bench = Bench::new(&scenario(&[delay]), |t| 1e5 * t * t);
        let addresses = [encoder::COUNT, encoder::VELOCITY, encoder::INDEX].map(|register| bench.addr(6, register));
        let mut windows = |which: std::ops::Range<u64>| {
            measure(|| {
                for window in which {
                    let from = window * 5 * MS;
                    bench.window(from + 5 * MS, &addresses.map(|addr| (from + 1000, addr, false)));
                }
            })
            .count_total
        };
        assert!(windows(0..10) > 0, "the bench's own buffers grow");
        assert_eq!(windows(10..100), 0, "{delay}");
    }
}
