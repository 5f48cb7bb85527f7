// The full theory of elasticity as a plain sweep: one pass over both displacements per step, OpenMP over rows, radii contiguous.
//
// The scheme is that of src/model/cells.rs with Courant number 1: a node's equations hold differences and sums, over the cells above
// and below it, of what its columns have. `u` moves along z, `v` along r. Rows 0 .. nz of `pitch` numbers each begin
// with LEFT columns for images about the axis; columns from nr on stay at rest. Level k+1 overwrites k-1. Rows are worked on
// by BLOCK columns, whose cells fit the first cache.
#include <stddef.h>

#define LEFT 8
#define BLOCK 128

enum place { SURFACE, INTERIOR, BACKING };

struct weights {
    // by column: q' and q of the cell at its inner side; shares of the cells at either side in u; in v
    const double *inner, *outer, *axial_in, *axial_out, *slip_in, *slip_out, *radial;
    // the operator that damps when it is applied twice, by column, of u and of v
    const double *u_out, *u_in, *v_out, *v_in;
    double shear, lame, hourglass;
};

// Puts a field at rest, every part by the thread that will sweep it: memory is given out near the core that touches it first.
void elastic_at_rest(double *field, int rows, ptrdiff_t pitch, int threads) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int j = 0; j < rows; j++)
        for (ptrdiff_t i = 0; i < pitch; i++)
            field[j * pitch + i] = 0;
}

// Over the cells below and above a row of nodes: difference (below - above) and sum of what a column has there, of
// `stretch`, the lower node less the upper one, and of `sink`, both together. At a boundary one row of cells is all, twice.
struct column {
    double stretch_difference, stretch_sum, sink_difference, sink_sum;
};

static inline __attribute__((always_inline)) struct column column(enum place place, const double *field, ptrdiff_t pitch) {
    const double here = field[0];
    if (place == SURFACE) {
        const double below = field[pitch], stretch = 2 * (below - here), sink = 2 * (here + below);
        return (struct column){stretch, stretch, sink, sink};
    }
    const double above = field[-pitch];
    if (place == BACKING) {
        const double stretch = 2 * (here - above), sink = 2 * (above + here);
        return (struct column){-stretch, stretch, -sink, sink};
    }
    const double below = field[pitch], ends = above + below, twice = 2 * here, across = below - above;
    return (struct column){ends - twice, across, across, ends + twice};
}

// Takes from `next` the operator applied twice to `moved`; what stands inside the axis has no weight. `once` is room.
static inline __attribute__((always_inline)) void damp(double *restrict next, const double *restrict moved, double *restrict once,
                                                       const double *restrict out, const double *restrict in, int nr) {
#pragma omp simd
    for (int i = 0; i < nr; i++)
        once[i] = out[i] * (moved[i + 2] - moved[i]) - in[i] * (moved[i] - moved[i - 2]);
#pragma omp simd
    for (int i = 0; i < nr; i++)
        next[i] -= out[i] * (once[i + 2] - once[i]) - in[i] * (once[i] - once[i - 2]);
}

// Advances the row of nodes `u`, `v` at level k to level k+1, which replaces k-1 in `next_u`, `next_v`.
static inline __attribute__((always_inline)) void row(enum place place, int damped, const double *restrict u,
                                                      const double *restrict v, double *restrict next_u,
                                                      double *restrict next_v, const struct weights *w, int nr,
                                                      ptrdiff_t pitch, double *restrict moved_u, double *restrict moved_v,
                                                      double *restrict once) {
    const double shear = w->shear, lame = w->lame, hourglass = w->hourglass;
    const double *restrict inner = w->inner, *restrict outer = w->outer;
    const double *restrict axial_in = w->axial_in, *restrict axial_out = w->axial_out;
    const double *restrict slip_in = w->slip_in, *restrict slip_out = w->slip_out, *restrict radial = w->radial;
    if (damped) {
#pragma omp simd
        for (int i = 0; i < nr; i++) {
            moved_u[i] = u[i] - next_u[i];
            moved_v[i] = v[i] - next_v[i];
        }
    }
    for (int first = 0; first < nr; first += BLOCK) {
        const int count = nr - first < BLOCK ? nr - first : BLOCK;
        double normal[BLOCK + 8] __attribute__((aligned(64))), lean[BLOCK + 8] __attribute__((aligned(64)));
        double slip[BLOCK + 8] __attribute__((aligned(64))), flow[BLOCK + 8] __attribute__((aligned(64)));
#pragma omp simd
        for (int n = 0; n <= count; n++) {
            const int i = first + n;
            const struct column ui = column(place, u + i - 1, pitch), uo = column(place, u + i, pitch);
            const struct column vi = column(place, v + i - 1, pitch), vo = column(place, v + i, pitch);
            const double dilation = outer[i] * vo.sink_difference - inner[i] * vi.sink_difference;
            const double shift = (uo.sink_sum - ui.sink_sum) + (vi.stretch_sum + vo.stretch_sum);
            normal[n] = (ui.stretch_difference + uo.stretch_difference) + lame * dilation;
            lean[n] = hourglass * (uo.stretch_difference - ui.stretch_difference) - shear * shift;
            slip[n] = (uo.sink_difference - ui.sink_difference) + (vi.stretch_difference + vo.stretch_difference);
            flow[n] = lame * (ui.stretch_sum + uo.stretch_sum) + outer[i] * (vo.sink_sum - hourglass * vo.stretch_difference) -
                      inner[i] * (vi.sink_sum - hourglass * vi.stretch_difference);
        }
#pragma omp simd
        for (int n = 0; n < count; n++) {
            const int i = first + n;
            const double a = axial_in[i] * (normal[n] + lean[n]) + axial_out[i] * (normal[n + 1] - lean[n + 1]);
            const double b = slip_in[i] * slip[n] + slip_out[i] * slip[n + 1] + radial[i] * (flow[n + 1] - flow[n]);
            if (place != BACKING)
                next_u[i] = 2 * u[i] - next_u[i] + a;
            next_v[i] = 2 * v[i] - next_v[i] + b;
        }
    }
    if (damped) {
        if (place != BACKING)
            damp(next_u, moved_u, once, w->u_out, w->u_in, nr);
        damp(next_v, moved_v, once, w->v_out, w->v_in, nr);
    }
    // images about the axis
    next_u[-1] = next_u[0];
    next_v[-1] = -next_v[0];
}

static inline __attribute__((always_inline)) void sweep(int damped, double *const *u, double *const *v, const struct weights *w,
                                                        int nr, int nz, ptrdiff_t pitch, int punch, double push, int steps,
                                                        int threads) {
#pragma omp parallel num_threads(threads)
    {
        double room[3 * pitch] __attribute__((aligned(64)));
        for (ptrdiff_t i = 0; i < 3 * pitch; i++)
            room[i] = 0;
        double *moved_u = room + LEFT, *moved_v = moved_u + pitch, *once = moved_v + pitch;
        for (int k = 0; k < steps; k++) {
            const double *now_u = u[k % 2] + LEFT, *now_v = v[k % 2] + LEFT;
            double *next_u = u[1 - k % 2] + LEFT, *next_v = v[1 - k % 2] + LEFT;
#pragma omp for schedule(static)
            for (int j = 0; j <= nz; j++) {
                const ptrdiff_t at = j * pitch;
                if (j == 0) {
                    row(SURFACE, damped, now_u, now_v, next_u, next_v, w, nr, pitch, moved_u, moved_v, once);
                    for (int i = 0; i < punch; i++)
                        next_u[i] = now_u[i] + push;
                    next_u[-1] = next_u[0];
                } else if (j == nz) {
                    row(BACKING, damped, now_u + at, now_v + at, next_u + at, next_v + at, w, nr, pitch, moved_u, moved_v, once);
                } else {
                    row(INTERIOR, damped, now_u + at, now_v + at, next_u + at, next_v + at, w, nr, pitch, moved_u, moved_v, once);
                }
            }
        }
    }
}

// * `u`, `v`: both levels of each
// * `weights`: the arrays of `struct weights` in their order; those of the damping are not used without it
// * `constants`: µ, λ, k
void elastic_sweeps(double *const *u, double *const *v, const double *const *weights, const double *constants, int nr, int nz,
                    ptrdiff_t pitch, int punch, double push, int steps, int threads, int damped) {
    const struct weights w = {weights[0], weights[1], weights[2], weights[3], weights[4], weights[5], weights[6],
                              weights[7], weights[8], weights[9], weights[10], constants[0], constants[1], constants[2]};
    if (damped)
        sweep(1, u, v, &w, nr, nz, pitch, punch, push, steps, threads);
    else
        sweep(0, u, v, &w, nr, nz, pitch, punch, push, steps, threads);
}
