//! Shared parts of the benchmarks.
//!
//! # Speed of the solver
//!
//! A flat punch on a layer, nodes 1/N apart out to r = 4, 6N steps, two cores (AMD EPYC, Zen 4, 512-bit vectors): ratio of the time of
//! a plain C sweep with OpenMP to that of the others, medians of five alternating rounds (those of numba, pystencils and Devito
//! in rounds of their own, 2N steps at N = 1000).
//!
//! | | N = 200 | N = 500 | N = 1000 |
//! |---|---|---|---|
//! | plain C, gcc -O3 | 1.00 | 1.00 | 1.00 |
//! | numba | 1.50 | 1.27 | 0.92 |
//! | pystencils | 1.07 | 1.06 | 0.90 |
//! | Devito | 0.71 | 0.64 | 0.58 |
//! | percuss, the paper's mesh (the same work), its steps alone | 3.09 | 4.46 | 5.33 |
//! | the whole process | 1.60 | 3.22 | 5.43 |
//! | percuss, matched mesh, order 2, its steps alone | 2.88 | 3.33 | 4.80 |
//! | the whole process | 1.64 | 2.72 | 4.53 |
//! | percuss, matched mesh, order 4 with damping (the default), its steps alone | 1.11 | 1.19 | 1.72 |
//! | the whole process | 0.84 | 1.12 | 1.74 |
//!
//! The others sweep the field of order 2, record nothing, and are timed without start and compilation, on memory already in use. So are
//! the steps of percuss, with the contact solved in every one; the whole process includes its start, and records stress, drag,
//! velocity and probes of every step. On the matched mesh the layer is twice as thick and the run twice as long, which makes as many
//! nodes and steps; its light cone is wider. N = 1000 does not fit into the caches, N = 200 does. Order 4 takes 2.6 times the time of
//! order 2: its kernel has 24 operations and shuffles where that of order 2 has 10.
//!
//! The full theory, a glued punch on a layer of thickness 1 out to r = 4, 10⁹ node steps per second (both displacements; the nodes that a
//! sweep of the whole mesh has), beside a plain C sweep of the same scheme, medians of three alternating rounds:
//!
//! | | N = 500, t ≤ 4, one thread | two threads | N = 1000, t ≤ 2, one thread (once) | two threads |
//! |---|---|---|---|---|
//! | plain C without damping, with damping | 0.26, 0.17 | 0.52, 0.33 | 0.27, 0.16 | 0.51, 0.34 |
//! | percuss without, with | 0.36, 0.36 | 0.74, 0.70 | 0.58, 0.58 | 0.97, 0.96 |
//!
//! A node step has about 80 operations here, where that of order 2 has 10: neither program waits for memory.
//!
//! ```text
//! python3 -m venv env && env/bin/pip install numpy numba pystencils devito     (and gcc)
//! cargo build --release --workspace
//! python3 tools/bench/peers/compare.py --python env/bin/python                   the table
//! python3 tools/bench/peers/compare.py --theory full --python env/bin/python     the full theory
//! target/release/solver-bench cone                                             half-space with and without the light cone
//! target/release/solver-bench recording                                        the cost of recording
//! target/release/solver-bench growth                                           time over N³
//! ```
//!
//! Four techniques contribute: temporal blocking, with the interior up to 32 steps behind the surface (16 with order 4), in tiles that stay in the
//! caches; worker threads for the interior beside the thread of the surface, each with fixed rows; vectors along rows, with sums
//! shared between rows; and a light cone, outside of which nodes are not computed. Results do not depend on threads or instructions,
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
