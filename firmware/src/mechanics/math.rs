//! The elementary functions: the only source of `sin`, `cos`, `sqrt`, `cbrt`, `atan2` and `tanh` in the controller.
//!
//! Everything here is built from IEEE 754 `+ - * /`, comparisons and bit moves in `f32`, so host, emulator and silicon
//! give the same bits. Every function is total; NaN in gives NaN out.
//!
//! `u` = 2^-24 below is the unit roundoff of `f32`.

use core::f32::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// 1.5 * 2^23. Adding it rounds a number of magnitude below 2^22 to the nearest integer, which the FPU does in one
/// instruction, and leaves that integer, modulo a power of two, in the low bits of the sum.
const ROUND: f32 = 12_582_912.0;

/// Largest magnitude (rad) for which the three-part reductions below are exact: quotients stay below 2^13, so that a
/// quotient times a part of 11 bits is exact.
const REDUCTION_RANGE: f32 = 8192.0;

/// pi/2 in three parts (Cody and Waite 1980): 11 bits, 11 bits, the rest. They sum to pi/2 within 2e-15.
const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// 2 pi in three parts, like [`HALF_PI`].
const TWO_PI: [f32; 3] = [6.281_25, 1.935_005_2e-3, 3.019_916e-7];

/// Brings a finite angle (rad) into the range of the three-part reductions.
///
/// Beyond that range the period is the `f32` nearest to 2 pi: its relative error is 2.8e-8, so the phase error is
/// less than half the spacing of `f32` at the angle itself. No joint of any arm turns that far.
fn fold(angle: f32) -> f32 {
    if angle.abs() <= REDUCTION_RANGE {
        angle
    } else {
        without_turns(angle)
    }
}

/// Remainder of an angle beyond one turn, with its sign: exact, by long division of the mantissas. NaN for an infinity or NaN.
///
/// At most 126 steps. `libm::fmodf` divides 64-bit integers in software, which costs an image a kilobyte.
#[inline(never)]
fn without_turns(angle: f32) -> f32 {
    const FRACTION: u32 = f32::MANTISSA_DIGITS - 1;
    const HIDDEN: u32 = 1 << FRACTION;
    let mantissa = |x: f32| x.to_bits() & (HIDDEN - 1) | HIDDEN;
    let exponent = |x: f32| x.to_bits() << 1 >> (FRACTION + 1);
    if !angle.is_finite() {
        return f32::NAN;
    }
    let turn = mantissa(TAU);
    let mut rest = mantissa(angle);
    for step in exponent(TAU)..=exponent(angle) {
        if step != exponent(TAU) {
            rest <<= 1;
        }
        if rest >= turn {
            rest -= turn;
        }
    }
    // The unit of TAU's last place: 2^(2 - 23).
    (rest as f32 * (4.0 / HIDDEN as f32)).copysign(angle)
}

/// Subtracts `count` times a period given in three parts.
fn reduce(angle: f32, count: f32, [high, middle, low]: [f32; 3]) -> f32 {
    ((angle - count * high) - count * middle) - count * low
}

/// Sine and cosine of `x` (rad), in that order.
///
/// Error at most 2.5 u for |x| <= 8192 rad: 0.8 u from rounding the reduced angle, the rest from the last two sums of
/// either polynomial. A larger finite `x` adds a phase error of half its own spacing. NaN for an infinity or NaN.
///
/// Cody-Waite reduction to [-pi/4, pi/4], then minimax polynomials there (Remez exchange; truncation error 3.9e-9 of the
/// sine, relative, and 1e-10 of the cosine).
#[must_use]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let x = fold(x);
    let shifted = x * FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let r = reduce(x, shifted - ROUND, HALF_PI);

    let z = r * r;
    let sin = r + r * z * (SIN[0] + z * (SIN[1] + z * SIN[2]));
    let cos = (1.0 - 0.5 * z) + z * z * (COS[0] + z * (COS[1] + z * COS[2]));

    // Rotated by the quadrants: four products cost half of what choosing and changing signs does, and are as exact.
    let turn = TURNS.get((quadrant & 3) as usize);
    let [sin_turn, cos_turn] = turn.copied().unwrap_or_default();
    (
        sin * cos_turn + cos * sin_turn,
        cos * cos_turn - sin * sin_turn,
    )
}

/// Sine and cosine of 0 to 3 quadrants. To add -0 changes nothing, not even a zero.
const TURNS: [[f32; 2]; 4] = [[-0.0, 1.0], [1.0, -0.0], [-0.0, -1.0], [-1.0, -0.0]];

/// Coefficients of r^3, r^5, r^7 of the sine.
const SIN: [f32; 3] = [-0.166_666_55, 8.332_157_5e-3, -1.951_479_5e-4];

/// Coefficients of r^4, r^6, r^8 of the cosine.
const COS: [f32; 3] = [4.166_664_6e-2, -1.388_736_3e-3, 2.443_791_2e-5];

/// Square root, correctly rounded; NaN for a negative argument.
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// Cube root, error at most 2 u relative for |x| up to 2^126; a subnormal number counts as zero.
///
/// A third of the exponent gives five bits (the start of FreeBSD's `cbrtf`); each Halley step triples them. The error
/// is that of the last sum (1 u) plus a third of that of the cube (2 u). `libm` takes the same steps in `f64`, which is
/// emulated in software on an M4F.
#[must_use]
#[inline(never)]
pub fn cbrt(x: f32) -> f32 {
    let size = x.abs();
    if size < f32::MIN_POSITIVE {
        return x * 0.0;
    }
    let mut root = f32::from_bits(size.to_bits() / 3 + 709_958_130);
    for _ in 0..2 {
        let cube = root * root * root;
        root -= root * ((cube - size) / (2.0 * cube + size));
    }
    if x < 0.0 { -root } else { root }
}

/// The fourth root of a positive number, or up to 0.6 % more: a quarter of the exponent is within 6 % of it, and a Newton step from
/// either side leads above it.
#[must_use]
pub fn fourth_root_or_more(x: f32) -> f32 {
    let near = f32::from_bits(x.to_bits() / 4 + 799_014_912);
    0.75 * near + 0.25 * x / (near * near * near)
}

/// Length of the vector (x, y). Error at most 2 u relative while the squares stay within the range of `f32`, as they
/// do for anything measured in metres.
#[must_use]
pub fn hypot(x: f32, y: f32) -> f32 {
    sqrt(x * x + y * y)
}

/// Angle (rad) of the vector (x, y) in [-pi, pi], error at most 4 u relative. Zero for the zero vector.
#[must_use]
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// As [`atan2`] with less than two thirds of its instructions, for what is asked for in every sample; not a number for the zero vector. Error at most
/// 4 u relative.
///
/// The angle from the nearer axis, or from the diagonal where it is more than half way there, so that its tangent is at most tan(pi/8); and
/// for that the polynomial of Cephes (Moshier 1989).
#[inline(never)]
#[must_use]
pub fn angle(y: f32, x: f32) -> f32 {
    const TAN: [f32; 4] = [-0.333_329_5, 0.199_777_11, -0.138_776_86, 8.053_744_5e-2];
    let (wide, high) = (x.abs(), y.abs());
    let (long, short) = (greatest(wide, high), least(wide, high));
    let (from, t) = if short > 0.414_213_57 * long {
        (FRAC_PI_4, (short - long) / (short + long))
    } else {
        (0.0, short / long)
    };
    let z = t * t;
    let angle = from + (t + t * z * (TAN[0] + z * (TAN[1] + z * (TAN[2] + z * TAN[3]))));
    let angle = if high > wide {
        FRAC_PI_2 - angle
    } else {
        angle
    };
    let angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

/// The angle (rad) without whole turns, in (-pi, pi]. An angle already in that range is returned unchanged, to the bit.
///
/// Error at most 2 u pi for |angle| <= 8192 rad; beyond, see the phase error of the reduction. NaN for an infinity or NaN.
#[must_use]
pub fn wrap(angle: f32) -> f32 {
    let angle = fold(angle);
    let turns = (angle * (1.0 / TAU) + ROUND) - ROUND;
    let r = reduce(angle, turns, TWO_PI);
    // The quotient is rounded: close to half a turn it may be off by one.
    if r > PI {
        r - TAU
    } else if r <= -PI {
        r + TAU
    } else {
        r
    }
}

/// Hyperbolic tangent, error at most 4e-7 everywhere, odd, never outside [-1, 1]. NaN for an infinity or NaN.
///
/// It smooths Coulomb friction, of every axis in every sample: a cubic for each eighth of a unit costs no division, and the
/// same instructions at rest as in motion. The error is that of the cubics, 3.6e-7 with rounding, and 3.3e-7 = 1 - tanh 7.8125
/// beyond them.
#[inline(always)]
#[must_use]
pub fn tanh(x: f32) -> f32 {
    let shifted = x + ROUND_EIGHTHS;
    let eighths =
        (shifted.to_bits() as i32).saturating_sub(ROUND_EIGHTHS.to_bits() as i32 - MIDDLE);
    let r = x - (shifted - ROUND_EIGHTHS);
    let cubic = TANH.get(eighths.clamp(0, 2 * MIDDLE - 1) as usize);
    let [c0, c1, c2, c3] = cubic.copied().unwrap_or_default();
    c0 + r * (c1 + r * (c2 + r * c3))
}

/// Rounds to eighths as [`ROUND`] does to integers, and leaves them in the low bits.
const ROUND_EIGHTHS: f32 = ROUND / 8.0;

/// Index of zero in [`TANH`].
const MIDDLE: i32 = 64;

/// For each eighth of a unit the coefficients of r^0 to r^3 of tanh around it, |r| <= 1/16.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
static TANH: [[f32; 4]; 2 * MIDDLE as usize] = {
    const TANH_EIGHTH: f64 = 0.124_353_001_771_596_2;
    let mut table = [[-1.0, 0.0, 0.0, 0.0]; 2 * MIDDLE as usize];
    let mut t = 0.0;
    let mut k = 0;
    while k < MIDDLE as usize {
        let [c0, c1, c2, c3] = if k + 1 < MIDDLE as usize {
            cubic(t)
        } else {
            [1.0, 0.0, 0.0, 0.0]
        };
        table[MIDDLE as usize + k] = [c0, c1, c2, c3];
        table[MIDDLE as usize - k] = [-c0, c1, -c2, c3];
        // The tangent of a sum.
        t = (t + TANH_EIGHTH) / (1.0 + t * TANH_EIGHTH);
        k += 1;
    }
    table
};

/// The cubic of tanh around the place where it is `t`: Taylor's of degree 4, whose r^4 is replaced by R^2 r^2 - R^4 / 8, with R the greatest
/// r. That spreads the error evenly (Chebyshev).
const fn cubic(t: f64) -> [f32; 4] {
    const SQUARE: f64 = 1.0 / 256.0;
    let slope = 1.0 - t * t;
    let fourth = t * slope * (2.0 / 3.0 - t * t);
    [
        (t - fourth * (SQUARE * SQUARE / 8.0)) as f32,
        slope as f32,
        (fourth * SQUARE - t * slope) as f32,
        (slope * (t * t - 1.0 / 3.0)) as f32,
    ]
}

/// The smaller of two numbers; `a` if either is NaN. A compare and a move, unlike `f32::min`.
#[must_use]
pub fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The greater of two numbers, likewise; `b` if either is NaN.
#[must_use]
pub fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `x` limited to [`lower`, `upper`]; NaN stays NaN.
///
/// Unlike `f32::clamp` it does not panic for crossed limits (the lower one wins), and unlike `f32::min` and `max` it is
/// a compare and a move on an FPU without instructions for those.
#[must_use]
pub fn clamp(x: f32, lower: f32, upper: f32) -> f32 {
    let x = if x > upper { upper } else { x };
    if x < lower { lower } else { x }
}
