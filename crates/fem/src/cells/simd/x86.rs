//! Lanes in the vector registers of x86-64.
//!
//! Values of these types are made only by kernels that `CellOperator::dispatch` has chosen after it found the
//! instructions on the processor: what every `SAFETY` comment here refers to as *detected*. Their twin is
//! [`super::Portable`]; the test `vector_and_portable_kernels_agree` compares the kernels built on all three.

use std::arch::x86_64::*;

use super::{Lanes, Nodes};

macro_rules! lanes {
    ($(#[$doc:meta])* $name:ident([$scalar:ty; $count:literal] in $register:ty):
     $splat:ident $load:ident $store:ident $add:ident $sub:ident $mul:ident $fma:ident $gather:ident $scatter:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub struct $name($register);

        impl Lanes for $name {
            type Scalar = $scalar;
            const COUNT: usize = $count;

            #[inline(always)]
            fn splat(x: $scalar) -> Self {
                // SAFETY: the instructions were detected.
                Self(unsafe { $splat(x) })
            }

            #[inline(always)]
            fn load(from: &[$scalar]) -> Self {
                let from: &[$scalar; $count] = from[..$count].try_into().expect("the slice has this length");
                // SAFETY: the instructions were detected; the array has as many numbers as are read.
                Self(unsafe { $load(from.as_ptr()) })
            }

            #[inline(always)]
            fn store(self, to: &mut [$scalar]) {
                let to: &mut [$scalar; $count] =
                    (&mut to[..$count]).try_into().expect("the slice has this length");
                // SAFETY: the instructions were detected; the array has as many numbers as are written.
                unsafe { $store(to.as_mut_ptr(), self.0) }
            }

            #[inline(always)]
            fn add(self, other: Self) -> Self {
                // SAFETY: the instructions were detected.
                Self(unsafe { $add(self.0, other.0) })
            }

            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                // SAFETY: the instructions were detected.
                Self(unsafe { $sub(self.0, other.0) })
            }

            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                // SAFETY: the instructions were detected.
                Self(unsafe { $mul(self.0, other.0) })
            }

            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                // SAFETY: the instructions were detected.
                Self(unsafe { $fma(self.0, factor.0, term.0) })
            }

            #[inline(always)]
            fn gather(nodes: &Nodes<$scalar>, index: &[u16], stride: usize) -> [Self; 4] {
                // SAFETY: the instructions were detected.
                let [a, b, c, d] = unsafe { $gather(nodes, index, stride) };
                [Self(a), Self(b), Self(c), Self(d)]
            }

            #[inline(always)]
            fn scatter(values: [Self; 4], nodes: &mut Nodes<$scalar>, index: &[u16], stride: usize) {
                let [a, b, c, d] = values;
                // SAFETY: the instructions were detected.
                unsafe { $scatter([a.0, b.0, c.0, d.0], nodes, index, stride) }
            }
        }
    };
}

lanes! {
    /// Eight numbers in a register of 512 bits.
    F64x8([f64; 8] in __m512d):
    _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_fmadd_pd
    gather_f64x8 scatter_f64x8
}

lanes! {
    /// Four numbers in a register of 256 bits.
    F64x4([f64; 4] in __m256d):
    _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_fmadd_pd
    gather_f64x4 scatter_f64x4
}

lanes! {
    /// Sixteen numbers in a register of 512 bits.
    F32x16([f32; 16] in __m512):
    _mm512_set1_ps _mm512_loadu_ps _mm512_storeu_ps _mm512_add_ps _mm512_sub_ps _mm512_mul_ps _mm512_fmadd_ps
    gather_f32x16 scatter_f32x16
}

lanes! {
    /// Eight numbers in a register of 256 bits.
    F32x8([f32; 8] in __m256):
    _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_fmadd_ps
    gather_f32x8 scatter_f32x8
}

/// One node of each lane, by its index.
macro_rules! node {
    ($nodes:ident, $index:ident, $stride:ident, $lane:expr, $load:ident) => {
        $load($nodes[$index[$lane * $stride] as usize].as_ptr())
    };
}

/// Adds a row of four numbers to a node.
macro_rules! add_to_node {
    ($nodes:ident, $index:ident, $stride:ident, $lane:expr, $row:expr, $load:ident, $add:ident, $store:ident) => {
        let node = $nodes[$index[$lane * $stride] as usize].as_mut_ptr();
        $store(node, $add($load(node), $row));
    };
}

#[inline(always)]
unsafe fn gather_f64x8(nodes: &Nodes<f64>, index: &[u16], stride: usize) -> [__m512d; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        // Rows of cells `k` and `k + 4`.
        macro_rules! row {
            ($k:literal) => {
                _mm512_insertf64x4::<1>(
                    _mm512_castpd256_pd512(node!(nodes, index, stride, $k, _mm256_loadu_pd)),
                    node!(nodes, index, stride, $k + 4, _mm256_loadu_pd),
                )
            };
        }
        let (a, b, c, d) = (row!(0), row!(1), row!(2), row!(3));
        let (ac, bd) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
        let (ac2, bd2) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
        let low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
        let high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
        [
            _mm512_permutex2var_pd(ac, low, ac2),
            _mm512_permutex2var_pd(bd, low, bd2),
            _mm512_permutex2var_pd(ac, high, ac2),
            _mm512_permutex2var_pd(bd, high, bd2),
        ]
    }
}

#[inline(always)]
unsafe fn scatter_f64x8(v: [__m512d; 4], nodes: &mut Nodes<f64>, index: &[u16], stride: usize) {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        let (a, b) = (_mm512_unpacklo_pd(v[0], v[1]), _mm512_unpackhi_pd(v[0], v[1]));
        let (c, d) = (_mm512_unpacklo_pd(v[2], v[3]), _mm512_unpackhi_pd(v[2], v[3]));
        let low = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
        let high = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
        macro_rules! add {
            ($k:literal, $row:expr) => {{
                add_to_node!(
                    nodes,
                    index,
                    stride,
                    $k,
                    $row,
                    _mm256_loadu_pd,
                    _mm256_add_pd,
                    _mm256_storeu_pd
                );
            }};
        }
        let (r02, r13) = (_mm512_permutex2var_pd(a, low, c), _mm512_permutex2var_pd(b, low, d));
        add!(0, _mm512_castpd512_pd256(r02));
        add!(1, _mm512_castpd512_pd256(r13));
        add!(2, _mm512_extractf64x4_pd::<1>(r02));
        add!(3, _mm512_extractf64x4_pd::<1>(r13));
        let (r46, r57) = (_mm512_permutex2var_pd(a, high, c), _mm512_permutex2var_pd(b, high, d));
        add!(4, _mm512_castpd512_pd256(r46));
        add!(5, _mm512_castpd512_pd256(r57));
        add!(6, _mm512_extractf64x4_pd::<1>(r46));
        add!(7, _mm512_extractf64x4_pd::<1>(r57));
    }
}

/// The transpose of a 4 x 4 matrix.
#[inline(always)]
unsafe fn transposed_f64([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        let (ab, ab2) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (cd, cd2) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        [
            _mm256_permute2f128_pd::<0x20>(ab, cd),
            _mm256_permute2f128_pd::<0x20>(ab2, cd2),
            _mm256_permute2f128_pd::<0x31>(ab, cd),
            _mm256_permute2f128_pd::<0x31>(ab2, cd2),
        ]
    }
}

#[inline(always)]
unsafe fn gather_f64x4(nodes: &Nodes<f64>, index: &[u16], stride: usize) -> [__m256d; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        macro_rules! row {
            ($k:literal) => {
                node!(nodes, index, stride, $k, _mm256_loadu_pd)
            };
        }
        transposed_f64([row!(0), row!(1), row!(2), row!(3)])
    }
}

#[inline(always)]
unsafe fn scatter_f64x4(v: [__m256d; 4], nodes: &mut Nodes<f64>, index: &[u16], stride: usize) {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        for (k, row) in transposed_f64(v).into_iter().enumerate() {
            {
                add_to_node!(nodes, index, stride, k, row, _mm256_loadu_pd, _mm256_add_pd, _mm256_storeu_pd);
            }
        }
    }
}

/// Transposes the 4 x 4 matrices in the quarters of four registers.
macro_rules! transpose_quarters {
    ($rows:expr, $low:ident, $high:ident, $low2:ident, $high2:ident, $to_pd:ident, $to_ps:ident) => {{
        let [a, b, c, d] = $rows;
        let (ab, ab2) = ($to_pd($low(a, b)), $to_pd($high(a, b)));
        let (cd, cd2) = ($to_pd($low(c, d)), $to_pd($high(c, d)));
        [$to_ps($low2(ab, cd)), $to_ps($high2(ab, cd)), $to_ps($low2(ab2, cd2)), $to_ps($high2(ab2, cd2))]
    }};
}

#[inline(always)]
unsafe fn transposed_f32x16(rows: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        transpose_quarters!(
            rows,
            _mm512_unpacklo_ps,
            _mm512_unpackhi_ps,
            _mm512_unpacklo_pd,
            _mm512_unpackhi_pd,
            _mm512_castps_pd,
            _mm512_castpd_ps
        )
    }
}

#[inline(always)]
unsafe fn transposed_f32x8(rows: [__m256; 4]) -> [__m256; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        transpose_quarters!(
            rows,
            _mm256_unpacklo_ps,
            _mm256_unpackhi_ps,
            _mm256_unpacklo_pd,
            _mm256_unpackhi_pd,
            _mm256_castps_pd,
            _mm256_castpd_ps
        )
    }
}

#[inline(always)]
unsafe fn gather_f32x16(nodes: &Nodes<f32>, index: &[u16], stride: usize) -> [__m512; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        // The cells `k`, `k + 4`, `k + 8` and `k + 12`: their transposes have the cells in order.
        macro_rules! row {
            ($k:literal) => {{
                let first = _mm512_castps128_ps512(node!(nodes, index, stride, $k, _mm_loadu_ps));
                let row = _mm512_insertf32x4::<1>(first, node!(nodes, index, stride, $k + 4, _mm_loadu_ps));
                let row = _mm512_insertf32x4::<2>(row, node!(nodes, index, stride, $k + 8, _mm_loadu_ps));
                _mm512_insertf32x4::<3>(row, node!(nodes, index, stride, $k + 12, _mm_loadu_ps))
            }};
        }
        transposed_f32x16([row!(0), row!(1), row!(2), row!(3)])
    }
}

#[inline(always)]
unsafe fn scatter_f32x16(v: [__m512; 4], nodes: &mut Nodes<f32>, index: &[u16], stride: usize) {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        let rows = transposed_f32x16(v);
        macro_rules! quarter {
            ($q:literal) => {
                for k in 0..4 {
                    {
                        let row = _mm512_extractf32x4_ps::<$q>(rows[k]);
                        add_to_node!(
                            nodes,
                            index,
                            stride,
                            4 * $q + k,
                            row,
                            _mm_loadu_ps,
                            _mm_add_ps,
                            _mm_storeu_ps
                        );
                    }
                }
            };
        }
        quarter!(0);
        quarter!(1);
        quarter!(2);
        quarter!(3);
    }
}

#[inline(always)]
unsafe fn gather_f32x8(nodes: &Nodes<f32>, index: &[u16], stride: usize) -> [__m256; 4] {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        macro_rules! row {
            ($k:literal) => {
                _mm256_insertf128_ps::<1>(
                    _mm256_castps128_ps256(node!(nodes, index, stride, $k, _mm_loadu_ps)),
                    node!(nodes, index, stride, $k + 4, _mm_loadu_ps),
                )
            };
        }
        transposed_f32x8([row!(0), row!(1), row!(2), row!(3)])
    }
}

#[inline(always)]
unsafe fn scatter_f32x8(v: [__m256; 4], nodes: &mut Nodes<f32>, index: &[u16], stride: usize) {
    // SAFETY: the caller has detected the instructions; a node has the four numbers that are read or written.
    unsafe {
        let rows = transposed_f32x8(v);
        macro_rules! half {
            ($q:literal) => {
                for k in 0..4 {
                    {
                        let row = _mm256_extractf128_ps::<$q>(rows[k]);
                        add_to_node!(
                            nodes,
                            index,
                            stride,
                            4 * $q + k,
                            row,
                            _mm_loadu_ps,
                            _mm_add_ps,
                            _mm_storeu_ps
                        );
                    }
                }
            };
        }
        half!(0);
        half!(1);
    }
}
