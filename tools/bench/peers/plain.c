// The reference case as a plain sweep: one pass over the field per step, OpenMP over radii, depth contiguous.
//
//   u^{k+1} = u_{j-1} + u_{j+1} - u^{k-1} + out*S_{i+1} - (out + inw)*S_i + inw*S_{i-1},   S = u_{j-1} + 2u_j + u_{j+1}
//
// Columns 0 .. nr of `rows` = nz + 1 numbers, `pitch` apart; column nr and row nz stay at rest.
#include <stddef.h>

// Puts a field at rest, every part by the thread that will sweep it: memory is given out near the core that touches it first.
void at_rest(double *field, long numbers, int threads) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (long i = 0; i < numbers; i++)
        field[i] = 0;
}

void sweeps(double *even, double *odd, const double *out, const double *inw, int nr, int nz, ptrdiff_t pitch,
            int punch, double push, int steps, int threads) {
#pragma omp parallel num_threads(threads)
    for (int k = 0; k < steps; k++) {
        const double *now = k % 2 ? odd : even;
        double *next = k % 2 ? even : odd;
#pragma omp for schedule(static)
        for (int i = 0; i < nr; i++) {
            const double *restrict here = now + i * pitch;
            const double *restrict outer = here + pitch;
            const double *restrict inner = i > 0 ? here - pitch : outer;
            double *restrict column = next + i * pitch;
            const double a = out[i], b = inw[i], c = -(a + b);
            if (i <= punch)
                column[0] = here[0] + push;
            else
                column[0] = 2 * here[1] - column[0] +
                            2 * (a * (outer[0] + outer[1]) + c * (here[0] + here[1]) + b * (inner[0] + inner[1]));
#pragma omp simd
            for (int j = 1; j < nz; j++)
                column[j] = here[j - 1] + here[j + 1] - column[j] +
                            (a * (outer[j - 1] + 2 * outer[j] + outer[j + 1]) + c * (here[j - 1] + 2 * here[j] + here[j + 1]) +
                             b * (inner[j - 1] + 2 * inner[j] + inner[j + 1]));
        }
    }
}
