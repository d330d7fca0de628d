//! A step does not allocate.

mod common;

use allocation_counter::measure;
use common::{Bench, free, scenario};

#[test]
fn a_step_in_steady_state_does_not_allocate() {
    for integrator in ["semi-implicit", "rk4"] {
        let mut scenario = scenario(&[&format!("plant.integrator={integrator}")]);
        // in contact, sliding down
        scenario.surfaces[0].position_m[2] = -0.001;
        let mut bench = Bench::new(&scenario);
        bench.window(5_000_000, &[free(1_000_001, [0.0; 7])]);
        let counted = measure(|| {
            for _ in 0..20 {
                let at = bench.t;
                bench.window(at + 5_000_000, &[free(at + 1_000_001, [0.0, -3.1, -0.9, 4.2, 1.9, -0.1, 0.0])]);
            }
        });
        assert_eq!(counted.count_total, 0, "{integrator}");
        assert!(bench.out.mail.plant.len() >= 51);
    }
}
