//! Sobol's sequence: points that fill the unit cube evenly, whichever few of its sides one looks along.
//!
//! Point n has in dimension d the bits ⊕_k g_k v_k, g = n ⊕ n/2 the Gray code of n (Antonov & Saleev 1979) and
//! v_k = m_k/2^k; m_k comes from a primitive polynomial of degree s over the field of two, m_k = m_(k−s) ⊕
//! 2^s m_(k−s) ⊕ Σ_j 2^j a_j m_(k−j). Polynomials and initial m are those of Joe & Kuo (SIAM Journal on Scientific
//! Computing 30, 2008), file `new-joe-kuo-6.21201`, the first 60 of its dimensions. (The crates that hold
//! them all bring a second generator of random numbers and linear algebra, or have not been kept.)

/// Dimensions of the table.
pub const MAX_DIMENSIONS: usize = DIRECTIONS.len() + 1;
const BITS: usize = 32;

/// One dimension of the sequence.
pub struct Sobol {
    directions: [u32; BITS],
}

impl Sobol {
    /// Dimension `dimension` < [`MAX_DIMENSIONS`], from 0: van der Corput's sequence is the first.
    pub fn new(dimension: usize) -> Self {
        let mut directions = [0; BITS];
        if dimension == 0 {
            for (k, v) in directions.iter_mut().enumerate() {
                *v = 1 << (BITS - 1 - k);
            }
            return Self { directions };
        }
        let (polynomial, initial) = DIRECTIONS[dimension - 1];
        let degree = initial.len();
        for k in 0..BITS {
            directions[k] = if k < degree {
                initial[k] << (BITS - 1 - k)
            } else {
                let mut v = directions[k - degree] ^ (directions[k - degree] >> degree);
                for j in 1..degree {
                    // Bit degree − j of the polynomial is a_j.
                    if polynomial >> (degree - j) & 1 == 1 {
                        v ^= directions[k - j];
                    }
                }
                v
            };
        }
        Self { directions }
    }

    /// The bits of point `n` after the point, 0 for the first point.
    pub fn bits(&self, n: u32) -> u32 {
        let gray = n ^ (n >> 1);
        let chosen = (0..BITS).filter(|k| gray >> k & 1 == 1);
        chosen.fold(0, |sum, k| sum ^ self.directions[k])
    }
}

/// Primitive polynomial, leading and last coefficient included, and initial m of dimensions 1, 2, …
#[rustfmt::skip]
const DIRECTIONS: &[(u32, &[u32])] = &[
    (0x3, &[1]),
    (0x7, &[1, 3]),
    (0xb, &[1, 3, 1]),
    (0xd, &[1, 1, 1]),
    (0x13, &[1, 1, 3, 3]),
    (0x19, &[1, 3, 5, 13]),
    (0x25, &[1, 1, 5, 5, 17]),
    (0x29, &[1, 1, 5, 5, 5]),
    (0x2f, &[1, 1, 7, 11, 19]),
    (0x37, &[1, 1, 5, 1, 1]),
    (0x3b, &[1, 1, 1, 3, 11]),
    (0x3d, &[1, 3, 5, 5, 31]),
    (0x43, &[1, 3, 3, 9, 7, 49]),
    (0x5b, &[1, 1, 1, 15, 21, 21]),
    (0x61, &[1, 3, 1, 13, 27, 49]),
    (0x67, &[1, 1, 1, 15, 7, 5]),
    (0x6d, &[1, 3, 1, 15, 13, 25]),
    (0x73, &[1, 1, 5, 5, 19, 61]),
    (0x83, &[1, 3, 7, 11, 23, 15, 103]),
    (0x89, &[1, 3, 7, 13, 13, 15, 69]),
    (0x8f, &[1, 1, 3, 13, 7, 35, 63]),
    (0x91, &[1, 3, 5, 9, 1, 25, 53]),
    (0x9d, &[1, 3, 1, 13, 9, 35, 107]),
    (0xa7, &[1, 3, 1, 5, 27, 61, 31]),
    (0xab, &[1, 1, 5, 11, 19, 41, 61]),
    (0xb9, &[1, 3, 5, 3, 3, 13, 69]),
    (0xbf, &[1, 1, 7, 13, 1, 19, 1]),
    (0xc1, &[1, 3, 7, 5, 13, 19, 59]),
    (0xcb, &[1, 1, 3, 9, 25, 29, 41]),
    (0xd3, &[1, 3, 5, 13, 23, 1, 55]),
    (0xd5, &[1, 3, 7, 3, 13, 59, 17]),
    (0xe5, &[1, 3, 1, 3, 5, 53, 69]),
    (0xef, &[1, 1, 5, 5, 23, 33, 13]),
    (0xf1, &[1, 1, 7, 7, 1, 61, 123]),
    (0xf7, &[1, 1, 7, 9, 13, 61, 49]),
    (0xfd, &[1, 3, 3, 5, 3, 55, 33]),
    (0x11d, &[1, 3, 1, 15, 31, 13, 49, 245]),
    (0x12b, &[1, 3, 5, 15, 31, 59, 63, 97]),
    (0x12d, &[1, 3, 1, 11, 11, 11, 77, 249]),
    (0x14d, &[1, 3, 1, 11, 27, 43, 71, 9]),
    (0x15f, &[1, 1, 7, 15, 21, 11, 81, 45]),
    (0x163, &[1, 3, 7, 3, 25, 31, 65, 79]),
    (0x165, &[1, 3, 1, 1, 19, 11, 3, 205]),
    (0x169, &[1, 1, 5, 9, 19, 21, 29, 157]),
    (0x171, &[1, 3, 7, 11, 1, 33, 89, 185]),
    (0x187, &[1, 3, 3, 3, 15, 9, 79, 71]),
    (0x18d, &[1, 3, 7, 11, 15, 39, 119, 27]),
    (0x1a9, &[1, 1, 3, 1, 11, 31, 97, 225]),
    (0x1c3, &[1, 1, 1, 3, 23, 43, 57, 177]),
    (0x1cf, &[1, 3, 7, 7, 17, 17, 37, 71]),
    (0x1e7, &[1, 3, 1, 5, 27, 63, 123, 213]),
    (0x1f5, &[1, 1, 3, 5, 11, 43, 53, 133]),
    (0x211, &[1, 3, 5, 5, 29, 17, 47, 173, 479]),
    (0x21b, &[1, 3, 3, 11, 3, 1, 109, 9, 69]),
    (0x221, &[1, 1, 1, 5, 17, 39, 23, 5, 343]),
    (0x22d, &[1, 3, 1, 5, 25, 15, 31, 103, 499]),
    (0x233, &[1, 1, 1, 11, 11, 17, 63, 105, 183]),
    (0x259, &[1, 1, 5, 11, 9, 29, 97, 231, 363]),
    (0x25f, &[1, 1, 5, 15, 19, 45, 41, 7, 383]),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn at(dimension: usize, n: u32) -> f64 {
        f64::from(Sobol::new(dimension).bits(n)) / 4_294_967_296.0
    }

    /// `scipy.stats.qmc.Sobol(60, scramble=False)`, scipy 1.17.1.
    #[test]
    fn as_scipy_has_it() {
        let expected = [
            (0, 5, 0.875),
            (1, 5, 0.875),
            (2, 7, 0.375),
            (3, 100, 0.7265625),
            (7, 513, 0.4091796875),
            (20, 1000, 0.5224609375),
            (39, 777, 0.3583984375),
            (59, 1023, 0.3525390625),
            (59, 2, 0.75),
        ];
        for (dimension, n, x) in expected {
            assert_eq!(at(dimension, n), x, "{dimension} {n}");
        }
    }

    /// Of 2^k points every interval of length 2^−k holds one, in every dimension.
    #[test]
    fn every_dimension_is_stratified() {
        for dimension in 0..MAX_DIMENSIONS {
            let mut seen = [false; 256];
            for n in 0..256 {
                seen[(at(dimension, n) * 256.0) as usize] = true;
            }
            assert!(seen.iter().all(|seen| *seen), "{dimension}");
        }
    }
}
