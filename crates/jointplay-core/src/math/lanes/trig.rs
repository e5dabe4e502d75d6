//! Sine and cosine of all lanes at once.

use crate::math::lanes::block::{LANES, sin_cos_near_zero};

/// Angles up to this size (rad) are reduced without loss: the multiple of a quarter turn is a whole number, and the
/// third part of pi / 2, which is left out, is nothing beside rounding.
const LARGEST: f64 = 1e9;

/// Sines and cosines of angles; those of the C library only beyond [`LARGEST`].
#[inline(always)]
pub(crate) fn sin_cos(angles: &[f64; LANES]) -> [[f64; LANES]; 2] {
    let (mut sines, mut cosines) = ([0.0; LANES], [0.0; LANES]);
    let mut reduced = true;
    for i in 0..LANES {
        (sines[i], cosines[i]) = of_one(angles[i]);
        reduced &= angles[i].abs() <= LARGEST;
    }
    if !reduced {
        for i in 0..LANES {
            (sines[i], cosines[i]) = angles[i].sin_cos();
        }
    }
    [sines, cosines]
}

/// `x = k pi / 2 + r` with a whole k and r within an eighth of a turn.
#[inline(always)]
fn of_one(x: f64) -> (f64, f64) {
    // 1.5 2^52 + k holds the whole number k in its low bits, negative ones as well.
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    // pi / 2 as the sum of two numbers; with one rounding the product with the first one cancels exactly.
    const HIGH: f64 = std::f64::consts::FRAC_PI_2;
    const LOW: f64 = 6.123_233_995_736_766e-17;
    let held = x.mul_add(std::f64::consts::FRAC_2_PI, MAGIC);
    let whole = held - MAGIC;
    let rest = whole.mul_add(-LOW, whole.mul_add(-HIGH, x));
    let (sine, cosine) = sin_cos_near_zero(rest);
    let quarter = held.to_bits();
    let (s, c) = if quarter & 1 == 0 { (sine, cosine) } else { (cosine, sine) };
    (if quarter & 2 == 0 { s } else { -s }, if (quarter + 1) & 2 == 0 { c } else { -c })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_agree_with_the_library() {
        for scale in [1e-9, 1e-3, 1.0, 30.0, 1e4, 1e8, 1e12] {
            for block in 0..40 {
                let angles: [f64; LANES] = std::array::from_fn(|i| scale * ((64 * block + i) as f64 * 0.0123 - 15.7));
                let [sines, cosines] = sin_cos(&angles);
                for i in 0..LANES {
                    let (s, c) = angles[i].sin_cos();
                    assert!((sines[i] - s).abs() < 3e-16 && (cosines[i] - c).abs() < 3e-16, "{}", angles[i]);
                }
            }
        }
        let [sines, cosines] = sin_cos(&[f64::NAN; LANES]);
        assert!(sines[0].is_nan() && cosines[0].is_nan());
    }
}
