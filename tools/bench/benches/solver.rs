//! Kernels and encoder, with criterion: `cargo bench -p percuss-bench`.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use percuss::{
    grid::{Geometry, Grid, MeshKind, Spacing},
    message::percuss::InterfaceStress,
    model::{
        Coverage, Field, FrameFields, Model, Request,
        rakhmatulin::Rakhmatulin,
        scheme::{Corner, Order},
    },
    recording::Batch,
    surface::Surface,
};

/// A target with its whole section inside the light cone, and its surface.
type Target = (Box<dyn Model<()>>, Surface);

/// * `corner`: the corner term of the scheme
/// * `shown`: what frames show
fn target(n: usize, corner: Option<Corner>, shown: FrameFields) -> Target {
    let spacing = Spacing { dr: 1.0, dz: 1.0, layer_rows: Some(n) };
    let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, 4 * n, n);
    let mut surface = Surface::new(4 * n);
    surface.loaded = 4 * n;
    let mut target = (Rakhmatulin::new(grid, 0.5, corner).blocked(Coverage::Field, shown), surface);
    advance(&mut target, n, false);
    target
}

fn advance((model, surface): &mut Target, steps: usize, frame: bool) {
    for _ in 0..steps {
        model.predict(surface);
        surface.displacement.copy_from_slice(&surface.free);
        surface.displacement[..surface.loaded / 4].fill(1.0);
        model.advance(surface, (), Request { frame, lines: false });
        while model.next(false).is_some() {}
    }
}

fn kernels(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("steps");
    let schemes = [("order 2", None), ("order 4, damped", Corner::new(Order::Fourth, 1.0))];
    for (name, corner) in schemes {
        for n in [100, 200, 500] {
            let mut target = target(n, corner, FrameFields { fields: vec![], every: 1 });
            const STEPS: usize = 48;
            group.throughput(Throughput::Elements((STEPS * 4 * n * n) as u64));
            let name = format!("{name}, N = {n}");
            group.bench_function(name, |bench| bench.iter(|| advance(&mut target, STEPS, false)));
        }
    }
    group.finish();

    let mut group = criterion.benchmark_group("24 steps with a frame, N = 500");
    for (name, fields) in
        [("energy", vec![]), ("stress", vec![Field::Stress]), ("velocity", vec![Field::Velocity])]
    {
        let mut target = target(500, Corner::new(Order::Fourth, 1.0), FrameFields { fields, every: 1 });
        group.throughput(Throughput::Elements(24 * 4 * 500 * 500));
        group.bench_function(name, |bench| {
            bench.iter(|| {
                advance(&mut target, 1, true);
                advance(&mut target, 23, false);
            });
        });
    }
    group.finish();
}

fn encoder(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("encoder");
    let stress: Vec<f64> = (0..1000).map(|i| 1.0 / (1.0 + i as f64)).collect();
    let message = InterfaceStress { step: 1, time: 0.1, r0: 0.0, dr: 1e-3, stress };
    const MESSAGES: u64 = 100;
    group.throughput(Throughput::Bytes(MESSAGES * 8 * message.stress.len() as u64));
    group.bench_function("interface stress", |bench| {
        bench.iter_batched(
            Batch::default,
            |mut batch| {
                for k in 0..MESSAGES {
                    batch.put(0, k, black_box(&message));
                }
                batch
            },
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

criterion_group!(benches, kernels, encoder);
criterion_main!(benches);
