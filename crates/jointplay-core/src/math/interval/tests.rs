use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::math::curve::Curve;
use crate::math::interval::Interval;
use crate::math::real::Real;

const TINY: f64 = f64::MIN_POSITIVE;

/// Numbers of many sizes, some of them with few digits.
fn number(rng: &mut Xoshiro256PlusPlus) -> f64 {
    let digits = rng.random_range(-1.0..1.0_f64) * 2f64.powi(rng.random_range(-40..40));
    if rng.random_bool(0.2) { f64::from(digits as f32) } else { digits }
}

fn exact(x: f64) -> Interval {
    Interval::from_f64(x)
}

/// The exact result is the rounded one and a remainder, which is a number, too; for a quotient and a root its sign
/// is that of the remainder of the inverse operation.
#[test]
fn the_exact_result_is_inside_and_not_far_from_the_ends() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let inside = |found: Interval, rounded: f64, above: f64| {
        assert!(found.low < rounded || above >= 0.0 && found.low <= rounded, "{found:?} {rounded} {above}");
        assert!(found.high > rounded || above <= 0.0 && found.high >= rounded, "{found:?} {rounded} {above}");
        assert!(found.width() <= 9.0 * f64::EPSILON * rounded.abs() + 3.0 * TINY, "{found:?}");
    };
    for _ in 0..20_000 {
        let (a, b) = (number(&mut rng), number(&mut rng));
        let sum = a + b;
        let part = sum - a;
        inside(exact(a) + exact(b), sum, (a - (sum - part)) + (b - part));
        inside(exact(a) * exact(b), a * b, a.mul_add(b, -(a * b)));
        inside(exact(a).scaled(b), a * b, a.mul_add(b, -(a * b)));
        let quotient = a / b;
        inside(exact(a) / exact(b), quotient, (-quotient).mul_add(b, a) * b.signum());
        let root = a.abs().sqrt();
        inside(exact(a.abs()).root(), root, (-root).mul_add(root, a.abs()));
    }
}

#[test]
fn results_for_all_numbers_of_the_operands_are_inside() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    for _ in 0..20_000 {
        let mut drawn = || {
            let (a, b) = (rng.random_range(-2.0..2.0_f64), rng.random_range(-0.4..0.4_f64));
            let within = Interval::new(a.min(a + b), a.max(a + b));
            (within, (a + rng.random_range(0.0..1.0) * b).clamp(within.low, within.high))
        };
        let ((x, a), (y, b)) = (drawn(), drawn());
        let holds = |of: Interval, value: f64| assert!(of.contains(value), "{x:?} {y:?} {of:?} {value}");
        holds(x + y, a + b);
        holds(x - y, a - b);
        holds(x * y, a * b);
        holds(x / y, a / b);
        holds(x.square(), a * a);
        holds(x.square().root(), a.abs());
        let (sine, cosine) = x.sin_cos();
        holds(sine, a.sin());
        holds(cosine, a.cos());
        holds(Interval::small_angle(x, y), a.atan2(b));
        holds(Interval::double_arc(x.square()), f64::double_arc(a * a));
    }
}

/// Arguments with sine, cosine and arc tangent as a number and what is missing to 40 digits, by mpmath.
#[test]
fn functions_hold_their_values_to_forty_digits() {
    for line in TABLE.lines() {
        let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let [x, sine, sine_rest, cosine, cosine_rest, arc, arc_rest] = numbers[..] else { panic!("{line}") };
        let (s, c) = exact(x).sin_cos();
        let found = [
            (s, sine, sine_rest),
            (c, cosine, cosine_rest),
            (Interval::whole_angle(exact(x), Interval::ONE), arc, arc_rest),
        ];
        for (found, value, rest) in found {
            // The exact value is the number and what is missing from it.
            assert!(value - found.low >= -rest && found.high - value >= rest, "{x} {found:?} {value} {rest}");
            assert!(found.width() <= 18.0 * f64::EPSILON * value.abs(), "{x} {found:?}");
        }
    }
}

#[test]
fn an_extreme_between_the_ends_is_reached() {
    let quarter = std::f64::consts::FRAC_PI_2;
    for k in -4..=4 {
        let x = f64::from(k) * quarter;
        let (sine, cosine) = Interval::new(x - 0.2, x + 0.3).sin_cos();
        let peak = if k % 2 == 0 { cosine } else { sine };
        assert!((peak.size() - 1.0).abs() < f64::EPSILON && peak.width() < 0.05 + 1e-9, "{k} {peak:?}");
    }
}

const TABLE: &str = "\
-0.0021955888188896714 -0.0021955870548770982 9.753570092749056e-20 0.9999975896958374 3.722442878511737e-17 -0.0021955852908738787 -1.2198547294730576e-19
-0.0017686979637811181 -0.001768697041613837 -2.60782597526768e-20 0.9999984358541643 -4.10415195519659e-17 -0.0017686961194497291 -9.189564836506162e-20
-0.22261276339566674 -0.22077866443797922 -2.543531480895021e-18 0.9753239366123351 -1.9275989133879333e-17 -0.2190410778456754 1.2972143663752027e-17
53.0730045535369 0.3278912529054256 2.0802549395647772e-17 -0.9447154737105296 1.6827766206720776e-17 1.551956585316934 -7.730489410802913e-17
0.011379189311000395 0.0113789437384018 2.3209849041255213e-19 0.999935257723918 -1.5795362140918897e-17 0.011378698200777936 -6.91302361211995e-19
0.0033539399307476324 0.003353933642721388 -1.504865042788526e-19 0.9999943755487429 -4.603296292589764e-17 0.0033539273547729498 5.192759085440889e-20
-0.002838721709585775 -0.0028387178970227475 1.37177539706038e-19 0.9999959708322335 4.317694014369861e-18 -0.0028387140844935146 -1.7195137551079495e-19
-209.72071493093384 -0.6932528884906953 -3.2304527827321976e-17 -0.7206944099958785 -3.3573997055917746e-17 -1.566028116741308 -5.637240033720003e-17
45.50241236078013 0.9987159871023635 2.392768558655124e-17 0.050659422678822424 2.3488179668073665e-19 1.5488230071248836 -1.6256889349772115e-17
0.008697867505435386 0.008697757836034704 1.999679066612649e-19 0.9999621737889017 -6.014548730291254e-18 0.00869764817576001 -8.029440209306868e-19
-2.1977588492743982 -0.8098132919819785 2.0398334458050395e-17 -0.5866876785218101 -3.660682498284836e-17 -1.143784750731642 8.618430246580606e-17
62.260267616953314 -0.540966165925273 -2.03830824244212e-17 0.841044355146689 5.061441063466178e-17 1.5547360999466724 3.077739154646528e-17
0.0025187270536049227 0.0025187243904775856 -7.061724565392611e-20 0.9999968280086916 3.496848967497974e-17 0.0025187217273688325 7.16041928247672e-21
2.269537305286816 0.7656526648052865 3.212328749013257e-17 -0.6432542241420289 2.1663344867455704e-17 1.1557714355193953 6.970624641252126e-17
0.00013885563570445713 0.00013885563525824714 7.703686207267287e-21 0.9999999903595562 8.649239591455816e-18 0.00013885563481203718 -2.2340250673655476e-21
-0.0001815141040365395 -0.00018151410303980412 6.3119824539903275e-21 0.999999983526315 3.484385454867816e-17 -0.00018151410204306876 3.605229532720609e-21
135.5230324055104 -0.4210007262341626 -1.3139949947647213e-17 -0.9070603003716499 1.7329246520295192e-17 1.5634176411659615 -5.732566739274125e-17
0.006032063166863786 0.006032026586703698 3.0147578776396993e-19 0.999981807162139 -4.9600568300541696e-17 0.00603199000800767 -2.376944919593711e-19
2.2223699672339117 0.7951304674523457 -1.6952104132043025e-17 -0.6064384055524635 2.3527499830249373e-17 1.1479672794235278 -9.380160239817205e-17
93.69542967540235 -0.5246891588041825 3.0390468892775875e-17 0.8512938896957732 2.4340388209214402e-18 1.5601238528445391 -5.147246550571251e-17
1.5707963267948966 1.0 -1.874699728327322e-33 6.123233995736766e-17 -1.4973849048591698e-33 1.0038848218538872 3.054567039683288e-17
3.141592653589793 1.2246467991473532e-16 -2.99476980971834e-33 -1.0 7.498798913309288e-33 1.2626272556789118 -9.18587307550028e-17
4.71238898038469 -1.0 1.6872297554945898e-32 -1.8369701987210297e-16 -7.833796929500799e-33 1.3616916829711636 -7.713514450410577e-17
6.283185307179586 -2.4492935982947064e-16 5.9895396194366814e-33 1.0 -2.999519565323715e-32 1.4129651365067377 3.5231970545668096e-17";

#[test]
fn a_range_of_a_curve_holds_what_its_points_give() {
    let curve: Curve = serde_json::from_value(serde_json::json!({
        "knots": [-1.0, 0.0, 1.0, 3.0],
        "pieces": [[0.5, 1.0, -0.3], [1.2, 0.4, -0.3, 0.7], [2.0, 1.9, 1.8, -0.4]],
    }))
    .unwrap();
    for (low, high) in [(-3.0, 4.0), (-1.5, -0.5), (0.2, 0.3), (0.9, 1.1), (2.5, 6.0), (1.0, 1.0)] {
        for order in 0..3 {
            let held = Interval::new(low, high).of_curve(&curve, order);
            for k in 0..=50 {
                let x = low + (high - low) * f64::from(k) / 50.0;
                let (value, slack) = (curve.at(x, order), 1e-12);
                // The second derivative jumps where the straight parts begin, at the ends of the knots.
                assert!(held.low - slack <= value && value <= held.high + slack, "{x} {order} {held:?}");
            }
        }
    }
    assert!(Interval::new(0.2, 0.21).of_curve(&curve, 0).width() < 0.02);
}
