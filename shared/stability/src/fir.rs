//! The low-pass filter of one stage of the JR3 receiver's cascade: its 25 taps and its frequency
//! response. The single home of these numbers: the force-sensor board filters with them, and the
//! stability bounds are computed behind them.
//!
//! Windowed sinc with a Hamming window, cut-off at 1/16 of the stage's input rate, unit gain at DC
//! (`firwin(25, 1/8)` of SciPy gives the same taps). The response at the cut-off is 0.511 (−5.8 dB); it is
//! the −6 dB point of the ideal low-pass, as is usual for this design. The stage then drops to a
//! quarter of its input rate, whose Nyquist frequency is 1/8 of the input rate: the attenuation is
//! 39 dB there, and from 0.134 of the input rate on nothing passes above −50 dB.
//!
//! The manuals do not print the taps of the real receiver. Among Hamming, Hann, Blackman and rectangular
//! windows, with the cut-off as the −6 dB point or as the −3 dB point, this one comes nearest to the
//! largest stable contact stiffness that is quoted for the cascade: 5.58 kN/m for (m, b) =
//! (5.7, 477) where 5.57 is quoted, and 9.23 for (100, 1000) where 9.18 is.
//!
//! Nothing here can fail.

use core::f64::consts::PI;

/// Number of taps of one stage.
pub const TAPS: usize = 25;

/// Group delay of one stage at every frequency, in samples of its input rate (linear phase).
pub const DELAY_SAMPLES: usize = TAPS / 2;

/// Cut-off of one stage as a fraction of its input rate.
pub const CUTOFF_OVER_INPUT_RATE: f64 = 1.0 / 16.0;

/// Input samples per output sample of one stage.
pub const DECIMATION: usize = 4;

/// The taps h₀ … h₂₄ of one stage, symmetric to the bit, their sum 1.
///
/// Uses `libm` and a fixed order of summation, so every machine gets the same bits.
pub fn lowpass_taps() -> [f64; TAPS] {
    let mut taps = [0.0; TAPS];
    for (i, tap) in taps.iter_mut().enumerate() {
        // Distance from the middle tap: equal for mirrored taps, so the symmetry is exact.
        let distance = i.abs_diff(DELAY_SAMPLES) as f64;
        *tap = sinc(2.0 * CUTOFF_OVER_INPUT_RATE * distance) * hamming(distance);
    }
    let sum: f64 = taps.iter().sum();
    taps.map(|tap| tap / sum)
}

/// Gain of one stage at `frequency` (a fraction of the input rate), its pure delay of
/// [`DELAY_SAMPLES`] taken out: real, because the taps are symmetric; negative in every other
/// side lobe.
pub fn amplitude(taps: &[f64; TAPS], frequency: f64) -> f64 {
    let mut sum = taps[DELAY_SAMPLES];
    for k in 1..=DELAY_SAMPLES {
        sum += 2.0 * taps[DELAY_SAMPLES + k] * libm::cos(2.0 * PI * frequency * k as f64);
    }
    sum
}

/// sin(πx)/(πx).
fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        libm::sin(PI * x) / (PI * x)
    }
}

/// Hamming window at `distance` taps from its middle.
fn hamming(distance: f64) -> f64 {
    0.54 + 0.46 * libm::cos(PI * distance / DELAY_SAMPLES as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_taps_are_symmetric_to_the_bit_and_sum_to_one() {
        let taps = lowpass_taps();
        for i in 0..TAPS {
            assert_eq!(taps[i].to_bits(), taps[TAPS - 1 - i].to_bits(), "tap {i}");
        }
        assert!((taps.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_taps_are_those_of_scipys_firwin() {
        // scipy.signal.firwin(25, 1/8), the first half and the middle.
        let scipy = [
            -0.002166823682341475,
            -0.0026117522005138123,
            -0.003254991964352446,
            -0.0029676076982096773,
            1.5424013305083962e-18,
            0.007479627882912816,
            0.020684372212160032,
            0.03958065653489831,
            0.06256703382761004,
            0.08660842247804355,
            0.10783127345119793,
            0.12243156388920391,
            0.12763645053878167,
        ];
        for (i, (tap, reference)) in lowpass_taps().iter().zip(scipy).enumerate() {
            assert!((tap - reference).abs() < 1e-16, "tap {i}: {tap}");
        }
    }

    #[test]
    fn the_response_at_the_cut_off_is_the_half_of_a_windowed_sinc() {
        let taps = lowpass_taps();
        assert!((amplitude(&taps, 0.0) - 1.0).abs() < 1e-15);
        assert!((amplitude(&taps, CUTOFF_OVER_INPUT_RATE) - 0.5114).abs() < 5e-5);
    }

    #[test]
    fn the_symmetric_form_of_the_response_equals_the_sum_over_the_taps() {
        let taps = lowpass_taps();
        for frequency in [0.001, 0.03, 0.0625, 0.1, 0.125, 0.3, 0.5] {
            let (mut re, mut im) = (0.0, 0.0);
            for (n, tap) in taps.iter().enumerate() {
                re += tap * (2.0 * PI * frequency * n as f64).cos();
                im -= tap * (2.0 * PI * frequency * n as f64).sin();
            }
            let delay = 2.0 * PI * frequency * DELAY_SAMPLES as f64;
            let a = amplitude(&taps, frequency);
            assert!((re - a * delay.cos()).abs() < 1e-14, "{frequency}");
            assert!((im + a * delay.sin()).abs() < 1e-14, "{frequency}");
        }
    }

    #[test]
    fn what_would_alias_is_attenuated_by_39_db_at_the_output_nyquist_and_50_db_beyond() {
        let taps = lowpass_taps();
        let db = |f: f64| 20.0 * amplitude(&taps, f).abs().log10();
        assert!(db(0.125) < -38.5, "{}", db(0.125));
        for i in 134..=500 {
            let f = f64::from(i) / 1000.0;
            assert!(db(f) < -50.0, "{f}: {}", db(f));
        }
    }
}
