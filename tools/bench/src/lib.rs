//! Shared parts of the benchmarks.
//!
//! # Speed of the solver
//!
//! A flat punch on a layer, nodes 1/N apart out to r = 4, 6N steps, two cores: ratio of the time of a plain C sweep with OpenMP to that of the others,
//! medians of five alternating rounds (those of numba, pystencils and Devito at N = 1000 of three, with 2N steps). The machine is an AMD EPYC (Zen 5, 1 MiB
//! of the second cache a core); for AVX2 both C and percuss are compiled as for a machine without AVX-512.
//!
//! | | AVX-512: N = 200 | N = 500 | N = 1000 | AVX2: N = 200 | N = 500 | N = 1000 |
//! |---|---|---|---|---|---|---|
//! | plain C, gcc -O3 | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 |
//! | numba | 0.98 | 1.06 | 0.98 | | | |
//! | pystencils | 0.97 | 0.85 | 0.85 | | | |
//! | Devito | 0.73 | 0.32 | 0.47 | | | |
//! | percuss, the paper's mesh (the same work), its steps alone | 3.26 | 5.21 | 10.3 | 3.11 | 5.02 | 7.84 |
//! | the whole process | 1.54 | 4.17 | 9.22 | 1.71 | 4.31 | 7.23 |
//! | percuss, matched mesh, order 2, its steps alone | 3.04 | 4.10 | 7.16 | 2.74 | 3.97 | 5.57 |
//! | the whole process | 1.58 | 3.46 | 6.73 | 1.64 | 3.48 | 5.24 |
//! | percuss, matched mesh, order 4 with damping (the default), its steps alone | 1.58 | 2.03 | 3.47 | 1.24 | 1.71 | 2.25 |
//! | the whole process | 0.98 | 1.78 | 3.34 | 0.92 | 1.51 | 2.18 |
//!
//! The others sweep the field of order 2, record nothing, and are timed without start and compilation, on memory already in use. So are
//! the steps of percuss, with the contact solved in every one; the whole process includes its start, and records stress, drag,
//! velocity and probes of every step. On the matched mesh the layer is twice as thick and the run twice as long, which makes as many
//! nodes and steps; its light cone is wider. N = 1000 does not fit into the caches, N = 200 does: what plain C loses there depends on the machine's memory,
//! and so do the ratios (5.3 on an EPYC of the generation before, where they are 10.3 here). Order 4 takes 1.9 to 2.5 times the time of
//! order 2: its kernel has 20 operations and shuffles where that of order 2 has 9.
//!
//! The full theory, a glued punch on a layer of thickness 1 out to r = 4, 10⁹ node steps per second (both displacements; the nodes that a
//! sweep of the whole mesh has), beside a plain C sweep of the same scheme, medians of three alternating rounds:
//!
//! | | N = 500, t ≤ 4, one thread | two threads | N = 1000, t ≤ 2, one thread (once) | two threads |
//! |---|---|---|---|---|
//! | plain C without damping, with damping | 0.43, 0.29 | 1.03, 0.66 | 0.35, 0.25 | 0.72, 0.52 |
//! | percuss without, with | 2.13, 1.38 | 4.19, 2.71 | 3.58, 2.34 | 6.79, 4.47 |
//! | plain C, AVX2 | 0.43, 0.26 | 0.94, 0.58 | | |
//! | percuss, AVX2 | 1.41, 0.96 | 2.73, 1.83 | | |
//!
//! A node step has about 60 operations here, where that of order 2 has 9: neither program waits for memory.
//!
//! ```text
//! python3 -m venv env && env/bin/pip install numpy numba pystencils devito     (and gcc)
//! cargo build --release --workspace
//! python3 tools/bench/peers/compare.py --python env/bin/python                   the table
//! python3 tools/bench/peers/compare.py --theory full --python env/bin/python     the full theory
//! RUSTFLAGS="--cfg percuss_without_avx512" cargo build --release --workspace --target-dir target/avx2
//! … compare.py --release target/avx2/release --march x86-64-v3                   as on a machine without AVX-512
//! python3 tools/bench/peers/accuracy.py --python env/bin/python                  time to accuracy (and ccx, Debian's calculix-ccx)
//! target/release/solver-bench cone                                             half-space with and without the light cone
//! target/release/solver-bench recording                                        the cost of recording
//! target/release/solver-bench growth                                           time over N³
//! ```
//!
//! Four techniques contribute: temporal blocking, with the interior up to 32 steps behind the surface (16 with order 4), in tiles that stay in the
//! caches; worker threads for the interior beside the thread of the surface, each with fixed rows; vectors along rows with fused multiplications, sums
//! shared between rows or kept in a ring; and a light cone, outside of which nodes are not computed. Results do not depend on threads or instructions,
//! bit for bit.
//!
//! Recording takes 6 to 8 % of the time of a run on the paper's mesh at N = 1000, with 200 frames of stress, energy and pictures for viewers; stress,
//! drag, velocity and probes of every step alone take 3 to 6 %. The run does not stop for frames: they are
//! sampled while the interior passes the level, and the kernel sums their energy. The cost is in the size: a frame has one node in
//! 11 along r and along z there, the default of `record.field_every`. With every eighth node, without pictures, it is 10 %; with
//! every node (1.8 GB) the run takes four times as long, most of it for compression and output.
//!
//! # Speed of the reader
//!
//! `target/release/reader-bench FILE [OTHER]` (after `cargo build --release --workspace`) compares `trace` and `diff` with
//! decompression of the chunks alone. Recordings of 2 GB, two cores, medians of alternating runs:
//!
//! | | Throughput relative to decompression | Largest memory |
//! |---|---|---|
//! | `trace` of one field of `/interface/stress` | 0.81 | |
//! | `diff`, equal recordings | 1.06 | |
//! | `diff`, every value different | 0.85 | 183 MB |

use std::{fmt::Display, process::ExitCode};

/// Ends a program, with its error on stderr.
pub fn exit(result: Result<(), impl Display>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The median; of an even number of values the upper one.
///
/// # Panics
///
/// If there is none, or one cannot be compared.
pub fn median<T: PartialOrd + Copy>(values: impl IntoIterator<Item = T>) -> T {
    let mut values: Vec<T> = values.into_iter().collect();
    values.sort_by(|a, b| a.partial_cmp(b).expect("times and ratios are numbers"));
    values[values.len() / 2]
}
