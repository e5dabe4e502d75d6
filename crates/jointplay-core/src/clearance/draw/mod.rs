//! Drawing offsets for a block of samples: of one random stream per lane, of scrambled Sobol points, or of given scores.

pub(crate) mod given;
pub(crate) mod numbers;
pub(crate) mod points;
pub(crate) mod shapes;
pub(crate) mod stream;
mod truncated;

pub use shapes::Draw;
pub use stream::Stream;

/// Standard deviations between the centre and the boundary of a normal law.
pub const SIGMAS: f64 = 3.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clearance::Set;
    use crate::clearance::draw::points::Points;
    use crate::clearance::law::Law;
    use crate::clearance::samples::KINDS;
    use crate::math::lanes::block::{Block, LANES};
    use crate::math::lanes::simd::{Kernel, Width, dispatch, limit};

    struct Draws(Set, Law);

    impl Kernel for Draws {
        type Output = Vec<u64>;

        #[inline(always)]
        fn run(self) -> Vec<u64> {
            let (mut stream, mut points) = (Stream::new(3, 1), Points::new(3, 1, 640, 0, 1));
            let mut drawn = vec![Block::splat(0.0); self.0.size()];
            let mut bits = Vec::new();
            for _ in 0..10 {
                stream.draw(&self.0, self.1, &mut drawn);
                bits.extend(drawn.iter().flat_map(|block| block.0.map(f64::to_bits)));
                points.go_on();
                points.draw(&self.0, self.1, &mut drawn);
                bits.extend(drawn.iter().flat_map(|block| block.0.map(f64::to_bits)));
            }
            bits
        }
    }

    #[test]
    fn own_coordinates_are_drawn_as_offsets_are() {
        for set in KINDS {
            for law in [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss] {
                let (mut offsets, mut own) = (Stream::new(3, 1), Stream::new(3, 1));
                let n = set.size();
                let (mut drawn, mut unit) = (vec![Block::splat(0.0); n], vec![Block::splat(0.0); n]);
                for _ in 0..10 {
                    offsets.draw(&set, law, &mut drawn);
                    own.draw_own(&set, law, &mut unit);
                    for lane in 0..LANES {
                        let at: Vec<f64> = unit.iter().map(|block| block.0[lane]).collect();
                        for (k, d) in set.of_unit(&at)[..n].iter().enumerate() {
                            assert!((d - drawn[k].0[lane]).abs() < 1e-14 * set.half_width(k), "{set:?} {law:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn draws_are_the_same_on_every_width() {
        for set in KINDS {
            for law in [Law::Uniform, Law::Boundary, Law::Normal, Law::Gauss] {
                let [plain, avx2, avx512] = [Width::Plain, Width::Avx2, Width::Avx512].map(|width| {
                    limit(width);
                    dispatch(Draws(set, law))
                });
                assert!(plain == avx2 && plain == avx512, "{set:?} {law:?}");
            }
        }
    }
}
