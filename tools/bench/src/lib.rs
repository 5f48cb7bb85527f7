//! Shared parts of the benchmarks.
//!
//! # Speed of the solver
//!
//! A flat punch on a layer, nodes 1/N apart out to r = 4, 6N steps, two cores: ratio of the time of a plain C sweep with OpenMP to that of the others,
//! medians of three alternating rounds (numba, pystencils and Devito: of five, with 3N steps). The machine is an AMD EPYC (Zen 4, 1 MiB
//! of the second cache a core); for AVX2 both C and percuss are compiled as for a machine without AVX-512.
//!
//! | | AVX-512: N = 200 | N = 500 | N = 1000 | AVX2: N = 200 | N = 500 | N = 1000 |
//! |---|---|---|---|---|---|---|
//! | plain C, gcc -O3 | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 | 1.00 |
//! | numba | | 1.29 | 0.95 | | | |
//! | pystencils | | 1.08 | 0.96 | | | |
//! | Devito | | 0.64 | 0.63 | | | |
//! | percuss, the paper's mesh (the same work), its steps alone | 3.08 | 3.44 | 5.84 | 2.62 | 2.96 | 5.39 |
//! | the whole process | 1.63 | 3.23 | 5.74 | 1.54 | 2.67 | 4.98 |
//! | percuss, matched mesh, order 2, its steps alone | 2.33 | 3.30 | 4.49 | 2.18 | 2.45 | 4.28 |
//! | the whole process | 1.36 | 2.63 | 4.47 | 1.34 | 2.09 | 4.04 |
//! | percuss, matched mesh, order 4 with damping (the default), its steps alone | 1.11 | 1.30 | 2.02 | 0.85 | 0.82 | 1.49 |
//! | the whole process | 0.86 | 1.08 | 2.02 | 0.68 | 0.78 | 1.36 |
//!
//! The others sweep the field of order 2, record nothing, and are timed without start and compilation, on memory already in use. So are
//! the steps of percuss, with the contact solved in every one; the whole process includes its start, and records stress, drag,
//! velocity and probes of every step. On the matched mesh the layer is twice as thick and the run twice as long, which makes as many
//! nodes and steps; its light cone is wider. N = 1000 does not fit into the caches, N = 200 does: what plain C loses there depends on the machine's memory,
//! and so do the ratios (10.3 on an EPYC of the generation after, where they are 5.8 here). Order 4 takes 2.1 to 3.0 times the time of
//! order 2: its kernel has 20 operations and shuffles where that of order 2 has 9.
//!
//! The full theory, a glued punch on a layer of thickness 1 out to r = 4, N = 500, t ≤ 4, 10⁹ node steps per second (both displacements; the nodes that a
//! sweep of the whole mesh has), beside a plain C sweep of the same scheme, medians of three alternating rounds:
//!
//! | | one thread | two threads |
//! |---|---|---|
//! | plain C without damping, with damping | 0.27, 0.17 | 0.55, 0.33 |
//! | percuss without, with | 0.86, 0.55 | 1.45, 1.06 |
//! | plain C, AVX2 | 0.25, 0.17 | 0.44, 0.28 |
//! | percuss, AVX2 | 0.58, 0.40 | 0.92, 0.69 |
//!
//! A node step has about 60 operations here, where that of order 2 has 9: neither program waits for memory.
//!
//! ```text
//! python3 -m venv env && env/bin/pip install numpy numba pystencils devito scikit-fem     (and gcc)
//! cargo build --release --workspace
//! python3 tools/bench/peers/compare.py --python env/bin/python                   the table
//! python3 tools/bench/peers/compare.py --theory full --python env/bin/python     the full theory
//! RUSTFLAGS="--cfg percuss_without_avx512" cargo build --release --workspace --target-dir target/avx2
//! … compare.py --release target/avx2/release --march x86-64-v3                   as on a machine without AVX-512
//! python3 tools/bench/peers/accuracy.py --python env/bin/python                  time to accuracy (and ccx, Debian's calculix-ccx)
//! … accuracy.py --task ball                                                      a ball on graded meshes (scikit-fem)
//! target/release/solver-bench recording                                        the cost of recording
//! target/release/solver-bench growth                                           time over N³
//! ```
//!
//! Four techniques contribute: temporal blocking, with the interior up to 32 steps behind the surface (16 with order 4), in tiles that stay in the
//! caches; worker threads for the interior beside the thread of the surface, each with fixed rows; vectors along rows with fused multiplications, sums
//! shared between rows or kept in a ring; and a light cone, outside of which nothing has moved and no node is computed. Results do not depend on threads or instructions,
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
